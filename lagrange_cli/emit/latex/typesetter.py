"""Sections of a document as LaTeX: sentences, tables, displays broken into lines."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from lagrange_cli.emit.steps.sections import (
    Block,
    Bullets,
    Formula,
    Formulas,
    Law,
    Picture,
    Section,
    Table,
    Title,
    Words,
)
from lagrange_cli.notation.latex import LatexPrinter
from lagrange_cli.notation.layout import Piece, break_lines, prefixed, suffixed, width

#: Columns of half an em that a number takes beside a display, and that labels have at the least.
_NUMBER, _LABEL = 5, 8

#: Lines of a formula that stay on one page.
_MOST_LINES = 6

#: Rows of a table that is kept on one page.
_LONGEST_TABLE = 24

#: What takes no room of its own in a general formula.
_NO_ROOM = re.compile(r"\\(?:mathbf|mathrm|text|dot|ddot|[dt]?frac)\b|\\,|[{}_^ ]|\\(?=[a-zA-Z])")


@dataclass(frozen=True)
class FormulaRow:
    """A formula: its label before the alignment, and the pieces after it.

    ``ends``: false if the next row continues it, which then has the number.
    """

    label: str
    pieces: Sequence[Piece]
    ends: bool = True


@dataclass(frozen=True)
class Typesetter:
    """Writes sections in LaTeX.

    Attributes
    ----------
    columns
        Width of a line, in columns of half an em.
    numbered
        True if displays have numbers.
    stem
        The beginning of all labels.
    counts
        Part of the document → how many of its formulas have a label.
    """

    columns: float = 83
    numbered: bool = True
    stem: str = ""
    counts: dict[str, int] = field(default_factory=dict)

    @property
    def printer(self) -> LatexPrinter:
        return LatexPrinter()

    def section(self, section: Section) -> list[str]:
        """The heading of a section and its blocks."""
        return [rf"\section*{{{section.heading}}}", *self.blocks(section)]

    def blocks(self, section: Section) -> list[str]:
        """The blocks of a section without its heading."""
        return [line for block in section.blocks for line in self._block(block, section.name)]

    def _block(self, block: Block, part: str) -> list[str]:
        match block:
            case Words(text):
                return [text]
            case Title(text):
                return ["", text]
            case Law(text, ends):
                return [rf"\[ {'' if ends else _UNBROKEN}{text} \]"]
            case Formulas(_, result):
                return self.display(self.rows(block), part, numbered=result and self.numbered)
            case Table():
                return _table(block)
            case Bullets(items):
                return [_BULLETS, *(rf"  \item {item}" for item in items), r"\end{itemize}"]
            case Picture():
                return []

    # -- rows -----------------------------------------------------------------------

    def rows(self, block: Formulas) -> list[FormulaRow]:
        """Rows of a display, one or more for each formula."""
        return [part for row in block.rows for part in self._rows(row)]

    def _rows(self, row: Formula) -> list[FormulaRow]:
        """A formula on a line, or each of its sides on one where they are too long together."""
        bodies = [self.printer.pieces(node) for node in row.chain]
        label = rf"{row.name}\colon\quad {row.label}".rstrip() if row.name else row.label
        if row.multiplier:
            gap = suffixed(bodies[0], r" \ge 0", 4)
            return [FormulaRow(label, prefixed(gap, rf"0 \le {row.multiplier} \perp ", 12))]
        if row.is_rate:
            return [FormulaRow(label, suffixed(self.printer.rate(row.chain[0]), " = 0", 3))]
        if not row.label:
            return [FormulaRow(label, _equated(bodies))]
        middle = [[Piece(row.middle, room(row.middle))]] if row.middle else []
        sides = [prefixed(side, "= ", 3) for side in (*middle, *bodies)] or [[Piece("", 0)]]
        whole = [piece for side in sides for piece in (replace(side[0], separator=" "), *side[1:])]
        if width(whole) <= self._available([label], numbered=True):
            return [FormulaRow(label, [replace(whole[0], separator=""), *whole[1:]])]
        labels = [label, *("" for _ in sides[1:])]
        last = len(sides) - 1
        return [
            FormulaRow(shown, side, ends=number == last)
            for number, (shown, side) in enumerate(zip(labels, sides, strict=True))
        ]

    def _available(self, labels: Iterable[str], *, numbered: bool) -> float:
        """Columns beside the widest label and the number."""
        widest = max((room(label) for label in labels), default=0)
        return self.columns - max(_LABEL, widest) - _NUMBER

    # -- displays -------------------------------------------------------------------

    def display(self, rows: Sequence[FormulaRow], part: str, *, numbered: bool) -> list[str]:
        """Formulas as a display, with a number and a label each, or none."""
        available = self._available([row.label for row in rows], numbered=numbered)
        written = [_lines(row, available) for row in rows]
        if not written:
            return []
        tags = [self._label(part) if numbered and row.ends else "" for row in rows]
        star = "" if numbered else "*"
        if len(rows) == 1 and len(written[0]) <= _MOST_LINES:
            return _equation(written[0], tags[0], star)
        gathered = all(
            not row.label and len(lines) == 1 for row, lines in zip(rows, written, strict=True)
        )
        name = "gather" if gathered else "align"
        shown = [
            _numbered(lines, tag, numbered=numbered)
            for lines, tag in zip(written, tags, strict=True)
        ]
        body = " \\\\\n".join(shown)
        body = body.replace("  & ", "  ") if gathered else body
        return [rf"\begin{{{name}{star}}}", body, rf"\end{{{name}{star}}}"]

    def aligned(self, rows: Sequence[FormulaRow]) -> list[str]:
        """Formulas as an ``aligned`` environment, which stands within a display."""
        available = self._available([row.label for row in rows], numbered=False)
        shown = [line for row in rows for line in _lines(row, available)]
        return [r"\begin{aligned}", " \\\\\n".join(shown), r"\end{aligned}"]

    def _label(self, part: str) -> str:
        number = self.counts[part] = self.counts.get(part, 0) + 1
        return rf"\label{{eq:{self.stem}:{part}:{number}}}"


#: Within a display that a sentence goes on after: no page ends there.
_UNBROKEN = r"\postdisplaypenalty=10000 "

_BULLETS = r"\begin{itemize}\setlength{\itemsep}{0pt}\setlength{\parskip}{0pt}"


def room(formula: str) -> float:
    """Columns of half an em that a general formula takes, near enough to break lines by."""
    return len(re.sub(r"[a-z]{2,}", "x", _NO_ROOM.sub("", formula)))


def _equated(bodies: Sequence[list[Piece]]) -> list[Piece]:
    """``left = 0``, or ``left = right``."""
    if len(bodies) == 1:
        return suffixed(bodies[0], " = 0", 3)
    left, right = bodies
    equal = Piece(right[0].text, right[0].width + 3, " = ", "= ", 0)
    return [*left, equal, *right[1:]]


def _lines(row: FormulaRow, available: float) -> list[str]:
    """The lines of a formula, aligned after its label."""
    first, *others = break_lines(row.pieces, available, available - 4, step=2)
    label = f"{row.label} " if row.label else ""
    lines = [f"  {label}& {first.text}"]
    return lines + [
        rf"  &\hspace{{{1.5 + 0.8 * line.level:g}em}} {{}} {line.text}" for line in others
    ]


def _equation(lines: Sequence[str], tag: str, star: str) -> list[str]:
    """One formula, which stays on a page."""
    body = "".join(lines).replace("& ", "", 1)
    if len(lines) > 1:
        body = "\n".join([r"\begin{split}", " \\\\\n".join(lines), r"\end{split}"])
    return [rf"\begin{{equation{star}}}{tag}", body, rf"\end{{equation{star}}}"]


def _numbered(lines: Sequence[str], tag: str, *, numbered: bool) -> str:
    """The lines of one of several formulas, of which the last has its number."""
    end = " \\nonumber \\\\\n" if numbered else " \\\\\n"
    return end.join(lines) + (f" {tag}" if tag else r" \nonumber" if numbered else "")


def _table(table: Table) -> list[str]:
    """A long one may run over pages, for which LaTeX needs a second run to align its columns."""
    columns = "".join(r"p{0.45\textwidth}" if head == table.prose else "l" for head in table.heads)
    long = len(table.rows) > _LONGEST_TABLE
    opening = r"\begin{longtable}[l]" if long else r"\begin{tabular}"
    return [
        "" if long else r"\par\medskip",
        f"{opening}{{@{{}}{columns}@{{}}}}",
        r"  \toprule",
        _cells(table.heads),
        r"  \midrule" + (r" \endhead" if long else ""),
        *map(_cells, table.rows),
        r"  \bottomrule",
        r"\end{longtable}" if long else r"\end{tabular}",
    ]


def _cells(row: Sequence[str]) -> str:
    return "  " + " & ".join(row) + r" \\"
