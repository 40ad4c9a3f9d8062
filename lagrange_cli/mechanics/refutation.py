"""Real states at which what is not proven is seen to be false.

Points are drawn over many magnitudes, on both sides of zero: what rests near the start acts
somewhere. A value that differs in so many digits there is no rounding error.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.tape import DomainError, values

__all__ = ["depends", "is_nonzero", "states"]

_DIGITS, _AGREED = 120, 100
_STATES = 60

State = dict[sp.Symbol, mpf]


def states(symbols: Sequence[sp.Symbol], number: int = _STATES) -> Iterator[State]:
    """Random states: of order one, then of magnitudes between 1e-6 and 1e9."""
    source = random.Random(1788)
    for k in range(number):
        state = {}
        for s in symbols:
            size = mpf(source.getrandbits(200) + 1) / mpf(2) ** 200
            power = mpf(10) ** (mpf(source.uniform(-6, 9 * k / number)) if k % 3 else 0)
            negative = not s.is_positive and source.random() < 0.5
            state[s] = -size * power if negative else size * power
        yield state


def is_nonzero(expression: sp.Expr) -> bool:
    """Whether an expression is seen not to vanish: it is not small beside its terms somewhere."""
    return expression != 0 and _differs(sp.Add.make_args(expression))


def depends(expression: sp.Expr, symbol: sp.Symbol) -> bool:
    """Whether an expression is seen to have two values for two of a symbol."""
    held = [t for t in sp.Add.make_args(expression) if symbol in t.free_symbols]
    elsewhere = sp.Dummy(symbol.name, **symbol.assumptions0)
    return _differs([*held, *(-t.xreplace({symbol: elsewhere}) for t in held)])


def _differs(terms: Sequence[sp.Expr]) -> bool:
    """Whether a sum of terms is not zero somewhere."""
    symbols = sorted(set().union(*(t.free_symbols for t in terms)), key=sp.default_sort_key)
    with mpmath.workdps(_DIGITS):
        for state in states(symbols):
            try:
                found = values(terms, state)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue
            if abs(sum(found)) > mpf(10) ** -_AGREED * sum(map(abs, found)):
                return True
    return False
