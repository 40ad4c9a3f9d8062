"""Configurations within sentences and as displays: ``θ = acos(g / (R ω²)) = 1.03``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.report.contents.analysis.matrices import Matrices
from lagrange_cli.report.contents.analysis.wording import has_one_number, turning_values
from lagrange_cli.report.tree import Formula

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.values import Equilibrium, Existence
    from lagrange_cli.mechanics.system import Coordinate
    from lagrange_cli.report.contents.derivation.writer import DocumentWriter

#: Parts of a line that each formula of a configuration, and all of them, fill at most to stand in
#: a sentence.
_SHORT, _SHORT_TOGETHER = 0.5, 0.9


@dataclass(frozen=True)
class Places:
    """Writes configurations.

    Attributes
    ----------
    writer
        Equations, letters and language.
    columns
        Width of a line in columns of half an em.
    coordinates
        Those that rest.
    steady
        The reduced system of steady motions; None at equilibria.
    """

    writer: DocumentWriter
    columns: float
    coordinates: Sequence[Coordinate]
    steady: SteadyForm | None = None

    def place(
        self,
        exact: Sequence[Expr] | None,
        position: Sequence[object] | None,
        free: Sequence[str],
    ) -> list[Formula]:
        """``θ = acos(g / (R ω²)) = 1.03``, a row for each coordinate."""
        writer, rows = self.writer, []
        for k, c in enumerate(self.coordinates):
            label = writer.lettered_coordinate(c)
            if c.name in free:
                rows.append(Formula(label, (), middle=writer.letters.upright(writer.say("any"))))
                continue
            closed = None if exact is None else exact[k]
            chain = () if closed is None else (writer.tree(closed),)
            if position is not None and has_one_number(closed, free):
                chain = (*chain, Matrices(writer, self.columns).number(float(str(position[k]))))
            rows.append(Formula(label, chain))
        return rows

    def point(self, point: Equilibrium) -> list[Formula]:
        """Return a row for each coordinate that rests, and for each that turns."""
        rows = self.place(point.exact, point.position, point.free)
        if self.steady is None or point.turning is None:
            return rows
        return [*rows, *(self._turned(*one) for one in turning_values(self.steady, point.turning))]

    def _turned(self, symbol: Symbol, exact: Expr | None, number: float | None) -> Formula:
        """Return the rate of a coordinate, or its momentum."""
        chain = () if exact is None else (self.writer.tree(exact),)
        if number is not None and (exact is None or not exact.is_Rational):
            chain = (*chain, Matrices(self.writer, self.columns).number(number))
        return Formula(self.letter(symbol), chain)

    def letter(self, symbol: Symbol) -> str:
        """Return the symbol of a momentum or rate in the letters of the format."""
        return self.writer.letters.formula(self.writer.tree(symbol))

    def is_short(self, place: Sequence[Formula]) -> bool:
        room = self.writer.letters.room
        widths = [3 + sum(room(n) + 3 for n in row.chain) for row in place]
        return (
            max(widths, default=0) <= _SHORT * self.columns
            and sum(widths) <= _SHORT_TOGETHER * self.columns
        )

    def inline(self, place: Sequence[Formula], conditions: Sequence[Existence]) -> str:
        letters, shown_text = self.writer.letters, self.writer.lettering.text
        shown = ", ".join(
            letters.inline(
                " = ".join(
                    filter(None, [*map(shown_text, (row.label, row.middle)), *self._printed(row)])
                )
            )
            for row in place
        )
        where = self.conditions(conditions)
        if not where:
            return shown
        return self.writer.say("{place} where {conditions}", place=shown, conditions=where)

    def _printed(self, row: Formula) -> list[str]:
        return list(map(self.writer.letters.formula, row.chain))

    def conditions(self, conditions: Sequence[Existence]) -> str:
        writer, letters = self.writer, self.writer.letters
        listed = []
        for c in conditions:
            sides = [letters.formula(writer.tree(e)) for e in (c.smaller, c.larger)]
            sign = letters.at_most_sign if c.relation == "<=" else c.relation
            listed.append(f"{sides[0]} {sign} {sides[1]}")
        return writer.lettered_list(listed)

    def number(self, value: float) -> str:
        return self.literal(f"{value:.6g}")

    def literal(self, text: str) -> str:
        return self.writer.letters.value(float(text), text)
