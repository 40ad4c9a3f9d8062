"""Lines and bodies of a sketch at other configurations than the start: shapes of modes.

Links are found once, at all configurations that are drawn, and then drawn at each of them; curves
that hold particles stay where they are. A system that goes much farther than it is large is
followed: marks on its floor show that it moves.
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

#: How many times its size a system may go in a film that does not follow it (as on pages).
_FAR = 6

#: Marks of a floor along and across it from the one nearest to the system, and their distance and
#: length over the size of the system.
_MARKS, _APART, _MARK = (3, 1), 0.4, 0.1

#: Part of the size of a system by which its lowest place may change on a floor.
_LEVEL = 0.02

#: Radii of particles in centimetres, and their part of the distance of neighbours.
_LEAST_BODY, BODY, _OF_DISTANCE = 0.035, 0.1, 0.15


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
    radius
        That of a particle, in centimetres: the closer particles are, the smaller.
    """

    at_rest: DrawnConfiguration
    still: tuple[tuple[StrokeKind, Array], ...]
    moved: tuple[DrawnConfiguration, ...]
    is_line: bool
    radius: float = BODY


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
        rims = [wheel.rim(known.places[0, wheel.particle], _ROUND) for wheel in self._wheels]
        self._view = view_of(known.configurations, down, *rims, *self._outlines.shown())
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
        return DisplacedSketch(
            states[0], still, tuple(states[1:]), drawing.is_line, drawing.radius()
        )

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
        seen = [view.project(self._reach(k)) for k in range(fitted)]
        low, high = (np.array([f(places, axis=0) for places in seen]) for f in (np.min, np.max))
        extent = float((high.max(axis=0) - low.min(axis=0)).max())
        self._size = float((high - low).max())
        self._is_following = extent > _FAR * self._size > 0
        self.middles = (low + high) / 2
        if not self._is_following:
            self.middles = np.tile((low.min(axis=0) + high.max(axis=0)) / 2, (count, 1))
        self.scale = _EXTENT / (
            2 * self._size if self._is_following else extent or frame_of(known).size
        )
        spread = np.ptp(flat.reshape(-1, 2), axis=0) * self.scale
        self.is_line = bool(spread.min() < 1e-6) and not wheels and not outlines.bodies
        self.turns = [self._turns(link) for link in known.links]
        self._floor = self._floor_below() if self._is_following else None

    def _reach(self, number: int) -> Array:
        """Return places that a picture of a configuration has to hold, shape (P, 3)."""
        places = self.known.places[number]
        rims = (wheel.rim(places[wheel.particle], _ROUND) for wheel in self.wheels)
        lines = (line for _, line in self._shapes(number))
        return np.concatenate([places, *rims, *lines])

    def at(self, places: Array, number: int = 0) -> Array:
        """Return places of space in centimetres of the picture of a configuration."""
        placed: Array = (self.view.project(places) - self.middles[number]) * self.scale
        return placed

    def radius(self) -> float:
        """Return the radius of particles at rest, which leaves neighbours apart."""
        places = self.known.places[0, : self.known.configurations.particles]
        if len(places) < 2:
            return BODY
        across = np.linalg.norm(places[:, None] - places[None], axis=2)
        np.fill_diagonal(across, np.inf)
        near = self.scale * float(np.median(across.min(axis=0)))
        return float(np.clip(_OF_DISTANCE * near, _LEAST_BODY, BODY)) if near > 0 else BODY

    def _turns(self, link: Link) -> int | None:
        """Return the number of coils of a spring at rest; None of other links."""
        if link.kind != "spring" or len(self.known.links) > _MOST_COILS:
            return None
        start, end = (self.at(self.known.places[0, end]) for end in link.ends)
        return shapes.coils(float(np.linalg.norm(end - start)))

    def at_configuration(self, number: int) -> DrawnConfiguration:
        """Draw the links and bodies of one configuration."""
        places = self.at(self.known.places[number], number)
        strokes: list[tuple[StrokeKind, Array]] = []
        strokes += [("ground", self.at(mark, number)) for mark in self._marks(number)]
        for link, turns in zip(self.known.links, self.turns, strict=True):
            start, end = places[link.ends[0]], places[link.ends[1]]
            if link.length is not None:
                slack = self.scale * self.known.slack(link, number)
                strokes.append((link.kind, shapes.rope(start, end, slack)))
                continue
            strokes += [(link.kind, line) for line in self._lines(link, turns, start, end)]
        strokes += [(kind, self.at(line, number)) for kind, line in self._shapes(number)]
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
            return [("wheel", self.at(wheel.rim(centre, _ROUND), number))]
        headed = self._headed(wheel, angles, number)
        spoke = np.stack([centre, *headed.rim(centre, angles[number : number + 1])])
        lines = (headed.rim(centre, _ROUND), spoke)
        return [("wheel", self.at(line, number)) for line in lines]

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
        if self._is_following:
            return ()
        known = self.known
        strokes: list[tuple[StrokeKind, Array]] = []
        ends = {end for k in known.links if k.has_support for end in k.ends}
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

    def _floor_below(self) -> Array:
        """Return a place of the floor of a system that is followed, and two directions along it.

        The floor is below a wheel, or level where the lowest place is in all configurations; else
        it is the plane of the picture. Shape (3, 3).
        """
        right, up = self.view.matrix
        wheel = next((w for w in self.wheels if w.ground is not None), None)
        if wheel is not None:
            contact = self.known.places[0, wheel.particle] - wheel.radius * wheel.normal
            return np.array([contact, wheel.towards, np.cross(wheel.normal, wheel.towards)])
        upright = up * (np.abs(right) < 1e-12)
        lowest = [float((self._reach(k) @ upright).min()) for k in range(self.count)]
        right = right * (np.abs(up) < 1e-12)
        if np.ptp(lowest) > _LEVEL * self._size:
            return np.array([self.known.places[0, 0], right, up / np.linalg.norm(up)])
        return np.array([lowest[0] * upright, right, np.cross(upright, right)])

    def _marks(self, number: int) -> Iterator[Array]:
        """Yield the floor near the system in a configuration: its line, and marks on it."""
        if self._floor is None:
            return
        place, *ways = self._floor
        apart = _APART * self._size
        off = self.known.places[number, 0] - place
        near = [round(float(off @ way) / apart) for way in ways]
        half = _MARK * self._size / 2 * ways[0]
        if any(wheel.ground is not None for wheel in self.wheels):
            below = place + (off @ ways[0]) * ways[0]
            yield np.array([below - self._size * ways[0], below + self._size * ways[0]])
        for along in range(-_MARKS[0], _MARKS[0] + 1):
            for across in range(-_MARKS[1], _MARKS[1] + 1):
                numbers = near[0] + along, near[1] + across
                mark = place + apart * sum(k * way for k, way in zip(numbers, ways, strict=True))
                yield np.array([mark - half, mark + half])

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
