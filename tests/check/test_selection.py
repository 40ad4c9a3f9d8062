"""Scenes are chosen by text, pattern, revision and the last run, and no other is checked."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from lagrange_cli.cache import open_cache
from lagrange_cli.check import Selection, note_outcomes, scenes_in
from lagrange_cli.check.model import Report, SceneReport
from lagrange_cli.errors import InputError
from tests.cli.terminal import lagrange

FREE = "particles: {b: {mass: 1, position: [x, 0, 0]}}\n"
DRIVEN = """\
particles: {p: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
inputs: {F: {file: f.csv, column: F, interpolation: linear}}
forces: {push: {on: p, force: [F, 0, 0]}}
"""
PATHS = ["a/free.yaml", "a/driven.yaml", "b/Free.yaml", "old/free.yaml"]


@pytest.fixture
def folder(tmp_path, monkeypatch, cache_folder):
    for path in PATHS:
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(DRIVEN if "driven" in path else FREE)
    (tmp_path / "a" / "f.csv").write_text("t,F\n0,1\n2,1\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def chosen(selection: Selection) -> list[str]:
    return selection.selected(scenes_in(["."]), open_cache())


@pytest.mark.parametrize(
    ("selection", "expected"),
    [
        (Selection(), ["a/driven.yaml", "a/free.yaml", "b/Free.yaml", "old/free.yaml"]),
        (Selection("FREE"), ["a/free.yaml", "b/Free.yaml", "old/free.yaml"]),
        (Selection("a/"), ["a/driven.yaml", "a/free.yaml"]),
        (Selection(excluded=("old",)), ["a/driven.yaml", "a/free.yaml", "b/Free.yaml"]),
        (Selection(excluded=("a/*", "b/")), ["old/free.yaml"]),
        (Selection(excluded=("*ree.yaml",)), ["a/driven.yaml"]),
        (Selection("free", ("*",)), []),
    ],
)
def test_text_and_patterns(folder, selection, expected):
    assert [os.path.normpath(path) for path in chosen(selection)] == expected


def test_a_text_that_no_path_holds_is_refused(folder):
    done = lagrange("check", ".", "-k", "fere", cwd=folder)
    assert done.returncode == 2
    assert "no path of a scene holds 'fere'" in done.stderr


def test_the_last_run_is_remembered(folder):
    with pytest.raises(InputError, match="no check from this folder is known"):
        chosen(Selection(failed=True))
    note_outcomes(
        Report((SceneReport("a/free.yaml", "fail", 0), SceneReport("old/free.yaml", "crash", 0))),
        open_cache(),
    )
    # The other one was not checked again, and stays.
    note_outcomes(Report((SceneReport("./a/../a/free.yaml", "pass", 0),)), open_cache())
    assert chosen(Selection(failed=True)) == ["./old/free.yaml"]
    (folder / "old" / "free.yaml").unlink()
    note_outcomes(Report((SceneReport("b/Free.yaml", "pass", 0),)), open_cache())
    assert chosen(Selection(failed=True)) == []
    done = lagrange("check", ".", "--only-failed", cwd=folder)
    assert (done.returncode, done.stdout) == (0, "0 scenes: nothing to check\n")


def git(folder: Path, *words: str) -> None:
    names = ("-c", "user.name=A", "-c", "user.email=a@b.c", "-c", "init.defaultBranch=main")
    subprocess.run(["git", *names, *words], cwd=folder, check=True, capture_output=True)


def test_scenes_and_the_files_that_they_read_are_compared_with_a_revision(folder):
    git(folder, "init")
    git(folder, "add", ".")
    git(folder, "commit", "-m", "first")
    since = Selection(changed_since="HEAD")
    assert chosen(since) == []
    (folder / "a" / "f.csv").write_text("t,F\n0,2\n2,1\n")
    assert chosen(since) == ["./a/driven.yaml"]
    (folder / "new.yaml").write_text(FREE)
    (folder / "b" / "Free.yaml").write_text(FREE + "# changed\n")
    assert chosen(since) == ["./new.yaml", "./a/driven.yaml", "./b/Free.yaml"]
    git(folder, "add", ".")
    git(folder, "commit", "-m", "second")
    assert chosen(since) == []
    assert len(chosen(Selection(changed_since="HEAD~1"))) == 3
    assert len(chosen(Selection("b/", changed_since="HEAD~1"))) == 1


@pytest.mark.parametrize("revision", ["nowhere", "--output=stolen", "HEAD:a"])
def test_revisions_that_there_are_not(folder, revision):
    git(folder, "init")
    git(folder, "add", ".")
    git(folder, "commit", "-m", "first")
    done = lagrange("check", ".", f"--changed-since={revision}", cwd=folder)
    assert done.returncode == 2
    assert f"'{revision}' is no revision of the repository" in done.stderr
    assert not (folder / "stolen").exists()


def test_without_a_repository_or_git(folder, monkeypatch):
    with pytest.raises(InputError, match="is in no git repository"):
        chosen(Selection(changed_since="HEAD"))
    git(folder, "init")
    monkeypatch.setenv("PATH", str(folder))
    with pytest.raises(InputError, match="git cannot be run"):
        chosen(Selection(changed_since="HEAD"))
