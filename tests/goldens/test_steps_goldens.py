"""Steps of scenes, character by character as they were read and approved.

Updated as the other goldens are.
"""

from __future__ import annotations

import importlib
import json
import re
import shutil
from pathlib import Path

import pytest

from lagrange_cli.cli.main import run

HERE = Path(__file__).resolve().parent
STEPS = HERE / "steps"
SYSTEMS = HERE.parents[1] / "systems"
PAGES = HERE.parents[1] / "docs" / "steps"

#: Name of a folder → scene and options.
GOLDENS = {
    "bead_on_parabola": ("lecture/bead_on_parabola.yaml",),
    "bead_on_parabola_by_dalembert": ("lecture/bead_on_parabola.yaml", "--by", "dalembert"),
    "masses_through_hole": ("lecture/masses_through_hole.yaml",),
    "pendulum_with_force": ("lecture/pendulum_with_force.yaml", "--forces"),
    "pendulum_with_force_by_dalembert": (
        "lecture/pendulum_with_force.yaml",
        "--by",
        "dalembert",
        "--forces",
        "--ascii",
    ),
    "lever_by_virtual_work": ("lecture/lever.yaml", "--by", "virtual-work"),
    "bead_on_rotating_hoop": ("beads/bead_on_rotating_hoop.yaml",),
    "double_pendulum": ("pendulums/double_pendulum.yaml",),
    "wheel_down_incline": ("rolling/wheel_down_incline.yaml", "--forces"),
    "rolling_disk_by_dalembert": ("rolling/rolling_disk.yaml", "--by", "dalembert"),
}

#: Format → file.
FILES = {"text": "steps.txt", "latex": "steps.tex", "json": "steps.json"}


@pytest.mark.parametrize("name", GOLDENS)
@pytest.mark.parametrize("format_", ["text", "latex"])
def test_steps_are_those_that_were_approved(
    name: str, format_: str, updates: bool, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    compared(name, format_, updates, capsysbinary)


def test_steps_as_json(updates: bool, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    compared("masses_through_hole", "json", updates, capsysbinary)


@pytest.mark.slow
def test_pages_are_what_the_command_writes(updates: bool, tmp_path: Path) -> None:
    """The table of docs/steps lists the pages and the scenes that they are written from."""
    table = (PAGES / "README.md").read_text(encoding="utf-8")
    scene = r"\[`\w+`\]\(\.\./\.\./systems/([\w/]+\.yaml)\)"
    listed = re.findall(rf"\]\((\w+\.md)\)(?:, \[PDF\]\(\w+\.pdf\))? \| {scene}", table)
    written = {p.name for p in PAGES.iterdir() if p.suffix == ".md"}
    assert {name for name, _ in listed} | {"README.md"} == written
    folder = PAGES if updates else tmp_path
    for name, scene in listed:
        words = [
            "emit",
            str(SYSTEMS / scene),
            "--to",
            "markdown",
            "--steps",
            "-o",
            str(folder),
            "-q",
        ]
        assert run([*words, "-o", str(folder)]) == 0
        assert (folder / name).read_bytes() == (PAGES / name).read_bytes()


def test_pdfs_are_those_of_today(updates: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each says of which LaTeX it was made; ``python docs/steps/typeset.py`` makes them anew."""
    monkeypatch.syspath_prepend(PAGES)
    pages = importlib.import_module("typeset")
    listed = pages.listed()
    assert {f"{name}.pdf" for name in listed} == {path.name for path in PAGES.glob("*.pdf")}
    assert len(listed) == 5
    for name, scene in listed.items():
        if updates:
            pages.typeset(pages.source(scene), PAGES / f"{name}.pdf")
        made = (PAGES / f"{name}.pdf").read_bytes()
        assert f"/Subject ({pages.digest(pages.source(scene))})".encode() in made, name
        assert b"/ID" not in made
        assert b"Date" not in made


@pytest.mark.slow
@pytest.mark.latex
def test_a_pdf_is_the_same_each_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    monkeypatch.syspath_prepend(PAGES)
    pages = importlib.import_module("typeset")
    text = pages.source(pages.listed()["bead_on_parabola"])
    for name in ("one", "other"):
        pages.typeset(text, tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def compared(
    name: str, format_: str, updates: bool, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """Print the steps and compare them with the file, or write it."""
    scene, *options = GOLDENS[name]
    words = ["derive", str(SYSTEMS / scene), "--steps", "--format", format_, *options, "-q"]
    assert run(words) == 0
    printed = capsysbinary.readouterr()
    assert printed.err == b""
    text = printed.out.decode()
    if format_ == "json":
        text = json.dumps(json.loads(text)["steps"], indent=1) + "\n"
    path = STEPS / name / FILES[format_]
    if updates:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert without_noise(text) == without_noise(path.read_text(encoding="utf-8"))


def without_noise(text: str) -> str:
    """The text without the sizes of rounding errors, whose digits depend on the processor."""
    sizes = re.findall(r"mismatch (?:was )?\$?(?:\d \\times )?(?:10\^\{|\de)-(\d+)", text)
    assert sizes or text.startswith(("[", "{"))
    assert all(int(size) >= 50 for size in sizes), "arithmetic is in 50 digits or more"
    return re.sub(r"(mismatch (?:was )?)(\$[^$]*10\^\{-\d+\}\$|\de-\d+)", r"\1…", text)


def test_every_folder_of_steps_has_its_scene() -> None:
    assert {path.name for path in STEPS.iterdir()} == set(GOLDENS)
