"""Tables of samples as files, written in parts: CSV and NPZ."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import IO, TYPE_CHECKING, BinaryIO, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import ending_of
from lagrange_cli.simulate.arrays import Array

if TYPE_CHECKING:
    import zipfile

#: Takes the next rows of a table, column name → values; every part has the same columns.
AddRows: TypeAlias = Callable[[Mapping[str, Array]], None]

#: Opens a table that a file is to hold, of ``count`` rows in all: (file, count, folder); what
#: memory should not hold waits in ``folder``. It is complete at the end of the context.
Format: TypeAlias = Callable[[BinaryIO, int, str | None], AbstractContextManager[AddRows]]

#: Bytes of a number.
_NUMBER = 8

#: Bytes of a column that are copied at a time.
_PART = 2**22

#: Bytes of all columns that wait in memory; more wait in a file.
BYTES_IN_MEMORY = 2**26

#: Bytes of a column from which on the archive needs the format of 64 bits.
LARGE = 2**31


@contextmanager
def as_csv(file: BinaryIO, count: int, folder: str | None = None) -> Iterator[AddRows]:
    """Write a header of names, then numbers with 17 significant digits."""
    import csv

    headed = False

    def add(table: Mapping[str, Array]) -> None:
        nonlocal headed
        text = io.StringIO()
        if not headed:
            csv.writer(text, lineterminator="\n").writerow(table)
            headed = True
        for row in np.column_stack(list(table.values())).tolist():
            text.write(",".join(f"{value:.17g}" for value in row) + "\n")
        file.write(text.getvalue().encode())

    yield add


@contextmanager
def as_npz(file: BinaryIO, count: int, folder: str | None = None) -> Iterator[AddRows]:
    """Write an NPZ archive, one array a name, the same bytes every time.

    An archive has one array after the other, so that many columns wait in a file of their own.
    """
    # Here and not above, as in the other format: most runs write no file.
    import tempfile
    import zipfile

    names: list[str] = []
    added = 0
    with tempfile.SpooledTemporaryFile(BYTES_IN_MEMORY, dir=folder) as waiting:

        def add(table: Mapping[str, Array]) -> None:
            nonlocal added
            names[:] = table
            for k, values in enumerate(table.values()):
                waiting.seek(_NUMBER * (k * count + added))
                waiting.write(np.ascontiguousarray(values, dtype=float).tobytes())
            added += len(next(iter(table.values())))

        yield add
        waiting.seek(0)
        with zipfile.ZipFile(file, "w") as archive:
            for name in names:
                _put(archive, name, count, _parts(waiting, _NUMBER * count))


def _parts(file: IO[bytes], size: int) -> Iterator[bytes]:
    while size:
        part = file.read(min(_PART, size))
        size -= len(part)
        yield part


def _put(archive: zipfile.ZipFile, name: str, count: int, parts: Iterable[bytes]) -> None:
    """Write an array of doubles, shape (count,), from its bytes."""
    import zipfile

    entry, large = zipfile.ZipInfo(f"{name}.npy"), _NUMBER * count > LARGE
    with archive.open(entry, "w", force_zip64=large) as file:
        header = np.lib.format.header_data_from_array_1_0(np.empty(0))
        np.lib.format.write_array_header_1_0(file, {**header, "shape": (count,)})
        for part in parts:
            file.write(part)


#: Format by the ending of a file's name.
_FORMATS: dict[str, Format] = {".csv": as_csv, ".npz": as_npz}


def format_of(path: str | os.PathLike[str]) -> Format:
    """Return the format of a file by its ending.

    Raises
    ------
    InputError
        There is none.
    """
    ending = ending_of(path)
    if ending not in _FORMATS:
        raise InputError(
            Problem(
                f"a trajectory is written as .csv or .npz, not '{ending}'",
                hint="-o traj.csv",
                rule="output",
            )
        )
    return _FORMATS[ending]
