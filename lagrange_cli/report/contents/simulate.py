"""Report of ``lagrange simulate``: the end of a trajectory and the accuracy it has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import get_args

from lagrange_cli.report.contents.numbers import assigned, decimal, phrased
from lagrange_cli.report.inlines import Inline, Listed, Plain, Text, Unit, say, symbol
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import (
    Column,
    Document,
    Labelled,
    Medium,
    Part,
    Section,
    Table,
    section,
    sections,
    table_of,
)
from lagrange_cli.report.values.simulation import SIMULATION, TRAJECTORY, Simulated
from lagrange_cli.simulate import Trajectory
from lagrange_cli.simulate.results.trajectory import Event, Slide

#: Events that the report lists.
_MOST_EVENTS = 12

#: Values that it lists with each event.
_MOST_VALUES = 6

#: Characters of the longest value.
_DIGITS = 16

json_of.register(Simulated, SIMULATION.write)
json_of.register(Trajectory, TRAJECTORY.write)


@contents_of.register
def motion_document(simulated: Simulated) -> Document:
    """Return the last state, what is conserved, the events, and the promise of accuracy."""
    trajectory = simulated.trajectory
    title = say(
        "{name} at t = {t}", name=Plain(trajectory.name), t=decimal(float(trajectory.t[-1]))
    )
    written = sections(
        section("", *map(partial(_state, trajectory), get_args(Medium))),
        section("", _further(simulated)),
        section("", _conserved(simulated)),
        _events(trajectory.events, simulated.names),
        _slides(trajectory.slides),
        section("", Labelled(_known(simulated)), _ending(trajectory)),
    )
    return Document(trajectory.name, "a motion", title, written)


contents_of.register(Trajectory, lambda trajectory: motion_document(Simulated(trajectory)))


def _state(trajectory: Trajectory, medium: Medium) -> Table:
    """Return the last state: each name with its value and its rate, if it has one.

    A document has the symbols of the names, and their units; a terminal the names alone, by which
    files have them.
    """
    followed = trajectory.conserved_drift or {}
    state = {name: x for name, x in trajectory.state.items() if name not in followed}
    names = [name for name in state if not name.startswith("dot(")]
    labels = trajectory.labels

    def rate(name: str) -> Text:
        known = state.get(f"dot({name})")
        return "" if known is None else decimal(known)

    def column(name: str) -> Text:
        if medium == "terminal" or "(" in name:
            return Plain(name)
        return Inline(symbol(name, latex=labels.latex.get(name)))

    table = table_of(
        names,
        Column("", column),
        Column(say("value"), lambda name: decimal(state[name]), True),
        Column(say("rate"), rate, True),
        Column(say("unit"), lambda name: Unit(labels.units[name]) if name in labels.units else ""),
        digits=_DIGITS,
    )
    if medium == "terminal":
        return replace(
            table, heads=table.heads[:-1], rows=tuple(r[:-1] for r in table.rows), only=medium
        )
    return replace(table.without_empty_columns(), only=medium)


def _ending(trajectory: Trajectory) -> Labelled | None:
    """Say why a motion ends before its time, and what was done otherwise than asked.

    A terminal has it beside the report, as every other remark.
    """
    reasons = [(say("Reason"), phrased(trajectory.reason))] if trajectory.reason else []
    remarks = [(say("Remark"), phrased(remark)) for remark in trajectory.remarks]
    rows = (*reasons, *remarks)
    return Labelled(rows, only="document") if rows else None


def _further(simulated: Simulated) -> Table | None:
    """Return the last values of further columns that no other table has."""
    followed = simulated.trajectory.conserved_drift or {}
    values = {name: x for name, x in simulated.further().items() if name not in followed}
    if not values:
        return None
    return table_of(
        values.items(),
        Column(say("column"), lambda item: Plain(item[0])),
        Column(say("value"), lambda item: decimal(item[1]), True),
        digits=_DIGITS,
    )


def _conserved(simulated: Simulated) -> Part | None:
    """Return conserved quantities with their values at the end and their drifts."""
    trajectory = simulated.trajectory
    if trajectory.conserved_drift is None:
        return None
    if not trajectory.conserved_drift:
        nothing = say("nothing was found among energies and momenta of linear symmetries")
        return Labelled(((say("Conserved"), nothing),))
    values = trajectory.state | simulated.further()
    return table_of(
        trajectory.conserved_drift.items(),
        Column(say("conserved"), lambda item: Plain(item[0])),
        Column(say("value"), lambda item: decimal(values[item[0]]), True),
        Column(say("relative drift"), lambda item: _known_number(item[1], ".1e"), True),
        digits=_DIGITS,
    )


def _known_number(value: float | None, form: str) -> Text:
    return say("none") if value is None else decimal(value, form)


def _events(events: Sequence[Event], shown: Sequence[str]) -> Section | None:
    """Return the first events with the values of some names."""
    if not events:
        return None
    left_out = say(
        "and {count} more until t = {t}",
        count=len(events) - _MOST_EVENTS,
        t=decimal(events[-1].t),
    )
    return section(
        say("Events"),
        table_of(
            events[:_MOST_EVENTS],
            Column("t", lambda event: decimal(event.t), True),
            Column(say("event"), lambda event: Plain(event.name)),
            Column(
                say("values"),
                lambda event: Listed(
                    tuple(assigned(n, decimal(event.state[n])) for n in shown[:_MOST_VALUES])
                ),
            ),
            prose=say("values"),
        ),
        left_out if len(events) > _MOST_EVENTS else None,
    )


def _slides(slides: Sequence[Slide]) -> Section | None:
    """Return the first times for which the motion slides along kinks."""
    if not slides:
        return None
    left_out = say("and {count} more", count=len(slides) - _MOST_EVENTS)
    return section(
        say("Sliding"),
        table_of(
            slides[:_MOST_EVENTS],
            Column(say("slides on"), lambda slide: Plain(f"{slide.on} = 0")),
            Column(say("from t ="), lambda slide: decimal(slide.start), True),
            Column(say("to t ="), lambda slide: _known_end(slide), True),
        ),
        left_out if len(slides) > _MOST_EVENTS else None,
    )


def _known_end(slide: Slide) -> Text:
    return say("the end") if slide.end is None else decimal(slide.end)


def _promise(trajectory: Trajectory) -> Text:
    if trajectory.requested is None:
        return say("nothing is promised or estimated: a method was chosen")
    return say(
        "{requested} requested, {estimated} estimated, holds until t = {until}",
        requested=decimal(trajectory.requested, "g"),
        estimated=_known_number(trajectory.estimated, ".1e"),
        until=_known_number(trajectory.holds_until, ".9g"),
    )


def drift_of(drift: float | None) -> Text:
    """Say how far the energy drifts, if it is conserved."""
    if drift is None:
        return say("not found to be conserved")
    return say("relative drift {drift}", drift=decimal(drift, ".1e"))


def _known(simulated: Simulated) -> tuple[tuple[Text, Text], ...]:
    """Return what is known of the motion beside its end."""
    trajectory, off = simulated.trajectory, simulated.trajectory.constraint_drift
    # Where no energy is conserved the Jacobi integral may be: its drift is another thing.
    conserved = say("Jacobi") if trajectory.labels.energy == "h" else say("Energy")
    rows: list[tuple[Text, Text]] = [
        (say("Accuracy"), _promise(trajectory)),
        (conserved, drift_of(trajectory.energy_drift)),
    ]
    if off is not None:
        largest = say("largest drift {drift}", drift=decimal(off, ".1e"))
        rows.append((say("Constraints"), largest))
    if simulated.in_other_form:
        rows.append((say("Form"), Plain(trajectory.formulation)))
    cost = say(
        "{method}, {steps} steps, {evaluations} evaluations of the right-hand side",
        method=Plain(trajectory.method),
        steps=trajectory.steps,
        evaluations=trajectory.rhs_evaluations,
    )
    rows += [(say("Method"), cost), (say("Code"), Plain(trajectory.implementation))]
    return tuple(rows)
