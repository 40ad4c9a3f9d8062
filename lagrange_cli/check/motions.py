"""Expected motions, and whether the motion of a scene keeps its accuracy.

A scene is simulated once for each end and accuracy: what is expected of its states, of what it
conserves and of its events shares motions with the check that it can be simulated at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.analysis.symmetries.conserved_quantities import with_constants_of_motion
from lagrange_cli.check.equilibria import number_of
from lagrange_cli.check.model import edits_at
from lagrange_cli.errors import Mark, Problem, nearest
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene.conditions import Expect, Formulation, InitialValue, StateExpectation
from lagrange_cli.scene.language.expression import Expression

if TYPE_CHECKING:
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.results.trajectory import Event


#: States and times are computed ten times closer than they are compared, if doubles allow it.
_STATE_MARGIN = 0.1
#: Smallest and largest accuracy that is asked for, relative to scales.
_FINEST_ACCURACY = 1e-12
_COARSEST_ACCURACY = 1e-6
#: Part of the span of a scene that is simulated where nothing more is asked for.
_SHORT_SPAN = 0.1


@dataclass
class Motions:
    """Motions of a scene, each integrated once.

    Attributes
    ----------
    equations
        The scene's equations, whose motion expectations are of.
    in_formulation
        Derives the scene in a formulation.
    """

    equations: Equations
    in_formulation: Callable[[Formulation], Equations]
    _known: dict[tuple[float | None, float | None], Trajectory] = field(default_factory=dict)

    @cached_property
    def model(self) -> Model:
        """The model of the equations. SciPy is imported here, for scenes that need it."""
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.equations)

    def to(self, until: float | None = None, accuracy: float | None = None) -> Trajectory:
        """Return the motion until a time with an accuracy; None leaves them to the scene."""
        from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
        from lagrange_cli.simulate.options import SimulationOptions

        if (until, accuracy) not in self._known:
            options = SimulationOptions(until=until, accuracy=accuracy)
            self._known[until, accuracy] = simulate_past_singularities(
                self.model, options, self._with_multipliers
            )
        trajectory = self._known[until, accuracy]
        if trajectory.status == "stopped":
            raise KeyboardInterrupt
        return trajectory

    def _with_multipliers(self) -> Model:
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.in_formulation("multiplier"))

    def as_simulated(self) -> Motions:
        """Return the motions in the formulation that the scene's section ``simulate`` names."""
        wanted = self.equations.system.simulate.formulation
        if wanted is None or wanted == "auto":
            return self
        return Motions(self.in_formulation(wanted), self.in_formulation)


def simulated(motions: Motions, *, in_full: bool) -> Iterator[Problem]:
    """Require a scene that says how long to simulate to keep its accuracy.

    Parameters
    ----------
    in_full
        False for the first tenth of its span alone.
    """
    defaults = motions.equations.system.simulate
    if defaults.until is None:
        return
    span = defaults.until - defaults.start
    short = span > 0 and not in_full
    until = defaults.start + _SHORT_SPAN * span if short else None
    yield from _incomplete(motions.as_simulated().to(until), defaults.mark)


def _incomplete(trajectory: Trajectory, mark: Mark | None) -> Iterator[Problem]:
    """Yield a problem if a simulation did not reach its end."""
    if trajectory.status != "ok":
        yield Problem(
            f"the simulation ended with {trajectory.status.replace('_', ' ')}; "
            f"it holds until t = {trajectory.holds_until:g}",
            mark,
            hint=trajectory.reason or "",
            rule="simulation",
        )


def _state(expect: Expect, motions: Motions) -> Iterator[Problem]:
    for state in expect.states:
        yield from _one_state(state, motions)


def _name(entry: InitialValue) -> str:
    return f"dot({entry.name})" if entry.order else entry.name


def _close_enough(motions: Motions, state: StateExpectation) -> Trajectory:
    """Simulate so that errors are well below ``within``, which is in the scene's units.

    Accuracy is relative to scales, which a first run finds. A Cartesian name has no scale of its
    own, and may move with every coordinate: the largest scale stands for it.
    """
    equations = motions.equations
    time, within = number_of(equations, state.time), number_of(equations, state.within)
    wanted = min(max(_STATE_MARGIN * within, _FINEST_ACCURACY), _COARSEST_ACCURACY)
    trajectory = motions.to(time, wanted)
    scales = trajectory.scales
    largest = max(scales.values(), default=1.0)
    scale = max(scales.get(_name(entry), largest) for entry in state.values)
    needed = max(_STATE_MARGIN * within / scale, _FINEST_ACCURACY)
    if needed < wanted and trajectory.status == "ok":
        return motions.to(time, needed)
    return trajectory


def _one_state(state: StateExpectation, motions: Motions) -> Iterator[Problem]:
    equations, trajectory = motions.equations, _close_enough(motions, state)
    time, within = number_of(equations, state.time), number_of(equations, state.within)
    yield from _incomplete(trajectory, state.mark)
    if trajectory.status != "ok":
        return
    for entry in state.values:
        name = _name(entry)
        expected, reached = number_of(equations, entry.value), trajectory.state[name]
        if not math.fabs(reached - expected) <= within:
            yield Problem(
                f"at t = {time:g}: expected {name} = {expected!r} within {within:g}, "
                f"found {reached!r}",
                entry.mark,
                rule="state",
                edits=edits_at(entry.value, _rounded(reached, within)),
            )


def _rounded(value: float, within: float) -> str:
    """Write a value to a hundredth of the difference that is allowed."""
    places = 2 - math.floor(math.log10(within)) if within > 0 else None
    return repr(value if places is None else round(value, places) + 0.0)


def _drift(expect: Expect, motions: Motions) -> Iterator[Problem]:
    if not expect.drift:
        return
    equations = motions.equations
    if any(name != "energy" for name, _ in expect.drift):
        motions = Motions(with_constants_of_motion(equations), motions.in_formulation)
    trajectory = motions.to()
    yield from _incomplete(trajectory, expect.mark)
    drifts = {**(trajectory.conserved_drift or {}), "energy": trajectory.energy_drift}
    for name, expression in expect.drift:
        bound, drift, hint = number_of(equations, expression), drifts.get(name), ""
        if drift is None:
            message = f"'{name}' is not found to be conserved; no drift is measured"
            known = [first for first, measured in drifts.items() if measured is not None]
            hint = nearest(name, known) or f"found: {', '.join(known) or 'none'}"
        elif not drift <= bound:
            message = f"expected a drift of '{name}' within {bound:g}, found {drift:.3g}"
        else:
            continue
        yield Problem(message, expression.mark(), hint, rule="drift")


def _events(expect: Expect, motions: Motions) -> Iterator[Problem]:
    """Require each listed event to happen, after those before it in the list."""
    if not expect.events:
        return
    equations = motions.equations
    bounds = [None if e.within is None else number_of(equations, e.within) for e in expect.events]
    trajectory = motions.to(accuracy=_accuracy_for(equations, bounds))
    yield from _incomplete(trajectory, expect.events[0].mark)
    if trajectory.status != "ok":
        return
    span = float(trajectory.t[-1] - trajectory.t[0])
    usual = span * (trajectory.requested or _COARSEST_ACCURACY)
    wanted = [
        ExpectedEvent(
            event.name,
            None if event.time is None else number_of(equations, event.time),
            usual if bound is None else bound,
            event.mark,
            event.time,
        )
        for event, bound in zip(expect.events, bounds, strict=True)
    ]
    yield from missing_events(wanted, trajectory.events)


def _accuracy_for(equations: Equations, bounds: Sequence[float | None]) -> float | None:
    """Return the accuracy that locates events well within bounds; None for the scene's own.

    Times of events are accurate relative to the span of the simulation.
    """
    known = [bound for bound in bounds if bound is not None]
    until = equations.system.simulate.until
    if not known or until is None or not until > equations.system.simulate.start:
        return None  # a run that has no span is refused where it begins
    needed = _STATE_MARGIN * min(known) / (until - equations.system.simulate.start)
    return min(
        equations.system.simulate.accuracy or _COARSEST_ACCURACY, max(needed, _FINEST_ACCURACY)
    )


_MotionCheck: TypeAlias = Callable[[Expect, Motions], Iterator[Problem]]

#: Name of a key of ``expect`` → its check, which needs motions.
MOTION_CHECKS: dict[str, _MotionCheck] = {"state": _state, "drift": _drift, "events": _events}


#: Events that a message lists.
_LISTED = 8


@dataclass(frozen=True)
class ExpectedEvent:
    """An event that a simulation shall have.

    Attributes
    ----------
    name
        Name of the event.
    time
        Simulated time at which it is expected; None for any.
    within
        Largest difference from that time.
    mark
        Place in the scene.
    written
        The time as it stands in the scene.
    """

    name: str
    time: float | None
    within: float
    mark: Mark
    written: Expression | None = None

    def is_met_by(self, event: Event) -> bool:
        """Say whether an event has the name, and is near enough to the time."""
        if event.name != self.name:
            return False
        return self.time is None or abs(event.t - self.time) <= self.within


def missing_events(wanted: Sequence[ExpectedEvent], events: Sequence[Event]) -> Iterator[Problem]:
    """Yield a problem for each wanted event that does not happen after those wanted before it."""
    start = 0
    for want in wanted:
        matching = (k for k in range(start, len(events)) if want.is_met_by(events[k]))
        place = next(matching, None)
        if place is None:
            time = _nearest_time(want, events[start:])
            edits = () if time is None else edits_at(want.written, _rounded(time, want.within))
            message = _message(want, time)
            yield Problem(message, want.mark, _hint(events), rule="events", edits=edits)
        else:
            start = place + 1


def _nearest_time(want: ExpectedEvent, events: Sequence[Event]) -> float | None:
    """Return the time of the event of this name nearest to the one wanted; None for none."""
    times = [event.t for event in events if event.name == want.name]
    return min(times, key=lambda t: abs(t - (want.time or 0.0)), default=None)


def _message(want: ExpectedEvent, time: float | None) -> str:
    if want.time is None:
        return f"expected {want.name}; it does not happen"
    expected = f"expected {want.name} at t = {want.time!r} within {want.within:g}"
    return (
        f"{expected}; it does not happen" if time is None else f"{expected}, found it at {time!r}"
    )


def _hint(events: Sequence[Event]) -> str:
    """List the events of the simulation, in order."""
    if not events:
        return "found no events"
    listed = [f"{event.name} at t = {event.t!r}" for event in events[:_LISTED]]
    more = len(events) - len(listed)
    return "\n".join(["found", *(f"  {x}" for x in listed), *([f"  and {more} more"] * bool(more))])
