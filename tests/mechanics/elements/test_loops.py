"""Closed loops of bodies: what joints count, which equations are redundant, two formulations."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mpf

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive, reduce
from lagrange_cli.mechanics.numerics.rank import dependent_rows, normalized_row
from lagrange_cli.mechanics.reduction.coordinates import manifold_of, sampler_of
from lagrange_cli.scene import read_text
from tests.mechanics.elements.random_loops import Loop, Motion, planar_loop, spatial_loop

FREE = """
{plane}bodies:
  one: {{at: [x, {y}, z], turn: {turn}, mass: 1, inertia: {moments}}}
frames: {{mark: {{at: [{p}]}}}}
points: {{p: {{on: one, at: [0.1, 0, 0.2]}}}}
constraints: {{joint: {joint}}}
coordinates: [{coordinates}]
{near}
"""
IN_SPACE = {
    "plane": "",
    "y": "y",
    "turn": "[z: a, x: b, y: c]",
    "moments": "[1, 1, 1]",
    "coordinates": "x, y, z, a, b, c",
    "p": "1, 2, 3",
    "near": "near: {x: 1, y: 2, z: 3, a: 0, b: 0, c: 0}",
}
BY_QUATERNION = IN_SPACE | {
    "turn": "{quaternion: [a, b, c, d]}",
    "coordinates": "x, y, z, a, b, c, d",
    "near": "near: {x: 1, y: 2, z: 3, a: 1, b: 0, c: 0, d: 0}",
}
IN_PLANE = {
    "plane": "plane: xz\n",
    "y": "0",
    "turn": "a",
    "moments": "1",
    "coordinates": "x, z, a",
    "p": "1, 0, 3",
    "near": "near: {x: 1, z: 3, a: 0}",
}


@pytest.mark.parametrize(
    ("joint", "in_plane", "in_space"),
    [
        ("{pin: [origin, p]}", 2, 3),
        ("{parallel: [[x, one], [1, 0, 0]]}", 1, 2),
        ("{parallel: [[[1, 0, 2], one], [[1, 0, 2], mark]]}", 1, 2),
        ("{weld: [one, mark]}", 3, 6),
        ("{touch: one, radius: 3, on: {normal: z}}", 1, 1),
    ],
)
def test_a_joint_counts_the_equations_that_it_stands_for(
    joint: str, in_plane: int, in_space: int
) -> None:
    for base, count in (
        (IN_PLANE, in_plane),
        (IN_SPACE, in_space),
        (BY_QUATERNION, in_space),
    ):
        account = reduce(read_text(FREE.format(joint=joint, **base))).account
        assert account.constraints == count
        assert account.dof == account.of_bodies - count


BRICARD = """
bodies:
  b1: {turn: {y: q1}, centre: [0, 0, -0.5], mass: 1,
       inertia: {rod: 1}}
  b2: {on: b1, at: [0, 0, -1], turn: {x: q2}, centre: [0, 0.5, 0], mass: 1,
       inertia: {rod: 1, axis: y}}
  b3: {on: b2, at: [0, 1, 0], turn: {z: q3}, centre: [0.5, 0, 0], mass: 1,
       inertia: {rod: 1, axis: x}}
  b4: {on: b3, at: [1, 0, 0], turn: {y: q4}, centre: [0, 0, 0.5], mass: 1,
       inertia: {rod: 1}}
  b5: {on: b4, at: [0, 0, 1], turn: {x: q5}, centre: [0, -0.5, 0], mass: 1,
       inertia: {rod: 1, axis: y}}
"""
HINGE = """
points: {end: {on: b5, at: [0, -1, 0]}, base: [1, 0, 0]}
constraints: {point: {pin: [end, base]}, axis: {parallel: [[z, b5], z]}}
coordinates: [q1, q2, q3, q4, q5]
"""
WELD = """
frames: {end: {on: b5, at: [0, -1, 0], turn: {z: q6}}, base: {at: [1, 0, 0]}}
constraints: {loop: {weld: [end, base]}}
coordinates: [q1, q2, q3, q4, q5, q6]
"""


@pytest.mark.parametrize(
    ("closing", "said"),
    [
        (HINGE, "1 of the 2 equations of constraint 'axis' is redundant: implied by its others"),
        (WELD, "1 of the 6 equations of constraint 'loop' is redundant: implied by its others"),
    ],
)
def test_bricards_linkage_moves_since_one_equation_is_redundant(closing: str, said: str) -> None:
    # R. Bricard's orthogonal linkage, as in IFToMM's library of benchmarks: six rods of 1 m.
    near = ", ".join(f"q{k}: 0" for k in range(1, 7 if closing is WELD else 6))
    reduced = reduce(read_text(f"{BRICARD}{closing}near: {{{near}}}\n"))
    assert reduced.account.dof == 1
    (warning,) = reduced.warnings
    assert said in warning.message


@pytest.mark.parametrize("seed", range(8))
def test_points_on_bricards_linkage_are_drawn_on_the_branch_of_its_start(seed: int) -> None:
    # Its closures are of another rank on branches a quarter of a turn away, and thousands of turns
    # away, where Newton's method leaps.
    start = ", ".join(f"q{k}: 0" for k in range(1, 6))
    reduced = reduce(read_text(f"{BRICARD}{HINGE}near: {{{start}}}\n"))
    manifold = manifold_of(reduced.chart, reduced.closures)
    sampler = sampler_of(reduced.chart, [], manifold, seed=str(seed))
    far, near = sampler.draw(), sampler.draw(width=mpf(1) / 8)
    assert far is not None
    assert all(abs(far[q]) < 2 * np.pi for q in sampler.coordinates)
    assert near is not None
    rows = [normalized_row(row) for row in manifold.slopes(near)]
    assert len(rows) == 4
    assert not dependent_rows(rows)


def test_a_planar_loop_of_hinges_in_space_has_three_equations_that_say_nothing() -> None:
    text = """
bodies:
  crank: {turn: {y: q1}, mass: 1,
       inertia: {rod: 1, axis: x}}
  coupler: {on: crank, at: [1, 0, 0], turn: {y: q2}, mass: 1, inertia: {rod: 2, axis: x}}
  rocker: {at: [2, 0, 0], turn: {y: q3}, mass: 1,
       inertia: {rod: 1.5, axis: x}}
points: {A: {on: coupler, at: [2, 0, 0]}, B: {on: rocker, at: [1.5, 0, 0]}}
constraints: {point: {pin: [A, B]}, axis: {parallel: [[y, coupler], [y, rocker]]}}
coordinates: [q1, q2, q3]
near: {q1: 1, q2: -0.5, q3: 1.2}
"""
    reduced = reduce(read_text(text))
    account = reduced.account
    assert account.dof == 1
    assert [w.hint for w in reduced.warnings] == [
        "redundant: y_A = y_B",
        "redundant: y of coupler is parallel to y of rocker, 1;"
        " y of coupler is parallel to y of rocker, 2",
    ]
    assert [(line.name, line.idle, len(line.equations)) for line in account.lines] == [
        ("point", 1, 3),
        ("axis", 2, 2),
    ]


def test_a_hinge_that_is_stated_twice_is_redundant() -> None:
    joints = "{pin: [origin, p]}, again: {pin: [p, origin]}"
    reduced = reduce(read_text(FREE.format(joint=joints, **IN_SPACE)))
    assert reduced.account.constraints == 3
    (warning,) = reduced.warnings
    assert "3 of the 3 equations of constraint 'again' are redundant: implied by 'joint'" in (
        warning.message
    )


LOOPS = [(planar_loop, seed) for seed in range(40)] + [(spatial_loop, seed) for seed in range(10)]


@pytest.mark.parametrize(
    ("draw", "seed"),
    [
        pytest.param(*case, marks=() if k % 10 == 0 else pytest.mark.campaign)
        for k, case in enumerate(LOOPS)
    ],
)
def test_two_formulations_of_a_loop_agree(draw: type[Loop], seed: int) -> None:
    loop = draw(seed)
    derived = [derive(read_text(scene)) for scene in loop.scenes]
    assert derived[0].derivation.account.dof == derived[1].derivation.account.dof
    motions = [Motion(e, state) for e, state in zip(derived, loop.states, strict=True)]
    assert all(motion.missed < 1e-12 for motion in motions)
    source = np.random.default_rng(seed)
    first = motions[0].velocity({name: source.uniform(-1, 1) for name in loop.common})
    wanted = {name: first[motions[0].names.index(name)] for name in loop.common}
    second = motions[1].velocity(wanted)
    for name, rate in wanted.items():
        assert second[motions[1].names.index(name)] == pytest.approx(rate, abs=1e-10)
    one, other = motions[0].accelerations(first), motions[1].accelerations(second)
    scale = max(1.0, *map(abs, one.values()))
    for name in loop.common:
        assert abs(one[name] - other[name]) <= 1e-9 * scale


SLIDER = """
plane: xz
bodies:
  crank: {turn: q1, mass: 1, inertia: 1}
  rod: {on: crank, at: [1, 0, 0], turn: q2, mass: 1, inertia: 1}
  block: {at: [s, 0, 0], mass: 1, inertia: 1}
points: {end: {on: rod, at: [3, 0, 0]}, pin: {on: block}, far: [9, 0, 0], near: {on: crank}}
constraints: {loop: {pin: [end, %s]}}
coordinates: [q1, q2%s]
near: {q1: 1, q2: -1, s: 3}
"""


def test_coordinates_of_joints_may_all_be_declared() -> None:
    # The closure gives s in closed form: with the name declared it stays beside the others.
    for declared, count in (("", 2), (", s", 3)):
        reduced = reduce(read_text(SLIDER % ("pin", declared)))
        assert reduced.account.dof == 1
        assert len(reduced.coordinates) == count


def test_a_loop_that_cannot_close_is_refused_at_the_joint() -> None:
    with pytest.raises(InputError) as caught:
        reduce(read_text(SLIDER % ("far", ", s")))
    problem = caught.value.problems[0]
    assert "'loop'" in problem.message
    assert problem.mark is not None
    assert problem.mark.line == 8


def test_a_weld_does_not_close_the_other_way_round() -> None:
    text = FREE.format(joint="{weld: [one, mark]}", **IN_PLANE).replace("near:", "initial:")
    assert derive(read_text(text)).system.initial is not None
    with pytest.raises(InputError, match="the axes of 'one' and 'mark' are turned against"):
        derive(read_text(text.replace("a: 0", "a: pi")))
