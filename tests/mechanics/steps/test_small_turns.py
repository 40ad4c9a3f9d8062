"""d'Alembert's principle of bodies by quaternions: Euler's equations, and wrong lines are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest
import sympy as sp

from lagrange_cli.api import loads
from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.dynamics.euler_form import euler_form
from lagrange_cli.mechanics.step_values import DerivationSteps, VirtualWork
from lagrange_cli.mechanics.steps.derive_steps import derive_steps
from lagrange_cli.mechanics.steps.steps_certificate import certify_steps
from lagrange_cli.scene import read_text
from tests.mechanics.dynamics.test_euler_form import FLYING, TOP, on_sphere
from tests.mechanics.steps.test_steps import certified

#: The body that flies with its centre on a sphere, which keeps a multiplier.
TETHERED = (
    FLYING.replace(
        "initial:", "constraints: {rope: x_craft^2 + y_craft^2 + z_craft^2 = 1.04}\ninitial:"
    )
    .replace("at: [x, y, z]", "at: [x, y, z]\n    centre: [0, 0, 0.2]")
    .replace("x: 0", "x: 1")
)


@cache
def small_turns(text: str) -> DerivationSteps:
    return derive_steps(*certified(text), "dalembert")


@pytest.mark.parametrize("text", [TOP, FLYING])
def test_the_coefficients_of_small_turns_are_eulers_equations(text: str) -> None:
    """Of one body they are those that the derivation has, certified by another route."""
    derivation, _, _ = certified(text)
    form = euler_form(derivation)
    assert form is not None
    steps = small_turns(text)
    turns = [parts for parts in steps.balances if parts.displacement.axis]
    assert [parts.displacement.axis for parts in turns] == ["1", "2", "3"]
    quaternion = [derivation.reduced.coordinates[k].q for k in form.numbers]
    for k, parts in enumerate(turns):
        by_hand = form.inertia[k] - form.gyroscopic[k] - form.torques[k]
        by_hand = by_hand.xreplace(dict(zip(spins(form.body), form.spins, strict=True)))
        shown = parts.whole.xreplace(dict(zip(spins(form.body), form.spins, strict=True)))
        assert on_sphere(shown - by_hand, quaternion)
        assert not parts.terms[0][1].is_number


def spins(body: str) -> list[sp.Symbol]:
    return [sp.Symbol(f"omega_{axis}({body})", real=True) for axis in "123"]


@pytest.mark.slow
def test_multipliers_of_other_constraints_push_along_small_turns() -> None:
    turns = [parts for parts in small_turns(TETHERED).balances if parts.displacement.axis]
    held = [str(factor) for parts in turns for _, factor in parts.terms]
    assert "lambda_rope" in held
    assert "lambda_unit_craft" not in held


def test_the_text_has_small_turns_and_no_multiplier_of_the_length() -> None:
    text = loads(TOP).derive(steps="dalembert").text()
    assert "δq0 = -½ (q1 δφ_1 + q2 δφ_2 + q3 δφ_3)" in text
    assert "δx_top = h (1 - 2 q2² - 2 q3²) δφ_2 + 2 h (q0 q3 - q1 q2) δφ_1" in text
    assert "The δφ_1, δφ_2 and δφ_3 are independent" in text
    assert "A ω̇_1 - (A - C) ω_2 ω_3 - 2 m g h (q0 q1 + q2 q3) = 0" in text
    assert "λ_unit" not in text


def test_virtual_work_at_rest_is_that_of_small_turns() -> None:
    text = loads(TOP).derive(steps="virtual-work").text()
    assert "Q_φ_1 = Σ_i F_i · ∂r_i/∂φ_1 = 2 m g h (q0 q1 + q2 q3) = 0" in text
    assert "Q_φ_3 = Σ_i F_i · ∂r_i/∂φ_3 = 0" in text
    solutions = text.partition("Equilibrium\n")[2].partition("Certified")[0]
    assert "-1" not in solutions, "q and -q are one turn"
    assert solutions.count("= 1\n") == 4


#: A wheel on a body by a quaternion, whose angular velocity has a part of the body's.
ROTOR = """
name: rotor
parameters: {m: 1.3, A: 1.1, J: 0.2, k: 0.3}
bodies:
  base: {turn: {quaternion: [q0, q1, q2, q3]}, mass: m, inertia: [A, A, 2*A]}
  wheel: {on: base, turn: {z: theta}, mass: m, inertia: [J, J, J]}
coordinates: [q0, q1, q2, q3, theta]
potentials: {spring: k*theta^2/2}
initial: {q0: 1, q1: 0, q2: 0, q3: 0, theta: 0}
"""


@pytest.mark.slow
def test_bodies_on_one_that_turns_freely_rest_with_it() -> None:
    """The inertia of the wheel is in the coefficients of the body's turns, and vanishes at rest."""
    moving = loads(ROTOR).derive(steps="dalembert").text()
    assert "2 A ω̇_3_base + J ω̇_3_wheel = 0" in moving
    at_rest = loads(ROTOR).derive(steps="virtual-work").text().partition("Principle of")[2]
    assert "ω̇" not in at_rest
    assert "Q_φ_3_base = Σ_i F_i · ∂r_i/∂φ_3_base = 0" in at_rest


def test_json_has_the_axes_and_equations_of_small_turns() -> None:
    equations = loads(TOP).derive(steps="dalembert").report()["steps"]["virtual_work"]
    assert [(one["coordinate"], one["axis"]) for one in equations] == [
        ("top", axis) for axis in "123"
    ]
    assert equations[2]["residual"] == "C*dot(omega_3(top))"


NEARLY = 1 + sp.Rational(1, 10**20)


def by_parts(change: Callable[[VirtualWork], VirtualWork]) -> Callable[..., DerivationSteps]:
    def wrong(steps: DerivationSteps) -> DerivationSteps:
        first, *others = steps.balances
        return replace(steps, balances=(change(first), *others))

    return wrong


def with_rates(change: Callable[[sp.Symbol, sp.Expr], sp.Expr]) -> Callable[..., DerivationSteps]:
    def wrong(parts: VirtualWork) -> VirtualWork:
        rates = tuple((q, change(q, g)) for q, g in parts.displacement.rates)
        return replace(parts, displacement=replace(parts.displacement, rates=rates))

    return by_parts(wrong)


def of_body(change: Callable[..., object]) -> Callable[..., DerivationSteps]:
    def wrong(steps: DerivationSteps) -> DerivationSteps:
        (body,) = steps.bodies
        return replace(steps, bodies=(change(body),))

    return wrong


WRONG: dict[str, Callable[[DerivationSteps], DerivationSteps]] = {
    "a turn that is too large": with_rates(lambda q, g: NEARLY * g),
    "a turn that changes the length": with_rates(lambda q, g: g + q / 10**20),
    "the equation": by_parts(
        lambda parts: replace(
            parts, terms=(*parts.terms[1:], (NEARLY * parts.terms[0][0], sp.S(1)))
        )
    ),
    "inertia": by_parts(lambda parts: replace(parts, inertia=NEARLY * parts.inertia)),
    "work": by_parts(lambda parts: replace(parts, work=-parts.work)),
    "angular momenta": by_parts(lambda parts: replace(parts, turning=NEARLY * parts.turning)),
    "a place": of_body(
        lambda body: replace(
            body,
            components=tuple(
                replace(p, slopes=tuple((s, NEARLY * e) for s, e in p.slopes))
                for p in body.components
            ),
        )
    ),
    "a place left out": of_body(
        lambda body: replace(
            body, components=tuple(replace(p, slopes=p.slopes[1:]) for p in body.components)
        )
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_no_wrong_line_of_a_small_turn_passes(name: str) -> None:
    wrong = WRONG[name](small_turns(TOP))
    with pytest.raises(InternalError, match="a step of the derivation disagrees"):
        certify_steps(*certified(TOP), wrong, {})


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("bodies:\n", "frames: {arm: {turn: {z: theta}}}\nbodies:\n"),
        ("turn: {quaternion: [q0, q1, q2, q3]}", "turn: [quaternion: [q0, q1, q2, q3], z: theta]"),
    ],
)
def test_quaternions_that_do_not_alone_turn_a_body_are_refused(old: str, new: str) -> None:
    text = TOP.replace(old, new).replace("q2, q3]\npot", "q2, q3, theta]\npot")
    if "arm" in text:
        text = text.replace("    turn:", "    on: arm\n    turn:")
    with pytest.raises(InputError, match="quaternion of 'top' is not the only turn") as refusal:
        derive(read_text(text), steps="dalembert")
    (problem,) = refusal.value.problems
    assert problem.mark is not None
    assert problem.mark.line > 1
