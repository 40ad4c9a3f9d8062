"""Accelerations and multipliers of equations with closures, at one state."""

from __future__ import annotations

from collections.abc import Mapping

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.equations import Equations
from tests.mechanics.mechanics_support import number

State = dict[sp.Symbol, mpf]


def solved(e: Equations, state: Mapping[sp.Symbol, mpf]) -> tuple[dict[str, mpf], dict[str, mpf]]:
    """Accelerations and multipliers of [[M, −Φᵀ], [Φ, 0]] [a; λ] = [f; −bias]."""
    n, m = len(e.system.coordinates), len(e.system.closures)
    matrix, right = mpmath.zeros(n + m), mpmath.zeros(n + m, 1)
    for i in range(n):
        right[i] = number(e.system.forcing[i], state)
        for j in range(n):
            matrix[i, j] = number(e.system.mass_matrix[i][j], state)
        for k, closure in enumerate(e.system.closures):
            matrix[n + k, i] = number(closure.gradient[i], state)
            matrix[i, n + k] = -matrix[n + k, i]
    for k, closure in enumerate(e.system.closures):
        right[n + k] = -number(closure.bias, state)
    found = mpmath.lu_solve(matrix, right)
    a = {c.name: found[i] for i, c in enumerate(e.system.coordinates)}
    return a, {c.name: found[n + k] for k, c in enumerate(e.system.closures)}


def state_of(e: Equations, **values: object) -> State:
    """A state by names, ``v_x`` for the velocity of x, with the parameters' values."""
    state = {p.symbol: mpf("9.81") if p.name == "g" else mpf(p.value) for p in e.system.parameters}
    state[e.system.t] = mpf(values.pop("t", 0))
    for c in e.system.coordinates:
        state[c.q], state[c.v] = mpf(values[c.name]), mpf(values["v_" + c.name])
    return state


def holds(e: Equations, state: State) -> None:
    """The state satisfies every closure: positions in their rate too."""
    for closure in e.system.closures:
        assert abs(number(closure.expression, state)) < mpf(10) ** -25
        products = [
            number(g, state) * state[c.v]
            for g, c in zip(closure.gradient, e.system.coordinates, strict=True)
        ]
        assert abs(sum(products) + number(closure.rate, state)) < mpf(10) ** -24


def close(x: mpf, y: mpf) -> bool:
    return abs(x - y) <= mpf(10) ** -20 * (1 + abs(y))


FLAT = "plane: xz\nparticles: {bob: {mass: m, position: [x, y, z]}}\n"
PENDULUM = (
    "parameters: {m: 2, l: 3, g: 9.81}\n" + FLAT + "constraints: {rod: x^2 + z^2 = l^2}\n"
    "potentials: {weight: m*g*z}\n"
)
FOUR_BAR = """
parameters: {m: 1, a: 1, b: 3, c: 2, d: 3, g: 9.81}
plane: xz
particles:
  A: {mass: m, position: [xa, ya, za]}
  B: {mass: 2*m, position: [xb, yb, zb]}
coordinates: [alpha, beta, gamma]
definitions:
  xa: a*cos(alpha)
  za: a*sin(alpha)
  xb: xa + b*cos(beta)
  zb: za + b*sin(beta)
constraints: {loop: [xb = d + c*cos(gamma), zb = c*sin(gamma)]}
potentials: {weight: {gravity: g}}
"""
FOUR_BAR_OF_RODS = """
parameters: {m: 1, a: 1, b: 3, c: 2, d: 3, g: 9.81}
plane: xz
points: {left: [0, 0, 0], right: [d, 0, 0]}
particles:
  A: {mass: m, position: [xa, ya, za]}
  B: {mass: 2*m, position: [xb, yb, zb]}
constraints:
  crank: {distance: [left, A], equals: a}
  coupler: {distance: [A, B], equals: b}
  rocker: {distance: [right, B], equals: c}
potentials: {weight: {gravity: g}}
"""
SLIDER_CRANK = """
parameters: {m: 1, M: 4, r: 1, l: 3, g: 9.81}
plane: xz
particles:
  pin: {mass: m, position: [xp, yp, zp]}
  piston: {mass: M, position: [s, u, w]}
points: {shaft: [0, 0, 0]}
constraints:
  crank: {distance: [shaft, pin], equals: r}
  rod: {distance: [pin, piston], equals: l}
  guide: w = 0
potentials: {weight: {gravity: g}}
"""
