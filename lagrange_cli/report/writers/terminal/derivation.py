"""The derivation as a person reads it in a terminal, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.base import OptionValue, completed
from lagrange_cli.notation.page import USUAL_WIDTH, Page, page
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.report.contents.derivation.contents import contents
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.document_options import DEFAULT_SECTIONS, TEXT_OPTIONS, sections_of
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import language
from lagrange_cli.report.tree import seen
from lagrange_cli.report.writers.terminal.letters import AsciiLetters, UnicodeLetters
from lagrange_cli.report.writers.terminal.sections import TerseRows, title_row

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


def derivation_text(
    equations: Equations,
    *,
    ascii: bool = False,
    form: str = "lagrange",
    width: int = USUAL_WIDTH,
    **options: OptionValue,
) -> str:
    """Write the derivation in lines of ``width`` columns where formulas allow; see
    :func:`derivation_page`. ``options`` are those of the registry for text."""
    return derivation_page(equations, ascii=ascii, form=form, options=options).text(width)


def derivation_page(
    equations: Equations,
    *,
    ascii: bool = False,
    form: str = "lagrange",
    options: Mapping[str, OptionValue] | None = None,
) -> Page:
    """Write the derivation: degrees of freedom, energies, equations, what is conserved.

    Parameters
    ----------
    equations
        What a derivation yields.
    ascii
        Seven-bit text with formulas in the scene language; else Unicode.
    form
        ``lagrange`` for Lagrange's equations; ``explicit`` for accelerations and
        multipliers where few are coupled, and rows of M q̈ = f where more are; or one of
        :data:`.forms.contents.FORMS`.
    options
        ``sections`` and ``language`` as the registry declares them for text.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    chosen = completed("text", TEXT_OPTIONS, options or {})
    say = language(str(chosen["language"]))
    written_out = bool(chosen["written_out"])
    writer = DocumentWriter(equations, written_out=written_out, read_back=ascii)
    # The scene has the parameters; they are shown with steps, and where they are asked for.
    asked = sections_of(chosen, forces=equations.derivation.constraint_forces is not None)
    is_usual = chosen["sections"] == DEFAULT_SECTIONS and equations.derivation.steps is None
    parts = [part for part in asked if not (is_usual and part == "system")]
    lettering = Lettering(AsciiLetters(), say.in_ascii())
    printer: OneLinePrinter = ScenePrinter()
    if not ascii:
        is_lowered = writer.families is not None
        lettering = Lettering(UnicodeLetters(lowered=is_lowered), say)
        printer = UnicodePrinter(lowered=is_lowered)
    rows = TerseRows(lettering, printer)
    sections = seen(contents(writer, parts, form), "terminal")
    return page([[title_row(equations, ascii=ascii)], *map(rows.section, sections)], ascii=ascii)
