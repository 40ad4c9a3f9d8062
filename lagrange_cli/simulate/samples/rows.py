"""Sample times and states that are read in parts, whether they are in memory or not."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, Protocol, overload

import numpy as np

from lagrange_cli.simulate.arrays import Array

#: Numbers of the states that are looked at at a time.
WINDOW = 2**17


class RowSequence(Protocol):
    """A sequence of numbers or of states, of which any part can be had as an array."""

    def __len__(self) -> int: ...

    @overload
    def __getitem__(self, key: int, /) -> Any: ...

    @overload
    def __getitem__(self, key: slice, /) -> Array: ...


class LazyRows(ABC):
    """Rows of which a part is read when it is asked for."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def _at(self, numbers: range) -> Array:
        """Read the rows with some numbers, in ascending order."""

    @overload
    def __getitem__(self, key: int, /) -> Any: ...

    @overload
    def __getitem__(self, key: slice, /) -> Array: ...

    def __getitem__(self, key: int | slice, /) -> Any:
        if isinstance(key, slice):
            return self._at(range(len(self))[key])
        number = range(len(self))[key]
        return self._at(range(number, number + 1))[0]


@dataclass(frozen=True)
class Grid(LazyRows):
    """Times ``start + k·step``, of which the last is ``until`` exactly.

    The same numbers as those of numpy.linspace if ``step`` is (until − start)/(count − 1).

    Attributes
    ----------
    start
        First time.
    until
        Last time.
    step
        Time from one to the next but the last, which may be closer.
    count
        Number of times.
    """

    start: float
    until: float
    step: float
    count: int

    def __len__(self) -> int:
        return self.count

    def _at(self, numbers: range) -> Array:
        times = np.arange(numbers.start, numbers.stop, numbers.step, dtype=float)
        times = times * self.step + self.start
        if len(numbers) and numbers[-1] == self.count - 1:
            times[-1] = self.until
        return times


@dataclass(frozen=True)
class RowRanges(LazyRows):
    """The rows of some ranges of others, one range after the other."""

    rows: RowSequence
    ranges: Sequence[tuple[int, int]]

    def __len__(self) -> int:
        return sum(last - first for first, last in self.ranges)

    def _at(self, numbers: range) -> Array:
        ends = accumulate(last - first for first, last in self.ranges)
        parts = []
        for (first, last), end in zip(self.ranges, ends, strict=True):
            # The number, of all rows, of the one that would be the first of this range.
            offset = first - (end - (last - first))
            a, b = max(first, numbers.start + offset), min(last, numbers.stop + offset)
            if a < b:
                parts.append(self.rows[a:b])
        return np.concatenate([self.rows[:0], *parts])[:: numbers.step]


def first_rows(rows: RowSequence, count: int) -> RowSequence:
    """Return the first ``count`` of some rows."""
    return rows[:count] if isinstance(rows, np.ndarray) else RowRanges(rows, [(0, count)])


def decimated(rows: RowSequence, stride: int) -> RowSequence:
    """Return every ``stride``-th row, plus the last."""
    if stride == 1:
        return rows[:]
    last = len(rows) - 1
    return np.append(rows[0:last:stride], rows[last])


def window_rows(width: int) -> int:
    """Return the number of states, of ``width`` numbers, that are looked at at a time."""
    return max(1, WINDOW // max(width, 1))


def windows(times: RowSequence, states: RowSequence) -> Iterator[tuple[Array, Array]]:
    """Yield times and states in parts; all at once where they are in memory."""
    count = len(states)
    size = count if isinstance(states, np.ndarray) else window_rows(len(states[0]))
    for first in range(0, count, max(size, 1)):
        last = min(first + size, count)
        yield times[first:last], states[first:last]
