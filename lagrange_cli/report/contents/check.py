"""Report of ``lagrange check``: text, GitHub annotations, JSON and JUnit XML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from xml.etree import ElementTree

from lagrange_cli.check import Report, SceneReport
from lagrange_cli.errors import Problem, escape_controls, render
from lagrange_cli.report.contents.numbers import decimal
from lagrange_cli.report.inlines import Lettering, Listed, Plain, Text, say
from lagrange_cli.report.phrases.language import ENGLISH
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
from lagrange_cli.report.writers.terminal.letters import UnicodeLetters

json_of.register(Report, CHECK.write)


@contents_of.register
def check_document(report: Report) -> Document:
    """Return each scene with its outcome and its problems.

    A document has a table of the scenes; a terminal has the problems of each below it.
    """
    total = _counted_scenes(report)
    written = sections(
        section(
            "",
            Paragraph(total, only="document"),
            replace(table_of(report.scenes, *_COLUMNS), only="document"),
            *(block for scene in report.scenes for block in _scene(scene)),
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


def _counted_scenes(report: Report) -> Text:
    """Count the scenes, and those of each outcome."""
    counts = tuple(f"{n} {outcome}" for outcome, n in report.summary.items() if n)
    return say.counted(
        len(report.scenes),
        "{count} scene: {outcomes}",
        "{count} scenes: {outcomes}",
        outcomes=Listed(counts) or say("nothing to check"),
    )


def _escape(value: str, *more: tuple[str, str]) -> str:
    """Escape a value as GitHub's workflow commands ask, ``%`` first, and control characters in
    its lines as everywhere."""
    value = "\n".join(map(escape_controls, value.split("\n")))
    for character, escaped in (("%", "%25"), ("\r", "%0D"), ("\n", "%0A"), *more):
        value = value.replace(character, escaped)
    return value


def _annotation(scene: SceneReport, problem: Problem) -> str:
    """One ``::error`` workflow command."""
    mark = problem.mark
    places = {"file": mark.file if mark else scene.path}
    if mark:
        places |= {"line": str(mark.line), "col": str(mark.column)}
    places["title"] = f"{scene.outcome}: {problem.rule}"
    properties = ",".join(
        f"{key}={_escape(value, (':', '%3A'), (',', '%2C'))}" for key, value in places.items()
    )
    message = problem.message + (f"\n{problem.hint}" if problem.hint else "")
    return f"::error {properties}::{_escape(message)}"


def github_annotations(report: Report) -> str:
    """Return annotations for a GitHub workflow, one a problem, and a line that counts."""
    written = [_annotation(scene, p) for scene in report.scenes for p in scene.problems]
    total = Lettering(UnicodeLetters(), ENGLISH).text(_counted_scenes(report))
    return "\n".join([*written, total]) + "\n"


def _xml(text: str) -> str:
    """A text without the two characters that no escaping brings into XML."""
    return text.replace("\ufffe", "\\ufffe").replace("\uffff", "\\uffff")


def junit_xml(report: Report) -> str:
    """JUnit XML: a test case a scene; crashes and invalid scenes are errors."""
    outcomes = [scene.outcome for scene in report.scenes]
    suite = ElementTree.Element(
        "testsuite",
        name="lagrange check",
        tests=str(len(outcomes)),
        failures=str(outcomes.count("fail")),
        errors=str(outcomes.count("invalid") + outcomes.count("crash")),
        time=f"{sum(scene.seconds for scene in report.scenes):.3f}",
    )
    for scene in report.scenes:
        case = ElementTree.SubElement(
            suite,
            "testcase",
            classname="scenes",
            name=_xml(escape_controls(scene.path)),
            time=f"{scene.seconds:.3f}",
        )
        for problem in scene.problems:
            tag = "failure" if scene.outcome == "fail" else "error"
            message = _xml(escape_controls(problem.message))
            entry = ElementTree.SubElement(case, tag, type=problem.rule, message=message)
            entry.text = _xml(render(problem))
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"
