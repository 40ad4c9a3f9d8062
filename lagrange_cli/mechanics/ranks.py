"""Numerical ranks of Jacobians at feasible configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp
from mpmath import mpf
from numpy.typing import NDArray

from lagrange_cli.mechanics.sampling import double
from lagrange_cli.mechanics.tape import Tape, values

__all__ = [
    "TOLERANCE",
    "Matrix",
    "Point",
    "clearly_independent",
    "dependent_columns",
    "dependent_gradients",
    "dependent_rows",
]

#: Relative tolerance of consistency and rank (so that √6/4 may be written in decimals).
TOLERANCE = 1e-9

#: Rows beyond this number are first looked at all at once.
_LARGE = 64
#: Square of the distance at which a row of length 1 is clear of the others.
_DISTANT = 1e-10

Point = Mapping[sp.Symbol, mpf]
Matrix = NDArray[np.float64]


def _jacobian(
    functions: Sequence[sp.Expr],
    variables: Sequence[sp.Symbol],
    point: Point,
) -> Matrix:
    """∂functions/∂variables at a point, (functions, variables); largest entry of a row is 1."""
    others = [s for s in point if s not in set(variables)]
    inputs = [*variables, *others]
    run = Tape(functions, inputs).run([(point[s], mpf(0), mpf(0)) for s in inputs], order=0)
    rows = np.zeros((len(functions), len(variables)))
    for k in range(len(functions)):
        row = {j: x for j, x in run.partials(k).items() if j < len(variables)}
        largest = max((abs(x) for x in row.values()), default=mpf(0))
        if largest:
            rows[k, list(row)] = [double(x / largest) for x in row.values()]
    return rows


def dependent_columns(
    functions: Sequence[sp.Expr], variables: Sequence[sp.Symbol], points: Sequence[Point]
) -> Matrix | None:
    """Directions in which the variables move no function, at every point.

    Returns
    -------
    Rows that span the null space of ∂functions/∂variables at the last point, or
    None where the columns are independent at some point.
    """
    null: Matrix | None = None
    for point in points:
        matrix = _jacobian(functions, variables, point)
        scaled = matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        _, sizes, right = np.linalg.svd(scaled, full_matrices=True)
        null = right[int(np.sum(sizes > TOLERANCE * max(sizes[0], 1e-300))) :]
        if not len(null):
            return None
    return null


def dependent_gradients(
    functions: Sequence[sp.Expr],
    resolved: Mapping[sp.Symbol, sp.Expr],
    coordinates: Sequence[sp.Symbol],
    points: Sequence[Point],
) -> dict[int, tuple[int, ...]]:
    """Functions of position whose gradients depend on earlier ones' at every point.

    Gradients are taken over raw symbols and coordinates, before anything is
    eliminated, so that definitions play no part. Maps the number of a function
    to those that imply it.
    """
    movable = {*resolved, *coordinates}
    variables = list(
        dict.fromkeys(v for phi in functions for v in sorted(phi.free_symbols & movable, key=str))
    )
    found: dict[int, tuple[int, ...]] | None = None
    for point in points:
        everywhere = dict(point)
        symbols = [s for s in resolved if s not in everywhere]
        positions = values([resolved[s] for s in symbols], point)
        everywhere.update(zip(symbols, positions, strict=True))
        here = dependent_rows(_jacobian(functions, variables, everywhere))
        found = here if found is None else {k: v for k, v in found.items() if k in here}
    return found or {}


def clearly_independent(matrix: Matrix) -> bool:
    """Whether the pivots of A Aᵀ tell, by sparse elimination, that the rows of A are independent.

    A pivot is the square of a row's distance from what the rows before it span.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import splu

    sizes = np.linalg.norm(matrix, axis=1)
    if not sizes.all():
        return False
    rows = csr_array(matrix / sizes[:, None])
    try:
        factors = splu(
            (rows @ rows.T).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:
        return False  # singular
    return bool((factors.U.diagonal() > _DISTANT).all())


def dependent_rows(matrix: Matrix, tolerance: float = TOLERANCE) -> dict[int, tuple[int, ...]]:
    """Rows that are combinations of earlier independent rows, with the rows that take part."""
    if len(matrix) > _LARGE and clearly_independent(matrix):
        return {}
    basis: list[int] = []
    dependent: dict[int, tuple[int, ...]] = {}
    for k, row in enumerate(matrix):
        size = np.linalg.norm(row)
        if not size:
            dependent[k] = ()
            continue
        if basis:
            shares, *_ = np.linalg.lstsq(matrix[basis].T, row, rcond=1e-12)
            if np.linalg.norm(matrix[basis].T @ shares - row) <= tolerance * size:
                part = np.abs(shares) > 1e-7 * np.abs(shares).max()
                dependent[k] = tuple(b for b, p in zip(basis, part, strict=True) if p)
                continue
        basis.append(k)
    return dependent
