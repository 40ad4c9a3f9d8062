"""Files are written whole or not at all."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import BinaryIO

from lagrange_cli.errors import InputError, Problem

__all__ = ["cannot_write", "check_writable", "new_file", "whole_file", "write_file", "write_files"]


def cannot_write(name: str, error: OSError) -> InputError:
    """The refusal for something that cannot be written."""
    return InputError(Problem(f"cannot write {name}: {error.strerror or error}", rule="output"))


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a file that could not be written, before the work whose result it is to hold.

    Raises
    ------
    InputError
        Its folder is missing or read-only, or the path is a folder or a read-only file.
    """
    target = os.path.realpath(path)
    try:
        _admit(target)
        folder = os.path.realpath(os.path.dirname(target), strict=True)
        if not (os.path.exists(target) or os.access(folder, os.W_OK)):
            raise PermissionError(0, "the folder is read-only")
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error


def new_file(folder: str | os.PathLike[str]) -> tuple[int, str]:
    """Open a temporary file of a new name, for this user alone; return its handle and path.

    Raises
    ------
    OSError
        It cannot be made.
    """
    # The module tempfile would do the same, but takes as long to import as all of Click.
    path = os.path.join(folder, f".{os.urandom(16).hex()}.tmp")
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    return os.open(path, flags, 0o600), path


def write_file(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write one file whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written; what was there before is untouched.
    """
    _write({os.fspath(path): content})


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file to be written in parts; it takes its place when all is written without error.

    Raises
    ------
    InputError
        It cannot be written; what was there before is untouched.
    """
    target = os.path.realpath(path)
    try:
        _admit(target)
        if os.path.exists(target) and not os.path.isfile(target):
            with open(target, "wb") as stream:
                yield stream
            return
        handle, temporary = new_file(os.path.dirname(target))
        try:
            with os.fdopen(handle, "w+b") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            os.chmod(temporary, _mode(target))
            os.replace(temporary, target)
        finally:
            with suppress(FileNotFoundError):
                os.unlink(temporary)
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error


def write_files(folder: str | os.PathLike[str], files: Mapping[str, str]) -> list[str]:
    """Write files into a folder, made where it is missing; return their paths.

    Either all files are complete or none of them is touched.

    Raises
    ------
    InputError
        The folder cannot be made, or a file cannot be written.
    """
    target = os.fspath(folder)
    try:
        os.makedirs(target, exist_ok=True)
    except FileExistsError:
        raise InputError(
            Problem(f"cannot write into '{target}': it is a file and not a folder", rule="output")
        ) from None
    except OSError as error:
        raise cannot_write(f"into '{target}'", error) from error
    paths = {os.path.join(target, name): text for name, text in files.items()}
    _write(paths)
    return list(paths)


def _write(files: Mapping[str, str | bytes]) -> None:
    """Write all contents to temporary files beside their targets, then rename each."""
    waiting: list[tuple[str, str]] = []
    try:
        for path, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            try:
                _stage(path, data, waiting)
            except OSError as error:
                raise cannot_write(f"'{path}'", error) from error
        for temporary, target in waiting:
            os.replace(temporary, target)
    finally:
        for temporary, _ in waiting:
            with suppress(FileNotFoundError):
                os.unlink(temporary)


def _stage(path: str, data: bytes, waiting: list[tuple[str, str]]) -> None:
    """Write data to a temporary file, or at once to what is no regular file (``/dev/null``)."""
    target = os.path.realpath(path)
    _admit(target)
    if os.path.exists(target) and not os.path.isfile(target):
        with open(target, "wb") as stream:
            stream.write(data)
        return
    handle, temporary = new_file(os.path.dirname(target))
    waiting.append((temporary, target))
    with os.fdopen(handle, "wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    os.chmod(temporary, _mode(target))


def _admit(target: str) -> None:
    """Refuse a folder and a read-only file."""
    if os.path.isdir(target):
        raise IsADirectoryError(0, "it is a folder and not a file")
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise PermissionError(0, "the file is read-only")


def _mode(target: str) -> int:
    """Permissions of the file that is replaced, or those that the umask leaves a new one."""
    if os.path.exists(target):
        return stat.S_IMODE(os.stat(target).st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
