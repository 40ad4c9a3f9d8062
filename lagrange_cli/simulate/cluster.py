"""One function of many tasks, on the workers of a user's Dask cluster.

The function travels once, with all that it needs; tasks are small and so are their results. Workers
that run other versions than this process are refused before anything is run. Lost workers are
Dask's to replace: their tasks are run again by others. No scheduler is started here.
"""

from __future__ import annotations

import hashlib
import itertools
import logging
import math
import os
import pickle
import secrets
import sys
import threading
import time
import warnings
import zlib
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from itertools import islice
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from lagrange_cli.errors import InputError, LagrangeError, Problem
from lagrange_cli.files import is_address
from lagrange_cli.simulate.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from distributed import Client

_Task_contra = TypeVar("_Task_contra", contravariant=True)
_Result_co = TypeVar("_Result_co", covariant=True)
_Task = TypeVar("_Task")
_Result = TypeVar("_Result")

#: Libraries that results and their way to this process depend on.
_LIBRARIES = ("numpy", "scipy", "sympy", "mpmath", "dask", "distributed", "cloudpickle")

#: Rules of problems that are those of a worker, whatever is run on it.
_OF_WORKERS = {"cluster", "output"}

#: Seconds until a scheduler that does not answer is refused.
_PATIENCE = 5.0

#: Seconds that are left to a connection to be closed.
_FAREWELL = 2.0

#: Tasks that are given to each thread of the cluster, so that none waits for the next one.
_AHEAD = 3

#: The same of a cluster that has few threads, or none yet.
_FEWEST_AHEAD = 8

#: Seconds between two looks at how many threads there are.
_GLANCE = 2.0

#: Seconds in which a new file must be seen by all workers, and between two looks.
_SEEN_WITHIN, _LOOK_AGAIN = 3.0, 0.25

_EXTRA = "pip install 'lagrange-cli[distributed]'"


class ClusterError(InputError):
    """A cluster cannot be used as it is, or was lost."""


def refusal(message: str, hint: str = "") -> ClusterError:
    """Return the refusal of a cluster."""
    return ClusterError(Problem(message, hint=hint, rule="cluster"))


class Work(Protocol[_Task_contra, _Result_co]):
    """A function of tasks that is sent to workers once."""

    def __call__(self, task: _Task_contra, /) -> _Result_co:
        """Do a task."""

    def prepare(self) -> None:
        """Compile what all tasks need; done by one worker of each host before the first task."""


@contextmanager
def connected(address: str) -> Iterator[Client]:
    """Connect to a scheduler for a while.

    Raises
    ------
    ClusterError
        There is none at this address, or Dask is not installed.
    """
    if find_spec("distributed") is None:
        raise ClusterError(
            Problem("a cluster needs dask and distributed", hint=_EXTRA, rule="missing-extra")
        )
    from distributed import Client

    _silence()
    try:
        with warnings.catch_warnings():
            # Versions that differ are refused later, by name.
            warnings.simplefilter("ignore")
            client = Client(address, timeout=_PATIENCE, set_as_default=False, name="lagrange")
    except (OSError, ValueError, RuntimeError, TypeError) as error:
        hint = "'dask scheduler' starts one and says its address; --on local runs here"
        reason = str(error).strip().splitlines()[:1] or [type(error).__name__]
        raise refusal(f"no Dask scheduler answers at {address}: {reason[0]}", hint) from None
    try:
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=_FAREWELL)


def _silence() -> None:
    """Let nothing but this program speak of lost connections."""
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


# What is installed.


@cache
def installed() -> dict[str, str]:
    """Return what results depend on in this process: name → version."""
    found = {"python": sys.version.split()[0], "lagrange_cli": __version__}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return {**found, "the code of lagrange_cli": _code_digest()}


def _code_digest() -> str:
    """Hash the contents of the package's sources, in 12 digits."""
    package, hasher = os.path.dirname(os.path.dirname(os.path.abspath(__file__))), hashlib.sha256()
    for folder, folders, files in os.walk(package):
        folders.sort()
        for name in sorted(files):
            if name.endswith((".py", ".c", ".h", ".in")):
                path = os.path.join(folder, name)
                with open(path, "rb") as stream:
                    data = stream.read()
                hasher.update(f"{os.path.relpath(path, package)}\0{len(data)}\0".encode())
                hasher.update(data)
    return hasher.hexdigest()[:12]


def _difference(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """Say which versions differ, or ``""``."""
    names = [name for name in here if here[name] != there.get(name, "none")]
    if names and names[-1] == "the code of lagrange_cli" and len(names) > 1:
        names.pop()  # of course: another version of it, or other libraries, say enough
    return ", ".join(
        f"{name} {there.get(name, 'none')} where this process has {here[name]}" for name in names
    )


# On a worker.


@dataclass(frozen=True)
class _Parcel:
    """A function with all that it needs, packed once and opened once by each worker.

    Attributes
    ----------
    token
        Of this run, by which workers know it again.
    installed
        What is installed where it was packed.
    watched
        A file of the run that workers must see; None if there is none.
    content
        The function, serialized and compressed.
    """

    token: str
    installed: Mapping[str, str] = field(compare=False)
    watched: str | None = field(compare=False)
    content: bytes = field(compare=False)


_opened: dict[str, Work[Any, Any]] = {}
_opening = threading.Lock()

#: Functions that a worker keeps open.
_MOST_OPENED = 4


def _open(parcel: _Parcel) -> Work[Any, Any]:
    """Return the function of a parcel.

    Raises
    ------
    ClusterError
        It cannot be run here as where it was packed.
    """
    with _opening:
        if parcel.token not in _opened:
            _require_alike(parcel)
            while len(_opened) >= _MOST_OPENED:
                _opened.pop(next(iter(_opened)))
            _opened[parcel.token] = _unpacked(parcel)
        return _opened[parcel.token]


def _require_alike(parcel: _Parcel) -> None:
    """Refuse a worker that came after the others were asked, and is unlike them."""
    different = _difference(parcel.installed, installed())
    if different:
        raise refusal(f"it has {different}")
    if parcel.watched is not None and not exists(parcel.watched):
        raise refusal(f"it does not see '{os.path.dirname(parcel.watched)}' as it is here")


def _unpacked(parcel: _Parcel) -> Work[Any, Any]:
    import cloudpickle

    try:
        work: Work[Any, Any] = cloudpickle.loads(zlib.decompress(parcel.content))
    except (ImportError, AttributeError) as error:
        hint = "functions of your own must be importable there, or defined in the script itself"
        raise refusal(f"it cannot load what the run needs: {error}", hint) from error
    return work


@dataclass(frozen=True)
class _Answer:
    """The result of a task, or the refusal that it ended with and the worker that refused."""

    result: Any
    refusal: LagrangeError | None = None
    worker: str = ""


def _do(parcel: _Parcel, task: Any) -> _Answer:
    """Do a task on a worker."""
    try:
        return _Answer(_open(parcel)(task))
    except LagrangeError as error:
        return _Answer(None, error, _worker_name())


def _prepare(parcel: _Parcel) -> _Answer:
    try:
        _open(parcel).prepare()
    except LagrangeError as error:
        return _Answer(None, error, _worker_name())
    return _Answer(None)


def _worker_name() -> str:
    from distributed import get_worker

    with suppress(ValueError):
        return str(get_worker().address)
    return "unknown"


def _itself(parcel: _Parcel) -> _Parcel:
    return parcel


def exists(path: str) -> bool:
    """Say whether there is such a file, by its path or its address."""
    if not is_address(path):
        return os.path.exists(path)
    import fsspec

    files, place = fsspec.core.url_to_fs(path)
    files.invalidate_cache()
    return bool(files.exists(place))


@dataclass(frozen=True)
class _Findings:
    """What a worker finds out about itself before the run.

    Attributes
    ----------
    installed
        As :func:`installed`.
    sees
        It sees the file that is watched.
    lacks
        Why it compiles nothing, or ``""``.
    """

    installed: Mapping[str, str]
    sees: bool
    lacks: str


def _findings(watched: str | None) -> _Findings:
    return _Findings(installed(), watched is None or exists(watched), _without_compiler())


def _without_compiler() -> str:
    try:
        find_compiler()
    except CompileError as error:
        return error.reason
    return ""


# Here.


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

    def in_any_order(
        self, work: Work[_Task, _Result], tasks: Iterable[_Task], watched: str | None = None
    ) -> Generator[_Result, None, None]:
        """Yield the results of tasks as they are found; closing the iterator cancels the others.

        Parameters
        ----------
        work
            Sent to workers once.
        tasks
            Asked for as they can be begun.
        watched
            A file, or its address, that all workers must see.

        Raises
        ------
        ClusterError
            Workers are unlike this process, or the scheduler was lost.
        LagrangeError
            That of a task.
        """
        from distributed.comm import CommClosedError
        from distributed.client import ClosedClientError

        address = getattr(self.client.scheduler, "address", "its address")
        try:
            self._require_alike_workers(watched)
            yield from self._results(_packed(work, watched), iter(tasks))
        except (ClosedClientError, CommClosedError, TimeoutError, ConnectionError) as error:
            raise refusal(f"the scheduler at {address} was lost") from error
        except _CancelledError:
            raise refusal(f"the scheduler at {address} was lost, or gave up the run") from None

    def _require_alike_workers(self, watched: str | None) -> None:
        """Refuse the cluster if a worker is unlike this process; say which interpret."""
        found = self._found(watched)
        for worker, findings in found.items():
            different = _difference(installed(), findings.installed)
            if different:
                hint = "the same environment everywhere gives the same results everywhere"
                raise refusal(f"the worker at {worker} has {different}", hint)
            if watched is not None and not findings.sees:
                raise _unseen(worker, os.path.dirname(watched))
        interpreting = [worker for worker, findings in found.items() if findings.lacks]
        if interpreting and not _without_compiler():
            reason = found[interpreting[0]].lacks
            self.tell(f"interpreted, and slower, on {', '.join(interpreting)}: {reason}")
        if not found:
            self.tell("the cluster has no workers yet: waiting for them")

    def _found(self, watched: str | None) -> dict[str, _Findings]:
        """Ask all workers what they are; again while one does not see a file that is new."""
        given_up = time.monotonic() + _SEEN_WITHIN
        while True:
            found = self.client.run(_findings, watched, on_error="return")
            for worker, findings in found.items():
                if not isinstance(findings, _Findings):
                    raise _unusable(worker, findings)
            seen = all(findings.sees for findings in found.values())
            if seen or time.monotonic() > given_up:
                return dict(found)
            time.sleep(_LOOK_AGAIN)

    def _results(self, parcel: _Parcel, waiting: Iterator[_Task]) -> Generator[Any, None, None]:
        """Yield the results of tasks, of which as many are under way as keep workers busy."""
        from distributed import as_completed

        pending, numbers = set[Any](), itertools.count()
        completed = as_completed(loop=self.client.loop, with_results=True, raise_errors=False)
        # A task, not scattered: what a lost worker held is sent again.
        shared = self._submit(_itself, parcel, key=f"lagrange-{parcel.token}")
        try:
            self._prepare(shared)
            while True:
                for task in islice(waiting, max(0, self._many() - len(pending))):
                    key = f"lagrange-{parcel.token}-{next(numbers)}"
                    future = self._submit(_do, shared, task, key=key)
                    pending.add(future)
                    completed.add(future)
                if not pending:
                    return
                future, result = next(completed)
                pending.discard(future)
                yield _received(future, result)
        finally:
            if self.client.status == "running":
                with suppress(Exception):
                    self.client.cancel([shared, *pending])

    def _submit(self, function: Callable[..., Any], *args: Any, **options: Any) -> Any:
        with warnings.catch_warnings():
            # That a model of many equations is large.
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self.client.submit(function, *args, pure=False, **options)

    def _prepare(self, shared: Any) -> None:
        """Let one worker of each host compile, so that the others find it done."""
        hosts = {worker.rpartition(":")[0]: worker for worker in self.client.nthreads()}
        futures = [
            self._submit(_prepare, shared, workers=[worker], allow_other_workers=True)
            for worker in hosts.values()
        ]
        from distributed import as_completed

        ready = as_completed(
            futures, loop=self.client.loop, with_results=True, raise_errors=False
        )
        for future, result in ready:
            _received(future, result)

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


def _received(future: Any, result: Any) -> Any:
    """Return the result of a task that has ended.

    Raises
    ------
    ClusterError
        It ended several workers.
    LagrangeError
        That of the task, with the worker's address.
    """
    from distributed import KilledWorker

    if future.status == "finished":
        assert isinstance(result, _Answer)
        if result.refusal is not None:
            raise _of_worker(result.refusal, result.worker)
        return result.result
    if future.status != "error":
        raise _CancelledError
    error = result[1]
    if isinstance(error, KilledWorker):
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
    hint = f"{_EXTRA}, of version {__version__}, in the environment of the workers"
    return refusal(f"the worker at {worker} cannot load lagrange_cli: {error}", hint)


def _unseen(worker: str, folder: str) -> ClusterError:
    return refusal(
        f"the worker at {worker} does not see '{folder}', where results are to be written",
        "name an output in a folder that this machine and all workers share",
    )


def _packed(work: Work[Any, Any], watched: str | None) -> _Parcel:
    """Pack a function.

    Raises
    ------
    ClusterError
        Something of it cannot be sent.
    """
    import cloudpickle

    try:
        content = zlib.compress(cloudpickle.dumps(work), 1)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise refusal(f"a function cannot be sent to workers: {error}") from error
    return _Parcel(secrets.token_hex(8), installed(), watched, content)
