"""Outcomes of checks, and the cache, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from lagrange_cli.cache import MAX_CACHE_BYTES, Cache, Entry, Removed
from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    INTEGER,
    NUMBER,
    TEXT,
    JsonObject,
    Key,
    counts,
    list_of,
    one_of,
    or_null,
)

if TYPE_CHECKING:
    from lagrange_cli.check import Report, SceneReport
    from lagrange_cli.errors import Problem

# Scenes.


def _line(problem: Problem) -> int | None:
    return problem.mark.line if problem.mark else None


def _column(problem: Problem) -> int | None:
    return problem.mark.column if problem.mark else None


PROBLEM: JsonObject[Problem] = JsonObject(
    Key("line", or_null(INTEGER), "Its line, from 1; null if it has no place.", _line),
    Key("column", or_null(INTEGER), "Its column, from 1; null if it has no place.", _column),
    Key("rule", TEXT, "Short name of its kind, which does not change."),
    Key("message", TEXT, "A sentence that explains it."),
)
_OUTCOMES = {
    "pass": "Scenes that pass.",
    "fail": "Scenes with an expectation that does not hold.",
    "invalid": "Scenes that are refused.",
    "timeout": "Scenes whose check reached a limit of time or memory.",
    "crash": "Scenes that the program failed on.",
}
_SCENE: JsonObject[SceneReport] = JsonObject(
    Key("path", TEXT, "The scene as it was named, or found in a folder."),
    Key(
        "outcome",
        one_of(*_OUTCOMES),
        "fail: an expectation does not hold; invalid: the scene is refused; timeout: its check"
        " reached a limit of time or memory; crash: a defect of the program.",
    ),
    Key("seconds", NUMBER, "Wall clock of its check.", lambda scene: round(scene.seconds, 3)),
    Key("problems", list_of(PROBLEM), "Why it does not pass."),
)
CHECK: JsonObject[Report] = JsonObject(
    Key("scenes", list_of(_SCENE), "The scenes, in the order in which they were named."),
    Key(
        "summary",
        counts(_OUTCOMES, "invalid", "timeout", "crash"),
        "Number of scenes of each outcome.",
    ),
    Key(
        "unchecked",
        INTEGER,
        "Number of scenes that were not checked after one that did not pass, with -x.",
        lambda report: report.unchecked or None,
        optional=True,
    ),
)

# The cache.

#: Kind of entry → the endings of its files.
_KINDS = {"answers": (".json",), "compiled": (".so", ".db")}


class CacheView(NamedTuple):
    """A cache with its entries, and what was removed from it."""

    cache: Cache
    entries: Sequence[Entry]
    removed: Removed | None


_REMOVED: JsonObject[Removed] = JsonObject(
    Key("files", INTEGER, "Number of files."),
    Key("bytes", INTEGER, "Their size.", lambda removed: removed.size),
)
CACHE: JsonObject[CacheView] = JsonObject(
    Key(
        "folder",
        or_null(TEXT),
        "The folder of the cache; null if there is none.",
        lambda view: view.cache.folder,
    ),
    Key("usable", BOOLEAN, "True if results can be kept.", lambda view: view.cache.reason is None),
    Key(
        "reason",
        or_null(TEXT),
        "Why nothing can be kept; null if it can.",
        lambda view: view.cache.reason,
    ),
    Key(
        "entries",
        counts(
            {
                "answers": "Derivations, answers and outcomes of checks.",
                "compiled": "Compiled functions.",
            }
        ),
        "Number of results of each kind.",
        lambda view: {
            kind: sum(entry.suffix in endings for entry in view.entries)
            for kind, endings in _KINDS.items()
        },
    ),
    Key("bytes", INTEGER, "Their size.", lambda view: sum(entry.size for entry in view.entries)),
    Key("largest", INTEGER, "The size above which old ones go.", lambda _: MAX_CACHE_BYTES),
    Key("removed", _REMOVED, "What --clear removed.", optional=True),
)
