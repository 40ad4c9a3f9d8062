"""Standard streams of the process: results alone on stdout, and a stderr that may be gone.

Packages and the C libraries behind them print to stdout, where the reader of ``--json`` expects
nothing else. A stderr that cannot be written (a closed terminal, a full disk) is no reason for a
command to fail.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from contextvars import ContextVar
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

#: Descriptor of standard output.
_STDOUT = 1

#: Descriptor of standard error.
_STDERR = 2

_RESULTS: ContextVar[TextIO | None] = ContextVar("results")


class ForgivingFile(io.FileIO):
    """A file that takes data that it cannot write for written."""

    def write(self, data: ReadableBuffer, /) -> int:
        size = memoryview(data).nbytes
        try:
            written = super().write(data)
        except OSError:
            return size
        # None: it would block.
        return size if written is None else written


def prepare_streams() -> None:
    """Set up the streams of a process that is a command, once, at its start.

    All writing to the descriptor of stdout, also by C libraries and child processes, then goes to
    stderr; ``sys.stdout`` alone leads to where stdout led.
    """
    _occupy()
    sys.stderr = _stderr(sys.stderr)
    if sys.stdout is not None:
        sys.stdout.flush()
        sys.stdout = _moved(sys.stdout)
    os.dup2(_STDERR, _STDOUT)


def _occupy() -> None:
    """Open the null device for closed descriptors, lest a file that is opened takes their place."""
    while (handle := os.open(os.devnull, os.O_RDWR)) <= _STDERR:
        os.set_inheritable(handle, True)
    os.close(handle)


def _stderr(before: TextIO | None) -> TextIO:
    """Return a standard error of the same encoding that never fails."""
    raw = ForgivingFile(_STDERR, "wb", closefd=False)
    encoding = getattr(before, "encoding", None) or "utf-8"
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding, "backslashreplace", line_buffering=True
    )


def _moved(stream: TextIO) -> TextIO:
    """Return a text stream like another, with a descriptor of its own for the same file."""
    raw = io.FileIO(os.dup(stream.fileno()), "wb")
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        stream.encoding,
        stream.errors,
        line_buffering=getattr(stream, "line_buffering", False),
    )


def results() -> TextIO | None:
    """Return the stream that results are printed to; None if stdout is closed."""
    return _RESULTS.get(sys.stdout)


@contextmanager
def results_apart() -> Iterator[None]:
    """Send what is printed by the way to stderr; :func:`results` stays what stdout was."""
    token = _RESULTS.set(sys.stdout)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _RESULTS.reset(token)
