"""Solution of equations in doubles, with NumPy: the routines that a :class:`Solve` calls.

The methods are those of emitted code. Where there is no solution they raise an ArithmeticError, or
NumPy's LinAlgError.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.program.lowered.functions import Solve
from lagrange_cli.program.solvers.tolerances import LARGEST_EXPONENT, LEAST_INERTIA, UNEVEN_PIVOT

Array: TypeAlias = NDArray[np.floating[Any]]

#: A pivot below this multiple of its diagonal entry is rounding error.
_ROUNDING = 2.0**-53

#: Below the exponent of every number.
_LEAST = -65536


def solution(step: Solve, matrix: Sequence[float], right: Sequence[float]) -> list[float]:
    """Solve equations of which the numbers are given by rows."""
    solved: list[float] = solve(step, np.array(matrix), np.array(right)).ravel().tolist()
    return solved


def solve(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve equations; the numbers of matrix and right-hand side may be overwritten."""
    with np.errstate(all="ignore"):
        return _ROUTINES[step.routine](step, matrix, right)


def _square(matrix: Array, size: int) -> Array:
    return matrix.reshape(size, size)


def _definite(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve with a positive definite matrix, whose Cholesky factor holds the roots of pivots."""
    a = _square(matrix, step.sizes[0])
    d = np.linalg.cholesky(a).diagonal()
    if not (d * d > _ROUNDING * a.diagonal()).all():
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
        if not abs(a[best, j]) > s * _ROUNDING:
            raise ArithmeticError("a singular matrix")
        a[[j, best]] = a[[best, j]]
        b[[j, best]] = b[[best, j]]
        ratio = a[j + 1 :, j] / a[j, j]
        a[j + 1 :, j:] -= ratio[:, None] * a[j, j:]
        b[j + 1 :] -= ratio * b[j]
    for j in reversed(range(s)):
        b[j] = (b[j] - a[j, j + 1 :] @ b[j + 1 :]) / a[j, j]
    return b


def _banded(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve with a positive definite band, S = L D Lᵀ; row k holds the diagonal and its right."""
    m, w = step.sizes[0], step.sizes[1] + 1
    a, b = np.zeros((m + w, w)), np.concatenate([right, np.zeros(w)])
    a[:m] = matrix.reshape(m, w)
    bounds = m * _ROUNDING * a[:, 0]
    for k in range(m):
        if not a[k, 0] > bounds[k]:
            raise ArithmeticError("a singular matrix")
        ratio = a[k, 1:] / a[k, 0]
        for i in range(1, w):
            a[k + i, : w - i] -= ratio[i - 1] * a[k, i:]
        b[k + 1 : k + w] -= ratio * b[k]
        b[k] /= a[k, 0]
        a[k, 1:] = ratio
    for k in reversed(range(m)):
        b[k] -= np.dot(a[k, 1:], b[k + 1 : k + w])
    return b[:m]


def _sparse(step: Solve, matrix: Array, right: Array) -> Array:
    """Solve with a positive definite matrix whose lower triangle is given by rectangles.

    Each rectangle is some neighbouring columns with nonzeros in the same rows, S = L D Lᵀ. Of
    each, the first table has its first column, the numbers of its columns and rows, where its
    numbers and its rows start, and where its updates end. Of each update the third table has the
    rectangle that it comes from, which of its rows are columns of this one, and where in the fourth
    all later rows of it stand among the rows of this one.
    """
    m, b = step.sizes[0], right
    first, rows, third, spots = map(np.array, step.tables)
    node, sources = first.reshape(-1, 6), third.reshape(-1, 4)
    blocks = [matrix[at : at + c * h].reshape(c, h) for _, c, h, at, _, _ in node]
    bounds = m * _ROUNDING * np.concatenate([block.diagonal() for block in blocks])
    pivots = np.empty(m)
    update = 0
    for (start, columns, height, _, at, end), block in zip(node, blocks, strict=True):
        for source, low, high, spot in sources[update:end]:
            known = pivots[_columns_of(node[source])]
            _update(block, blocks[source], known, (low, high), spots[spot:])
        update = end
        below = rows[at : at + height]
        for k in range(columns):
            pivot = block[k, k]
            if not pivot > bounds[start + k]:
                raise ArithmeticError("a singular matrix")
            pivots[start + k] = pivot
            for j in range(k + 1, columns):
                block[j, j:] -= block[k, j] / pivot * block[k, j:]
            block[k, k + 1 :] /= pivot
            b[below[k + 1 :]] -= block[k, k + 1 :] * b[start + k]
    b[:m] /= pivots
    for (start, columns, height, _, at, _), block in zip(node[::-1], blocks[::-1], strict=True):
        below = rows[at : at + height]
        for k in reversed(range(columns)):
            b[start + k] -= np.dot(block[k, k + 1 :], b[below[k + 1 :]])
    return b


def _columns_of(node: Any) -> slice:
    return slice(node[0], node[0] + node[1])


def _update(
    block: Array, source: Array, pivots: Array, bounds: tuple[int, int], spots: Any
) -> None:
    """Subtract what elimination by the columns of an earlier rectangle takes from a later one."""
    low, high = bounds
    scaled = pivots[:, None] * source
    where = spots[: source.shape[1] - low]
    change = scaled[:, low:high].T @ source[:, low:]
    for k in range(high - low):
        block[where[k], where[k:]] -= change[k, k:]


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


_ROUTINES: dict[str, Callable[[Solve, Array, Array], Array]] = {
    "definite": _definite,
    "pivoted": _pivoted,
    "saddle": _saddle,
    "banded": _banded,
    "sparse": _sparse,
    "columns": _columns,
}
