"""Euler's equations of one body: torques and rates by hand, and wrong forms are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest
import sympy as sp

from lagrange_cli.api import loads
from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import Evidence, certify
from lagrange_cli.mechanics.certify.printed import certify_euler
from lagrange_cli.mechanics.dynamics.euler_form import euler_form
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import EulerForm
from lagrange_cli.scene import read_text
from tests.mechanics.steps.test_turning_steps import is_zero

#: A top about its fixed point, beside which its centre of mass is.
TOP = """
name: top
parameters: {m: 0.2, h: 0.05, A: 8e-4, C: 2e-4, g: 9.81}
bodies:
  top:
    turn: {quaternion: [q0, q1, q2, q3]}
    mass: m
    centre: [0, 0, h]
    inertia: {about: origin, moments: [A, A, C]}
coordinates: [q0, q1, q2, q3]
potentials: {weight: {gravity: g}}
initial: {q0: 1, q1: 0, q2: 0, q3: 0}
"""

#: A body that flies, with a product of inertia, and torques along its axes and those of space.
FLYING = """
name: flying
parameters: {m: 1.3, A: 1.1, B: 1.4, C: 1.9, D: 0.1, u: 0.2, c: 0.3, g: 9.81}
bodies:
  craft:
    at: [x, y, z]
    turn: {quaternion: [q0, q1, q2, q3]}
    mass: m
    inertia: [[A, D, 0], [D, B, 0], [0, 0, C]]
coordinates: [x, y, z, q0, q1, q2, q3]
potentials: {weight: {gravity: g}}
forces:
  wheel: {on: craft, torque: [0, 0, u], axes: craft}
  wind: {on: craft, torque: [c, 0, 0]}
dissipation: {air: c*omega_2(craft)^2/2}
initial: {x: 0, y: 0, z: 0, q0: 1, q1: 0, q2: 0, q3: 0}
"""

#: The top by Euler's angles.
ANGLES = (
    TOP.replace("{quaternion: [q0, q1, q2, q3]}", "[z: phi, x: theta, z: psi]")
    .replace("[q0, q1, q2, q3]", "[phi, theta, psi]")
    .replace("{q0: 1, q1: 0, q2: 0, q3: 0}", "{phi: 0, theta: 0.3, psi: 0}")
)


@cache
def certified(text: str) -> tuple[Uncertified, Evidence, EulerForm]:
    derivation = derive_uncertified(reduce(read_text(text)))
    form = euler_form(derivation)
    assert form is not None
    return derivation, certify(derivation, 30, 2), form


def rotation(quaternion: list[sp.Symbol]) -> sp.Matrix:
    a, b, c, d = quaternion
    cross = sp.Matrix([[0, -d, c], [d, 0, -b], [-c, b, 0]])
    return sp.eye(3) + 2 * a * cross + 2 * cross * cross


def on_sphere(expression: sp.Expr, quaternion: list[sp.Symbol]) -> bool:
    """Say whether an expression vanishes where the quaternion has length 1."""
    lengths = dict(zip(quaternion, map(sp.Rational, ("1/5", "2/5", "2/5", "4/5")), strict=True))
    return is_zero(expression.xreplace(lengths))


@pytest.mark.parametrize("text", [TOP, FLYING])
def test_torques_are_those_by_hand(text: str) -> None:
    derivation, evidence, form = certified(text)
    certify_euler(evidence, derivation, form)
    names = derivation.reduced.names.parameters
    quaternion = [derivation.reduced.coordinates[k].q for k in form.numbers]
    axes = rotation(quaternion).T
    if text == TOP:
        arm, weight = sp.Matrix([0, 0, names["h"]]), sp.Matrix([0, 0, -names["m"] * names["g"]])
        torque = arm.cross(axes * weight)
    else:
        second = sp.Symbol("omega_2(craft)", real=True)
        drag = sp.Matrix([0, -names["c"] * second, 0])
        torque = axes * sp.Matrix([names["c"], 0, 0]) + sp.Matrix([0, 0, names["u"]]) + drag
    for shown, by_hand in zip(form.torques, torque, strict=True):
        assert on_sphere(shown - by_hand, quaternion)


def test_a_top_by_eulers_angles_has_the_equations_of_books() -> None:
    """ω by Euler's angles as in section 35 of Landau and Lifshitz, solved by hand."""
    derivation, evidence, form = certified(ANGLES)
    certify_euler(evidence, derivation, form)
    _, theta, psi = (c.q for c in derivation.reduced.coordinates)
    first, second, third = (sp.Symbol(f"omega_{axis}(top)", real=True) for axis in "123")
    around = first * sp.sin(psi) + second * sp.cos(psi)
    by_hand = (
        around / sp.sin(theta),
        first * sp.cos(psi) - second * sp.sin(psi),
        third - around * sp.cos(theta) / sp.sin(theta),
    )
    for shown, rate in zip(form.rates, by_hand, strict=True):
        assert is_zero(shown - rate)
    names = derivation.reduced.names.parameters
    weight = names["m"] * names["g"] * names["h"] * sp.sin(theta)
    torques = (weight * sp.cos(psi), -weight * sp.sin(psi), 0)
    for shown, torque in zip(form.torques, torques, strict=True):
        assert is_zero(shown - torque)


NEARLY = 1 + sp.Rational(1, 10**20)


def scaled(field: str) -> Callable[[EulerForm], EulerForm]:
    def wrong(form: EulerForm) -> EulerForm:
        first, *others = getattr(form, field)
        return replace(form, **{field: (NEARLY * first, *others)})

    return wrong


WRONG: dict[str, Callable[[EulerForm], EulerForm]] = {
    **{field: scaled(field) for field in ("inertia", "gyroscopic", "torques", "rates")},
    "T": lambda form: replace(form, kinetic=NEARLY * form.kinetic),
    "sign": lambda form: replace(form, gyroscopic=tuple(-e for e in form.gyroscopic)),
}


@pytest.mark.parametrize("text", [FLYING, ANGLES])
@pytest.mark.parametrize("name", WRONG)
def test_no_wrong_form_passes(name: str, text: str) -> None:
    derivation, evidence, form = certified(text)
    with pytest.raises(InternalError, match="Euler's equations"):
        certify_euler(evidence, derivation, WRONG[name](form))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mass: m\n", "mass: m\n    centre: [0, 0, 0.1]\n"),
        ("bodies:\n", "particles: {p: {mass: 1, position: [x + 1, y, z]}}\nbodies:\n"),
        ("dissipation:", "kinetic: {rotor: A*omega_3(craft)^2}\ndissipation:"),
    ],
)
def test_other_systems_have_lagranges_equations(old: str, new: str) -> None:
    """The centre beside the origin of a body that flies, another mass, inertia of the scene's."""
    text = FLYING.replace(old, new)
    assert text != FLYING
    assert euler_form(derive_uncertified(reduce(read_text(text)))) is None


@pytest.mark.parametrize(
    "turn", ["[z: phi, x: theta, z: psi + 3*t]", "[z: phi, x: theta + psi]", "[z: phi]"]
)
def test_turns_without_three_free_rates_have_lagranges_equations(turn: str) -> None:
    text = ANGLES.replace("[z: phi, x: theta, z: psi]", turn)
    scene = (
        text
        if "psi" in turn
        else text.replace(", theta, psi]", "]").replace(", theta: 0.3, psi: 0", "")
    )
    assert euler_form(derive_uncertified(reduce(read_text(scene)))) is None


@pytest.mark.parametrize("place", ["[q1, 0, 0]", "[sin(3*t), 0, 0]"])
def test_a_pivot_that_moves_has_lagranges_equations(place: str) -> None:
    text = TOP.replace("    mass: m", f"    at: {place}\n    mass: m")
    assert text != TOP
    assert euler_form(derive_uncertified(reduce(read_text(text)))) is None


def test_the_text_has_eulers_equations_without_a_multiplier() -> None:
    text = loads(TOP).derive().text()
    assert "A ω̇_1 = (A - C) ω_2 ω_3 + 2 m g h (q0 q1 + q2 q3)" in text
    assert "A ω̇_2 = (C - A) ω_3 ω_1 + 2 m g h (q0 q2 - q1 q3)" in text
    assert "C ω̇_3 = 0" in text
    assert "T = ½ A (ω_1² + ω_2²) + ½ C ω_3²" in text
    assert "λ" not in text
    assert "C*dot(omega_3(top)) = 0" in loads(TOP).derive().text(ascii=True)


def test_the_text_of_angles_has_eulers_equations_where_they_are_asked_for() -> None:
    derivation = loads(ANGLES).derive()
    text = derivation.text(form="euler")
    assert "A ω̇_2 = (C - A) ω_3 ω_1 - m g h sin θ sin ψ" in text
    assert "so that the angles change at the rates" in text
    assert "φ̇ = (ω_1 sin ψ + ω_2 cos ψ) / sin θ" in text
    assert "ω_1" not in derivation.text()
    with_steps = loads(ANGLES).derive(steps="lagrange").text(form="euler")
    assert "A ω̇_2 = (C - A) ω_3 ω_1 - m g h sin θ sin ψ" in with_steps


def test_json_has_eulers_equations_where_they_print() -> None:
    angles, quaternion = (loads(text).derive() for text in (ANGLES, TOP))
    report = angles.report(form="euler")
    assert report["euler"]["equations"][2] == {
        "spin": "omega_3(top)",
        "residual": "C*dot(omega_3(top))",
    }
    assert report["euler"]["rates"]["theta"] == "omega_1(top)*cos(psi) - omega_2(top)*sin(psi)"
    assert report["equations"] == angles.report()["equations"]
    assert "euler" not in angles.report()
    assert list(quaternion.report()["euler"]["rates"]) == ["q0", "q1", "q2", "q3"]


def test_other_systems_are_refused() -> None:
    derivation = loads(FLYING.replace("mass: m", "mass: m\n    centre: [0, 0, 0.1]")).derive()
    with pytest.raises(InputError, match=":1:1: 'flying' is not one rigid body that a quaternion"):
        derivation.text(form="euler")
    with pytest.raises(InputError, match="--form lagrange writes"):
        derivation.report(form="euler")
