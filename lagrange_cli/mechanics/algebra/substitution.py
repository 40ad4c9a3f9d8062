"""Expressions written again with other symbols, or with expressions in place of symbols.

Elements of an indexed family differ in the names of their symbols. If the new names stand in the
order of the old ones, all arguments of sums and products keep their places: nothing is sorted, and
nothing that SymPy evaluates comes out otherwise. Where expressions take the places of symbols,
operations that recur are evaluated once.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import negative, plain_sum
from lagrange_cli.mechanics.algebra.polynomials import has_more_nodes
from lagrange_cli.mechanics.free_symbols import symbols_in

#: Parts of expressions that have no finite real value.
_WITHOUT_VALUE = frozenset((sp.zoo, sp.nan, sp.oo, -sp.oo, sp.I))

#: Parts of the longest expression whose shape is compared with others; those of elements of
#: families have some dozens, positions of long chains of bodies more than can be walked.
_LONGEST_SHAPE = 20_000

#: Most expressions of which it is kept whether they have a value.
_KEPT = 2**18

#: ``id`` of an expression → the expression, so that the id stays its own, and whether it has one.
_HAS_VALUE: dict[int, tuple[sp.Basic, bool]] = {}


def has_value(expr: sp.Basic) -> bool:
    """Tell whether no part of an expression is infinite, undefined, imaginary or a range."""
    known = _HAS_VALUE.get(id(expr))
    if known is None:
        if len(_HAS_VALUE) >= _KEPT:
            _HAS_VALUE.clear()
        without = expr in _WITHOUT_VALUE or isinstance(expr, sp.AccumBounds)
        known = _HAS_VALUE[id(expr)] = expr, not without and all(map(has_value, expr.args))
    return known[1]


def with_numbers(expr: sp.Expr, numbers: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr | None:
    """Replace symbols by numbers; None where the expression has no value with them."""
    try:
        replaced = Substitution(numbers).put_into(expr)
    except (TypeError, ValueError):  # a range or an infinity that max or sign cannot compare
        return None
    return replaced if has_value(replaced) else None


def at_rest(expr: sp.Expr, velocities: Iterable[sp.Symbol]) -> sp.Expr | None:
    """Set velocities to 0; None where the expression has no value at rest."""
    return with_numbers(expr, dict.fromkeys(velocities, sp.S.Zero))


class Step(NamedTuple):
    """An operation of a template.

    Attributes
    ----------
    kind
        The class of its value.
    build
        Makes its value from those of its operands, without evaluation.
    operands
        Their numbers among the values: symbols and constants, then earlier steps.
    symbols
        The numbers of the symbols that it holds.
    known
        Values by the symbol, if it is one: elements of a family share these.
    """

    kind: Callable[..., sp.Expr]
    build: Callable[..., sp.Expr]
    operands: Sequence[int]
    symbols: frozenset[int]
    known: dict[sp.Symbol, sp.Expr]


class Template:
    """An expression whose symbols are exchanged for others of one order and one kind.

    Parameters
    ----------
    expr
        The expression.
    symbols
        All symbols of it, and perhaps others, in the order of their names.

    Attributes
    ----------
    constants
        Parts without symbols.
    steps
        Operations, each distinct one once and after its operands.
    whole
        Number of the expression itself.
    """

    def __init__(self, expr: sp.Expr, symbols: Sequence[sp.Symbol]) -> None:
        parts = _parts(expr, symbols)
        self.constants = [part for part in parts if not symbols_in(part)]
        moving = [part for part in parts if symbols_in(part)]
        places = {part: k for k, part in enumerate([*symbols, *self.constants, *moving])}
        self.steps = [_step(part, places) for part in moving]
        self.whole = places[expr]

    def over(self, symbols: Sequence[sp.Symbol]) -> sp.Expr:
        """Write the expression with other symbols, one in place of each of the template's."""
        values = [*symbols, *self.constants]
        for _, build, operands, symbol_numbers, known in self.steps:
            if len(symbol_numbers) > 1:
                values.append(build(*[values[k] for k in operands]))
                continue
            (place,) = symbol_numbers
            symbol = symbols[place]
            if symbol not in known:
                known[symbol] = build(*[values[k] for k in operands])
            values.append(known[symbol])
        whole: sp.Expr = values[self.whole]
        return whole


@dataclass(frozen=True, eq=False)
class Shape:
    """The first expression of a shape, with its symbols in the order of their names.

    It is equal to itself alone.
    """

    expr: sp.Expr
    symbols: tuple[sp.Symbol, ...]

    @cached_property
    def template(self) -> Template:
        return Template(self.expr, self.symbols)


class Element(NamedTuple):
    """An expression that is the first one of its shape with other symbols of the same order.

    Attributes
    ----------
    expr
        The expression.
    shape
        The first of its shape.
    symbols
        Its symbols, each in place of that of the first one.
    """

    expr: sp.Expr
    shape: Shape
    symbols: tuple[sp.Symbol, ...]


def single_element(expr: sp.Expr) -> Element:
    """Return an expression as the only element of its shape."""
    symbols = tuple(sorted(symbols_in(expr), key=attrgetter("name")))
    return Element(expr, Shape(expr, symbols), symbols)


class Shapes:
    """Shapes of expressions that differ in symbols of one order and kind alone."""

    def __init__(self) -> None:
        self._known: dict[Hashable, Shape] = {}

    def element(self, expr: sp.Expr) -> Element:
        """Return an expression with its shape; the first of a shape stands for it."""
        if has_more_nodes(expr, _LONGEST_SHAPE):
            return single_element(expr)
        symbols = tuple(sorted(symbols_in(expr), key=attrgetter("name")))
        places: dict[sp.Basic, Hashable] = {s: (k, s.is_positive) for k, s in enumerate(symbols)}
        key = tuple(_walk(expr, places))
        return Element(expr, self._known.setdefault(key, Shape(expr, symbols)), symbols)


def _walk(expr: sp.Basic, places: Mapping[sp.Basic, Hashable]) -> Iterator[Hashable]:
    """Yield the operations of an expression in their order, and the places of its symbols."""
    if not expr.args:
        yield places.get(expr, expr)
        return
    yield expr.func, len(expr.args)
    for argument in expr.args:
        yield from _walk(argument, places)


def _parts(expr: sp.Expr, symbols: Sequence[sp.Symbol]) -> list[sp.Basic]:
    """List the parts of an expression but symbols, each once and operands first."""
    listed: dict[sp.Basic, bool] = dict.fromkeys(symbols, False)
    stack: list[tuple[sp.Basic, bool]] = [(expr, False)]
    while stack:
        top, ready = stack.pop()
        if top in listed:
            continue
        if ready or not symbols_in(top):
            listed[top] = True
        else:
            stack.append((top, True))
            stack.extend((a, False) for a in reversed(top.args))
    return [part for part, wanted in listed.items() if wanted]


def _step(expr: sp.Basic, places: Mapping[sp.Basic, int]) -> Step:
    operands = [places[a] for a in expr.args]
    symbol_numbers = frozenset(places[s] for s in symbols_in(expr))
    return Step(expr.func, _builder(expr), operands, symbol_numbers, {})


def _builder(expr: sp.Basic) -> Callable[..., sp.Expr]:
    """Return the function that builds an expression of this kind from its parts, unevaluated."""
    kind: Callable[..., sp.Expr] = expr.func
    if expr.is_Add or expr.is_Mul:
        commutes = expr.is_commutative
        return lambda *parts: expr.func._from_args(parts, commutes)
    if expr.is_Pow:
        return lambda *parts: sp.Pow(*parts, evaluate=False)
    return kind


class Substitution:
    """Replaces symbols as ``xreplace`` does.

    Parameters
    ----------
    places
        Symbol → the expression in its place.
    """

    def __init__(self, places: Mapping[sp.Basic, sp.Expr]) -> None:
        self._places = places
        #: An operation and the ``id`` of its operands → the operands, so that ids stay theirs, and
        #: its value.
        self._known: dict[tuple[Any, ...], tuple[Sequence[sp.Basic], sp.Expr]] = {}
        #: ``id`` of an expression → the expression, so that the id stays its own, and its value.
        self._put_in: dict[int, tuple[sp.Expr, sp.Expr]] = {}

    def place(self, symbol: sp.Symbol) -> sp.Expr | None:
        """Give the expression in place of a symbol; None if it stays."""
        return self._places.get(symbol)

    def put_into(self, expr: sp.Expr) -> sp.Expr:
        """Replace the symbols in an expression; parts without any stay as they are.

        Inputs that positions hold are functions of t, which are replaced as symbols are.
        """
        if expr in self._places or not expr.args:
            return self._places.get(expr, expr)
        known = self._put_in.get(id(expr))
        if known is None:
            parts = [self.put_into(a) for a in expr.args]
            is_same = all(new is old for new, old in zip(parts, expr.args, strict=True))
            known = expr, expr if is_same else self.evaluated(expr.func, parts)
            self._put_in[id(expr)] = known
        return known[1]

    def evaluated(self, kind: Callable[..., sp.Expr], parts: Sequence[sp.Expr]) -> sp.Expr:
        """Evaluate an operation, once for operands that are the same objects."""
        key = kind, *map(id, parts)
        if key not in self._known:
            self._known[key] = parts, _made(kind, parts)
        return self._known[key][1]


def _made(kind: Callable[..., sp.Expr], parts: Sequence[sp.Expr]) -> sp.Expr:
    if kind is sp.Add:
        return plain_sum(parts)
    if kind is sp.Mul and len(parts) == 2 and parts[0] is sp.S.NegativeOne:
        return negative(parts[1]) if parts[1].is_Add else sp.Mul(*parts)
    return kind(*parts)


def is_periodic(expr: sp.Expr, angle: sp.Symbol) -> bool:
    """Tell whether an expression is the same a turn later.

    It is written anew besides, as SymPy multiplies numbers into sums then: ½ (a + b).
    """
    if _turns_in_functions(expr, angle):
        return True
    dummy = sp.Dummy()
    rewritten = expr.xreplace({angle: dummy}).xreplace({dummy: angle})
    return bool(expr.xreplace({angle: angle + 2 * sp.pi}) == rewritten)


def _turns_in_functions(expr: sp.Expr, angle: sp.Symbol) -> bool:
    """Tell whether an angle occurs only in sines and cosines that are the same a turn later."""
    pending, seen = [expr], set[sp.Basic]()
    while pending:
        part = pending.pop()
        if part == angle:
            return False
        if part in seen:
            continue
        seen.add(part)
        if not isinstance(part, (sp.sin, sp.cos)):
            pending += part.args
        elif part.xreplace({angle: angle + 2 * sp.pi}) != part:
            return False
    return True
