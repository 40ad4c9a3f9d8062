"""Members of an ensemble by their numbers: listed one by one, or enumerated as they are asked for.

A grid of a billion members is some axes: nothing is made of a member before its block is run.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.files.rows import DECIMAL_NUMBER, quoted_cell
from lagrange_cli.simulate.arrays import Array

#: Members that are enumerated at most.
MOST_MEMBERS = 1_000_000_000

#: Members that are listed one by one at most, as rows of a file: each is kept with its place.
MOST_LISTED = 100_000

#: Rule of the problems with members.
RULE = "ensemble"

#: Text of a value, and its place.
Cell = tuple[str, Mark]


def refused(message: str, mark: Mark, hint: str = "") -> InputError:
    """Return the refusal of members."""
    return InputError(Problem(message, mark, hint, RULE))


def too_many(mark: Mark, most: int) -> InputError:
    """Return the refusal of more than ``most`` members."""
    return refused(f"more than {most:,} members", mark, "divide them among several runs")


@dataclass(frozen=True)
class Members(ABC):
    """Values of each member, as texts of expressions.

    Attributes
    ----------
    names
        Names of parameters and initial values.
    heads
        Place of each name.
    """

    names: tuple[str, ...]
    heads: tuple[Mark, ...]

    def __post_init__(self) -> None:
        for k, name in enumerate(self.names):
            if not name:
                raise refused("a column has no name", self.heads[k])
            if name in self.names[:k]:
                raise refused(f"{quoted_cell(name)} is given twice", self.heads[k])

    @abstractmethod
    def __len__(self) -> int:
        """Count the members."""

    @abstractmethod
    def rows(self, first: int = 0, last: int | None = None) -> Iterator[tuple[str, ...]]:
        """Yield for each member from ``first`` to before ``last`` a text for each name."""

    def numbers(self, first: int, last: int) -> list[Array] | None:
        """Return the numbers in the rows of members, an array for each name; None if a text is no
        plain number."""
        return None

    @abstractmethod
    def mark(self, member: int, name: str) -> Mark:
        """Return the place of a value."""

    @abstractmethod
    def cells(self) -> Iterator[Cell]:
        """Yield every text that was written for a member, once, with its place."""

    @abstractmethod
    def identity(self) -> object:
        """Return an identity key: plain values that only equal members have."""

    @abstractmethod
    def description(self) -> dict[str, object]:
        """Describe the source of the members in a few JSON values."""

    def without_places(self) -> Members:
        """Return members of the same values without places, for other processes."""
        return self

    def values(self, member: int) -> dict[str, str]:
        """Return name → text of a member."""
        (row,) = self.rows(member, member + 1)
        return dict(zip(self.names, row, strict=True))


@dataclass(frozen=True)
class ListedMembers(Members):
    """Members one by one.

    Attributes
    ----------
    table
        For each member a text for each name, with its place.
    """

    table: tuple[tuple[Cell, ...], ...]

    def __len__(self) -> int:
        return len(self.table)

    def rows(self, first: int = 0, last: int | None = None) -> Iterator[tuple[str, ...]]:
        for row in self.table[first:last]:
            yield tuple(text for text, _ in row)

    def mark(self, member: int, name: str) -> Mark:
        return self.table[member][self.names.index(name)][1]

    def cells(self) -> Iterator[Cell]:
        for row in self.table:
            yield from row

    def without_places(self) -> Members:
        nowhere = Mark("", 1, 1)
        return replace(self, table=tuple(tuple((text, nowhere) for text in r) for r in self.rows()))

    def identity(self) -> object:
        return self.names, tuple(self.rows())

    def description(self) -> dict[str, object]:
        return {"listed": list(self.names)}


@dataclass(frozen=True)
class GridMembers(Members):
    """All combinations of values; those of the last name vary fastest.

    Attributes
    ----------
    axes
        For each name its values, with their places.
    """

    axes: tuple[tuple[Cell, ...], ...]

    def __len__(self) -> int:
        return self._number

    @cached_property
    def _number(self) -> int:
        return math.prod(len(axis) for axis in self.axes)

    def rows(self, first: int = 0, last: int | None = None) -> Iterator[tuple[str, ...]]:
        for member in range(first, len(self) if last is None else min(last, len(self))):
            yield tuple(text for text, _ in self._at(member))

    def numbers(self, first: int, last: int) -> list[Array] | None:
        if self._axis_numbers is None:
            return None
        members, columns = np.arange(first, min(last, len(self))), []
        for axis in reversed(self._axis_numbers):
            members, k = np.divmod(members, len(axis))
            columns.append(axis[k])
        return columns[::-1]

    @cached_property
    def _axis_numbers(self) -> list[Array] | None:
        """The values of each name; None if one is no plain number."""
        if not all(DECIMAL_NUMBER.fullmatch(text) for text, _ in self.cells()):
            return None
        return [np.array([float(text) for text, _ in axis]) for axis in self.axes]

    def mark(self, member: int, name: str) -> Mark:
        return self._at(member)[self.names.index(name)][1]

    def _at(self, member: int) -> list[Cell]:
        row: list[Cell] = []
        for axis in reversed(self.axes):
            member, k = divmod(member, len(axis))
            row.append(axis[k])
        return row[::-1]

    def cells(self) -> Iterator[Cell]:
        for axis in self.axes:
            yield from axis

    def identity(self) -> object:
        return self.names, tuple(tuple(text for text, _ in axis) for axis in self.axes)

    def description(self) -> dict[str, object]:
        lengths = map(len, self.axes)
        return {"grid": dict(zip(self.names, lengths, strict=True))}


def listed(names: Sequence[str], heads: Sequence[Mark], table: Sequence[Sequence[Cell]]) -> Members:
    """Return members that are listed one by one; refuse equal names, and texts without a value."""
    rows = tuple(tuple(cell(text, mark) for text, mark in row) for row in table)
    return ListedMembers(tuple(names), tuple(heads), rows)


#: Name, its place and values.
Axis = tuple[str, Mark, Sequence[Cell]]


def combined(axes: Sequence[Axis]) -> Members:
    """Return all combinations of the values of axes; refuse as :func:`listed`, and too many."""
    if math.prod(len(cells) for _, _, cells in axes) > MOST_MEMBERS:
        raise too_many(axes[-1][1], MOST_MEMBERS)
    values = tuple(tuple(cell(*each) for each in cells) for _, _, cells in axes)
    return GridMembers(tuple(name for name, *_ in axes), tuple(head for _, head, _ in axes), values)


def cell(text: str, mark: Mark) -> Cell:
    """Return the text, stripped, of a finite number or of an expression; refuse others."""
    text = text.strip()
    if not text:
        raise refused("expected a number, found nothing", mark)
    if not DECIMAL_NUMBER.fullmatch(text):
        from lagrange_cli.scene import parse_expression

        parse_expression(text, mark)
    elif not math.isfinite(float(text)):
        raise refused(f"{quoted_cell(text)} is beyond the range of doubles", mark)
    return text, mark
