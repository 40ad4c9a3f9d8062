"""Steps of rigid bodies: angular velocities, angular momenta and torques beside SymPy's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import mpmath
import pytest
import sympy as sp

from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.step_values import (
    BodySteps,
    DerivationSteps,
    SpinSteps,
    TurningSteps,
)
from lagrange_cli.mechanics.steps.derive_steps import derive_steps
from lagrange_cli.mechanics.steps.steps_certificate import certify_steps
from lagrange_cli.scene import read_text
from tests.mechanics.steps.test_steps import by_sympy, certified

#: A body with products of inertia and a centre beside its origin, turned by two angles on a turned
#: frame, with a torque along the axes of space, one along its own, and a force.
BODY = """
name: body
parameters: {m: 1.3, a: 0.2, b: 0.1, A: 1.1, B: 1.4, C: 1.9, D: 0.1, w: 2, c: 0.3}
frames: {table: {turn: {z: w*t}}}
bodies:
  arm:
    on: table
    at: [a, 0, 0]
    turn: [x: p, y: q]
    mass: m
    centre: [0, b, 0]
    inertia: [[A, D, 0], [D, B + m*b^2, 0], [0, 0, C]]
coordinates: [p, q]
forces:
  push: {on: arm, force: [c, 0, c*p]}
  wind: {on: arm, torque: [c, 0, c*q]}
  motor: {on: arm, torque: [0, c, 0], axes: arm}
potentials: {weight: {gravity: 9.81}}
initial: {p: 0.3, q: 0.2}
"""


@cache
def body_steps() -> DerivationSteps:
    return derive_steps(*certified(BODY), "dalembert")


def turning(steps: DerivationSteps) -> TurningSteps:
    (body,) = (body for body in steps.bodies if body.turning is not None)
    assert body.turning is not None
    return body.turning


def axial(matrix: sp.Matrix) -> sp.Matrix:
    entries = matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]
    return sp.Matrix(entries) / 2


@pytest.mark.slow
def test_angular_velocities_follow_from_the_rotation() -> None:
    """R of the turns by hand, ω from Ṙ, the rate of the angular momentum along axes of space."""
    _, _, equations = certified(BODY)
    steps, names = turning(body_steps()), {p.name: p.symbol for p in equations.system.parameters}
    p, q = (c.q for c in equations.system.coordinates)

    def about(number: int, angle: sp.Expr) -> sp.Matrix:
        return (sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3)[number](angle)

    rotation = about(2, names["w"] * equations.system.t) * about(0, p) * about(1, q)
    shown = sp.Matrix(3, 3, steps.turning.rotation)
    assert same_all(shown, rotation)
    spin = axial(rotation.T * rotation.applyfunc(lambda e: by_sympy(e, equations)))
    assert same_all([c.spin for c in steps.components], spin)
    tensor = sp.Matrix(3, 3, steps.turning.inertia)
    momentum = rotation * tensor * spin
    change = rotation.T * momentum.applyfunc(lambda e: by_sympy(e, equations))
    moments = body_steps().named_moments
    assert same_all([c.inertia.xreplace(moments) for c in steps.components], change)
    c = names["c"]
    torque = rotation.T * sp.Matrix([c, 0, c * q]) + sp.Matrix([0, c, 0])
    assert same_all([c.torque for c in steps.components], torque)


def same_all(first: Sequence[sp.Expr] | sp.Matrix, second: sp.Matrix) -> bool:
    return all(is_zero(x - y) for x, y in zip(first, second, strict=True))


def is_zero(expression: sp.Expr) -> bool:
    """True if an expression vanishes to 40 digits where each symbol has another value."""
    symbols = sorted(expression.free_symbols, key=str)
    value = sp.lambdify(symbols, expression, "mpmath", cse=True)
    with mpmath.workdps(60):
        at = [mpmath.mpf(3 * k + 2) / (7 * k + 5) for k, _ in enumerate(symbols)]
        return bool(abs(value(*at)) < mpmath.mpf(10) ** -40)


@pytest.mark.slow
def test_the_parts_of_virtual_work_make_up_lagranges_equations() -> None:
    steps = body_steps()
    assert max(steps.mismatch, steps.difference) < 1e-25
    moments = steps.named_moments
    assert list(map(str, moments)) == ["inertia_2(arm)"]
    for parts, coordinate in zip(steps.balances, steps.coordinates, strict=True):
        whole = parts.inertia + parts.turning - parts.work - parts.torques + parts.coordinates
        assert is_zero(whole.xreplace(moments) - coordinate.residual)


def changed(field: str, change: Callable[[sp.Expr], object]) -> Callable[..., DerivationSteps]:
    """Change a field of the second component of ω."""

    def wrong(steps: DerivationSteps) -> DerivationSteps:
        first, second, third = turning(steps).components
        off = replace(second, **{field: change(getattr(second, field))})
        return with_components(steps, (first, off, third))

    return wrong


def with_components(
    steps: DerivationSteps, components: tuple[SpinSteps, ...], **fields: object
) -> DerivationSteps:
    def put(body: BodySteps) -> BodySteps:
        if body.turning is None:
            return body
        return replace(body, turning=replace(body.turning, components=components, **fields))

    return replace(steps, bodies=tuple(map(put, steps.bodies)))


def by_force(number: int, field: str) -> Callable[[DerivationSteps], DerivationSteps]:
    def wrong(steps: DerivationSteps) -> DerivationSteps:
        forces = list(steps.forces)
        pairs = tuple((name, NEARLY * e) for name, e in getattr(forces[number], field))
        forces[number] = replace(forces[number], **{field: pairs})
        return replace(steps, forces=tuple(forces))

    return wrong


NEARLY = 1 + sp.Rational(1, 10**20)

WRONG: dict[str, Callable[[DerivationSteps], DerivationSteps]] = {
    **{
        field: changed(field, lambda e: NEARLY * e)
        for field in ("spin", "rate", "law", "inertia", "torque")
    },
    "a slope left out": changed("partials", lambda pairs: pairs[1:]),
    "energy": lambda s: with_components(
        s, turning(s).components, energy=NEARLY * turning(s).energy
    ),
    "component of a torque": by_force(1, "components"),
    "work of a torque": by_force(2, "generalized"),
    "angular momenta": lambda s: replace(
        s, balances=(replace(s.balances[0], turning=-s.balances[0].turning), s.balances[1])
    ),
    "torques": lambda s: replace(
        s, balances=(s.balances[0], replace(s.balances[1], torques=sp.Integer(0)))
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_no_wrong_line_of_a_body_passes(name: str) -> None:
    wrong = WRONG[name](body_steps())
    assert wrong != body_steps()
    with pytest.raises(InternalError, match="a step of the derivation disagrees"):
        certify_steps(*certified(BODY), wrong, {})


@pytest.mark.parametrize("plane", ["xy", "yz", "xz"])
def test_a_turn_in_a_plane_is_counted_as_its_angle(plane: str) -> None:
    """Also from x to z, which is against the y axis."""
    text = f"""
name: bar
parameters: {{I: 0.3, c: 0.2}}
plane: {plane}
bodies: {{bar: {{turn: theta, mass: 1, inertia: I}}}}
coordinates: [theta]
forces: {{motor: {{on: bar, torque: c}}}}
initial: {{theta: 0}}
"""
    equations = derive(read_text(text), steps="dalembert", points=2)
    assert equations.derivation.steps is not None
    steps = turning(equations.derivation.steps)
    (component,) = steps.components
    (theta,) = equations.system.coordinates
    assert steps.axes == "plane"
    assert component.spin == theta.v
    assert str(component.torque) == "c"
