"""Lines and bodies of a sketch at other configurations than the start: shapes of modes.

Links are found once, at all configurations that are drawn, and then drawn at each of them; curves
that hold particles stay where they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.pictures.sketch import shapes
from lagrange_cli.pictures.sketch.configurations import configurations, feasible_near, size_of
from lagrange_cli.pictures.sketch.findings import Findings, Link
from lagrange_cli.pictures.sketch.guides import Guide, frame_of, guides
from lagrange_cli.pictures.sketch.links import findings
from lagrange_cli.pictures.sketch.outlines import Outlines
from lagrange_cli.pictures.sketch.sketch import StrokeKind
from lagrange_cli.pictures.sketch.view import View, gravity, view_of
from lagrange_cli.pictures.sketch.wheels import Wheel, find_wheels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]

#: Largest extent of the bodies of a picture, in centimetres, and half the length of ground.
_EXTENT, _GROUND = 5.5, 0.28

#: Links above which springs and dampers are lines.
_MOST_COILS = 40

#: Angles of a rim.
_ROUND = np.linspace(0, 2 * np.pi, 49)


@dataclass(frozen=True)
class DrawnConfiguration:
    """One configuration in centimetres, y upwards.

    Attributes
    ----------
    strokes
        Kind of each line, with its places, shape (P, 2).
    bodies
        Places of the particles, shape (particles, 2).
    """

    strokes: tuple[tuple[StrokeKind, Array], ...]
    bodies: Array


@dataclass(frozen=True)
class DisplacedSketch:
    """A system in its rest position and beside it.

    Attributes
    ----------
    at_rest
        The rest position.
    still
        Supports and curves, which do not move.
    moved
        One for each configuration that was asked for.
    is_line
        True if everything is and stays on one line.
    """

    at_rest: DrawnConfiguration
    still: tuple[tuple[StrokeKind, Array], ...]
    moved: tuple[DrawnConfiguration, ...]
    is_line: bool


class RestingSketch:
    """A system at rest, to be drawn with displacements.

    Parameters
    ----------
    equations
        The equations of motion.
    rest_place
        Coordinates at rest, shape (n,).

    Raises
    ------
    InputError
        There are no particles, or too many bodies, or no values that could be drawn.
    """

    def __init__(self, equations: Equations, rest_place: Array) -> None:
        self._around, self._rest = configurations(equations), rest_place
        self._time = float(self._around.times[0])
        self._known = known = findings(self._with([rest_place], [self._time]))
        down = gravity(known.configurations)
        self._wheels = find_wheels(known.configurations, down)
        self._outlines = Outlines(known.configurations)
        self._view = view_of(known.configurations, down, *self._outlines.shown())
        self._guides = guides(known, self._view, frame_of(known))

    def _with(self, shown: Sequence[Array], times: Sequence[float]) -> Configurations:
        """Return configurations that begin with some, those near the start behind them."""
        around = self._around
        places = [around.drawn(q, float(t)) for q, t in zip(shown, times, strict=True)]
        return replace(
            around,
            q=np.concatenate([shown, around.q]),
            times=np.concatenate([times, around.times]),
            places=np.concatenate([places, around.places]),
        )

    def speed(self, direction: Array) -> float:
        """Return how far the fastest particle moves for a unit of a displacement, over the extent
        of the system."""
        step = 1e-4 / max(1e-300, float(np.abs(direction).max()))
        near = (self._rest + part * step * direction for part in (-1, 0, 1))
        places = [self._around.drawn(q, self._time) for q in near]
        across = np.linalg.norm(places[2] - places[0], axis=1)[: self._around.particles]
        return float(across.max()) / (2 * step) / size_of(places[1])

    def displaced(self, moved: Sequence[Array]) -> DisplacedSketch:
        """Draw it at rest and at other configurations, each of shape (n,), which are moved onto
        the constraints."""
        shown = [self._rest, *(feasible_near(self._around, q) for q in moved)]
        known = self._findings(shown, [self._time] * len(shown))
        return self._drawn(known, self._guides, len(shown), 1)

    def followed(self, q: Array, times: Array) -> DisplacedSketch:
        """Draw it at rest and along a motion, at coordinates of shape (T, n) and times (T,).

        Curves go as far as the motion does.
        """
        count = 1 + len(q)
        known = self._findings([self._rest, *q], [self._time, *times])
        curves = guides(known, self._view, frame_of(known, count))
        return self._drawn(known, curves, count, count)

    def _drawn(
        self, known: Findings, curves: Sequence[Guide], count: int, fitted: int
    ) -> DisplacedSketch:
        """Draw the first configurations, the first ``fitted`` of them as large as a picture is."""
        drawing = _Drawing(known, self._view, self._wheels, self._outlines, count, fitted)
        states = [drawing.at_configuration(k) for k in range(count)]
        still = drawing.still(curves)
        return DisplacedSketch(states[0], still, tuple(states[1:]), drawing.is_line)

    @property
    def shortest_link(self) -> float:
        """Return the shortest link over the extent of the system, 1 if there is none."""
        places = self._known.places[0]
        ends = [link.ends for link in self._known.links if link.kind != "radius"]
        lengths = [float(np.linalg.norm(places[a] - places[b])) for a, b in ends]
        size = size_of(places[: self._known.declared])
        return min((x / size for x in lengths if x > 1e-6 * size), default=1.0)

    def _findings(self, shown: Sequence[Array], times: Sequence[float]) -> Findings:
        """Return the links with all bodies at these configurations."""
        known, together = self._known, self._with(shown, times)
        added = range(known.declared, len(known.names))
        if not all(known.is_fixed(body) for body in added):
            return findings(together)  # a pivot moves, whose place no expression gives
        fixed = np.repeat(known.places[:1, known.declared :], len(together.q), axis=0)
        places = np.concatenate([together.places, fixed], axis=1)
        return replace(known, configurations=together, places=places)


class _Drawing:
    """Draws the configurations in one view and one scale."""

    def __init__(
        self,
        known: Findings,
        view: View,
        wheels: list[Wheel],
        outlines: Outlines,
        count: int,
        fitted: int,
    ) -> None:
        self.known, self.view, self.wheels, self.count = known, view, wheels, count
        self._rolling = {wheel.particle for wheel in wheels}
        self._outlines = outlines
        flat = view.project(known.places[:count])
        drawn = [view.project(line) for k in range(fitted) for _, line in self._shapes(k)]
        place = np.concatenate([flat[:fitted].reshape(-1, 2), *drawn])
        extent = float(np.ptp(place, axis=0).max())
        self.middle = (place.min(axis=0) + place.max(axis=0)) / 2
        self.scale = _EXTENT / (extent or frame_of(known).size)
        spread = np.ptp(flat.reshape(-1, 2), axis=0) * self.scale
        self.is_line = bool(spread.min() < 1e-6) and not wheels and not outlines.bodies
        self.turns = [self._turns(link) for link in known.links]

    def at(self, places: Array) -> Array:
        """Return places of space in centimetres."""
        placed: Array = (self.view.project(places) - self.middle) * self.scale
        return placed

    def _turns(self, link: Link) -> int | None:
        """Return the number of coils of a spring at rest; None of other links."""
        if link.kind != "spring" or len(self.known.links) > _MOST_COILS:
            return None
        start, end = (self.at(self.known.places[0, end]) for end in link.ends)
        return shapes.coils(float(np.linalg.norm(end - start)))

    def at_configuration(self, number: int) -> DrawnConfiguration:
        """Draw the links and bodies of one configuration."""
        places = self.at(self.known.places[number])
        strokes: list[tuple[StrokeKind, Array]] = []
        for link, turns in zip(self.known.links, self.turns, strict=True):
            start, end = places[link.ends[0]], places[link.ends[1]]
            strokes += [(link.kind, line) for line in self._lines(link, turns, start, end)]
        strokes += [(kind, self.at(line)) for kind, line in self._shapes(number)]
        for wheel in self.wheels:
            strokes += self._rim(wheel, number)
        return DrawnConfiguration(tuple(strokes), places[: self.known.configurations.particles])

    def _shapes(self, number: int) -> Iterator[tuple[StrokeKind, Array]]:
        """Yield the lines of rigid bodies in space at a configuration."""
        known = self.known.configurations
        for outline in self._outlines.at(known.q[number], float(known.times[number])):
            if outline.particle not in self._rolling:
                centre = self.known.places[number, outline.particle]
                yield from outline.lines(centre, self.view.matrix)

    def _lines(self, link: Link, turns: int | None, start: Array, end: Array) -> list[Array]:
        if turns is not None:
            return [shapes.coiled(start, end, turns)]
        has_few_links = len(self.known.links) <= _MOST_COILS
        if link.kind == "damper" and has_few_links:
            return shapes.damper(start, end)
        return [np.array([start, end])]

    def _rim(self, wheel: Wheel, number: int) -> list[tuple[StrokeKind, Array]]:
        """Draw a wheel, with a spoke where its angle is a coordinate."""
        centre = self.known.places[number, wheel.particle]
        angles = self._angles(wheel)
        if angles is None:
            return [("wheel", self.at(wheel.rim(centre, _ROUND)))]
        headed = self._headed(wheel, angles, number)
        spoke = np.stack([centre, *headed.rim(centre, angles[number : number + 1])])
        return [("wheel", self.at(headed.rim(centre, _ROUND))), ("wheel", self.at(spoke))]

    def _angles(self, wheel: Wheel) -> Array | None:
        """Return the angle of a wheel at all configurations, None if it is no coordinate."""
        configurations = self.known.configurations
        names = [c.name for c in configurations.equations.system.coordinates]
        return configurations.q[:, names.index(wheel.name)] if wheel.name in names else None

    def _headed(self, wheel: Wheel, angles: Array, number: int) -> Wheel:
        """Return a wheel as it heads at a configuration: a disk on a plane turns about its normal.

        Its heading is that between the neighbours of the configuration.
        """
        before, after = max(1, number - 1), min(self.count - 1, number + 1)
        if wheel.ground is not None or before >= after:
            return wheel
        places = self.known.places[:, wheel.particle]
        way = places[after] - places[before]
        way = way - (way @ wheel.normal) * wheel.normal
        length, turn = float(np.linalg.norm(way)), float(angles[after] - angles[before])
        if length <= 1e-9 * wheel.radius or turn == 0:
            return wheel
        return replace(wheel, towards=np.sign(turn) * way / length)

    def still(self, curves: Sequence[Guide]) -> tuple[tuple[StrokeKind, Array], ...]:
        """Draw the ground of fixed pivots, and curves of constraints on single particles."""
        known = self.known
        strokes: list[tuple[StrokeKind, Array]] = []
        ends = {end for k in known.links if k.kind not in ("radius", "rope") for end in k.ends}
        for body in sorted(ends):
            if body >= known.configurations.particles and known.is_fixed(body):
                at = self.at(known.places[0, body])
                ground = at + np.array([[-_GROUND, 0.0], [_GROUND, 0.0]])
                ticks = shapes.hatching(ground, left=self._hangs(body))
                strokes += [("ground", line) for line in (ground, *ticks)]
        for guide in curves:
            strokes.append(("curve", self.at(guide.curve.points)))
        for wheel in self.wheels:
            if wheel.ground is not None:
                strokes.append(("ground", self.at(self._reached(wheel))))
        return tuple(strokes)

    def _reached(self, wheel: Wheel) -> Array:
        """Return the ground of a wheel, a straight one as far as the wheel goes."""
        assert wheel.ground is not None
        if len(wheel.ground) > 2:
            return wheel.ground
        gone = (
            self.known.places[: self.count, wheel.particle] - self.known.places[0, wheel.particle]
        )
        ways = gone @ wheel.towards
        first, last = wheel.ground
        return np.array([first + ways.min() * wheel.towards, last + ways.max() * wheel.towards])

    def _hangs(self, body: int) -> bool:
        """Tell whether what a pivot holds is below it."""
        linked = [k.ends for k in self.known.links if body in k.ends]
        rest_place = self.at(self.known.places[0])
        return (
            sum(
                float(rest_place[a if b == body else b][1] - rest_place[body][1]) for a, b in linked
            )
            <= 0
        )
