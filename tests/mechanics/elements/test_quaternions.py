"""Bodies that turn by quaternions of length 1: counts, certificate, motions by Euler's angles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.dynamics import body_recursion
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import simulate

#: A body off its centre of mass with an arm on it, hung by a spring and pushed by a torque.
FREE = """
parameters: {m: 1, A: 0.3, B: 0.4, C: 0.2, l: 0.3, k: 10, g: 9.81}
bodies:
  base: {at: [x, y, z], turn: TURN, centre: [0.1, 0, 0.05], mass: m, inertia: [A, B, C]}
  arm: {on: base, at: [l, 0, 0], turn: {y: s}, centre: [0, 0, -0.2], mass: 0.5,
        inertia: [0.01, 0.02, 0.01]}
points: {hook: {on: base, at: [0, l, 0]}, o: [0, 0, 0]}
coordinates: [x, y, z, ANGLES, s]
potentials: {weight: {gravity: g}, string: {spring: [hook, o], stiffness: k, length: 0.1}}
forces: {motor: {on: arm, torque: [0.1, 0.2, 0.3*cos(t)], axes: base}}
outputs: {w1: omega_1(base), wz: omega_z(base)}
simulate: {until: 1.5, accuracy: 1e-9, samples: 16}
initial: {x: 0.1, y: 0, z: 0, s: 0.2, dot(x): 0.2, dot(y): 0, dot(z): 0, dot(s): 1, START}
"""

BY_QUATERNION = (
    FREE.replace("TURN", "{quaternion: [q0, q1, q2, q3]}")
    .replace("ANGLES", "q0, q1, q2, q3")
    .replace(
        "START",
        "q0: cos(0.5), q1: sin(0.5), q2: 0, q3: 0, dot(q1): cos(0.5)/5, dot(q0): -sin(0.5)/5",
    )
)
BY_ANGLES = (
    FREE.replace("TURN", "[z: a, x: b, z: c]")
    .replace("ANGLES", "a, b, c")
    .replace("START", "a: 0, b: 1, c: 0, dot(a): 0, dot(b): 0.4, dot(c): 0")
)


@pytest.fixture(params=[body_recursion.CHAIN_TERMS, 0], ids=["collected", "by recursion"])
def route(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Derive as short chains are, and as long ones."""
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", request.param)


def test_four_parts_are_three_freedoms() -> None:
    reduced = reduce(read_text(BY_QUATERNION))
    assert (reduced.account.of_bodies, reduced.account.constraints, reduced.account.dof) == (
        12,
        5,
        7,
    )
    assert reduced.account.implied == 5
    assert [closure.name for closure in reduced.closures] == ["unit_base"]


@pytest.mark.usefixtures("route")
def test_motions_are_those_by_eulers_angles() -> None:
    one, two = (simulate(derive(read_text(text))) for text in (BY_QUATERNION, BY_ANGLES))
    assert one.status == two.status == "ok"
    columns, expected = one.columns, two.columns
    for name in ("x", "s", "x_hook", "z_hook", "x_arm", "y_arm", "w1", "wz"):
        assert columns[name] == pytest.approx(expected[name], abs=3e-9)
    squares = sum(columns[f"q{k}"] ** 2 for k in range(4))
    assert np.abs(squares - 1).max() < 4e-16


def _off(name: str) -> Callable[[Uncertified], Uncertified]:
    """Put another value of a parameter into f."""

    def changed(derivation: Uncertified) -> Uncertified:
        known = sp.Symbol(name, real=True)
        other = {known: known * sp.Rational(1001, 1000)}
        forcing = tuple(tuple(t.xreplace(other) for t in terms) for terms in derivation.forcing)
        assert forcing != derivation.forcing
        return replace(derivation, forcing=forcing)

    return changed


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("mistake", [_off("A"), _off("C"), _off("g")])
def test_mistakes_across_the_quaternion_do_not_pass(
    mistake: Callable[[Uncertified], Uncertified],
) -> None:
    derivation = derive_uncertified(reduce(read_text(BY_QUATERNION)))
    with pytest.raises(InternalError, match=r"disagree with Newton's law"):
        certify(mistake(derivation), 30, 4)


def test_a_length_that_is_not_1_is_refused_with_its_place() -> None:
    text = BY_QUATERNION.replace("q0: cos(0.5)", "q0: 0.9")
    with pytest.raises(InputError) as caught:
        simulate(derive(read_text(text)))
    (problem,) = caught.value.problems
    assert "violate constraint 'unit_base'" in problem.message
    assert problem.mark is not None


def test_two_quaternions_of_one_body_are_refused_at_the_coordinate() -> None:
    """A ball joint on a frame without mass turns what is free to turn."""
    body = "{turn: [quaternion: [p0, p1, p2, p3], quaternion: [e0, e1, e2, e3]], mass: 1"
    scene = f"bodies: {{b: {body}, inertia: [1, 2, 2.5]}}}}\n"
    scene += "coordinates: [p0, p1, p2, p3, e0, e1, e2, e3]\n"
    with pytest.raises(InputError, match=r"coordinate '[pe]1' has no inertia of its own"):
        derive(read_text(scene))


@pytest.mark.usefixtures("route")
def test_a_quaternion_on_a_turning_body_has_the_motion_of_its_angles() -> None:
    """A gyroscope on a ball joint at the end of a driven arm, both off their centres."""
    scene = """
parameters: {g: 9.81}
bodies:
  arm: {turn: [z: a, x: t], centre: [0.1, 0.2, 0.1], mass: 2, inertia: [0.1, 0.2, 0.15]}
  top: {on: arm, at: [0.5, 0, a], turn: TURN, centre: [0, 0.1, 0.2], mass: 1,
        inertia: [0.02, 0.03, 0.01]}
coordinates: [a, ANGLES]
potentials: {weight: {gravity: g}}
forces: {wind: {on: top, force: [0.3, cos(t), 0]}}
simulate: {until: 1, accuracy: 1e-9, samples: 6}
initial: {a: 0.2, dot(a): 1, START}
"""
    parts = {"TURN": "{quaternion: [p0, p1, p2, p3]}", "ANGLES": "p0, p1, p2, p3"}
    parts["START"] = "p0: cos(0.2), p1: sin(0.2), p2: 0, p3: 0, dot(p1): 2*cos(0.2)"
    angles = {"TURN": "[x: b, y: c, z: d]", "ANGLES": "b, c, d"}
    angles["START"] = "b: 0.4, c: 0, d: 0, dot(b): 4, dot(c): 0, dot(d): 0"
    motions = []
    for words in (parts, angles):
        text = scene
        for word, meaning in words.items():
            text = text.replace(word, meaning)
        motions.append(simulate(derive(read_text(text))))
    for name in ("a", "x_top", "y_top", "z_top", "dot(a)"):
        one, two = (motion.columns[name] for motion in motions)
        assert one == pytest.approx(two, abs=5e-9)


def test_a_long_chain_on_a_body_that_floats_is_derived_by_recursion() -> None:
    """Parts of quaternions are of size 1, also where the body falls without turning."""
    links = 14
    lines = ["parameters: {g: 9.81}", "bodies:"]
    lines += ["  base: {at: [x, y, z], turn: {quaternion: [p0, p1, p2, p3]}, mass: 2,"]
    lines += ["         inertia: [0.2, 0.3, 0.4]}"]
    for k in range(links):
        on = f"l{k - 1}" if k else "base"
        lines += [
            f"  l{k}: {{on: {on}, at: [0.1, 0, 0.2], turn: {{{'xyz'[k % 3]}: s{k}}}, mass: 1,"
        ]
        lines += ["       inertia: [0.01, 0.02, 0.015]}"]
    names = ["x", "y", "z", *(f"p{k}" for k in range(4)), *(f"s{k}" for k in range(links))]
    start = {name: int(name == "p0") for name in names} | {f"dot({n})": 0 for n in names}
    lines += [f"coordinates: [{', '.join(names)}]", "potentials: {weight: {gravity: g}}"]
    lines += [f"initial: {{{', '.join(f'{n}: {v}' for n, v in start.items())}}}"]
    lines += ["simulate: {until: 0.5, accuracy: 1e-6, samples: 3}"]
    equations = derive(read_text("\n".join(lines)))
    assert equations.derivation.sources is not None
    assert equations.derivation.sources.tree is not None
    motion = simulate(equations)
    assert motion.status == "ok"
    assert motion.columns["z"][-1] == pytest.approx(-9.81 / 8, rel=1e-12)
