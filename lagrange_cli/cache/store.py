"""Entries of the cache: one file each, with the hash of its content in its name.

An entry is called ``KEY-HASH.json``, ``.so`` or ``.db``: KEY is the hash of the inputs that the
entry was made from, HASH that of KEY, the suffix and the entry's bytes. It is written to a
temporary file and renamed. A file that does not have the hash of its name is removed and counts as
missing. So writers need no lock, and neither a crash nor a full disk nor decay of the disk nor an
entry under another's name yields a wrong result.
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

#: Bytes of all entries; beyond, the least recently used ones are removed. The bound is chosen so
#: that the scenes of a project stay and a disk is not filled; it is not tuned.
MAX_CACHE_BYTES = 256 * 2**20
#: Number of entries, likewise.
MAX_CACHE_ENTRIES = 2048

#: Name of the folder in which a compiler keeps what it needs again, beside the entries.
_COMPILER_FOLDER = "compiler"

#: A use is noted on an entry that was not used for this long, in seconds.
_USE_NOTED_AFTER = 24 * 3600.0

#: Suffixes that entries have.
_SUFFIXES = (".json", ".so", ".db")

#: The mark of a file system whose files cannot be run or loaded; 0 where none is known.
_NO_EXECUTION = getattr(os, "ST_NOEXEC", 0)

_DIGITS = frozenset("0123456789abcdef")


class Entry(NamedTuple):
    """A file of the cache.

    Attributes
    ----------
    name
        Name of the file, ``KEY-HASH.SUFFIX``.
    size
        Its bytes.
    used
        Time of its last use, in seconds since 1970; exact to a day.
    """

    name: str
    size: int
    used: float

    @property
    def suffix(self) -> str:
        """Return ``.json``, ``.so`` or ``.db``."""
        return os.path.splitext(self.name)[1]


class Removed(NamedTuple):
    """Outcome of clearing a cache.

    Attributes
    ----------
    files, size
        Number of removed files, and their bytes.
    failures
        Number of files that the system refused to remove.
    """

    files: int
    size: int
    failures: int = 0


class Cache:
    """Bytes by key, kept in a folder. Keys are hashes as :func:`digest` gives them.

    Attributes
    ----------
    folder
        Path of the folder; None if there is none.
    reason
        The reason why nothing can be stored, None if all is well; a failure to write sets it.
    """

    def __init__(self, folder: str | None, reason: str | None = None) -> None:
        self.folder = folder
        self.reason = reason

    def get(self, key: str, suffix: str = ".json") -> bytes | None:
        """Return the bytes kept under a key, or None."""
        entry = self._find(key, suffix)
        return entry[1] if entry else None

    def path(self, key: str, suffix: str = ".so") -> str | None:
        """Return the path of the file kept under a key, its content just verified, or None.

        The file can be gone at any time afterwards, as another process may clear the cache:
        whoever opens it must be ready for that.
        """
        entry = self._find(key, suffix)
        return entry[0] if entry else None

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

    def replace(self, key: str, data: bytes) -> bool:
        """Keep bytes under a key in place of those before; say whether they are kept."""
        if not self.put(key, data):
            return False
        new = _name(key, ".json", data)
        for entry in list(self._files()):
            if entry.name.startswith(key) and entry.name != new:
                _remove(entry.path)
        return True

    @property
    def compiler_folder(self) -> str | None:
        """Path of a folder in which a compiler may keep what it needs again, None if there is none.

        The compiler makes the folder, which is no entry and goes with :meth:`clear`.
        """
        if self.folder is None or self.reason is not None:
            return None
        return os.path.join(self.folder, _COMPILER_FOLDER)

    def entries(self) -> list[Entry]:
        """Return all entries, the last used first."""
        entries = []
        for entry in self._files():
            if _is_entry(entry.name):
                with suppress(OSError):
                    status = entry.stat(follow_symlinks=False)
                    entries.append(Entry(entry.name, status.st_size, status.st_mtime))
        return sorted(entries, key=lambda entry: (-entry.used, entry.name))

    def clear(self) -> Removed:
        """Remove every file of the cache, and no other; return how many, and their bytes.

        Other processes may fill or clear the cache at the same time. A file that one of them
        removes first, or writes anew, is no failure.
        """
        files = size = failures = 0
        for entry in list(self._files()):
            ours = _is_entry(entry.name) or is_temporary(entry.name)
            if ours or entry.name == _COMPILER_FOLDER:
                try:
                    size += _unlinked(entry.path)
                    files += 1
                except FileNotFoundError:
                    continue
                except OSError:
                    failures += 1
        return Removed(files, size, failures)

    def _files(self) -> Iterator[os.DirEntry[str]]:
        if self.folder is None:
            return
        with suppress(OSError), os.scandir(self.folder) as entries:
            yield from entries

    def _find(self, key: str, suffix: str) -> tuple[str, bytes] | None:
        """Find path and content of an entry; of several, made side by side, the first by name."""
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
            made.replace(path)

    def _bound(self, new: str) -> None:
        """Remove entries that exceed the bounds, but not the new one."""
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
    """Name an entry; its hash binds the bytes to the question that they answer."""
    return f"{key}-{digest(key, suffix, data)}{suffix}"


def _is_inert(folder: str) -> bool:
    """Say whether the system refuses to load code from the files of a folder."""
    return bool(_NO_EXECUTION and os.statvfs(folder).f_flag & _NO_EXECUTION)


def _unlinked(path: str) -> int:
    """Remove a path named like an entry; return its size.

    A folder goes with all that is in it. No link is followed.
    """
    status = os.lstat(path)
    if stat.S_ISDIR(status.st_mode):
        # Here and not above: it is slow to import, and hardly ever needed.
        from shutil import rmtree

        rmtree(path)
    else:
        os.unlink(path)
    return status.st_size


def _remove(path: str) -> None:
    """Remove a path named like an entry where the system allows it."""
    with suppress(OSError):
        _unlinked(path)


def _verified(path: str) -> bytes | None:
    """Read an entry whose content has the hash in its name; remove any other and return None."""
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
    """Read a regular file of this user and note its use; None if it is anything else."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    flags |= getattr(os, "O_NONBLOCK", 0)
    handle = os.open(path, flags)
    try:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode) or status.st_size > MAX_CACHE_BYTES:
            return None
        if os.name == "posix" and status.st_uid != os.geteuid():
            return None
        if abs(time.time() - status.st_mtime) > _USE_NOTED_AFTER:
            with suppress(OSError):
                os.utime(path)
        with os.fdopen(handle, "rb", closefd=False) as stream:
            return stream.read()
    finally:
        os.close(handle)
