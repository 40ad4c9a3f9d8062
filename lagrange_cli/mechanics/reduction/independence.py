"""Independent closure equations among those that restrict the coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.diagnosis import errors as refusals
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.gauss_newton import SparseRow
from lagrange_cli.mechanics.numerics.rank import (
    RANK_TOLERANCE,
    dense_matrix,
    dependent_rows,
    normalized_row,
    rank,
)
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, Sampler, to_double
from lagrange_cli.mechanics.reduction.geometry import Geometry
from lagrange_cli.mechanics.reduction.local_identities import identities_around, identities_beside

#: A gradient below this part of its size nearby has vanished.
_FLAT = 1e-7
#: Gradients this close to a combination of others depend on them, as checked nearby too.
_DEPENDENT = 1e-6
#: Distance, relative to scales, at which seemingly implied equations are tried.
_AROUND = mpf("0.01")


def independent_closures(
    geometry: Geometry,
    related: Sequence[int],
    manifold: Manifold,
    sampler: Sampler,
    points: Sequence[SamplePoint],
) -> tuple[int, ...]:
    """Numbers of the stated equations that stay as closures beside the coordinates.

    Parameters
    ----------
    related
        Numbers of the equations that restrict the coordinates.
    manifold
        The manifold of these equations, in that order.
    points
        Configurations that satisfy them all.

    Raises
    ------
    InputError
        Equations that are singular wherever they hold.
    """
    slopes = [manifold.slopes(p) for p in points]
    places = [q for p in points for q in sampler.around(p, mpf(1))]
    slopes_around = [manifold.slopes(p) for p in places]
    for k, number in enumerate(related):
        steepest = max(_size(off[k]) for off in slopes_around)
        if all(_size(on[k]) <= _FLAT * steepest for on in slopes):
            raise _without_slope(geometry, number, sampler, [*points, *places])
    everywhere = [dependent_rows([*map(normalized_row, rows)], _DEPENDENT) for rows in slopes]
    dropped = {
        k: by for k, by in everywhere[0].items() if all(k in dependent for dependent in everywhere)
    }
    independent = [k for k in manifold.all if k not in dropped]
    _require_implied(geometry, related, manifold, sampler, points, dropped)
    return tuple(related[k] for k in independent)


def require_no_border(geometry: Geometry, sampler: Sampler) -> None:
    """Refuse equations that hold identically on one side of the start alone.

    Raises
    ------
    InputError
        There is one, as acos(cos x) = x at x = 0.
    """
    one_sided = identities_beside(geometry.elimination.pending, sampler, geometry.reference)
    for number, places in one_sided.items():
        raise _without_slope(geometry, number, sampler, places)


def _without_slope(
    geometry: Geometry,
    number: int,
    sampler: Sampler,
    places: Sequence[Mapping[sp.Symbol, mpf]],
) -> InputError:
    """Build the error of an equation whose gradient vanishes at all or some of its solutions."""
    sides = geometry.elimination.pending[number]
    present = [q for q in geometry.coordinates if q in symbols_in(sides[0] - sides[1])]
    for place in places:
        values = {q: mpf(f"{to_double(place[q]):.2g}") for q in present}
        if identities_around({number: sides}, sampler, {**place, **values}):
            shown = {q.name: f"{to_double(x):.2g}" for q, x in values.items()}
            stated = geometry.elimination.stated[number]
            return refusals.satisfied_elsewhere_error(geometry.names.scene, stated, shown)
    return refusals.singular_error(geometry.names.scene, geometry.elimination, [number])


def _size(row: SparseRow) -> mpf:
    return max(map(abs, row.values()), default=mpf(0))


def _require_implied(
    geometry: Geometry,
    related: Sequence[int],
    manifold: Manifold,
    sampler: Sampler,
    points: Sequence[SamplePoint],
    dropped: dict[int, tuple[int, ...]],
) -> None:
    """Refuse equations whose gradients depend on others' though the others do not imply them."""
    independent = [k for k in manifold.all if k not in dropped]
    around = [manifold.placed(sampler.near(p, _AROUND), independent) for p in points if dropped]
    for point in around:
        if point is None:
            continue
        violations = manifold.violations(point)
        for k, by in dropped.items():
            # Each of the equations may be off by the tolerance, as decimals are; one that
            # does not follow is off by the square of the distance around.
            if violations[k] > RANK_TOLERANCE * (1 + len(by)):
                if all(map(sampler.is_given, points)):
                    raise refusals.isolated_start_error(
                        geometry.names.scene, geometry.elimination, related
                    )
                raise refusals.singular_error(
                    geometry.names.scene, geometry.elimination, [related[j] for j in (*by, k)]
                )


def require_determined(
    geometry: Geometry, manifold: Manifold, draw: Callable[[], Sequence[SamplePoint]]
) -> None:
    """Refuse declared coordinates beside which closures leave a name undetermined.

    Parameters
    ----------
    draw
        Draws configurations that satisfy the closures.

    Raises
    ------
    InputError
        Too few coordinates.
    """
    names, elimination = geometry.names, geometry.elimination
    opened = [k for k, q in enumerate(geometry.coordinates) if q in elimination.unknowns]
    if names.scene.coordinates is None or not opened:
        return
    ranks = [_rank(manifold.slopes(p), opened) for p in draw()]
    if max(ranks) < len(opened):
        raise refusals.too_few_error(names.scene, elimination, len(opened) - max(ranks))


def _rank(rows: Sequence[SparseRow], columns: Sequence[int]) -> int:
    place = {j: k for k, j in enumerate(columns)}
    restricted = [{place[j]: x for j, x in row.items() if j in place} for row in rows]
    return rank(
        dense_matrix([normalized_row(row) for row in restricted], len(columns)), RANK_TOLERANCE
    )
