"""Report of ``lagrange check``: text, GitHub annotations, JSON and JUnit XML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from lagrange_cli.errors import Problem, escape_controls, render
from lagrange_cli.notation.page import Page, Role, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, table
from lagrange_cli.report.values.check import CHECK

if TYPE_CHECKING:
    from lagrange_cli.check import Report, SceneReport

#: Outcome, path, seconds.
_SCENE = (TableColumn("", 7, before=""), TableColumn(), TableColumn())


def _scene_rows(scene: SceneReport) -> list[Row]:
    """The lines for one scene: its outcome, and each problem with its place."""
    row = [scene.outcome, escape_controls(scene.path), f"({scene.seconds:.2f} s)"]
    role: Role = "good" if scene.outcome == "pass" else "bad"
    lines = table(_SCENE, [row], heading=False, role=role)
    problems = [line for problem in scene.problems for line in render(problem).splitlines()]
    return lines + [Row("", f"  {line}") for line in problems]


def _total(report: Report) -> str:
    """Count the scenes, and those of each outcome."""
    number = len(report.scenes)
    counts = ", ".join(f"{n} {outcome}" for outcome, n in report.summary.items() if n)
    return f"{number} {'scene' if number == 1 else 'scenes'}: {counts or 'nothing to check'}\n"


def check_text(report: Report) -> Page:
    """The report for a person."""
    rows = [row for scene in report.scenes for row in _scene_rows(scene)]
    return page([[*rows, Row("", _total(report).rstrip())]])


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


def github(report: Report) -> str:
    """Annotations for a GitHub workflow, one a problem, and a line that counts."""
    annotations = [_annotation(scene, p) for scene in report.scenes for p in scene.problems]
    return "\n".join([*annotations, _total(report)])


def _xml(text: str) -> str:
    """A text without the two characters that no escaping brings into XML."""
    return text.replace("\ufffe", "\\ufffe").replace("\uffff", "\\uffff")


def junit(report: Report) -> str:
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


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[Report], str | Page]] = {
    "text": check_text,
    "github": github,
    "json": lambda report: json_text(CHECK.write(report)),
}
