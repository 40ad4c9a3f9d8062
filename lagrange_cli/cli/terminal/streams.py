"""Standard streams of the process: results alone on stdout, and a stderr that may be gone.

Packages and the C libraries behind them print to stdout, where the reader of ``--json`` expects
nothing else; and what cannot be told on stderr (a closed terminal, a full disk) is no reason
for a command to fail.
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

_STDOUT, _STDERR = 1, 2

_RESULTS: ContextVar[TextIO | None] = ContextVar("results")


class ForgivingFile(io.FileIO):
    """A file that takes what it cannot write for written."""

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

    Whatever writes to the descriptor of stdout, C libraries and child processes included, writes
    to stderr; ``sys.stdout`` alone leads to where stdout led.
    """
    _occupy()
    sys.stderr = _stderr(sys.stderr)
    if sys.stdout is not None:
        sys.stdout.flush()
        sys.stdout = _moved(sys.stdout)
    os.dup2(_STDERR, _STDOUT)


def _occupy() -> None:
    """Put nothing in the place of closed descriptors, lest a file that is opened takes it."""
    while (handle := os.open(os.devnull, os.O_RDWR)) <= _STDERR:
        os.set_inheritable(handle, True)
    os.close(handle)


def _stderr(before: TextIO | None) -> TextIO:
    """Standard error with the encoding of before, one that never fails."""
    raw = ForgivingFile(_STDERR, "wb", closefd=False)
    encoding = getattr(before, "encoding", None) or "utf-8"
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding, "backslashreplace", line_buffering=True
    )


def _moved(stream: TextIO) -> TextIO:
    """A text stream like another, with a descriptor of its own for the same file."""
    raw = io.FileIO(os.dup(stream.fileno()), "wb")
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        stream.encoding,
        stream.errors,
        line_buffering=getattr(stream, "line_buffering", False),
    )


def results() -> TextIO | None:
    """Where results are printed; None where stdout is closed."""
    return _RESULTS.get(sys.stdout)


@contextmanager
def results_apart() -> Iterator[None]:
    """Let what is printed by the way go to stderr; :func:`results` stays what stdout was."""
    token = _RESULTS.set(sys.stdout)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _RESULTS.reset(token)
