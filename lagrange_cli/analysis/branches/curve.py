"""The solution set F(y) = 0 near a point: tangents and corrections, in scaled unknowns.

A point of a curve is corrected by Newton's method on F = 0 and one linear equation, the
hyperplane in which the corrector moves (H. B. Keller 1977). Residuals of the last corrections have
50 digits, so that a point is right to the rounding of its doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mpmath
import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.interval_roots import IntervalSystem
from lagrange_cli.analysis.interval_values import Interval, around
from lagrange_cli.analysis.values import DIGITS, Matrix
from lagrange_cli.mechanics.numerics.autodiff import DomainError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lagrange_cli.analysis.branches.functions import BranchFunctions
    from lagrange_cli.analysis.values import Mpf

# Newton's method. A contraction well below 1 tells the nearest part of the curve from others.

#: Corrections, at most, and the scaled size of one at which doubles have done their part.
_MOST_CORRECTIONS, _CONVERGED = 8, 1e-9
#: Largest ratio of the second correction to the first.
_CONTRACTION = 0.3
#: Size of the last correction, relative to the point, that is rounding.
_ROUNDING = 1e-14
#: Distance, in scaled unknowns, at which sizes of equations are measured.
_NEAR = 0.3
#: Singular value of the scaled J below which it is proven that a point is on the curve.
_SINGULAR = 1e-3
#: Polishing corrections, at most.
_POLISHING = 4


@dataclass(frozen=True)
class CurvePoint:
    """A point of a branch.

    Attributes
    ----------
    y
        Coordinates, multipliers and the parameter, shape (N + 1,).
    tangent
        Unit tangent in scaled unknowns, shape (N + 1,), in the direction of travel.
    turn
        Sign of det [J; tangent]; it changes at simple branch points.
    """

    y: Matrix
    tangent: Matrix
    turn: float

    @property
    def slope(self) -> float:
        """The part of the tangent along the parameter; it changes its sign at folds."""
        return float(self.tangent[-1])


@dataclass(frozen=True)
class Space:
    """Scaled unknowns, and where they may be.

    Attributes
    ----------
    functions
        F and its derivatives.
    scale
        Size of each unknown, shape (N + 1,).
    rows
        Size of each equation, shape (N,).
    low, high
        Range of the parameter.
    turns
        2π for unknowns of which values a turn apart mean the same, else 0; shape (N + 1,).
    allows
        Says whether coordinates are where the scene allows them.
    """

    functions: BranchFunctions
    scale: Matrix
    rows: Matrix
    low: float
    high: float
    turns: Matrix
    allows: Callable[[Matrix], bool]

    def difference(self, y: Matrix, origin: Matrix) -> Matrix:
        """Subtract points in scaled unknowns, angles to within half a turn."""
        gap = y - origin
        whole = np.where(self.turns > 0, self.turns, 1.0)
        return np.asarray((gap - self.turns * np.round(gap / whole)) / self.scale)

    def linearized(self, y: Matrix) -> tuple[Matrix, Matrix] | None:
        """Evaluate scaled residuals and their derivatives; None where there are none."""
        level, slopes = self.functions.residuals(y)
        with np.errstate(all="ignore"):
            level, slopes = level / self.rows, slopes * self.scale / self.rows[:, None]
        if not (np.isfinite(level).all() and np.isfinite(slopes).all()):
            return None
        return level, slopes

    def point(self, y: Matrix, along: Matrix) -> CurvePoint | None:
        """Add the tangent, turned to the side of ``along``; None if none is single."""
        known = self.linearized(y)
        if known is None:
            return None
        _, sizes, rows = np.linalg.svd(known[1])
        tangent = rows[-1] if rows[-1] @ along >= 0 else -rows[-1]
        if not len(sizes) or sizes[-1] == 0.0:
            return None
        # Where J is nearly singular, corrections also contract beside a curve.
        if sizes[-1] < _SINGULAR and self.radii([mpf(x) for x in y.tolist()], tangent) is None:
            return None
        sign, _ = np.linalg.slogdet(np.vstack([known[1], tangent]))
        return CurvePoint(y, tangent, float(sign))

    def radii(self, y: Sequence[Mpf], normal: Matrix) -> Matrix | None:
        """Prove that there is a point of the curve in the hyperplane through a point.

        Returns the distances within which each of its unknowns is; None without a proof.
        """
        functions, n = self.functions, self.functions.size
        border = (normal / self.scale).tolist()
        weights = [around(mpf(x), mpf(0)) for x in border]
        place = [around(x, mpf(0)) for x in y]

        def levels(z: Sequence[Interval]) -> list[Interval]:
            pairs = zip(weights, z, place, strict=True)
            products = [w * (a - b) for w, a, b in pairs]
            return [*functions.enclosed_levels(z), sum(products[1:], products[0])]

        def slopes(z: Sequence[Interval]) -> dict[tuple[int, int], Interval]:
            entries = {(r, c): x for (r, c), x in functions.enclosed_slopes(z).items()}
            return entries | {(n, k): w for k, w in enumerate(weights)}

        return IntervalSystem(levels, slopes, n + 1).root_radii(y)

    def corrected(self, y: Matrix, normal: Matrix) -> Matrix | None:
        """Move in the hyperplane through y with this normal to the curve; None if none is near.

        Corrections must contract, so that the point is on the part of the curve nearest to y.
        """
        near = self.approached(y, normal)
        return None if near is None else self.polished(near, normal)

    def approached(self, y: Matrix, normal: Matrix) -> Matrix | None:
        """Correct as :meth:`corrected`, in doubles alone."""
        size = np.inf
        for count in range(_MOST_CORRECTIONS):
            step = self._step(y, normal)
            if step is None:
                return None
            y = y - step * self.scale
            before, size = size, float(np.abs(step).max())
            if count and size > _CONTRACTION * before and size > _CONVERGED:
                return None
            if size <= _CONVERGED * max(1.0, float(np.abs(y / self.scale).max())):
                return y
        return None

    def _step(self, y: Matrix, normal: Matrix, level: Matrix | None = None) -> Matrix | None:
        known = self.linearized(y)
        if known is None:
            return None
        right = np.append(known[0] if level is None else level, 0.0)
        try:
            step = np.linalg.solve(np.vstack([known[1], normal]), right)
        except np.linalg.LinAlgError:
            return None
        return step if np.isfinite(step).all() else None

    def polished(self, y: Matrix, normal: Matrix) -> Matrix | None:
        """Correct by residuals in digits until only rounding is left."""
        best, least = y, np.inf
        for _ in range(_POLISHING):
            level = self._exact_level(y)
            step = None if level is None else self._step(y, normal, level)
            if step is None:
                return None
            size = float(np.abs(step / np.maximum(1.0, np.abs(y / self.scale))).max())
            y = y - step * self.scale
            if size < least:
                best, least = y, size
            if size <= _ROUNDING:
                break
        return np.asarray(best)

    def _exact_level(self, y: Matrix) -> Matrix | None:
        with mpmath.workdps(DIGITS):
            try:
                level = self.functions.level_at([mpf(x) for x in y.tolist()])
            except DomainError:
                return None
            return np.array([float(x) for x in level]) / self.rows

    def landed(self, y: Matrix, value: float) -> Matrix | None:
        """Move to the point of the curve where the parameter has this value."""
        along = np.zeros_like(y)
        along[-1] = 1.0
        placed = y.copy()
        placed[-1] = value
        return self.corrected(placed, along)


def row_sizes(functions: BranchFunctions, seeds: Sequence[Matrix], scale: Matrix) -> Matrix:
    """Measure the usual size of each equation by its derivatives near points; 1 without any.

    At the points themselves all derivatives of a degenerate equation may vanish.
    """
    random = np.random.default_rng(0)
    near = [y + scale * random.uniform(-_NEAR, _NEAR, len(y)) for y in seeds]
    sizes = [np.abs(functions.residuals(y)[1] * scale).max(axis=1) for y in near]
    known = [s for s in sizes if np.isfinite(s).all()]
    usual = np.median(known, axis=0) if known else np.ones(functions.size)
    return np.where(usual > 0, usual, 1.0)
