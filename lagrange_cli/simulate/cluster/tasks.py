"""Tasks on the workers of a user's cluster, which are all alike and as this process is."""

from __future__ import annotations

import importlib
import itertools
import logging
import math
import os
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from lagrange_cli.errors import InputError, LagrangeError, Problem
from lagrange_cli.simulate.cluster.workers import (
    EXTRA,
    Answer,
    ClusterError,
    Findings,
    Parcel,
    Work,
    difference,
    do,
    findings,
    installed,
    itself,
    packed,
    prepare,
    refusal,
    without_compiler,
)
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from distributed import Client

#: Seconds until a scheduler that does not answer is refused.
_PATIENCE = 5.0

#: Seconds beyond that, in which Dask itself gives up where it can.
_MARGIN = 0.5

#: Seconds that are left to a connection to be closed.
_FAREWELL = 2.0


@contextmanager
def connected(address: str, patience: float = _PATIENCE) -> Iterator[Client]:
    """Connect to a scheduler for a while, if it answers within ``patience`` seconds.

    Raises
    ------
    ClusterError
        There is none at this address, or Dask is not installed.
    """
    if find_spec("distributed") is None:
        raise ClusterError(
            Problem("a cluster needs dask and distributed", hint=EXTRA, rule="missing-extra")
        )
    importlib.import_module("distributed")  # which makes its loggers
    _silence()
    try:
        with warnings.catch_warnings():
            # Versions that differ are refused later, by name.
            warnings.simplefilter("ignore")
            client = _client(address, patience)
    except Exception as error:
        hint = "'dask scheduler' starts one and says its address; --on local runs here"
        reason = str(error).strip().splitlines()[:1] or [f"no answer after {patience:g} s"]
        raise refusal(f"no Dask scheduler answers at {address}: {reason[0]}", hint) from None
    try:
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=_FAREWELL)


def _client(address: str, patience: float) -> Client:
    """Connect, in a thread of its own: Dask waits for ever for servers that are no schedulers.

    Raises
    ------
    OSError
        Nothing answers, or not in time.
    """
    from distributed import Client

    made: Future[Client] = Future()

    def connect() -> None:
        try:
            made.set_result(
                Client(address, timeout=patience, set_as_default=False, name="lagrange")
            )
        except BaseException as error:
            made.set_exception(error)

    threading.Thread(target=connect, daemon=True).start()
    return made.result(timeout=patience + _MARGIN)


def _silence() -> None:
    """Let nothing but this program speak of lost connections."""
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


_Task = TypeVar("_Task")
_Result = TypeVar("_Result")

#: Rules of problems that are those of a worker, whatever is run on it.
_OF_WORKERS = {"cluster", "output"}

#: Tasks that are given to each thread of the cluster, so that none waits for the next one.
_AHEAD = 3

#: The same of a cluster that has few threads, or none yet.
_FEWEST_AHEAD = 8

#: Seconds between two looks at how many threads there are.
_GLANCE = 2.0

#: Seconds in which a new file must be seen by all workers, and between two looks.
_SEEN_WITHIN, _LOOK_AGAIN = 3.0, 0.25


@dataclass
class Cluster:
    """Workers that are all alike, and as this process is.

    Attributes
    ----------
    client
        The connection to their scheduler, which is not closed here.
    tell
        Called with remarks for the user.
    """

    client: Client
    tell: Callable[[str], None] = lambda text: None
    _looked: float = field(default=-math.inf, init=False)
    _wanted: int = field(default=0, init=False)
    _interpreting: set[str] = field(default_factory=set, init=False)

    def admit(self, watched: str | None = None) -> None:
        """Require workers that are as this process is; say which of them compile nothing.

        Parameters
        ----------
        watched
            A file, or its address, that all workers must see.

        Raises
        ------
        ClusterError
            One of them differs, or the scheduler was lost.
        """
        if self.client.asynchronous:
            raise refusal("the client is asynchronous", "distributed.Client(ADDRESS) is not")
        with self._lost_is_told():
            self._require_alike_workers(watched)

    def in_any_order(
        self,
        work: Work[_Task, _Result],
        tasks: Iterable[_Task],
        watched: str | None = None,
        killed: Callable[[_Task], _Result] | None = None,
        budget: float | None = None,
    ) -> Generator[_Result, None, None]:
        """Yield the results of tasks as they are found; closing the iterator cancels the others.

        Parameters
        ----------
        work
            Sent to workers once.
        tasks
            Asked for as they can be begun.
        watched
            As for :meth:`admit`, of workers that come later.
        killed
            Makes the result of a task that ended several workers; refused by default.
        budget
            Seconds after which no further result is waited for.

        Raises
        ------
        ClusterError
            A worker that came later differs, or the scheduler was lost.
        LagrangeError
            That of a task.
        """
        with self._lost_is_told():
            yield from self._results(packed(work, watched), iter(tasks), killed, budget)

    @contextmanager
    def _lost_is_told(self) -> Iterator[None]:
        """Say in words that the scheduler is gone, or has cancelled the run."""
        from distributed.client import ClosedClientError
        from distributed.comm import CommClosedError

        address = getattr(self.client.scheduler, "address", "its address")
        try:
            yield
        except (ClosedClientError, CommClosedError, TimeoutError, ConnectionError) as error:
            raise refusal(f"the scheduler at {address} was lost") from error
        except _CancelledError:
            raise refusal(f"the scheduler at {address} was lost, or cancelled the run") from None

    def _require_alike_workers(self, watched: str | None) -> None:
        """Refuse the cluster if a worker is unlike this process; say which interpret."""
        answers = self._findings(watched)
        for worker, answer in answers.items():
            different = difference(installed(), answer.installed)
            if different:
                hint = "the same environment everywhere gives the same results everywhere"
                raise refusal(f"the worker at {worker} has {different}", hint)
            if watched is not None and not answer.sees:
                raise _unseen(worker, os.path.dirname(watched))
        self._tell_interpreting({worker: a.lacks for worker, a in answers.items() if a.lacks})
        if not answers:
            self.tell("the cluster has no workers yet: waiting for them")

    def _tell_interpreting(self, reasons: Mapping[str, str]) -> None:
        """Say once of workers that they compile nothing, where this process does."""
        new = [worker for worker in reasons if worker not in self._interpreting]
        if new and not without_compiler():
            self.tell(f"interpreted, and slower, on {', '.join(new)}: {reasons[new[0]]}")
        self._interpreting.update(new)

    def _findings(self, watched: str | None) -> dict[str, Findings]:
        """Ask all workers what they are; again while one does not see a file that is new."""
        given_up = time.monotonic() + _SEEN_WITHIN
        while True:
            answers = self.client.run(findings, watched, on_error="return")
            for worker, answer in answers.items():
                if not isinstance(answer, Findings):
                    raise _unusable(worker, answer)
            seen = all(answer.sees for answer in answers.values())
            if seen or time.monotonic() > given_up:
                return dict(answers)
            time.sleep(_LOOK_AGAIN)

    def _results(
        self,
        parcel: Parcel,
        waiting: Iterator[_Task],
        killed: Callable[[_Task], Any] | None,
        budget: float | None,
    ) -> Generator[Any, None, None]:
        """Yield the results of tasks, of which as many are under way as keep workers busy."""
        pending, numbers = dict[Any, _Task](), itertools.count()
        ended = math.inf if budget is None else time.monotonic() + budget
        completed = self._completed([], budget)
        # A task, not scattered: what a lost worker held is sent again.
        shared = self._shared(parcel)
        try:
            self._prepare(shared, budget)
            while True:
                for task in islice(waiting, max(0, self._many() - len(pending))):
                    key = f"lagrange-{parcel.token}-{next(numbers)}"
                    future = self._submit(do, shared, task, key=key)
                    pending[future] = task
                    completed.add(future)
                if not pending:
                    return
                future, result = next(completed)
                task = pending.pop(future)
                if killed is not None and _ended_workers(future, result):
                    yield killed(task)
                else:
                    yield self._received(future, result)
        except TimeoutError:
            if time.monotonic() < ended:
                raise
        finally:
            if self.client.status == "running":
                with suppress(Exception):
                    self.client.cancel([shared, *pending])

    def _shared(self, parcel: Parcel) -> Any:
        """Send a parcel to the cluster."""
        with warnings.catch_warnings():
            # That a model of many equations is large.
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._submit(itself, parcel, key=f"lagrange-{parcel.token}")

    def _submit(self, function: Callable[..., Any], *args: Any, **options: Any) -> Any:
        return self.client.submit(function, *args, pure=False, **options)

    def _prepare(self, shared: Any, budget: float | None) -> None:
        """Let one worker of each host compile, so that the others find it done."""
        hosts = {worker.rpartition(":")[0]: worker for worker in self.client.nthreads()}
        futures = [
            self._submit(prepare, shared, workers=[worker], allow_other_workers=True)
            for worker in hosts.values()
        ]
        for future, result in self._completed(futures, budget):
            self._received(future, result)

    def _completed(self, futures: list[Any], budget: float | None) -> Any:
        """Iterate over tasks with their results as they end; a time-out ends it with the budget."""
        from distributed import as_completed

        options = {"with_results": True, "raise_errors": False, "timeout": budget}
        return as_completed(futures, loop=self.client.loop, **options)

    def _received(self, future: Any, result: Any) -> Any:
        """Return the result of a task as :func:`_result`; say if its worker compiles nothing."""
        if isinstance(result, Answer) and result.lacks:
            self._tell_interpreting({result.worker: result.lacks})
        return _result(future, result)

    def _many(self) -> int:
        """Return how many tasks keep all workers busy; looked up now and then."""
        now = time.monotonic()
        if now - self._looked > _GLANCE:
            self._looked = now
            threads = sum(self.client.nthreads().values())
            self._wanted = max(_FEWEST_AHEAD, _AHEAD * threads)
        return self._wanted


class _CancelledError(Exception):
    """A task was cancelled, not by this process."""


def _ended_workers(future: Any, result: Any) -> bool:
    """Say whether a task has ended one worker after the other."""
    from distributed import KilledWorker

    return future.status == "error" and isinstance(result[1], KilledWorker)


def _result(future: Any, result: Any) -> Any:
    """Return the result of a task that has ended.

    Raises
    ------
    ClusterError
        It ended several workers.
    LagrangeError
        That of the task, with the worker's address.
    """
    if future.status == "finished":
        assert isinstance(result, Answer)
        if result.refusal is not None:
            raise _of_worker(result.refusal, result.worker)
        return result.result
    if future.status != "error":
        raise _CancelledError
    error = result[1]
    if _ended_workers(future, result):
        hint = "as with too little memory: --memory-limit of dask worker, its log"
        raise refusal("a task ended one worker after the other that was given it", hint)
    if isinstance(error, OSError):
        raise refusal(f"a task failed on its worker: {type(error).__name__}: {error}")
    raise error


def _of_worker(error: LagrangeError, worker: str) -> LagrangeError:
    """Say on which worker an error occurred, if it is not one of the scene."""
    first, *others = error.problems
    if first.rule not in _OF_WORKERS:
        return error
    return InputError(replace(first, message=f"the worker at {worker}: {first.message}"), *others)


def _unusable(worker: str, error: object) -> ClusterError:
    hint = f"{EXTRA}, of version {__version__}, in the environment of the workers"
    return refusal(f"the worker at {worker} cannot load lagrange_cli: {error}", hint)


def _unseen(worker: str, folder: str) -> ClusterError:
    return refusal(
        f"the worker at {worker} does not see '{folder}', where results are to be written",
        "name an output in a folder that this machine and all workers share",
    )
