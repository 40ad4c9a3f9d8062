"""Placed robot → the YAML of a scene, as a person writes it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal

from lagrange_cli.robots.names import identifier
from lagrange_cli.robots.placing import BODY_SUFFIX, PlacedFrame, PlacedRobot
from lagrange_cli.robots.poses import FreeTurn, Pose, times
from lagrange_cli.robots.quantities import ConstantTurn, Vector, number_text
from lagrange_cli.robots.robot import Inertial, Joint, Robot

#: Widest line of a mapping within braces.
_WIDEST = 118

#: The usual acceleration of gravity, where a file has none.
_GRAVITY = Decimal("9.81")

_SIMPLE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_ -.")


@dataclass(frozen=True)
class SceneOptions:
    """Wishes for a scene.

    Attributes
    ----------
    limits
        True if limits of joints are one-sided constraints.
    source
        Name of the file, which the first line tells.
    stem
        Name of the scene where the robot has none.
    """

    limits: bool
    source: str
    stem: str


def scene_text(robot: Robot, placed: PlacedRobot, options: SceneOptions) -> str:
    """Return the text of a scene."""
    return "\n".join(_Writer(robot, placed, options).lines()) + "\n"


class _Writer:
    def __init__(self, robot: Robot, placed: PlacedRobot, options: SceneOptions) -> None:
        self.robot, self.placed, self.options = robot, placed, options
        self.parameters: list[tuple[str, str]] = []
        self.joints = [
            joint for joint in robot.joints if joint.name in placed.expressions
        ]  # those with one coordinate

    def lines(self) -> Iterator[str]:
        bodies = list(self._bodies())
        laws = [line for lines in self._laws() for line in lines]
        gravity = list(self._gravity())
        name = identifier(self.robot.name) or identifier(self.options.stem) or "robot"
        yield f"# Imported from {_comment(self.options.source)}."
        yield f"name: {name}"
        yield f"title: {_quoted(self.robot.name or name)}"
        yield "parameters:"
        yield from (f"  {key}: {value}" for key, value in self.parameters)
        yield from laws[: self._inputs]
        yield from bodies
        yield from self._points()
        yield "coordinates:"
        for c in self.placed.coordinates:
            unit = "" if c.unit is None else f"unit: {c.unit}, "
            yield f"  {c.name}: {{{unit}description: {_quoted(c.description)}}}"
        yield from gravity
        yield from laws[self._inputs :]
        yield from self._limits()
        yield from self._start()

    # -- bodies ---------------------------------------------------------------------------

    def _bodies(self) -> Iterator[str]:
        frames = [f for f in self.placed.frames if f.inertial is None]
        if frames:
            yield "frames:"
            for frame in frames:
                yield from _entry(frame.name, list(_placing(frame)))
        yield "bodies:"
        for frame in self.placed.frames:
            if frame.inertial is not None:
                suffix = frame.name.removesuffix(BODY_SUFFIX)
                mass = self._parameter(
                    "m", suffix, frame.inertial.mass, "kg", f"mass of {frame.link}"
                )
                yield from _entry(frame.name, [*_placing(frame), *_inertia(frame.inertial, mass)])

    def _parameter(self, stem: str, suffix: str, value: Decimal, unit: str, what: str) -> str:
        name = self.placed.names.take(_suffixed(stem, suffix))
        text = f"{{value: {number_text(value)}, unit: {unit}, description: {_quoted(what)}}}"
        self.parameters.append((name, text))
        return name

    def _points(self) -> Iterator[str]:
        if self.placed.points:
            yield "points:"
        for point in self.placed.points:
            at = f", at: {_vector(point.at)}" if any(point.at) else ""
            yield f"  {point.name}: {{on: {point.on}{at}}}"

    # -- laws -----------------------------------------------------------------------------

    def _laws(self) -> tuple[list[str], ...]:
        """Return inputs, kinetic energies, dissipation and forces of joints."""
        inputs, forces = self._drives()
        self._inputs = len(inputs)
        kinetic = self._terms("kinetic", "armature", self._armature)
        springs = self._springs()
        damping = self._terms("dissipation", "damping", self._damping)
        self._spring_lines = springs
        forces = [*forces, *self._friction()]
        return inputs, kinetic, damping, (["forces:", *forces] if forces else [])

    def _drives(self) -> tuple[list[str], list[str]]:
        inputs, forces = list[str](), list[str]()
        for joint in self.joints:
            if joint.is_driven:
                q = self.placed.expressions[joint.name]
                stem = "tau" if joint.kind == "hinge" else "F"
                u = self.placed.names.take(_suffixed(stem, q))
                inputs.append(f"  {u}: 0")
                forces.append(f"  {self._force('drive', q)}: {{on: {q}, force: {u}}}")
        for drive in self.robot.drives:
            if drive.joint in self.placed.expressions:
                q = self.placed.expressions[drive.joint]
                wanted = identifier(drive.name)
                is_free = wanted != "" and self.placed.names.is_free(wanted)
                u = self.placed.names.take(wanted if is_free else _suffixed("u", q))
                inputs.append(f"  {u}: 0")
                force = drive.force.format(q=q, u=u)
                forces.append(f"  {self._force('drive', q)}: {{on: {q}, force: {force}}}")
        return (["inputs:", *inputs] if inputs else []), forces

    def _force(self, stem: str, suffix: str) -> str:
        return self.placed.names.take(_suffixed(stem, suffix))

    def _friction(self) -> list[str]:
        lines = []
        for joint, f in self._shared("friction", "f", "dry friction", ("N*m", "N")):
            q = self.placed.expressions[joint.name]
            name = self._force("friction", q)
            lines.append(f"  {name}: {{on: {q}, force: -{f}*sign(dot({q}))}}")
        return lines

    def _terms(
        self, section: str, name: str, laws: Callable[[], Iterable[tuple[str, str]]]
    ) -> list[str]:
        """Write a section with one term: half of the sum of parameters times squares of rates."""
        by_parameter: dict[str, list[str]] = {}
        for parameter, q in laws():
            by_parameter.setdefault(parameter, []).append(_squared_rate(q))
        if not by_parameter:
            return []
        parts = [
            f"{p}/2*{squares[0]}" if len(squares) == 1 else f"{p}/2*({' + '.join(squares)})"
            for p, squares in by_parameter.items()
        ]
        return [f"{section}:", f"  {name}: {' + '.join(parts)}"]

    def _armature(self) -> Iterator[tuple[str, str]]:
        units = ("kg*m^2", "kg")
        for joint, a in self._shared("armature", "a", "inertia of the rotor", units):
            yield a, self.placed.expressions[joint.name]

    def _damping(self) -> Iterator[tuple[str, str]]:
        for joint, d in self._shared("damping", "d", "damping", ("N*m*s", "N*s/m")):
            yield d, self.placed.expressions[joint.name]

    def _shared(
        self, quantity: str, stem: str, what: str, units: tuple[str, str]
    ) -> Iterator[tuple[Joint, str]]:
        """Return joints that have a quantity with its parameter, one for joints that are alike."""
        having: list[Joint] = [j for j in self.joints if getattr(j, quantity) > 0]
        for kind, unit in zip(("hinge", "slide"), units, strict=True):
            alike = [j for j in having if j.kind == kind]
            values = [getattr(j, quantity) for j in alike]
            if len(alike) > 1 and len(set(values)) == 1:
                described = f"{what} of each of {len(alike)} joints"
                common = self._parameter(stem, "", values[0], unit, described)
                yield from ((joint, common) for joint in alike)
                continue
            for joint, value in zip(alike, values, strict=True):
                suffix = self._coordinate(joint)
                yield joint, self._parameter(stem, suffix, value, unit, f"{what} of {joint.name}")

    def _coordinate(self, joint: Joint) -> str:
        q = self.placed.expressions[joint.name]
        return q if joint.follows is None else identifier(joint.name)

    def _springs(self) -> list[str]:
        lines = []
        for joint, k in self._shared("stiffness", "k", "stiffness", ("N*m", "N/m")):
            q = self.placed.expressions[joint.name]
            stretch = f"{q} - {joint.spring_rest}" if joint.spring_rest != "0" else q
            stretch = stretch.replace("- -", "+ ")
            inner = stretch if stretch.isidentifier() else f"({stretch})"
            lines.append(f"  {_suffixed('spring', self._coordinate(joint))}: {k}/2*{inner}^2")
        return lines

    def _gravity(self) -> Iterator[str]:
        gravity = self.robot.gravity
        weight: list[str] = []
        if gravity is None or any(gravity):
            direction = ""
            size = _GRAVITY
            if gravity is not None:
                x, y, z = gravity
                size = (x * x + y * y + z * z).sqrt()
                if x or y or z > 0:
                    direction = f", direction: {_vector(gravity)}"
            what = "gravitational acceleration"
            text = f"{{value: {number_text(size)}, unit: m/s^2, description: {what}}}"
            self.parameters.append(("g", text))
            weight = [f"  weight: {{gravity: g{direction}}}"]
        if weight or self._spring_lines:
            yield "potentials:"
            yield from (*weight, *self._spring_lines)

    # -- the rest -------------------------------------------------------------------------

    def _limits(self) -> Iterator[str]:
        if not self.options.limits:
            return
        lines = []
        for joint in self.joints:
            q = self.placed.expressions[joint.name]
            for end, relation in ((joint.lower, ">="), (joint.upper, "<=")):
                if end is not None:
                    name = self._force(
                        "lower" if relation == ">=" else "upper", self._coordinate(joint)
                    )
                    lines.append(f"  {name}: {q} {relation} {end}")
        if lines:
            yield "constraints:"
            yield from lines

    def _start(self) -> Iterator[str]:
        values = [f"{c.name}: {c.start}" for c in self.placed.coordinates]
        yield from _flow("initial", values)
        yield "simulate: {until: 2, accuracy: 1e-9, samples: 101}"
        # Of the four parts of a quaternion three are free.
        free = {j.name for c in self.placed.coordinates if (j := c.joint).kind in ("free", "ball")}
        yield f"expect: {{dof: {len(self.placed.coordinates) - len(free)}}}"


def _suffixed(stem: str, name: str) -> str:
    """Return a name with the name or number of what it belongs to."""
    if not name:
        return stem
    letters = name.rstrip("0123456789")
    if letters in ("q", "link") and letters != name:
        return f"{stem}{name[len(letters) :]}"
    return f"{stem}_{name}"


def _squared_rate(q: str) -> str:
    return f"dot({q})^2"


def _placing(frame: PlacedFrame) -> Iterator[str]:
    if frame.on is not None:
        yield f"on: {frame.on}"
    at = _at(frame.pose)
    if at is not None:
        yield f"at: {at}"
    turns = list(_turns(frame.pose))
    if len(turns) == 1:
        yield f"turn: {{{turns[0]}}}" if not turns[0].startswith("{") else f"turn: {turns[0]}"
    elif turns:
        yield f"turn: [{', '.join(turns)}]"


def _at(pose: Pose) -> str | None:
    entries = []
    for k in range(3):
        terms = [times(s.along[k], _factor(s.by, s.along[k])) for s in pose.slides if s.along[k]]
        if pose.at[k] or not terms:
            terms.insert(0, number_text(pose.at[k]))
        text = terms[0]
        for term in terms[1:]:
            text += f" - {term[1:]}" if term.startswith("-") else f" + {term}"
        entries.append(text)
    return None if set(entries) == {"0"} else f"[{', '.join(entries)}]"


def _factor(by: str, factor: Decimal) -> str:
    """Return a displacement as a factor, a sum in brackets unless it stands alone."""
    return by if factor == 1 or not any(c in by for c in "+-") else f"({by})"


def _turns(pose: Pose) -> Iterator[str]:
    pending: ConstantTurn | None = None
    for turn in pose.turns:
        if isinstance(turn, ConstantTurn):
            if pending is not None:
                yield _turn(pending.axis, pending.angle.text)
            pending = turn
            continue
        if isinstance(turn, FreeTurn):
            if pending is not None:
                yield _turn(pending.axis, pending.angle.text)
            pending = None
            yield f"quaternion: [{', '.join(turn.parts)}]"
            continue
        angle = turn.angle if turn.sign > 0 else _negative(turn.angle)
        if pending is not None and pending.axis == turn.axis:
            sign = " - " if angle.startswith("-") else " + "
            angle = f"{pending.angle.text}{sign}{angle.removeprefix('-')}"
        elif pending is not None:
            yield _turn(pending.axis, pending.angle.text)
        pending = None
        yield _turn(turn.axis, angle)
    if pending is not None:
        yield _turn(pending.axis, pending.angle.text)


def _negative(text: str) -> str:
    if text.startswith("-") and " " not in text:
        return text[1:]
    return f"-({text})" if any(c in text for c in " ") else f"-{text}"


def _turn(axis: str | Vector, angle: str) -> str:
    if isinstance(axis, str):
        return f"{axis}: {angle}"
    return f"{{axis: {_vector(axis)}, angle: {angle}}}"


def _inertia(inertial: Inertial, mass: str) -> Iterator[str]:
    yield f"mass: {mass}"
    if any(inertial.centre):
        yield f"centre: {_vector(inertial.centre)}"
    if inertial.shape is not None:
        yield f"inertia: {inertial.shape}"
        return
    xx, yy, zz, xy, xz, yz = inertial.tensor
    rows: Sequence[Vector] = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    if any((xy, xz, yz)):
        yield f"inertia: [{', '.join(map(_vector, rows))}]"
    else:
        yield f"inertia: {_vector((xx, yy, zz))}"


def _vector(vector: Vector) -> str:
    return f"[{', '.join(map(number_text, vector))}]"


def _entry(name: str, parts: list[str]) -> Iterator[str]:
    """Write a mapping on one line, or a line for each of its keys."""
    line = f"  {name}: {{{', '.join(parts)}}}"
    if len(line) <= _WIDEST:
        yield line
    else:
        yield f"  {name}:"
        yield from (f"    {part}" for part in parts)


def _flow(key: str, parts: list[str]) -> Iterator[str]:
    line = f"{key}: {{{', '.join(parts)}}}"
    if len(line) <= _WIDEST:
        yield line
    else:
        yield f"{key}:"
        yield from (f"  {part}" for part in parts)


def _quoted(text: str) -> str:
    """Return a text as YAML reads it back."""
    plain = text and set(text) <= _SIMPLE and text[0].isalpha() and text[-1] != " "
    return text if plain and text.lower() not in _WORDS else json.dumps(text)


#: Words that YAML reads as something else.
_WORDS = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")


def _comment(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)
