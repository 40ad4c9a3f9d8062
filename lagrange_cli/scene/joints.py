"""Joints as constraints: a point on a point, a direction along another, a body on a surface.

Constraints hold the equations that a joint stands for; a :class:`Joint` beside them says in the
scene's names what is joined.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from lagrange_cli.scene.language.expression import Expression

JointKind: TypeAlias = Literal["pin", "parallel", "weld", "touch", "roll", "unit"]


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint that a constraint's equations stand for.

    Attributes
    ----------
    kind
        Its key in the scene.
    parts
        Names of what is joined; of ``parallel`` each after its direction. A body that touches a
        surface is followed by what the surface is: ``plane``, its point, its normal and its frame;
        ``sphere`` or ``cylinder``, its side, its radius, its centre, its axis and its frame. Of
        ``unit`` the frame that turns by a quaternion.
    radii
        Radius of a body that touches a surface, and that of the surface; none of other joints.
    positive
        An expression that is above zero where the joint is as it is meant, beside other solutions
        of its equations: the cosine of the turn that is left of a weld, the height of a disk's
        centre over the point that touches. None if there are no others.
    constants
        Radii, and what directions and surfaces are given by, which do not move in their frames.
    round
        A disk or a sphere about the origin of a body that touches a surface, and the number of its
        axis; None of other joints, and of disks about a direction that is no axis of the body.
    quaternions
        Parts of the quaternions that ``unit`` keeps at length 1.
    """

    kind: JointKind
    parts: tuple[str, ...]
    radii: tuple[Expression, ...] = ()
    positive: Expression | None = None
    constants: tuple[Expression, ...] = ()
    round: tuple[Literal["disk", "sphere"], int] | None = None
    quaternions: tuple[Expression, ...] = ()

    def role(self, number: int, text: str) -> tuple[str, ...]:
        """Return what the multiplier of an equation is, by its number and its text.

        ``force`` on one part along an axis, the opposite one on the other; ``torque`` between two;
        ``normal`` force of a surface on a body, or ``friction``. On a sphere a body that rolls has
        ``part`` of the force along each gradient, as these are not at right angles.
        ``unit`` is no force.
        """
        if self.kind == "unit":
            return (self.kind, self.parts[0])
        if self.kind in ("touch", "roll"):
            body, shape = self.parts[:2]
            if self.kind == "roll" and shape == "sphere":
                return ("part", body, shape)
            return ("friction" if number else "normal", body, shape)
        if self.kind == "parallel":
            return ("torque", self.parts[1], self.parts[3])
        axis, blank = text[:1], text[1:2]
        return (
            ("force", *self.parts, axis)
            if blank in "_ " and axis in "xyz"
            else (
                "torque",
                *self.parts,
            )
        )
