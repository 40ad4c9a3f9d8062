"""Tests of residuals against noise: their size, and their correlation from one to the next.

Residuals of a motion that passes measurements are these measurements' noise. If it does not, they
still show the motion: neighbours have like signs. G. M. Ljung and G. E. P. Box, Biometrika 65
(1978), p. 297, sum the squares of the correlations rₖ of n residuals at the first h lags,

    Q = n (n + 2) Σ rₖ²/(n − k),

which has a χ² distribution of h degrees of freedom for white noise, if n is large. A fit takes what
it can of the noise, so that few residuals are less correlated than noise; the distribution of
theirs is sampled: noise is drawn, and what its fit would take is removed from it by the derivatives
of the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array

#: Part of fits to white noise of the stated size that are told to contradict it.
LEVEL = 1e-3

#: Lags at most, and the part of a column's residuals that they may span.
_MOST_LAGS, _PART_OF_COLUMN = 10, 5

#: Residuals of a column above which Q has its distribution of large samples, and draws below it.
_LARGE, _DRAWS = 400, 9999

#: Numbers of draws that are held at a time.
_CHUNK = 2_000_000

#: Probabilities by the distribution of large samples within which draws decide.
_UNDECIDED = 1e-9, 0.1


@dataclass(frozen=True)
class SerialCorrelation:
    """Test of a column's residuals for serial correlation by Ljung and Box.

    Attributes
    ----------
    statistic
        Their Q.
    lags
        Number of lags.
    probability
        That of a larger Q for white noise.
    """

    statistic: float
    lags: int
    probability: float


def serial_correlation(residuals: Array, column: slice, taken: Array) -> SerialCorrelation | None:
    """Test a column's residuals in the order of time; None if they are too few, or all zero.

    Parameters
    ----------
    residuals
        Residuals of all columns over their deviations, shape (n,).
    column
        Those of the column.
    taken
        Orthonormal directions in which a fit takes noise, shape (n, values).
    """
    from scipy.stats import chi2

    of_column = residuals[column]
    count = len(of_column)
    lags = min(_MOST_LAGS, count // _PART_OF_COLUMN)
    if lags < 1 or not np.any(of_column):
        return None
    statistic = float(_portmanteau(of_column[np.newaxis], lags)[0])
    probability = float(chi2.sf(statistic, lags))
    if count <= _LARGE and _UNDECIDED[0] < probability < _UNDECIDED[1]:
        probability = _drawn_probability(statistic, lags, column, taken)
    return SerialCorrelation(statistic, lags, probability)


def _portmanteau(rows: Array, lags: int) -> Array:
    """Return Q of each row."""
    count = rows.shape[1]
    squares = np.einsum("ij,ij->i", rows, rows)
    total = np.zeros(len(rows))
    for k in range(1, lags + 1):
        products = np.einsum("ij,ij->i", rows[:, k:], rows[:, :-k])
        total += (products / squares) ** 2 / (count - k)
    return np.asarray(count * (count + 2) * total)


def _drawn_probability(statistic: float, lags: int, column: slice, taken: Array) -> float:
    """Return the part of draws of white noise, less what a fit takes, with a larger Q."""
    generator = np.random.default_rng(0)
    larger, left = 0, _DRAWS
    while left:
        number = min(left, max(1, _CHUNK // len(taken)))
        noise = generator.standard_normal((number, len(taken)))
        left_over = noise[:, column] - (noise @ taken) @ taken[column].T
        larger += int((_portmanteau(left_over, lags) >= statistic).sum())
        left -= number
    return (larger + 1) / (_DRAWS + 1)


def least_of(probabilities: Sequence[float]) -> float:
    """Return the probability that the least of several is as small, by Bonferroni's bound."""
    return min(1.0, len(probabilities) * min(probabilities)) if probabilities else 1.0
