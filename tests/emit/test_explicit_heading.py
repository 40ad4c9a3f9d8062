"""What the explicit form says of itself is true of the rows below it.

What is solved is compared with formulas of textbooks, and with the saddle point system.
"""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli import load, loads
from lagrange_cli.mechanics.dynamics.accelerations import explicit_form
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report

BOB = "particles: {bob: {mass: 2, position: [x, y, z]}}\n"
CHAIN = """
sizes: {n: %d}
plane: xz
points: {"p[0]": [0, 0, 0]}
particles: {"p[i=1..n]": {mass: 1, position: ["x[i]", "y[i]", "z[i]"]}}
coordinates: ["th[i=1..n]"%s]
definitions:
  x[0]: 0
  z[0]: 0
  x[i=1..n]: x[i-1] + sin(th[i])
  z[i=1..n]: z[i-1] - cos(th[i])
%s
"""
FOUR_BAR = """
plane: xz
particles: {p: {mass: 1, position: [x, y, z]}, q: {mass: 1, position: [u, y2, w]}}
coordinates: [al, be, ga]
definitions: {x: cos(al), z: sin(al), u: 2 + 2*cos(ga), w: 2*sin(ga)}
constraints: {loop: [cos(al) + 3*cos(be) = u, sin(al) + 3*sin(be) = w]}
near: {be: 0.16, ga: 0.72}
initial: {al: 1}
"""
#: Scene → what is said of it, in text after "Equations of motion, ".
SCENES = {
    "solved": (
        BOB + "coordinates: [x, y]\ndefinitions: {z: x^2}\n",
        "Solved for the accelerations",
    ),
    "multipliers": (
        BOB + "plane: xz\nconstraints: {rod: x^2 + z^2 = 1}\n",
        "Solved for the accelerations and multipliers",
    ),
    "contacts": (
        BOB + "constraints: {floor: z >= 0}\n",
        "Solved for the accelerations; contacts determine their multipliers",
    ),
    "closures and contacts": (
        BOB + "plane: xz\nconstraints: {rod: x^2 + z^2 = 1, floor: z >= -1/2}\n",
        "Solved for the accelerations and multipliers; contacts determine their multipliers",
    ),
    "coupled": (
        CHAIN % (3, "", ""),
        "Not solved for the accelerations, as a linear system",
    ),
    "partly": (
        CHAIN % (3, ", u", "kinetic: {u: dot(u)^2}"),
        "Solved for the accelerations where few are coupled, the others as a linear system",
    ),
    "closed": (
        FOUR_BAR,
        "Not solved for the accelerations, as a linear system with the closure equations,"
        " differentiated",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_what_is_solved_is_said(name: str) -> None:
    scene, line = SCENES[name]
    system = loads("name: s\n" + scene).derive()
    text = " ".join(derivation_text(system.equations, form="explicit").split())
    assert f"Equations of motion, {line[0].lower()}{line[1:]} " in text
    (document,) = system.emit("latex", form="explicit").values()
    assert f"\n{line}:\n" in document
    explicit = explicit_form(system.equations)
    assert ("linear system" in line) == (None in explicit.accelerations)
    assert ("differentiated" in line) == (None in explicit.multipliers)
    unknown = {c.multiplier for c in system.equations.system.pushing}
    values = (*explicit.accelerations, *explicit.multipliers)
    held = {s for value in values if value is not None for s in value.free_symbols}
    assert held & unknown == {c.closure.multiplier for c in system.equations.system.contacts}


#: Scene → left side of the explicit form → formula of a textbook.
FORMULAS = {
    "rolling/wheel_down_incline": {
        "ddot(s)": "g*sin(alpha)/(1 + I/(m*R**2))",
        "ddot(psi)": "g*sin(alpha)/(1 + I/(m*R**2))/R",
        "lambda_rolling": "-I*g*sin(alpha)/(1 + I/(m*R**2))/R**2",
    },
    "constraints/pendulum_in_cartesian_coordinates": {
        "ddot(x)": "2*x*L",
        "ddot(z)": "2*z*L - g",
        "lambda_rod": "m*L",
    },
}


@pytest.mark.parametrize("name", FORMULAS)
def test_multipliers_are_eliminated(name: str) -> None:
    equations = load(f"systems/{name}.yaml").derive().equations
    names = {c.q.name: c.q for c in equations.system.coordinates}
    names |= {p.name: p.symbol for p in equations.system.parameters}
    if "x" in names:
        x, z = equations.system.coordinates
        names["L"] = (names["g"] * z.q - x.v**2 - z.v**2) / (2 * (x.q**2 + z.q**2))
    explicit = explicit_form(equations)
    lefts = [f"ddot({c.name})" for c in equations.system.coordinates]
    lefts += [c.multiplier.name for c in equations.system.closures]
    values = dict(zip(lefts, (*explicit.accelerations, *explicit.multipliers), strict=True))
    for left, formula in FORMULAS[name].items():
        assert sp.simplify(values[left] - sp.sympify(formula, names)) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["rolling/chaplygin_sleigh", "rolling/rolling_disk", "constraints/coupled_gears"]
)
def test_solutions_solve_the_saddle_point_system(name: str) -> None:
    equations = load(f"systems/{name}.yaml").derive().equations
    explicit = explicit_form(equations)
    assert None not in (*explicit.accelerations, *explicit.multipliers)
    gradient = sp.Matrix([list(c.gradient) for c in equations.system.closures])
    mass, forcing = sp.Matrix(equations.system.mass_matrix), sp.Matrix(equations.system.forcing)
    a, multipliers = sp.Matrix(explicit.accelerations), sp.Matrix(explicit.multipliers)
    motion = mass * a - forcing - gradient.T * multipliers
    rates = gradient * a + sp.Matrix([c.bias for c in equations.system.closures])
    assert sp.simplify(sp.Matrix([*motion, *rates])).is_zero_matrix


@pytest.mark.slow
def test_json_has_a_row_for_each_multiplier() -> None:
    rolling = load("systems/rolling/wheel_down_incline.yaml").derive().equations
    report = derivation_report(rolling, "explicit")
    assert report["equations"][0]["residual"] == "ddot(s) - g*sin(alpha)/(1 + I/(m*R^2))"
    assert report["multiplier_equations"] == [
        {
            "multiplier": "lambda_rolling",
            "residual": "lambda_rolling + m*g*I*sin(alpha)/(m*R^2 + I)",
        }
    ]
    bars = loads("name: s\n" + FOUR_BAR).derive().equations
    rows = derivation_report(bars, "explicit")["multiplier_equations"]
    assert [row["multiplier"] for row in rows] == ["lambda_loop_1", "lambda_loop_2"]
    assert "ddot(be)" in rows[0]["residual"]
    assert "multiplier_equations" not in derivation_report(bars)
