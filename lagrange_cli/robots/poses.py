"""Places of frames against each other: constants, and what coordinates add and turn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from typing import TypeAlias

from lagrange_cli.robots.quantities import (
    NO_VECTOR,
    ONE,
    ZERO,
    ConstantTurn,
    Matrix,
    Vector,
    added,
    axis_letter,
    fewest_turns,
    is_square,
    number_text,
    rotation,
    turned,
    unit,
)
from lagrange_cli.robots.robot import Joint, Placement


@dataclass(frozen=True)
class JointTurn:
    """A turn by a coordinate about an axis, its letter or any direction, or against that axis."""

    axis: str | Vector
    sign: int
    angle: str


@dataclass(frozen=True)
class FreeTurn:
    """A turn to any orientation: the names of the four parts of a quaternion, the scalar first."""

    parts: tuple[str, ...]


AnyTurn: TypeAlias = ConstantTurn | JointTurn | FreeTurn


@dataclass(frozen=True)
class Slide:
    """A displacement by a coordinate: factors along three axes, and what they multiply."""

    along: Vector
    by: str


@dataclass(frozen=True)
class Pose:
    """A frame against another one: a place, slides, and turns.

    Attributes
    ----------
    at, slides
        Its origin, as a constant and what coordinates add.
    turns
        Its turns in order.
    """

    at: Vector = NO_VECTOR
    slides: tuple[Slide, ...] = ()
    turns: tuple[AnyTurn, ...] = ()

    @property
    def is_constant(self) -> bool:
        return not self.slides and all(isinstance(t, ConstantTurn) for t in self.turns)

    @property
    def is_none(self) -> bool:
        return not self.slides and not self.turns and not any(self.at)

    def square(self) -> Matrix | None:
        """Return its rotation if that only exchanges axes."""
        constant = [turn for turn in self.turns if isinstance(turn, ConstantTurn)]
        if len(constant) < len(self.turns):
            return None
        matrix = rotation(constant)
        return matrix if is_square(matrix) else None

    def followed(self, placement: Placement) -> Pose | None:
        """Return the pose of a frame that is placed against this one; None if that rounds."""
        turns = (*self.turns, *placement.turns)
        if not any(placement.at):
            return replace(self, turns=_fewest(turns))
        matrix = self.square()
        if matrix is None:
            return None
        return replace(self, at=added(self.at, turned(matrix, placement.at)), turns=_fewest(turns))


def _fewest(turns: tuple[AnyTurn, ...]) -> tuple[AnyTurn, ...]:
    """Join constant turns at the end of a list."""
    count = len(turns)
    while count and isinstance(turns[count - 1], ConstantTurn):
        count -= 1
    tail = tuple(t for t in turns[count:] if isinstance(t, ConstantTurn))
    return (*turns[:count], *fewest_turns(tail))


def axis_vector(number: int) -> Vector:
    x, y, z = (ONE if k == number else ZERO for k in range(3))
    return x, y, z


def can_slide(pose: Pose, joint: Joint) -> bool:
    """Tell whether a joint that displaces its child can be written as the place of its frame."""
    if joint.kind in ("slide", "planar"):
        return pose.square() is not None
    return joint.kind != "free" or pose.is_constant


def slid(pose: Pose, axis: Vector, by: str) -> Pose:
    matrix = rotation([t for t in pose.turns if isinstance(t, ConstantTurn)])
    return replace(pose, slides=(*pose.slides, Slide(turned(matrix, unit(axis)), by)))


def joint_turn(axis: Vector, by: str) -> JointTurn:
    along = axis_letter(axis)
    if along is None:
        return JointTurn(axis, 1, by)
    return JointTurn(along[0], along[1], by)


def times(factor: Decimal, text: str) -> str:
    """Write a product of a number and a text without a sum."""
    if abs(factor) == 1:
        return text if factor > 0 else f"-{text}"
    return f"{number_text(factor)}*{text}"
