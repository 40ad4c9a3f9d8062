"""Spatial chains of bodies: long ones are derived by recursion over their frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal

import mpmath
import numpy as np
import pytest
from mpmath import mpf

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.routes import Tapes
from lagrange_cli.mechanics.dynamics import body_recursion
from lagrange_cli.mechanics.dynamics.inertia import CarryingFrame, TreeInertia
from lagrange_cli.mechanics.dynamics.lagrange import derive_uncertified
from lagrange_cli.mechanics.free_symbols import distinct_parts
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.numerics.elementary import in_decimals, to_decimal, to_mpf
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.scene import read_text
from tests.mechanics.elements.random_trees import random_tree


def chain_of_bodies(number: int, axes: str = "xy") -> str:
    lines = ["parameters: {m: 1.0, l: 0.5, g: 9.81}", "bodies:"]
    for k in range(number):
        on = f"on: b{k - 1}, at: [0, 0, -l], " if k else ""
        turn = f"turn: {{{axes[k % len(axes)]}: q{k}}}"
        lines.append(f"  b{k}: {{{on}{turn}, centre: [0, 0, -l/2], mass: m, inertia: {{rod: l}}}}")
    lines.append(f"coordinates: [{', '.join(f'q{k}' for k in range(number))}]")
    lines.append("potentials: {weight: {gravity: g}}")
    return "\n".join(lines)


def test_equations_of_ten_joints_in_space_are_certified_and_factored() -> None:
    derivation = derive(read_text(chain_of_bodies(10))).derivation
    assert derivation.certificate.mismatch < 1e-20
    assert any("left unexpanded" in remark for remark in derivation.remarks)


def test_equations_of_thirty_joints_in_space_are_certified() -> None:
    equations = derive(read_text(chain_of_bodies(30)))
    assert equations.derivation.certificate.mismatch < 1e-20
    assert equations.system.formulation == "minimal"
    program = build_program(equations, ("acceleration",))
    assert count_operations(program).total < 16_000


@pytest.mark.parametrize("terms", [0, 25])
def test_a_rod_that_turns_about_itself_is_refused_at_its_coordinate(
    terms: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", terms)
    with pytest.raises(InputError, match="coordinate 'q3' has no inertia of its own"):
        derive(read_text(chain_of_bodies(4, "zxy")))


def test_a_steady_spin_about_the_vertical_is_conserved_by_a_long_chain() -> None:
    text = chain_of_bodies(9, "zxy")
    conserved = derive(read_text(text)).derivation.conserved
    assert [c.name for c in conserved] == ["p_q0", "energy"]


@pytest.mark.parametrize("seed", range(6))
def test_recursion_gives_the_equations_that_are_collected(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = read_text(random_tree(seed, 1 + seed).scene())
    collected = derive(scene).system
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", 0)
    recursive = derive(scene).system
    n = len(recursive.coordinates)
    symbols = [*(c.q for c in recursive.coordinates), *(c.v for c in recursive.coordinates)]
    state = dict(zip(symbols, np.random.default_rng(seed).uniform(-1, 1, 2 * n), strict=True))
    numbers = [
        evaluate([*(row[k] for row in s.mass_matrix for k in range(n)), *s.forcing], state)
        for s in (collected, recursive)
    ]
    scale = max(map(abs, numbers[0]))
    assert max(abs(a - b) for a, b in zip(*numbers, strict=True)) <= 1e-13 * scale


@pytest.mark.parametrize("seed", range(6))
def test_inertia_of_numbers_is_that_of_expressions(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", 0)
    derivation = derive_uncertified(reduce(read_text(random_tree(seed, 1 + seed).scene())))
    tree = derivation.inertia
    assert isinstance(tree, TreeInertia)
    tapes = Tapes(derivation)
    random = np.random.default_rng(seed)
    with mpmath.workdps(30), in_decimals():
        point = {s: Decimal(random.uniform(-1, 1)) for s in (*tapes.moving, *tapes.a)}
        rows, _ = tapes.derived_parts(point)
        state = {s: to_mpf(x) for s, x in point.items()}
        exact = [{k: evaluate([e], state)[0] for k, e in row.items()} for row in tree.full]
        scale = max(abs(x) for row in exact for x in row.values())
        for row, expected in zip(rows, exact, strict=True):
            for k in range(tree.size):
                difference = row.get(k, Decimal(0)) - to_decimal(expected.get(k, mpf(0)))
                assert abs(difference) <= Decimal("1e-25") * to_decimal(scale)


def _with(change: Callable[[CarryingFrame], CarryingFrame]) -> Callable[[TreeInertia], TreeInertia]:
    """Change the third frame of a tree."""

    def planted(tree: TreeInertia) -> TreeInertia:
        return replace(tree, frames=(*tree.frames[:2], change(tree.frames[2]), *tree.frames[3:]))

    return planted


def _with_motion(**other: str) -> Callable[[TreeInertia], TreeInertia]:
    """Give one vector of the third joint the value of another of its vectors."""

    def changed(frame: CarryingFrame) -> CarryingFrame:
        (motion,) = frame.motions
        vectors = {name: getattr(motion, source) for name, source in other.items()}
        return replace(frame, motions=(replace(motion, **vectors),))

    return _with(changed)


@pytest.mark.parametrize(
    "mistake",
    [
        pytest.param(_with(lambda f: replace(f, parent=0)), id="a frame below is forgotten"),
        pytest.param(_with(lambda f: replace(f, step=f.step[::-1])), id="the step is another"),
        pytest.param(_with_motion(axis="force"), id="the axis is another"),
        pytest.param(_with_motion(torque="force"), id="the moment of momentum is another"),
        pytest.param(_with_motion(force="torque"), id="the momentum is another"),
    ],
)
def test_mistakes_of_the_inertia_of_a_chain_do_not_pass(
    mistake: Callable[[TreeInertia], TreeInertia],
) -> None:
    derivation = derive_uncertified(reduce(read_text(chain_of_bodies(8))))
    assert isinstance(derivation.inertia, TreeInertia)
    assert certify(derivation, 30, 1).certificate.mismatch < 1e-20
    with pytest.raises(InternalError, match=r"disagree with Newton's law"):
        certify(replace(derivation, inertia=mistake(derivation.inertia)), 30, 1)


def test_code_of_a_long_chain_needs_no_entry_of_its_mass_matrix(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(TreeInertia, "full", property(lambda _: pytest.fail("M was made")))
    EMITTERS["c"].emit(derive(read_text(f"name: chain\n{chain_of_bodies(20)}")))


def test_angles_of_several_coordinates_slides_and_driven_joints_are_recursive_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = """
parameters: {m: 1.0, A: 0.3, g: 9.81, c: 0.2}
bodies:
  a: {at: [s, sin(t), s^2], turn: [z: p + 2*q, x: p*q], centre: [0.1, 0.2, 0], mass: m,
      inertia: [A, A, A]}
  b: {on: a, at: [0.3, q^2, p], turn: [{axis: [1, 2, 2], angle: q + t}], centre: [0, 0.1, 0.3],
      mass: 2*m, inertia: [[0.5, 0.1, 0], [0.1, 0.4, 0.05], [0, 0.05, 0.3]]}
particles:
  bob: {mass: m, position: [p, q, s]}
coordinates: [s, p, q]
potentials: {weight: {gravity: g}, spring: p^2/2 + z_b*s}
forces:
  push: {on: b, force: [1, p, 0]}
  twist: {on: b, torque: [0, q, dot(p)]}
  pull: {on: q, force: -c*dot(q)}
dissipation: {drag: c*dot(s)^2/2}
"""
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", 0)
    assert derive(read_text(text)).derivation.certificate.mismatch < 1e-20


def test_chains_that_are_too_long_beside_constraints_are_refused_at_the_frame() -> None:
    with pytest.raises(InputError) as caught:
        reduce(read_text(chain_of_bodies(30) + "\nconstraints: {end: z_b29 = -1}"))
    (problem,) = caught.value.problems
    assert "this chain of frames is too long" in problem.message
    assert problem.mark is not None
    assert problem.mark.line > 10


def test_places_of_a_chain_share_those_of_the_frames_below() -> None:
    def terms(number: int) -> int:
        places = reduce(read_text(chain_of_bodies(number))).resolved.values()
        return sum(len(part.args) for part in {*distinct_parts(*places)} if part.is_Add)

    shorter, longer, longest = map(terms, (60, 70, 80))
    assert longest - longer == longer - shorter


def test_joints_about_one_axis_are_not_refused() -> None:
    assert len(reduce(read_text(chain_of_bodies(24, "x"))).coordinates) == 24
