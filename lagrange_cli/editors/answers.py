"""The process that works for the language server: requests as lines of JSON, answers likewise.

``python -m lagrange_cli.editors.answers`` reads requests from standard input until it ends. Each
has the text of a scene, and where it stands. One process reads scenes, another one derives them.
"""

from __future__ import annotations

import json
import os
import re
import sys
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from queue import SimpleQueue
from typing import Any, BinaryIO

from lagrange_cli.api.remembered import SceneSource
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.api.workspace import Workspace
from lagrange_cli.editors.completion import completions
from lagrange_cli.editors.hovering import hover_text
from lagrange_cli.editors.outline import Occurrence, Outline, Symbol, words_of
from lagrange_cli.errors import Edit, InputError, LagrangeError, Mark, Problem
from lagrange_cli.scene import laid_out
from lagrange_cli.scene.language.expression import RESERVED
from lagrange_cli.scene.language.tokens import IDENTIFIER
from lagrange_cli.scene.reader import read_partly
from lagrange_cli.scene.reading.source import edited

#: Most characters of a name.
_LONGEST = 100

#: Bytes of memory that the process may take.
_MEMORY = 4 * 2**30

#: Top-level keys by which a file of YAML is taken for a scene.
_SCENE = re.compile(r"^(particles|bodies|coordinates|potentials|kinetic|frames)\s*:", re.MULTILINE)


@dataclass
class _Derivations(Workspace):
    """A workspace that takes note of warnings."""

    warnings: list[Problem] = field(default_factory=list)

    def tell(self, warnings: Iterable[Problem], remarks: Iterable[str]) -> None:
        self.warnings += warnings


@lru_cache(maxsize=4)
def _outline(text: str, file: str) -> Outline | None:
    """Outline a text; None if it is no YAML."""
    try:
        return Outline.of_text(text, file)
    except LagrangeError:
        return None


def _problems(text: str, file: str) -> list[dict[str, Any]]:
    """Return the problems of reading a text; none of a file that is no scene."""
    if not _SCENE.search(text):
        return []
    outline = _outline(text, file)
    problems = read_partly(text, file)[1] if outline is None else outline.problems
    return [_plain(problem) for problem in problems]


def _derived(text: str, file: str) -> dict[str, Any]:
    """Derive a scene: its equations by coordinate, all as text, and problems."""
    workspace = _Derivations()
    data = text.encode("utf-8", "surrogatepass")
    scene = RememberedScene(workspace, SceneSource(file, data))

    def value_of(derivation: Any) -> Any:
        equations = derivation.report()["equations"]
        page = derivation.text(sections="energies,equations")
        return {e["coordinate"]: f"{e['residual']} = 0" for e in equations}, page

    try:
        equations, page = scene.answer("editor", (), "writing equations", value_of)
    except LagrangeError as refusal:
        return {"problems": [_plain(problem) for problem in refusal.problems]}
    problems = [_plain(problem) for problem in workspace.warnings]
    return {"equations": equations, "page": page, "problems": problems}


def _hover(
    text: str, file: str, line: int, column: int, derived: dict[str, Any] | None
) -> dict[str, Any] | None:
    """Return Markdown about a place, and its range."""
    outline = _outline(text, file)
    about = None if outline is None else hover_text(outline, line, column, derived)
    return {"text": about[0], "range": _range(about[1])} if about else None


def _definition(text: str, file: str, line: int, column: int) -> dict[str, int] | None:
    """Return the range of the declaration of the name at a place."""
    outline = _outline(text, file)
    occurrence = None if outline is None else outline.symbol_at(line, column)
    if outline is None or occurrence is None:
        return None
    return _range(outline.declarations[occurrence.symbol].mark)


def _renamed(text: str, file: str, line: int, column: int, name: str) -> dict[str, Any]:
    """Return the edits by which a name becomes another one, or why it cannot."""
    try:
        edits = renamed(text, Outline.of_text(text, file), line, column, name)
    except InputError as refusal:
        return {"refusal": refusal.problems[0].message}
    return {"edits": [{"range": _range(edit.mark), "text": edit.text} for edit in edits]}


def _layout(text: str, file: str) -> str | None:
    """Return the text in the usual layout; None if it is no YAML."""
    try:
        return laid_out(text.encode("utf-8", "surrogatepass"), file)
    except LagrangeError:
        return None


#: What a request asks for → the function that answers.
_ANSWERS: dict[str, Callable[..., Any]] = {
    "problems": _problems,
    "derived": _derived,
    "completions": completions,
    "hover": _hover,
    "definition": _definition,
    "renamed": _renamed,
    "layout": _layout,
}


def renamed(text: str, outline: Outline, line: int, column: int, name: str) -> tuple[Edit, ...]:
    """Return the edits that give the name at a place another one, each place once.

    The new name stands nowhere in the scene, so that replacing it back restores the text.

    Raises
    ------
    InputError
        There is no name at the place, the new one cannot be declared or stands in the scene
        already, a place of it is not known to the character, or the scene would be refused.
    """
    occurrence = outline.symbol_at(line, column)
    if occurrence is None:
        raise _refusal("no name that the scene declares stands here")
    symbol = occurrence.symbol
    if not IDENTIFIER.fullmatch(name) or len(name) > _LONGEST or name in RESERVED:
        raise _refusal(f"'{name}' cannot be a name")
    if name in _words_in_use(outline):
        raise _refusal(f"'{name}' stands in the scene already")
    marks = _marks(outline, symbol)
    edits = tuple(Edit(mark, name) for mark in marks)
    _, problems = read_partly(edited(text, edits), marks[0].file)
    errors = [problem for problem in problems if problem.severity == "error"]
    if errors and not any(problem.severity == "error" for problem in outline.problems):
        raise _refusal(f"with '{name}' the scene is refused: {errors[0].message}")
    return edits


def _marks(outline: Outline, symbol: Symbol) -> list[Mark]:
    """Return the places of a symbol, each once."""
    marks: dict[tuple[int, int], Mark] = {}
    for occurrence in outline.occurrences:
        if occurrence.symbol == symbol:
            mark = _exact(occurrence)
            marks.setdefault((mark.line, mark.column), mark)
    return list(marks.values())


def _exact(occurrence: Occurrence) -> Mark:
    mark = occurrence.mark
    if not occurrence.exact:
        where = f"a text of several lines, or with escapes, on line {mark.line}"
        raise _refusal(f"'{occurrence.symbol.name}' stands in {where}: write that on one line")
    return mark


def _words_in_use(outline: Outline) -> set[str]:
    """Return the words of names and expressions, and the names that they may be made of."""
    texts = [p.scalar.text for p in outline.places if p.kind not in ("key", "words")]
    words = {word for text in texts for word, _, _ in words_of(text)}
    return words | {word.partition("_")[2] for word in words}


def _refusal(message: str) -> InputError:
    return InputError(Problem(message, rule="rename"))


def _plain(problem: Problem) -> dict[str, Any]:
    """Return a problem as a JSON value; one without a place is at the beginning of the file."""
    mark = problem.mark or Mark("", 1, 1)
    message = f"{problem.message}\n{problem.hint}" if problem.hint else problem.message
    return {
        "range": _range(mark),
        "message": message,
        "rule": problem.rule,
        "severity": problem.severity,
    }


def _range(mark: Mark) -> dict[str, int]:
    """Return a mark as line, first column and column behind it, counted from 0."""
    start = mark.column - 1
    return {"line": mark.line - 1, "start": start, "end": start + mark.length}


def answered(request: dict[str, Any]) -> Any:
    """Answer a request, whose ``ask`` says what it asks for."""
    return _ANSWERS[request.pop("ask")](**request)


def _limit_memory() -> None:
    """Limit the memory of this process, where the system can.

    Windows has no such limit for a process that limits itself, and macOS may refuse it.
    """
    with suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))


def _requests(stream: BinaryIO) -> SimpleQueue[bytes]:
    """Return a queue of lines; the process ends with the stream, also in the midst of work."""
    lines: SimpleQueue[bytes] = SimpleQueue()

    def read() -> None:
        for line in stream:
            lines.put(line)
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    return lines


def main() -> None:
    """Answer requests from standard input, one after the other."""
    replies = os.fdopen(os.dup(1), "wb")
    # What libraries print is no answer.
    os.dup2(2, 1)
    _limit_memory()
    requests = _requests(sys.stdin.buffer)
    while True:
        request = json.loads(requests.get())
        try:
            reply = {"answer": answered(request)}
        except Exception as error:
            reply = {"failure": f"{type(error).__name__}: {error}"}
        replies.write(json.dumps(reply).encode() + b"\n")
        replies.flush()


if __name__ == "__main__":
    main()
