"""Inputs from files: polynomials between the rows of a recording, and where they hold.

Between two rows an input is a polynomial in the time since the first of them: that row's
value (``previous``), a straight line (``linear``), or a cubic with two continuous
derivatives over all rows and a third one at the second and the last row but one (``cubic``,
the "not-a-knot" spline; de Boor, *A Practical Guide to Splines*, IV). Its coefficients are
numbers that change from piece to piece; nothing is compiled for them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.files import Interpolation, Recorded, Recording, read_recording
from lagrange_cli.simulate.disturbance import off_by_one_ulp
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.integrators.pieces import Pieces

__all__ = ["COEFFICIENTS", "Drive", "drive_of"]

#: Coefficients of a piece of each interpolation; with more than one, the time from which
#: they count stands before them.
COEFFICIENTS: dict[Interpolation, int] = {"previous": 1, "linear": 2, "cubic": 4}

#: Numbers of all pieces together.
_MOST_NUMBERS = 20_000_000


@dataclass(frozen=True)
class Drive:
    """The inputs of a model from files: their pieces, and ``first`` to ``last`` time of each."""

    pieces: Pieces
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

    def disturbed(self, pattern: int) -> Pieces:
        """The pieces with every number off by its rounding error."""
        return Pieces(self.pieces.starts, off_by_one_ulp(self.pieces.rows, pattern))


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


def drive_of(recordings: Sequence[Recording]) -> Drive | None:
    """Read the recordings; None where there are none.

    Raises
    ------
    InputError
        Located: one of them cannot be read, or changes faster than doubles can say.
    """
    if not recordings:
        return None
    found = [read_recording(recording) for recording in recordings]
    each = [_pieces(recording, of) for recording, of in zip(recordings, found, strict=True)]
    return Drive(
        _together(each, recordings[0].mark),
        tuple(recordings),
        tuple(_span(r.interpolation, of) for r, of in zip(recordings, found, strict=True)),
    )


def _span(interpolation: Interpolation, recorded: Recorded) -> tuple[float, float]:
    """Where an input is known: what is held until the next row is held after the last too."""
    last = math.inf if interpolation == "previous" else recorded.times[-1]
    return recorded.times[0], last


def _pieces(recording: Recording, recorded: Recorded) -> Pieces:
    times, values = np.array(recorded.times), np.array(recorded.values)
    if recording.interpolation == "previous":
        return Pieces(times, values[:, None])
    with np.errstate(all="ignore"):
        rows = np.column_stack([times[:-1], *_polynomials(recording, times, values)])
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(bad):
        raise InputError(
            Problem(
                f"'{recording.file}' changes faster than doubles can say"
                f" after t = {recorded.times[bad[0]]!r}",
                recording.mark,
                rule="recording",
            )
        )
    return Pieces(times[:-1], rows)


def _polynomials(recording: Recording, times: Array, values: Array) -> list[Array]:
    """Coefficients of every piece, the lowest first."""
    slopes = np.diff(values) / np.diff(times)
    if recording.interpolation == "linear" or not np.isfinite(slopes).all():
        return [values[:-1], slopes]
    from scipy.interpolate import CubicSpline

    try:
        return list(np.flip(CubicSpline(times, values).c, axis=0))
    except (ValueError, np.linalg.LinAlgError):
        return [values[:-1], *np.full((3, len(slopes)), np.nan)]


def _together(each: Sequence[Pieces], mark: Mark) -> Pieces:
    """The pieces of all inputs side by side: one begins where any of them does."""
    starts = np.unique(np.concatenate([pieces.starts for pieces in each]))
    width = sum(pieces.rows.shape[1] for pieces in each)
    if len(starts) * width > _MOST_NUMBERS:
        raise InputError(
            Problem(
                f"recordings with {len(starts):,} different times are too many beside each other",
                mark,
                hint="record the inputs at the same times",
                rule="limit",
            )
        )
    held = [np.searchsorted(pieces.starts, starts, side="right") - 1 for pieces in each]
    parts = [p.rows[np.maximum(k, 0)] for p, k in zip(each, held, strict=True)]
    return Pieces(starts, np.hstack(parts))
