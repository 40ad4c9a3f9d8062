"""Finished blocks of an ensemble: kept one by one, and put together at the end.

While members are run whose result is a file, a folder ``FILE.parts`` beside it has a file for
each finished block, written whole or not at all, and ``ensemble.json``, which says what they are
blocks of. Otherwise they are kept in memory.
"""

from __future__ import annotations

import io
import json
import math
import re
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write, discard, is_temporary, whole_file, write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.blocks import MEMBER_FIGURES, MEMBER_WORDS, MemberBlock
from lagrange_cli.simulate.ensemble.result import Ensemble

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.run import Blocks

#: Name, shape, and parts along the first axis, of an array.
_Entry: TypeAlias = tuple[str, tuple[int, ...], Iterable[Array]]

_NOTE = "ensemble.json"
_BLOCK = re.compile(r"block-([0-9]{9})\.npz", re.ASCII)


def parts_of(output: str) -> Path:
    """Name the folder of the blocks of a result."""
    return Path(f"{output}.parts")


def _refused(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="resume"))


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


@dataclass
class Store:
    """Finished blocks by their numbers: summaries; whole ones in files, or in memory if wanted.

    Attributes
    ----------
    size
        Members of each block but the last.
    folder
        Where blocks are kept; None for memory.
    whole
        Blocks are kept in memory if there is no folder, not only their summaries.
    finished
        Summary of each finished block.
    """

    size: int
    folder: Path | None = None
    whole: bool = False
    finished: dict[int, BlockSummary] = field(default_factory=dict)
    _blocks: dict[int, MemberBlock] = field(default_factory=dict)

    def keep(self, block: MemberBlock) -> None:
        """Keep a block that is finished.

        Raises
        ------
        InputError
            It cannot be written.
        """
        if self.folder is not None:
            write_file(self._path(block.number), _serialized(block))
        elif self.whole:
            self._blocks[block.number] = block
        self._finish(block)

    def _finish(self, block: MemberBlock) -> None:
        self.finished[block.number] = BlockSummary.of(block, block.number * self.size)

    def _path(self, number: int) -> Path:
        assert self.folder is not None
        return self.folder / f"block-{number:09d}.npz"

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

    def load(self, blocks: int, length: Callable[[int], int]) -> None:
        """Read the finished blocks of an earlier run; what cannot be read is not finished.

        Parameters
        ----------
        blocks
            How many there are.
        length
            Number of a block → members of it.
        """
        assert self.folder is not None
        for path in sorted(self.folder.iterdir()):
            match = _BLOCK.fullmatch(path.name)
            number = int(match[1]) if match else blocks
            if number < blocks:
                block = _deserialized(path, number, length(number))
                if block is not None:
                    self._finish(block)

    def write(self, output: str, t: Array) -> None:
        """Put all blocks together in one NPZ, and remove them.

        Raises
        ------
        InputError
            It cannot be written.
        """
        assert self.folder is not None
        with whole_file(output) as stream:
            self._write(stream, t)
        discard(self.folder)

    def _write(self, stream: BinaryIO, t: Array) -> None:
        with zipfile.ZipFile(stream, "w") as archive:
            for name, shape, parts in self._entries(t):
                _put(archive, name, shape, parts)

    def ensemble(self, name: str, t: Array) -> Ensemble:
        """Put all blocks together in memory."""
        entries = self._entries(t)
        return Ensemble(name, {entry: np.concatenate(list(parts)) for entry, _, parts in entries})

    def _entries(self, t: Array) -> Iterator[_Entry]:
        """Yield one array a name: times, columns (members, samples), and what members have one of.

        Each is read from all blocks before the next one.
        """
        numbers = sorted(self.finished)
        members = sum(sum(self.finished[k].counts.values()) for k in numbers)
        yield "t", t.shape, [t]
        for name in dict.fromkeys(name for k in numbers for name in self._names_in(k)):
            shape = (members, len(t)) if name.startswith(_COLUMN) else (members,)
            yield _written_name(name), shape, self._parts(numbers, name, shape[1:])

    def _names_in(self, number: int) -> list[str]:
        """Return the names of the arrays of a finished block."""
        if self.folder is None:
            return list(_arrays(self._blocks[number]))
        with zipfile.ZipFile(self._path(number)) as archive:
            return [name.removesuffix(".npy") for name in archive.namelist()]

    def _parts(self, numbers: Sequence[int], name: str, rest: tuple[int, ...]) -> Iterator[Array]:
        """Yield an array of each finished block, NaN in one that has none."""
        width = max(self._width(number, name) for number in numbers) if name in _TEXTS else 0
        for number in numbers:
            part = self._array(number, name)
            if part is None:
                part = np.full((sum(self.finished[number].counts.values()), *rest), np.nan)
            yield part.astype(f"<U{width}") if width else part

    def _width(self, number: int, name: str) -> int:
        """Return the length of the longest text of a finished block."""
        part = self._array(number, name)
        return 1 if part is None else max(1, part.dtype.itemsize // 4)

    def _array(self, number: int, name: str) -> Array | None:
        if self.folder is None:
            return _arrays(self._blocks[number]).get(name)
        with np.load(self._path(number), allow_pickle=False) as arrays:
            return np.asarray(arrays[name]) if name in arrays else None


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


# Blocks as bytes.


#: Kind of a block's arrays → how their names begin in its file.
_KINDS = {
    "columns": "c/",
    "numbers": "n/",
    "varied": "g/",
    "scales": "s/",
    "figures": "f/",
    "words": "w/",
}

_COLUMN = _KINDS["columns"]

#: The same → how they begin in the result.
_WRITTEN = {"c/": "", "n/": "", "g/": "given/", "s/": "scale/", "f/": "member/", "w/": "member/"}

#: Names of arrays of texts.
_TEXTS = frozenset(f"w/{name}" for name in MEMBER_WORDS)


def _written_name(name: str) -> str:
    """Return the name that an array of blocks has in the result."""
    return _WRITTEN[name[:2]] + name[2:]


def _arrays(block: MemberBlock) -> dict[str, Any]:
    """Return the arrays of a block by their names in its file, in the order of the result's."""
    arrays: dict[str, Any] = {}
    for kind, start in _KINDS.items():
        arrays |= {f"{start}{name}": np.asarray(a) for name, a in getattr(block, kind).items()}
    return arrays


def _serialized(block: MemberBlock) -> bytes:
    file = io.BytesIO()
    np.savez(file, **_arrays(block))
    return file.getvalue()


#: Exceptions that a file which is no archive of arrays leads to.
_UNREADABLE = (
    *(OSError, ValueError, KeyError, EOFError, RuntimeError, MemoryError),
    *(zipfile.BadZipFile, zlib.error),
)


def _deserialized(path: Path, number: int, size: int) -> MemberBlock | None:
    """Read a block without its columns; None if the file is none, or has other members."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            every = {name: arrays[name] for name in arrays.files}
    except _UNREADABLE:
        return None
    parts = {
        kind: {name[2:]: a for name, a in every.items() if name.startswith(start)}
        for kind, start in _KINDS.items()
    }
    figures, words = parts["figures"], parts["words"]
    known = set(figures) == set(MEMBER_FIGURES) and set(words) == set(MEMBER_WORDS)
    if not known or any(array.shape[:1] != (size,) for array in every.values()):
        return None
    parts["words"] = {name: [str(word) for word in array] for name, array in words.items()}
    return MemberBlock(number, **parts)


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
        return Store(blocks.size)
    folder = parts_of(output)
    store = Store(blocks.size, folder)
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
