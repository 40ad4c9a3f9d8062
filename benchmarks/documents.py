"""Documents of every shipped scene, given to the programs that typeset them.

    python benchmarks/documents.py
    python benchmarks/documents.py markdown --scenes 'pendulums/*'

Each scene is derived in few coordinates, with its constraints beside Cartesian names, and with its
steps both ways; each derivation is written in both forms, and in LaTeX in every style, in two
columns and in every language; so is the analysis of each scene. What a program refuses is listed,
and what sticks out of a LaTeX line or frame by more than 5 pt; the exit code is 1 where there is
anything. ``KEEP=FOLDER`` in the environment leaves the LaTeX documents and what pdfLaTeX made of
them.

Formulas of Markdown are rendered by KaTeX in strict mode, which needs node and, in this checkout,
``npm install --no-save katex``. Typst is compiled by PyPI's package ``typst``. HTML is checked
by the W3C's checker, which needs Java and ``npm install --no-save vnu-jar``.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from lagrange_cli import InputError, load
from lagrange_cli.report.document_options import SECTIONS

ROOT = Path(__file__).resolve().parents[1]
KATEX = Path(__file__).resolve().with_name("katex_strict.js")

#: Options of the derivations: formulation and way of the steps.
DERIVATIONS = (("auto", None), ("multiplier", None), ("auto", "lagrange"), ("auto", "dalembert"))
FORMS: tuple[dict[str, str], ...] = ({"form": "lagrange"}, {"form": "explicit"})

#: The W3C's checker of HTML.
CHECKER = ROOT / "node_modules" / "vnu-jar" / "build" / "dist" / "vnu.jar"

_ALL = ",".join(name for name in SECTIONS if name != "sketch")
_COLUMN = {"width": "column"}
_STEPS: tuple[dict[str, str], ...] = ({}, {"style": "beamer"}, {**_COLUMN, "language": "fr"})

#: Options of LaTeX documents of each derivation.
LATEX_OPTIONS: dict[tuple[str, str | None], tuple[dict[str, str], ...]] = {
    ("auto", None): (
        {"sections": _ALL},
        {"sections": _ALL, "style": "beamer"},
        {"sections": _ALL, **_COLUMN, "language": "de"},
        {"style": "snippet", **_COLUMN},
        {"form": "explicit"},
    ),
    ("multiplier", None): ({}, _COLUMN),
    ("auto", "lagrange"): _STEPS,
    ("auto", "dalembert"): _STEPS,
}

#: Options of LaTeX documents of its analysis.
LATEX_ANALYSES: tuple[dict[str, str], ...] = (
    {},
    {"style": "beamer", "language": "fr"},
    {**_COLUMN, "language": "de"},
    {"style": "snippet", **_COLUMN},
)

#: A displayed formula, or one within a line; what a backslash escapes is neither.
_FORMULA = re.compile(
    r"\\.|^\$\$\n(?P<shown>.*?)\n\$\$$|\$(?P<inline>(?:\\.|[^$\\])+)\$", re.M | re.S
)


@dataclass(frozen=True)
class Document:
    """A document of a scene; ``name`` says how it was written."""

    name: str
    text: str


@dataclass(frozen=True)
class Outcome:
    """What a program made of documents.

    Attributes
    ----------
    counted
        How much of what was read.
    failures
        A line for each document or formula that was refused.
    """

    counted: str
    failures: list[str]


def shipped(pattern: str = "*/*") -> list[Path]:
    """Scenes that are not there to be refused."""
    paths = sorted((ROOT / "systems").glob(f"{pattern}.yaml"))
    return [path for path in paths if path.parent.name != "refused"]


def documents(path: Path, to: str) -> Iterator[Document]:
    """All documents of a scene in a format.

    Scenes without constraints have no form with multipliers, and long derivations no steps.
    """
    for formulation, by in DERIVATIONS:
        try:
            derivation = load(path).derive(formulation=formulation, steps=by, forces=to == "latex")
        except InputError:
            if (formulation, by) == DERIVATIONS[0]:
                raise
            continue
        for options in LATEX_OPTIONS[formulation, by] if to == "latex" else FORMS:
            (text,) = derivation.emit(to, **options).values()
            shown = (v for k, v in options.items() if k != "sections")
            words = " ".join(filter(None, (formulation, by, *shown)))
            yield Document(f"{path.parent.name}/{path.stem} ({words})", text)
    analysis = load(path).derive().analyze()
    for options in LATEX_ANALYSES if to == "latex" else ({},):
        (text,) = analysis.emit(to, **options).values()
        words = " ".join(("analysis", *options.values()))
        yield Document(f"{path.parent.name}/{path.stem} ({words})", text)


def formulas(markdown: str) -> list[tuple[str, bool]]:
    """The formulas of a page of Markdown, each with whether it is displayed."""
    found = _FORMULA.finditer(markdown)
    pairs = ((m["shown"], m["inline"]) for m in found)
    return [(shown or inline, shown is not None) for shown, inline in pairs if shown or inline]


def has_katex() -> bool:
    """Tell whether node runs here and finds KaTeX."""
    if shutil.which("node") is None:
        return False
    command = ["node", "-e", "require.resolve('katex', {paths: [process.cwd()]})"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0


def refused_by_katex(pairs: Sequence[tuple[str, bool]]) -> list[tuple[int, str]]:
    """Return index and message of each formula that KaTeX refuses."""
    done = subprocess.run(
        ["node", KATEX], cwd=ROOT, input=json.dumps(pairs).encode(), capture_output=True, check=True
    )
    return [(index, message) for index, message in json.loads(done.stdout)]


def markdown(written: Sequence[Document]) -> Outcome:
    """Render every formula with KaTeX."""
    pairs = [(document, *pair) for document in written for pair in formulas(document.text)]
    refused = refused_by_katex([(formula, shown) for _, formula, shown in pairs])
    lines = [f"{pairs[index][0].name}: {message}" for index, message in refused]
    return Outcome(f"{len(pairs)} formulas", lines)


#: Points between the margins of a page.
_TEXT_WIDTH = 160 / 25.4 * 72

#: Added to a document: the widths of its displays in points.
_WIDTHS = """
#show math.equation.where(block: true): it => {
  it
  context [#metadata(measure(math.equation(math.display(it.body))).width.pt()) <width>]
}
"""


def displays_too_wide(document: str) -> list[float]:
    """Compile a document of Typst; return the widths in points of displays that do not fit."""
    import typst as compiler

    widths = compiler.query((_WIDTHS + document).encode(), "<width>", field="value", one=False)
    return [points for points in json.loads(widths) if points > _TEXT_WIDTH]


def typst(written: Sequence[Document]) -> Outcome:
    """Compile every document with Typst; displays must fit between the margins."""
    lines = []
    for document in written:
        try:
            wide = displays_too_wide(document.text)
        except RuntimeError as refusal:
            lines.append(f"{document.name}: {refusal}")
        else:
            lines += [f"{document.name}: a display of {points:.0f} points" for points in wide]
    return Outcome(f"{len(written)} documents", lines)


#: Points by which a line or a frame may stick out: less than a letter.
MOST = 5.0

_OVERFULL = re.compile(r"Overfull \\[hv]box \(([\d.]+)pt too (?:wide|high)\)(?:[a-z ]*[\d-]+)?")

#: An article for snippets.
_ARTICLE = r"""\documentclass[10pt,a4paper,twocolumn]{article}
\usepackage[T1]{fontenc}
\usepackage[margin=20mm,columnsep=8mm]{geometry}
\usepackage{lmodern,amsmath}
\allowdisplaybreaks
\begin{document}
%s
\end{document}
"""


def stuck_out(text: str, folder: Path) -> str:
    """Compile a LaTeX document; say what is wrong with it, or nothing."""
    folder.mkdir(parents=True, exist_ok=True)
    whole = text if r"\documentclass" in text else _ARTICLE % text
    (folder / "page.tex").write_text(whole, encoding="utf-8")
    words = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape"]
    try:
        run = subprocess.run(
            [*words, "page.tex"], cwd=folder, capture_output=True, timeout=300, check=False
        )
    except subprocess.TimeoutExpired:
        return "takes longer than 300 s"
    log = (folder / "page.log").read_text(encoding="utf-8", errors="replace")
    if run.returncode != 0:
        return next((line for line in log.splitlines() if line.startswith("!")), "failed")
    # LaTeX breaks the lines of its log at 79 characters.
    found = [m[0] for m in _OVERFULL.finditer(log.replace("\n", "")) if float(m[1]) > MOST]
    return found[0] if found else ""


def latex(written: Sequence[Document]) -> Outcome:
    """Compile every document with pdfLaTeX; nothing may stick out."""
    with tempfile.TemporaryDirectory() as made, ThreadPoolExecutor() as pool:
        folder = Path(os.environ.get("KEEP") or made).resolve()
        paths = [folder / re.sub(r"\W+", "_", d.name) for d in written]
        told = list(pool.map(stuck_out, [d.text for d in written], paths))
    lines = [f"{d.name}: {line}" for d, line in zip(written, told, strict=True) if line]
    return Outcome(f"{len(written)} documents", lines)


def has_checker() -> bool:
    """Tell whether Java runs here and the checker of HTML is installed."""
    return shutil.which("java") is not None and CHECKER.is_file()


def html(written: Sequence[Document]) -> Outcome:
    """Check every page with the W3C's checker."""
    with tempfile.TemporaryDirectory() as folder:
        names = {f"{index}.html": document for index, document in enumerate(written)}
        for name, document in names.items():
            Path(folder, name).write_text(document.text, encoding="utf-8")
        command = ["java", "-jar", str(CHECKER), "--errors-only", "--format", "json", folder]
        done = subprocess.run(command, capture_output=True, check=False)
    messages = json.loads(done.stderr)["messages"]
    lines = [f"{names[Path(m['url']).name].name}: {m['message']}" for m in messages]
    return Outcome(f"{len(written)} pages", lines)


#: Format → what reads its documents.
READERS: dict[str, Callable[[Sequence[Document]], Outcome]] = {
    "latex": latex,
    "markdown": markdown,
    "typst": typst,
    "html": html,
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("formats", nargs="*", metavar="FORMAT", help=", ".join(READERS))
    parser.add_argument("--scenes", default="*/*", help="a pattern of paths below systems/")
    options = parser.parse_args()
    print("| format | documents | read | failures | seconds |\n|---|---|---|---|---|")
    failures = []
    for name in options.formats or READERS:
        started = time.perf_counter()
        written = [d for path in shipped(options.scenes) for d in documents(path, name)]
        outcome = READERS[name](written)
        seconds = time.perf_counter() - started
        numbers = f"{len(written)} | {outcome.counted} | {len(outcome.failures)} | {seconds:.0f}"
        print(f"| {name} | {numbers} |", flush=True)
        failures += [f"{name}: {line}" for line in outcome.failures]
    print("\n".join(["", *failures]))
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
