"""Texts that options write in the scene language, and the places in them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import ClassVar

from lagrange_cli.errors import InputError, Mark, Problem

_OPENING, _CLOSING = "([", ")]"

_RELATION = re.compile(r"[<>=!]+")

#: Sign of left side less right side where an inequality holds.
INEQUALITIES = {">": 1, ">=": 1, "<": -1, "<=": -1}


@dataclass(frozen=True)
class WrittenText:
    """A text over the state of a motion.

    Attributes
    ----------
    text
        The text.
    source
        The option or argument that holds it, as messages name it: ``--section``.
    """

    text: str
    source: str

    #: The rule that messages about it name.
    rule: ClassVar[str] = "expression"

    def mark(self, start: int, end: int) -> Mark:
        """Mark a part of the text, without the blanks around it."""
        part = self.text[start:end]
        begin = start + len(part) - len(part.lstrip())
        return Mark(self.source, 1, begin + 1, self.text, max(1, len(part.strip())))

    def refusal(self, message: str, start: int, end: int, hint: str = "") -> InputError:
        """Return the refusal of a part of the text."""
        return InputError(Problem(message, self.mark(start, end), hint, rule=self.rule))

    def parts(
        self, separator: str = ",", start: int = 0, end: int | None = None
    ) -> list[tuple[int, int]]:
        """Return the bounds of the parts between separators outside brackets."""
        end = len(self.text) if end is None else end
        places = range(start, end)
        cuts = [k for k in places if self.text[k] == separator and not self._depth(start, k)]
        return list(zip([start, *(k + 1 for k in cuts)], [*cuts, end], strict=True))

    def relations(self, start: int, end: int) -> list[re.Match[str]]:
        """Return the signs of relations in a part of the text, outside brackets."""
        signs = _RELATION.finditer(self.text, start, end)
        return [sign for sign in signs if not self._depth(start, sign.start())]

    def _depth(self, start: int, place: int) -> int:
        """Count the brackets that are opened from a start on and not closed at a place."""
        part = self.text[start:place]
        return sum((c in _OPENING) - (c in _CLOSING) for c in part)
