"""Defaults of options, from ``lagrange.toml`` or ``[tool.lagrange]`` of ``pyproject.toml``.

The nearest folder with such a file counts, upwards from the working directory, and its defaults
alone. An option that is given counts more.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files import read_bytes
from lagrange_cli.report.formats import FORMATS
from lagrange_cli.report.phrases.language import LANGUAGES

if TYPE_CHECKING:
    from lagrange_cli.api.formats import Option

#: Most scenes that are worked on at a time.
MOST_JOBS = 4096

#: The place in a message of :mod:`tomllib`.
_PLACE = re.compile(r"\(at line (\d+), column (\d+)\)")
#: The beginning of the table of defaults.
_TABLE = re.compile(r"^\s*\[\s*tool\s*\.\s*lagrange\s*\]", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Defaults:
    """Defaults of options; those that no file has are None.

    Attributes
    ----------
    accuracy
        Accuracy of motions of ``simulate`` whose error nothing else controls.
    format
        Format of what is printed, and of files whose ending says none.
    language
        Language of reports and documents.
    exclude
        Patterns of scenes that ``check`` and ``fmt`` leave out.
    jobs
        Number of scenes, members or points at a time, on this machine.
    path
        The file that they come from.
    """

    accuracy: float | None = None
    format: str | None = None
    language: str | None = None
    exclude: tuple[str, ...] | None = None
    jobs: int | None = None
    path: str | None = None

    def for_documents(
        self, declared: Iterable[Option], chosen: Mapping[str, str | bool]
    ) -> dict[str, str | bool]:
        """Return options of a document, with the default language if it has a language."""
        if self.language is None or all(option.name != "language" for option in declared):
            return dict(chosen)
        return {"language": self.language, **chosen}


def _is_list_of_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) and text for text in value)


def _is_accuracy(value: Any) -> bool:
    return type(value) is float and 0 < value < 1


def _is_format(value: Any) -> bool:
    return value in FORMATS


def _is_count(value: Any) -> bool:
    return type(value) is int and 1 <= value <= MOST_JOBS


#: Name of a key → its values in words, and a test of a value.
KEYS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "accuracy": ("a number between 0 and 1, as 1e-9", _is_accuracy),
    "format": (f"one of {', '.join(FORMATS)}", _is_format),
    "language": (f"one of {', '.join(LANGUAGES)}", LANGUAGES.__contains__),
    "exclude": ("a list of patterns, as ['drafts/*']", _is_list_of_texts),
    "jobs": (f"a number from 1 to {MOST_JOBS}", _is_count),
}


def read_defaults() -> Defaults:
    """Read the defaults that hold in the working directory.

    Raises
    ------
    InputError
        The file is no TOML, or has an unknown key or a wrong value: with its place.
    """
    try:
        here = folder = os.getcwd()
    except OSError:
        return Defaults()  # The directory was removed, or a folder above it may not be read.
    below = None
    while folder != below:
        for name in ("lagrange.toml", "pyproject.toml"):
            path = os.path.join(folder, name)
            if os.path.isfile(path):  # not where a folder may not be searched
                defaults = _in_file(os.path.relpath(path, here), is_shared=name == "pyproject.toml")
                if defaults is not None:
                    return defaults
        below, folder = folder, os.path.dirname(folder)
    return Defaults()


def _in_file(path: str, *, is_shared: bool) -> Defaults | None:
    """Read a file; None if it is shared with other programs, and has none of ours."""
    import tomllib  # which commands without such a file do not need

    data = read_bytes(path)
    if is_shared and b"lagrange" not in data:
        return None
    text = data.decode("utf-8", "replace")
    try:
        table: Any = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        line, column = (int(place[1]), int(place[2])) if place else (len(text.splitlines()), 1)
        raise InputError(
            Problem(f"not valid TOML: {error}", _mark(path, text, line, column), rule="defaults")
        ) from None
    if is_shared:
        tools = table.get("tool")
        if not isinstance(tools, dict) or "lagrange" not in tools:
            return None
        table = tools["lagrange"]
    return _checked(table, path, text)


def _checked(table: Any, path: str, text: str) -> Defaults:
    """Check the keys and values of a table."""
    if not isinstance(table, dict):
        place = _place(path, text, "lagrange")
        raise InputError(Problem("'tool.lagrange' is a table of defaults", place, rule="defaults"))
    problems = []
    for key, value in table.items():
        place = _place(path, text, key)
        if key not in KEYS:
            hint = nearest(key, KEYS) or f"known are {', '.join(KEYS)}"
            problems.append(Problem(f"there is no default '{key}'", place, hint, "unknown-name"))
        elif not KEYS[key][1](value):
            message = f"'{key}' is {KEYS[key][0]}; found {value!r}"
            problems.append(Problem(message, place, rule="defaults"))
    if problems:
        raise InputError(*problems)
    values = {**table, "exclude": tuple(table["exclude"])} if "exclude" in table else table
    return Defaults(**values, path=path)


def _place(path: str, text: str, key: str) -> Mark:
    """Return the place of a key, which tomllib does not tell: the first after the table begins."""
    table = _TABLE.search(text)
    written = re.compile(rf"(?<![\w-]){re.escape(key)}(?![\w-])")
    match = written.search(text, table.end() if table else 0) or written.search(text)
    if match is None:  # A key in quotes with escapes.
        return Mark(path, 1, 1)
    line = text.count("\n", 0, match.start()) + 1
    column = match.start() - (text.rfind("\n", 0, match.start()) + 1) + 1
    return _mark(path, text, line, column, len(key))


def _mark(path: str, text: str, line: int, column: int, length: int = 1) -> Mark:
    lines = text.split("\n")
    return Mark(
        path, line, column, lines[line - 1].rstrip("\r") if line <= len(lines) else "", length
    )
