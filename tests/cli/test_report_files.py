"""Files of reports: their ending says the format, beside what is printed."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from lagrange_cli.report.document_options import ENDINGS
from tests.cli.terminal import lagrange, succeed

ROOT = Path(__file__).resolve().parents[2]
BALL = str(ROOT / "systems" / "lecture" / "thrown_ball.yaml")
PENDULUM = str(ROOT / "systems" / "pendulums" / "pendulum.yaml")
PATHS = ("path", BALL, "--from", "x=0,z=0,t=0", "--to", "x=4,z=0,t=1", "--starts", "2")
LISTED = " or ".join(ENDINGS.values())


def printed(*words: str) -> str:
    return str(succeed(*words)).rstrip("\n")


@pytest.mark.parametrize("format_", ENDINGS)
def test_a_file_of_a_report_is_what_its_format_prints(format_, tmp_path):
    file = tmp_path / f"it{ENDINGS[format_].upper()}"
    language = () if format_ == "json" else ("--language", "de")
    shown = printed(*PATHS, *language, "-o", str(file))
    assert shown == printed(*PATHS, *language)
    written, whole = file.read_text(), printed(*PATHS, *language, "--format", format_)
    if format_ == "text":
        # Files have 80 columns, pipes lines of any length.
        written, whole = " ".join(written.split()), " ".join(whole.split())
    assert written.rstrip("\n") == whole


@pytest.mark.parametrize("command", ["tradeoff", "stress", "fit", "path"])
def test_other_endings_are_refused_before_the_scene_is_read(command, tmp_path):
    further = {"fit": ("data.csv", "--free", "l"), "path": ("--from", "t=0", "--to", "t=1")}
    words = [command, "missing.yaml", *further.get(command, ())]
    done: subprocess.CompletedProcess[str] = lagrange(*words, "-o", "report.pdf", cwd=tmp_path)
    assert done.returncode == 2
    assert f"'report.pdf' does not end in {LISTED}" in done.stderr
    assert not done.stdout


@pytest.mark.parametrize("command", ["derive", "analyze"])
def test_the_ending_chooses_the_format_unless_one_is_named(command, tmp_path):
    file = tmp_path / "it.md"
    assert not printed(command, PENDULUM, "-o", str(file))
    assert file.read_text().startswith("# Simple pendulum\n")
    assert printed(command, PENDULUM, "--format", "markdown") == file.read_text().rstrip("\n")


def test_a_derivation_is_written_into_any_file_in_the_format_that_is_named(tmp_path):
    for name in ("it.json", "it.dat"):
        assert not printed("derive", PENDULUM, "--format", "markdown", "-o", str(tmp_path / name))
        assert (tmp_path / name).read_text().startswith("# Simple pendulum\n")
    assert not printed("derive", PENDULUM, "-o", str(tmp_path / "it.JSON"))
    assert json.loads((tmp_path / "it.JSON").read_text())["name"] == "pendulum"
