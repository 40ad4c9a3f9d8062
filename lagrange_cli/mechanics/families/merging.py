"""Merging of sums: before and after an index, over pairs and over equal indices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import sympy as sp

from lagrange_cli.mechanics.algebra.factor import scaled
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.families.canonical import Shapes
from lagrange_cli.mechanics.families.elements import Element, Elements, Index, Place
from lagrange_cli.mechanics.families.fitting import Vector
from lagrange_cli.mechanics.families.forms import Range


@dataclass(frozen=True)
class Piece:
    """Terms of one shape.

    Attributes
    ----------
    number
        Number in front, over the letters.
    product
        The term without it, over elements with letters.
    ranges
        Indices of the sum; none if it is one term of a row.
    rows
        Indices of the rows that hold it; empty in an energy.
    """

    number: sp.Expr
    product: sp.Expr
    ranges: tuple[Range, ...] = ()
    rows: frozenset[Vector] = frozenset()

    @property
    def term(self) -> sp.Expr:
        """The whole term."""
        return self.number * self.product


@dataclass(frozen=True)
class Merging:
    """Merges pieces.

    Attributes
    ----------
    elements
        The families.
    letters
        Letters of the rows' indices, then those of sums.
    """

    elements: Elements
    letters: tuple[sp.Symbol, ...]

    def around(self, pieces: list[Piece]) -> list[Piece]:
        """Merge sums before and after a row's index, and the term at the index."""
        pieces = list(pieces)
        for piece in [p for p in pieces if p.ranges]:
            if piece not in pieces:
                continue
            for second in pieces:
                whole = self._beside(piece, second) if second is not piece else None
                if whole is not None:
                    pieces = [p for p in pieces if p not in (piece, second)] + [whole]
                    break
        for piece in [p for p in pieces if p.ranges]:
            pieces = self._with_own(piece, pieces)
        return pieces

    def _beside(self, before: Piece, after: Piece) -> Piece | None:
        """Σ over j < i and Σ over j > i of one body: over j ≠ i."""
        if not after.ranges or not self._is_same(before.product, after.product):
            return None
        (low,), (high,) = before.ranges, after.ranges
        split = low.last
        if not isinstance(split, Place) or high.first != split._replace(offset=split.offset + 2):
            return None
        if split.offset != -1 or low.letter != high.letter:
            return None
        i, j = split.letter, low.letter
        number = before.number * self._ratio(before.product, after.product)
        merged = _larger_or_smaller(number, after.number, i, j)
        if merged is None:
            return None
        both = Range(j, low.first, high.last, i)
        return Piece(merged, after.product, (both,), before.rows | after.rows)

    def _with_own(self, piece: Piece, pieces: list[Piece]) -> list[Piece]:
        """Merge the term at the row's index into a sum that leaves it out."""
        (span,) = piece.ranges
        j = span.letter
        index = span.besides
        wider = replace(span, besides=None)
        if index is None:
            for end, step in (("last", -1), ("first", 1)):
                place = getattr(span, end)
                if isinstance(place, Place) and place.offset == step:
                    index = place.letter
                    wider = replace(span, **{end: Place(index)})
        if index is None:
            return pieces
        value = self._at(piece.term, j, index)
        if value == 0 and span.besides is not None:
            return [replace(p, ranges=(wider,)) if p is piece else p for p in pieces]
        if value == 0 or not has_value(value):
            return pieces
        for local in pieces:
            if not local.ranges and sp.expand(local.term - value) == 0:
                whole = replace(piece, ranges=(wider,), rows=piece.rows | local.rows)
                return [p for p in pieces if p not in (piece, local)] + [whole]
        return pieces

    def symmetric(self, pieces: list[Piece]) -> list[Piece]:
        """Merge a sum over pairs and one over equal indices."""
        for piece in pieces:
            if len(piece.ranges) < 2 or piece.ranges[1].first != Place(piece.ranges[0].letter, 1):
                continue
            (outer, inner) = piece.ranges
            i, j = outer.letter, inner.letter
            swapped_number = piece.number.xreplace({i: j, j: i})
            number = _larger_or_smaller(swapped_number, piece.number, i, j)
            if number is None:
                continue
            number = scaled(sp.S.Half, number)
            body = number * piece.product
            swapped = self._exchanged(piece.product, i, j)
            if (
                not self._is_same(swapped, piece.product)
                or self._ratio(swapped, piece.product) != 1
            ):
                continue
            diagonal = self._at(body, j, i)
            for local in pieces:
                if len(local.ranges) != 1 or local.ranges[0] != replace(outer, last=inner.last):
                    continue
                if sp.expand(self._renamed(local.term, local.ranges[0].letter, i) - diagonal) == 0:
                    both = (replace(outer, last=inner.last), Range(j, outer.first, inner.last))
                    whole = Piece(number, piece.product, both)
                    return [p for p in pieces if p not in (piece, local)] + [whole]
        return pieces

    def _mapped(self, expr: sp.Expr, rule: Callable[[Place], Index]) -> sp.Expr:
        """Change the indices of the elements in an expression."""
        rules = {}
        for symbol in expr.free_symbols:
            element = self.elements.meanings.get(symbol)
            if element is not None:
                places = tuple(p if isinstance(p, int) else rule(p) for p in element.places)
                example = self.elements.examples[symbol]
                rules[symbol] = self.elements.pattern(element._replace(places=places), example)
        return expr.xreplace(rules)

    def _renamed(self, expr: sp.Expr, old: sp.Symbol, new: sp.Symbol) -> sp.Expr:
        if old == new:
            return expr
        moved = self._mapped(expr, lambda p: p._replace(letter=new) if p.letter == old else p)
        return moved.xreplace({old: new})

    #: The value of a term where one index equals another one.
    _at = _renamed

    def _exchanged(self, expr: sp.Expr, i: sp.Symbol, j: sp.Symbol) -> sp.Expr:
        exchange = {i: j, j: i}
        moved = self._mapped(expr, lambda p: p._replace(letter=exchange.get(p.letter, p.letter)))
        return moved.xreplace(exchange)

    def _is_same(self, first: sp.Expr, second: sp.Expr) -> bool:
        """Tell whether two terms over letters are the same up to a number."""
        a, b = self._shapes.shape_of(first), self._shapes.shape_of(second)
        return (a.text, a.symbols) == (b.text, b.symbols)

    def _ratio(self, first: sp.Expr, second: sp.Expr) -> sp.Expr:
        return self._shapes.shape_of(first).number / self._shapes.shape_of(second).number

    @cached_property
    def _shapes(self) -> Shapes:
        """Shapes of terms over letters, whose indices are ordered as the letters are."""
        rank = {letter: k for k, letter in enumerate(self.letters)}

        def element(symbol: sp.Symbol) -> Element | None:
            known = self.elements.element(symbol)
            if known is None:
                return None
            ranked = (
                (-1, p) if isinstance(p, int) else (rank[p.letter], p.offset) for p in known.places
            )
            return known._replace(places=tuple(ranked))  # type: ignore[arg-type]

        return Shapes(element)


def _larger_or_smaller(
    before: sp.Expr, after: sp.Expr, i: sp.Symbol, j: sp.Symbol
) -> sp.Expr | None:
    """Find one number for j < i and j > i: equal, or that of the larger or smaller index."""
    if sp.expand(before - after) == 0:
        return after
    if sp.expand(before.xreplace({i: j}) - after) == 0 and j not in before.free_symbols:
        return after.xreplace({j: sp.Max(i, j)})
    if sp.expand(before.xreplace({j: i}) - after) == 0 and i not in before.free_symbols:
        return after.xreplace({i: sp.Min(i, j)})
    return None
