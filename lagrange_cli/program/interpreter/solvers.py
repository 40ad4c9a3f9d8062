"""Solution of equations in doubles: the routines that a :class:`Solve` calls.

Small systems are solved by the routines of all languages, which run as they are. Dense ones of more
rows are solved by LAPACK.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.program.interpreter.values import solution_shape
from lagrange_cli.program.lowered.functions import Solve
from lagrange_cli.program.lowered.routines.numbers import EPSILON
from lagrange_cli.program.lowered.routines.registry import ROUTINES

Array: TypeAlias = NDArray[np.floating[Any]]

#: Rows up to which a routine of Python takes less time than LAPACK, as measured: 8 and 19
#: microseconds for a definite matrix of 6, 35 and 23 of 12. Saddles are solved by their routine
#: alone, whose scaling and refinement LAPACK has not: those of shipped scenes have 13 rows at most.
_LARGEST = {"definite": 8, "pivoted": 8, "columns": 4}


def solution(step: Solve, matrix: Sequence[float], right: Sequence[float]) -> list[float]:
    """Solve equations of which the numbers are given by rows.

    Raises
    ------
    ArithmeticError, numpy.linalg.LinAlgError
        There is no solution.
    """
    rows = solution_shape(step)[0]
    if step.routine in _LARGEST and rows > _LARGEST[step.routine]:
        with np.errstate(all="ignore"):
            solved = _WITH_NUMPY[step.routine](step, np.array(matrix), np.array(right))
        unknowns: list[float] = solved.ravel().tolist()
        return unknowns
    unknowns = list(right)
    scratch = [[0.0] * size for size in _scratch_sizes(step, rows)]
    sizes = (step.sizes[0], step.sizes[1]) if step.routine == "saddle" else step.sizes
    if not ROUTINES[step.routine](*sizes, *step.tables, list(matrix), unknowns, *scratch):
        raise ArithmeticError("a singular matrix")
    return unknowns


def _scratch_sizes(step: Solve, rows: int) -> Sequence[int]:
    """Return the sizes of the arrays that a routine overwrites behind its arguments."""
    if step.routine == "saddle":
        return rows, rows * rows, rows
    if step.routine == "sparse":
        return rows, rows
    return () if step.routine == "pivoted" else (rows,)


def _square(matrix: Array, size: int) -> Array:
    return matrix.reshape(size, size)


def _definite(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve with a positive definite matrix, whose Cholesky factor holds the roots of pivots."""
    a = _square(matrix, step.sizes[0])
    d = np.linalg.cholesky(a).diagonal()
    if not (d * d > EPSILON * a.diagonal()).all():
        raise ArithmeticError("a singular matrix")
    return np.linalg.solve(a, right)


def _pivoted(step: Solve, matrix: Array, right: Array) -> Array:
    return np.linalg.solve(_square(matrix, step.sizes[0]), right)


def _columns(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve with a symmetric matrix and the columns of a right-hand side.

    Units do not matter: rows and columns are scaled alike by powers of two first (Ruiz,
    RAL-TR-2001-034).
    """
    _, size, columns = step.sizes
    a, b = _square(matrix, size), right.reshape(size, columns)
    d = np.ones(size)
    for _ in range(4):
        sizes = (np.abs(a) * d).max(axis=1) * d
        d = np.where(sizes > 0.0, np.ldexp(d, (-np.frexp(sizes)[1]) // 2), d)
    return d[:, None] * np.linalg.solve(a * d * d[:, None], b * d[:, None])


_WITH_NUMPY: dict[str, Callable[[Solve, Array, Array], Array]] = {
    "definite": _definite,
    "pivoted": _pivoted,
    "columns": _columns,
}
