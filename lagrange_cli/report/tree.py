"""The tree of a report, free of formats: sections of words, laws, labelled formulas, tables, lists.

Words and general formulas within lines are those of :mod:`.inlines`. Contents make trees, writers
print them. Where a text stands in place of words, it is in the letters of its format already.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

from lagrange_cli.notation.tree import DisplayNode
from lagrange_cli.report.inlines import Text, Written


@dataclass(frozen=True)
class Paragraph:
    """A paragraph."""

    text: Text


@dataclass(frozen=True)
class Title:
    """The particle, coordinate or force that the next formulas are about."""

    text: Text


@dataclass(frozen=True)
class Law:
    """A general formula on a line of its own.

    ``ends``: false if the sentence goes on after it.
    """

    text: Text
    ends: bool = True


@dataclass(frozen=True)
class Formula:
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
    """

    label: Text
    chain: tuple[DisplayNode, ...]
    middle: Text = ""
    name: Text = ""
    multiplier: Text = ""
    ranges: Text = ""
    components: tuple[Text, ...] = ()


@dataclass(frozen=True)
class Formulas:
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
class Table:
    """A table.

    Attributes
    ----------
    heads, rows
        Its first line and the others.
    prose
        The head of the column that may hold sentences.
    numeric
        The heads of columns of numbers, which end below each other.
    """

    heads: tuple[Text, ...]
    rows: tuple[tuple[Text, ...], ...]
    prose: Text = ""
    numeric: frozenset[Text] = frozenset()

    def without_empty_columns(self) -> Table:
        """Return the columns in which something stands."""
        used = [i for i in range(len(self.heads)) if any(row[i] for row in self.rows)]
        picked = [tuple(row[i] for i in used) for row in (self.heads, *self.rows)]
        return replace(self, heads=picked[0], rows=tuple(picked[1:]))


@dataclass(frozen=True)
class Bullets:
    """A list."""

    items: tuple[Text, ...]


@dataclass(frozen=True)
class Labelled:
    """Short names, each with what belongs to it: a list of terms."""

    rows: tuple[tuple[Text, Text], ...]


@dataclass(frozen=True)
class Verbatim:
    """Lines of characters of one width, as a diagram of letters."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class Picture:
    """The sketch of the system, which a format draws in its way."""


Block: TypeAlias = (
    Paragraph | Title | Law | Formulas | Table | Bullets | Labelled | Verbatim | Picture
)
"""A part of a section; steps have no tables, bullets and pictures."""

Part: TypeAlias = Block | Text
"""A part of a section, where words by themselves are a paragraph."""


@dataclass(frozen=True)
class Section:
    """A heading, and what stands below it.

    Attributes
    ----------
    heading
        What stands above it.
    blocks
        What stands below it.
    name
        The name of the part of a document that it is, by which labels are told apart.
    """

    heading: Text
    blocks: tuple[Block, ...]
    name: str = ""


def section(heading: Text, *blocks: Part | None) -> Section | None:
    """Return a section of the blocks that there are; None if none holds anything."""
    parts = (Paragraph(b) if isinstance(b, Written | str) else b for b in blocks if b)
    shown = tuple(b for b in parts if not (isinstance(b, Formulas) and not b.rows))
    return Section(heading, shown) if shown else None


def formulas(rows: Iterable[Formula], *, result: bool = False) -> Formulas:
    return Formulas(tuple(rows), result)
