"""Sample times and states of a run: in memory, or in a file of which a part is in memory.

Times and states go in part by part, and are read part by part in the same way, wherever they
are.
"""

from __future__ import annotations

import os
import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import IO, Any, Protocol, TypeAlias, overload

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import SavedState

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


#: Bytes of a number.
_DOUBLE_SIZE = 8


class MemoryBuffer:
    """All samples in one array, shape (count, width)."""

    def __init__(self, count: int, width: int) -> None:
        self._array = np.empty((count, width))

    def unfilled(self, first: int, last: int) -> Array:
        """Return rows to fill, from the number ``first`` to ``last`` at most."""
        return self._array[first:last]

    def rows(self, count: int) -> Array:
        """Return the first ``count`` rows, which have been filled."""
        return self._array[:count]

    def state(self, count: int) -> SavedState:
        """Return what a checkpoint has to hold of the first ``count`` samples."""
        return {"states": self._array[:count]}

    def restore(self, state: SavedState) -> bool:
        """Fill the samples of a checkpoint again; False where that is not possible."""
        self._array[: len(state["states"])] = state["states"]
        return True


class FileBuffer:
    """Samples in a file; those of the window that is being filled are in memory.

    Parameters
    ----------
    file
        Open for reading and writing; rows of ``width`` doubles, as the machine has them.
    size
        Rows of a window.
    """

    #: The CRC-32 of the rows in the file that are no longer in memory.
    _check = 0

    def __init__(self, file: IO[bytes], width: int, size: int | None = None) -> None:
        self._file, self._width = file, width
        self._buffer = np.empty((size or window_rows(width), width))
        self._base = 0

    def unfilled(self, first: int, last: int) -> Array:
        if first - self._base == len(self._buffer):
            self._check = self._put(len(self._buffer))
            self._base = first
        return self._buffer[first - self._base : last - self._base]

    def rows(self, count: int) -> RowSequence:
        return _FileRows(self, count)

    def read(self, first: int, last: int) -> Array:
        """Read rows that have been filled."""
        in_memory = self._buffer[max(first - self._base, 0) : max(last - self._base, 0)]
        if first >= self._base:
            return in_memory.copy()
        size = _DOUBLE_SIZE * self._width
        self._file.seek(first * size)
        data = self._file.read((min(last, self._base) - first) * size)
        return np.concatenate([np.frombuffer(data).reshape(-1, self._width), in_memory])

    def state(self, count: int) -> SavedState:
        """Write the first ``count`` rows to the disk; return their number and checksum."""
        check = self._put(count - self._base)
        os.fsync(self._file.fileno())
        return {"count": count, "check": check}

    def restore(self, state: SavedState) -> bool:
        """Go on behind the rows in the file; False where they are not those that were written."""
        count, size = state["count"], len(self._buffer)
        self._file.seek(0)
        for self._base in range(0, count, size):
            rows = min(size, count - self._base)
            data = self._file.read(_DOUBLE_SIZE * self._width * rows)
            if len(data) < _DOUBLE_SIZE * self._width * rows:
                return False
            self._buffer[:rows] = np.frombuffer(data).reshape(rows, self._width)
            check, self._check = self._check, zlib.crc32(data, self._check)
        self._check, checksum = check, self._check
        return bool(checksum == state["check"])

    def _put(self, rows: int) -> int:
        """Write the first rows of the window into the file; return the CRC-32 of it up to them."""
        data = self._buffer[:rows].tobytes()
        try:
            self._file.seek(_DOUBLE_SIZE * self._width * self._base)
            self._file.write(data)
            self._file.flush()
        except OSError as error:
            raise cannot_write("the samples of a long run", error) from error
        return zlib.crc32(data, self._check)


@dataclass(frozen=True)
class _FileRows(LazyRows):
    """The first ``count`` rows of a file of samples."""

    buffer: FileBuffer
    count: int

    def __len__(self) -> int:
        return self.count

    def _at(self, numbers: range) -> Array:
        return self.buffer.read(numbers.start, numbers.stop)[:: numbers.step]


SampleBuffer: TypeAlias = MemoryBuffer | FileBuffer
"""Memory or a file into which a run writes its samples."""


def unnamed_file(folder: str) -> IO[bytes]:
    """Open a file without a name, that is gone with the process.

    Raises
    ------
    InputError
        It cannot be made.
    """
    from tempfile import TemporaryFile  # few runs need one, and it imports much

    try:
        return TemporaryFile(dir=folder)
    except OSError as error:
        raise cannot_write(f"into '{folder}'", error) from error


def named_file(path: str, *, again: bool) -> IO[bytes]:
    """Open a file that stays, empty or that of before.

    Raises
    ------
    InputError
        It cannot be made, or is not there.
    """
    try:
        return open(path, "r+b" if again else "w+b")
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error


def buffer_folder(result: str | os.PathLike[str] | None) -> str:
    """Name the folder for samples: that of a result, or that of temporary files."""
    if result is None:
        from tempfile import gettempdir

        return gettempdir()
    return os.path.dirname(os.path.realpath(result))


def require_disk_space(folder: str, count: int, numbers: int) -> None:
    """Refuse samples for which a disk has no space.

    Parameters
    ----------
    numbers
        Those of a sample, in all files.

    Raises
    ------
    InputError
        With what they take and what there is.
    """
    from shutil import disk_usage

    row, free = _DOUBLE_SIZE * numbers, disk_usage(folder).free
    wanted = row * count
    if wanted > free:
        raise InputError(
            Problem(
                f"{count:,} samples take {wanted / 1e9:.3g} GB, and '{folder}' has"
                f" {free / 1e9:.3g} GB left",
                hint=f"--samples {max(2, free // row // 2)}, or -o FILE on another"
                " disk (TMPDIR where there is no -o)",
                rule="limit",
            )
        )
