"""Shared by the tests of mechanics: scenes from text, and numbers to evaluate at."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping
from functools import cache

import mpmath
import sympy as sp
from hypothesis import settings

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import parse_expression, read_text
from lagrange_cli.scene.language.expression import Expression

#: The same examples in every run, however slow the machine.
generated = settings(deadline=None, derandomize=True, max_examples=30)
few = settings(deadline=None, derandomize=True, max_examples=8)

DOUBLE_PENDULUM = """
parameters: {m1: 1, m2: 2, l1: {value: 1, positive: true}, l2: {value: 3, positive: true}, g: 9.81}
plane: xz
particles:
  upper: {mass: m1, position: [x1, y1, z1]}
  lower: {mass: m2, position: [x2, y2, z2]}
coordinates: [theta1, theta2]
definitions:
  x1: l1*sin(theta1)
  z1: -l1*cos(theta1)
  x2: x1 + l2*sin(theta2)
  z2: z1 - l2*cos(theta2)
potentials: {weight: {gravity: g}}
"""

POLAR = """
parameters: {m: 1, k: 2}
plane: xy
particles: {puck: {mass: m, position: [x, y, z]}}
coordinates: [r, theta]
definitions: {x: r*cos(theta), y: r*sin(theta)}
"""


@cache
def derived(text: str, digits: int = 30) -> Equations:
    """Equations of a scene given without its name."""
    return derive(read_text("name: tested\n" + text), digits=digits)


def refusal(text: str) -> Problem:
    """The first problem for which a scene is refused as wrong input."""
    try:
        derive(read_text("name: tested\n" + text))
    except InputError as error:
        return error.problems[0]
    raise AssertionError("the scene is accepted")


def expression(text: str) -> Expression:
    return parse_expression(text, Mark("scene.yaml", 3, 5, "  x: " + text))


def random_point(symbols: Iterable[sp.Symbol], seed: int, low: float = 0.5) -> dict:
    """Values between ``low`` and ``low + 1`` to 53 bits, by symbol."""
    draw = random.Random(seed)
    return {s: mpmath.mpf(low + draw.random()) for s in sorted(set(symbols), key=str)}


def number(expr: sp.Expr, point: Mapping[sp.Symbol, object], digits: int = 30) -> mpmath.mpf:
    """Value by SymPy's own evaluation."""
    exact = {s: sp.Float(x, digits + 10) for s, x in point.items()}
    return mpmath.mpf(sp.sympify(expr).evalf(digits, subs=exact))
