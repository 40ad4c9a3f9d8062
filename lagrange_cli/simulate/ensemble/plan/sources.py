"""Members of an ensemble from a file, as ranges of values, or from Python.

A CSV file has a header of names, ``m``, ``theta``, ``dot(theta)``, and a row a member; a
YAML file is a list of mappings with the same names. Values are expressions of the scene
language. Ranges are ``m=linspace(0.1,10,100)``, ``logspace(-1,1,5)`` (powers of ten between
two exponents), ``geomspace(0.1,10,5)`` or a list, ``[1,2,3]``; several make a grid.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lagrange_cli.errors import Mark
from lagrange_cli.files import ending_of
from lagrange_cli.files.reading import read_regular
from lagrange_cli.files.rows import DECIMAL_NUMBER, CsvRows, decoded, quoted_cell
from lagrange_cli.simulate.ensemble.plan.enumeration import (
    MOST_LISTED,
    RULE,
    Axis,
    Cell,
    Members,
    cell,
    combined,
    listed,
    refused,
    too_many,
)

#: Ranges by name: (first, last, number) → values.
_RANGES: dict[str, Callable[[float, float, int], np.ndarray]] = {
    "linspace": np.linspace,
    "logspace": np.logspace,
    "geomspace": np.geomspace,
}

_CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)
_LIST = re.compile(r"\s*\[(.*)\]\s*", re.DOTALL)
_COUNT = re.compile(r"\s*[0-9]{1,9}\s*", re.ASCII)
_EXAMPLE = "linspace(0.1,10,100), logspace(-1,1,5), geomspace(0.1,10,5) or a list, [1,2,3]"


def _without_blanks(name: str) -> str:
    """Return a name as scenes have it, without blanks in ``dot(x)`` and ``x[1,2]``."""
    return re.sub(r"\s+", "", name) if re.search(r"[\[(]", name) else name.strip()


# From a file.


def read_members(path: str) -> Members:
    """Read the members of a CSV or YAML file, by its ending.

    Raises
    ------
    InputError
        Located: the file cannot be read, or a row is wrong.
    """
    readers = {".csv": _csv, ".yaml": _yaml, ".yml": _yaml}
    mark, ending = Mark(path, 1, 1), ending_of(path)
    if ending not in readers:
        raise refused("an ensemble is a .csv or a .yaml file", mark)
    data = read_regular(path, mark, "an ensemble")
    return readers[ending](decoded(data, path, RULE), path)


def _csv(lines: list[str], path: str) -> Members:
    rows = CsvRows(lines, path, RULE)
    records = iter(rows)
    header = next(records, None)
    if header is None:
        raise refused("this file is empty", Mark(path, 1, 1), "its first row names columns")
    heads = [rows.place(k) for k in range(len(header))]
    cells = list(_rows_of(records, rows, len(header)))
    if not cells:
        raise rows.refused("there is no member: a row of values follows the names")
    return listed([_without_blanks(name) for name in header], heads, cells)


def _rows_of(records: Iterator[list[str]], rows: CsvRows, width: int) -> Iterator[list[Cell]]:
    for number, row in enumerate(records):
        if number == MOST_LISTED:
            raise too_many(rows.place(), MOST_LISTED)
        if len(row) != width:
            have = f"{len(row)} cell{'s' * (len(row) != 1)}"
            raise rows.refused(
                f"{have} in this row, {width} in the first one",
                "decimals are written with a point, cells separated by commas",
            )
        yield [(text, rows.place(k)) for k, text in enumerate(row)]


def _yaml(lines: list[str], path: str) -> Members:
    from lagrange_cli.scene.reading.source import Mapping, Sequence, compose

    text, example = "".join(lines), "a list of mappings: - {m: 1, theta: 0.5}"
    start = Mark(path, 1, 1)
    root = compose(text, path) if text.strip() else None
    if not isinstance(root, Sequence) or not root.items:
        raise refused("there is no member", start if root is None else root.mark, example)
    if len(root.items) > MOST_LISTED:
        raise too_many(root.mark, MOST_LISTED)
    for item in root.items:
        if not isinstance(item, Mapping):
            raise refused("a member is a mapping of names to values", item.mark, example)
    members = [item for item in root.items if isinstance(item, Mapping)]
    first = members[0].entries
    names = [_without_blanks(key.text) for key, _ in first]
    cells = [_of_mapping(member, names) for member in members]
    return listed(names, [key.mark for key, _ in first], cells)


def _of_mapping(member: object, names: Sequence[str]) -> list[Cell]:
    """Return the values of a member of a YAML file, in the order of the first one."""
    from lagrange_cli.scene.reading.source import Mapping, Scalar

    assert isinstance(member, Mapping)
    cells: dict[str, Cell] = {}
    for key, value in member.entries:
        name = _without_blanks(key.text)
        if name not in names:
            raise refused(
                f"{quoted_cell(name)} is not among the names of the first member", key.mark
            )
        if not isinstance(value, Scalar):
            raise refused("expected a number", value.mark)
        cells[name] = value.text, value.mark
    missing = [name for name in names if name not in cells]
    if missing:
        raise refused(f"this member has no {quoted_cell(missing[0])}", member.mark)
    return [cells[name] for name in names]


# As ranges.


def grid(specifications: Sequence[str]) -> Members:
    """Combine all values of ranges, each ``NAME=RANGE``; the last one varies fastest.

    Raises
    ------
    InputError
        Located in the option: it is no range.
    """
    return combined([_axis(text) for text in specifications])


def _axis(text: str) -> Axis:
    """Read a range: its name, the place of the name, and its values."""
    name, equals, written = text.partition("=")
    head = Mark("--vary", 1, 1, text, max(1, len(name)))
    if not (equals and name.strip() and written.strip()):
        raise refused("this is not of the form NAME=RANGE", head, f"--vary 'm={_EXAMPLE[:20]}'")
    mark = replace(head, column=len(name) + 2, length=len(written))
    call, values_listed = call_of(written), _LIST.fullmatch(written)
    if values_listed:
        values = [(part, mark) for part in split_at_commas(values_listed[1], mark)]
    elif call and call[0] in _RANGES:
        kind, arguments = call
        values = [(repr(x), mark) for x in _range(kind, split_at_commas(arguments, mark), mark)]
    else:
        raise refused("this is no range", mark, f"a range is {_EXAMPLE}")
    return _without_blanks(name), head, values


def call_of(written: str) -> tuple[str, str] | None:
    """Return the name and the arguments of ``name(arguments)``; None of another text."""
    called = _CALL.fullmatch(written)
    return None if called is None else (called[1], called[2])


def split_at_commas(text: str, mark: Mark) -> list[str]:
    """Split at commas outside parentheses; refuse empty parts."""
    parts, depth = [""], 0
    for character in text:
        depth += (character == "(") - (character == ")")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    if not all(part.strip() for part in parts):
        raise refused("a value is missing", mark)
    return parts


def _range(kind: str, arguments: Sequence[str], mark: Mark) -> list[float]:
    if len(arguments) != 3 or not _COUNT.fullmatch(arguments[2]):
        raise refused(f"{kind} takes its first and last value and a whole number of them", mark)
    number = int(arguments[2])
    if number == 0:
        raise refused("no member: the number of values is 0", mark)
    if number > MOST_LISTED:
        raise too_many(mark, MOST_LISTED)
    first, last = (constant(text, mark) for text in arguments[:2])
    if kind == "geomspace" and not first * last > 0:
        raise refused("the ends of geomspace have one sign and are not 0", mark)
    with np.errstate(all="ignore"):
        values = _RANGES[kind](first, last, number)
    if not np.isfinite(values).all():
        raise refused("a value of this range is beyond the range of doubles", mark)
    return [float(x) for x in values]


def constant(text: str, mark: Mark) -> float:
    """Evaluate a constant expression; refuse other texts."""
    written, _ = cell(text, mark)
    if DECIMAL_NUMBER.fullmatch(written):
        return float(written)
    from lagrange_cli.mechanics.symbols.convert import to_sympy
    from lagrange_cli.mechanics.symbols.values import nearest_double
    from lagrange_cli.scene import parse_expression

    return nearest_double(to_sympy(parse_expression(written, mark), lambda name: None))


# From Python.


def members_of(
    values: Mapping[str, Sequence[str]] | Sequence[Mapping[str, str]],
) -> Members:
    """Combine all values of some names, the last one varies fastest; or take members one by one.

    Raises
    ------
    InputError
        There is no member, or members have different names.
    """
    if isinstance(values, Mapping):
        members = combined([_axis_of(name, texts) for name, texts in values.items()])
    else:
        names = list(values[0]) if values else []
        if len(values) > MOST_LISTED:
            raise too_many(Mark("members", 1, 1), MOST_LISTED)
        cells = [_row_of(member, names, number) for number, member in enumerate(values)]
        heads = [Mark(f"members[0] {name}", 1, 1, name, len(name)) for name in names]
        members = listed([_without_blanks(name) for name in names], heads, cells)
    if not (members.names and len(members)):
        raise refused("there is no member", Mark("members", 1, 1), "{'theta': [0.1, 0.2]}")
    return members


def _axis_of(name: str, texts: Sequence[str]) -> Axis:
    head = Mark(f"members {name}", 1, 1, name, len(name))
    cells = [(text, replace(head, text=text, length=len(text))) for text in texts]
    return _without_blanks(name), head, cells


def _row_of(member: Mapping[str, str], names: Sequence[str], number: int) -> list[Cell]:
    """Return the values of a member in the order of the first one."""
    mark = Mark(f"members[{number}]", 1, 1)
    for name in sorted(member.keys() ^ set(names)):
        has = "has" if name in member else "has no"
        raise refused(f"this member {has} {quoted_cell(name)}, unlike the first one", mark)
    marks = [replace(mark, text=member[name], length=len(member[name])) for name in names]
    return [(member[name], place) for name, place in zip(names, marks, strict=True)]
