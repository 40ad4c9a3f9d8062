"""Expressions over letters of indices: sums with Σ and rows of families, as frozen values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

import sympy as sp

from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.families.elements import Index, index_at

#: Length in print of a Σ, or of the range of an element, with a letter and its two ends.
_RANGE_LENGTH = 4


@dataclass(frozen=True)
class Range:
    """The values of an index.

    Attributes
    ----------
    letter
        The index.
    first, last
        Its ends, over the letters of outer indices.
    besides
        The outer index whose value it skips, None if it takes all values.
    """

    letter: sp.Symbol
    first: Index
    last: Index
    besides: sp.Symbol | None = None

    def values(self, outer: Mapping[sp.Symbol, int]) -> list[int]:
        """Values of the index for values of the outer ones."""
        first, last = index_at(self.first, outer), index_at(self.last, outer)
        left_out = None if self.besides is None else outer[self.besides]
        return [k for k in range(first, last + 1) if k != left_out]


def assignments(
    ranges: tuple[Range, ...], outer: Mapping[sp.Symbol, int] | None = None
) -> Iterator[dict[sp.Symbol, int]]:
    """Yield all values of some indices for values of the outer ones."""
    if not ranges:
        yield dict(outer or {})
        return
    for value in ranges[0].values(outer or {}):
        yield from assignments(ranges[1:], {**(outer or {}), ranges[0].letter: value})


@dataclass(frozen=True)
class Series:
    """A sum of one body over indices.

    Attributes
    ----------
    body
        The summand.
    ranges
        The indices, the outermost first.
    """

    body: sp.Expr
    ranges: tuple[Range, ...]


@dataclass(frozen=True)
class Form:
    """An expression over letters.

    Attributes
    ----------
    expression
        The expression; symbols in it stand for series and for elements over letters.
    series
        Symbol → its series.
    """

    expression: sp.Expr
    series: Mapping[sp.Symbol, Series] = field(default_factory=dict)

    @property
    def length(self) -> int:
        """Its length in print."""
        return printed_length(self.expression) + sum(
            printed_length(s.body) - 1 + _RANGE_LENGTH * len(s.ranges) for s in self.series.values()
        )


@dataclass(frozen=True)
class FamilyRow:
    """A row of a page for all elements of a family: an equation, a definition, a momentum.

    Attributes
    ----------
    name
        Name of the element, with letters: ``u[i]``, ``rod[i]``.
    ranges
        The indices of the elements.
    covers
        Numbers of the rows that it replaces.
    shown
        The terms, and the factor that was divided out.
    series
        Symbol in these → its series.
    """

    name: str
    ranges: tuple[Range, ...]
    covers: tuple[int, ...]
    shown: ShownEquation
    series: Mapping[sp.Symbol, Series] = field(default_factory=dict)

    @property
    def form(self) -> Form:
        """The sum of the terms."""
        return Form(self.shown.residual, self.series)

    @property
    def length(self) -> int:
        """Its length in print."""
        return self.form.length + _RANGE_LENGTH * sum(r.first != r.last for r in self.ranges)


def rectangle(letters: tuple[sp.Symbol, ...], ends: list[tuple[int, int]]) -> tuple[Range, ...]:
    """Ranges between numbers, one for each letter."""
    return tuple(
        Range(letter, first, last) for letter, (first, last) in zip(letters, ends, strict=True)
    )


def places_in(ends: list[tuple[int, int]]) -> Iterator[tuple[int, ...]]:
    """Yield all indices between some ends."""
    return product(*(range(first, last + 1) for first, last in ends))
