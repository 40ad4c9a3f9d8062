"""Standard output: written whole, in what its encoding has, with failures explained."""

from __future__ import annotations

import os
import sys

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import cannot_write

__all__ = ["can_print", "print_text"]

#: What a shell reports for a process that SIGPIPE ended.
CLOSED_PIPE = 141


def can_print(text: str) -> bool:
    """Say whether standard output's encoding has every character of a text."""
    if sys.stdout is None:
        return True
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True


def print_text(text: str) -> None:
    """Write a text to standard output, at once and whole.

    Characters that the encoding lacks are written as escapes. A reader that
    went away ends the program in silence, as it does for other filters.

    Raises
    ------
    InputError
        Standard output cannot be written (a full disk).
    """
    if sys.stdout is None:
        raise InputError(Problem("cannot write standard output: it is closed", rule="output"))
    encoding = sys.stdout.encoding or "ascii"
    printable = text.encode(encoding, "backslashreplace").decode(encoding)
    try:
        sys.stdout.write(printable if printable.endswith("\n") else printable + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        _abandon_stdout()
        raise SystemExit(CLOSED_PIPE) from None
    except OSError as error:
        _abandon_stdout()
        raise cannot_write("standard output", error) from error


def _abandon_stdout() -> None:
    """Point standard output at nothing, so that the flush at exit cannot fail again."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
