"""Recordings as code has them: polynomials between rows, and the text that evaluates them.

Between two rows an input is a polynomial in the time since the first of them: that row's
value (``previous``), a straight line (``linear``), or a cubic (``cubic``) with two
continuous derivatives at all rows and a third one at the second and the last but one (the
"not-a-knot" spline; de Boor, *A Practical Guide to Splines*, IV).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import Interpolation, Recording, read_recording

if TYPE_CHECKING:
    from lagrange_cli.emit.c_names import Real
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["COEFFICIENTS", "Polynomials", "c_recorded", "polynomials", "python_recorded"]

#: Coefficients of the polynomials of each interpolation.
COEFFICIENTS: dict[Interpolation, int] = {"previous": 1, "linear": 2, "cubic": 4}

#: Numbers of a recording that are written into code.
MOST_WRITTEN = 100_000

#: How far beyond a recording, as a part of it, rounding of times may lead.
ROUNDING = 1e-9

_Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Polynomials:
    """What an input is from each of ``starts`` to the next, and until ``end`` (or infinity).

    ``coefficients`` of the time since the start, the lowest first: shape (len(starts), k).
    """

    recording: Recording
    starts: _Array
    coefficients: _Array
    end: float


def polynomials(recording: Recording) -> Polynomials:
    """Read a recording.

    Raises
    ------
    InputError
        Located: it cannot be read, or changes faster than doubles can say.
    """
    found = read_recording(recording)
    times, values = np.array(found.times), np.array(found.values)
    if recording.interpolation == "previous":
        # What is held until the next row is held after the last one too.
        return Polynomials(recording, times, values[:, None], math.inf)
    with np.errstate(all="ignore"):
        coefficients = _coefficients(recording.interpolation, times, values)
    bad = np.flatnonzero(~np.isfinite(coefficients).all(axis=1))
    if len(bad):
        raise InputError(
            Problem(
                f"'{recording.file}' changes faster than doubles can say"
                f" after t = {found.times[bad[0]]!r}",
                recording.mark,
                rule="recording",
            )
        )
    return Polynomials(recording, times[:-1], coefficients, found.times[-1])


def _coefficients(interpolation: Interpolation, times: _Array, values: _Array) -> _Array:
    slopes = np.diff(values) / np.diff(times)
    if interpolation == "linear" or not np.isfinite(slopes).all():
        return np.column_stack([values[:-1], slopes])
    from scipy.interpolate import CubicSpline

    try:
        return np.asarray(np.flip(CubicSpline(times, values).c, axis=0).T)
    except (ValueError, np.linalg.LinAlgError):
        return np.full((len(slopes), 4), np.nan)


def _written(equations: Equations) -> list[tuple[int, Polynomials]]:
    """The recorded inputs by number.

    Raises
    ------
    InputError
        Located: one of them is too long to be written into code, or cannot be read.
    """
    found = [
        (number, polynomials(given.recording))
        for number, given in enumerate(equations.inputs)
        if given.recording is not None
    ]
    for _, of in found:
        if of.coefficients.size > MOST_WRITTEN:
            raise InputError(
                Problem(
                    f"'{of.recording.file}' is too long to be written into code:"
                    f" {of.coefficients.size:,} numbers, the most are {MOST_WRITTEN:,}",
                    of.recording.mark,
                    hint="lagrange simulate reads it whole; the functions of emitted C"
                    " take inputs from their caller",
                    rule="limit",
                )
            )
    return found


# Python.

_PYTHON = '''\
def recorded(t, y, p, at=None):
    """The recorded inputs at time t, with what lies between two rows continued from the time
    at, by default t itself; NaN for the others, and outside a recording."""
    values = [nan] * len(INPUTS)
    for number, end, rows in RECORDED:
        within = @ROUNDING@ * (end - rows[0][0]) if end < inf else 0.0
        if rows[0][0] - within <= t <= end + within:
            row = bisect_right(rows, (t if at is None else at, inf)) - 1
            start, *coefficients = rows[max(row, 0)]
            values[number] = 0.0
            for coefficient in reversed(coefficients):
                values[number] = values[number] * (t - start) + coefficient
    return values
'''


def python_recorded(equations: Equations) -> list[str]:
    """The recordings of the inputs, and the function ``recorded``; nothing where there are none."""
    found = _written(equations)
    if not found:
        return []
    lines = ["#: Number of the input, end, and rows: a start, coefficients from the lowest."]
    lines.append("RECORDED = [")
    for number, of in found:
        end = "inf" if math.isinf(of.end) else repr(of.end)
        lines += [
            f"    # {comment_text(_described(equations, number))}",
            f"    ({number}, {end}, [",
        ]
        lines += [f"        {_row(of, k)}," for k in range(len(of.starts))]
        lines.append("    ]),")
    return ["\n".join([*lines, "]", ""]), _PYTHON.replace("@ROUNDING@", repr(ROUNDING))]


def _row(of: Polynomials, k: int) -> tuple[float, ...]:
    return (float(of.starts[k]), *map(float, of.coefficients[k]))


def _described(equations: Equations, number: int) -> str:
    given: Any = equations.inputs[number]
    return f"{given.name}: {given.recording.described}"


# C.

_C = """\
/* @TEXT@, at t with what lies between two rows continued from the time at. */
static @REAL@ @NAME@_recorded_@K@(@REAL@ t, @REAL@ at)
{
    static const @REAL@ rows[@ROWS@][@WIDTH@] = {
@NUMBERS@
    };
    @REAL@ value = @ZERO@;
    int low = 0, high = @ROWS@, k;
    while (high - low > 1) {
        const int middle = (low + high)/2;
        if (rows[middle][0] <= at) {
            low = middle;
        } else {
            high = middle;
        }
    }
    for (k = @WIDTH@ - 1; k > 0; --k) {
        value = value*(t - rows[low][0]) + rows[low][k];
    }
    return value;
}
"""

_C_BOUNDS = """\
    if (!(start >= @FIRST@@UNTIL@)) {
        fprintf(stderr, "%s\\n", @TEXT@);
        return 2;
    }
"""


@dataclass(frozen=True)
class CRecorded:
    """Functions that give recorded inputs, statements that set ``u``, and checks of the run."""

    functions: str
    setting: str
    checks: str


def c_recorded(equations: Equations, prefix: str, real: Real) -> CRecorded:
    """What a ``main`` needs of recordings; all empty where there are none."""
    from lagrange_cli.emit.c_names import c_string

    functions, setting, checks = "", "", ""
    for number, of in _written(equations):
        name = comment_text(_described(equations, number))
        rows = [", ".join(map(real.value, _row(of, k))) for k in range(len(of.starts))]
        text = _C.replace("@NUMBERS@", ",\n".join(f"        {{{row}}}" for row in rows))
        for token, value in (
            ("@TEXT@", name),
            ("@REAL@", real.name),
            ("@NAME@", prefix),
            ("@K@", str(number)),
            ("@ROWS@", str(len(rows))),
            ("@WIDTH@", str(of.coefficients.shape[1] + 1)),
            ("@ZERO@", real.value(0.0)),
        ):
            text = text.replace(token, value)
        functions += f"\n{text}"
        call = f"{prefix}_recorded_{number}(t + at[stage]*h, t + at[1]*h)"
        setting += f"        u[{number}] = {call};\n"
        ends = "" if math.isinf(of.end) else f" && until <= {real.value(of.end)}"
        says = "goes on" if math.isinf(of.end) else f"ends at t = {of.end!r}"
        message = c_string(f"{name}: begins at t = {float(of.starts[0])!r}, {says}")
        bounds = _C_BOUNDS.replace("@FIRST@", real.value(float(of.starts[0])))
        checks += bounds.replace("@UNTIL@", ends).replace("@TEXT@", message)
    return CRecorded(functions, setting, checks)
