"""Tables: values over one argument, or over a grid of two, in a CSV file beside a scene.

The first row names the columns. The first column holds the argument, in increasing order; with two
arguments the first two columns do, and each combination of their values has one row. Mistakes are
reported at their place in the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files.recordings import FileColumn, read_recorded_file
from lagrange_cli.files.rows import CsvRows, decoded, quoted_cell

#: The rule that problems of tables bear.
_RULE = "table"

TableInterpolation = Literal["monotone", "linear", "cubic"]
Outside = Literal["end", "hold", "extend"]

#: Most values of a table: each is a piece of the code that evaluates it.
MOST_VALUES = 400


@dataclass(frozen=True, slots=True)
class Table:
    """A function that a file gives at points.

    Attributes
    ----------
    source
        The column of its values.
    interpolation
        The interpolation between points.
    outside
        What holds beyond the outermost points: nothing (``end``), the outermost value (``hold``),
        or the straight line with the slope there (``extend``).
    axes
        Values of each argument, strictly increasing.
    values
        Values at the points, those of the last argument side by side.
    """

    source: FileColumn
    interpolation: TableInterpolation
    outside: Outside
    axes: tuple[tuple[Fraction, ...], ...]
    values: tuple[Fraction, ...]


def read_table(
    source: FileColumn, arguments: int, interpolation: TableInterpolation, outside: Outside
) -> Table:
    """Read a table over one or two arguments.

    Raises
    ------
    InputError
        Located in the scene: the file lies outside its folder, cannot be read, or has no such
        column. Located in the file: anything that is wrong with its rows.
    """
    rows = CsvRows(decoded(read_recorded_file(source), source.path, _RULE), source.path, _RULE)
    header = [name.strip() for name in next(iter(rows), [])]
    column = _column(header, source, arguments)
    points: dict[tuple[Fraction, ...], Fraction] = {}
    last: Fraction | None = None
    for row in rows:
        if len(row) != len(header):
            raise rows.refused(f"{len(row)} cells in this row, {len(header)} in the first one")
        at = tuple(_exact(rows.number(row, k)) for k in range(arguments))
        if arguments == 1 and last is not None and at[0] <= last:
            said = f"{row[0].strip()} is not greater than the value before, {float(last)!r}"
            raise rows.refused(said, "rows are in increasing order of the argument", rows.place(0))
        if at in points:
            raise rows.refused("these arguments have a value before", "", rows.place(0))
        points[at], last = _exact(rows.number(row, column)), at[0]
        if len(points) > MOST_VALUES:
            raise rows.refused(
                f"a table has at most {MOST_VALUES} values", "leave out rows where little changes"
            )
    axes = tuple(tuple(sorted({at[k] for at in points})) for k in range(arguments))
    if any(len(axis) < 2 for axis in axes):
        raise rows.refused("a table needs two values of each argument")
    return Table(source, interpolation, outside, axes, tuple(_on_grid(points, axes, rows)))


def _exact(value: float) -> Fraction:
    """Return the decimal that a person would write for a double."""
    return Fraction(repr(value))


def _column(header: Sequence[str], source: FileColumn, arguments: int) -> int:
    """Return the number of the column with the values."""
    if not header:
        mark = Mark(source.path, 1, 1)
        raise InputError(Problem("this file is empty", mark, "its first row names columns", _RULE))
    if source.column in header[arguments:]:
        return header.index(source.column, arguments)
    first = "the first column is" if arguments == 1 else "the first two columns are"
    hint = f"{first} for the argument" + "s" * (arguments > 1)
    if source.column not in header:
        hint = nearest(source.column, header) or f"columns are {', '.join(header[:20])}"
    raise InputError(
        Problem(
            f"'{source.path}' has no column {quoted_cell(source.column)} of values",
            source.column_mark,
            hint,
            _RULE,
        )
    )


def _on_grid(
    points: dict[tuple[Fraction, ...], Fraction],
    axes: Sequence[Sequence[Fraction]],
    rows: CsvRows,
) -> list[Fraction]:
    """List the values in the order of the grid.

    Raises
    ------
    InputError
        A combination of arguments has no value.
    """
    grid: list[tuple[Fraction, ...]] = [()]
    for axis in axes:
        grid = [(*at, x) for at in grid for x in axis]
    for at in grid:
        if at not in points:
            missing = ", ".join(f"{float(x):g}" for x in at)
            raise rows.refused(
                f"no row has the arguments {missing}", "a table has a value at each point of a grid"
            )
    return [points[at] for at in grid]
