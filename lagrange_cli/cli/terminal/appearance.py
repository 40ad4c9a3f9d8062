"""Width and colours of a terminal, as its user has set them up."""

from __future__ import annotations

import os
from typing import TextIO

import click

from lagrange_cli.report import Paint, Role

#: Lines are not broken to fewer columns.
_NARROWEST = 40

#: Variables that ask for colours where there is no terminal.
_FORCING = ("FORCE_COLOR", "CLICOLOR_FORCE")

#: The look of names by their roles.
_LOOKS: dict[Role, dict[str, str | bool]] = {
    "heading": {"bold": True},
    "name": {"fg": "cyan"},
    "good": {"fg": "green"},
    "bad": {"fg": "red"},
}


def is_terminal(stream: TextIO | None) -> bool:
    """Say whether a stream leads to a terminal; it may be closed or none."""
    try:
        return stream is not None and stream.isatty()
    except ValueError:
        return False


def window_width(stream: TextIO | None, otherwise: int) -> int:
    """Return the columns of the window that a stream leads to.

    ``COLUMNS`` in the environment goes before; ``otherwise`` is for streams without a window.
    """
    asked = os.environ.get("COLUMNS", "")
    if asked.isascii() and asked.isdigit() and int(asked) > 0:
        return max(int(asked), _NARROWEST)
    if stream is None or not is_terminal(stream):
        return otherwise
    try:
        # A terminal that does not know its width says 0.
        known = os.get_terminal_size(stream.fileno()).columns
    except (OSError, ValueError):
        return otherwise
    return max(known, _NARROWEST) if known else otherwise


def wants_colour(stream: TextIO | None) -> bool:
    """Say whether text on a stream is to be coloured.

    That is so on terminals that can, unless ``NO_COLOR`` is set; ``FORCE_COLOR`` and
    ``CLICOLOR_FORCE`` ask for it elsewhere too.
    """
    if os.environ.get("NO_COLOR"):
        return False
    if any(os.environ.get(name, "0") not in ("", "0") for name in _FORCING):
        return True
    return is_terminal(stream) and os.environ.get("TERM") != "dumb"


def painter(stream: TextIO | None) -> Paint | None:
    """Return what colours names of pages on a stream; None if nothing is to be coloured."""
    return _painted if wants_colour(stream) else None


def _painted(text: str, role: Role) -> str:
    """Give a text its look, but not the blanks before it."""
    if not text.strip() or role not in _LOOKS:
        return text
    begin = len(text) - len(text.lstrip())
    return text[:begin] + click.style(text[begin:], **_LOOKS[role])  # type: ignore[arg-type]
