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

from lagrange_cli.mechanics.sampling import double
from lagrange_cli.mechanics.tape import DomainError, Run, Tape

__all__ = ["Manifold"]

_ZERO = mpf(0)
#: Steps that may wander, and the least progress of those after them: where a gradient
#: vanishes on the manifold a step halves the distance only.
_PATIENCE, _PROGRESS = 25, 0.75
_STEPS = 80
#: A step small enough to arrive with, in that case.
_SLOW = mpf(10) ** -12

#: Singular values below this part of the largest are left out of a step.
_CUT = 1e-7

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
        return all(max(map(abs, after[k])) <= _FLAT * max(map(abs, before[k])) for k in wrong)

    def _step(self, point: Point, rows: Sequence[int]) -> list[mpf]:
        values, gradients = self.gradients(point)
        return _least([values[k] for k in rows], [gradients[k] for k in rows], self.scale)

    def gradients(self, point: Point) -> tuple[list[mpf], list[list[mpf]]]:
        """φ and ∂φ/∂q at a point."""
        inputs = [(point[s], _ZERO, _ZERO) for s in [*self.q, *self._others]]
        run = self._positions.run(inputs, 0)
        rows = [_gradient(run, k, slice(0, len(self.q))) for k in self.all]
        return run.values, rows

    def _sizes(self, point: Point) -> list[mpf]:
        """Σ |term| of each φ."""
        inputs = [(point[s], _ZERO, _ZERO) for s in [*self.q, *self._others]]
        pending = iter(self._terms.run(inputs, 0).values)
        return [sum((abs(next(pending)) for _ in range(n)), _ZERO) for n in self._lengths]

    def violations(self, point: Point) -> list[mpf]:
        """|φ| beside the size of its terms."""
        values, _ = self.gradients(point)
        return [
            abs(x) / (size or mpf(1)) for x, size in zip(values, self._sizes(point), strict=True)
        ]

    def slopes(self, point: Point) -> list[list[mpf]]:
        """∂φ/∂q in the units of the coordinates."""
        _, gradients = self.gradients(point)
        return [[x * s for x, s in zip(row, self.scale, strict=True)] for row in gradients]

    # Velocities and accelerations.

    def motion(
        self, point: Point, accelerations: Sequence[mpf]
    ) -> tuple[list[mpf], list[mpf], list[list[mpf]]]:
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
        gradients = [_gradient(run, k, slice(0, len(q))) for k in range(len(levels))]
        run = self._velocities.run([*q, *moving, *others], 1)
        levels += [x[0] for x in run.outputs]
        rates += [x[1] for x in run.outputs]
        wanted = slice(len(q), 2 * len(q))
        gradients += [_gradient(run, k, wanted) for k in range(len(run.outputs))]
        return levels, rates, gradients

    def tangent(self, point: Point) -> dict[sp.Symbol, mpf]:
        """The point with its velocities changed least so that they satisfy every equation."""
        moved = dict(point)
        still = [_ZERO] * len(self.q)
        for _ in range(self._repetitions()):
            levels, _, gradients = self.motion(moved, still)
            step = _least(levels, gradients, self.scale)
            for w, unit, x in zip(self.v, self.scale, step, strict=True):
                moved[w] -= unit * x
        return moved

    def accelerated(self, point: Point, accelerations: Sequence[mpf]) -> list[mpf]:
        """Accelerations changed least so that they satisfy every equation at a point."""
        found = list(accelerations)
        for _ in range(self._repetitions()):
            _, rates, gradients = self.motion(point, found)
            step = _least(rates, gradients, self.scale)
            found = [a - unit * x for a, unit, x in zip(found, self.scale, step, strict=True)]
        return found

    @staticmethod
    def _repetitions() -> int:
        """Solutions in doubles that linear equations need for the digits carried."""
        return int(mpmath.mp.dps) // 12 + 2


def _gradient(run: Run, output: int, wanted: slice) -> list[mpf]:
    return [x[0] for x in run.gradient({output: (mpf(1), _ZERO, _ZERO)})[wanted]]


def _least(
    values: Sequence[mpf], gradients: Sequence[Sequence[mpf]], scale: Sequence[mpf]
) -> list[mpf]:
    """The smallest step, in units of ``scale``, that removes the values to first order."""
    units = np.array([double(s) for s in scale])
    matrix = np.array([[double(x) if x else 0.0 for x in row] for row in gradients])
    matrix = matrix.reshape(len(values), len(units)) * units
    largest = np.abs(matrix).max(axis=1, initial=0.0)
    matrix /= np.where(largest > 0, largest, 1.0)[:, None]
    right = [x / mpf(d) if d else _ZERO for x, d in zip(values, largest, strict=True)]
    # Doubles reach down to 1e-308 only, while residuals shrink with the digits carried.
    size = max((abs(x) for x in right), default=_ZERO)
    if not size:
        return [_ZERO] * len(scale)
    inverse = np.linalg.pinv(matrix, rcond=_CUT)
    step = inverse @ np.array([double(x / size) for x in right])
    if not np.isfinite(step).all():
        raise ZeroDivisionError
    return [size * mpf(x) for x in step]
