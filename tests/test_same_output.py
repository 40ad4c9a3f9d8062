"""The comparison of two versions: the same is the same, and what differs is told."""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

from lagrange_cli.cli.main import lagrange

ROOT = Path(__file__).resolve().parents[1]
SCENE = "systems/lecture/bead_on_parabola.yaml"


@pytest.fixture
def same_output(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The command as a module."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("same_output")


def in_git() -> bool:
    command = ["git", "-C", str(ROOT), "rev-parse", "--verify", "--quiet", "HEAD"]
    return shutil.which("git") is not None and not subprocess.run(command, check=False).returncode


def counts(printed: str) -> dict[str, list[int]]:
    """Rows of the printed table: compared, refused, differing."""
    rows = re.findall(r"^\| ([a-z ]+) \| (\d+) \| (\d+) \| (\d+) \|$", printed, re.MULTILINE)
    return {kind: [int(n) for n in numbers] for kind, *numbers in rows}


def keep_kinds(same_output, monkeypatch, kinds: tuple[str, ...]) -> None:
    """Let the comparison ask for some kinds of output alone."""
    every_command = same_output.commands

    def some_commands(*words, **options):
        asked = every_command(*words, **options)
        return [command for command in asked if same_output.kind_of(command) in kinds]

    monkeypatch.setattr(same_output, "commands", some_commands)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kinds",
    [("emit c", "simulate"), pytest.param((), marks=pytest.mark.campaign)],
    ids=["some", "all"],
)
def test_a_version_has_the_same_output_as_itself(same_output, monkeypatch, capsys, kinds) -> None:
    """Two folders, as two commits would be: nothing differs, and all was run."""
    if kinds:
        keep_kinds(same_output, monkeypatch, kinds)
    words = ["--scenes", SCENE.removeprefix("systems/"), "--until", "1", "-j", "2"]
    assert same_output.main([str(ROOT), str(ROOT), *words]) == 0
    table = counts(capsys.readouterr().out)
    assert table["simulate"] == [1, 0, 0]
    # Canonical equations in multiplier form are refused.
    assert table["emit c"] == [38, 6, 0]
    if not kinds:
        # Routh's form is refused: no coordinate is cyclic.
        assert table["derive text"] == [40, 4, 0]
    assert table["all"][0] == len(same_output.commands(SCENE, simulate=True, until=None))


@pytest.mark.skipif(not in_git(), reason="this is no clone")
def test_a_commit_is_unpacked(same_output, tmp_path) -> None:
    folder = same_output.checkout("HEAD", tmp_path / "before")
    assert (folder / "lagrange_cli" / "__main__.py").is_file()
    with pytest.raises(SystemExit, match="no folder and no commit"):
        same_output.checkout("no-such-commit", tmp_path / "none")


@pytest.mark.slow
def test_a_difference_is_shown_counted_and_kept(same_output, monkeypatch, capsys, tmp_path) -> None:
    """A heading that one side words differently: texts and pages in English have it, no code."""
    keep_kinds(same_output, monkeypatch, ("derive text", "emit python"))
    other = tmp_path / "other"
    shutil.copytree(ROOT / "lagrange_cli", other / "lagrange_cli")
    heading, planted = '"Degrees of freedom', '"Degrees of boredom'
    # The catalogues of other languages have it as a key.
    sources = [p for p in other.rglob("*") if p.suffix in (".py", ".yaml")]
    changed = [p for p in sources if heading in p.read_text(encoding="utf-8")]
    assert changed
    for path in changed:
        text = path.read_text(encoding="utf-8").replace(heading, planted)
        path.write_text(text, encoding="utf-8")
    kept = tmp_path / "kept"
    words = ["--scenes", "lecture/bead_on_parabola.yaml", "--no-simulate", "--keep", str(kept)]
    assert same_output.main([str(ROOT), str(other), *words]) == 1
    printed = capsys.readouterr().out
    table = counts(printed)
    compared, refused, differing = table["derive text"]
    in_other_languages = 4
    assert differing == compared - refused - in_other_languages
    assert table["emit python"][2] == 0
    assert table["all"][2] == sum(row[2] for kind, row in table.items() if kind != "all")
    assert "    -Degrees of freedom" in printed
    sides = {suffix: sorted(kept.glob(f"*.{suffix}")) for suffix in ("before", "after")}
    assert len(sides["before"]) == len(sides["after"]) == table["all"][2]
    assert "Degrees of boredom" in sides["after"][0].read_text(encoding="utf-8")


def test_seconds_are_left_out_and_nothing_else(same_output) -> None:
    words = ["simulate", SCENE, "--json"]
    sides = [
        {"exit code": "0", "standard output": f'{{"seconds": {{"derive": {s}}}, "steps": 12}}'}
        for s in (0.1, 0.2)
    ]
    assert list(same_output.compared(words, *sides)) == []
    other = {**sides[1], "standard output": '{"seconds": {}, "steps": 13}'}
    (difference,) = same_output.compared(words, sides[0], other)
    assert difference.output == "standard output"


@pytest.mark.slow
def test_a_process_that_dies_is_a_difference(same_output, tmp_path) -> None:
    nowhere = tmp_path / "no checkout"
    comparison = same_output.Comparison(nowhere, nowhere, tmp_path)
    comparison.scene(SCENE, [["derive", SCENE]])
    comparison.close()
    (difference,) = comparison.tally.differences
    assert difference.output == "process"
    assert difference.before is not None


@pytest.mark.parametrize("subcommand", ["derive", "emit"])
def test_every_choice_of_every_option_is_compared(same_output, subcommand) -> None:
    """A format or an option that is added later must be added to the comparison too."""
    shown = CliRunner().invoke(lagrange, [subcommand, "--help"]).output
    declared = re.findall(r"^  (?:-\w, )?(--[a-z-]+)(?: +\[([a-z|-]+)\])?", shown, re.MULTILINE)
    commands = same_output.commands(SCENE, simulate=False, until=None)
    asked = [[*words, ""] for words in commands if words[0] == subcommand]
    elsewhere = {"--json", "--digits", "--parameter", "--list"}
    common = {"--output", "--strict", "--quiet", "--verbose", "--traceback", "--help"}
    for option, choices in declared:
        if option in elsewhere | common:
            continue
        values = {words[words.index(option) + 1] for words in asked if option in words}
        assert values, f"{option} is not compared"
        assert set(filter(None, choices.split("|"))) <= values, option
