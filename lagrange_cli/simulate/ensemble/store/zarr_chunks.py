"""Chunks of Zarr arrays, encoded as the Zarr specification (version 3) says and put side by side.

Zarr changes threads several times for each array that is written by itself, and at each change
waits for the threads that integrate. Here the thread that has the numbers encodes them, and Zarr is
given the chunks of all arrays at once.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Level of the compression, which leaves it to Zstandard.
_LEVEL = 0


class Chunk(NamedTuple):
    """Name in a store, and the bytes there."""

    name: str
    data: bytes


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
        Those of the chunk, fewer of the last one: the array ends before its last chunk does.
    """
    from numcodecs import VLenUTF8, Zstd

    texts = values.dtype.kind == "U"
    kind = np.dtype(object) if texts else array.dtype.newbyteorder("<")
    whole = np.full(array.chunks, array.fill_value, kind)
    whole[: len(values)] = values
    place = array.metadata.encode_chunk_key((number,) + (0,) * (whole.ndim - 1))
    data = Zstd(level=_LEVEL).encode(VLenUTF8().encode(whole) if texts else whole)
    return Chunk(f"{array.path}/{place}", data)


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
        await asyncio.gather(
            *(group.store.set(name, buffer.from_bytes(data)) for name, data in chunks)
        )

    sync(put_all())
