"""Report of ``lagrange stress``: what became of a scene at its extremes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.reports.tables import TableColumn, labelled, table

if TYPE_CHECKING:
    from lagrange_cli.studies.stress.measure import Stress
    from lagrange_cli.studies.stress.points import StressPoint
    from lagrange_cli.studies.stress.runs import StressRun

#: Characters of a setting and of a reason in the table.
_SETTING_WIDTH, _REASON_WIDTH = 26, 72

_RUNS = (
    TableColumn("axis", 12),
    TableColumn("value", 8, ">", " "),
    TableColumn("set"),
    TableColumn("outcome", 8),
    TableColumn("error", 8, ">", " "),
    TableColumn("estimate", 8, ">", " "),
    TableColumn("reason"),
)

#: Units of the bases, as scenes have them.
_UNITS = {"mass": "kg", "length": "m", "time": "s"}


def setting(point: StressPoint) -> str:
    """What makes a point, in the words of the scene."""
    if point.scaled is not None:
        return ", ".join(f"{_UNITS[base]} * {x:.3g}" for base, x in point.scaled.items())
    texts = {**point.parameters, **point.initial}
    given = [f"{name} = {float(text):.12g}" for name, text in texts.items()]
    if point.until is not None:
        given.append(f"until {float(point.until):.6g}")
    return ", ".join(given)


# JSON.


def stress_summary(found: Stress) -> dict[str, Any]:
    """Return what ``lagrange stress --json`` writes."""
    return {
        "name": found.name,
        "budget": found.budget,
        "points": [_point(run) for run in found.runs],
        "left_out": list(found.left_out),
        "summary": found.counts,
    }


def _point(run: StressRun) -> dict[str, Any]:
    point = run.point
    return {
        "axis": point.axis,
        "value": point.value,
        "outcome": run.outcome,
        "error": _finite(run.error),
        "estimated": _finite(run.estimated),
        "reason": run.reason or None,
        "requested": run.requested,
        "holds_until": run.holds_until,
        "reference": run.reference or None,
        "set": {**point.parameters, **point.initial},
        "until": point.until,
    }


def _finite(value: float | None) -> float | None:
    return value if value is None or math.isfinite(value) else None


# Text.


def _text(found: Stress) -> str:
    """The table and what it comes to, for a person."""
    lines = [f"{found.name}: {sentence(found.counts)}", ""]
    if found.runs:
        lines += [*table(_RUNS, list(map(_row, found.runs))), ""]
    lines += _references(found.runs)
    if found.left_out:
        lines += _labelled("Left out", f"the scene has no points of {', '.join(found.left_out)}")
    return "\n".join(lines)


def sentence(counts: dict[str, int]) -> str:
    """What the outcomes of runs come to, in one sentence."""
    said = (
        f"{counts['runs']} runs: {counts['holds']} right, {counts['degraded']} degraded with a"
        f" right estimate, {counts['refused']} refused, {counts['wrong']} silently wrong"
    )
    if counts["unchecked"]:
        said += f"; {counts['unchecked']} of them could be compared with nothing"
    if counts["underestimated"]:
        said += f"; {counts['underestimated']} are as accurate as asked, but less than estimated"
    return said


def _row(run: StressRun) -> list[str]:
    return [
        run.point.axis,
        f"{run.point.value:.3g}",
        _cut(setting(run.point), _SETTING_WIDTH),
        run.outcome,
        _number(run.error),
        _number(run.estimated),
        _cut(run.reason, _REASON_WIDTH),
    ]


def _references(runs: Sequence[StressRun]) -> list[str]:
    """What the errors are measured against, and how often."""
    kinds: dict[str, int] = {}
    for run in runs:
        if run.error is not None:
            kind = run.reference.partition(" until ")[0]
            kinds[kind] = kinds.get(kind, 0) + 1
    listed = ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
    return _labelled("Reference", listed) if kinds else []


def _labelled(label: str, said: str) -> list[str]:
    return labelled([(label, said)], width=9)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0e}"


def _cut(said: str, most: int) -> str:
    return said if len(said) <= most else said[: most - 3] + "..."


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[Stress], str]] = {
    "text": _text,
    "json": lambda found: json_text(stress_summary(found)),
}
