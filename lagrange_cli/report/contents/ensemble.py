"""Report of ``lagrange simulate`` for an ensemble: the outcomes of its members."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lagrange_cli.notation.page import Page, Row, page, words
from lagrange_cli.report.tables import json_text, labelled, sentence_row
from lagrange_cli.report.values.simulation import ENSEMBLE, SimulatedMembers

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.store.blocks import NumberRange

#: Failures that the text lists.
_MOST_SHOWN = 12


def _text(simulated: SimulatedMembers) -> Page:
    """The result for a person."""
    counts, estimated = simulated.counts(), simulated.store.estimated()
    finished = sum(counts.values())
    listed = ", ".join(f"{count} {status}" for status, count in counts.items())
    rate = finished / max(simulated.seconds["integrate"], 1e-9)
    known = [("Status", listed or "none is finished")]
    if estimated is not None:
        known.append(("Accuracy", f"{estimated:.1e} estimated, the largest of all members"))
    known.append(("Speed", f"{rate:.3g} members a second"))
    done = f"{simulated.plan.model.name}: {finished} of {len(simulated.members)} members"
    return page(
        [
            [sentence_row(done, "heading")],
            labelled(*known, width=8),
            _reduced(simulated.reduced(), finished),
            _failures(simulated.failed(_MOST_SHOWN), finished - counts.get("ok", 0)),
        ]
    )


def _reduced(reduced: Mapping[str, tuple[NumberRange, float]], members: int) -> list[Row]:
    """Say what the numbers of motions come to, a line each; nothing if there are none."""
    if not reduced:
        return []
    lines, width = [Row("Reduced", role="heading")], max(map(len, reduced))
    for name, (extent, error) in reduced.items():
        if extent.known:
            said = f"from {extent.least:.6g} to {extent.largest:.6g}{_off_by(error)}"
        else:
            is_open = error == math.inf
            said = "open: it is not decided whether there is one" if is_open else "of none"
        if 0 < extent.known < members:
            said += f", of {extent.known} members"
        lines.append(Row(f"  {name:{width}}", "  ", words(said), "name"))
    return lines


def _off_by(error: float) -> str:
    """Say how far a number may be off; nothing where no accuracy is promised."""
    if math.isnan(error):
        return ""
    return f" ± {error:.1g}" if error < math.inf else ", with an error that has no bound"


def _failures(failed: Sequence[Mapping[str, Any]], number: int) -> list[Row]:
    """List the first of a number of failures, a line each; nothing if there are none."""
    if not failed:
        return []
    lines = [Row("Failed", role="heading")]
    for member in failed:
        values = ", ".join(f"{name} = {value}" for name, value in member["values"].items())
        what = f"{values}: {member['status']}, {member['reason']}"
        lines.append(Row(f"  {member['member']}", "  ", words(what), "name"))
    if number > len(failed):
        lines.append(Row(f"  and {number - len(failed)} more; --json lists them all"))
    return lines


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[SimulatedMembers], str | Page]] = {
    "text": _text,
    "json": lambda simulated: json_text(ENSEMBLE.write(simulated)),
}
