"""One extreme point: what ``simulate`` makes of it, and whether that is right."""

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
from lagrange_cli.simulate.charts.simulation import multiplier_form, simulate_past_singularities
from lagrange_cli.simulate.checkpoint.progress import Deadline, Watch
from lagrange_cli.simulate.ensemble.members import MemberValues, Recipe
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactEventKind, ModeChange
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import SimulationOptions, resolve
from lagrange_cli.simulate.results.trajectory import Event, Trajectory
from lagrange_cli.simulate.simulation import RunContext, problem_of
from lagrange_cli.simulate.system.functions import right_hand_side
from lagrange_cli.studies.reference import Motion, errors, reference
from lagrange_cli.studies.stress.points import StressPoint

#: Budgets of a point that each run of its reference may take: of one for all that is kept, and
#: of those for parts of it where there is none.
_PATIENCE = {1.0: 2.0, 0.5: 1.0, 0.1: 0.5}

#: How much finer the accuracy of another formulation is that is compared with.
_FINER = 10.0

_Outcome = Literal["holds", "degraded", "refused", "wrong"]


@dataclass(frozen=True)
class StressTask:
    """A point of a scene; ``number`` is its place among others, ``budget`` seconds of a run."""

    number: int
    recipe: Recipe
    point: StressPoint
    accuracy: float | None
    budget: float


@dataclass(frozen=True)
class StressRun:
    """Result of a point.

    ``outcome``: it ``holds`` to the end as promised; it is ``degraded``, the promise holding
    for a part; it is ``refused``, nothing being promised; or it is ``wrong``: what is promised
    is not so. ``error`` is measured against ``reference`` (in words), None where there is
    none; ``own`` of it may be the reference's. ``estimated`` is the program's estimate;
    the promise holds until ``holds_until``.
    """

    number: int
    point: StressPoint
    outcome: _Outcome
    requested: float | None = None
    error: float | None = None
    estimated: float | None = None
    holds_until: float | None = None
    own: float = 0.0
    reason: str = ""
    reference: str = ""

    @property
    def checked(self) -> bool:
        """True if there was something to compare with, or nothing was promised."""
        return self.outcome == "refused" or self.error is not None

    @property
    def underestimated(self) -> bool:
        """True if the error is larger than its estimate."""
        if self.error is None or self.estimated is None:
            return False
        return self.error - self.own > self.estimated


class _Compared(NamedTuple):
    """The error of what is kept, how much of that may be the reference's, and what it is.

    ``doubt``: how far a run by another method is from the reference.
    """

    error: float
    own: float
    reference: str
    doubt: float = 0.0


class _Forms:
    """The models of a point: that of the scene's formulation, and the one with multipliers."""

    def __init__(self, recipe: Recipe, own: MemberValues) -> None:
        self.first = recipe.model(own)
        self._recipe, self._own = recipe, own

    def _other(self) -> Model:
        return self._recipe.model(self._own, "multiplier")

    def simulated(self, options: SimulationOptions) -> Trajectory:
        """Run ``simulate`` on it; compiling does not count to the budget."""
        context = RunContext(right_hand_side(self.first))
        other = multiplier_form(self.first, self._recipe.formulation, self._other)
        return simulate_past_singularities(self.first, options, other, context)

    def of(self, formulation: str) -> Model:
        """The one that ran."""
        return self.first if formulation == self.first.formulation else self._other()

    def but(self, formulation: str) -> Model | None:
        """One of another formulation, None where there is none."""
        if formulation != self.first.formulation:
            return None
        try:
            found = self._other()
        except InputError:
            return None
        return found if found.formulation != formulation else None


def run_point(task: StressTask) -> StressRun:
    """Simulate a point as the command does, and compare with a reference."""
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
    return replace(task.recipe, times={**task.recipe.times, "until": until})


def _judged(task: StressTask, found: Trajectory, compared: _Compared | None) -> StressRun:
    """The outcome, and what it rests on."""
    promised = found.requested or 0.0
    outcome: _Outcome = "holds" if found.status == "ok" else "degraded"
    run = StressRun(
        task.number,
        task.point,
        outcome,
        found.requested,
        estimated=found.estimated,
        holds_until=found.holds_until,
        reason=found.reason,
    )
    if compared is None:
        return replace(run, reference="none")
    run = replace(run, reference=compared.reference)
    if compared.error - compared.own > promised:
        # Where another method is as far from the reference it may be that which is wrong.
        if compared.error - compared.doubt > promised:
            return replace(run, outcome="wrong", error=compared.error, own=compared.own)
        return replace(run, reference=f"none: other methods are not as {compared.reference}")
    if compared.own > promised:
        return replace(run, reference=f"none: {compared.reference} is good to {compared.own:.0e}")
    return replace(run, error=compared.error, own=compared.own)


# The same motion by other means.


def _compared(forms: _Forms, found: Trajectory, budget: float) -> _Compared | None:
    """The error by the reference, else by another formulation."""
    model = forms.of(found.formulation)
    for part, patience in _PATIENCE.items():
        times = found.t[: max(2, round(part * len(found.t)))]
        with suppress(AccuracyError, StoppedError):
            return _by_reference(model, found, times, patience * budget)
    other = forms.but(found.formulation)
    return None if other is None else _by_formulation(other, found, budget)


def _by_reference(model: Model, found: Trajectory, times: Array, budget: float) -> _Compared:
    """The error of the first samples by a solution of much higher accuracy.

    Raises
    ------
    AccuracyError, StoppedError
        There is none.
    """
    request = resolve(model, SimulationOptions(method="DOP853", rtol=1e-6))
    problem = problem_of(model, replace(request, times=times), right_hand_side(model))
    with np.errstate(all="ignore"):
        coarse = coarse_result(problem, 1e-9, Watch(deadline=Deadline.after(budget)))
        known = reference(problem, coarse, budget)
        error = errors(problem, known.scales, _motion(model, found, times), known.motion)
    until = "" if len(times) == len(found.t) else f" until t = {times[-1]:.6g}"
    return _Compared(float(error[-1]), known.error, known.method + until, known.difference or 0.0)


def _motion(model: Model, found: Trajectory, times: Array) -> Motion:
    """The first samples of a trajectory in the coordinates of a model, with its events."""
    names = (*model.coordinates, *(f"dot({name})" for name in model.coordinates))
    states = np.column_stack([found.columns[name][: len(times)] for name in names])
    switches = tuple(_switch(model, names, e) for e in found.events if e.t <= times[-1])
    return Motion(states, switches, float(times[-1]))


def _switch(model: Model, names: tuple[str, ...], event: Event) -> ModeChange:
    kind, _, contact = event.name.partition(":")
    after = np.array([event.state[name] for name in names])
    before = after if event.before is None else np.array([event.before[name] for name in names])
    number = model.contacts.index(contact)
    flags = tuple(k == number and kind != "release" for k in range(len(model.contacts)))
    return ModeChange(event.t, number, cast(ContactEventKind, kind), before, after, flags)


def _by_formulation(model: Model, found: Trajectory, budget: float) -> _Compared | None:
    """The error by the motion in other coordinates, as accurate as it can be had."""
    try:
        accuracy = (found.requested or 0.0) / _FINER
        other = simulate_past_singularities(
            model, SimulationOptions(accuracy=accuracy, budget=budget)
        )
    except InputError:
        return None
    common = min(len(found.t), len(other.t))
    if common < 2 or found.events or not np.array_equal(found.t[:common], other.t[:common]):
        return None
    names = [name for name in found.scales if name in other.columns]
    distances = [
        np.abs(found.columns[name][:common] - other.columns[name][:common]).max() / scale
        for name, scale in found.scales.items()
        if name in names
    ]
    if not names or np.isnan(distances).any():
        return None
    until = "" if common == len(found.t) else f" until t = {found.t[common - 1]:.6g}"
    said = f"{other.formulation} form{until}"
    return _Compared(float(max(distances)), other.estimated or 0.0, said)


# The same motion in other units.


def _with_units(task: StressTask, run: StressRun, found: Trajectory) -> StressRun:
    """The run beside that in the scene's units, to which it is equal bit by bit where units
    change by powers of two."""
    point, recipe = task.point, task.recipe
    known, factors = dimensions(recipe.scene()), point.scaled or {}
    options = SimulationOptions(accuracy=task.accuracy, budget=task.budget)
    plain = _Forms(recipe, MemberValues()).simulated(options)
    common = min(len(found.t), len(plain.t))
    jumps = [np.isin(of.t[:common], of.exempt) for of in (found, plain)]
    distance = 0.0
    for name, scale in plain.scales.items():
        here = found.columns[name][:common] / known.factor(name, factors)
        difference = np.abs(here - plain.columns[name][:common])
        if name not in plain.coordinates:
            difference[jumps[0] | jumps[1]] = 0.0
        distance = max(distance, float(difference.max()) / scale)
    powers_of_two = all(math.frexp(x)[0] == 0.5 for x in factors.values())
    said = f"{run.reference}; the scene's units"
    if powers_of_two and (distance > 0 or len(found.t) != len(plain.t)):
        reason = f"not bit by bit as in the scene's units, off by {distance:.1e}"
        run = replace(run, reason="; ".join(filter(None, (reason, run.reason))))
    wrong = distance > 2 * (run.requested or 0.0)
    return replace(
        run,
        outcome="wrong" if wrong else run.outcome,
        error=max(distance, run.error or 0.0),
        reference=said,
    )
