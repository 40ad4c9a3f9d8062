"""Report of ``lagrange derive``: the derivation as text, a document or JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.terminal.output import can_encode
from lagrange_cli.notation.page import Page

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation


def _text(derivation: Derivation, form: str, ascii_only: bool, encoding: str) -> Page:
    """The derivation as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.text import derivation_page

    written = derivation_page(derivation.equations, form=form, ascii=ascii_only)
    if ascii_only or can_encode(written.text(), encoding):
        return written
    return derivation_page(derivation.equations, form=form, ascii=True)


def _json(derivation: Derivation, form: str, _ascii_only: bool, _encoding: str) -> str:
    """The derivation as JSON."""
    return json_text(derivation.report(form=form))


def _latex(derivation: Derivation, form: str, _ascii_only: bool, _encoding: str) -> str:
    """The derivation as a LaTeX document."""
    (written,) = derivation.emit("latex", form=form).values()
    return written


def _typst(derivation: Derivation, form: str, _ascii_only: bool, _encoding: str) -> str:
    """The derivation as a Typst document."""
    (written,) = derivation.emit("typst", form=form).values()
    return written


def _markdown(derivation: Derivation, form: str, _ascii_only: bool, _encoding: str) -> str:
    """The derivation as Markdown."""
    (written,) = derivation.emit("markdown", form=form).values()
    return written


#: Name of a format → what writes it, in a form of the equations, in plain ASCII or in what an
#: encoding has.
FORMATS: Mapping[str, Callable[[Derivation, str, bool, str], str | Page]] = {
    "text": _text,
    "latex": _latex,
    "markdown": _markdown,
    "typst": _typst,
    "json": _json,
}
