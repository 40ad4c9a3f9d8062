"""State of a run in a file, from which a later process goes on.

The file has the state without the samples, written whole or not at all; the samples are in a file
beside it that only grows. A run goes on from it only if nothing has changed that the result depends
on.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from typing import IO, Any

from lagrange_cli.cache import digest, fingerprint
from lagrange_cli.errors import InputError, Problem, StoppedError
from lagrange_cli.files import write_file
from lagrange_cli.simulate.checkpoint.serialization import (
    MAGIC,
    DamagedError,
    deserialize,
    serialize,
)
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.integrators.base import Integrator, SavedState
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.samples.buffer import named_file
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.version import __version__

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
        """Visit beside what is called after every step, and before it ends the run."""

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
