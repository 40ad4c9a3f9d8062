"""Words of an analysis: its phrases, verdicts and the names of its parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.report.inlines import (
    Inline,
    Label,
    Listed,
    Sentence,
    Text,
    numeral,
    opened,
    say,
    symbol,
)
from lagrange_cli.report.tree import Paragraph

if TYPE_CHECKING:
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries
    from lagrange_cli.analysis.values import Verdict


def inlined(formulas: Iterable[Label]) -> Listed:
    """Return formulas within a sentence, commas between them."""
    return Listed(tuple(map(Inline, formulas)))


def values_of(inputs: Iterable[tuple[str, float]]) -> Listed:
    """``u = 1, v = 2``."""
    return inlined(state(name) + " = " + numeral(x) for name, x in inputs)


def state(name: str) -> Label:
    """Return the symbol of a state or an input, ``dot(x)`` and ``ddot(x)`` with their dots."""
    for order, opening in enumerate(("dot(", "ddot("), 1):
        if name.startswith(opening):
            return symbol(name[len(opening) : -1], order)
    return symbol(name)


def sentence(text: Text) -> Paragraph:
    """Return a paragraph of one sentence, which begins with a capital and ends in a full stop."""
    return Paragraph(say("{text}.", text=opened(text)))


def hidden(count: int) -> Paragraph | None:
    """Say that more is in JSON, if there is more."""
    return Paragraph(say("And {count} more, in JSON.", count=count)) if count > 0 else None


def verdict_word(verdict: Verdict) -> Sentence:
    """Name the proven stability of an equilibrium, or say that it is undecided."""
    return {
        "stable": say("stable"),
        "asymptotically stable": say("asymptotically stable"),
        "stable but for drift": say("stable but for drift"),
        "stable in the linear approximation": say("stable in the linear approximation"),
        "unstable": say("unstable"),
        "undecided": say("undecided"),
    }[verdict]


def searched(symmetries: Symmetries | None) -> Sentence:
    """Say among which quantities conserved ones were searched for."""
    if symmetries is None:
        return say("among cyclic momenta and energy")
    if symmetries.complete:
        return say("among energy and what symmetries linear in the coordinates give")
    return say("among energy and what symmetries constant in the coordinates give")


def part_words(parts: Sequence[str]) -> Listed:
    """Name parts of an analysis."""
    names = {
        "symmetries": say("symmetries"),
        "equilibria": say("equilibria"),
        "linearization": say("linearization"),
        "modes": say("modes"),
        "contacts": say("loss of contact"),
    }
    return Listed(tuple(names[part] for part in parts))
