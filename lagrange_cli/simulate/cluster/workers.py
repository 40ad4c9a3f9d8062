"""A function that is packed once, and the work that workers do with it.

Results depend on versions of Python, of libraries, and of this program and its code: a worker with
others is refused.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import secrets
import sys
import threading
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Protocol, TypeVar

from lagrange_cli.errors import InputError, LagrangeError, Problem
from lagrange_cli.files import is_address
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.version import __version__

#: How what a cluster needs is installed.
EXTRA = "pip install 'lagrange-cli[distributed]'"


class ClusterError(InputError):
    """A cluster cannot be used as it is, or was lost."""


def refusal(message: str, hint: str = "") -> ClusterError:
    """Return the refusal of a cluster."""
    return ClusterError(Problem(message, hint=hint, rule="cluster"))


#: Libraries that results and their way to this process depend on.
_LIBRARIES = ("numpy", "scipy", "sympy", "mpmath", "dask", "distributed", "cloudpickle")

#: The name under which the digest of this program's sources stands.
_CODE = "the code of lagrange_cli"


@cache
def installed() -> dict[str, str]:
    """Return the versions on which results of this process depend, by name."""
    versions = {"python": sys.version.split()[0], "lagrange_cli": __version__}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "none"
    return {**versions, _CODE: _code_digest()}


def _code_digest() -> str:
    """Hash the contents of the package's sources, in 12 digits."""
    package = next(iter(sys.modules["lagrange_cli"].__path__))
    hasher = hashlib.sha256()
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


def difference(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """Say which versions differ, or ``""``."""
    names = [name for name in here if here[name] != there.get(name, "none")]
    if names and names[-1] == _CODE and len(names) > 1:
        names.pop()  # of course: another version of it, or other libraries, say enough
    return ", ".join(
        f"{name} {there.get(name, 'none')} where this process has {here[name]}" for name in names
    )


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
    """Facts that a worker reports about itself before the run.

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
