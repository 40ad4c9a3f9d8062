"""Display trees of forms over letters: elements of families and sums over indices."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.families.elements import index_at
from lagrange_cli.notation import ordering
from lagrange_cli.notation.build import display
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayNode,
    DisplayRange,
    DisplaySymbol,
    SignedNode,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.families import Families
    from lagrange_cli.mechanics.families.forms import FamilyRow, Form, Range, Series
    from lagrange_cli.notation.vocabulary import NamedFactor, Vocabulary

#: Offsets of indices are ordered as numbers of this many digits.
_MIDDLE = 500_000


@dataclass(frozen=True)
class FamilyNotation:
    """Writes forms over letters.

    Attributes
    ----------
    families
        What the forms are of.
    words
        Display names of the equations' symbols.
    """

    families: Families
    words: Vocabulary

    def whole(self, row: FamilyRow) -> DisplayNode:
        """Return a definition or quantity of all elements."""
        return self.part(row, row.shown.residual)

    def part(self, row: FamilyRow, expression: sympy.Expr) -> DisplayNode:
        """Another expression over the letters of a row."""
        return display(expression, self.words_of(row))

    def words_of(self, row: FamilyRow) -> Vocabulary:
        """Return names of all symbols that a row shows."""
        shown, form = row.shown, row.shown.rate_form
        pairs = [*shown.terms, *(() if form is None else form.remainder)]
        parts = [*(e for pair in pairs for e in pair), *shown.whole_parts]
        return self._words(parts, row.series, row.ranges)

    def form(self, form: Form, ranges: tuple[Range, ...] = ()) -> DisplayNode:
        """Return an expression with sums over indices."""
        return display(form.expression, self._words([form.expression], form.series, ranges))

    # -- words --------------------------------------------------------------------

    def _words(
        self,
        parts: Sequence[sympy.Expr],
        series_of: Mapping[sympy.Symbol, Series],
        ranges: tuple[Range, ...],
    ) -> Vocabulary:
        """Return names of the symbols of some expressions, and what their series are."""
        words = self._known(parts, ranges)
        named: dict[sympy.Expr, tuple[NamedFactor, ...]] = dict(words.named)
        for symbol, series in series_of.items():
            node = self._series(series, ranges)
            named[symbol] = ((SignedNode(False, node), Fraction(1)),)
        return replace(words, named=named)

    def _series(self, series: Series, outer: tuple[Range, ...]) -> DisplayNode:
        words = self._known([series.body], (*outer, *series.ranges))
        body = display(series.body, words)
        return ordering.series_of(body, tuple(self._ranges(series.ranges)))

    def _known(self, parts: Sequence[sympy.Expr], ranges: tuple[Range, ...]) -> Vocabulary:
        """Words with the symbols of some parts, whose sums stand in the order of the scene."""
        symbols = set[sympy.Symbol]().union(*(p.free_symbols for p in parts))
        atoms = dict(self.words.atoms)
        meanings = self.families.elements.meanings
        counters = [*self.families.letters, *self.families.sizes]
        for symbol in symbols:
            if symbol in meanings:
                atoms[symbol] = self._element(symbol)
            elif symbol in counters:
                atoms[symbol] = ordering.symbol_of(
                    symbol.name, Dependence.NUMBER, counters.index(symbol)
                )
        totals = set[sympy.Expr]().union(*(p.atoms(sympy.Add) for p in parts))
        sums = {**self.words.sums, **dict(self._sums(totals, ranges))}
        return replace(self.words, atoms=atoms, sums=sums)

    def _element(self, symbol: sympy.Symbol) -> DisplaySymbol:
        """An element over letters, ordered as the first of its family, then by its indices."""
        elements = self.families.elements
        element = elements.meanings[symbol]
        like = self.words.atoms[elements.examples[symbol]]
        first = min(
            self.words.atoms[s].traits.text
            for e, s in elements.symbols.items()
            if (e.family, e.order) == (element.family, element.order)
        )
        ranks = {letter: k for k, letter in enumerate(self.families.letters)}
        indices = "".join(
            f".{0 if isinstance(p, int) else 1 + ranks.get(p.letter, 90):02d}"
            f"{_MIDDLE + (p if isinstance(p, int) else p.offset):06d}"
            for p in element.places
        )
        return replace(
            like, name=element.name, latex=None, traits=replace(like.traits, text=first + indices)
        )

    def _sums(
        self, totals: Iterable[sympy.Expr], ranges: tuple[Range, ...]
    ) -> Iterator[tuple[sympy.Expr, tuple[tuple[sympy.Expr, ...], bool]]]:
        """Return sums of indices, sizes first; others in the order in which the scene has them."""
        counters = {*self.families.letters, *self.families.sizes}
        at = self._example(ranges)
        for total in totals:
            if total.free_symbols <= counters:
                yield total, (tuple(sorted(total.args, key=self._counted)), False)
                continue
            rules = self._rules(total, at)
            if rules is None:
                continue
            terms = {term.xreplace(rules): term for term in total.args}
            written, negative = self.words.sums.get(sympy.Add(*terms), (None, False))
            if written is not None and set(written) <= terms.keys():
                yield total, (tuple(terms[w] for w in written), negative)

    def _counted(self, term: sympy.Expr) -> tuple[int, str]:
        size = term in self.families.sizes
        return (0 if size else 1 if term.is_Integer else 2), str(term)

    def _example(self, ranges: tuple[Range, ...]) -> Mapping[sympy.Symbol, int]:
        """Return values of indices in the midst of their ranges, apart from each other."""
        values: dict[sympy.Symbol, int] = dict(self.families.sizes)
        for k, span in enumerate(ranges):
            first, last = (index_at(end, values) for end in (span.first, span.last))
            values[span.letter] = first + (last - first) // 2 if k % 2 == 0 else last
        return values

    def _rules(
        self, total: sympy.Expr, at: Mapping[sympy.Symbol, int]
    ) -> dict[sympy.Symbol, sympy.Symbol] | None:
        """Return the elements of a sum at some indices; None if one of them is no symbol."""
        elements, rules = self.families.elements, {}
        for symbol in total.free_symbols:
            element = elements.meanings.get(symbol)
            if element is None:
                continue
            try:
                places = tuple(index_at(p, at) for p in element.places)
            except KeyError:
                return None
            known = elements.symbols.get(element._replace(places=places))
            if known is None:
                return None
            rules[symbol] = known
        return rules

    # -- ranges ---------------------------------------------------------------------

    def _ranges(self, ranges: Sequence[Range]) -> Iterator[DisplayRange]:
        """Return the indices of a sum; pairs i < j of all elements are told apart from others."""
        for k, span in enumerate(ranges):
            shown = DisplayRange(span.letter.name, str(span.first), str(span.last))
            if span.besides is not None:
                whole = self._is_whole(span.first, span.last)
                shown = replace(shown, besides=span.besides.name, is_whole=whole)
            elif k and str(span.first) == f"{ranges[k - 1].letter}+1":
                outer = ranges[k - 1]
                is_pair = index_at(outer.last, self._sizes) + 1 == index_at(span.last, self._sizes)
                if is_pair and self._is_whole(outer.first, span.last):
                    shown = replace(shown, after=outer.letter.name, is_whole=True)
            yield shown

    @property
    def _sizes(self) -> Mapping[sympy.Symbol, int]:
        return self.families.sizes

    def _is_whole(self, first: object, last: object) -> bool:
        """Tell whether a range is that of all elements of a family."""
        return any(
            (r.first, r.last) == (first, last)
            for name in self.families.coordinates
            for r in name.ranges
        )
