"""Least-squares steps in doubles towards the solution of equations in high precision.

Of many equations, most hold few unknowns: beyond :data:`_LARGE` of them the
step A⁺ r = Aᵀ (A Aᵀ)⁻¹ r is found by sparse elimination, with a trace of the
unit matrix added so that equations that depend on others do no harm
(Tikhonov's regularization; Björck, Numerical Methods for Least Squares
Problems, 1996, sections 2.7 and 6.1).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import mpmath
import numpy as np
from mpmath import mpf
from numpy.typing import NDArray

from lagrange_cli.mechanics.sampling import double

__all__ = ["Row", "least", "repetitions", "smallest"]

Row: TypeAlias = Mapping[int, mpf]
"""The entries of a row that are not zero, by column."""

_ZERO = mpf(0)

#: Singular values below this part of the largest are left out of a step.
_CUT = 1e-7

#: Above this number of equations the step is found by sparse elimination.
_LARGE = 64

_Matrix = NDArray[np.float64]


def least(values: Sequence[mpf], rows: Sequence[Row], scale: Sequence[mpf]) -> list[mpf]:
    """The smallest step, in units of ``scale``, that removes the values to first order.

    Raises
    ------
    ZeroDivisionError
        There is none.
    """
    units = [double(s) for s in scale]
    scaled = [{j: double(x) * units[j] for j, x in row.items()} for row in rows]
    largest = [max(map(abs, row.values()), default=0.0) for row in scaled]
    right = [x / mpf(d) if d else _ZERO for x, d in zip(values, largest, strict=True)]
    # Doubles reach down to 1e-308 only, while residuals shrink with the digits carried.
    size = max((abs(x) for x in right), default=_ZERO)
    if not size:
        return [_ZERO] * len(units)
    columns = [j for row in scaled for j in row]
    entries = [x / (d or 1.0) for row, d in zip(scaled, largest, strict=True) for x in row.values()]
    numbers = [k for k, row in enumerate(scaled) for _ in row]
    solve = _dense if len(rows) <= _LARGE else _sparse
    target = np.array([double(x / size) for x in right])
    step = solve((numbers, columns), entries, target, len(units))
    if not np.isfinite(step).all():
        raise ZeroDivisionError
    return [size * mpf(x) for x in step]


def smallest(rows: Sequence[Row], target: Sequence[mpf], scale: Sequence[mpf]) -> list[mpf]:
    """The smallest x, in units of ``scale``, with rows·x = target to all digits carried.

    Raises
    ------
    ZeroDivisionError
        There is none.
    """
    found = [_ZERO] * len(scale)
    for _ in range(repetitions()):
        missing = [
            x - sum((entry * found[j] for j, entry in row.items()), _ZERO)
            for x, row in zip(target, rows, strict=True)
        ]
        step = least(missing, rows, scale)
        found = [x + unit * y for x, unit, y in zip(found, scale, step, strict=True)]
    return found


def repetitions() -> int:
    """Solutions in doubles that linear equations need for the digits carried."""
    return int(mpmath.mp.dps) // 12 + 2


_Places: TypeAlias = tuple[list[int], list[int]]


def _dense(places: _Places, entries: list[float], target: _Matrix, width: int) -> _Matrix:
    matrix = np.zeros((len(target), width))
    matrix[places] = entries
    step: _Matrix = np.linalg.pinv(matrix, rcond=_CUT) @ target
    return step


def _sparse(places: _Places, entries: list[float], target: _Matrix, width: int) -> _Matrix:
    from scipy.sparse import csc_array, eye_array
    from scipy.sparse.linalg import splu

    matrix = csc_array((entries, places), shape=(len(target), width))
    normal = (matrix @ matrix.T + _CUT**2 * eye_array(len(target))).tocsc()
    try:
        step: _Matrix = matrix.T @ splu(normal).solve(target)
    except RuntimeError as error:
        raise ZeroDivisionError from error
    return step
