"""Elements of indexed families among the symbols of equations: ``u[2,3]``, ``x2``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, cast

import sympy as sp

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate

#: Fewest elements of a family that is shown as a family: two or three are written out.
FEWEST = 4
#: Fewest neighbours in a family that are shown by one row.
FEWEST_ROWS = 3

_BRACKETED = re.compile(r"(.+)\[(-?\d+(?:,-?\d+)*)\]")
_NUMBERED = re.compile(r"(.*[^\W\d])_?(0|[1-9]\d*)")


class Place(NamedTuple):
    """An index: a letter plus a number."""

    letter: sp.Symbol
    offset: int = 0

    def __str__(self) -> str:
        return f"{self.letter}{self.offset:+d}" if self.offset else str(self.letter)


#: An index of an element, or an end of a range.
Index: TypeAlias = Place | int


def index_at(index: Index, letters: Mapping[sp.Symbol, int]) -> int:
    """Value of an index for values of the letters."""
    return index if isinstance(index, int) else letters[index.letter] + index.offset


class Element(NamedTuple):
    """One element of a family.

    Attributes
    ----------
    family
        Name of the family.
    order
        Number of dots over it.
    places
        Its indices.
    """

    family: str
    order: int
    places: tuple[Index, ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """The indices of an element that has no letters."""
        return cast("tuple[int, ...]", self.places)

    @property
    def name(self) -> str:
        """The element as the scene language writes it, without dots: ``u[i+1,j]``."""
        return f"{self.family}[{','.join(map(str, self.places))}]"


def element_of(name: str) -> Element | None:
    """Read a name with one or two indices, ``p[2,3]``, or with a number behind it, ``x2``."""
    bracketed = _BRACKETED.fullmatch(name)
    if bracketed:
        places = tuple(map(int, bracketed[2].split(",")))
        return Element(bracketed[1], 0, places) if len(places) < 3 else None
    numbered = _NUMBERED.fullmatch(name)
    return Element(numbered[1], 0, (int(numbered[2]),)) if numbered else None


def families_of(names: Iterable[str]) -> dict[str, dict[tuple[int, ...], str]]:
    """Group names by family: index → name. Families of few elements are left out."""
    families: dict[str, dict[tuple[int, ...], str]] = {}
    doubtful = set()
    for name in names:
        element = element_of(name)
        if element is not None:
            elements = families.setdefault(element.family, {})
            if element.numbers in elements:
                doubtful.add(element.family)
            elements[element.numbers] = name
    return {
        family: elements
        for family, elements in families.items()
        if len(elements) >= FEWEST
        and family not in doubtful
        and len({len(places) for places in elements}) == 1
    }


@dataclass(frozen=True)
class Elements:
    """The elements among the symbols of some equations.

    Attributes
    ----------
    by_symbol
        Symbol → its element.
    symbols
        Element → its symbol.
    beyond
        Element without a symbol → its expression, by the scene or by a convention.
    patterns
        Element over letters → the symbol that stands for it in forms.
    meanings
        Symbol that stands for an element over letters → that element.
    examples
        The same symbol → the symbol of one such element.
    """

    by_symbol: Mapping[sp.Symbol, Element]
    symbols: Mapping[Element, sp.Symbol]
    beyond: Mapping[Element, sp.Expr]
    patterns: dict[Element, sp.Symbol] = field(default_factory=dict)
    meanings: dict[sp.Symbol, Element] = field(default_factory=dict)
    examples: dict[sp.Symbol, sp.Symbol] = field(default_factory=dict)

    @property
    def families(self) -> set[str]:
        """Names of the families."""
        return {element.family for element in self.symbols}

    def pattern(self, element: Element, example: sp.Symbol) -> sp.Symbol:
        """Symbol of an element whose indices may hold letters, of the kind of ``example``."""
        if element in self.symbols:
            return self.symbols[element]
        if element not in self.patterns:
            name = element.name
            for _ in range(element.order):
                name = f"dot({name})" if name == element.name else f"d{name}"
            symbol = sp.Symbol(name, **example.assumptions0)
            self.patterns[element] = symbol
            self.meanings[symbol] = element
            self.examples[symbol] = example
        return self.patterns[element]

    def element(self, symbol: sp.Symbol) -> Element | None:
        """Element of a symbol, or of one over letters; None for a symbol of no family."""
        return self.by_symbol.get(symbol) or self.meanings.get(symbol)

    def closed(self) -> Elements | None:
        """Close the families to rings: elements before the first and after the last have meanings.

        None if all such elements have a meaning already.
        """
        further = dict(self.beyond)
        for family in self.families:
            places = {e.numbers for e in self.symbols if e.family == family}
            numbers = sorted(p[0] for p in places if len(p) == 1)
            if not numbers or numbers != list(range(numbers[0], numbers[-1] + 1)):
                continue
            ends = {numbers[0] - 1: numbers[-1], numbers[-1] + 1: numbers[0]}
            for beyond, place in ends.items():
                for order in range(3):
                    symbol = self.symbols.get(Element(family, order, (place,)))
                    if symbol is not None:
                        further.setdefault(Element(family, order, (beyond,)), symbol)
        return replace(self, beyond=further) if len(further) > len(self.beyond) else None


def elements_of(equations: Equations) -> Elements | None:
    """Find the families of some equations; None if no coordinate belongs to one."""
    families = families_of(c.name for c in equations.system.coordinates)
    if not families:
        return None
    others = families_of(
        [p.name for p in equations.system.parameters]
        + [x.name for x in equations.system.external]
        + [c.multiplier.name for c in equations.system.pushing]
    )
    if not families.keys().isdisjoint(others):
        return None
    by_symbol: dict[sp.Symbol, Element] = {}
    for c in equations.system.coordinates:
        element = element_of(c.name)
        if element is not None and element.family in families:
            for order, symbol in enumerate((c.q, c.v, c.a)):
                by_symbol[symbol] = element._replace(order=order)
    for named in (
        *((p.name, p.symbol) for p in equations.system.parameters),
        *((x.name, x.symbol) for x in equations.system.external),
        *((c.multiplier.name, c.multiplier) for c in equations.system.pushing),
    ):
        element = element_of(named[0])
        if element is not None and element.family in others:
            by_symbol[named[1]] = element
    beyond = dict(_beyond(equations, families.keys() | others.keys()))
    return Elements(by_symbol, {e: s for s, e in by_symbol.items()}, beyond)


def _beyond(equations: Equations, families: Iterable[str]) -> Iterator[tuple[Element, sp.Expr]]:
    """Definitions of the scene for elements of families, with their rates: ``q[0]: q[n]``."""
    known = set(families)
    coordinates: dict[sp.Symbol, Coordinate] = {c.q: c for c in equations.system.coordinates}
    for name, expression in equations.presentation.abbreviations:
        element = element_of(name)
        if element is None or element.family not in known:
            continue
        yield element, expression
        if expression in coordinates:
            yield element._replace(order=1), coordinates[expression].v
            yield element._replace(order=2), coordinates[expression].a
        elif expression.is_number:
            yield element._replace(order=1), sp.S.Zero
            yield element._replace(order=2), sp.S.Zero
