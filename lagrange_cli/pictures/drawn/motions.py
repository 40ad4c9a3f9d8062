"""Motions: columns over the time, paths and phase portraits, with the ends of these marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lagrange_cli.pictures.curves import Curve, read_panels, usual_panels
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import Axis, Line, Panel, Picture, axis_of, in_dollars
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels
from lagrange_cli.simulate.results.trajectory import Trajectory

#: Change of a conserved energy over the largest kinetic part of it.
_DRIFT = Label(r"$(%s - %s_{0}) / T_{\mathrm{max}}$", "(%s − %s₀)/T max")


@picture_of.register
def picture_of_motion(trajectory: Trajectory, asked: str | None = None) -> Picture:
    """Draw the curves that are asked for, else coordinates, velocities and energy over the time."""
    if asked is None:
        usual = usual_panels(trajectory.coordinates, trajectory.labels.dimensions)
        curves = (*usual, (Curve("energy"),))
    else:
        curves = read_panels(asked, ("t", *trajectory.columns, "energy"), "of")
    panels = tuple(_panel(trajectory, part) for part in curves)
    title = trajectory.labels.title or trajectory.name
    return Picture(title, panels, is_stacked=all(panel.is_tight for panel in panels))


def _panel(trajectory: Trajectory, curves: Sequence[Curve]) -> Panel:
    lines = tuple(_line(trajectory, curve, curves) for curve in curves)
    return panel_of(trajectory.labels, curves, lines, drift=_is_drift(trajectory, curves))


def panel_of(
    labels: Labels, curves: Sequence[Curve], lines: tuple[Line, ...], *, drift: bool = False
) -> Panel:
    """Return the panel of some curves.

    Parameters
    ----------
    lines
        What they show.
    drift
        True if this is the drift of a conserved energy.
    """
    energy = labels.energy
    y = Axis(Label(_DRIFT.latex % (energy, energy), _DRIFT.plain % (energy, energy)))
    return Panel(
        lines,
        axis_of(labels, [curve.abscissa for curve in curves]),
        y if drift else axis_of(labels, [curve.ordinate for curve in curves]),
        is_tight=over_time(curves),
        is_equal=all(labels.dimensions.get(name) == "m" for curve in curves for name in curve),
    )


def over_time(curves: Sequence[Curve]) -> bool:
    """Tell if all curves are over the time."""
    return all(curve.abscissa == "t" for curve in curves)


def curve_label(labels: Labels, curve: Curve, *, alone: bool) -> Label:
    """Return the name of a curve: that of its ordinate ``alone``, or over its abscissa."""
    symbol, over = (labels.symbol(name) for name in curve)
    if alone:
        return in_dollars(symbol)
    return Label(f"${symbol.latex}({over.latex})$", f"{symbol.plain}({over.plain})")


def _is_drift(trajectory: Trajectory, curves: Sequence[Curve]) -> bool:
    """Tell if a panel shows nothing but a conserved energy over the time."""
    return trajectory.energy_scale is not None and set(curves) == {Curve("energy")}


def _line(trajectory: Trajectory, curve: Curve, curves: Sequence[Curve]) -> Line:
    x, y = _points(trajectory, curve)
    if trajectory.energy_scale is not None and _is_drift(trajectory, [curve]):
        y = (y - trajectory.energy[0]) / trajectory.energy_scale
    finite = np.isfinite(x) & np.isfinite(y)
    alone = over_time(curves)
    label = curve_label(trajectory.labels, curve, alone=alone)
    return Line(label, x[finite], y[finite], has_ends=not alone and curve.abscissa != "t")


def _points(trajectory: Trajectory, curve: Curve) -> tuple[Array, Array]:
    """Return abscissas and ordinates of a curve, both sides of every jump among them."""
    known = trajectory.decimated
    if known is None:
        columns = {**trajectory.columns, "t": trajectory.t, "energy": trajectory.energy}
        return _with_events(trajectory, curve, columns)
    shown = known.curves if curve.abscissa == "t" else known.path
    values = {**shown.columns, "t": shown.t, "energy": shown.energy}
    return values[curve.abscissa], values[curve.ordinate]


def _with_events(
    trajectory: Trajectory, curve: Curve, columns: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Put the states at events among samples: an impact is as steep, and as high, as it is."""
    x, y = columns[curve.abscissa], columns[curve.ordinate]
    states = [
        {**side, "t": event.t}
        for event in trajectory.events
        for side in (event.before, event.state)
        if side is not None
    ]
    if not all(name in state for state in states for name in curve):
        return x, y  # energy
    places = np.searchsorted(trajectory.t, [state["t"] for state in states])
    above, over = ([state[name] for state in states] for name in curve)
    return np.insert(x, places, over), np.insert(y, places, above)
