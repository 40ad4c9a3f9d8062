"""Lagrangians of free flight and gaps of scenes with one-sided constraints, typed by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

from sympy import Expr, Rational, Symbol, cos, sin, tan

Names = SimpleNamespace

HALF = Rational(1, 2)


def _falling(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.x**2 + v.z**2) - p.m * p.g * q.z


def _rod(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    """A uniform rod: its moment of inertia is m l²/12."""
    return _falling(p, q, v, t) + HALF * (p.m * p.l**2 / 12) * v.theta**2


def _blocks(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x1**2 + HALF * p.M * v.x2**2


def _ball(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.z**2 - p.m * p.g * q.z


#: Scene name → Lagrangian over namespaces of parameters, q, v, and t.
IN_FLIGHT: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "ball_on_vibrating_table": _ball,
    "block_leaving_wedge": _falling,
    "bouncing_ball": _falling,
    "dropped_rod": _rod,
    "galperin_billiard": _blocks,
    "ladder_leaving_wall": _rod,
    "particle_leaving_sphere": _falling,
    "slack_rope": _falling,
}

#: Scene name → gaps φ(q, t) ≥ 0.
GAPS: Mapping[str, Callable[[Names, Names, Symbol], list[Expr]]] = {
    "ball_on_vibrating_table": lambda p, q, t: [q.z - p.A * sin(p.w * t)],
    "block_leaving_wedge": lambda p, q, t: [q.z + (q.x + p.j * t**3 / 6) * tan(p.alpha)],
    "bouncing_ball": lambda p, q, t: [q.z],
    "dropped_rod": lambda p, q, t: [
        q.z - p.l * sin(q.theta) / 2,
        q.z + p.l * sin(q.theta) / 2,
    ],
    "galperin_billiard": lambda p, q, t: [q.x1, q.x2 - q.x1],
    "ladder_leaving_wall": lambda p, q, t: [
        q.x - p.l / 2 * sin(q.theta),
        q.z - p.l / 2 * cos(q.theta),
    ],
    "particle_leaving_sphere": lambda p, q, t: [q.x**2 + q.z**2 - p.R**2],
    "slack_rope": lambda p, q, t: [p.l**2 - q.x**2 - q.z**2],
}

#: Scene name → coefficients of restitution, 0 where nothing is said.
RESTITUTIONS: Mapping[str, Callable[[Names], list[Expr]]] = {
    "ball_on_vibrating_table": lambda p: [p.e],
    "bouncing_ball": lambda p: [p.e],
    "dropped_rod": lambda p: [p.e, p.e],
    "galperin_billiard": lambda p: [1, 1],
}
