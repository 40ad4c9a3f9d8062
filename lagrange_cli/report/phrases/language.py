"""Languages of the phrase catalogue; the phrases in the code are English."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module

from lagrange_cli.errors import InternalError, Problem

#: Language → modules and names of its tables.
_TABLES = {
    "de": (("german", "GERMAN"), ("german_of_analyses", "GERMAN_OF_ANALYSES")),
    "fr": (("french", "FRENCH"), ("french_of_analyses", "FRENCH_OF_ANALYSES")),
}

#: Codes of the languages of the phrase catalogue.
LANGUAGES = ("en", *_TABLES)


@dataclass(frozen=True)
class Language:
    """A language of the phrase catalogue.

    Attributes
    ----------
    code
        ``en``, ``de`` or the like.
    phrases
        English phrase → the same in this language, with the same parts in braces. English has none.
    thousands
        Separator of the thousands of a number.
    """

    code: str
    phrases: Mapping[str, str] = field(default_factory=dict, repr=False)
    thousands: str = ","

    def __call__(self, english: str, **parts: object) -> str:
        """Say a phrase, its parts put in their places.

        Raises
        ------
        InternalError
            The table of the language does not have it.
        """
        phrase = english if self.code == "en" else self.phrases.get(english)
        if phrase is None:
            raise InternalError(Problem(f"no words of language '{self.code}' for '{english}'"))
        return phrase.format(**parts)

    def counted(self, count: int, one: str, many: str, **parts: object) -> str:
        """Say a phrase of one thing or of several, with ``{count}`` as one of its parts."""
        return self(one if count == 1 else many, count=count, **parts)

    def number(self, value: int) -> str:
        """Return a whole number, its thousands apart."""
        return f"{value:,}".replace(",", self.thousands)

    def first(self, is_first: bool, first: str, later: str, **parts: object) -> str:
        """Say the first member of a list, or a later one, which may be shorter."""
        return self(first if is_first else later, **parts)

    def in_ascii(self) -> Language:
        """Return the same in plain ASCII: ``ae`` for the German ä, e for the French é."""
        spelling = _UMLAUTS if self.code == "de" else dict[int, str]()
        phrases = {k: _plain(v, spelling) for k, v in self.phrases.items()}
        return replace(self, phrases=phrases, thousands=_plain(self.thousands, spelling))


#: Language → separator of the thousands of a number.
_THOUSANDS = {"de": ".", "fr": "\u00a0"}

_UMLAUTS = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"}
)


def _plain(text: str, spelling: Mapping[int, str]) -> str:
    spelled = unicodedata.normalize("NFKD", text.translate(spelling))
    return spelled.encode("ascii", "ignore").decode("ascii")


def language(code: str) -> Language:
    """Return the language of that code, one of :data:`LANGUAGES`."""
    if code == "en":
        return ENGLISH
    tables = (
        getattr(import_module(f"lagrange_cli.report.phrases.{module}"), name)
        for module, name in _TABLES[code]
    )
    phrases = {k: phrase for table in tables for k, phrase in table.items()}
    return Language(code, phrases, _THOUSANDS[code])


#: The language of the program, whose phrases stand in the code.
ENGLISH = Language("en")
