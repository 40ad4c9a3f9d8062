"""First integrals that the program does not find, as the books have them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Names = SimpleNamespace


def _swinging_atwood(p: Names, q: Names, v: Names) -> Array:
    """Tufillaro's integral of the swinging Atwood machine with M = 3 m."""
    c, s = np.cos(q.theta / 2), np.sin(q.theta / 2)
    motion = q.r**2 * v.theta * (v.r * c - q.r * v.theta / 2 * s)
    return np.asarray(motion + p.g * q.r**2 * s * c**2)


def _toda_lattice(p: Names, q: Names, v: Names) -> Array:
    """Henon's cubic integral of three particles on a ring."""
    a, b, c = np.exp(q.q1 - q.q2), np.exp(q.q2 - q.q3), np.exp(q.q3 - q.q1)
    return np.asarray(v.q1 * v.q2 * v.q3 - v.q1 * b - v.q2 * c - v.q3 * a)


def _two_centres(p: Names, q: Names, v: Names) -> Array:
    """The integral that separates in elliptic coordinates (Liouville)."""
    metric = p.c**2 * (np.sinh(q.xi) ** 2 + np.sin(q.eta) ** 2)
    sides = p.c * ((p.a + p.b) * np.cosh(q.xi) + (p.a - p.b) * np.cos(q.eta))
    energy = metric * (v.xi**2 + v.eta**2) / 2 - sides / metric
    along = metric**2 * v.xi**2 / 2 - p.c * (p.a + p.b) * np.cosh(q.xi)
    return np.asarray(along - energy * p.c**2 * np.cosh(q.xi) ** 2)


def _pleiades(p: Names, q: Names, v: Names) -> Array:
    """The angular momentum."""
    x, y = (np.array([getattr(q, f"{c}{k}") for k in range(1, 8)]) for c in "xy")
    vx, vy = (np.array([getattr(v, f"{c}{k}") for k in range(1, 8)]) for c in "xy")
    return np.asarray(np.arange(1, 8) @ (x * vy - y * vx))


def _schwarzschild_orbit(p: Names, q: Names, v: Names) -> Array:
    """The square of the four-velocity, -1 in proper time."""
    lapse = 1 - 2 * p.M / q.r
    return np.asarray(-lapse * v.t_far**2 + v.r**2 / lapse + q.r**2 * v.phi**2)


#: Scene name → a function of parameters, positions and velocities that stays constant.
FIRST_INTEGRALS: Mapping[str, Callable[[Names, Names, Names], Array]] = {
    "swinging_atwood": _swinging_atwood,
    "toda_lattice": _toda_lattice,
    "two_centres": _two_centres,
    "pleiades": _pleiades,
    "schwarzschild_orbit": _schwarzschild_orbit,
}
