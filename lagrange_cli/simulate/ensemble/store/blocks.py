"""Results of the members of an ensemble, block by block."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

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
    """Parts, put together as they come.

    Parameters
    ----------
    names
        Of what members are given.
    members, samples
        How many there are.
    columns
        Those that are expected.
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
        """Make columns of those that are new."""
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
