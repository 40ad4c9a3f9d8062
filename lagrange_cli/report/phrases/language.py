"""Languages of the phrase catalogue; the phrases in the code are English."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pkgutil import get_data

from lagrange_cli.errors import InternalError, Problem

#: Codes of the languages; each but English has a catalogue ``CODE.yaml`` beside this module.
LANGUAGES = ("en", "de", "fr")


@dataclass(frozen=True)
class Language:
    """A language of the phrase catalogue.

    All attributes but the code stand in the catalogue under their names.

    Attributes
    ----------
    code
        ``en``, ``de`` or the like.
    phrases
        English phrase → the same in this language, with the same parts in braces. English has none.
    thousands
        Separator of the thousands of a number.
    singular
        Counts of which the singular is used.
    spelling
        Letter → letters of plain ASCII; those that are not listed lose their accents.
    """

    code: str
    phrases: Mapping[str, str] = field(default_factory=dict, repr=False)
    thousands: str = ","
    singular: Sequence[int] = (1,)
    spelling: Mapping[str, str] = field(default_factory=dict, repr=False)

    def __call__(self, english: str, **parts: object) -> str:
        """Say a phrase, its parts put in their places.

        Raises
        ------
        InternalError
            The catalogue of the language does not have it.
        """
        phrase = english if self.code == "en" else self.phrases.get(english)
        if phrase is None:
            raise InternalError(Problem(f"no words of language '{self.code}' for '{english}'"))
        return phrase.format(**parts)

    def counted(self, count: int, one: str, many: str, **parts: object) -> str:
        """Say a phrase of one thing or of several, with ``{count}`` as one of its parts."""
        return self(one if count in self.singular else many, count=count, **parts)

    def number(self, value: int) -> str:
        """Return a whole number, its thousands apart."""
        return f"{value:,}".replace(",", self.thousands)

    def first(self, is_first: bool, first: str, later: str, **parts: object) -> str:
        """Say the first member of a list, or a later one, which may be shorter."""
        return self(first if is_first else later, **parts)

    def in_ascii(self) -> Language:
        """Return the same in plain ASCII: ``ae`` for the German ä, e for the French é."""
        letters = str.maketrans(dict(self.spelling))
        phrases = {k: _plain(v.translate(letters)) for k, v in self.phrases.items()}
        return replace(self, phrases=phrases, thousands=_plain(self.thousands))


def _plain(text: str) -> str:
    return unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode("ascii")


#: The language of the program, whose phrases stand in the code.
ENGLISH = Language("en")


@cache
def language(code: str) -> Language:
    """Return the language of that code, one of :data:`LANGUAGES`."""
    if code == "en":
        return ENGLISH
    import yaml  # English does without it.

    catalogue = get_data("lagrange_cli.report.phrases", f"{code}.yaml")
    assert catalogue is not None
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # Not every PyYAML has libyaml.
    return Language(code, **yaml.load(catalogue, loader))
