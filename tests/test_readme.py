"""Every block of README.md and of the pages of docs/ is run, and what it shows is compared.

The blocks of a page are one session, from the first to the last, in a folder of its own that holds
``systems`` and an empty ``out``. A comment above a block says what it is:

``<!-- file: PATH -->``
    The block is this file of the repository.
``<!-- write: NAME -->``
    The reader writes this file; later blocks of the page use it.
``<!-- append: NAME -->``
    The reader adds this to the end of a file.
``<!-- picture: NAME -->``, ``<!-- picture: NAME.pdf PAGE -->``
    An earlier command of the page wrote this file; the image below is a copy of it or of one page.
``<!-- command -->``
    One of the two commands of README.md that CI runs.
``<!-- set up -->``
    Part of the first of them.

``python -m tests.test_readme [PAGE...]`` writes what the commands print now into the pages, and the
pictures beside them; look at the difference before you commit it. A line ``...`` in an expected
output stands for any lines.
"""

from __future__ import annotations

import doctest
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.cli.terminal import lagrange

ROOT = Path(__file__).resolve().parents[1]
README = "README.md"
PAGES = (
    README,
    *(f"docs/{name}.md" for name in ("tutorial", "lecturers", "engineers")),
    *(f"docs/{name}.md" for name in ("accuracy", "analysis", "mechanics", "path")),
    *(f"docs/{name}.md" for name in ("command-line", "fmi", "output", "scene-language")),
)
BLOCK = re.compile(r"(?:<!-- (?P<note>[^\n]*) -->\n)?```(?P<kind>\w+)\n(?P<body>.*?)```", re.DOTALL)
PICTURE = re.compile(
    r"<!-- picture: (?P<name>\S+)(?: (?P<page>\d+))? -->\n!\[[^\]]*\]\((?P<path>[^)]+)\)"
)

#: A call of ``lagrange``, which is run in this process, and where its output goes.
LAGRANGE = re.compile(
    r"lagrange (?P<words>(?:'[^']*'|\"[^\"]*\"|[^'\"|<>])*)(?P<rest>.*)", re.DOTALL
)

#: Programs that blocks call, each of which a machine may lack.
PROGRAMS = ("gcc", "pdflatex")


@dataclass(frozen=True)
class Block:
    """A fenced block with the comment before it, and the number of its line."""

    kind: str
    note: str
    body: str
    line: int


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str, *kinds: str) -> list[Block]:
    text = text_of(page)
    listed = [
        Block(m["kind"], m["note"] or "", m["body"], text.count("\n", 0, m.start()) + 1)
        for m in BLOCK.finditer(text)
    ]
    return [block for block in listed if not kinds or block.kind in kinds]


def commands(body: str) -> list[tuple[str, str]]:
    """Each command of a console block with the output shown for it."""
    parts = re.split(r"^\$ (.*(?:\\\n.*)*)\n", body, flags=re.MULTILINE)[1:]
    return list(zip(parts[::2], parts[1::2], strict=True))


def run_console(lines: list[str], folder: Path) -> list[str]:
    """Run the commands one after the other and return what each printed, errors included."""
    printed, code = list[str](), 0
    for line in lines:
        called = LAGRANGE.fullmatch(line)
        if called is None:
            output, code = run_shell(f"(exit {code}); {line}", folder)
        else:
            done = lagrange(*shlex.split(called["words"]), cwd=folder)
            output, code = done.stdout, done.returncode
            if called["rest"]:
                output, code = run_shell(f"cat {called['rest']}", folder, output)
            output += done.stderr
        printed.append(output.lstrip("\n"))
    return printed


def run_shell(line: str, folder: Path, input: str = "") -> tuple[str, int]:
    """Run a line in a shell; return what it printed, errors included, and its exit code."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-c", line],
        cwd=folder,
        env=os.environ | {"PATH": path, "PYTHONIOENCODING": "utf-8"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        input=input,
        encoding="utf-8",
        timeout=300,
    )
    return done.stdout, done.returncode


def settled(text: str) -> str:
    """A text without what differs between machines: times, rounding errors, last digits.

    The first picture in a new cache also says that matplotlib collects its fonts.
    """
    text = re.sub(r"Matplotlib is building the font cache.*\n", "", text)
    text = re.sub(r"\(\d+\.\d+ s\)", "(SECONDS)", text)
    measured = (
        r"(?:mismatch|Abweichung)\s\S+|± \de-1\d|\S+ estimated|drift \S+|\d+ steps|\d+ evaluations"
    )
    text = re.sub(rf"{measured}|\b\d\.\de-1[3-9]\b", "MEASURED", text)
    return re.sub(r"-?\d+\.\d{10,}", lambda number: f"{float(number[0]):.8g}", text)


def matches(shown: str, printed: str) -> bool:
    checker = doctest.OutputChecker()
    return checker.check_output(settled(shown), settled(printed), doctest.ELLIPSIS)


def clone(folder: Path) -> Path:
    """Make a folder that looks like a clone, in which the blocks may write."""
    shutil.copytree(ROOT / "systems", folder / "systems")
    (folder / "out").mkdir()
    return folder


def lacks_program(block: Block) -> bool:
    """Tell whether a block calls a program that is not installed, which CI must have."""
    missing = [p for p in PROGRAMS if re.search(rf"\b{p} ", block.body) and not shutil.which(p)]
    assert not missing or os.environ.get("CI") != "true", f"CI must have {missing}"
    return bool(missing)


def printed_by(block: Block, folder: Path) -> list[tuple[str, str, str]]:
    """Each command of a console block, the output shown for it, and what it prints."""
    wanted = commands(block.body)
    printed = run_console([command for command, _ in wanted], folder)
    assert len(printed) == len(wanted), f"line {block.line}: {printed}"
    return [(*pair, output) for pair, output in zip(wanted, printed, strict=True)]


def is_written(note: str, body: str, folder: Path) -> bool:
    """Write the file of a block that the reader writes; tell whether it is one."""
    action, _, name = note.partition(": ")
    if action in ("write", "append"):
        with (folder / name).open("w" if action == "write" else "a", encoding="utf-8") as file:
            file.write(body)
    return action in ("write", "append")


def differences(page: str, folder: Path) -> Iterator[str]:
    """Run the blocks of a page, and yield what is not as it is shown."""
    for block in blocks(page):
        here = f"{page}, line {block.line}"
        if is_written(block.note, block.body, folder):
            continue
        if block.note.startswith("file: "):
            if block.body != text_of(block.note.removeprefix("file: ")):
                yield f"{here} is not the file that it names"
        elif block.kind == "console" and not lacks_program(block):
            for command, shown, printed in printed_by(block, folder):
                if not matches(shown, printed):
                    yield f"{here}: $ {command}\nshown:\n{shown}\nprinted:\n{printed}"
        elif block.kind == "python" and ">>>" in block.body:
            yield from failed_examples(block, here, folder)


def failed_examples(block: Block, here: str, folder: Path) -> Iterator[str]:
    """Run the examples of a block of Python, and yield those that give something else."""
    test = doctest.DocTestParser().get_doctest(block.body, {}, here, here, block.line)
    lines: list[str] = []
    before = Path.cwd()
    os.chdir(folder)
    try:
        doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=lines.append)
    finally:
        os.chdir(before)
    if lines:
        yield "".join(lines)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.latex
@pytest.mark.usefixtures("frozen_garbage")
@pytest.mark.parametrize("page", PAGES)
def test_every_block_gives_what_it_shows(page, tmp_path):
    assert list(differences(page, clone(tmp_path))) == []
    for picture in PICTURE.finditer(text_of(page)):
        if not picture["name"].endswith(".pdf") or shutil.which("pdflatex"):
            assert (tmp_path / picture["name"]).stat().st_size > 1000


def test_every_block_is_of_a_kind_that_is_tested():
    assert {block.kind for block in blocks(README)} == {"yaml", "console", "sh", "python"}
    assert len(blocks(README, "console")) >= 4
    for page in ("docs/tutorial.md", "docs/lecturers.md", "docs/engineers.md"):
        for block in blocks(page):
            noted = block.note.startswith(("write: ", "append: ", "file: ", "set up"))
            assert noted or block.kind == "console" or ">>>" in block.body, (page, block.line)


def test_the_two_commands():
    listed = blocks(README, "sh")
    assert [block.note for block in listed] == ["command", "command"]
    assert all(block.body.count("\n") == 1 for block in listed)


@pytest.mark.parametrize("page", PAGES)
def test_set_up_is_that_of_the_first_command(page):
    for block in blocks(page, "sh"):
        if block.note == "set up":
            for line in block.body.splitlines():
                assert line.replace("'.[plot]'", ".") in blocks(README, "sh")[0].body


@pytest.mark.slow
def test_first_command_ends_with_equations_and_a_simulated_result(tmp_path):
    """The part after the installation, which CI runs as a whole."""
    _, _, *words = blocks(README, "sh")[0].body.strip().split(" && ")
    assert len(words) == 2
    plain = [word.removeprefix(".venv/bin/") for word in words]
    derived, simulated = run_console(plain, clone(tmp_path))
    assert "Equations of motion" in derived
    assert "t = 10" in simulated


def test_readme_is_short():
    assert len(text_of(README).splitlines()) <= 200


@pytest.mark.parametrize(
    "page", [README, *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").rglob("*.md"))]
)
def test_links_lead_somewhere(page):
    """Files and headings that a page links to exist."""
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(text_of(page))):
        if "://" not in target:
            path, _, place = target.partition("#")
            linked = ((ROOT / page).parent / path).resolve() if path else ROOT / page
            assert linked.exists(), target
            assert not place or place in anchors(linked.read_text(encoding="utf-8")), target


def prose(text: str) -> str:
    """A page without its blocks."""
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def anchors(text: str) -> set[str]:
    """The anchors that GitHub makes of the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", prose(text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def updated(page: str, folder: Path) -> str:
    """Return a page with what its commands print now, where that is not what it shows."""

    def replaced(match: re.Match[str]) -> str:
        note, body = match["note"] or "", match["body"]
        if note.startswith("file: "):
            body = text_of(note.removeprefix("file: "))
        elif not is_written(note, body, folder) and match["kind"] == "console":
            body = "".join(
                f"$ {command}\n{shown if matches(shown, printed) else printed}"
                for command, shown, printed in printed_by(Block("console", "", body, 0), folder)
            )
            body = body if body.endswith("\n") else body + "\n"
        start, end = (at - match.start() for at in match.span("body"))
        return match[0][:start] + body + match[0][end:]

    text = BLOCK.sub(replaced, text_of(page))
    for picture in PICTURE.finditer(text):
        written, shown = folder / picture["name"], (ROOT / page).parent / picture["path"]
        if written.suffix == ".pdf":
            number = picture["page"] or "1"
            words = ["pdftoppm", "-png", "-singlefile", "-gray", "-r", "75", "-f", number]
            subprocess.run([*words, written, shown.with_suffix("")], check=True)
        else:
            shutil.copy(written, shown)
    return text


if __name__ == "__main__":
    for page_ in sys.argv[1:] or PAGES:
        with tempfile.TemporaryDirectory() as name_:
            new = updated(page_, clone(Path(name_)))
            (ROOT / page_).write_text(new, encoding="utf-8")
