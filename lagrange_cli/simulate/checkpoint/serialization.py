"""Serialization of plain values without pickling: the content of a checkpoint."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: First bytes of a value: it is an archive.
MAGIC = b"PK\x03\x04"


class DamagedError(Exception):
    """These are not the bytes of a value."""


def _unreadable() -> tuple[type[Exception], ...]:
    """Return the exceptions that bytes which are no archive of arrays, or another one, lead to."""
    import zipfile
    import zlib

    return (
        *(OSError, ValueError, KeyError, TypeError, IndexError, EOFError, RuntimeError),
        *(MemoryError, AttributeError, zipfile.BadZipFile, zlib.error),
    )


def serialize(value: Any) -> bytes:
    """Write numbers, texts, None, arrays, and sequences and mappings of these as bytes.

    Arrays that are one object are one object again when they are read; sequences become tuples.
    """
    parts = _Arrays()
    text = json.dumps(_encoded(value, parts)).encode()
    file = io.BytesIO()
    np.savez(file, text=np.frombuffer(text, np.uint8), numbers=parts.bytes())
    return file.getvalue()


def deserialize(data: bytes) -> Any:
    """Read the value that :func:`serialize` wrote.

    Raises
    ------
    DamagedError
        The bytes are others than those it gave.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            text, numbers = arrays["text"].tobytes(), arrays["numbers"]
        return _decoded(json.loads(text), numbers, {})
    except _unreadable() as error:
        raise DamagedError(str(error)) from error


class _Arrays:
    """The bytes of arrays, one after the other, each object once."""

    def __init__(self) -> None:
        self._parts: list[NDArray[Any]] = []
        self._places: dict[int, int] = {}
        self._size = 0

    def place(self, array: NDArray[Any]) -> int:
        """Return the offset of an array's bytes."""
        if id(array) not in self._places:
            self._places[id(array)] = self._size
            self._parts.append(array)  # kept alive, so that its id stays its own
            self._size += array.nbytes
        return self._places[id(array)]

    def bytes(self) -> NDArray[np.uint8]:
        return np.frombuffer(b"".join(part.tobytes() for part in self._parts), np.uint8)


def _encoded(value: Any, arrays: _Arrays) -> Any:
    """Write values as JSON holds them: mappings and sequences as a word and their entries."""
    if isinstance(value, np.ndarray):
        # Products of matrices are summed in another order where their columns lie together.
        order = "F" if value.flags.f_contiguous and value.ndim > 1 else "C"
        return ["array", value.dtype.str, list(value.shape), arrays.place(value), order]
    if isinstance(value, np.generic):
        # Some operations give other results for numbers of NumPy than for those of Python.
        return ["number", *_encoded(np.array(value), arrays)[1:]]
    if isinstance(value, Mapping):
        return ["map", {name: _encoded(entry, arrays) for name, entry in value.items()}]
    if isinstance(value, list | tuple):
        return ["row", [_encoded(entry, arrays) for entry in value]]
    return value


def _decoded(value: Any, numbers: NDArray[Any], known: dict[Any, NDArray[Any]]) -> Any:
    if not isinstance(value, list):
        return value
    kind, *content = value
    if kind == "map":
        return {name: _decoded(entry, numbers, known) for name, entry in content[0].items()}
    if kind == "row":
        return tuple(_decoded(entry, numbers, known) for entry in content[0])
    dtype, shape, first = np.dtype(content[0]), tuple(content[1]), content[2]
    if kind == "number":
        return np.frombuffer(numbers, dtype, 1, first)[0]
    if (first, shape) not in known:
        count = int(np.prod(shape, dtype=int))
        flat = np.frombuffer(numbers, dtype, count, first) if count else np.empty(0, dtype)
        known[first, shape] = flat.reshape(shape).copy(order=content[3])
    return known[first, shape]
