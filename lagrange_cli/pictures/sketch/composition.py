"""A sketch of a system at its start: what was found of it, laid out in centimetres."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.pictures.sketch import labels, shapes
from lagrange_cli.pictures.sketch.configurations import Configurations
from lagrange_cli.pictures.sketch.findings import Angle, Findings, Link
from lagrange_cli.pictures.sketch.guides import Frame, Guide, frame_of
from lagrange_cli.pictures.sketch.labels import Placer, half_size
from lagrange_cli.pictures.sketch.links import parts_of
from lagrange_cli.pictures.sketch.outlines import DrawnOutline
from lagrange_cli.pictures.sketch.sketch import (
    Caption,
    Dot,
    DotKind,
    Label,
    Place,
    Sketch,
    Stroke,
    StrokeKind,
)
from lagrange_cli.pictures.sketch.view import View
from lagrange_cli.pictures.sketch.wheels import Wheel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.mechanics.equations import Equations

    Array: TypeAlias = NDArray[np.float64]

#: Largest extent of the bodies and curves of a picture, in centimetres.
_EXTENT = 5.5
#: Most particles with labels, links with coils, and supports with triangles.
_MOST_LABELS, _MOST_COILS, _MOST_SUPPORTS = 8, 40, 4
#: Smallest angle that has an arc.
_LEAST_ANGLE = 0.05
#: Smallest radius of a wheel whose angle has an arc, in centimetres.
_LEAST_WHEEL = 0.7
_AXIS, _ARROW = 0.75, 0.95
_MOST_VALUES = 8
#: Angles of a rim.
_ROUND = np.linspace(0, 2 * np.pi, 73)


def sketch_of(equations: Equations) -> Sketch:
    """Draw a system at its start.

    Raises
    ------
    InputError
        There are no particles, too many bodies, or no configuration that could be drawn.
    """
    parts = parts_of(equations)
    on_curves = {guide.particle for guide in parts.curves if guide.outside is None}
    known = parts.known
    known.links[:] = [_demoted(link, on_curves) for link in known.links]
    frame = frame_of(known)
    rolling = {wheel.particle for wheel in parts.wheels}
    start = parts.outlines.at(known.configurations.q[0], float(known.configurations.times[0]))
    outlines = [outline for outline in start if outline.particle not in rolling]
    drawing = _Drawing(known, parts.view, frame, parts.curves, parts.down, parts.wheels, outlines)
    return drawing.sketch()


def _demoted(link: Link, on_curves: set[int]) -> Link:
    """Return a line of constant length to a particle that a curve holds is no rod."""
    if link.kind == "rod" and not link.stated and link.ends[1] in on_curves:
        return Link("radius", link.ends)
    return link


@dataclass
class _Drawing:
    """A sketch in the making.

    Attributes
    ----------
    known, view, frame, curves, down, wheels, outlines
        What is drawn, and how it is seen; the direction of gravity, None without it.
    strokes, dots, labels
        What has been drawn.
    placer
        Where labels may stand.
    """

    known: Findings
    view: View
    frame: Frame
    curves: list[Guide]
    down: Array | None
    wheels: list[Wheel]
    outlines: list[DrawnOutline]
    strokes: list[Stroke] = field(default_factory=list)
    dots: list[Dot] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)
    placer: Placer = field(default_factory=Placer)
    _wanted: list[tuple[Array, float, Caption, Array | None]] = field(default_factory=list)

    def __post_init__(self) -> None:
        shown = [self.known.places[0], *(guide.curve.points for guide in self.curves)]
        for wheel in self.wheels:
            shown.append(wheel.rim(self.known.places[0, wheel.particle], _ROUND))
            shown += [] if wheel.ground is None else [wheel.ground]
        shown += [line for _, _, line in self._outlines()]
        if not np.ptp(self.known.places[0], axis=0).max() > 0:
            shown.append(np.stack([self.frame.low, self.frame.high]))
        flat = self.view.project(np.concatenate(shown))
        self._middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
        extent = float(np.ptp(flat, axis=0).max())
        self.scale = _EXTENT / (extent or self.frame.size)

    def sketch(self) -> Sketch:
        """Draw everything, labels last."""
        self._draw_curves()
        self._draw_wheels()
        for kind, name, line in self._outlines():
            self.stroke(kind, _thinned(self.at(line)), name)
        self._draw_links()
        self._draw_angles()
        self._draw_bodies()
        self._draw_forces()
        self._place_labels()
        low, high = self._bounds()
        self._draw_directions(low, high)
        self._place_labels()
        low, high = self._bounds()
        equations = self.known.configurations.equations
        return Sketch(
            equations.presentation.name,
            equations.presentation.title,
            tuple(self._remarks()),
            tuple(self.strokes),
            tuple(self.dots),
            tuple(self.labels),
            _place(low - 0.15),
            _place(high + 0.15),
        )

    def _outlines(self) -> Iterator[tuple[StrokeKind, str, Array]]:
        """Yield the lines of rigid bodies in space, with the name of the body."""
        for outline in self.outlines:
            centre = self.known.places[0, outline.particle]
            for kind, line in outline.lines(centre, self.view.matrix):
                yield kind, self.known.names[outline.particle], line

    # -- parts --------------------------------------------------------------------

    def at(self, places: Array) -> Array:
        """Return places of space in centimetres of the picture."""
        placed: Array = (self.view.project(places) - self._middle) * self.scale
        return placed

    def body(self, number: int) -> Array:
        return self.at(self.known.places[0, number])

    def stroke(self, kind: StrokeKind, line: Array, name: str = "", closed: bool = False) -> None:
        points = [_place(point) for point in line]
        if closed:
            points.pop()
        if len(set(points)) > 1:
            self.strokes.append(Stroke(kind, tuple(points), closed, name))
            self.placer.avoid(line)

    def label(
        self, caption: Caption, at: Array, clearance: float, towards: Array | None = None
    ) -> None:
        """Ask for a label; it is placed when everything is drawn."""
        self._wanted.append((at, clearance, caption, towards))

    def _place_labels(self) -> None:
        for at, clearance, caption, towards in self._wanted:
            centre = self.placer.around(at, caption.plain, clearance, towards)
            self.labels.append(Label(caption, _place(centre)))
        self._wanted.clear()

    def _draw_curves(self) -> None:
        for guide in self.curves:
            line = _thinned(self.at(guide.curve.points))
            self.stroke("curve", line, guide.name, guide.curve.closed)
            if guide.outside is not None:
                for tick in self._ticks(guide, line):
                    self.stroke("hatch", tick, guide.name)

    def _ticks(self, guide: Guide, line: Array) -> list[Array]:
        """Ticks on the side of a boundary on which its particle cannot be."""
        assert guide.outside is not None
        start = self.at(self.known.places[0, guide.particle])
        k = int(np.linalg.norm(line[:-1] - start, axis=1).argmin())
        along, outside = line[k + 1] - line[k], self.view.project(guide.outside)
        return shapes.hatching(line, left=float(shapes.across(along) @ outside) > 0)

    def _draw_wheels(self) -> None:
        """Draw each wheel with a spoke, its angle from the place that touches the ground."""
        for wheel in self.wheels:
            centre = self.known.places[0, wheel.particle]
            self.stroke("wheel", self.at(wheel.rim(centre, _ROUND)), wheel.name, closed=True)
            if wheel.ground is not None:
                self._draw_ground(wheel)
            spoke = self.at(np.stack([centre, *wheel.rim(centre, np.array([wheel.angle]))]))
            self.stroke("wheel", spoke, wheel.name)
            size = labels.symbol_caption(self.known.configurations.equations, wheel.size)
            self.label(size, spoke.mean(axis=0), 0.0)
            turn = float(np.fmod(wheel.angle, 2 * np.pi))
            if abs(turn) >= _LEAST_ANGLE and wheel.radius * self.scale >= _LEAST_WHEEL:
                start = self.at(wheel.rim(centre, np.zeros(1)))
                self.stroke("reference", np.stack([spoke[0], *start]))
                turns = np.linspace(0, turn, max(8, int(abs(turn) / 0.08)))
                arc = spoke[0] + 0.45 * (self.at(wheel.rim(centre, turns)) - spoke[0])
                self.stroke("angle", arc, wheel.name)
                middle = arc[len(arc) // 2]
                self.label(labels.named(wheel.name), middle, 0.0, _unit(middle - spoke[0]))

    def _draw_ground(self, wheel: Wheel) -> None:
        assert wheel.ground is not None
        line = self.at(wheel.ground)
        if len(line) > 2:
            closed = float(np.linalg.norm(line[-1] - line[0])) < 1e-6
            self.stroke("curve", _thinned(line), wheel.name, closed)
            return
        self.stroke("ground", line, wheel.name)
        above = float(shapes.across(line[1] - line[0]) @ self.view.project(wheel.normal)) > 0
        for tick in shapes.hatching(line, left=not above):
            self.stroke("ground", tick, wheel.name)

    def _draw_links(self) -> None:
        pairs = [frozenset(link.ends) for link in self.known.links]
        sizes = [link.size for link in self.known.links]
        for number, link in enumerate(self.known.links):
            start, end = (self.body(end) for end in link.ends)
            length = float(np.linalg.norm(end - start))
            if length < 1e-6:
                continue
            side = shapes.across((end - start) / length)
            alike = [k for k, pair in enumerate(pairs) if pair == pairs[number]]
            shift = 0.34 * (alike.index(number) - (len(alike) - 1) / 2) * side
            name = "-".join(self.known.names[end] or "pivot" for end in link.ends)
            for line in self._link_lines(link, start + shift, end + shift):
                self.stroke(link.kind, line, name)
            if link.size is not None and (sizes.count(link.size) == 1 or number == 0):
                caption = labels.symbol_caption(self.known.configurations.equations, link.size)
                clearance = 0.0 if link.kind == "rod" else 0.1
                self.label(caption, (start + end) / 2 + shift, clearance)

    def _link_lines(self, link: Link, start: Array, end: Array) -> list[Array]:
        if len(self.known.links) <= _MOST_COILS and link.kind == "spring":
            return [shapes.spring(start, end)]
        if len(self.known.links) <= _MOST_COILS and link.kind == "damper":
            return shapes.damper(start, end)
        slack = self.scale * self.known.slack(link, 0)
        if slack > 0:
            return [shapes.rope(start, end, slack)]
        return [np.array([start, end])]

    def _draw_angles(self) -> None:
        vertices: dict[int, int] = {}
        for angle in self.known.angles:
            count = vertices.get(angle.ends[0], 0)
            if self._draw_angle(angle, count):
                vertices[angle.ends[0]] = count + 1

    def _draw_angle(self, angle: Angle, count: int) -> bool:
        """Draw an angle from its reference; ``count`` others stand at the same vertex."""
        value = float(np.fmod(angle.value, 2 * np.pi))
        vertex, tip = (self.known.places[0, end] for end in angle.ends)
        foot = vertex + _projection(tip - vertex, angle)
        length = float(np.linalg.norm(self.at(foot) - self.at(vertex)))
        if abs(value) < _LEAST_ANGLE or length < 0.3:
            return False
        coordinate = self.known.configurations.equations.system.coordinates[angle.coordinate]
        radius = min(0.95, 0.5 * length) + 0.22 * count
        turns = np.linspace(0, value, max(8, int(abs(value) / 0.08)))[:, None]
        arms = np.cos(turns) * angle.reference + np.sin(turns) * angle.towards
        arc = self.at(vertex + radius / self.scale * arms)
        start = self.at(vertex)
        reach = max(1.35 * radius, min(length, 1.6))
        self.stroke("reference", np.array([start, start + reach * _unit(arc[0] - start)]))
        if angle.projected:
            self.stroke("reference", np.array([start, self.at(foot)]))
            self.stroke("reference", np.array([self.at(foot), self.at(tip)]))
        self.stroke("angle", arc, coordinate.name)
        middle = arc[len(arc) // 2]
        caption = labels.named(coordinate.name, coordinate.latex)
        self.label(caption, middle, 0.0, _unit(middle - start))
        return True

    def _draw_bodies(self) -> None:
        known = self.known
        particles = known.configurations.particles
        radius = 0.09 if particles <= _MOST_LABELS else 0.06 if particles <= 60 else 0.035
        ends = {end for link in known.links for end in link.ends}
        held_ends = {end for k in known.links if k.has_support for end in k.ends}
        supports = [k for k in range(particles, len(known.names)) if known.is_fixed(k)]
        for number in range(particles, len(known.names)):
            at = self.body(number)
            guided = number not in held_ends and any(
                k.kind == "rope" and number in k.ends for k in known.links
            )
            if number not in supports or guided:
                self._dot("joint", at, 0.06, known.names[number])
            elif number in held_ends:
                self._draw_support(at, number, len([k for k in supports if k in held_ends]))
            elif number in ends or number < known.declared:
                self._dot("origin", at, 0.04, known.names[number])
                if known.names[number]:
                    caption = labels.point_caption(known.configurations, known.names[number])
                    self.label(caption, at, 0.04)
        names = labels.particle_captions(known.configurations.equations)
        for number in range(particles):
            at = self.body(number)
            self._dot("mass", at, radius, known.names[number])
            if particles <= _MOST_LABELS:
                self.label(names[number], at, radius)

    def _draw_forces(self) -> None:
        """Draw an arrow for each force on a body, as it is at the start."""
        numbers = {name: number for number, name in enumerate(self.known.names)}
        for force, pull in self.known.configurations.pulls():
            seen = self.view.project(pull)
            if np.linalg.norm(seen) > 1e-6 * np.linalg.norm(pull):
                start, along = self.body(numbers[force.on]), _unit(seen)
                pushes = self._lies_on_a_link(numbers[force.on], along)
                if pushes:
                    start = start - (_ARROW + 0.12) * along
                tip = start + _ARROW * along
                self.stroke("force", np.array([start, tip]), force.name)
                caption = labels.force_caption(self.known.configurations.equations, force)
                self.label(caption, start if pushes else tip, 0.0, -along if pushes else along)

    def _lies_on_a_link(self, number: int, along: Array) -> bool:
        """Tell whether a link goes from a body in a direction: a force pushes against it there."""
        others = [{*k.ends} - {number} for k in self.known.links if number in k.ends]
        ways = [self.body(*ends) - self.body(number) for ends in others if len(ends) == 1]
        return any(float(_unit(way) @ along) > 0.97 for way in ways)

    def _dot(self, kind: DotKind, at: Array, radius: float, name: str) -> None:
        self.dots.append(Dot(kind, _place(at), radius, name))
        self.placer.avoid(np.array([at - 0.6 * radius, at + 0.6 * radius]))

    def _draw_support(self, at: Array, number: int, count: int) -> None:
        """Draw the ground of a fixed pivot, on the side away from what it holds."""
        name = self.known.names[number]
        if count > _MOST_SUPPORTS:
            lines = shapes.fastening(at)
        else:
            held_links = [k.ends for k in self.known.links if number in k.ends]
            others = [self.body(a if b == number else b) for a, b in held_links]
            below = sum(float(end[1] - at[1]) for end in others) < 0
            lines = shapes.hanger(at) if below else shapes.support(at)
        for line in lines:
            self.stroke("ground", line, name)

    def _draw_directions(self, low: Array, high: Array) -> None:
        """Draw the axes beside everything, and the direction of gravity."""
        names = "xyz"
        arms = {axis: _AXIS * self.view.matrix[:, axis] for axis in self.view.axes}
        least = np.minimum(np.min(list(arms.values()), axis=0), 0)
        corner = np.array([low[0] - 0.95 - _AXIS, low[1] + 0.1]) - least
        for axis, arm in arms.items():
            self.stroke("axis", np.array([corner, corner + arm]), names[axis])
            caption = Caption(names[axis], names[axis])
            self.label(caption, corner + arm, 0.0, _unit(arm))
        if self.down is None:
            return
        fall = self.view.project(self.down)
        if np.linalg.norm(fall) > 1e-6:
            start = np.array([high[0] + 0.55, high[1]])
            arrow = np.array([start, start + _ARROW * _unit(fall)])
            self.stroke("gravity", arrow, "gravity")
            weight = labels.gravity_caption(self.known.configurations, self.down)
            if weight is not None:
                self.label(weight, arrow.mean(axis=0), 0.05, np.array([1.0, 0.0]))

    # -- the whole ----------------------------------------------------------------

    def _bounds(self) -> tuple[Array, Array]:
        places = [np.array(stroke.points) for stroke in self.strokes]
        for dot in self.dots:
            places += [np.array([dot.at]) - dot.radius, np.array([dot.at]) + dot.radius]
        for label in self.labels:
            half = half_size(label.caption.plain)
            places += [np.array([label.at]) - half, np.array([label.at]) + half]
        together = np.concatenate(places)
        return together.min(axis=0), together.max(axis=0)

    def _remarks(self) -> Iterator[str]:
        known: Configurations = self.known.configurations
        values = [(c.name, known.q[0][k]) for k, c in enumerate(known.equations.system.coordinates)]
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in values[:_MOST_VALUES])
        more = ", ..." if len(values) > _MOST_VALUES else ""
        if known.is_given:
            yield f"the start, t = {known.times[0]:.6g}: {shown}{more}"
            return
        yield "the scene gives no start: a configuration that its constraints allow"
        yield f"{shown}{more}"
        chosen = ", ".join(f"{s.name} = {v:.6g}" for s, v in list(known.values.items()))
        if chosen:
            yield f"parameters: {chosen}"


def _projection(along: Array, angle: Angle) -> Array:
    """Return the part of a line in the plane of its angle."""
    return (along @ angle.reference) * angle.reference + (along @ angle.towards) * angle.towards


def _unit(arrow: Array) -> Array:
    length = float(np.linalg.norm(arrow))
    return arrow / length if length > 0 else np.array([1.0, 0.0])


def _place(point: Array) -> Place:
    """Return a place with thousandths of a centimetre, without negative zeros."""
    x, y = (round(float(value), 3) + 0.0 for value in point)
    return x, y


def _thinned(line: Array) -> Array:
    """Return a polyline without points that lie on the line between their neighbours."""
    kept_points = [line[0]]
    for k in range(1, len(line) - 1):
        chord = line[k + 1] - kept_points[-1]
        length = float(np.linalg.norm(chord))
        off = abs(float(shapes.across(chord) @ (line[k] - kept_points[-1])))
        if (
            length == 0
            or off > 4e-4 * length
            or float(np.linalg.norm(line[k] - kept_points[-1])) > 1.5
        ):
            kept_points.append(line[k])
    return np.array([*kept_points, line[-1]])
