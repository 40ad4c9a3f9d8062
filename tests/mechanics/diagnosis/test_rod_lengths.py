"""Rods that the triangle inequality forbids are named, with the path that is too short."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text

PARTICLES = """
name: rods
parameters: {l: 1}
particles:
  A: {mass: 1, position: [xa, ya, za]}
  B: {mass: 1, position: [xb, yb, zb]}
  C: {mass: 1, position: [xc, yc, zc]}
  D: {mass: 1, position: [xd, yd, zd]}
points: {O: [0, 0, 0], P: [10, 0, 0]}
"""


def refused(constraints):
    with pytest.raises(InputError) as caught:
        derive(read_text(PARTICLES + "constraints:\n" + constraints))
    (problem,) = caught.value.problems
    return problem


@pytest.mark.slow
def test_triangle_of_sides_1_1_3():
    problem = refused("""
  ab: {distance: [A, B], equals: l}
  bc: {distance: [B, C], equals: l}
  ca: {distance: [C, A], equals: 3*l}
""")
    assert problem.rule == "inconsistent"
    assert problem.message == (
        "constraints 'ab', 'bc', 'ca' contradict each other: 'A' and 'C' are to be 3 apart,"
        " where 'ab' and 'bc' reach 2 at most"
    )
    assert "'ca'" in problem.hint


@pytest.mark.slow
def test_the_shortest_path_is_named_and_nothing_else():
    problem = refused("""
  far: {distance: [D, O], equals: 3.5}
  oa: {distance: [O, A], equals: 1}
  ab: {distance: [A, B], equals: 1}
  bd: {distance: [B, D], equals: 1}
  around: {distance: [A, D], equals: 2.9}
""")
    assert "'bd', 'ab', 'oa', 'far'" in problem.message
    assert "around" not in problem.message


def test_lengths_between_fixed_points_have_a_range():
    """With a rod of 3 from one end, the other one reaches over 10 by 7 to 13."""
    problem = refused("""
  oa: {distance: [O, A], equals: 3}
  ap: {distance: [A, P], equals: 4}
""")
    snippet = "ap: {distance: [A, P], equals: 12}"
    assert problem.hint == f"'ap' can be 7 to 13 long:\n{snippet}"


@pytest.mark.slow
def test_two_lengths_of_one_rod():
    problem = refused("""
  first: {distance: [A, B], equals: 1}
  second: {distance: [B, A], equals: 2}
""")
    assert "'first'" in problem.message
    assert "'second'" in problem.message


@pytest.mark.slow
def test_a_path_that_just_reaches_is_no_contradiction():
    """A taut chain has a configuration, if only one: it is not refused for its lengths."""
    taut = """
constraints:
  ab: {distance: [A, B], equals: 1}
  bc: {distance: [B, C], equals: 2}
  ca: {distance: [A, C], equals: 3}
"""
    problem = refused(taut.removeprefix("\nconstraints:\n"))
    assert "contradict" not in problem.message
