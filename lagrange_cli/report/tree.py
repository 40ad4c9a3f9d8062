"""The tree of a report, free of formats: sections of words, laws, labelled formulas, tables, lists.

Words and general formulas within lines are those of :mod:`.inlines`. Contents make trees, writers
print them. A text that stands in place of words is the same in every format and language.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Generic, Literal, TypeAlias, TypeVar

from lagrange_cli.notation.page import Role
from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.report.inlines import Listed, Text, Written, in_parentheses, say

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Readers that a block may be for: those of a document, those of a terminal.
Medium: TypeAlias = Literal["document", "terminal"]


@dataclass(frozen=True, kw_only=True)
class Visible:
    """A part of a section.

    Attributes
    ----------
    only
        The readers that it is for; None for all. A terminal is terser than a document: it has
        remarks at the ends of lines where a document has sentences.
    """

    only: Medium | None = None


_Value = TypeVar("_Value")


@dataclass(frozen=True)
class Paragraph(Visible):
    """A paragraph.

    ``role``: that of its first word, where a format has colours.
    """

    text: Text
    role: Role = ""


@dataclass(frozen=True)
class Title(Visible):
    """The particle, coordinate or force that the next formulas are about."""

    text: Text


@dataclass(frozen=True)
class Law(Visible):
    """A general formula on a line of its own.

    ``ends``: false if the sentence goes on after it.
    """

    text: Text
    ends: bool = True


@dataclass(frozen=True)
class Formula(Visible):
    """``label = middle = first = second``; without a label ``first = 0`` or ``first = second``.

    Attributes
    ----------
    label
        A general formula; empty where the formula says that something vanishes.
    chain
        Equal expressions; none where the middle says it all.
    middle
        A general formula, or empty.
    name
        What stands before it with a colon, or empty.
    multiplier
        λ of a contact, whose gap is the chain: ``0 ≤ λ ⊥ gap ≥ 0``; else empty.
    ranges
        The values of its indices, or empty.
    components
        Those of a vector that the label is, or none.
    aside
        A remark that a terminal has at the end of the line, or empty.
    brief
        What a terminal prints in place of the formula, or empty.
    otherwise
        Formulas in its place where one of its sides takes most of a line.
    """

    label: Text
    chain: tuple[DisplayNode, ...]
    middle: Text = ""
    name: Text = ""
    multiplier: Text = ""
    ranges: Text = ""
    components: tuple[Text, ...] = ()
    aside: Text = ""
    brief: Text = ""
    otherwise: tuple[Formula, ...] = ()


@dataclass(frozen=True)
class Formulas(Visible):
    """Formulas below each other, aligned at their signs of equality.

    Attributes
    ----------
    rows
        The formulas.
    result
        True if they are kept beyond the working: they get numbers.
    """

    rows: tuple[Formula, ...]
    result: bool = False


@dataclass(frozen=True)
class Table(Visible):
    """A table.

    Attributes
    ----------
    heads, rows
        Its first line and the others.
    prose
        The head of the column that may hold sentences.
    numeric
        The heads of columns of numbers, which end below each other.
    digits
        Characters of the longest number that such a column may hold: tables below each other are
        aligned in formats of one width.
    """

    heads: tuple[Text, ...]
    rows: tuple[tuple[Text, ...], ...]
    prose: Text = ""
    numeric: frozenset[Text] = frozenset()
    digits: int = 0

    def without_empty_columns(self) -> Table:
        """Return the columns in which something stands."""
        used = [i for i in range(len(self.heads)) if any(row[i] for row in self.rows)]
        picked = [tuple(row[i] for i in used) for row in (self.heads, *self.rows)]
        return replace(self, heads=picked[0], rows=tuple(picked[1:]))


@dataclass(frozen=True)
class Column(Generic[_Value]):
    """A column of a table: its head, the cell of a value, and whether these are numbers."""

    head: Text
    cell: Callable[[_Value], Text]
    is_numeric: bool = False


def table_of(
    values: Iterable[_Value], *columns: Column[_Value], prose: Text = "", digits: int = 0
) -> Table:
    """Return a table with a row for each value."""
    return Table(
        tuple(column.head for column in columns),
        tuple(tuple(column.cell(value) for column in columns) for value in values),
        prose,
        frozenset(column.head for column in columns if column.is_numeric),
        digits,
    )


@dataclass(frozen=True)
class Bullets(Visible):
    """A list; ``counted``: with numbers, by which its items are referred to."""

    items: tuple[Text, ...]
    counted: bool = False


@dataclass(frozen=True)
class Labelled(Visible):
    """Short names, each with what belongs to it: a list of terms."""

    rows: tuple[tuple[Text, Text], ...]


@dataclass(frozen=True)
class StatementRow:
    """Equations and inequalities as a scene has them.

    Attributes
    ----------
    name, remark
        Their name, and what is to be said of them, or empty.
    equations
        Each with the values of its indices, or empty.
    """

    name: Text
    equations: tuple[tuple[Text, Text], ...]
    remark: Text = ""

    @property
    def item(self) -> Written:
        """The equations with their name and remark as an item of a list."""
        parts = (part for pair in self.equations for part in pair if part)
        item = say("{name}: {value}", name=self.name, value=Listed(tuple(parts)))
        return in_parentheses(item, self.remark) if self.remark else item


@dataclass(frozen=True)
class Statements(Visible):
    """Equations and inequalities as a scene has them, those of one name on a line."""

    rows: tuple[StatementRow, ...]


@dataclass(frozen=True)
class Packed(Visible):
    """Short items and formulas, which stand beside each other where there is room.

    Attributes
    ----------
    heading, items
        What stands before them, and the items.
    rows
        The formulas.
    """

    heading: Text
    items: tuple[Text, ...]
    rows: tuple[Formula, ...] = ()


@dataclass(frozen=True)
class Verbatim(Visible):
    """Lines of characters of one width, as a diagram of letters."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class Picture(Visible):
    """The sketch of the system, which a format draws in its way."""


@dataclass(frozen=True)
class Passage(Visible):
    """A sentence with formulas, which are displayed where they are too long for it.

    Attributes
    ----------
    before, after
        The words around them.
    place
        The formulas.
    """

    before: Text
    place: tuple[Formula, ...]
    after: Text


@dataclass(frozen=True)
class Case:
    """A configuration, and what is said of it.

    Attributes
    ----------
    place
        A formula for each coordinate.
    condition
        The conditions under which it exists, or empty.
    verdict, reason
        Its stability and why, or empty.
    """

    place: tuple[Formula, ...]
    condition: Text = ""
    verdict: Text = ""
    reason: Text = ""


@dataclass(frozen=True)
class Cases(Visible):
    """Configurations: a list where all are short, else displays with titles."""

    cases: tuple[Case, ...]


Cells: TypeAlias = tuple[tuple[DisplayNode, ...], ...]
"""Entries of a matrix, row by row."""


@dataclass(frozen=True)
class Matrix:
    """A matrix, written as one where it fits a line, else by its entries that are not 0.

    Attributes
    ----------
    letter
        Its letter, which is bold.
    values
        Its entries in numbers; none if all are 0.
    closed
        Its entries in closed form; none where these are unknown, or are numbers.
    """

    letter: str
    values: Cells
    closed: Cells = ()


@dataclass(frozen=True)
class Matrices(Visible):
    """Matrices below each other; those that are too large are named as such."""

    matrices: tuple[Matrix, ...]


PlainBlock: TypeAlias = (
    Paragraph | Title | Law | Formulas | Table | Bullets | Labelled | Verbatim | Picture
)
"""A part of a section whose form does not depend on the room of a line."""

Block: TypeAlias = PlainBlock | Statements | Packed | Passage | Cases | Matrices
"""A part of a section; steps have no tables, lists and pictures."""

Part: TypeAlias = Block | Text
"""A part of a section, where words by themselves are a paragraph."""


@dataclass(frozen=True)
class Section:
    """A heading, and what stands below it.

    Attributes
    ----------
    heading
        What stands above it; empty for nothing.
    blocks
        What stands below it.
    name
        The name of the part of a document that it is, by which labels are told apart.
    terse
        The heading in a terminal if it is another one; None if a terminal has none.
    lead
        What a terminal has behind it on the same line, broken between the texts.
    gap
        Blanks or a sign between the two.
    margin
        Columns before formulas in a terminal that are aligned at their signs, as on a board; None
        for formulas behind their names, with remarks.
    """

    heading: Text
    blocks: tuple[Block, ...]
    name: str = ""
    terse: Text | None = ""
    lead: tuple[Text, ...] = ()
    gap: str = "   "
    margin: int | None = None

    def seen_by(self, medium: Medium) -> Section:
        """Return the section with the parts that are for some readers."""
        shown: list[Block] = []
        for block in self.blocks:
            if block.only not in (None, medium):
                continue
            if isinstance(block, Formulas):
                rows = tuple(row for row in block.rows if row.only in (None, medium))
                shown += [replace(block, rows=rows)] if rows else []
            else:
                shown.append(block)
        return replace(self, blocks=tuple(shown))


def seen(sections: Iterable[Section], medium: Medium) -> list[Section]:
    """Return the sections that hold anything for some readers, with what is for them."""
    shown = (section.seen_by(medium) for section in sections)
    return [s for s in shown if s.blocks or (s.lead and medium == "terminal")]


@dataclass(frozen=True)
class Document:
    """A whole report.

    Attributes
    ----------
    name
        Name of the scene.
    about
        The subject, in English for a comment.
    title
        What stands above all; empty for nothing.
    sections
        The sections.
    description
        The scene's own words about itself.
    equations
        The system, whose symbols are printed as its scene says, and which pictures are of; None
        where a value is reported without it.
    """

    name: str
    about: str
    title: Text
    sections: tuple[Section, ...]
    description: Text = ""
    equations: Equations | None = None

    def seen_by(self, medium: Medium) -> Document:
        """Return the document with the parts that are for some readers."""
        return replace(self, sections=tuple(seen(self.sections, medium)))


def sections(*written: Section | None) -> tuple[Section, ...]:
    """Return the sections that there are."""
    return tuple(one for one in written if one is not None)


def section(
    heading: Text,
    *blocks: Part | None,
    terse: Text | None = "",
    lead: tuple[Text, ...] = (),
    gap: str = "   ",
) -> Section | None:
    """Return a section of the blocks that there are; None if none holds anything."""
    parts = (Paragraph(b) if isinstance(b, Written | str) else b for b in blocks if b)
    shown = tuple(b for b in parts if not (isinstance(b, Formulas) and not b.rows))
    if not (shown or lead):
        return None
    return Section(heading, shown, terse=terse, lead=lead, gap=gap)


def formulas(
    rows: Iterable[Formula], *, result: bool = False, only: Medium | None = None
) -> Formulas:
    return Formulas(tuple(rows), result, only=only)
