"""Finished blocks of an ensemble: kept one by one, and put together at the end.

While members are run whose result is a file, a folder ``FILE.parts`` beside it has a file for
each finished block, and ``ensemble.json``, which says what they are blocks of. Otherwise they are
kept in memory. Blocks are written by whoever runs them; what is told of them comes back.
"""

from __future__ import annotations

import json
import math
import zipfile
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write, discard, is_temporary, whole_file, write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.block_files import (
    COLUMN,
    TEXTS,
    BlockFiles,
    arrays_of,
    written_name,
)
from lagrange_cli.simulate.ensemble.blocks import MemberBlock
from lagrange_cli.simulate.ensemble.result import Ensemble
from lagrange_cli.simulate.ensemble.summaries import (
    BlockSummary,
    Failure,
    InMemory,
    KeptBlock,
    NumberRange,
    Summarized,
)

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.run import Blocks

#: Name, shape, and parts along the first axis, of an array.
_Entry: TypeAlias = tuple[str, tuple[int, ...], Iterable[Array]]

#: Keeps a block where it is run, in this process or another one; what is told of it comes back.
BlockWriter: TypeAlias = Callable[[MemberBlock], KeptBlock]

_NOTE = "ensemble.json"


def parts_of(output: str) -> Path:
    """Name the folder of the blocks of a result."""
    return Path(f"{output}.parts")


def _refused(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="resume"))


@dataclass
class Store(ABC):
    """Finished blocks by their numbers.

    Attributes
    ----------
    size
        Members of each block but the last.
    finished
        Summary of each finished block.
    """

    size: int
    finished: dict[int, BlockSummary] = field(default_factory=dict)

    @property
    @abstractmethod
    def writer(self) -> BlockWriter:
        """What keeps a block; it can be sent to other processes."""

    def finish(self, kept: KeptBlock) -> None:
        """Count a block as finished, which the writer has kept."""
        self.finished[kept.number] = kept.summary

    @abstractmethod
    def complete(self, t: Array) -> None:
        """Put all blocks together in the result, once they are finished.

        Parameters
        ----------
        t
            Times of the samples.

        Raises
        ------
        InputError
            The result cannot be written.
        """

    def counts(self) -> dict[str, int]:
        """Return status → number of members of finished blocks."""
        total = Counter[str]()
        for summary in self.finished.values():
            total.update(summary.counts)
        return dict(sorted(total.items()))

    def failures(self) -> Iterator[Failure]:
        """Yield the members of finished blocks that are not ``ok``, in order."""
        for number in sorted(self.finished):
            yield from self.finished[number].failures

    def estimated(self) -> float | None:
        """Return the largest estimated error, relative to scales; None if there is none."""
        known = [s.estimated for s in self.finished.values() if not math.isnan(s.estimated)]
        return max(known, default=None)

    def ranges(self) -> dict[str, NumberRange]:
        """Return kept number → its range over the members of finished blocks."""
        found: dict[str, NumberRange] = {}
        for summary in self.finished.values():
            for name, extent in summary.ranges.items():
                found[name] = extent.with_other(found[name]) if name in found else extent
        return found


class SummaryStore(Store):
    """Summaries alone."""

    @property
    def writer(self) -> BlockWriter:
        return Summarized(self.size)

    def complete(self, t: Array) -> None:
        """Nothing is written."""


@dataclass
class MemoryStore(Store):
    """Blocks in memory."""

    _blocks: dict[int, MemberBlock] = field(default_factory=dict)

    @property
    def writer(self) -> BlockWriter:
        return InMemory(self.size)

    def finish(self, kept: KeptBlock) -> None:
        super().finish(kept)
        assert kept.block is not None
        self._blocks[kept.number] = kept.block

    def complete(self, t: Array) -> None:
        """Nothing is written: :meth:`ensemble` has the result."""

    def ensemble(self, name: str, t: Array) -> Ensemble:
        """Put all blocks together."""
        arrays = {number: arrays_of(block) for number, block in self._blocks.items()}
        whole = _Whole(
            self, lambda number: list(arrays[number]), lambda number, name: arrays[number].get(name)
        )
        return Ensemble(name, {n: np.concatenate(list(p)) for n, _, p in whole.entries(t)})


@dataclass
class NpzStore(Store):
    """Blocks in files of a folder, which become one NPZ.

    Attributes
    ----------
    output
        The NPZ.
    """

    output: str = ""

    @property
    def writer(self) -> BlockWriter:
        return self._files

    @property
    def _files(self) -> BlockFiles:
        return BlockFiles(parts_of(self.output), self.size)

    def load(self, blocks: int, length: Callable[[int], int]) -> None:
        """Read the finished blocks of an earlier run, as :meth:`.block_files.BlockFiles.finished`;
        what cannot be read is not finished."""
        for kept in self._files.finished(blocks, length):
            self.finish(kept)

    def complete(self, t: Array) -> None:
        with whole_file(self.output) as stream:
            self._write(stream, t)
        discard(parts_of(self.output))

    def _write(self, stream: BinaryIO, t: Array) -> None:
        whole = _Whole(self, self._files.names, self._files.array)
        with zipfile.ZipFile(stream, "w") as archive:
            for name, shape, parts in whole.entries(t):
                _put(archive, name, shape, parts)


@dataclass(frozen=True)
class _Whole:
    """Arrays over the members of all finished blocks.

    Attributes
    ----------
    store
        Which these are.
    names
        Number of a block → names of its arrays.
    array
        Number of a block and name → array, None if it has none.
    """

    store: Store
    names: Callable[[int], list[str]]
    array: Callable[[int, str], Array | None]

    def entries(self, t: Array) -> Iterator[_Entry]:
        """Yield one array a name: times, columns (members, samples), and what members have one of.

        Each is read from all blocks before the next one.
        """
        numbers = sorted(self.store.finished)
        members = sum(map(self._members, numbers))
        yield "t", t.shape, [t]
        for name in dict.fromkeys(name for k in numbers for name in self.names(k)):
            shape = (members, len(t)) if name.startswith(COLUMN) else (members,)
            yield written_name(name), shape, self._parts(numbers, name, shape[1:])

    def _members(self, number: int) -> int:
        return sum(self.store.finished[number].counts.values())

    def _parts(self, numbers: Sequence[int], name: str, rest: tuple[int, ...]) -> Iterator[Array]:
        """Yield an array of each finished block, NaN in one that has none."""
        width = max(self._width(number, name) for number in numbers) if name in TEXTS else 0
        for number in numbers:
            part = self.array(number, name)
            if part is None:
                part = np.full((self._members(number), *rest), np.nan)
            yield part.astype(f"<U{width}") if width else part

    def _width(self, number: int, name: str) -> int:
        """Return the length of the longest text of a finished block."""
        part = self.array(number, name)
        return 1 if part is None else max(1, part.dtype.itemsize // 4)


def _put(
    archive: zipfile.ZipFile,
    name: str,
    shape: tuple[int, ...],
    parts: Iterable[Array],
) -> None:
    """Write an array that comes in parts along its first axis."""
    waiting = iter(parts)
    first = next(waiting)
    with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as file:
        header = np.lib.format.header_data_from_array_1_0(first)
        np.lib.format.write_array_header_1_0(file, {**header, "shape": shape})
        file.write(np.ascontiguousarray(first).tobytes())
        for part in waiting:
            file.write(np.ascontiguousarray(part).tobytes())


def open_store(output: str | None, blocks: Blocks, *, resume: bool) -> Store:
    """Open the store of finished blocks, with ``resume`` those of an interrupted run.

    Parameters
    ----------
    output
        The NPZ that the result is to be; None if nothing but summaries is kept.
    blocks
        All that are to be.

    Raises
    ------
    InputError
        There are blocks and they are not to be used, or they are of another ensemble.
    """
    if output is None:
        return SummaryStore(blocks.size)
    folder = parts_of(output)
    store = NpzStore(blocks.size, output=output)
    note = {"key": blocks.plan.key, "members": len(blocks.members), "size": blocks.size}
    if not _has_begun(folder):
        _begin(folder, note)
        return store
    if not resume:
        raise _refused(
            f"'{folder}' has the members that an interrupted run finished",
            f"--resume goes on with the others; rm -r '{folder}' begins anew",
        )
    if _read(folder / _NOTE) != note:
        raise _refused(
            f"'{folder}' is of another ensemble: the scene, its members, options that matter or"
            " the program have changed",
            f"rm -r '{folder}' begins anew",
        )
    store.load(len(blocks), blocks.length)
    return store


def _has_begun(folder: Path) -> bool:
    """Tell whether anything is in the way of a new run; a killed one can leave an empty folder."""
    try:
        return not all(is_temporary(path.name) for path in folder.iterdir())
    except FileNotFoundError:
        return False
    except OSError:
        return True


def _begin(folder: Path, note: Mapping[str, Any]) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise cannot_write(f"'{folder}'", error) from error
    write_file(folder / _NOTE, json.dumps(note))


def _read(path: Path) -> Any:
    """Read the JSON in a file, None if there is none."""
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
