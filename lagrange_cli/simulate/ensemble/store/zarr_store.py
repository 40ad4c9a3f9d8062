"""Finished blocks in a Zarr store, where xarray, Dask and other languages read them as they are.

Every array is divided along members as they are divided into blocks, so that a block is one chunk
of each, which whoever runs the block writes: no two processes write one chunk. Whoever drives the
run marks the block as finished afterwards, in ``block.finished``; what is not marked is run again.
"""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write, discard, is_address, remove_abandoned_files
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.blocks import (
    COLUMN,
    TEXTS,
    FinishedBlock,
    MemberBlock,
    arrays_of,
    written_name,
)
from lagrange_cli.simulate.ensemble.store.result import Description, Ensemble
from lagrange_cli.simulate.ensemble.store.store import (
    Store,
    refused,
    require_package,
    require_resumable,
    settled,
)
from lagrange_cli.simulate.request import resolve

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks

#: Names of the axes; ``t`` is also the array of sample times.
_AXES = ("member", "t")

#: Name of the array of flags of finished blocks.
_FINISHED = "block.finished"

#: Flags that are written together.
_FLAGS = 4096

#: Attribute of an array: its name in the result; of the store: what it must agree on to go on.
_NAME, _NOTE = "npz_name", "lagrange_run"

#: Character for the slash in names, which would make a folder of them.
_SLASH = "÷"


def array_name(name: str) -> str:
    """Return the name in a store of an array of the result: ``final.theta`` of ``final/theta``.

    A column that has the name of the axis is ``column.member``.
    """
    if name == _AXES[0]:
        return f"column.{name}"
    return name.replace("/", ".", 1).replace("/", _SLASH)


@contextmanager
def _writing(path: str) -> Iterator[None]:
    """Turn errors of the system into refusals to write there."""
    try:
        yield
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error


#: Level of the compression, which leaves it to Zstandard.
_LEVEL = 0


#: Name of a chunk in a store, and the bytes there.
Chunk: TypeAlias = tuple[str, bytes]


def codecs(texts: bool) -> dict[str, Any]:
    """Return options of a new array, so that :func:`chunk` encodes what it holds."""
    from zarr.codecs import BytesCodec, VLenUTF8Codec, ZstdCodec

    serializer = VLenUTF8Codec() if texts else BytesCodec(endian="little")
    return {"serializer": serializer, "compressors": ZstdCodec(level=_LEVEL)}


def chunk(array: Any, number: int, values: NDArray[Any]) -> Chunk:
    """Return a chunk of an array that is divided along its first axis.

    Parameters
    ----------
    values
        Values of the chunk; fewer of the last one, before whose end the array ends.
    """
    from numcodecs import VLenUTF8, Zstd

    texts = values.dtype.kind == "U"
    kind = np.dtype(object) if texts else array.dtype.newbyteorder("<")
    whole = np.full(array.chunks, array.fill_value, kind)
    whole[: len(values)] = values
    place = array.metadata.encode_chunk_key((number,) + (0,) * (whole.ndim - 1))
    data = Zstd(level=_LEVEL).encode(VLenUTF8().encode(whole) if texts else whole)
    return f"{array.path}/{place}", data


def put(group: Any, chunks: Iterable[Chunk]) -> None:
    """Write chunks into the store of a group.

    Raises
    ------
    OSError
        One cannot be written; others may be.
    """
    from zarr.core.buffer import default_buffer_prototype
    from zarr.core.sync import sync

    buffer = default_buffer_prototype().buffer

    async def put_all() -> None:
        stored = (group.store.set(name, buffer.from_bytes(data)) for name, data in chunks)
        await asyncio.gather(*stored)

    sync(put_all())


@dataclass(frozen=True)
class ZarrWriter:
    """Writes blocks as chunks, in this process or another one, on this machine or another one.

    Attributes
    ----------
    path
        Path or address of the store.
    token
        Random name of the run, so that a process that opened an earlier store of this path opens
        this one.
    members, size, samples
        Number of members, of those in each block but the last, and of samples.
    description
        Units and symbols of the arrays.
    admit
        Called before a block is written; an exception of it keeps the block out.
    """

    path: str
    token: str
    members: int
    size: int
    samples: int
    description: Description
    admit: Callable[[], None] | None = None

    def __call__(self, block: MemberBlock) -> FinishedBlock:
        """Write a block.

        Raises
        ------
        InputError
            It cannot be written.
        """
        with _writing(self.path):
            chunks = [
                chunk(self._array(name), block.number, values)
                for name, values in arrays_of(block).items()
            ]
            if self.admit is not None:
                self.admit()
            put(_opened(self.path, self.token).group, chunks)
        return FinishedBlock.of_block(block, self.size)

    def _array(self, name: str) -> Any:
        """Return the array of a name in blocks; make it if this is its first block."""
        from zarr.errors import ContainsArrayError

        opened = _opened(self.path, self.token)
        if name not in opened.arrays:
            written, axes = written_name(name), 2 if name.startswith(COLUMN) else 1
            stored_name, texts = array_name(written), name in TEXTS
            if not settled(lambda: stored_name in opened.group):
                # Several processes may make it at a time.
                with suppress(ContainsArrayError):
                    opened.group.create_array(
                        stored_name,
                        shape=(self.members, self.samples)[:axes],
                        chunks=(self.size, self.samples)[:axes],
                        dtype=str if texts else "float64",
                        fill_value="" if texts else np.nan,
                        dimension_names=_AXES[:axes],
                        attributes={**self.description.of_array(written), _NAME: written},
                        **codecs(texts),
                    )
            opened.arrays[name] = settled(lambda: opened.group[stored_name])
        return opened.arrays[name]


@dataclass(frozen=True)
class _Opened:
    """A store that a process has opened, and its arrays by their names in blocks."""

    group: Any
    arrays: dict[str, Any] = field(default_factory=dict)


@lru_cache(maxsize=4)
def _opened(path: str, token: str) -> _Opened:
    """Open a store, once for each run."""
    import zarr

    return _Opened(zarr.open_group(path, mode="r+", use_consolidated=False))


@dataclass
class ZarrStore(Store):
    """Blocks as chunks of a Zarr store.

    Attributes
    ----------
    path
        Path or address of the store.
    writer_of_run
        Writer of the blocks of this run.
    """

    path: str = ""
    writer_of_run: ZarrWriter | None = None

    @property
    def writer(self) -> ZarrWriter:
        assert self.writer_of_run is not None
        return self.writer_of_run

    @property
    def place(self) -> str:
        return self.path if is_address(self.path) else os.path.abspath(self.path)

    def far_writer(self, admit: Callable[[], None]) -> ZarrWriter:
        return replace(self.writer, path=self.place, admit=admit)

    @property
    def _group(self) -> Any:
        return _opened(self.path, self.writer.token).group

    @cached_property
    def _flags(self) -> tuple[Any, NDArray[np.bool_]]:
        """The array of flags in the store, and the flags."""
        array = self._group[_FINISHED]
        return array, array[:]

    def finish(self, block: FinishedBlock) -> None:
        array, flags = self._flags
        flags[block.number] = True
        number = block.number // _FLAGS
        with _writing(self.path):
            put(self._group, [chunk(array, number, flags[number * _FLAGS :][:_FLAGS])])
        super().finish(block)

    def complete(self, t: Array) -> None:
        """Mark the store as complete, with its metadata in one file."""
        import zarr

        if not is_address(self.path):
            remove_abandoned_files(self.path)
        with _writing(self.path), warnings.catch_warnings():
            # Zarr warns that other implementations do not read consolidated metadata.
            warnings.filterwarnings("ignore", message=".*[Cc]onsolidated")
            self._group.attrs["complete"] = 1
            zarr.consolidate_metadata(self._group.store, path=self._group.path)

    def give_up(self) -> None:
        if not is_address(self.path):
            discard(self.path)

    def load(self, blocks: Blocks) -> None:
        """Count the blocks that an earlier run marked as finished and that can be read."""
        for number in np.flatnonzero(self._flags[1]).tolist():
            block = self._read(number, blocks.length(number))
            if block is not None:
                super().finish(FinishedBlock.of_block(block, self.size))

    def _read(self, number: int, length: int) -> MemberBlock | None:
        """Read the parts of a block that its summary needs; None if they are not whole."""
        first = number * self.size
        arrays = _arrays_of(self._group)

        def part(name: str) -> Array:
            values: Array = arrays[name][first : first + length]
            return values

        try:
            words = {name: part(f"member/{name}").tolist() for name in ("status", "reason")}
            figures = {name: part(f"member/{name}") for name in ("holds_until", "estimated")}
            kinds = ("reduced/", "reduced_error/", "final/")
            numbers = {name: part(name) for name in arrays if name.startswith(kinds)}
        except (OSError, KeyError, ValueError, RuntimeError):
            return None
        if not all(words["status"]):
            return None
        return MemberBlock(number, {}, numbers, {}, {}, figures, words)

    def ensemble(self, name: str, t: Array) -> Ensemble:
        return Ensemble(name, ZarrArrays(self.path))


@dataclass(frozen=True)
class ZarrArrays(Mapping[str, Any]):
    """Arrays of a store by their names in an NPZ, read as they are asked for.

    Attributes
    ----------
    path
        Path or address of the store.
    """

    path: str

    def __getitem__(self, name: str) -> Any:
        values = self._arrays()[name][:]
        return np.array(values.tolist(), dtype=str) if values.dtype.kind in "TO" else values

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays())

    def __len__(self) -> int:
        return len(self._arrays())

    def _arrays(self) -> dict[str, Any]:
        import zarr

        return _arrays_of(zarr.open_group(self.path, mode="r"))


def _arrays_of(group: Any) -> dict[str, Any]:
    """Return the arrays of a store by their names in an NPZ."""
    with warnings.catch_warnings():
        # A run that was killed may have left a temporary file.
        warnings.filterwarnings("ignore", message="Object at .* is not recognized")
        named = [(array.attrs.get(_NAME), array) for _, array in group.arrays()]
    return {str(name): array for name, array in named if name is not None}


# Opening.


def open_zarr_store(path: str, blocks: Blocks, *, resume: bool) -> ZarrStore:
    """Open the store of finished blocks, as :func:`.opening.open_store` does."""
    require_package("zarr", ".zarr", "'lagrange-cli[distributed]'")
    description, plan = Description.of_blocks(blocks), blocks.plan
    t = np.asarray(resolve(plan.model, plan.options).times)
    note = json.dumps(blocks.note)
    with _writing(path):
        attributes = _attributes(path)
        if attributes is None:
            _begin(path, blocks, t, note, description)
        else:
            _require(attributes, note, path, resume)
    writer = ZarrWriter(
        path, secrets.token_hex(8), len(blocks.members), blocks.size, len(t), description
    )
    store = ZarrStore(blocks.size, path=path, writer_of_run=writer)
    if attributes is not None:
        store.load(blocks)
    return store


def _attributes(path: str) -> Mapping[str, Any] | None:
    """Return the attributes of a store; None if nothing is there.

    Raises
    ------
    InputError
        There is no store of an ensemble, but something else.
    """
    import zarr

    try:
        group = zarr.open_group(path, mode="r", use_consolidated=False)
    except FileNotFoundError:
        if is_address(path) or not os.path.exists(path) or not os.listdir(path):
            return None
        raise _other(path) from None
    except (ImportError, ValueError) as error:
        # fsspec has no such protocol, or misses what this one needs.
        raise InputError(Problem(f"cannot open '{path}': {error}", rule="output")) from error
    if _NOTE not in group.attrs:
        raise _other(path)
    # A run that was killed before it had flags is no run.
    return dict(group.attrs) if _FINISHED in group else None


def _other(path: str) -> InputError:
    said = f"cannot write '{path}': there is something else, no ensemble of this program"
    return InputError(Problem(said, hint="name another output", rule="output"))


def _require(attributes: Mapping[str, Any], note: object, path: str, resume: bool) -> None:
    """Refuse to go on with a store of another ensemble, or unasked."""
    anew = "name another output" if is_address(path) else f"rm -r '{path}' begins anew"
    if not resume and attributes.get("complete"):
        raise refused(f"'{path}' is there already, with all members", anew)
    require_resumable(path, attributes[_NOTE], note, resume, anew)


def _begin(path: str, blocks: Blocks, t: Array, note: str, description: Description) -> None:
    """Make a store without results."""
    import zarr

    coordinates = " ".join(array_name(f"given/{name}") for name in blocks.plan.names)
    attributes = {**description.plain(), _NOTE: note, "coordinates": coordinates}
    group = zarr.open_group(path, mode="a", zarr_format=3, attributes=attributes)
    group.update_attributes(attributes)
    times = group.create_array(
        _AXES[1],
        shape=t.shape,
        chunks=t.shape,
        dtype="float64",
        dimension_names=_AXES[1:],
        attributes={**description.of_array("t"), _NAME: "t"},
        overwrite=True,
    )
    times[:] = t
    group.create_array(
        _FINISHED,
        shape=(len(blocks),),
        chunks=(min(len(blocks), _FLAGS),),
        dtype=bool,
        dimension_names=("block",),
        **codecs(texts=False),
        overwrite=True,
    )
