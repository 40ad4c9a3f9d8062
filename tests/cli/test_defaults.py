"""Defaults of a folder hold below it, are weaker than options, and are refused with their place."""

from __future__ import annotations

import json
import os

import pytest

from tests.cli.terminal import lagrange

FREE = "particles: {b: {mass: 1, position: [x, 0, 0]}}\ncoordinates: [x]\n"


@pytest.fixture
def folder(tmp_path, cache_folder):
    (tmp_path / "drafts").mkdir()
    for path in ("a.yaml", "drafts/b.yaml"):
        (tmp_path / path).write_text(FREE)
    return tmp_path


def test_without_a_file_nothing_is_set(folder):
    done = lagrange("config", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[1:] == [
        f"# {k}: not set" for k in ("accuracy", "format", "language", "exclude", "jobs")
    ]


def test_the_nearest_file_counts_alone(folder):
    (folder / "lagrange.toml").write_text('language = "de"\n')
    (folder / "drafts" / "pyproject.toml").write_text('[project]\nname = "lagrange"\n')
    inner = folder / "drafts" / "inner"
    inner.mkdir()
    shown = lagrange("config", cwd=inner).stdout.splitlines()
    assert shown[0].replace("\\", "/") == "# ../../lagrange.toml"
    assert shown[3] == 'language = "de"'
    (folder / "drafts" / "pyproject.toml").write_text("[tool.lagrange]\njobs = 2\n")
    shown = lagrange("config", cwd=inner).stdout.splitlines()
    assert shown[3:] == ["# language: not set", "# exclude: not set", "jobs = 2"]


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("[tool.other]\njob = 1\n[tool.lagrange]\njob = 2\n", "4:1", "there is no default 'job'"),
        ("[tool]\nlagrange.jobs = true\n", "2:10", "'jobs' is a number from 1 to 4096; found True"),
        ("[tool.lagrange]\njobs = 0\n", "2:1", "'jobs' is a number"),
        (
            '[tool.lagrange]\nlanguage = "xx"\n',
            "2:1",
            "'language' is one of en, de, fr; found 'xx'",
        ),
        ("[tool.lagrange]\nlanguage = ['de']\n", "2:1", "'language' is one of"),
        ('[tool.lagrange]\nexclude = "drafts"\n', "2:1", "'exclude' is a list of patterns"),
        ("[tool.lagrange]\naccuracy = 2\n", "2:1", "'accuracy' is a number between 0 and 1, as"),
        ("[tool.lagrange]\nformat = 'c'\n", "2:1", "'format' is one of text, latex, markdown"),
        ("[tool.lagrange]\njobs =\n", "2:7", "not valid TOML"),
        ("tool.lagrange = 3\n", "1:6", "'tool.lagrange' is a table"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(folder, text, place, message):
    (folder / "pyproject.toml").write_text(text)
    for words in (["config"], ["check", "a.yaml"]):
        done = lagrange(*words, cwd=folder)
        assert done.returncode == 2
        assert done.stderr.startswith(f"pyproject.toml:{place}: {message}")


def test_patterns_leave_scenes_out_unless_others_are_given(folder):
    (folder / "lagrange.toml").write_text('exclude = ["drafts"]\njobs = 1\n')
    assert "1 scene: 1 pass" in lagrange("check", ".", cwd=folder).stdout
    assert "2 scenes: 2 pass" in lagrange("check", ".", "--exclude", "x", cwd=folder).stdout
    (folder / "drafts" / "b.yaml").write_text(FREE.replace("[x, 0", "[ x,0"))
    assert lagrange("fmt", ".", "--check", cwd=folder).returncode == 0
    assert lagrange("fmt", ".", "--check", "--exclude", "x", cwd=folder).returncode == 1


def test_a_default_language_is_of_words_alone(folder):
    english = lagrange("check", "a.yaml", cwd=folder).stdout
    (folder / "lagrange.toml").write_text('language = "de"\n')
    assert lagrange("check", "a.yaml", cwd=folder).stdout != english
    assert lagrange("check", "a.yaml", "--language", "en", cwd=folder).returncode == 0
    done = lagrange("check", "a.yaml", "--json", cwd=folder)
    assert json.loads(done.stdout)["summary"]["pass"] == 1
    for words in (["derive"], ["derive", "--format", "json"], ["emit", "--to", "python"]):
        done = lagrange(words[0], "a.yaml", *words[1:], cwd=folder)
        assert (done.returncode, done.stderr) == (0, "")
    german = lagrange("derive", "a.yaml", cwd=folder).stdout
    assert "Freiheitsgrade" in german
    assert (
        "Freiheitsgrade" not in lagrange("derive", "a.yaml", "--language", "en", cwd=folder).stdout
    )


def requested(folder, *words):
    start = ["-i", "x=0", "-i", "dot(x)=1"]
    done = lagrange("simulate", "a.yaml", *start, "--json", *words, cwd=folder)
    return json.loads(done.stdout)["accuracy"]["requested"]


def test_a_default_accuracy_is_weaker_than_options_and_scenes(folder):
    words = ["--until", "1"]
    assert requested(folder, *words) == 1e-6
    (folder / "lagrange.toml").write_text("accuracy = 1e-8\n")
    assert "accuracy = 1e-08" in lagrange("config", cwd=folder).stdout
    assert requested(folder, *words) == 1e-8
    assert requested(folder, *words, "--accuracy", "1e-7") == 1e-7
    assert requested(folder, *words, "--method", "DOP853", "--rtol", "1e-3") is None
    (folder / "a.yaml").write_text(FREE + "simulate: {until: 1, accuracy: 1e-4}\n")
    assert requested(folder) == 1e-4
    (folder / "a.yaml").write_text(FREE + "simulate: {until: 1, method: DOP853, rtol: 1e-4}\n")
    assert requested(folder) is None
    (folder / "a.yaml").write_text(FREE + "simulate: {until: -1}\n")
    done = lagrange("simulate", "a.yaml", "-i", "x=0", "-i", "dot(x)=1", cwd=folder)
    assert done.stderr.startswith("a.yaml:3:")


def test_a_default_format_is_weaker_than_an_ending(folder):
    (folder / "lagrange.toml").write_text('format = "json"\n')
    for words in (["derive", "a.yaml"], ["check", "a.yaml"], ["cache"], ["analyze", "a.yaml"]):
        assert json.loads(lagrange(*words, cwd=folder).stdout)
    text = lagrange("check", "a.yaml", "--format", "text", cwd=folder).stdout
    assert text.endswith("1 scene: 1 pass\n")
    for command in ("derive", "check"):
        lagrange(command, "a.yaml", "-o", "a.tex", cwd=folder)
        assert "\\documentclass" in (folder / "a.tex").read_text()
        (folder / "a.tex").unlink()


def test_default_jobs_are_of_this_machine(folder):
    (folder / "lagrange.toml").write_text("jobs = 2\n")
    done = lagrange("check", ".", "--on", "tcp://127.0.0.1:9", cwd=folder)
    assert "--jobs" not in done.stderr
    assert "2 scenes: 2 pass" in lagrange("check", ".", cwd=folder).stdout


def test_folders_that_may_not_be_searched_have_no_defaults(folder, monkeypatch):
    (folder / "lagrange.toml").write_text("jobs = 2\n")
    stat = os.stat

    def refusing(path, *further, **named):
        if str(path).endswith(".toml"):
            raise PermissionError(13, "Permission denied")
        return stat(path, *further, **named)

    monkeypatch.setattr(os, "stat", refusing)
    assert "# jobs: not set" in lagrange("config", cwd=folder).stdout
