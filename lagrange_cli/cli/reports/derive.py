"""Report of ``lagrange derive``: the derivation as text, LaTeX or JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.cli.output import can_encode
from lagrange_cli.cli.reports.json_text import json_text

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["FORMATS"]


def text(equations: Equations, form: str, ascii_only: bool, encoding: str) -> str:
    """The derivation as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.text import derivation_text

    written = derivation_text(equations, ascii=ascii_only, form=form)
    if ascii_only or can_encode(written, encoding):
        return written
    return derivation_text(equations, ascii=True, form=form)


def json_report(equations: Equations, form: str, _ascii_only: bool, _encoding: str) -> str:
    """The derivation as JSON."""
    from lagrange_cli.emit.report import derivation_report

    return json_text(derivation_report(equations, form))


def latex(equations: Equations, form: str, _ascii_only: bool, _encoding: str) -> str:
    """The derivation as a LaTeX document."""
    from lagrange_cli.emit.registry import emitter

    (written,) = emitter("latex").emit(equations, {"form": form}).values()
    return written


#: Name of a format → what writes it, in a form of the equations, in plain ASCII or in what an
#: encoding has.
FORMATS: Mapping[str, Callable[[Equations, str, bool, str], str]] = {
    "text": text,
    "latex": latex,
    "json": json_report,
}
