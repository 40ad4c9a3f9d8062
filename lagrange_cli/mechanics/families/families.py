"""The families of some equations as pages show them, each form searched for once, on demand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.families.elements import (
    Element,
    Elements,
    Place,
    element_of,
    elements_of,
    families_of,
)
from lagrange_cli.mechanics.families.forms import (
    FamilyRow,
    Form,
    Range,
    assignments,
)
from lagrange_cli.mechanics.families.instances import Instances, random_point
from lagrange_cli.mechanics.families.search import Row, Search
from lagrange_cli.mechanics.families.sizes import Sizes
from lagrange_cli.mechanics.families.texts import IndexedText, indexed_texts

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Letters of indices where the scene has none, or needs more.
_LETTERS = "ijklpqrs"


@dataclass(frozen=True)
class FamilyName:
    """Coordinates of one family.

    Attributes
    ----------
    name
        Name of an element, with letters.
    ranges
        The indices.
    covers
        Numbers of the coordinates.
    """

    name: str
    ranges: tuple[Range, ...]
    covers: tuple[int, ...]


class Families:
    """The families of some equations, in the forms that pages show.

    Every form is compared, at a random state in 30 digits and for every element, with the derived
    expression. A row covers only the elements for which that holds.

    Parameters
    ----------
    equations
        The equations.
    elements
        Their elements.
    """

    def __init__(self, equations: Equations, elements: Elements) -> None:
        self.equations = equations
        self._given = elements
        self.sizes = {
            sp.Symbol(name, integer=True, positive=True): value
            for name, value in equations.presentation.sizes
        }
        self.letters = _letters(equations)
        self._constants = frozenset(p.symbol for p in equations.system.parameters)

    # -- parts of a page ----------------------------------------------------------

    @property
    def motion(self) -> tuple[FamilyRow, ...]:
        """Equations of motion; those covered are numbers of :attr:`Equations.shown`.

        Equations of no family are among them where they are shorter with sums over indices.
        """
        return self._motion

    @property
    def elements(self) -> Elements:
        """The families, with the meanings of elements beyond their ends."""
        return self._search.elements

    @cached_property
    def kinetic(self) -> Form | None:
        """The kinetic energy, None if it is written out."""
        return self.quantity(self.equations.system.kinetic)

    @cached_property
    def potential(self) -> Form | None:
        """The potential, None if it is written out."""
        return self.quantity(self.equations.system.potential)

    @cached_property
    def dissipation(self) -> Form | None:
        """The dissipation function, None if it is written out."""
        return self.quantity(self.equations.system.dissipation)

    def quantity(self, whole: sp.Expr) -> Form | None:
        """An energy or another quantity with sums over indices, None if it is written out."""
        form = self._search.energy(whole, self.letters)
        if form is None:
            return None
        series = {s: self._sizing.series(one) for s, one in form.series.items()}
        return Form(form.expression, series)

    @cached_property
    def closures(self) -> tuple[FamilyRow, ...]:
        """Closure equations; those covered are numbers of :attr:`Equations.closures`."""
        return self._named([(c.name, c.expression) for c in self.equations.system.closures])

    @cached_property
    def momenta(self) -> tuple[FamilyRow, ...]:
        """Conserved momenta; those covered are numbers of :attr:`Equations.conserved`."""
        return self._named(
            [(c.coordinate or "", c.expression) for c in self.equations.derivation.conserved]
        )

    def definitions(self, named: Sequence[tuple[str, sp.Expr]]) -> tuple[FamilyRow, ...]:
        """Definitions of names; ``covers`` counts them in the given order."""
        return self._named(named)

    def texts(self, texts: Sequence[str]) -> list[IndexedText]:
        """Texts of the scene that are alike but for their indices."""
        return [
            t._replace(ranges=tuple(self._sizing.span(r, None) for r in t.ranges))
            for t in indexed_texts(texts, self.letters)
        ]

    @cached_property
    def coordinates(self) -> tuple[FamilyName, ...]:
        """The families among the coordinates."""
        numbers = {c.name: k for k, c in enumerate(self.equations.system.coordinates)}
        names = []
        for family, elements in families_of(numbers).items():
            for text in indexed_texts([*elements.values()], self.letters):
                if text.ranges:
                    covered = tuple(numbers[[*elements.values()][k]] for k in text.covers)
                    ranges = tuple(
                        self._sizing.span(r, self._sizing.size_of(family, k, r))
                        for k, r in enumerate(text.ranges)
                    )
                    names.append(FamilyName(text.text, ranges, covered))
        return tuple(names)

    @cached_property
    def beyond(self) -> tuple[FamilyRow, ...]:
        """Meanings of elements before the first and after the last to which the forms refer."""
        reached: dict[Element, sp.Expr] = {}
        for form, ranges in self._shown():
            for element in self._reached(form, ranges):
                if element.order == 0 and element in self.elements.beyond:
                    reached[element] = self.elements.beyond[element]
        rows = [
            Row(k, element, _stated(element.name, reached[element]))
            for k, element in enumerate(sorted(reached))
        ]
        forms = list(self._rows(self._search, rows))
        covered = {k for f in forms for k in f.covers}
        for row in rows:
            if row.number not in covered:
                meaning = _stated(row.element.name, self._last_element(reached[row.element]))
                forms.append(
                    self._sizing.row(FamilyRow(row.element.name, (), (row.number,), meaning))
                )
        return tuple(sorted(forms, key=lambda row: row.covers))

    def _last_element(self, symbol: sp.Expr) -> sp.Expr:
        """The last element of a family with the size as its index; others as they are."""
        element = self.elements.by_symbol.get(symbol)
        if element is None:
            return symbol
        places = tuple(
            self._sizing.end(p, self._sizing.declared(element.family, k), 0)  # type: ignore[arg-type]
            for k, p in enumerate(element.places)
        )
        return self.elements.pattern(element._replace(places=places), symbol)

    @property
    def sizes_shown(self) -> dict[sp.Symbol, int]:
        """The sizes that ranges of coordinates end with, with their values."""
        ends = [r.last for name in self.coordinates for r in name.ranges]
        used = {end.letter for end in ends if isinstance(end, Place)}
        return {size: value for size, value in self.sizes.items() if size in used}

    @property
    def is_shown(self) -> bool:
        """Tell whether some form replaces rows or terms that would be written out."""
        return bool(self.motion or self.kinetic or self.potential)

    @property
    def _sizing(self) -> Sizes:
        return Sizes(self.sizes, dict(self.equations.presentation.families), self._given)

    # -- searches -------------------------------------------------------------------

    @cached_property
    def _decided(self) -> tuple[Search, tuple[FamilyRow, ...]]:
        """Choose between families with ends and rings; return search and equations of motion.

        Families are closed to rings if all equations have one form then.
        """
        rows = [
            Row(k, element, shown)
            for k, shown in enumerate(self.equations.derivation.shown)
            if (element := element_of(shown.coordinate)) is not None
            and element.family in self._given.families
        ]
        plain = self._searching(self._given)
        motion = self._rows(plain, rows)
        closed = None if _covers(motion, rows) else self._given.closed()
        if closed is not None:
            ring = self._searching(closed)
            around = self._rows(ring, rows)
            if _covers(around, rows):
                return ring, around
        return plain, motion

    def _searching(self, elements: Elements) -> Search:
        return Search(elements, Instances(elements, self._point), self._constants)

    @cached_property
    def _point(self) -> Mapping[sp.Symbol, mpf]:
        """A random state at which the equations have values; that of the certificate if need be."""
        equations = self.equations
        symbols = {equations.system.t, *self._constants}
        symbols |= {s for c in equations.system.coordinates for s in (c.q, c.v, c.a)}
        symbols |= {c.multiplier for c in equations.system.pushing} | {
            x.symbol for x in equations.system.external
        }
        point = random_point(sorted(symbols, key=str))
        sources = equations.derivation.sources
        if sources is None or not symbols <= sources.state.keys():
            return point
        parts = [
            equations.system.potential,
            *(shown.residual for shown in equations.derivation.shown),
        ]
        values = Instances(self._given, point).values(parts)
        return sources.state if None in values else point

    @cached_property
    def _motion(self) -> tuple[FamilyRow, ...]:
        rows = list(self._decided[1])
        covered = {k for row in rows for k in row.covers}
        for k, shown in enumerate(self.equations.derivation.shown):
            form = None
            if k not in covered and shown.rate_form is None:
                form = self.quantity(shown.residual)
            if form is not None:
                whole = replace(shown, terms=((form.expression, sp.S.One),))
                rows.append(FamilyRow(shown.coordinate, (), (k,), whole, form.series))
        return tuple(sorted(rows, key=lambda row: row.covers))

    @property
    def _search(self) -> Search:
        return self._decided[0]

    def _named(self, named: Sequence[tuple[str, sp.Expr]]) -> tuple[FamilyRow, ...]:
        known = families_of(name for name, _ in named)
        rows = [
            Row(k, element, _stated(name, expression))
            for k, (name, expression) in enumerate(named)
            if (element := element_of(name)) is not None and element.family in known
        ]
        return self._rows(self._search, rows)

    def _rows(self, search: Search, rows: Sequence[Row]) -> tuple[FamilyRow, ...]:
        sized = map(self._sizing.row, search.rows(rows, self.letters))
        return tuple(sorted(sized, key=lambda row: row.covers))

    # -- beyond the ends ----------------------------------------------------------------

    def _shown(self) -> Iterable[tuple[Form, tuple[Range, ...]]]:
        for row in self.motion:
            yield row.form, row.ranges
        for form in (self.kinetic, self.potential):
            if form is not None:
                yield form, ()

    def _reached(self, form: Form, ranges: tuple[Range, ...]) -> set[Element]:
        """Collect elements in a form that belong to no coordinate."""
        reached: set[Element] = set()
        parts = [(form.expression, ranges)]
        parts += [(one.body, (*ranges, *one.ranges)) for one in form.series.values()]
        at_sizes = dict(self.sizes)
        for expr, spans in parts:
            patterns = [
                e for s in expr.free_symbols if (e := self.elements.meanings.get(s)) is not None
            ]
            for at in assignments(spans, at_sizes):
                for pattern in patterns:
                    places = tuple(
                        p if isinstance(p, int) else at[p.letter] + p.offset for p in pattern.places
                    )
                    element = pattern._replace(places=places)
                    if element not in self.elements.symbols:
                        reached.add(element)
        return reached


def _covers(family_rows: Sequence[FamilyRow], rows: Sequence[Row]) -> bool:
    """Tell whether each family has one row that stands for all of its elements."""
    families = {row.element.family for row in rows}
    return len(family_rows) == len(families) and sum(len(f.covers) for f in family_rows) == len(
        rows
    )


def _stated(name: str, expression: sp.Expr) -> ShownEquation:
    return ShownEquation(name, ((expression, sp.S.One),), sp.S.One)


def _letters(equations: Equations) -> tuple[sp.Symbol, ...]:
    """Letters of indices: those of the scene's families, then unused ones."""
    named = [
        *(p.name for p in equations.system.parameters),
        *(c.name for c in equations.system.coordinates),
        *(c.name for c in equations.system.cartesian_names),
        *(name for name, _ in (*equations.presentation.abbreviations, *equations.system.outputs)),
        *(f.name for f in equations.system.functions),
        *(x.name for x in equations.system.external),
        *(name for name, _ in equations.presentation.sizes),
        "t",
    ]
    taken = {name.partition("[")[0].partition("_")[0].rstrip("0123456789") for name in named}
    taken |= {name.partition("[")[0] for name in named}
    families = [
        element.family for c in equations.system.coordinates if (element := element_of(c.name))
    ]
    declared = dict(equations.presentation.families)
    declared_letters = next((declared[f] for f in families if f in declared), ())
    letters = dict.fromkeys([index.letter for index in declared_letters] + [*_LETTERS])
    return tuple(
        sp.Symbol(letter, integer=True, positive=True) for letter in letters if letter not in taken
    )


def families_in(equations: Equations) -> Families | None:
    """The families of some equations that a page shows as such; None if it shows none."""
    elements = elements_of(equations)
    families = None if elements is None else Families(equations, elements)
    return families if families is not None and families.is_shown else None
