"""Ranges of indices in the letters of formats: ``i, j = 1 … n``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range


def grouped_ranges(ranges: Sequence[Range]) -> list[tuple[list[str], str, str]]:
    """Return letters that run between the same ends, with these."""
    groups: dict[tuple[str, str], list[str]] = {}
    for span in ranges:
        groups.setdefault((str(span.first), str(span.last)), []).append(span.letter.name)
    return [(letters, first, last) for (first, last), letters in groups.items()]


def text_ranges(ranges: Sequence[Range], *, ascii: bool) -> str:
    """``i = 1 … n``, in ASCII as the scene language has it: ``i=1..n``."""
    if ascii:
        return ", ".join(f"{r.letter}={r.first}..{r.last}" for r in ranges)
    return ", ".join(
        f"{', '.join(letters)} = {_spaced(first)} … {_spaced(last)}"
        for letters, first, last in grouped_ranges(ranges)
    )


def latex_ranges(ranges: Sequence[Range]) -> str:
    """Return ranges of indices in LaTeX, without dollars."""
    return r",\ ".join(
        rf"{', '.join(letters)} = {first}, \dots, {last}"
        for letters, first, last in grouped_ranges(ranges)
    )


def typst_ranges(ranges: Sequence[Range]) -> str:
    """Return ranges of indices in Typst's mathematics."""
    return ", ".join(
        f"{', '.join(letters)} = {first}, dots.h, {last}"
        for letters, first, last in grouped_ranges(ranges)
    )


def _spaced(end: str) -> str:
    return end.replace("-", " - ").replace("+", " + ") if end[:1].isalpha() else end
