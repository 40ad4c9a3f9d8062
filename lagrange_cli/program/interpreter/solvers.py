"""Solution of equations in doubles: the routines that a :class:`Solve` calls.

Small systems are solved by the routines of all languages, which run as they are. Dense ones of more
rows are solved by the same methods with NumPy.
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
from lagrange_cli.program.solvers.tolerances import LARGEST_EXPONENT, LEAST_INERTIA, UNEVEN_PIVOT

Array: TypeAlias = NDArray[np.floating[Any]]

#: Rows up to which a routine of Python takes less time than NumPy, as measured: 77 and 260
#: microseconds for a saddle of 10 rows, 0.42 and 0.55 ms of 20, 8 and 19 microseconds for a
#: definite matrix of 6, 35 and 23 of 12. Bands and sparse matrices have no form for NumPy.
_LARGEST = {"definite": 8, "pivoted": 8, "saddle": 20, "columns": 4}

#: Below the exponent of every number.
_LEAST = -65536


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


def _saddle(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve M x = f + Gᵀ λ, G x = g for [x, λ].

    Units do not matter: rows and columns are scaled by powers of two (Bunch, *J. ACM* 18 (1971)
    566). Where M is nearly singular the solution is refined once (Skeel, *Math. Comput.* 35 (1980)
    817).
    """
    n, b = step.sizes[0], right
    a = _square(matrix, len(b))
    size = np.abs(a[:n, :n]).max()
    unit = np.ldexp(1.0, -np.frexp(size)[1]) if size > 0.0 else 1.0
    a[:n, :n] *= unit
    b[:n] *= unit
    uneven = _is_uneven(a[:n, :n])
    d = np.zeros(len(b))
    if uneven:
        d[:n] = _inertia_scales(a, n)
    _equilibrate(a, d)
    a *= d[:, None]
    a *= d
    b *= d
    x = _eliminated(a.copy(), b.copy())
    if uneven:
        x += _eliminated(a.copy(), b - a @ x)
    x *= d
    x[n:] /= -unit
    if not np.isfinite(x).all():
        raise ArithmeticError("not finite")
    return x


def _equilibrate(a: Array, d: Array) -> None:
    """Find scales of the rows that have none, each from those that it meets."""
    stuck = False
    while not d.all():
        before = np.count_nonzero(d)
        for i in np.flatnonzero(d == 0.0):
            entries = np.abs(a[i]) * (1.0 if stuck else d)
            size = max(entries.max(), np.sqrt(np.abs(a[i, i])))
            if size > 0.0:
                d[i] = 1.0 if stuck else np.ldexp(1.0, -np.frexp(size)[1])
                stuck = False
        if np.count_nonzero(d) == before:
            if stuck:
                raise ArithmeticError("a row of zeros")
            stuck = True


def _is_uneven(m: Array) -> bool:
    """Tell if elimination leaves little of an inertia; coordinates without any do not count."""
    c = m.copy()
    for k, inertia in enumerate(m.diagonal()):
        beyond = c[k, k + 1 :]
        if inertia > LEAST_INERTIA:
            even = c[k, k] > UNEVEN_PIVOT * inertia
        else:
            even = not np.delete(m[k], k).any()
        if not even:
            return True
        if beyond.any():
            c[k + 1 :, k + 1 :] -= np.outer(beyond / c[k, k], beyond)
    return False


def _inertia_scales(a: Array, n: int) -> Array:
    """Return one over the root of the inertia of each coordinate, or of w g² where that is more.

    g is the gradient of a closure, and w the second smallest ratio of inertias over g² that it
    meets, if there are two. The scale is 0 without either.
    """
    inertia = a.diagonal()[:n]
    exponents = np.where(inertia != 0.0, np.frexp(inertia)[1], _LEAST)
    sizes = exponents.copy()
    for g in a[n:, :n]:
        squares = 2 * np.frexp(g)[1]
        both = (g != 0.0) & (inertia != 0.0)
        if both.any():
            smallest = np.sort((exponents - squares)[both])[:2]
            w = min(smallest[-1], LARGEST_EXPONENT)
            sizes = np.where(g != 0.0, np.maximum(sizes, w + squares), sizes)
    return np.where(sizes > _LEAST, np.ldexp(1.0, -np.ceil(sizes / 2).astype(int)), 0.0)


def _eliminated(a: Array, b: Array) -> Array:
    """Solve a x = b by elimination with partial pivoting, in place."""
    s = len(b)
    for j in range(s):
        best = j + int(np.argmax(np.abs(a[j:, j])))
        if not abs(a[best, j]) > s * EPSILON:
            raise ArithmeticError("a singular matrix")
        a[[j, best]] = a[[best, j]]
        b[[j, best]] = b[[best, j]]
        ratio = a[j + 1 :, j] / a[j, j]
        a[j + 1 :, j:] -= ratio[:, None] * a[j, j:]
        b[j + 1 :] -= ratio * b[j]
    for j in reversed(range(s)):
        b[j] = (b[j] - a[j, j + 1 :] @ b[j + 1 :]) / a[j, j]
    return b


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
    "saddle": _saddle,
    "columns": _columns,
}
