"""Sections of a document as LaTeX: sentences, tables, displays broken into lines."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

from lagrange_cli.notation.layout import break_lines
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.typeset import WIDEST_PART
from lagrange_cli.report import tree
from lagrange_cli.report.inlines import say
from lagrange_cli.report.writers.latex.letters import MacroPrinter, Macros
from lagrange_cli.report.writers.rows import FILLED, FormulaRow, RowSetter

#: Size of the letters → points of a column, half an em.
COLUMN_POINTS = {10: 5.0, 11: 5.475}

#: Lines of a formula that stay on one page.
_MOST_LINES = 6

#: Lines of an ``aligned`` environment.
_LONGEST_ALIGNED = 24

#: What takes no room of its own in a general formula.
_NO_ROOM = re.compile(r"\\(?:mathbf|mathrm|text|dot|ddot|[dt]?frac)\b|\\,|[{}_^ ]|\\(?=[a-zA-Z])")


@dataclass(frozen=True)
class Typesetter(RowSetter):
    """Writes sections in LaTeX.

    Attributes
    ----------
    numbered
        True if displays have numbers.
    stem
        The beginning of all labels.
    picture
        LaTeX of the sketch, empty if none is wanted.
    most_rows
        Rows of a table that is kept on one page.
    macros
        Macros of the symbols, None if letters stand for themselves.
    has_tabularx
        True if the preamble loads tabularx.
    counts
        Part of the document → how many of its formulas have a label.
    """

    numbered: bool = True
    stem: str = ""
    picture: str = ""
    most_rows: int = 24
    macros: Macros | None = None
    has_tabularx: bool = True
    counts: dict[str, int] = field(default_factory=dict)

    wide = r"\quad "
    colon = r"\colon\quad"
    at_least = r"\ge"
    at_most = r"\le"
    complementary = r"\perp"

    @cached_property
    def printer(self) -> LatexPrinter:
        # Parts that are not broken, as fractions, leave room for what stands beside them.
        widest = min(WIDEST_PART, 0.65 * self.columns - 9.5)
        return LatexPrinter(widest) if self.macros is None else MacroPrinter(self.macros, widest)

    def room(self, formula: str) -> float:
        if formula.startswith(_ALONE):
            return 0
        words = _TEXTS.findall(formula)
        return sum(map(letter_count, words)) + len(
            re.sub(r"[a-z]{2,}", "x", _NO_ROOM.sub("", _TEXTS.sub("", formula)))
        )

    def alone(self, label: str) -> str:
        return rf"{_ALONE}{{$\displaystyle {label}$}}"

    def definitions(self, body: Iterable[str]) -> str:
        """Return definitions of the macros that stand in a body, each line with its end."""
        lines = [] if self.macros is None else self.macros.definitions(self.stem, body)
        return "".join(f"{line}\n" for line in lines)

    def section(self, section: tree.Section) -> list[str]:
        """Return the heading of a section and its blocks."""
        heading = self.text(section.heading)
        return [*([rf"\section*{{{heading}}}"] if heading else []), *self.blocks(section)]

    def blocks(self, section: tree.Section) -> list[str]:
        """Return the blocks of a section without its heading."""
        lines: list[str] = []
        is_inline = False
        for block in self.fitted(section):
            # A table is as a letter in the paragraph in which it stands.
            ends = is_inline and isinstance(block, tree.Paragraph)
            lines += [*([""] if ends else []), *self._block(block, section.name)]
            is_inline = isinstance(block, tree.Table)
        return lines

    def _block(self, block: tree.PlainBlock, part: str) -> list[str]:
        match block:
            case tree.Paragraph(text):
                return [self.text(text)]
            case tree.Title(text):
                return ["", self.text(text)]
            case tree.Law(text, ends):
                return self._law(self.text(text), "" if ends else _UNBROKEN)
            case tree.Formulas(_, result):
                return self.display(self.rows(block), part, numbered=result and self.numbered)
            case tree.Table():
                return self._table(block)
            case tree.Bullets(items, counted):
                return _list(map(self.text, items), "enumerate" if counted else "itemize")
            case tree.Labelled(rows):
                terms = (
                    say("{name}: {value}", name=rf"\textbf{{{self.text(a)}}}", value=b)
                    for a, b in rows
                )
                return _list(map(self.text, terms))
            case tree.Verbatim(lines):
                shown = (line.replace(r"\end{verbatim}", r"\end {verbatim}") for line in lines)
                return [r"\begin{verbatim}", *shown, r"\end{verbatim}"]
            case tree.Picture():
                return [r"\begin{center}", self.picture, r"\end{center}"]

    # -- laws -----------------------------------------------------------------------

    def _law(self, text: str, penalty: str) -> list[str]:
        """Return a general formula on a line, or on several where it is too long for one."""
        parts = _LAW_BREAK.split(text)
        lines = [parts[0]]
        for sign, part in zip(parts[1::2], parts[2::2], strict=True):
            whole = f"{lines[-1]}{sign}{part}"
            if letter_count(whole) <= FILLED * self.columns:
                lines[-1] = whole
            elif sign.startswith(","):
                lines[-1:] = [f"{lines[-1]},", part]
            else:
                lines.append(f"{{}}{sign}{part}")
        if len(lines) == 1:
            return [rf"\[ {penalty}{text} \]"]
        return [rf"\begin{{gather*}}{penalty}", " \\\\\n".join(lines), r"\end{gather*}"]

    # -- displays -------------------------------------------------------------------

    def display(self, rows: Sequence[FormulaRow], part: str, *, numbered: bool) -> list[str]:
        """Return formulas as a display, with a number and a label each, or none."""
        available = self.available([row.label for row in rows])
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

    def lines(self, rows: Sequence[FormulaRow]) -> list[str]:
        """Return formulas below each other, broken into lines, each with its sign of alignment."""
        available = self.available([row.label for row in rows])
        return [line for row in rows for line in _lines(row, available)]

    def aligned(self, rows: Sequence[FormulaRow]) -> Iterator[list[str]]:
        """Return formulas as ``aligned`` environments, which stand within a display each.

        Long ones are several, since KaTeX expands no more than 1,000 macros in a display.
        """
        shown = self.lines(rows)
        for start in range(0, len(shown), _LONGEST_ALIGNED):
            lines = " \\\\\n".join(shown[start : start + _LONGEST_ALIGNED])
            yield [r"\begin{aligned}", lines, r"\end{aligned}"]

    # -- tables ---------------------------------------------------------------------

    def _table(self, table: tree.Table) -> list[str]:
        """Return the lines of a table; a long one is several, between which pages may end."""
        lines = [list(map(self.text, row)) for row in (table.heads, *table.rows)]
        widths = [max(map(letter_count, column)) + 3 for column in zip(*lines, strict=True)]
        fits, has_prose = sum(widths) <= self.columns, table.prose in table.heads
        prose = "l" if fits else r">{\raggedright\arraybackslash\hspace{0pt}}X"
        if has_prose and not (fits or self.has_tabularx):
            others = sum(widths) - widths[table.heads.index(table.prose)]
            prose = rf"p{{{max(0.2, 0.9 - others / self.columns):.2f}\linewidth}}"
        kinds = dict.fromkeys(table.numeric, "r") | {table.prose: prose}
        columns = "".join(kinds.get(head, "l") for head in table.heads)
        heads, *rows = lines
        parts = range(0, len(rows), self.most_rows)
        is_wide = sum(widths) > _WIDEST_SMALL * self.columns
        sides = _FITTING if fits else _SMALL[is_wide]
        if has_prose and not fits:
            sides = _WITH_PROSE if self.has_tabularx else _SMALL[False]
        shown = (_part(columns, heads, rows[k : k + self.most_rows], sides) for k in parts)
        return [line for part in shown for line in part]

    def _label(self, part: str) -> str:
        number = self.counts[part] = self.counts.get(part, 0) + 1
        return rf"\label{{eq:{self.stem}:{part}:{number}}}"


_Sides: TypeAlias = tuple[str, str, str, str]
"""Lines before and after a table, the name of its environment, and the environment's width."""

#: Of a table that fits a line; of others with a column of sentences, and of those without one,
#: which are set in small and smaller print.
_FITTING: _Sides = ("", "", "tabular", "")
_WITH_PROSE: _Sides = (r"{\setlength{\tabcolsep}{3pt}", "}", "tabularx", r"{\linewidth}")
_SMALL: tuple[_Sides, _Sides] = (
    (r"{\footnotesize\setlength{\tabcolsep}{3pt}", "}", "tabular", ""),
    (r"{\scriptsize\setlength{\tabcolsep}{3pt}", "}", "tabular", ""),
)

#: Width of a table that fits a line in small print, as a part of the line. Less than the ratio of
#: the letters and of the spaces between columns asks for.
_WIDEST_SMALL = 1.2


def _part(
    columns: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    sides: _Sides,
) -> list[str]:
    """Return the lines of a table that is kept on one page."""
    before, after, name, size = sides
    return [
        rf"\par\medskip{before}",
        rf"\begin{{{name}}}{size}{{@{{}}{columns}@{{}}}}",
        r"  \toprule",
        _cells(heads),
        r"  \midrule",
        *map(_cells, rows),
        r"  \bottomrule",
        rf"\end{{{name}}}{after}",
    ]


#: Where a general formula may be broken.
_LAW_BREAK = re.compile(r"(,\\quad | = | \+ )")

#: Words in a formula, in which braces may stand around brackets.
_TEXTS = re.compile(r"\\text\{((?:[^{}]|\{[^{}]*\})*)\}")

#: What begins a label that has a line for itself.
_ALONE = r"\rlap"

#: Within a display that a sentence goes on after: no page ends there.
_UNBROKEN = r"\postdisplaypenalty=10000 "

_TIGHT = r"\setlength{\itemsep}{0pt}\setlength{\parskip}{0pt}"


def _list(items: Iterable[str], kind: str = "itemize") -> list[str]:
    shown = (rf"  \item {item}" for item in items)
    return [rf"\begin{{{kind}}}{_TIGHT}", *shown, rf"\end{{{kind}}}"]


def letter_count(text: str) -> int:
    """Count the letters of a text without its commands."""
    return len(re.sub(r"\\[A-Za-z]+|[{}$_^]", "", text))


def _lines(row: FormulaRow, available: float) -> list[str]:
    """Return the lines of a formula, aligned after its label."""
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
    """Return the lines of one of several formulas, of which the last has its number."""
    end = " \\nonumber \\\\\n" if numbered else " \\\\\n"
    return end.join(lines) + (f" {tag}" if tag else r" \nonumber" if numbered else "")


def _cells(row: Sequence[str]) -> str:
    return "  " + " & ".join(row) + r" \\"
