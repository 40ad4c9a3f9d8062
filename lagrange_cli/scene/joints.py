"""Joints as constraints: a point on a point, a direction along another, a body on a surface.

Constraints hold the equations that a joint stands for; a :class:`Joint` beside them says in the
scene's names what is joined.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from lagrange_cli.scene.language.expression import Expression

JointKind: TypeAlias = Literal["pin", "parallel", "weld", "touch", "roll"]


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint that a constraint's equations stand for.

    Attributes
    ----------
    kind
        Its key in the scene.
    parts
        Names of what is joined; of ``parallel`` each after its direction, of a surface that is no
        frame its point and its normal.
    radius
        Radius of a body that touches a surface; None for other joints.
    positive
        An expression that is above zero where the joint is as it is meant, beside other solutions
        of its equations: the cosine of the turn that is left of a weld, the height of a disk's
        centre over the point that touches. None if there are no others.
    constants
        The radius, and what directions and planes are given by, which do not move in their frames.
    """

    kind: JointKind
    parts: tuple[str, ...]
    radius: Expression | None = None
    positive: Expression | None = None
    constants: tuple[Expression, ...] = ()

    def role(self, number: int, text: str) -> tuple[str, ...]:
        """Return what the multiplier of an equation is, by its number and its text.

        ``force`` on one part along an axis, the opposite one on the other; ``torque`` between two;
        ``normal`` force of a plane on a body, or ``friction``.
        """
        if self.kind in ("touch", "roll"):
            return ("friction" if number else "normal", self.parts[0])
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
