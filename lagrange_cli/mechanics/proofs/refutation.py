"""Refutation by example: real states at which a claim is false.

States are drawn over many magnitudes, on both sides of zero: a stop that is open near the start
closes at some of them. A difference that more digits repeat is no rounding error.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.arithmetic import negative
from lagrange_cli.mechanics.algebra.polynomials import has_more_nodes
from lagrange_cli.mechanics.algebra.substitution import Substitution
from lagrange_cli.mechanics.free_symbols import distinct_parts, symbols_in
from lagrange_cli.mechanics.kinks import KINKED, surfaces_of
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate

_ZERO = mpf(0)

# The digits leave a wide gap between rounding and a difference, and the numbers of states keep a
# refutation quick; none is tuned. A claim without an example is not proven by that.

#: Decimal digits of values.
_DIGITS = 120
#: Digits below its terms at which a value may be rounding.
_AGREED = 100
#: Further digits by which a value is confirmed.
_MORE = 40
#: States over all magnitudes.
_STATES = 40
#: States beside each surface.
_BESIDE = 6
#: Nodes of the longest expression whose sums are surfaces to look at: sorting walks through all.
_MOST_NODES = 100_000
#: Most surfaces that are examined.
_SURFACES = 48
#: Distance from a surface on either side.
_APART = mpf(10) ** -95
#: Digits below its terms at which a jump may be rounding.
_JUMP = 70

_key = sp.default_sort_key

_State = dict[sp.Symbol, mpf]


def _states(symbols: Sequence[sp.Symbol], number: int = _STATES) -> Iterator[_State]:
    """Draw random states: of order one, then of magnitudes between 1e-6 and 1e9."""
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
    """Say whether an expression is not small relative to its terms at some state."""
    return expression != 0 and _differs(sp.Add.make_args(expression))


def depends(expression: sp.Expr, symbol: sp.Symbol) -> bool:
    """Say whether an expression has two values for two values of a symbol at some state."""
    dependent = [t for t in sp.Add.make_args(expression) if symbol in symbols_in(t)]
    elsewhere = sp.Dummy(symbol.name, **symbol.assumptions0)
    put_in = Substitution({symbol: elsewhere}).put_into
    return _differs([*dependent, *(negative(put_in(t)) for t in dependent)])


def jumps(expression: sp.Expr) -> bool:
    """Say whether an expression has two values on two sides of a surface."""
    terms = sp.Add.make_args(expression)
    for surface, symbol in _surfaces(terms):
        there = _on(surface, symbol, sorted(_symbols(terms), key=_key))
        states = ({**s, symbol: s[symbol] + d} for s in there for d in (_APART, -_APART))
        seen = list(_seen(terms, states, _DIGITS))
        for (near_state, here), (far_state, beyond) in zip(seen[::2], seen[1::2], strict=False):
            size, step = sum(map(abs, (*here, *beyond))), sum(here) - sum(beyond)
            if abs(step) <= mpf(10) ** -_JUMP * size:
                continue
            # Cancellation within a function leaves rounding, which more digits do not repeat.
            closer = [v for _, v in _seen(terms, [near_state, far_state], _DIGITS + _MORE)]
            if len(closer) == 2 and abs(sum(closer[0]) - sum(closer[1]) - step) <= abs(step) / 2:
                return True
    return False


def _differs(terms: Sequence[sp.Expr]) -> bool:
    """Say whether a sum of terms is not zero at some state, confirmed by more digits."""
    for state, parts in _seen(terms, states_for(terms), _DIGITS):
        total = sum(parts)
        if abs(total) <= mpf(10) ** -_AGREED * sum(map(abs, parts)):
            continue
        for _, closer in _seen(terms, [state], _DIGITS + _MORE):
            if abs(sum(closer) - total) <= abs(total) / 2:
                return True
    return False


def values_at(expressions: Sequence[sp.Expr], points: Iterable[_State]) -> Iterator[list[mpf]]:
    """Evaluate expressions in many digits at the states at which all are finite and real."""
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
    return set().union(*map(symbols_in, expressions))


def states_for(
    expressions: Sequence[sp.Expr], symbols: Sequence[sp.Symbol] | None = None
) -> Iterator[_State]:
    """Draw states over many magnitudes, and beside the surfaces of switching functions.

    Parameters
    ----------
    symbols
        Symbols with a value in each state; by default those of the expressions.
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
    """Draw states on a surface, which is linear in one of the symbols."""
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
    """Yield surfaces at which an expression may jump, with a symbol in which each is linear.

    They are zeros of sums, and of the arguments of switching functions.
    """
    parts = [*distinct_parts(*expressions)]
    # Sums of long chains are too many, and too long to be sorted.
    is_long = any(has_more_nodes(e, _MOST_NODES) for e in expressions)
    sums = set() if is_long else {part for part in parts if part.is_Add}
    for kink in {part for part in parts if isinstance(part, KINKED)}:
        sums.update(surfaces_of(kink))
    number = 0
    for surface in sorted(sums, key=_key):
        for symbol in sorted(surface.free_symbols, key=_key):
            if surface.is_polynomial(symbol) and _is_linear(surface, symbol):
                yield surface, symbol
                number += 1
                if number == _SURFACES:
                    return


def _is_linear(surface: sp.Expr, symbol: sp.Symbol) -> bool:
    """Tell if the slope of a sum shows it linear in a symbol: to expand it may take minutes."""
    slope = surface.diff(symbol)
    return slope != 0 and symbol not in slope.free_symbols
