"""Outcomes of earlier checks, which the cache keeps."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter

from lagrange_cli.cache import Cache, digest, fingerprint
from lagrange_cli.cache.values import from_bytes, to_bytes
from lagrange_cli.check.model import SceneOutcome, SceneReport
from lagrange_cli.check.walk import name_of
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import read_bytes
from lagrange_cli.files.recordings import read_recorded_file
from lagrange_cli.scene import read_text

#: The key of a recording, in any way in which YAML writes it.
_NAMES_A_FILE = re.compile(rb"file['\"]?\s*:")


@dataclass(frozen=True)
class ReportStore:
    """Outcomes by the text of a scene.

    The key of a scene holds its text and the content of the recordings that it names.

    Attributes
    ----------
    cache
        Holds the outcomes.
    question
        Hash of the options of the run, the code of the program and its libraries.
    """

    cache: Cache
    question: str

    @classmethod
    def of_run(
        cls, cache: Cache, parameters: Mapping[str, str] | None, strict: bool
    ) -> ReportStore:
        """Return the store of a run with these options."""
        asked = json.dumps([sorted((parameters or {}).items()), strict])
        return cls(cache, digest("check", fingerprint(), asked))

    def recall_path(self, path: str) -> SceneReport | None:
        """Return the report of the scene at a path; None if there is none, or no such file."""
        try:
            return self.recall(path, read_bytes(path))
        except InputError:
            return None  # The check of the scene reports it.

    def recall(self, path: str, data: bytes) -> SceneReport | None:
        """Return the report of a scene's text, None if there is none."""
        started = perf_counter()
        key = self._key(path, data)
        stored = None if key is None else self.cache.get(key)
        if stored is None:
            return None
        outcome, problems = from_bytes(stored)
        return SceneReport(path, outcome, perf_counter() - started, problems)

    def keep(
        self, path: str, data: bytes, outcome: SceneOutcome, problems: tuple[Problem, ...]
    ) -> None:
        """Store the outcome of a check."""
        key, stored = self._key(path, data), to_bytes((outcome, problems))
        if key is not None and stored is not None:
            self.cache.put(key, stored)

    def _key(self, path: str, data: bytes) -> str | None:
        """Return the key of a scene's text and recordings; None if these cannot be read."""
        file = name_of(path)
        recordings: list[bytes] = []
        if _NAMES_A_FILE.search(data):
            try:
                inputs = read_text(data, file).inputs
                named = [entry.recording for entry in inputs if entry.recording is not None]
                recordings = [read_recorded_file(recording) for recording in named]
            except InputError:
                return None
        return digest(self.question, file, data, *recordings)
