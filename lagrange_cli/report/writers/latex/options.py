"""Options of a LaTeX document: its style, its parts, and the width of its lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.notation.vocabulary import latex_overrides
from lagrange_cli.pictures.sketch.tikz import tikz_picture
from lagrange_cli.report.contents.derivation.documents import (
    Content,
    asked_content,
    derivation_content,
)
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.document_options import DEFAULT_SECTIONS, EXERCISES, length, sections_of
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import ENGLISH, Language, language
from lagrange_cli.report.writers.latex.letters import LatexLetters, Macros
from lagrange_cli.report.writers.latex.typesetter import COLUMN_POINTS, Typesetter

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.report.tree import Section

#: Points of a line of a page in A4 with margins of 25 mm, of one of its two columns with margins of
#: 20 mm, and of a frame.
_PAGE, _COLUMN, _FRAME = 455.2, 230.4, 307.2

#: The parts of a snippet if nothing else is asked for, without steps and with them.
_SNIPPET = ("equations",)
_STEPS_SNIPPET = ("energies", "equations", "conserved")


@dataclass(frozen=True)
class LatexOptions:
    """Options of LaTeX.

    Attributes
    ----------
    style
        ``document``, ``beamer``, ``snippet``, ``exercise`` or ``solution``.
    form
        ``lagrange`` or ``explicit``.
    parts
        Names of the parts of the document.
    width
        ``page``, ``column``, or a length.
    numbered
        True if displays have numbers.
    say
        The language of the words between formulas.
    written_out
        True if every element of indexed families is shown.
    macros
        Macros of the symbols, None if letters stand for themselves.
    content
        What the document holds in place of the derivation; None for that.
    """

    style: str = "document"
    form: str = "lagrange"
    parts: tuple[str, ...] = tuple(DEFAULT_SECTIONS.split(","))
    width: str = "page"
    numbered: bool = True
    say: Language = ENGLISH
    written_out: bool = False
    macros: Macros | None = None
    content: Content | None = None

    @classmethod
    def of(
        cls,
        equations: Equations,
        options: Mapping[str, OptionValue],
        content: Content | None = None,
    ) -> LatexOptions:
        """Read complete options."""
        style = str(options["style"])
        if style in EXERCISES:
            content = asked_content("latex", equations, options)
        parts = sections_of(options, forces=equations.derivation.constraint_forces is not None)
        if content is not None and content.draws:
            parts = (*parts, "sketch")
        if style == "snippet" and options["sections"] == DEFAULT_SECTIONS:
            parts = _SNIPPET if equations.derivation.steps is None else _STEPS_SNIPPET
        numbered = options["numbers"] == "on"
        say = language(str(options["language"]))
        form, width = str(options["form"]), str(options["width"])
        written_out = bool(options["written_out"])
        macros = Macros(latex_overrides(equations)) if options["macros"] else None
        return cls(style, form, parts, width, numbered, say, written_out, macros, content)

    def writer(self, equations: Equations) -> DocumentWriter:
        """Return the writer of the document's content."""
        return DocumentWriter(equations, written_out=self.written_out)

    def sections(self, equations: Equations) -> list[Section]:
        """Return the sections of the document."""
        return self.shown(equations).sections(self.writer(equations))

    def shown(self, equations: Equations) -> Content:
        """Return what the document holds."""
        return self.content or derivation_content(equations, self.parts, self.form)

    @property
    def _points(self) -> float:
        """Return points of a line."""
        page = _FRAME if self.style == "beamer" else _PAGE
        points = length(self.width)
        return {"page": page, "column": _COLUMN}[self.width] if points is None else points

    @property
    def columns(self) -> float:
        """Return columns of half an em of a line."""
        points = self._points
        return points / COLUMN_POINTS[11 if self.style != "beamer" and points > _COLUMN else 10]

    def setter(self, equations: Equations | None, stem: str) -> Typesetter:
        """Return the typesetter of displays of this width, whose labels begin with a stem."""
        picture = ""
        if equations is not None and "sketch" in self.parts:
            picture = tikz_picture(equations, self._points)
        rows = 6 if self.style == "beamer" else 24
        return Typesetter(
            Lettering(LatexLetters(equations, self.macros), self.say),
            self.columns,
            self.numbered,
            stem,
            picture,
            rows,
            self.macros,
        )
