"""Inputs from files: their pieces side by side, and where they are known; and from Python.

The coefficients of :mod:`lagrange_cli.files.interpolation` are numbers that change from piece to
piece; nothing is compiled for them. Functions of Python are called at every evaluation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.cache import digest
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.simulate.integrators.right_hand_side import InputPieces
from lagrange_cli.simulate.system.rounding import off_by_one_ulp

if TYPE_CHECKING:
    from lagrange_cli.files import Recording
    from lagrange_cli.files.interpolation import Polynomials

#: Numbers of all pieces together.
MOST_TABLE_NUMBERS = 20_000_000


@dataclass(frozen=True)
class RecordedInputs:
    """Inputs of a model that are read from files, or are functions of Python.

    Attributes
    ----------
    pieces
        Coefficients of all recorded inputs, piece by piece, and the functions.
    recordings
        File and column of each input.
    spans
        First and last time of each input.
    """

    pieces: InputPieces
    recordings: tuple[Recording, ...]
    spans: tuple[tuple[float, float], ...]

    def require(self, start: float, until: float) -> None:
        """Refuse a run beyond what is recorded.

        Raises
        ------
        InputError
            Located at the first recording that begins later or ends earlier.
        """
        for recording, (first, last) in zip(self.recordings, self.spans, strict=True):
            if not first <= start <= until <= last:
                raise _beyond(recording, (first, last), (start, until))

    def perturbed(self, pattern: int) -> InputPieces:
        """Return the pieces with every number off by its rounding error."""
        pieces = self.pieces
        ends = off_by_one_ulp(np.ones(len(pieces.functions)), pattern) > 1
        functions = zip(pieces.functions, np.where(ends, math.inf, -math.inf).tolist(), strict=True)
        return InputPieces(
            pieces.starts,
            off_by_one_ulp(pieces.rows, pattern),
            tuple(partial(_beside, function, end) for function, end in functions),
        )


def digest_of_files(recordings: Sequence[Recording]) -> str:
    """Hash the files of recordings as they are now; refuses as :func:`read_recorded_inputs`."""
    from lagrange_cli.files import read_recorded_file

    return digest(*map(read_recorded_file, recordings))


def _beside(function: Callable[[float], float], end: float, t: float) -> float:
    return math.nextafter(function(t), end)


def with_functions(
    recorded: RecordedInputs | None, functions: Mapping[str, Callable[[float], float]]
) -> RecordedInputs | None:
    """Put functions of time, by the names of their inputs, behind recorded inputs."""
    if not functions:
        return recorded
    nothing = RecordedInputs(InputPieces(np.array([-math.inf]), np.empty((1, 0))), (), ())
    inputs = recorded or nothing
    checked = tuple(partial(_value, name, function) for name, function in functions.items())
    return replace(inputs, pieces=replace(inputs.pieces, functions=checked))


def _value(name: str, function: Callable[[float], float], t: float) -> float:
    """Evaluate an input.

    Raises
    ------
    InputError
        It has no value, or none that is finite.
    """
    try:
        value = float(function(float(t)))
    except (ArithmeticError, ValueError) as error:
        # The code of the equations would take them for its own.
        raise _without_value(name, t, f"{type(error).__name__}: {error}") from error
    if not math.isfinite(value):
        raise _without_value(name, t, repr(value))
    return value


def _without_value(name: str, t: float, what: str) -> InputError:
    said = f"the input '{name}' has no finite value at t = {float(t)!r}: {what}"
    return InputError(Problem(said, rule="inputs"))


def _beyond(
    recording: Recording, span: tuple[float, float], run: tuple[float, float]
) -> InputError:
    first, last = max(span[0], run[0]), min(span[1], run[1])
    options = [
        *([f"--from {first!r}"] if span[0] > run[0] else []),
        *([f"--until {last!r}"] if span[1] < run[1] else []),
    ]
    ends = f"ends at t = {span[1]!r}" if math.isfinite(span[1]) else "goes on"
    return InputError(
        Problem(
            f"'{recording.file}' begins at t = {span[0]!r} and {ends},"
            f" the run goes from {run[0]!r} to {run[1]!r}",
            recording.mark,
            hint=" ".join(options) if first < last else "record or simulate another time",
            rule="recording",
        )
    )


def read_recorded_inputs(recordings: Sequence[Recording]) -> RecordedInputs | None:
    """Read the recordings; None if there are none.

    Raises
    ------
    InputError
        Located: one of them cannot be read, or changes faster than doubles can say.
    """
    if not recordings:
        return None
    from lagrange_cli.files.interpolation import polynomials

    inputs = [polynomials(recording) for recording in recordings]
    spans = tuple((float(recorded.starts[0]), recorded.end) for recorded in inputs)
    pieces = _merged([_pieces(recorded) for recorded in inputs], recordings[0].mark)
    return RecordedInputs(pieces, tuple(recordings), spans)


def _pieces(recorded: Polynomials) -> InputPieces:
    """Put coefficients behind the time from which they count, which a single one does not need."""
    starts, coefficients = recorded.starts, recorded.coefficients
    columns = [coefficients] if coefficients.shape[1] == 1 else [starts, coefficients]
    return InputPieces(starts, np.column_stack(columns))


def _merged(each: Sequence[InputPieces], mark: Mark) -> InputPieces:
    """Merge the pieces of all inputs: one begins where any of them does."""
    starts = np.unique(np.concatenate([pieces.starts for pieces in each]))
    width = sum(pieces.rows.shape[1] for pieces in each)
    if len(starts) * width > MOST_TABLE_NUMBERS:
        raise InputError(
            Problem(
                f"recordings with {len(starts):,} different times are too many beside each other",
                mark,
                hint="record the inputs at the same times",
                rule="limit",
            )
        )
    numbers = [np.searchsorted(pieces.starts, starts, side="right") - 1 for pieces in each]
    parts = [p.rows[np.maximum(k, 0)] for p, k in zip(each, numbers, strict=True)]
    return InputPieces(starts, np.hstack(parts))
