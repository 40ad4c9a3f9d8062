"""Tables of measurements: a CSV file with the time and one column a measured name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files.reading import read_regular
from lagrange_cli.files.rows import CsvRows, decoded, quoted_cell

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lagrange_cli.simulate.arrays import Array

_RULE = "measurements"
_TIME = "t"
_SIGMA = re.compile(r"sigma\((.+)\)")


@dataclass(frozen=True)
class Measurements:
    """Measured values over time.

    Attributes
    ----------
    path
        The file.
    times
        Shape (rows,), not decreasing.
    values
        Column → its values, of the shape of ``times``; not a number where a cell is empty.
    deviations
        Column → standard deviations of its values, where the file has them.
    places
        Column → its place in the first row.
    """

    path: str
    times: Array
    values: Mapping[str, Array]
    deviations: Mapping[str, Array]
    places: Mapping[str, Mark]


def read_measurements(path: str) -> Measurements:
    """Read ``t,NAME,…`` and, beside a column, perhaps ``sigma(NAME)``.

    Raises
    ------
    InputError
        Located in the file: it cannot be read, or a row is wrong.
    """
    lines = decoded(read_regular(path, Mark(path, 1, 1), "measurements"), path, _RULE)
    rows = CsvRows(lines, path, _RULE)
    header = [name.strip() for name in next(iter(rows), [])]
    places = {name: rows.place(k) for k, name in enumerate(header)}
    _check_header(rows, header)
    cells: list[list[float]] = []
    for row in rows:
        if len(row) != len(header):
            count = f"{len(row)} cell{'s' * (len(row) != 1)}"
            raise rows.refused(f"{count} in this row, {len(header)} in the first one")
        numbers = [
            rows.number(row, k) if row[k].strip() or name == _TIME else np.nan
            for k, name in enumerate(header)
        ]
        _check_row(rows, header, numbers, cells[-1] if cells else None)
        cells.append(numbers)
    if not cells:
        raise rows.refused("there are no rows of numbers")
    columns = dict(zip(header, np.array(cells).T, strict=True))
    times = columns.pop(_TIME)
    matched = {name: _SIGMA.fullmatch(name) for name in columns}
    return Measurements(
        path,
        times,
        {name: x for name, x in columns.items() if matched[name] is None},
        {sigma[1]: columns[name] for name, sigma in matched.items() if sigma is not None},
        places,
    )


def _check_header(rows: CsvRows, header: Sequence[str]) -> None:
    if _TIME not in header:
        hint = "the first row names the columns: t,x, separated by commas"
        raise rows.refused("no column is named 't', which is the time", hint)
    for k, name in enumerate(header):
        if header.index(name) < k:
            raise rows.refused(f"two columns are named {quoted_cell(name)}", "", rows.place(k))
        sigma = _SIGMA.fullmatch(name)
        if sigma is not None and sigma[1] not in header:
            raise rows.refused(
                f"no column is named {quoted_cell(sigma[1])}, whose deviations these are",
                "",
                rows.place(k),
            )
    if all(name == _TIME or _SIGMA.fullmatch(name) for name in header):
        raise rows.refused("nothing is measured: there is no column beside 't'")


def _check_row(
    rows: CsvRows, header: Sequence[str], numbers: Sequence[float], before: Sequence[float] | None
) -> None:
    at = header.index(_TIME)
    if before is not None and numbers[at] < before[at]:
        hint = "rows are in order of time"
        raise rows.refused(f"time {numbers[at]!r} is before {before[at]!r}", hint, rows.place(at))
    for k, name in enumerate(header):
        sigma = _SIGMA.fullmatch(name)
        if sigma is None:
            continue
        measured = not np.isnan(numbers[header.index(sigma[1])])
        if measured and not numbers[k] > 0:
            raise rows.refused("a standard deviation is above zero", "", rows.place(k))


def require_names(measurements: Measurements, known: Sequence[str]) -> None:
    """Refuse columns that a motion does not have.

    Raises
    ------
    InputError
        At the first of them.
    """
    for name in measurements.values:
        if name not in known:
            raise InputError(
                Problem(
                    f"{quoted_cell(name)} is nothing that a motion of the scene has",
                    measurements.places[name],
                    nearest(name, list(known)) or f"it has {', '.join(known)}",
                    _RULE,
                )
            )


def require_times(measurements: Measurements, start: float) -> None:
    """Refuse measurements before the motion starts, and those that are all at the start.

    Raises
    ------
    InputError
        There is one, or none later.
    """
    first, place = float(measurements.times[0]), measurements.places[_TIME]
    if first < start:
        message = f"the first measurement, at t = {first:.6g}, is before the start, t = {start:.6g}"
        hint = "give the scene's section simulate a 'from' that is not later"
        raise InputError(Problem(message, place, hint, _RULE))
    if not measurements.times[-1] > start:
        raise InputError(Problem("all measurements are at the start", place, rule=_RULE))
