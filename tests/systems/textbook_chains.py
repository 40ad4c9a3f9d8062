"""Lagrangians of the chains, rings and nets, typed with loops over the members' names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise, product
from types import SimpleNamespace

from sympy import Expr, Integer, Matrix, Rational, Symbol, cos, exp, sin, sqrt

Names = SimpleNamespace

HALF = Rational(1, 2)


def _row(names: Names, base: str, n: int) -> list[Symbol]:
    return [getattr(names, f"{base}[{i}]") for i in range(1, n + 1)]


def _toda_ring(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    x, w = _row(q, "q", 6), _row(v, "q", 6)
    return sum(HALF * w[i] ** 2 - exp(x[i - 1] - x[i]) for i in range(6))


def _pendulum_chain(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    theta, omega = _row(q, "theta", 4), _row(v, "theta", 4)
    velocity, height, total = Matrix([0, 0]), Integer(0), Integer(0)
    for angle, rate in zip(theta, omega, strict=True):
        velocity += p.l * rate * Matrix([cos(angle), sin(angle)])
        height -= p.l * cos(angle)
        total += HALF * p.m * velocity.dot(velocity) - p.m * p.g * height
    return total


def _oscillator_ring(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    x, w = _row(q, "x", 6), _row(v, "x", 6)
    return sum(HALF * p.m * w[i] ** 2 - HALF * p.K * (x[i] - x[i - 1]) ** 2 for i in range(6))


def _fput(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    u = [Integer(0), *_row(q, "u", 15), Integer(0)]
    kinetic = sum(HALF * w**2 for w in _row(v, "u", 15))
    stretches = [after - before for before, after in pairwise(u)]
    return kinetic - sum(HALF * d**2 + p.alpha * d**3 / 3 for d in stretches)


def _net_of_springs(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    def u(i: int, j: int) -> Expr:
        return getattr(q, f"u[{i},{j}]", Integer(0))

    beads = list(product(range(1, 4), repeat=2))
    kinetic = sum(HALF * p.m * getattr(v, f"u[{i},{j}]") ** 2 for i, j in beads)
    pairs = [(u(i, j), u(i + 1, j)) for i, j in product(range(4), range(1, 4))]
    pairs += [(u(i, j), u(i, j + 1)) for i, j in product(range(1, 4), range(4))]
    return kinetic - sum(HALF * p.k * (p.a**2 + (a - b) ** 2) for a, b in pairs)


def _chain_of_rods(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    squares = sum(w**2 for base in "xz" for w in _row(v, base, 4))
    return HALF * p.m * squares - p.m * p.g * sum(_row(q, "z", 4))


def _rods(p: Names, q: Names, t: Symbol) -> list[Expr]:
    x, z = ([Integer(0), *_row(q, base, 4)] for base in "xz")
    ends = zip(pairwise(x), pairwise(z), strict=True)
    return [(a - b) ** 2 + (c - d) ** 2 - p.l**2 for (a, b), (c, d) in ends]


KNOTS = list(product(range(1, 4), repeat=2))


def _hanging_net(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    squares = sum(getattr(v, f"{base}[{i},{j}]") ** 2 for i, j in KNOTS for base in "xyz")
    heights = sum(getattr(q, f"z[{i},{j}]") for i, j in KNOTS)
    return HALF * p.mass * squares - p.mass * p.g * heights


def _threads(p: Names, q: Names, t: Symbol) -> list[Expr]:
    def at(i: int, j: int) -> Matrix:
        if i == 0:
            return Matrix([p.l * j, 0, 0])
        return Matrix([getattr(q, f"{base}[{i},{j}]") for base in "xyz"])

    pairs = [((i - 1, j), (i, j)) for i, j in KNOTS]
    pairs += [((i, j), (i, j + 1)) for i, j in KNOTS if j < 3]
    apart = [at(*a) - at(*b) for a, b in pairs]
    return [d.dot(d) - p.l**2 for d in apart]


def _curtain(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    """Weights, and springs between neighbours of a row (their length is a root)."""
    squares = sum(getattr(v, f"{base}[{i},{j}]") ** 2 for i, j in KNOTS for base in "xz")
    heights = sum(getattr(q, f"z[{i},{j}]") for i, j in KNOTS)
    springs = Integer(0)
    for i, j in product(range(1, 4), (1, 2)):
        apart = [getattr(q, f"{c}[{i},{j + 1}]") - getattr(q, f"{c}[{i},{j}]") for c in "xz"]
        springs += HALF * p.k * (sqrt(apart[0] ** 2 + apart[1] ** 2) - p.a) ** 2
    return HALF * p.mass * squares - p.mass * p.g * heights - springs


def _hanging_rods(p: Names, q: Names, t: Symbol) -> list[Expr]:
    def at(i: int, j: int) -> Matrix:
        if i == 0:
            return Matrix([p.a * j, 0])
        return Matrix([getattr(q, f"{base}[{i},{j}]") for base in "xz"])

    apart = [at(i, j) - at(i - 1, j) for i, j in KNOTS]
    return [d.dot(d) - p.l**2 for d in apart]


#: Scene name → φ(q, t) of the equations φ = 0 beside its Lagrangian.
CHAIN_CLOSURES: Mapping[str, Callable[[Names, Names, Symbol], list[Expr]]] = {
    "chain_of_rods": _rods,
    "hanging_net": _threads,
    "net_of_rods_and_springs": _hanging_rods,
}

#: Scene name → its Lagrangian.
CHAINS: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "chain_of_rods": _chain_of_rods,
    "hanging_net": _hanging_net,
    "net_of_rods_and_springs": _curtain,
    "toda_ring": _toda_ring,
    "pendulum_chain": _pendulum_chain,
    "oscillator_ring": _oscillator_ring,
    "fput": _fput,
    "net_of_springs": _net_of_springs,
}
