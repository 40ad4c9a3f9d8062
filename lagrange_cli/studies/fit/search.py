"""Values at which the sum of squares is smallest, from one start or from several.

One start: the sum over a whole record of an oscillation has a minimum for each number of
oscillations that a motion gains or loses on the measured one. The sum over few oscillations has no
other near by. A search therefore fits the measurements before a horizon, as many as the motion from
the start follows, and moves the horizon as the motion follows more, to the end of the record: what
multiple shooting does for a record in pieces, without further unknowns for their starts (H. G.
Bock, "Recent advances in parameter identification techniques for O.D.E.", 1983, on why long records
need either). How many fits are right from starts far from the truth is in ``benchmarks/fits.py``.

Several starts are points of a Latin hypercube (M. D. McKay, R. J. Beckman and W. J. Conover,
Technometrics 21, 1979, p. 239). If n of them ended at w minima, those that were not found attract
w (w + 1)/(n (n − 1)) of all starts, in expectation (C. G. E. Boender and A. H. G. Rinnooy Kan,
Mathematical Programming 37, 1987, p. 59): where other minima may be as good, the search ends with a
small part. Where they can only be better, three starts that end at the best one end it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.errors import LagrangeError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.studies.fit.residuals import Residuals

#: A motion follows measurements while the root mean square of residuals over the ranges of their
#: columns is below this: a quarter of an oscillation behind gives 0.5 (``benchmarks/fits.py``).
_FOLLOWED = 0.25

#: Motions of a fit to a part of the record, and to the whole.
_RUNS_OF_PART, _MOST_RUNS = 15, 100

#: Weight of a change of a value by its size in a fit to a part of the record, over the ranges of
#: columns: values that a part does not show stay where they are.
_INERTIA = 0.03

#: Most starts that are tried unless more are asked for.
MOST_STARTS = 32

#: Residuals over the ranges of columns below which values are the same.
_SAME = 1e-5

#: Part of all starts, in expectation, that may lead to minima that were not found.
_UNSEEN = 0.1

#: Minima are compared whose sum of squares over the ranges of columns is within this factor of the
#: least, or so small.
COMPARED, EXACT = 4.0, 1e-12

#: Starts that end at a minimum, none at a lower one.
_AGREEING = 3


@dataclass(frozen=True)
class Minimum:
    """A minimum of the sum of squares.

    Attributes
    ----------
    start, values
        Where the search began, and the minimum.
    cost
        Sum of squares.
    converged
        Values have stopped changing.
    at_bound
        −1 or 1 for each value that is at its lowest or highest, else 0.
    """

    start: Array
    values: Array
    cost: float
    converged: bool
    at_bound: Array


@dataclass(frozen=True)
class Box:
    """Bounds of values, shape (values,) each: absolute, and of starts.

    Attributes
    ----------
    lowest, highest
        Values stay between these.
    first, last
        Starts are drawn between these.
    is_logarithmic
        Starts are drawn by their logarithms.
    """

    lowest: Array
    highest: Array
    first: Array
    last: Array
    is_logarithmic: NDArray[np.bool_]

    def points(self, number: int, seed: int = 0) -> Array:
        """Return points of a Latin hypercube, shape (number, values)."""
        from scipy.stats import qmc

        drawn = qmc.LatinHypercube(len(self.first), seed=np.random.default_rng(seed)).random(number)
        points = self.first + drawn * (self.last - self.first)
        for k in np.flatnonzero(self.is_logarithmic):
            points[:, k] = self.first[k] * (self.last[k] / self.first[k]) ** drawn[:, k]
        return np.asarray(points)


def minimum_from(residuals: Residuals, start: Array, box: Box) -> Minimum | None:
    """Find the minimum that a start leads to; None if there is no motion on the way.

    Parameters
    ----------
    residuals
        Residuals with the deviations that hold during the search.
    start
        Values within the bounds.
    box
        The bounds.
    """
    values = start
    until = _followed(residuals, values, fewest(residuals))
    while until < len(residuals.times):
        values = _fitted_part(residuals, values, until, box)
        until = _followed(residuals, values, 1 + until + until // 4)
    try:
        return minimum_near(residuals, start, values, box, 1e-6)
    except LagrangeError:
        return None


def fewest(residuals: Residuals) -> int:
    """Return the number of times before which there are measurements enough to begin with."""
    enough = np.cumsum(residuals.counts) >= 2 * len(residuals.names) + 3
    return min(int(np.argmax(enough)) + 1, len(enough)) if enough.any() else len(enough)


def _followed(residuals: Residuals, values: Array, least: int) -> int:
    """Return how many times the motion follows the measurements for, ``least`` or more."""
    try:
        squares = residuals.by_time(values)
    except LagrangeError:
        return min(least, len(residuals.times))
    mean = np.cumsum(squares) / np.maximum(np.cumsum(residuals.counts), 1)
    left = np.flatnonzero(mean > _FOLLOWED**2)
    left = left[left >= least]
    return int(left[0]) if len(left) else len(residuals.times)


def _fitted_part(residuals: Residuals, values: Array, until: int, box: Box) -> Array:
    """Fit the measurements before a time; values that these do not show hardly change."""
    sizes = np.where(values != 0, np.abs(values), residuals.sizes)
    weights = _INERTIA / sizes
    try:
        solution = _least_squares(
            lambda x: np.concatenate([residuals.residuals(x, until), weights * (x - values)]),
            lambda x: np.vstack([residuals.jacobian(x, until), np.diag(weights)]),
            values,
            box,
            sizes,
            _RUNS_OF_PART,
            1e-3,
        )
    except LagrangeError:
        return values
    return np.asarray(solution.x)


def minimum_near(
    residuals: Residuals, start: Array, values: Array, box: Box, tolerance: float
) -> Minimum:
    """Find the minimum of all measurements near values.

    Parameters
    ----------
    start
        Where the search began.
    tolerance
        Change of values, relative to their sizes, at which they have converged; the sum of squares
        has where it changes by the hundredth part of this.
    """
    sizes = np.where(values != 0, np.abs(values), residuals.sizes)
    functions = residuals.residuals, residuals.jacobian
    solution = _least_squares(*functions, values, box, sizes, _MOST_RUNS, tolerance)
    cost, converged = float(2 * solution.cost), bool(solution.status > 0)
    return Minimum(start, np.asarray(solution.x), cost, converged, solution.active_mask)


def _least_squares(
    function: Callable[[Array], Array],
    jacobian: Callable[[Array], Array],
    values: Array,
    box: Box,
    sizes: Array,
    most: int,
    tolerance: float,
) -> Any:
    from scipy.optimize import least_squares

    return least_squares(
        function,
        values,
        jacobian,
        bounds=(box.lowest, box.highest),
        x_scale=sizes,
        xtol=tolerance,
        ftol=1e-2 * tolerance,
        gtol=1e-14,
        max_nfev=most,
    )


class Standing(Enum):
    """Conclusion from the residuals of the least minimum on other minima.

    ``PROVEN``: they are noise, so small that no other motion leaves such. ``PLAUSIBLE``: other
    minima may be as good. ``DOUBTFUL``: they are hardly noise, and other minima may be better.
    """

    PROVEN = auto()
    PLAUSIBLE = auto()
    DOUBTFUL = auto()


class Search:
    """Minima of the sum of squares from several starts.

    Parameters
    ----------
    residuals
        The residuals.
    box
        Bounds.
    periods
        Changes of values that change nothing, whole turns of starts; infinite where there are none.

    Attributes
    ----------
    minima
        Different minima, by their sums of squares.
    ended
        Number of starts that ended at each of them.
    tried
        Number of starts.
    """

    def __init__(self, residuals: Residuals, box: Box, periods: Array) -> None:
        self._residuals, self._box, self._periods = residuals, box, periods
        self.minima: list[Minimum] = []
        self.ended: list[int] = []
        self.tried = 0

    def go(self, first: Array, number: int | None, judge: Callable[[Minimum], Standing]) -> None:
        """Search from the first values, then from others as long as they may show other minima.

        Parameters
        ----------
        first
            The first values.
        number
            Number of starts; None if the search may end before ``MOST_STARTS``.
        judge
            Says how a minimum stands that is smaller than those before.
        """
        most = MOST_STARTS if number is None else number
        starts = [first, *self._box.points(most - 1)] if most > 1 else [first]
        standing = Standing.DOUBTFUL
        for start in starts:
            self.tried += 1
            self._residuals.deviations = self._residuals.ranges
            minimum = minimum_from(self._residuals, start, self._box)
            if minimum is None or not np.isfinite(minimum.cost):
                continue  # squares of residuals may be beyond doubles
            if self._add(minimum) and number is None:
                standing = judge(minimum)
            if number is None and self._is_enough(standing):
                return

    def _add(self, minimum: Minimum) -> bool:
        """Add a minimum where it belongs; tell if it is a new one, and the least."""
        for k, known in enumerate(self.minima):
            if self.are_same(known, minimum):
                self.ended[k] += 1
                if minimum.cost < known.cost:
                    self.minima[k] = minimum
                return False
        place = sum(known.cost <= minimum.cost for known in self.minima)
        self.minima.insert(place, minimum)
        self.ended.insert(place, 1)
        return place == 0

    def are_same(self, one: Minimum, another: Minimum) -> bool:
        """Tell if the values differ by less than noise shows."""
        lower = min(one, another, key=lambda minimum: minimum.cost)
        change = another.values - one.values
        turning = np.isfinite(self._periods)
        periods = self._periods[turning]
        change[turning] -= periods * np.round(change[turning] / periods)
        self._residuals.deviations = self._residuals.ranges
        seen = self._residuals.jacobian(lower.values) @ change
        noise = max(lower.cost / len(seen), _SAME**2)
        return bool(seen @ seen <= noise)

    def _is_enough(self, standing: Standing) -> bool:
        if standing is not Standing.PLAUSIBLE:
            return standing is Standing.PROVEN or self.ended[0] >= _AGREEING
        # Minima that are much worse count as one: it does not matter how many there are.
        good = sum(m.cost < COMPARED * self.minima[0].cost + EXACT for m in self.minima)
        w, n = good + (good < len(self.minima)), sum(self.ended)
        return n > 1 and w * (w + 1) < _UNSEEN * n * (n - 1)
