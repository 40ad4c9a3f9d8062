"""Sizes of the scene in forms: ranges up to n, numbers relative to the end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.mechanics.families.elements import Elements, Index, Place
from lagrange_cli.mechanics.families.forms import FamilyRow, Range, Series

if TYPE_CHECKING:
    from lagrange_cli.scene.model import FamilyIndex


@dataclass(frozen=True)
class Sizes:
    """Writes sizes in place of their numbers in forms.

    Attributes
    ----------
    values
        Sizes with their values.
    families
        Family → of each index the letter, and the size that it ends with or None.
    elements
        The elements in forms.
    """

    values: Mapping[sp.Symbol, int]
    families: Mapping[str, tuple[FamilyIndex, ...]]
    elements: Elements

    def row(self, row: FamilyRow) -> FamilyRow:
        """Write sizes in a row in place of their numbers."""
        family = row.name.partition("[")[0]
        indices = row.name.partition("[")[2].rstrip("]").split(",")
        letters = {str(r.letter): r for r in row.ranges}
        sizes: dict[sp.Symbol, sp.Symbol | None] = {}
        for k, index in enumerate(indices):
            if index in letters:
                sizes[letters[index].letter] = self.size_of(family, k, letters[index])
        series = {s: self.series(one, sizes) for s, one in row.series.items()}
        ranges = tuple(self.span(r, sizes.get(r.letter)) for r in row.ranges)

        def sized(expr: sp.Expr) -> sp.Expr:
            return self._numbers(self._places(expr), sizes)

        name = row.name
        if "[" in name:
            name = f"{family}[{','.join(self._index(family, k, i) for k, i in enumerate(indices))}]"
        shown = row.shown.map(name, sized)
        return replace(row, name=name, shown=shown, ranges=ranges, series=series)

    def _index(self, family: str, position: int, index: str) -> str:
        """Write the last index, or the one behind it, by the size."""
        if not index.lstrip("-").isdigit():
            return index
        return str(self.end(int(index), self.declared(family, position), 0))

    def _places(self, expr: sp.Expr) -> sp.Expr:
        rules = {}
        for symbol in expr.free_symbols:
            element = self.elements.meanings.get(symbol)
            if element is not None and any(isinstance(p, int) for p in element.places):
                places = tuple(
                    self.end(p, self.declared(element.family, k), 0) if isinstance(p, int) else p
                    for k, p in enumerate(element.places)
                )
                example = self.elements.examples[symbol]
                rules[symbol] = self.elements.pattern(element._replace(places=places), example)
        return expr.xreplace(rules)

    def series(
        self, series: Series, outer: Mapping[sp.Symbol, sp.Symbol | None] | None = None
    ) -> Series:
        """A series whose ranges end with sizes."""
        sizes = dict(outer or {})
        for r in series.ranges:
            sizes[r.letter] = self._size_in(series.body, r)
        body = self._numbers(self._places(series.body), sizes)
        ranges = tuple(self.span(r, sizes[r.letter]) for r in series.ranges)
        return replace(series, body=body, ranges=ranges)

    def _size_in(self, body: sp.Expr, span: Range) -> sp.Symbol | None:
        """The size of an index by the elements that have it."""
        for symbol in sorted(body.free_symbols, key=str):
            element = self.elements.meanings.get(symbol)
            if element is None:
                continue
            for k, place in enumerate(element.places):
                if isinstance(place, Place) and place.letter == span.letter:
                    return self.size_of(element.family, k, span)
        return None

    def declared(self, family: str, position: int) -> sp.Symbol | None:
        # The components of the positions of p[i,j] have its indices.
        indices = self.families.get(family) or self.families.get(family[2:], ())
        wanted = indices[position].size if position < len(indices) else None
        return next((s for s in self.values if s.name == wanted), None)

    def size_of(self, family: str, position: int, span: Range) -> sp.Symbol | None:
        """Return the size at the end of an index's range: the declared one, or the only match."""
        declared = self.declared(family, position)
        if declared is not None or not isinstance(span.last, int):
            return declared
        fitting = [s for s, value in self.values.items() if value == span.last]
        return fitting[0] if len(fitting) == 1 else None

    def span(self, span: Range, size: sp.Symbol | None) -> Range:
        if size is None and isinstance(span.last, int):
            fitting = [s for s, value in self.values.items() if value == span.last]
            size = fitting[0] if len(fitting) == 1 else None
        if not isinstance(span.last, int):
            return span
        return replace(span, last=self.end(span.last, size, -1))

    def end(self, value: int, size: sp.Symbol | None, least: int) -> Index:
        """Write a number as a size, one more, or one less if ``least`` is −1."""
        if size is None or not least <= value - self.values[size] <= 1:
            return value
        return Place(size, value - self.values[size])

    def _numbers(self, expr: sp.Expr, sizes: Mapping[sp.Symbol, sp.Symbol | None]) -> sp.Expr:
        """Write numbers less an index relative to the end: ``n + 1 - i`` for ``5 - i``."""
        rules = {}
        for total in expr.atoms(sp.Add):
            letters = total.free_symbols
            if not letters or not letters <= sizes.keys():
                continue
            size = next((sizes[x] for x in sorted(letters, key=str) if sizes[x] is not None), None)
            number, moving = total.as_coeff_Add(rational=True)
            falls = moving.as_coeff_Mul(rational=True)[0] < 0
            if size is None or not falls or not number.is_Integer:
                continue
            offset = int(number) - self.values[size]
            if -1 <= offset <= 1:
                rules[total] = size + offset + moving
        return expr.xreplace(rules)
