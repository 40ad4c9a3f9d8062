"""The samples of a run while it is made: in memory, or in a file of which a part is in memory."""

from __future__ import annotations

import os
import zlib
from dataclasses import dataclass
from typing import IO, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import SavedState
from lagrange_cli.simulate.samples.rows import LazyRows, RowSequence, window_rows

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
        kept = self._buffer[max(first - self._base, 0) : max(last - self._base, 0)]
        if first >= self._base:
            return kept.copy()
        size = _DOUBLE_SIZE * self._width
        self._file.seek(first * size)
        data = self._file.read((min(last, self._base) - first) * size)
        return np.concatenate([np.frombuffer(data).reshape(-1, self._width), kept])

    def state(self, count: int) -> SavedState:
        """See to it that the first ``count`` rows are on the disk; how to know them again."""
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


def buffer_folder(beside: str | os.PathLike[str] | None) -> str:
    """Name the folder for samples: that of a result, or that of temporary files."""
    if beside is None:
        from tempfile import gettempdir

        return gettempdir()
    return os.path.dirname(os.path.realpath(beside))


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
