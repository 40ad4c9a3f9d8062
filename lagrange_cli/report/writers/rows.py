"""Formulas of a display as rows of pieces, which a format breaks into lines."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from lagrange_cli.notation.layout import Piece, prefixed, suffixed, width
from lagrange_cli.notation.printers.typeset import TypesetPrinter
from lagrange_cli.report.inlines import Lettering, Text
from lagrange_cli.report.tree import Formula, Formulas, PlainBlock, Section
from lagrange_cli.report.writers.fitting import Fitting

#: Columns of half an em that a number takes beside a display, and that labels have at the least.
_NUMBER, _LABEL = 5, 3

#: The part of a line that formulas fill by estimated widths, which are not exact.
FILLED = 0.94

#: The part of a line that a label takes at the most beside its formula.
WIDEST_LABEL = 0.35


@dataclass(frozen=True)
class FormulaRow:
    """A formula: its label before the alignment, and the pieces after it.

    ``ends``: false if the next row continues it, which then has the number.
    """

    label: str
    pieces: Sequence[Piece]
    ends: bool = True


@dataclass(frozen=True)
class RowSetter(ABC):
    """Makes rows of formulas.

    ``colon`` stands after a name; ``at_least``, ``at_most`` and ``complementary`` are ≥, ≤ and ⊥;
    ``wide`` is a wide space.

    Attributes
    ----------
    lettering
        Letters and language.
    columns
        Width of a line, in columns of half an em.
    """

    lettering: Lettering
    columns: float = 83

    colon = ""
    wide = " "
    at_least = ">="
    at_most = "<="
    complementary = ""

    def text(self, text: Text) -> str:
        """Return words or a formula as a text."""
        return self.lettering.text(text)

    def alone(self, label: str) -> str | None:
        """A label that has a line for itself and no width; None if the format has none such."""
        return None

    @property
    @abstractmethod
    def printer(self) -> TypesetPrinter:
        """Return the printer of display trees."""

    @abstractmethod
    def room(self, formula: str) -> float:
        """Columns of half an em that a general formula takes, near enough to break lines by."""

    def rows(self, block: Formulas) -> list[FormulaRow]:
        """Return rows of a display, one or more for each formula."""
        chosen = self._fitting.each(block.rows)
        return [part for row in chosen for part in self._ranged(row, self._rows(row))]

    def fitted(self, section: Section) -> Iterator[PlainBlock]:
        """Return the blocks of a section as they fit a line."""
        return self._fitting.blocks(section.blocks)

    @property
    def _fitting(self) -> Fitting:
        return Fitting(self.lettering, self.columns)

    def _ranged(self, formula: Formula, rows: list[FormulaRow]) -> list[FormulaRow]:
        """Return the rows of a formula with the values of its indices behind the last one."""
        spans = self.text(formula.ranges)
        if not spans:
            return rows
        last = rows[-1]
        ranges = Piece(spans, 1.4 * self.room(spans) + 4, self.wide, "", 0)
        return [*rows[:-1], replace(last, pieces=[*suffixed(last.pieces, ",", 0.5), ranges])]

    def available(self, labels: Iterable[str]) -> float:
        """Return columns beside the widest label and the number."""
        widest = max((self.room(label) for label in labels), default=0)
        return FILLED * self.columns - max(_LABEL, widest) - _NUMBER

    def _rows(self, row: Formula) -> list[FormulaRow]:
        """A formula on a line, or each of its sides on one where they are too long together."""
        bodies = [self.printer.pieces(self.lettering.node(node)) for node in row.chain]
        label, name, middle = map(self.text, (row.label, row.name, row.middle))
        label = f"{name}{self.colon} {label}".rstrip() if name else label
        if row.multiplier:
            gap = suffixed(bodies[0], f" {self.at_least} 0", 4)
            push = f"0 {self.at_most} {self.text(row.multiplier)} {self.complementary} "
            return [FormulaRow(label, prefixed(gap, push, 12))]
        if not self.text(row.label):
            return [FormulaRow(label, _equated(bodies))]
        before = [[Piece(middle, self.room(middle))]] if middle else []
        before += [self._vector(list(map(self.text, row.components)))] if row.components else []
        sides = [prefixed(side, "= ", 3) for side in (*before, *bodies)] or [[Piece("", 0)]]
        whole = [piece for side in sides for piece in (replace(side[0], separator=" "), *side[1:])]
        if self.room(label) > WIDEST_LABEL * self.columns and (apart := self.alone(label)):
            sides = [[Piece("", 0)], *sides]
            label = apart
        elif width(whole) <= self.available([label]):
            return [FormulaRow(label, [replace(whole[0], separator=""), *whole[1:]])]
        labels = [label, *("" for _ in sides[1:])]
        last = len(sides) - 1
        return [
            FormulaRow(shown, side, ends=number == last)
            for number, (shown, side) in enumerate(zip(labels, sides, strict=True))
        ]

    def _vector(self, components: Sequence[str]) -> list[Piece]:
        """Return components in parentheses; a line may end after each comma."""
        texts = [f"{component}," for component in components]
        texts[0] = f"({texts[0]}"
        texts[-1] = f"{texts[-1][:-1]})"
        first, *others = (Piece(text, self.room(text) + 1, "", "", 0) for text in texts)
        return [replace(first, depth=None), *(replace(piece, separator=" ") for piece in others)]


def _equated(bodies: Sequence[list[Piece]]) -> list[Piece]:
    """``left = 0``, or ``left = right``."""
    if len(bodies) == 1:
        return suffixed(bodies[0], " = 0", 3)
    left, right = bodies
    equal = Piece(right[0].text, right[0].width + 3, " = ", "= ", 0)
    return [*left, equal, *right[1:]]
