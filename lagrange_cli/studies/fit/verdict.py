"""Judgement of a fit: what measurements determine, and whether their noise is what is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.studies.fit.noise import LEVEL, SerialCorrelation, least_of, serial_correlation
from lagrange_cli.studies.fit.residuals import SMALLEST_DEVIATION, Residuals, column_size
from lagrange_cli.studies.fit.search import Box, Minimum, Standing, minimum_near

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory

#: Ratio of singular values of J, its columns of one length, below which a combination of values
#: changes nothing that was measured.
_UNDETERMINED = 1e-7

#: Rounds in which deviations and values are found from each other, and the part of deviations by
#: which these change at last.
_ROUNDS, _SETTLED = 4, 1e-2

#: One start settles a fit only with so many degrees of freedom, with noise of at most this part of
#: each column's variance, and with probabilities of the tests above this.
_FEWEST_DEGREES, _NOISE, _PROBABLE = 15, 0.2, 0.003

#: Times of measurements for each turning point of a column: at equal distances, the next
#: oscillation that has the same values is nine times as fast.
_TIMES_OF_TURN = 5


@dataclass(frozen=True)
class Judged:
    """A minimum with the deviations of noise that hold there.

    Attributes
    ----------
    minimum
        The minimum.
    deviations
        Column → deviations.
    residuals
        Residuals over deviations, shape (n,).
    slopes
        Their derivatives, shape (n, values).
    variance
        Variance of the residuals: 1 where deviations are given, else estimated.
    covariance
        That of the errors of the values, shape (values, values); NaN where values are at bounds.
        All of it is NaN if it does not exist.
    undetermined
        Direction in which the values may change without a change of the residuals; or None.
    size_probability
        That of a larger χ² if the deviations are as given; None where they are not.
    serial
        Tests of the columns for serial correlation, where there is one.
    is_exact
        Whether the motion passes all measurements as exactly as it is known.
    noise
        Largest part of a column's variance that the residuals have.
    """

    minimum: Minimum
    deviations: dict[str, Array]
    residuals: Array
    slopes: Array
    variance: float
    covariance: Array
    undetermined: Array | None
    size_probability: float | None
    serial: dict[str, SerialCorrelation]
    is_exact: bool
    noise: float

    @property
    def serial_probability(self) -> float:
        """Probability that the largest correlation among the columns is as large in white noise."""
        return least_of([test.probability for test in self.serial.values()])

    @property
    def degrees(self) -> int:
        """Measurements less values."""
        return len(self.residuals) - len(self.minimum.values)

    @property
    def score(self) -> float:
        """−2 log L of the residuals, up to what is the same at all minima of the measurements."""
        from_deviations = sum(np.nansum(2 * np.log(x)) for x in self.deviations.values())
        return float(self.residuals @ self.residuals + from_deviations)

    def is_as_good_as(self, best: Judged) -> bool:
        """Tell if noise may make its residuals as much larger than the best ones as they are."""
        from scipy.stats import chi2

        return self.score - best.score < float(chi2.isf(LEVEL, len(self.minimum.values)))

    @property
    def is_white(self) -> bool:
        """True if the residuals are noise of the stated deviations as most noise is."""
        size = 1.0 if self.size_probability is None else self.size_probability
        return self.is_exact or min(size, self.serial_probability) > _PROBABLE

    @property
    def is_small(self) -> bool:
        """True if the motion is well told from its noise, by many measurements."""
        return self.degrees >= _FEWEST_DEGREES and self.noise < _NOISE


def standing(residuals: Residuals, judgement: Judged) -> Standing:
    """Tell what the residuals of the least minimum say of others.

    Two motions that pass the same measurements, closely and often between their turning points, are
    one: then no other minimum is as good. Slow residuals may be those of another motion.
    """
    if not (judgement.minimum.converged and judgement.is_white):
        return Standing.DOUBTFUL
    if not judgement.is_small:
        return Standing.PLAUSIBLE
    motion = residuals.dense_motion(judgement.minimum.values)
    return Standing.PROVEN if _is_resolved(residuals, motion) else Standing.PLAUSIBLE


def judged(residuals: Residuals, minimum: Minimum, box: Box, accuracy: float) -> Judged:
    """Find the deviations of noise at a minimum, move it to where these have it, and judge it.

    The deviations of ``residuals`` are those of the result afterwards.
    """
    settled = _settled(residuals, minimum, box)
    values = settled.values
    r, slopes = residuals.residuals(values), residuals.jacobian(values)
    free = settled.at_bound == 0
    columns = slopes[:, free]
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(lengths > 0, lengths, 1.0)
    directions, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    is_seen = singular > _UNDETERMINED * max(singular, default=0.0)
    undetermined = None
    if not is_seen.all():
        undetermined = np.zeros(len(values))
        undetermined[free] = rows[-1]
    degrees = len(r) - len(values)
    variance = 1.0 if residuals.given else float(r @ r) / degrees
    covariance = np.full((len(values), len(values)), np.nan)
    if undetermined is None and free.any():
        covariance[np.ix_(free, free)] = variance * np.linalg.inv(columns.T @ columns)
    fitted = residuals.fitted(values)
    sizes = _relative_sizes(residuals, fitted)
    return Judged(
        settled,
        residuals.deviations,
        r,
        slopes,
        variance,
        covariance,
        undetermined,
        float(_larger(float(r @ r), degrees)) if residuals.given else None,
        _serial(residuals, r, directions[:, is_seen]),
        all(size <= 10 * max(SMALLEST_DEVIATION, accuracy) for size, _ in sizes),
        max(part for _, part in sizes),
    )


def _settled(residuals: Residuals, minimum: Minimum, box: Box) -> Minimum:
    """Move a minimum to where it is with the deviations of noise."""
    for k in range(_ROUNDS):
        before = residuals.deviations
        residuals.take_deviations(minimum.values)
        changes = [np.nanmax(np.abs(x / before[k] - 1)) for k, x in residuals.deviations.items()]
        if k and max(changes) < _SETTLED:
            break
        minimum = minimum_near(residuals, minimum.start, minimum.values, box, 1e-10)
    return minimum


def _relative_sizes(residuals: Residuals, fitted: dict[str, Array]) -> list[tuple[float, float]]:
    """Return the residuals of columns over their ranges, and their parts of the variances."""
    sizes = []
    for name, column in fitted.items():
        present = residuals.present[name]
        measured = residuals.measurements.values[name][present]
        square = float(np.mean((measured - column[present]) ** 2))
        variance = float(np.var(measured))
        part = square / variance if variance > 0 else 1.0
        sizes.append((float(np.sqrt(square)) / column_size(measured), part))
    return sizes


def _larger(square: float, degrees: int) -> float:
    from scipy.stats import chi2

    return float(chi2.sf(square, degrees))


def _serial(residuals: Residuals, r: Array, taken: Array) -> dict[str, SerialCorrelation]:
    tests, first = {}, 0
    for name, present in residuals.present.items():
        last = first + int(present.sum())
        test = serial_correlation(r, slice(first, last), taken)
        if test is not None:
            tests[name] = test
        first = last
    return tests


def _is_resolved(residuals: Residuals, motion: Trajectory) -> bool:
    """Tell if there are times enough between the turning points of the motion that was measured."""
    seen = (motion.t >= residuals.times[0]) & (motion.t <= residuals.times[-1])
    for name in residuals.present:
        rates = np.sign(np.diff(motion.columns[name][seen]))
        turns = int((np.diff(rates[rates != 0]) != 0).sum())
        if len(residuals.times) < _TIMES_OF_TURN * turns:
            return False
    return True
