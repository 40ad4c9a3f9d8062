"""A sketch as TikZ: a picture for ``\\input`` that needs the package tikz alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.pictures.sketch.composition import sketch_of

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.pictures.sketch.sketch import Dot, DotKind, Place, Sketch, Stroke, StrokeKind

_STYLES: dict[StrokeKind, str] = {
    "rod": "line width=0.9pt",
    "radius": "dashed",
    "rope": "line width=0.6pt",
    "spring": "line width=0.5pt, line join=round",
    "damper": "line width=0.5pt",
    "curve": "line width=0.6pt, gray",
    "hatch": "very thin",
    "ground": "line width=0.5pt",
    "wheel": "line width=0.7pt",
    "body": "line width=0.55pt, line join=round",
    "angle": "thin, ->",
    "reference": "thin, densely dotted",
    "axis": "thin, ->",
    "gravity": "line width=0.7pt, ->",
    "force": "line width=0.9pt, ->",
}
_POINTS_PER_CM = 72.27 / 2.54

_DOTS: dict[DotKind, str] = {"mass": r"\fill", "joint": r"\draw[fill=white]", "origin": r"\fill"}


def emit_tikz(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    """Return ``NAME.tikz.tex``.

    Raises
    ------
    InputError
        The system cannot be drawn; see :func:`.composition.sketch_of`.
    """
    return {f"{equations.presentation.name}.tikz.tex": tikz_text(sketch_of(equations))}


def tikz_picture(equations: Equations, points: float) -> str:
    """The same within a document, made smaller where it is wider than a line of so many points.

    Raises
    ------
    InputError
        The system cannot be drawn.
    """
    sketch = sketch_of(equations)
    text = tikz_text(sketch).rstrip()
    is_wide = (sketch.high[0] - sketch.low[0]) * _POINTS_PER_CM > points
    return f"\\resizebox{{\\linewidth}}{{!}}{{%\n{text}%\n}}" if is_wide else text


def tikz_text(sketch: Sketch) -> str:
    """Write a sketch as a ``tikzpicture``."""
    title = sketch.name if sketch.title is None else f"{sketch.name}: {sketch.title}"
    remarks = "".join(f"% {comment_text(line)}\n" for line in (title, *sketch.remarks))
    lines = [
        *(_stroke(stroke) for stroke in sketch.strokes),
        *(_dot(dot) for dot in sketch.dots),
        *(rf"\node at {_at(k.at)} {{${k.caption.latex}$}};" for k in sketch.labels),
    ]
    return remarks + "\n".join(_picture(lines)) + "\n"


def _picture(lines: list[str]) -> Iterator[str]:
    yield r"\begin{tikzpicture}[x=1cm, y=1cm]"
    if any(r"\text{" in line for line in lines):
        yield r"\providecommand{\text}[1]{\mbox{#1}}"
    yield from lines
    yield r"\end{tikzpicture}"


def _stroke(stroke: Stroke) -> str:
    path = " -- ".join(_at(point) for point in stroke.points)
    return rf"\draw[{_STYLES[stroke.kind]}] {path}{' -- cycle' if stroke.closed else ''};"


def _dot(dot: Dot) -> str:
    return rf"{_DOTS[dot.kind]} {_at(dot.at)} circle[radius={dot.radius:g}];"


def _at(place: Place) -> str:
    return f"({place[0]:g},{place[1]:g})"
