"""The same function of many tasks, on several cores or machines."""

from __future__ import annotations

import importlib.util
import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

__all__ = ["in_any_order"]

Task = TypeVar("Task")
Result = TypeVar("Result")


def in_any_order(
    function: Callable[[Task], Result], tasks: Iterable[Task], jobs: int | None
) -> Iterator[Result]:
    """Results as they are found.

    One job runs here. More run through joblib where it is installed, by whatever backend is
    configured there (``joblib.parallel_config``) and returns results as they come, else in
    processes of this machine. What is left is given up where the iterator is closed.

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
    function: Callable[[Task], Result], tasks: Iterable[Task], jobs: int | None
) -> Iterator[Result]:
    from joblib import Parallel, delayed

    parallel = Parallel(n_jobs=jobs, return_as="generator_unordered")
    yield from parallel(delayed(function)(task) for task in tasks)


def _by_processes(
    function: Callable[[Task], Result], tasks: Iterable[Task], jobs: int | None
) -> Iterator[Result]:
    from concurrent.futures import ProcessPoolExecutor, as_completed

    before = set(multiprocessing.active_children())
    executor = ProcessPoolExecutor(jobs, initializer=_leave_interrupts)
    try:
        futures = [executor.submit(function, task) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
        executor.shutdown()
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()


def _leave_interrupts() -> None:
    """Ctrl-C reaches every process of a terminal: the one that waits for the others decides."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
