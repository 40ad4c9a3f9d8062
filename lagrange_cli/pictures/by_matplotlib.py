"""Picture → file, by matplotlib."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.pictures.figures import DPI, new_figure, picture_bytes, require_ending, settings
from lagrange_cli.pictures.picture import DEGREES, NO_LABEL
from lagrange_cli.pictures.style import (
    BAR_COLOURS,
    legend_columns,
    legend_corner,
    legend_lines,
    looks,
    text_sides,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lagrange_cli.pictures.picture import (
        ColourBar,
        Line,
        Look,
        Panel,
        Picture,
        PlaneMap,
    )
    from lagrange_cli.simulate.model.labels import Label

#: Inches: the width of the text of a page, that of a single path, the height of panels over one
#: abscissa and of others below each other, and the part of each for numbers and names.
_WIDTH, _SINGLE, _HEIGHT, _STACKED, _NAMES = 6.3, 4.4, 1.9, 2.4, (0.9, 0.5)

#: Inches across a panel without axes, above it for its title, and across the narrowest picture.
_BARE, _HEAD, _NARROW = 2.1, 0.35, 3.2

#: Centimetres of an inch.
_INCH = 2.54

#: Numbers of a centimetre of an axis.
_TICKS = 1.5

#: Points across a mark, and the label of what no legend names.
_MARK, _UNNAMED = 3.5, "_nolegend_"

#: Inches of a map, and the colour of what has no value, which the bar of colours does not have.
_MAP, _NOTHING = (6.3, 5.4), "0.8"

#: Characters of an inch of the title.
_LETTERS = 10

#: Place and shape of a bar of colours.
_BAR: dict[str, Any] = {"fraction": 0.046, "pad": 0.03, "aspect": 28}

#: Colours of a bar: more of them become an image, which .pgf does not take.
_STEPS = 48

_DASHES: tuple[Any, ...] = ("-", "--", ":", "-.", (0, (6, 1, 1, 1, 1, 1)))
_SYMBOLS = "os^vDP*X"


def draw(picture: Picture, ending: str, dpi: int = DPI) -> bytes:
    """Draw a picture; return the bytes of a file of this ending, with ``dpi`` dots an inch.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending.
    """
    columns, rows = picture.columns, -(-len(picture.panels) // picture.columns)
    width, heights = _size(picture)
    figure = new_figure((width, sum(heights) + 0.4), ending)
    with settings(ending) as by_tex:
        writer = _Writer(picture, by_tex)
        grid = figure.subplots(
            rows, columns, squeeze=False, sharex=picture.shares_abscissa, height_ratios=heights
        )
        for number, panel in enumerate(picture.panels):
            axes, height = grid.flat[number], heights[number // columns]
            across, tall = width / columns - _NAMES[0], height - _NAMES[1]
            writer.draw_panel(axes, panel, (_INCH * across, _INCH * tall))
        for axes in grid.flat[len(picture.panels) :]:
            axes.set_visible(False)
        if picture.shares_abscissa:
            for axes in grid.flat[:-1]:
                axes.set_xlabel("")
        figure.align_ylabels()
        if picture.bar is not None:
            _draw_bar(figure, picture.bar, list(grid.flat), writer)
        _draw_title(figure, picture.title, picture.caption, by_tex)
        return picture_bytes(figure, ending, dpi)


def _size(picture: Picture) -> tuple[float, list[float]]:
    """Return the inches across the picture, and those of each row of panels."""
    columns, first = picture.columns, picture.panels[0]
    if picture.is_stacked:
        height = _HEIGHT if picture.shares_abscissa else _STACKED
        return _WIDTH, [height * panel.height for panel in picture.panels]
    rows = -(-len(picture.panels) // columns)
    if first.box is not None:
        return max(_NARROW, columns * _BARE), rows * [_BARE * first.ratio + _HEAD]
    width = _WIDTH if columns > 1 else _SINGLE
    return width, rows * [width / columns]


def _draw_title(figure: Figure, title: str, caption: Label, by_tex: bool) -> None:
    """Write a text of the scene, which is no mathematics to be parsed, and mathematics below it."""
    lines = textwrap.wrap(title, round(_LETTERS * figure.get_figwidth()))
    shown = [latex_text(line) if by_tex else line.replace("$", r"\$") for line in lines]
    figure.suptitle(
        "\n".join([*shown, *([] if caption is NO_LABEL else [_shown(caption, by_tex)])])
    )


class _Writer:
    """Writer of panels, for texts that TeX sets or matplotlib."""

    def __init__(self, picture: Picture, by_tex: bool) -> None:
        self.picture, self.by_tex = picture, by_tex

    def draw_panel(self, axes: Axes, panel: Panel, size: tuple[float, float]) -> None:
        """Draw a panel into axes of a size in centimetres."""
        axes.margins(x=0 if panel.is_tight else 0.05, y=0.1 if panel.places else 0.05)
        for line, look in looks(panel):
            self._draw_line(axes, line, look)
        self._draw_axes(axes, panel, size[1])
        self._draw_legend(axes, panel, size)
        for place, side in zip(panel.places, text_sides(panel, *size), strict=True):
            axes.plot([place.x], [place.y], "o", color="black", markersize=_MARK, label=_UNNAMED)
            axes.annotate(
                self.shown(place.label),
                (place.x, place.y),
                (4 * side[0], 4 * side[1]),
                textcoords="offset points",
                fontsize=8,
                ha="left" if side[0] > 0 else "right",
                va="bottom" if side[1] > 0 else "top",
            )

    def _draw_line(self, axes: Axes, line: Line, look: Look) -> None:
        colour = look.colour or _colour_map()(line.level)
        style: dict[str, Any] = {
            "color": colour,
            "linewidth": look.width,
            "linestyle": _DASHES[look.dash] if look.width else "none",
            "zorder": 1.5 if line.style in ("faint", "band", "rule") else 2.0,
        }
        if look.symbol is not None:
            symbol = "+" if look.symbol < 0 else _SYMBOLS[look.symbol]
            style |= {"marker": symbol, "markersize": look.size}
        if line.style == "dots" or line.look is not None:
            style["markeredgewidth"] = 0
        label = self.shown(line.label) if look.is_named else _UNNAMED
        if line.errors is None:
            axes.plot(line.x, line.y, label=label, **style)
        else:
            axes.errorbar(line.x, line.y, line.errors, label=label, elinewidth=0.8, **style)
        if line.has_ends and len(line.x):
            ends: dict[str, Any] = {"color": colour, "label": _UNNAMED, "zorder": 3}
            axes.plot(line.x[:1], line.y[:1], "o", markerfacecolor="white", markersize=6, **ends)
            axes.plot(line.x[-1:], line.y[-1:], "o", markersize=3, **ends)

    def _draw_axes(self, axes: Axes, panel: Panel, height: float) -> None:
        from matplotlib.ticker import MaxNLocator

        if panel.title is not NO_LABEL:
            axes.set_title(self.shown(panel.title))
        if panel.box is not None:
            axes.set(xlim=panel.box[:2], ylim=panel.box[2:], aspect="equal")
            axes.set_axis_off()
            return
        axes.set_xlabel(self.shown(panel.x.label))
        axes.set_ylabel(self.shown(panel.y.label))
        axes.set_xscale("log" if panel.x.is_log else "linear")
        axes.set_yscale("log" if panel.y.is_log else "linear")
        if panel.x.is_log or panel.y.is_log:
            axes.grid(visible=True, which="major", color="0.9", linewidth=0.6)
        if not panel.y.is_log:
            # Locators that look at the size of axes change numbers after these are laid out.
            steps = [1, 1.5, 3, 4.5, 9, 10] if panel.y.unit == DEGREES else [1, 2, 2.5, 5, 10]
            axes.yaxis.set_major_locator(
                MaxNLocator(nbins=min(8, round(_TICKS * height)), steps=steps)
            )
        if panel.x.is_reversed:
            axes.xaxis.set_inverted(True)
        if panel.is_equal:
            axes.set_aspect("equal", adjustable="datalim")

    def _draw_legend(self, axes: Axes, panel: Panel, size: tuple[float, float]) -> None:
        """Name the lines where no line is covered: in a corner, else outside of the axes."""
        if not legend_lines(panel):
            return
        place: dict[str, Any] = {"loc": legend_corner(panel, *size)}
        if place["loc"] is None and self.picture.columns > 1:
            place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": 3}
        elif place["loc"] is None:
            columns = legend_columns(panel, size[1])
            place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "ncols": columns}
        dotted = any(line.style == "dots" for line in panel.lines)
        axes.legend(markerscale=3 if dotted else 1, **place)

    def shown(self, label: Label) -> str:
        return _shown(label, self.by_tex)


def _draw_bar(figure: Figure, bar: ColourBar, grid: list[Axes], writer: _Writer) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(bar.low, bar.high), _colour_map())
    drawn = figure.colorbar(scale, ax=grid, label=writer.shown(bar.axis.label), **_BAR)
    if drawn.solids is not None:
        drawn.solids.set_edgecolor("face")


def _colour_map() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("lagrange", BAR_COLOURS, _STEPS)


def draw_map(plane: PlaneMap, ending: str) -> bytes:
    """Draw a map as an image with a bar of its colours; return the bytes of a file of this ending.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending; or it is one of TeX, to which
        images are not written.
    """
    require_map_ending(ending)
    figure = new_figure(_MAP, ending)
    with settings(ending) as by_tex:
        axes = figure.subplots()
        aspect: Any = "equal" if plane.is_equal else "auto"
        image: Any
        if plane.is_even:
            image = axes.imshow(plane.values, origin="lower", extent=plane.extent, aspect=aspect)
        else:
            image = axes.pcolormesh(
                plane.x, plane.y, plane.values, shading="nearest", rasterized=True
            )
            axes.set_aspect(aspect)
        axes.set_facecolor(_NOTHING)
        axes.set_xlabel(_shown(plane.x_axis.label, by_tex))
        axes.set_ylabel(_shown(plane.y_axis.label, by_tex))
        axes.tick_params(direction="out")
        figure.colorbar(image, ax=axes, label=_shown(plane.bar.label, by_tex), **_BAR)
        if np.isnan(plane.values).any():
            _draw_key(axes)
        _draw_title(figure, plane.title, NO_LABEL, by_tex)
        return picture_bytes(figure, ending)


def require_map_ending(ending: str) -> None:
    """Refuse a format that a map cannot be written in, before there is anything to draw.

    Raises
    ------
    InputError
        As :func:`draw_map`.
    """
    if ending in ("tex", "pgf"):
        message = f"a map is an image, which is not written as '.{ending}'"
        raise InputError(Problem(message, hint="--plot map.png, map.pdf, map.svg", rule="output"))
    require_ending(ending)


def _draw_key(axes: Axes) -> None:
    """Say below the map which colour stands for no value."""
    from matplotlib.patches import Patch

    patch = Patch(facecolor=_NOTHING, edgecolor="0.5", linewidth=0.5, label="no value")
    place: Any = {"loc": "upper right", "bbox_to_anchor": (1.0, -0.08)}
    axes.legend(handles=[patch], handlelength=1.2, borderpad=0, **place)


def _shown(label: Label, by_tex: bool) -> str:
    """Return a label as LaTeX, or in the part of it that matplotlib knows, or in Unicode."""
    if by_tex:
        return label.latex
    from matplotlib.mathtext import MathTextParser

    try:
        MathTextParser("path").parse(label.latex)
        is_known = "$" in label.latex
    except ValueError:
        is_known = False
    return label.latex if is_known else label.plain.replace("$", r"\$")
