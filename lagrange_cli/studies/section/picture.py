"""Picture of a section: its points, those of each motion in a colour of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.files.rows import DECIMAL_NUMBER
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.simulate.results.curves import Curve, Panels, read_panels
from lagrange_cli.simulate.results.picture import Line, Panel, Picture, axis_label, has_one_scale

if TYPE_CHECKING:
    from lagrange_cli.studies.section.result import Section, SectionPoints


def section_panels(section: Section, of: str | None, source: str) -> Panels:
    """Return what is drawn: as ``of`` says, or a phase portrait of each free coordinate.

    Raises
    ------
    InputError
        Located: nothing has a name that is asked for.
    """
    if of is None:
        return tuple((Curve(f"dot({name})", name),) for name in section.free)
    return read_panels(of, ("t", *section.columns, "energy"), source)


def picture_of_section(section: Section, panels: Panels) -> Picture:
    """Gather the points of a picture."""
    title = f"{section.labels.title or section.name}: {section.condition}"
    return Picture(title, tuple(_panel(section, curves) for curves in panels))


def _panel(section: Section, curves: tuple[Curve, ...]) -> Panel:
    labels = section.labels
    return Panel(
        lines=tuple(
            _points(section, number, points, curve)
            for curve in curves
            for number, points in enumerate(section.members)
            if len(points.t)
        ),
        x_label=axis_label(labels, [curve.abscissa for curve in curves]),
        y_label=axis_label(labels, [curve.ordinate for curve in curves]),
        over_time=False,
        equal=has_one_scale(labels, curves),
    )


def _points(section: Section, place: int, points: SectionPoints, curve: Curve) -> Line:
    x, y = (_column(section, points, name) for name in (curve.abscissa, curve.ordinate))
    return Line(_label(section, place, points, curve), x, y, dots=True)


def _label(section: Section, place: int, points: SectionPoints, curve: Curve) -> Label:
    """Name the points of a motion by the numbers that set it apart, else by what they show."""
    if points.given and all(map(DECIMAL_NUMBER.fullmatch, points.given.values())):
        given = points.given.items()
        pairs = [(section.labels.symbol(name), f"{float(text):.6g}") for name, text in given]
        latex = ", ".join(f"${symbol.latex} = {number}$" for symbol, number in pairs)
        return Label(latex, ", ".join(f"{symbol.plain} = {number}" for symbol, number in pairs))
    if len(section.members) > 1:
        return Label(str(place), str(place))
    symbol, over = (section.labels.symbol(name) for name in curve)
    return Label(f"${symbol.latex}({over.latex})$", f"{symbol.plain}({over.plain})")


def _column(section: Section, points: SectionPoints, name: str) -> Array:
    """Return the values of a column; angles between −π and π if whole turns change nothing."""
    known = {**points.columns, "t": points.t, "energy": points.energy}
    values = known[name]
    if name not in section.turning:
        return values
    return np.asarray(np.remainder(values + np.pi, 2 * np.pi) - np.pi)
