"""Newton's method onto the manifold of closure equations.

Residuals are evaluated in high precision, steps are least-squares solutions in
doubles: the error shrinks quadratically at first and then by fifteen digits a
step, so that few steps reach any precision, and equations that depend on each
other need no special case (Deuflhard, Newton Methods for Nonlinear Problems,
2004, section 4.4). Points come in and go out as mpf; on the way all is done in decimals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from functools import cached_property

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.numerics.autodiff import DecimalRun, Jet, Tape
from lagrange_cli.mechanics.numerics.autodiff_float import DoubleTape
from lagrange_cli.mechanics.numerics.elementary import (
    DecimalRow,
    DecimalValues,
    in_decimals,
    numbers_as_decimals,
    numbers_as_mpf,
    to_decimal,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.gauss_newton import (
    SMALLEST_TRUSTED,
    LeastSquares,
    SparseRow,
    least_norm_solution,
)
from lagrange_cli.mechanics.numerics.sampling import to_double

_ZERO = Decimal(0)
_INFINITE = Decimal("Infinity")
# Lengths of steps are relative to the scales of the coordinates. The numbers of steps admit slow
# convergence at singular points and end a search that wanders; a point that is returned satisfies
# the equations whatever these numbers are. None is tuned.

#: Most steps of Newton's method.
_STEPS = 80
#: Steps at first that need not make progress.
_PATIENCE = 25
#: Largest ratio of a later step's length to the one before: where a gradient vanishes on the
#: manifold a step halves the distance only.
_PROGRESS = Decimal("0.75")
#: Length of a step at which the method stops in that case.
_SLOW = Decimal("1e-12")
#: Most corrections of velocities, and the part of a velocity below which what a correction leaves
#: of it has lost the digits of reserve: a wheel of 1e114 metres turns by 1e-114 of its drawn rate.
_CORRECTIONS = 8
_CANCELLED = Decimal("1e-20")
#: Number of equations above which points are first approached in doubles.
_LARGE = 64
#: Length of a step at which that approach ends.
_NEAR = 1e-7
#: Steps after which a step is to be shorter than half of an earlier one.
_WANDER = 10
#: Largest violation of an equation that is left, relative to its terms (it may depend on others).
_TOLERANCE = Decimal("1e-9")
#: Length of a step that diverges.
_FAR = Decimal("1e30")
#: Part of its length at the start below which a gradient has vanished.
_FLAT = Decimal("1e-8")

_Point = Mapping[sp.Symbol, mpf]


class Manifold:
    """States q, v, a that satisfy equations φ(q, t) = 0 and ψ(q, v, t) = 0.

    Parameters
    ----------
    positions
        Both sides of each φ over q, t and parameters.
    velocities
        Each ψ over q, v, t and parameters.
    t, q, v, parameters
        Symbols of time, coordinates, velocities and parameters.
    scale
        Size of the motion of each coordinate: steps are smallest in these units.
    """

    def __init__(
        self,
        positions: Sequence[tuple[sp.Expr, sp.Expr]],
        velocities: Sequence[sp.Expr],
        t: sp.Symbol,
        q: Sequence[sp.Symbol],
        v: Sequence[sp.Symbol],
        parameters: Sequence[sp.Symbol],
        scale: Mapping[sp.Symbol, mpf],
    ) -> None:
        self.q, self.v, self._others = list(q), list(v), [t, *parameters]
        self.scale = [scale[s] for s in q]
        with in_decimals():
            self._units = [to_decimal(x) for x in self.scale]
        self._symbols = [*self.q, *self._others]
        self._sides, self._rates = list(positions), list(velocities)
        self.all = [*range(len(positions))]

    # Tapes are made when they are needed: of large systems most never are.

    @cached_property
    def _positions(self) -> Tape:
        return Tape([left - right for left, right in self._sides], self._symbols)

    @cached_property
    def _in_doubles(self) -> DoubleTape:
        return DoubleTape(self._positions, len(self.q))

    @cached_property
    def _terms(self) -> tuple[Tape, list[int]]:
        """Record the terms of both sides of each φ, and count them."""
        terms = [[*sp.Add.make_args(a), *sp.Add.make_args(b)] for a, b in self._sides]
        return Tape([e for x in terms for e in x], self._symbols), [len(x) for x in terms]

    @cached_property
    def _velocities(self) -> Tape:
        return Tape(self._rates, [*self.q, *self.v, *self._others])

    # Positions.

    def placed(
        self, point: _Point, rows: Sequence[int] | None = None
    ) -> dict[sp.Symbol, mpf] | None:
        """Move a point onto the manifold of some φ (all by default); None if Newton's method fails.

        Dependent equations need to hold to 1e-9 only.
        """
        chosen = self.all if rows is None else list(rows)
        if not chosen:
            return dict(point)
        try:
            with in_decimals():
                start = numbers_as_decimals(point)
                moved = self._reached(start, chosen)
                if moved and self._holds(start, moved, chosen):
                    return self._with_positions(point, moved)
        except (ArithmeticError, np.linalg.LinAlgError):
            pass
        return None

    def _with_positions(self, point: _Point, moved: DecimalValues) -> dict[sp.Symbol, mpf]:
        """Give the coordinates of a point the values that Newton's method reached."""
        return {**point, **{s: to_mpf(moved[s]) for s in self.q}}

    def within(
        self, point: _Point, gaps: int, inset: mpf | None = None
    ) -> dict[sp.Symbol, mpf] | None:
        """Move a point so that every φ is zero, and the last ``gaps`` of them not negative.

        Newton's method takes in the gaps that are violated at each step; None if it ends
        elsewhere. ``inset``: distance from the border of a gap, relative to scales.
        """
        try:
            with in_decimals():
                first = len(self.all) - gaps
                border = _ZERO if inset is None else to_decimal(inset)
                moved = self._inside(numbers_as_decimals(point), first, border)
                if moved and self._allows(moved, first):
                    return self._with_positions(point, moved)
        except (ArithmeticError, np.linalg.LinAlgError):
            pass
        return None

    def _inside(
        self, moved: dict[sp.Symbol, Decimal], first: int, inset: Decimal
    ) -> dict[sp.Symbol, Decimal] | None:
        """Run Newton's method with the inequalities from the ``first`` on; None if it diverges."""
        lengths, smallest = list[Decimal](), _smallest()
        for _ in range(_STEPS if self.q else 0):
            run = self._at(moved)
            gradients = [_partials(run, k, 0, len(self.q)) for k in self.all]
            levels = [
                x if k < first else min(x - inset * self._reach(gradients[k]), _ZERO)
                for k, x in enumerate(run.values)
            ]
            rows = [k for k in self.all if k < first or levels[k]]
            system = LeastSquares([gradients[k] for k in rows], self._units)
            lengths.append(self._move(moved, system, levels, rows))
            stays = len(lengths) > _WANDER and lengths[-1] > lengths[-_WANDER] / 2
            if lengths[-1] > _FAR:
                return None
            if lengths[-1] <= smallest or stays:
                break
        return moved

    def _reach(self, row: DecimalRow) -> Decimal:
        """Sum |∂φ/∂q|·scale: the change of φ over the scale of every coordinate."""
        return sum((abs(x) * self._units[j] for j, x in row.items()), _ZERO)

    def _allows(self, point: DecimalValues, first: int) -> bool:
        """Say whether equations hold, and from the ``first`` on inequalities."""
        levels = self._at(point).values
        return all(
            miss <= _TOLERANCE or (k >= first and levels[k] > 0)
            for k, miss in enumerate(self._misses(point))
        )

    def _reached(
        self, point: DecimalValues, rows: Sequence[int]
    ) -> dict[sp.Symbol, Decimal] | None:
        """Run Newton's method, in doubles first for a large system; None if it fails."""
        if len(rows) <= _LARGE:
            return self._newton(point, rows)
        try:
            near = self._approached(point, rows)
        except ArithmeticError:
            return self._newton(point, rows)  # beyond the range of doubles
        return None if near is None else self._refined(*near, rows)

    def _newton(self, point: DecimalValues, rows: Sequence[int]) -> dict[sp.Symbol, Decimal] | None:
        """Run Newton's method with gradients at every step; None if it makes no progress."""
        moved, before, smallest = dict(point), _INFINITE, _smallest()
        for count in range(_STEPS):
            run = self._at(moved)
            values, gradients = run.values, [_partials(run, k, 0, len(self.q)) for k in rows]
            length = self._move(moved, LeastSquares(gradients, self._units), values, rows)
            # So slow an approach ends where the gradient vanishes: more digits show nothing new.
            if length <= smallest or (count >= _PATIENCE and length <= _SLOW):
                return moved
            if count >= _PATIENCE and length > _PROGRESS * before:
                return None
            before = length
        return None

    def _approached(
        self, point: DecimalValues, rows: Sequence[int]
    ) -> tuple[dict[sp.Symbol, Decimal], LeastSquares] | None:
        """Approach the manifold in doubles, and linearize there; None without a point nearby.

        Raises
        ------
        ArithmeticError
            Doubles do not reach so far.
        """
        others = [to_double(point[s]) for s in self._others]
        start = np.array([to_double(point[s]) for s in self.q])
        units = np.array([to_double(x) for x in self._units])
        change, sizes = np.zeros(len(self.q)), [math.inf]
        for count in range(_PATIENCE):
            values, gradients = self._in_doubles.run([*(start - change).tolist(), *others])
            system = LeastSquares(gradients[rows], self._units)
            if sizes[-1] <= _NEAR:
                moves = zip(self.q, change.tolist(), strict=True)
                return {**point, **{s: point[s] - Decimal(x) for s, x in moves}}, system
            step = system.in_doubles(values[rows])
            change += units * step
            sizes.append(float(np.abs(step).max(initial=0.0)))
            if count >= _WANDER and sizes[-1] > sizes[1] / 2:
                break
        return None

    def _refined(
        self, moved: dict[sp.Symbol, Decimal], system: LeastSquares, rows: Sequence[int]
    ) -> dict[sp.Symbol, Decimal] | None:
        """Add digits to a point by simplified Newton steps, with gradients kept in doubles."""
        before, smallest = _INFINITE, _smallest()
        for _ in range(_STEPS):
            length = self._move(moved, system, self._at(moved).values, rows)
            if length <= smallest:
                return moved
            if length > _PROGRESS * before:
                return None
            before = length
        return None

    def _move(
        self,
        point: dict[sp.Symbol, Decimal],
        system: LeastSquares,
        values: Sequence[Decimal],
        rows: Sequence[int],
    ) -> Decimal:
        """Take one step in place; return its length relative to scales."""
        step = system.step([values[k] for k in rows])
        for s, unit, x in zip(self.q, self._units, step, strict=True):
            if x:
                point[s] -= unit * x
        return max(map(abs, step), default=_ZERO)

    def _holds(self, start: DecimalValues, point: DecimalValues, rows: Sequence[int]) -> bool:
        """Say whether equations are satisfied, or have lost their gradient since the start."""
        if len(rows) > _LARGE and self._clearly_holds(point, rows):
            return True
        wrong = [k for k, x in enumerate(self._misses(point)) if x > _TOLERANCE and k in rows]
        if not wrong:
            return True
        before, after = self._slopes(start), self._slopes(point)
        return all(_steepest(after[k]) <= _FLAT * _steepest(before[k]) for k in wrong)

    def _at(self, point: DecimalValues) -> DecimalRun:
        return self._positions.run_in_decimals(self._still(point), 0)

    def _still(self, point: DecimalValues) -> list[Jet]:
        return [(point[s], _ZERO, _ZERO) for s in self._symbols]

    def violations(self, point: _Point) -> list[mpf]:
        """Measure each |φ| relative to its terms, or to Σ |∂φ/∂q|·scale if that is more.

        The terms of log(x² + z²) = 0 are zero where it holds.
        """
        with in_decimals():
            return [to_mpf(x) for x in self._misses(numbers_as_decimals(point))]

    def _misses(self, point: DecimalValues) -> list[Decimal]:
        run, misses = self._at(point), []
        tape, lengths = self._terms
        pending = iter(tape.run_in_decimals(self._still(point), 0).values)
        for k, (value, count) in enumerate(zip(run.values, lengths, strict=True)):
            terms = sum((abs(next(pending)) for _ in range(count)), _ZERO)
            change = self._reach(_partials(run, k, 0, len(self.q)))
            misses.append(abs(value) / (max(terms, change) or 1))
        return misses

    def _clearly_holds(self, point: DecimalValues, rows: Sequence[int]) -> bool:
        """Say whether |φ| is small relative to Σ |∂φ/∂q|·scale, in doubles alone."""
        try:
            values, slopes = self._in_doubles.run([to_double(point[s]) for s in self._symbols])
        except ArithmeticError:
            return False
        changes = abs(slopes[rows]) @ np.array([to_double(x) for x in self._units])
        sizes = np.abs(values[rows])
        return bool(
            (sizes <= float(_TOLERANCE) * changes).all() and (changes > SMALLEST_TRUSTED).all()
        )

    def slopes(self, point: _Point) -> list[SparseRow]:
        """Give the rows ∂φ/∂q·scale."""
        with in_decimals():
            return [numbers_as_mpf(row) for row in self._slopes(numbers_as_decimals(point))]

    def _slopes(self, point: DecimalValues) -> list[DecimalRow]:
        run = self._at(point)
        rows = [_partials(run, k, 0, len(self.q)) for k in self.all]
        return [{j: x * self._units[j] for j, x in row.items()} for row in rows]

    # Velocities and accelerations.

    def motion(
        self, point: _Point, accelerations: Sequence[mpf]
    ) -> tuple[list[mpf], list[mpf], list[SparseRow]]:
        """Evaluate residuals of velocity, of acceleration, and the gradient of every equation.

        φ̇, φ̈ and ∂φ/∂q for the positional ones; ψ, ψ̇ and ∂ψ/∂v for the others.
        """
        with in_decimals():
            turned = [to_decimal(a) for a in accelerations]
            levels, rates, gradients = self.motion_in_decimals(numbers_as_decimals(point), turned)
            levels, rates = ([to_mpf(x) for x in part] for part in (levels, rates))
            return levels, rates, [numbers_as_mpf(row) for row in gradients]

    def motion_in_decimals(
        self, point: DecimalValues, accelerations: Sequence[Decimal]
    ) -> tuple[list[Decimal], list[Decimal], list[dict[int, Decimal]]]:
        """Evaluate what :meth:`motion` does, within :func:`.elementary.in_decimals`."""
        t, *parameters = self._others
        v = [point[w] for w in self.v]
        q = [(point[s], x, a) for s, x, a in zip(self.q, v, accelerations, strict=True)]
        moving = [(x, a, _ZERO) for x, a in zip(v, accelerations, strict=True)]
        others = [(point[t], Decimal(1), _ZERO), *((point[p], _ZERO, _ZERO) for p in parameters)]
        run = self._positions.run_in_decimals([*q, *others], 2)
        levels = [x[1] for x in run.outputs]
        rates = [x[2] for x in run.outputs]
        gradients = [_partials(run, k, 0, len(q)) for k in range(len(levels))]
        run = self._velocities.run_in_decimals([*q, *moving, *others], 1)
        levels += [x[0] for x in run.outputs]
        rates += [x[1] for x in run.outputs]
        count = len(self._velocities.outputs)
        gradients += [_partials(run, k, len(q), 2 * len(q)) for k in range(count)]
        return levels, rates, gradients

    def tangent(self, point: _Point) -> dict[sp.Symbol, mpf]:
        """Change velocities by the least amount that satisfies every equation."""
        with in_decimals():
            moved = numbers_as_decimals(point)
            for _ in range(_CORRECTIONS):
                start = moved
                levels, _, gradients = self.motion_in_decimals(start, [_ZERO] * len(self.q))
                changes = least_norm_solution(gradients, levels, self._units)
                moved = start | {w: start[w] - x for w, x in zip(self.v, changes, strict=True)}
                if all(abs(moved[w]) >= _CANCELLED * abs(start[w]) for w in self.v):
                    break
            return {**point, **numbers_as_mpf({w: moved[w] for w in self.v})}


def _smallest() -> Decimal:
    """Length of a step below which the digits carried are exhausted."""
    return Decimal((0, (1,), 8 - mpmath.mp.dps))


def _steepest(row: DecimalRow) -> Decimal:
    return max(map(abs, row.values()), default=_ZERO)


def _partials(run: DecimalRun, output: int, start: int, stop: int) -> dict[int, Decimal]:
    """Differentiate an output by the inputs from ``start`` to ``stop`` that it holds."""
    return {j - start: x for j, x in run.partials(output).items() if start <= j < stop and x}
