"""Numbers of constant expressions: products by their factors, as all at once."""

from __future__ import annotations

import mpmath
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.symbols.values import evaluated, evaluated_by_factors

DIGITS = 60


@pytest.mark.parametrize(
    "value",
    [
        sp.Integer(7),
        sp.Rational(1, 3),
        sp.pi * sp.sqrt(2),
        -sp.exp(-50) * sp.Rational(3, 7) * sp.sin(1),
        sp.pi * (sp.cos(1) ** 2 + sp.sin(1) ** 2 - sp.Rational(1, 2)),
        sp.sqrt(3) * (sp.exp(1) - sp.pi) ** 3,
        sp.Float("1e-20", 60) * sp.pi,
    ],
)
def test_a_product_is_that_of_its_factors(value):
    with mpmath.workdps(DIGITS):
        found, known = evaluated_by_factors(value, DIGITS), evaluated(value, DIGITS)
        assert abs(found - known) <= mpf(10) ** (1 - DIGITS) * abs(known)


def test_factors_that_are_not_real_are_taken_together():
    value = sp.Mul(sp.log(-2), sp.log(-2) - 2 * sp.I * sp.pi, evaluate=False)
    with mpmath.workdps(DIGITS):
        known = mpmath.log(2) ** 2 + mpmath.pi**2
        assert abs(evaluated_by_factors(value, DIGITS) - known) < mpf(10) ** (2 - DIGITS)


def test_what_is_below_any_constant_is_0():
    assert evaluated_by_factors(sp.pi * sp.exp(sp.Integer(-(10**9))), 30) == 0
