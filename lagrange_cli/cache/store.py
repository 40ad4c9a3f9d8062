"""Entries of the cache: one file each, its name saying what its content must be.

An entry is called ``KEY-HASH.json``, ``.so`` or ``.db``: KEY is the hash of
what the entry was made from, HASH that of KEY, the suffix and the entry's
bytes. It is written to a temporary file and renamed, and what does not have the
hash of its name is removed and counts as missing. So writers need no lock, and
neither a crash nor a full disk nor decay of the disk nor an entry under another's
name yields a wrong result.
"""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

from lagrange_cli.cache.keys import digest
from lagrange_cli.files import is_temporary, temporary_file

#: Bounds of what is kept; beyond, what was not used for the longest time goes.
MAX_CACHE_BYTES = 256 * 2**20
MAX_CACHE_ENTRIES = 2048

#: A use is noted on an entry that was not used for this long, in seconds.
_USE_NOTED_AFTER = 24 * 3600.0

_SUFFIXES = (".json", ".so", ".db")

#: The mark of a file system whose files cannot be run or loaded; 0 where none is known.
_NO_EXECUTION = getattr(os, "ST_NOEXEC", 0)

_DIGITS = frozenset("0123456789abcdef")


class Entry(NamedTuple):
    """A file of the cache: its name, its bytes, and when it was last used."""

    name: str
    size: int
    used: float

    @property
    def suffix(self) -> str:
        """What kind of file it is: ``.json``, ``.so`` or ``.db``."""
        return os.path.splitext(self.name)[1]


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
        if self.folder is None or len(data) > MAX_CACHE_BYTES:
            return False
        name = _name(key, suffix, data)
        try:
            if suffix == ".so" and _is_inert(self.folder):
                self.reason = f"code in '{self.folder}' cannot be run"
                return False
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
            if _is_entry(entry.name):
                with suppress(OSError):
                    of = entry.stat(follow_symlinks=False)
                    found.append(Entry(entry.name, of.st_size, of.st_mtime))
        return sorted(found, key=lambda entry: (-entry.used, entry.name))

    def clear(self) -> Removed:
        """Remove every file of the cache, and no other; return how many, and their bytes."""
        files = size = 0
        for entry in list(self._files()):
            if _is_entry(entry.name) or is_temporary(entry.name):
                length = _remove(entry.path)
                if length is not None:
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
        names = [entry.name for entry in self._files() if entry.name.startswith(key)]
        for name in sorted(filter(_is_entry, names)):
            if name.endswith(suffix):
                path = os.path.join(self.folder, name)
                data = _verified(path)
                if data is not None:
                    return path, data
        return None

    def _write(self, path: str, data: bytes) -> None:
        with temporary_file(os.path.dirname(path)) as made:
            with os.fdopen(made.handle, "wb", closefd=False) as stream:
                stream.write(data)
            os.replace(made.path, path)

    def _bound(self, new: str) -> None:
        """Remove what exceeds the bounds, but not the new entry."""
        assert self.folder is not None
        total = 0
        for count, entry in enumerate(self.entries(), 1):
            total += entry.size
            if (total > MAX_CACHE_BYTES or count > MAX_CACHE_ENTRIES) and entry.name != new:
                _remove(os.path.join(self.folder, entry.name))


def _check(key: str, suffix: str) -> None:
    if not (_is_hash(key) and suffix in _SUFFIXES):
        raise ValueError(f"no key of the cache: {key!r}, {suffix!r}")


def _is_hash(text: str) -> bool:
    return len(text) == 64 and _DIGITS.issuperset(text)


def _is_entry(name: str) -> bool:
    """Say whether a file name is KEY-HASH.SUFFIX."""
    stem, suffix = os.path.splitext(name)
    key, _, content = stem.partition("-")
    return suffix in _SUFFIXES and _is_hash(key) and _is_hash(content)


def _name(key: str, suffix: str, data: bytes) -> str:
    """The name of an entry; its hash binds what is kept to the question that it answers."""
    return f"{key}-{digest(key, suffix, data)}{suffix}"


def _is_inert(folder: str) -> bool:
    """Say whether the system refuses to load code from the files of a folder."""
    return bool(_NO_EXECUTION and os.statvfs(folder).f_flag & _NO_EXECUTION)


def _remove(path: str) -> int | None:
    """Remove what is called as a file of the cache; return its size, None if it stays.

    A folder goes with all that is in it. No link is followed.
    """
    try:
        found = os.lstat(path)
        if stat.S_ISDIR(found.st_mode):
            # Here and not above: it is slow to import, and hardly ever needed.
            from shutil import rmtree

            rmtree(path)
        else:
            os.unlink(path)
    except OSError:
        return None
    return found.st_size


def _verified(path: str) -> bytes | None:
    """The content of an entry, if it is what its name says; else it is removed."""
    name = os.path.basename(path)
    try:
        data = _read(path)
    except OSError:
        data = None
    if data is not None and _name(name[:64], os.path.splitext(name)[1], data) == name:
        return data
    _remove(path)
    return None


def _read(path: str) -> bytes | None:
    """The content of a regular file of this user, None of any other; notes that it was used."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    flags |= getattr(os, "O_NONBLOCK", 0)
    handle = os.open(path, flags)
    try:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode) or found.st_size > MAX_CACHE_BYTES:
            return None
        if os.name == "posix" and found.st_uid != os.geteuid():
            return None
        if abs(time.time() - found.st_mtime) > _USE_NOTED_AFTER:
            with suppress(OSError):
                os.utime(path)
        with os.fdopen(handle, "rb", closefd=False) as stream:
            return stream.read()
    finally:
        os.close(handle)
