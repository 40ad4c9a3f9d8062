"""Facts hold at every state: what rests near the start, or is narrow or tiny there, counts."""

from __future__ import annotations

import re

import pytest
import sympy as sp

from lagrange_cli.mechanics.proofs.continuity import is_analytic, is_continuous
from lagrange_cli.mechanics.proofs.refutation import depends, is_nonzero, jumps
from tests.mechanics.mechanics_support import derived, refusal

PLANE = (
    "parameters: {m: 2, k: 100, a: 0}\n"
    "particles: {b: {mass: m, position: [x, y, 0]}}\ncoordinates: [x, y]\n"
)
START = "initial: {x: 0, y: 0, dot(x): 1, dot(y): 1}\n"

#: What acts on x alone, and not near the start.
FAR_AWAY = (
    "max(0, x - 3)",
    "max(0, x - 3)^2",
    "min(0, x + 7)",
    "abs(x - 3) + x",
    "max(0, abs(x) - 3)",
    "max(0, min(1, x - 5))",
    "sqrt((x - 3)^2) + x",
    "sqrt(x^2 - 6*x + 9) + x",
    "exp(-((x - 5)/1e-9)^2)",
    "1e-60*x",
    "1e-60/(1 + ((x - 5)/1e-9)^2)",
    "tanh((x - 5)/1e-9)",
    "(x/10)^40",
    "max(0, 1 - abs((x - 5)/1e-6))",
)

#: What is the same everywhere, in disguise.
NOTHING = (
    "cos(x)^2 + sin(x)^2",
    "max(0, x - 3) - (x - 3 + abs(x - 3))/2",
    "max(x, y) + min(x, y) - x - y",
    "abs(x - 3) - max(x - 3, 3 - x)",
    "sqrt(x^2 - 6*x + 9)^2 - (x - 3)^2",
    "exp(x)*exp(-x)",
    "(1 + tan(x)^2)*cos(x)^2",
)


def names(text: str) -> tuple[set[str], set[str]]:
    """Cyclic coordinates and conserved quantities."""
    equations = derived(text)
    return set(equations.derivation.cyclic), {c.name for c in equations.derivation.conserved}


@pytest.mark.slow
@pytest.mark.parametrize("term", FAR_AWAY)
def test_a_potential_that_acts_elsewhere_is_no_symmetry(term: str) -> None:
    cyclic, conserved = names(f"{PLANE}potentials: {{v: '{term}'}}\n{START}")
    assert (cyclic, conserved) == ({"y"}, {"p_y", "energy"})


@pytest.mark.parametrize("term", FAR_AWAY)
def test_a_force_that_acts_elsewhere_conserves_nothing_of_what_it_acts_on(term: str) -> None:
    cyclic, conserved = names(f"{PLANE}forces: {{f: {{on: x, force: '{term}'}}}}\n{START}")
    assert (cyclic, conserved) == ({"x", "y"}, {"p_y"})


@pytest.mark.slow
@pytest.mark.parametrize("term", [term for term in FAR_AWAY if "exp" not in term])
def test_inertia_that_changes_elsewhere_is_no_symmetry(term: str) -> None:
    text = f"{PLANE}kinetic: {{e: 'm/2*({term})^2*dot(y)^2'}}\n{START}"
    assert names(text) == ({"y"}, {"p_y", "energy"})


@pytest.mark.slow
@pytest.mark.parametrize("term", [re.sub(r"\bx\b", "t", term) for term in FAR_AWAY])
def test_what_changes_at_another_time_conserves_no_energy(term: str) -> None:
    assert names(f"{PLANE}potentials: {{v: 'y^2*({term})'}}\n{START}") == ({"x"}, {"p_x"})


@pytest.mark.parametrize("drag", ["max(0, dot(x) - 5)^2", "1e-60*dot(x)^2", "abs(dot(x))^3"])
def test_drag_at_other_speeds_counts(drag: str) -> None:
    start = START.replace("dot(x): 1", "dot(x): 0")
    assert names(f"{PLANE}dissipation: {{d: '{drag}'}}\n{start}")[1] == {"p_y"}


@pytest.mark.parametrize("term", NOTHING)
def test_what_cancels_everywhere_takes_nothing_away(term: str) -> None:
    forces = f"forces: {{f: {{on: x, force: 'x*({term}) - x*({term})'}}}}\n"
    assert names(f"{PLANE}potentials: {{v: 'k*({term})'}}\n{forces}{START}") == (
        {"x", "y"},
        {"p_x", "p_y", "energy"},
    )


def test_forces_across_the_motion_do_no_work() -> None:
    field = "max(0, x - 3)"
    one, other = f"{{on: x, force: '{field}*dot(y)'}}", f"{{on: y, force: '-{field}*dot(x)'}}"
    forces = f"forces: {{f: {one}, g: {other}}}\n"
    assert names(PLANE + forces + START)[1] == {"energy"}
    assert names(PLANE + forces.replace("-max", "-1.000000000001*max") + START)[1] == set()


def test_forces_along_a_constraint_do_no_work_beside_it() -> None:
    """A force along the rod, written as one: closures admit no displacement against it."""
    rod = (
        "particles: {b: {mass: 1, position: [x, 0, z]}}\nplane: xz\n"
        "constraints: {rod: x^2 + z^2 = 1}\n"
        "forces: {pull: {on: b, force: ['F*x', 0, 'F*z']}}\ninitial: {x: 0.6, z: 0.8}\n"
    )
    assert names(rod.replace("F", "max(0, x - 3)"))[1] == {"energy"}
    assert names(rod.replace("F*x", "0").replace("F", "max(0, x - 3)"))[1] == set()


@pytest.mark.parametrize("step", ["sign(x - 3)", "(x - 3)/abs(x - 3)", "atan2(y, x)"])
def test_what_jumps_is_not_said_to_be_conserved(step: str) -> None:
    """The force is zero, or smooth, on both sides; the energy is another one."""
    text = f"{PLANE}potentials: {{v: 'k*({step})'}}\n{START.replace('x: 0', 'x: 1')}"
    assert "energy" not in names(text)[1]
    text = f"{PLANE}kinetic: {{e: 'm/8*({step})*dot(y)^2'}}\n{START.replace('x: 0', 'x: 1')}"
    assert not names(text)[1] & {"energy", "p_x"}


def test_parameters_that_are_zero_or_negative_prove_nothing() -> None:
    assert names(f"{PLANE}potentials: {{v: a*x}}\n{START}") == ({"y"}, {"p_y", "energy"})
    assert names(f"{PLANE}potentials: {{v: (sqrt(a^2) - a)*x}}\n{START}")[0] == {"y"}


ROTOR = (
    "particles: {b: {mass: 1, position: [x, 0, 0]}}\ncoordinates: [x, p]\n"
    "initial: {x: 0, p: 0, dot(x): 1, dot(p): 1}\n"
)


def test_inertia_that_ends_on_the_other_side_is_not_positive_definite() -> None:
    equations = derived(f"{ROTOR}kinetic: {{k: 'max(0, 3 - x)*dot(p)^2/2'}}\n")
    assert not equations.derivation.facts.positive_definite_mass_matrix
    assert derived(
        f"{ROTOR}kinetic: {{k: dot(p)^2/2}}\n"
    ).derivation.facts.positive_definite_mass_matrix


def test_inertia_that_begins_on_the_other_side_is_missed_where_it_was_looked_for() -> None:
    problem = refusal(f"{ROTOR}kinetic: {{k: 'max(0, x - 3)*dot(p)^2/2'}}\n")
    assert "singular at the configurations looked at" in problem.message
    problem = refusal(f"{ROTOR}potentials: {{k: p^2}}\n")
    assert "singular at every configuration" in problem.message


X, Y, K = sp.Symbol("x", real=True), sp.Symbol("y", real=True), sp.Symbol("k", positive=True)
R = sp.sqrt(X**2 + Y**2)


@pytest.mark.parametrize(
    ("expression", "continuous"),
    [
        (-K / R, True),
        (K * sp.exp(-R) / R, True),
        ((3 * Y**2 / R**2 - 1) / R**3, True),
        (K * sp.Max(0, X - 3) ** 2 / (1 + Y**2), True),
        (sp.tanh(10**9 * X), True),
        (-K / sp.Abs(X), True),
        (sp.sign(X), False),
        (X / sp.Abs(X), False),
        (sp.atan(1 / X), False),
        (X * sp.sqrt(1 + 1 / X**2), False),
        (1 / (1 + 1 / X + 1 / sp.Abs(X)), False),
        (sp.sqrt(X**2 - 6 * X + 9) / (X - 3), False),
        (X * sp.Max(0, 1 / X), False),
        (sp.atan2(Y, X), False),
    ],
)
def test_continuity_is_told_by_structure(expression: sp.Expr, continuous: bool) -> None:
    assert is_continuous(expression, {X, Y}) is continuous


def test_analytic_expressions_are_told_from_sawteeth() -> None:
    assert is_analytic(sp.log(1 + X**2) * sp.sin(Y), {X, Y})
    for bent in (sp.asin(sp.sin(X)), sp.Abs(X), sp.sqrt(X**2 - 2 * X + 1), sp.atan(sp.tan(X))):
        assert not is_analytic(bent, {X, Y})


def test_refutations_reach_far_and_narrow_places() -> None:
    box = sp.Max(0, 1 - sp.Abs(10**9 * (X - 5)))
    assert depends(box * Y, X)
    assert is_nonzero(sp.Max(0, X - 10**6))
    assert not is_nonzero(sp.Max(0, X) + sp.Min(0, X) - X)
    assert jumps(Y + sp.sign(X - 3) / 10**60)
    assert not jumps(Y + sp.Max(0, X - 3))


def test_rounding_denies_nothing() -> None:
    """cosh(u)^2 - sinh(u)^2 = 1, of numbers beyond the fifty digits of certificates."""
    equations = derived(
        "coordinates: [x]\nparticles: {b: {mass: 1, position: [x, 0, 0]}}\n"
        "potentials: {v: 3*(cosh(x - 100)^2 - sinh(x - 100)^2)}\n"
        "initial: {x: 0.3, dot(x): 0.5}\n"
    )
    assert {c.name for c in equations.derivation.conserved} == {"p_x", "energy"}
    assert equations.derivation.cyclic == ("x",)
