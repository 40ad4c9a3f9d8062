"""Entries of the cache: one file each, its name saying what its content must be.

An entry is called ``KEY-HASH.json`` or ``KEY-HASH.so``: KEY is the hash of
what the entry was made from, HASH that of its bytes. It is written to a
temporary file and renamed, and what does not have the hash of its name is
removed and counts as missing. So writers need no lock, and neither a crash nor
a full disk nor decay of the disk yields a wrong result.
"""

from __future__ import annotations

import os
import re
import stat
import time
from collections.abc import Iterator
from contextlib import suppress
from hashlib import sha256
from typing import NamedTuple

from lagrange_cli.files import new_file

__all__ = ["Cache", "Entry", "Removed"]

#: Bounds of what is kept; beyond, what was not used for the longest time goes.
LARGEST = 256 * 2**20
MOST = 2048

#: A use is noted on an entry that was not used for this long, in seconds.
NOTED = 24 * 3600.0

#: A temporary file this old, in seconds, was left by a process that was killed.
ABANDONED = 3600.0

_NAME = re.compile(r"([0-9a-f]{64})-([0-9a-f]{64})(\.json|\.so)")
_TEMPORARY = re.compile(r"\.[0-9a-f]{32}\.tmp")
_KEY = re.compile(r"[0-9a-f]{64}")
_SUFFIXES = (".json", ".so")


class Entry(NamedTuple):
    """A file of the cache: its name, its kind, its bytes, and when it was last used."""

    name: str
    suffix: str
    size: int
    used: float


class Removed(NamedTuple):
    """How many files were removed, and their bytes."""

    files: int
    size: int


class Cache:
    """Bytes by key, kept in a folder.

    ``reason`` says why nothing can be kept, None where all is well; a failure
    to write sets it. Keys are hashes as :func:`digest` gives them.
    """

    def __init__(self, folder: str | None, reason: str | None = None) -> None:
        self.folder = folder
        self.reason = reason

    def get(self, key: str, suffix: str = ".json") -> bytes | None:
        """Return the bytes kept under a key, or None."""
        found = self._find(key, suffix)
        return found[1] if found else None

    def path(self, key: str, suffix: str = ".so") -> str | None:
        """Return the path of the file kept under a key, its content just verified, or None.

        The file can be gone at any time after (another process clears the
        cache): whoever opens it must be ready for that.
        """
        found = self._find(key, suffix)
        return found[0] if found else None

    def put(self, key: str, data: bytes, suffix: str = ".json") -> bool:
        """Keep bytes under a key; say whether they are kept."""
        _check(key, suffix)
        if self.folder is None or len(data) > LARGEST:
            return False
        name = f"{key}-{sha256(data).hexdigest()}{suffix}"
        try:
            self._write(os.path.join(self.folder, name), data)
            self._bound(name)
        except OSError as error:
            self.reason = f"'{self.folder}' cannot be written: {error.strerror or error}"
            return False
        return True

    def entries(self) -> list[Entry]:
        """Return what is kept, the last used first."""
        found = []
        for entry in self._files():
            match = _NAME.fullmatch(entry.name)
            if match:
                with suppress(OSError):
                    of = entry.stat(follow_symlinks=False)
                    found.append(Entry(entry.name, match[3], of.st_size, of.st_mtime))
        return sorted(found, key=lambda entry: (-entry.used, entry.name))

    def clear(self) -> Removed:
        """Remove every file of the cache, and no other; return how many, and their bytes."""
        files = size = 0
        for entry in list(self._files()):
            if _NAME.fullmatch(entry.name) or _TEMPORARY.fullmatch(entry.name):
                with suppress(OSError):
                    length = entry.stat(follow_symlinks=False).st_size
                    os.unlink(entry.path)
                    files, size = files + 1, size + length
        return Removed(files, size)

    def _files(self) -> Iterator[os.DirEntry[str]]:
        if self.folder is None:
            return
        with suppress(OSError), os.scandir(self.folder) as found:
            yield from found

    def _find(self, key: str, suffix: str) -> tuple[str, bytes] | None:
        """The path and content of an entry; of several, made side by side, the first by name."""
        _check(key, suffix)
        if self.folder is None:
            return None
        names = [e.name for e in self._files() if e.name.startswith(f"{key}-")]
        for name in sorted(names):
            match = _NAME.fullmatch(name)
            if match and match[3] == suffix:
                path = os.path.join(self.folder, name)
                data = _verified(path, match[2])
                if data is not None:
                    return path, data
        return None

    def _write(self, path: str, data: bytes) -> None:
        handle, temporary = new_file(os.path.dirname(path))
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
            os.replace(temporary, path)
        finally:
            with suppress(FileNotFoundError):
                os.unlink(temporary)

    def _bound(self, new: str) -> None:
        """Remove what exceeds the bounds, but not the new entry, and what killed processes left."""
        assert self.folder is not None
        total = 0
        for count, entry in enumerate(self.entries(), 1):
            total += entry.size
            if (total > LARGEST or count > MOST) and entry.name != new:
                _remove(os.path.join(self.folder, entry.name))
        oldest = time.time() - ABANDONED
        for file in self._files():
            if _TEMPORARY.fullmatch(file.name):
                with suppress(OSError):
                    if file.stat(follow_symlinks=False).st_mtime < oldest:
                        os.unlink(file.path)


def _check(key: str, suffix: str) -> None:
    if not _KEY.fullmatch(key) or suffix not in _SUFFIXES:
        raise ValueError(f"no key of the cache: {key!r}, {suffix!r}")


def _remove(path: str) -> None:
    with suppress(OSError):
        os.unlink(path)


def _verified(path: str, expected: str) -> bytes | None:
    """The content of a file, if it has the expected hash; a file that fails is removed."""
    try:
        data = _read(path)
    except OSError:
        data = None
    if data is not None and sha256(data).hexdigest() == expected:
        return data
    _remove(path)
    return None


def _read(path: str) -> bytes | None:
    """The content of a regular file of this user, None of any other; notes that it was used."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    flags |= getattr(os, "O_NONBLOCK", 0)
    with os.fdopen(os.open(path, flags), "rb") as stream:
        found = os.fstat(stream.fileno())
        if not stat.S_ISREG(found.st_mode) or found.st_size > LARGEST:
            return None
        if os.name == "posix" and found.st_uid != os.geteuid():
            return None
        if abs(time.time() - found.st_mtime) > NOTED:
            with suppress(OSError):
                os.utime(path)
        return stream.read()
