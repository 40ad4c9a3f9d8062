"""Curves of a picture, as they are asked for: ``z:x + z2:x2, theta``."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar, NamedTuple, TypeAlias

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.scene.language.written_text import WrittenText

#: Names that a hint lists.
_MOST_LISTED = 12


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
    written = _WrittenCurves(text, source)
    problems: list[Problem] = []
    panels = []
    for panel in written.parts(","):
        curves = []
        for bounds in written.parts("+", *panel):
            places = written.parts(":", *bounds)
            names = ["".join(text[a:b].split()) for a, b in places]
            if len(names) > 2:
                problems += written.refusal("a curve is ORDINATE:ABSCISSA", *bounds).problems
            for name, place in zip(names[:2], places, strict=False):
                if name not in columns:
                    problems.append(_unknown(name, columns, written.mark(*place)))
            curves.append(Curve(*names[:2]))
        panels.append(tuple(curves))
    if problems:
        raise InputError(*problems)
    return tuple(panels)


class _WrittenCurves(WrittenText):
    """Curves as they were written."""

    rule: ClassVar[str] = "plot-of"


def _unknown(name: str, columns: Collection[str], mark: Mark) -> Problem:
    if not name:
        return Problem("a name is missing", mark, "'z:x, dot(theta):theta'", rule="plot-of")
    shown = list(columns)[:_MOST_LISTED]
    listed = ", ".join([*shown, "..."] if len(columns) > len(shown) else shown)
    hint = nearest(name, columns) or f"it has {listed}"
    return Problem(f"the motion has nothing named '{name}'", mark, hint, rule="unknown-name")


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
