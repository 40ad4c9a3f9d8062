"""Root loci: the poles of small motions along a branch, as curves over its parameter.

Poles of neighbouring points are paired so that they move least in all (H. W. Kuhn 1955, as SciPy
solves it). Where one moves far from a point to the next, a point amid them is put between.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from lagrange_cli.analysis.branch_values import Locus
from lagrange_cli.analysis.branches.poles import first_order_in_doubles
from lagrange_cli.analysis.branches.refining import amid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lagrange_cli.analysis.branches.curve import CurvePoint, Space
    from lagrange_cli.analysis.values import Matrix

# All set by hand.

#: Part of the largest pole of a branch by which a pole moves between neighbouring points at most.
_FAR = 0.01
#: Halvings of an interval: poles that meet move as the root of the parameter.
_HALVINGS = 12
#: Points of a locus.
_MOST = 2000


def locus(space: Space, points: Sequence[CurvePoint]) -> Locus:
    """Follow the poles along a branch; without points where coordinates are singular."""
    places = [point.y for point in points]
    poles = _poles(space, places)
    for _ in range(_HALVINGS):
        size = max((float(np.abs(p).max(initial=0.0)) for p in poles if p is not None), default=0.0)
        jumps = [_jump(one, other) for one, other in pairwise(poles)]
        far = [k for k, jump in enumerate(jumps) if jump > _FAR * size]
        if not far or len(places) + len(far) > _MOST:
            break
        between = {k: y for k in far if (y := amid(space, places[k], places[k + 1])) is not None}
        found = dict(zip(between, _poles(space, list(between.values())), strict=True))
        for k in sorted(between, reverse=True):
            places.insert(k + 1, between[k])
            poles.insert(k + 1, found[k])
    known = [(y[-1], p) for y, p in zip(places, poles, strict=True) if p is not None]
    if not known:
        return Locus(np.empty(0), np.empty((0, 0), dtype=complex))
    values, rows = zip(*known, strict=True)
    return Locus(np.array(values), _in_turn(rows))


def _poles(space: Space, places: Sequence[Matrix]) -> list[NDArray[np.complex128] | None]:
    """Find the poles at points, in doubles; None where coordinates are singular."""
    if not places:
        return []
    tables = space.functions.small_motions(np.array(places).T)
    systems = (first_order_in_doubles(*(table[k] for table in tables)) for k in range(len(places)))
    return [None if s is None else np.linalg.eigvals(s[0]).astype(complex) for s in systems]


def _jump(one: NDArray[np.complex128] | None, other: NDArray[np.complex128] | None) -> float:
    """Return the farthest that a pole moves; 0 where there are none or another number."""
    if one is None or other is None or one.shape != other.shape:
        return 0.0
    moved = one - other[_pairing(one, other)]
    return float(np.abs(moved).max(initial=0.0))


def _pairing(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> NDArray[np.intp]:
    """Return for each pole the number of the one that it becomes."""
    return np.asarray(linear_sum_assignment(np.abs(one[:, None] - other))[1])


def _in_turn(rows: Sequence[NDArray[np.complex128]]) -> NDArray[np.complex128]:
    """Put poles into columns in which they move least; those of another number are left out."""
    ordered = [rows[0][np.lexsort((rows[0].imag, rows[0].real))]]
    for row in rows[1:]:
        if row.shape == ordered[0].shape:
            ordered.append(row[_pairing(ordered[-1], row)])
        else:
            ordered.append(np.full_like(ordered[0], np.nan))
    return np.array(ordered)
