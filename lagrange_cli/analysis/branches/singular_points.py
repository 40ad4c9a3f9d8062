"""Folds and branch points in many digits, by systems of equations that are regular there.

A fold is a zero of F, F_x φ, φ₀·φ − 1 (G. Moore and A. Spence, SIAM J. Numer. Anal. 17 (1980)
567), a simple branch point one of F + μ ψ, Jᵀψ, ψ₀·ψ − 1 with μ = 0; where μ is not zero the
branches miss each other (W. Govaerts 2000, ch. 8). The directions of both branches solve the
algebraic branching equation ψ·F_yy t t = 0 on the null space of J (H. B. Keller 1977).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import mpmath
import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.branches.functions import Derivatives
from lagrange_cli.analysis.interval_roots import IntervalSystem
from lagrange_cli.analysis.interval_values import Interval, around
from lagrange_cli.analysis.values import DIGITS, Matrix, Mpf
from lagrange_cli.mechanics.numerics.autodiff import DomainError

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.curve import Space

#: Steps of Newton's method, and the size of the last one, relative to the unknowns.
_STEPS, _LAST = 40, mpf(10) ** -40
#: Size of a last step that is good enough, where a root is nearly multiple.
_GOOD = mpf(10) ** -16
#: Part of the derivatives' size below which μ, a coefficient or a component is zero.
_ZERO = mpf(10) ** -12

#: Part of the derivatives' size below which branches that are found to miss each other by μ meet.
_MEETING = mpf(10) ** -30

_Extended: TypeAlias = "tuple[list[Any], dict[tuple[int, int], Any]]"
"""Equations and their derivatives, by row and column, as numbers or intervals."""

_Linearized: TypeAlias = "tuple[list[Mpf], mpmath.matrix]"


@dataclass(frozen=True)
class Located:
    """A point in many digits.

    Attributes
    ----------
    y
        Coordinates, multipliers and the parameter.
    error
        Size of the last correction of the parameter, or proven bound of its error, relative to its
        range.
    radius
        Bound of the errors of the others, relative to 1 and to each.
    more
        Further unknowns of the system that it is a regular root of.
    """

    y: tuple[Mpf, ...]
    error: float
    radius: float = 1e-9
    more: tuple[Mpf, ...] = ()


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


def proven_point_at(space: Space, y: Matrix, normal: Matrix) -> Located | None:
    """Correct a point as :func:`point_at`; None if it is not proven that there is one."""
    at = point_at(space, y, normal)
    radii = None if at is None else space.radii(at.y, normal)
    if at is None or radii is None:
        return None
    sizes = np.maximum(1.0, np.abs([float(x) for x in at.y]))
    return replace(at, radius=float((radii / sizes).max()))


def fold_at(space: Space, y: Matrix, tangent: Matrix) -> Located | None:
    """Find the fold near a point; None if it is not proven that there is one."""
    n = space.functions.size
    null = _unit(tangent[:-1] * space.scale[:-1])
    fixed = [mpf(x) for x in null.tolist()]

    def extended(values: Derivatives, phi: Sequence[Any], normal: Sequence[Any]) -> _Extended:
        """Write F, F_x φ and φ₀·φ − 1."""
        moved = [0 * values.levels[0]] * n
        entries: dict[tuple[int, int], Any] = {(2 * n, n + 1 + k): x for k, x in enumerate(normal)}
        for (row, column), slope in values.slopes.items():
            entries[row, column] = slope
            if column < n:
                entries[n + row, n + 1 + column] = slope
                moved[row] = moved[row] + slope * phi[column]
        for (row, first, second), value in values.curvatures.items():
            if second < n:
                added = value * phi[second]
                entries[n + row, first] = entries.get((n + row, first), 0 * added) + added
        return [*values.levels, *moved, _dot(normal, phi) - 1], entries

    return _extended_root(space, extended, y, fixed, fixed)


def crossing_at(space: Space, y: Matrix) -> Crossing | None:
    """Find the simple branch point near a point; None if it is not proven that there is one."""
    n = space.functions.size
    known = space.linearized(y)
    if known is None:
        return None
    left, _, _ = np.linalg.svd(known[1])
    fixed = [mpf(x) for x in _unit(left[:, -1] / space.rows).tolist()]

    def extended(values: Derivatives, more: Sequence[Any], normal: Sequence[Any]) -> _Extended:
        """Write F + μ ψ, Jᵀψ and ψ₀·ψ − 1."""
        mu, psi = more[0], more[1:]
        turned = [0 * mu] * (n + 1)
        entries: dict[tuple[int, int], Any] = {}
        for row in range(n):
            entries[row, n + 1] = psi[row]
            entries[row, n + 2 + row] = mu
            entries[2 * n + 1, n + 2 + row] = normal[row]
        for (row, column), slope in values.slopes.items():
            entries[row, column] = slope
            entries[n + column, n + 2 + row] = slope
            turned[column] = turned[column] + slope * psi[row]
        for (row, first, second), value in values.curvatures.items():
            added = value * psi[row]
            place = (n + first, second)
            entries[place] = entries.get(place, 0 * added) + added
        levels = [a + mu * b for a, b in zip(values.levels, psi, strict=True)]
        return [*levels, *turned, _dot(normal, psi) - 1], entries

    at = _extended_root(space, extended, y, [mpf(0), *fixed], fixed)
    if at is None:
        return None
    mu, psi = at.more[0], at.more[1:]
    size = max(abs(a * mpf(b)) for a, b in zip(psi, (1 / space.rows).tolist(), strict=True))
    if abs(mu) * size > _MEETING:
        return None
    return Crossing(at, _directions(space, at, psi))


def _extended_root(
    space: Space,
    extended: Callable[[Derivatives, Sequence[Any], Sequence[Any]], _Extended],
    y: Matrix,
    more: Sequence[Mpf],
    normal: Sequence[Mpf],
) -> Located | None:
    """Find the root of a system that is regular at a singular point, with a proof.

    Parameters
    ----------
    extended
        Writes the equations and their derivatives, over derivatives of F, further unknowns and the
        normal.
    y, more
        A point near it, and the further unknowns there.
    normal
        Coefficients of the condition that fixes the size of a null vector.
    """
    functions, n = space.functions, space.functions.size

    def linearized(z: Sequence[Mpf]) -> _Linearized:
        levels, entries = extended(functions.entries_at(z[: n + 1]), z[n + 1 :], normal)
        matrix = mpmath.zeros(len(levels), len(levels))
        for place, value in entries.items():
            matrix[place] = value
        return levels, matrix

    solution = _newton(linearized, [*map(mpf, y.tolist()), *more])
    at = _located(space, solution)
    if at is None or solution is None:
        return None
    weights = [around(x, mpf(0)) for x in normal]

    def enclosed(z: Sequence[Interval]) -> _Extended:
        return extended(functions.enclosed_entries(z[: n + 1]), z[n + 1 :], weights)

    unknown = solution[0]
    equations = IntervalSystem(lambda z: enclosed(z)[0], lambda z: enclosed(z)[1], len(unknown))
    radii = equations.root_radii(unknown)
    if radii is None:
        return None
    error = float(radii[n]) / (space.high - space.low)
    sizes = np.maximum(1.0, np.abs([float(x) for x in at.y[:n]]))
    radius = float((radii[:n] / sizes).max())
    # Zero, where it is as good as the number that was found.
    pairs = zip(at.y, radii.tolist(), strict=False)
    place = tuple(mpf(0) if abs(x) <= radius else x for x, radius in pairs)
    return replace(at, y=place, error=error, radius=radius, more=tuple(unknown[n + 1 :]))


def _dot(first: Sequence[Any], second: Sequence[Any]) -> Any:
    products = [a * b for a, b in zip(first, second, strict=True)]
    return sum(products[1:], products[0])


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
