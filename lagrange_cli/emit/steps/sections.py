"""Sections of a board: words, laws, labelled formulas."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from lagrange_cli.notation.tree import DisplayNode


@dataclass(frozen=True)
class Words:
    """A paragraph in the letters of its format."""

    text: str


@dataclass(frozen=True)
class Title:
    """The particle, coordinate or force that the next formulas are about."""

    text: str


@dataclass(frozen=True)
class Law:
    """A general formula on a line of its own, in the letters of its format."""

    text: str


@dataclass(frozen=True)
class Formula:
    """``label = middle = first = second``, or ``first = 0`` without a label.

    Attributes
    ----------
    label
        In the letters of the format; empty where the formula says that something vanishes.
    chain
        Equal expressions; none where the middle says it all.
    middle
        A general formula in the letters of the format, or empty.
    """

    label: str
    chain: tuple[DisplayNode, ...]
    middle: str = ""


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


Block: TypeAlias = Words | Title | Law | Formulas


@dataclass(frozen=True)
class Section:
    """A heading, and what stands below it."""

    heading: str
    blocks: tuple[Block, ...]


def _is_empty(block: Block) -> bool:
    return isinstance(block, Formulas) and not block.rows


def section(heading: str, *blocks: Block | None) -> Section | None:
    """A section of the blocks that there are; None if none holds anything."""
    kept = tuple(
        b for b in blocks if b is not None and not (isinstance(b, Formulas) and not b.rows)
    )
    return Section(heading, kept) if kept else None


def formulas(rows: Iterable[Formula], *, result: bool = False) -> Formulas:
    return Formulas(tuple(rows), result)
