"""Documents of every shipped scene, given to the programs that typeset them.

    python benchmarks/documents.py
    python benchmarks/documents.py markdown --scenes 'pendulums/*'

Each scene is derived in few coordinates, with its constraints beside Cartesian names, and with its
steps both ways; each derivation is written in both forms. What a program refuses is listed, and the
exit code is 1 where there is anything.

Formulas of Markdown are rendered by KaTeX in strict mode, which needs node and, in this checkout,
``npm install --no-save katex``. Typst is compiled by PyPI's package ``typst``.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from lagrange_cli import InputError, load

ROOT = Path(__file__).resolve().parents[1]
KATEX = Path(__file__).resolve().with_name("katex_strict.js")

#: Options of the derivations: formulation and way of the steps.
DERIVATIONS = (("auto", None), ("multiplier", None), ("auto", "lagrange"), ("auto", "dalembert"))
FORMS = ("lagrange", "explicit")

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
            derivation = load(path).derive(formulation=formulation, steps=by)
        except InputError:
            if (formulation, by) == DERIVATIONS[0]:
                raise
            continue
        for form in FORMS:
            (text,) = derivation.emit(to, form=form).values()
            words = " ".join(filter(None, (formulation, by, form)))
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


#: Format → what reads its documents.
READERS: dict[str, Callable[[Sequence[Document]], Outcome]] = {
    "markdown": markdown,
    "typst": typst,
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
