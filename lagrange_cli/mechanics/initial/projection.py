"""Project an initial state onto the position and velocity constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentStartError, InputError, Problem
from lagrange_cli.mechanics.initial.configuration import NEWTON_STARTS, ConfigurationSearch
from lagrange_cli.mechanics.numerics.gauss_newton import SparseRow
from lagrange_cli.mechanics.numerics.rank import (
    column_factors,
    dependent_rows,
    normalized_row,
    scale_columns,
)
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.values import decimal
from lagrange_cli.mechanics.system import InitialState

_ZERO = mpf(0)

#: Conditions on velocities this close to a combination of others depend on them.
_DEPENDENT = 1e-12
#: Inertia, relative to the largest, of a coordinate without any at a singular point.
_TRACE = mpf(10) ** -20

#: Largest violation, relative to the scene's length or speed, that is projected.
_TOLERANCE = mpf(10) ** -9
#: Change, relative to length or speed, that counts as rounding of the arithmetic.
_ROUNDING = mpf(10) ** -20


class ClosureProjection:
    """Projection onto the closures at the parameters and the start time of a scene.

    Parameters
    ----------
    constants
        Values of parameters and t.
    length
        The scene's length.
    """

    def __init__(self, reduced: Reduced, constants: Mapping[sp.Symbol, mpf], length: mpf) -> None:
        self._closures = [
            *(c for c in reduced.closures if c.kind == "position"),
            *(c for c in reduced.closures if c.kind == "velocity"),
        ]
        self._start = reduced.scene.initial[0].mark
        self._constants = dict(constants)
        self._length = length
        self._q = [c.q for c in reduced.coordinates]
        self._v = [c.v for c in reduced.coordinates]
        self._manifold = reduced.manifold()
        self._search = ConfigurationSearch(reduced, constants, [], [], [], length)

    def placed(self, q: Sequence[mpf]) -> tuple[list[mpf], mpf]:
        """Project coordinates onto the closures; also return the largest change.

        Raises
        ------
        InputError
            They violate a closure by more than 1e-9 of the length.
        """
        if not self._closures:
            return list(q), _ZERO
        misses = self._search.misses(q)
        for k, miss in enumerate(misses):
            if miss > _TOLERANCE * self._length:
                raise self.violated(k, miss)
        point = self._manifold.placed(self._point(q))
        if point is None:
            raise self.violated(0, max(misses, default=_ZERO))
        return self._changed(q, [point[s] for s in self._q], self._length)

    def tangent(self, q: Sequence[mpf], v: Sequence[mpf]) -> tuple[list[mpf], mpf]:
        """Project velocities onto the closures; also return the largest change.

        Raises
        ------
        InputError
            They violate a closure by more than 1e-9 of the speed.
        """
        if not self._closures:
            return list(v), _ZERO
        point = self._point(q, v)
        levels, _, gradients = self._manifold.motion(point, [_ZERO] * len(self._q))
        speed = max(map(abs, v), default=_ZERO) or mpf(1)
        for k, (level, gradient) in enumerate(zip(levels, gradients, strict=True)):
            miss = abs(level) / _size(gradient)
            if miss > _TOLERANCE * speed:
                raise self.violated(k, miss, "velocities")
        moved = self._manifold.tangent(point)
        return self._changed(v, [moved[w] for w in self._v], speed)

    @staticmethod
    def _changed(before: Sequence[mpf], after: list[mpf], scale: mpf) -> tuple[list[mpf], mpf]:
        change = max((abs(x - y) for x, y in zip(before, after, strict=True)), default=_ZERO)
        return (after, change) if change > _ROUNDING * scale else (list(before), _ZERO)

    def rates(self, q: Sequence[mpf]) -> tuple[list[SparseRow], list[mpf]]:
        """Gradient and rate of each closure, gradient·v + rate = 0, largest entry of each row 1."""
        if not self._closures:
            return [], []
        still = [_ZERO] * len(self._q)
        rates, _, gradients = self._manifold.motion(self._point(q), still)
        sizes = [_size(g) for g in gradients]
        return (
            [{j: x / s for j, x in g.items()} for g, s in zip(gradients, sizes, strict=True)],
            [x / size for x, size in zip(rates, sizes, strict=True)],
        )

    def _point(self, q: Sequence[mpf], v: Sequence[mpf] | None = None) -> dict[sp.Symbol, mpf]:
        velocities = [_ZERO] * len(self._v) if v is None else list(v)
        return {
            **self._constants,
            **dict(zip(self._q, q, strict=True)),
            **dict(zip(self._v, velocities, strict=True)),
        }

    def nowhere(self) -> InputError:
        """Build the error of initial values without a configuration."""
        named = ", ".join(f"'{n}'" for n in dict.fromkeys(c.name for c in self._closures))
        satisfies = f" that satisfies {named}" if named else ""
        return InconsistentStartError(
            Problem(
                f"no configuration with the initial values was found in {NEWTON_STARTS}"
                f" starts{satisfies}",
                self._start,
                rule="initial-inconsistent",
            )
        )

    def violated(self, number: int, miss: mpf, what: str = "values") -> InputError:
        """Build the error of initial values that a closure contradicts."""
        closure = self._closures[number]
        return InconsistentStartError(
            Problem(
                f"the initial {what} violate constraint '{closure.name}'"
                f" by {mpmath.nstr(miss, 3)}: {closure.text}",
                self._start,
                rule="initial-inconsistent",
            )
        )


def _size(gradient: SparseRow) -> mpf:
    """The largest entry, 1 where there is none."""
    return max(map(abs, gradient.values()), default=_ZERO) or mpf(1)


def state_of(positions: Sequence[mpf], velocities: Sequence[mpf], projected: float) -> InitialState:
    """Return a state as doubles, and as decimals with the digits that doubles lack."""
    return InitialState(
        tuple(map(float, positions)),
        tuple(map(float, velocities)),
        projected,
        tuple(map(decimal, (*positions, *velocities))),
    )


def smallest_solution(
    matrix: Sequence[SparseRow], target: Sequence[mpf], metric: Sequence[SparseRow]
) -> list[mpf]:
    """x of least xᵀ·metric·x with matrix·x = target, dependent rows left out.

    Zeros if rows are dependent only within the digits carried: they miss the target, and the caller
    refuses it as it does other velocities without rates of the coordinates.
    """
    width = len(metric)
    normalized = [normalized_row(row) for row in matrix]
    dependent = dependent_rows(
        scale_columns(normalized, column_factors(normalized, width)), _DEPENDENT
    )
    independent = [k for k in range(len(matrix)) if k not in dependent]
    if not independent:
        return [_ZERO] * width
    rows = _full([matrix[k] for k in independent], width)
    right = mpmath.matrix([target[k] for k in independent])
    weighted = _inverse(_full(metric, width)) * rows.T
    try:
        return list(weighted * mpmath.lu_solve(rows * weighted, right))
    except ZeroDivisionError:
        return [_ZERO] * width


def _full(rows: Sequence[SparseRow], width: int) -> mpmath.matrix:
    """The rows with their zeros."""
    return mpmath.matrix([[row.get(j, _ZERO) for j in range(width)] for row in rows])


def _inverse(metric: mpmath.matrix) -> mpmath.matrix:
    """Invert the metric; coordinates without inertia at a singular point get a trace of it."""
    try:
        return mpmath.inverse(metric)
    except ZeroDivisionError:
        largest = max(metric[i, i] for i in range(metric.rows)) or mpf(1)
        return mpmath.inverse(metric + mpmath.eye(metric.rows) * largest * _TRACE)
