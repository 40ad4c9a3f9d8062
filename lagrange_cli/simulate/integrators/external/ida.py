"""IDA of SUNDIALS: implicit differential equations, with constraints as equations of each step.

Motion on constraints is y' = f(t, y) + B μ, 0 = h(t, y), where h has constraints of positions
and of velocities and μ vanishes on the solution: the stabilized form of index 2 (Gear, Leimkuhler,
Gupta, *J. Comput. Appl. Math.* 12-13 (1985) 77; Gear, *SIAM J. Sci. Stat. Comput.* 7 (1986) 734)
with accelerations already solved for. Backward differentiation of order k ≤ 6 converges for it
with order k (Brenan, Campbell, Petzold, *Numerical Solution of Initial-Value Problems in
Differential-Algebraic Equations*, 1996, section 3.2).

μ is eliminated, as it has no error that a step should be chosen by: with the projection P onto the
constraints and a projector T onto the range of its derivative, whose kernel B spans,

    T (y' − f(t, y)) + (1 − T) (y − P(t, y)) = 0

has as many equations as y: what is tangential is differential, what is normal is algebraic.
Whatever such projector T is, each step solves y' = f on the constraints, so it is that of the state
where the step began, with one block for positions and one for velocities. It is orthogonal where
each number is measured by its absolute tolerance: what leads back to the constraints is smallest.
The smallest in the metric of the kinetic energy would move light bodies on stiff springs by more
than their tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import UNMET, StepError
from lagrange_cli.simulate.integrators.differences import distances, quotients
from lagrange_cli.simulate.integrators.external.sundials import Sundials
from lagrange_cli.simulate.integrators.right_hand_side import Projection

#: Failures to solve the equations of a step, each of which quarters it, before it is given up.
_MOST_FAILURES = 30

#: Iterations for a linear system; the first nearly solves it.
_KRYLOV = 5

#: Factors of the distance of difference quotients, which are tried until the derivative of a
#: projection is a projector: some projections round more than others.
_WIDER = 1.0, 64.0, 4096.0, 262144.0

#: Largest distance of a projector from its square, beside its largest entry, and of its trace from
#: its rank, beside its size.
_ROUGH = 1e-2


class IDA(Sundials):
    """Backward differentiation of variable step and order 1 to 5, over residuals.

    States and samples are projected when they are handed out; what the solver goes on from obeys
    the constraints as it does all other equations of a step, within a part of the tolerance.
    """

    name = "IDA"
    title = "backward differentiation of SUNDIALS, implicit, for stiff systems on constraints"
    order = 5
    implicit = True

    _tangent: Array | None = None
    _back: Array | None = None
    _system: tuple[float, Array, Array] | None = None

    def _scales(self, small: Array) -> Array:
        """Return powers of two, so that units matter neither for pivots nor for projectors."""
        return np.exp2(np.round(np.log2(np.where(small > 0, small, 1.0))))

    def _begun(self, **options: Any) -> Any:
        from sksundae import ida

        self._unit, self._atol = options["first_step"], options["atol"]
        self._rate = self._slope(self.t, self.y)
        self._moved = np.zeros_like(self._rate)
        # IDA's direct solvers keep the factors of an earlier step and scale what they give, which
        # does not suit equations without rates: errors of their solution look like those of the
        # step, and orders stay low. With products by the matrix of the present step, and its
        # inverse as preconditioner, iterations end after the first.
        solver = ida.IDA(
            self._residual,
            linsolver="gmres",
            krylov_dim=_KRYLOV,
            precond=ida.IDAPrecond(self._set_up, self._solve),
            jactimes=ida.IDAJacTimes(None, self._multiply),
            max_conv_fails=_MOST_FAILURES,
            **options,
        )
        solver.init_step(self.t, np.zeros_like(self._rate), self._rate)
        return solver

    def step(self, limit: float) -> None:
        if self._projection is not None:
            self._tangent, self._back = self._projectors(self._projection)
            self._system = None
        start = self.t
        super().step(limit)
        self._unit, self._system = self.t - start, None

    def _arrive(self, solution: Any) -> None:
        super()._arrive(solution)
        self._rate, self._moved = solution.yp, np.maximum(self._moved, np.abs(solution.y))

    def _slope(self, t: float, y: Array) -> Array:
        """Evaluate the rate of z by the right-hand side."""
        return self._rhs(t, y) / self._scale

    def _residual(self, t: float, z: Array, rate: Array, out: Array) -> None:
        """Evaluate the equations of a step, in units of z: rates are taken times the last step."""
        y = self._state(z)
        late = self._unit * (rate - self._slope(t, y))
        if self._projection is None or self._tangent is None:
            out[:] = late
            return
        off = (y - self._projection(t, y)) / self._scale
        out[:] = off + self._tangent @ (late - off)

    def _set_up(self, t: float, z: Array, rate: Array, residual: Array, cj: float) -> None:
        """Take the derivatives of slopes here."""
        y = self._state(z)
        of_slope = self._quotients(lambda y: self._slope(t, y), y, self._moves(y, rate))
        self._of_slope, self._system = of_slope, None

    def _matrices(self, cj: float) -> tuple[Array, Array]:
        """Return ∂residual/∂z + cj ∂residual/∂rate and its inverse, NaN if it is singular."""
        if self._system is None or self._system[0] != cj:
            one = np.eye(len(self._rate))
            late = self._unit * (cj * one - self._of_slope)
            matrix = late if self._tangent is None else self._back + self._tangent @ late
            try:
                inverse = np.linalg.inv(matrix)
            except np.linalg.LinAlgError:
                inverse = np.full_like(matrix, np.nan)
            self._system = cj, matrix, inverse
        return self._system[1:]

    def _solve(
        self,
        t: float,
        z: Array,
        rate: Array,
        residual: Array,
        right_side: Array,
        out: Array,
        cj: float,
        within: float,
    ) -> None:
        out[:] = self._matrices(cj)[1] @ right_side

    def _multiply(
        self, t: float, z: Array, rate: Array, residual: Array, vector: Array, out: Array, cj: float
    ) -> None:
        out[:] = self._matrices(cj)[0] @ vector

    def _projectors(self, project: Projection) -> tuple[Array, Array]:
        """Return T at the state, and the derivative of (1 − T)(y − P(y)).

        Raises
        ------
        StepError
            Constraints are singular here, or cannot be met nearby.
        """
        one, half = np.eye(len(self.y)), (len(self.y) - self._states) // 2

        def projected(y: Array) -> Array:
            return project(self.t, y) / self._scale

        moves = self._moves(self.y, self._rate)
        for wider in _WIDER:
            derivative = self._quotients(projected, self.y, wider * moves)
            if _projects(derivative):
                tangent = np.zeros_like(derivative)
                with suppress(np.linalg.LinAlgError):
                    for part in (slice(half), slice(half, 2 * half), slice(2 * half, None)):
                        tangent[part, part] = _onto(derivative[part, part])
                    return tangent, (one - tangent) @ (one - derivative)
            # A component at 0 may have been moved by next to nothing.
            moves = np.maximum(moves, np.median(moves / self._scale) * self._scale)
        raise StepError(UNMET)

    def _quotients(self, function: Callable[[Array], Array], y: Array, moves: Array) -> Array:
        """Differentiate a function of y by z."""
        return quotients(function, y, moves) * self._scale

    def _moves(self, y: Array, rate: Array) -> Array:
        """Choose distances for quotients."""
        motion = np.maximum(self._moved, np.maximum(self._unit * np.abs(rate), self._atol))
        return distances(y, motion * self._scale)


def _projects(matrix: Array) -> bool:
    """Tell whether a matrix is nearly a projector: its trace is its rank, whatever the units."""
    rank, largest = np.trace(matrix), np.abs(matrix).max()
    off = np.abs(matrix @ matrix - matrix).max()
    return bool(off <= _ROUGH * largest and abs(rank - np.round(rank)) <= _ROUGH * len(matrix))


def _onto(projector: Array) -> Array:
    """Return the orthogonal projector with the range of another one."""
    left = np.linalg.svd(projector)[0][:, : round(np.trace(projector))]
    return np.asarray(left @ left.T)
