"""Elements of families with positions put in, worked out once for all that come out alike.

The springs of a net hold positions of beads in the plane, a*i and a*(i + 1), and displacements
that are coordinates. The parts with positions are evaluated first, each distinct one once. If they
have the same values, springs differ in coordinates alone again.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Sequence
from operator import attrgetter
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.algebra.substitution import Substitution
from lagrange_cli.mechanics.algebra.templates import Element, Shape, Step
from lagrange_cli.mechanics.free_symbols import symbols_in


class _Plan(NamedTuple):
    """How the elements of one shape are taken apart.

    Attributes
    ----------
    put_in
        Numbers of the symbols for which expressions are put in.
    steps
        Operations on these and on constants alone, with their numbers.
    largest
        Numbers of those of which others are made.
    """

    put_in: Sequence[int]
    steps: Sequence[tuple[int, Step]]
    largest: Sequence[int]


class ResolvedElements:
    """Elements with expressions put in place of some symbols.

    Parameters
    ----------
    substitution
        What is put in.
    coordinates
        Symbols that may be exchanged for one another; all others are what they are.
    resolve
        Puts them into an expression.
    """

    def __init__(
        self,
        substitution: Substitution,
        coordinates: Collection[sp.Symbol],
        resolve: Callable[[sp.Expr], sp.Expr],
    ) -> None:
        self._substitution = substitution
        self._coordinates = coordinates
        self._resolve = resolve
        self._plans: dict[Hashable, _Plan] = {}
        self._shapes: dict[Hashable, Shape] = {}

    def of(self, element: Element) -> Element:
        """Put expressions into an element."""
        places = [self._substitution.place(s) for s in element.symbols]
        still = [s for s, place in zip(element.symbols, places, strict=True) if place is None]
        pattern = element.shape, *[place is None for place in places]
        if pattern not in self._plans:
            self._plans[pattern] = _plan(element.shape, places)
        parts = self._parts(element, self._plans[pattern], places)
        held = set().union(*map(symbols_in, parts))
        symbols = tuple(sorted(held.union(still), key=attrgetter("name")))
        number = {s: k for k, s in enumerate(still)}
        kinds = [(number.get(s), s if s in held else self._kind(s), s.is_positive) for s in symbols]
        key = *pattern, *map(id, parts), *kinds
        if key in self._shapes:
            shape = self._shapes[key]
            return Element(shape.template.over(symbols), shape, symbols)
        expr = self._resolve(element.expr)
        self._shapes[key] = Shape(expr, symbols)
        return Element(expr, self._shapes[key], symbols)

    def _kind(self, symbol: sp.Symbol) -> Hashable:
        return "coordinate" if symbol in self._coordinates else symbol

    def _parts(
        self, element: Element, plan: _Plan, places: Sequence[sp.Expr | None]
    ) -> list[sp.Expr]:
        """The values of the largest parts for which all symbols are put in."""
        constants = element.shape.template.constants
        values: dict[int, sp.Expr] = dict(enumerate(constants, len(places)))
        values.update((k, place) for k in plan.put_in if (place := places[k]) is not None)
        for number, step in plan.steps:
            operands = [values[k] for k in step.operands]
            values[number] = self._substitution.evaluated(step.kind, operands)
        return [values[k] for k in plan.largest]


def _plan(shape: Shape, places: Sequence[sp.Expr | None]) -> _Plan:
    template = shape.template
    put_in = [k for k, place in enumerate(places) if place is not None]
    first = len(places) + len(template.constants)
    numbered = list(enumerate(template.steps, first))
    inner = [(k, step) for k, step in numbered if step.symbols.issubset(put_in)]
    known = {*put_in, *(k for k, _ in inner)}
    used = {k for number, step in numbered if number not in known for k in step.operands}
    used.add(template.whole)
    return _Plan(put_in, inner, sorted(known & used))
