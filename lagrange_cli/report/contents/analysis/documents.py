"""The sections of an analysis, and what writes them in a terminal and as documents."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

from lagrange_cli.analysis.result import Analysis
from lagrange_cli.emit.base import OptionValue, completed, unknown_choice
from lagrange_cli.notation.page import Page, page
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.report.contents.analysis.branches import branch_sections
from lagrange_cli.report.contents.analysis.contacts import contacts_section, with_results
from lagrange_cli.report.contents.analysis.equilibria import equilibria_section
from lagrange_cli.report.contents.analysis.linear import linear_sections
from lagrange_cli.report.contents.analysis.numerical import (
    along_section,
    exponents_section,
    response_section,
)
from lagrange_cli.report.contents.analysis.wording import part_words, searched, sentence
from lagrange_cli.report.contents.derivation.conservation import Further, balance, conserved
from lagrange_cli.report.contents.derivation.documents import (
    Content,
    asked_document,
    written_document,
)
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.numbers import phrased
from lagrange_cli.report.document_options import ANALYZED, DEFAULTS, DOCUMENTS
from lagrange_cli.report.inlines import Lettering, say, symbol
from lagrange_cli.report.phrases.language import language
from lagrange_cli.report.registry import contents_of
from lagrange_cli.report.tree import Document, Labelled, Section, formulas, section, seen
from lagrange_cli.report.writers.terminal.letters import AsciiLetters, UnicodeLetters
from lagrange_cli.report.writers.terminal.results import ResultRows
from lagrange_cli.report.writers.terminal.sections import title_row

if TYPE_CHECKING:
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetry
    from lagrange_cli.notation.vocabulary import Vocabulary


@dataclass(frozen=True)
class _AnalysisWriter(DocumentWriter):
    """A writer that knows the symbols that an analysis brings in."""

    analysis: Analysis | None = None

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols."""
        words = super().words
        return words if self.analysis is None else with_results(self.analysis, words)


def analysis_sections(analysis: Analysis, writer: DocumentWriter) -> list[Section]:
    """Return the sections of an analysis in their order, each with a name."""
    if analysis.steady is not None or analysis.contacts is not None:
        fields = {field.name: getattr(writer, field.name) for field in dataclasses.fields(writer)}
        writer = _AnalysisWriter(**fields, analysis=analysis)
    names = [c.name for c in analysis.equations.system.coordinates]
    conserved_sections = (("conserved", _conserved(analysis, writer)), ("energy", balance(writer)))
    named = [
        ("equilibria", equilibria_section(analysis, writer)),
        *linear_sections(analysis, writer),
        *branch_sections(analysis.branches, names),
        *(conserved_sections if _asks_for_symmetries(analysis) else ()),
        ("contacts", contacts_section(analysis.contacts, writer)),
        ("exponents", exponents_section(analysis.exponents)),
        ("along", along_section(analysis.along)),
        ("response", response_section(analysis.response)),
        ("left-out", _left_out(analysis)),
    ]
    sections = [replace(section, name=name) for name, section in named if section is not None]
    rows = writer.abbreviations()
    if rows:
        sections.append(Section(say("Abbreviations"), (formulas(rows),), "abbreviations"))
    return sections


def _asks_for_symmetries(analysis: Analysis) -> bool:
    """Tell whether conserved quantities belong to the parts that were asked for."""
    left_out = any(left.part == "symmetries" for left in analysis.left_out)
    return analysis.symmetries is not None or left_out


def _conserved(analysis: Analysis, writer: DocumentWriter) -> Section | None:
    """Return conserved quantities, with those that symmetries give."""
    result = analysis.symmetries
    further = [] if result is None else [_further(writer, s) for s in result.proven]
    lines = conserved(writer, further, None if result is None else searched(result))
    if lines is None or result is None or not result.unproven:
        return lines
    unproven = say("{count} more that numbers suggest could not be proven", count=result.unproven)
    return replace(lines, blocks=(*lines.blocks, sentence(unproven)))


def _further(writer: DocumentWriter, symmetry: Symmetry) -> Further:
    names = [c.name for c in writer.equations.system.coordinates]
    label, reason = symbol(symmetry.name), phrased(symmetry.described(names))
    row = writer.total(label, (symmetry.expression,))
    return Further(label, reason, replace(row, aside=reason))


def _left_out(analysis: Analysis) -> Section | None:
    reasons: dict[str, list[str]] = {}
    for left in analysis.left_out:
        reasons.setdefault(left.reason, []).append(left.part)
    items = tuple((part_words(parts), phrased(reason)) for reason, parts in reasons.items())
    return section(say("Left out"), Labelled(items) if items else None)


def analysis_page(analysis: Analysis, *, ascii: bool = False, code: str = "en") -> Page:
    """Write an analysis: equilibria, linear system, modes, conserved quantities, parts left out.

    Parameters
    ----------
    analysis
        What was found.
    ascii
        Seven-bit text with formulas in the scene language; else Unicode.
    code
        The language of the words.
    """
    letters = AsciiLetters() if ascii else UnicodeLetters()
    lettering = Lettering(letters, language(code).in_ascii() if ascii else language(code))
    writer = DocumentWriter(analysis.equations, abbreviating=False, written_out=True)
    sections = seen(analysis_sections(analysis, writer), "terminal")
    rows = ResultRows(lettering, ScenePrinter() if ascii else UnicodePrinter())
    title = title_row(analysis.equations, ascii=ascii)
    return page([[title], *map(rows.section, sections)], ascii=ascii)


@contents_of.register
def analysis_contents(analysis: Analysis) -> Document:
    """Return what a document holds of an analysis."""
    return asked_document("html", analysis.equations, DEFAULTS, _content(analysis))[0]


def _content(analysis: Analysis) -> Content:
    return Content("analysis", partial(analysis_sections, analysis))


def analysis_document(
    analysis: Analysis, to: str, options: Mapping[str, OptionValue] | None = None
) -> dict[str, str]:
    """Return file name → text of an analysis in a format of documents.

    Parameters
    ----------
    analysis
        What was found.
    to
        The format.
    options
        Those of :data:`~.document_options.ANALYZED`; those absent take their defaults.

    Raises
    ------
    InputError
        There is no such format or option, or the option does not take the value.
    """
    if to not in DOCUMENTS:
        listed = ", ".join(DOCUMENTS)
        message = f"an analysis has no format '{to}'; there are {listed}"
        raise unknown_choice(message, to, list(DOCUMENTS))
    chosen = completed(to, ANALYZED[to], options or {})
    return written_document(to, analysis.equations, {**DEFAULTS, **chosen}, _content(analysis))
