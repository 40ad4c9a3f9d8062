"""Names of links and joints as the language of scenes takes them.

Words that all names share are left out, as ``lbr_iiwa_joint_3`` of an arm; what stays a number gets
a letter before it: ``q3``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from lagrange_cli.scene.language.expression import RESERVED

#: Characters of the longest name, and words that names of joints and links have besides.
_LONGEST = 40
_KINDS_OF_WORDS = ("joint", "jnt", "link")


@dataclass
class Names:
    """Names that are in use in a scene, in the sense in which two would print alike."""

    taken: set[str] = field(default_factory=set)

    def take(self, name: str, *implied: str) -> str:
        """Take a name that is free, numbered if it is not; ``implied`` go with it as ``x_{}``."""
        candidate, number = name, 1
        while not self.is_free(candidate, *implied):
            number += 1
            candidate = f"{name}_v{number}"
        self.taken |= {_alike(n) for n in self._all(candidate, implied)}
        return candidate

    def is_free(self, name: str, *implied: str) -> bool:
        every = self._all(name, implied)
        return not any(n in RESERVED or _alike(n) in self.taken for n in every)

    def _all(self, name: str, implied: Iterable[str]) -> list[str]:
        return [name, *(pattern.format(name) for pattern in implied)]


def _alike(name: str) -> str:
    """Return the name without what languages of code and indices of formulas do not tell apart."""
    return name.replace("_", "").lower()


def identifier(text: str) -> str:
    """Return letters, digits and ``_`` of a name, a letter first; empty if none are left."""
    words = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:_LONGEST].rstrip("_")
    return words if not words or words[0].isalpha() else f"n{words}"


def short_names(names: Sequence[str], letter: str) -> list[str]:
    """Return names without the words that all of them share, at their beginning and their end.

    What is left of one as a number follows the letter; where nothing is left, so does its place.
    """
    words = [re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").split("_") for name in names]
    start = _shared(words) if len(words) > 1 else 0
    end = _shared([row[start:][::-1] for row in words]) if len(words) > 1 else 0
    results = []
    for place, row in enumerate(words, 1):
        rest_words = row[start : len(row) - end]
        kept_words = [w for w in rest_words if w.lower() not in _KINDS_OF_WORDS] or rest_words
        text = "_".join(kept_words)
        if not text:
            results.append(f"{letter}{place}" if len(words) > 1 else letter)
        elif text.isdigit():
            results.append(f"{letter}{int(text)}")
        else:
            results.append(identifier(text) or f"{letter}{place}")
    return results


def _shared(rows: Sequence[Sequence[str]]) -> int:
    count = 0
    for column in zip(*rows, strict=False):
        if len(set(column)) > 1:
            break
        count += 1
    return count
