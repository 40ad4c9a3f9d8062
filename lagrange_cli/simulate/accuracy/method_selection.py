"""Select a method by a coarse run: scales of the motion, step lengths, and stiffness."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from lagrange_cli.simulate.accuracy.coarse_run import (
    COARSE,
    COARSE_TOLERANCES,
    CoarseRun,
    few_steps,
    steady_time,
)
from lagrange_cli.simulate.accuracy.roundoff import NOISE_PART, noise_of_step
from lagrange_cli.simulate.accuracy.stiffness import stiffness_trial
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import CheckpointWriter
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators import INTEGRATORS, Integrator
from lagrange_cli.simulate.integrators.base import Rhs, SavedState
from lagrange_cli.simulate.integrators.external.heyoka_method import Taylor
from lagrange_cli.simulate.integrators.hybrid.surfaces import surfaces_of
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.piecewise import input_pieces
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.samples.rows import Grid, decimated
from lagrange_cli.simulate.sharpness.analyticity import AnalyticDiscs, longest_step
from lagrange_cli.simulate.sharpness.peaks import watching

#: Right-hand sides of a motion of few steps from which on another method is tried.
_WORTH_TRYING = 300

#: A step beside the time in which accelerations stay about what they are.
_STEADY_STEPS = 0.1

#: States at which rounding of the right-hand side is looked at.
_NOISE_SAMPLES = 16

#: Numbers of the samples of the coarse run, where those that are asked for are not in memory.
_MOST = 2**20

#: Right-hand sides after which the explicit run pauses to ask whether the system is stiff.
_PROBE_AFTER = 20_000

#: The tolerance from which on Gauss16 takes about as few right-hand sides as DOP853, or fewer;
#: side by side, eight cost little more than one or two.
_FINE = 2e-11


@dataclass(frozen=True)
class CoarseResult:
    """Scales, method and steps that a coarse run finds for the runs to come.

    Attributes
    ----------
    scales
        Those of q and q̇ so far at each sample it reached, shape (samples, 2n).
    noise
        Rounding error of a step so far, at samples equally far apart, shape (NOISE_SAMPLES at
        most, 2n): a tolerance below it would only chase rounding.
    closest
        How close to the origin each coordinate came in short steps, relative to the scales,
        shape (2n,).
    method
        The method for the runs to come: explicit, or implicit where the system is stiff.
    first_step, longest_step
        Steps of the runs to come, in units of time.
    evaluations
        Right-hand sides that the coarse run took.
    between
        How far components go between samples that do not show it, shape (2n,).
    stride
        Samples asked for that one sample of the coarse run stands for.
    sharp
        True if steps are made again for peaks of sharp functions.
    """

    scales: Array
    noise: Array
    closest: Array
    method: type[Integrator]
    first_step: float
    longest_step: float
    evaluations: int
    between: Array
    stride: int = 1
    sharp: bool = False

    def scales_so_far(self, samples: int) -> Array:
        """The scales within a number of samples."""
        return np.asarray(self.scales[min(self._own(samples), len(self.scales)) - 1])

    def _own(self, samples: int) -> int:
        """Return the number of coarse samples within a number of samples."""
        return -(-samples // self.stride)

    @property
    def relative_noise(self) -> float:
        """The typical noise beside the scales, of the component where it is largest."""
        # The median; numpy.median would import much.
        ascending, middle = np.sort(self.noise, axis=0), (len(self.noise) - 1) / 2
        median = (ascending[math.floor(middle)] + ascending[math.ceil(middle)]) / 2
        typical = median / self.scales[-1]
        return float(np.max(typical, initial=0.0, where=np.isfinite(typical)))

    def noise_so_far(self, samples: int) -> Array:
        """The noise within a number of samples."""
        part = min(self._own(samples) / len(self.scales), 1.0)
        return np.asarray(self.noise[round(part * (len(self.noise) - 1))])

    def finer(self, factor: float) -> CoarseResult:
        """The same found with arithmetic whose rounding is that part of doubles'."""
        return replace(self, noise=factor * self.noise)

    def state(self) -> SavedState:
        """The same as plain values."""
        numbers = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**numbers, "method": self.method.name}

    @classmethod
    def restored(cls, state: SavedState) -> CoarseResult:
        """Rebuild a result from its :meth:`state`."""
        return cls(**{**state, "method": INTEGRATORS[state["method"]]})

    @property
    def stiff(self) -> bool:
        return self.method.implicit


def restored_or_coarse_result(
    problem: InitialValueProblem,
    tolerance: float,
    watch: Watch,
    keeper: CheckpointWriter | None,
    *,
    looks: bool = False,
) -> CoarseResult:
    """Return the result of the coarse run, or that from before an interruption."""
    if keeper is not None and keeper.before is not None:
        return CoarseResult.restored(keeper.before["pilot"])
    return coarse_result(problem, tolerance, watch, looks=looks)


def coarse_result(
    problem: InitialValueProblem, tolerance: float, watch: Watch, *, looks: bool = False
) -> CoarseResult:
    """Run coarsely over the whole problem; ``tolerance`` is that of the runs to come.

    Where it ``looks``, steps are as long as :mod:`.sharpness.analyticity` shows that they may be.
    """
    many = isinstance(problem.times, Grid)
    stride = -(-len(problem.times) * len(problem.y0) // _MOST) if many else 1
    problem, spent = replace(watching(problem), times=decimated(problem.times, stride)), 0
    discs = AnalyticDiscs(problem)
    # What has a kink is analytic in no disc around it.
    looks = looks and surfaces_of(problem.rhs) is None
    reach = discs.first(CoarseRun(problem, watch, COARSE).places[0]) if looks else 0.0
    for coarse in COARSE_TOLERANCES:
        coarse_run, run, method, more = _tracked(problem, coarse, tolerance, reach, watch)
        spent += more
        while not coarse_run.shown(seen := coarse_run.see(discs, tolerance)):
            reach = seen
            coarse_run, run, method, more = _tracked(problem, coarse, tolerance, reach, watch)
            spent += more
        reach = seen
        if not coarse_run.too_close:
            break
    longest = longest_step(problem, reach)
    if longest > problem.longest_step:
        few = few_steps(problem, reach)
        method, trial = _method_of_tame(problem, method, tolerance, coarse_run if few else None)
        spent += trial
    scales, noise = coarse_run.scales(run), _noise(problem, run, coarse_run.step_at)
    closest, first_step = coarse_run.closest, coarse_run.first_step
    between = coarse_run.between(run)
    sharp = coarse_run.explicit.remade + run.remade > 0
    return CoarseResult(
        scales, noise, closest, method, first_step, longest, spent, between, stride, sharp
    )


def _method_of_tame(
    problem: InitialValueProblem,
    method: type[Integrator],
    tolerance: float,
    coarse_run: CoarseRun | None,
) -> tuple[type[Integrator], int]:
    """Select the method of fewest right-hand sides for long steps; return it and what the trial
    took. ``coarse_run``: the coarse run if it was at the tolerance to come, else None.

    Steps as long as the motion is tame take many iterations of Gauss16; but where constraints
    are kept, fewer steps are fewer projections.
    """
    names, rhs = ("DOP853", "Gauss16"), problem.rhs
    suits = isinstance(rhs, NativeRhs) and input_pieces(rhs) is None
    if method.name not in names or not suits or tolerance > _FINE:
        return method, 0
    if coarse_run is None:
        return INTEGRATORS[names[not suits_gauss(rhs)]], 0
    by_gauss, cost = False, 0
    if suits_gauss(rhs) and coarse_run.explicit.evaluations > _WORTH_TRYING:
        by_gauss, cost = _cheaper_by_gauss(problem, coarse_run)
    return INTEGRATORS[names[by_gauss]], cost


def _cheaper_by_gauss(problem: InitialValueProblem, coarse_run: CoarseRun) -> tuple[bool, int]:
    """Tell if Gauss16 takes fewer right-hand sides for half of the way than the coarse run; return
    that and what the trial took."""
    trial = Run(INTEGRATORS["Gauss16"], problem, coarse_run.control_of_trial)
    half, most = 1 + len(problem.times) // 2, coarse_run.explicit.evaluations
    while trial.filled < half and trial.evaluations < most:
        if not trial.go(half, most_evaluations=most - trial.evaluations):
            break
    reached = trial.failure is None and trial.filled >= half
    return reached and trial.evaluations < coarse_run.spent_until(trial.t), trial.evaluations


def _tracked(
    problem: InitialValueProblem, coarse: float, tolerance: float, reach: float, watch: Watch
) -> tuple[CoarseRun, Run, type[Integrator], int]:
    """A coarse run with sight of so much, the method for further ones, and what both cost."""
    finer = min(coarse, tolerance) if few_steps(problem, reach) else coarse
    coarse_run = CoarseRun(problem, watch, finer, reach)
    run, method, trial = _followed(problem, coarse_run, tolerance, watch)
    return coarse_run, run, method, trial + run.evaluations


def _followed(
    problem: InitialValueProblem, coarse_run: CoarseRun, tolerance: float, watch: Watch
) -> tuple[Run, type[Integrator], int]:
    """A coarse run to the end, the method for further ones, and what it cost to find that."""
    run, method = coarse_run.explicit, explicit_method(problem, tolerance)
    if coarse_run.go(run, _PROBE_AFTER) or coarse_run.too_close:
        return run, method, 0
    least = NOISE_PART * noise_of_step(problem, run.t, run.y, coarse_run.step_at(run.t))
    probed = stiffness_trial(problem, run.t, run.y, tolerance, coarse_run.seen(), least, watch)
    spent = probed.evaluations
    if probed.stiff:
        method, spent = INTEGRATORS["Radau"], spent + run.evaluations
        run = coarse_run.implicit()
    coarse_run.go(run, None)
    return run, method, spent


def suits_gauss(rhs: Rhs) -> bool:
    """Tell if Gauss16 is fast: its stages side by side, and no rows of inputs, which make steps so
    short that DOP853 is cheaper."""
    return (
        isinstance(rhs, NativeRhs) and rhs.lanes_address is not None and input_pieces(rhs) is None
    )


def suits_taylor(rhs: Rhs, size: int) -> bool:
    """Tell if series that heyoka compiles stand in for a C compiler: it is installed, and the
    right-hand side can be written in expressions without kinks."""
    smooth = surfaces_of(rhs) is None
    return smooth and not isinstance(rhs, NativeRhs) and Taylor.suits(rhs, size)


def explicit_method(problem: InitialValueProblem, tolerance: float) -> type[Integrator]:
    """The method for motion that is not stiff."""
    if suits_taylor(problem.rhs, len(problem.y0)):
        return INTEGRATORS["taylor"]
    fits = tolerance <= _FINE and suits_gauss(problem.rhs)
    return INTEGRATORS["Gauss16" if fits else "DOP853"]


def reason_for_method(coarse: CoarseResult, usual: float) -> str:
    """Say in words why a method was selected; ``usual``: longest step of most runs, in time."""
    if coarse.stiff:
        return "a coarse trial found the system stiff: an implicit method needs fewer evaluations"
    reason, by_gauss = "an explicit method of high order", coarse.method is INTEGRATORS["Gauss16"]
    if coarse.method is INTEGRATORS["taylor"]:
        reason = "series that are compiled without a compiler of C"
    if coarse.longest_step > usual:
        reason = "collocation at eight points" if by_gauss else reason
        reason += ", in long steps: nothing sharp is near the motion, around which it is analytic"
    elif by_gauss:
        reason = "collocation, whose eight stages are evaluated side by side"
    return f"no stiffness was found: {reason}"


def _noise(problem: InitialValueProblem, run: Run, step_at: Callable[[float], float]) -> Array:
    """Return the effect of rounding on a step of mean size, or of the local size if smaller, so
    far, shape (samples, 2n)."""
    if run.steps == 0:
        return np.zeros((1, len(problem.y0)))
    picked = np.linspace(0, run.filled - 1, _NOISE_SAMPLES).round().astype(int)
    most = min(run.mean_step, problem.longest_step)
    steady, each = steady_time(problem, most), []
    for k in picked.tolist():
        t = float(problem.times[k])
        # At the start steps are short because motion that begins has no scale yet.
        least = _STEADY_STEPS * steady if k == 0 else 0.0
        h = min(max(step_at(t), least), most)
        each.append(noise_of_step(problem, t, run.states[k], h))
    return np.maximum.accumulate(np.array(each), axis=0)
