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


#: Scene name → L(parameters, q, v, t).
BODIES: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "physical_pendulum": _physical_pendulum,
    "compound_pendulum": _compound_pendulum,
    "spinning_top": _spinning_top,
    "cart_pole": _cart_pole,
    "double_rod": _double_rod,
}
