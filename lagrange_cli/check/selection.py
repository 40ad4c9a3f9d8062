"""Choose some of the scenes that paths name: by text, by what changed, by the last run."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch

from lagrange_cli.cache import Cache, digest
from lagrange_cli.check.model import Report
from lagrange_cli.check.walk import files_of
from lagrange_cli.errors import InputError, Problem


@dataclass(frozen=True, slots=True)
class Selection:
    """Conditions that a scene must meet to be checked, all of them.

    Attributes
    ----------
    text
        Its path holds this text, whatever the capitals; empty for any.
    excluded
        Neither its path nor a name in it matches one of these patterns (:mod:`fnmatch`).
    changed_since
        A revision of git: the scene, or a file that it reads, differs from it; None for any.
    failed
        It did not pass when it was last checked from this folder.
    """

    text: str = ""
    excluded: tuple[str, ...] = ()
    changed_since: str | None = None
    failed: bool = False

    def selected(self, scenes: Sequence[str], cache: Cache | None) -> list[str]:
        """Return the scenes that are selected, in their order.

        Raises
        ------
        InputError
            No path holds the text, no last run is known, or git cannot compare.
        """
        chosen = [s for s in scenes if self.text.casefold() in s.casefold()]
        if scenes and not chosen:
            raise InputError(
                Problem(f"no path of a scene holds '{self.text}'", hint="-k TEXT", rule="path")
            )
        chosen = [s for s in chosen if not any(_matches(s, p) for p in self.excluded)]
        if self.failed:
            failed = failed_before(cache)
            chosen = [s for s in chosen if _identity(s) in failed]
        if self.changed_since is not None:
            changed = _changed_files(self.changed_since, chosen)
            chosen = [s for s in chosen if not changed.isdisjoint(map(_identity, files_of(s)))]
        return chosen


def _matches(path: str, pattern: str) -> bool:
    """Say whether a path, a folder on it or a name in it matches a pattern."""
    parts = os.path.normpath(path).split(os.sep)
    heads = [os.sep.join(parts[: k + 1]) for k in range(len(parts))]
    wanted = os.path.normpath(pattern)
    return any(fnmatch(text, wanted) for text in (*parts, *heads))


def _identity(path: str) -> str:
    """Return the path that a file is recognized by, from whichever folder it is named."""
    return os.path.realpath(path)


# Git.


def _changed_files(revision: str, scenes: Sequence[str]) -> set[str]:
    """Return the files of the scenes' repositories that differ from a revision, or are new.

    Raises
    ------
    InputError
        A scene is in no repository, git is not there, or it does not know the revision.
    """
    folders = dict.fromkeys(os.path.dirname(_identity(s)) for s in scenes if s != "-")
    changed: set[str] = set()
    for root in dict.fromkeys(map(_repository, folders)):
        commit = f"{revision}^{{commit}}"
        known = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", commit)
        if not known:
            raise _refused(f"'{revision}' is no revision of the repository '{root}'")
        differing = ("diff", "--name-only", "--no-renames", "--no-ext-diff", "-z", known.strip())
        new = ("ls-files", "--others", "--exclude-standard", "-z")
        names = _git(root, *differing, "--") + _git(root, *new)
        changed.update(_identity(os.path.join(root, name)) for name in names.split("\0") if name)
    return changed


def _repository(folder: str) -> str:
    """Return the root of the work tree that a folder belongs to."""
    root = folder
    while not os.path.exists(os.path.join(root, ".git")):
        root, below = os.path.dirname(root), root
        if root == below:
            raise _refused(f"'{folder}' is in no git repository")
    return root


def _git(root: str, *words: str) -> str:
    """Return what a command of git prints in a work tree; nothing if it fails."""
    try:
        done = subprocess.run(["git", "-C", root, *words], capture_output=True, check=False)
    except OSError as error:
        raise _refused(f"git cannot be run: {error.strerror or error}") from None
    return os.fsdecode(done.stdout) if done.returncode == 0 else ""


def _refused(message: str) -> InputError:
    return InputError(Problem(message, hint="--changed-since main", rule="git"))


# The last run.


def failed_before(cache: Cache | None) -> set[str]:
    """Return the scenes that did not pass when they were last checked from this folder.

    Raises
    ------
    InputError
        No run is known.
    """
    stored = None if cache is None else cache.get(_last_run())
    if stored is None:
        hint = "lagrange check PATH... without --only-failed; it is kept in the cache"
        raise InputError(Problem("no check from this folder is known", hint=hint, rule="cache"))
    return set(json.loads(stored))


def note_outcomes(report: Report, cache: Cache) -> None:
    """Keep in the cache which scenes did not pass; others stay as they were."""
    key = _last_run()
    checked = {_identity(scene.path) for scene in report.scenes}
    failed = {_identity(s.path) for s in report.scenes if s.outcome != "pass"}
    before = set(json.loads(cache.get(key) or b"[]")) - checked
    cache.replace(key, json.dumps(sorted(failed | set(filter(os.path.exists, before)))).encode())


def _last_run() -> str:
    """Return the key of the scenes that failed in the last run from this folder."""
    return digest("scenes that failed", os.getcwd())
