"""Tolerance schedule of an attempt: absolute tolerances that grow with the motion."""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.accuracy.coarse_run import LEAST
from lagrange_cli.simulate.accuracy.method_selection import CoarseResult
from lagrange_cli.simulate.accuracy.roundoff import NOISE_PART
from lagrange_cli.simulate.integrators import Control, Integrator
from lagrange_cli.simulate.integrators.base import Loosening
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE
from lagrange_cli.simulate.runs.problem import InitialValueProblem

#: Part of the tolerance that does not shrink with |y|; set by hand.
_ABSOLUTE_PART = 0.1

#: The same at least, if y comes close to 0; set by hand.
_LEAST_PART = 1e-12

#: Samples in which absolute tolerances stay as they are, in doubles and in wider arithmetic, and
#: the largest number of such stretches; set by hand.
_STRETCH, _STRETCH_WIDER, _MOST_STRETCHES = 64, 4, 2**14

#: Least scale so far as a part of the last one, at each attempt: motion that grows from almost
#: nothing may need it resolved.
_SMALLEST_SCALE = (1e-9, 1e-60, 0.0)


class ToleranceSchedule:
    """Tolerances of attempt ``number`` at a problem, relative to the scales of a coarse run."""

    def __init__(self, problem: InitialValueProblem, coarse: CoarseResult, number: int) -> None:
        self._problem, self._coarse, n = problem, coarse, len(problem.kinds)
        self._smallest = _SMALLEST_SCALE[min(number, len(_SMALLEST_SCALE) - 1)]
        #: Components that sweep over their own size.
        self._sweeping = np.abs(problem.y0) <= coarse.scales
        self._sweeping[:n] &= ~problem.angles
        # Part of the tolerance that does not shrink with |y|, less if y comes near 0.
        part = np.maximum(_ABSOLUTE_PART * coarse.closest, _LEAST_PART)
        stretch = _STRETCH if problem.real is DOUBLE else _STRETCH_WIDER
        stretch = max(stretch, len(problem.times) // _MOST_STRETCHES)
        #: The times at which stretches of samples begin, shape (k,).
        self._since = problem.times[::stretch]
        # Samples that are reached where stretches begin, and all of them, shape (k + 1,).
        end = len(self._since) * stretch + 2
        reached = np.minimum(np.arange(1, end, stretch), len(problem.times))
        so_far = np.maximum(coarse.scales_so_far(problem, reached), self._smallest * coarse.scales)
        #: Scales of absolute tolerances where stretches begin, and at the end, (k + 1, 2n).
        self._scales = np.where(self._sweeping, part * so_far, coarse.scales)
        #: The least absolute tolerances there, shape (k + 1, 2n).
        self._noise = NOISE_PART * coarse.noise_so_far(reached) + LEAST

    def control(
        self, method: type[Integrator], tolerance: float, first_step: float, longest: float
    ) -> Control:
        """Return tolerances and step limits of a run from its start."""
        # A component that sweeps over its own size is taken relatively, so that
        # motion of many sizes (a comet's) is resolved at each; an angle, or a
        # position far from the origin, relative to how far it moves.
        rows = np.maximum(tolerance * self._scales, self._noise)
        return Control(
            np.where(self._sweeping, tolerance, 0.0),
            rows[-1 if method.implicit else 0].copy(),
            first_step,
            longest,
            autonomous=self._problem.autonomous,
            loosening=None if method.implicit else Loosening(self._since, rows[:-1]),
        )

    @property
    def loose_at_first(self) -> bool:
        """True if the absolute tolerance at first follows a least scale, not the motion so far."""
        first = self._coarse.scales_so_far(self._problem, np.array([1]))
        return bool((first < self._smallest * self._coarse.scales).any())
