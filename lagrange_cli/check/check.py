"""Check scenes: validate, derive, certify, compare with what they expect."""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

from lagrange_cli.cache import Cache, digest, fingerprint
from lagrange_cli.cache.values import from_bytes, to_bytes
from lagrange_cli.check.model import (
    CheckedMotions,
    CheckOptions,
    Limits,
    Report,
    SceneOutcome,
    SceneReport,
)
from lagrange_cli.check.walk import columns_in, name_of, scenes_in
from lagrange_cli.check.workers import in_processes, on_cluster
from lagrange_cli.errors import AccuracyError, InputError, LagrangeError, Mark, Problem
from lagrange_cli.files import read_bytes, read_recording
from lagrange_cli.files.recordings import read_recorded_file
from lagrange_cli.scene import expected_error
from lagrange_cli.scene.conditions import ErrorExpectation, Expect, Formulation
from lagrange_cli.scene.reader import SceneText

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.cluster.tasks import Cluster


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
    def of_run(cls, cache: Cache, options: CheckOptions) -> ReportStore:
        """Return the store of a run with these options."""
        asked = json.dumps([sorted(options.parameters.items()), options.strict, options.motions])
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
        try:
            recordings = [read_recorded_file(column) for column in columns_in(data, path)]
        except InputError:
            return None
        return digest(self.question, name_of(path), data, *recordings)


#: Windows has no limits, and macOS does not keep them.
_UNLIMITED = ("win32", "darwin")

_OutcomeOfScene = tuple[SceneOutcome, tuple[Problem, ...]]


def check_paths(
    paths: Sequence[str],
    options: CheckOptions | None = None,
    *,
    jobs: int = 1,
    limits: Limits | None = None,
    stops: bool = False,
    cluster: Cluster | None = None,
    cache: Cache | None = None,
    progress: Callable[[SceneReport], None] | None = None,
) -> Report:
    """Check every scene that the paths name.

    Parameters
    ----------
    paths
        Scene files and folders.
    options
        Options that outcomes depend on.
    jobs
        Number of scenes checked at the same time, each in its own process if more than 1 (not
        for standard input).
    limits
        The most that the check of one scene may take. Each is then checked in its own process.
    stops
        No further check begins after a scene that does not pass.
    cluster
        Workers that check the scenes in place of this machine.
    cache
        Holds outcomes and derivations of earlier runs, which are not worked out again, and takes
        those of this one; None to check everything anew. A cluster uses none.
    progress
        Called with each scene's report as it is ready.

    Raises
    ------
    InputError
        A path does not exist, the cluster cannot be used, or there are limits for standard input
        or a cluster. Problems of scenes do not raise: they are in the report.
    """
    scenes, options, limits = scenes_in(paths), options or CheckOptions(), limits or Limits()
    _require_processes(scenes, limits, cluster)
    store = None if cache is None else ReportStore.of_run(cache, options)
    reports: dict[str, SceneReport] = {}
    running: Generator[SceneReport]
    if cluster is not None:
        check = partial(check_text, options=options)
        running = on_cluster(cluster, scenes, options.parameters, check)
    else:
        job = partial(check_scene, options=options, store=store)
        if limits or (jobs > 1 and "-" not in scenes):
            running = _in_processes(scenes, jobs, job, store, limits)
        else:
            running = (job(path) for path in scenes)
    with closing(running):
        for report in running:
            reports[report.path] = report
            if progress is not None:
                progress(report)
            if stops and report.outcome != "pass":
                break
    checked = tuple(reports[path] for path in scenes if path in reports)
    return Report(checked, unchecked=len(scenes) - len(checked))


def _require_processes(scenes: Sequence[str], limits: Limits, cluster: Cluster | None) -> None:
    """Refuse limits that are none, or where no processes of this machine check the scenes."""
    if limits.seconds is not None and not limits.seconds > 0:
        message = f"timeout must be a positive number, not {limits.seconds:g}"
        raise InputError(Problem(message, hint="--timeout 60", rule="limit"))
    place = "a cluster" if cluster else "standard input" if "-" in scenes else ""
    if limits and place:
        hint = "limits are of processes of this machine, which check files"
        raise InputError(Problem(f"a check on {place} has no limits", hint=hint, rule="limit"))
    if limits.memory is not None and sys.platform in _UNLIMITED:
        message = "this system limits the memory of no process"
        raise InputError(Problem(message, hint="leave --memory out", rule="limit"))


def _in_processes(
    scenes: Sequence[str],
    jobs: int,
    job: Callable[[str], SceneReport],
    store: ReportStore | None,
    limits: Limits,
) -> Generator[SceneReport]:
    """Yield reports from the store, then those of processes, which start if any is missing.

    Of several processes none is left alone with a long scene at the end: large files come first,
    since time grows with what a scene holds.
    """
    missing = []
    for path in scenes:
        report = None if store is None else store.recall_path(path)
        if report is None:
            missing.append(path)
        else:
            yield report
    if jobs > 1:
        missing.sort(key=_size_of, reverse=True)
    if missing:
        yield from in_processes(missing, jobs, job, limits)


def _size_of(path: str) -> int:
    """Return the bytes of a file; 0 if it is missing."""
    try:
        return os.path.getsize(path)
    except OSError:
        return 0  # The check of the scene reports it.


def check_scene(
    path: str, options: CheckOptions | None = None, *, store: ReportStore | None = None
) -> SceneReport:
    """Check one scene; errors of any kind become part of its report."""
    started = perf_counter()
    try:
        data = read_bytes(path)
    except InputError as error:
        return SceneReport(path, "invalid", perf_counter() - started, error.problems)
    return check_text(path, data, options=options, store=store)


def check_text(
    path: str,
    data: bytes,
    *,
    options: CheckOptions | None = None,
    store: ReportStore | None = None,
) -> SceneReport:
    """Check the text of the scene at a path, as :func:`check_scene`."""
    started, options = perf_counter(), options or CheckOptions()
    if store is not None:
        report = store.recall(path, data)
        if report is not None:
            return report
    trace = ""
    text = SceneText(name_of(path), data, options.parameters)
    try:
        outcome, problems = _check(text, options, None if store is None else store.cache)
    except MemoryError:
        outcome, problems = "timeout", (_out_of_memory(path),)
    except Exception as error:
        outcome, problems = "crash", (_crash(error),)
        trace = "".join(traceback.format_exception(error))
    else:
        if store is not None:
            store.keep(path, data, outcome, problems)
    return SceneReport(path, outcome, perf_counter() - started, problems, trace)


def _check(text: SceneText, options: CheckOptions, cache: Cache | None) -> _OutcomeOfScene:
    """Read, derive and compare a scene."""
    # Mathematics is imported here: stored reports need none of it.
    from lagrange_cli.mechanics.stored_derivation import stored_derivation

    try:
        scene = text.read()
    except InputError as error:
        return _refused(error, expected_error(text.data, text.file))

    def in_formulation(formulation: Formulation) -> Equations:
        return stored_derivation(scene, text, cache, formulation=formulation)

    try:
        equations = in_formulation("auto")
        equations.derivation.textbook()  # which is certified when it is written
        for recording in filter(None, (entry.recording for entry in equations.system.inputs)):
            read_recording(recording)
    except InputError as error:
        return _refused(error, scene.expect.error)
    if options.strict and equations.derivation.warnings:
        return _refused(InputError(*equations.derivation.warnings), scene.expect.error)
    if scene.expect.error is not None:
        return "fail", (_not_refused(scene.expect.error),)
    problems = tuple(_disagreements(scene.expect, equations, in_formulation, options.motions))
    return ("fail" if problems else "pass"), problems


def _disagreements(
    expect: Expect,
    equations: Equations,
    in_formulation: Callable[[Formulation], Equations],
    wanted: CheckedMotions,
) -> Iterator[Problem]:
    """Yield what does not hold of a derived scene; a check that cannot be made does not hold."""
    from lagrange_cli.check.expectations import CHECKS
    from lagrange_cli.check.motions import MOTION_CHECKS, Motions, simulated

    motions = Motions(equations, in_formulation)
    comparisons = [
        *(partial(check, expect, equations) for check in CHECKS.values()),
        *(partial(check, expect, motions) for check in MOTION_CHECKS.values()),
    ]
    if wanted != "expected":
        comparisons.append(partial(simulated, motions, in_full=wanted == "full"))
    for compare in comparisons:
        try:
            yield from compare()
        except (AccuracyError, InputError) as error:
            yield from error.problems


def _refused(error: InputError, expected: ErrorExpectation | None) -> _OutcomeOfScene:
    """Return the outcome of a refused scene: ``pass`` if the refusal is expected."""
    if expected is None:
        return "invalid", error.problems
    if any(_is_expected(problem, expected) for problem in error.problems):
        return "pass", ()
    wrong = Problem(
        f"the scene is refused otherwise than expected: {error.problems[0].message}",
        expected.mark,
        hint=f"expected {_wanted(expected)}; found kind '{error.problems[0].rule}'",
        rule="error",
    )
    return "fail", (wrong, *error.problems)


def _is_expected(problem: Problem, expected: ErrorExpectation) -> bool:
    text = f"{problem.message}\n{problem.hint}"
    return expected.kind in (None, problem.rule) and (expected.contains or "") in text


def _wanted(expected: ErrorExpectation) -> str:
    """Describe an ``error`` expectation in words."""
    parts = []
    if expected.kind is not None:
        parts.append(f"kind '{expected.kind}'")
    if expected.contains is not None:
        parts.append(f"a message that contains '{expected.contains}'")
    return " and ".join(parts) or "any refusal"


def _not_refused(expected: ErrorExpectation) -> Problem:
    return Problem(
        f"the scene is not refused; expected {_wanted(expected)}", expected.mark, rule="error"
    )


def _out_of_memory(path: str) -> Problem:
    hint = "memory is limited by the machine or for this process (ulimit -v)"
    return Problem("out of memory", Mark(path, 1, 1), hint, rule="limit")


def _crash(error: Exception) -> Problem:
    """Return the problem of an unexpected exception, with its place in the program."""
    if isinstance(error, LagrangeError):
        return error.problems[0]
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({frames[-1].filename.rpartition('/')[2]}:{frames[-1].lineno})" if frames else ""
    return Problem(
        f"internal error: {type(error).__name__}: {error}{place}",
        hint="this is a defect of lagrange and not of the scene; please report it",
        rule="crash",
    )
