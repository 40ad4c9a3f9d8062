"""Simulate one extreme point, and judge the result by a reference."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, cast

import numpy as np

from lagrange_cli.errors import AccuracyError, InputError, StoppedError
from lagrange_cli.scene.dimensions import dimensions
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactEventKind, ModeChange
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.results.trajectory import Event, Trajectory
from lagrange_cli.simulate.simulation import RunContext, problem_of
from lagrange_cli.simulate.system.functions import right_hand_side
from lagrange_cli.studies.reference import Motion, errors, reference
from lagrange_cli.studies.stress.points import StressPoint

#: Part of a trajectory → seconds that each run of a reference for it may take, in budgets of a
#: point. The parts are tried in turn until one has a reference; less time for shorter parts bounds
#: the seconds of a point without any. Not tuned.
_PATIENCE = {1.0: 2.0, 0.5: 1.0, 0.1: 0.5}

#: Accuracy that is asked for over that of the other formulation that it is compared with.
_FINER = 10.0

_Outcome = Literal["holds", "degraded", "refused", "wrong"]


@dataclass(frozen=True)
class StressTask:
    """A point of a scene that is to be run.

    Attributes
    ----------
    number
        Its place among all points, from 0.
    recipe
        Makes models of the scene.
    point
        The point.
    accuracy
        Accuracy to ask for, relative to scales, unless the point has one; None for the scene's.
    budget
        Seconds that its run may take.
    """

    number: int
    recipe: Recipe
    point: StressPoint
    accuracy: float | None
    budget: float


@dataclass(frozen=True)
class StressRun:
    """Result of a point. All errors are relative to scales.

    Attributes
    ----------
    number, point
        Its place among all points, and the point itself.
    outcome
        It ``holds`` to the end as promised; it is ``degraded``: the promise holds for a part; it is
        ``refused``: nothing is promised; or it is ``wrong``: the promise is broken.
    requested
        Accuracy that was promised; None if there was nothing to promise.
    error
        Distance from the reference; None if there is no reference.
    estimated
        The program's own estimate of the error; None if there is none.
    holds_until
        Time until which the promise holds.
    uncertainty
        Part of ``error`` that may be the reference's.
    reason
        Why it does not hold; empty if it does.
    reference
        The reference in words.
    """

    number: int
    point: StressPoint
    outcome: _Outcome
    requested: float | None = None
    error: float | None = None
    estimated: float | None = None
    holds_until: float | None = None
    uncertainty: float = 0.0
    reason: str = ""
    reference: str = ""

    @property
    def checked(self) -> bool:
        """True if there was a reference, or nothing was promised."""
        return self.outcome == "refused" or self.error is not None

    @property
    def underestimated(self) -> bool:
        """True if the error is larger than its estimate."""
        if self.error is None or self.estimated is None:
            return False
        return self.error - self.uncertainty > self.estimated


class _Compared(NamedTuple):
    """A trajectory beside its reference; all errors are relative to scales.

    Attributes
    ----------
    error
        Distance of the two.
    uncertainty
        Part of it that may be the reference's.
    reference
        The reference in words.
    doubt
        Distance of another method's run from the reference; 0 if there was none.
    """

    error: float
    uncertainty: float
    reference: str
    doubt: float = 0.0


class _Forms:
    """The models of a point: that of the scene's formulation, and the one with multipliers."""

    def __init__(self, recipe: Recipe, values: MemberValues) -> None:
        self.first = recipe.model(values)
        self._recipe, self._values = recipe, values

    def _with_multipliers(self) -> Model:
        return self._recipe.model(self._values, "multiplier")

    def simulated(self, options: SimulationOptions) -> Trajectory:
        """Simulate the point; compiling does not count to the budget."""
        context = RunContext(right_hand_side(self.first))
        formulation = self._recipe.formulation
        return simulate_past_singularities(
            self.first, options, self._with_multipliers, context, formulation=formulation
        )

    def in_formulation(self, formulation: str) -> Model:
        """Return the model of a formulation."""
        return self.first if formulation == self.first.formulation else self._with_multipliers()

    def not_in_formulation(self, formulation: str) -> Model | None:
        """Return the model of another formulation; None if there is none."""
        if formulation != self.first.formulation:
            return None
        try:
            model = self._with_multipliers()
        except InputError:
            return None
        return model if model.formulation != formulation else None


def run_point(task: StressTask) -> StressRun:
    """Simulate a point as the command does, and compare it with a reference."""
    point = task.point
    values, recipe = MemberValues(point.parameters, point.initial), _recipe(task)
    accuracy = point.accuracy or task.accuracy
    try:
        forms = _Forms(recipe, values)
        motion = forms.simulated(SimulationOptions(accuracy=accuracy, budget=task.budget))
    except InputError as refusal:
        return StressRun(task.number, point, "refused", reason=refusal.problems[0].message)
    if len(motion.t) < 2:
        return StressRun(task.number, point, "refused", motion.requested, reason=motion.reason)
    run = _judged(task, motion, _compared(forms, motion, task.budget))
    return run if point.scaled is None else _with_units(task, run, motion)


def _recipe(task: StressTask) -> Recipe:
    until = task.point.until
    if until is None:
        return task.recipe
    text = task.recipe.text
    return replace(task.recipe, text=replace(text, times={**text.times, "until": until}))


def _judged(task: StressTask, trajectory: Trajectory, compared: _Compared | None) -> StressRun:
    """Return the outcome; ``compared`` is None if there is no reference."""
    promised = trajectory.requested or 0.0
    outcome: _Outcome = "holds" if trajectory.status == "ok" else "degraded"
    run = StressRun(
        task.number,
        task.point,
        outcome,
        trajectory.requested,
        estimated=trajectory.estimated,
        holds_until=trajectory.holds_until,
        reason=trajectory.reason,
    )
    if compared is None:
        return replace(run, reference="none")
    error, uncertainty, name, doubt = compared
    if error - uncertainty > promised:
        # If another method is as far from the reference, the reference may be wrong.
        if error - doubt <= promised:
            return replace(run, reference=f"none: other methods are not as {name}")
        run = replace(run, outcome="wrong")
    elif uncertainty > promised:
        return replace(run, reference=f"none: {name} is good to {uncertainty:.0e}")
    return replace(run, error=error, uncertainty=uncertainty, reference=name)


# The same motion by other means.


def _compared(forms: _Forms, trajectory: Trajectory, budget: float) -> _Compared | None:
    """Compare with a reference, else with another formulation; None if there is neither."""
    model = forms.in_formulation(trajectory.formulation)
    for part, patience in _PATIENCE.items():
        times = trajectory.t[: max(2, round(part * len(trajectory.t)))]
        with suppress(AccuracyError, StoppedError):
            return _by_reference(model, trajectory, times, patience * budget)
    other_model = forms.not_in_formulation(trajectory.formulation)
    return None if other_model is None else _by_formulation(other_model, trajectory, budget)


def _by_reference(model: Model, trajectory: Trajectory, times: Array, budget: float) -> _Compared:
    """Compare the first samples with a solution of much higher accuracy.

    Raises
    ------
    AccuracyError, StoppedError
        There is no such solution.
    """
    request = resolve(model, SimulationOptions(method="DOP853", rtol=1e-6))
    problem = problem_of(model, replace(request, times=times), right_hand_side(model))
    with np.errstate(all="ignore"):
        coarse = coarse_result(problem, 1e-9, Watch(deadline=Deadline.after(budget)))
        known = reference(problem, coarse, budget)
        error = errors(problem, known.scales, _motion(model, trajectory, times), known.motion)
    until = "" if len(times) == len(trajectory.t) else f" until t = {times[-1]:.6g}"
    return _Compared(float(error[-1]), known.error, known.method + until, known.difference or 0.0)


def _motion(model: Model, trajectory: Trajectory, times: Array) -> Motion:
    """Return the first samples of a trajectory in a model's coordinates, with its events."""
    states = np.column_stack([trajectory.columns[name][: len(times)] for name in model.state_names])
    switches = tuple(_switch(model, e) for e in trajectory.events if e.t <= times[-1])
    return Motion(states, switches, float(times[-1]))


def _switch(model: Model, event: Event) -> ModeChange:
    names = model.state_names
    kind, _, contact = event.name.partition(":")
    after = np.array([event.state[name] for name in names])
    before = after if event.before is None else np.array([event.before[name] for name in names])
    number = model.contacts.index(contact)
    flags = tuple(k == number and kind != "release" for k in range(len(model.contacts)))
    return ModeChange(event.t, number, cast(ContactEventKind, kind), before, after, flags)


def _by_formulation(model: Model, trajectory: Trajectory, budget: float) -> _Compared | None:
    """Compare with the motion in other coordinates; None if the two have no samples in common."""
    options = SimulationOptions(accuracy=(trajectory.requested or 0.0) / _FINER, budget=budget)
    try:
        second = simulate_past_singularities(model, options)
    except InputError:
        return None
    common = min(len(trajectory.t), len(second.t))
    same_times = np.array_equal(trajectory.t[:common], second.t[:common])
    if common < 2 or trajectory.events or not same_times:
        return None
    distances = [
        np.abs(trajectory.columns[name][:common] - second.columns[name][:common]).max() / scale
        for name, scale in trajectory.scales.items()
        if name in second.columns
    ]
    if not distances or np.isnan(distances).any():
        return None
    until = "" if common == len(trajectory.t) else f" until t = {trajectory.t[common - 1]:.6g}"
    said = f"{second.formulation} form{until}"
    return _Compared(float(max(distances)), second.estimated or 0.0, said)


# The same motion in other units.


def _with_units(task: StressTask, run: StressRun, trajectory: Trajectory) -> StressRun:
    """Compare a run with that in the scene's units as well.

    If units change by powers of two, the two are equal bit by bit.
    """
    point, recipe = task.point, task.recipe
    known, factors = dimensions(recipe.scene()), point.scaled or {}
    options = SimulationOptions(accuracy=task.accuracy, budget=task.budget)
    plain = _Forms(recipe, MemberValues()).simulated(options)
    common = min(len(trajectory.t), len(plain.t))
    jumps = [np.isin(motion.t[:common], motion.exempt) for motion in (trajectory, plain)]
    distance = 0.0
    for name, scale in plain.scales.items():
        here = trajectory.columns[name][:common] / known.factor(name, factors)
        difference = np.abs(here - plain.columns[name][:common])
        if name not in plain.coordinates:
            difference[jumps[0] | jumps[1]] = 0.0
        distance = max(distance, float(difference.max()) / scale)
    powers_of_two = all(math.frexp(x)[0] == 0.5 for x in factors.values())
    said = f"{run.reference}; the scene's units"
    if powers_of_two and (distance > 0 or len(trajectory.t) != len(plain.t)):
        reason = f"not bit by bit as in the scene's units, off by {distance:.1e}"
        run = replace(run, reason="; ".join(filter(None, (reason, run.reason))))
    wrong = distance > 2 * (run.requested or 0.0)
    return replace(
        run,
        outcome="wrong" if wrong else run.outcome,
        error=max(distance, run.error or 0.0),
        reference=said,
    )
