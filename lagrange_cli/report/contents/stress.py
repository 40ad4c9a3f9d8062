"""Report of ``lagrange stress``: the outcomes of a scene at its extremes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Page, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table
from lagrange_cli.report.values.studies import STRESS

if TYPE_CHECKING:
    from lagrange_cli.studies.stress.measure import Stress
    from lagrange_cli.studies.stress.points import StressPoint
    from lagrange_cli.studies.stress.runs import StressRun

#: Characters of a setting in the table.
_SETTING_WIDTH = 26

#: Characters of a reason in the table.
_REASON_WIDTH = 72

_RUNS = (
    TableColumn("axis", 12),
    TableColumn("value", 8, ">", " "),
    TableColumn("set"),
    TableColumn("outcome", 8),
    TableColumn("error", 8, ">", " "),
    TableColumn("estimate", 8, ">", " "),
    TableColumn("reason"),
)

#: Base dimension → its unit in scenes.
_UNITS = {"mass": "kg", "length": "m", "time": "s"}


def setting(point: StressPoint) -> str:
    """Write the values that make a point, in the names of the scene."""
    if point.scaled is not None:
        return ", ".join(f"{_UNITS[base]} * {x:.3g}" for base, x in point.scaled.items())
    texts = {**point.parameters, **point.initial}
    settings = [f"{name} = {float(text):.12g}" for name, text in texts.items()]
    if point.until is not None:
        settings.append(f"until {float(point.until):.6g}")
    return ", ".join(settings)


def _text(stress: Stress) -> Page:
    """Write the table and its summary, for a person."""
    left_out = f"the scene has no points of {', '.join(stress.left_out)}"
    return page(
        [
            [sentence_row(f"{stress.name}: {sentence(stress.counts)}", "heading")],
            table(_RUNS, list(map(_row, stress.runs))) if stress.runs else [],
            _references(stress.runs)
            + (labelled(("Left out", left_out)) if stress.left_out else []),
        ]
    )


def sentence(counts: dict[str, int]) -> str:
    """Sum up the outcomes of runs in one sentence."""
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


def _references(runs: Sequence[StressRun]) -> list[Row]:
    """List the kinds of references that errors are measured from, and how often."""
    checked = [run.reference for run in runs if run.error is not None]
    kinds = Counter(reference.partition(" until ")[0] for reference in checked)
    listed = ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
    return labelled(("Reference", listed)) if kinds else []


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0e}"


def _cut(said: str, most: int) -> str:
    return said if len(said) <= most else said[: most - 3] + "..."


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[Stress], str | Page]] = {
    "text": _text,
    "json": lambda stress: json_text(STRESS.write(stress)),
}
