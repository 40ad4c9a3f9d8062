"""Branches of equilibria over a parameter as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Stability

EndKind: TypeAlias = Literal[
    "range", "closed", "branch point", "singular", "pole", "far", "stuck", "budget"
]
"""The way in which a branch ends.

``range``: with the parameter's range. ``closed``: where it began. ``branch point``: it begins at
one, from which no other side leads into the range. ``singular``: coordinates are singular or not
allowed beyond. ``pole``: forces grow without bound. ``far``: unknowns leave every bound. ``stuck``:
no step is safe. ``budget``: there are too many points.
"""

MarkKind: TypeAlias = Literal[
    "fold", "pitchfork", "transcritical", "branch point", "divergence", "flutter"
]
"""The kind of a marked point.

``branch point``: branches meet otherwise than in a pitchfork or transcritically; ``divergence``:
several eigenvalues vanish at once; ``flutter``: a pair of poles leaves the imaginary axis.
"""


@dataclass(frozen=True)
class MarkedPoint:
    """A point at which a branch turns back, meets another one, or changes its stability.

    Attributes
    ----------
    kind
        Its kind.
    value
        The parameter.
    error
        Estimated error of ``value``, with the rounding of its double.
    position
        One number for each coordinate.
    frequency
        Angular frequency of the oscillation that begins at flutter; None otherwise.
    """

    kind: MarkKind
    value: float
    error: float
    position: tuple[float, ...]
    frequency: float | None


@dataclass(frozen=True)
class Stretch:
    """A part of a branch without marked points in it, and without points within their errors.

    Attributes
    ----------
    first, last
        Numbers of its first and last point on the branch.
    stability
        The strongest statement proven at points within it.
    """

    first: int
    last: int
    stability: Stability


@dataclass(frozen=True)
class Locus:
    """Poles of small motions along a branch.

    Attributes
    ----------
    values
        The parameter at points of the branch, shape (points,).
    poles
        Shape (points, poles); each column is one pole that moves with the parameter. Beyond a
        point where two meet, their columns may be exchanged. NaN where their number differs.
    """

    values: NDArray[np.float64]
    poles: NDArray[np.complex128]


@dataclass(frozen=True)
class Branch:
    """A curve of equilibria.

    Attributes
    ----------
    values
        The parameter at the points, shape (points,).
    positions
        Coordinates, shape (points, n); angles are continuous along the branch.
    ends
        The ways in which it ends on both sides; a closed loop ends with its first point.
    marks
        Pairs of the number of a point on it and the number of the marked point there, in order.
    stretches
        Its parts, in their order.
    locus
        The poles along it.
    """

    values: NDArray[np.float64]
    positions: NDArray[np.float64]
    ends: tuple[EndKind, EndKind]
    marks: tuple[tuple[int, int], ...]
    stretches: tuple[Stretch, ...]
    locus: Locus


@dataclass(frozen=True)
class Branches:
    """Branches of equilibria over the range of a parameter.

    Attributes
    ----------
    parameter
        Its name.
    low, high
        Its range.
    branches
        The branches.
    marks
        The marked points of all branches, by the parameter.
    values
        Number of values of the parameter at which equilibria were sought.
    starts
        Number of starts of these searches.
    skipped
        Number of equilibria that are parts of continua or degenerate, and were not followed.
    left
        Number of equilibria, and of directions at branch points, that were not followed since
        there were enough branches.
    held_inputs
        Inputs that vary with time, and the values at which they are held.
    free, periodic
        Names of the coordinates that may have any value, and of the angles whose values a turn
        apart are the same configuration.
    """

    parameter: str
    low: float
    high: float
    branches: tuple[Branch, ...]
    marks: tuple[MarkedPoint, ...]
    values: int
    starts: int
    skipped: int
    left: int
    held_inputs: tuple[tuple[str, float], ...]
    free: tuple[str, ...] = ()
    periodic: tuple[str, ...] = ()
