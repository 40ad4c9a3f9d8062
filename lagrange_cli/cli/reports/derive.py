"""Report of ``lagrange derive``: the derivation as text, a document or JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.terminal.output import can_encode
from lagrange_cli.notation.page import Page

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation

#: Option of a format → its value.
Options: TypeAlias = Mapping[str, str | bool]


def _text(
    derivation: Derivation, form: str, chosen: Options, ascii_only: bool, encoding: str
) -> Page:
    """The derivation as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.text import derivation_page

    equations = derivation.equations
    written = derivation_page(equations, form=form, ascii=ascii_only, options=chosen)
    if ascii_only or can_encode(written.text(), encoding):
        return written
    return derivation_page(equations, form=form, ascii=True, options=chosen)


def _json(
    derivation: Derivation, form: str, chosen: Options, _ascii_only: bool, _encoding: str
) -> str:
    """The derivation as JSON."""
    return json_text(derivation.report(form=form, latex=bool(chosen.get("latex"))))


def _document(to: str) -> Callable[[Derivation, str, Options, bool, str], str]:
    """The derivation in a format of ``emit``."""

    def written(
        derivation: Derivation, form: str, chosen: Options, _ascii_only: bool, _encoding: str
    ) -> str:
        (text,) = derivation.emit(to, form=form, **chosen).values()
        return text

    return written


#: Name of a format → what writes it, in a form of the equations, with options of the format, in
#: plain ASCII or in what an encoding has.
FORMATS: Mapping[str, Callable[[Derivation, str, Options, bool, str], str | Page]] = {
    "text": _text,
    "latex": _document("latex"),
    "markdown": _document("markdown"),
    "typst": _document("typst"),
    "json": _json,
}
