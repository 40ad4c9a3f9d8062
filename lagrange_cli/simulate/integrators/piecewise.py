"""Right-hand sides with inputs that are other numbers in each piece of time.

Within a piece such a right-hand side is smooth; at its end it may jump, or have a kink. So
steps end where a piece ends, and begin there with the numbers of the next one: the order of
a method, and its estimate of errors, hold as for any smooth problem.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    ConstrainedRhs,
    Control,
    Integrator,
    Projection,
    Rhs,
    SavedState,
    Shift,
    projection,
)

#: Units in the last place within which times are the same.
_SAME_TIME_ULPS = 16


@dataclass(frozen=True)
class InputPieces:
    """Numbers ``rows[k]``, which hold from ``starts[k]`` (ascending) to the next start.

    The first row holds before the first start too; at a start the new row does.
    ``rows`` has shape (len(starts), width). The values of ``functions`` of time follow the numbers
    of a row; they are smooth, and evaluated by Python at every time.
    """

    starts: Array
    rows: Array
    functions: tuple[Callable[[float], float], ...] = ()

    def at(self, t: float) -> int:
        """Return the number of the piece that holds at a time, and on from there."""
        return max(int(np.searchsorted(self.starts, t, side="right")) - 1, 0)

    def values(self, t: float) -> list[float]:
        """Return all numbers at a time."""
        return [*self.rows[self.at(t)].tolist(), *(function(t) for function in self.functions)]

    def first(self, t: float) -> int:
        """Return the piece in which a run begins: not one that ends within the rounding of t.

        A start may be found, as where a contact closes, and be meant to be its end.
        """
        return self.at(t + _SAME_TIME_ULPS * math.ulp(t))

    def end(self, piece: int) -> float:
        """Return the time at which a piece ends, infinite for the last."""
        return float(self.starts[piece + 1]) if piece + 1 < len(self.starts) else math.inf


@dataclass(frozen=True)
class PiecewiseRhs:
    """A right-hand side whose inputs are other numbers in each piece.

    Attributes
    ----------
    pieces
        Numbers of the pieces.
    within
        Makes the right-hand side for the numbers of one piece.
    project
        Moves a state onto the constraints; None without constraints.
    """

    pieces: InputPieces
    within: Callable[[Array], Rhs]
    project: Projection | None = None

    def __call__(self, t: float, y: Array) -> Array:
        return self.in_piece(self.pieces.at(t))(t, y)

    def in_piece(self, piece: int) -> Rhs:
        """Make the right-hand side with the numbers of one piece, at any time."""
        return self.within(self.pieces.rows[piece])


def input_pieces(rhs: Rhs) -> InputPieces | None:
    """Return the pieces of a right-hand side, None if it has none."""
    pieces: InputPieces | None = getattr(rhs, "pieces", None)
    return pieces


def with_projection(rhs: Rhs, project: Projection, shift: Shift | None = None) -> Rhs:
    """Give a right-hand side, with pieces or without, a projection onto constraints."""
    if isinstance(rhs, PiecewiseRhs):
        within = rhs.within
        return PiecewiseRhs(
            rhs.pieces, lambda row: ConstrainedRhs(within(row), project, shift), project
        )
    return ConstrainedRhs(rhs, project, shift)


def in_pieces(
    method: type[Integrator], rhs: Any, t0: float, y0: Array, t_end: float, control: Control
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
        rhs: Any,
        t0: float,
        y0: Array,
        t_end: float,
        control: Control,
    ) -> None:
        self._method, self._rhs, self._pieces = method, rhs, rhs.pieces
        self._projection = projection(rhs)
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
