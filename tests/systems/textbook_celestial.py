"""Lagrangians of celestial mechanics as the books have them, typed by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from types import SimpleNamespace

from sympy import Expr, Integer, Rational, Symbol, cos, cosh, sin, sinh, sqrt

Names = SimpleNamespace

HALF = Rational(1, 2)


def _kepler(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.r**2 + q.r**2 * v.phi**2) + p.G * p.M * p.m / q.r


def _two_bodies(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # Jacobi's split: the centre of mass, and a particle with the reduced mass.
    total = p.m1 + p.m2
    reduced = p.m1 * p.m2 / total
    centre = [(p.m1 * v.x1 + p.m2 * v.x2) / total, (p.m1 * v.y1 + p.m2 * v.y2) / total]
    relative = [v.x2 - v.x1, v.y2 - v.y1]
    kinetic = HALF * total * sum(c**2 for c in centre) + HALF * reduced * sum(
        c**2 for c in relative
    )
    distance = sqrt((q.x2 - q.x1) ** 2 + (q.y2 - q.y1) ** 2)
    return kinetic + p.G * p.m1 * p.m2 / distance


def _figure_eight(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * (v.xa**2 + v.ya**2 + v.xb**2 + v.yb**2 + v.xc**2 + v.yc**2)
    ab = sqrt((q.xa - q.xb) ** 2 + (q.ya - q.yb) ** 2)
    bc = sqrt((q.xb - q.xc) ** 2 + (q.yb - q.yc) ** 2)
    ca = sqrt((q.xc - q.xa) ** 2 + (q.yc - q.ya) ** 2)
    return kinetic + p.G * p.m**2 * (1 / ab + 1 / bc + 1 / ca)


def _arenstorf_orbit(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # Velocity in the axes at rest, along the turning ones.
    kinetic = HALF * ((v.x - q.y) ** 2 + (v.y + q.x) ** 2)
    earth = sqrt((q.x + p.mu) ** 2 + q.y**2)
    moon = sqrt((q.x - 1 + p.mu) ** 2 + q.y**2)
    return kinetic + (1 - p.mu) / earth + p.mu / moon


def _trojan_asteroid(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    x, y = q.r * cos(q.phi), q.r * sin(q.phi)
    kinetic = HALF * (v.r**2 + q.r**2 * (1 + v.phi) ** 2)
    sun, jupiter = sqrt((x + p.mu) ** 2 + y**2), sqrt((x - 1 + p.mu) ** 2 + y**2)
    return kinetic + (1 - p.mu) / sun + p.mu / jupiter


def _gravitation(masses: Mapping[str, Expr], strength: Expr, q: Names, v: Names) -> Expr:
    """Bodies in a plane, their coordinates called x and y followed by the body's key."""
    at = {k: (getattr(q, f"x{k}"), getattr(q, f"y{k}")) for k in masses}
    speed2 = {k: getattr(v, f"x{k}") ** 2 + getattr(v, f"y{k}") ** 2 for k in masses}
    kinetic = sum(HALF * m * speed2[k] for k, m in masses.items())
    return kinetic + strength * sum(
        masses[i] * masses[j] / sqrt((at[i][0] - at[j][0]) ** 2 + (at[i][1] - at[j][1]) ** 2)
        for i, j in combinations(masses, 2)
    )


def _lagrange_triangle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return _gravitation({"a": p.ma, "b": p.mb, "c": p.mc}, p.G, q, v)


def _pleiades(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return _gravitation({str(k): Integer(k) for k in range(1, 8)}, p.G, q, v)


def _two_centres(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # Separated by Liouville's form.
    metric = p.c**2 * (sinh(q.xi) ** 2 + sin(q.eta) ** 2)
    attraction = p.c * ((p.a + p.b) * cosh(q.xi) + (p.a - p.b) * cos(q.eta)) / metric
    return HALF * metric * (v.xi**2 + v.eta**2) + attraction


def _schwarzschild_orbit(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    lapse = 1 - 2 * p.M / q.r
    return HALF * (v.r**2 / lapse + q.r**2 * v.phi**2 - lapse * v.t_far**2)


#: Scene name → L(parameters, q, v, t).
CELESTIAL: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "kepler": _kepler,
    "two_bodies": _two_bodies,
    "figure_eight": _figure_eight,
    "arenstorf_orbit": _arenstorf_orbit,
    "trojan_asteroid": _trojan_asteroid,
    "lagrange_triangle": _lagrange_triangle,
    "pleiades": _pleiades,
    "two_centres": _two_centres,
    "schwarzschild_orbit": _schwarzschild_orbit,
}
