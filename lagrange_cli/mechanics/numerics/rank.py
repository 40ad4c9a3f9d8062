"""Numerical ranks of Jacobians at feasible configurations.

Ranks decide on the independence of constraints and coordinates; expressions seldom show them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import TypeAlias

import numpy as np
import sympy as sp
from mpmath import mpf
from numpy.typing import NDArray

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import Tape, evaluate
from lagrange_cli.mechanics.numerics.sampling import to_double

#: Relative tolerance of consistency and rank: √6/4 that a person writes with ten decimals passes,
#: and an equation that is off by more is another one.
RANK_TOLERANCE = 1e-9

#: Number of rows above which one sparse factorization looks at them all: fewer are quickly made
#: orthogonal row by row. Not tuned.
_LARGE = 64
#: Squared distance at which a row of length 1 is clear of the others: well above the squared
#: tolerance of rank, and above the rounding of pivots.
_DISTANT = 1e-10
#: Rounds in which columns and rows are scaled: further ones change the factors little.
_ROUNDS = 3
#: Largest entry that is rounding of the 30 digits of others: five digits are lost at most.
_NOTHING = 1e-25

#: Functions of each variable that are looked at before all others: the components of a position.
_FIRST = 3

SymbolValues = Mapping[sp.Symbol, mpf]
Matrix = NDArray[np.float64]
DoubleRow: TypeAlias = Mapping[int, float]
"""The entries of a row that are not zero, by column."""


def _jacobian(
    functions: Sequence[sp.Expr], variables: Sequence[sp.Symbol], point: SymbolValues
) -> list[DoubleRow]:
    """Evaluate ∂functions/∂variables at a point by rows, the largest entry of each 1."""
    varied = set(variables)
    inputs = [*variables, *(s for s in point if s not in varied)]
    run = Tape(functions, inputs).run([(point[s], mpf(0), mpf(0)) for s in inputs], order=0)
    return [run.slopes(k, len(variables)) for k in range(len(functions))]


def normalized_row(row: Mapping[int, mpf]) -> DoubleRow:
    """Convert a row to doubles, divided by its largest entry."""
    largest = max((abs(x) for x in row.values()), default=mpf(0))
    return {j: to_double(x / largest) for j, x in row.items() if x}


def dense_matrix(rows: Sequence[DoubleRow], width: int | None = None) -> Matrix:
    """Fill in zeros, shape (rows, width); the width is the least possible by default."""
    if width is None:
        width = 1 + max((j for row in rows for j in row), default=-1)
    matrix = np.zeros((len(rows), width))
    for k, row in enumerate(rows):
        matrix[k, list(row)] = list(row.values())
    return matrix


def rank(matrix: Matrix, tolerance: float) -> int:
    """Count the singular values of a matrix above ``tolerance`` times the largest one.

    NumPy's ``matrix_rank`` has such a tolerance, ``rtol``, since version 2.0 only.
    """
    if not matrix.size:
        return 0
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return int(np.count_nonzero(sizes > tolerance * sizes.max()))


def column_factors(rows: Sequence[DoubleRow], width: int) -> list[float]:
    """Equilibrate columns: factors that make their largest entries alike, relative to rows.

    A radius multiplies an angle in the constraint of a rolling wheel: without factors, rows of
    large wheels differ by little more than rounding, and those of small ones hardly hold the
    angle.
    """
    factors = np.ones(width)
    entries = np.abs(dense_matrix(rows, width))
    for _ in range(_ROUNDS):
        scaled = entries * factors
        scaled /= np.maximum(scaled.max(axis=1, keepdims=True, initial=0.0), 1e-300)
        largest = scaled.max(axis=0, initial=0.0)
        factors /= np.where(largest > _NOTHING, largest, 1.0)
    return [float(x) for x in factors]


def scale_columns(rows: Sequence[DoubleRow], factors: Sequence[float]) -> list[DoubleRow]:
    """Multiply the columns of rows by factors."""
    return [{j: x * factors[j] for j, x in row.items()} for row in rows]


def dependent_columns(
    functions: Sequence[sp.Expr], variables: Sequence[sp.Symbol], points: Sequence[SymbolValues]
) -> Matrix | None:
    """Find directions in which the variables move no function, at every point.

    Returns
    -------
    Rows that span the null space of ∂functions/∂variables at the last point, shape
    (nullity, variables); None if the columns are independent at some point.
    """
    sample = _first_holding(functions, variables)
    is_short = 2 * len(sample) <= len(functions)
    if is_short and dependent_columns(sample, variables, points[:1]) is None:
        return None
    null: Matrix | None = None
    for point in points:
        matrix = dense_matrix(_jacobian(functions, variables, point), len(variables))
        scaled = matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        # Vectors cost far more than values, and are seldom needed.
        sizes = np.linalg.svd(scaled, compute_uv=False)
        independent = int(np.sum(sizes > RANK_TOLERANCE * max(sizes[0], 1e-300)))
        if independent == len(variables):
            return None
        null = np.linalg.svd(scaled, full_matrices=True)[2][independent:]
    return null


def _first_holding(functions: Sequence[sp.Expr], variables: Sequence[sp.Symbol]) -> list[sp.Expr]:
    """Return the first functions that hold each variable: of many they mostly show all to count."""
    left = dict.fromkeys(variables, _FIRST)
    sample = []
    for function in functions:
        variables_in = symbols_in(function) & left.keys()
        if any(left[variable] for variable in variables_in):
            sample.append(function)
            left |= {variable: max(0, left[variable] - 1) for variable in variables_in}
    return sample


def dependent_gradients(
    functions: Sequence[sp.Expr],
    resolved: Mapping[sp.Symbol, sp.Expr],
    coordinates: Sequence[sp.Symbol],
    points: Sequence[SymbolValues],
) -> dict[int, tuple[int, ...]]:
    """Find functions of position whose gradients depend on earlier ones' at every point.

    Gradients are taken over raw symbols and coordinates, before anything is
    eliminated, so that definitions play no part. Maps the number of a function
    to those that imply it.
    """
    movable = {*resolved, *coordinates}
    variables = list(
        dict.fromkeys(
            v
            for phi in functions
            for v in sorted(symbols_in(phi) & movable, key=attrgetter("name"))
        )
    )
    dependent: dict[int, tuple[int, ...]] | None = None
    for point in points:
        everywhere = dict(point)
        symbols = [s for s in resolved if s not in everywhere]
        positions = evaluate([resolved[s] for s in symbols], point)
        everywhere.update(zip(symbols, positions, strict=True))
        rows = _jacobian(functions, variables, everywhere)
        here = dependent_rows(scale_columns(rows, column_factors(rows, len(variables))))
        dependent = here if dependent is None else {k: v for k, v in dependent.items() if k in here}
    return dependent or {}


def clearly_independent(rows: Sequence[DoubleRow]) -> bool:
    """Say whether the pivots of A Aᵀ show that the rows of A are independent.

    A pivot of sparse elimination is the square of a row's distance from the span of those before.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import splu

    sizes = [math.hypot(*row.values()) for row in rows]
    if not all(sizes):
        return False
    numbers = [k for k, row in enumerate(rows) for _ in row]
    columns = [j for row in rows for j in row]
    entries = [x / size for row, size in zip(rows, sizes, strict=True) for x in row.values()]
    matrix = csr_array((entries, (numbers, columns)))
    try:
        factors = splu(
            (matrix @ matrix.T).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:
        return False  # singular
    return bool((factors.U.diagonal() > _DISTANT).all())


def dependent_rows(
    rows: Sequence[DoubleRow], tolerance: float = RANK_TOLERANCE
) -> dict[int, tuple[int, ...]]:
    """Find rows that are combinations of earlier independent rows, with the rows that take part.

    Each row is made orthogonal to those before it, twice: the first pass leaves an error of
    rounding, which the second removes (Gram and Schmidt; Giraud, Langou and Rozložník, The loss of
    orthogonality in the Gram–Schmidt orthogonalization process, 2005).
    """
    if len(rows) > _LARGE and clearly_independent(rows):
        return {}
    matrix = dense_matrix(rows)
    directions = np.zeros((min(matrix.shape), matrix.shape[1]))
    basis: list[int] = []
    dependent: dict[int, tuple[int, ...]] = {}
    for k, row in enumerate(matrix):
        size = np.linalg.norm(row)
        spanned = directions[: len(basis)]
        remainder = row - spanned.T @ (spanned @ row)
        remainder -= spanned.T @ (spanned @ remainder)
        if np.linalg.norm(remainder) > tolerance * size:
            directions[len(basis)] = remainder / np.linalg.norm(remainder)
            basis.append(k)
        elif size and basis:
            shares, *_ = np.linalg.lstsq(matrix[basis].T, row, rcond=1e-12)
            part = np.abs(shares) > 1e-7 * np.abs(shares).max()
            dependent[k] = tuple(b for b, p in zip(basis, part, strict=True) if p)
        else:
            dependent[k] = ()
    return dependent
