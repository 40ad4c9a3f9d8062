"""What reports say of finished blocks: counts, failures, errors, ranges of kept numbers."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.blocks import MemberBlock


@dataclass(frozen=True)
class Failure:
    """A member that is not ``ok``.

    Attributes
    ----------
    member
        Its number.
    status, reason
        What became of it, and why.
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
    def of(cls, values: Array) -> NumberRange:
        """Return the range of values that are not NaN."""
        known = values[~np.isnan(values)]
        if len(known) == 0:
            return cls(math.nan, math.nan, 0)
        return cls(float(known.min()), float(known.max()), len(known))

    def with_other(self, other: NumberRange) -> NumberRange:
        """Return the range over the members of both."""
        if not (self.known and other.known):
            return self if self.known else other
        least, largest = min(self.least, other.least), max(self.largest, other.largest)
        return NumberRange(least, largest, self.known + other.known)


@dataclass(frozen=True)
class BlockSummary:
    """What reports say of a finished block.

    Attributes
    ----------
    counts
        Status → number of members.
    failures
        Members that are not ``ok``.
    estimated
        Largest estimated error, NaN if there is none.
    ranges
        Name of a kept number → range of its values.
    """

    counts: Mapping[str, int]
    failures: tuple[Failure, ...]
    estimated: float
    ranges: Mapping[str, NumberRange]

    @classmethod
    def of(cls, block: MemberBlock, first: int) -> BlockSummary:
        """Sum up a block whose first member has this number."""
        rows = zip(
            block.words["status"], block.words["reason"], block.figures["holds_until"], strict=True
        )
        failures = (
            Failure(first + k, status, reason, float(holds))
            for k, (status, reason, holds) in enumerate(rows)
            if status != "ok"
        )
        counts = Counter(block.words["status"])
        largest = NumberRange.of(block.figures["estimated"]).largest
        ranges = {name: NumberRange.of(values) for name, values in block.numbers.items()}
        return cls(counts, tuple(failures), largest, ranges)


@dataclass(frozen=True)
class KeptBlock:
    """A block that is finished and kept.

    Attributes
    ----------
    number
        The block's number in its ensemble.
    summary
        What reports say of it.
    block
        Its results; None if they are in a file, or not wanted.
    """

    number: int
    summary: BlockSummary
    block: MemberBlock | None = None

    @classmethod
    def of(cls, block: MemberBlock, size: int) -> KeptBlock:
        """Sum up a block; ``size`` is that of all blocks but the last."""
        return cls(block.number, BlockSummary.of(block, block.number * size))


@dataclass(frozen=True)
class Summarized:
    """Keeps nothing of blocks but their summaries.

    Attributes
    ----------
    size
        Members of each block but the last.
    """

    size: int

    def __call__(self, block: MemberBlock) -> KeptBlock:
        """Sum up a block."""
        return KeptBlock.of(block, self.size)


@dataclass(frozen=True)
class InMemory:
    """Keeps blocks in memory.

    Attributes
    ----------
    size
        Members of each block but the last.
    """

    size: int

    def __call__(self, block: MemberBlock) -> KeptBlock:
        """Sum up a block and keep it."""
        return replace(KeptBlock.of(block, self.size), block=block)
