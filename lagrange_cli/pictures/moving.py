"""Systems that move: frames of a sketch, as an SVG, GIF or MP4 that plays them.

What moves is drawn in black, supports and curves in grey; shapes of modes have the system at rest
in light grey beside them.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import ending_of, write_file
from lagrange_cli.notation.symbols import printable
from lagrange_cli.pictures.figures import new_figure
from lagrange_cli.pictures.sketch.displaced import BODY, DisplacedSketch, RestingSketch
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.pictures.sketch.displaced import DrawnConfiguration
    from lagrange_cli.pictures.sketch.sketch import StrokeKind
    from lagrange_cli.simulate import Trajectory

#: Endings of files that move; all but the first are made by matplotlib.
MOVING = ("svg", "gif", "mp4")

#: Panels in a row.
IN_A_ROW = 4

#: Centimetres around everything, above it for the title, and from a line to itself displaced.
_MARGIN, _HEAD, _BESIDE = 0.45, 0.7, 0.55

#: Dots an inch of a film, pixels of a centimetre of an SVG, centimetres of an inch.
_DPI, _PIXELS, _INCH = 100, 32, 2.54

#: Width of lines in points.
WIDTHS: Mapping[StrokeKind, float] = {
    "rod": 1.6,
    "wheel": 1.2,
    "body": 1.0,
    "spring": 0.9,
    "damper": 0.9,
}
OTHER_WIDTH = 0.8

#: Least part of its width that a line has beside small particles.
_THINNEST = 0.6
#: Part of its size to which a line may shrink between two frames of an SVG: it turns by 0.9 rad.
_SHRUNK = 0.9

#: Frames a second of a film, and its most frames.
_RATE, _MOST_FRAMES = 25, 500

#: Seconds of films in real time; a film that would be shorter or longer lasts the usual seconds.
_SHORTEST, _LONGEST, _USUAL = 1.0, 60.0, 10.0

#: Longest film that is asked for by its speed, in seconds.
_MOST_SECONDS = 3600.0

#: Largest height of a panel over its width: a film of what falls is no line of pixels.
_TALLEST = 2.0

LIGHT, DARK, STILL = "#b8b8b8", "#000000", "#777777"


@dataclass(frozen=True)
class MovingPanel:
    """A system that moves.

    Attributes
    ----------
    title
        What stands above it.
    sketch
        The system at rest, and in each frame.
    shows_rest
        True if the system at rest is drawn too.
    """

    title: Label
    sketch: DisplacedSketch
    shows_rest: bool = True

    def shown(self, number: int) -> DrawnConfiguration:
        """Return a frame; below the system at rest where both would lie on one line."""
        drawn = self.sketch.moved[number]
        if not (self.sketch.is_line and self.shows_rest):
            return drawn
        across = np.ptp(drawn.bodies, axis=0).argmin()
        shift = -_BESIDE * np.eye(2)[across]
        strokes = tuple((kind, line + shift) for kind, line in drawn.strokes)
        return type(drawn)(strokes, drawn.bodies + shift)

    @property
    def thinness(self) -> float:
        """Return by how much lines are thinner beside particles that are smaller than usual."""
        return max(_THINNEST, self.sketch.radius / BODY)

    def backdrop(self) -> list[tuple[DrawnConfiguration, str]]:
        """Return what does not move, with its colours."""
        still = type(self.sketch.at_rest)(self.sketch.still, np.zeros((0, 2)))
        return [(still, STILL), *([(self.sketch.at_rest, LIGHT)] if self.shows_rest else [])]


@dataclass(frozen=True)
class MovingPictures:
    """Panels whose frames are shown one after the other, over and over.

    Attributes
    ----------
    title
        The scene's title, or its name.
    panels
        Each with as many frames.
    seconds
        Time from the first frame to the first again.
    remark
        What is not shown, in words; empty if nothing is left out.
    """

    title: str
    panels: tuple[MovingPanel, ...]
    seconds: float
    remark: str = ""

    @property
    def frames(self) -> int:
        return len(self.panels[0].sketch.moved)

    def box(self) -> tuple[Array, Array]:
        """Return the corners of a box around each of the panels."""
        places = []
        for panel in self.panels:
            drawn = [panel.shown(number) for number in range(self.frames)]
            drawn += [configuration for configuration, _ in panel.backdrop()]
            places += [line for configuration in drawn for _, line in configuration.strokes]
            places += [configuration.bodies for configuration in drawn]
        together = np.concatenate(places)
        low, high = together.min(axis=0) - _MARGIN, together.max(axis=0) + _MARGIN
        width, height = high - low
        missing = np.array([max(0.0, height / _TALLEST - width) / 2, 0.0])
        return low - missing, high + missing


def animated(pictures: MovingPictures, ending: str) -> bytes:
    """Return the bytes of a file that moves, of one of the endings :data:`MOVING`.

    Raises
    ------
    InputError
        The ending is another one, matplotlib is not installed, or ffmpeg is not there for an MP4.
    """
    if ending == "svg":
        return ("\n".join(_svg(pictures)) + "\n").encode()
    if ending not in MOVING:
        hint = f"endings: {', '.join(MOVING)}"
        raise InputError(
            Problem(f"no animation is written as '.{ending}'", hint=hint, rule="output")
        )
    return _film(pictures, ending)


def write_film(path: str | os.PathLike[str], pictures: MovingPictures) -> None:
    """Write a file that moves, whose ending says what it is; see :func:`animated`."""
    write_file(path, animated(pictures, ending_of(path).lstrip(".")))


# -- motions ------------------------------------------------------------------------------


def motion_pictures(
    equations: Equations,
    motions: Sequence[tuple[str, Trajectory]],
    speed: float | None = None,
) -> MovingPictures:
    """Draw motions, a panel each.

    Between samples coordinates are interpolated by cubics through their values and rates.

    Parameters
    ----------
    motions
        Motions of these equations over the same time, each below a title; a unit of their time is
        a second.
    speed
        Units of its time in a second of the film; None for 1, or, where the film would be shorter
        than a second or longer than a minute, for a film of ten seconds.

    Raises
    ------
    InputError
        The speed is not positive, or the film would be of hours, or there is no picture of the
        system.
    """
    first = motions[0][1]
    seconds = _seconds(float(first.t[-1] - first.t[0]), speed)
    frames = int(min(_MOST_FRAMES, max(2, round(_RATE * seconds))))
    times = np.linspace(first.t[0], first.t[-1], frames, endpoint=False)
    panels = (
        MovingPanel(Label(title, title), _followed(equations, trajectory, times), shows_rest=False)
        for title, trajectory in motions
    )
    return MovingPictures(first.labels.title, tuple(panels), seconds)


def _followed(equations: Equations, trajectory: Trajectory, times: Array) -> DisplacedSketch:
    from scipy.interpolate import CubicHermiteSpline

    names, t = trajectory.coordinates, trajectory.t
    values = np.array([trajectory.columns[name] for name in names]).T
    rates = np.array([trajectory.columns[f"dot({name})"] for name in names]).T
    apart = np.concatenate([[True], np.diff(t) > 0])
    followed = CubicHermiteSpline(t[apart], values[apart], rates[apart])(times)
    return RestingSketch(equations, values[0]).followed(followed, times)


def _seconds(span: float, speed: float | None) -> float:
    """Return how long the film of a motion lasts."""
    if speed is None:
        return span if _SHORTEST <= span <= _LONGEST else _USUAL
    if not 0 < speed < np.inf:
        raise InputError(Problem(f"a speed is a positive number, not {speed:g}", rule="speed"))
    if not span / speed <= _MOST_SECONDS:
        problem = f"at speed {speed:g} the film of {span:g} units of time lasts more than an hour"
        hint = f"--speed {span / _USUAL:.3g} makes it last {_USUAL:g} s"
        raise InputError(Problem(problem, hint=hint, rule="speed"))
    return max(span / speed, 1.0 / _RATE)


# -- films --------------------------------------------------------------------------------


def _film(pictures: MovingPictures, ending: str) -> bytes:
    low, high = pictures.box()
    columns, rows, size = _grid(pictures, low, high)
    figure = new_figure((columns * size[0] / _INCH, rows * size[1] / _INCH), "png")
    from matplotlib import animation

    if ending == "mp4" and not animation.FFMpegWriter.isAvailable():
        hint = "install ffmpeg, or write a .gif or .svg"
        raise InputError(
            Problem("an MP4 needs ffmpeg, which is not there", hint=hint, rule="output")
        )
    moving = [
        _MovingLines(figure, panel, (rows, columns, number), low, high)
        for number, panel in enumerate(pictures.panels, 1)
    ]

    def show(number: int) -> list[Line2D]:
        return [line for lines in moving for line in lines.show(number)]

    rate = pictures.frames / pictures.seconds
    film = animation.FuncAnimation(figure, show, frames=pictures.frames)
    writers = {"gif": animation.PillowWriter, "mp4": animation.FFMpegWriter}
    with TemporaryDirectory(prefix="lagrange-") as folder:
        path = os.path.join(folder, f"film.{ending}")
        film.save(path, writer=writers[ending](fps=rate), dpi=_DPI)
        with open(path, "rb") as file:
            return file.read()


class _MovingLines:
    """The lines of a panel of a film, which take the places of a frame."""

    def __init__(
        self,
        figure: Figure,
        panel: MovingPanel,
        place: tuple[int, int, int],
        low: Array,
        high: Array,
    ) -> None:
        self._panel = panel
        self._axes = figure.add_subplot(*place)
        self._axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        self._axes.set_axis_off()
        self._axes.set_title(panel.title.plain, fontsize=10)
        for configuration, colour in panel.backdrop():
            self._lines(configuration, colour)
        self._moving = self._lines(panel.shown(0), DARK)

    def _lines(self, drawn: DrawnConfiguration, colour: str) -> list[Line2D]:
        style: dict[str, Any] = {"solid_capstyle": "round"}
        lines = []
        for kind, places in drawn.strokes:
            dash = "--" if kind == "radius" else "-"
            width = self._panel.thinness * WIDTHS.get(kind, OTHER_WIDTH)
            style |= {"color": _colour(kind, colour), "linestyle": dash}
            lines += self._axes.plot(*places.T, linewidth=width, **style)
        size = 2 * self._panel.sketch.radius * 72 / _INCH
        lines += self._axes.plot(*drawn.bodies.T, "o", markersize=size, color=colour)
        return lines

    def show(self, number: int) -> list[Line2D]:
        """Move the lines to their places in a frame; return them."""
        drawn = self._panel.shown(number)
        places = [*(line for _, line in drawn.strokes), drawn.bodies]
        for line, (x, y) in zip(self._moving, (p.T for p in places), strict=True):
            line.set_data(x, y)
        return self._moving


# -- as a moving SVG ----------------------------------------------------------------------


def _grid(pictures: MovingPictures, low: Array, high: Array) -> tuple[int, int, Array]:
    """Return columns, rows, and the size of a panel with its title, in centimetres."""
    columns = min(IN_A_ROW, len(pictures.panels))
    return columns, -(-len(pictures.panels) // columns), high - low + np.array([0.0, _HEAD])


def _svg(pictures: MovingPictures) -> Iterator[str]:
    low, high = pictures.box()
    columns, rows, size = _grid(pictures, low, high)
    size = _PIXELS * size
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
        yield from _svg_panel(panel, origin, corner, pictures.seconds)
        middle = column * size[0] + size[0] / 2
        yield (
            f'<text x="{middle:.1f}" y="{origin[1] - 6:.1f}" fill="#000" text-anchor="middle"'
            f' font-family="serif" font-size="16">{_text(panel.title.plain)}</text>'
        )
        yield "</g>"
    yield "</svg>"


def _svg_panel(panel: MovingPanel, origin: Array, corner: Array, seconds: float) -> Iterator[str]:
    def at(line: Array) -> Array:
        """Return pixels, y downwards."""
        placed: Array = origin + _PIXELS * (line - corner) * np.array([1.0, -1.0])
        return placed

    radius = _PIXELS * panel.sketch.radius
    for drawn, colour in panel.backdrop():
        for kind, line in drawn.strokes:
            style = _style(kind, colour, panel.thinness)
            yield f'<polyline {style} points="{_points(at(line))}"/>'
        for x, y in at(drawn.bodies):
            yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius:.2f}" fill="{colour}"/>'
    frames = [panel.shown(k) for k in (*range(len(panel.sketch.moved)), 0)]
    mode = "discrete" if _turns_far(frames[:-1]) else "linear"
    for number, (kind, line) in enumerate(frames[0].strokes):
        each = [_points(at(frame.strokes[number][1])) for frame in frames]
        style = _style(kind, DARK, panel.thinness)
        yield f'<polyline {style} points="{_points(at(line))}">'
        yield f"{_animate('points', each, seconds, mode)}</polyline>"
    bodies = np.array([at(frame.bodies) for frame in frames])
    for x, y in bodies.transpose(1, 2, 0):
        yield f'<circle cx="{x[0]:.2f}" cy="{y[0]:.2f}" r="{radius:.2f}" fill="{DARK}">'
        for name, values in (("cx", x), ("cy", y)):
            yield _animate(name, [f"{value:.2f}" for value in values], seconds, mode)
        yield "</circle>"


def _colour(kind: StrokeKind, colour: str) -> str:
    """Return the colour of a line; the ground is grey where it moves past what is followed."""
    return STILL if kind == "ground" and colour == DARK else colour


def _style(kind: StrokeKind, colour: str, thinness: float) -> str:
    dashes = ' stroke-dasharray="5 3"' if kind == "radius" else ""
    width = thinness * WIDTHS.get(kind, OTHER_WIDTH)
    return f'stroke="{_colour(kind, colour)}" stroke-width="{width:.3g}"{dashes}'


def _animate(name: str, values: Sequence[str], seconds: float, mode: str) -> str:
    return (
        f'<animate attributeName="{name}" dur="{seconds:g}s" repeatCount="indefinite"'
        f' calcMode="{mode}" values="{";".join(values)}"/>'
    )


def _turns_far(frames: Sequence[DrawnConfiguration]) -> bool:
    """Tell whether something turns so far from frame to frame that it would shrink between them."""
    for number in range(len(frames[0].strokes)):
        lines = np.array([frame.strokes[number][1] for frame in frames])
        lines = lines - lines.mean(axis=1, keepdims=True)
        between = (lines[1:] + lines[:-1]) / 2
        sizes, least = (np.linalg.norm(x, axis=(1, 2)) for x in (lines, between))
        if (least < _SHRUNK * np.minimum(sizes[1:], sizes[:-1])).any():
            return True
    return False


def _points(line: Array) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)


def _text(text: str) -> str:
    """Return text without markup and without characters that XML does not allow."""
    return escape(printable(text))
