"""A robot as a tree of links and joints, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Literal, TypeAlias

from lagrange_cli.errors import Mark
from lagrange_cli.robots.quantities import NO_VECTOR, ConstantTurn, Vector

JointKind: TypeAlias = Literal["hinge", "slide", "fixed", "free", "planar", "ball"]

#: Tensor of inertia: Ixx, Iyy, Izz, Ixy, Ixz, Iyz, products as entries of the tensor.
Tensor: TypeAlias = tuple[Decimal, Decimal, Decimal, Decimal, Decimal, Decimal]


@dataclass(frozen=True)
class Placement:
    """A place and successive turns, against another frame."""

    at: Vector = NO_VECTOR
    turns: tuple[ConstantTurn, ...] = ()


@dataclass(frozen=True)
class Inertial:
    """The mass of a link.

    Attributes
    ----------
    mass
        In kilograms, positive.
    centre
        The centre of mass, in the axes of the link.
    tensor
        About the centre, in the axes of the link.
    shape
        A uniform shape in the language of scenes that has this tensor, None of others.
    mark
        The place in the file.
    """

    mass: Decimal
    centre: Vector
    tensor: Tensor
    mark: Mark
    shape: str | None = None


@dataclass(frozen=True)
class Link:
    """A rigid part; its inertia is None where it has no mass."""

    name: str
    mark: Mark
    inertial: Inertial | None = None


@dataclass(frozen=True)
class Follows:
    """The law of a joint that another one moves: ``factor`` times its coordinate + ``offset``."""

    joint: str
    factor: Decimal
    offset: Decimal
    mark: Mark


@dataclass(frozen=True)
class Joint:
    """A joint between two links.

    Attributes
    ----------
    name, mark, kind
        Its name, its place in the file, and what it lets move.
    parent, child
        Names of links; None for space.
    origin
        The frame of the child in that of the parent where the coordinate is 0.
    axis
        The axis of a hinge or slide, in the frame of the child; across the plane of a planar one.
    lower, upper
        Limits of the coordinate as text of the language of scenes, None without.
    lower_value, upper_value
        Their values.
    damping, friction, stiffness, armature
        Of the joint, 0 without: a force per speed, one that is constant, one per displacement from
        ``spring_rest``, and the inertia of a rotor.
    reference
        Coordinate at which the frames are as ``origin`` says.
    follows
        What else moves it.
    is_driven
        True if a motor acts on it.
    """

    name: str
    mark: Mark
    kind: JointKind
    parent: str | None
    child: str
    origin: Placement = Placement()
    axis: Vector = NO_VECTOR
    lower: str | None = None
    upper: str | None = None
    lower_value: float = float("-inf")
    upper_value: float = float("inf")
    damping: Decimal = Decimal(0)
    friction: Decimal = Decimal(0)
    stiffness: Decimal = Decimal(0)
    spring_rest: str = "0"
    armature: Decimal = Decimal(0)
    reference: str = "0"
    follows: Follows | None = None
    is_driven: bool = False


@dataclass(frozen=True)
class Drive:
    """A force of an actuator on a joint, as text over ``{q}``, ``{u}`` and ``dot({q})``."""

    joint: str
    name: str
    force: str


@dataclass(frozen=True)
class Marker:
    """A named place on a link."""

    name: str
    link: str | None
    at: Vector


@dataclass(frozen=True)
class LeftOut:
    """Something of a file that a scene does not say: how often, and where first."""

    what: str
    mark: Mark
    count: int = 1


@dataclass(frozen=True)
class Robot:
    """A robot.

    Attributes
    ----------
    name
        As in the file; empty without one.
    links, joints
        Its tree, parents before children: each link but roots is the child of one joint.
    drives
        Forces of actuators.
    markers
        Named places.
    gravity
        The acceleration of gravity; None for the usual one.
    left_out
        What else is in the file.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    drives: tuple[Drive, ...] = ()
    markers: tuple[Marker, ...] = ()
    gravity: Vector | None = None
    left_out: tuple[LeftOut, ...] = ()
