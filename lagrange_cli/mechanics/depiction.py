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
    """

    name: str
    components: tuple[str, str, str]
    position: tuple[Expr, Expr, Expr]
    latex: str | None = None


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
class Depiction:
    """Sources of a picture besides the particles.

    Attributes
    ----------
    points, links, relations
        Points, helpers between two bodies, constraints between positions.
    potentials
        Terms of V by name, over Cartesian names, coordinates, parameters and t; those that hold
        rates are left out.
    """

    points: tuple[PlacedPoint, ...]
    links: tuple[BodyLink, ...]
    relations: tuple[StatedRelation, ...]
    potentials: tuple[tuple[str, Expr], ...]
