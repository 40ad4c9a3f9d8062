"""Report of ``lagrange stress``: the outcomes of a scene at its extremes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from lagrange_cli.report.contents.numbers import decimal
from lagrange_cli.report.inlines import Listed, Plain, Text, in_parentheses, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import Column, Document, Labelled, section, sections, table_of
from lagrange_cli.report.values.studies import STRESS
from lagrange_cli.studies.stress.measure import Stress
from lagrange_cli.studies.stress.points import StressPoint
from lagrange_cli.studies.stress.runs import StressRun

#: Characters of a setting in the table.
_SETTING_WIDTH = 26

#: Characters of a reason in the table.
_REASON_WIDTH = 72

#: Base dimension → its unit in scenes.
_UNITS = {"mass": "kg", "length": "m", "time": "s"}

json_of.register(Stress, STRESS.write)


@contents_of.register
def stress_document(stress: Stress) -> Document:
    """Return every run with its outcome, and the kinds of references."""
    title = say(
        "{name}: {outcomes}", name=Plain(stress.name), outcomes=outcomes_counted(stress.counts)
    )
    known = _known(stress)
    written = sections(
        section("", table_of(stress.runs, *_RUNS, prose=say("reason")) if stress.runs else None),
        section("", Labelled(known) if known else None),
    )
    return Document(stress.name, "a scene at its extremes", title, written)


def setting(point: StressPoint) -> str:
    """Write the values that make a point, in the names of the scene."""
    if point.scaled is not None:
        return ", ".join(f"{_UNITS[base]} * {x:.3g}" for base, x in point.scaled.items())
    texts = {**point.parameters, **point.initial}
    settings = [f"{name} = {float(text):.12g}" for name, text in texts.items()]
    if point.until is not None:
        settings.append(f"until {float(point.until):.6g}")
    return ", ".join(settings)


def outcomes_counted(counts: dict[str, int]) -> Text:
    """Sum up the outcomes of runs in one sentence."""
    parts: list[Text] = [
        say(
            "{runs} runs: {holds} right, {degraded} degraded with a right estimate, {refused}"
            " refused, {wrong} silently wrong",
            **{name: counts[name] for name in ("runs", "holds", "degraded", "refused", "wrong")},
        )
    ]
    if counts["unchecked"]:
        parts.append(
            say("{count} of them could be compared with nothing", count=counts["unchecked"])
        )
    if counts["underestimated"]:
        said = say(
            "{count} are as accurate as asked, but less than estimated",
            count=counts["underestimated"],
        )
        parts.append(said)
    return Listed(tuple(parts), between="; ")


def _cut(said: str, most: int) -> Plain:
    return Plain(said if len(said) <= most else said[: most - 3] + "...")


_RUNS: tuple[Column[StressRun], ...] = (
    Column(say("axis"), lambda run: Plain(run.point.axis)),
    Column(say("value"), lambda run: decimal(run.point.value, ".3g"), True),
    Column(say("set"), lambda run: _cut(setting(run.point), _SETTING_WIDTH)),
    Column(say("outcome"), lambda run: Plain(run.outcome)),
    Column(say("error"), lambda run: decimal(run.error, ".0e"), True),
    Column(say("estimate"), lambda run: decimal(run.estimated, ".0e"), True),
    Column(say("reason"), lambda run: _cut(run.reason, _REASON_WIDTH)),
)


def _known(stress: Stress) -> tuple[tuple[Text, Text], ...]:
    rows: list[tuple[Text, Text]] = []
    kinds = _references(stress.runs)
    if kinds:
        rows.append((say("Reference"), kinds))
    if stress.left_out:
        axes = Listed(tuple(map(Plain, stress.left_out)))
        rows.append((say("Left out"), say("the scene has no points of {axes}", axes=axes)))
    return tuple(rows)


def _references(runs: Sequence[StressRun]) -> Listed:
    """List the kinds of references that errors are measured from, and how often."""
    checked = [run.reference for run in runs if run.error is not None]
    kinds = Counter(reference.partition(" until ")[0] for reference in checked)
    return Listed(tuple(in_parentheses(Plain(kind), f"{n}") for kind, n in kinds.items()))
