"""Names that constraints determine as they do Cartesian names: of energies, positions, forces."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli import loads
from lagrange_cli.errors import InputError

WHEEL = """
name: wheel
parameters: {m: 2, R: {value: 0.5, positive: true}, I: 0.25, g: 9.81, al: 0.5}
particles: {w: {mass: m, position: [s*cos(al), 0, -s*sin(al)]}}
coordinates: [s]
kinetic: {spin: I/2*dot(psi)^2}
potentials: {weight: {gravity: g}}
constraints: {rolling: %s}
"""


@pytest.mark.parametrize("rolling", ["s = R*psi", "R*psi - s = 0", "dot(s) = R*dot(psi)"])
def test_the_angle_of_a_wheel_is_eliminated(rolling: str) -> None:
    equations = loads(WHEEL % rolling).derive().equations
    assert [c.name for c in equations.system.coordinates] == ["s"]
    account = equations.derivation.account
    assert (account.cartesian, account.extra, account.constraints, account.dof) == (3, 1, 3, 1)
    assert account.implied == 2
    p = {p.name: p.symbol for p in equations.system.parameters}
    inertia = p["m"] + p["I"] / p["R"] ** 2
    assert sp.simplify(equations.system.mass_matrix[0][0] - inertia) == 0
    assert sp.simplify(equations.system.forcing[0] - p["m"] * p["g"] * sp.sin(p["al"])) == 0
    (angle,) = [c for c in equations.system.cartesian_names if c.name == "psi"]
    assert sp.simplify(angle.velocity - equations.system.coordinates[0].v / p["R"]) == 0
    turned = equations.system.coordinates[0].q - p.get("s_0", 0)
    assert sp.simplify(angle.position - p.get("psi_0", 0) - turned / p["R"]) == 0


def test_forces_and_multipliers_are_those_of_a_declared_angle() -> None:
    rolled = loads(WHEEL % "s = R*psi").derive(forces=True).equations
    assert rolled.derivation.constraint_forces is not None
    (reaction,) = rolled.derivation.constraint_forces.reactions
    p = {p.name: p.symbol for p in rolled.system.parameters}
    expected = (
        -p["g"] * sp.sin(p["al"]) * p["I"] / p["R"] ** 2 / (1 + p["I"] / p["m"] / p["R"] ** 2)
    )
    assert sp.simplify(reaction.multiplier - expected) == 0


def test_the_angle_takes_part_in_starts_and_motions() -> None:
    system = loads(
        WHEEL % "dot(s) = R*dot(psi)" + "initial: {s: 1, psi: 3, dot(psi): 2}\n"
    ).derive()
    run = system.simulate(until=1.0, accuracy=1e-9)
    travelled = run.state["s"] - 1
    assert abs(travelled - (1 + 9.81 * 0.479425538604203 / 1.5 / 2)) < 1e-8
    assert abs(run.state["psi"] - 3 - travelled / 0.5) < 1e-8


@pytest.mark.parametrize(
    ("rolling", "unknown"), [("s = 3", "psi"), ("s = R*phi", "psi"), ("s = R*phi", "phi")]
)
def test_a_name_in_one_of_the_sections_is_unknown(rolling: str, unknown: str) -> None:
    with pytest.raises(InputError) as refused:
        loads(WHEEL % rolling)
    assert any(f"unknown name '{unknown}'" in p.message for p in refused.value.problems)


WEDGE = """
name: wedge
parameters: {m1: 1, m2: 2, alpha: 0.5, beta: 0.8, g: 9.81, l: 3, k: 1}
plane: xz
particles:
  A: {mass: m1, position: [-s1*cos(alpha), 0, -s1*sin(alpha)]}
  B: {mass: m2, position: [s2*cos(beta), 0, -s2*sin(beta)]}
constraints: {string: %s}
%s
potentials: {weight: {gravity: g}}
"""


@pytest.mark.parametrize("string", ["s1 + s2 = l", "dot(s1) + dot(s2) = 0", "l - s2 - s1 = 0"])
def test_a_length_in_a_position_is_eliminated(string: str) -> None:
    equations = loads(WEDGE % (string, "coordinates: [s1]")).derive().equations
    assert [c.name for c in equations.system.coordinates] == ["s1"]
    account = equations.derivation.account
    assert (account.cartesian, account.extra, account.constraints, account.dof) == (6, 0, 5, 1)
    assert account.implied == 2
    assert [line.status for line in account.lines] == ["satisfied", "independent"]
    p = {p.name: p.symbol for p in equations.system.parameters}
    assert sp.simplify(equations.system.mass_matrix[0][0] - p["m1"] - p["m2"]) == 0
    pull = p["g"] * (p["m1"] * sp.sin(p["alpha"]) - p["m2"] * sp.sin(p["beta"]))
    assert sp.simplify(equations.system.forcing[0] - pull) == 0


def test_the_hint_for_two_coordinates_leads_to_one() -> None:
    """What one refusal says to write is no other refusal."""
    with pytest.raises(InputError, match="too many coordinates") as refused:
        loads(WEDGE % ("s1 + s2 = l", "coordinates: [s1, s2]")).derive()
    hint = refused.value.problems[0].hint
    assert hint.splitlines()[0] == "coordinates: [s1]"
    for lines in (hint, hint.splitlines()[0], ""):
        assert len(loads(WEDGE % ("s1 + s2 = l", lines)).derive().equations.system.coordinates) == 1


@pytest.mark.parametrize(
    "section",
    [
        "potentials: {spring: k/2*u^2}",
        "dissipation: {friction: k/2*dot(u)^2}",
        "forces: {pull: {on: P, force: [-k*u, 0, 0]}}",
        "points: {far: [u, 0, 0]}\nforces: {pull: {on: far, force: [k, 0, 0]}}",
    ],
)
def test_names_of_other_sections(section: str) -> None:
    scene = f"""
parameters: {{m: 1, k: 2, l: 1}}
particles: {{P: {{mass: m, position: [q, 0, 0]}}}}
coordinates: [q]
constraints: {{rope: u + 2*q = l}}
{section}
"""
    equations = loads(scene).derive().equations
    assert [c.name for c in equations.system.coordinates] == ["q"]
    p = {p.name: p.symbol for p in equations.system.parameters}
    (row,) = equations.system.forcing
    assert p["k"] in row.free_symbols


@pytest.mark.parametrize("string", ["s1 = l", "s1 + s3 = l"])
def test_a_name_in_positions_alone_is_unknown(string: str) -> None:
    with pytest.raises(InputError) as refused:
        loads(WEDGE % (string, "coordinates: [s1]"))
    assert any("unknown name 's2'" in p.message for p in refused.value.problems)


def test_a_dependent_name_that_nothing_determines_is_asked_for() -> None:
    scene = WHEEL.replace("kinetic: {", "kinetic: {turn: dot(phi)^2, ")
    with pytest.raises(InputError, match="nothing determines") as refused:
        loads(scene % "s = R*psi + phi").derive()
    assert refused.value.problems[0].hint.startswith("coordinates: [s, p")
