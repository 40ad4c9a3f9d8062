"""Documents of an analysis in LaTeX, Markdown, Typst and HTML, from the same sections."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.base import OptionValue, completed, unknown_choice
from lagrange_cli.report.contents.analysis.branches import BranchSections
from lagrange_cli.report.contents.analysis.contacts import LossLines, with_results
from lagrange_cli.report.contents.analysis.linear import linear_sections
from lagrange_cli.report.contents.analysis.numerical import response_lines, response_table
from lagrange_cli.report.contents.analysis.places import Places
from lagrange_cli.report.contents.analysis.wording import (
    Teller,
    along_lines,
    averaged_line,
    count_line,
    part_word,
    reason_of,
    searched,
    span_line,
    unproven_lines,
    verdict_word,
)
from lagrange_cli.report.contents.derivation.conservation import Further, balance, conserved
from lagrange_cli.report.contents.derivation.contents import Content
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.document_options import ANALYZED, LATEX_OPTIONS, MOST_LISTED
from lagrange_cli.report.inlines import Spelled
from lagrange_cli.report.tree import (
    Block,
    Bullets,
    Formula,
    Paragraph,
    Section,
    Table,
    Title,
    formulas,
    section,
)
from lagrange_cli.report.writers.html import emit_html
from lagrange_cli.report.writers.latex.document import emit_latex
from lagrange_cli.report.writers.markdown import emit_markdown
from lagrange_cli.report.writers.typst.document import emit_typst

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetry
    from lagrange_cli.analysis.values import Equilibria, Equilibrium, NearBalance
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.notation.vocabulary import Vocabulary


def analysis_sections(
    analysis: Analysis,
    writer: DocumentWriter,
    columns: float,
) -> list[Section]:
    """Write the sections of a document of an analysis.

    Parameters
    ----------
    analysis
        What was found.
    writer
        Equations, letters and language.
    columns
        Width of a line in columns of half an em.
    """
    if analysis.steady is not None or analysis.contacts is not None:
        fields = {field.name: getattr(writer, field.name) for field in dataclasses.fields(writer)}
        writer = _AnalysisWriter(**fields, analysis=analysis)
    contents = _Contents(analysis, writer, columns)
    named = [
        ("equilibria", contents.equilibria()),
        *linear_sections(analysis, contents.places),
        *contents.branches(),
        ("conserved", contents.conserved()),
        ("energy", balance(writer)),
        ("contacts", contents.contacts()),
        ("exponents", contents.exponents()),
        ("along", contents.along()),
        ("response", contents.response()),
        ("left-out", contents.left_out()),
    ]
    named_sections = [replace(section, name=name) for name, section in named if section is not None]
    rows = writer.abbreviations()
    if rows:
        here = Section(writer.say("Abbreviations"), (formulas(rows),), "abbreviations")
        return [*named_sections, here]
    return named_sections


@dataclass(frozen=True)
class _AnalysisWriter(DocumentWriter):
    """A writer that knows the symbols that an analysis brings in."""

    analysis: Analysis | None = None

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols."""
        words = super().words
        return words if self.analysis is None else with_results(self.analysis, words)


@dataclass(frozen=True)
class _Contents:
    analysis: Analysis
    writer: DocumentWriter
    columns: float

    @cached_property
    def teller(self) -> Teller:
        letters = self.writer.letters
        return Teller(
            self.writer.say,
            lambda name: letters.inline(letters.symbol(name)),
            lambda letter: letters.inline(letters.bold(letter)),
            letters.words,
        )

    @cached_property
    def places(self) -> Places:
        analysis = self.analysis
        return Places(
            self.writer, self.columns, analysis.rest_equations.system.coordinates, analysis.steady
        )

    # -- equilibria -----------------------------------------------------------------

    def equilibria(self) -> Section | None:
        result = self.analysis.equilibria
        if result is None:
            return None
        say, letters = self.writer.say, self.writer.letters
        points = result.points[:MOST_LISTED]
        hidden = len(result.points) - len(points)
        counted = count_line(result, say, self.teller.symbol)
        blocks: list[Block | None] = [Paragraph(say("{text}.", text=_capital(counted)))]
        blocks += self._points(points)
        if hidden:
            blocks.append(Paragraph(say("And {count} more, in JSON.", count=hidden)))
        blocks += self._absent(result)
        near = unproven_lines(result, say, self._near)
        blocks += [Bullets(tuple(near))] if near else []
        if result.held_inputs:
            inputs = ", ".join(
                letters.inline(f"{letters.symbol(n)} = {self.places.number(x)}")
                for n, x in result.held_inputs
            )
            blocks.append(Paragraph(say("Inputs are held at {values}.", values=inputs)))
        steady = self.analysis.steady
        if steady is None:
            return section(say("Equilibria"), *blocks)
        momenta = ", ".join(
            letters.inline(
                self.places.letter(symbol) + ("" if x is None else f" = {self.places.number(x)}")
            )
            for symbol, x in steady.given_values
        )
        return section(
            say("Steady motions"), Paragraph(say("With {values}:", values=momenta)), *blocks
        )

    def _points(self, points: Sequence[Equilibrium]) -> Iterator[Block]:
        rows = [self.places.point(p) for p in points]
        if all(self.places.is_short(place) for place in rows):
            items = [
                self._sentence(point, self.places.inline(place, point.conditions))
                for point, place in zip(points, rows, strict=True)
            ]
            if items:
                yield Bullets(tuple(items))
            return
        for point, place in zip(points, rows, strict=True):
            yield Title(self._sentence(point, ""))
            yield formulas(place)
            where = self.places.conditions(point.conditions)
            if where:
                yield Paragraph(self.writer.say("where {conditions}", conditions=where))

    def _sentence(self, point: Equilibrium, place: str) -> str:
        """``θ = 0: stable, since K is positive definite: the energy has a minimum``."""
        say, reason = self.writer.say, self.teller(reason_of(point))
        if point.stability is not None and point.stability.stable_where:
            where = self.places.conditions(point.stability.stable_where)
            reason = say("stable where {conditions}", conditions=where)
        verdict = "" if point.stability is None else verdict_word(point.stability.verdict, say)
        if reason and verdict:
            verdict = say("{verdict} ({reason})", verdict=verdict, reason=reason)
        if not place:
            return say("{text}:", text=_capital(verdict or reason))
        whole = verdict or reason
        return say("{name}: {value}", name=place, value=whole) if whole else place

    def _near(self, at: NearBalance) -> str:
        return self.places.inline(self.places.place(None, at.position, at.free), ())

    def _absent(self, result: Equilibria) -> Iterator[Block]:
        """Return equilibria that exist for other values of the parameters."""
        items = []
        for absent in result.absent:
            if absent.conditions:
                pairs = zip(self.places.coordinates, absent.exact, strict=True)
                free = [c.name for c, e in pairs if e == c.q]
                items.append(
                    self.places.inline(
                        self.places.place(absent.exact, None, free), absent.conditions
                    )
                )
        if items:
            yield Paragraph(
                self.writer.say("For other values of the parameters there are as well:")
            )
            yield Bullets(tuple(items))

    # -- what is conserved, and what is missing -----------------------------------------

    def conserved(self) -> Section | None:
        result = self.analysis.symmetries
        symmetries = () if result is None else result.proven
        further = [self._symmetry(s) for s in symmetries]
        among = "" if result is None else searched(result, self.writer.say)
        lines = conserved(self.writer, further, Spelled(among) if among else None)
        if lines is None or result is None or not result.unproven:
            return lines
        doubt = self.writer.say(
            "{count} more that numbers suggest could not be proven", count=result.unproven
        )
        text = Paragraph(self.writer.say("{text}.", text=doubt))
        return Section(lines.heading, (*lines.blocks, text), lines.name)

    def _symmetry(self, symmetry: Symmetry) -> Further:
        names = [c.name for c in self.writer.equations.system.coordinates]
        symbol = self.writer.letters.symbol(symmetry.name)
        reason = self.teller(symmetry.described(names))
        return Further(symbol, reason, self.writer.total(symbol, (symmetry.expression,)))

    def contacts(self) -> Section | None:
        """Return forces of contacts, and where these vanish."""
        losses, writer, letters = self.analysis.contacts, self.writer, self.writer.letters
        if losses is None:
            return None

        def shown(expression: Expr) -> str:
            return letters.formula(writer.tree(expression))

        lines = LossLines(writer.say, shown, self.places.number, letters.inline, self.teller)
        rows = [
            Formula(shown(loss.multiplier), (writer.tree(loss.force),)) for loss in losses.contacts
        ]
        items = [
            writer.say(
                "{name}: {value}",
                name=letters.inline(writer.lettering.text(label.label)),
                value=lines.lost(loss, losses),
            )
            for label, loss in zip(rows, losses.contacts, strict=True)
        ]
        scope = _capital(lines.scope(losses))
        return section(
            writer.say("Loss of contact"),
            Paragraph(writer.say("{text}:" if rows else "{text}.", text=scope)),
            formulas(rows, result=True) if rows else None,
            Bullets((*items, *lines.constants(losses))) if items else None,
        )

    def exponents(self) -> Section | None:
        """Return a table of Lyapunov exponents and their spreads."""
        result = self.analysis.exponents
        if result is None:
            return None
        say, letters = self.writer.say, self.writer.letters
        rows = tuple(
            (
                letters.inline(self.places.literal(f"{x:.5g}")),
                letters.inline(self.places.literal(f"{y:.2g}")),
            )
            for x, y in zip(result.values, result.spreads, strict=True)
        )
        return section(
            say("Lyapunov exponents"),
            Paragraph(say("{text}.", text=_capital(averaged_line(result, say, letters.inline)))),
            Table((say("exponent"), say("spread")), rows),
        )

    def along(self) -> Section | None:
        """Return the section on a linear system along a motion; JSON holds its matrices."""
        result, say, letters = self.analysis.along, self.writer.say, self.writer.letters
        if result is None:
            return None
        named = (
            (say("states"), result.states),
            (say("inputs"), result.inputs),
            (say("outputs"), result.outputs),
        )
        rows = [
            say("{name}: {value}", name=name, value=", ".join(map(self._state, names)))
            for name, names in named
            if names
        ]
        lines = along_lines(result, say, letters.words)
        span = say("{text}.", text=_capital(span_line(result, say, letters.inline)))
        return section(say("Along the motion"), Paragraph(span), Bullets((*rows, *lines)))

    def response(self) -> Section | None:
        """Return a table of largest gains."""
        result, say, letters = self.analysis.response, self.writer.say, self.writer.letters
        if result is None:
            return None
        head, *rows = response_table(result, say)
        cells = tuple(tuple(letters.words(cell) for cell in row) for row in rows)
        lines = tuple(
            say("{text}.", text=_capital(letters.words(line)))
            for line in response_lines(result, say)
        )
        return section(say("Frequency response"), Table(head, cells), Paragraph(" ".join(lines)))

    def _state(self, name: str) -> str:
        letters = self.writer.letters
        dotted = name.startswith("dot(")
        return letters.inline(letters.symbol(name[4:-1] if dotted else name, int(dotted)))

    def branches(self) -> list[tuple[str, Section | None]]:
        """Return branches of equilibria, and their marked points."""
        result = self.analysis.branches
        if result is None:
            return []
        written = BranchSections(result, self.writer, self.places, self.teller)
        return [("branches", written.branches()), ("marked-points", written.marks())]

    def left_out(self) -> Section | None:
        reasons: dict[str, list[str]] = {}
        say = self.writer.say
        for left in self.analysis.left_out:
            reasons.setdefault(self.teller(left.reason), []).append(part_word(left.part, say))
        items = [
            say("{name}: {value}", name=", ".join(parts), value=reason)
            for reason, parts in reasons.items()
        ]
        return section(say("Left out"), Bullets(tuple(items)) if items else None)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


_Emit: TypeAlias = Callable[["Equations", Mapping[str, OptionValue], Content], dict[str, str]]

#: Format → what writes a content in it.
_FORMATS: dict[str, _Emit] = {
    "latex": emit_latex,
    "markdown": emit_markdown,
    "typst": emit_typst,
    "html": emit_html,
}

#: What options of derivations are where a document holds none.
_DEFAULTS: dict[str, OptionValue] = {option.name: option.default for option in LATEX_OPTIONS}


def analysis_document(
    analysis: Analysis, to: str, options: Mapping[str, OptionValue] | None = None
) -> dict[str, str]:
    """Return file name → text of an analysis in ``latex``, ``markdown``, ``typst`` or ``html``.

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
    if to not in _FORMATS:
        listed = ", ".join(_FORMATS)
        message = f"an analysis has no format '{to}'; there are {listed}"
        raise unknown_choice(message, to, list(_FORMATS))
    chosen = completed(to, ANALYZED[to], options or {})
    content = Content("analysis", partial(analysis_sections, analysis))
    return _FORMATS[to](analysis.equations, {**_DEFAULTS, **chosen}, content)
