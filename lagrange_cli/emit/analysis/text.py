"""An analysis as a person reads it in a terminal, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import (
    energy_is_sum,
    energy_letter,
    quantity_labels,
)
from lagrange_cli.emit.forms.writer import with_momenta
from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.build import display, display_sum
from lagrange_cli.notation.layout import Piece, columns, joined
from lagrange_cli.notation.one_line import OneLinePrinter, solid
from lagrange_cli.notation.page import Block, Page, Row, formula, page, words
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import Vocabulary, vocabulary

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.analysis.symmetries import Symmetry
    from lagrange_cli.analysis.values import (
        Analysis,
        Equilibria,
        Equilibrium,
        Existence,
        Linearization,
        Matrix,
        Mode,
        Turning,
    )
    from lagrange_cli.mechanics.findings import Conserved

#: What conserved quantities are looked for among.
_SEARCHED = "among cyclic momenta and energy"
_SEARCHED_FURTHER = "among energy and what symmetries {} in the coordinates give"

#: Equilibria and modes that are listed, and columns of a matrix that is written out.
_MOST_LISTED, _MOST_COLUMNS = 16, 8


def analysis_page(analysis: Analysis, *, ascii: bool = False) -> Page:
    """Write an analysis: equilibria, linear system, modes, what is conserved, what is left out.

    ``ascii``: seven-bit text with formulas in the scene language; else Unicode.
    """
    printer = ScenePrinter() if ascii else UnicodePrinter()
    letters = vocabulary(analysis.equations)
    if analysis.steady is not None:
        letters = with_momenta(letters, analysis.steady.momenta)
    writer = _Writer(analysis, letters, printer)
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
    """

    analysis: Analysis
    words: Vocabulary
    printer: OneLinePrinter

    def sections(self) -> Iterator[Iterable[Row | Block]]:
        analysis = self.analysis
        yield [self.heading()]
        if analysis.equilibria is not None:
            yield self.equilibria(analysis.equilibria)
        if analysis.linearization is not None:
            yield self.linearization(analysis.linearization)
            yield self.state_space(analysis.linearization)
        if analysis.modes is not None:
            yield self.modes(analysis.modes)
        yield self.conserved()
        yield self.left_out()

    def heading(self) -> Row:
        name, title = self.analysis.equations.name, self.analysis.equations.title
        if not title:
            return Row(escape_controls(name), role="heading")
        return Row(escape_controls(name), ": ", words(escape_controls(title)), "heading")

    # Equilibria.

    def equilibria(self, equilibria: Equilibria) -> list[Row | Block]:
        steady = self.analysis.steady
        name = "Equilibria" if steady is None else "Steady motions"
        head = Row(name, "   ", words(_count(equilibria)), "heading")
        points = equilibria.points[:_MOST_LISTED]
        verdicts = ["" if p.stability is None else p.stability.verdict for p in points]
        width = max(map(len, verdicts), default=0)
        rows = [
            Row(f"  {verdict}", " " * (width - len(verdict) + 3), self.point(p), "name", 2, _why(p))
            for p, verdict in zip(points, verdicts, strict=True)
        ]
        lines: list[Row | Block] = [head, Block(tuple(rows), "asides")]
        hidden = len(equilibria.points) - len(points)
        if hidden:
            lines.append(Row("", "  ", words(f"and {hidden} more, in --json")))
        for absent in equilibria.absent:
            if absent.conditions:
                coordinates = self.analysis.resting.coordinates
                pairs = zip(coordinates, absent.exact, strict=True)
                place = self.values(absent.exact, None, [c.name for c, e in pairs if e == c.q])
                lines.append(Row("  absent", "   ", (*place, *self.where(absent.conditions))))
        if steady is not None:
            given = ", ".join(
                f"{self.symbol(s)}" + ("" if x is None else f" = {x:.6g}") for s, x in steady.given
            )
            lines.append(Row("", "  ", words(f"with {given}")))
        if equilibria.held:
            held = ", ".join(f"{self.printer.symbol(n)} = {x:g}" for n, x in equilibria.held)
            lines.append(Row("", "  ", words(f"with inputs held at {held}")))
        return lines

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
        for k, (momentum, (given, _)) in enumerate(zip(steady.momenta, steady.given, strict=True)):
            is_rate = given == momentum.symbol
            shown = momentum.coordinate.v if is_rate else momentum.symbol
            exact = turning.exact_rates if is_rate else turning.exact_momenta
            numbers = turning.rates if is_rate else turning.momenta
            value = self.value(self.symbol(shown), None if exact is None else exact[k])
            told = numbers is not None and (exact is None or not exact[k].is_Rational)
            if numbers is not None and told:
                value += solid(f" = {float(numbers[k]):.6g}")
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
        coordinates = self.analysis.resting.coordinates
        for k, c in enumerate(coordinates):
            name = self.printer.symbol(c.name)
            if c.name in free:
                value = solid(f"{name} any")
            else:
                value = self.value(name, None if exact is None else exact[k])
                number = None if position is None else f"{float(str(position[k])):.6g}"
                told = number is not None and (exact is None or not exact[k].is_Rational)
                value += solid(f" = {number}") if told else []
            comma = solid(",") if k + 1 < len(coordinates) else []
            pieces += [*_spaced(value, first=not pieces), *comma]
        return tuple(pieces)

    def value(self, name: str, exact: Expr | None) -> list[Piece]:
        if exact is None:
            return solid(name)
        return [*solid(f"{name} = "), *self.pieces(exact)]

    def where(self, conditions: Sequence[Existence]) -> list[Piece]:
        """Write the conditions under which an equilibrium exists."""
        signs = {"<=": "≤" if self.is_unicode else "<=", "=": "="}
        pieces: list[Piece] = []
        for k, condition in enumerate(conditions):
            pieces += words(" where" if k == 0 else " and")
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
            Row("Linearization", "   ", words(f"{form}, q of {unknowns} from"), "heading"),
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
        if linear.damping.any():
            lines.append(Row("", "  ", words(_damping_line(linear))))
        return lines

    def state_space(self, linear: Linearization) -> list[Row | Block]:
        space = linear.state_space
        names = [", ".join(map(self.printed, x)) for x in (space.states, space.inputs)]
        form = "x′ = A x + B u" if self.is_unicode else "x' = A*x + B*u"
        states = f"{form}, x of {names[0]}" + (f", u of {names[1]}" if names[1] else "")
        lines: list[Row | Block] = [Row("State space", "   ", words(states), "heading")]
        exact = linear.exact
        lines += self.matrix("A", space.a, None if exact is None else exact.a)
        if space.inputs:
            lines += self.matrix("B", space.b, None if exact is None else exact.b)
        if self.analysis.equations.outputs:
            outputs = ", ".join(map(self.printed, space.outputs))
            form = "y = C x + D u" if self.is_unicode else "y = C*x + D*u"
            lines.append(Row("Outputs", "   ", words(f"{form}, y of {outputs}"), "heading"))
            lines += self.matrix("C", space.c, None)
            lines += self.matrix("D", space.d, None) if space.inputs else []
        return lines

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
                        told = "" if entry.is_Rational else f"= {value:.6g}"
                        yield formula(label, " = ", self.pieces(entry), aside=told)
        elif numbers.shape[1] > _MOST_COLUMNS:
            rows, width = numbers.shape
            yield Row(f"  {name}", f" {rows} by {width}, in --json", role="name")
        else:
            yield from _number_rows(name, numbers)

    # Modes.

    def modes(self, modes: Sequence[Mode]) -> list[Row | Block]:
        damped = any(mode.pole is not None for mode in modes)
        kind = "poles and angular frequencies" if damped else "angular frequencies"
        lines: list[Row | Block] = [Row("Modes", "   ", words(kind), "heading")]
        for mode in modes[:_MOST_LISTED]:
            lines += self.mode(mode)
        hidden = len(modes) - _MOST_LISTED
        return (
            [*lines, Row("", "  ", words(f"and {hidden} more, in --json"))] if hidden > 0 else lines
        )

    def mode(self, mode: Mode) -> Iterator[Row]:
        label = f"  {mode.frequency:.9g}"
        shape = words(self.shape(mode))
        if mode.pole is not None:
            yield Row(label, f"   pole {_complex(mode.pole)}   ", shape, "name")
        elif mode.exact_square is None:
            yield Row(label, "   ", shape, "name")
        else:
            square = self.pieces(mode.exact_square)
            yield formula(label, "   squared ", square)
            yield Row("", " " * (columns(label) + 3), self.exact_shape(mode) or shape)

    def shape(self, mode: Mode) -> str:
        amplitudes = [_complex(complex(a)) for a in mode.shape[:_MOST_COLUMNS]]
        more = ", …" if self.is_unicode else ", ..."
        return f"shape {', '.join(amplitudes)}{more if len(mode.shape) > _MOST_COLUMNS else ''}"

    def exact_shape(self, mode: Mode) -> tuple[Piece, ...]:
        pieces: list[Piece] = []
        for k, amplitude in enumerate(mode.exact_shape or ()):
            comma = solid(",") if k else solid("shape")
            pieces += [*comma, *_spaced(self.pieces(amplitude), first=False)]
        return tuple(pieces)

    # Conserved quantities, and what is missing.

    def conserved(self) -> list[Row | Block]:
        found, searched = self.analysis.symmetries, _SEARCHED
        rows = [self.conserved_row(c) for c in self.analysis.equations.conserved]
        if found is not None:
            searched = _SEARCHED_FURTHER.format("linear" if found.complete else "constant")
            rows += [self.symmetry_row(symmetry) for symmetry in found.found]
        if not rows:
            return [Row("Conserved", "   ", words(f"none {searched}"), "heading")]
        lines: list[Row | Block] = [
            Row("Conserved", " ", words(searched), "heading"),
            Block(tuple(rows), "asides"),
        ]
        if found is not None and found.unproven:
            number = f"{found.unproven} more that numbers suggest could not be proven"
            lines.append(Row("", "  ", words(number)))
        return lines

    def symmetry_row(self, symmetry: Symmetry) -> Row:
        shown = self.pieces(symmetry.expression)
        moved = zip(self.analysis.equations.coordinates, symmetry.field, strict=True)
        names = [self.printer.symbol(c.name) for c, x in moved if x != 0]
        aside = symmetry.kind or f"displacement of {', '.join(names)}"
        return formula(f"  {self.printer.symbol(symmetry.name)}", " = ", shown, aside=aside)

    def conserved_row(self, quantity: Conserved) -> Row:
        labels, equations = quantity_labels(self.analysis.equations), self.analysis.equations
        reason = escape_controls(quantity.reason)
        if quantity.kind != "momentum" and energy_is_sum(equations, quantity):
            return Row(
                f"  {labels['E']}", f" = {labels['T']} + {labels['V']}", (), "name", 0, reason
            )
        parts = quantity.parts or (quantity.expression,)
        is_momentum = quantity.kind == "momentum"
        name = (
            self.printer.symbol(quantity.name) if is_momentum else labels[energy_letter(quantity)]
        )
        shown = self.printer.pieces(display_sum(parts, self.words))
        return formula(f"  {name}", " = ", shown, aside=reason)

    def left_out(self) -> list[Row | Block]:
        reasons: dict[str, list[str]] = {}
        for left in self.analysis.left_out:
            reasons.setdefault(left.reason, []).append(left.part)
        if not reasons:
            return []
        rows = [
            Row(f"  {', '.join(parts)}", ": ", words(escape_controls(reason)), "name")
            for reason, parts in reasons.items()
        ]
        return [Row("Left out", role="heading"), *rows]

    def pieces(self, expression: Expr) -> list[Piece]:
        return self.printer.pieces(display(expression, self.words))


def _count(equilibria: Equilibria) -> str:
    """Say how many there are, or how many were found."""
    number = len(equilibria.points)
    if equilibria.complete:
        return "none: the forces cannot balance" if not number else "these are all"
    if equilibria.starts:
        return f"{number} found, by a search from {equilibria.starts} starts; there may be others"
    return f"{number} found; there may be others"


def _why(point: Equilibrium) -> str:
    told = "" if point.stability is None else point.stability.reason
    return told if point.isolated else "one of a continuum"


def _damping_line(linear: Linearization) -> str:
    parts = [linear.dissipative.any(), linear.gyroscopic.any()]
    return {
        (True, False): "C is symmetric: damping",
        (False, True): "C is antisymmetric: gyroscopic",
        (True, True): "C has a symmetric part, damping, and an antisymmetric one, gyroscopic",
    }[bool(parts[0]), bool(parts[1])]


def _spaced(pieces: Sequence[Piece], *, first: bool) -> list[Piece]:
    """Put a blank before pieces at which a line may be broken, unless they come first."""
    head, *others = pieces
    if first:
        return list(pieces)
    return [Piece(head.text, head.width + 1, " ", "", 0), *others]


def _number_rows(name: str, numbers: Matrix) -> Iterator[Row]:
    cells = [[f"{x:.6g}" for x in row] for row in (numbers + 0.0).tolist()]
    widths = [max(len(row[k]) for row in cells) for k in range(len(cells[0]))]
    for i, row in enumerate(cells):
        shown = "  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True))
        label = f"  {name} = " if i == 0 else " " * (len(name) + 5)
        yield Row(label.rstrip(), " " * (len(label) - len(label.rstrip())) + shown, (), "name")


def _complex(value: complex) -> str:
    if not value.imag:
        return f"{value.real:.6g}"
    sign = "+" if value.imag > 0 else "-"
    real = f"{value.real:.6g} " if value.real else ""
    return f"{real}{sign} {abs(value.imag):.6g}i" if real else f"{value.imag:.6g}i"
