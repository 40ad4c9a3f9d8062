"""What methods of fixed step share; the sum over steps is compensated (:mod:`.scipy_methods`)."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Control, Integrator, Rhs


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """a + b as a rounded sum and its exact rounding error (Knuth)."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


class FixedStep(Integrator):
    """Steps of ``control.step``, shorter ones at the end of what is asked for."""

    adaptive = False
    interpolates = False
    kept: ClassVar[tuple[str, ...]] = ("_low",)

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        if control.step is None:
            raise ValueError(f"{self.name} needs control.step")
        self._rhs, self._h = self._counted(rhs), control.step
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        self._low = np.zeros_like(self.y)

    def step(self, limit: float) -> None:
        t = self.t
        # A remainder of rounding size joins the step rather than becoming one.
        t_new = t + self._h if limit - t > self._h * (1 + 1e-9) else limit
        y, low = two_sum(self.y, self._low + self._change(t, t_new - t))
        projected = self._arrived(t_new, y)
        if projected is not y:
            self._moved()
        self.t, self.y, self._low = t_new, projected, low

    @abstractmethod
    def _change(self, t: float, h: float) -> Array:
        """Return the change of the state over a step, without the rounding of the sum."""

    def _moved(self) -> None:
        """Forget what belongs to a state that was then projected."""
