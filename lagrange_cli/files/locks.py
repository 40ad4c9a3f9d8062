"""Locks that end with the process that holds them, whatever ends it.

They are record locks (``fcntl``): they belong to the process, not to a handle that child processes
would inherit, and they hold between machines where the file system is shared.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files.identity import is_address

if TYPE_CHECKING:
    from types import ModuleType


def cannot_write(name: str, error: OSError) -> InputError:
    """Return the refusal of something that cannot be written, with the system's reason."""
    return InputError(Problem(f"cannot write {name}: {error.strerror or error}", rule="output"))


#: The content of a lock file: the process, and its machine.
_CONTENT = re.compile(rb"lagrange ([0-9]{1,20}) ([^\n]{0,255})\n", re.ASCII)
#: Bytes that are read of a file that may be a lock.
_LONGEST = 512

_FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


#: Windows neither renames nor removes files that are open, and its signal 0 is Ctrl-C.
POSIX = os.name == "posix"


def _fcntl() -> ModuleType | None:
    try:
        import fcntl
    except ImportError:
        return None
    return fcntl


def try_lock(handle: int) -> bool | None:
    """Lock an open file for this process; False if another has it, None if that is unknown.

    The lock ends when any handle of this file is closed in this process.
    """
    fcntl = _fcntl()
    if fcntl is None:
        return None
    try:
        fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        # Others: a file system without locks.
        return False if error.errno in (errno.EACCES, errno.EAGAIN) else None
    return True


def lock_of(output: str) -> str:
    """Return the path of the file whose lock says that an output is being made."""
    return f"{output}.lock"


@contextmanager
def sole_writer(output: str | None) -> Iterator[None]:
    """Hold the lock of an output, the file ``OUTPUT.lock`` beside it.

    None, no output, is never refused; neither is an address, which has no lock.

    Raises
    ------
    InputError
        Another process makes it, or there is such a file that is no lock.
    """
    if output is None or is_address(output):
        yield
        return
    path = lock_of(os.path.realpath(output))
    handle = _acquired(path, output)
    try:
        yield
    finally:
        if not POSIX:
            os.close(handle)
        with suppress(OSError):
            os.unlink(path)
        if POSIX:  # The lock holds until the file is gone.
            os.close(handle)


def _acquired(path: str, output: str) -> int:
    """Open the lock file and lock it; return its handle."""
    while True:
        try:
            handle = os.open(path, _FLAGS, 0o600)
        except OSError as error:
            raise cannot_write(f"'{path}'", error) from error
        try:
            if _take(handle, path, output):
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _take(handle: int, path: str, output: str) -> bool:
    """Lock the file and sign it; False if it was removed meanwhile."""
    try:
        content = os.read(handle, _LONGEST)
        if content and not _CONTENT.fullmatch(content):
            raise _no_lock(path, output)
        if try_lock(handle) is False:
            raise _held(content, output)
        # Who held it before may have removed it.
        if not os.fstat(handle).st_nlink:
            return False
        os.ftruncate(handle, 0)
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, f"lagrange {os.getpid()} {_machine()}\n".encode())
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error
    return True


def _machine() -> str:
    return os.uname().nodename if hasattr(os, "uname") else ""


def _held(content: bytes, output: str) -> InputError:
    """Return the refusal of an output that another process makes, perhaps not named yet."""
    holder = _CONTENT.fullmatch(content)
    if holder is None:
        return _refused(f"another process is making '{output}'", "wait for it to end")
    process, machine = holder[1].decode(), holder[2].decode("utf-8", "replace")
    where = "" if machine == _machine() else f" on {machine}"
    return _refused(
        f"process {process}{where} is making '{output}'",
        f"wait for it to end, or end it: kill {process}",
    )


def _no_lock(path: str, output: str) -> InputError:
    return _refused(
        f"'{path}' is in the way: it would be the lock of '{output}', and is another file",
        "name another output, or move that file",
    )


def _refused(message: str, hint: str) -> InputError:
    return InputError(Problem(message, hint=hint, rule="lock"))
