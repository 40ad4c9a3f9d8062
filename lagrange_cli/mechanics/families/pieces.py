"""Terms of one shape as few terms over letters: neighbours, sums, pairs.

The patterns are proposals; :mod:`.instances` compares them with the derived expressions.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from lagrange_cli.mechanics.families.canonical import Term
from lagrange_cli.mechanics.families.elements import Elements, Index, Place
from lagrange_cli.mechanics.families.fitting import (
    Bound,
    Link,
    Vector,
    formula,
    links,
    row_ranges,
    runs,
)
from lagrange_cli.mechanics.families.forms import Range
from lagrange_cli.mechanics.families.merging import Merging, Piece

#: Fewest terms of a sum that is written with Σ, and fewest rows that show a pattern.
_FEWEST_TERMS = 3


@dataclass(frozen=True)
class Patterns:
    """Finds patterns in terms.

    Attributes
    ----------
    elements
        The families.
    letters
        Letters of the rows' indices, then those of sums.
    """

    elements: Elements
    letters: tuple[sp.Symbol, ...]

    @cached_property
    def _merging(self) -> Merging:
        return Merging(self.elements, self.letters)

    # -- energies ---------------------------------------------------------------

    def of_energy(self, terms: Iterable[Term]) -> tuple[list[Piece], list[Term]]:
        """Find the sums in an energy; return them with the terms that belong to no sum."""
        pieces: list[Piece] = []
        left: list[Term] = []
        for group in _grouped(terms, lambda t: t.text):
            for part in self._split(group, self._energy_ranges):
                if isinstance(part, Term):
                    left.append(part)
                else:
                    pieces.append(part)
        return self._merging.symmetric(pieces), left

    def _split(
        self,
        group: Sequence[Term],
        whole: Callable[[Sequence[Term]], list[Piece | Term] | None],
    ) -> list[Piece | Term]:
        """Find one pattern of all terms of a group, or one for each distance between elements."""
        known = whole(group)
        if known is not None:
            return known
        pieces: list[Piece | Term] = []
        for part in _grouped(group, lambda t: str(_distances(self._places(t)))):
            pieces += whole(part) or list(part)
        return pieces

    def _energy_ranges(self, group: Sequence[Term]) -> list[Piece | Term] | None:
        """One or two indices that all terms of a group run over."""
        if len(group) < _FEWEST_TERMS:
            return list(group)
        vectors = [_flat(self._places(t)) for t in group]
        linked = _from_least(links(vectors))
        count = len({k.variable for k in linked} - {None})
        points = {_variables(v, linked): t for v, t in zip(vectors, group, strict=True)}
        if len(points) < len(group):
            return None
        if count == 1:
            return self._lines(points, linked)
        return self._areas(points, linked) if count == 2 else None

    def _lines(
        self, points: dict[Vector, Term], linked: Sequence[Link]
    ) -> list[Piece | Term] | None:
        """Sums over one index, each over a range with one formula for the number in front."""
        spans = runs([v[0] for v in points])
        whole = self._summed(points, linked, spans[0]) if len(spans) == 1 else None
        if whole is not None:
            return [whole]
        pieces: list[Piece | Term] = []
        for alike in _grouped(points, lambda v: str(points[v].number)):
            for span in runs([v[0] for v in alike]):
                piece = self._summed({(k,): points[k,] for k in span}, linked, span)
                pieces += [points[k,] for k in span] if piece is None else [piece]
        return pieces

    def _summed(
        self, points: dict[Vector, Term], linked: Sequence[Link], span: range
    ) -> Piece | None:
        if len(points) < _FEWEST_TERMS:
            return None
        ends = Range(self.letters[0], span.start, span.stop - 1)
        return self._piece(points, linked, (ends,))

    def _areas(
        self, points: dict[Vector, Term], linked: Sequence[Link]
    ) -> list[Piece | Term] | None:
        """Fit a sum over two indices: a rectangle, or pairs with the first less than the second."""
        first, second = self.letters[:2]
        rows = runs({v[0] for v in points})
        columns = runs({v[1] for v in points})
        if len(rows) > 1 or len(columns) > 1:
            return None
        (a,), (b,) = rows, columns
        if len(points) == len(a) * len(b):
            ranges = (Range(first, a.start, a.stop - 1), Range(second, b.start, b.stop - 1))
        elif len(points) == len(a) * (len(a) + 1) // 2 and all(v[0] < v[1] for v in points):
            if (b.start, b.stop) != (a.start + 1, a.stop + 1):
                return None
            inner = Range(second, Place(first, 1), a.stop)
            ranges = (Range(first, a.start, a.stop - 1), inner)
        else:
            return None
        piece = self._piece(points, linked, ranges)
        return None if piece is None else [piece]

    def _piece(
        self, points: dict[Vector, Term], linked: Sequence[Link], ranges: tuple[Range, ...]
    ) -> Piece | None:
        letters = [r.letter for r in ranges]
        number = formula({v: t.number for v, t in points.items()}, letters)
        if number is None:
            return None
        places = [
            link.offset if link.variable is None else Place(letters[link.variable], link.offset)
            for link in linked
        ]
        body = self._over_letters(points.values(), places)
        return None if body is None else Piece(number, body, ranges)

    # -- rows -------------------------------------------------------------------

    def of_rows(self, terms: Iterable[Term], rows: frozenset[Vector]) -> list[Piece]:
        """Find the terms that all rows of a family share; terms of few rows are left out."""
        pieces: list[Piece] = []
        for group in _grouped(terms, lambda t: t.text):
            for part in _grouped(group, lambda t: str(self._sides(t))):
                whole = self._in_rows(part, rows)
                if whole is not None:
                    pieces.append(whole)
                    continue
                for alike in _grouped(part, lambda t: str(self._from_row(t))):
                    piece = self._in_rows(alike, rows)
                    pieces += [] if piece is None else [piece]
        return self._merging.around(pieces)

    def _in_rows(self, group: Sequence[Term], rows: frozenset[Vector]) -> Piece | None:
        """One term of each row, or a sum over one index in each."""
        holders = frozenset(t.row for t in group)
        if len(holders) < _FEWEST_TERMS:
            return None
        width = len(group[0].row)
        vectors = [(*t.row, *_flat(self._places(t))) for t in group]
        linked = links(vectors)
        index_of = {link.variable: k for k, link in enumerate(linked[:width])}
        free = {k.variable for k in linked} - index_of.keys() - {None}
        if len(free) > 1 or len({(t.row, t.symbols) for t in group}) < len(group):
            return None
        ranges: tuple[Range, ...] = ()
        letters = self.letters[:width]
        points = {(*t.row,): t.number for t in group}
        if free:
            (variable,) = free
            at = next(k for k, link in enumerate(linked) if link.variable == variable)
            sums: dict[Vector, set[int]] = defaultdict(set)
            for vector in vectors:
                sums[vector[:width]].add(vector[at])
            ends = row_ranges(sums, rows)
            if ends is None or max(map(len, sums.values())) < _FEWEST_TERMS - 1:
                return None
            letter = self.letters[width]
            first, last = (self._index(end) for end in ends)
            ranges, letters = (Range(letter, first, last),), (*letters, letter)
            points = {(*v[:width], v[at]): t.number for v, t in zip(vectors, group, strict=True)}
            index_of[variable] = width
        elif len(group) != len(holders):
            return None
        number = formula(points, letters)
        if number is None:
            return None
        places: list[Index] = []
        for link in linked[width:]:
            if link.variable is None:
                places.append(link.offset)
            else:
                k = index_of[link.variable]
                base = linked[k].offset if k < width else 0
                places.append(Place(letters[k], link.offset - base))
        body = self._over_letters(group, places)
        return None if body is None else Piece(number, body, ranges, holders)

    def _index(self, bound: Bound) -> Index:
        if bound.position is None:
            return bound.offset
        return Place(self.letters[bound.position], bound.offset)

    def _from_row(self, term: Term) -> list[Vector]:
        """Distances of the elements of a term from its row."""
        row = term.row
        return [
            tuple(p - row[k % len(row)] for k, p in enumerate(places))
            for places in self._places(term)
        ]

    def _sides(self, term: Term) -> list[Vector]:
        """Signs of these distances."""
        return [tuple((d > 0) - (d < 0) for d in ds) for ds in self._from_row(term)]

    # -- terms over letters ---------------------------------------------------------

    def _places(self, term: Term) -> list[Vector]:
        """The indices of the elements of a term."""
        return [self.elements.by_symbol[s].numbers for s in term.symbols]

    def _over_letters(self, terms: Iterable[Term], places: Sequence[Index]) -> sp.Expr | None:
        """Replace indices by letters in a term, chosen so that its elements stay distinct."""
        for term in terms:
            rules: dict[sp.Symbol, sp.Symbol] = {}
            taken, at = True, 0
            for symbol in term.symbols:
                element = self.elements.by_symbol[symbol]
                indices = tuple(places[at : at + len(element.places)])
                at += len(element.places)
                pattern = self.elements.pattern(element._replace(places=indices), symbol)
                taken &= rules.setdefault(symbol, pattern) == pattern
            if taken and len(set(rules.values())) == len(rules):
                return term.product.xreplace(rules)
        return None


def _grouped(items: Iterable, key: Callable) -> Iterator[list]:  # type: ignore[type-arg]
    groups: dict[str, list] = {}  # type: ignore[type-arg]
    for item in items:
        groups.setdefault(key(item), []).append(item)
    yield from groups.values()


def _flat(places: Iterable[Vector]) -> Vector:
    return tuple(p for indices in places for p in indices)


def _distances(places: Sequence[Vector]) -> list[Vector]:
    """Distances of elements from the first one of as many indices."""
    first: dict[int, Vector] = {}
    distances = []
    for indices in places:
        origin = first.setdefault(len(indices), indices)
        distances.append(tuple(p - o for p, o in zip(indices, origin, strict=True)))
    return distances


def _from_least(linked: Sequence[Link]) -> list[Link]:
    """Offsets counted from the least of each variable."""
    least: dict[int, int] = {}
    for link in linked:
        if link.variable is not None:
            least[link.variable] = min(link.offset, least.get(link.variable, link.offset))
    return [
        link if link.variable is None else Link(link.variable, link.offset - least[link.variable])
        for link in linked
    ]


def _variables(vector: Vector, linked: Sequence[Link]) -> Vector:
    """The values of the variables in a vector."""
    values: dict[int, int] = {}
    for component, link in zip(vector, linked, strict=True):
        if link.variable is not None:
            values[link.variable] = component - link.offset
    return tuple(values[k] for k in sorted(values))
