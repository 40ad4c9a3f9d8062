"""Zero tests prove identities, and nothing that is off by a kink, a narrow or a tiny term."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.mechanics.proofs.zero_test import are_equal, does_not_depend, vanish

pytestmark = pytest.mark.slow

X, Y, T, A = sp.symbols("x y t a", real=True)
K, M = sp.symbols("k m", positive=True)
TINY = sp.Rational(1, 10**60)

#: Expressions that are zero wherever they are defined.
ZEROS = {
    "circle": sp.sin(X) ** 2 + sp.cos(X) ** 2 - 1,
    "double angle": sp.sin(2 * X + Y) - 2 * sp.sin(X + Y / 2) * sp.cos(X + Y / 2),
    "third of a turn": sp.cos(X + sp.pi / 3) - sp.cos(X) / 2 + sp.sqrt(3) / 2 * sp.sin(X),
    "product of angles": sp.cos(X * (Y + 1))
    - sp.cos(X * Y) * sp.cos(X)
    + sp.sin(X * Y) * sp.sin(X),
    "tangent": sp.tan(X) - sp.sin(2 * X) / (1 + sp.cos(2 * X)),
    "exponentials": sp.exp(X + Y) - sp.exp(X) * sp.exp(Y),
    "hyperbolic": sp.cosh(X) ** 2 - sp.sinh(X) ** 2 - 1,
    "tanh": sp.tanh(X) - sp.sinh(2 * X) / (1 + sp.cosh(2 * X)),
    "powers": X ** (A + 1) - X * X**A,
    "roots": 1 / (sp.sqrt(X**2 + Y**2) + 1) - (sp.sqrt(X**2 + Y**2) - 1) / (X**2 + Y**2 - 1),
    "roots of the same": sp.sqrt((X - 1) ** 2 + Y**2) - sp.sqrt(X**2 - 2 * X + 1 + Y**2),
    "root of a product": sp.sqrt(K * M + K) - sp.sqrt(K) * sp.sqrt(M + 1),
    "fourth root": (X**2 + 1) ** sp.Rational(3, 4) - (X**2 + 1) / (X**2 + 1) ** sp.Rational(1, 4),
    "square of a root": sp.sqrt(X**2 - 6 * X + 9) ** 2 - (X - 3) ** 2,
    "both roots": (sp.sqrt(X**2 - 6 * X + 9) - X + 3) * (sp.sqrt(X**2 - 6 * X + 9) + X - 3),
    "abs by max": sp.Abs(X) - sp.Max(X, -X),
    "max by abs": sp.Max(0, X - 3) - (X - 3 + sp.Abs(X - 3)) / 2,
    "positive part times negative": sp.Max(0, X) * sp.Max(0, -X),
    "max and min": sp.Max(X, Y) + sp.Min(X, Y) - X - Y,
    "sign": X * sp.sign(X) - sp.Abs(X),
    "scaled sign": sp.sign(K * X - 3 * K) - sp.sign(X - 3),
    "nested": sp.Abs(sp.Abs(X) - 1) - sp.Max(sp.Abs(X) - 1, 1 - sp.Abs(X)),
    "logarithm of a product": sp.log(K * M) - sp.log(K) - sp.log(M),
    "inverse functions": sp.acos(X) + sp.asin(X) - sp.pi / 2,
    "many kinks": sp.expand(sum(sp.Max(0, X - k) for k in range(10)) ** 2)
    - sum(sp.Max(0, X - k) for k in range(10)) ** 2,
}

#: Expressions that are zero on a part of their domain, or nearly.
NOT_ZEROS = {
    "stop": sp.Max(0, X - 3),
    "step": sp.sign(X - 3) - sp.sign(X - 4),
    "far needle": sp.exp(-(((X - 5) * 10**9) ** 2)),
    "needle": TINY / (1 + ((X - 5) * 10**9) ** 2),
    "steep": sp.tanh((X - 5) * 10**9) + 1,
    "high power": X**400,
    "hidden abs": sp.sqrt(X**2 - 6 * X + 9) - (X - 3),
    "the other hidden abs": sp.sqrt(X**2 - 6 * X + 9) + (X - 3),
    "hidden in a fourth root": sp.sqrt((X**2 - 6 * X + 9) ** 2 - Y) - (X - 3) ** 2,
    "hidden beside a root": sp.sqrt(sp.expand((X - 1) ** 2 * (1 + X**2)))
    - (X - 1) * sp.sqrt(1 + X**2),
    "hidden in a cosine": sp.sqrt(2 - 2 * sp.cos(X)) - 2 * sp.sin(X / 2),
    "hidden in a sine": sp.sqrt(1 - sp.sin(X) ** 2) - sp.cos(X),
    "wrong sign of a number": sp.sqrt(4 - 2 * sp.sqrt(3)) - 1 + sp.sqrt(3),
    "a side of a product": (X + sp.Abs(X)) * sp.Max(0, Y),
    "one side of ten": sp.Mul(*(sp.Max(0, X - k) for k in range(4))),
    "unscaled": sp.Max(0, A * X) - A * sp.Max(0, X),
    "sawtooth": sp.asin(sp.sin(X)) - X,
    "product of arctangents": sp.atan(X) + sp.atan(1 / X) - sp.pi / 2,
}


@pytest.mark.parametrize("name", ZEROS)
def test_identities_are_proven(name: str) -> None:
    assert vanish(ZEROS[name])


@pytest.mark.parametrize("name", ZEROS)
def test_identities_that_are_off_by_a_tiny_term_are_not(name: str) -> None:
    assert not vanish(ZEROS[name] + TINY * X)


@pytest.mark.parametrize("name", NOT_ZEROS)
def test_what_is_zero_on_a_part_is_not_proven(name: str) -> None:
    assert not vanish(NOT_ZEROS[name])


SMALL = st.integers(-4, 4).filter(bool)
RATIOS = st.builds(sp.Rational, SMALL, st.integers(1, 6))
SYMBOLS = st.sampled_from([X, Y, T, K * T, X * Y])
ANGLES = st.lists(st.tuples(RATIOS, SYMBOLS), min_size=1, max_size=3).map(
    lambda pairs: sp.Add(*(c * s for c, s in pairs))
)
FUNCTIONS: list[Callable[[Any, Any], Any]] = [
    lambda a, b: sp.sin(a + b) - sp.sin(a) * sp.cos(b) - sp.cos(a) * sp.sin(b),
    lambda a, b: sp.cos(a - b) - sp.cos(a) * sp.cos(b) - sp.sin(a) * sp.sin(b),
    lambda a, b: sp.exp(a - b) - sp.exp(a) / sp.exp(b),
    lambda a, b: sp.cosh(a + b) - sp.cosh(a) * sp.cosh(b) - sp.sinh(a) * sp.sinh(b),
    lambda a, b: sp.sqrt(1 + a**2) * sp.sqrt(2 + b**2) - sp.sqrt((1 + a**2) * (2 + b**2)),
    lambda a, b: (sp.sqrt(1 + a**2) - b) * (sp.sqrt(1 + a**2) + b) - 1 - a**2 + b**2,
    lambda a, b: sp.Abs(a) * sp.sign(a) + sp.Max(b, 0) - a - (b + sp.Abs(b)) / 2,
    lambda a, b: sp.Max(a, b) - sp.Min(a, b) - sp.Abs(a - b),
]
WIDTHS = st.integers(0, 60).map(lambda n: sp.Rational(1, 10**n))
DISTURBANCES: list[Callable[[Any, Any], Any]] = [
    lambda a, w: w * a,
    lambda a, w: sp.Max(0, a - 3),
    lambda a, w: w * sp.sign(a + 1),
    lambda a, w: w * sp.Min(0, a + 7),
    lambda a, w: sp.exp(-(((a - 3) / w) ** 2)),
    lambda a, w: w / (1 + ((a - 2) / w) ** 2),
    lambda a, w: sp.sqrt(sp.expand((a - 3) ** 2)) - a + 3,
    lambda a, w: 1 + sp.tanh((a - 3) / w),
]


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(FUNCTIONS), ANGLES, ANGLES)
def test_random_identities_are_proven(identity: Callable[..., Any], a: Any, b: Any) -> None:
    assert vanish(identity(a, b))


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(FUNCTIONS), st.sampled_from(DISTURBANCES), ANGLES, ANGLES, SYMBOLS, WIDTHS)
def test_disturbed_identities_are_not_proven(
    identity: Callable[..., Any], disturbance: Callable[..., Any], a: Any, b: Any, u: Any, w: Any
) -> None:
    assert not vanish(identity(a, b) + disturbance(u, w))


def test_dependence_is_looked_at_on_both_sides_at_once() -> None:
    """A derivative would say that a step, or x/|x|, does not depend on x."""
    assert does_not_depend(Y * sp.cos(X) ** 2 + Y * sp.sin(X) ** 2, X)
    for expression in (sp.sign(X - 3), X / sp.Abs(X), sp.Max(0, sp.sign(X)), TINY * X):
        assert not does_not_depend(expression + Y, X)
        assert does_not_depend(expression + Y, T)


def test_equal_functions_of_equal_arguments_are_the_same() -> None:
    argument = sp.sin(X) ** 2 + sp.cos(X) ** 2 + Y**2
    assert are_equal(sp.atan(argument), sp.atan(1 + Y**2))
    assert not are_equal(sp.atan(argument), sp.atan(1 + Y**2 * (1 + TINY)))


def test_questions_beyond_the_budget_are_left_open() -> None:
    """Twenty switching functions that matter have a million combinations of sides."""
    positive = sp.Mul(*(1 + sp.Max(0, X - k) * sp.Max(0, k - X) for k in range(20)))
    assert not vanish(positive - 1 + sp.Max(0, X - 21))
