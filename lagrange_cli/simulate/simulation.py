"""Equations → Trajectory: what was asked for, resolved, integrated and gathered."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem, placed
from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
from lagrange_cli.simulate.accuracy.measured import Measured
from lagrange_cli.simulate.accuracy.user_method import integrate_with_method
from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint, CheckpointWriter, identity
from lagrange_cli.simulate.checkpoint.progress import Deadline, RunProgress, Watch
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.integrators.external.heyoka_method import Taylor
from lagrange_cli.simulate.integrators.native.methods import COMPILED
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import Request, resolve
from lagrange_cli.simulate.results.columns import sampled, state_columns
from lagrange_cli.simulate.results.outcome import reason, status
from lagrange_cli.simulate.results.streaming import (
    Stream,
    buffers,
    shown_samples,
    written_in_windows,
)
from lagrange_cli.simulate.results.trajectory import Event, Slide, Trajectory
from lagrange_cli.simulate.runs.problem import InitialValueProblem, require_a_start, sampled_start
from lagrange_cli.simulate.samples import Grid, RowSequence, SampleBuffer
from lagrange_cli.simulate.sharpness import unseen_forces
from lagrange_cli.simulate.system.functions import (
    KeptFunctions,
    RightHandSide,
    WiderArithmetic,
)
from lagrange_cli.simulate.system.singular_guard import guard_signs
from lagrange_cli.simulate.verification.branching import without_branches
from lagrange_cli.simulate.verification.contact_history import MotionFunctions, functions_along
from lagrange_cli.simulate.verification.disproof import cut_at_disproof
from lagrange_cli.simulate.verification.drifts import EnergyDrift, conserved_drifts
from lagrange_cli.simulate.verification.uniqueness import require_unique_start, unbounded_slopes
from lagrange_cli.stages import is_to_end

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache
    from lagrange_cli.mechanics.equations import Equations

#: Looks at all times and states of a stream, and at what is known of them.
Look: TypeAlias = Callable[[RowSequence, RowSequence, Trajectory], None]


@dataclass(frozen=True)
class RunContext:
    """Means and listeners of a run, which no result depends on, beside the user's options.

    Attributes
    ----------
    functions
        What evaluates the model; by default as ``kept_functions`` or ``cache`` make it.
    kept_functions
        Makes functions, and keeps what it has compiled in memory; None if that is not wanted.
    cache
        Keeps what is compiled; by default the user's.
    stream
        What becomes of samples that are more than memory should hold; by default they are
        refused.
    checkpoint
        Where to write the state of the run now and then, and when it is stopped.
    progress
        Called with a fraction from 0 to 1 that never falls.
    reached
        Called with the simulated time, which begins anew with each pass over the samples.
    stop
        Asked often; once it is true the run stops and keeps what it has.
    """

    functions: RightHandSide | None = None
    kept_functions: KeptFunctions | None = None
    cache: Cache | None = None
    stream: Stream | None = None
    checkpoint: Checkpoint | None = None
    progress: Callable[[float], None] | None = None
    reached: Callable[[float], None] | None = None
    stop: Callable[[], bool] | None = None

    def functions_of(self, model: Model, budget: float | None) -> RightHandSide:
        """Return what evaluates a model, compiled if there is a C compiler, else interpreted."""
        if self.functions is not None:
            return self.functions
        maker = self.kept_functions or KeptFunctions(self.cache)
        return maker(model, budget)

    def resolved(self, model: Model, options: SimulationOptions) -> Request:
        """Resolve options with these means; refuses as :func:`.request.resolve`."""
        return resolve(model, options, None if self.stream is None else self.stream.in_memory)


def simulate(
    system: Equations | Model,
    *,
    until: float | None = None,
    accuracy: float | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    step: float | None = None,
    samples: int | None = None,
    budget: float | None = None,
    times: Sequence[float] | None = None,
    progress: Callable[[float], None] | None = None,
    reached: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
    functions: RightHandSide | None = None,
    cache: Cache | None = None,
    stream: Stream | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trajectory:
    """Integrate the equations of motion from their initial state.

    Options that are None come from the scene's section ``simulate``; without any,
    ``accuracy`` is 1e-6 and there are 501 samples.

    Parameters
    ----------
    until, accuracy, method, rtol, atol, step, samples, budget, times
        See :class:`.options.SimulationOptions`.
    progress, reached, stop, functions, cache, stream, checkpoint
        See :class:`RunContext`.

    Raises
    ------
    InputError
        Something needed is missing or a number cannot be used; ``accuracy`` is below what double
        precision can hold; there are no accelerations at the start, or it violates constraints.
    """
    model = system if isinstance(system, Model) else _modelled(system)
    options = SimulationOptions(
        until=until,
        accuracy=accuracy,
        method=method,
        rtol=rtol,
        atol=atol,
        step=step,
        samples=samples,
        budget=budget,
        times=None if times is None else tuple(map(float, times)),
    )
    context = RunContext(
        functions=functions,
        cache=cache,
        stream=stream,
        checkpoint=checkpoint,
        progress=progress,
        reached=reached,
        stop=stop,
    )
    return integrate(model, context.resolved(model, options), context)


def integrate(
    model: Model, request: Request, context: RunContext, *, every: int = 1, look: Look | None = None
) -> Trajectory:
    """Integrate what is asked for.

    Parameters
    ----------
    every
        Parts of the time between samples; the result has a sample after each.
    look
        Called with all times and states of a stream, and what is known of them, before anything
        is written; may refuse.

    Raises
    ------
    InputError
        As :func:`simulate`.
    """
    stream, checkpoint = context.stream, context.checkpoint
    if checkpoint is not None and request.method is not None:
        # Before any file is made.
        CheckpointWriter.require(request.method)
    if model.driven:
        _require_kept_functions(context)
    span = float(request.times[0]), float(request.times[-1])
    progress = RunProgress(context.progress, context.reached, span)
    watch = Watch(progress, Deadline.after(request.budget), context.stop)
    with _at_the_scene(request.mark):
        if stream is None or not isinstance(request.times, Grid):
            if stream is not None:
                context = replace(context, stream=None)
            return _simulated(model, request.refined(every), watch, context)
        with buffers(stream, model, request, checkpoint) as buffer:
            return _simulated(model, request, watch, context, buffer, look)


def _require_kept_functions(context: RunContext) -> None:
    """Refuse what does not go with inputs that are Python functions."""
    if context.functions is not None:
        raise InputError(Problem("'functions' have their own inputs", rule="inputs"))
    if context.checkpoint is not None:
        said = "a run whose inputs are Python functions cannot go on from a file, which lacks them"
        raise InputError(Problem(said, rule="resume"))


@contextmanager
def _at_the_scene(mark: Mark | None) -> Iterator[None]:
    """Refuse at the scene's place, if there is one, what has none."""
    try:
        yield
    except InputError as refusal:
        raise placed(refusal, mark) from refusal


def _simulated(
    model: Model,
    request: Request,
    watch: Watch,
    context: RunContext,
    buffer: Callable[[], SampleBuffer] | None = None,
    look: Look | None = None,
) -> Trajectory:
    started = time.perf_counter()
    stream, checkpoint = context.stream, context.checkpoint
    functions = context.functions_of(model, request.budget)
    problem = problem_of(model, request, functions, buffer)
    if functions.recorded_inputs is not None:
        functions.recorded_inputs.require(problem.start, problem.until)
    require_a_start(model, problem)
    places = unbounded_slopes(model, functions)
    require_unique_start(places, problem.start, problem.y0)
    keeper = None
    # Whoever ends the compiler gets interpreted functions, by which no other run could go on.
    if checkpoint is not None and not is_to_end():
        keeper = CheckpointWriter(checkpoint, identity(model, request, functions))
    compile_seconds = time.perf_counter() - started
    if request.accuracy is not None:
        measured = integrate_to_accuracy(problem, request.accuracy, watch, keeper)
        if places is not None and not (model.multipliers or model.contacts):
            measured = without_branches(places, problem, measured, request.accuracy, watch)
    else:
        measured = integrate_with_method(problem, request, watch, keeper)
    seen = functions_along(model, functions, problem.start, measured)
    measured, drift = cut_at_disproof(model, seen, problem.times, measured, request.accuracy)
    if not measured.stopped:
        watch.progress.done()
    trajectory = _trajectory(model, request, seen, problem, measured, drift, compile_seconds)
    if stream is not None and look is not None:
        look(problem.times, measured.states, trajectory)
    if stream is not None:
        columns = partial(sampled, model, seen)
        trajectory = written_in_windows(stream, trajectory, problem.times, measured.states, columns)
    if checkpoint is not None and not (checkpoint.lasting or measured.stopped):
        checkpoint.remove()
    return trajectory


def _modelled(equations: Equations) -> Model:
    from lagrange_cli.simulate.model.build import model_of

    return model_of(equations)


def problem_of(
    model: Model,
    request: Request,
    functions: RightHandSide,
    buffer: Callable[[], SampleBuffer] | None = None,
) -> InitialValueProblem:
    """Build the initial value problem of a request."""
    if functions.guarded is not None and _ends_at_borders(request):
        start, promised = float(request.times[0]), request.accuracy is not None
        guards = guard_signs(model, start, request.initial, barred=promised)
        functions = functions if guards is None else functions.guarded(guards)
    problem = InitialValueProblem(
        functions.rhs,
        sampled_start(functions.rhs, request.times, request.initial),
        request.times,
        model.kinds,
        functions.perturbed,
        model.facts["autonomous"],
        wider=lambda: _wider(model, problem, functions),
        buffer=buffer,
        widens=functions.widens,
        read_off=model.chart is not None,
        landmarks=functions.landmarks,
    )
    return problem


def _ends_at_borders(request: Request) -> bool:
    """Tell whether a right-hand side that does not exist beyond a border ends a run there."""
    return request.method is None or request.method.shortens


def _wider(
    model: Model, problem: InitialValueProblem, functions: RightHandSide | WiderArithmetic
) -> InitialValueProblem | None:
    sides = functions.wider()
    if sides is None:
        return None
    # A run may go on from another state than the model's start.
    pairs = zip(model.exact_initial, problem.y0.tolist(), strict=False)
    exact = tuple(x if x is not None and float(x) == y else None for x, y in pairs)
    wide = replace(
        problem,
        rhs=sides.rhs,
        perturbed=sides.perturbed,
        real=sides.real,
        exact=exact,
        widens=sides.widens,
        landmarks=sides.landmarks,
    )
    return replace(wide, wider=partial(_wider, model, wide, sides))


def trajectory_of(
    model: Model, request: Request, functions: RightHandSide, measured: Measured
) -> Trajectory:
    """Build a trajectory from measured samples, cut at a disproof."""
    problem = problem_of(model, request, functions)
    seen = functions_along(model, functions, problem.start, measured)
    trusted, drift = cut_at_disproof(model, seen, problem.times, measured, request.accuracy)
    return _trajectory(model, request, seen, problem, trusted, drift, 0.0)


def _trajectory(
    model: Model,
    request: Request,
    seen: MotionFunctions,
    problem: InitialValueProblem,
    measured: Measured,
    drift: EnergyDrift | None,
    compile_seconds: float,
) -> Trajectory:
    times, states, functions = problem.times, measured.states, seen.functions
    promised = request.accuracy is not None
    last_time = float(times[len(states) - 1])
    energy = drift.energy if drift is not None and isinstance(states, np.ndarray) else None
    part = sampled(model, seen, *shown_samples(times, states), energy)
    return Trajectory(
        name=model.name,
        status=status(problem, measured),
        reason=reason(model, problem, measured, request),
        t=part.t,
        columns=part.columns,
        energy=part.energy,
        coordinates=model.coordinates,
        requested=request.accuracy,
        estimated=measured.estimate if promised else None,
        scales=dict(zip(model.state_names, measured.scales.tolist(), strict=True)),
        holds_until=last_time if promised else None,
        energy_drift=None if drift is None else drift.drift,
        energy_scale=None if drift is None else drift.scale,
        labels=model.labels,
        constraint_drift=seen.drift(times, states, measured.scales),
        multipliers=part.multipliers,
        symbols=dict(zip((*model.multipliers, *model.contacts), model.symbols, strict=True)),
        forces=part.forces,
        conserved_drift=_conserved_drift(model, seen, drift, times, states),
        events=_events(model, functions, measured),
        slides=tuple(
            Slide(model.surface_names[k], start, end if math.isfinite(end) else None)
            for k, start, end in measured.slides
        ),
        exempt=tuple(measured.exempt.tolist()),
        remarks=unseen_forces(model, functions, problem, states) if promised else (),
        method=measured.method,
        implementation=_implementation(functions, measured),
        choice=measured.choice,
        formulation=model.formulation,
        steps=measured.steps,
        rhs_evaluations=measured.evaluations,
        all_evaluations=measured.all_evaluations,
        seconds={
            "compile": compile_seconds,
            "integrate": measured.run_seconds,
            "estimate": measured.estimate_seconds,
        },
    )


def _conserved_drift(
    model: Model,
    seen: MotionFunctions,
    energy: EnergyDrift | None,
    times: RowSequence,
    states: RowSequence,
) -> dict[str, float | None] | None:
    """Name of each conserved quantity → its drift; None unless quantities are followed."""
    if model.quantities is None:
        return None
    drifts = conserved_drifts(model, seen.functions, times, states)
    if energy is not None:
        drifts["jacobi" if "jacobi" in model.conserved else "energy"] = energy.drift
    return drifts


def _implementation(functions: RightHandSide, measured: Measured) -> str:
    """Say in words what evaluated the equations and made the steps."""
    if measured.arithmetic != "double":
        return f"{functions.implementation}, {measured.arithmetic}"
    if measured.method == Taylor.name:
        return f"series compiled by heyoka, and {functions.implementation}"
    if not functions.native:
        return functions.implementation
    if measured.method in COMPILED:
        return functions.implementation
    package = INTEGRATORS[measured.method].package
    by = "SciPy" if package is None else package[1].upper()
    return f"{functions.implementation}, stepped by {by}"


def _events(model: Model, functions: RightHandSide, measured: Measured) -> tuple[Event, ...]:
    """Return the events of contacts, with all columns before and after."""
    switches = measured.switches
    if not switches:
        return ()
    times = np.array([s.t for s in switches])
    sides = [np.array([getattr(s, side) for s in switches]) for side in ("before", "after")]
    before, after = (
        state_columns(model, functions, times, states.reshape(len(switches), -1))
        for states in sides
    )
    return tuple(
        Event(
            s.t,
            f"{s.kind}:{model.contacts[s.contact]}",
            {name: float(column[k]) for name, column in after.items()},
            {name: float(column[k]) for name, column in before.items()} if s.jumps else None,
        )
        for k, s in enumerate(switches)
    )
