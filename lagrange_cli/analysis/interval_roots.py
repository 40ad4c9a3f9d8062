"""Proof that equations have one root in a box, by Krawczyk's operator.

With any matrix C, every root of F in a box X about x lies in x − C F(x) + (1 − C F′(X)) (X − x).
If that is within X, there is a root in X; if C F′(X) is regular besides, there is one alone
(R. Krawczyk, Computing 4 (1969) 187; S. M. Rump, Acta Numerica 19 (2010) 287, section 13).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mpmath
import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.interval_values import BITS, Interval, around, ends

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Matrix, Mpf

#: Radii of boxes that are tried, relative to 1 and to the unknowns: a large one takes less exact
#: points, a small one tells neighbouring roots apart.
_WIDTHS = (1e-10, 1e-20, 1e-30)
#: Part by which boxes about roots are larger than they need be, and their least size.
_MORE, _LEAST = 1e-3, 1e-60
#: Relative rounding of a few operations of doubles.
_FEW_ROUNDINGS = 1e-14


@dataclass(frozen=True)
class IntervalSystem:
    """Equations in as many unknowns, over intervals.

    Attributes
    ----------
    levels
        Values of the equations; raises ArithmeticError or ValueError without values.
    slopes
        Their derivatives that are not plainly zero, by row and column; raises as ``levels``.
    size
        Number of equations and of unknowns.
    """

    levels: Callable[[Sequence[Interval]], Sequence[Interval]]
    slopes: Callable[[Sequence[Interval]], dict[tuple[int, int], Interval]]
    size: int

    def root_radii(self, middle: Sequence[Mpf]) -> Matrix | None:
        """Prove that there is a root near a point, and one alone in some box about it.

        Returns the distances within which each of its unknowns is, or None without a proof.
        """
        with mpmath.workprec(BITS):
            try:
                residuals = self.levels([around(x, mpf(0)) for x in middle])
                for width in _WIDTHS:
                    box = np.array([width * max(1.0, abs(float(x))) for x in middle])
                    radii = self._radii_within(middle, box, residuals)
                    if radii is not None:
                        return radii
            except (ArithmeticError, ValueError):
                return None
        return None

    def _radii_within(
        self, middle: Sequence[Mpf], box: Matrix, residuals: Sequence[Interval]
    ) -> Matrix | None:
        whole = [around(x, mpf(r)) for x, r in zip(middle, box.tolist(), strict=True)]
        self.levels(whole)  # raises where a function jumps
        slopes, spread = self._matrices(self.slopes(whole))
        rows = np.abs(slopes).max(axis=1, initial=0.0)
        rows[rows == 0.0] = 1.0
        try:
            scaled = np.linalg.inv(slopes * box / rows[:, None])
        except np.linalg.LinAlgError:
            return None
        with np.errstate(all="ignore"):
            inverse = box[:, None] * scaled / rows
        if not np.isfinite(inverse).all():
            return None
        with np.errstate(all="ignore"):
            size = np.abs(inverse)
            unit = np.eye(self.size)
            rounding = _FEW_ROUNDINGS * self.size * (size @ np.abs(slopes) + unit)
            remainder = np.abs(unit - inverse @ slopes) + size @ spread + rounding
            remainder *= 1 + _FEW_ROUNDINGS * self.size
            offset = size @ _magnitudes(residuals) * (1 + _FEW_ROUNDINGS * self.size)
            if not (remainder @ box < 0.5 * box).all():
                return None
            # More than what is needed, so that the image lies within despite rounding.
            largest = max(float((offset / box).max(initial=0.0)), _LEAST)
            radii = np.linalg.solve(unit - remainder, (1 + _MORE) * offset + _MORE * largest * box)
            image = (offset + remainder @ radii) * (1 + _FEW_ROUNDINGS * self.size)
        return radii if (image < radii).all() and (radii < box).all() else None

    def _matrices(self, slopes: dict[tuple[int, int], Interval]) -> tuple[Matrix, Matrix]:
        """Return the middles of derivatives in doubles, and distances that hold all of each."""
        middle, spread = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for place, slope in slopes.items():
            low, high = ends(slope)
            middle[place] = float((low + high) / 2)
            center = mpf(float(middle[place]))
            distance = max(abs(high - center), abs(low - center))
            spread[place] = float(distance) * (1 + _FEW_ROUNDINGS)
        return middle, spread


def _magnitudes(values: Sequence[Interval]) -> Matrix:
    """Return the largest sizes of numbers in intervals, rounded up."""
    sizes = [max(map(abs, ends(x))) for x in values]
    return np.array(
        [float(size) * (1 + _FEW_ROUNDINGS) + (1e-300 if size else 0) for size in sizes]
    )
