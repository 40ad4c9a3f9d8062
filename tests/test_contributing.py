"""What CONTRIBUTING.md, the justfile and tests/README.md name is there."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest
import yaml

from lagrange_cli.cli.main import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("CONTRIBUTING.md", "SECURITY.md", "tests/README.md")
FOLDERS = r"(?:\.ci|benchmarks|docs|lagrange_cli|systems|tests)"
CODE = "\n".join(p.read_text(encoding="utf-8") for p in (ROOT / "lagrange_cli").rglob("*.py"))


def page(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def recipes() -> dict[str, list[str]]:
    """The commands of each verb of the justfile, with its variables put in and no options."""
    text = page("justfile")
    variables = dict(re.findall(r'^(\w+) := "(.*)"$', text, re.MULTILINE))
    verbs = re.findall(r"^([a-z-]+)(?: [^:=\n]*)?:\n((?:    .*\n)+)", text, re.MULTILINE)
    found = {}
    for verb, body in verbs:
        for name, value in variables.items():
            body = body.replace("{{" + name + "}}", value)
        body = body.replace("{{commit}}", "COMMIT").replace(" {{options}}", "")
        found[verb] = [line.strip() for line in body.splitlines()]
    return found


def test_verbs_are_those_of_the_justfile_with_the_same_commands() -> None:
    shown = re.findall(
        r"^    just ([a-z-]+)(?: [A-Z]+)? +# (.*)$", page("CONTRIBUTING.md"), re.MULTILINE
    )
    assert {verb: command.split(" && ") for verb, command in shown} == {
        verb: commands for verb, commands in recipes().items() if verb != "default"
    }


@pytest.mark.parametrize("name", PAGES)
def test_verbs_that_are_mentioned_are_there(name: str) -> None:
    assert set(re.findall(r"`just ([a-z-]+)", page(name))) <= set(recipes())


@pytest.mark.parametrize("name", [*PAGES, "justfile", ".pre-commit-config.yaml"])
def test_paths_that_are_named_exist(name: str) -> None:
    text = page(name)
    named = set(re.findall(rf"(?<![\w/.-])({FOLDERS}/[\w/.-]*\w)", text))
    linked = {
        str((ROOT / name).parent.joinpath(target).resolve().relative_to(ROOT))
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", text)
    }
    assert {path for path in named | linked if not (ROOT / path).exists()} == set()


def test_registries_and_functions_that_are_named_exist() -> None:
    text = page("CONTRIBUTING.md")
    registries = set(re.findall(r"`(_?[A-Z][A-Z_]+)`", text))
    assert {"EMITTERS", "INTEGRATORS", "CHECKS"} <= registries
    assert [n for n in registries if not re.search(rf"^{n}\b.* = ", CODE, re.MULTILINE)] == []
    classes = set(re.findall(r"`([A-Z][a-z]+)`", text))
    assert [n for n in classes if not re.search(rf"^class {n}\b", CODE, re.MULTILINE)] == []
    functions = set(re.findall(r"`([a-z]+_[a-z_]+)`", text))
    assert [n for n in functions if not re.search(rf"\bdef {n}\b", CODE)] == []


def test_every_folder_of_tests_is_described() -> None:
    described = re.findall(r"^\| ([^|]+) \|", page("tests/README.md"), re.MULTILINE)
    named = set(re.findall(r"`(\w+)`", " ".join(described)))
    folders = {p.name for p in (ROOT / "tests").iterdir() if p.is_dir() and any(p.rglob("*.*"))}
    assert folders - {"__pycache__"} <= named


def test_every_mark_is_described_and_declared() -> None:
    options = tomllib.loads(page("pyproject.toml"))["tool"]["pytest"]["ini_options"]
    declared = {line.partition(":")[0] for line in options["markers"]}
    table = page("tests/README.md").partition("## Marks")[2]
    assert set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)) == declared
    assert "--strict-markers" in options["addopts"]


def test_the_workflow_runs_the_script() -> None:
    assert "- run: .ci/run\n" in page(".github/workflows/ci.yml")


def test_the_workflow_runs_commands_that_there_are_on_other_systems() -> None:
    job = yaml.safe_load(page(".github/workflows/ci.yml"))["jobs"]["elsewhere"]
    assert job["strategy"]["matrix"]["system"] == ["macos-latest", "windows-latest"]
    commands = [shlex.split(step["run"]) for step in job["steps"] if "run" in step]
    assert {words[1] for words in commands if words[0] == "lagrange"} <= set(COMMANDS)
    words = [word for command in commands for word in command]
    assert all((ROOT / word).exists() for word in words if word.startswith(("tests/", "systems")))
    (extras,) = re.findall(r"\.\[(.*)\]", " ".join(words))
    known = tomllib.loads(page("pyproject.toml"))["project"]["optional-dependencies"]
    assert set(extras.split(",")) <= known.keys()
