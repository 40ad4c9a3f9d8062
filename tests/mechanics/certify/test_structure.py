"""Cyclic coordinates, conserved quantities and structure facts."""

from __future__ import annotations

from pathlib import Path

import mpmath
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_file
from tests.mechanics.mechanics_support import (
    DOUBLE_PENDULUM,
    POLAR,
    derived,
    expression,
    number,
    random_point,
    refusal,
)

SYSTEMS = Path(__file__).parents[3] / "systems"

BEAD = "particles: {bead: {mass: m, position: [x, y, z]}}\n"

HOOP = (
    "parameters: {m: 1, R: 1, w: 2, g: 9.81}\n" + BEAD + "coordinates: [q]\n"
    "definitions: {x: R*sin(q)*cos(w*t), y: R*sin(q)*sin(w*t), z: -R*cos(q)}\n"
    "potentials: {weight: {gravity: g}}\n"
)

MAGNETIC = (
    "parameters: {m: 1, B: 2}\nplane: xy\n" + BEAD + "coordinates: [r, theta]\n"
    "definitions: {x: r*cos(theta), y: r*sin(theta)}\n"
    "potentials: {field: B*(y*dot(x) - x*dot(y))/2}\n"
)

FREE = "parameters: {m: 1}\nplane: xy\n" + BEAD + "coordinates: [x, y]\n"

#: Scene → cyclic coordinates and names of conserved quantities.
CASES = {
    "central force": (POLAR + "potentials: {s: k*r^2}\n", ["theta"], ["p_theta", "energy"]),
    "double pendulum": (DOUBLE_PENDULUM, [], ["energy"]),
    "forced cyclic coordinate": (
        POLAR + "potentials: {s: k*r^2}\nforces: {turn: {on: theta, force: 1}}\n",
        ["theta"],
        [],
    ),
    "force on another coordinate": (
        POLAR + "forces: {pull: {on: r, force: -k*r^3}}\n",
        ["theta"],
        ["p_theta"],
    ),
    "central force written as a force": (
        POLAR + "forces: {pull: {on: puck, force: [-k*x, -k*y, 0]}}\n",
        ["theta"],
        ["p_theta"],
    ),
    "central drag": (
        POLAR + "dissipation: {d: dot(r)^2}\n",
        ["theta"],
        ["p_theta"],
    ),
    "drag": (POLAR + "dissipation: {d: (dot(x)^2 + dot(y)^2)/2}\n", ["theta"], []),
    "force that does no work": (
        FREE + "forces: {lorentz: {on: bead, force: [dot(y), -dot(x), 0]}}\n",
        ["x", "y"],
        ["energy"],
    ),
    "force that does no work, in polar coordinates": (
        POLAR + "forces: {lorentz: {on: puck, force: [dot(y), -dot(x), 0]}}\n",
        ["theta"],
        ["energy"],
    ),
    "reaction along the constraint's normal": (
        POLAR + "forces: {up: {on: puck, force: [0, 0, 5]}}\n",
        ["theta"],
        ["p_theta", "energy"],
    ),
    "rotating hoop": (HOOP, [], ["jacobi"]),
    "magnetic field": (MAGNETIC, ["theta"], ["p_theta", "energy"]),
    "time in the potential": (FREE + "potentials: {v: x*cos(t)}\n", ["y"], ["p_y"]),
    "time in the mass matrix": (
        "parameters: {m: 1}\n" + BEAD + "coordinates: [s]\n"
        "definitions: {x: s*(1 + t), y: 0, z: 0}\n",
        [],
        [],
    ),
    "time as a total derivative": (
        FREE + "kinetic: {boost: 3*t^2}\n",
        ["x", "y"],
        ["p_x", "p_y"],
    ),
    "support at constant speed": (
        "parameters: {m: 1, u: 2}\n" + BEAD + "coordinates: [s]\n"
        "definitions: {x: s + u*t, y: 0, z: 0}\n",
        ["s"],
        ["p_s", "jacobi"],
    ),
    "a force that depends on time": (
        FREE + "forces: {push: {on: bead, force: [sin(t), 0, 0]}}\n",
        ["x", "y"],
        ["p_y"],
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_cyclic_and_conserved(name: str) -> None:
    text, cyclic, conserved = CASES[name]
    e = derived(text)
    assert list(e.derivation.cyclic) == cyclic
    assert [c.name for c in e.derivation.conserved] == conserved


def drift(e: Equations, quantity: sp.Expr, seed: int) -> mpf:
    """d/dt of a quantity along the motion, relative to the size of its parts."""
    symbols = [e.system.t, *(s for c in e.system.coordinates for s in (c.q, c.v))]
    symbols += [p.symbol for p in e.system.parameters]
    point = random_point(symbols, seed)
    with mpmath.workdps(40):
        mass = mpmath.matrix([[number(x, point, 40) for x in row] for row in e.system.mass_matrix])
        force = mpmath.matrix([number(f, point, 40) for f in e.system.forcing])
        a = mpmath.lu_solve(mass, force)
        parts = [number(sp.diff(quantity, e.system.t), point, 40)]
        for k, c in enumerate(e.system.coordinates):
            parts.append(number(sp.diff(quantity, c.q), point, 40) * point[c.v])
            parts.append(number(sp.diff(quantity, c.v), point, 40) * a[k])
        return abs(sum(parts)) / (1 + sum(abs(p) for p in parts))


@pytest.mark.parametrize("name", CASES)
def test_conserved_quantities_do_not_change(name: str) -> None:
    e = derived(CASES[name][0])
    for found in e.derivation.conserved:
        for seed in (1, 2, 3):
            assert drift(e, found.expression, seed) < mpf(10) ** -25


@pytest.mark.parametrize("name", CASES)
def test_what_is_not_listed_does_change(name: str) -> None:
    """No momentum of a coordinate and no energy function is passed over."""
    e = derived(CASES[name][0])
    listed = {c.name for c in e.derivation.conserved}
    momenta = {f"p_{c.name}": sp.diff(e.system.lagrangian, c.v) for c in e.system.coordinates}
    energy = (
        sp.Add(*(c.v * sp.diff(e.system.lagrangian, c.v) for c in e.system.coordinates))
        - e.system.lagrangian
    )
    for label, quantity in momenta.items():
        if label in e.derivation.cyclic and label not in listed:
            assert max(drift(e, quantity, s) for s in (1, 2, 3)) > mpf(10) ** -6
    if not listed & {"energy", "jacobi"}:
        assert max(drift(e, energy, s) for s in (1, 2, 3)) > mpf(10) ** -6


@pytest.mark.parametrize("name", CASES)
def test_the_energy_function_is_that_of_the_lagrangian(name: str) -> None:
    e = derived(CASES[name][0])
    expected = (
        sp.Add(*(c.v * sp.diff(e.system.lagrangian, c.v) for c in e.system.coordinates))
        - e.system.lagrangian
    )
    point = random_point((expected - e.system.energy).free_symbols, 4)
    assert abs(number(expected - e.system.energy, point)) < mpf(10) ** -25


@pytest.mark.parametrize(
    ("path", "name", "text"),
    [
        ("lecture/masses_through_hole", "p_theta", "M*r^2*dot(theta)"),
        ("lecture/particle_on_sphere", "p_phi", None),
        ("celestial/kepler", None, None),
    ],
)
def test_shipped_momenta(path: str, name: str | None, text: str | None) -> None:
    e = derive(read_file(str(SYSTEMS / f"{path}.yaml")))
    momenta = {c.name: c.expression for c in e.derivation.conserved if c.kind == "momentum"}
    assert momenta
    if name is not None and text is not None:
        assert sp.expand(momenta[name] - interpret(e, expression(text))) == 0
    for found in e.derivation.conserved:
        assert drift(e, found.expression, 1) < mpf(10) ** -25


# What is small is not what is absent.


@pytest.mark.parametrize("size", ["1e-20", "1e-30", "1e-60", "1e-300"])
def test_a_weak_potential_is_no_symmetry(size: str) -> None:
    e = derived(FREE + f"potentials: {{weak: {size}*x^2, strong: y^2}}")
    assert e.derivation.cyclic == ()
    assert [c.name for c in e.derivation.conserved] == ["energy"]


@pytest.mark.parametrize("size", ["1e-20", "1e-30", "1e-60"])
def test_a_slow_change_is_no_conservation(size: str) -> None:
    e = derived(FREE + f"potentials: {{weak: {size}*x^2*t, strong: y^2}}")
    assert e.derivation.conserved == ()
    assert not e.derivation.facts.autonomous


@pytest.mark.parametrize("size", ["1e-30", "1e-60"])
def test_a_weak_drag_is_a_drag(size: str) -> None:
    e = derived(FREE + f"potentials: {{v: x^2}}\ndissipation: {{d: {size}*dot(y)^2}}")
    assert e.derivation.conserved == ()


@pytest.mark.parametrize(("first", "second"), [("1e30", "1e-31"), ("1e-31", "1e30"), ("1", "1e12")])
def test_masses_of_any_ratio_keep_their_equations(first: str, second: str) -> None:
    e = derived(DOUBLE_PENDULUM.replace("m1: 1, m2: 2", f"m1: {first}, m2: {second}"))
    plain = derived(DOUBLE_PENDULUM)
    assert e.derivation.cyclic == ()
    assert e.system.mass_matrix == plain.system.mass_matrix
    assert [s.terms for s in e.derivation.shown] == [s.terms for s in plain.derivation.shown]


@pytest.mark.parametrize("length", ["1e-12", "1e16", "1e-100", "1e100"])
def test_units_do_not_matter(length: str) -> None:
    """Also with positions in Cartesian coordinates, and with an initial state."""
    ring = (
        f"parameters: {{m: 1e-31, l: {length}, g: 9.81}}\nplane: xz\n"
        + BEAD
        + "constraints: {ring: x^2 + z^2 = l^2}\ncoordinates: [x]\n"
        "potentials: {weight: {gravity: g}}\ninitial: {x: 0.6*l, z: -0.8*l, dot(x): l}"
    )
    e = derived(ring)
    assert e.system.initial is not None
    assert e.system.initial.positions[0] == pytest.approx(0.6 * float(length), rel=1e-15)
    assert [c.name for c in e.derivation.conserved] == ["energy"]
    unit = derived(ring.replace(f"l: {length}", "l: 1").replace("1e-31", "1"))
    assert e.system.mass_matrix == unit.system.mass_matrix


def test_a_dozen_coordinates() -> None:
    names = [f"q{k}" for k in range(12)]
    bodies = "\n".join(f"  p{k}: {{mass: 1, position: [q{k}, 0, 0]}}" for k in range(12))
    springs = " + ".join(f"(q{k + 1} - q{k})^2/2" for k in range(11))
    e = derived(
        f"particles:\n{bodies}\ncoordinates: [{', '.join(names)}]\npotentials: {{v: {springs}}}"
    )
    assert e.derivation.account.dof == 12
    assert e.derivation.facts.constant_mass_matrix
    assert e.derivation.facts.diagonal_mass_matrix
    assert sp.Matrix(e.system.mass_matrix) == sp.eye(12)


# Facts.


def flags(e: Equations) -> set[str]:
    names = (
        "constant_mass_matrix",
        "diagonal_mass_matrix",
        "separable",
        "separable_on_closures",
        "autonomous",
        "rheonomic",
        "planar",
        "positive_definite_mass_matrix",
    )
    return {n for n in names if getattr(e.derivation.facts, n)}


USUAL = {"autonomous", "planar", "positive_definite_mass_matrix"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            FREE + "potentials: {v: x^2*y}",
            USUAL
            | {
                "constant_mass_matrix",
                "diagonal_mass_matrix",
                "separable",
                "separable_on_closures",
            },
        ),
        (DOUBLE_PENDULUM, USUAL),
        (POLAR + "potentials: {s: k*r}", USUAL | {"diagonal_mass_matrix"}),
        (
            HOOP,
            {"autonomous", "rheonomic", "diagonal_mass_matrix", "constant_mass_matrix"}
            | {"separable", "separable_on_closures", "positive_definite_mass_matrix"},
        ),
        (
            FREE + "potentials: {v: x*sin(t)}",
            USUAL - {"autonomous"}
            | {
                "constant_mass_matrix",
                "diagonal_mass_matrix",
                "separable",
                "separable_on_closures",
            },
        ),
        (
            FREE + "dissipation: {d: dot(x)^2}",
            USUAL | {"constant_mass_matrix", "diagonal_mass_matrix"},
        ),
        (
            "coordinates: [u, w]\nkinetic: {T: dot(u)^2/2 - dot(w)^2/2}",
            {
                "constant_mass_matrix",
                "diagonal_mass_matrix",
                "separable",
                "separable_on_closures",
                "autonomous",
            },
        ),
        (
            "coordinates: [u, w]\nkinetic: {T: dot(u)*dot(w)}",
            {"constant_mass_matrix", "separable", "separable_on_closures", "autonomous"},
        ),
    ],
)
def test_facts(text: str, expected: set[str]) -> None:
    assert flags(derived(text)) == expected


def test_a_mass_matrix_called_positive_is_positive() -> None:
    """A negative kinetic term is no inertia, whatever it stands beside."""
    e = derived(FREE + "kinetic: {debt: -dot(x)^2}")
    assert not e.derivation.facts.positive_definite_mass_matrix
    e = derived("parameters: {J: -2}\ncoordinates: [u, w]\nkinetic: {T: J*dot(u)^2 + dot(w)^2}\n")
    assert not e.derivation.facts.positive_definite_mass_matrix


def test_unused_parameters_are_warned_of() -> None:
    e = derived("parameters: {m: 1, idle: 3, other: 2*idle}\n" + BEAD + "potentials: {v: x+y+z}")
    assert e.derivation.facts.unused_parameters == ("other",)
    assert [w.rule for w in e.derivation.warnings] == ["unused-parameter"]


@pytest.mark.parametrize(
    ("definition", "angle"),
    [
        ("cos(s)", True),
        ("cos(3*s)", True),
        ("sin(s + t)", True),
        ("tan(s)", True),
        ("cos(s/2)", False),
        ("cos(s) + s", False),
        ("s*cos(s)", False),
        ("cos(2.5*s)", False),
        ("cos(s^2)", False),
        ("exp(s)", False),
    ],
)
def test_angles_are_recognized(definition: str, angle: bool) -> None:
    e = derived(
        "particles: {bead: {mass: 1, position: [x, 0, 0]}}\ncoordinates: [s]\n"
        f"definitions: {{x: {definition}}}"
    )
    assert e.system.coordinates[0].is_angle is angle


def test_angles_that_turn_a_body_are_recognized_where_nothing_depends_on_them() -> None:
    e = derived(
        "frames: {ring: {turn: [z: phi]}}\ncoordinates: [phi, theta, psi]\n"
        "bodies: {b: {on: ring, turn: [x: theta, z: psi], mass: 1, inertia: [1, 1, 2]}}"
    )
    assert [c.is_angle for c in e.system.coordinates] == [True, True, True]


@pytest.mark.parametrize(
    "names",
    [
        ("E", "I", "N"),
        ("S", "O", "Q"),
        ("lambda", "beta", "gamma"),
        ("tt", "T", "t1"),
        ("e", "i", "j"),
        ("zeta", "re", "im"),
        ("Symbol", "exec", "None_"),
    ],
)
def test_every_name_is_the_users(names: tuple[str, str, str]) -> None:
    p, u, w = names
    e = derived(
        f"parameters: {{{p}: 3}}\ncoordinates: [{u}, {w}]\n"
        f"kinetic: {{T0: {p}*(dot({u})^2 + dot({w})^2)/2}}\n"
        f"potentials: {{V0: {p}*{u}^2*{w}}}\ninitial: {{{u}: 1, {w}: 2}}"
    )
    a, b = (c.q for c in e.system.coordinates)
    s = e.system.parameters[0].symbol
    assert e.system.forcing == (-2 * s * a * b, -s * a**2)
    assert e.system.mass_matrix == ((s, 0), (0, s))
    assert e.system.initial is not None
    assert e.system.initial.positions == (1.0, 2.0)


@pytest.mark.parametrize(
    ("length", "words"),
    [
        ("1e200", "above 1e308: numbers overflow"),
        ("1e-200", "below 1e-307: numbers underflow"),
    ],
)
def test_inertia_beyond_doubles_is_no_lack_of_inertia(length: str, words: str) -> None:
    problem = refusal(
        f"parameters: {{l: {length}}}\n"
        "particles: {bob: {mass: 1, position: [l*sin(q), 0, -l*cos(q)]}}\n"
        "coordinates: [q]\n"
    )
    assert problem.message == f"the inertia of coordinate 'q' is {words}"
    assert problem.rule == "range"
    assert problem.mark is not None
    assert problem.mark.line == 4
