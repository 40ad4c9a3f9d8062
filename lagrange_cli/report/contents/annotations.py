"""Reports of ``lagrange check`` for other programs: GitHub, GitLab, SARIF and JUnit.

A problem without a place has that of its scene. Texts of scenes are escaped as each format asks.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import Any
from urllib.parse import quote
from xml.etree import ElementTree

from lagrange_cli.cache import digest
from lagrange_cli.check import Report, SceneReport
from lagrange_cli.errors import Mark, Problem, escape_controls, render
from lagrange_cli.report.contents.check import counted_scenes
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import ENGLISH
from lagrange_cli.report.tables import json_text
from lagrange_cli.report.writers.terminal.letters import UnicodeLetters
from lagrange_cli.version import __version__

#: The schema that editors check SARIF by.
_SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"

#: Outcome of a scene → the severity of its problems in GitLab's reports.
_SEVERITIES = {"fail": "major", "invalid": "critical", "timeout": "minor", "crash": "blocker"}


def _problems(report: Report) -> Iterator[tuple[SceneReport, Problem, Mark]]:
    """Yield each problem with its scene and its place."""
    for scene in report.scenes:
        for problem in scene.problems:
            yield scene, problem, problem.mark or Mark(scene.path, 1, 1)


def _message(problem: Problem) -> str:
    return problem.message + (f"\n{problem.hint}" if problem.hint else "")


# GitHub.


def _escape_lines(text: str) -> str:
    """Replace control characters in the lines of a text."""
    return "\n".join(map(escape_controls, text.split("\n")))


def _escape(value: str, *more: tuple[str, str]) -> str:
    """Escape a value as GitHub's workflow commands ask, ``%`` first, and control characters in
    its lines as everywhere."""
    value = _escape_lines(value)
    for character, escaped in (("%", "%25"), ("\r", "%0D"), ("\n", "%0A"), *more):
        value = value.replace(character, escaped)
    return value


def _annotation(scene: SceneReport, problem: Problem) -> str:
    """One ``::error`` workflow command."""
    mark = problem.mark
    places = {"file": _forward(mark.file if mark else scene.path)}
    if mark:
        places |= {"line": str(mark.line), "col": str(mark.column)}
    places["title"] = f"{scene.outcome}: {problem.rule}"
    properties = ",".join(
        f"{key}={_escape(value, (':', '%3A'), (',', '%2C'))}" for key, value in places.items()
    )
    return f"::error {properties}::{_escape(_message(problem))}"


def github_annotations(report: Report) -> str:
    """Return annotations for a GitHub workflow, one a problem, and a line that counts."""
    written = [_annotation(scene, p) for scene in report.scenes for p in scene.problems]
    total = Lettering(UnicodeLetters(), ENGLISH).text(counted_scenes(report))
    return "\n".join([*written, total]) + "\n"


# SARIF and GitLab.


def _uri(path: str) -> str:
    """Return the reference of a file, relative where its path is, as RFC 3986 writes it."""
    return Path(path).as_uri() if os.path.isabs(path) else quote(_forward(path))


def _forward(path: str) -> str:
    """Return a path with forward slashes and without ``./`` before it."""
    return PurePath(path).as_posix()


def sarif(report: Report) -> str:
    """Return a log of OASIS SARIF 2.1.0, with a result for each problem."""
    rules = list(dict.fromkeys(problem.rule for _, problem, _ in _problems(report)))
    driver = {"name": "lagrange", "version": __version__, "rules": [{"id": rule} for rule in rules]}
    results = [
        {
            "ruleId": problem.rule,
            "ruleIndex": rules.index(problem.rule),
            "level": "error",
            "message": {"text": _escape_lines(_message(problem))},
            "locations": [{"physicalLocation": _physical(mark)}],
            "properties": {"outcome": scene.outcome},
        }
        for scene, problem, mark in _problems(report)
    ]
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return json_text({"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]})


def _physical(mark: Mark) -> dict[str, Any]:
    """Return the place of a mark in SARIF."""
    region = {
        "startLine": mark.line,
        "startColumn": mark.column,
        "endColumn": mark.column + max(1, mark.length),
    }
    return {"artifactLocation": {"uri": _uri(mark.file)}, "region": region}


def gitlab(report: Report) -> str:
    """Return a report of GitLab's Code Quality: a list of the problems.

    Fingerprints, by which GitLab tells new problems from old ones, leave out the line.
    """
    written: list[dict[str, Any]] = []
    seen: dict[str, int] = {}
    for scene, problem, mark in _problems(report):
        path = _forward(mark.file)
        key = digest(path, problem.rule, problem.message)
        seen[key] = seen.get(key, 0) + 1
        written.append(
            {
                "description": _escape_lines(problem.message),
                "check_name": problem.rule,
                "fingerprint": digest(key, str(seen[key])),
                "severity": _SEVERITIES[scene.outcome],
                "location": {"path": path, "lines": {"begin": mark.line}},
            }
        )
    return json_text(written)


# JUnit.


def _xml(text: str) -> str:
    """A text without the two characters that no escaping brings into XML."""
    return text.replace("\ufffe", "\\ufffe").replace("\uffff", "\\uffff")


def junit_xml(report: Report) -> str:
    """Return JUnit XML: a test case a scene, of the class of its folder.

    Scenes that are invalid, crash or reach a limit are errors.
    """
    outcomes = [scene.outcome for scene in report.scenes]
    failures = outcomes.count("fail")
    suite = ElementTree.Element(
        "testsuite",
        name="lagrange check",
        tests=str(len(outcomes)),
        failures=str(failures),
        errors=str(len(outcomes) - failures - outcomes.count("pass")),
        time=f"{sum(scene.seconds for scene in report.scenes):.3f}",
    )
    known = {"lagrange": __version__, "python": platform.python_version(), "platform": os.name}
    _add_properties(suite, known)
    for scene in report.scenes:
        folder, name = os.path.split(scene.path)
        case = ElementTree.SubElement(
            suite,
            "testcase",
            classname=_xml(escape_controls(_forward(folder).replace("/", "."))),
            name=_xml(escape_controls(name)),
            file=_xml(escape_controls(scene.path)),
            time=f"{scene.seconds:.3f}",
        )
        _add_properties(case, {"outcome": scene.outcome})
        for problem in scene.problems:
            tag = "failure" if scene.outcome == "fail" else "error"
            message = _xml(escape_controls(problem.message))
            entry = ElementTree.SubElement(case, tag, type=problem.rule, message=message)
            entry.text = _xml(render(problem))
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _add_properties(element: ElementTree.Element, values: dict[str, str]) -> None:
    properties = ElementTree.SubElement(element, "properties")
    for name, value in values.items():
        ElementTree.SubElement(properties, "property", name=name, value=value)


#: Name of a format → the function that writes it.
CHECK_FORMATS = {"github": github_annotations, "gitlab": gitlab, "sarif": sarif}
