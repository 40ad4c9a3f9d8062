"""A sketch as SVG 1.1: one file without scripts, fonts or references."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from lagrange_cli.notation.symbols import printable
from lagrange_cli.pictures.sketch.composition import sketch_of

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.pictures.sketch.sketch import Dot, DotKind, Place, Sketch, Stroke, StrokeKind

#: Pixels of a centimetre.
_PIXELS = 40

_STYLES: dict[StrokeKind, str] = {
    "rod": 'stroke-width="1.6"',
    "radius": 'stroke-width="0.9" stroke-dasharray="5 3"',
    "rope": 'stroke-width="1.1"',
    "spring": 'stroke-width="0.9" stroke-linejoin="round"',
    "damper": 'stroke-width="0.9"',
    "curve": 'stroke-width="1.1" stroke="#777"',
    "hatch": 'stroke-width="0.5"',
    "ground": 'stroke-width="0.9"',
    "wheel": 'stroke-width="1.2"',
    "body": 'stroke-width="1.0" stroke-linejoin="round"',
    "angle": 'stroke-width="0.7" marker-end="url(#arrow)"',
    "reference": 'stroke-width="0.7" stroke-dasharray="1.5 2.5"',
    "axis": 'stroke-width="0.7" marker-end="url(#arrow)"',
    "gravity": 'stroke-width="1.2" marker-end="url(#arrow)"',
    "force": 'stroke-width="1.5" marker-end="url(#arrow)"',
}
_DOTS: dict[DotKind, str] = {
    "mass": 'fill="#000" stroke="none"',
    "joint": 'fill="#fff" stroke-width="0.9"',
    "origin": 'fill="#000" stroke="none"',
}
_ARROW = (
    '<defs><marker id="arrow" markerUnits="userSpaceOnUse" markerWidth="8" markerHeight="6"'
    ' refX="7" refY="3" orient="auto"><path d="M0,0 L7,3 L0,6" fill="none" stroke="#000"'
    ' stroke-width="0.8"/></marker></defs>'
)


def emit_svg(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    """Return ``NAME.svg``.

    Raises
    ------
    InputError
        The system cannot be drawn; see :func:`.composition.sketch_of`.
    """
    return {f"{equations.presentation.name}.svg": svg_text(sketch_of(equations))}


def svg_text(sketch: Sketch) -> str:
    """Write a sketch as an SVG document."""
    return "\n".join(_lines(sketch)) + "\n"


def _lines(sketch: Sketch) -> Iterator[str]:
    left, top = sketch.low[0], -sketch.high[1]
    width, height = (high - low for low, high in zip(sketch.low, sketch.high, strict=True))
    x, y, w, h = (f"{_PIXELS * value:.1f}" for value in (left, top, width, height))
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" viewBox="{x} {y} {w} {h}"'
        f' width="{w}" height="{h}">'
    )
    yield f"<title>{_text(sketch.title or sketch.name)}</title>"
    yield f"<desc>{_text('; '.join(sketch.remarks))}</desc>"
    yield f'<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="#fff"/>'
    yield _ARROW
    yield '<g fill="none" stroke="#000" stroke-linecap="round">'
    yield from map(_stroke, sketch.strokes)
    yield from map(_dot, sketch.dots)
    yield "</g>"
    yield '<g font-family="serif" font-size="15" font-style="italic" text-anchor="middle">'
    for label in sketch.labels:
        across, down = _at(label.at)
        yield f'<text x="{across}" y="{down}" dy="0.35em">{_text(label.caption.plain)}</text>'
    yield "</g>"
    yield "</svg>"


def _stroke(stroke: Stroke) -> str:
    points = " ".join(",".join(_at(point)) for point in stroke.points)
    shape = "polygon" if stroke.closed else "polyline"
    return f'<{shape} {_STYLES[stroke.kind]} points="{points}"/>'


def _dot(dot: Dot) -> str:
    x, y = _at(dot.at)
    return f'<circle {_DOTS[dot.kind]} cx="{x}" cy="{y}" r="{_PIXELS * dot.radius:.2f}"/>'


def _at(place: Place) -> tuple[str, str]:
    """Return a place in pixels, y downwards."""
    x, y = _PIXELS * place[0] + 0.0, -_PIXELS * place[1] + 0.0
    return f"{x:.2f}", f"{y:.2f}"


def _text(text: str) -> str:
    """Text without markup or characters that XML has not."""
    return escape(printable(text))
