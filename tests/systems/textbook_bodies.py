"""What the books say about scenes of rigid bodies, typed by hand as in :mod:`.textbook`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

from sympy import Expr, Rational, Symbol, cos, sin

Names = SimpleNamespace

HALF = Rational(1, 2)


def _physical_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.I * v.theta**2 + p.m * p.g * p.a * cos(q.theta)


def _compound_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    moment = p.m * p.l**2 / 3 + p.M * (p.l**2 + p.R**2 / 2)
    return HALF * moment * v.theta**2 + (p.m / 2 + p.M) * p.g * p.l * cos(q.theta)


def _spinning_top(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    transverse = HALF * p.I1 * (v.theta**2 + v.phi**2 * sin(q.theta) ** 2)
    axial = HALF * p.I3 * (v.psi + v.phi * cos(q.theta)) ** 2
    return transverse + axial - p.m * p.g * p.h * cos(q.theta)


def _cart_pole(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    translation = HALF * (p.M + p.m) * v.x**2 + p.m * p.c * v.x * v.theta * cos(q.theta)
    turning = HALF * Rational(4, 3) * p.m * p.c**2 * v.theta**2
    return translation + turning - p.m * p.g * p.c * cos(q.theta)


def _double_rod(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    coupled = 3 * v.theta1 * v.theta2 * cos(q.theta1 - q.theta2)
    kinetic = p.m * p.l**2 / 6 * (4 * v.theta1**2 + v.theta2**2 + coupled)
    return kinetic + HALF * p.m * p.g * p.l * (3 * cos(q.theta1) + cos(q.theta2))


def _top_off_the_vertical(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    transverse = HALF * p.I1 * (v.beta**2 + v.alpha**2 * cos(q.beta) ** 2)
    axial = HALF * p.I3 * (v.psi + v.alpha * sin(q.beta)) ** 2
    return transverse + axial - p.m * p.g * p.h * cos(q.alpha) * cos(q.beta)


def _reaction_wheel_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    arm = HALF * (p.I + p.m * p.a**2 + p.M * p.l**2) * v.theta**2
    wheel = HALF * p.J * (v.theta + v.phi) ** 2
    return arm + wheel + (p.m * p.a + p.M * p.l) * p.g * cos(q.theta)


def _acrobot(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    both = v.q1 + v.q2
    first = HALF * (p.m1 * p.c1**2 + p.m2 * p.l1**2 + p.I1) * v.q1**2
    second = HALF * (p.m2 * p.c2**2 + p.I2) * both**2
    coupled = p.m2 * p.l1 * p.c2 * cos(q.q2) * v.q1 * both
    height = (p.m1 * p.c1 + p.m2 * p.l1) * sin(q.q1) + p.m2 * p.c2 * sin(q.q1 + q.q2)
    return first + second + coupled - p.g * height


def _rotary_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    arm = HALF * (p.I + p.m * p.d**2 + p.M * p.l**2) * v.alpha**2
    rod = HALF * (p.J + p.M * p.c**2) * (v.beta**2 + v.alpha**2 * sin(q.beta) ** 2)
    coupled = p.M * p.l * p.c * cos(q.beta) * v.alpha * v.beta
    return arm + rod + coupled + p.M * p.g * p.c * cos(q.beta)


def _gyroscope_in_gimbals(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    outer = p.C2 + (p.A + p.B1) * sin(q.theta) ** 2 + p.C1 * cos(q.theta) ** 2
    across = HALF * outer * v.phi**2 + HALF * (p.A + p.A1) * v.theta**2
    return across + HALF * p.C * (v.psi + v.phi * cos(q.theta)) ** 2


def _ballbot(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    rolling = HALF * (p.m + Rational(7, 5) * p.M) * p.r**2 * v.phi**2
    coupled = p.m * p.c * p.r * v.phi * v.theta * cos(q.theta)
    falling = HALF * (p.J + p.m * p.c**2) * v.theta**2 - p.m * p.g * p.c * cos(q.theta)
    return rolling + coupled + falling


def _planar_quadrotor(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * (v.x**2 + v.z**2) + HALF * p.I * v.theta**2
    return kinetic - p.m * p.g * q.z


def _planar_thrust(p: Names, q: Names, v: Names, t: Symbol) -> dict[str, Expr]:
    first, second = Rational("2.41"), Rational("2.4")
    return {
        "x": -(first + second) * sin(q.theta),
        "z": (first + second) * cos(q.theta),
        "theta": p.r * (first - second),
    }


#: Scene name → L(parameters, q, v, t).
BODIES: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "physical_pendulum": _physical_pendulum,
    "compound_pendulum": _compound_pendulum,
    "spinning_top": _spinning_top,
    "precessing_top": _spinning_top,
    "sleeping_top": _top_off_the_vertical,
    "reaction_wheel_pendulum": _reaction_wheel_pendulum,
    "acrobot": _acrobot,
    "rotary_pendulum": _rotary_pendulum,
    "ballbot": _ballbot,
    "gyroscope_in_gimbals": _gyroscope_in_gimbals,
    "planar_quadrotor": _planar_quadrotor,
    "cart_pole": _cart_pole,
    "double_rod": _double_rod,
}

#: Scene name → generalized forces that are not in L.
BODIES_FORCES: Mapping[str, Callable[[Names, Names, Names, Symbol], dict[str, Expr]]] = {
    "planar_quadrotor": _planar_thrust,
}
