"""Phrases of an analysis, which formats translate into their symbols and languages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

#: A part of a phrase: a text, or names of the scene.
Part: TypeAlias = "str | tuple[str, ...]"


class Phrase(str):
    """An English sentence that knows its pattern and its parts.

    As a text it is the sentence itself, with names as the scene has them, so that messages of
    errors may be phrases.

    Attributes
    ----------
    english
        The pattern, with the names of parts in braces.
    parts
        The values of the parts; a tuple holds names of the scene, or letters of matrices.
    """

    __slots__ = ("english", "parts")

    english: str
    parts: Mapping[str, Part]

    def __new__(cls, english: str, **parts: Part) -> Phrase:
        """Fill the parts into the pattern."""
        plain = {k: p if isinstance(p, str) else ", ".join(p) for k, p in parts.items()}
        phrase = super().__new__(cls, english.format(**plain))
        phrase.english, phrase.parts = english, parts
        return phrase

    def __reduce__(self) -> tuple[object, ...]:
        """Copy and pickle a phrase with its pattern."""
        return _phrase, (self.english, dict(self.parts))


def _phrase(english: str, parts: Mapping[str, Part]) -> Phrase:
    return Phrase(english, **parts)
