"""An analysis as a person reads it in a terminal, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.build import display
from lagrange_cli.notation.layout import Piece, columns, joined
from lagrange_cli.notation.page import Block, Page, Row, formula, page, words
from lagrange_cli.notation.printers.one_line import OneLinePrinter, solid
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.vocabulary import Vocabulary, vocabulary
from lagrange_cli.report.contents.analysis.branches import BranchRows
from lagrange_cli.report.contents.analysis.contacts import contact_rows, with_results
from lagrange_cli.report.contents.analysis.numerical import (
    along_rows,
    complex_text,
    exponent_rows,
    number_rows,
    response_rows,
)
from lagrange_cli.report.contents.analysis.wording import (
    Teller,
    count_line,
    damping_line,
    has_one_number,
    held_line,
    part_word,
    reason_of,
    searched,
    turning_values,
    unproven_lines,
    verdict_word,
)
from lagrange_cli.report.contents.sentences import none_conserved_line
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.phrases.language import ENGLISH, Language, language
from lagrange_cli.report.writers.terminal.conserved import conserved_row, energy
from lagrange_cli.report.writers.terminal.writer import TextWriter, title_row

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.analysis.branches.values import Branches
    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetry
    from lagrange_cli.analysis.values import (
        Equilibria,
        Equilibrium,
        Existence,
        Linearization,
        Matrix,
        Mode,
        NearBalance,
        Turning,
    )

#: Columns of a matrix that is written out.
_MOST_COLUMNS = 8


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
    printer = ScenePrinter() if ascii else UnicodePrinter()
    say = language(code).in_ascii() if ascii else language(code)
    letters = with_results(analysis, vocabulary(analysis.equations))
    writer = _Writer(analysis, letters, printer, say)
    return page(writer.sections(), ascii=ascii)


@dataclass(frozen=True)
class _Writer:
    """Writes the sections of the text.

    Attributes
    ----------
    analysis
        What was found.
    words
        Display names of the symbols of the equations.
    printer
        Prints display trees on one line.
    say
        The language of the words between formulas.
    """

    analysis: Analysis
    words: Vocabulary
    printer: OneLinePrinter
    say: Language = ENGLISH

    def sections(self) -> Iterator[Iterable[Row | Block]]:
        analysis = self.analysis
        yield [title_row(self.lines)]
        if analysis.equilibria is not None:
            yield self.equilibria(analysis.equilibria)
        if analysis.linearization is not None:
            yield self.linearization(analysis.linearization)
            yield self.state_space(analysis.linearization)
        if analysis.modes is not None:
            yield self.modes(analysis.modes)
        if analysis.branches is not None:
            rows = self.branches(analysis.branches)
            yield rows.rows()
            yield rows.marked_rows()
        yield self.conserved()
        yield energy(self.lines)
        yield contact_rows(self.analysis.contacts, self.say, self.pieces, self.phrase)
        yield exponent_rows(self.analysis.exponents, self.say)
        yield along_rows(self.analysis.along, self.say)
        yield response_rows(self.analysis.response, self.say)
        yield self.left_out()

    @cached_property
    def lines(self) -> TextWriter:
        """Return the writer of derivations, in the same letters."""
        return TextWriter(self.analysis.equations, self.words, self.printer, say=self.say)

    def phrase(self, phrase: str) -> str:
        """Say a phrase of the analysis."""
        symbol = self.printer.symbol
        return Teller(self.say, symbol, str, escape_controls)(phrase)

    # Equilibria.

    def equilibria(self, equilibria: Equilibria) -> list[Row | Block]:
        steady = self.analysis.steady
        counted = words(count_line(equilibria, self.say, self.printer.symbol))
        name = self.say("Equilibria") if steady is None else self.say("Steady motions")
        head = Row(name, "   ", counted, "heading")
        points = equilibria.points[:MOST_LISTED]
        verdicts = [
            "" if p.stability is None else verdict_word(p.stability.verdict, self.say)
            for p in points
        ]
        width = max(map(len, verdicts), default=0)
        rows = [
            Row(
                f"  {verdict}",
                " " * (width - len(verdict) + 3),
                self.point(p),
                "name",
                2,
                self.reason(p),
            )
            for p, verdict in zip(points, verdicts, strict=True)
        ]
        lines: list[Row | Block] = [head, Block(tuple(rows), "asides")]
        hidden = len(equilibria.points) - len(points)
        if hidden:
            lines.append(self.hidden(hidden))
        for absent in equilibria.absent:
            if absent.conditions:
                coordinates = self.analysis.rest_equations.system.coordinates
                pairs = zip(coordinates, absent.exact, strict=True)
                place = self.values(absent.exact, None, [c.name for c, e in pairs if e == c.q])
                place_lines = (*place, *self.where(absent.conditions))
                lines.append(Row(f"  {self.say('absent')}", "   ", place_lines))
        if steady is not None:
            momenta = ", ".join(
                f"{self.symbol(s)}" + ("" if x is None else f" = {x:.6g}")
                for s, x in steady.given_values
            )
            lines.append(Row("", "  ", words(self.say("with {values}", values=momenta))))
        further = unproven_lines(equilibria, self.say, self.near)
        further += held_line(equilibria, self.say, self.printer.symbol)
        return [*lines, *(Row("", "  ", words(line)) for line in further)]

    def near(self, at: NearBalance) -> str:
        return joined(self.values(None, at.position, at.free))

    def reason(self, point: Equilibrium) -> str:
        """Say why an equilibrium is stable or not, or when it is."""
        if point.stability is None or not point.stability.stable_where:
            return self.phrase(reason_of(point))
        where = self.listed(point.stability.stable_where)
        return self.say("stable where {conditions}", conditions=joined(where).strip())

    def hidden(self, count: int) -> Row:
        """Say that more is in JSON."""
        return Row("", "  ", words(self.say("and {count} more, in --json", count=count)))

    def point(self, point: Equilibrium) -> tuple[Piece, ...]:
        place = self.values(point.exact, point.position, point.free)
        return (*place, *self.turning(point.turning), *self.where(point.conditions))

    def symbol(self, symbol: Symbol) -> str:
        """Print a symbol in its letters, ``θ̇`` or ``p_θ``."""
        return joined(self.pieces(symbol))

    def turning(self, turning: Turning | None) -> Iterator[Piece]:
        """Write of each ignored coordinate the rate where the momentum is given, or otherwise."""
        steady = self.analysis.steady
        if steady is None or turning is None:
            return
        for shown, exact, number in turning_values(steady, turning):
            value = self.value(self.symbol(shown), exact)
            if number is not None and (exact is None or not exact.is_Rational):
                value += solid(f" = {number:.6g}")
            yield from solid(",")
            yield from _spaced(value, first=False)

    def values(
        self,
        exact: Sequence[Expr] | None,
        position: Sequence[object] | None,
        free: Sequence[str],
    ) -> tuple[Piece, ...]:
        """Write ``x = g / k = 1.5, y any``: closed forms where they are known, and numbers."""
        pieces: list[Piece] = []
        coordinates = self.analysis.rest_equations.system.coordinates
        for k, c in enumerate(coordinates):
            name = self.printer.symbol(c.name)
            if c.name in free:
                value = solid(self.say("{name} any", name=name))
            else:
                closed = None if exact is None else exact[k]
                value = self.value(name, closed)
                if position is not None and has_one_number(closed, free):
                    value += solid(f" = {float(str(position[k])):.6g}")
            comma = solid(",") if k + 1 < len(coordinates) else []
            pieces += [*_spaced(value, first=not pieces), *comma]
        return tuple(pieces)

    def value(self, name: str, exact: Expr | None) -> list[Piece]:
        if exact is None:
            return solid(name)
        return [*solid(f"{name} = "), *self.pieces(exact)]

    def where(self, conditions: Sequence[Existence]) -> list[Piece]:
        """Write the conditions under which an equilibrium exists."""
        return [*words(f" {self.say('where')}"), *self.listed(conditions)] if conditions else []

    def listed(self, conditions: Sequence[Existence]) -> list[Piece]:
        """Write conditions with *and* between them."""
        signs = {"<=": "≤" if self.is_unicode else "<=", "=": "=", "<": "<"}
        pieces: list[Piece] = []
        for k, condition in enumerate(conditions):
            pieces += words(f" {self.say('and')}") if k else []
            pieces += _spaced(self.pieces(condition.smaller), first=False)
            pieces += solid(f" {signs[condition.relation]} ")
            pieces += self.pieces(condition.larger)
        return pieces

    # The linear system.

    def linearization(self, linear: Linearization) -> list[Row | Block]:
        at = self.values(linear.at.exact, linear.at.position, linear.at.free)
        unknowns = ", ".join(map(self.printer.symbol, linear.coordinates))
        form = "M q″ + C q′ + K q = 0" if self.is_unicode else "M*q'' + C*q' + K*q = 0"
        lines: list[Row | Block] = [
            Row(
                self.say("Linearization"),
                "   ",
                words(self.say("{law}, q of {names} from", law=form, names=unknowns)),
                "heading",
            ),
            Row("", "  ", at),
        ]
        exact = linear.exact
        named = [
            ("M", linear.mass, None if exact is None else exact.mass),
            ("C", linear.damping, None if exact is None else exact.damping),
            ("K", linear.stiffness, None if exact is None else exact.stiffness),
        ]
        for name, numbers, closed in named:
            lines += self.matrix(name, numbers, closed)
        damping = damping_line(linear, "C", self.say)
        return [*lines, Row("", "  ", words(damping))] if damping else lines

    def state_space(self, linear: Linearization) -> list[Row | Block]:
        space = linear.state_space
        names = [", ".join(map(self.printed, x)) for x in (space.states, space.inputs)]
        form = "x′ = A x + B u" if self.is_unicode else "x' = A*x + B*u"
        states = self.law(form, x=names[0], u=names[1])
        heading = self.say("State space")
        lines: list[Row | Block] = [Row(heading, "   ", words(states), "heading")]
        exact = linear.exact
        lines += self.matrix("A", space.a, None if exact is None else exact.a)
        if space.inputs:
            lines += self.matrix("B", space.b, None if exact is None else exact.b)
        if self.analysis.equations.system.outputs:
            outputs = ", ".join(map(self.printed, space.outputs))
            form = "y = C x + D u" if self.is_unicode else "y = C*x + D*u"
            linear_words = words(self.law(form, y=outputs))
            lines.append(Row(self.say("Outputs"), "   ", linear_words, "heading"))
            lines += self.matrix("C", space.c, None)
            lines += self.matrix("D", space.d, None) if space.inputs else []
        return lines

    def law(self, law: str, **names: str) -> str:
        """``law, x of θ, θ̇, u of F``."""
        listed = [self.say("{letter} of {names}", letter=k, names=x) for k, x in names.items() if x]
        return ", ".join([law, *listed])

    @property
    def is_unicode(self) -> bool:
        return isinstance(self.printer, UnicodePrinter)

    def printed(self, name: str) -> str:
        """Print the name of a state, ``dot(x)`` with its dot."""
        if name.startswith("dot("):
            return self.printer.symbol(name[4:-1], 1)
        return self.printer.symbol(name)

    def matrix(
        self, name: str, numbers: Matrix, exact: Sequence[Sequence[Expr]] | None
    ) -> Iterator[Row]:
        """Write the entries that are not zero in closed form, or all of them in numbers."""
        if not numbers.size or not numbers.any():
            yield Row(f"  {name}", " = 0", role="name")
        elif exact is not None:
            for i, row in enumerate(exact):
                for j, entry in enumerate(row):
                    if entry != 0:
                        value = numbers[i, j]
                        label = f"  {name}[{i + 1},{j + 1}]"
                        size_note = "" if entry.is_Rational else f"= {value:.6g}"
                        yield formula(label, " = ", self.pieces(entry), aside=size_note)
        elif numbers.shape[1] > _MOST_COLUMNS:
            rows, width = numbers.shape
            size_note = self.say("{rows} by {columns}, in --json", rows=rows, columns=width)
            yield Row(f"  {name}", f" {size_note}", role="name")
        else:
            yield from number_rows(name, numbers)

    # Modes.

    def modes(self, modes: Sequence[Mode]) -> list[Row | Block]:
        damped = any(mode.pole is not None for mode in modes)
        kind = self.say("angular frequencies")
        if damped:
            kind = self.say("poles and angular frequencies")
        lines: list[Row | Block] = [Row(self.say("Modes"), "   ", words(kind), "heading")]
        for mode in modes[:MOST_LISTED]:
            lines += self.mode(mode)
        hidden = len(modes) - MOST_LISTED
        return [*lines, self.hidden(hidden)] if hidden > 0 else lines

    def mode(self, mode: Mode) -> Iterator[Row]:
        label = f"  {mode.frequency:.9g}"
        shape = words(self.shape(mode))
        if mode.pole is not None:
            pole = self.say("pole {value}", value=complex_text(mode.pole))
            yield Row(label, f"   {pole}   ", shape, "name")
        elif mode.exact_square is None:
            yield Row(label, "   ", shape, "name")
        else:
            square = self.pieces(mode.exact_square)
            yield formula(label, f"   {self.say('squared')} ", square)
            yield Row("", " " * (columns(label) + 3), self.exact_shape(mode) or shape)

    def shape(self, mode: Mode) -> str:
        amplitudes = [complex_text(complex(a)) for a in mode.shape[:_MOST_COLUMNS]]
        more = ", …" if self.is_unicode else ", ..."
        listed_amplitudes = ", ".join(amplitudes) + (
            more if len(mode.shape) > _MOST_COLUMNS else ""
        )
        return self.say("shape {values}", values=listed_amplitudes)

    def exact_shape(self, mode: Mode) -> tuple[Piece, ...]:
        pieces: list[Piece] = []
        for k, amplitude in enumerate(mode.exact_shape or ()):
            comma = solid(",") if k else solid(self.say("shape"))
            pieces += [*comma, *_spaced(self.pieces(amplitude), first=False)]
        return tuple(pieces)

    # Branches, conserved quantities, and what is missing.

    def branches(self, result: Branches) -> BranchRows:
        names = [c.name for c in self.analysis.equations.system.coordinates]
        sign = "±" if self.is_unicode else "+-"
        return BranchRows(result, names, self.say, self.phrase, self.printer.symbol, sign)

    def conserved(self) -> list[Row | Block]:
        symmetries = self.analysis.symmetries
        heading, among = self.say("Conserved"), searched(symmetries, self.say)
        rows = [conserved_row(self.lines, c) for c in self.analysis.equations.derivation.conserved]
        if symmetries is not None:
            rows += [self.symmetry_row(symmetry) for symmetry in symmetries.proven]
        if not rows:
            none = f"{self.say('none')} {among}"
            if symmetries is None:
                none = self.lines.text(none_conserved_line(self.analysis.equations))
            return [Row(heading, "   ", words(none), "heading")]
        lines: list[Row | Block] = [
            Row(heading, " ", words(among), "heading"),
            Block(tuple(rows), "asides"),
        ]
        if symmetries is not None and symmetries.unproven:
            number = self.say(
                "{count} more that numbers suggest could not be proven", count=symmetries.unproven
            )
            lines.append(Row("", "  ", words(number)))
        return lines

    def symmetry_row(self, symmetry: Symmetry) -> Row:
        shown = self.pieces(symmetry.expression)
        names = [c.name for c in self.analysis.equations.system.coordinates]
        aside = self.phrase(symmetry.described(names))
        return formula(f"  {self.printer.symbol(symmetry.name)}", " = ", shown, aside=aside)

    def left_out(self) -> list[Row | Block]:
        reasons: dict[str, list[str]] = {}
        for left in self.analysis.left_out:
            reasons.setdefault(self.phrase(left.reason), []).append(part_word(left.part, self.say))
        if not reasons:
            return []
        rows = [
            Row(f"  {', '.join(parts)}", ": ", words(reason), "name")
            for reason, parts in reasons.items()
        ]
        return [Row(self.say("Left out"), role="heading"), *rows]

    def pieces(self, expression: Expr) -> list[Piece]:
        return self.printer.pieces(display(expression, self.words))


def _spaced(pieces: Sequence[Piece], *, first: bool) -> list[Piece]:
    """Put a blank before pieces at which a line may be broken, unless they come first."""
    head, *others = pieces
    if first:
        return list(pieces)
    return [Piece(head.text, head.width + 1, " ", "", 0), *others]
