"""Finished blocks as files of a folder: each is written whole or not at all, by whoever ran it."""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lagrange_cli.files import write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.blocks import MEMBER_FIGURES, MEMBER_WORDS, MemberBlock
from lagrange_cli.simulate.ensemble.store.summaries import KeptBlock

_BLOCK = re.compile(r"block-([0-9]{9})\.npz", re.ASCII)

#: Kind of a block's arrays → how their names begin in its file.
KINDS = {
    "columns": "c/",
    "numbers": "n/",
    "varied": "g/",
    "scales": "s/",
    "figures": "f/",
    "words": "w/",
}

COLUMN = KINDS["columns"]

#: The same → how they begin in the result.
WRITTEN = {"c/": "", "n/": "", "g/": "given/", "s/": "scale/", "f/": "member/", "w/": "member/"}

#: Names of arrays of texts.
TEXTS = frozenset(f"w/{name}" for name in MEMBER_WORDS)


def written_name(name: str) -> str:
    """Return the name that an array of blocks has in the result."""
    return WRITTEN[name[:2]] + name[2:]


def arrays_of(block: MemberBlock) -> dict[str, Any]:
    """Return the arrays of a block by their names in its file, in the order of the result's."""
    arrays: dict[str, Any] = {}
    for kind, start in KINDS.items():
        arrays |= {f"{start}{name}": np.asarray(a) for name, a in getattr(block, kind).items()}
    return arrays


def _serialized(block: MemberBlock) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays_of(block))
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
    """Files of blocks.

    Attributes
    ----------
    folder
        Where they are.
    size
        Members of each block but the last.
    admit
        Called before a block takes its place; what it raises keeps it out.
    """

    folder: Path
    size: int
    admit: Callable[[], None] | None = None

    def __call__(self, block: MemberBlock) -> KeptBlock:
        """Write a block.

        Raises
        ------
        InputError
            It cannot be written.
        """
        write_file(self._path(block.number), _serialized(block), self.admit)
        return KeptBlock.of(block, self.size)

    def _path(self, number: int) -> Path:
        return self.folder / f"block-{number:09d}.npz"

    def finished(self, blocks: int, length: Callable[[int], int]) -> Iterator[KeptBlock]:
        """Yield what is known of the blocks that can be read.

        Parameters
        ----------
        blocks
            How many there are.
        length
            Number of a block → members of it.
        """
        for path in sorted(self.folder.iterdir()):
            match = _BLOCK.fullmatch(path.name)
            number = int(match[1]) if match else blocks
            if number < blocks:
                block = _deserialized(path, number, length(number))
                if block is not None:
                    yield KeptBlock.of(block, self.size)

    def names(self, number: int) -> list[str]:
        """Return the names of the arrays of a block."""
        with zipfile.ZipFile(self._path(number)) as archive:
            return [name.removesuffix(".npy") for name in archive.namelist()]

    def array(self, number: int, name: str) -> Array | None:
        """Return an array of a block, None if it has none of this name."""
        with np.load(self._path(number), allow_pickle=False) as arrays:
            return np.asarray(arrays[name]) if name in arrays else None
