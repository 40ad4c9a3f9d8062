"""Picture: what a drawing of a trajectory, or of a map over a plane, shows, whatever draws it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels
from lagrange_cli.simulate.results.curves import Curve, Panels

if TYPE_CHECKING:
    from lagrange_cli.simulate.results.decimation import Decimated

#: Colours of lines.
COLOURS = 4

#: Symbols that the label of an axis lists; of more it has the first and the last.
_MOST_SYMBOLS = 3

#: Change of a conserved energy over the largest kinetic part of it.
_DRIFT = Label(r"$(%s - %s_{0}) / T_{\mathrm{max}}$", "(%s − %s₀)/T max")


@dataclass(frozen=True)
class Line:
    """A line, its points of shape (m,), all finite.

    ``faint``: it stands behind the others, thin and grey, and no legend names it. ``dots``: its
    points are drawn, and nothing between them. ``dash``: number of its dashes, and it is black;
    None for the next ones. ``again``: it looks like an earlier line, which a legend names.
    """

    label: Label
    x: Array
    y: Array
    faint: bool = False
    dots: bool = False
    dash: int | None = None
    again: bool = False


@dataclass(frozen=True)
class MarkedPlace:
    """A point of a picture with a text beside it."""

    x: float
    y: float
    label: Label


@dataclass(frozen=True)
class Panel:
    """A pair of axes.

    Attributes
    ----------
    lines
        At least one.
    x_label, y_label
        Labels of the axes.
    over_time
        True if all lines are over the time.
    equal
        True if both axes show lengths, and so are to have one scale.
    places
        Points that are marked.
    """

    lines: tuple[Line, ...]
    x_label: Label
    y_label: Label
    over_time: bool
    equal: bool
    places: tuple[MarkedPlace, ...] = ()

    @property
    def named(self) -> tuple[Line, ...]:
        """Lines that are not faint."""
        return tuple(line for line in self.lines if not line.faint)

    @property
    def has_legend(self) -> bool:
        """True if a legend tells lines apart, which it cannot do with many colours of dots."""
        count = sum(not line.again for line in self.named)
        return count > 1 and (count <= COLOURS or not any(line.dots for line in self.named))

    @property
    def faint(self) -> tuple[Line, ...]:
        """Lines that are."""
        return tuple(line for line in self.lines if line.faint)


@dataclass(frozen=True)
class Picture:
    """Panels with a title, which is text of the scene without any mathematics.

    ``stacked``: panels stand below each other though their abscissas differ.
    """

    title: str
    panels: tuple[Panel, ...]
    stacked: bool = False

    @property
    def columns(self) -> int:
        """Panels beside each other: those over the time stand below each other."""
        return 1 if len(self.panels) == 1 or self.stacked or self.over_time else 2

    @property
    def over_time(self) -> bool:
        """True if all panels are over the time, whose axis the last one then has for all."""
        return all(panel.over_time for panel in self.panels)

    @property
    def wide(self) -> bool:
        """True if panels are wider than high."""
        return self.stacked or self.over_time


class DrawnEvent(Protocol):
    """An event as a picture shows it: both sides of a jump."""

    @property
    def t(self) -> float: ...

    @property
    def state(self) -> Mapping[str, float]: ...

    @property
    def before(self) -> Mapping[str, float] | None: ...


class DrawnMotion(Protocol):
    """A motion as a picture shows it; the fields are those of a :class:`.trajectory.Trajectory`."""

    @property
    def name(self) -> str: ...

    @property
    def labels(self) -> Labels: ...

    @property
    def t(self) -> Array: ...

    @property
    def columns(self) -> Mapping[str, Array]: ...

    @property
    def energy(self) -> Array: ...

    @property
    def energy_scale(self) -> float | None: ...

    @property
    def events(self) -> Sequence[DrawnEvent]: ...

    @property
    def decimated(self) -> Decimated | None: ...


def picture_of(trajectory: DrawnMotion, panels: Panels) -> Picture:
    """Gather the lines of a picture and their labels."""
    title = trajectory.labels.title or trajectory.name
    return Picture(title, tuple(_panel(trajectory, curves) for curves in panels))


def _panel(trajectory: DrawnMotion, curves: Sequence[Curve]) -> Panel:
    labels = trajectory.labels
    over_time = all(curve.abscissa == "t" for curve in curves)
    drift = _is_drift(trajectory, curves)
    return Panel(
        lines=tuple(_line(trajectory, curve, over_time) for curve in curves),
        x_label=axis_label(labels, [curve.abscissa for curve in curves]),
        y_label=_drift_label(labels)
        if drift
        else axis_label(labels, [curve.ordinate for curve in curves]),
        over_time=over_time,
        equal=has_one_scale(labels, curves),
    )


def has_one_scale(labels: Labels, curves: Sequence[Curve]) -> bool:
    """Tell if all that curves show are lengths."""
    return all(labels.dimensions.get(name) == "m" for curve in curves for name in curve)


def _is_drift(trajectory: DrawnMotion, curves: Sequence[Curve]) -> bool:
    """Say whether a panel shows nothing but a conserved energy over the time."""
    return trajectory.energy_scale is not None and set(curves) == {Curve("energy")}


def _drift_label(labels: Labels) -> Label:
    symbol = labels.energy
    return Label(_DRIFT.latex % (symbol, symbol), _DRIFT.plain % (symbol, symbol))


def _line(trajectory: DrawnMotion, curve: Curve, over_time: bool) -> Line:
    symbol, over = (trajectory.labels.symbol(name) for name in curve)
    label = Label(f"${symbol.latex}$", symbol.plain)
    if not over_time:
        label = Label(f"${symbol.latex}({over.latex})$", f"{symbol.plain}({over.plain})")
    x, y = _points(trajectory, curve)
    if trajectory.energy_scale is not None and _is_drift(trajectory, [curve]):
        y = (y - trajectory.energy[0]) / trajectory.energy_scale
    finite = np.isfinite(x) & np.isfinite(y)
    return Line(label, x[finite], y[finite])


def _points(trajectory: DrawnMotion, curve: Curve) -> tuple[Array, Array]:
    """Return abscissas and ordinates of a curve, both sides of every jump among them."""
    known = trajectory.decimated
    if known is None:
        columns = {**trajectory.columns, "t": trajectory.t, "energy": trajectory.energy}
        return _with_events(trajectory, curve, columns)
    shown = known.curves if curve.abscissa == "t" else known.path
    values = {**shown.columns, "t": shown.t, "energy": shown.energy}
    return values[curve.abscissa], values[curve.ordinate]


def _with_events(
    trajectory: DrawnMotion, curve: Curve, columns: Mapping[str, Array]
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


def axis_label(labels: Labels, names: Sequence[str]) -> Label:
    """Name what an axis shows, and its unit if that is the same for all."""
    distinct = list(dict.fromkeys(names))
    symbols = [labels.symbol(name) for name in distinct]
    latex, plain = [f"${s.latex}$" for s in symbols], [s.plain for s in symbols]
    if len(symbols) > _MOST_SYMBOLS:
        latex, plain = [latex[0], r"$\ldots$", latex[-1]], [plain[0], "…", plain[-1]]
    units = {labels.unit(name) for name in distinct}
    unit = units.pop() if len(units) == 1 else None
    ending = ("", "") if unit is None else (f" in ${unit.latex}$", f" in {unit.plain}")
    return Label(", ".join(latex) + ending[0], ", ".join(plain) + ending[1])


#: Differences of distances between values that count as one distance, as a part of it.
_EVEN = 1e-6


@dataclass(frozen=True)
class PlaneMap:
    """A number at each pair of two values.

    Attributes
    ----------
    title
        Text of the scene without any mathematics.
    x, y
        Values that increase, at least two of each.
    values
        Shape (len(y), len(x)), NaN where there is none.
    x_label, y_label, label
        Of both axes and of the values.
    equal
        True if both axes are to have one scale.
    """

    title: str
    x: Array
    y: Array
    values: Array
    x_label: Label
    y_label: Label
    label: Label
    equal: bool

    @property
    def is_even(self) -> bool:
        """True if the values of both axes lie as far from each other everywhere."""
        distances = (np.diff(axis) for axis in (self.x, self.y))
        return all(np.ptp(d) <= _EVEN * abs(d.mean()) for d in distances)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, lower and upper end, half a distance beyond the values."""
        half_x, half_y = (float(axis[1] - axis[0]) / 2 for axis in (self.x, self.y))
        x, y = (float(self.x[0]), float(self.x[-1])), (float(self.y[0]), float(self.y[-1]))
        return x[0] - half_x, x[1] + half_x, y[0] - half_y, y[1] + half_y
