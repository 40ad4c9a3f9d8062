"""Closures that are redundant, singular or impossible: what is named, and how."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath
import pytest

from tests.mechanics.closures_support import (
    FLAT,
    FOUR_BAR_OF_RODS,
    PENDULUM,
)
from tests.mechanics.mechanics_support import derived, refusal


@pytest.fixture(autouse=True)
def _precise() -> Iterator[None]:
    with mpmath.workdps(40):
        yield


@pytest.mark.parametrize(
    ("curve", "start"),
    [
        ("log(x^2 + z^2) = 0", "initial: {x: 0.6, z: -0.8}\n"),
        ("log(x^2 + z^2) = 0", ""),
        ("sin(z - sin(x) + 0.01*x*z) = 0", ""),
        ("sin(z - sin(x) + 0.01*x*z) = 0", "initial: {x: 0, z: 0}\n"),
        ("(x^2 + z^2 - 1)*exp(x) = 0", "initial: {x: 0.6, z: -0.8}\n"),
    ],
)
def test_an_equation_whose_only_term_vanishes(curve: str, start: str) -> None:
    text = FLAT + "parameters: {m: 2}\nconstraints: {curve: '" + curve + "'}\n"
    e = derived(text + start)
    assert (e.derivation.account.dof, e.system.multipliers) == (1, ("curve",))
    if start:
        assert e.system.initial is not None
        assert e.system.initial.projected == 0.0


def test_a_redundant_closure_is_named() -> None:
    text = PENDULUM.replace("= l^2", "= l^2, again: 2*x^2 + 2*z^2 = 2*l^2")
    e = derived(text)
    assert e.system.multipliers == ("rod",)
    assert e.derivation.account.dof == 1
    assert [w.rule for w in e.derivation.warnings] == ["redundant"]
    assert {line.name: line.implied_by for line in e.derivation.account.lines}["again"] == ("rod",)


TRIANGLE = (
    "parameters: {s: 1}\nparticles:\n  a: {mass: 1, position: [x1, y1, z1]}\n"
    "  b: {mass: 1, position: [x2, y2, z2]}\n  c: {mass: 1, position: [x3, y3, z3]}\n"
    "constraints:\n  one: {distance: [a, b], equals: 1}\n"
    "  two: {distance: [b, c], equals: 1}\n  three: {distance: [a, c], equals: %s}\n"
)


def test_a_rigid_triangle() -> None:
    e = derived(TRIANGLE % "1.5")
    assert (
        e.derivation.account.cartesian,
        e.derivation.account.constraints,
        e.derivation.account.dof,
    ) == (9, 3, 6)
    assert len(e.system.coordinates) == 9


@pytest.mark.slow
@pytest.mark.parametrize("spoke", ["sqrt(6)/4*c", "0.612372436*c"])
def test_a_tetrahedron_with_a_redundant_spoke(spoke: str) -> None:
    """Four corners, and a fifth particle at the centre: one of ten rods follows."""
    names = ["one", "two", "three", "four", "five"]
    particles = "".join(
        f"  {n}: {{mass: 1, position: [x{k}, y{k}, z{k}]}}\n" for k, n in enumerate(names)
    )
    rods = "".join(
        f"  {a}_{b}: {{distance: [{a}, {b}], equals: {spoke if b == 'five' else 'c'}}}\n"
        for i, a in enumerate(names)
        for b in names[i + 1 :]
    )
    start = "x0: 0.35, y0: 0.35, z0: 0.35, x1: 0.35, y1: -0.35, z1: -0.35, x2: -0.35, y2: 0.35"
    start += ", z2: -0.35, x3: -0.35, y3: -0.35, z3: 0.35, x4: 0, y4: 0, z4: 0"
    e = derived(
        f"parameters: {{c: 1}}\nparticles:\n{particles}constraints:\n{rods}near: {{{start}}}\n"
    )
    assert (
        e.derivation.account.cartesian,
        e.derivation.account.constraints,
        e.derivation.account.dof,
    ) == (15, 9, 6)
    assert [w.rule for w in e.derivation.warnings] == ["redundant"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "rule", "named"),
    [
        (TRIANGLE % "3", "inconsistent", ["'one'", "'two'", "'three'"]),
        (TRIANGLE % "2", "singular", ["'one'", "'two'", "'three'"]),
        (PENDULUM.replace("= l^2", "= -l^2"), "inconsistent", ["'rod'"]),
        (PENDULUM.replace("= l^2", "= 0"), "singular", ["'rod'"]),
        (PENDULUM.replace("x^2 + z^2 = l^2", "(x - sin(z))^2 = 0"), "singular", ["'rod'"]),
        (
            PENDULUM.replace("= l^2", "= l^2, far: (x - 9)^2 + z^2 = l^2"),
            "inconsistent",
            ["'rod'", "'far'"],
        ),
    ],
)
def test_sets_that_cannot_hold(text: str, rule: str, named: list[str]) -> None:
    problem = refusal(text)
    assert problem.rule == rule
    assert problem.mark is not None
    for name in named:
        assert name in problem.message


@pytest.mark.slow
def test_what_was_put_into_an_equation_is_named() -> None:
    """x = 2 w and w = 0.5 + z leave no real point of x² + z² = 0.01; (2 z − sin z)² = 0 is flat."""
    inner = "parameters: {m: 1}\n" + FLAT + "points: {p: [w, 0, 0]}\n"
    inner += "constraints: {half: w = 0.5 + z, twice: x = 2*w, %s}\n"
    problem = refusal(inner % "rod: x^2 + sin(z)^2*x^4 + z^2 = 0.01")
    assert problem.rule == "inconsistent"
    assert all(name in problem.message for name in ("'half'", "'twice'", "'rod'"))
    problem = refusal(inner % "rod: (x - 1 - sin(z))^2 = 0")
    assert problem.rule == "singular"
    assert all(name in problem.message for name in ("'half'", "'twice'", "'rod'"))
    assert "rod: x - sin(z) - 1 = 0" in problem.hint


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (PENDULUM.replace("x^2 + z^2 = l^2", "(x - sin(z))^2 = 0"), "x = 0 in place of x^2 = 0"),
        (PENDULUM.replace("= l^2", "= 0"), "x = 0 in place of x^2 = 0"),
        (
            PENDULUM.replace("x^2 + z^2 = l^2", "cosh(x - sin(z)) = 1"),
            "crosses zero where it holds",
        ),
        (TRIANGLE % "2", "leave out 'one', 'two' or 'three'"),
    ],
)
def test_hints_at_singular_equations(text: str, hint: str) -> None:
    assert hint in refusal(text).hint


def test_declared_coordinates_with_too_little_to_fix_the_others() -> None:
    problem = refusal(
        FOUR_BAR_OF_RODS.replace("  rocker: {distance: [right, B], equals: c}\n", "")
        + "coordinates: [xa]\n"
    )
    assert problem.rule == "too-few-coordinates"


def test_closures_without_any_inertia_are_refused() -> None:
    text = PENDULUM + "points: {p: [u, 0, w]}\nnear: {u: 3, w: 1}\n"
    text = text.replace("= l^2", "= l^2, free: u^2 + w^2 = l^2")
    assert refusal(text).rule in ("no-inertia", "dependent-coordinates")


TAUT = """
sizes: {n: 3}
parameters: {D: 4}
plane: xz
points: {"p[0]": [0, 0, 0], e: [D, 0, 0]}
particles:
  p[i=1..n]: {mass: 1, position: ["x[i]", "y[i]", "z[i]"]}
constraints:
  rod[i=1..n]: {distance: ["p[i-1]", "p[i]"], equals: 1}
  last: {distance: ["p[n]", e], equals: 1}
"""


@pytest.mark.slow
def test_a_taut_chain_is_not_called_impossible() -> None:
    start = 'initial: {"x[i=1..n]": i, "z[i=1..n]": 0}\n'
    taut = refusal(TAUT + start)
    assert taut.message.startswith("nothing moves at the given configuration: it satisfies 'plane'")
    assert "no other one beside it was found" in taut.message
    assert "reach 4 at most" in refusal(TAUT.replace("D: 4", "D: 4.1") + start).message
    assert derived(TAUT.replace("D: 4", "D: 3.9")).derivation.account.dof == 2


@pytest.mark.slow
def test_a_long_chain_needs_no_initial_values() -> None:
    chain = TAUT.replace("n: 3", "n: 66").replace(
        '  last: {distance: ["p[n]", e], equals: 1}\n', ""
    )
    assert derived(chain).derivation.account.dof == 66


@pytest.mark.slow
def test_members_of_families_in_hints_can_be_pasted() -> None:
    hint = refusal(TAUT.replace("D: 4", "D: 9")).hint
    assert '{distance: ["p[3]", e], equals: ' in hint
