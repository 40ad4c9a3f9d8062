"""Report of ``lagrange check`` for a person."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from lagrange_cli.check import Report, SceneReport
from lagrange_cli.errors import render
from lagrange_cli.report.contents.numbers import decimal
from lagrange_cli.report.inlines import Listed, Plain, Text, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import (
    Block,
    Column,
    Document,
    Paragraph,
    Title,
    Verbatim,
    section,
    sections,
    table_of,
)
from lagrange_cli.report.values.check import CHECK

json_of.register(Report, CHECK.write)


@contents_of.register
def check_document(report: Report) -> Document:
    """Return each scene with its outcome and its problems, and the slowest ones.

    A document has a table of the scenes; a terminal has the problems of each below it.
    """
    total = counted_scenes(report)
    shown = [s for s in report.scenes if not (report.brief and s.outcome == "pass")]
    slowest = sorted(report.scenes, key=lambda scene: -scene.seconds)[: report.slowest]
    written = sections(
        section(
            "",
            Paragraph(total, only="document"),
            replace(table_of(shown, *_COLUMNS), only="document") if shown else None,
            *(block for scene in shown for block in _scene(scene)),
            Title(say("Slowest scenes")) if slowest else None,
            table_of(slowest, *_COLUMNS) if slowest else None,
            Paragraph(total, "heading", only="terminal"),
        )
    )
    return Document("check", "outcomes of checks", "", written)


_COLUMNS: tuple[Column[SceneReport], ...] = (
    Column(say("scene"), lambda scene: Plain(scene.path)),
    Column(say("outcome"), lambda scene: scene.outcome),
    Column(say("seconds"), lambda scene: decimal(scene.seconds, ".2f"), True),
)


def _scene(scene: SceneReport) -> Iterator[Block]:
    """Return the outcome of a scene, and each problem with its place."""
    seconds = f"({scene.seconds:.2f} s)"
    outcome = Listed((f"{scene.outcome:7}", Plain(scene.path), seconds), between="  ")
    yield Paragraph(outcome, "good" if scene.outcome == "pass" else "bad", only="terminal")
    lines = [line for problem in scene.problems for line in render(problem).splitlines()]
    if lines:
        yield Title(Plain(scene.path), only="document")
        yield Verbatim(tuple(f"  {line}" for line in lines))


def counted_scenes(report: Report) -> Text:
    """Count the scenes, and those of each outcome."""
    counts = tuple(f"{n} {outcome}" for outcome, n in report.summary.items() if n)
    if report.unchecked:
        return say.counted(
            len(report.scenes),
            "{count} scene: {outcomes}; not checked: {unchecked}",
            "{count} scenes: {outcomes}; not checked: {unchecked}",
            outcomes=Listed(counts),
            unchecked=Plain(str(report.unchecked)),
        )
    return say.counted(
        len(report.scenes),
        "{count} scene: {outcomes}",
        "{count} scenes: {outcomes}",
        outcomes=Listed(counts) or say("nothing to check"),
    )
