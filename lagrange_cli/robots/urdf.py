"""URDF → robot.

The format is that of http://wiki.ros.org/urdf/XML: angles in radians, ``rpy`` about the axes of the
parent, which stay fixed, so that they are turns in reverse order; the frame of a joint is that of
its child.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from decimal import Decimal

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.robots.quantities import (
    ZERO,
    ConstantTurn,
    Vector,
    axis_letter,
    fewest_turns,
    in_radians,
    number_text,
    rotation,
)
from lagrange_cli.robots.robot import (
    Follows,
    Inertial,
    Joint,
    JointKind,
    LeftOut,
    Link,
    Placement,
    Robot,
)
from lagrange_cli.robots.tensors import in_turned_axes
from lagrange_cli.robots.xml_reader import Element

_KINDS: dict[str, JointKind] = {
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "slide",
    "fixed": "fixed",
    "floating": "free",
    "planar": "planar",
}

#: What is listed of other elements of a robot, links and joints.
_ELSEWHERE = {
    "transmission": "transmissions",
    "gazebo": "settings of Gazebo",
    "ros2_control": "settings of ros2_control",
    "sensor": "sensors",
    "visual": "pictures and meshes of links",
    "collision": "shapes for collisions",
    "safety_controller": "safety controllers",
    "calibration": "calibrations of joints",
}
#: Elements that say nothing about a motion.
_SILENT = (
    "material",
    "link",
    "joint",
    "inertial",
    "origin",
    "parent",
    "child",
    "axis",
    "limit",
    "dynamics",
    "mimic",
)


def robot_of_urdf(root: Element, *, floating: bool = False) -> Robot:
    """Return the robot that a file describes, its root fixed in space unless it is floating.

    Raises
    ------
    InputError
        Located: something is missing, unknown, or contradicts itself.
    """
    links = [_link(element) for element in root.every("link")]
    _require_names(links, "link")
    joints = [_joint(element) for element in root.every("joint")]
    _require_names(joints, "joint")
    known = {link.name for link in links}
    for element, joint in zip(root.every("joint"), joints, strict=True):
        _require_known(element, joint, known)
    if not links:
        root.refuse("this robot has no links")
    ordered = _in_order(links, joints)
    if floating:
        onto = {joint.child for joint in joints}
        bases = [link for link in links if link.name not in onto]
        ordered = [*(Joint(k.name, k.mark, "free", None, k.name) for k in bases), *ordered]
    return Robot(
        root.attributes.get("name", ""),
        tuple(links),
        tuple(ordered),
        left_out=tuple(_left_out(root)),
    )


def _require_names(parts: Iterable[Link | Joint], what: str) -> None:
    seen: set[str] = set()
    for part in parts:
        if part.name in seen:
            raise InputError(
                Problem(f"two {what}s are called '{part.name}'", part.mark, rule="clash")
            )
        seen.add(part.name)


def _require_known(element: Element, joint: Joint, links: set[str]) -> None:
    for tag, name in (("parent", joint.parent), ("child", joint.child)):
        if name not in links:
            (end,) = element.every(tag)
            end.refuse(f"joint '{joint.name}' names the link '{name}', which there is not", "link")


def _in_order(links: list[Link], joints: list[Joint]) -> list[Joint]:
    """Return the joints from the root on, each after that of its parent."""
    onto: dict[str, Joint] = {}
    for joint in joints:
        if joint.child in onto:
            problem = f"link '{joint.child}' is the child of two joints: loops are not read"
            hint = f"it is that of '{onto[joint.child].name}' already"
            raise InputError(Problem(problem, joint.mark, hint, "loop"))
        onto[joint.child] = joint
    roots = [link.name for link in links if link.name not in onto]
    if not roots:
        raise InputError(
            Problem("no link is the root: joints form a loop", joints[0].mark, rule="loop")
        )
    from_parent: dict[str | None, list[Joint]] = {}
    for joint in joints:
        from_parent.setdefault(joint.parent, []).append(joint)
    ordered: list[Joint] = []
    waiting = list(reversed(roots))
    while waiting:
        children = from_parent.get(waiting.pop(), [])
        ordered += children
        waiting += [joint.child for joint in reversed(children)]
    missing = [joint for joint in joints if joint not in ordered]
    if missing:
        raise InputError(Problem("joints form a loop", missing[0].mark, rule="loop"))
    return ordered


def _placement(element: Element | None) -> Placement:
    if element is None:
        return Placement()
    at = _vector(element, "xyz", "0 0 0")
    roll, pitch, yaw = (in_radians(angle) for angle in _vector(element, "rpy", "0 0 0"))
    turns = ConstantTurn("z", yaw), ConstantTurn("y", pitch), ConstantTurn("x", roll)
    return Placement(at, fewest_turns(turns))


def _vector(element: Element, attribute: str, default: str | None = None) -> Vector:
    x, y, z = element.numbers(attribute, 3, default)
    return x, y, z


def _link(element: Element) -> Link:
    name = element.required("name")
    inertial = element.first("inertial")
    return Link(
        name, element.place("name"), None if inertial is None else _inertial(inertial, name)
    )


def _inertial(element: Element, link: str) -> Inertial | None:
    mass_element, inertia = element.first("mass"), element.first("inertia")
    if mass_element is None:
        element.refuse(f"the inertia of link '{link}' has no <mass>", rule="missing")
    mass = mass_element.number("value")
    if mass < 0:
        mass_element.refuse(f"the mass of link '{link}' is negative", "value")
    placement = _placement(element.first("origin"))
    moments = dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), ZERO)
    if inertia is not None:
        moments = {key: inertia.number(key, "0") for key in moments}
    tensor = tuple(moments.values())
    if mass == 0:
        return None
    place = (inertia or element).mark
    xx, yy, zz, xy, xz, yz = tensor
    body_tensor = in_turned_axes((xx, yy, zz, xy, xz, yz), rotation(placement.turns))
    return Inertial(mass, placement.at, body_tensor, place)


def _joint(element: Element) -> Joint:
    name, written = element.required("name"), element.required("type")
    if written not in _KINDS:
        hint = f"known are {', '.join(_KINDS)}"
        element.refuse(f"joint '{name}' is of the unknown type '{written}'", "type", hint)
    ends = {}
    for tag in ("parent", "child"):
        end = element.first(tag)
        if end is None:
            element.refuse(f"joint '{name}' has no <{tag}>", rule="missing")
        ends[tag] = end.required("link")
    axis_element = element.first("axis")
    axis: Vector = (Decimal(1), ZERO, ZERO)
    if axis_element is not None:
        axis = _vector(axis_element, "xyz", "1 0 0")
    kind = _KINDS[written]
    if kind in ("hinge", "slide", "planar") and not any(axis):
        assert axis_element is not None
        axis_element.refuse(f"the axis of joint '{name}' has no length", "xyz")
    if kind == "planar" and axis_letter(axis) is None:
        assert axis_element is not None
        hint = "it is one of the axes of the joint's frame, which its origin can turn"
        axis_element.refuse(f"joint '{name}' moves in a plane across a slanted axis", "xyz", hint)
    joint = Joint(
        name,
        element.place("name"),
        kind,
        ends["parent"],
        ends["child"],
        _placement(element.first("origin")),
        axis,
    )
    if kind not in ("hinge", "slide"):
        return joint
    joint = _with_limits(joint, element.first("limit"), written)
    return _with_mimic(_with_dynamics(joint, element.first("dynamics")), element.first("mimic"))


def _with_limits(joint: Joint, limit: Element | None, written: str) -> Joint:
    if limit is None:
        return joint
    is_driven = limit.number("effort", "0") > 0
    joint = replace(joint, is_driven=is_driven)
    if written == "continuous":
        return joint
    bounds = {} if _are_reversed(limit) else _bounds(limit)
    texts = {
        k: in_radians(v).text if joint.kind == "hinge" else number_text(v)
        for k, v in bounds.items()
    }
    return replace(
        joint,
        lower=texts.get("lower"),
        upper=texts.get("upper"),
        lower_value=float(bounds.get("lower", "-inf")),
        upper_value=float(bounds.get("upper", "inf")),
    )


def _bounds(limit: Element) -> dict[str, Decimal]:
    """Return the finite limits: joints without an end are written with infinite ones."""
    texts = {key: limit.attributes.get(key, "0") for key in ("lower", "upper")}
    finite = (
        key
        for key, text in texts.items()
        if text.strip().lower().lstrip("+-") not in ("inf", "infinity")
    )
    return {key: limit.number(key, "0") for key in finite}


def _are_reversed(limit: Element) -> bool:
    """Tell whether the lower limit is above the upper one: programs take this for none."""
    bounds = _bounds(limit)
    return len(bounds) == 2 and bounds["lower"] > bounds["upper"]


def _with_dynamics(joint: Joint, dynamics: Element | None) -> Joint:
    if dynamics is None:
        return joint
    damping, friction = (dynamics.number(key, "0") for key in ("damping", "friction"))
    for key, value in (("damping", damping), ("friction", friction)):
        if value < 0:
            dynamics.refuse(f"the {key} of joint '{joint.name}' is negative", key)
    return replace(joint, damping=damping, friction=friction)


def _with_mimic(joint: Joint, mimic: Element | None) -> Joint:
    if mimic is None:
        return joint
    law = Follows(
        mimic.required("joint"),
        mimic.number("multiplier", "1"),
        mimic.number("offset", "0"),
        mimic.mark,
    )
    return replace(joint, follows=law, is_driven=False, friction=ZERO)


def _left_out(root: Element) -> list[LeftOut]:
    counts: Counter[str] = Counter()
    places: dict[str, Mark] = {}

    def note(what: str, mark: Mark) -> None:
        counts[what] += 1
        places.setdefault(what, mark)

    for element in (root, *root.every("link"), *root.every("joint")):
        for child in element.children:
            if child.tag not in _SILENT:
                note(_ELSEWHERE.get(child.tag, f"<{child.tag}>"), child.mark)
    for inertial in (i for link in root.every("link") for i in link.every("inertial")):
        mass, inertia = inertial.first("mass"), inertial.first("inertia")
        if mass is None or inertia is None or mass.number("value") != 0:
            continue
        if any(inertia.number(key, "0") for key in ("ixx", "iyy", "izz")):
            note("moments of inertia of links without mass", inertia.mark)
    for joint in root.every("joint"):
        limit = joint.first("limit")
        dynamics = joint.first("dynamics")
        if joint.first("mimic") and dynamics and dynamics.number("friction", "0"):
            note("dry friction of joints that follow others", dynamics.place("friction"))
        for key in ("effort", "velocity"):
            if limit is not None and limit.number(key, "0") > 0:
                note(f"largest {key} of joints", limit.place(key))
        has_ends = joint.attributes.get("type") in ("revolute", "prismatic")
        if has_ends and limit is not None and _are_reversed(limit):
            note("limits of joints whose lower one is above the upper one", limit.mark)
        if joint.attributes.get("type") in ("planar", "floating") and joint.first("dynamics"):
            note("damping of planar and floating joints", joint.mark)
    return [LeftOut(what, places[what], count) for what, count in counts.items()]
