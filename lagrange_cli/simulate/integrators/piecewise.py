"""Runs of a method that begins anew in each piece of the inputs of a right-hand side."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Control, Integrator, SavedState
from lagrange_cli.simulate.integrators.right_hand_side import StructuredRhs


def in_pieces(
    method: type[Integrator],
    rhs: StructuredRhs,
    t0: float,
    y0: Array,
    t_end: float,
    control: Control,
) -> Integrator:
    """Start a run of a method that begins anew in each piece of ``rhs``."""
    kind = _Interpolating if method.interpolates else _Piecewise
    return kind(method, rhs, t0, y0, t_end, control)


class _Piecewise(Integrator):
    """Runs of a method, one a piece."""

    interpolates: ClassVar[bool] = False

    def __init__(
        self,
        method: type[Integrator],
        rhs: StructuredRhs,
        t0: float,
        y0: Array,
        t_end: float,
        control: Control,
    ) -> None:
        assert rhs.pieces is not None
        self._method, self._rhs, self._pieces = method, rhs, rhs.pieces
        self._projection = rhs.project
        self._control, self.t_end = control, t_end
        self._before = 0
        self._begin(self._pieces.first(t0), t0, y0, control.first_step)

    def _begin(self, piece: int, t: float, y: Array, first_step: float) -> None:
        self._piece, self._taken, self._from = piece, (first_step, 0.0), (t, y)
        end = min(self._pieces.end(piece), self.t_end)
        # The tolerances stay those of the control, which may change between steps.
        control = replace(self._control, first_step=first_step)
        self._run = self._method(self._rhs.in_piece(piece), t, y, end, control)
        self.t, self.y = self._run.t, self._run.y
        self.evaluations = self._before + self._run.evaluations

    def state(self) -> SavedState:
        values = {"piece": self._piece, "taken": self._taken, "from": self._from}
        return {**super().state(), **values, "before": self._before, "run": self._run.state()}

    def restore(self, state: SavedState) -> None:
        t, y = state["from"]
        self._begin(state["piece"], t, y, state["taken"][0])
        self._run.restore(state["run"])
        self._taken, self._before = state["taken"], state["before"]
        super().restore(state)

    def step(self, limit: float) -> None:
        if self.t >= self._run.t_end and self.t < self.t_end:
            # The last step may have been cut by the end of the piece, the one before was not.
            self._before = self.evaluations
            self._begin(self._piece + 1, self.t, self.y, max(self._taken))
        run = self._run
        try:
            run.step(run.t_end if self.interpolates else min(limit, run.t_end))
        finally:
            self.evaluations = self._before + run.evaluations
        self._taken = (self._taken[1] or run.t - self.t, run.t - self.t)
        self.t, self.y = run.t, run.y


class _Interpolating(_Piecewise):
    """The same of a method that interpolates."""

    interpolates: ClassVar[bool] = True

    def interpolate(self, times: Array) -> Array:
        return self._run.interpolate(times)
