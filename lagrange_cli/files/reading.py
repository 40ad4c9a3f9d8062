"""Reading a scene's bytes: bounded, and only from what has an end."""

from __future__ import annotations

import os
import stat
import sys

from lagrange_cli.errors import InputError, Mark, Problem

__all__ = ["MAX_BYTES", "read_bytes", "too_large"]

MAX_BYTES = 4 * 2**20


def read_bytes(path: str) -> bytes:
    """Read a scene file, or standard input for ``-``; at most :data:`MAX_BYTES`.

    Raises
    ------
    InputError
        If there is no such regular file, it cannot be read, or it is too large.
    """
    if path == "-":
        data = sys.stdin.buffer.read(MAX_BYTES + 1)
    else:
        try:
            data = _read_regular(path)
        except OSError as error:
            raise _refusal(_reason(error), path) from None
        except ValueError:
            raise _refusal("this is not the name of a file", path) from None
    if len(data) > MAX_BYTES:
        raise too_large("<stdin>" if path == "-" else path)
    return data


def too_large(file: str) -> InputError:
    """The refusal of a text of more than :data:`MAX_BYTES`."""
    return _refusal(f"larger than {MAX_BYTES // 2**20} MiB", file, "limit")


def _read_regular(path: str) -> bytes:
    # Non-blocking, so that opening a named pipe without a writer returns.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, flags), "rb") as file:
        mode = os.fstat(file.fileno()).st_mode
        if stat.S_ISDIR(mode):
            raise _refusal("this is a folder, not a scene file", path)
        if not stat.S_ISREG(mode):
            raise _refusal("this is not a regular file", path)
        return file.read(MAX_BYTES + 1)


def _reason(error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, IsADirectoryError):
        return "this is a folder, not a scene file"
    return f"cannot be read: {error.strerror or type(error).__name__}"


def _refusal(message: str, path: str, rule: str = "file") -> InputError:
    return InputError(Problem(message, Mark(path, 1, 1), rule=rule))
