"""Least-squares steps in doubles towards the solution of equations in high precision.

Of many equations, most hold few unknowns: beyond :data:`_LARGE` of them the
step A⁺ r = Aᵀ (A Aᵀ)⁻¹ r is found by sparse elimination, with a trace of the
unit matrix added so that equations that depend on others do no harm
(Tikhonov's regularization; Björck, Numerical Methods for Least Squares
Problems, 1996, sections 2.7 and 6.1).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import mpmath
import numpy as np
from mpmath import mpf
from numpy.typing import NDArray

from lagrange_cli.mechanics.sampling import double

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["LeastSquares", "Row", "repetitions", "smallest"]

Row: TypeAlias = Mapping[int, Any]
"""The entries of a row that are not zero, by column."""

_ZERO = mpf(0)

#: Singular values below this part of the largest are left out of a step.
_CUT = 1e-7

#: Above this number of equations the step is found by sparse elimination.
_LARGE = 64

_Matrix = NDArray[np.float64]


class LeastSquares:
    """Rows of a linear system, made ready for steps towards its solution.

    Parameters
    ----------
    rows
        Numbers of any kind, or a sparse matrix of doubles.
    scale
        Units of the unknowns: steps are smallest in them.
    """

    def __init__(self, rows: Sequence[Row] | csr_array, scale: Sequence[mpf]) -> None:
        units = np.array([double(s) for s in scale])
        count, self._width = len(rows) if isinstance(rows, Sequence) else rows.shape[0], len(units)
        numbers, columns, entries = _entries(rows)
        entries = entries * units[columns]
        self._largest = np.zeros(count)
        np.maximum.at(self._largest, numbers, np.abs(entries))
        self._solve = None
        if self._largest.any():
            entries = entries / np.where(self._largest, self._largest, 1.0)[numbers]
            prepare = _dense if count <= _LARGE else _sparse
            self._solve = prepare((numbers, columns), entries, (count, self._width))

    def step(self, values: Sequence[mpf]) -> list[mpf]:
        """The smallest step, in units of ``scale``, that removes the values to first order.

        Raises
        ------
        ZeroDivisionError
            There is none.
        """
        pairs = zip(values, self._largest.tolist(), strict=True)
        right = [x / mpf(d) if d else _ZERO for x, d in pairs]
        # Doubles reach down to 1e-308 only, while residuals shrink with the digits carried.
        size = max((abs(x) for x in right), default=_ZERO)
        if not size:
            return [_ZERO] * self._width
        step = self._solved(np.array([double(x / size) for x in right]))
        return [size * mpf(x) for x in step.tolist()]

    def in_doubles(self, values: _Matrix) -> _Matrix:
        """The same where doubles are enough."""
        return self._solved(values / np.where(self._largest, self._largest, np.inf))

    def _solved(self, right: _Matrix) -> _Matrix:
        step = np.zeros(self._width) if self._solve is None else self._solve(right)
        if not np.isfinite(step).all():
            raise ZeroDivisionError
        return step


def smallest(rows: Sequence[Row], target: Sequence[mpf], scale: Sequence[mpf]) -> list[mpf]:
    """The smallest x, in units of ``scale``, with rows·x = target to all digits carried.

    Raises
    ------
    ZeroDivisionError
        There is none.
    """
    found, system = [_ZERO] * len(scale), LeastSquares(rows, scale)
    for _ in range(repetitions()):
        missing = [
            x - sum((entry * found[j] for j, entry in row.items()), _ZERO)
            for x, row in zip(target, rows, strict=True)
        ]
        if not any(missing):
            break
        step = system.step(missing)
        found = [x + unit * y for x, unit, y in zip(found, scale, step, strict=True)]
    return found


def repetitions() -> int:
    """Solutions in doubles that linear equations need for the digits carried."""
    return int(mpmath.mp.dps) // 12 + 2


_Numbers: TypeAlias = NDArray[np.int64]
_Places: TypeAlias = tuple[_Numbers, _Numbers]
_Solve: TypeAlias = Callable[[_Matrix], _Matrix]


def _entries(rows: Sequence[Row] | csr_array) -> tuple[_Numbers, _Numbers, _Matrix]:
    """Row, column and value of each entry."""
    if not isinstance(rows, Sequence):
        coordinates = rows.tocoo()
        return coordinates.row.astype(np.int64), coordinates.col.astype(np.int64), coordinates.data
    numbers = [k for k, row in enumerate(rows) for _ in row]
    columns = [j for row in rows for j in row]
    entries = [double(x) for row in rows for x in row.values()]
    return np.array(numbers, np.int64), np.array(columns, np.int64), np.array(entries, np.float64)


def _dense(places: _Places, entries: _Matrix, shape: tuple[int, int]) -> _Solve:
    matrix = np.zeros(shape)
    matrix[places] = entries
    return lambda target: np.asarray(np.linalg.lstsq(matrix, target, rcond=_CUT)[0])


def _sparse(places: _Places, entries: _Matrix, shape: tuple[int, int]) -> _Solve:
    from scipy.sparse import csc_array, eye_array
    from scipy.sparse.linalg import splu

    matrix = csc_array((entries, places), shape=shape)
    normal = (matrix @ matrix.T + _CUT**2 * eye_array(shape[0])).tocsc()
    try:
        factors = splu(normal)
    except RuntimeError as error:
        raise ZeroDivisionError from error
    return lambda target: np.asarray(matrix.T @ factors.solve(target))
