"""Picture: panels with lines, axes and marked places, or a map, whatever writes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Literal, TypeAlias

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels

NO_LABEL = Label("", "")

#: Unit of axes whose numbers divide a turn.
DEGREES = Label(r"\mathrm{degrees}", "degrees")

# Labels.

#: Symbols that the label of an axis lists; of more it has the first and the last.
_MOST_SYMBOLS = 3

#: Unit of rates of angles where the scene leaves the unit of time open.
_TURNING = Label(r"\mathrm{rad\ per\ unit\ of\ time}", "rad per unit of time")


@dataclass(frozen=True)
class Axis:
    """The quantity that an axis shows.

    Attributes
    ----------
    name
        Its name in mathematics.
    unit
        Its unit, in ``latex`` without dollars; None if it has none, or several.
    is_log
        True if equal distances are equal factors.
    is_reversed
        True if values ascend to the left.
    """

    name: Label
    unit: Label | None = None
    is_log: bool = False
    is_reversed: bool = False

    @property
    def label(self) -> Label:
        """The name with the unit."""
        if self.unit is None:
            return self.name
        name, unit = self.name, self.unit
        return Label(f"{name.latex} in ${unit.latex}$", f"{name.plain} in {unit.plain}")

    def scaled(self, values: Array) -> Array:
        """Return the places of values along the axis, but for a factor and an offset."""
        if not self.is_log:
            return values
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.log10(values))


def axis_of(labels: Labels, names: Sequence[str]) -> Axis:
    """Return the axis of some columns, with their unit if it is the same for all."""
    distinct = list(dict.fromkeys(names))
    symbols = [in_dollars(labels.symbol(name)) for name in distinct]
    if len(symbols) > _MOST_SYMBOLS:
        symbols = [symbols[0], Label(r"$\ldots$", "…"), symbols[-1]]
    units = {unit_of_column(labels, column) for column in distinct}
    return Axis(listed(symbols), units.pop() if len(units) == 1 else None)


def unit_of_column(labels: Labels, name: str) -> Label | None:
    """Return the unit of a column; angles turn in radians whatever the unit of time is."""
    if labels.dimensions.get(name) == "rad/s" and name not in labels.units:
        return _TURNING
    return labels.unit(name)


def frequency_unit(labels: Labels) -> Label | None:
    """Return the unit of angular frequencies; None where that of time is open."""
    time = labels.unit("t")
    return time and Label(rf"\mathrm{{rad}}/{time.latex}", f"rad/{time.plain}")


def in_dollars(symbol: Label) -> Label:
    """Return a symbol as a label."""
    return Label(f"${symbol.latex}$", symbol.plain)


def at_time(symbol: Label, t: float) -> Label:
    """Return the symbol of a value at a time, ``θ(0)``; both have no dollars."""
    return Label(f"{symbol.latex}({t:g})", f"{symbol.plain}({t:g})")


def listed(labels: Sequence[Label]) -> Label:
    """Return labels with commas between them."""
    return Label(*(", ".join(texts) for texts in zip(*map(astuple, labels), strict=True)))


def equation(symbol: Label, value: float, unit: Label | None, digits: int = 6) -> Label:
    """Return ``symbol = value unit``; the symbol and the unit have no dollars."""
    latex, plain = f"{symbol.latex} = {latex_digits(value, digits)}", f"{value:.{digits}g}"
    if unit is not None:
        latex, plain = rf"{latex}\,{unit.latex}", f"{plain} {unit.plain}"
    return Label(f"${latex}$", f"{symbol.plain} = {plain}")


def latex_digits(value: float, digits: int = 6) -> str:
    """Write a number in LaTeX."""
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    return mantissa if not exponent else rf"{mantissa} \times 10^{{{int(exponent)}}}"


# Lines and panels.

Style: TypeAlias = Literal["line", "faint", "rule", "band", "dots", "marked", "crosses", "bars"]
"""Style of a line: a ``line`` through its points, ``marked`` with symbols at them, ``dots`` or
``bars`` of errors at its points alone; a ``faint`` one behind others, which no legend names; a
dotted ``rule``; a broad ``band`` behind others; large black ``crosses``."""


#: Dash patterns, and symbols at points, that writers have.
DASHES, SYMBOLS = 5, 8


@dataclass(frozen=True)
class Look:
    """The look of a line.

    Attributes
    ----------
    colour
        In hexadecimal digits; None for that of its level.
    width
        Points, in which letters are measured, across the line; 0 for none.
    dash
        Number of its dash pattern, below :data:`DASHES`.
    symbol
        Number of the symbols at its points, below :data:`SYMBOLS`; None for none, -1 for crosses.
    size
        Points across a symbol.
    is_named
        True if the legend has it.
    """

    colour: str | None
    width: float = 1.0
    dash: int = 0
    symbol: int | None = None
    size: float = 0.0
    is_named: bool = True


@dataclass(frozen=True)
class Line:
    """A line.

    Attributes
    ----------
    label
        Its name in the legend.
    x, y
        Its points, shape (m,), all finite.
    style
        Its style.
    dash
        Number of its dashes, and it is black; None for the next ones.
    colour
        Number of its colour and dashes; None for the next ones.
    is_again
        True if it looks like an earlier line, which a legend names.
    has_ends
        True if its first point is marked by a circle and its last one by a disc.
    errors
        Half the length of a bar at each point, shape (m,); None for no bars.
    level
        Place of its colour in the bar of colours, from 0 to 1; None without one.
    look
        Its look; None for that of its style.
    """

    label: Label
    x: Array
    y: Array
    style: Style = "line"
    dash: int | None = None
    colour: int | None = None
    is_again: bool = False
    has_ends: bool = False
    errors: Array | None = None
    level: float | None = None
    look: Look | None = None


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
        Its lines; those behind others come first.
    x, y
        The axes.
    is_tight
        True if lines reach both ends of the horizontal axis, as those over the time.
    is_equal
        True if both axes show lengths, and so are to have one scale.
    places
        Points that are marked.
    has_legend
        True if a legend may name its lines.
    height
        Relative to other panels.
    title
        Text above it.
    box
        Left, right, lower and upper end of a panel that is drawn without its axes, in one scale.
    """

    lines: tuple[Line, ...]
    x: Axis
    y: Axis
    is_tight: bool = False
    is_equal: bool = False
    places: tuple[MarkedPlace, ...] = ()
    has_legend: bool = True
    height: float = 1.0
    title: Label = NO_LABEL
    box: tuple[float, float, float, float] | None = None

    @property
    def ratio(self) -> float:
        """Height over width of a panel without axes."""
        left, right, low, high = self.box or (0.0, 1.0, 0.0, 1.0)
        return min(max((high - low) / (right - left), 0.25), 2.0)


@dataclass(frozen=True)
class ColourBar:
    """A bar that gives lines their colours by numbers between two."""

    axis: Axis
    low: float
    high: float


@dataclass(frozen=True)
class Picture:
    """Panels with a title.

    Attributes
    ----------
    title
        Text of the scene without any mathematics.
    panels
        The panels.
    is_stacked
        True if panels are wide and stand below each other.
    caption
        Mathematics below the title.
    bar
        Colours of lines that have a level; None if none has.
    most_columns
        Panels beside each other, at most.
    """

    title: str
    panels: tuple[Panel, ...]
    is_stacked: bool = False
    caption: Label = NO_LABEL
    bar: ColourBar | None = None
    most_columns: int = 2

    @property
    def columns(self) -> int:
        """Panels beside each other."""
        return 1 if self.is_stacked else min(self.most_columns, len(self.panels))

    @property
    def shares_abscissa(self) -> bool:
        """True if the horizontal axis of the lowest panel is that of all."""
        axes = {panel.x for panel in self.panels}
        return self.is_stacked and len(axes) == 1


# Maps.

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
    x_axis, y_axis, bar
        Quantities of both axes, and of the values.
    is_equal
        True if both axes are to have one scale.
    """

    title: str
    x: Array
    y: Array
    values: Array
    x_axis: Axis
    y_axis: Axis
    bar: Axis
    is_equal: bool

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
