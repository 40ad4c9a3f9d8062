"""Sections of a document as Typst: sentences, tables, displays broken into lines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from lagrange_cli.notation.layout import break_lines
from lagrange_cli.notation.printers.typst import CONTINUED, TypstPrinter, balanced, typst_string
from lagrange_cli.report import tree
from lagrange_cli.report.inlines import Text
from lagrange_cli.report.writers.rows import FormulaRow, RowSetter

#: Lines of a display that stay on one page.
_MOST_LINES = 6

#: What takes no room of its own in a general formula, and names that print as one letter.
_NO_ROOM = re.compile(r'\b(?:frac|upright|bold|scripts|thin|dot\.double|dot)\b|[_^(),\s"]')
_LETTER = re.compile(r"[a-zA-Z.]{2,}")

#: What takes no room in a cell with numbers.
_SIGNS = re.compile(r'\$|\^|[()]|times |#raw|"')


@dataclass(frozen=True)
class Typesetter(RowSetter):
    """Writes sections in Typst.

    Attributes
    ----------
    stem
        The beginning of all labels.
    counts
        Part of the document → how many of its formulas have a label.
    """

    stem: str = ""
    counts: dict[str, int] = field(default_factory=dict)

    colon = ": quad"
    wide = " quad "
    complementary = "perp"

    @property
    def printer(self) -> TypstPrinter:
        return TypstPrinter()

    def room(self, formula: str) -> float:
        strings = sum(map(len, re.findall(r'"(.*?)"', formula)))
        return strings + len(_LETTER.sub("x", _NO_ROOM.sub(" ", formula)).replace(" ", ""))

    def section(self, section: tree.Section) -> list[str]:
        """Return the heading of a section and its blocks."""
        heading = self.text(section.heading)
        return [*([f"= {heading}"] if heading else []), *self.blocks(section)]

    def blocks(self, section: tree.Section) -> list[str]:
        """Return the blocks of a section without its heading."""
        return [line for block in self.fitted(section) for line in self._block(block, section.name)]

    def _block(self, block: tree.PlainBlock, part: str) -> Iterator[str]:
        match block:
            case tree.Paragraph(text):
                yield self.text(text)
            case tree.Title(text):
                yield from ("", self.text(text))
            case tree.Law(text):
                yield f"$ {self.text(text)} $"
            case tree.Formulas(_, result):
                rows = self.rows(block)
                yield from self.numbered(rows, part) if result else [self._display(rows)]
            case tree.Table():
                yield from self._table(block)
            case tree.Bullets(items, counted):
                yield from (f"{'+' if counted else '-'} {item}" for item in map(self.text, items))
            case tree.Labelled(rows):
                yield from (f"/ {self.text(a)}: {self.text(b)}" for a, b in rows)
            case tree.Verbatim(lines):
                shown = ", ".join(map(typst_string, lines))
                yield rf'#raw(block: true, ({shown},).join("\n"))'
            case tree.Picture():
                pass

    # -- displays -------------------------------------------------------------------

    def numbered(self, rows: Sequence[FormulaRow], part: str) -> Iterator[str]:
        """Displays with a number and a label, one for each formula."""
        formula: list[FormulaRow] = []
        for row in rows:
            formula.append(row)
            if row.ends:
                number = self.counts[part] = self.counts.get(part, 0) + 1
                label = f" <eq:{self.stem}:{part}:{number}>"
                yield f"#numbered[{self._display(formula, label)}]"
                formula = []

    def _display(self, rows: Sequence[FormulaRow], label: str = "") -> str:
        """Return formulas below each other, aligned after their labels."""
        available = self.available([row.label for row in rows])
        lines = [line for row in rows for line in _lines(row, available)]
        shown = "$ " + " \\\n  ".join(lines) + f" ${label}"
        return shown if len(lines) <= _MOST_LINES else f"#long[{shown}]"

    # -- tables ---------------------------------------------------------------------

    def _table(self, table: tree.Table) -> Iterator[str]:
        """Return a table between lines; a long one runs over pages, a wide one is small."""
        lines = zip(*(map(self.text, row) for row in (table.heads, *table.rows)), strict=True)
        room = sum(max(len(_SIGNS.sub("", cell)) for cell in column) + 3 for column in lines)
        is_small = room > self.columns and table.prose not in table.heads
        if is_small:
            yield "#text(size: 0.7em)["
        widths = ", ".join("1fr" if head == table.prose else "auto" for head in table.heads)
        aligned = ("right" if head in table.numeric else "left" for head in table.heads)
        yield "#table("
        yield f"  columns: ({widths},), stroke: none, table.hline(),"
        if table.numeric:
            yield f"  align: ({', '.join(aligned)},),"
        yield f"  table.header({self._cells(table.heads)}), table.hline(),"
        for row in table.rows:
            yield f"  {self._cells(row)},"
        yield "  table.hline(),"
        yield ")]" if is_small else ")"

    def _cells(self, row: Sequence[Text]) -> str:
        return ", ".join(f"[{self.text(cell)}]" for cell in row)


def _lines(row: FormulaRow, available: float) -> Iterator[str]:
    lines = break_lines(row.pieces, available, available - 4, step=2)
    first, *others = balanced(line.text for line in lines)
    yield f"{row.label} & {first}".lstrip()
    for line, text in zip(lines[1:], others, strict=True):
        yield f"& #h({1.5 + 0.8 * line.level:g}em) {CONTINUED}{text}"
