"""More points on a branch where stability may come and go between two of its points.

Between neighbours and the point amid them, parabolas foretell three functions of small motions:
the eigenvalue of M⁻¹K nearest to zero, the largest real part of a pole, and the smallest distance
of two squares of poles. Where one may come to zero though its sign is the same at all three, the
interval is halved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.branches.curve import CurvePoint
from lagrange_cli.analysis.branches.poles import first_order_in_doubles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lagrange_cli.analysis.branches.curve import Space
    from lagrange_cli.analysis.values import Matrix

# Budgets and thresholds: a larger ``_NEAR`` tests more intervals, a smaller one may miss a pair of
# changes; not tuned.

#: Halvings of an interval.
_HALVINGS = 14
#: Points that are added to a branch.
_MOST = 300
#: Part of the values at three points below which a parabola through them is near zero.
_NEAR = 0.2
#: Part of the largest pole, or eigenvalue, that is rounding.
_ROUNDING = 1e-8


def refined(space: Space, points: Sequence[CurvePoint]) -> list[CurvePoint]:
    """Return the points of a branch, with more of them where stability may change twice."""
    known = list(points)
    values = tested(space, [p.y for p in known])
    fresh = [True] * (len(known) - 1)
    for _ in range(_HALVINGS):
        places = [k for k, is_fresh in enumerate(fresh) if is_fresh]
        middles = {k: amid(space, known[k].y, known[k + 1].y) for k in places}
        halved = [k for k in places if middles[k] is not None]
        middle = tested(space, [y for k in halved for y in (middles[k],) if y is not None])
        doubtful = {
            k: m
            for k, m in zip(halved, middle, strict=True)
            if any(map(_may_vanish, np.array([values[k], m, values[k + 1]]).T))
        }
        if not doubtful or len(known) + len(doubtful) > len(points) + _MOST:
            return known
        known, values, fresh = _halved(space, known, values, middles, doubtful)
    return known


def tested(space: Space, points: Sequence[Matrix]) -> list[Matrix]:
    """Evaluate the three functions at points, each of shape (3,); NaN at singular coordinates."""
    if not points:
        return []
    tables = space.functions.small_motions(np.array(points).T)
    return [_tested(*(table[k] for table in tables)) for k in range(len(points))]


def _tested(mass: Matrix, damping: Matrix, stiffness: Matrix, gradients: Matrix) -> Matrix:
    known = first_order_in_doubles(mass, damping, stiffness, gradients)
    if known is None:
        return np.full(3, np.nan)
    whole, square = known
    poles, squares = np.linalg.eigvals(whole), np.linalg.eigvals(square)
    size = float(np.abs(poles).max(initial=0.0))
    height = float(np.abs(squares).max(initial=0.0))
    real = squares.real[np.abs(squares.imag) <= _ROUNDING * height]
    flat = float(real[np.argmin(np.abs(real))]) if len(real) else height
    above = poles[poles.imag > _ROUNDING * size] ** 2
    gaps = np.abs(above[:, None] - above)[np.triu_indices(len(above), 1)]
    values = np.array([flat, float(poles.real.max(initial=-size)), gaps.min(initial=size**2)])
    values[np.abs(values) <= _ROUNDING * np.array([height, size, size**2])] = 0.0
    return values


def amid(space: Space, start: Matrix, end: Matrix) -> Matrix | None:
    """Return the point of a branch amid two neighbours, in doubles; None if none is near."""
    chord = (end - start) / space.scale
    length = float(np.linalg.norm(chord))
    return space.approached((start + end) / 2, chord / length) if length else None


def _may_vanish(column: Matrix) -> bool:
    """Say whether the parabola through a value, one amid, and another comes near zero."""
    if not np.isfinite(column).all():
        return False
    signs = np.sign(column)
    if not (signs == signs[0]).all():
        # A change between the ends is seen by itself; one that is undone is not.
        return bool(signs[0] == signs[2])
    if not signs[0]:
        return False
    left, middle, right = np.abs(column)
    bend, slope = 2 * (left - 2 * middle + right), right - left
    place = -slope / (2 * bend) if bend > 0 else 1.0
    if bend <= 0 or abs(place) >= 0.5:
        return False
    return bool(middle - slope**2 / (4 * bend) < _NEAR * min(left, middle, right))


def _halved(
    space: Space,
    known: Sequence[CurvePoint],
    values: Sequence[Matrix],
    middles: dict[int, Matrix | None],
    doubtful: dict[int, Matrix],
) -> tuple[list[CurvePoint], list[Matrix], list[bool]]:
    """Insert the midpoints of doubtful intervals, whose halves are tested again."""
    points, tests, fresh = [known[0]], [values[0]], list[bool]()
    for k in range(len(known) - 1):
        y = middles.get(k) if k in doubtful else None
        chord = (known[k + 1].y - known[k].y) / space.scale
        exact = None if y is None else space.polished(y, chord / np.linalg.norm(chord))
        point = None if exact is None else space.point(exact, known[k].tangent)
        if point is not None:
            points.append(point)
            tests.append(doubtful[k])
        fresh += [True, True] if point is not None else [False]
        points.append(known[k + 1])
        tests.append(values[k + 1])
    return points, tests, fresh
