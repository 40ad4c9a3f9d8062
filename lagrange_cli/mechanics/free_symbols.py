"""Free symbols of expressions, computed once for each part, and functions that a scene leaves open.

A scene may name a function of one argument without giving it, as V(r). Its derivatives are further
such functions, with a prime each. Where numbers are needed, as in the certificate, a smooth
function stands for each: an identity that holds for it at random states holds for all.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from functools import cache

import mpmath
import sympy as sp
from mpmath import mpf
from sympy.core.function import AppliedUndef

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.tabulated import Tabulated
from lagrange_cli.scene.model import DeclaredFunction

#: Sines that stand for an unknown function where numbers are needed.
_WAVES = 3

#: Expressions whose symbols are kept.
_KEPT = 2**18

#: ``id`` of an expression → the expression, which keeps its id from being given away, and its
#: symbols. By identity, since to compare with an equal expression of before takes longer.
_SYMBOLS: dict[int, tuple[sp.Basic, frozenset[sp.Symbol]]] = {}


def symbols_in(expr: sp.Basic) -> frozenset[sp.Symbol]:
    """Return the symbols of an expression; nothing here binds any, so that all are free."""
    known = _SYMBOLS.get(id(expr))
    if known is not None:
        return known[1]
    if len(_SYMBOLS) >= _KEPT:
        _SYMBOLS.clear()
    # Chains nest more deeply than Python's calls may.
    stack = [expr]
    while stack:
        top = stack[-1]
        missing = [part for part in top.args if id(part) not in _SYMBOLS]
        if missing:
            stack += missing
        else:
            inside = (top,) if top.is_Symbol else ()
            below = (_SYMBOLS[id(part)][1] for part in top.args)
            _SYMBOLS[id(top)] = top, frozenset[sp.Symbol](inside).union(*below)
            stack.pop()
    return _SYMBOLS[id(expr)][1]


def distinct_parts(*expressions: sp.Basic) -> Iterator[sp.Basic]:
    """Yield expressions and all that they are made of, each object once.

    Expressions of long chains share parts at every level: a walk over all paths would not end.
    """
    stack, seen = list(expressions), set[int]()
    while stack:
        top = stack.pop()
        if id(top) not in seen:
            seen.add(id(top))
            yield top
            stack += top.args


def holds(expr: sp.Basic, *kinds: type[sp.Basic]) -> bool:
    """Say whether an operation of some kinds stands in an expression."""
    return any(isinstance(part, kinds) for part in distinct_parts(expr))


def symbols_of_all(expressions: Iterable[sp.Basic]) -> frozenset[sp.Symbol]:
    """Return the free symbols of all of some expressions, in one walk over their distinct parts."""
    present, seen, parts = set[sp.Symbol](), set[int](), list(expressions)
    while parts:
        part = parts.pop()
        if part.is_Symbol:
            present.add(part)
        for below in part.args:
            if id(below) not in seen:
                seen.add(id(below))
                parts.append(below)
    return frozenset(present)


def unknown_function(name: str, argument: sp.Expr) -> sp.Expr:
    """Apply an unknown function; ``name`` ends in a prime for each derivative."""
    return sp.Function(name, real=True)(argument)


def is_unknown(expression: sp.Basic) -> bool:
    """Tell whether an expression is an unknown function of something, or one of a table."""
    return isinstance(expression, (AppliedUndef, Tabulated))


def is_open(expression: sp.Basic) -> bool:
    """Tell whether an expression is a function of which no values are known."""
    return isinstance(expression, AppliedUndef)


def name_and_order(expression: sp.Expr) -> tuple[str, int]:
    """Return the name of an unknown function and the number of its derivatives.

    Slopes of a table of two arguments have the numbers of these behind its name.
    """
    if isinstance(expression, Tabulated):
        orders, name = expression.orders, expression.token.name
        if len(orders) == 1:
            return name, orders[0]
        numbers = "".join(str(k) * n for k, n in enumerate(orders, 1))
        return f"{name}_{numbers}" if numbers else name, 0
    name = expression.func.__name__.rstrip("'")
    return name, len(expression.func.__name__) - len(name)


def unknown_names(expression: sp.Expr) -> frozenset[str]:
    """Return the names of the unknown functions that an expression holds, or derivatives of."""
    return frozenset(name_and_order(f)[0] for f in expression.atoms(AppliedUndef))


def arguments_of(expression: sp.Expr) -> tuple[sp.Expr, ...]:
    """Return what an unknown function, or one of a table, is applied to."""
    if isinstance(expression, Tabulated):
        return expression.arguments
    arguments: tuple[sp.Expr, ...] = expression.args
    return arguments


def unknown_slope(expression: sp.Expr, number: int = 0) -> sp.Expr:
    """Differentiate an unknown function, or one of a table, by an argument."""
    if isinstance(expression, Tabulated):
        return expression.slope(number)
    return unknown_function(f"{expression.func.__name__}'", expression.args[0])


def require_given(functions: Iterable[DeclaredFunction]) -> None:
    """Refuse functions that are not known, where values are asked for.

    Raises
    ------
    InputError
        At the first of them.
    """
    for function in functions:
        if function.is_unknown:
            name, argument = function.name, function.argument
            raise InputError(
                Problem(
                    f"function '{name}' is not given: equations can be derived and printed, but not"
                    " evaluated or drawn",
                    function.mark,
                    hint=f"{name}: {{of: {argument}, equals: an expression in {argument}}}",
                    rule="unknown-function",
                )
            )


@cache
def stand_in(name: str) -> Callable[[mpf], mpf]:
    """Return the function that stands for an unknown one, by its name with its primes."""
    base = name.rstrip("'")
    order = len(name) - len(base)
    digest = hashlib.sha256(base.encode()).digest()
    numbers = [mpf(digest[k] + 100) / 256 for k in range(3 * _WAVES)]
    waves = [tuple(numbers[k::_WAVES]) for k in range(_WAVES)]

    def value(x: mpf) -> mpf:
        turned = order * mpmath.pi / 2
        return mpmath.fsum(a * w**order * mpmath.sin(w * x + p + turned) for a, w, p in waves)

    return value
