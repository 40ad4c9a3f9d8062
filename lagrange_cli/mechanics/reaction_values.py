"""Forces of constraints as frozen values: on bodies, and as multipliers of equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from sympy import Expr


@dataclass(frozen=True)
class BodyReaction:
    """The constraint force f = m r̈ − F on a particle, or on a point that a force pulls at.

    Attributes
    ----------
    name
        Name of the particle or point.
    components
        f along x, y, z, over q, v, t or as :attr:`ConstraintForces.form` says.
    size
        f along its direction, of either sign; None if there is no short form.
    """

    name: str
    components: tuple[Expr, Expr, Expr]
    size: Expr | None = None


@dataclass(frozen=True)
class Reaction:
    """The multiplier λ of one equation φ = 0 of the scene, which exerts λ ∇φ.

    Attributes
    ----------
    name
        Name of the constraint.
    text
        φ = 0 as the scene writes it.
    multiplier
        λ.
    sizes
        λ |∇φ| for each body whose Cartesian names φ holds.
    """

    name: str
    text: str
    multiplier: Expr
    sizes: tuple[tuple[str, Expr], ...]


@dataclass(frozen=True)
class ConstraintForces:
    """Constraint forces on bodies, and the multipliers of the scene's equations.

    Attributes
    ----------
    bodies
        Forces on particles and points.
    reactions
        Multipliers of equations.
    form
        Symbols of the expressions: ``motion`` q, v and t alone; ``accelerations`` ``ddot(q)``
        too; ``multipliers`` those of the closures (and accelerations if no multiplier alone
        gives a force).
    open
        Constraints whose multipliers are not determined or have no short form.
    included
        Terms of the scene that are written in coordinates, so that they act on no particle: the
        constraints pass them on.
    """

    bodies: tuple[BodyReaction, ...]
    reactions: tuple[Reaction, ...]
    form: Literal["motion", "accelerations", "multipliers"]
    open: tuple[str, ...] = ()
    included: tuple[str, ...] = ()
