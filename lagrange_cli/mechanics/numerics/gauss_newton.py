"""Gauss–Newton steps in doubles for equations in decimals of high precision.

Of many equations, most hold few unknowns: beyond :data:`_LARGE` of them the step
A⁺ r = Aᵀ (A Aᵀ)⁻¹ r is computed by sparse elimination, with a small multiple of the
unit matrix added so that equations that depend on others do no harm
(Tikhonov's regularization; Björck, Numerical Methods for Least Squares
Problems, 1996, sections 2.7 and 6.1).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any, TypeAlias

import mpmath
import numpy as np
from numpy.typing import NDArray

from lagrange_cli.mechanics.numerics.bounded_functions import DomainError
from lagrange_cli.mechanics.numerics.sampling import to_double

if TYPE_CHECKING:
    from scipy.sparse import csr_array

SparseRow: TypeAlias = Mapping[int, Any]
"""The entries of a row that are not zero, by column."""

_ZERO = Decimal(0)

#: Part of the largest singular value below which one is left out of a step: about the square root
#: of a double's rounding, so that dependent equations do no harm and independent ones count.
_CUT = 1e-7

#: Number of equations above which the step is found by sparse elimination: for fewer, the dense
#: singular value decomposition is quick. Not tuned.
_LARGE = 64

#: Least largest entry of a row that is converted to doubles: below, they lose digits.
SMALLEST_TRUSTED = 1e-280

_Matrix = NDArray[np.float64]


class LeastSquares:
    """Factored rows of a linear system, for steps towards its solution.

    Parameters
    ----------
    rows
        Decimals, or a sparse matrix of doubles.
    scale
        Units of the unknowns: steps are smallest in them.
    """

    def __init__(self, rows: Sequence[SparseRow] | csr_array, scale: Sequence[Decimal]) -> None:
        self._width = len(scale)
        if isinstance(rows, Sequence):
            numbers, columns, entries, self._largest = _equilibrated(rows, scale)
        else:
            numbers, columns, entries, self._largest = _of_matrix(rows, scale)
        self._solve = None
        if len(entries):
            prepare = _dense if len(self._largest) <= _LARGE else _sparse
            shape = len(self._largest), self._width
            self._solve = prepare((numbers, columns), entries, shape)

    def step(self, values: Sequence[Decimal]) -> list[Decimal]:
        """Find the least step, in units of ``scale``, that removes the values to first order.

        Raises
        ------
        ZeroDivisionError
            There is none.
        """
        pairs = zip(values, self._largest, strict=True)
        right = [x / d if d else _ZERO for x, d in pairs]
        # Doubles reach down to 1e-308 only, while residuals shrink with the digits carried.
        size = max((abs(x) for x in right), default=_ZERO)
        if not size:
            return [_ZERO] * self._width
        step = self._solved(np.array([to_double(x / size) for x in right]))
        return [size * Decimal(x) for x in step.tolist()]

    def in_doubles(self, values: _Matrix) -> _Matrix:
        """Find the step in doubles alone, shape (width,)."""
        largest = np.array([to_double(d) for d in self._largest])
        return self._solved(values / np.where(largest, largest, np.inf))

    def _solved(self, right: _Matrix) -> _Matrix:
        step = np.zeros(self._width) if self._solve is None else self._solve(right)
        if not np.isfinite(step).all():
            raise ZeroDivisionError
        return step


def least_norm_solution(
    rows: Sequence[SparseRow], target: Sequence[Decimal], scale: Sequence[Decimal]
) -> list[Decimal]:
    """Solve rows·x = target to all digits carried, with the least norm of x/``scale`` in doubles.

    Raises
    ------
    ZeroDivisionError
        There is none.
    """
    solution, system = [_ZERO] * len(scale), LeastSquares(rows, scale)
    missing, before = list(target), Decimal("Infinity")
    # Decimals do not underflow: a remainder can shrink without an end.
    rounding = max(map(abs, target), default=_ZERO) * Decimal(10) ** -mpmath.mp.dps
    while (size := max(map(abs, missing), default=_ZERO)) > rounding and 2 * size < before:
        step = system.step(missing)
        solution = [x + unit * y for x, unit, y in zip(solution, scale, step, strict=True)]
        before = size
        missing = [
            x - sum((entry * solution[j] for j, entry in row.items()), _ZERO)
            for x, row in zip(target, rows, strict=True)
        ]
    return solution


_Numbers: TypeAlias = NDArray[np.int64]
_Places: TypeAlias = tuple[_Numbers, _Numbers]
_Solve: TypeAlias = Callable[[_Matrix], _Matrix]


#: Row, column and value of each entry, and the largest of each row that they are divided by.
_Equilibrated: TypeAlias = tuple[_Numbers, _Numbers, _Matrix, list[Decimal]]


def _equilibrated(rows: Sequence[SparseRow], scale: Sequence[Decimal]) -> _Equilibrated:
    """Scale columns by ``scale`` and rows to 1, which brings them into the range of doubles."""
    scaled = [{j: x * scale[j] for j, x in row.items() if x} for row in rows]
    largest = [max(map(abs, row.values()), default=_ZERO) for row in scaled]
    numbers = np.array([k for k, row in enumerate(scaled) for _ in row], np.int64)
    columns = np.array([j for row in scaled for j in row], np.int64)
    pairs = zip(scaled, largest, strict=True)
    entries = np.array([to_double(x / d) for row, d in pairs for x in row.values()])
    return numbers, columns, entries, largest


def _of_matrix(matrix: csr_array, scale: Sequence[Decimal]) -> _Equilibrated:
    coordinates = matrix.tocoo()
    numbers, columns = coordinates.row.astype(np.int64), coordinates.col.astype(np.int64)
    entries = coordinates.data * np.array([to_double(s) for s in scale])[columns]
    largest = np.zeros(matrix.shape[0])
    np.maximum.at(largest, numbers, np.abs(entries))
    if not (largest > SMALLEST_TRUSTED).all() or not np.isfinite(largest).all():
        raise DomainError  # beyond the range of doubles, or close to its end
    return numbers, columns, entries / largest[numbers], [Decimal(x) for x in largest.tolist()]


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
