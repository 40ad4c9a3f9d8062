"""Quotients that are written shorter keep their values, within the budgets and beyond them."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.shorten import shortened

A, X, Y = sp.symbols("a x y", positive=True)
LONG = sp.Add(*(X**k * Y ** (k % 3) * (k + 1) for k in range(17)))


@pytest.mark.parametrize(
    "quotient",
    [
        LONG / (X + 2 * Y),
        sp.sqrt(X + Y) * (X + Y) / (X - 2 * Y),
        (X + Y) ** 2 / A - X * Y / A,
        (X**2 - Y**2) / (X + Y) + A / (X * Y),
    ],
    ids=["long", "root", "one term below", "common factor"],
)
def test_quotients_keep_their_values(quotient: sp.Expr) -> None:
    at = {A: sp.Rational(3, 7), X: sp.Rational(5, 2), Y: sp.Rational(2, 3)}
    assert sp.expand(shortened(quotient).xreplace(at) - quotient.xreplace(at)) == 0


def test_common_factors_are_cancelled() -> None:
    assert shortened((X**2 - Y**2) / (X + Y)) == X - Y
