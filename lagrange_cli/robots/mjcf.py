"""MJCF → robot.

The format is that of https://mujoco.readthedocs.io/en/stable/XMLreference.html: bodies within each
other, each with the joints against its parent. A joint may stand beside the origin of its body: the
frame of the body in a scene stands at the joint instead, and what is in the body is given from
there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from decimal import Decimal

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.robots.mjcf_settings import Settings, choice, read_settings
from lagrange_cli.robots.quantities import (
    NO_VECTOR,
    ONE,
    ZERO,
    ConstantTurn,
    Vector,
    added,
    fewest_turns,
    number_text,
    rotation,
    scaled,
    turned,
)
from lagrange_cli.robots.robot import (
    Drive,
    Inertial,
    Joint,
    JointKind,
    LeftOut,
    Link,
    Marker,
    Placement,
    Robot,
    Tensor,
)
from lagrange_cli.robots.shapes import inertial_of
from lagrange_cli.robots.tensors import in_turned_axes, total_inertia
from lagrange_cli.robots.xml_reader import Element

_KINDS: dict[str, JointKind] = {"hinge": "hinge", "slide": "slide", "ball": "ball", "free": "free"}

#: Elements that change nothing of a motion, or are read.
_SILENT = (
    *("compiler", "option", "size", "visual", "statistic", "default", "asset", "worldbody"),
    *("actuator", "custom", "body", "joint", "freejoint", "geom", "site", "inertial", "frame"),
    *("camera", "light"),
)
_ELSEWHERE = {
    "contact": "settings of contacts",
    "equality": "equality constraints",
    "tendon": "tendons",
    "sensor": "sensors",
    "keyframe": "key frames",
    "include": "included files",
    "extension": "extensions",
    "deformable": "deformable bodies",
    "composite": "composite objects",
    "flexcomp": "deformable bodies",
    "replicate": "replicated bodies",
    "attach": "attached models",
    "plugin": "plugins",
}
#: Numbers of ``option`` that are a force where they are not 0.
_MEDIA = ("density", "viscosity", "wind")

_MINUS = Decimal(-1)


def robot_of_mjcf(root: Element, *, floating: bool = False) -> Robot:
    """Return the robot that a file describes.

    Raises
    ------
    InputError
        Located: something is missing or unknown, or its mass is that of a mesh.
    """
    if floating:
        hint = "in MJCF a body that moves freely has a <freejoint/>"
        root.refuse("--floating is for URDF, which does not say how a robot stands", hint=hint)
    reader = _Reader(read_settings(root))
    for world in root.every("worldbody"):
        reader.read_children(world, None, Placement(), "")
    reader.read_actuators(root)
    reader.note_others(root)
    links = reader.scaled_links()
    if not links:
        root.refuse("this model has no bodies")
    return Robot(
        root.attributes.get("model", ""),
        tuple(links),
        tuple(reader.joints),
        tuple(reader.drives),
        tuple(reader.markers),
        _gravity(root),
        tuple(LeftOut(what, reader.places[what], n) for what, n in reader.counts.items()),
    )


def _gravity(root: Element) -> Vector:
    gravity = (ZERO, ZERO, Decimal("-9.81"))
    for option in root.every("option"):
        x, y, z = option.numbers("gravity", 3, " ".join(map(str, gravity)))
        gravity = (x, y, z)
        for flag in option.every("flag"):
            if flag.attributes.get("gravity") == "disable":
                return NO_VECTOR
    return gravity


@dataclass
class _Reader:
    settings: Settings
    links: list[Link] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    drives: list[Drive] = field(default_factory=list)
    markers: list[Marker] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    places: dict[str, Mark] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)

    def note(self, what: str, mark: Mark) -> None:
        self.counts[what] += 1
        self.places.setdefault(what, mark)

    # -- bodies ---------------------------------------------------------------------------

    def read_children(
        self, element: Element, link: str | None, frame: Placement, inherited: str
    ) -> None:
        """Read bodies and places within a body, whose frame stands at ``frame`` for them."""
        inherited = element.attributes.get("childclass", inherited)
        for child in element.children:
            if child.tag == "body":
                self._read_body(child, link, frame, inherited)
            elif child.tag == "frame":
                inner = _within(frame, self.settings.placement(child))
                self.read_children(child, link, inner, inherited)
            elif child.tag == "site" and link is not None and "name" in child.attributes:
                site = self.settings.resolved(child, inherited)
                at = _within(frame, self.settings.placement(site)).at
                self.markers.append(Marker(child.attributes["name"], link, at))

    def _read_body(
        self, body: Element, parent: str | None, frame: Placement, inherited: str
    ) -> None:
        inherited = body.attributes.get("childclass", inherited)
        name = self._name(body, "body")
        base = _within(frame, self.settings.placement(body))
        joints = [
            self._joint(self.settings.resolved(e, inherited), name)
            for e in body.children
            if e.tag in ("joint", "freejoint")
        ]
        shift = NO_VECTOR
        on = parent
        links: list[Link] = []
        for number, (joint, at) in enumerate(joints):
            is_last = number == len(joints) - 1
            child = name if is_last else self._free_name(f"{name}_{joint.name}")
            moved = added(at, scaled(shift, _MINUS))
            if number == 0:
                origin = Placement(added(base.at, turned(rotation(base.turns), at)), base.turns)
            else:
                origin = Placement(moved)
            self.joints.append(replace(joint, parent=on, child=child, origin=origin))
            links.append(Link(child, body.mark))
            on, shift = child, at
        if not joints:
            self.joints.append(Joint(f"{name}_fixed", body.mark, "fixed", parent, name, base))
            links.append(Link(name, body.mark))
        inside = Placement(scaled(shift, _MINUS))
        links[-1] = replace(links[-1], inertial=self._inertial(body, inside, inherited))
        self.links += links
        self.read_children(body, name, inside, inherited)

    def _name(self, element: Element, stem: str) -> str:
        name = element.attributes.get("name")
        if name is None:
            return self._free_name(f"{stem}{len(self.links) + 1}")
        if f"{stem} {name}" in self.names:
            problem = f"two elements <{element.tag}> are called '{name}'"
            raise InputError(Problem(problem, element.place("name"), rule="clash"))
        self.names.add(f"{stem} {name}")
        return name

    def _free_name(self, name: str) -> str:
        candidate, number = name, 1
        while f"body {candidate}" in self.names:
            number += 1
            candidate = f"{name}_{number}"
        self.names.add(f"body {candidate}")
        return candidate

    # -- joints ---------------------------------------------------------------------------

    def _joint(self, element: Element, body: str) -> tuple[Joint, Vector]:
        """Return a joint without its ends, and its place in the axes of its body."""
        written = "free" if element.tag == "freejoint" else element.attributes.get("type", "hinge")
        if written not in _KINDS:
            hint = f"known are {', '.join(_KINDS)}"
            element.refuse(f"a joint is of the unknown type '{written}'", "type", hint)
        kind = _KINDS[written]
        if "name" not in element.attributes:
            element = replace(
                element,
                attributes={**element.attributes, "name": f"{body}_{kind}_{len(self.joints)}"},
            )
        name = self._name(element, "joint")
        joint = Joint(name, element.mark, kind, None, body)
        if kind == "free":
            return joint, NO_VECTOR
        place = _vector(element.numbers("pos", 3, "0 0 0"))
        if kind == "ball":
            for quantity in ("damping", "frictionloss", "armature", "stiffness"):
                if any(element.some_numbers(quantity, "0")):
                    self.note(f"{quantity} of ball joints", element.mark)
            return joint, place
        axis = _vector(element.numbers("axis", 3, "0 0 1"))
        if not any(axis):
            element.refuse(f"the axis of joint '{name}' has no length", "axis")
        joint = self._with_forces(replace(joint, axis=axis), element)
        return self._limited(joint, element), place

    def _with_forces(self, joint: Joint, element: Element) -> Joint:
        """Return a joint with its forces, each not negative, and where it is without them."""
        quantities = {}
        for attribute in ("damping", "frictionloss", "armature", "stiffness"):
            quantities[attribute] = element.number(attribute, "0")
            if quantities[attribute] < 0:
                element.refuse(f"the {attribute} of joint '{joint.name}' is negative", attribute)
        return replace(
            joint,
            damping=quantities["damping"],
            friction=quantities["frictionloss"],
            armature=quantities["armature"],
            stiffness=quantities["stiffness"],
            reference=self._text(element.number("ref", "0"), joint.kind),
            spring_rest=self._text(element.number("springref", "0"), joint.kind),
        )

    def _text(self, value: Decimal, kind: str) -> str:
        return self.settings.angle(value).text if kind == "hinge" else number_text(value)

    def _limited(self, joint: Joint, element: Element) -> Joint:
        words = {"true": True, "false": False, "auto": None}
        wanted = choice(element, "limited", words, "auto")
        if wanted is None:
            wanted = "range" in element.attributes and self.settings.limits_by_range
        if not wanted:
            return joint
        lower, upper = element.numbers("range", 2, "0 0")
        if lower >= upper:
            element.refuse(f"the range of joint '{joint.name}' is empty", "range")
        values = [lower, upper]
        if joint.kind == "hinge":
            values = [self.settings.angle(value).value for value in values]
        return replace(
            joint,
            lower=self._text(lower, joint.kind),
            upper=self._text(upper, joint.kind),
            lower_value=float(values[0]),
            upper_value=float(values[1]),
        )

    # -- inertia --------------------------------------------------------------------------

    def _inertial(self, body: Element, inside: Placement, inherited: str) -> Inertial | None:
        written = body.first("inertial")
        if written is not None and self.settings.inertia_from_shapes is not True:
            return _shifted(self._written(written), inside.at)
        if self.settings.inertia_from_shapes is False:
            return None
        parts = [
            part
            for geom, frame in _geoms(body, self.settings, Placement())
            if (part := inertial_of(self.settings.resolved(geom, inherited), self.settings))
            is not None
            and (part := _placed(part, frame)) is not None
        ]
        if not parts:
            return None
        if len(parts) == 1:
            return _shifted(parts[0], inside.at)
        mass, centre, tensor = total_inertia((p.mass, p.centre, p.tensor) for p in parts)
        return _shifted(Inertial(mass, centre, tensor, parts[0].mark), inside.at)

    def _written(self, element: Element) -> Inertial | None:
        mass = element.number("mass")
        if mass <= 0:
            element.refuse("a mass is positive", "mass")
        placement = self.settings.placement(element)
        if "fullinertia" in element.attributes:
            xx, yy, zz, xy, xz, yz = element.numbers("fullinertia", 6)
            tensor: Tensor = (xx, yy, zz, xy, xz, yz)
            turns: tuple[ConstantTurn, ...] = ()
        else:
            xx, yy, zz = element.numbers("diaginertia", 3, "0 0 0")
            tensor, turns = (xx, yy, zz, ZERO, ZERO, ZERO), placement.turns
        return Inertial(mass, placement.at, in_turned_axes(tensor, rotation(turns)), element.mark)

    def scaled_links(self) -> list[Link]:
        """Return the links, their masses scaled where the file wants a total."""
        total = self.settings.total_mass
        if total is None:
            return self.links
        factor = total / sum((k.inertial.mass for k in self.links if k.inertial), ZERO)
        return [replace(k, inertial=_heavier(k.inertial, factor)) for k in self.links]

    # -- actuators ------------------------------------------------------------------------

    def read_actuators(self, root: Element) -> None:
        known = {joint.name: joint for joint in self.joints}
        for section in root.every("actuator"):
            for written in section.children:
                actuator = self.settings.resolved(written, "")
                joint = known.get(actuator.attributes.get("joint", ""))
                force = None if joint is None else _force(actuator)
                if joint is None or force is None or joint.kind not in ("hinge", "slide"):
                    self.note(f"actuators of type {actuator.tag}", actuator.mark)
                    continue
                if "ctrlrange" in actuator.attributes or "forcerange" in actuator.attributes:
                    self.note("ranges of controls and forces", actuator.mark)
                self.drives.append(
                    Drive(joint.name, actuator.attributes.get("name", f"u_{joint.name}"), force)
                )

    # -- what else ------------------------------------------------------------------------

    def note_others(self, root: Element) -> None:
        for element in _everything(root):
            if element.tag in _ELSEWHERE:
                self.note(_ELSEWHERE[element.tag], element.mark)
            elif element.tag == "geom" and "mesh" in element.attributes:
                self.note("meshes", element.mark)
        for option in root.every("option"):
            for medium in _MEDIA:
                if any(option.some_numbers(medium, "0")):
                    self.note(f"the {medium} of a medium", option.place(medium))
        geoms = [
            e for e in _everything(root) if e.tag == "geom" and e.attributes.get("contype") != "0"
        ]
        if geoms:
            self.note("contacts of bodies", geoms[0].mark)


def _everything(root: Element) -> Iterator[Element]:
    """Yield the elements of a file but those of defaults and assets, which are named where used."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        yield element
        if element.tag not in _ELSEWHERE:
            waiting += [c for c in reversed(element.children) if c.tag not in ("default", "asset")]


def _geoms(
    body: Element, settings: Settings, frame: Placement
) -> Iterable[tuple[Element, Placement]]:
    for child in body.children:
        if child.tag == "geom":
            yield child, frame
        elif child.tag == "frame":
            yield from _geoms(child, settings, _within(frame, settings.placement(child)))


def _within(outer: Placement, inner: Placement) -> Placement:
    """Return the placement of a frame within a frame."""
    at = added(outer.at, turned(rotation(outer.turns), inner.at))
    return Placement(at, fewest_turns((*outer.turns, *inner.turns)))


def _placed(part: Inertial, frame: Placement) -> Inertial:
    if not any(frame.at) and not frame.turns:
        return part
    matrix = rotation(frame.turns)
    centre = added(frame.at, turned(matrix, part.centre))
    shape = None if frame.turns else part.shape
    return replace(part, centre=centre, tensor=in_turned_axes(part.tensor, matrix), shape=shape)


def _shifted(part: Inertial | None, by: Vector) -> Inertial | None:
    return None if part is None else replace(part, centre=added(part.centre, by))


def _heavier(part: Inertial | None, factor: Decimal) -> Inertial | None:
    if part is None:
        return None
    xx, yy, zz, xy, xz, yz = (factor * entry for entry in part.tensor)
    return replace(part, mass=factor * part.mass, tensor=(xx, yy, zz, xy, xz, yz))


def _force(actuator: Element) -> str | None:
    """Return the force of an actuator on its joint; None of kinds that are not read."""
    gears = actuator.some_numbers("gear", "1")
    gear = gears[0] if gears else ONE
    factor = "" if gear == 1 else f"{number_text(gear)}*"
    place = "{q}" if gear == 1 else f"{number_text(gear)}*{{q}}"
    rate = "dot({q})" if gear == 1 else f"{number_text(gear)}*dot({{q}})"
    if actuator.tag == "motor":
        return f"{factor}{{u}}"
    if actuator.tag == "position":
        stiffness, damping = (actuator.number(key, d) for key, d in (("kp", "1"), ("kv", "0")))
        damper = f" - {number_text(damping)}*{rate}" if damping else ""
        inner = f"{number_text(stiffness)}*({{u}} - {place}){damper}"
        return inner if gear == 1 else f"{factor}({inner})"
    if actuator.tag == "velocity":
        return f"{factor}{number_text(actuator.number('kv', '1'))}*({{u}} - {rate})"
    return None


def _vector(numbers: tuple[Decimal, ...]) -> Vector:
    x, y, z = numbers
    return x, y, z
