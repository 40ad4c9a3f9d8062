"""Sums of one velocity and what drives it, and terms over them."""

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.rate_sums import RateSum, over_rate_sums, rate_sums

r, phi, v, w, omega, m, b, t = sp.symbols("r phi v w omega m b t", real=True)
RATES = {r: v, phi: w}


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (w + omega, [RateSum(w, w + omega)]),
        (phi + omega * t, [RateSum(w, w + omega)]),
        (phi - sp.sin(t), [RateSum(w, w - sp.cos(t))]),
        (phi + omega, []),
        (r + phi + omega * t, []),
        (2 * w + omega, []),
    ],
)
def test_sums_of_one_velocity(written, expected):
    assert list(rate_sums([written], RATES, t)) == expected


def test_square_is_found_in_its_terms():
    terms = [m * r * w**2, 2 * m * omega * r * w, m * omega**2 * r]
    shown, meanings = over_rate_sums(terms, [RateSum(w, w + omega)])
    ((symbol, rate),) = meanings.items()
    assert shown == [m * r * symbol**2]
    assert sp.expand(shown[0].subs(symbol, rate.whole)) == sp.Add(*terms)


def test_terms_that_would_be_longer_stay():
    terms = [m * r * w**2, b * w]
    assert over_rate_sums(terms, [RateSum(w, w + omega)]) == (terms, {})
