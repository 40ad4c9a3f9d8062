"""Select a method by a coarse run: scales of the motion, noise of its steps, and stiffness.

A coarse run finds the scales. The noise of steps, from rounding of the right-hand side, says below
which tolerance nothing is gained. A short trial of an explicit and of an implicit method side by
side says whether the system is stiff.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.accuracy.coarse_run import (
    COARSE_TOLERANCES,
    CoarseRun,
    steady_time,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import CheckpointWriter
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, Integrator
from lagrange_cli.simulate.integrators.base import SavedState
from lagrange_cli.simulate.integrators.external.heyoka_method import Taylor
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, in_mode
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.native.methods import CompiledTaylor
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, structured
from lagrange_cli.simulate.runs.problem import InitialValueProblem, scales_from
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.samples import Grid, decimated
from lagrange_cli.simulate.sharpness import watching
from lagrange_cli.simulate.system.rounding import each_off_by_one_ulp

#: Part of the noise of a step that its error estimate feels.
NOISE_PART = 1 / 16

#: Patterns in which the last places of a state are moved: numbers that are close to each other,
#: and whose difference matters, may move alike in one of them.
_PATTERNS = (0, 1, 2, 3)


def noise_of_steps(
    problem: InitialValueProblem,
    times: Array,
    states: Array,
    lengths: Array,
    closed: Sequence[ContactMode],
) -> Array:
    """Return the changes of steps from some states by rounding of the right-hand side.

    The largest change that the perturbed right-hand sides make, or the last places of the
    state, each by itself: together they may cancel, as in k*(r - l) where both move alike.
    Errors of velocities move positions within the step.

    Parameters
    ----------
    times, states, lengths
        Of the beginning of each step, and its length, shapes (m,), (m, 2n), (m,).
    closed
        Contacts that are closed at each; empty for a system without contacts.

    Returns
    -------
    Shape (m, 2n), 0 where the right-hand side does not exist.
    """
    if problem.perturbed is None:
        return np.zeros(states.shape)
    moved = each_off_by_one_ulp(states, _PATTERNS)
    change = np.empty(states.shape)
    for alike, (rhs, *perturbed) in _smooth_parts(problem, times, states, closed):
        at, there = times[alike], states[alike]
        every = moved[:, alike].reshape(-1, states.shape[1])
        slopes = _slopes(rhs, np.concatenate([at] * len(moved)), every)
        slopes = np.concatenate([slopes, *(_slopes(side, at, there) for side in perturbed)])
        slopes = slopes.reshape(-1, *there.shape)
        change[alike] = np.abs(slopes[1:] - slopes[0]).max(axis=0)
    h = lengths[:, None]
    noise = h * change
    noise[~np.isfinite(noise)] = 0.0
    layout = problem.layout
    noise[:, layout.positions] += h * noise[:, layout.velocities]
    return noise


def _slopes(rhs: Rhs, t: Array, y: Array) -> Array:
    """Evaluate a right-hand side at many states, shapes (m,), (m, 2n) → (m, 2n)."""
    if isinstance(rhs, NativeRhs) and rhs.kernels is not None:
        return rhs.table(t, y, y.shape[1])
    return np.array([rhs(s, state) for s, state in zip(t.tolist(), y, strict=True)])


def _smooth_parts(
    problem: InitialValueProblem, t: Array, y: Array, closed: Sequence[ContactMode]
) -> Iterable[tuple[list[int] | slice, list[Rhs]]]:
    """Divide states into those of one mode, with the right-hand side and the perturbed ones in it,
    without the jumps that a last place may cross."""
    sides = [problem.rhs, *(problem.perturbed or ())]
    surfaces = [structured(rhs).surfaces for rhs in sides]
    if surfaces[0] is None and not any(closed):
        return [(slice(None), sides)]
    parts: dict[Any, tuple[list[int], list[Rhs]]] = {}
    for k, mode in enumerate(closed):
        around = None if mode or surfaces[0] is None else surfaces[0].around(float(t[k]), y[k])
        if (mode, around) not in parts:
            smooth = [in_mode(rhs, mode) for rhs in sides]
            if around is not None:
                smooth = [every.side(around) for every in surfaces if every is not None]
            parts[mode, around] = [], smooth
        parts[mode, around][0].append(k)
    return parts.values()


#: Right-hand sides that each method may take.
_LONGEST_TRIAL = 4_000

#: Factor by which the implicit method must come farther: its steps cost more besides.
_AHEAD = 2.0

#: First step of the trial as a part of the span.
_FIRST_TRIAL_STEP = 1e-8

#: Finest tolerance at which the trial is made.
_FINEST = 1e-12


@dataclass(frozen=True)
class StiffnessTrial:
    """Outcome of a trial: the implicit method came farther or not, and the right-hand sides
    used."""

    stiff: bool
    evaluations: int


def stiffness_trial(
    problem: InitialValueProblem,
    t: float,
    y: Array,
    tolerance: float,
    scales: Array,
    least: Array,
    watch: Watch,
) -> StiffnessTrial:
    """Let both methods start from (t, y), past any initial layer, at the tolerance to come.

    ``least``: the smallest absolute tolerance, below which steps only chase rounding.
    """
    remaining = replace(problem, y0=y, times=np.array([t, problem.until]))
    tolerance = max(tolerance, _FINEST)
    n, size = len(problem.kinds), problem.layout.size
    reached, evaluations = [], 0
    for name in ("DOP853", "Radau"):
        control = Control(
            rtol=np.where(np.arange(size) < n, 0.0, tolerance),
            atol=np.maximum(tolerance * scales, least),
            first_step=problem.span * _FIRST_TRIAL_STEP,
            max_step=problem.longest_step,
        )
        run = Run(INTEGRATORS[name], remaining, control)
        while run.go(len(remaining.times), most_evaluations=_LONGEST_TRIAL - run.evaluations):
            watch((t - problem.start) / problem.span)
            if run.evaluations >= _LONGEST_TRIAL:
                break
        reached.append(run.t - t)
        evaluations += run.evaluations
    return StiffnessTrial(reached[1] > _AHEAD * reached[0], evaluations)


#: A step beside the time in which accelerations stay about what they are.
_STEADY_STEPS = 0.1

#: States at which rounding of the right-hand side is looked at, as parts of the samples.
_NOISE_PARTS = np.arange(16) / 15

#: Numbers of the samples of the coarse run, where those that are asked for are not in memory.
_MOST = 2**20

#: Right-hand sides after which the explicit run pauses to ask whether the system is stiff.
_PROBE_AFTER = 20_000


@dataclass(frozen=True)
class CoarseResult:
    """Scales, method and steps that a coarse run finds for the runs to come.

    Attributes
    ----------
    largest
        Distances from the start and speeds so far, at each sample it reached, shape (samples, 2n).
    scales
        Scales of the whole motion, shape (2n,).
    noise
        Rounding error of a step so far, at samples equally far apart, shape (NOISE_SAMPLES at
        most, 2n): a tolerance below it would only chase rounding.
    closest
        How close to the origin each coordinate came in short steps, relative to the scales,
        shape (2n,).
    method
        The method for the runs to come: explicit, or implicit where the system is stiff.
    first_step
        First step of the runs to come, in units of time.
    evaluations
        Right-hand sides that the coarse run took.
    between
        How far components go between samples that do not show it, shape (2n,).
    stride
        Samples asked for that one sample of the coarse run stands for.
    sharp
        True if steps are made again for peaks of sharp functions.
    """

    largest: Array
    scales: Array
    noise: Array
    closest: Array
    method: type[Integrator]
    first_step: float
    evaluations: int
    between: Array
    stride: int = 1
    sharp: bool = False

    def scales_so_far(self, problem: InitialValueProblem, samples: NDArray[np.int_]) -> Array:
        """Return the scales within some numbers of samples (m,), shape (m, 2n)."""
        largest = self.largest[np.minimum(self._own(samples), len(self.largest)) - 1]
        return scales_from(problem, largest)

    def _own(self, samples: NDArray[np.int_]) -> NDArray[np.int_]:
        """Return the numbers of coarse samples within numbers of samples."""
        return -(-samples // self.stride)

    @property
    def relative_noise(self) -> float:
        """The typical noise beside the scales, of the component where it is largest."""
        # The median, since the noise so far ascends.
        typical = (self.noise[(len(self.noise) - 1) // 2] + self.noise[len(self.noise) // 2]) / 2
        typical /= self.scales
        return float(typical[np.isfinite(typical)].max(initial=0.0))

    def noise_so_far(self, samples: NDArray[np.int_]) -> Array:
        """Return the noise within some numbers of samples (m,), shape (m, 2n)."""
        part = np.minimum(self._own(samples) / len(self.largest), 1.0)
        return np.asarray(self.noise[np.rint(part * (len(self.noise) - 1)).astype(int)])

    def finer(self, factor: float) -> CoarseResult:
        """Return the result for arithmetic whose rounding is this part of doubles'."""
        return replace(self, noise=factor * self.noise)

    def state(self) -> SavedState:
        """Return the result as plain values."""
        numbers = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**numbers, "method": self.method.name}

    @classmethod
    def restored(cls, state: SavedState) -> CoarseResult:
        """Rebuild a result from its :meth:`state`."""
        return cls(**{**state, "method": INTEGRATORS[state["method"]]})

    @property
    def stiff(self) -> bool:
        """True if the method for the runs to come is implicit."""
        return self.method.implicit


def restored_or_coarse_result(
    problem: InitialValueProblem,
    tolerance: float,
    watch: Watch,
    keeper: CheckpointWriter | None,
) -> CoarseResult:
    """Return the result of the coarse run, or that from before an interruption."""
    if keeper is not None and keeper.before is not None:
        return CoarseResult.restored(keeper.before["coarse"])
    return coarse_result(problem, tolerance, watch)


def coarse_result(problem: InitialValueProblem, tolerance: float, watch: Watch) -> CoarseResult:
    """Run coarsely over the whole problem; ``tolerance`` is that of the runs to come."""
    many = isinstance(problem.times, Grid)
    stride = -(-len(problem.times) * len(problem.y0) // _MOST) if many else 1
    problem, spent = watching(problem), 0
    if many:
        problem = replace(problem, times=decimated(problem.times, stride))
    for coarse in COARSE_TOLERANCES:
        coarse_run = CoarseRun(problem, watch, coarse)
        run, method, trial = _followed(problem, coarse_run, tolerance, watch)
        spent += trial + run.evaluations
        if not coarse_run.too_close:
            break
    largest, scales, between = coarse_run.scales(run)
    return CoarseResult(
        largest,
        scales,
        _noise(problem, run, coarse_run),
        coarse_run.closest,
        method,
        coarse_run.first_step,
        spent,
        between,
        stride,
        sharp=coarse_run.explicit.remade + run.remade > 0,
    )


def _followed(
    problem: InitialValueProblem, coarse_run: CoarseRun, tolerance: float, watch: Watch
) -> tuple[Run, type[Integrator], int]:
    """Run coarsely to the end; return the run, the method for further ones, and the evaluations
    that were spent besides."""
    run, method = coarse_run.explicit, explicit_method(problem)
    if coarse_run.go(run, _PROBE_AFTER) or coarse_run.too_close:
        return run, method, 0
    at = np.array([run.t])
    steps = coarse_run.steps_at(at)
    least = NOISE_PART * noise_of_steps(problem, at, run.y[None], steps, [run.closed])[0]
    scales = coarse_run.motion.scales
    probed = stiffness_trial(problem, run.t, run.y, tolerance, scales, least, watch)
    spent = probed.evaluations
    if probed.stiff:
        method, spent = INTEGRATORS["Radau"], spent + run.evaluations
        run = coarse_run.implicit()
    coarse_run.go(run)
    return run, method, spent


def suits_gauss(rhs: Rhs) -> bool:
    """Tell if Gauss16 is fast: compiled, for doubles, and without rows of inputs, which make steps
    so short that DOP853 is cheaper. Where constraints are kept it is no faster, and its iteration
    ends at singular configurations that explicit stages pass."""
    fast = isinstance(rhs, NativeRhs) and rhs.real is DOUBLE and structured(rhs).pieces is None
    return fast and structured(rhs).project is None


def _suits_taylor(rhs: Rhs, size: int) -> bool:
    """Tell if series that heyoka compiles stand in for a C compiler: it is installed, and the
    right-hand side can be written in expressions without kinks."""
    smooth = structured(rhs).surfaces is None
    return smooth and not isinstance(rhs, NativeRhs) and Taylor.suits(rhs, size)


def explicit_method(problem: InitialValueProblem) -> type[Integrator]:
    """Return the method for motion that is not stiff."""
    if isinstance(problem.rhs, NativeRhs) and problem.rhs.series is not None:
        return CompiledTaylor
    # Perturbed companions have more operations, and may be too long where the run is not.
    every = (problem.rhs, *(problem.perturbed or ()))
    if all(_suits_taylor(rhs, len(problem.y0)) for rhs in every):
        return INTEGRATORS["taylor"]
    return INTEGRATORS["Gauss16" if suits_gauss(problem.rhs) else "DOP853"]


def reason_for_method(coarse: CoarseResult) -> str:
    """Say in words why a method was selected."""
    if coarse.stiff:
        return "a coarse trial found the system stiff: an implicit method needs fewer evaluations"
    reason = "an explicit method of high order"
    if coarse.method is INTEGRATORS["taylor"]:
        reason = "series that are compiled without a compiler of C"
    elif coarse.method is INTEGRATORS["Gauss16"]:
        reason = "compiled collocation of order 16"
    return f"no stiffness was found: {reason}"


def _noise(problem: InitialValueProblem, run: Run, coarse_run: CoarseRun) -> Array:
    """Return the effect of rounding on a step of mean size, or of the local size if smaller, so
    far, shape (samples, 2n)."""
    if run.steps == 0:
        return np.zeros((1, len(problem.y0)))
    picked = np.rint(_NOISE_PARTS * (run.filled - 1)).astype(int)
    most = min(run.mean_step, problem.longest_step)
    # At the start steps are short because motion that begins has no scale yet.
    shortest = coarse_run.first_step / _STEADY_STEPS
    steady = _STEADY_STEPS * steady_time(problem, shortest, most / _STEADY_STEPS, run.began)
    times = problem.times[:][picked]
    lengths = np.minimum(np.maximum(coarse_run.steps_at(times), (picked == 0) * steady), most)
    closed = [run.closed_at(t) for t in times.tolist()]
    each = noise_of_steps(problem, times, run.states[picked], lengths, closed)
    return np.asarray(np.maximum.accumulate(each, axis=0))
