"""Sums that are seen to be irreducible are those that SymPy's factor leaves alone."""

import random

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra import polynomials
from lagrange_cli.mechanics.algebra.polynomials import factored_form

x, y, z, w = sp.symbols("x y z w", real=True)
UNKNOWNS = (x, y, z, sp.sin(w))


def _sum(chance):
    terms = [
        chance.choice([1, 1, 2, -1, 3])
        * sp.Mul(*(u ** chance.choice([0, 0, 1, 1, 2]) for u in UNKNOWNS))
        for _ in range(chance.randint(1, 3))
    ]
    return sp.Add(*terms)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_what_is_left_alone_has_no_factors(seed, monkeypatch):
    """Of random sums and products of two, whatever is not handed to SymPy."""
    chance, asked = random.Random(seed), []
    factor = sp.factor
    monkeypatch.setattr(polynomials.sp, "factor", lambda e: asked.append(e) or factor(e))
    left_alone = 0
    for _ in range(100):
        whole = _sum(chance) * _sum(chance) if chance.random() < 0.6 else _sum(chance)
        expr = sp.expand(whole)
        before = len(asked)
        form = factored_form.__wrapped__(expr)  # what is remembered is not asked for
        if len(asked) == before and expr.is_Add:
            left_alone += 1
            assert factor(expr) == expr == form
    assert left_alone > 3


def test_exponents_that_multiply_out_to_high_powers_are_left_alone():
    """e^((y + 1)²⁰) would be a product of powers of exponentials, of degrees up to 184,756."""
    steep = 2 * x + sp.exp(x - (y + 1) ** 20)
    assert factored_form(steep) is steep
    # Of low powers they are unknowns like others.
    apart = sp.exp(x + y) + sp.exp(x + z)
    assert factored_form(apart) == sp.exp(x) * (sp.exp(y) + sp.exp(z))
