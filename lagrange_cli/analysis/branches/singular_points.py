"""Folds and branch points in many digits, by systems of equations that are regular there.

A fold is a zero of F, F_x φ, φ₀·φ − 1 (G. Moore and A. Spence, SIAM J. Numer. Anal. 17 (1980)
567), a simple branch point one of F + μ ψ, Jᵀψ, ψ₀·ψ − 1 with μ = 0; where μ is not zero the
branches miss each other (W. Govaerts 2000, ch. 8). The directions of both branches solve the
algebraic branching equation ψ·F_yy t t = 0 on the null space of J (H. B. Keller 1977).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import mpmath
import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.branches.curve import DIGITS
from lagrange_cli.analysis.values import Matrix, Mpf
from lagrange_cli.mechanics.numerics.autodiff import DomainError

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.curve import Space

#: Steps of Newton's method, and the size of the last one, relative to the unknowns.
_STEPS, _LAST = 40, mpf(10) ** -40
#: Size of a last step that is good enough, where a root is nearly multiple.
_GOOD = mpf(10) ** -16
#: Part of the derivatives' size below which μ, a coefficient or a component is zero.
_ZERO = mpf(10) ** -12

_Linearized: TypeAlias = "tuple[list[Mpf], mpmath.matrix]"


@dataclass(frozen=True)
class Located:
    """A point in many digits.

    Attributes
    ----------
    y
        Coordinates, multipliers and the parameter.
    error
        Size of the last correction of the parameter, relative to its range.
    """

    y: tuple[Mpf, ...]
    error: float


@dataclass(frozen=True)
class Crossing:
    """A simple branch point.

    Attributes
    ----------
    at
        The point.
    tangents
        Unit tangents of both branches in scaled unknowns, each of shape (N + 1,); none if the
        branching equation does not have two real solutions.
    """

    at: Located
    tangents: tuple[Matrix, ...]


def point_at(space: Space, y: Matrix | Sequence[Mpf], normal: Matrix) -> Located | None:
    """Correct a point in the hyperplane through it, in digits; None if Newton's method fails.

    ``normal``: over scaled unknowns.
    """
    border = [mpf(x) for x in (normal / space.scale).tolist()]
    guess = [mpf(x) for x in y]

    def linearized(z: Sequence[Mpf]) -> _Linearized:
        level, slopes = space.functions.slopes_at(z)
        matrix = _stacked(slopes, [border])
        offset = mpmath.fdot(border, [a - b for a, b in zip(z, guess, strict=True)])
        return [*level, offset], matrix

    return _located(space, _newton(linearized, guess))


def fold_at(space: Space, y: Matrix, tangent: Matrix) -> Located | None:
    """Find the fold near a point; None if there is none."""
    functions, n = space.functions, space.functions.size
    null = _unit(tangent[:-1] * space.scale[:-1])
    fixed = [mpf(x) for x in null.tolist()]

    def linearized(z: Sequence[Mpf]) -> _Linearized:
        level, slopes = functions.slopes_at(z[: n + 1])
        phi = z[n + 1 :]
        matrix = mpmath.zeros(2 * n + 1, 2 * n + 1)
        _put(matrix, slopes, 0, 0)
        _put(matrix, slopes[:, :n], n, n + 1)
        for (row, first, second), value in functions.curvatures_at(z[: n + 1]).items():
            if second < n:
                matrix[n + row, first] += value * phi[second]
        for k in range(n):
            matrix[2 * n, n + 1 + k] = fixed[k]
        moved = [mpmath.fdot(slopes[row, :n].tolist()[0], phi) for row in range(n)]
        return [*level, *moved, mpmath.fdot(fixed, phi) - 1], matrix

    return _located(space, _newton(linearized, [*map(mpf, y.tolist()), *fixed]))


def crossing_at(space: Space, y: Matrix) -> Crossing | None:
    """Find the simple branch point near a point; None if there is none."""
    functions, n = space.functions, space.functions.size
    known = space.linearized(y)
    if known is None:
        return None
    left, _, _ = np.linalg.svd(known[1])
    fixed = [mpf(x) for x in _unit(left[:, -1] / space.rows).tolist()]

    def linearized(z: Sequence[Mpf]) -> _Linearized:
        level, slopes = functions.slopes_at(z[: n + 1])
        mu, psi = z[n + 1], z[n + 2 :]
        matrix = mpmath.zeros(2 * n + 2, 2 * n + 2)
        _put(matrix, slopes, 0, 0)
        _put(matrix, slopes.T, n, n + 2)
        for row in range(n):
            matrix[row, n + 1] = psi[row]
            matrix[row, n + 2 + row] = mu
            matrix[2 * n + 1, n + 2 + row] = fixed[row]
        for (row, first, second), value in functions.curvatures_at(z[: n + 1]).items():
            matrix[n + first, second] += value * psi[row]
        right = [a + mu * b for a, b in zip(level, psi, strict=True)]
        right += [mpmath.fdot(slopes[:, k], psi) for k in range(n + 1)]
        return [*right, mpmath.fdot(fixed, psi) - 1], matrix

    solution = _newton(linearized, [*map(mpf, y.tolist()), mpf(0), *fixed])
    at = _located(space, solution)
    if at is None or solution is None:
        return None
    mu, psi = solution[0][n + 1], solution[0][n + 2 :]
    size = max(abs(a * mpf(b)) for a, b in zip(psi, (1 / space.rows).tolist(), strict=True))
    if abs(mu) * size > _ZERO:
        return None
    return Crossing(at, _directions(space, at, psi))


def _directions(space: Space, at: Located, psi: Sequence[Mpf]) -> tuple[Matrix, ...]:
    """Solve the algebraic branching equation for the tangents of both branches."""
    functions = space.functions
    with mpmath.workdps(DIGITS):
        _, slopes = functions.slopes_at(at.y)
        basis = _null_space(space, slopes, psi)
        curvatures = functions.curvatures_at(at.y)

        def form(u: Sequence[Mpf], v: Sequence[Mpf]) -> tuple[Mpf, Mpf]:
            terms = [psi[r] * h * u[a] * v[b] for (r, a, b), h in curvatures.items()]
            return mpmath.fsum(terms), mpmath.fsum(map(abs, terms))

        pairs = [form(basis[i], basis[j]) for i, j in ((0, 0), (0, 1), (1, 1))]
        size = max(s for _, s in pairs) or mpf(1)
        a, b, c = (value / size if abs(value) > _ZERO * size else mpf(0) for value, _ in pairs)
        root = b * b - a * c
        if root <= _ZERO:
            return ()
        shares = _shares(a, b, c, mpmath.sqrt(root))
        return tuple(_combined(space, basis, *share) for share in shares)


def _shares(a: Mpf, b: Mpf, c: Mpf, root: Mpf) -> tuple[tuple[Mpf, Mpf], tuple[Mpf, Mpf]]:
    """Solve a α² + 2 b α β + c β² = 0 for both ratios of α and β without cancellation."""
    far = -(b + root) if b >= 0 else -(b - root)
    return (far, a), (c, far)


def _combined(space: Space, basis: Sequence[Sequence[Mpf]], alpha: Mpf, beta: Mpf) -> Matrix:
    direction = [alpha * u + beta * v for u, v in zip(*basis, strict=True)]
    scaled = [x / mpf(s) for x, s in zip(direction, space.scale.tolist(), strict=True)]
    largest = max(map(abs, scaled))
    clean = [float(x / largest) if abs(x) > _ZERO * largest else 0.0 for x in scaled]
    return _unit(np.array(clean))


def _null_space(
    space: Space, slopes: mpmath.matrix, psi: Sequence[Mpf]
) -> tuple[Sequence[Mpf], Sequence[Mpf]]:
    """Find two vectors that span the null space of J, whose left null vector is ψ."""
    n = space.functions.size
    doubles = np.array([[float(x) for x in row] for row in slopes.tolist()])
    _, _, rows = np.linalg.svd(doubles * space.scale / space.rows[:, None])
    bordered = mpmath.zeros(n + 2, n + 2)
    _put(bordered, slopes, 0, 0)
    for k in range(n):
        bordered[k, n + 1] = psi[k]
    for k in range(n + 1):
        for border in (1, 2):
            bordered[n + border - 1, k] = mpf(float(rows[-border][k] / space.scale[k]))
    vectors = []
    for border in (0, 1):
        right = mpmath.zeros(n + 2, 1)
        right[n + border] = mpf(1)
        vectors.append(list(mpmath.lu_solve(bordered, right))[: n + 1])
    return vectors[0], vectors[1]


# Newton's method.


def _newton(
    linearized: Callable[[Sequence[Mpf]], _Linearized], start: Sequence[Mpf]
) -> tuple[list[Mpf], list[Mpf]] | None:
    """Find a root: the root and the last correction; None if corrections do not end."""
    z, step = list(start), [mpf("inf")]
    with mpmath.workdps(DIGITS):
        least = mpf("inf")
        for count in range(_STEPS):
            try:
                level, slopes = linearized(z)
                step = list(mpmath.lu_solve(slopes, mpmath.matrix(level)))
            except (DomainError, ZeroDivisionError, ValueError):
                return None
            z = [a - b for a, b in zip(z, step, strict=True)]
            size = max(abs(s) / max(1, abs(a)) for a, s in zip(z, step, strict=True))
            if size < _LAST:
                return z, step
            if count > 8 and size > least / 2:
                return (z, step) if size < _GOOD else None
            least = min(least, size)
    return None


def _located(space: Space, solution: tuple[list[Mpf], list[Mpf]] | None) -> Located | None:
    if solution is None:
        return None
    unknown, step = solution
    size = space.functions.size
    width = space.high - space.low
    return Located(tuple(unknown[: size + 1]), float(abs(step[size]) / width))


def _stacked(matrix: mpmath.matrix, rows: Sequence[Sequence[Mpf]]) -> mpmath.matrix:
    whole = mpmath.zeros(matrix.rows + len(rows), matrix.cols)
    _put(whole, matrix, 0, 0)
    for k, row in enumerate(rows):
        for j, x in enumerate(row):
            whole[matrix.rows + k, j] = x
    return whole


def _put(whole: mpmath.matrix, part: mpmath.matrix, row: int, column: int) -> None:
    for i in range(part.rows):
        for j in range(part.cols):
            whole[row + i, column + j] = part[i, j]


def _unit(vector: Matrix) -> Matrix:
    size = float(np.linalg.norm(vector))
    return vector / size if size else vector
