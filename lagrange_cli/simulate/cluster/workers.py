"""A function that is packed once, and what workers do with it."""

from __future__ import annotations

import os
import pickle
import secrets
import threading
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeVar

from lagrange_cli.errors import LagrangeError
from lagrange_cli.files import is_address
from lagrange_cli.simulate.cluster.installed import difference, installed
from lagrange_cli.simulate.cluster.refusals import refusal
from lagrange_cli.simulate.toolchain.compiler import CompileError, find_compiler

_Task = TypeVar("_Task", contravariant=True)
_Result = TypeVar("_Result", covariant=True)

#: Functions that a worker keeps open.
_MOST_OPENED = 4


class Work(Protocol[_Task, _Result]):
    """A function of tasks that is sent to workers once."""

    def __call__(self, task: _Task, /) -> _Result:
        """Do a task."""

    def prepare(self) -> None:
        """Compile what all tasks need; done by one worker of each host before the first task."""


@dataclass(frozen=True)
class Parcel:
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


def _open(parcel: Parcel) -> Work[Any, Any]:
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


def _require_alike(parcel: Parcel) -> None:
    """Refuse a worker that came after the others were asked, and is unlike them."""
    different = difference(parcel.installed, installed())
    if different:
        raise refusal(f"it has {different}")
    if parcel.watched is not None and not exists(parcel.watched):
        raise refusal(f"it does not see '{os.path.dirname(parcel.watched)}' as it is here")


def _unpacked(parcel: Parcel) -> Work[Any, Any]:
    import cloudpickle

    try:
        work: Work[Any, Any] = cloudpickle.loads(zlib.decompress(parcel.content))
    except (ImportError, AttributeError) as error:
        hint = "functions of your own must be importable there, or defined in the script itself"
        raise refusal(f"it cannot load what the run needs: {error}", hint) from error
    return work


@dataclass(frozen=True)
class Answer:
    """The end of a task.

    Attributes
    ----------
    worker
        The one that was given it.
    lacks
        Why that worker compiles nothing, or ``""``.
    result
        Of the task.
    refusal
        What it ended with instead; None if it has a result.
    """

    worker: str
    lacks: str
    result: Any = None
    refusal: LagrangeError | None = None


def do(parcel: Parcel, task: Any) -> Answer:
    """Do a task on a worker."""
    return _answer(lambda: _open(parcel)(task))


def prepare(parcel: Parcel) -> Answer:
    return _answer(lambda: _open(parcel).prepare())


def _answer(work: Callable[[], Any]) -> Answer:
    answer = Answer(_worker_name(), without_compiler())
    try:
        return replace(answer, result=work())
    except LagrangeError as error:
        return replace(answer, refusal=error)


def _worker_name() -> str:
    from distributed import get_worker

    with suppress(ValueError):
        return str(get_worker().address)
    return "unknown"


def itself(parcel: Parcel) -> Parcel:
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
class Findings:
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


def findings(watched: str | None) -> Findings:
    return Findings(installed(), watched is None or exists(watched), without_compiler())


def without_compiler() -> str:
    try:
        find_compiler()
    except CompileError as error:
        return error.reason
    return ""


def packed(work: Work[Any, Any], watched: str | None) -> Parcel:
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
    return Parcel(secrets.token_hex(8), installed(), watched, content)
