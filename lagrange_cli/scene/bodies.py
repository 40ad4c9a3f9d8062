"""Rigid bodies and the frames that they are placed by, as a scene declares them.

Positions, turns and angular velocities are composed over the chain of frames that a body stands
on, in the scene's names. A body is a particle at its centre of mass that turns besides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from lagrange_cli.errors import Mark
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.language.rotations import implied_name
from lagrange_cli.scene.model import Particle, Scene

Vector: TypeAlias = tuple[Expression, Expression, Expression]

Axis: TypeAlias = str | Vector
"""``x``, ``y`` or ``z`` of the frame as earlier turns left it, or a direction in it."""


@dataclass(frozen=True, slots=True)
class ComposedExpression(Expression):
    """An expression that frames imply: nobody wrote it, and it is not printed as written."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A turn about an axis of a frame as the turns before it left the frame.

    Attributes
    ----------
    axis
        The axis.
    angle
        The angle, positive by the right-hand rule about the axis, or against it if ``reverse``.
    reverse
        True in the plane xz, whose turn from x to z is against y.
    """

    axis: Axis
    angle: Expression
    reverse: bool = False


@dataclass(frozen=True, slots=True)
class QuaternionTurn:
    """A turn to any orientation, by a quaternion of length 1.

    Attributes
    ----------
    parts
        Four names of coordinates, that of the scalar first.
    """

    parts: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class ThreeAngles:
    """Three angles that turn a body, and the quaternion that replaces them.

    Attributes
    ----------
    axes
        The axes of the three turns, such as ``zxz``.
    angles
        Names of the angles, in this order.
    parts
        Names of the quaternion's parts, that of the scalar first.
    """

    axes: str
    angles: tuple[str, ...]
    parts: tuple[str, ...]


AnyTurn: TypeAlias = Turn | QuaternionTurn

ShapeKind: TypeAlias = Literal["rod", "disk", "sphere", "cylinder", "box"]


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape of uniform density about the centre of mass.

    Attributes
    ----------
    kind
        Its key in the scene.
    axis
        Number of the axis of a rod, disk or cylinder in the body's axes.
    sizes
        Length, radius, radius and height, or lengths of edges.
    """

    kind: ShapeKind
    axis: int
    sizes: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Motion:
    """An elementary motion of a frame against the one that it stands on.

    Attributes
    ----------
    axis
        Unit vector along the axes of space.
    amount
        The angle, or the displacement along the axis.
    is_turn
        True of a turn, False of a displacement of the origin.
    """

    axis: Vector
    amount: Expression
    is_turn: bool


@dataclass(frozen=True, slots=True)
class FreeTurn:
    """A turn of a frame by a quaternion, which has no angles.

    Attributes
    ----------
    axes
        The axes that it turns, along those of space: columns of R before the turn.
    spin
        Angular velocity of the turn along them.
    parts
        The quaternion.
    """

    axes: tuple[Vector, ...]
    spin: Vector
    parts: tuple[Expression, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame in the tree of those that bodies stand on.

    Attributes
    ----------
    name
        Its name.
    parent
        The frame that it stands on, None for space.
    step
        Its origin from that of the parent, along the axes of space.
    motions
        Displacements of its origin along the axes of the parent, then its turns in order.
    """

    name: str
    parent: Frame | None
    step: Vector
    motions: tuple[Motion | FreeTurn, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Body(Particle):
    """A rigid body: its mass stands at its centre of mass, whose position it has as a particle.

    Attributes
    ----------
    on
        Name of the frame or body that it moves against, None for space.
    base
        Name of the body that it stands on, perhaps over frames; None for space.
    centre
        Its centre of mass in its axes, None at its origin.
    shape
        The shape that its inertia is written by, None for moments.
    turns
        Its turns against that, in order.
    chain
        Its turns against ``base``, with those of the frames between; none if it is displaced
        against one of these.
    frame
        Its place in the tree of frames.
    rotation
        Entries of R by rows: columns are its axes, in those of space.
    spin, spin_in_space
        Components of ω along its own axes, and along those of space.
    inertia
        Rows of its tensor of inertia about the centre of mass, in its axes.
    inertia_mark
        Place of the entry ``inertia``.
    placing
        Positions and angles that it and the frames below it are written with.
    planar
        True if it moves in the plane of the scene, where a body counts 3.
    """

    on: str | None
    base: str | None = None
    centre: Vector | None = None
    shape: Shape | None = None
    turns: tuple[AnyTurn, ...]
    chain: tuple[AnyTurn, ...] = ()
    frame: Frame
    rotation: tuple[Expression, ...]
    spin: Vector
    spin_in_space: Vector
    inertia: tuple[Vector, Vector, Vector]
    inertia_mark: Mark
    placing: tuple[Expression, ...] = ()
    planar: bool = False


def bodies_of(scene: Scene) -> tuple[Body, ...]:
    """Return the rigid bodies of a scene, which are among its particles."""
    return tuple(p for p in scene.particles if isinstance(p, Body))


def rotation_term(name: str) -> str:
    """Name of the kinetic energy of a body's turning among the terms of ``kinetic``."""
    return implied_name("rotation", name)
