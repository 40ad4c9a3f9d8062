"""Ends of a path: a configuration at a time, as ``x=0, y=l/2, t=0``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.simulate.arrays import Array

if TYPE_CHECKING:
    from collections.abc import Callable

    from lagrange_cli.scene.model import Scene

#: Name of the time.
TIME = "t"

_OPENING, _CLOSING = "([", ")]"

#: A number that is read without SymPy.
_DECIMAL = re.compile(r"[+-]?[0-9]{1,40}(\.[0-9]{0,40})?([eE][+-]?[0-9]{1,3})?", re.ASCII)


@dataclass(frozen=True)
class End:
    """A configuration at a time.

    Attributes
    ----------
    t
        The time.
    q
        Values of the coordinates, shape (n,).
    """

    t: float
    q: Array


@dataclass(frozen=True)
class WrittenEnd:
    """An end as it was written.

    Attributes
    ----------
    source
        Option that holds it, as messages name it: ``--from``.
    values
        Name → text of its value, with its place.
    marks
        Name → place of the name.
    """

    source: str
    values: Mapping[str, tuple[str, Mark]]
    marks: Mapping[str, Mark]


def written_end(text: str, source: str) -> WrittenEnd:
    """Split ``NAME=VALUE, ...``; values stay texts.

    Raises
    ------
    InputError
        Located: a part is not of this form, or a name stands twice.
    """
    values: dict[str, tuple[str, Mark]] = {}
    marks: dict[str, Mark] = {}
    for start, end in _parts(text):
        name, equals, value = text[start:end].partition("=")
        mark = _mark(text, start, len(name) if equals else end - start, source)
        if not (name.strip() and equals and value.strip()):
            raise InputError(Problem("a part is NAME=VALUE", mark, "x=0,t=0", rule="path"))
        known = "".join(name.split())
        if known in values:
            raise InputError(Problem(f"'{known}' is given twice", mark, rule="path"))
        place = _mark(text, start + len(name) + 1, len(value), source)
        values[known], marks[known] = (value.strip(), place), mark
    return WrittenEnd(source, values, marks)


def end_of(values: Mapping[str, float | str], source: str) -> WrittenEnd:
    """Make the end of a mapping of names to numbers or expressions."""
    texts = {name: x if isinstance(x, str) else repr(float(x)) for name, x in values.items()}
    placed = {name: (text, Mark(source, 1, 1, text)) for name, text in texts.items()}
    return WrittenEnd(source, placed, {name: Mark(source, 1, 1, name) for name in texts})


def _parts(text: str) -> Iterator[tuple[int, int]]:
    """Yield the bounds of the parts between commas outside brackets."""
    start = depth = 0
    for place, character in enumerate(text):
        depth += (character in _OPENING) - (character in _CLOSING)
        if character == "," and depth == 0:
            yield start, place
            start = place + 1
    yield start, len(text)


def _mark(text: str, start: int, length: int, source: str) -> Mark:
    """Mark a part of the text without the blanks around it."""
    part = text[start : start + length]
    begin = start + len(part) - len(part.lstrip())
    return Mark(source, 1, begin + 1, text, max(1, len(part.strip())))


def read_ends(
    first: WrittenEnd,
    last: WrittenEnd,
    coordinates: Sequence[str],
    scene: Callable[[], Scene],
) -> tuple[End, End]:
    """Evaluate both ends.

    Parameters
    ----------
    coordinates
        Names of all coordinates, each of which must have a value.
    scene
        Reads the scene, over whose parameters values may be written.

    Raises
    ------
    InputError
        Located: a name is unknown or missing, a value is not a finite number over the parameters,
        or the last end is not after the first.
    """
    problems = [p for end in (first, last) for p in _problems_of_names(end, coordinates)]
    if problems:
        raise InputError(*problems)
    ends = [_read(end, coordinates, scene) for end in (first, last)]
    if not ends[1].t > ends[0].t:
        _, mark = last.values[TIME]
        message = f"the path ends at t = {ends[1].t:g}, which is not after t = {ends[0].t:g}"
        hint = f"{last.source} ... t={ends[0].t + 1:g}"
        raise InputError(Problem(message, mark, hint, rule="path"))
    return ends[0], ends[1]


def _problems_of_names(end: WrittenEnd, coordinates: Sequence[str]) -> Iterator[Problem]:
    names = (*coordinates, TIME)
    for name, mark in end.marks.items():
        if name in names:
            continue
        message, hint = f"'{name}' is not a coordinate", nearest(name, names)
        if name.startswith("dot("):
            message = f"'{name}' is not given at an end: the path of stationary action tells it"
        yield Problem(message, mark, hint or f"there are {', '.join(names)}", rule="unknown-name")
    missing = [name for name in names if name not in end.values]
    if missing:
        listed = ", ".join(f"'{name}'" for name in missing)
        text = ",".join(f"{name}={text}" for name, (text, _) in end.values.items())
        hint = ",".join(filter(None, (text, *(f"{name}=0" for name in missing))))
        mark = Mark(end.source, 1, 1, text)
        yield Problem(f"no value of {listed}", mark, f"{end.source} {hint}", rule="path")


def _read(end: WrittenEnd, coordinates: Sequence[str], scene: Callable[[], Scene]) -> End:
    numbers = {name: _number(*end.values[name], scene) for name in (*coordinates, TIME)}
    return End(numbers[TIME], np.array([numbers[name] for name in coordinates]))


def _number(text: str, mark: Mark, scene: Callable[[], Scene]) -> float:
    """Evaluate an expression over parameters."""
    if _DECIMAL.fullmatch(text):
        value = float(text)
        if math.isfinite(value):
            return value
    from lagrange_cli.mechanics.symbols.values import ParameterValues
    from lagrange_cli.scene import parse_expression

    written = scene()
    sizes = {size.name: size.value for size in written.sizes}
    expression = parse_expression(text, mark, values=sizes)
    known = ParameterValues(written).float(expression)
    if known is None:
        raise InputError(Problem("a parameter has no value", mark, "-p NAME=1", rule="path"))
    return known
