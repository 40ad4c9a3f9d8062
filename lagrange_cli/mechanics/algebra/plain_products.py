"""Powers and products as SymPy builds them, where it would find nothing to evaluate.

SymPy asks whether a term of a power's base is infinite, and builds the powers in a product anew:
for a spring that takes longer than all else that is done with its energy.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import monomial


def power(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
    """Build a power; that of a sum with symbols, which are finite, stays as it is."""
    if base.is_Add and exponent.is_Rational and exponent not in (0, 1) and base.free_symbols:
        return sp.Pow(base, exponent, evaluate=False)
    return sp.Pow(base, exponent)


def product(factors: Sequence[sp.Expr]) -> sp.Expr:
    """Multiply; different symbols and powers of sums are only sorted."""
    numbers = [f for f in factors if f.is_Rational]
    others = [f for f in factors if not f.is_Rational]
    if 0 in numbers or not all(f.is_Symbol or _is_power_of_sum(f) for f in others):
        return sp.Mul(*factors)
    return monomial(sp.Mul(*numbers), others)


def _is_power_of_sum(factor: sp.Expr) -> bool:
    return bool(factor.is_Pow and factor.base.is_Add and factor.base.free_symbols)
