"""Pictures of normal modes: the system at rest in grey, displaced in black; still or moving.

A mode moves as q* + a Re(Y e^{iφ}), with its shape Y over all coordinates. The amplitude a is for
the eye: the fastest particle goes a part of the extent of the system, and no angle far.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from lagrange_cli.analysis.analyze import analyze
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.notation.symbols import printable
from lagrange_cli.pictures.by_matplotlib import draw
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import (
    NO_LABEL,
    Axis,
    Line,
    Look,
    Panel,
    Picture,
    equation,
    frequency_unit,
)
from lagrange_cli.pictures.sketch.displaced import DisplacedSketch, RestingSketch
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels, labels_of

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Mode
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.pictures.sketch.displaced import DrawnConfiguration
    from lagrange_cli.pictures.sketch.sketch import StrokeKind

#: Modes that are drawn, and pictures in a row.
_MOST_MODES, _IN_A_ROW = 12, 4

#: Part of the extent that the fastest particle goes, and of the shortest link, and radians that an
#: angle turns, at most.
_REACH, _APART, _TURN = 0.2, 0.3, 0.5

#: Pictures of a period, and its seconds.
_FRAMES, _SECONDS = 24, 2.0

#: Centimetres around everything, above it for the title, and from a line to itself displaced.
_MARGIN, _HEAD, _BESIDE = 0.45, 0.7, 0.55

#: Points across a panel, dots an inch of an animation, pixels of a centimetre of an SVG.
_POINTS, _DPI, _PIXELS = 150, 100, 32

#: Width of lines in points.
_WIDTHS: Mapping[StrokeKind, float] = {"rod": 1.6, "wheel": 1.2, "spring": 0.9, "damper": 0.9}
_OTHER_WIDTH, _BODY = 0.8, 0.1

_LIGHT, _DARK, _STILL = "#b8b8b8", "#000000", "#777777"


@dataclass(frozen=True)
class ModePanel:
    """One mode.

    Attributes
    ----------
    title
        Its angular frequency or pole.
    sketch
        The system at rest, and along a period, or at its largest displacement alone.
    """

    title: Label
    sketch: DisplacedSketch

    def shown(self, number: int) -> DrawnConfiguration:
        """Return the displaced system; below itself where both would lie on one line."""
        drawn = self.sketch.moved[number]
        if not self.sketch.is_line:
            return drawn
        across = np.ptp(drawn.bodies, axis=0).argmin()
        shift = -_BESIDE * np.eye(2)[across]
        strokes = tuple((kind, line + shift) for kind, line in drawn.strokes)
        return type(drawn)(strokes, drawn.bodies + shift)


@dataclass(frozen=True)
class ModePictures:
    """The modes of a system at an equilibrium.

    Attributes
    ----------
    title
        The scene's title, or its name.
    panels
        One a mode.
    remark
        Number of modes that are not drawn, in words; empty if all are.
    """

    title: str
    panels: tuple[ModePanel, ...]
    remark: str = ""


def mode_pictures(
    equations: Equations, at: Mapping[str, str] | None = None, *, moving: bool
) -> ModePictures:
    """Draw the modes at an equilibrium.

    Parameters
    ----------
    at
        As for :func:`.analyze.analyze`.
    moving
        True for the pictures of a period, else the largest displacement.

    Raises
    ------
    InputError
        There are no modes, or no picture of the system.
    """
    analysis = analyze(equations, ("linearization", "modes"), at)
    assert analysis.linearization is not None
    linear, modes = analysis.linearization, analysis.modes or ()
    if not modes:
        raise InputError(Problem("there are no modes to draw", rule="plot"))
    phases = 2 * np.pi * np.arange(_FRAMES if moving else 1) / _FRAMES
    assert linear.at.position is not None
    q0 = np.array([float(x) for x in linear.at.position])
    sketch, labels = RestingSketch(equations, q0), labels_of(equations)
    panels = tuple(
        _panel(
            equations,
            sketch,
            q0,
            linear.directions @ np.array(mode.shape),
            _titled(mode, labels),
            phases,
        )
        for mode in modes[:_MOST_MODES]
    )
    hidden = len(modes) - len(panels)
    remark = f"{hidden} further modes are not drawn" if hidden else ""
    title = printable(equations.presentation.title or equations.presentation.name)
    return ModePictures(title, panels, remark)


def _panel(
    equations: Equations,
    sketch: RestingSketch,
    q0: Array,
    shape: Array,
    title: Label,
    phases: Array,
) -> ModePanel:
    shape = shape * _amplitude(equations, sketch, shape)
    moved = [q0 + np.real(shape * np.exp(1j * phase)) for phase in phases]
    return ModePanel(title, sketch.displaced(moved))


def _amplitude(equations: Equations, sketch: RestingSketch, shape: Array) -> float:
    """Choose the factor of a shape that is seen well."""
    speeds = [sketch.speed(part) for part in (shape.real, shape.imag)]
    turning = [
        abs(x) for c, x in zip(equations.system.coordinates, shape, strict=True) if c.is_angle
    ]
    reach = min(_REACH, _APART * sketch.shortest_link)
    limits = [reach / max(speeds)] if max(speeds) > 1e-9 else []
    limits += [_TURN / max(turning)] if max(turning, default=0.0) > 0 else []
    return min(limits, default=0.0)


def _titled(mode: Mode, labels: Labels) -> Label:
    """Write ``ω = 3.132 rad/s``, or the pole ``s = −0.1 ± 3.1 i``."""
    pole = mode.pole
    if pole is None:
        unit = frequency_unit(labels)
        return equation(Label(r"\omega", "ω"), mode.frequency, unit, 4)
    parts = [f"{pole.real:.4g}".replace("-", "−")] if pole.real else []
    parts += [f"± {pole.imag:.4g} i"] if pole.imag else []
    plain = f"s = {' '.join(parts) or '0'}"
    latex = plain.replace("−", "-").replace("±", r"\pm").replace(" i", r"\,\mathrm{i}")
    return Label(f"${latex}$", plain)


# -- boxes --------------------------------------------------------------------------------


def _box(pictures: ModePictures) -> tuple[Array, Array]:
    """Return the corners of a box around each of the pictures."""
    places = []
    for panel in pictures.panels:
        drawn = [panel.sketch.at_rest, *map(panel.shown, range(len(panel.sketch.moved)))]
        places += [line for d in drawn for _, line in d.strokes]
        places += [line for _, line in panel.sketch.still]
        places += [d.bodies for d in drawn]
    together = np.concatenate(places)
    return together.min(axis=0) - _MARGIN, together.max(axis=0) + _MARGIN


# -- as pictures --------------------------------------------------------------------------


@picture_of.register
def picture_of_modes(pictures: ModePictures, asked: str | None = None) -> Picture:
    """Draw a panel for each mode."""
    return _picture(pictures, 0)


def _picture(pictures: ModePictures, number: int) -> Picture:
    """Return the picture of one of the configurations of each mode."""
    (left, low), (right, high) = (corner.tolist() for corner in _box(pictures))
    empty = Panel((), Axis(NO_LABEL), Axis(NO_LABEL), box=(left, right, low, high))
    dot = 2 * _BODY * _POINTS * min(1 / (right - left), empty.ratio / (high - low))
    panels = tuple(
        replace(empty, lines=tuple(_lines(panel, number, dot)), title=panel.title)
        for panel in pictures.panels
    )
    return Picture(pictures.title, panels, most_columns=_IN_A_ROW)


def _lines(panel: ModePanel, number: int, dot: float) -> Iterator[Line]:
    """Yield supports, the system at rest and displaced; ``dot``: points across a body."""
    still = type(panel.sketch.at_rest)(panel.sketch.still, np.zeros((0, 2)))
    drawn = ((still, _STILL), (panel.sketch.at_rest, _LIGHT), (panel.shown(number), _DARK))
    for configuration, colour in drawn:
        for kind, line in configuration.strokes:
            look = Look(
                colour, _WIDTHS.get(kind, _OTHER_WIDTH), int(kind == "radius"), is_named=False
            )
            yield Line(NO_LABEL, line[:, 0], line[:, 1], look=look)
        x, y = configuration.bodies.T
        yield Line(NO_LABEL, x, y, look=Look(colour, 0.0, 0, 0, dot, is_named=False))


def _gif(pictures: ModePictures) -> bytes:
    """Draw the pictures of a period one after the other."""
    frames = [draw(_picture(pictures, number), "png", _DPI) for number in range(_FRAMES)]
    from PIL import Image

    first, *others = (Image.open(io.BytesIO(frame)) for frame in frames)
    stream, pause = io.BytesIO(), round(1000 * _SECONDS / _FRAMES)
    first.save(stream, "gif", save_all=True, append_images=others, duration=pause, loop=0)
    return stream.getvalue()


# -- as a moving SVG ----------------------------------------------------------------------


def animated_modes(pictures: ModePictures, ending: str) -> bytes:
    """Draw moving pictures as ``svg``, which needs nothing, or ``gif``.

    Raises
    ------
    InputError
        The ending is another one, or matplotlib is not installed.
    """
    if ending == "svg":
        return ("\n".join(_svg(pictures)) + "\n").encode()
    if ending == "gif":
        return _gif(pictures)
    hint = "endings: svg, gif"
    raise InputError(Problem(f"no animation is written as '.{ending}'", hint=hint, rule="output"))


def _svg(pictures: ModePictures) -> Iterator[str]:
    low, high = _box(pictures)
    size = _PIXELS * (high - low + np.array([0.0, _HEAD]))
    columns = min(_IN_A_ROW, len(pictures.panels))
    rows = -(-len(pictures.panels) // columns)
    width, height = columns * size[0], rows * size[1]
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" viewBox="0 0 {width:.1f}'
        f' {height:.1f}" width="{width:.1f}" height="{height:.1f}">'
    )
    yield f"<title>{_text(pictures.title)}</title>"
    yield f'<rect width="{width:.1f}" height="{height:.1f}" fill="#fff"/>'
    for number, panel in enumerate(pictures.panels):
        row, column = divmod(number, columns)
        origin = np.array([column * size[0], row * size[1] + _PIXELS * _HEAD])
        corner = np.array([low[0], high[1]])
        yield '<g fill="none" stroke-linecap="round">'
        yield from _svg_panel(panel, origin, corner)
        middle = column * size[0] + size[0] / 2
        yield (
            f'<text x="{middle:.1f}" y="{origin[1] - 6:.1f}" fill="#000" text-anchor="middle"'
            f' font-family="serif" font-size="16">{_text(panel.title.plain)}</text>'
        )
        yield "</g>"
    yield "</svg>"


def _svg_panel(panel: ModePanel, origin: Array, corner: Array) -> Iterator[str]:
    def at(line: Array) -> Array:
        """Return pixels, y downwards."""
        placed: Array = origin + _PIXELS * (line - corner) * np.array([1.0, -1.0])
        return placed

    sketch = panel.sketch
    for kind, line in sketch.still:
        yield f'<polyline {_style(kind, _STILL)} points="{_points(at(line))}"/>'
    for kind, line in sketch.at_rest.strokes:
        yield f'<polyline {_style(kind, _LIGHT)} points="{_points(at(line))}"/>'
    radius = _PIXELS * _BODY
    for x, y in at(sketch.at_rest.bodies):
        yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius:.2f}" fill="{_LIGHT}"/>'
    frames = [panel.shown(k) for k in (*range(len(sketch.moved)), 0)]
    for number, (kind, line) in enumerate(frames[0].strokes):
        each = [_points(at(frame.strokes[number][1])) for frame in frames]
        yield f'<polyline {_style(kind, _DARK)} points="{_points(at(line))}">'
        yield f"{_animate('points', each)}</polyline>"
    bodies = np.array([at(frame.bodies) for frame in frames])
    for x, y in bodies.transpose(1, 2, 0):
        yield f'<circle cx="{x[0]:.2f}" cy="{y[0]:.2f}" r="{radius:.2f}" fill="{_DARK}">'
        for name, values in (("cx", x), ("cy", y)):
            yield _animate(name, [f"{value:.2f}" for value in values])
        yield "</circle>"


def _style(kind: StrokeKind, colour: str) -> str:
    dashes = ' stroke-dasharray="5 3"' if kind == "radius" else ""
    return f'stroke="{colour}" stroke-width="{_WIDTHS.get(kind, _OTHER_WIDTH)}"{dashes}'


def _animate(name: str, values: Sequence[str]) -> str:
    return (
        f'<animate attributeName="{name}" dur="{_SECONDS:g}s" repeatCount="indefinite"'
        f' values="{";".join(values)}"/>'
    )


def _points(line: Array) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)


def _text(text: str) -> str:
    """Return text without markup and without characters that XML does not allow."""
    return escape(printable(text))
