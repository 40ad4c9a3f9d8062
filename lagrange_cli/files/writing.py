"""Writing of files, whole or not at all."""

from __future__ import annotations

import os
import signal
import stat
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import BinaryIO

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files.locks import cannot_write
from lagrange_cli.files.temporary import Temporary, temporary_file

#: Signals that end a process in between, where the system has them.
_ENDING = {
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
}


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
        replaced = os.path.isfile(target) or not os.path.exists(target)
        if replaced and not os.access(folder, os.W_OK):
            raise PermissionError(0, "the folder is read-only")
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error


def write_file(
    path: str | os.PathLike[str],
    content: str | bytes,
    admit: Callable[[], None] | None = None,
) -> None:
    """Write one file whole or not at all.

    Parameters
    ----------
    admit
        Called once the content lies in the file's folder under another name, right before it takes
        its place; what it raises leaves nothing behind.

    Raises
    ------
    InputError
        The file cannot be written; what was there before is untouched.
    """
    _write({os.fspath(path): content}, admit)


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file to be written in parts; it takes its place once all is written without error.

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
        with temporary_file(os.path.dirname(target)) as made:
            with os.fdopen(made.handle, "w+b", closefd=False) as stream:
                yield stream
            _finish(made, target)
            made.replace(target)
    except OSError as error:
        raise cannot_write(f"'{path}'", error) from error


def write_files(folder: str | os.PathLike[str], files: Mapping[str, str | bytes]) -> list[str]:
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
    paths = {os.path.join(target, name): content for name, content in files.items()}
    _write(paths)
    return list(paths)


def _write(files: Mapping[str, str | bytes], admit: Callable[[], None] | None = None) -> None:
    """Write all contents to temporary files beside their targets, then rename each."""
    with ExitStack() as stack:
        waiting: list[tuple[str, Temporary, str]] = []
        for path, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            target = os.path.realpath(path)
            try:
                staged = _staged(stack, target, data)
            except OSError as error:
                raise cannot_write(f"'{path}'", error) from error
            if staged is not None:
                waiting.append((path, staged, target))
        if admit is not None:
            admit()
        with _uninterrupted():
            for path, temporary, target in waiting:
                try:
                    temporary.replace(target)
                except OSError as error:
                    raise cannot_write(f"'{path}'", error) from error


def _staged(stack: ExitStack, target: str, data: bytes) -> Temporary | None:
    """Write the data to a temporary file; None if they went straight to what is no regular file
    (``/dev/null``)."""
    _admit(target)
    if os.path.exists(target) and not os.path.isfile(target):
        with open(target, "wb") as stream:
            stream.write(data)
        return None
    made = stack.enter_context(temporary_file(os.path.dirname(target)))
    with os.fdopen(made.handle, "wb", closefd=False) as stream:
        stream.write(data)
    _finish(made, target)
    return made


def _finish(made: Temporary, target: str) -> None:
    """Flush the data to the disk, with owner and permissions of the file that they replace, or
    with those that the umask leaves a new file."""
    os.fsync(made.handle)
    try:
        before = os.stat(target)
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(made.path, 0o666 & ~mask)
        return
    if hasattr(os, "fchown"):
        for owner in (before.st_uid, -1):
            with suppress(PermissionError):
                os.fchown(made.handle, owner, before.st_gid)
                break
    os.chmod(made.path, stat.S_IMODE(before.st_mode))


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Let signals wait, so that files that belong together take their places together.

    Handlers stand in for a mask, which other threads of the process do not have.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: dict[int, None] = {}
    before = {number: signal.getsignal(number) for number in _ENDING}
    heard = {n: handler for n, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    for number in heard:
        signal.signal(number, lambda signal_number, _: waiting.setdefault(signal_number))
    try:
        yield
    finally:
        for number, handler in heard.items():
            signal.signal(number, handler)
        for number in waiting:
            signal.raise_signal(number)


def _admit(target: str) -> None:
    """Refuse a folder and a read-only file."""
    if os.path.isdir(target):
        raise IsADirectoryError(0, "it is a folder and not a file")
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise PermissionError(0, "the file is read-only")


def can_encode(text: str, encoding: str) -> bool:
    """Say whether an encoding has every character of a text."""
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        return False
    return True
