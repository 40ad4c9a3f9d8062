"""The search for forms of families in energies and in rows of a page, each proven.

An energy is taken apart into terms; those of one shape whose indices run over a range become a Σ.
A row of a family becomes the row of all elements, first with indices relative to its own, then by
the terms that all rows share. Every form is compared with the derived expression, element by
element (:class:`.instances.Instances`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.families.canonical import Shapes, Term
from lagrange_cli.mechanics.families.elements import FEWEST_ROWS, Element, Elements, Index, Place
from lagrange_cli.mechanics.families.fitting import Vector, formula
from lagrange_cli.mechanics.families.forms import (
    FamilyRow,
    Form,
    places_in,
    rectangle,
)
from lagrange_cli.mechanics.families.gathering import Gathering
from lagrange_cli.mechanics.families.instances import Instances
from lagrange_cli.mechanics.families.merging import Piece
from lagrange_cli.mechanics.families.pieces import Patterns

#: Most rows that may fail as the model of the others.
_MOST_FAILURES = 2


@dataclass(frozen=True)
class Row:
    """A row of a page that belongs to an element of a family.

    Attributes
    ----------
    number
        Its place on the page.
    element
        The element.
    shown
        Its terms, and the factor that was divided out.
    """

    number: int
    element: Element
    shown: ShownEquation

    @property
    def places(self) -> Vector:
        """The indices of the element."""
        return self.element.numbers


@dataclass(frozen=True)
class Search:
    """Finds forms of families.

    Attributes
    ----------
    elements
        The families.
    instances
        Values at which forms are compared.
    constants
        Symbols that do not move.
    """

    elements: Elements
    instances: Instances
    constants: frozenset[sp.Symbol]

    @cached_property
    def _shapes(self) -> Shapes:
        return Shapes(self.elements.by_symbol.get, len(self.elements.by_symbol))

    @cached_property
    def _row_terms(self) -> dict[tuple[sp.Expr, Vector], list[Term] | None]:
        return {}

    # -- energies -----------------------------------------------------------------

    def energy(self, whole: sp.Expr, letters: tuple[sp.Symbol, ...]) -> Form | None:
        """Write an energy with its sums as Σ; None if that is not shorter in print."""
        terms = self._shapes.terms(whole, ())
        if terms is None:
            return None
        patterns = Patterns(self.elements, letters)
        pieces, left = patterns.of_energy(terms)
        if not pieces:
            return None
        pieces, remainder = self._widened(patterns, pieces, left)
        gathering = Gathering(self.elements, self._still(letters))
        form = gathering.energy(pieces, remainder)
        if form.length >= printed_length(whole):
            return None
        return form if self.instances.holds(form, {}, self.instances.values([whole])[0]) else None

    def _widened(
        self, patterns: Patterns, pieces: list[Piece], left: Sequence[Term]
    ) -> tuple[list[Piece], list[sp.Expr]]:
        """Extend sums beyond the ends of families where fewer terms are left over then."""
        leftover: dict[tuple[str, tuple[sp.Symbol, ...]], tuple[Fraction, sp.Expr]] = {}
        for term in left:
            _add(leftover, term, 1)
        for number, piece in enumerate(pieces):
            for k in range(len(piece.ranges)):
                for end, step in (("last", 1), ("first", -1)):
                    wider = self._wider(pieces[number], k, end, step)
                    smaller = wider and self._without(leftover, *wider)
                    if wider and smaller is not None and len(smaller) < len(leftover):
                        pieces[number], leftover = wider[0], smaller
        return pieces, [_rational(number) * product for number, product in leftover.values()]

    def _wider(
        self, piece: Piece, k: int, end: str, step: int
    ) -> tuple[Piece, list[sp.Expr]] | None:
        """Widen range number ``k`` of a piece by one value; return it with the added terms."""
        span = piece.ranges[k]
        limit = getattr(span, end)
        if not isinstance(limit, int) or any(isinstance(r.first, Place) for r in piece.ranges):
            return None
        wider = replace(span, **{end: limit + step})
        ranges = (*piece.ranges[:k], wider, *piece.ranges[k + 1 :])
        others = [r for m, r in enumerate(piece.ranges) if m != k]
        added = []
        for places in places_in([(r.first, r.last) for r in others]):  # type: ignore[misc]
            at = dict(zip((r.letter for r in others), places, strict=True))
            at[span.letter] = limit + step
            value = self._instance(piece.term, at)
            if value is None:
                return None
            added.append(value)
        return replace(piece, ranges=ranges), added

    def _without(
        self,
        leftover: Mapping[tuple[str, tuple[sp.Symbol, ...]], tuple[Fraction, sp.Expr]],
        _: Piece,
        added: Sequence[sp.Expr],
    ) -> dict[tuple[str, tuple[sp.Symbol, ...]], tuple[Fraction, sp.Expr]] | None:
        smaller = dict(leftover)
        for term in self._shapes.terms(sp.Add(*added), ()) or ():
            _add(smaller, term, -1)
        return {key: entry for key, entry in smaller.items() if entry[0]}

    def _instance(self, expr: sp.Expr, at: Mapping[sp.Symbol, int]) -> sp.Expr | None:
        """Substitute values of letters in an expression; None if it has no meaning there."""
        rules: dict[sp.Symbol, sp.Expr] = {s: sp.Integer(v) for s, v in at.items()}
        for symbol in expr.free_symbols:
            element = self.elements.meanings.get(symbol)
            if element is None:
                continue
            places = tuple(
                p if isinstance(p, int) else at[p.letter] + p.offset for p in element.places
            )
            concrete = element._replace(places=places)
            value = self.elements.symbols.get(concrete, self.elements.beyond.get(concrete))
            if value is None:
                return None
            rules[symbol] = value
        return expr.xreplace(rules)

    # -- rows -----------------------------------------------------------------------

    def rows(self, rows: Sequence[Row], letters: tuple[sp.Symbol, ...]) -> Iterator[FamilyRow]:
        """Find rows that stand for several elements of a family; others are left out."""
        families: dict[tuple[str, int], list[Row]] = {}
        for row in rows:
            key = row.element.family, len(row.element.places)
            families.setdefault(key, []).append(row)
        for (_, width), covered in families.items():
            yield from self._family(covered, letters, letters[:width])

    def _family(
        self,
        rows: list[Row],
        letters: tuple[sp.Symbol, ...],
        indices: tuple[sp.Symbol, ...],
    ) -> Iterator[FamilyRow]:
        parts = [e for row in rows for e in row.shown.whole_parts]
        values = iter(self.instances.values(parts))
        known = {row.places: [next(values) for _ in row.shown.whole_parts] for row in rows}
        waiting = {row.places: row for row in rows}
        failures = 0
        while failures < _MOST_FAILURES and len(waiting) >= FEWEST_ROWS:
            model = self._model(list(waiting.values()))
            best = self._best(model, waiting, known, letters, indices)
            if best is None or len(best.covers) < FEWEST_ROWS:
                del waiting[model.places]
                failures += 1
                continue
            yield best
            for place in [p for p, r in waiting.items() if r.number in best.covers]:
                del waiting[place]

    def _best(
        self,
        model: Row,
        waiting: Mapping[Vector, Row],
        known: Mapping[Vector, Sequence[mpf | None]],
        letters: tuple[sp.Symbol, ...],
        indices: tuple[sp.Symbol, ...],
    ) -> FamilyRow | None:
        """Choose the form of most rows, between the model's own and the terms that all share."""
        best: FamilyRow | None = None
        for candidate in self._candidates(model, waiting, letters, indices):
            row = self._proven(candidate, model, waiting, known, indices)
            if row is not None and (best is None or len(row.covers) > len(best.covers)):
                best = row
            if best is not None and len(best.covers) == len(waiting):
                break
        return None if best is None else fixed(best, self.elements)

    def _candidates(
        self,
        model: Row,
        waiting: Mapping[Vector, Row],
        letters: tuple[sp.Symbol, ...],
        indices: tuple[sp.Symbol, ...],
    ) -> Iterator[FamilyRow]:
        name = model.element._replace(places=tuple(Place(letter) for letter in indices)).name
        shifted = self._shifted(model, indices)
        yield FamilyRow(name, (), (), replace(shifted, coordinate=name))
        common = self._common(model, waiting, letters)
        if common is not None:
            terms, series = common
            for divisor in self._divisors(shifted.divided_by, waiting, indices):
                yield FamilyRow(name, (), (), ShownEquation(name, terms, divisor), series)

    def _divisors(
        self, shifted: sp.Expr, waiting: Mapping[Vector, Row], indices: tuple[sp.Symbol, ...]
    ) -> list[sp.Expr]:
        """List forms of the divisor over the index, on which its number may depend."""
        numbers = {}
        for place, row in waiting.items():
            number = row.shown.divided_by.as_coeff_Mul(rational=True)[0]
            numbers[place] = Fraction(int(number.p), int(number.q))
        number = formula(numbers, indices)
        symbolic = shifted.as_coeff_Mul(rational=True)[1]
        return [shifted] if number is None else [number * symbolic]

    def _model(self, rows: list[Row]) -> Row:
        """Choose the row with the most elements; of several the middle one."""
        centre = [sum(r.places[k] for r in rows) / len(rows) for k in range(len(rows[0].places))]

        def key(row: Row) -> tuple[int, float, Vector]:
            element_count = sum(
                s in self.elements.by_symbol for s in row.shown.residual.free_symbols
            )
            away = sum((p - c) ** 2 for p, c in zip(row.places, centre, strict=True))
            # Indices that differ tell which of them an element with one index goes with.
            return -element_count, away + 0.1 * (len(set(row.places)) < len(row.places)), row.places

        return min(rows, key=key)

    def _shifted(self, model: Row, indices: tuple[sp.Symbol, ...]) -> ShownEquation:
        """Write a row with indices relative to its own."""
        shown = model.shown
        rules: dict[sp.Symbol, sp.Symbol] = {}
        for symbol in set[sp.Symbol]().union(*(p.free_symbols for p in shown.whole_parts)):
            element = self.elements.by_symbol.get(symbol)
            if element is not None and len(element.places) <= len(indices):
                places = counted(element.numbers, model.places, indices)
                rules[symbol] = self.elements.pattern(element._replace(places=places), symbol)
        return shown.map(shown.coordinate, lambda e: e.xreplace(rules))

    def _common(
        self, model: Row, waiting: Mapping[Vector, Row], letters: tuple[sp.Symbol, ...]
    ) -> tuple[tuple[tuple[sp.Expr, sp.Expr], ...], dict] | None:  # type: ignore[type-arg]
        """Write the terms that all rows share, as far as the model holds them."""
        terms: list[Term] = []
        for row in waiting.values():
            flat = self._terms(row)
            if flat is None:
                return None
            terms += flat
        pieces = Patterns(self.elements, letters).of_rows(terms, frozenset(waiting))
        pieces = [p for p in pieces if model.places in p.rows]
        gathering = Gathering(self.elements, self._still(letters))
        shown = tuple(gathering.row(pieces))
        return (shown, gathering.series_in([e for pair in shown for e in pair])) if shown else None

    def _terms(self, row: Row) -> list[Term] | None:
        """Terms of a row, split once."""
        key = row.shown.residual, row.places
        if key not in self._row_terms:
            self._row_terms[key] = self._shapes.terms(*key)
        return self._row_terms[key]

    def _still(self, letters: tuple[sp.Symbol, ...]) -> frozenset[sp.Symbol]:
        patterns = (s for s, example in self.elements.examples.items() if example in self.constants)
        return self.constants | frozenset(letters) | frozenset(patterns)

    def _proven(
        self,
        candidate: FamilyRow,
        model: Row,
        waiting: Mapping[Vector, Row],
        known: Mapping[Vector, Sequence[mpf | None]],
        indices: tuple[sp.Symbol, ...],
    ) -> FamilyRow | None:
        """Return the candidate with its proven elements; None if these are too few."""
        forms = [Form(part, candidate.series) for part in candidate.shown.whole_parts]

        def is_held_at(places: Vector) -> bool:
            at = dict(zip(indices, places, strict=True))
            values = known[places]
            return len(values) == len(forms) and all(
                self.instances.holds(form, at, value)
                for form, value in zip(forms, values, strict=True)
            )

        proven_places = {p for p in waiting if is_held_at(p)} if is_held_at(model.places) else set()
        if not proven_places:
            return None
        ends = block(model.places, proven_places)
        rows = [waiting[p] for p in places_in(ends)]
        covered = tuple(row.number for row in rows)
        row = replace(candidate, ranges=rectangle(indices, ends), covers=covered)
        # Each row has a name and a sign of equality, too.
        written = sum(printed_length(r.shown.residual) + 2 for r in rows)
        return row if row.length + 2 < written else None


def _add(
    leftover: dict[tuple[str, tuple[sp.Symbol, ...]], tuple[Fraction, sp.Expr]],
    term: Term,
    sign: int,
) -> None:
    key = term.text, term.symbols
    number, product = leftover.get(key, (Fraction(0), term.product))
    leftover[key] = number + sign * term.number, product


def _rational(value: Fraction) -> sp.Rational:
    return sp.Rational(value.numerator, value.denominator)


def counted(places: Vector, row: Vector, indices: tuple[sp.Symbol, ...]) -> tuple[Place, ...]:
    """Write indices relative to a row's; a single index relative to the nearest of two."""
    if len(places) == len(indices):
        return tuple(Place(o, p - r) for o, p, r in zip(indices, places, row, strict=True))
    (place,) = places
    k = min(range(len(row)), key=lambda k: abs(place - row[k]))
    return (Place(indices[k], place - row[k]),)


def block(centre: Vector, members: set[Vector]) -> list[tuple[int, int]]:
    """Grow a block of indices around one as long as all in it are members; return its ends."""
    ends = [(p, p) for p in centre]
    grows = True
    while grows:
        grows = False
        for k in range(len(ends)):
            for step in (-1, 1):
                first, last = ends[k]
                added = first - 1 if step < 0 else last + 1
                layer = [*ends[:k], (added, added), *ends[k + 1 :]]
                if all(p in members for p in places_in(layer)):
                    ends[k] = (min(first, added), max(last, added))
                    grows = True
    return ends


def fixed(row: FamilyRow, elements: Elements) -> FamilyRow:
    """Replace the indices of a row that take one value by that value."""
    single = {r.letter: int(r.first) for r in row.ranges if r.first == r.last}  # type: ignore[arg-type]
    if not single:
        return row

    def rule(place: Index) -> Index:
        if isinstance(place, Place) and place.letter in single:
            return single[place.letter] + place.offset
        return place

    def fixed(expr: sp.Expr) -> sp.Expr:
        rules: dict[sp.Symbol, sp.Expr] = {s: sp.Integer(v) for s, v in single.items()}
        for symbol in expr.free_symbols:
            element = elements.meanings.get(symbol)
            if element is not None:
                moved = element._replace(places=tuple(map(rule, element.places)))
                rules[symbol] = elements.pattern(moved, elements.examples[symbol])
        return expr.xreplace(rules)

    name = row.name
    for letter, value in single.items():
        head, _, indices = name.partition("[")
        shown_indices = [str(value) if i == str(letter) else i for i in indices[:-1].split(",")]
        name = f"{head}[{','.join(shown_indices)}]"
    shown = row.shown.map(name, fixed)
    series = {
        s: replace(
            one,
            body=fixed(one.body),
            ranges=tuple(replace(r, first=rule(r.first), last=rule(r.last)) for r in one.ranges),
        )
        for s, one in row.series.items()
    }
    ranges = tuple(r for r in row.ranges if r.letter not in single)
    return replace(row, name=name, ranges=ranges, shown=shown, series=series)
