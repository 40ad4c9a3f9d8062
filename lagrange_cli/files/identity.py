"""Tell whether two paths lead to one file, so that no output replaces what is read.

A file has many names: other spellings of its path, and links of both kinds. Two names are of one
file if its device and its number on that device are the same.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable
from typing import NamedTuple, TypeAlias

from lagrange_cli.errors import InputError, Problem

_STDIN = 0


#: A regular file by its device and number there, or where one is to be.
_Place: TypeAlias = tuple[int, int] | str


class Named(NamedTuple):
    """A file as messages name it.

    Attributes
    ----------
    what
        The file's role: ``the scene``, ``--plot``.
    path
        The path as it was typed; ``-`` is standard input.
    """

    what: str
    path: str


def ending_of(path: str | os.PathLike[str]) -> str:
    """Return what the name of a file ends in, as ``.csv``, in lower case; "" for nothing."""
    from pathlib import Path  # a run that writes no file does without

    return Path(path).suffix.lower()


def require_apart(reads: Iterable[Named], writes: Iterable[Named]) -> None:
    """Refuse outputs that would replace what is read, or each other.

    ``-`` among ``reads`` is standard input. Devices and pipes are not replaced.

    Raises
    ------
    InputError
        Two of them are one file.
    """
    read: dict[_Place, Named] = {}
    for named in reads:
        if (source := _identity(named.path)) is not None:
            read.setdefault(source, named)
    written: dict[_Place, Named] = {}
    for named in writes:
        place = _identity(named.path) or _place(named.path)
        if place is None:
            continue
        if place in read:
            raise _would_replace(named, read[place])
        if place in written:
            both = f"{written[place].what} and {named.what}"
            raise _refused(f"{both} name one file, '{named.path}'")
        written[place] = named


def is_address(path: str) -> bool:
    """Tell whether this names no file of this machine but an address, as ``s3://bucket/name``."""
    return "://" in path


def same_file(first: str, second: str) -> bool:
    """Say whether two paths lead to one regular file that exists."""
    key = _identity(first)
    return key is not None and key == _identity(second)


def stamp_of(path: str) -> tuple[int, ...]:
    """Return numbers that usually change when a file does; none if it is missing."""
    try:
        status = os.stat(path)
    except OSError:
        return ()
    return status.st_mtime_ns, status.st_size, status.st_ino


def _identity(path: str) -> tuple[int, int] | None:
    """Return device and number of a regular file; None if there is no such file."""
    try:
        status = os.fstat(_STDIN) if path == "-" else os.stat(path)
    except (OSError, ValueError):
        return None
    return (status.st_dev, status.st_ino) if stat.S_ISREG(status.st_mode) else None


def _place(path: str) -> str | None:
    """Return the real path of a file that does not exist yet; None if something else exists."""
    return None if os.path.exists(path) or "\0" in path else os.path.realpath(path)


def _would_replace(output: Named, source: Named) -> InputError:
    at = ", on standard input" if source.path == "-" else f", '{source.path}'"
    where = "" if source.path == output.path else at
    return _refused(f"{output.what} '{output.path}' would replace {source.what}{where}")


def _refused(message: str) -> InputError:
    return InputError(Problem(message, hint="name another file", rule="output"))
