"""Robot → frames, bodies and points of a scene.

Links without mass on fixed joints leave no frame behind: what stands on them is placed by what they
stand on, if their turns only exchange axes, or if it stands at their origin, so that nothing is
rounded. So do links without mass that a joint moves and one other joint leads on from, as in a
wrist: their turns follow each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from decimal import Decimal

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.robots.names import Names, identifier, short_names
from lagrange_cli.robots.poses import (
    FreeTurn,
    JointTurn,
    Pose,
    axis_vector,
    can_slide,
    joint_turn,
    slid,
    times,
)
from lagrange_cli.robots.quantities import AXES, ONE, Vector, axis_letter, number_text
from lagrange_cli.robots.robot import Inertial, Joint, LeftOut, Link, Placement, Robot
from lagrange_cli.robots.tensors import require_possible

#: Names that a body or point has besides its own.
_IMPLIED = ("x_{}", "y_{}", "z_{}")

#: End of the name of a body whose own is that of a joint.
BODY_SUFFIX = "_body"


@dataclass(frozen=True)
class PlacedFrame:
    """A frame or body of a scene; ``on`` is None in space, ``inertial`` None for a frame."""

    name: str
    on: str | None
    pose: Pose
    inertial: Inertial | None
    link: str


@dataclass(frozen=True)
class PlacedPoint:
    """A point fixed on a frame or body, or in space."""

    name: str
    on: str | None
    at: Vector


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a joint, with how the scene describes it."""

    name: str
    joint: Joint
    unit: str | None
    description: str
    start: str = "0"


@dataclass
class PlacedRobot:
    """Frames, bodies, points and coordinates of a scene.

    Attributes
    ----------
    frames, points, coordinates
        In their order in the scene.
    expressions
        For each hinge or slide what its coordinate is in the scene: a name, or that of the joint
        which it follows with a factor.
    names
        Names in use.
    left_out
        What the scene does not say.
    """

    frames: list[PlacedFrame] = field(default_factory=list)
    points: list[PlacedPoint] = field(default_factory=list)
    coordinates: list[Coordinate] = field(default_factory=list)
    expressions: dict[str, str] = field(default_factory=dict)
    names: Names = field(default_factory=Names)
    left_out: list[LeftOut] = field(default_factory=list)


@dataclass(frozen=True)
class _Anchor:
    """Pose of a link against a frame of the scene."""

    on: str | None
    pose: Pose


def placed_robot(robot: Robot) -> PlacedRobot:
    """Place the links of a robot.

    Raises
    ------
    InputError
        Located: nothing of it moves, or a joint follows itself.
    """
    return _Placing(robot).placed()


class _Placing:
    def __init__(self, robot: Robot) -> None:
        self.robot, self.result = robot, PlacedRobot()
        self.links = {link.name: link for link in robot.links}
        self.children: dict[str | None, list[Joint]] = {}
        for joint in robot.joints:
            self.children.setdefault(joint.parent, []).append(joint)
        self.moved_mass = self._moved_mass()
        self.anchors: dict[str | None, _Anchor] = {None: _Anchor(None, Pose())}
        self.frame_names: dict[str, str] = {}
        self.several: dict[tuple[str, str], str] = {}

    def placed(self) -> PlacedRobot:
        moving = [j for j in self.robot.joints if j.kind != "fixed" and self._moves_mass(j)]
        if not moving:
            mark = self.robot.links[0].mark if self.robot.links else Mark("robot", 1, 1)
            raise InputError(Problem("nothing of this robot moves", mark, rule="robot"))
        self._name_coordinates(moving)
        self._name_links()
        onto = {joint.child for joint in self.robot.joints}
        for link in self.robot.links:
            if link.name not in onto:
                self._place(link, _Anchor(None, Pose()))
        for joint in self.robot.joints:
            self._place_by(joint)
        self._place_markers()
        return self.result

    def _moved_mass(self) -> dict[str, bool]:
        """Tell for each link whether it or anything on it has mass."""
        has_mass = {link.name: link.inertial is not None for link in self.robot.links}
        for joint in reversed(self.robot.joints):
            if joint.parent is not None:
                has_mass[joint.parent] |= has_mass[joint.child]
        return has_mass

    def _moves_mass(self, joint: Joint) -> bool:
        return self.moved_mass[joint.child] or joint.armature > 0

    # -- names ----------------------------------------------------------------------------

    def _name_coordinates(self, moving: list[Joint]) -> None:
        names = self.result.names
        names.take("g")
        single = [j for j in moving if j.kind in ("hinge", "slide") and j.follows is None]
        short = dict(
            zip([j.name for j in single], short_names([j.name for j in single], "q"), strict=True)
        )
        for joint in moving:
            if joint.name in short:
                self._name_one(joint, short[joint.name])
            elif joint.follows is None:
                self._name_several(joint, sum(j.kind == joint.kind for j in moving) > 1)
        for joint in moving:
            if joint.follows is not None:
                self.result.expressions[joint.name] = self._following(joint, moving)

    def _name_one(self, joint: Joint, short: str) -> None:
        """Name the coordinate of a hinge or a slide."""
        name = self.result.names.take(short)
        self.result.expressions[joint.name] = name
        word = "angle" if joint.kind == "hinge" else "displacement"
        described = Coordinate(name, joint, _UNITS[word], f"{word} of {joint.name}", _start(joint))
        self.result.coordinates.append(described)

    def _following(self, joint: Joint, moving: list[Joint]) -> str:
        """Return the law of a joint that another one moves, over a coordinate."""
        by_name = {j.name: j for j in moving}
        factor, offset, law, seen = ONE, Decimal(0), joint.follows, {joint.name}
        while law is not None:
            factor, offset = factor * law.factor, offset + factor * law.offset
            if law.joint not in self.result.expressions and law.joint not in by_name:
                problem = f"joint '{joint.name}' follows '{law.joint}', which does not move"
                raise InputError(Problem(problem, law.mark, rule="mimic"))
            if law.joint in seen:
                raise InputError(
                    Problem(f"joint '{joint.name}' follows itself", law.mark, rule="mimic")
                )
            seen.add(law.joint)
            name, law = law.joint, by_name[law.joint].follows
        if name not in self.result.expressions:
            problem = f"joint '{joint.name}' follows '{name}', which is no hinge or slide"
            raise InputError(Problem(problem, joint.mark, rule="mimic"))
        text = times(factor, self.result.expressions[name])
        if offset:
            sign = "+" if offset > 0 else "-"
            text = f"{text} {sign} {number_text(abs(offset))}"
        return text

    def _name_several(self, joint: Joint, is_suffixed: bool) -> None:
        """Name the coordinates of a joint that has several."""
        suffix = f"_{identifier(joint.name)}" if is_suffixed else ""
        stems: Iterable[tuple[str, str]] = {
            "free": (*_PLACES, *_PARTS),
            "planar": (*_PLACES[:2], ("theta", "turn")),
            "ball": _PARTS,
        }[joint.kind]
        for stem, what in stems:
            name = self.result.names.take(f"{stem}{suffix}")
            self.several[joint.name, stem] = name
            start = "1" if stem == _PARTS[0][0] else "0"
            described = Coordinate(name, joint, _UNITS.get(what), f"{what} of {joint.child}", start)
            self.result.coordinates.append(described)

    def _name_links(self) -> None:
        """Name links with mass and those that may need a frame, as short as is clear."""
        onto = {joint.child for joint in self.robot.joints}
        moving = [k for k in self.robot.links if self.moved_mass[k.name] and k.name in onto]
        for link, short in zip(
            moving, short_names([link.name for link in moving], "link"), strict=True
        ):
            whole = identifier(link.name) or short
            candidates = (short, whole, f"{whole}{BODY_SUFFIX}")
            names = self.result.names
            name = next((c for c in candidates if names.is_free(c, *_IMPLIED)), candidates[-1])
            self.frame_names[link.name] = names.take(name, *_IMPLIED)

    # -- places ---------------------------------------------------------------------------

    def _place_by(self, joint: Joint) -> None:
        link = self.links[joint.child]
        anchor = self.anchors[joint.parent]
        pose = anchor.pose.followed(joint.origin)
        if pose is None:
            assert joint.parent is not None
            self.anchors[joint.parent] = anchor = self._framed(self.links[joint.parent], anchor)
            pose = anchor.pose.followed(joint.origin)
            assert pose is not None
        if joint.kind != "fixed" and not self._moves_mass(joint):
            self._note("joints that move no mass", joint.mark)
        elif joint.kind != "fixed":
            if not can_slide(pose, joint):
                name = self.result.names.take(f"{self.frame_names[link.name]}_base", *_IMPLIED)
                self.result.frames.append(PlacedFrame(name, anchor.on, pose, None, link.name))
                anchor, pose = _Anchor(name, Pose()), Pose()
            pose = self._moved(pose, joint)
        self._place(link, _Anchor(anchor.on, pose))

    def _place(self, link: Link, anchor: _Anchor) -> None:
        """Place a link: as a body, a frame, a point, or for the links that stand on it alone."""
        children = self.children.get(link.name, [])
        if link.inertial is None:
            if not anchor.pose.is_constant and len(children) != 1:
                anchor = self._framed(link, anchor)
            elif not children and anchor.on is not None:
                self._add_point(link.name, anchor)
        elif anchor.on is None and anchor.pose.is_constant:
            self._note("masses of links that are fixed in space", link.inertial.mark)
        else:
            require_possible(link.inertial.tensor, f"link '{link.name}'", link.inertial.mark)
            name = self.frame_names[link.name]
            frame = PlacedFrame(name, anchor.on, anchor.pose, link.inertial, link.name)
            self.result.frames.append(frame)
            anchor = _Anchor(name, Pose())
        self.anchors[link.name] = anchor

    def _framed(self, link: Link, anchor: _Anchor) -> _Anchor:
        """Write a frame for a link without mass, so that others can stand on it."""
        name = self.frame_names.get(link.name)
        if name is None:
            name = self.result.names.take(identifier(link.name) or "frame", *_IMPLIED)
            self.frame_names[link.name] = name
        self.result.frames.append(PlacedFrame(name, anchor.on, anchor.pose, None, link.name))
        return _Anchor(name, Pose())

    def _add_point(self, link: str, anchor: _Anchor) -> None:
        name = self.result.names.take(identifier(link) or "point", *_IMPLIED)
        self.result.points.append(PlacedPoint(name, anchor.on, anchor.pose.at))

    def _place_markers(self) -> None:
        for marker in self.robot.markers:
            anchor = self.anchors[marker.link]
            pose = anchor.pose.followed(Placement(marker.at))
            if anchor.on is not None and pose is not None:
                self._add_point(marker.name, _Anchor(anchor.on, pose))

    def _moved(self, pose: Pose, joint: Joint) -> Pose:
        """Return the pose after the motion of a joint."""
        names = self.result.expressions
        if joint.kind in ("hinge", "slide"):
            expression = names[joint.name]
            by = expression if joint.reference == "0" else _less(expression, joint.reference)
            if joint.kind == "hinge":
                return replace(pose, turns=(*pose.turns, joint_turn(joint.axis, by)))
            return slid(pose, joint.axis, by)
        if joint.kind == "planar":
            letter, sign = axis_letter(joint.axis) or ("z", 1)
            k = AXES.index(letter)
            for stem, number in (("x", (k + 1) % 3), ("y", (k + 2) % 3)):
                pose = slid(pose, axis_vector(number), self.several[joint.name, stem])
            turn = JointTurn(letter, sign, self.several[joint.name, "theta"])
            return replace(pose, turns=(*pose.turns, turn))
        freely = FreeTurn(tuple(self.several[joint.name, stem] for stem, _ in _PARTS))
        if joint.kind == "ball":
            return replace(pose, turns=(*pose.turns, freely))
        return self._freed(pose, joint, freely)

    def _freed(self, pose: Pose, joint: Joint, turn: FreeTurn) -> Pose:
        """Return the pose of a link that is free: it begins at its place, with its turns last.

        So the quaternion is the turn of the link against where it begins, along the axes of space.
        """
        freed = Pose()
        for number, stem in enumerate(AXES):
            name = self.several[joint.name, stem]
            freed = slid(freed, axis_vector(number), name)
            self.result.coordinates = [
                replace(c, start=number_text(pose.at[number])) if c.name == name else c
                for c in self.result.coordinates
            ]
        return replace(freed, turns=(turn, *pose.turns))

    def _note(self, what: str, mark: Mark) -> None:
        known = {entry.what: k for k, entry in enumerate(self.result.left_out)}
        if what in known:
            entry = self.result.left_out[known[what]]
            self.result.left_out[known[what]] = replace(entry, count=entry.count + 1)
        else:
            self.result.left_out.append(LeftOut(what, mark))


#: Coordinates of places, and of turns by a quaternion, with what they are of a link.
_PLACES = (("x", "place"), ("y", "place"), ("z", "place"))
_PARTS = (("e0", "scalar part"), ("e1", "x part"), ("e2", "y part"), ("e3", "z part"))

#: Units of coordinates by what they are; parts of a quaternion have none.
_UNITS = {"angle": "rad", "turn": "rad", "displacement": "m", "place": "m"}


def _less(expression: str, reference: str) -> str:
    if reference.startswith("-"):
        return f"{expression} + {reference[1:]}"
    return f"{expression} - {reference}"


def _start(joint: Joint) -> str:
    """Return where a joint begins: at its reference, or within its limits at what is closest."""
    if joint.reference != "0":
        return joint.reference
    if joint.lower is not None and joint.lower_value > 0:
        return joint.lower
    if joint.upper is not None and joint.upper_value < 0:
        return joint.upper
    return "0"
