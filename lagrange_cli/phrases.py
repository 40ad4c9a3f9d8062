"""Phrases that reports have of results, which formats translate into symbols and languages."""

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


def pattern(english: str) -> str:
    """Return the pattern of phrases that are made later, which catalogues have, too."""
    return english


def with_part(text: str, old: str, new: str) -> str:
    """Return a phrase with another text in place of each part that is a text; others unchanged."""
    if not isinstance(text, Phrase):
        return new if text == old else text
    parts = text.parts.items()
    return Phrase(
        text.english, **{k: with_part(p, old, new) if isinstance(p, str) else p for k, p in parts}
    )
