"""Real states at which what is not proven is seen to be false.

Points are drawn over many magnitudes, on both sides of zero: what rests near the start acts
somewhere. A value that differs in so many digits there is no rounding error.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate

__all__ = ["depends", "is_nonzero", "jumps", "states_for", "values_at"]

_ZERO = mpf(0)
_DIGITS, _AGREED, _MORE = 120, 100, 40

#: States over all magnitudes, and beside each surface.
_STATES, _BESIDE = 40, 6

#: Surfaces that are looked at.
_SURFACES = 48

#: How far apart the two sides of a surface are looked at, and digits that a jump is not below.
_APART, _JUMP = mpf(10) ** -95, 70

_key = sp.default_sort_key

_State = dict[sp.Symbol, mpf]


def _states(symbols: Sequence[sp.Symbol], number: int = _STATES) -> Iterator[_State]:
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
    dependent = [t for t in sp.Add.make_args(expression) if symbol in t.free_symbols]
    elsewhere = sp.Dummy(symbol.name, **symbol.assumptions0)
    return _differs([*dependent, *(-t.xreplace({symbol: elsewhere}) for t in dependent)])


def jumps(expression: sp.Expr) -> bool:
    """Whether an expression is seen to have two values on two sides of a surface."""
    terms = sp.Add.make_args(expression)
    for surface, symbol in _surfaces(terms):
        there = _on(surface, symbol, sorted(_symbols(terms), key=_key))
        beside = ({**s, symbol: s[symbol] + d} for s in there for d in (_APART, -_APART))
        seen = list(_seen(terms, beside, _DIGITS))
        for (near_state, here), (far_state, beyond) in zip(seen[::2], seen[1::2], strict=False):
            size, step = sum(map(abs, (*here, *beyond))), sum(here) - sum(beyond)
            if abs(step) <= mpf(10) ** -_JUMP * size:
                continue
            # Terms that cancel within a function are rounding, which more digits do not repeat.
            closer = [v for _, v in _seen(terms, [near_state, far_state], _DIGITS + _MORE)]
            if len(closer) == 2 and abs(sum(closer[0]) - sum(closer[1]) - step) <= abs(step) / 2:
                return True
    return False


def _differs(terms: Sequence[sp.Expr]) -> bool:
    """Whether a sum of terms is not zero somewhere, and not by rounding: more digits agree."""
    for state, parts in _seen(terms, states_for(terms), _DIGITS):
        total = sum(parts)
        if abs(total) <= mpf(10) ** -_AGREED * sum(map(abs, parts)):
            continue
        for _, closer in _seen(terms, [state], _DIGITS + _MORE):
            if abs(sum(closer) - total) <= abs(total) / 2:
                return True
    return False


def values_at(expressions: Sequence[sp.Expr], points: Iterable[_State]) -> Iterator[list[mpf]]:
    """Values of expressions, in many digits, at those states where all are finite and real."""
    return (values for _, values in _seen(expressions, points, _DIGITS))


def _seen(
    expressions: Sequence[sp.Expr], points: Iterable[_State], digits: int
) -> Iterator[tuple[_State, list[mpf]]]:
    symbols = sorted(_symbols(expressions), key=_key)
    with mpmath.workdps(digits):
        try:
            tape = Tape(expressions, symbols)
        except DomainError:
            return
        for point in points:
            try:
                run = tape.run([(mpf(point[s]), _ZERO, _ZERO) for s in symbols], order=0)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue
            yield point, run.values


def _symbols(expressions: Iterable[sp.Expr]) -> set[sp.Symbol]:
    return set().union(*(e.free_symbols for e in expressions))


def states_for(
    expressions: Sequence[sp.Expr], symbols: Sequence[sp.Symbol] | None = None
) -> Iterator[_State]:
    """States over many magnitudes, and at and beside the surfaces of switching functions.

    Parameters
    ----------
    symbols
        Those that states give; by default those of the expressions.
    """
    named = symbols if symbols is not None else sorted(_symbols(expressions), key=_key)
    with mpmath.workdps(_DIGITS):
        yield from _states(named)
        source = random.Random(1687)
        for surface, symbol in _surfaces(expressions):
            for state in _on(surface, symbol, named):
                away = source.choice((-1, 1)) * mpf(10) ** mpf(source.uniform(-15, 1))
                yield {**state, symbol: state[symbol] + away}


def _on(surface: sp.Expr, symbol: sp.Symbol, symbols: Sequence[sp.Symbol]) -> Iterator[_State]:
    """States on a surface, which is linear in one of the symbols."""
    with mpmath.workdps(_DIGITS):
        slope = surface.diff(symbol)
        for state in _states(symbols, _BESIDE):
            there = {**state, symbol: _ZERO}
            try:
                level, rate = evaluate([surface, slope], there)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue
            if rate:
                yield {**there, symbol: -level / rate}


def _surfaces(expressions: Sequence[sp.Expr]) -> Iterator[tuple[sp.Expr, sp.Symbol]]:
    """Sums within functions and powers, and what switching functions are of: where they vanish
    something may happen. With each a symbol in which it is linear."""
    sums = set().union(*(e.atoms(sp.Add) for e in expressions))
    for switch in set().union(*(e.atoms(sp.Abs, sp.sign, sp.Max, sp.Min) for e in expressions)):
        first, *others = switch.args
        sums.update([first - argument for argument in others] or [first])
    number = 0
    for surface in sorted(sums, key=_key):
        for symbol in sorted(surface.free_symbols, key=_key):
            if surface.is_polynomial(symbol) and sp.degree(surface, symbol) == 1:
                yield surface, symbol
                number += 1
                if number == _SURFACES:
                    return
