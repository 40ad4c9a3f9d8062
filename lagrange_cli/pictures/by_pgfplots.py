"""Picture → LaTeX, as a tikzpicture of pgfplots that the reader's document sets in its fonts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.notation.symbols import latex_text
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
    from lagrange_cli.pictures.picture import Line, Look, Panel, Picture
    from lagrange_cli.simulate.arrays import Array

#: Distance from a line that the points left of it have at most, over the extent of the axes; a
#: twentieth of a millimetre.
_TOLERANCE = 5e-4

#: Points of a line that are looked at: TeX takes seconds for some ten thousands.
_MOST_POINTS = 4000

#: Centimetres between axes beside each other; width and height of axes, by whether they are wide.
_BESIDE = 2.0
_SIZES = {True: (11.0, 3.2), False: (5.6, 5.6)}

#: Centimetres across a panel without axes.
_BARE = 4.0

#: Centimetres below axes for their names, and for a legend above the next ones.
_BELOW, _NAMES, _LEGEND = 0.9, 0.8, 0.5

_DASHES = ("solid", "dashed", "densely dotted", "dashdotted", "densely dashdotdotted")
_SYMBOLS = ("*", "square*", "triangle*", "diamond*", "pentagon*", "o", "square", "triangle")

#: Place of a legend → its anchor, and the part of the axes at which that is.
_CORNERS = {
    "upper right": ("north east", "0.98,0.97"),
    "upper left": ("north west", "0.02,0.97"),
    "lower right": ("south east", "0.98,0.03"),
    "lower left": ("south west", "0.02,0.03"),
    "upper center": ("north", "0.5,0.97"),
    "lower center": ("south", "0.5,0.03"),
    "center left": ("west", "0.02,0.5"),
    "center right": ("east", "0.98,0.5"),
}

_HEAD = r"""% Made by lagrange. In the preamble:
% \usepackage{amsmath, pgfplots} \pgfplotsset{compat=1.16}
"""


def pgfplots_text(picture: Picture) -> str:
    """Write a picture as a ``tikzpicture`` of pgfplots."""
    width, height = _size(picture)
    middle = (picture.columns * (width + _BESIDE) - _BESIDE) / 2
    top = height * picture.panels[0].height if picture.is_stacked else height
    place = f"({_number(middle)}cm,{_number(top + (0.3 if picture.columns == 1 else 1.0))}cm)"
    style = f"anchor=south, align=center, text width={_number(2 * middle)}cm"
    caption = "" if picture.caption is NO_LABEL else rf"\\ \mbox{{{picture.caption.latex}}}"
    title = f"\\node[{style}] at {place} {{{latex_text(picture.title)}{caption}}};\n"
    body = "".join(_axes(picture))
    return f"{_HEAD}\\begin{{tikzpicture}}\n{title}{body}\\end{{tikzpicture}}\n"


def _size(picture: Picture) -> tuple[float, float]:
    """Return the centimetres across axes, and the height of those of height 1."""
    if (first := picture.panels[0]).box is not None:
        return _BARE, _BARE * first.ratio
    return _SIZES[picture.is_stacked]


def _axes(picture: Picture) -> Iterator[str]:
    """Yield the axes of each panel below those before, the lower left corner of the first at 0."""
    width, full = _size(picture)
    between = _BELOW + (0.0 if picture.shares_abscissa else _NAMES)
    between += 0.0 if picture.columns == 1 else _LEGEND
    y = full * (picture.panels[0].height if picture.is_stacked else 1.0)
    for number, panel in enumerate(picture.panels):
        column = number % picture.columns
        height = full * (panel.height if picture.is_stacked else 1.0)
        if column == 0:
            y -= height + (between if number else 0.0)
        options = [
            f"at={{({_number(column * (width + _BESIDE))}cm,{_number(y)}cm)}}",
            f"width={_number(width)}cm, height={_number(height)}cm, scale only axis",
            *_options(picture, panel, (width, height)),
        ]
        joined, plots = ",\n  ".join(options), "".join(_plots(panel, (width, height)))
        yield f"\\begin{{axis}}[\n  {joined}]\n{plots}\\end{{axis}}\n"


def _options(picture: Picture, panel: Panel, size: tuple[float, float]) -> Iterator[str]:
    if panel.title is not NO_LABEL:
        yield f"title={{{panel.title.latex}}}"
    if panel.box is not None:
        names = zip(("xmin", "xmax", "ymin", "ymax"), panel.box, strict=True)
        yield from (f"{name}={_number(end)}" for name, end in names)
        yield "hide axis, axis equal"
        return
    yield f"ylabel={{{panel.y.label.latex}}}"
    below = picture.shares_abscissa and panel is not picture.panels[-1]
    yield "xticklabels={}" if below else f"xlabel={{{panel.x.label.latex}}}"
    for letter, axis in (("x", panel.x), ("y", panel.y)):
        if axis.is_log:
            yield f"{letter}mode=log, {letter}majorgrids, grid style={{black!10}}"
        if axis.unit == DEGREES:
            yield f"{letter}tick distance=90"
        if axis.is_reversed:
            yield f"{letter} dir=reverse"
    if panel.is_equal:
        yield "axis equal"
    elif panel.is_tight:
        yield "enlarge x limits=false"
    if legend_lines(panel):
        corner = legend_corner(panel, *size)
        if corner is not None:
            anchor, place = _CORNERS[corner]
            yield f"legend style={{at={{({place})}}, anchor={anchor}}}"
        elif picture.columns == 1:
            columns = legend_columns(panel, size[1])
            yield f"legend pos=outer north east, legend columns={columns}"
        else:
            yield "legend columns=3, legend style={at={(0.5,1.02)}, anchor=south}"
        yield "legend style={draw=none, fill=none, font=\\small}, legend cell align=left"
    if picture.bar is not None:
        stops = " ".join(f"rgb255=({','.join(map(str, _rgb(c)))})" for c in BAR_COLOURS)
        yield f"colormap={{lagrange}}{{{stops}}}"
        if panel is picture.panels[0]:
            ends = f"point meta min={_number(picture.bar.low)}, "
            ends += f"point meta max={_number(picture.bar.high)}"
            yield f"colorbar, {ends}, colorbar style={{ylabel={{{picture.bar.axis.label.latex}}}}}"


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(colour[1:]))


def _plots(panel: Panel, size: tuple[float, float]) -> Iterator[str]:
    for line, look in looks(panel):
        yield from _plot(panel, line, look)
    for place, (across, up) in zip(panel.places, text_sides(panel, *size), strict=True):
        at = f"(axis cs:{_number(place.x)},{_number(place.y)})"
        text = f"{up * (45 if across > 0 else 135)}:{{{place.label.latex}}}"
        label = f"label={{[font=\\scriptsize, inner sep=1pt]{text}}}"
        yield f"\\node[circle, fill, inner sep=1pt, {label}] at {at} {{}};\n"


def _plot(panel: Panel, line: Line, look: Look) -> Iterator[str]:
    if look.colour is None:
        colour = f"color of colormap={round(1000 * (line.level or 0.0))}"
    else:
        colour = "color={{rgb,255:red,{};green,{};blue,{}}}".format(*_rgb(look.colour))
    style = [colour]
    if look.width:
        style += [
            _DASHES[look.dash],
            f"line width={_number(0.4 * look.width)}pt",
            "line join=round",
        ]
    if look.symbol is not None:
        symbol = "+" if look.symbol < 0 else _SYMBOLS[look.symbol]
        style += [] if look.width else ["only marks"]
        style.append(f"mark={symbol}, mark size={_number(look.size / 4)}pt")
        style.append("mark options={solid}")
    if line.errors is not None:
        style.append("error bars/.cd, y dir=both, y explicit")
    if not look.is_named:
        style.insert(1, "forget plot")
    points = "".join(_points(panel, line))
    yield f"\\addplot[{', '.join(style)}] coordinates {{\n{points}}};\n"
    if look.is_named:
        yield f"\\addlegendentry{{{line.label.latex}}}\n"
    if line.has_ends and len(line.x):
        for end, fill in ((0, "white"), (-1, "")):
            at = f"({_number(line.x[end])},{_number(line.y[end])})"
            mark = f"mark=*, mark size={2 if fill else 1.2}pt"
            mark += f", mark options={{fill={fill}}}" if fill else ""
            yield f"\\addplot[{colour}, forget plot, only marks, {mark}] coordinates {{{at}}};\n"


def _points(panel: Panel, line: Line) -> Iterator[str]:
    if not len(line.x):
        return
    stays = line.style not in ("line", "faint")
    stride = 1 if stays else -(-len(line.x) // _MOST_POINTS)
    # Rounded as they are written: else the last digits of what is constant would be a shape.
    x, y = (np.array([float(_number(v)) for v in c[::stride]]) for c in (line.x, line.y))
    whole = np.arange(len(x))
    points = whole if stays else simplified(panel.x.scaled(x), panel.y.scaled(y), _TOLERANCE)
    for k in points:
        bar = "" if line.errors is None else f" +- (0,{_number(line.errors[k])})"
        yield f"({_number(x[k])},{_number(y[k])}){bar}\n"


def _number(value: float) -> str:
    return f"{value:.6g}"


def simplified(x: Array, y: Array, tolerance: float) -> NDArray[np.intp]:
    """Choose points of a curve that keep its shape (D. H. Douglas and T. K. Peucker, 1973).

    Parameters
    ----------
    x, y
        Shape (m,), finite.
    tolerance
        Distance from the curve that its points may have, relative to the extents of the curve.

    Returns
    -------
    NDArray
        Indices of the points, ascending.
    """
    scaled = np.stack([(c - c.min()) / (np.ptp(c) or 1.0) for c in (x, y)], axis=1)
    chosen = np.zeros(len(x), dtype=bool)
    chosen[[0, -1]] = True
    open_parts = [(0, len(x) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        inner = scaled[first + 1 : last] - scaled[first]
        if not len(inner):
            continue
        chord = scaled[last] - scaled[first]
        length = float(chord @ chord)
        # Distances from the chord, not from its line: paths turn back.
        along = np.clip(inner @ chord / length, 0.0, 1.0) if length else np.zeros(len(inner))
        off = np.hypot(*(inner - along[:, None] * chord).T)
        farthest = int(off.argmax())
        if off[farthest] > tolerance:
            middle = first + 1 + farthest
            chosen[middle] = True
            open_parts += [(first, middle), (middle, last)]
    return np.flatnonzero(chosen)
