"""Report of ``lagrange simulate``: the end of a trajectory and the accuracy it has."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Page, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table
from lagrange_cli.report.values.simulation import SIMULATION, Simulated

if TYPE_CHECKING:
    from lagrange_cli.simulate import Trajectory

#: Events that the text lists.
_MOST_EVENTS = 12

#: Values that it lists with each event.
_MOST_VALUES = 6

_STATE = (TableColumn(), TableColumn("value", 16, ">"), TableColumn("rate", 16, ">"))

#: Name and value.
_FURTHER = (TableColumn(), TableColumn("", 16, ">"))

#: Name of a conserved quantity, value, drift.
_CONSERVED = (
    TableColumn("conserved"),
    TableColumn("value", 16, ">"),
    TableColumn("relative drift", 16, ">"),
)

#: Time, name, values.
_EVENTS = (TableColumn("", 16), TableColumn(before=" "), TableColumn())


def _number(value: float | None, form: str) -> str:
    return "none" if value is None else format(value, form)


def _state(trajectory: Trajectory) -> list[Row]:
    """Write the last state as a table: each name with its value and its rate, if it has one."""
    followed = trajectory.conserved_drift or {}
    state = {name: x for name, x in trajectory.state.items() if name not in followed}
    rates = {name: state.get(f"dot({name})") for name in state if not name.startswith("dot(")}
    rows = [
        [name, f"{state[name]:.9g}", *([] if rate is None else [f"{rate:.9g}"])]
        for name, rate in rates.items()
    ]
    return table(_STATE, rows)


def _further(values: Mapping[str, float]) -> list[Row]:
    """Write one value a line."""
    return table(_FURTHER, [[n, f"{value:.9g}"] for n, value in values.items()], heading=False)


def _beside(simulated: Simulated) -> dict[str, float]:
    """Return the last values of further columns that no other table has."""
    followed = simulated.trajectory.conserved_drift or {}
    return {name: x for name, x in simulated.further().items() if name not in followed}


def _conserved(simulated: Simulated) -> list[Row]:
    """Write conserved quantities with their values at the end and their drifts."""
    trajectory = simulated.trajectory
    if trajectory.conserved_drift is None:
        return []
    values = trajectory.state | simulated.further()
    rows = [
        [name, f"{values[name]:.9g}", _number(drift, ".1e")]
        for name, drift in trajectory.conserved_drift.items()
    ]
    if not rows:
        said = "nothing was found among energies and momenta of linear symmetries"
        return labelled(("Conserved", said), width=9)
    return table(_CONSERVED, rows)


def _events(trajectory: Trajectory, shown: Sequence[str]) -> list[Row]:
    """List the first events with the values of some names."""
    events = trajectory.events
    if not events:
        return []
    rows = [
        [
            f"t = {event.t:.9g}",
            event.name,
            ", ".join(f"{name} = {event.state[name]:.9g}" for name in shown[:_MOST_VALUES]),
        ]
        for event in events[:_MOST_EVENTS]
    ]
    lines = [Row("Events", role="heading"), *table(_EVENTS, rows, heading=False)]
    if len(events) > _MOST_EVENTS:
        more = f"  and {len(events) - _MOST_EVENTS} more until t = {events[-1].t:.9g}"
        lines.append(Row(more))
    return lines


def _promise(trajectory: Trajectory) -> str:
    if trajectory.requested is None:
        return "nothing is promised or estimated: a method was chosen"
    estimated = _number(trajectory.estimated, ".1e")
    until = _number(trajectory.holds_until, ".9g")
    return f"{trajectory.requested:g} requested, {estimated} estimated, holds until t = {until}"


def _text(simulated: Simulated) -> Page:
    """The result for a person."""
    model, trajectory = simulated.model, simulated.trajectory
    # Where no energy is conserved the Jacobi integral may be: its drift is another thing.
    conserved = "Jacobi" if "jacobi" in model.conserved else "Energy"
    drift, off = trajectory.energy_drift, trajectory.constraint_drift
    drifts = "not found to be conserved" if drift is None else f"relative drift {drift:.1e}"
    known = [
        ("Accuracy", _promise(trajectory)),
        (conserved, drifts),
        *([] if off is None else [("Constraints", f"largest drift {off:.1e}")]),
        *([("Form", trajectory.formulation)] if simulated.in_other_form else []),
        (
            "Method",
            f"{trajectory.method}, {trajectory.steps} steps, "
            f"{trajectory.rhs_evaluations} evaluations of the right-hand side",
        ),
        ("Code", trajectory.implementation),
    ]
    return page(
        [
            [sentence_row(f"{trajectory.name} at t = {trajectory.t[-1]:.9g}", "heading")],
            _state(trajectory),
            _further(_beside(simulated)),
            _conserved(simulated),
            _events(trajectory, (*model.coordinates, *model.outputs)),
            labelled(*known, width=8),
        ]
    )


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[Simulated], str | Page]] = {
    "text": _text,
    "json": lambda simulated: json_text(SIMULATION.write(simulated)),
}
