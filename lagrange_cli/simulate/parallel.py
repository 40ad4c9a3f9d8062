"""One function of many tasks, on several cores or machines."""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from collections.abc import Set as AbstractSet
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from itertools import islice
from typing import TypeVar

#: Seconds between two looks at whether results are still wanted.
_GLANCE = 0.1

#: Tasks that are given to each thread, so that none waits for the next one.
_AHEAD = 2

_Task = TypeVar("_Task")
_Result = TypeVar("_Result")


def in_any_order(
    function: Callable[[_Task], _Result], tasks: Iterable[_Task], jobs: int | None
) -> Iterator[_Result]:
    """Yield results as they come.

    One job runs here. More run through joblib where it is installed, by whatever backend is
    configured there (``joblib.parallel_config``) and returns results as they come, else in
    processes of this machine. Closing the iterator gives up the tasks that are left.

    Parameters
    ----------
    function
        At the top level of a module; it and the tasks are sent to other processes.
    jobs
        How many at a time; None is joblib's configuration, one without joblib.
    """
    with_joblib = importlib.util.find_spec("joblib") is not None
    if jobs == 1 or (jobs is None and not with_joblib):
        return map(function, tasks)
    return (_by_joblib if with_joblib else _by_processes)(function, tasks, jobs)


def _by_joblib(
    function: Callable[[_Task], _Result], tasks: Iterable[_Task], jobs: int | None
) -> Iterator[_Result]:
    from joblib import Parallel, delayed

    parallel = Parallel(n_jobs=jobs, return_as="generator_unordered")
    yield from parallel(delayed(_shielded)(function, task) for task in tasks)


def _shielded(function: Callable[[_Task], _Result], task: _Task) -> _Result:
    """Run a task in a process that does not end in the midst of sending its result.

    Signals to all processes of a group would end those of joblib's own backend, whose parent then
    waits for the rest of the message for ever; it ends them itself, by other means.
    """
    if multiprocessing.current_process().name.startswith("LokyProcess"):
        for name in ("SIGTERM", "SIGHUP"):
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), signal.SIG_IGN)
    return function(task)


def _by_processes(
    function: Callable[[_Task], _Result], tasks: Iterable[_Task], jobs: int | None
) -> Iterator[_Result]:
    with _processes(jobs) as executor:
        waiting, pending = iter(tasks), set[Future[_Result]]()
        # One more is at hand for each process than it can begin.
        ahead = _AHEAD * (jobs or os.cpu_count() or 1)
        while True:
            pending |= {executor.submit(function, t) for t in islice(waiting, ahead - len(pending))}
            if not pending:
                return
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()


@contextmanager
def _processes(jobs: int | None) -> Iterator[ProcessPoolExecutor]:
    """Start processes of this machine, which end with the context whatever they are at."""
    before = set(multiprocessing.active_children())
    executor = ProcessPoolExecutor(jobs, initializer=become_worker)
    try:
        yield executor
        executor.shutdown()
    finally:
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
        _end_results(executor)
        # Waits for the thread that minds them, which ends with them.
        executor.shutdown(cancel_futures=True)


def _end_results(executor: ProcessPoolExecutor) -> None:
    """Close this process's own end of what the others send their results by.

    A thread would else wait for ever for the rest of a message that a process which was ended had
    begun. That end is a detail of the standard library; one that lacks it is left alone.
    """
    own_end = getattr(getattr(executor, "_result_queue", None), "_writer", None)
    if own_end is not None:
        own_end.close()


class Aside:
    """Services for a function that runs in a thread: other processes, and a stop.

    ``run(f, tasks)`` gives the results of a function in other processes, in order; ``stopped()``
    is true once no results are wanted any more, and then the former raises ``CancelledError``.
    """

    def __init__(self, executor: ProcessPoolExecutor) -> None:
        self._executor, self._stop = executor, threading.Event()
        self.stopped = self._stop.is_set

    def run(self, function: Callable[[_Task], _Result], tasks: Iterable[_Task]) -> list[_Result]:
        futures = [self._executor.submit(function, task) for task in tasks]
        pending: AbstractSet[Future[_Result]] = set(futures)
        while pending:
            if self.stopped():
                for future in pending:
                    future.cancel()
                raise CancelledError
            pending = wait(pending, timeout=_GLANCE).not_done
        return [future.result() for future in futures]

    def stop(self) -> None:
        self._stop.set()


def in_threads(
    function: Callable[[_Task, Aside], _Result], tasks: Iterable[_Task], jobs: int
) -> Iterator[_Result]:
    """Yield results, as they come, of a function that spends its time outside of Python.

    So many threads share the memory of this process; there are as many processes for what
    :class:`Aside` is given. Tasks are asked for, here, as threads become free.
    """
    with _processes(jobs) as executor:
        # All of them begin now, while there is one thread.
        executor.submit(int).result()
        aside = Aside(executor)
        threads = ThreadPoolExecutor(jobs)
        waiting = iter(tasks)
        pending: set[Future[_Result]] = set()
        try:
            while True:
                some = islice(waiting, _AHEAD * jobs - len(pending))
                pending |= {threads.submit(function, task, aside) for task in some}
                if not pending:
                    return
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            aside.stop()
            threads.shutdown(wait=True, cancel_futures=True)


def become_worker() -> None:
    """Make this process one of those that another waits for, and decides about.

    Ctrl-C and the end of a terminal, which reach every process there, are left to that one. When it
    has ended, whether or not it could end the others, this process ends.
    """
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
