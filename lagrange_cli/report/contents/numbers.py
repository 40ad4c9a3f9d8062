"""Numbers of results, in the digits that they are to have, and their phrases."""

from __future__ import annotations

import math

from lagrange_cli.phrases import Part, Phrase
from lagrange_cli.report.inlines import (
    Chain,
    Inline,
    Listed,
    Mark,
    Plain,
    Sentence,
    Text,
    Written,
    bold,
    symbol,
)


def digits(text: str) -> Inline:
    """Return a number with all digits of a text, as ``-1.20e-05``; one that is not finite is a
    word."""
    return Inline(Mark("digits" if math.isfinite(float(text)) else "upright", (text,)))


def decimal(value: float | None, form: str = ".9g") -> Text:
    """Return a number in a format of :func:`format`, a dash for None."""
    return "-" if value is None else digits(format(value, form) if value else "0")


def assigned(name: str, value: Text) -> Written:
    """Return ``name = value`` for a name of the scene or a rate, as one formula if it can be."""
    letter = Mark("scene_name", (name,))
    if isinstance(value, Inline):
        return Inline(Chain((letter, " = ", value.formula)))
    return Listed((Inline(letter), " = ", value), between="")


def phrased(text: str) -> Written:
    """Return a phrase of a result with its symbols; other texts stay as they are."""
    if not isinstance(text, Phrase):
        return Plain(text)
    return Sentence(text.english, tuple((k, _part(k, p)) for k, p in text.parts.items()))


def _part(name: str, part: Part) -> Written:
    if isinstance(part, str):
        return phrased(part)
    letters = map(bold if name == "matrix" else symbol, part)
    return Listed(tuple(map(Inline, letters)))
