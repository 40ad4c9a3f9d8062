"""Finished blocks of an ensemble: kept one by one, and put together at the end.

While members are run whose result is a file, a folder ``FILE.parts`` beside it has a file for
each finished block, written whole or not at all, and ``ensemble.json``, which says what they are
blocks of. Otherwise they are kept in memory.
"""

from __future__ import annotations

import io
import json
import re
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write, discard, is_temporary, whole_file, write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.blocks import MEMBER_FIGURES, MEMBER_WORDS, MemberBlock
from lagrange_cli.simulate.ensemble.result import Ensemble

#: Name, shape, and parts along the first axis, of an array.
_Entry: TypeAlias = tuple[str, tuple[int, ...], Iterable[Array]]

_NOTE = "ensemble.json"
_BLOCK = re.compile(r"block-([0-9]{6})\.npz", re.ASCII)


def parts_of(output: str) -> Path:
    """Name the folder of the blocks of a result."""
    return Path(f"{output}.parts")


def _refused(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="resume"))


@dataclass
class Store:
    """Blocks by their numbers; in memory, but for the columns if there is a ``folder``."""

    folder: Path | None
    finished: dict[int, MemberBlock] = field(default_factory=dict)

    def keep(self, block: MemberBlock) -> None:
        """Keep a block that is finished.

        Raises
        ------
        InputError
            It cannot be written.
        """
        if self.folder is not None:
            write_file(self._path(block.number), _serialized(block))
            block = replace(block, columns={})
        self.finished[block.number] = block

    def _path(self, number: int) -> Path:
        assert self.folder is not None
        return self.folder / f"block-{number:06d}.npz"

    def figures(self, name: str) -> Array:
        """Return a number of every member of finished blocks, in order."""
        parts = [self.finished[k].figures[name] for k in sorted(self.finished)]
        return np.concatenate([np.empty(0), *parts])

    def _scales(self, name: str) -> Array:
        """Return a coordinate's scale in every member of finished blocks, NaN if there is none."""
        blocks = [self.finished[k] for k in sorted(self.finished)]
        nothing = (np.full(len(block.words["status"]), np.nan) for block in blocks)
        pairs = zip(blocks, nothing, strict=True)
        return np.concatenate([block.scales.get(name, none) for block, none in pairs])

    def words(self, name: str) -> list[str]:
        """Return a text of every member of finished blocks, in order."""
        return [word for k in sorted(self.finished) for word in self.finished[k].words[name]]

    def members(self, sizes: Sequence[int]) -> list[int]:
        """Return numbers of the members of finished blocks; ``sizes`` are those of all blocks."""
        firsts = np.concatenate([[0], np.cumsum(sizes)]).tolist()
        return [m for k in sorted(self.finished) for m in range(firsts[k], firsts[k + 1])]

    def load(self, sizes: Sequence[int]) -> None:
        """Read the finished blocks of an earlier run; what cannot be read is not finished."""
        assert self.folder is not None
        for path in sorted(self.folder.iterdir()):
            match = _BLOCK.fullmatch(path.name)
            number = int(match[1]) if match else len(sizes)
            if number < len(sizes):
                block = _deserialized(path, number, sizes[number])
                if block is not None:
                    self.finished[number] = block

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
        """Yield one array a name: times, columns (members, samples), and figures of members."""
        numbers = sorted(self.finished)
        members = sum(len(self.finished[k].words["status"]) for k in numbers)
        yield "t", t.shape, [t]
        for name in self._column_names():
            yield name, (members, len(t)), (self._column(k, name, len(t)) for k in numbers)
        for name in self.finished[numbers[0]].varied:
            yield f"given/{name}", (members,), [self.finished[k].varied[name] for k in numbers]
        for name in dict.fromkeys(n for k in numbers for n in self.finished[k].scales):
            yield f"scale/{name}", (members,), [self._scales(name)]
        for name in MEMBER_FIGURES:
            yield f"member/{name}", (members,), [self.figures(name)]
        for name in MEMBER_WORDS:
            yield f"member/{name}", (members,), [np.array(self.words(name))]

    def _column_names(self) -> list[str]:
        names = dict[str, None]()
        for number in sorted(self.finished):
            names |= dict.fromkeys(self._names_in(number))
        return list(names)

    def _names_in(self, number: int) -> list[str]:
        """Return the columns of a finished block."""
        if self.folder is None:
            return list(self.finished[number].columns)
        with zipfile.ZipFile(self._path(number)) as archive:
            inside = [name.removesuffix(".npy") for name in archive.namelist()]
        return [name.removeprefix("c/") for name in inside if name.startswith("c/")]

    def _column(self, number: int, name: str, samples: int) -> Array:
        block = self.finished[number]
        if name in block.columns:
            return block.columns[name]
        if self.folder is not None:
            with np.load(self._path(number), allow_pickle=False) as arrays:
                if f"c/{name}" in arrays:
                    return np.asarray(arrays[f"c/{name}"], dtype=np.float64)
        return np.full((len(block.words["status"]), samples), np.nan)


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


def _serialized(block: MemberBlock) -> bytes:
    arrays: dict[str, Any] = {f"c/{name}": values for name, values in block.columns.items()}
    arrays |= {f"g/{name}": values for name, values in block.varied.items()}
    arrays |= {f"s/{name}": values for name, values in block.scales.items()}
    arrays |= {f"f/{name}": values for name, values in block.figures.items()}
    arrays |= {f"w/{name}": np.array(words) for name, words in block.words.items()}
    file = io.BytesIO()
    np.savez(file, **arrays)
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
        kind: {name[2:]: a for name, a in every.items() if name.startswith(f"{kind}/")}
        for kind in "gsfw"
    }
    known = set(parts["f"]) == set(MEMBER_FIGURES) and set(parts["w"]) == set(MEMBER_WORDS)
    if not known or any(array.shape[:1] != (size,) for array in every.values()):
        return None
    words = {name: [str(word) for word in array] for name, array in parts["w"].items()}
    return MemberBlock(number, {}, parts["g"], parts["s"], parts["f"], words)


def open_store(output: str | None, key: str, sizes: Sequence[int], *, resume: bool) -> Store:
    """Open the store of finished blocks, with ``resume`` those of an interrupted run.

    Parameters
    ----------
    output
        The NPZ that the result is to be; None if columns are not kept.
    key
        The hash of all that the results depend on.
    sizes
        Members of each block.

    Raises
    ------
    InputError
        There are blocks and they are not to be used, or they are of another ensemble.
    """
    if output is None:
        return Store(None)
    folder = parts_of(output)
    store = Store(folder)
    note = {"key": key, "blocks": list(sizes)}
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
    store.load(sizes)
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
