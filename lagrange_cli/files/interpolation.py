"""Recordings as polynomials between their rows.

Between two rows an input is a polynomial in the time since the first of them: that row's
value (``previous``), a straight line (``linear``), or a cubic (``cubic``) with two
continuous derivatives at all rows and a third one at the second and the last but one (the
"not-a-knot" spline; de Boor, *A Practical Guide to Splines*, IV).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files.recordings import Interpolation, Recording, read_recording

#: Number of coefficients of the polynomials of each interpolation.
COEFFICIENTS: dict[Interpolation, int] = {"previous": 1, "linear": 2, "cubic": 4}

_Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Polynomials:
    """A recorded input as a polynomial in time between each two of its rows.

    Attributes
    ----------
    recording
        The column that it was read from.
    starts
        Times at which the polynomials begin, shape (n,), increasing.
    coefficients
        Coefficients of powers of the time since the start, the lowest first, shape (n, k).
    end
        Time until which the last polynomial holds; infinite if the last value is held.
    """

    recording: Recording
    starts: _Array
    coefficients: _Array
    end: float

    def rates(self, order: int) -> Polynomials:
        """Return the derivatives of the polynomials of some order."""
        coefficients = self.coefficients
        for _ in range(order):
            coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
        return replace(self, coefficients=coefficients)


def polynomials(recording: Recording) -> Polynomials:
    """Read a recording and interpolate between its rows.

    Raises
    ------
    InputError
        Located: it cannot be read, or changes faster than doubles can say.
    """
    rows = read_recording(recording)
    times, values = np.array(rows.times), np.array(rows.values)
    if recording.interpolation == "previous":
        # A value that is held until the next row is held after the last row too.
        return Polynomials(recording, times, values[:, None], math.inf)
    with np.errstate(all="ignore"):
        coefficients = _coefficients(recording.interpolation, times, values)
    bad = np.flatnonzero(~np.isfinite(coefficients).all(axis=1))
    if len(bad):
        raise InputError(
            Problem(
                f"'{recording.file}' changes faster than doubles can say"
                f" after t = {rows.times[bad[0]]!r}",
                recording.mark,
                rule="recording",
            )
        )
    return Polynomials(recording, times[:-1], coefficients, rows.times[-1])


def _coefficients(interpolation: Interpolation, times: _Array, values: _Array) -> _Array:
    slopes = np.diff(values) / np.diff(times)
    if interpolation == "linear" or not np.isfinite(slopes).all():
        return np.column_stack([values[:-1], slopes])
    from scipy.interpolate import CubicSpline

    try:
        return np.asarray(np.flip(CubicSpline(times, values).c, axis=0).T)
    except (ValueError, np.linalg.LinAlgError):
        return np.full((len(slopes), 4), np.nan)
