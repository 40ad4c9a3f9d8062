"""Picture → LaTeX, as a tikzpicture of pgfplots that the reader's document sets in its fonts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.simulate.results.decimation import simplified
from lagrange_cli.simulate.results.picture import Line, MarkedPlace, Panel, Picture

#: Distance from a line that the points left of it have at most, over the extent of the axes; a
#: twentieth of a millimetre.
_TOLERANCE = 5e-4

#: Points of a line that are looked at: TeX takes seconds for some ten thousands.
_MOST_POINTS = 4000

#: Centimetres between axes beside each other; width and height of axes, by whether they are wide.
_BESIDE = 2.0
_SIZES = {True: (11.0, 3.2), False: (5.6, 5.6)}

_DASHES = ("solid", "dashed", "densely dotted", "dashdotted", "densely dashdotdotted")

_COLOURS = ("black", "blue!70!black", "red!75!black", "green!50!black")

_HEAD = r"""% Made by lagrange. In the preamble:
% \usepackage{amsmath, pgfplots} \pgfplotsset{compat=1.16}
"""


def pgfplots_text(picture: Picture) -> str:
    """Write a picture as a ``tikzpicture`` of pgfplots."""
    width, height = _size(picture)
    middle = (picture.columns * (width + _BESIDE) - _BESIDE) / 2
    place = f"({_number(middle)}cm,{_number(height + (0.3 if _beside(picture) else 1.0))}cm)"
    style = f"anchor=south, align=center, text width={_number(2 * middle)}cm"
    title = f"\\node[{style}] at {place} {{{latex_text(picture.title)}}};\n"
    body = "".join(_axis(picture, number) for number in range(len(picture.panels)))
    return f"{_HEAD}\\begin{{tikzpicture}}\n{title}{body}\\end{{tikzpicture}}\n"


def _beside(picture: Picture) -> bool:
    """Say whether legends stand beside the axes, and not above."""
    return picture.columns == 1


def _between(picture: Picture) -> float:
    """Return the centimetres between axes below each other, for abscissas and a legend above."""
    if not _beside(picture):
        return 2.2
    return 0.9 if picture.over_time else 1.7


def _size(picture: Picture) -> tuple[float, float]:
    return _SIZES[picture.wide]


def _axis(picture: Picture, number: int) -> str:
    panel, (width, height) = picture.panels[number], _size(picture)
    row, column = divmod(number, picture.columns)
    x, y = column * (width + _BESIDE), -row * (height + _between(picture))
    options = [
        f"at={{({_number(x)}cm,{_number(y)}cm)}}",
        f"width={_number(width)}cm, height={_number(height)}cm, scale only axis",
        *_options(picture, panel, last=number == len(picture.panels) - 1),
    ]
    lines = "".join(_plots(panel))
    return "\\begin{axis}[\n  " + ",\n  ".join(options) + "]\n" + lines + "\\end{axis}\n"


def _options(picture: Picture, panel: Panel, *, last: bool) -> Iterator[str]:
    yield f"ylabel={{{panel.y_label.latex}}}"
    below = picture.over_time and not last
    yield "xticklabels={}" if below else f"xlabel={{{panel.x_label.latex}}}"
    if panel.equal:
        yield "axis equal"
    elif panel.over_time:
        yield "enlarge x limits=false"
    if panel.has_legend:
        legend_place = "legend pos=outer north east"
        above = "legend columns=3, legend style={at={(0.5,1.02)}, anchor=south}"
        yield legend_place if _beside(picture) else above
        yield "legend style={draw=none}, legend cell align=left"


def _plots(panel: Panel) -> Iterator[str]:
    for line in panel.faint:
        yield _plot(line, "black!30, very thin, forget plot")
    for number, line in enumerate(panel.named):
        colour, dash = (number, number) if line.dash is None else (0, line.dash)
        dashes = "only marks, mark size=0.4pt" if line.dots else _DASHES[dash % len(_DASHES)]
        unnamed = ", forget plot" if line.again else ""
        yield _plot(line, f"{_COLOURS[colour % len(_COLOURS)]}, {dashes}{unnamed}")
        if panel.has_legend and not line.again:
            yield f"\\addlegendentry{{{line.label.latex}}}\n"
    for place in panel.places:
        at = f"(axis cs:{_number(place.x)},{_number(place.y)})"
        text = f"{_side(panel, place)}:{{{place.label.latex}}}"
        label = f"label={{[font=\\scriptsize, inner sep=1pt]{text}}}"
        yield f"\\node[circle, fill, inner sep=1pt, {label}] at {at} {{}};\n"


def _side(panel: Panel, place: MarkedPlace) -> int:
    """Return the direction of a text beside a point in degrees: left where the axes end."""
    everything = np.concatenate([line.x for line in panel.lines])
    low, high = float(everything.min()), float(everything.max())
    return 135 if place.x > low + 0.75 * (high - low) else 45


def _plot(line: Line, style: str) -> str:
    points = "".join(f"({_number(x)},{_number(y)})\n" for x, y in _points(line))
    return f"\\addplot[{style}, line join=round] coordinates {{\n{points}}};\n"


def _points(line: Line) -> Iterator[tuple[float, float]]:
    if not len(line.x):
        return
    stride = 1 if line.dots else -(-len(line.x) // _MOST_POINTS)
    # Rounded as they are written: else the last digits of what is constant would be a shape.
    x, y = (np.array([float(_number(v)) for v in c[::stride]]) for c in (line.x, line.y))
    points = np.arange(len(x)) if line.dots else simplified(x, y, _TOLERANCE)
    yield from zip(x[points].tolist(), y[points].tolist(), strict=True)


def _number(value: float) -> str:
    return f"{value:.6g}"
