"""Blocks and formulas whose form depends on the room of a line: the first form that fits.

Matrices stand as such or entry by entry, configurations within a sentence or as displays.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from lagrange_cli.notation.ordering import number_of, spelled_symbol
from lagrange_cli.notation.tree import Dependence, DisplayNode, DisplayRoot
from lagrange_cli.report import tree
from lagrange_cli.report.inlines import (
    Inline,
    Lettering,
    Listed,
    Text,
    bold,
    entry,
    label_node,
    numeral,
    opened,
    say,
)

#: Part of a line that a side of a formula fills at most where it can be written otherwise.
_WIDEST_SIDE = 0.6

#: Parts of a line that each formula of a configuration, and all of them, fill at most to stand in
#: a sentence.
_SHORT, _SHORT_TOGETHER = 0.5, 0.9

#: Columns of half an em that the parentheses of a matrix take, and the gap between two columns.
_FENCES, _GAP = 4, 2

#: The part of a line that a matrix fills at most beside its label and number.
_FILLED = 0.8

#: Entries that are not zero, up to which a matrix too wide for a line is written entry by entry.
MOST_ENTRIES = 24


@dataclass(frozen=True)
class Fitting:
    """Chooses the forms of blocks.

    Attributes
    ----------
    lettering
        Letters and language.
    columns
        Width of a line, in columns of half an em.
    """

    lettering: Lettering
    columns: float

    def blocks(self, blocks: Iterable[tree.Block]) -> Iterator[tree.PlainBlock]:
        """Return blocks in the forms that fit a line."""
        for block in blocks:
            match block:
                case tree.Statements(rows):
                    yield tree.Bullets(tuple(row.item for row in rows))
                case tree.Packed(heading, items, rows):
                    yield tree.Paragraph(say("{text}.", text=term(heading, Listed(items))))
                    yield tree.formulas(rows)
                case tree.Passage():
                    yield from self._passage(block)
                case tree.Cases(cases):
                    yield from self._cases(cases)
                case tree.Matrices(matrices):
                    yield from self._matrices(matrices)
                case _:
                    yield block

    def each(self, rows: Iterable[tree.Formula]) -> Iterator[tree.Formula]:
        """Return formulas, and others in place of those of which a side is too long."""
        for row in rows:
            yield from row.otherwise if row.otherwise and self._is_long(row) else (row,)

    def _is_long(self, row: tree.Formula) -> bool:
        """Say whether a side of a formula, or what a root is of, takes most of a line."""
        sides = (n.radicand if isinstance(n, DisplayRoot) else n for n in row.chain)
        return max(map(self._room, sides), default=0) > _WIDEST_SIDE * self.columns

    def _room(self, node: DisplayNode) -> float:
        """Return columns of half an em that an expression takes."""
        return self.lettering.letters.room(self.lettering.node(node))

    def _formula(self, node: DisplayNode) -> str:
        return self.lettering.letters.formula(self.lettering.node(node))

    # -- configurations ---------------------------------------------------------------

    def _is_short(self, place: Sequence[tree.Formula]) -> bool:
        """Say whether formulas stand in a sentence; vectors are displayed."""
        widths = [3 + sum(self._room(n) + 3 for n in row.chain) for row in place]
        return (
            max(widths, default=0) <= _SHORT * self.columns
            and sum(widths) <= _SHORT_TOGETHER * self.columns
            and not any(row.components for row in place)
        )

    def _inline(self, place: Sequence[tree.Formula]) -> str:
        text, inline = self.lettering.text, self.lettering.letters.inline
        sides = (
            filter(None, [text(row.label), text(row.middle), *map(self._formula, row.chain)])
            for row in place
        )
        return ", ".join(inline(" = ".join(parts)) for parts in sides)

    def _passage(self, passage: tree.Passage) -> Iterator[tree.PlainBlock]:
        place = passage.place
        if self._is_short(place):
            texts = passage.before, self._inline(place), passage.after
            yield tree.Paragraph(" ".join(map(self.lettering.text, texts)))
        else:
            yield from (
                tree.Paragraph(passage.before),
                tree.formulas(place),
                tree.Paragraph(passage.after),
            )

    def _cases(self, cases: Sequence[tree.Case]) -> Iterator[tree.PlainBlock]:
        if all(self._is_short(case.place) for case in cases):
            yield tree.Bullets(tuple(map(self._sentence, cases)))
            return
        for case in cases:
            about = judgement(case)
            if about:
                yield tree.Title(say("{text}:", text=opened(about)))
            yield tree.formulas(case.place)
            if case.condition:
                yield tree.Paragraph(say("where {conditions}", conditions=case.condition))

    def _sentence(self, case: tree.Case) -> Text:
        """``θ = 0: stable (K is positive definite: the energy has a minimum)``."""
        place: Text = self._inline(case.place)
        if case.condition:
            place = say("{place} where {conditions}", place=place, conditions=case.condition)
        about = judgement(case)
        return term(place, about) if about else place

    # -- matrices ---------------------------------------------------------------------

    def _matrices(self, matrices: Sequence[tree.Matrix]) -> Iterator[tree.PlainBlock]:
        written = [self._matrix(matrix) for matrix in matrices]
        if any(written):
            yield tree.formulas((row for rows in written for row in rows), result=True)
        remarks = [too_large(m) for m, rows in zip(matrices, written, strict=True) if not rows]
        if remarks:
            yield tree.Paragraph(" ".join(map(self.lettering.text, remarks)))

    def _matrix(self, matrix: tree.Matrix) -> list[tree.Formula]:
        """Return a matrix in closed form and in numbers; nothing if it is too large."""
        label = bold(matrix.letter)
        fitting = [cells for cells in (matrix.closed, matrix.values) if cells]
        if not fitting:
            return [tree.Formula(label, (), middle=bold("0"))]
        if len(matrix.values) == len(matrix.values[0]) == 1:
            return [tree.Formula(label, tuple(cells[0][0] for cells in fitting))]
        widths, room = list(map(self._width, fitting)), _FILLED * self.columns
        if sum(widths) <= room:
            return [tree.Formula(label, (), middle=" = ".join(map(self._text, fitting)))]
        if max(widths) <= room:
            # One below the other: their widths are over-estimated as those of symbols.
            sides = [spelled_symbol(self._text(c), Dependence.NUMBER, 0) for c in fitting]
            return [tree.Formula(label, tuple(sides))]
        entries = self.entries(matrix)
        return entries if len(entries) <= MOST_ENTRIES else []

    def _width(self, rows: tree.Cells) -> float:
        """Return columns of half an em that a matrix takes."""
        widest = (max(map(self._room, column)) for column in zip(*rows, strict=True))
        return _FENCES + sum(width + _GAP for width in widest)

    def _text(self, rows: tree.Cells) -> str:
        return self.lettering.letters.matrix([list(map(self._formula, row)) for row in rows])

    def entries(self, matrix: tree.Matrix) -> list[tree.Formula]:
        """Return the entries that are not 0, in closed form and in numbers if these differ."""
        label, shown = bold(matrix.letter), matrix.closed or matrix.values
        places = product(range(len(shown)), range(len(shown[0])))
        rows = []
        for i, j in places:
            nodes: tuple[DisplayNode, ...] = (shown[i][j], matrix.values[i][j])
            if not _is_zero(nodes[0]):
                nodes = nodes[: len(set(map(self._formula, nodes)))]
                rows.append(tree.Formula(entry(label, i + 1, j + 1), nodes))
        return rows


def _is_zero(node: DisplayNode) -> bool:
    return node in (number_of(0), label_node(numeral(0)))


def term(name: Text, text: Text) -> Text:
    """``name: text``."""
    return say("{name}: {value}", name=name, value=text)


def judgement(case: tree.Case) -> Text:
    """Return a verdict with its reason, as far as they are known."""
    if case.verdict and case.reason:
        return say("{verdict} ({reason})", verdict=case.verdict, reason=case.reason)
    return case.verdict or case.reason


def too_large(matrix: tree.Matrix) -> Text:
    """Say that a matrix is too large for the report."""
    return say(
        "{matrix} has {rows} rows and {columns} columns; JSON holds it.",
        matrix=Inline(bold(matrix.letter)),
        rows=len(matrix.values),
        columns=len(matrix.values[0]),
    )
