"""Formulas of equations in LaTeX: rows of ``align`` environments, broken into lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import (
    is_generalized_potential,
    quantity_labels,
    without_line,
)
from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.notation.build import display, display_row, display_sum
from lagrange_cli.notation.latex import LatexPrinter
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.layout import Piece, added, break_lines, joined, prefixed, suffixed
from lagrange_cli.notation.one_line import solid
from lagrange_cli.notation.symbols import latex_name
from lagrange_cli.notation.tree import DisplayNode, abbreviations_in
from lagrange_cli.notation.vocabulary import Vocabulary, unabbreviated, vocabulary

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import Coordinate, Equations

#: Columns of half an em that a line of the document holds beside its label and number.
LINE = 70


@dataclass(frozen=True)
class FormulaRow:
    """A numbered formula: its label before the alignment, and the pieces after it.

    ``ends``: false if the next row continues it, which then has the number.
    """

    label: str
    pieces: Sequence[Piece]
    ends: bool = True


@dataclass(frozen=True)
class Typesetter:
    """Writes formulas of some equations in LaTeX.

    Attributes
    ----------
    equations
        The equations.
    words
        Display names of their symbols.
    printer
        Prints display trees.
    abbreviated
        Names of the scene's abbreviations that what was set so far holds.
    """

    equations: Equations
    words: Vocabulary
    printer: LatexPrinter
    abbreviated: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, equations: Equations, *, abbreviating: bool = True) -> Typesetter:
        """The typesetter; steps of a derivation are written without abbreviations."""
        words = vocabulary(equations, abbreviating=abbreviating and equations.steps is None)
        return cls(equations, words, LatexPrinter())

    # -- parts --------------------------------------------------------------------

    def coordinate(self, coordinate: Coordinate, order: int = 0) -> str:
        return latex_name(coordinate.name, order, coordinate.latex)

    def inline(self, expression: Expr) -> str:
        return joined(self.pieces(expression))

    def pieces(self, expression: Expr) -> list[Piece]:
        return self.tree(display(expression, self.words))

    def tree(self, node: DisplayNode) -> list[Piece]:
        """The pieces of a tree, whose abbreviations are noted."""
        self._note(node)
        return self.printer.pieces(node)

    def _note(self, node: DisplayNode) -> None:
        if self.words.named:
            self.abbreviated.update(abbreviations_in(node))

    def row(self, index: int) -> list[Piece]:
        """Equation of motion ``index``: its left side and ``= 0``."""
        shown = self.equations.shown[index]
        if shown.momentum is None:
            return suffixed(self.tree(display_row(shown, self.words)), " = 0", 3)
        momentum = display(shown.momentum, self.words)
        self._note(momentum)
        return suffixed(self.printer.rate(momentum), " = 0", 3)

    def definition(self, label: str, expression: Expr) -> FormulaRow:
        """``label = expression``, aligned at the equality sign."""
        return FormulaRow(label, prefixed(self.pieces(expression), "= ", 3))

    def total(self, label: str, parts: Sequence[Expr]) -> FormulaRow:
        """``label = Σ parts``, the parts in their order."""
        tree = display_sum(parts, self.words)
        return FormulaRow(label, prefixed(self.tree(tree), "= ", 3))

    # -- groups of formulas ---------------------------------------------------------

    def energies(self) -> list[FormulaRow]:
        """T, V, the dissipation where there is one, and L."""
        labels = quantity_labels(self.equations)
        kinetic, lagrangian = latex_name(labels["T"]), latex_name(labels["L"])
        potential = latex_name(labels["U" if is_generalized_potential(self.equations) else "V"])
        rows = [
            self.definition(kinetic, self.equations.kinetic),
            self.definition(potential, self.equations.potential),
            self._lagrangian(lagrangian, f"{kinetic} - {potential}"),
        ]
        if self.equations.dissipation != 0:
            rows.append(self.definition(latex_name(labels["D"]), self.equations.dissipation))
        return rows

    def _lagrangian(self, label: str, difference: str) -> FormulaRow:
        """L written out where it is short, else as the difference, less what is left out of it."""
        head, short = Piece(f"= {difference}", 8), self.equations.short_lagrangian
        whole = self.pieces(self.equations.lagrangian if short is None else short.expression)
        is_long = sum(p.width for p in whole) > 3 * LINE
        if short is not None:
            less = [head, *added(self.pieces(-short.left_out))]
            return FormulaRow(label, less if is_long else prefixed(whole, "= ", 3))
        if is_long:
            return FormulaRow(label, [head])
        body = prefixed(whole, "= ", 3)
        first = Piece(body[0].text, body[0].width, " ", "", 0)
        return FormulaRow(label, [head, first, *body[1:]])

    def without(self) -> str:
        """Say what is left out of L; empty if nothing is."""
        label = latex_name(quantity_labels(self.equations)["L"])
        told = without_line(self.equations, "$t$")
        return f"Here ${label}$ is {told}." if told else ""

    def motion(self, form: str) -> list[FormulaRow]:
        """Lagrange's equations, or accelerations and multipliers, with M and f where they stay
        coupled."""
        coordinates = self.equations.coordinates
        if form != "explicit":
            return [
                FormulaRow(rf"{self.coordinate(c)}\colon\quad", self.row(i))
                for i, c in enumerate(coordinates)
            ]
        explicit = explicit_form(self.equations)
        labels = [
            *(self.coordinate(c, 2) for c in coordinates),
            *(self.inline(closure.multiplier) for closure in self.equations.closures),
        ]
        values = (*explicit.accelerations, *explicit.multipliers)
        rows = [
            self.definition(label, value)
            for label, value in zip(labels, values, strict=True)
            if value is not None
        ]
        return [*rows, *self._coupled(explicit.coupled), *self._differentiated(explicit)]

    def _differentiated(self, explicit: ExplicitForm) -> Iterator[FormulaRow]:
        """The closures beside accelerations that are not solved for, differentiated."""
        for closure, value in zip(self.equations.closures, explicit.multipliers, strict=True):
            if value is None:
                left = display_row(differentiated(self.equations, closure), self.words)
                yield FormulaRow("", suffixed(self.tree(left), " = 0", 3))

    def closures(self) -> list[FormulaRow]:
        """The closure equations, each with its name."""
        return [
            FormulaRow(
                rf"\text{{{latex_text(c.name)}}}\colon\quad",
                suffixed(self.pieces(c.expression), " = 0", 3),
            )
            for c in self.equations.closures
        ]

    def abbreviations(self) -> list[FormulaRow]:
        """What the abbreviations stand for that were set, those of these among them."""
        rows: list[FormulaRow] = []
        for name, expression in reversed(self.equations.abbreviations):
            if name in self.abbreviated:
                setter = replace(self, words=unabbreviated(name, self.words))
                rows.insert(0, setter.definition(latex_name(name), expression))
        return rows

    def contacts(self) -> list[FormulaRow]:
        """Complementarity of each contact: 0 ≤ λ ⊥ φ ≥ 0."""
        rows = []
        for contact in self.equations.contacts:
            push = rf"0 \le {self.inline(contact.closure.multiplier)} \perp "
            gap = suffixed(self.pieces(contact.closure.expression), r" \ge 0", 4)
            label = rf"\text{{{latex_text(contact.name)}}}\colon\quad"
            rows.append(FormulaRow(label, prefixed(gap, push, 12)))
        return rows

    def _coupled(self, indices: Sequence[int]) -> list[FormulaRow]:
        """``Σ M a = f`` for coordinates whose accelerations are not solved for."""
        rows, forcing = [], forcing_with_reactions(self.equations)
        for i in indices:
            terms: list[Piece] = []
            for j in indices:
                entry = self.equations.mass_matrix[i][j]
                if entry != 0:
                    product = self.tree(
                        display(entry * self.equations.coordinates[j].a, self.words)
                    )
                    terms += product if not terms else added(product)
            right = self.pieces(forcing[i])
            equal = Piece(right[0].text, right[0].width + 3, " = ", "= ", 0)
            rows.append(FormulaRow("", [*(terms or solid("0")), equal, *right[1:]]))
        return rows

    # -- layout ---------------------------------------------------------------------

    def align(self, rows: Iterable[FormulaRow], *, numbered: bool = True) -> list[str]:
        """Lines of an ``align`` environment; one number for each formula, or none."""
        shown = [_lines(row, numbered) for row in rows]
        if not shown:
            return []
        name = "align" if numbered else "align*"
        return [rf"\begin{{{name}}}", " \\\\\n".join(shown), rf"\end{{{name}}}"]

    def aligned(self, rows: Iterable[FormulaRow]) -> list[str]:
        """The same as an ``aligned`` environment, which stands within a display."""
        inner = self.align(rows, numbered=False)[1:-1]
        return [r"\begin{aligned}", *inner, r"\end{aligned}"]


def _lines(row: FormulaRow, numbered: bool) -> str:
    """A formula broken into lines of an ``align``, the number at the last one."""
    first, *others = break_lines(row.pieces, LINE, LINE - 4, step=2)
    label = f"{row.label} " if row.label else ""
    lines = [f"  {label}& {first.text}"]
    lines += [rf"  &\hspace{{{1.5 + 0.8 * line.level:g}em}} {{}} {line.text}" for line in others]
    end = " \\nonumber \\\\\n" if numbered else " \\\\\n"
    return end.join(lines) + (" \\nonumber" if numbered and not row.ends else "")
