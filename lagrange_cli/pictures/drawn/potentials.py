"""Effective potentials: V_eff with the energy, and the turning points of the motion marked."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import (
    NO_LABEL,
    Axis,
    Line,
    MarkedPlace,
    Panel,
    Picture,
    axis_of,
    equation,
)
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.studies.effective_potential import EffectivePotential


@picture_of.register
def picture_of_potential(potential: EffectivePotential, asked: str | None = None) -> Picture:
    """Draw V_eff, E, and a line down from each turning point."""
    labels, energy = potential.labels, potential.energy
    places = tuple(_turning_points(potential))
    low, high = float(potential.values.min()), float(potential.values.max())
    bottom = min(low, energy) - 0.05 * (max(high, energy) - min(low, energy))
    drops = (
        Line(NO_LABEL, np.repeat(place.x, 2), np.array([bottom, energy]), "faint")
        for place in places
    )
    curve = Line(Label(r"$V_{\mathrm{eff}}$", "V_eff"), potential.q, potential.values)
    name = equation(Label("E", "E"), energy, labels.unit("energy"))
    level = Line(name, potential.q[[0, -1]], np.repeat(energy, 2))
    x, y = axis_of(labels, [potential.coordinate.name]), Axis(curve.label, labels.unit("energy"))
    panel = Panel((*drops, curve, level), x, y, is_tight=True, places=places, height=1.2)
    return Picture(labels.title, (panel,), is_stacked=True)


def _turning_points(potential: EffectivePotential) -> Iterator[MarkedPlace]:
    """Yield the least and the largest value of the coordinate, each with its name."""
    symbol = potential.labels.symbol(potential.coordinate.name)
    letter = f"{{{symbol.latex}}}" if "_" in symbol.latex else symbol.latex
    turning = potential.turning or (None, None)
    words = ("0", "0") if turning[0] == turning[1] else ("min", "max")
    for word, place in dict(zip(words, turning, strict=True)).items():
        if place is not None:
            name = Label(rf"{letter}_{{\mathrm{{{word}}}}}", f"{symbol.plain}_{word}")
            label = equation(name, place, potential.labels.unit(potential.coordinate.name))
            yield MarkedPlace(place, potential.energy, label)
