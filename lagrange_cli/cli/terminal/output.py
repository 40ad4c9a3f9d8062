"""Standard output: written whole, in what its encoding has, with failures explained."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from typing import TextIO

from lagrange_cli.cli.terminal.appearance import painter, window_width
from lagrange_cli.cli.terminal.streams import results
from lagrange_cli.errors import InputError, Problem, escape_controls
from lagrange_cli.files import can_encode, cannot_write, write_file
from lagrange_cli.report import UNBROKEN, USUAL_WIDTH, Page
from lagrange_cli.report.document_options import format_of
from lagrange_cli.report.formats import ReportForm

#: Exit code that a shell reports for a process that SIGPIPE ended.
_CLOSED_PIPE = 141


def stdout_encoding() -> str:
    """Return the encoding of standard output, in lower case."""
    encoding = getattr(results(), "encoding", None) or "ascii"
    return str(encoding).lower()


def page_encoding() -> str:
    """Return the encoding of what a person reads on standard output.

    ``LC_ALL=C`` asks for ASCII, unless one of Python's own variables says otherwise; Python takes
    UTF-8 there, for systems on which no locale is set.
    """
    is_plain = os.environ.get("LC_ALL") in ("C", "POSIX")
    if is_plain and not (os.environ.get("PYTHONIOENCODING") or os.environ.get("PYTHONUTF8")):
        return "ascii"
    return stdout_encoding()


def print_text(content: str | Page, format_: str = "text", *, width: int = UNBROKEN) -> None:
    """Write a text to standard output, at once and whole; a page as its window is.

    Characters that the encoding lacks are written as escapes, those of JSON if ``format_`` is
    ``json``. A reader that went away ends the program in silence, as it does for other filters.

    Parameters
    ----------
    width
        Columns of the lines of a page where there is no window.

    Raises
    ------
    InputError
        Standard output cannot be written (a full disk).
    """
    stream = results()
    if stream is None:
        raise InputError(Problem("cannot write standard output: it is closed", rule="output"))
    if isinstance(content, Page):
        text = content.text(window_width(stream, width), painter(stream))
        printable = _encodable(text, page_encoding(), format_)
    else:
        printable = _encodable(content, stdout_encoding(), format_)
    try:
        stream.write(printable if printable.endswith("\n") else printable + "\n")
        stream.flush()
    except BrokenPipeError:
        _abandon(stream)
        raise SystemExit(_CLOSED_PIPE) from None
    except OSError as error:
        _abandon(stream)
        raise cannot_write("standard output", error) from error


def deliver(content: str | Page, format_: str, path: str | None, *, width: int = UNBROKEN) -> None:
    """Write a text to a file, or print it if ``path`` is None; see :func:`print_text`."""
    if path is None:
        print_text(content, format_, width=width)
    else:
        write_file(path, content.text(width) if isinstance(content, Page) else content)


def difference(path: str, before: bytes, after: bytes) -> str:
    """Return the changes of a file as a unified difference."""
    import difflib

    old, new = (text.decode("utf-8", "replace").splitlines() for text in (before, after))
    lines = difflib.unified_diff(old, new, path, path, lineterm="")
    return "".join(f"{escape_controls(line)}\n" for line in lines)


def print_report(value: object, form: ReportForm, output: str | None = None) -> None:
    """Print the report of a value; write it to ``output`` as well, if any, as its ending says.

    Raises
    ------
    InputError
        The file or standard output cannot be written.
    """
    if output is not None:
        written = replace(form, format=format_of(output) or "json").written(value)
        deliver(written, "", output, width=USUAL_WIDTH)
    print_text(form.written(value, page_encoding()), form.format)


def _encodable(text: str, encoding: str, format_: str) -> str:
    """Replace characters that an encoding lacks by escapes that the format has."""
    if format_ == "json" and not can_encode(text, encoding):
        # Python's escape of é is no JSON.
        return "".join(c if can_encode(c, encoding) else json.dumps(c)[1:-1] for c in text)
    return text.encode(encoding, "backslashreplace").decode(encoding)


def give_up_stdout() -> None:
    """Write what is still to be written; leave a standard output that takes no more alone."""
    stream = results()
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        _abandon(stream)


def _abandon(stream: TextIO) -> None:
    """Point standard output at nothing, so that the flush at exit cannot fail again."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
