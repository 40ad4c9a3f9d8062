"""States on the manifold that closures leave, found by Newton's method.

Residuals are evaluated in high precision, steps are least-squares solutions in
doubles: the error shrinks quadratically at first and then by fifteen digits a
step, so that few steps reach any precision, and equations that depend on each
other need no special case (Deuflhard, Newton Methods for Nonlinear Problems,
2004, section 4.4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.steps import Row, least, repetitions
from lagrange_cli.mechanics.tape import DomainError, Run, Tape

__all__ = ["Manifold"]

_ZERO = mpf(0)
#: Steps that may wander, and the least progress of those after them: where a gradient
#: vanishes on the manifold a step halves the distance only.
_PATIENCE, _PROGRESS = 25, 0.75
_STEPS = 80
#: A step small enough to arrive with, in that case.
_SLOW = mpf(10) ** -12

#: Largest relative violation of an equation that a step may leave (it may depend on others).
_TOLERANCE = mpf(10) ** -9

#: A gradient below this part of another has vanished.
_FLAT = mpf(10) ** -8

Point = Mapping[sp.Symbol, mpf]


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
        self._count = len(positions)
        still = [*self.q, *self._others]
        self._positions = Tape([left - right for left, right in positions], still)
        terms = [[*sp.Add.make_args(a), *sp.Add.make_args(b)] for a, b in positions]
        self._lengths = [len(x) for x in terms]
        self._terms = Tape([e for x in terms for e in x], still)
        self._velocities = Tape(list(velocities), [*self.q, *self.v, *self._others])
        self.all = [*range(self._count)]

    # Positions.

    def placed(
        self, point: Point, rows: Sequence[int] | None = None
    ) -> dict[sp.Symbol, mpf] | None:
        """The point moved on to the manifold of some φ (all by default); None where Newton fails.

        Equations beyond those that determine the others need to hold to 1e-9 only.
        """
        chosen = self.all if rows is None else list(rows)
        if not chosen:
            return dict(point)
        moved = dict(point)
        smallest, before = mpf(10) ** (8 - mpmath.mp.dps), mpf("inf")
        for count in range(_STEPS):
            try:
                step = self._step(moved, chosen)
            except (DomainError, ZeroDivisionError, OverflowError, np.linalg.LinAlgError):
                return None
            for s, unit, x in zip(self.q, self.scale, step, strict=True):
                moved[s] -= unit * x
            length = max(map(abs, step), default=_ZERO)
            # What approaches so slowly has no gradient where it arrives; more digits tell no more.
            if length <= smallest or (count >= _PATIENCE and length <= _SLOW):
                return moved if self._holds(point, moved, chosen) else None
            if count >= _PATIENCE and length > _PROGRESS * before:
                return None
            before = length
        return None

    def _holds(self, start: Point, point: Point, rows: Sequence[int]) -> bool:
        """Whether equations are satisfied, or have lost their gradient since the start."""
        wrong = [k for k, x in enumerate(self.violations(point)) if x > _TOLERANCE and k in rows]
        if not wrong:
            return True
        before, after = self.slopes(start), self.slopes(point)
        return all(_steepest(after[k]) <= _FLAT * _steepest(before[k]) for k in wrong)

    def _step(self, point: Point, rows: Sequence[int]) -> list[mpf]:
        run = self._at(point)
        values, gradients = run.values, [_partials(run, k, 0, len(self.q)) for k in rows]
        return least([values[k] for k in rows], gradients, self.scale)

    def _at(self, point: Point) -> Run:
        inputs = [(point[s], _ZERO, _ZERO) for s in [*self.q, *self._others]]
        return self._positions.run(inputs, 0)

    def _sizes(self, point: Point) -> list[mpf]:
        """Σ |term| of each φ."""
        inputs = [(point[s], _ZERO, _ZERO) for s in [*self.q, *self._others]]
        pending = iter(self._terms.run(inputs, 0).values)
        return [sum((abs(next(pending)) for _ in range(n)), _ZERO) for n in self._lengths]

    def violations(self, point: Point) -> list[mpf]:
        """|φ| beside the size of its terms, or of Σ |∂φ/∂q| where that is more.

        The terms of log(x² + z²) = 0 are zero where it holds.
        """
        run, found = self._at(point), []
        for k, (value, terms) in enumerate(zip(run.values, self._sizes(point), strict=True)):
            slopes = _partials(run, k, 0, len(self.q))
            change = sum((abs(x) * self.scale[j] for j, x in slopes.items()), _ZERO)
            found.append(abs(value) / (max(terms, change) or mpf(1)))
        return found

    def slopes(self, point: Point) -> list[Row]:
        """∂φ/∂q in the units of the coordinates."""
        run = self._at(point)
        rows = [_partials(run, k, 0, len(self.q)) for k in self.all]
        return [{j: x * self.scale[j] for j, x in row.items()} for row in rows]

    # Velocities and accelerations.

    def motion(
        self, point: Point, accelerations: Sequence[mpf]
    ) -> tuple[list[mpf], list[mpf], list[Row]]:
        """Residuals of velocity, of acceleration, and the gradient of every equation.

        φ̇, φ̈ and ∂φ/∂q for the positional ones; ψ, ψ̇ and ∂ψ/∂v for the others.
        """
        t, *parameters = self._others
        v = [point[w] for w in self.v]
        q = [(point[s], x, a) for s, x, a in zip(self.q, v, accelerations, strict=True)]
        moving = [(x, a, _ZERO) for x, a in zip(v, accelerations, strict=True)]
        others = [(point[t], mpf(1), _ZERO), *((point[p], _ZERO, _ZERO) for p in parameters)]
        run = self._positions.run([*q, *others], 2)
        levels = [x[1] for x in run.outputs]
        rates = [x[2] for x in run.outputs]
        gradients = [_partials(run, k, 0, len(q)) for k in range(len(levels))]
        run = self._velocities.run([*q, *moving, *others], 1)
        levels += [x[0] for x in run.outputs]
        rates += [x[1] for x in run.outputs]
        count = len(self._velocities.outputs)
        gradients += [_partials(run, k, len(q), 2 * len(q)) for k in range(count)]
        return levels, rates, gradients

    def tangent(self, point: Point) -> dict[sp.Symbol, mpf]:
        """The point with its velocities changed least so that they satisfy every equation."""
        moved = dict(point)
        still = [_ZERO] * len(self.q)
        for _ in range(repetitions()):
            levels, _, gradients = self.motion(moved, still)
            step = least(levels, gradients, self.scale)
            for w, unit, x in zip(self.v, self.scale, step, strict=True):
                moved[w] -= unit * x
        return moved

    def accelerated(self, point: Point, accelerations: Sequence[mpf]) -> list[mpf]:
        """Accelerations changed least so that they satisfy every equation at a point."""
        found = list(accelerations)
        for _ in range(repetitions()):
            _, rates, gradients = self.motion(point, found)
            step = least(rates, gradients, self.scale)
            found = [a - unit * x for a, unit, x in zip(found, self.scale, step, strict=True)]
        return found


def _steepest(row: Row) -> mpf:
    return max(map(abs, row.values()), default=_ZERO)


def _partials(run: Run, output: int, start: int, stop: int) -> Row:
    """Derivatives of an output by the inputs from ``start`` to ``stop`` that it holds."""
    return {j - start: x for j, x in run.partials(output).items() if start <= j < stop and x}
