"""Rows of a family and their indices: counted from a row's own, in blocks, of one value."""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from lagrange_cli.mechanics.families.elements import Elements, Index, Place
from lagrange_cli.mechanics.families.fitting import Vector
from lagrange_cli.mechanics.families.forms import FamilyRow, mapped, places_in


def counted(places: Vector, row: Vector, own: tuple[sp.Symbol, ...]) -> tuple[Place, ...]:
    """Indices counted from a row's; one index from the nearest of two."""
    if len(places) == len(own):
        return tuple(Place(o, p - r) for o, p, r in zip(own, places, row, strict=True))
    (place,) = places
    k = min(range(len(row)), key=lambda k: abs(place - row[k]))
    return (Place(own[k], place - row[k]),)


def block(centre: Vector, held: set[Vector]) -> list[tuple[int, int]]:
    """The ends of a block of indices around one, grown as long as all in it are held."""
    ends = [(p, p) for p in centre]
    grows = True
    while grows:
        grows = False
        for k in range(len(ends)):
            for step in (-1, 1):
                first, last = ends[k]
                added = first - 1 if step < 0 else last + 1
                layer = [*ends[:k], (added, added), *ends[k + 1 :]]
                if all(p in held for p in places_in(layer)):
                    ends[k] = (min(first, added), max(last, added))
                    grows = True
    return ends


def fixed(row: FamilyRow, elements: Elements) -> FamilyRow:
    """A row whose indices that take one value have that value."""
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
        kept = [str(value) if i == str(letter) else i for i in indices[:-1].split(",")]
        name = f"{head}[{','.join(kept)}]"
    shown = mapped(row.shown, name, fixed)
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
