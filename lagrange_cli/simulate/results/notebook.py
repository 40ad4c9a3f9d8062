"""A trajectory as a notebook shows it: what is promised, and the last state."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from lagrange_cli.notation.html import html_formula, html_table, html_text

if TYPE_CHECKING:
    from lagrange_cli.simulate.results.trajectory import Trajectory


def trajectory_html(trajectory: Trajectory) -> str:
    """Two tables: accuracy and method, and the values at the end."""
    span = f"t = {trajectory.t[0]:g} to {trajectory.t[-1]:g}, {len(trajectory.t)} samples"
    title = trajectory.labels.title or trajectory.name
    caption = f"<b>{html_text(title)}</b>: {html_text(f'{span}, {trajectory.status}')}"
    known = [[html_text(name), html_text(text)] for name, text in _known(trajectory)]
    state = [_row(trajectory, name) for name in trajectory.columns if not name.startswith("dot(")]
    at_end = f"at t = {trajectory.t[-1]:.9g}"
    heads = ("", "value", "rate", "unit")
    return "\n".join(
        [html_table(caption, (), known, len(known)), html_table(at_end, heads, state, len(state))]
    )


def _known(trajectory: Trajectory) -> Iterator[tuple[str, str]]:
    if trajectory.reason:
        yield "reason", trajectory.reason
    if trajectory.requested is None:
        yield "accuracy", "nothing is promised or estimated: a method was chosen"
    else:
        shown = [f"{trajectory.requested:g} requested"]
        if trajectory.estimated is not None:
            shown.append(f"{trajectory.estimated:.1e} estimated")
        if trajectory.holds_until is not None:
            shown.append(f"holds until t = {trajectory.holds_until:.9g}")
        yield "accuracy", ", ".join(shown)
    if trajectory.energy_drift is not None:
        yield "energy", f"relative drift {trajectory.energy_drift:.1e}"
    if trajectory.constraint_drift is not None:
        yield "constraints", f"largest drift {trajectory.constraint_drift:.1e}"
    yield "method", f"{trajectory.method}, {trajectory.steps} steps"
    if trajectory.events:
        first = trajectory.events[0]
        yield "events", f"{len(trajectory.events)}, first {first.name} at t = {first.t:.9g}"
    yield from (("remark", remark) for remark in trajectory.remarks)


def _row(trajectory: Trajectory, name: str) -> list[str]:
    """Symbol, last value, its rate where that is a column, unit."""
    rate, unit = trajectory.columns.get(f"dot({name})"), trajectory.labels.units.get(name)
    return [
        html_formula(trajectory.labels.symbol(name).latex),
        f"{trajectory.columns[name][-1]:.9g}",
        "" if rate is None else f"{rate[-1]:.9g}",
        html_text(unit or ""),
    ]
