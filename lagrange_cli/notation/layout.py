"""Formulas as pieces between which a line may be broken, and the breaking.

A printer gives pieces; joined they are the formula on one line. Breaks prefer
the outermost sum, then sums within parentheses, then products.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace

#: The depth of a break between two factors, below any sum that a person nests.
FACTOR_DEPTH = 20

#: Lines are not indented by more levels than this.
_DEEPEST = 4

#: A line is not broken before this part of it is filled, if it can be helped.
_LEAST_FILLED = 0.2


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a formula that is never broken.

    Attributes
    ----------
    text
        The part itself.
    width
        Width of separator and text, in the printer's units.
    separator
        Text before it on the same line.
    lead
        Text before it at the beginning of a line.
    depth
        Depth of the break before it, None if there can be none.
    """

    text: str
    width: float
    separator: str = ""
    lead: str = ""
    depth: int | None = None


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a formula; ``level`` counts the parentheses around its beginning."""

    text: str
    level: int


def columns(text: str) -> int:
    """Return the number of terminal columns of a text without wide characters."""
    return sum(1 for c in text if not unicodedata.combining(c))


def joined(pieces: Sequence[Piece]) -> str:
    """Return the formula on one line."""
    return "".join(p.separator + p.text for p in pieces)


def width(pieces: Sequence[Piece]) -> float:
    return sum(p.width for p in pieces)


def deeper(pieces: Sequence[Piece], by: int = 1) -> list[Piece]:
    """Return the same pieces within a further pair of parentheses."""
    return [p if p.depth is None else replace(p, depth=p.depth + by) for p in pieces]


def prefixed(pieces: Sequence[Piece], text: str, width: float) -> list[Piece]:
    """Put text before the first piece, without a break."""
    first = pieces[0]
    return [replace(first, text=text + first.text, width=first.width + width), *pieces[1:]]


def added(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces as further terms of a sum, with the sign of the first."""
    head = pieces[0]
    sign, text = ("-", head.text[1:]) if head.text.startswith("-") else ("+", head.text)
    return [Piece(text, head.width + 3, f" {sign} ", f"{sign} ", 0), *pieces[1:]]


def suffixed(pieces: Sequence[Piece], text: str, width: float) -> list[Piece]:
    """Put text after the last piece, without a break."""
    last = pieces[-1]
    return [*pieces[:-1], replace(last, text=last.text + text, width=last.width + width)]


def break_lines(
    pieces: Sequence[Piece], first: float, later: float, *, step: float = 0
) -> list[Line]:
    """Break a formula into lines.

    Parameters
    ----------
    pieces
        The formula.
    first, rest
        Width available in the first line and in the others. A piece wider than
        a line stays whole.
    step
        Width that a line loses by each level of its break, for indentation.
    """
    lines: list[Line] = []
    start = 0
    while start < len(pieces):
        head = pieces[start]
        level = min(head.depth or 0, _DEEPEST)
        end = _line_end(pieces, start, later - step * level if start else first)
        opening = head.lead if start else head.separator
        lines.append(Line(opening + head.text + joined(pieces[start + 1 : end]), level))
        start = end
    return lines


def _line_end(pieces: Sequence[Piece], start: int, available: float) -> int:
    """Return the index of the piece that begins the next line.

    Of the breaks that fit, the outermost ones, of those the last; breaks that
    leave the line too empty only where there is no other.
    """
    used = 0.0
    breaks: list[tuple[int, int, float]] = []
    for index in range(start, len(pieces)):
        piece = pieces[index]
        if index > start and piece.depth is not None:
            breaks.append((index, piece.depth, used))
        if breaks and used + piece.width > available:
            break
        used += piece.width
    else:
        return len(pieces)
    filled = [b for b in breaks if b[2] >= _LEAST_FILLED * available] or breaks
    outermost = min(depth for _, depth, _ in filled)
    return max(index for index, depth, _ in filled if depth == outermost)
