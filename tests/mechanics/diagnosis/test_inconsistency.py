"""Scenes that nothing satisfies: the smallest set is named, with proof or as searched for."""

from __future__ import annotations

import pytest

from tests.mechanics.mechanics_support import refusal

pytestmark = pytest.mark.slow

BODIES = "particles:\n  p: {mass: 1, position: [x, y, z]}\n  q: {mass: 1, position: [u, v, w]}\n"
FOUR = "particles: {a: {mass: 1}, b: {mass: 1}, c: {mass: 1}, d: {mass: 1}, e: {mass: 1}}\n"
TETRAHEDRON = """constraints:
  ab: {distance: [a, b], equals: 1}
  bc: {distance: [b, c], equals: 1}
  ca: {distance: [c, a], equals: 1}
  ad: {distance: [a, d], equals: %s}
  bd: {distance: [b, d], equals: %s}
  cd: {distance: [c, d], equals: %s}
  de: {distance: [d, e], equals: 1}
"""
LINKAGE = """
parameters: {a: 1, b: 1, c: 1, d: %s}
plane: xz
points: {o: [0, 0, 0], p: [d, 0, 0]}
particles:
  A: {mass: 1, position: [x1, y1, z1]}
  B: {mass: 1, position: [x2, y2, z2]}
constraints:
  crank: {distance: [o, A], equals: a}
  coupler: {distance: [A, B], equals: b}
  rocker: {distance: [B, p], equals: c}
"""


@pytest.mark.parametrize(
    ("constraints", "named"),
    [
        ("flat: y = 0, one: x^2 + z^2 = 1, two: x^2 + z^2 = 4", "'one', 'two'"),
        ("flat: y = 0, one: x^2 + y^2 + z^2 = 1, two: x = 2", "'one', 'two'"),
        ("one: x^2 + z^2 = 1, two: x + z = 2, three: x = u", "'one', 'two'"),
        (
            "one: x^2 + z^2 = 1, two: u = 2*x, three: u = w + 3, four: w = 0",
            "'one', 'two', 'three', 'four'",
        ),
        (
            "one: x^2 + z^2 = 1, two: u^3 + u = x + v, three: w^2 + u^2 = 5,"
            " four: y = exp(w) + v, five: x^2 + z^2 = 4",
            "'one', 'five'",
        ),
        ("floor: z = 0, roof: z = 1, wall: x = 2", "'floor', 'roof'"),
        ("one: x + 2*y + z = 1, two: y = u, three: 2*x + 4*u + 2*z = 5", "'one', 'two', 'three'"),
        ("one: x*z = 3, two: x^2 + z^2 = 1, three: u*v = 1", "'one', 'two'"),
        ("one: dot(x) = 1, two: dot(x) = 2, three: dot(y) = 3", "'one', 'two'"),
    ],
)
def test_the_smallest_set_is_named(constraints: str, named: str) -> None:
    problem = refusal(BODIES + f"constraints: {{{constraints}}}\n")
    assert problem.rule == "inconsistent"
    assert f"constraints {named}" in problem.message
    assert "contradict each other" in problem.message


@pytest.mark.slow
@pytest.mark.parametrize(
    "lengths",
    [
        ("1", "1", "1.9"),
        pytest.param(("0.55", "0.55", "0.55"), marks=pytest.mark.campaign),
        ("2", "1", "3"),
    ],
)
def test_a_tetrahedron_that_does_not_close(lengths: tuple[str, str, str]) -> None:
    """Every triangle of the first two closes; the Cayley-Menger determinant is negative."""
    problem = refusal(FOUR + TETRAHEDRON % lengths)
    assert problem.rule == "inconsistent"
    assert "contradict each other" in problem.message
    assert "'cd'" in problem.message
    assert "'de'" not in problem.message
    if lengths[2] != "3":
        assert "'ab', 'bc', 'ca', 'ad', 'bd', 'cd'" in problem.message


def test_a_linkage_whose_base_is_too_long() -> None:
    problem = refusal(LINKAGE % 4)
    assert problem.message == (
        "constraints 'crank', 'coupler', 'rocker' contradict each other: 'o' and 'p' are"
        " 4 apart, where 'crank', 'coupler' and 'rocker' reach 3 at most"
    )


def test_a_linkage_in_angles() -> None:
    text = (
        "parameters: {d: 4}\nparticles:\n  A: {mass: 1, position: [cos(s), 0, sin(s)]}\n"
        "coordinates: [s, f, g]\nconstraints: {loop: [cos(s) + cos(f) = d + cos(g),"
        " sin(s) + sin(f) = sin(g)]}\n"
    )
    assert "constraint 'loop' cannot hold: no real f, g, s" in refusal(text).message


def test_what_is_searched_for_only_is_not_called_a_contradiction() -> None:
    """exp 2x = (exp x)² is not put in: the honest wording, of a smallest set."""
    constraints = (
        "one: exp(x) + sin(z) = 0, two: exp(2*x) + cos(z) = 3, three: u^2 + v^2 = 1,"
        " four: y + sin(y) = w*v"
    )
    problem = refusal(BODIES + f"constraints: {{{constraints}}}\n")
    assert problem.rule == "inconsistent"
    assert "contradict" not in problem.message
    assert "no configuration found in 48 starts" in problem.message
    assert problem.message.endswith("satisfies 'one', 'two'")
    assert "leave one of these constraints out" in problem.hint


def test_tolerance_is_no_contradiction() -> None:
    text = BODIES + "constraints: {one: x^2 + z^2 = 1, two: x^2 + z^2 = %s}\n"
    assert "contradict" in refusal(text % "1.00001").message
    with pytest.raises(AssertionError, match="accepted"):
        refusal(text % "1.0000000001")


CHAIN = """
sizes: {n: %s}
parameters: {l: 0.1}
plane: xz
points: {"p[0]": [0, 0, 0], far: [%s, 0, 0]}
particles:
  p[i=1..n]: {mass: 1, position: ["x[i]", "y[i]", "z[i]"]}
constraints:
  rod[i=1..n]: {distance: ["p[i-1]", "p[i]"], equals: l}
"""


def test_a_long_list_of_names_is_cut() -> None:
    problem = refusal(CHAIN % (13, 3) + '  end: {distance: ["p[13]", far], equals: l}\n')
    assert problem.message.startswith("constraints 'rod[1]', 'rod[2]', 'rod[3]', 'rod[4]', ..., ")
    assert "'rod[13]', 'end' (14 in all) contradict each other" in problem.message
    assert problem.message.endswith("3 apart, where the 14 others reach 1.4 at most")


def test_an_impossible_equation_is_found_among_many() -> None:
    problem = refusal(CHAIN % (8, 1) + '  wall: "x[8]^2 + sin(z[8]) + cos(3*x[8]) = -5"\n')
    assert problem.message.startswith("constraint 'wall' cannot hold")
