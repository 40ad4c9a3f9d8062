"""Check scenes in parallel, in processes of this machine or on a user's Dask cluster.

If a process dies (out of memory, a crash of a compiled library), only the scene that it checks
crashes; one that takes too long is ended. To a cluster scenes travel as text, with the files that
they name.
"""

from __future__ import annotations

import gc
import math
import multiprocessing
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
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

#: Seconds after which clocks are looked at again: systems wait for no number beyond theirs.
_LONGEST_WAIT = 3600.0

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
    # SymPy imports these at its first operations.
    "sympy.assumptions.wrapper",
    "sympy.sets.setexpr",
    "sympy.tensor.tensor",
]


def _context() -> BaseContext:
    """Fork processes from a server with everything imported; spawn them if there is none.

    The server, which ignores Ctrl-C once it has imported, is started with it held back: a mask is
    inherited, and the parent's own Ctrl-C comes when it is lifted.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver, resource_tracker

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    resource_tracker.ensure_running()  # The server would start it, and lift the mask then.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return context


def _work(
    connection: Connection,
    job: _Job,
    collection: tuple[int, int, int],
    memory: int | None,
) -> None:
    """Do the jobs that a process is given until there are no more, and say when one begins.

    Interruptions are left to the parent.

    Parameters
    ----------
    connection
        Receives paths, sends None and then the report for each of them.
    job
        Checks one scene.
    collection
        Thresholds of the parent's garbage collector, which are the worker's too.
    memory
        Bytes that it may take; None for no limit.
    """
    gc.set_threshold(*collection)
    become_worker()
    if memory is not None:
        import resource  # which Windows lacks

        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        memory = min(memory, sys.maxsize if most == resource.RLIM_INFINITY else most)
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    with suppress(EOFError):
        while True:
            path = connection.recv()
            connection.send(None)
            connection.send(job(path))


@dataclass
class _Worker:
    """A process that checks scenes one after the other.

    Attributes
    ----------
    process
        The process.
    connection
        Takes paths and gives reports.
    path
        The scene that it checks.
    begun
        Time at which that check began; None until it has.
    """

    process: BaseProcess
    connection: Connection
    path: str = ""
    begun: float | None = None

    @classmethod
    def start(cls, job: _Job, memory: int | None) -> _Worker:
        """Start a process that does a job, which must be picklable, within bytes of memory."""
        context: Any = _context()
        connection, theirs = context.Pipe()
        work = (theirs, job, gc.get_threshold(), memory)
        process = context.Process(target=_work, args=work)
        process.start()
        theirs.close()
        return cls(process, connection)

    def check(self, path: str) -> None:
        """Begin to check a scene."""
        self.path, self.begun = path, None
        with suppress(OSError):  # A dead process is seen where its report is received.
            self.connection.send(path)

    def received(self) -> SceneReport | None:
        """Receive the report of the scene, or make that of a death; None if it only begins."""
        try:
            report: SceneReport | None = self.connection.recv()
        except (EOFError, OSError):
            return self._death()
        if report is None:
            self.begun = time.monotonic()
        return report

    def _death(self) -> SceneReport:
        self.process.join()
        code = self.process.exitcode or 0
        cause = f"by signal {-code}" if code < 0 else f"with exit code {code}"
        problem = Problem(f"the process that checked this scene ended {cause}", rule="crash")
        return SceneReport(self.path, "crash", 0.0, (problem,))

    def seconds_left(self, seconds: float | None) -> float:
        """Return the seconds that the check still has."""
        if seconds is None or self.begun is None:
            return math.inf
        return self.begun + seconds - time.monotonic()

    def overdue(self) -> SceneReport:
        """End the process, and return the report of its scene."""
        self.end()
        seconds = time.monotonic() - (self.begun or 0.0)
        place = Mark(name_of(self.path), 1, 1)
        problem = Problem(f"the check was ended after {seconds:.1f} s", place, rule="limit")
        return SceneReport(self.path, "timeout", seconds, (problem,))

    def end(self) -> None:
        """End the process, which may tidy up."""
        self.process.terminate()
        self.process.join(_GRACE)
        self.process.kill()
        self.process.join()
        self.connection.close()


def in_processes(
    paths: Sequence[str], jobs: int, job: _Job, limits: Limits | None = None
) -> Iterator[SceneReport]:
    """Yield the report of each scene as it is ready, at most ``jobs`` at a time.

    A process checks one scene after the other, so that what they share is imported and computed
    once. Where memory is limited each scene has its own.

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
        in which a process starts.
    """
    limits = limits or Limits()
    waiting = deque(paths)
    busy: dict[Connection, _Worker] = {}
    idle: list[_Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < jobs:
                worker = idle.pop() if idle else _Worker.start(job, limits.memory)
                busy[worker.connection] = worker
                worker.check(waiting.popleft())
            for ready in wait(list(busy), _patience(busy.values(), limits.seconds)):
                assert isinstance(ready, Connection)
                if (report := busy[ready].received()) is not None:
                    worker = busy.pop(ready)
                    if limits.memory is None and worker.process.is_alive():
                        idle.append(worker)
                    else:
                        worker.end()
                    yield report
            for worker in [w for w in busy.values() if w.seconds_left(limits.seconds) <= 0]:
                del busy[worker.connection]
                yield worker.overdue()
    finally:
        for worker in [*busy.values(), *idle]:
            if worker.process.is_alive():
                worker.process.terminate()


def _patience(workers: Iterable[_Worker], seconds: float | None) -> float | None:
    """Return the seconds until the first worker is overdue, at most an hour.

    None where none will be overdue.
    """
    left = min(worker.seconds_left(seconds) for worker in workers)
    return None if math.isinf(left) else min(max(left, 0.0), _LONGEST_WAIT)


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
