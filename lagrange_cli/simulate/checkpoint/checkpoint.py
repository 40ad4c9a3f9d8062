"""State of a run in a file, from which a later process goes on.

The file has the state without the samples, as plain values that are serialized without pickling,
and is written whole or not at all; the samples are in a file beside it that only grows. A run goes
on from it only if nothing has changed that the result depends on.
"""

from __future__ import annotations

import io
import json
import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.cache import digest, fingerprint
from lagrange_cli.errors import InputError, Problem, StoppedError
from lagrange_cli.files import write_file
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.integrators.base import Integrator, SavedState
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.samples import named_file
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.version import __version__

#: First bytes of a value: it is an archive.
MAGIC = b"PK\x03\x04"


class DamagedError(Exception):
    """These are not the bytes of a value."""


def _unreadable() -> tuple[type[Exception], ...]:
    """Return the exceptions that bytes which are no archive of arrays, or another one, lead to."""
    import zipfile
    import zlib

    return (
        *(OSError, ValueError, KeyError, TypeError, IndexError, EOFError, RuntimeError),
        *(MemoryError, AttributeError, zipfile.BadZipFile, zlib.error),
    )


def serialize(value: Any) -> bytes:
    """Write numbers, texts, None, arrays, and sequences and mappings of these as bytes.

    Arrays that are one object are one object again when they are read; sequences become tuples.
    """
    parts = _Arrays()
    text = json.dumps(_encoded(value, parts)).encode()
    file = io.BytesIO()
    np.savez(file, text=np.frombuffer(text, np.uint8), numbers=parts.bytes())
    return file.getvalue()


def deserialize(data: bytes) -> Any:
    """Read the value that :func:`serialize` wrote.

    Raises
    ------
    DamagedError
        The bytes are others than those it gave.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            text, numbers = arrays["text"].tobytes(), arrays["numbers"]
        return _decoded(json.loads(text), numbers, {})
    except _unreadable() as error:
        raise DamagedError(str(error)) from error


class _Arrays:
    """The bytes of arrays, one after the other, each object once."""

    def __init__(self) -> None:
        self._parts: list[NDArray[Any]] = []
        self._places: dict[int, int] = {}
        self._size = 0

    def place(self, array: NDArray[Any]) -> int:
        """Return the offset of an array's bytes."""
        if id(array) not in self._places:
            self._places[id(array)] = self._size
            self._parts.append(array)  # kept alive, so that its id stays its own
            self._size += array.nbytes
        return self._places[id(array)]

    def bytes(self) -> NDArray[np.uint8]:
        return np.frombuffer(b"".join(part.tobytes() for part in self._parts), np.uint8)


def _encoded(value: Any, arrays: _Arrays) -> Any:
    """Write values as JSON holds them: mappings and sequences as a word and their entries."""
    if isinstance(value, np.ndarray):
        # Products of matrices are summed in another order where their columns lie together.
        order = "F" if value.flags.f_contiguous and value.ndim > 1 else "C"
        return ["array", value.dtype.str, list(value.shape), arrays.place(value), order]
    if isinstance(value, np.generic):
        # Some operations give other results for numbers of NumPy than for those of Python.
        return ["number", *_encoded(np.array(value), arrays)[1:]]
    if isinstance(value, Mapping):
        return ["map", {name: _encoded(entry, arrays) for name, entry in value.items()}]
    if isinstance(value, list | tuple):
        return ["row", [_encoded(entry, arrays) for entry in value]]
    return value


def _decoded(value: Any, numbers: NDArray[Any], known: dict[Any, NDArray[Any]]) -> Any:
    if not isinstance(value, list):
        return value
    kind, *content = value
    if kind == "map":
        return {name: _decoded(entry, numbers, known) for name, entry in content[0].items()}
    if kind == "row":
        return tuple(_decoded(entry, numbers, known) for entry in content[0])
    dtype, shape, first = np.dtype(content[0]), tuple(content[1]), content[2]
    if kind == "number":
        return np.frombuffer(numbers, dtype, 1, first)[0]
    if (first, shape) not in known:
        count = int(np.prod(shape, dtype=int))
        flat = np.frombuffer(numbers, dtype, count, first) if count else np.empty(0, dtype)
        known[first, shape] = flat.reshape(shape).copy(order=content[3])
    return known[first, shape]


#: Seconds between two states that are written.
INTERVAL = 30.0

#: Parts of a run's identity, in the order in which differences are told, and the words for these.
_PARTS = {
    "program": "it was made by another version of lagrange or of its libraries",
    "code": "its equations were evaluated by other means",
    "scene": "the scene, or the form of its equations, has changed",
    "inputs": "what is recorded of its inputs has changed",
}


def samples_of(path: str, number: int) -> str:
    """Name the file that has the samples of a run."""
    return f"{path}.samples{number or ''}"


def identity(model: Model, request: Request, functions: RightHandSide) -> dict[str, Any]:
    """Gather all that a result depends on, as values that JSON holds."""
    equations = model.to_json()
    apart = ("parameters", "initial", "defaults", "recordings", "initial_decimals")
    numbers = {name: equations.pop(name) for name in apart}
    pieces = functions.recorded_inputs.pieces if functions.recorded_inputs is not None else None
    return {
        "program": (__version__, fingerprint()),
        "code": functions.implementation,
        "scene": digest(json.dumps(equations, sort_keys=True)),
        "inputs": pieces and digest(pieces.starts.tobytes(), pieces.rows.tobytes()),
        "parameters": {p["name"]: p["value"] for p in numbers["parameters"]},
        "initial": dict(zip(model.state_names, numbers["initial"], strict=True)),
        "options": _options(request),
        "decimals": digest(*(p["decimal"] for p in numbers["parameters"]), *model.initial_decimals),
    }


def _options(request: Request) -> dict[str, Any]:
    times = request.times
    return {
        "--from": float(times[0]),
        "--until": float(times[len(times) - 1]),
        "--samples": len(times),
        "--accuracy": request.accuracy,
        "--method": None if request.method is None else request.method.name,
        "--rtol": request.rtol,
        "--atol": request.atol,
        "--step": request.step,
    }


@dataclass(frozen=True)
class Checkpoint:
    """A file for the state of a run.

    Attributes
    ----------
    path
        Name of the file.
    resume
        The run goes on from the state that the file has.
    lasting
        The file stays when the run is complete, until the result is written and :meth:`remove` is
        called.
    """

    path: str
    resume: bool = False
    lasting: bool = False

    def samples(self, number: int) -> IO[bytes]:
        """Open the file that has the samples of a run, if they are not in memory.

        Raises
        ------
        InputError
            It cannot be made.
        """
        path = samples_of(self.path, number)
        return named_file(path, again=self.resume and os.path.exists(path))

    def remove(self) -> None:
        """Remove the files of a complete run."""
        with suppress(FileNotFoundError):
            os.unlink(self.path)
        with suppress(FileNotFoundError):
            for number in count():
                os.unlink(samples_of(self.path, number))


class CheckpointWriter:
    """Writes the state of a run into a file, and has that of before where it goes on.

    Parameters
    ----------
    asked
        Where, and whether to go on; else there may be no such file.
    known
        The :func:`identity` of the run.

    Raises
    ------
    InputError
        There is a file, or none, or one that is damaged or of another run.
    """

    def __init__(self, asked: Checkpoint, known: Mapping[str, Any]) -> None:
        self.path, self._known = asked.path, dict(known)
        self.before: SavedState | None = self._read() if asked.resume else None
        if not asked.resume and os.path.exists(asked.path):
            self._require_own()
            raise _refused(
                f"'{asked.path}' has the state of a run that was interrupted",
                f"--resume '{asked.path}' goes on with it; rm '{asked.path}' lets it begin anew",
            )
        self._state: Callable[[], SavedState] | None = None
        self._last = -INTERVAL

    def keep(self, state: Callable[[], SavedState]) -> None:
        """Take what gives the state from now on."""
        self._state = state

    def visit(self, *, now: bool = False) -> None:
        """Write the state, whole or not at all, if the last time was long ago, or ``now``."""
        if self._state is None or (time.monotonic() - self._last < INTERVAL and not now):
            return
        write_file(self.path, serialize({"run": self._known, "state": self._state()}))
        self._last = time.monotonic()

    def watched(self, watch: Callable[[float], None]) -> Callable[[float], None]:
        """Let the keeper be visited after every step, before the watch that may end the run."""

        def watch_and_visit(fraction: float) -> None:
            try:
                watch(fraction)
            except StoppedError:
                self.visit(now=True)
                raise
            self.visit()

        return watch_and_visit

    @staticmethod
    def require(method: type[Integrator]) -> None:
        """Refuse a method that cannot go on.

        Raises
        ------
        InputError
            Its state is out of reach.
        """
        if not method.resumes:
            can = ", ".join(name for name, integrator in INTEGRATORS.items() if integrator.resumes)
            raise _refused(
                f"{method.name} cannot be interrupted and go on: its state is out of reach",
                f"--method BDF\nmethods that can: {can}",
            )

    def damaged(self) -> InputError:
        """Make the refusal of files that are not those that were written."""
        return _refused(f"'{self.path}' is damaged, or was not written by --checkpoint")

    def _require_own(self) -> None:
        """Refuse to write over what is no checkpoint, with no word of removing it."""
        try:
            self._contents()
        except (OSError, DamagedError, KeyError, TypeError) as error:
            raise _refused(
                f"'{self.path}' is there already, and was not written by --checkpoint",
                "give the name of a file that is not there",
            ) from error

    def _contents(self) -> tuple[SavedState, SavedState]:
        """Read the identity and the state of the run in the file; a device or pipe is refused."""
        if os.path.exists(self.path) and not os.path.isfile(self.path):
            raise DamagedError
        with open(self.path, "rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise DamagedError
            file.seek(0)
            content = deserialize(file.read())
        return content["run"], content["state"]

    def _read(self) -> SavedState:
        try:
            was, state = self._contents()
        except OSError as error:
            raise _refused(
                f"cannot read '{self.path}': {error.strerror or error}",
                f"--checkpoint '{self.path}' begins a run that writes it",
            ) from error
        except (DamagedError, KeyError, TypeError) as error:
            raise self.damaged() from error
        difference = _difference(was, self._known)
        if difference:
            raise _refused(
                f"'{self.path}' is of another run: {difference}",
                "give the scene and the options of that run, or begin anew without --resume",
            )
        return dict(state)


def _refused(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="resume"))


def _difference(was: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Say in words the first difference; empty if there is none."""
    for name, words in _PARTS.items():
        if was.get(name) != now[name]:
            return words
    for kind in ("parameters", "initial", "options"):
        before = was.get(kind, {})
        for name, value in now[kind].items():
            old = before.get(name)
            if old != value:
                return f"{name} was {_shown(old)} and is {_shown(value)}"
    return "" if was.get("decimals") == now["decimals"] else _PARTS["scene"]


def _shown(value: Any) -> str:
    if value is None:
        return "not given"
    return f"{value:.17g}" if isinstance(value, float) else str(value)
