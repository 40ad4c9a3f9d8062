"""Check scenes in parallel, in processes of this machine or on a user's Dask cluster.

If a process dies (out of memory, a crash of a compiled library), only its scene crashes; one that
takes too long is ended. To a cluster scenes travel as text, with the files that they name.
"""

from __future__ import annotations

import gc
import math
import multiprocessing
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING, Any, Protocol

from lagrange_cli.check.model import Limits, SceneReport
from lagrange_cli.check.walk import name_of
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.files import (
    CarriedFile,
    FileColumn,
    carried_files,
    read_bytes,
    reading_carried,
)
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.parallel import become_worker

if TYPE_CHECKING:
    from lagrange_cli.simulate.cluster.tasks import Cluster


_Job = Callable[[str], SceneReport]

#: Seconds in which a process that is asked to end may tidy up.
_GRACE = 2.0

#: Modules that a check needs: imported once, by the server, not by the process of each scene.
_PRELOADED = [
    "lagrange_cli.check.check",
    "lagrange_cli.check.expectations",
    "lagrange_cli.check.motions",
    "lagrange_cli.mechanics.derivation",
    "lagrange_cli.mechanics.stored_derivation",
    "lagrange_cli.analysis.analyze",
    "lagrange_cli.simulate.charts.passages",
    "lagrange_cli.simulate.charts.simulation",
    "lagrange_cli.simulate.model.build",
]


def _context() -> BaseContext:
    """Fork processes from a server with everything imported; spawn them if there is none."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    return context


def _work(
    answer: Connection,
    job: _Job,
    path: str,
    collection: tuple[int, int, int],
    memory: int | None,
) -> None:
    """Do a job in a worker, which leaves interruptions to its parent, and says when it begins.

    Parameters
    ----------
    collection
        Thresholds of the parent's garbage collector, which are the worker's too.
    memory
        Bytes that it may take; None for no limit.
    """
    gc.set_threshold(*collection)
    become_worker()
    if memory is not None:
        import resource  # which Windows lacks

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    answer.send(None)
    answer.send(job(path))


def _died(path: str, process: BaseProcess) -> SceneReport:
    process.join()
    code = process.exitcode or 0
    cause = f"by signal {-code}" if code < 0 else f"with exit code {code}"
    problem = Problem(f"the process that checked this scene ended {cause}", rule="crash")
    return SceneReport(path, "crash", 0.0, (problem,))


@dataclass
class _Worker:
    """A process that checks a scene.

    Attributes
    ----------
    path
        The scene.
    process
        The process.
    begun
        Time at which the check began; None until it has.
    """

    path: str
    process: BaseProcess
    begun: float | None = None


def in_processes(
    paths: Sequence[str], jobs: int, job: _Job, limits: Limits | None = None
) -> Iterator[SceneReport]:
    """Yield the report of each scene as it is ready, at most ``jobs`` at a time.

    Parameters
    ----------
    paths
        The scenes, each once.
    jobs
        Number of processes that run at the same time.
    job
        Checks one scene; must be picklable.
    limits
        The most that a scene may take. Seconds count from the start of its check, without those
        in which modules are imported.
    """
    context: Any = _context()
    collection, limits = gc.get_threshold(), limits or Limits()
    waiting = deque(paths)
    running: dict[Connection, _Worker] = {}
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                answer, theirs = context.Pipe(duplex=False)
                path = waiting.popleft()
                work = (theirs, job, path, collection, limits.memory)
                process = context.Process(target=_work, args=work)
                running[answer] = _Worker(path, process)
                process.start()
                theirs.close()
            for ready in wait(list(running), _patience(running.values(), limits.seconds)):
                assert isinstance(ready, Connection)
                if (report := _received(ready, running[ready])) is not None:
                    del running[ready]
                    yield report
            for overdue in [a for a, w in running.items() if _left(w, limits.seconds) <= 0]:
                yield _ended(overdue, running.pop(overdue))
    finally:
        for worker in running.values():
            if worker.process.is_alive():
                worker.process.terminate()


def _left(worker: _Worker, seconds: float | None) -> float:
    """Return the seconds that a worker still has."""
    if seconds is None or worker.begun is None:
        return math.inf
    return worker.begun + seconds - time.monotonic()


def _patience(workers: Iterable[_Worker], seconds: float | None) -> float | None:
    """Return the seconds until the first worker is overdue; None where none will be."""
    left = min(_left(worker, seconds) for worker in workers)
    return None if math.isinf(left) else max(left, 0.0)


def _received(answer: Connection, worker: _Worker) -> SceneReport | None:
    """Receive a worker's report, or make that of its death; None if it only begins."""
    try:
        report: SceneReport | None = answer.recv()
    except EOFError:
        report = _died(worker.path, worker.process)
    if report is None:
        worker.begun = time.monotonic()
        return None
    answer.close()
    worker.process.join()
    return report


def _ended(answer: Connection, worker: _Worker) -> SceneReport:
    """End an overdue worker, and return the report of its scene."""
    worker.process.terminate()
    worker.process.join(_GRACE)
    worker.process.kill()
    worker.process.join()
    answer.close()
    seconds = time.monotonic() - (worker.begun or 0.0)
    problem = Problem(
        f"the check was ended after {seconds:.1f} s", Mark(name_of(worker.path), 1, 1), rule="limit"
    )
    return SceneReport(worker.path, "timeout", seconds, (problem,))


#: Threads of a worker check in turn: most of that is Python's.
_one_by_one = threading.Lock()


class _Check(Protocol):
    """Checks the text of the scene at a path."""

    def __call__(self, path: str, data: bytes, /) -> SceneReport: ...


@dataclass(frozen=True)
class _SceneTask:
    """A scene that was read here.

    Attributes
    ----------
    path
        The scene as it was named.
    data
        Its text.
    files
        Contents of the recorded inputs that it names.
    """

    path: str
    data: bytes
    files: Mapping[FileColumn, CarriedFile]


@dataclass(frozen=True)
class _CheckWork:
    """Checks scenes on a worker.

    Attributes
    ----------
    check
        Checks one of them.
    """

    check: _Check

    def prepare(self) -> None:
        """Prepare nothing: no code is compiled for all scenes."""

    def __call__(self, task: _SceneTask) -> SceneReport:
        with _one_by_one, reading_carried(task.files):
            return self.check(task.path, task.data)


def on_cluster(
    cluster: Cluster, paths: Sequence[str], parameters: Mapping[str, str] | None, check: _Check
) -> Generator[SceneReport]:
    """Yield the report of each scene as it is ready.

    Parameters
    ----------
    paths
        The scenes, each once; read here.
    parameters
        Values that replace those of the scenes.
    check
        Checks a scene with these values, there.

    Raises
    ------
    ClusterError
        The cluster cannot be used, or was lost.
    """
    cluster.admit()
    unread: list[SceneReport] = []
    tasks = _tasks(paths, parameters, unread.append)
    yield from cluster.in_any_order(_CheckWork(check), tasks, killed=_lost)
    yield from unread


def _tasks(
    paths: Sequence[str],
    parameters: Mapping[str, str] | None,
    refuse: Callable[[SceneReport], None],
) -> Iterator[_SceneTask]:
    """Read scenes one after the other; report those that cannot be read."""
    for path in paths:
        try:
            data = read_bytes(path)
        except InputError as error:
            refuse(SceneReport(path, "invalid", 0.0, error.problems))
            continue
        yield _SceneTask(path, data, carried_files(_columns(path, data, parameters)))


def _columns(path: str, data: bytes, parameters: Mapping[str, str] | None) -> list[FileColumn]:
    """Return the columns of files that a scene names; none of one that cannot be read."""
    try:
        scene = read_text(data, name_of(path), parameters=parameters)
    except InputError:
        return []
    return list(scene.columns)


def _lost(task: _SceneTask) -> SceneReport:
    problem = Problem("each worker that checked this scene ended", rule="crash")
    return SceneReport(task.path, "crash", 0.0, (problem,))
