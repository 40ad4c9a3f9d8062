"""The checks of expectations, one for each key of ``expect``.

To add a key, add its field to :class:`~lagrange_cli.scene.conditions.Expect` and a function to
:data:`CHECKS`. A check takes the scene's expectations and the equations. It yields a located
problem for each expectation that does not hold, and nothing for keys that the scene does not have.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from sympy import Expr

from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
from lagrange_cli.analysis.symmetries.conserved_quantities import with_constants_of_motion
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.check.compare import (
    Agreement,
    expressions_agree,
    lagrangians_agree,
    proportional,
)
from lagrange_cli.check.equilibria import (
    expected_equilibria,
    expected_frequencies,
    expected_law,
    number_of,
)
from lagrange_cli.errors import Mark, Problem, nearest
from lagrange_cli.mechanics import interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.notation.build import display_sum
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.scene_language import to_scene_language
from lagrange_cli.notation.vocabulary import vocabulary, with_symbols
from lagrange_cli.scene.conditions import Expect, InitialValue, StateExpectation
from lagrange_cli.scene.language.expression import Equation

if TYPE_CHECKING:
    from lagrange_cli.analysis.forms.hamiltonian import Hamiltonian
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.results.trajectory import Event


_Check: TypeAlias = Callable[[Expect, Equations], Iterator[Problem]]

#: States and times are computed ten times closer than they are compared, if doubles allow it.
_STATE_MARGIN = 0.1
#: Smallest and largest accuracy that is asked for, relative to scales.
_FINEST_ACCURACY = 1e-12
_COARSEST_ACCURACY = 1e-6


def _dof(expect: Expect, equations: Equations) -> Iterator[Problem]:
    account = equations.derivation.account
    if expect.dof is not None and expect.dof != account.dof:
        extra = f", E = {account.extra}" if account.extra else ""
        yield Problem(
            f"expected dof {expect.dof}, found {account.dof}",
            expect.dof_mark,
            hint=f"{', '.join(account.counted)}{extra}, K = {account.constraints}",
            rule="dof",
        )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "none"


def _cyclic(expect: Expect, equations: Equations) -> Iterator[Problem]:
    if expect.cyclic is None:
        return
    if set(expect.cyclic) != set(equations.derivation.cyclic):
        yield Problem(
            f"expected cyclic coordinates: {_listed(expect.cyclic)}; "
            f"found: {_listed(equations.derivation.cyclic)}",
            expect.cyclic_mark,
            rule="cyclic",
        )
        return
    names = {c.name for c in equations.system.coordinates}
    for name in filter(names.__contains__, equations.derivation.open_questions):
        yield Problem(
            f"it cannot be decided whether '{name}' is cyclic",
            expect.cyclic_mark,
            hint="leave 'cyclic' out: the list says of every coordinate whether it is",
            rule="cyclic",
        )


def _conserved(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require each listed quantity to be conserved; an empty list says that none is.

    Symmetries are looked for where a quantity is neither a cyclic momentum nor an energy.
    """
    if expect.conserved is None:
        return
    names = {c.name for c in equations.system.coordinates}
    if not expect.conserved:
        for name in equations.derivation.open_questions:
            if name not in names:
                yield Problem(
                    f"it cannot be decided whether '{name}' is conserved",
                    expect.conserved_mark,
                    hint="leave 'conserved' out: an empty list says that nothing is",
                    rule="conserved",
                )
    conserved = tuple(c.name for c in equations.derivation.conserved)
    if not expect.conserved and conserved:
        yield Problem(
            f"expected no conserved quantity; found: {_listed(conserved)}",
            expect.conserved_mark,
            rule="conserved",
        )
    if not expect.conserved and not conserved:
        further = tuple(symmetry.name for symmetry in linear_symmetries(equations).proven)
        if further:
            yield Problem(
                f"expected no conserved quantity; symmetries give {_listed(further)}",
                expect.conserved_mark,
                rule="conserved",
            )
    if not set(expect.conserved) <= set(conserved):
        conserved += tuple(symmetry.name for symmetry in linear_symmetries(equations).proven)
    for name in expect.conserved:
        if name not in conserved:
            yield Problem(
                f"'{name}' is not found to be conserved; found: {_listed(conserved)}",
                expect.conserved_mark,
                hint=nearest(name, conserved),
                rule="conserved",
            )


def _equations(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require each expected equation to be a nonzero multiple of a derived one, each of another."""
    unmatched, start = list(equations.derivation.shown), _start(equations)
    for expected in expect.equations or ():
        residual, undecided = _residual(equations, expected), False
        for derived in unmatched:
            verdict = proportional(residual, derived.residual.xreplace(start), equations)
            if verdict is Agreement.SAME:
                unmatched.remove(derived)
                break
            undecided = undecided or verdict is Agreement.UNDECIDED
        else:
            listed = [
                f"{derived.coordinate}: {to_scene_language(derived.residual, equations)} = 0"
                for derived in equations.derivation.shown
            ]
            yield Problem(
                "it cannot be decided whether this is a multiple of a derived equation"
                if undecided
                else "no derived equation is a multiple of this one",
                expected.mark(),
                hint="derived\n  " + "\n  ".join(listed),
                rule="equations",
            )


def _start(equations: Equations) -> dict[Expr, Expr]:
    """Return values of constants of integration, whose symbols no scene can write."""
    named = [p for p in equations.system.parameters if p.start_of is not None]
    return {p.symbol: p.exact for p in named if p.exact is not None}


def _residual(equations: Equations, expected: Equation) -> Expr:
    return interpret(equations, expected.left) - interpret(equations, expected.right)


def _lagrangian(expect: Expect, equations: Equations) -> Iterator[Problem]:
    if expect.lagrangian is None:
        return
    expected = interpret(equations, expect.lagrangian)
    derived = equations.system.lagrangian.xreplace(_start(equations))
    verdict = lagrangians_agree(expected, derived, equations)
    if verdict is not Agreement.SAME:
        yield Problem(
            "expected Lagrangian is not the derived one, nor differs by a total time derivative"
            if verdict is Agreement.DIFFERENT
            else "it cannot be decided whether the expected Lagrangian is the derived one",
            expect.lagrangian.mark(),
            hint=f"derived: {to_scene_language(equations.system.lagrangian, equations)}",
            rule="lagrangian",
        )


def _hamiltonian(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require H as a function of coordinates, momenta and time."""
    if expect.hamiltonian is None:
        return
    form = hamiltonian_form(equations)
    momenta = [pair.momentum for pair in form.pairs]
    expected = interpret(equations, expect.hamiltonian, {m.name: m.symbol for m in momenta})
    # Velocities that stay in H are those that the momenta determine.
    over = {m.symbol: m.expression for m in momenta} if form.coupled else {}
    over |= _start(equations)
    verdict = expressions_agree(expected.xreplace(over), form.expression.xreplace(over), equations)
    if verdict is not Agreement.SAME:
        yield Problem(
            "expected Hamiltonian is not the derived one"
            if verdict is Agreement.DIFFERENT
            else "it cannot be decided whether the expected Hamiltonian is the derived one",
            expect.hamiltonian.mark(),
            hint=f"derived: {_in_scene_language(equations, form)}",
            rule="hamiltonian",
        )


def _in_scene_language(equations: Equations, form: Hamiltonian) -> str:
    """Write H as the scene language does."""
    momenta = [(pair.momentum.symbol, pair.momentum.name, None) for pair in form.pairs]
    words = with_symbols(vocabulary(equations), momenta)
    return ScenePrinter().inline(display_sum(form.parts, words))


def _incomplete(trajectory: Trajectory, mark: Mark | None) -> Iterator[Problem]:
    """Yield a problem if a simulation did not reach its end."""
    if trajectory.status == "stopped":
        raise KeyboardInterrupt
    if trajectory.status != "ok":
        yield Problem(
            f"the simulation ended with {trajectory.status.replace('_', ' ')}; "
            f"it holds until t = {trajectory.holds_until:g}",
            mark,
            rule="simulation",
        )


def _simulated(
    equations: Equations, *, until: float | None = None, accuracy: float | None = None
) -> Trajectory:
    """Simulate the scene. SciPy is imported here, only for scenes that need it."""
    from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
    from lagrange_cli.simulate.model.build import model_of
    from lagrange_cli.simulate.options import SimulationOptions

    options = SimulationOptions(until=until, accuracy=accuracy)
    return simulate_past_singularities(model_of(equations), options)


def _state(expect: Expect, equations: Equations) -> Iterator[Problem]:
    for state in expect.states:
        yield from _one_state(state, equations)


def _name(entry: InitialValue) -> str:
    return f"dot({entry.name})" if entry.order else entry.name


def _close_enough(equations: Equations, state: StateExpectation) -> Trajectory:
    """Simulate so that errors are well below ``within``, which is in the scene's units.

    Accuracy is relative to scales, which a first run finds. A Cartesian name has no scale of its
    own, and may move with every coordinate: the largest scale stands for it.
    """
    time, within = number_of(equations, state.time), number_of(equations, state.within)
    wanted = min(max(_STATE_MARGIN * within, _FINEST_ACCURACY), _COARSEST_ACCURACY)
    trajectory = _simulated(equations, until=time, accuracy=wanted)
    scales = trajectory.scales
    largest = max(scales.values(), default=1.0)
    scale = max(scales.get(_name(entry), largest) for entry in state.values)
    needed = max(_STATE_MARGIN * within / scale, _FINEST_ACCURACY)
    if needed < wanted and trajectory.status == "ok":
        return _simulated(equations, until=time, accuracy=needed)
    return trajectory


def _one_state(state: StateExpectation, equations: Equations) -> Iterator[Problem]:
    trajectory = _close_enough(equations, state)
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
            )


def _drift(expect: Expect, equations: Equations) -> Iterator[Problem]:
    if not expect.drift:
        return
    if any(name != "energy" for name, _ in expect.drift):
        equations = with_constants_of_motion(equations)
    trajectory = _simulated(equations)
    yield from _incomplete(trajectory, expect.mark)
    drifts = {**(trajectory.conserved_drift or {}), "energy": trajectory.energy_drift}
    for name, expression in expect.drift:
        bound, drift, hint = number_of(equations, expression), drifts.get(name), ""
        if drift is None:
            message = f"'{name}' is not found to be conserved; no drift is measured"
            known = [first for first, measured in drifts.items() if measured is not None]
            hint = nearest(name, known) or f"found: {_listed(tuple(known))}"
        elif not drift <= bound:
            message = f"expected a drift of '{name}' within {bound:g}, found {drift:.3g}"
        else:
            continue
        yield Problem(message, expression.mark(), hint, rule="drift")


def _events(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require each listed event to happen, after those before it in the list."""
    if not expect.events:
        return
    bounds = [None if e.within is None else number_of(equations, e.within) for e in expect.events]
    trajectory = _simulated(equations, accuracy=_accuracy_for(equations, bounds))
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


#: Name of a key of ``expect`` → its check, in the order in which they are made. ``error`` is not
#: among them: it is met by a refusal, and then there are no equations to check.
CHECKS: dict[str, _Check] = {
    "dof": _dof,
    "cyclic": _cyclic,
    "conserved": _conserved,
    "equations": _equations,
    "lagrangian": _lagrangian,
    "hamiltonian": _hamiltonian,
    "state": _state,
    "drift": _drift,
    "events": _events,
    "equilibrium": expected_law,
    "equilibria": expected_equilibria,
    "frequencies": expected_frequencies,
}


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
    """

    name: str
    time: float | None
    within: float
    mark: Mark

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
            yield Problem(_message(want, events[start:]), want.mark, _hint(events), rule="events")
        else:
            start = place + 1


def _message(want: ExpectedEvent, remaining: Sequence[Event]) -> str:
    if want.time is None:
        return f"expected {want.name}; it does not happen"
    expected = f"expected {want.name} at t = {want.time!r} within {want.within:g}"
    times = [event.t for event in remaining if event.name == want.name]
    if not times:
        return f"{expected}; it does not happen"
    nearest = min(times, key=lambda t: abs(t - (want.time or 0.0)))
    return f"{expected}, found it at {nearest!r}"


def _hint(events: Sequence[Event]) -> str:
    """List the events of the simulation, in order."""
    if not events:
        return "found no events"
    listed = [f"{event.name} at t = {event.t!r}" for event in events[:_LISTED]]
    more = len(events) - len(listed)
    return "\n".join(["found", *(f"  {x}" for x in listed), *([f"  and {more} more"] * bool(more))])
