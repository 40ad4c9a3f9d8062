"""Poincaré sections: points of each motion in the plane of two columns."""

from __future__ import annotations

import numpy as np

from lagrange_cli.files.rows import DECIMAL_NUMBER
from lagrange_cli.pictures.curves import Curve, Panels, read_panels
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.drawn.motions import curve_label, panel_of
from lagrange_cli.pictures.mathematics import condition_label
from lagrange_cli.pictures.picture import Line, Panel, Picture, equation, listed
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.studies.section.result import Section, SectionPoints


@picture_of.register
def picture_of_section(section: Section, asked: str | None = None) -> Picture:
    """Draw what is asked for, else phase portraits of coordinates that the equation leaves free."""
    curves: Panels
    if asked is None:
        curves = tuple((Curve(f"dot({name})", name),) for name in section.free)
    else:
        curves = read_panels(asked, ("t", *section.columns, "energy"), "of")
    panels = tuple(_panel(section, part) for part in curves)
    caption = condition_label(section.condition, section.labels)
    return Picture(section.labels.title or section.name, panels, caption=caption)


def _panel(section: Section, curves: tuple[Curve, ...]) -> Panel:
    lines = tuple(
        _points(section, number, points, curve)
        for curve in curves
        for number, points in enumerate(section.members)
        if len(points.t)
    )
    panel = panel_of(section.labels, curves, lines)
    return Panel(lines, panel.x, panel.y, is_equal=panel.is_equal)


def _points(section: Section, place: int, points: SectionPoints, curve: Curve) -> Line:
    x, y = (_column(section, points, name) for name in (curve.abscissa, curve.ordinate))
    return Line(_label(section, place, points, curve), x, y, "dots")


def _label(section: Section, place: int, points: SectionPoints, curve: Curve) -> Label:
    """Name the points of a motion by the numbers that set it apart, else by their curve."""
    labels, texts = section.labels, points.given
    if texts and all(map(DECIMAL_NUMBER.fullmatch, texts.values())):
        pairs = ((name, float(text)) for name, text in texts.items())
        return listed([equation(labels.symbol(n), x, labels.unit(n)) for n, x in pairs])
    if len(section.members) > 1:
        return Label(str(place), str(place))
    return curve_label(labels, curve, alone=False)


def _column(section: Section, points: SectionPoints, name: str) -> Array:
    """Return the values of a column; angles between −π and π if whole turns change nothing."""
    known = {**points.columns, "t": points.t, "energy": points.energy}
    values = known[name]
    if name not in section.turning:
        return values
    return np.asarray(np.remainder(values + np.pi, 2 * np.pi) - np.pi)
