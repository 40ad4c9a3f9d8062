"""Finished blocks as files of a folder, which become one file once all are finished.

While members are run a folder ``FILE.parts`` beside the result has a file for each finished block,
written whole or not at all by the process that ran the block.
"""

from __future__ import annotations

import io
import json
import re
import zipfile
import zlib
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from lagrange_cli.files import cannot_write, discard, is_temporary, whole_file, write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.blocks import (
    KINDS,
    MEMBER_FIGURES,
    MEMBER_WORDS,
    FinishedBlock,
    MemberBlock,
    arrays_of,
)
from lagrange_cli.simulate.ensemble.store.result import Ensemble
from lagrange_cli.simulate.ensemble.store.store import (
    BlockWriter,
    JoinedArrays,
    Store,
    require_resumable,
)

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks


_NOTE = "ensemble.json"


def parts_of(output: str) -> Path:
    """Return the folder of the finished blocks of a result."""
    return Path(f"{output}.parts")


@dataclass
class PartsStore(Store):
    """Blocks in files of a folder, which become one file.

    Attributes
    ----------
    output
        That file.
    """

    output: str = ""

    @property
    def writer(self) -> BlockWriter:
        return self._files

    @property
    def place(self) -> str:
        return str(parts_of(self.output).absolute())

    def far_writer(self, admit: Callable[[], None]) -> BlockWriter:
        return BlockFiles(Path(self.place), self.size, admit)

    @property
    def _files(self) -> BlockFiles:
        """The files of finished blocks."""
        return BlockFiles(parts_of(self.output), self.size)

    def open(self, blocks: Blocks, *, resume: bool) -> None:
        """Begin the folder, or with ``resume`` go on with the blocks of an interrupted run in it.

        Raises
        ------
        InputError
            The folder cannot be made; or it is there and may not be used.
        """
        folder = parts_of(self.output)
        if not _has_begun(folder):
            _begin(folder, blocks.note)
            return
        anew = f"rm -r '{folder}' begins anew"
        require_resumable(folder, _read(folder / _NOTE), blocks.note, resume, anew)
        for block in self._files.finished(len(blocks), blocks.length):
            self.finish(block)

    def complete(self, t: Array) -> None:
        with whole_file(self.output) as stream:
            self._write(stream, t)
        discard(parts_of(self.output))

    def give_up(self) -> None:
        discard(parts_of(self.output))

    @abstractmethod
    def _write(self, stream: BinaryIO, t: Array) -> None:
        """Write the whole file."""


class NpzStore(PartsStore):
    """Blocks that become an NPZ."""

    def ensemble(self, name: str, t: Array) -> Ensemble:
        return Ensemble(name, NpzArrays(self.output))

    def _write(self, stream: BinaryIO, t: Array) -> None:
        whole = JoinedArrays(self, self._files.names, self._files.array)
        with zipfile.ZipFile(stream, "w") as archive:
            for name, shape, parts in whole.entries(t):
                _put(archive, name, shape, parts)


@dataclass(frozen=True)
class NpzArrays(Mapping[str, Array]):
    """Arrays of an NPZ, read as they are asked for.

    Attributes
    ----------
    path
        Path of the file.
    """

    path: str

    def __getitem__(self, name: str) -> Array:
        with np.load(self.path, allow_pickle=False) as arrays:
            return np.asarray(arrays[name])

    def __iter__(self) -> Iterator[str]:
        with np.load(self.path, allow_pickle=False) as arrays:
            return iter(arrays.files)

    def __len__(self) -> int:
        return sum(1 for _ in self)


_BLOCK = re.compile(r"block-([0-9]{9})\.npz", re.ASCII)


def _serialized(block: MemberBlock) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays_of(block))
    return file.getvalue()


#: Exceptions that a file leads to which is no archive of arrays.
_UNREADABLE = (
    *(OSError, ValueError, KeyError, EOFError, RuntimeError, MemoryError),
    *(zipfile.BadZipFile, zlib.error),
)


def _deserialized(path: Path, number: int, size: int) -> MemberBlock | None:
    """Read a block; None if the file is no block, or has another number of members."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            every = {name: arrays[name] for name in arrays.files}
    except _UNREADABLE:
        return None
    parts = {
        kind: {name[2:]: a for name, a in every.items() if name.startswith(start)}
        for kind, start in KINDS.items()
    }
    figures, words = parts["figures"], parts["words"]
    known = set(figures) == set(MEMBER_FIGURES) and set(words) == set(MEMBER_WORDS)
    if not known or any(array.shape[:1] != (size,) for array in every.values()):
        return None
    parts["words"] = {name: [str(word) for word in array] for name, array in words.items()}
    return MemberBlock(number, **parts)


@dataclass(frozen=True)
class BlockFiles:
    """Files of finished blocks in a folder.

    Attributes
    ----------
    folder
        The folder.
    size
        Members of each block but the last.
    admit
        Called before a block takes its place; an exception of it keeps the block out.
    """

    folder: Path
    size: int
    admit: Callable[[], None] | None = None

    def __call__(self, block: MemberBlock) -> FinishedBlock:
        """Write a block.

        Raises
        ------
        InputError
            It cannot be written.
        """
        write_file(self._path(block.number), _serialized(block), self.admit)
        return FinishedBlock.of_block(block, self.size)

    def _path(self, number: int) -> Path:
        return self.folder / f"block-{number:09d}.npz"

    def finished(self, blocks: int, length: Callable[[int], int]) -> Iterator[FinishedBlock]:
        """Yield the summaries of the blocks that can be read.

        Parameters
        ----------
        blocks
            Number of blocks.
        length
            Number of a block → number of its members.
        """
        for path in sorted(self.folder.iterdir()):
            match = _BLOCK.fullmatch(path.name)
            number = int(match[1]) if match else blocks
            if number < blocks:
                block = _deserialized(path, number, length(number))
                if block is not None:
                    yield FinishedBlock.of_block(block, self.size)

    def names(self, number: int) -> list[str]:
        """Return the names of the arrays of a block."""
        with zipfile.ZipFile(self._path(number)) as archive:
            return [name.removesuffix(".npy") for name in archive.namelist()]

    def array(self, number: int, name: str) -> Array | None:
        """Return an array of a block, None if it has none of this name."""
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


def _has_begun(folder: Path) -> bool:
    """Decide whether a run has begun here; a killed one can leave an empty folder."""
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
