"""Further solutions of a two-point problem by deflation of those that are known.

Newton's method on m(u) F(u), with m = Π (1 + 1/d_k²) over the distances d_k from known solutions,
is led away from them and may come to others from the same start (P. E. Farrell, Á. Birkisson and
S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026). Its step is that of F times a number. There is
no promise that it finds all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.studies.chebyshev import Points, coefficients_of, points_of
from lagrange_cli.studies.path.collocation import (
    CLOSE,
    TwoPointProblem,
    solved,
    solver,
)

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array

# Chosen with room: steps as long as a scale cross the whole of a problem in forty, and solutions
# that are one agree to more digits than here. Not tuned.

#: Steps of Newton's method.
_STEPS = 40
#: Longest step, in scales of coordinates.
_LONGEST = 1.0
#: Size, in scales, of paths that go to infinity.
_FAR = 1e3
#: Distance below which two solutions are one.
_SAME = 1e-4
#: Solutions in a row that one start may lead to.
_IN_A_ROW = 8


@dataclass
class Solutions:
    """Solutions of a two-point problem, as values at Chebyshev points and as coefficients."""

    paths: list[Array] = field(default_factory=list)
    coefficients: list[Array] = field(default_factory=list)

    def add(self, path: Array) -> bool:
        """Add a solution; return False if it is known."""
        if min(self._distances(path), default=1.0) < _SAME:
            return False
        self.paths.append(path)
        self.coefficients.append(coefficients_of(path))
        return True

    def _distances(self, path: Array) -> list[float]:
        return [float(np.sqrt(np.mean(gap**2))) for gap in self.gaps(path)]

    def gaps(self, path: Array) -> list[Array]:
        """Subtract the solutions from a path at its inner points."""
        x = 2 * points_of(len(path) - 1).s[1:-1] - 1
        values = np.polynomial.chebyshev.chebval
        return [path[1:-1] - values(x, known).T for known in self.coefficients]

    def factor(self, path: Array, step: Array) -> float:
        """Return the length of the deflated Newton step over that of Newton's step.

        By Sherman and Morrison it is 1/(1 − ∇m·step/m).
        """
        growth = 0.0
        for gap in self.gaps(path):
            square = float(np.mean(gap**2))
            growth -= 2 * float(np.mean(gap * step)) / (square * (1 + square))
        return 1 / (1 - growth)


def deflated(
    problem: TwoPointProblem, known: Solutions, starts: Sequence[Array]
) -> Iterator[Array]:
    """Yield solutions that are not known yet, and add them to the known ones.

    ``starts``: paths at Chebyshev points, from each of which solutions are sought until none is
    found. Where a solution is one of a family, deflation would go on along it, and nothing more is
    sought.
    """
    if any(map(problem.is_degenerate, known.paths)):
        return
    for start in starts:
        for _ in range(_IN_A_ROW):
            with np.errstate(all="ignore"):
                near = _newton(problem, known, points_of(len(start) - 1), start)
                path = None if near is None else solved(problem, near)
            if path is None or not known.add(path):
                break
            yield path
            if problem.is_degenerate(path):
                return


def _newton(
    problem: TwoPointProblem, known: Solutions, points: Points, path: Array
) -> Array | None:
    """Lead a path to a solution that is not known; None if it comes to none."""
    for _ in range(_STEPS):
        residual, jacobian = problem.residual(points, path), problem.jacobian(points, path)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        step = -solver(jacobian)(residual).reshape(path[1:-1].shape)
        if np.max(np.abs(step)) < CLOSE:
            return path
        step *= known.factor(path, step)
        size = float(np.max(np.abs(step)))
        if not np.isfinite(size):
            return None
        path = path.copy()
        path[1:-1] += step * min(1.0, _LONGEST / size)
        if np.max(np.abs(path)) > _FAR:
            return None
    return None
