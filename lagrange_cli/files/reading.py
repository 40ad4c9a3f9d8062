"""Read scenes and the files that they name: bounded, and only regular files."""

from __future__ import annotations

import os
import stat
import sys

from lagrange_cli.errors import InputError, LimitError, Mark, Problem

#: Bytes of the largest file that is read: a scene, or a file that it names.
MAX_BYTES = 4 * 2**20


def read_bytes(path: str, what: str = "a scene file") -> bytes:
    """Read a file, or standard input for ``-``; at most :data:`MAX_BYTES`.

    ``what`` is what messages call it.

    Raises
    ------
    InputError
        If there is no such regular file, it cannot be read, or it is too large.
    """
    if path == "-":
        data = _standard_input()
        if len(data) > MAX_BYTES:
            raise too_large("<stdin>")
        return data
    return read_regular(path, Mark(path, 1, 1), what)


def _standard_input() -> bytes:
    mark = Mark("<stdin>", 1, 1)
    if sys.stdin is None:
        raise _refusal("standard input is closed", mark)
    try:
        return sys.stdin.buffer.read(MAX_BYTES + 1)
    except OSError as error:
        raise _refusal(_reason(error, "a scene"), mark) from None


def too_large(file: str) -> InputError:
    """Return the refusal of a text of more than :data:`MAX_BYTES`."""
    return _too_large(Mark(file, 1, 1))


def read_regular(path: str, mark: Mark, what: str) -> bytes:
    """Read a regular file of at most :data:`MAX_BYTES`; messages call it ``what``.

    Raises
    ------
    InputError
        At ``mark``: there is none, it cannot be read, or it is too large.
    """
    try:
        data = _read(path, mark, what)
    except OSError as error:
        raise _refusal(_reason(error, what), mark) from None
    except ValueError:
        raise _refusal("this is not the name of a file", mark) from None
    if len(data) > MAX_BYTES:
        raise _too_large(mark)
    return data


def _read(path: str, mark: Mark, what: str) -> bytes:
    # Non-blocking, so that opening a named pipe without a writer returns.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, flags), "rb") as file:
        mode = os.fstat(file.fileno()).st_mode
        if stat.S_ISDIR(mode):
            raise _refusal(f"this is a folder, not {what}", mark)
        if not stat.S_ISREG(mode):
            raise _refusal("this is not a regular file", mark)
        return file.read(MAX_BYTES + 1)


def _too_large(mark: Mark) -> InputError:
    return LimitError(Problem(f"larger than {MAX_BYTES // 2**20} MiB", mark, rule="limit"))


def _reason(error: OSError, what: str) -> str:
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, IsADirectoryError):
        return f"this is a folder, not {what}"
    return f"cannot be read: {error.strerror or type(error).__name__}"


def _refusal(message: str, mark: Mark) -> InputError:
    return InputError(Problem(message, mark, rule="file"))
