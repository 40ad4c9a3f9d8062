"""What became of a scene at its extremes, as JSON and as text for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lagrange_cli.simulate.stress import Stress
from lagrange_cli.simulate.stress_points import StressPoint
from lagrange_cli.simulate.stress_runs import StressRun

__all__ = ["sentence", "setting", "summary", "text"]

#: Characters of a setting and of a reason in the table.
SETTING, REASON = 26, 72

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


def summary(found: Stress) -> dict[str, Any]:
    """What ``lagrange stress --json`` writes."""
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


def text(found: Stress) -> str:
    """The table and what it comes to, for a person."""
    lines = [f"{found.name}: {sentence(found.counts)}", ""]
    if found.runs:
        lines += [*_table(found.runs), ""]
    lines += _references(found.runs)
    if found.left_out:
        lines.append(f"Left out   the scene has no points of {', '.join(found.left_out)}")
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


def _table(runs: Sequence[StressRun]) -> list[str]:
    settings = [_cut(setting(run.point), SETTING) for run in runs]
    width = max(map(len, ("set", *settings)))
    head = (
        f"  {'axis':<12} {'value':>8}  {'set':<{width}}  {'outcome':<8} {'error':>8}"
        f" {'estimate':>8}  reason"
    )
    return [
        head,
        *(_row(run, f"{given:<{width}}") for run, given in zip(runs, settings, strict=True)),
    ]


def _row(run: StressRun, given: str) -> str:
    row = (
        f"  {run.point.axis:<12} {run.point.value:>8.3g}  {given}  {run.outcome:<8}"
        f" {_number(run.error):>8} {_number(run.estimated):>8}  {_cut(run.reason, REASON)}"
    )
    return row.rstrip()


def _references(runs: Sequence[StressRun]) -> list[str]:
    """What the errors are measured against, and how often."""
    kinds: dict[str, int] = {}
    for run in runs:
        if run.error is not None:
            kind = run.reference.partition(" until ")[0]
            kinds[kind] = kinds.get(kind, 0) + 1
    listed = ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
    return [f"Reference  {listed}"] if kinds else []


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0e}"


def _cut(said: str, most: int) -> str:
    return said if len(said) <= most else said[: most - 3] + "..."
