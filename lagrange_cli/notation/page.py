"""Page: text in rows whose lines are broken when the width of the reader's window is known.

Rows hold pieces between which a line may be broken, so that a page that was written once is laid
out at any width without the expressions it was written from.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

from lagrange_cli.notation.layout import Piece, break_lines, columns, joined

#: Columns of a line where the width of the reader's window is not known.
USUAL_WIDTH = 80

#: Width of lines that are not broken.
UNBROKEN = sys.maxsize

#: What a name at the beginning of a row is.
Role: TypeAlias = Literal["", "heading", "name", "good", "bad"]

#: Gives a name the look of its role.
Paint: TypeAlias = Callable[[str, Role], str]

#: A word, or a short equation or inequality, with the blanks before it.
_WORD = re.compile(r"(\s*)(\S+(?: [<>=]+ \S+)*)")

#: Further lines of a formula are indented by this, and by as much again in each parenthesis.
_HANG = 2


def words(text: str | Iterable[str]) -> tuple[Piece, ...]:
    """Make pieces of a text that is broken between words, or between the given items."""
    if isinstance(text, str):
        pairs = [(blanks, word) for blanks, word in _WORD.findall(text)]
    else:
        pairs = [(" " if index else "", item) for index, item in enumerate(text)]
    return tuple(Piece(word, columns(gap + word), gap, "", 0) for gap, word in pairs)


class Row(NamedTuple):
    """A line, or several if it is too long.

    Attributes
    ----------
    name
        Beginning of the first line, of a certain role; may begin with blanks.
    lead
        What follows before the pieces, under whose first the further lines begin.
    pieces
        The parts that are not broken.
    role
        Role of the name.
    hang
        Columns by which further lines are deeper.
    aside
        Text at the end of the last line, or on a line of its own.
    """

    name: str
    lead: str = ""
    pieces: tuple[Piece, ...] = ()
    role: Role = ""
    hang: int = 0
    aside: str = ""


def formula(
    name: str, lead: str, pieces: Sequence[Piece], role: Role = "name", aside: str = ""
) -> Row:
    """Make a row of an expression."""
    return Row(name, lead, tuple(pieces), role, _HANG, aside)


class Block(NamedTuple):
    """Rows below each other.

    Attributes
    ----------
    rows
        The rows.
    kind
        ``asides``: those of short rows stand below each other. ``packed``: the first row is
        followed by short ones beside each other.
    """

    rows: tuple[Row, ...]
    kind: Literal["", "asides", "packed"] = ""


@dataclass(frozen=True, slots=True)
class Page:
    """A text of sections, which blank lines set apart.

    Attributes
    ----------
    sections
        Each with its blocks.
    ascii
        True if what is not ASCII is to be escaped.
    """

    sections: tuple[tuple[Block, ...], ...]
    ascii: bool = False

    def text(self, width: int = USUAL_WIDTH, paint: Paint | None = None) -> str:
        """Lay the page out in lines of ``width`` columns where that can be."""
        show = paint or _unpainted
        sections = (
            "".join(
                f"{show(line.name, line.role)}{line.tail}".rstrip() + "\n"
                for block in section
                for line in _block_lines(block, width)
            )
            for section in self.sections
        )
        text = "\n".join(sections)
        return text.encode("ascii", "backslashreplace").decode("ascii") if self.ascii else text

    def __str__(self) -> str:
        return self.text()

    def to_json(self) -> list[Any]:
        """Return the page as values that JSON holds."""
        sections = [
            [[[_fields(row) for row in block.rows], block.kind] for block in section]
            for section in self.sections
        ]
        return [sections, self.ascii]

    @classmethod
    def from_json(cls, value: Sequence[Any]) -> Page:
        """Make the page that :meth:`to_json` gave."""
        sections, ascii_only = value
        return cls(tuple(tuple(_block(*b) for b in section) for section in sections), ascii_only)


def page(sections: Iterable[Iterable[Row | Block]], *, ascii: bool = False) -> Page:
    """Make a page of rows and blocks; sections without any are left out."""
    blocks = (tuple(Block((r,)) if isinstance(r, Row) else r for r in s) for s in sections)
    return Page(tuple(section for section in blocks if section), ascii)


def _block(rows: Sequence[Any], kind: Literal["", "asides", "packed"]) -> Block:
    return Block(tuple(map(_row, rows)), kind)


def _fields(row: Row) -> list[Any]:
    return [*row[:2], [astuple(piece) for piece in row.pieces], *row[3:]]


def _row(fields: Sequence[Any]) -> Row:
    name, lead, pieces, *others = fields
    return Row(name, lead, tuple(Piece(*piece) for piece in pieces), *others)


class _Line(NamedTuple):
    """A line whose beginning has a role."""

    name: str
    role: Role
    tail: str

    @property
    def width(self) -> int:
        return columns(self.name + self.tail)

    def extended(self, text: str) -> _Line:
        return _Line(self.name, self.role, self.tail + text)


def _unpainted(text: str, role: Role) -> str:
    return text


def _row_lines(row: Row, width: int) -> list[_Line]:
    """Break a row, without its aside."""
    if not row.pieces:
        return [_Line(row.name, row.role, row.lead)]
    first, *others = _broken(row, width)
    return [
        _Line(row.name, row.role, row.lead + first),
        *(_Line("", "", line) for line in others),
    ]


def _broken(row: Row, width: int) -> list[str]:
    """Break the pieces of a row; the first line goes behind its beginning."""
    before, indent = columns(row.name + row.lead), _indentation(row, width)
    pieces, later = row.pieces, width - indent - row.hang
    is_below = before > indent and before + sum(p.width for p in pieces) > width
    lines = break_lines(pieces, later if is_below else width - before, later, step=row.hang)
    blanks = (" " * (indent + row.hang + row.hang * line.level) for line in lines)
    shown = [gap + line.text for gap, line in zip(blanks, lines, strict=True)]
    return ["", *shown] if is_below else [lines[0].text, *shown[1:]]


def _indentation(row: Row, width: int) -> int:
    """Return the column under which further lines begin."""
    below = columns(row.name + row.lead)
    return below if below <= width // 2 else 2 * _HANG


def _block_lines(block: Block, width: int) -> Iterator[_Line]:
    if block.kind == "packed":
        yield from _packed(block.rows, width)
        return
    broken = [_row_lines(row, width) for row in block.rows]
    column, gap = 0, 3
    if block.kind == "asides":
        short = (lines[0].width for lines in broken if len(lines) == 1)
        column, gap = max((w for w in short if w <= width // 2), default=0), 5
    for row, lines in zip(block.rows, broken, strict=True):
        yield from lines[:-1]
        yield from _with_aside(lines[-1], row, max(column, lines[-1].width) + gap, width)


def _with_aside(last: _Line, row: Row, column: int, width: int) -> Iterator[_Line]:
    """Put a row's aside behind a line, at a column, or below the line where it does not fit."""
    if not row.aside:
        yield last
    elif column + columns(row.aside) <= width:
        yield last.extended(" " * (column - last.width) + row.aside)
    else:
        yield last
        yield from _row_lines(Row(" " * _indentation(row, width), "", words(row.aside)), width)


def _packed(rows: Sequence[Row], width: int) -> Iterator[_Line]:
    """Put rows beside the first one if all fit; else short ones beside each other below it."""
    head, *formulas = rows
    shown = [f"{row.name.lstrip()}{row.lead}{joined(row.pieces)}" for row in formulas]
    (line, *more) = _row_lines(head, width)
    one_row = "   ".join(shown)
    if shown and not more and line.width + 8 + columns(one_row) <= width:
        yield line.extended(" " * 8 + one_row)
        return
    yield from (line, *more)
    last: _Line | None = None
    for row, text in zip(formulas, shown, strict=True):
        if last is not None and last.width + 3 + columns(text) <= width:
            last = last.extended(f"   {text}")
            continue
        if last is not None:
            yield last
        *before, last = _row_lines(row, width)
        yield from before
    if last is not None:
        yield last
