"""Report of ``lagrange simulate`` for an ensemble: the outcomes of its members."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.reports.tables import labelled, sentence_row
from lagrange_cli.notation.page import Page, Row, page, words

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.input_file import Members
    from lagrange_cli.simulate.ensemble.run import Plan
    from lagrange_cli.simulate.ensemble.store import Store

#: Failures that the text lists.
_MOST_SHOWN = 12


@dataclass(frozen=True, slots=True)
class SimulatedMembers:
    """The results of an ensemble.

    Attributes
    ----------
    plan, members
        The runs that were planned, and the values of all members.
    store, sizes
        Results, and the number of members in each of its parts.
    output
        The file with the samples; None if none was asked for.
    seconds
        Wall clock of ``derive`` and ``integrate``.
    """

    plan: Plan
    members: Members
    store: Store
    sizes: Sequence[int]
    output: str | None
    seconds: Mapping[str, float]

    def counts(self) -> dict[str, int]:
        """Return status → number of members."""
        return dict(sorted(Counter(self.store.words("status")).items()))

    def failed(self) -> list[dict[str, Any]]:
        """Return the members that are not ``ok``, as JSON values."""
        store = self.store
        columns = (
            store.members(self.sizes),
            store.words("status"),
            store.words("reason"),
            store.figures("holds_until"),
        )
        return [
            {
                "member": member,
                "values": self.members.values(member),
                "status": status,
                "holds_until": float(holds),
                "reason": reason,
            }
            for member, status, reason, holds in zip(*columns, strict=True)
            if status != "ok"
        ]

    def estimated(self) -> float | None:
        """Return the largest estimated error, relative to scales; None if there is none."""
        known = [x for x in self.store.figures("estimated").tolist() if not math.isnan(x)]
        return max(known, default=None)


def _summary(simulated: SimulatedMembers) -> dict[str, Any]:
    """Return what ``--json`` writes."""
    counts = simulated.counts()
    return {
        "name": simulated.plan.model.name,
        "members": len(simulated.members),
        "finished": sum(counts.values()),
        "counts": counts,
        "failed": simulated.failed(),
        "estimated": simulated.estimated(),
        "numbers_alone": simulated.plan.alone,
        "output": simulated.output,
        "seconds": dict(simulated.seconds),
    }


def _text(simulated: SimulatedMembers) -> Page:
    """The result for a person."""
    counts, estimated = simulated.counts(), simulated.estimated()
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
            _failures(simulated.failed()),
        ]
    )


def _failures(failed: Sequence[Mapping[str, Any]]) -> list[Row]:
    """List the first failures, a line each; nothing if there are none."""
    if not failed:
        return []
    lines = [Row("Failed", role="heading")]
    for member in failed[:_MOST_SHOWN]:
        values = ", ".join(f"{name} = {value}" for name, value in member["values"].items())
        what = f"{values}: {member['status']}, {member['reason']}"
        lines.append(Row(f"  {member['member']}", "  ", words(what), "name"))
    if len(failed) > _MOST_SHOWN:
        lines.append(Row(f"  and {len(failed) - _MOST_SHOWN} more; --json lists them all"))
    return lines


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[SimulatedMembers], str | Page]] = {
    "text": _text,
    "json": lambda simulated: json_text(_summary(simulated)),
}
