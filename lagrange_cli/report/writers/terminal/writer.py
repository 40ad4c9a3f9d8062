"""The writer that all sections of the text share: vocabulary, printer, families, rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.errors import escape_controls
from lagrange_cli.mechanics.families.families import Families
from lagrange_cli.mechanics.families.forms import FamilyRow, Range
from lagrange_cli.notation.build import display, display_sum
from lagrange_cli.notation.families import FamilyNotation
from lagrange_cli.notation.layout import Piece, columns, suffixed
from lagrange_cli.notation.page import Block, Row, formula, words
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.symbols import text_prose
from lagrange_cli.notation.tree import DisplayNode, abbreviations_in
from lagrange_cli.notation.vocabulary import Vocabulary
from lagrange_cli.report.contents.families import with_families
from lagrange_cli.report.document_options import DEFAULT_SECTIONS
from lagrange_cli.report.inlines import Lettering, Text
from lagrange_cli.report.phrases.language import ENGLISH, Language
from lagrange_cli.report.ranges import text_ranges
from lagrange_cli.report.writers.terminal.letters import AsciiLetters, UnicodeLetters

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


#: Parts of the text unless others are asked for.
DEFAULT_PARTS = frozenset(DEFAULT_SECTIONS.split(","))


@dataclass(frozen=True)
class TextWriter:
    """Writes the sections of the text.

    Attributes
    ----------
    equations
        The equations.
    words
        Display names of their symbols.
    printer
        Prints display trees on one line.
    over_letters
        Writes what families have in common; None if all is written out.
    abbreviated
        Names of the scene's abbreviations that what was written so far holds.
    parts
        Names of the parts that are wanted.
    say
        The language of the words between formulas.
    """

    equations: Equations
    words: Vocabulary
    printer: OneLinePrinter
    over_letters: FamilyNotation | None = None
    abbreviated: set[str] = field(default_factory=set)
    parts: frozenset[str] = DEFAULT_PARTS
    say: Language = ENGLISH

    @property
    def families(self) -> Families | None:
        return None if self.over_letters is None else self.over_letters.families

    def with_families(self, part: str, count: int) -> Iterator[int | FamilyRow]:
        """Return numbers of the rows of a part of the page, or the rows of their families."""
        rows = () if self.families is None else getattr(self.families, part)
        return with_families(rows, count)

    def ranged(self, pieces: list[Piece], one: int | FamilyRow) -> list[Piece]:
        """Return a formula with the range of its indices behind it."""
        if not isinstance(one, FamilyRow) or not one.ranges:
            return pieces
        return [*suffixed(pieces, ",", 1), self.range_piece(one.ranges)]

    def range_piece(self, ranges: Sequence[Range]) -> Piece:
        span = text_ranges(ranges, ascii=isinstance(self.printer, ScenePrinter))
        return Piece(span, columns(span) + 1, " ", "", 0)

    def listed(self, named: Sequence[tuple[str, Expr]]) -> Iterator[tuple[str, list[Piece]]]:
        """Return names with what they stand for, those of families with letters."""
        definitions = () if self.families is None else self.families.definitions(named)
        for one in with_families(definitions, len(named)):
            if isinstance(one, FamilyRow) and self.over_letters is not None:
                yield one.name, self.ranged(self.tree(self.over_letters.whole(one)), one)
            elif isinstance(one, int):
                yield named[one][0], self.pieces(named[one][1])

    @cached_property
    def lettering(self) -> Lettering:
        """Letters of the printer, and the language."""
        is_lowered = isinstance(self.printer, UnicodePrinter) and self.printer.lowered
        is_ascii = isinstance(self.printer, ScenePrinter)
        return Lettering(
            AsciiLetters() if is_ascii else UnicodeLetters(lowered=is_lowered), self.say
        )

    def text(self, text: Text) -> str:
        """Return words or a formula as a text."""
        return self.lettering.text(text)

    def prose(self, text: Text | None) -> tuple[Piece, ...]:
        """Return words that are broken between lines; none of nothing."""
        return words(self.text(text or ""))

    def pieces(self, expression: Expr) -> list[Piece]:
        return self.tree(display(expression, self.words))

    def tree(self, node: DisplayNode) -> list[Piece]:
        """Return the pieces of a tree, whose abbreviations are noted."""
        self.note(node)
        return self.printer.pieces(self.lettering.node(node))

    def noted(self, node: DisplayNode) -> DisplayNode:
        """Return the same tree, whose abbreviations are noted."""
        self.note(node)
        return node

    def note(self, node: DisplayNode) -> None:
        if self.words.named:
            self.abbreviated.update(abbreviations_in(node))

    def total(self, label: str, parts: Sequence[Expr], aside: str = "") -> Row:
        """``label = Σ parts``, the parts in their order, or with sums over indices."""
        form = None if self.families is None else self.families.quantity(sympy.Add(*parts))
        if form is None or self.over_letters is None:
            shown = self.tree(display_sum(parts, self.words))
        else:
            shown = self.tree(self.over_letters.form(form))
        return formula(label, " = ", shown, aside=escape_controls(aside))

    def formula(self, label: str, expression: Expr, aside: str = "") -> Row:
        """``label = expression``, and what is said of it."""
        shown = self.pieces(expression)
        return formula(label, " = ", shown, aside=escape_controls(aside))


def title_row(writer: TextWriter) -> Row:
    """Return the name and the title of the scene, whose formulas are in plain letters."""
    presentation = writer.equations.presentation
    name, title = escape_controls(presentation.name), presentation.title
    if not title:
        return heading_row(name)
    is_ascii = isinstance(writer.printer, ScenePrinter)
    shown = words(escape_controls(title if is_ascii else text_prose(title)))
    return Row(name, ": ", shown, "heading")


def heading_row(text: str) -> Row:
    """Return a heading by itself."""
    return Row(text, role="heading")


def with_asides(heading: str, rows: Sequence[Row]) -> list[Row | Block]:
    """Return rows under a heading, what is said of each behind it."""
    return [heading_row(heading), Block(tuple(rows), "asides")] if rows else []
