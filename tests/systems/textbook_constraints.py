"""Lagrangians and constraints of scenes whose coordinates are not independent, typed by hand.

A Lagrangian here is that of the coordinates as if nothing related them;
:data:`CLOSURES` gives φ(q, t) of the equations φ = 0 beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

from sympy import Expr, Rational, Symbol, cos, sin, sqrt

from tests.systems.textbook_chains import CHAIN_CLOSURES

Names = SimpleNamespace

HALF = Rational(1, 2)


def _falling(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.x**2 + v.z**2) - p.m * p.g * q.z


def _falling_in_space(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.x**2 + v.y**2 + v.z**2) - p.m * p.g * q.z


def _slider_crank(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.I * v.theta**2 + HALF * p.m * v.x**2


def _four_bar_linkage(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m1 * p.a**2 * v.alpha**2 + HALF * p.m2 * p.c**2 * v.gamma**2
    return kinetic - p.g * (p.m1 * p.a * sin(q.alpha) + p.m2 * p.c * sin(q.gamma))


def _andrews_squeezer(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    """Masses of Hairer and Wanner II, equation (7.11), as ½ v·M v; the spring of (7.13)."""
    first = p.m1 * p.r_a**2 + p.I1 + p.I2
    first += p.m2 * (p.r**2 - 2 * p.d_a * p.r * cos(q.Theta) + p.d_a**2)
    mixed = p.m2 * (p.d_a**2 - p.d_a * p.r * cos(q.Theta)) + p.I2
    kinetic = first * v.beta**2 / 2 + mixed * v.beta * v.Theta
    kinetic += (p.m2 * p.d_a**2 + p.I2) * v.Theta**2 / 2
    kinetic += (p.m3 * (p.s_a**2 + p.s_b**2) + p.I3) * v.gamma**2 / 2
    arm = p.e - p.e_a
    kinetic += (p.m4 * arm**2 + p.I4) * v.Phi**2 / 2
    kinetic += (p.m4 * (arm**2 + p.z_t * arm * sin(q.Phi)) + p.I4) * v.Phi * v.delta
    rod = p.m4 * (p.z_t**2 + 2 * p.z_t * arm * sin(q.Phi) + arm**2) + p.I4 + p.I5
    kinetic += (rod + p.m5 * (p.t_a**2 + p.t_b**2)) * v.delta**2 / 2
    arm = p.z_f - p.f_a
    kinetic += (p.m6 * arm**2 + p.I6) * v.Omega**2 / 2
    kinetic += (p.m6 * (arm**2 - p.u * arm * sin(q.Omega)) + p.I6) * v.Omega * v.epsilon
    rod = p.m6 * (arm**2 - 2 * p.u * arm * sin(q.Omega) + p.u**2) + p.I6 + p.I7
    kinetic += (rod + p.m7 * (p.u_a**2 + p.u_b**2)) * v.epsilon**2 / 2
    x = p.s_d * cos(q.gamma) + p.s_c * sin(q.gamma) + p.x_b - p.x_c
    y = p.s_d * sin(q.gamma) - p.s_c * cos(q.gamma) + p.y_b - p.y_c
    return kinetic - p.c / 2 * (sqrt(x**2 + y**2) - p.l) ** 2


def _andrews_loops(p: Names, q: Names, t: Symbol) -> list[Expr]:
    """Hairer and Wanner II, equation (7.12)."""
    x = p.r * cos(q.beta) - p.d * cos(q.beta + q.Theta)
    y = p.r * sin(q.beta) - p.d * sin(q.beta + q.Theta)
    return [
        x - p.s * sin(q.gamma) - p.x_b,
        y + p.s * cos(q.gamma) - p.y_b,
        x - p.e * sin(q.Phi + q.delta) - p.z_t * cos(q.delta) - p.x_a,
        y + p.e * cos(q.Phi + q.delta) - p.z_t * sin(q.delta) - p.y_a,
        x - p.z_f * cos(q.Omega + q.epsilon) - p.u * sin(q.epsilon) - p.x_a,
        y - p.z_f * sin(q.Omega + q.epsilon) + p.u * cos(q.epsilon) - p.y_a,
    ]


def _four_bar_loop(p: Names, q: Names, t: Symbol) -> list[Expr]:
    return [
        p.a * cos(q.alpha) + p.b * cos(q.beta) - p.c * cos(q.gamma) - p.d,
        p.a * sin(q.alpha) + p.b * sin(q.beta) - p.c * sin(q.gamma),
    ]


def _chaplygin_sleigh(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    x = v.x - p.a * sin(q.theta) * v.theta
    y = v.y + p.a * cos(q.theta) * v.theta
    return HALF * p.m * (x**2 + y**2) + HALF * p.J * v.theta**2


def _knife_edge_on_incline(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * (v.x**2 + v.y**2) + HALF * p.J * v.phi**2
    return kinetic + p.m * p.g * sin(p.alpha) * q.x


def _rolling_disk(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    turning = HALF * p.I * v.psi**2 + HALF * p.J * v.phi**2
    return HALF * p.m * (v.x**2 + v.y**2) + turning


def _snakeboard(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    """Bloch's (5.8.1) with a spring that centres the wheels."""
    board = HALF * p.m * (v.x**2 + v.y**2) + HALF * (p.J + p.J_r + 2 * p.J_w) * v.theta**2
    return (
        board
        + HALF * p.J_r * v.psi**2
        + p.J_r * v.psi * v.theta
        + p.J_w * v.phi**2
        - (HALF * p.k * q.phi**2)
    )


def _ball_on_turntable(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.x**2 + v.y**2) + HALF * p.I * (v.alpha**2 + v.beta**2)


def _wheel_down_incline(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * v.s**2 + HALF * p.I * v.psi**2
    return kinetic + p.m * p.g * sin(p.alpha) * q.s


def _coupled_gears(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    arm = p.a + p.b
    turning = HALF * p.J * v.psi**2 + HALF * p.S * v.alpha**2
    return HALF * p.m * arm**2 * v.theta**2 + turning + p.m * p.g * arm * cos(q.theta)


def _elliptical_gears(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.I * v.alpha**2 + HALF * (p.I + p.m * p.r**2) * v.beta**2
    return kinetic - p.m * p.g * p.r * cos(q.beta)


#: Scene name → Lagrangian over namespaces of parameters, q, v, and t.
CONSTRAINED: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "andrews_squeezer": _andrews_squeezer,
    "ball_on_turntable": _ball_on_turntable,
    "bead_on_quartic": _falling,
    "chaplygin_sleigh": _chaplygin_sleigh,
    "coupled_gears": _coupled_gears,
    "elliptical_gears": _elliptical_gears,
    "four_bar_linkage": _four_bar_linkage,
    "knife_edge_on_incline": _knife_edge_on_incline,
    "pendulum_in_cartesian_coordinates": _falling,
    "rolling_disk": _rolling_disk,
    "slider_crank": _slider_crank,
    "snakeboard": _snakeboard,
    "spherical_pendulum_from_the_pole": _falling_in_space,
    "wheel_down_incline": _wheel_down_incline,
}

#: Scene name → φ(q, t) of its closures.
CLOSURES: Mapping[str, Callable[[Names, Names, Symbol], list[Expr]]] = {
    **CHAIN_CLOSURES,
    "andrews_squeezer": _andrews_loops,
    "bead_on_quartic": lambda p, q, t: [q.x**4 + q.z**4 - p.a**4],
    # The start of the scene: theta = 3/2, psi = 0, alpha = 1/2.
    "coupled_gears": lambda p, q, t: [
        p.a * (q.alpha - HALF) - (p.a + p.b) * (q.theta - 3 * HALF) + p.b * q.psi,
        (p.a + p.b) * (q.theta - 3 * HALF) + p.b * q.psi,
    ],
    "elliptical_gears": lambda p, q, t: [
        (1 - p.e) * sin(q.beta / 2) * cos(q.alpha / 2)
        - (1 + p.e) * cos(q.beta / 2) * sin(q.alpha / 2)
    ],
    "four_bar_linkage": _four_bar_loop,
    "pendulum_in_cartesian_coordinates": lambda p, q, t: [q.x**2 + q.z**2 - p.l**2],
    "slider_crank": lambda p, q, t: [
        (q.x - p.r * cos(q.theta)) ** 2 + p.r**2 * sin(q.theta) ** 2 - p.l**2
    ],
    "spherical_pendulum_from_the_pole": lambda p, q, t: [q.x**2 + q.y**2 + q.z**2 - p.l**2],
    "wheel_down_incline": lambda p, q, t: [q.s - p.R * q.psi],
}

#: Scene name → ψ(q, v, t) of its constraints on velocities.
ROLLING: Mapping[str, Callable[[Names, Names, Names, Symbol], list[Expr]]] = {
    "ball_on_turntable": lambda p, q, v, t: [
        v.x - p.R * v.beta + p.Omega * q.y,
        v.y + p.R * v.alpha - p.Omega * q.x,
    ],
    "chaplygin_sleigh": lambda p, q, v, t: [v.y * cos(q.theta) - v.x * sin(q.theta)],
    "knife_edge_on_incline": lambda p, q, v, t: [v.x * sin(q.phi) - v.y * cos(q.phi)],
    "rolling_disk": lambda p, q, v, t: [
        v.x - p.R * cos(q.phi) * v.psi,
        v.y - p.R * sin(q.phi) * v.psi,
    ],
    "snakeboard": lambda p, q, v, t: [
        v.y * cos(q.theta + q.phi) - v.x * sin(q.theta + q.phi) - p.r * cos(q.phi) * v.theta,
        v.y * cos(q.theta - q.phi) - v.x * sin(q.theta - q.phi) + p.r * cos(q.phi) * v.theta,
    ],
}

#: Scene name → generalized forces by coordinate.
CONSTRAINED_FORCES: Mapping[str, Callable[[Names, Names, Names, Symbol], dict[str, Expr]]] = {
    "andrews_squeezer": lambda p, q, v, t: {"beta": p.tau},
}
