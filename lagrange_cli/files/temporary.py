"""Temporary files and folders, removed by the next run if their process is dead.

A process can be killed at any time, and then nothing is tidied up. So each temporary file is
locked while it is made: the kernel frees the lock when its process ends, however that is, and
whoever makes the next temporary file in that folder removes those that are free. Unlike the
number of a process a lock cannot be another's, in a container or on another machine.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass

from lagrange_cli.files.locks import POSIX, try_lock

#: Temporary files: the number of the process, for a person, and 32 random digits.
_FILE = re.compile(r"\.lagrange-([0-9]+)-[0-9a-f]{32}\.tmp", re.ASCII)
#: Temporary folders, named likewise.
_FOLDER = re.compile(r"lagrange-([0-9]+)-[0-9a-f]{32}", re.ASCII)
#: Folders that are being removed.
_REFUSE = re.compile(r"\.lagrange-([0-9]+)-[0-9a-f]{32}\.old", re.ASCII)

_READ_WRITE = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


@dataclass
class Temporary:
    """A temporary file.

    Attributes
    ----------
    handle
        Open for reading and writing, until the file is closed.
    path
        Its path.
    is_open
        It was not closed yet.
    """

    handle: int
    path: str
    is_open: bool = True

    def replace(self, target: str) -> None:
        """Give the file the name of another, which it replaces."""
        if not POSIX:
            self.close()
        os.replace(self.path, target)

    def remove(self) -> None:
        """Remove the file unless it has another name now; its lock holds until it is gone."""
        if not POSIX:
            self.close()
        with suppress(FileNotFoundError):
            os.unlink(self.path)
        self.close()

    def close(self) -> None:
        """Close the file; its lock ends."""
        if self.is_open:
            self.is_open = False
            os.close(self.handle)


def is_temporary(name: str) -> bool:
    """Say whether a file name is one that :func:`temporary_file` makes."""
    return _FILE.fullmatch(name) is not None


@contextmanager
def temporary_file(folder: str | os.PathLike[str]) -> Iterator[Temporary]:
    """Open a file of a new name, for this user alone; unless renamed, it is removed in the end.

    Raises
    ------
    OSError
        It cannot be made.
    """
    remove_abandoned_files(os.fspath(folder))
    made = _new_file(os.fspath(folder))
    try:
        yield made
    finally:
        made.remove()


@contextmanager
def temporary_folder() -> Iterator[str]:
    """Make a folder for this user alone, among those of the system, removed in the end.

    Raises
    ------
    OSError
        It cannot be made.
    """
    # Here and not above: it takes as long to import as all of Click.
    from shutil import rmtree
    from tempfile import gettempdir

    path = os.path.join(gettempdir(), f"lagrange-{_unique()}")
    os.mkdir(path, 0o700)
    with ExitStack() as stack:
        stack.callback(rmtree, path, ignore_errors=True)
        stack.enter_context(temporary_file(path))
        yield path


def discard(folder: str | os.PathLike[str]) -> None:
    """Remove a folder with all that is in it; other processes see all of it or nothing.

    Files that cannot be removed stay, under a name by which the next run knows them.
    """
    from shutil import rmtree

    parent = os.path.dirname(os.path.realpath(folder))
    refuse = os.path.join(parent, f".lagrange-{_unique()}.old")
    with suppress(OSError):
        os.rename(folder, refuse)
        rmtree(refuse, ignore_errors=True)


def _unique() -> str:
    return f"{os.getpid()}-{os.urandom(16).hex()}"


def _new_file(folder: str) -> Temporary:
    """Make a locked file of a new name."""
    while True:
        path = os.path.join(folder, f".lagrange-{_unique()}.tmp")
        handle = os.open(path, _READ_WRITE | os.O_CREAT | os.O_EXCL, 0o600)
        # Before it was locked it could be taken for that of a dead process.
        if try_lock(handle) is not False and os.fstat(handle).st_nlink:
            return Temporary(handle, path)
        os.close(handle)


def remove_abandoned_files(folder: str) -> None:
    """Remove temporary files that no living process writes, and folders left half removed."""
    for entry in _entries(folder):
        named = _FILE.fullmatch(entry.name)
        # This process's own are locked against others, not against itself.
        if named is not None and int(named[1]) != os.getpid():
            _remove_dead(entry.path)
        elif _REFUSE.fullmatch(entry.name) and _is_own_folder(entry.path):
            from shutil import rmtree

            rmtree(entry.path, ignore_errors=True)


def remove_abandoned_folders() -> None:
    """Remove temporary folders whose locks are free, and empty ones of dead processes."""
    for entry in _entries(_home()):
        named = _FOLDER.fullmatch(entry.name)
        if named is None or int(named[1]) == os.getpid() or not _is_own_folder(entry.path):
            continue
        locks = [file.path for file in _entries(entry.path) if is_temporary(file.name)]
        if locks and all(_remove_dead(path) for path in locks):
            from shutil import rmtree

            rmtree(entry.path, ignore_errors=True)
        elif not _lives(int(named[1])):
            with suppress(OSError):
                os.rmdir(entry.path)


def _home() -> str:
    """Return the folder that :mod:`tempfile` chooses, where temporary folders are made.

    It would be asked, but takes 2 ms to import, and tries to write into the folder.
    """
    named = [os.environ.get(name, "") for name in ("TMPDIR", "TEMP", "TMP")]
    folders = (folder for folder in (*named, "/tmp", "/var/tmp", "/usr/tmp") if folder)
    return next((f for f in folders if os.path.isdir(f) and os.access(f, os.W_OK)), os.curdir)


def _entries(folder: str) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder or os.curdir) as entries:
            return list(entries)
    except OSError:
        return []


def _remove_dead(path: str) -> bool:
    """Remove a file of this user that nobody has locked; say whether it is gone."""
    try:
        handle = os.open(path, _READ_WRITE | getattr(os, "O_NONBLOCK", 0))
    except OSError:
        return False
    try:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode) or not _is_own(status) or not try_lock(handle):
            return False
        os.unlink(path)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True


def _is_own_folder(path: str) -> bool:
    try:
        status = os.lstat(path)
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and _is_own(status)


def _is_own(status: os.stat_result) -> bool:
    return os.name != "posix" or status.st_uid == os.geteuid()


def _lives(process: int) -> bool:
    """Say whether there may be a process of this number; a number can be taken again."""
    if not POSIX:
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
