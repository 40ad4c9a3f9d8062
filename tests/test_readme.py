"""Every block of README.md is run, and what it shows is compared.

``python tests/test_readme.py`` writes what the commands print now into
README.md; look at the difference before you commit it. A line ``...`` in an
expected output stands for any lines.
"""

from __future__ import annotations

import doctest
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
BLOCK = re.compile(r"(?:<!-- (?P<note>[^\n]*) -->\n)?```(?P<kind>\w+)\n(?P<body>.*?)```", re.DOTALL)
SEPARATOR = "=== end of command ==="


@dataclass(frozen=True)
class Block:
    """A fenced block with the comment before it, and the number of its line."""

    kind: str
    note: str
    body: str
    line: int


def blocks(*kinds: str) -> list[Block]:
    text = README.read_text(encoding="utf-8")
    found = [
        Block(m["kind"], m["note"] or "", m["body"], text.count("\n", 0, m.start()) + 1)
        for m in BLOCK.finditer(text)
    ]
    return [block for block in found if not kinds or block.kind in kinds]


def commands(body: str) -> list[tuple[str, str]]:
    """Each command of a console block with the output shown for it."""
    parts = re.split(r"^\$ (.*)\n", body, flags=re.MULTILINE)[1:]
    return list(zip(parts[::2], parts[1::2], strict=True))


def run_console(words: list[str], folder: Path) -> list[str]:
    """Run the commands in one shell and return what each printed, errors included."""
    script = "\n".join(f"{word}\n(s=$?; echo; echo '{SEPARATOR}'; exit $s)" for word in words)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=folder,
        env={name: value for name, value in os.environ.items() if name != "COLUMNS"}
        | {"PATH": path, "PYTHONIOENCODING": "utf-8"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        encoding="utf-8",
        timeout=300,
    )
    return [part.lstrip("\n") for part in done.stdout.split(f"\n{SEPARATOR}\n")[:-1]]


def settled(text: str) -> str:
    """A text without what differs between machines: times, rounding errors, last digits."""
    text = re.sub(r"\(\d+\.\d+ s\)", "(SECONDS)", text)
    measured = r"mismatch \S+|\S+ estimated|drift \S+|\d+ steps|\d+ evaluations"
    text = re.sub(measured, "MEASURED", text)
    return re.sub(r"-?\d+\.\d{10,}", lambda number: f"{float(number[0]):.8g}", text)


def matches(shown: str, printed: str) -> bool:
    checker = doctest.OutputChecker()
    return checker.check_output(settled(shown), settled(printed), doctest.ELLIPSIS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder that looks like a clone, in which the blocks may write."""
    path = tmp_path_factory.mktemp("clone")
    shutil.copytree(ROOT / "systems", path / "systems")
    (path / "out").mkdir()
    return path


def test_every_block_is_of_a_kind_that_is_tested():
    assert {block.kind for block in blocks()} == {"yaml", "console", "sh", "python"}
    assert len(blocks("console")) >= 6


@pytest.mark.parametrize("block", blocks("yaml"), ids=lambda block: f"line {block.line}")
def test_scene_is_the_file_that_it_names(block):
    path = ROOT / block.note.removeprefix("file: ")
    assert block.body == path.read_text(encoding="utf-8")


def test_the_two_commands():
    found = blocks("sh")
    assert [block.note for block in found] == ["command", "command"]
    assert all(block.body.count("\n") == 1 for block in found)


@pytest.mark.slow
def test_first_command_ends_with_equations_and_a_simulated_result(folder):
    """The part after the installation, which CI runs as a whole."""
    _, _, *words = blocks("sh")[0].body.strip().split(" && ")
    assert len(words) == 2
    derived, simulated = run_console([w.removeprefix(".venv/bin/") for w in words], folder)
    assert "Equations of motion" in derived
    assert "t = 10" in simulated


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("block", blocks("console"), ids=lambda block: f"line {block.line}")
def test_console(block, folder):
    if "gcc" in block.body and shutil.which("gcc") is None:
        assert os.environ.get("CI") != "true", "CI must have gcc"
        pytest.skip("gcc is not installed")
    wanted = commands(block.body)
    printed = run_console([command for command, _ in wanted], folder)
    assert len(printed) == len(wanted)
    for (command, shown), found in zip(wanted, printed, strict=True):
        assert matches(shown, found), f"$ {command}\nshown:\n{shown}\nprinted:\n{found}"


@pytest.mark.parametrize("block", blocks("python"), ids=lambda block: f"line {block.line}")
def test_python(block, folder, monkeypatch):
    monkeypatch.chdir(folder)
    test = doctest.DocTestParser().get_doctest(block.body, {}, "README.md", "README.md", block.line)
    assert test.examples
    outcome = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test)
    assert outcome.failed == 0


def test_links_lead_somewhere():
    targets = re.findall(r"\]\(([^)#]+)", README.read_text(encoding="utf-8"))
    assert targets
    assert [t for t in targets if "://" not in t and not (ROOT / t).exists()] == []


def _updated(match: re.Match[str], folder: Path) -> str:
    """A block with what its commands print now, where that is not what it shows."""
    note, body = match["note"] or "", match["body"]
    if note.startswith("file: "):
        body = (ROOT / note.removeprefix("file: ")).read_text(encoding="utf-8")
    elif match["kind"] == "console":
        wanted = commands(body)
        printed = run_console([command for command, _ in wanted], folder)
        body = "".join(
            f"$ {command}\n{shown if matches(shown, found) else found}"
            for (command, shown), found in zip(wanted, printed, strict=True)
        )
    start, end = (at - match.start() for at in match.span("body"))
    return match[0][:start] + body + match[0][end:]


def update() -> None:
    """Write what the commands print into README.md."""
    import tempfile

    with tempfile.TemporaryDirectory() as name:
        shutil.copytree(ROOT / "systems", Path(name) / "systems")
        (Path(name) / "out").mkdir()
        text = README.read_text(encoding="utf-8")
        README.write_text(BLOCK.sub(lambda m: _updated(m, Path(name)), text), encoding="utf-8")


if __name__ == "__main__":
    update()
