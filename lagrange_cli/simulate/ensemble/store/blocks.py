"""Results of the members of an ensemble, block by block."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array

#: Numbers that are known of each member, by the fields of a trajectory.
MEMBER_FIGURES = (
    *("estimated", "holds_until", "energy_drift", "constraint_drift"),
    *("steps", "rhs_evaluations", "all_evaluations"),
)

#: Texts that are known of each member, by the fields of a trajectory.
MEMBER_WORDS = ("status", "reason", "method", "formulation")


@dataclass(frozen=True)
class MemberBlock:
    """Results of the members of a block.

    Attributes
    ----------
    number
        The block's number in its ensemble.
    columns
        Name → values, shape (members, samples), NaN where nothing holds; empty where none are
        wanted.
    numbers
        Name → number of the motion of each member, shape (members,), NaN where it is not known.
    varied
        Name in the plan → the number of each member, shape (members,).
    scales
        Name → scale of each member, shape (members,), NaN where there is none.
    figures, words
        Name → one value a member.
    """

    number: int
    columns: Mapping[str, Array]
    numbers: Mapping[str, Array]
    varied: Mapping[str, Array]
    scales: Mapping[str, Array]
    figures: Mapping[str, Array]
    words: Mapping[str, list[str]]


#: Kind of a block's arrays → prefix of their names in its file.
KINDS = {
    "columns": "c/",
    "numbers": "n/",
    "varied": "g/",
    "scales": "s/",
    "figures": "f/",
    "words": "w/",
}

COLUMN = KINDS["columns"]

#: Prefix of a name in a block's file → prefix in the result.
WRITTEN = {"c/": "", "n/": "", "g/": "given/", "s/": "scale/", "f/": "member/", "w/": "member/"}

#: Names of arrays of texts.
TEXTS = frozenset(f"w/{name}" for name in MEMBER_WORDS)


def written_name(name: str) -> str:
    """Return the name that an array of blocks has in the result."""
    return WRITTEN[name[:2]] + name[2:]


def arrays_of(block: MemberBlock) -> dict[str, Any]:
    """Return the arrays of a block by their names in its file, in the order of the result's."""
    arrays: dict[str, Any] = {}
    for kind, start in KINDS.items():
        arrays |= {f"{start}{name}": np.asarray(a) for name, a in getattr(block, kind).items()}
    return arrays


@dataclass(frozen=True)
class BlockPart:
    """Results of some members of a block, with the fields of :class:`MemberBlock`.

    Attributes
    ----------
    members
        Numbers of the members in the block.
    columns
        May end before the last sample; copied before the next part is asked for.
    """

    members: list[int]
    columns: Mapping[str, Array]
    numbers: Mapping[str, Array]
    varied: Mapping[str, Array]
    scales: Mapping[str, Array]
    figures: Mapping[str, Array]
    words: Mapping[str, str]


class BlockBuilder:
    """Builder of a block from its parts, in any order.

    Parameters
    ----------
    names
        Names of the values in which members differ.
    members, samples
        Numbers of members and of samples.
    columns
        Columns that parts are expected to have.
    """

    def __init__(
        self, names: Sequence[str], members: int, samples: int, columns: Iterable[str]
    ) -> None:
        self._is_left = np.ones(members, bool)
        self._shape = members, samples
        self._columns = {name: np.empty(self._shape) for name in columns}
        self._numbers: dict[str, Array] = {}
        self._varied = {name: np.full(members, np.nan) for name in names}
        self._scales: dict[str, Array] = {}
        self._figures = {name: np.full(members, np.nan) for name in MEMBER_FIGURES}
        self._words = {name: np.full(members, "", object) for name in MEMBER_WORDS}

    @property
    def left(self) -> list[int]:
        """The members that are in no part."""
        numbers: list[int] = np.flatnonzero(self._is_left).tolist()
        return numbers

    def take(self, part: BlockPart) -> None:
        """Add a part."""
        members = np.asarray(part.members, np.int64)
        self._is_left[members] = False
        for name, word in part.words.items():
            self._words[name][members] = word
        for gathered, added in (
            (self._numbers, part.numbers),
            (self._varied, part.varied),
            (self._scales, part.scales),
            (self._figures, part.figures),
        ):
            for name, values in added.items():
                gathered.setdefault(name, np.full(self._shape[0], np.nan))[members] = values
        self._add(part.columns)
        for name, column in self._columns.items():
            values = part.columns.get(name, np.empty((1, 0)))
            column[members, : values.shape[1]] = values
            column[members, values.shape[1] :] = np.nan

    def _add(self, names: Iterable[str]) -> None:
        """Make the columns that are new."""
        # Members of earlier parts do not have these.
        without = ~self._is_left
        for name in names:
            if name not in self._columns:
                self._columns[name] = np.empty(self._shape)
                self._columns[name][without] = np.nan

    def block(self, number: int) -> MemberBlock:
        """Return the block; members in no part have no values."""
        for values in self._columns.values():
            values[self._is_left] = np.nan
        return MemberBlock(
            number,
            self._columns,
            self._numbers,
            self._varied,
            self._scales,
            self._figures,
            {name: words.tolist() for name, words in self._words.items()},
        )


@dataclass(frozen=True)
class Failure:
    """A member that is not ``ok``.

    Attributes
    ----------
    member
        Its number.
    status, reason
        Its status, and the reason in words.
    holds_until
        Time until which it is known, NaN if it could not be begun.
    """

    member: int
    status: str
    reason: str
    holds_until: float


@dataclass(frozen=True)
class NumberRange:
    """Range of a number over members.

    Attributes
    ----------
    least, largest
        NaN if it is known of no member.
    known
        How many members have it.
    """

    least: float
    largest: float
    known: int

    @classmethod
    def of_values(cls, values: Array) -> NumberRange:
        """Return the range of values that are not NaN."""
        known = values[~np.isnan(values)]
        if len(known) == 0:
            return cls(math.nan, math.nan, 0)
        return cls(float(known.min()), float(known.max()), len(known))

    def union(self, second: NumberRange) -> NumberRange:
        """Return the range over the members of both."""
        if not (self.known and second.known):
            return self if self.known else second
        least, largest = min(self.least, second.least), max(self.largest, second.largest)
        return NumberRange(least, largest, self.known + second.known)


@dataclass(frozen=True)
class BlockSummary:
    """Summary of a finished block for reports.

    Attributes
    ----------
    counts
        Status → number of members.
    failures
        Members that are not ``ok``.
    estimated
        Largest estimated error, NaN if there is none.
    ranges
        Name of a stored number → range of its values.
    """

    counts: Mapping[str, int]
    failures: tuple[Failure, ...]
    estimated: float
    ranges: Mapping[str, NumberRange]

    @classmethod
    def of_block(cls, block: MemberBlock, first: int) -> BlockSummary:
        """Summarize a block whose first member has the number ``first``."""
        rows = zip(
            block.words["status"], block.words["reason"], block.figures["holds_until"], strict=True
        )
        failures = (
            Failure(first + k, status, reason, float(holds))
            for k, (status, reason, holds) in enumerate(rows)
            if status != "ok"
        )
        counts = Counter(block.words["status"])
        largest = NumberRange.of_values(block.figures["estimated"]).largest
        ranges = {name: NumberRange.of_values(values) for name, values in block.numbers.items()}
        return cls(counts, tuple(failures), largest, ranges)


@dataclass(frozen=True)
class FinishedBlock:
    """A block that is finished and stored.

    Attributes
    ----------
    number
        The block's number in its ensemble.
    summary
        Its summary for reports.
    results
        Results of its members; None if they are in a file, or not wanted.
    """

    number: int
    summary: BlockSummary
    results: MemberBlock | None = None

    @classmethod
    def of_block(
        cls, block: MemberBlock, size: int, *, with_results: bool = False
    ) -> FinishedBlock:
        """Summarize a block; ``size`` is that of all blocks but the last."""
        summary = BlockSummary.of_block(block, block.number * size)
        return cls(block.number, summary, block if with_results else None)
