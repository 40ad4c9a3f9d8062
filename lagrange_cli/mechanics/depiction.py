"""Sources of a picture of a system: points, links, constraints and potentials as stated.

Equations of motion have lost the names in which constraints were written; a picture shows them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from sympy import Expr


#: Most particles and points of a picture: more are a blot at the size of a page.
MOST_BODIES = 400


@dataclass(frozen=True)
class PlacedPoint:
    """A massless point.

    Attributes
    ----------
    name
        Its name.
    components
        Names of its x, y and z.
    position
        r(q, t), along x, y, z.
    latex
        LaTeX of the scene, None if absent.
    on
        Name of the body that it is fixed to, None for others.
    """

    name: str
    components: tuple[str, str, str]
    position: tuple[Expr, Expr, Expr]
    latex: str | None = None
    on: str | None = None


@dataclass(frozen=True)
class BodyLink:
    """A distance, spring or damper that a helper of the scene states.

    Attributes
    ----------
    kind
        Its key in the scene.
    ends
        Names of two particles or points.
    size
        Length of a distance, stiffness of a spring, coefficient of a damper, over the names of the
        scene.
    """

    kind: Literal["distance", "spring", "damper"]
    ends: tuple[str, str]
    size: Expr


@dataclass(frozen=True)
class StatedRelation:
    """An equation or inequality between positions.

    Attributes
    ----------
    name
        Name of its constraint.
    expression
        φ over Cartesian names, coordinates, parameters and t; φ = 0, or φ ≥ 0.
    one_sided
        True if it is φ ≥ 0.
    """

    name: str
    expression: Expr
    one_sided: bool = False


@dataclass(frozen=True)
class BodyOutline:
    """Vectors over q, t and parameters, along the axes of space, that a rigid body is drawn by.

    Attributes
    ----------
    name
        Name of the body.
    kind
        Its shape; None for moments of inertia.
    spans
        From the centre of mass: to the end of a rod; to the rim of a disk and to that a right
        angle on; the same of a sphere or cylinder, then along its axis to the end; to the middle
        of three faces of a box.
    origin
        Place of its origin.
    base
        Name of the body that it stands on, None for space.
    """

    name: str
    kind: Literal["rod", "disk", "sphere", "cylinder", "box"] | None
    spans: tuple[tuple[Expr, Expr, Expr], ...]
    origin: tuple[Expr, Expr, Expr]
    base: str | None


@dataclass(frozen=True)
class Depiction:
    """Sources of a picture besides the particles.

    Attributes
    ----------
    bodies
        Outlines of rigid bodies.
    points, links, relations
        Points, helpers between two bodies, constraints between positions.
    potentials
        Terms of V by name, over Cartesian names, coordinates, parameters and t; those that hold
        rates are left out.
    """

    bodies: tuple[BodyOutline, ...]
    points: tuple[PlacedPoint, ...]
    links: tuple[BodyLink, ...]
    relations: tuple[StatedRelation, ...]
    potentials: tuple[tuple[str, Expr], ...]
