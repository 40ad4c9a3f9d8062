"""Curves of a picture, as they are asked for: ``z:x + z2:x2, theta``."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

from lagrange_cli.errors import InputError, Mark, Problem, nearest

_OPENING, _CLOSING = "([", ")]"


class Curve(NamedTuple):
    """Names of columns: of what is drawn upwards, and of what it is drawn over."""

    ordinate: str
    abscissa: str = "t"


#: Panels of a picture, each with its curves.
Panels: TypeAlias = tuple[tuple[Curve, ...], ...]


def read_panels(text: str, columns: Collection[str], source: str) -> Panels:
    """Read what is to be drawn: panels by commas apart, curves of a panel by ``+``.

    A curve is ``ordinate:abscissa``, or a name alone, which is drawn over the time.

    Parameters
    ----------
    columns
        Names that there are.
    source
        What holds the text, as messages name it.

    Raises
    ------
    InputError
        Located: something is not a curve, or there is no such name.
    """
    problems: list[Problem] = []
    panels = []
    for start, end in _parts(text, 0, len(text), ","):
        curves = []
        for part in _parts(text, start, end, "+"):
            places = list(_parts(text, *part, ":"))
            names = ["".join(text[a:b].split()) for a, b in places]
            if len(names) > 2:
                marked = _mark(text, *part, source)
                problems.append(Problem("a curve is ORDINATE:ABSCISSA", marked, rule="plot-of"))
            for name, place in zip(names[:2], places, strict=False):
                if name not in columns:
                    problems.append(_unknown(name, columns, _mark(text, *place, source)))
            curves.append(Curve(*names[:2]))
        panels.append(tuple(curves))
    if problems:
        raise InputError(*problems)
    return tuple(panels)


def _unknown(name: str, columns: Collection[str], mark: Mark) -> Problem:
    if not name:
        return Problem("a name is missing", mark, "'z:x, dot(theta):theta'", rule="plot-of")
    said = f"the motion has nothing named '{name}'"
    hint = nearest(name, columns) or f"it has {', '.join(_first(columns))}"
    return Problem(said, mark, hint, rule="unknown-name")


def _first(names: Collection[str], most: int = 12) -> list[str]:
    shown = list(names)[:most]
    return [*shown, "..."] if len(names) > most else shown


def _mark(text: str, start: int, end: int, source: str) -> Mark:
    """Mark a part of the text without the blanks around it."""
    part = text[start:end]
    begin = start + len(part) - len(part.lstrip())
    return Mark(source, 1, begin + 1, text, max(1, len(part.strip())))


def _parts(text: str, start: int, end: int, separator: str) -> Iterator[tuple[int, int]]:
    """Yield the bounds of the parts of ``text[start:end]`` between separators outside brackets."""
    depth = 0
    for place in range(start, end):
        depth += (text[place] in _OPENING) - (text[place] in _CLOSING)
        if text[place] == separator and depth == 0:
            yield start, place
            start = place + 1
    yield start, end


def columns_of(panels: Panels) -> tuple[str, ...]:
    """List the columns that are drawn, time and energy apart, each once."""
    names = (name for panel in panels for curve in panel for name in curve)
    return tuple(name for name in dict.fromkeys(names) if name not in ("t", "energy"))


def usual_panels(coordinates: Sequence[str], dimension: Mapping[str, str]) -> Panels:
    """Choose coordinates, then velocities over the time, a panel for each dimension."""
    rates = [f"dot({name})" for name in coordinates]
    panels: dict[tuple[bool, str], list[Curve]] = {}
    for is_rate, names in enumerate((coordinates, rates)):
        for name in names:
            panels.setdefault((bool(is_rate), dimension.get(name, "?")), []).append(Curve(name))
    return tuple(map(tuple, panels.values()))
