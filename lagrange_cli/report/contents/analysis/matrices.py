"""Matrices of a linear system as rows of a display: as they are, or their entries one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.notation.ordering import spelled_symbol
from lagrange_cli.notation.tree import Dependence, DisplayNode
from lagrange_cli.report.tree import Formula

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from sympy import Expr

    from lagrange_cli.report.contents.derivation.writer import DocumentWriter

    Numbers: TypeAlias = NDArray[np.float64] | NDArray[np.complex128]

Cells: TypeAlias = Sequence[Sequence[DisplayNode]]

#: Columns of half an em that the parentheses of a matrix take, and the gap between two columns.
_FENCES, _GAP = 4, 2

#: The part of a line that a matrix fills at most beside its label and number.
_FILLED = 0.8

#: Entries that are not zero, up to which a matrix too wide for a line is written entry by entry.
_MOST_ENTRIES = 24


@dataclass
class Matrices:
    """Writes the matrices of one section, and takes note of those that are too large for it.

    Attributes
    ----------
    writer
        Equations, letters and language.
    columns
        Width of a line in columns of half an em.
    too_large
        Letters of the matrices that are left to JSON, with their sizes.
    """

    writer: DocumentWriter
    columns: float
    too_large: list[tuple[str, int, int]] = field(default_factory=list)

    def rows(
        self, letter: str, numbers: Numbers, exact: Sequence[Sequence[Expr]] | None
    ) -> list[Formula]:
        """Write a matrix in closed form, where it is known, and in numbers.

        Parameters
        ----------
        letter
            Its letter, which is written in bold.
        numbers
            The matrix in doubles.
        exact
            The same in closed form, or None.
        """
        label = self.writer.letters.bold(letter)
        if not numbers.size or not numbers.any():
            return [Formula(label, (), middle=self.writer.letters.bold("0"))]
        values = [[self.number(x) for x in row] for row in numbers.tolist()]
        closed = None if exact is None else [[self.writer.tree(e) for e in r] for r in exact]
        if closed is not None and all(e.is_Rational for row in exact or () for e in row):
            values, closed = closed, None
        fitting = [rows for rows in (closed, values) if rows is not None]
        if numbers.size == 1:
            return [Formula(label, tuple(rows[0][0] for rows in fitting))]
        widths = [self._width(rows) for rows in fitting]
        if sum(widths) <= self._room:
            both = " = ".join(map(self._text, fitting))
            return [Formula(label, (), middle=both)]
        if max(widths) <= self._room:
            # One below the other: their widths are over-estimated as those of symbols.
            sides = [spelled_symbol(self._text(rows), Dependence.NUMBER, 0) for rows in fitting]
            return [Formula(label, tuple(sides))]
        return self._entries(letter, closed, values)

    @property
    def _room(self) -> float:
        return _FILLED * self.columns

    def _width(self, rows: Cells) -> float:
        """Return columns of half an em that a matrix takes."""
        room = self.writer.letters.room
        widest = (max(map(room, column)) for column in zip(*rows, strict=True))
        return _FENCES + sum(width + _GAP for width in widest)

    def _text(self, rows: Cells) -> str:
        letters = self.writer.letters
        return letters.matrix([[letters.formula(cell) for cell in row] for row in rows])

    def _entries(self, letter: str, closed: Cells | None, values: Cells) -> list[Formula]:
        """Return the entries that are not zero, or nothing where they are too many."""
        letters = self.writer.letters
        label = letters.bold(letter)
        listed = [
            (i, j)
            for i, row in enumerate(closed or values)
            for j, cell in enumerate(row)
            if letters.formula(cell) != "0"
        ]
        if len(listed) > _MOST_ENTRIES:
            self.too_large.append((letters.inline(label), len(values), len(values[0])))
            return []
        return [
            Formula(
                letters.below(label, f"{i + 1},{j + 1}"), self._sides(closed, values[i][j], i, j)
            )
            for i, j in listed
        ]

    def _sides(
        self, closed: Cells | None, value: DisplayNode, i: int, j: int
    ) -> tuple[DisplayNode, ...]:
        """Return an entry in closed form and in numbers, once if they read the same."""
        if closed is None:
            return (value,)
        formula = self.writer.letters.formula
        same = formula(closed[i][j]) == formula(value)
        return (value,) if same else (closed[i][j], value)

    def remark(self) -> str:
        """Say which matrices are too large for the document; empty if none is."""
        say = self.writer.say
        return " ".join(
            say(
                "{matrix} has {rows} rows and {columns} columns; JSON holds it.",
                matrix=label,
                rows=rows,
                columns=columns,
            )
            for label, rows, columns in self.too_large
        )

    # -- numbers ----------------------------------------------------------------------

    def number(self, value: complex) -> DisplayNode:
        """Return a number in six digits, as a symbol in the letters of the format."""
        shown = self._real(value.real) if not value.imag else self._complex(complex(value))
        return spelled_symbol(shown, Dependence.NUMBER, 0)

    def _real(self, value: float) -> str:
        text = f"{value + 0.0:.6g}"
        return self.writer.letters.value(value, text)

    def _complex(self, value: complex) -> str:
        letters = self.writer.letters
        turned = letters.times(self._real(abs(value.imag)), letters.imaginary)
        sign = "-" if value.imag < 0 else "+" if value.real else ""
        real = f"{self._real(value.real)} " if value.real else ""
        return f"{real}{sign} {turned}".strip() if real else f"{sign}{turned}"
