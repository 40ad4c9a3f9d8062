"""The allowlist of LaTeX in a scene: math symbols with scripts, and nothing that acts.

It is for ``latex:`` keys, and for formulas between dollars in titles and descriptions. Formats
that are not LaTeX write the parts that :func:`latex_parts` reads.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

#: Most characters of a ``latex`` key.
_LONGEST = 100

_SYMBOL_NAMES = """
    alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta iota kappa varkappa
    lambda mu nu xi pi varpi rho varrho sigma varsigma tau upsilon phi varphi chi psi omega
    Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega
    ell hbar imath jmath wp Re Im aleph partial nabla infty prime dagger ddagger ast star circ
    bullet parallel perp top bot cdot times pm mp odot oplus otimes
    quad qquad
"""
#: Macros of one argument in braces.
_ACCENT_NAMES = """
    hat widehat tilde widetilde bar overline underline vec dot ddot check breve acute grave
    mathring mathrm mathbf mathit mathsf mathtt mathcal mathbb mathfrak mathscr boldsymbol
    operatorname
"""
#: Names of the macros that are allowed: those that stand alone, those with an argument.
SYMBOLS = frozenset(_SYMBOL_NAMES.split())
ACCENTS = frozenset(_ACCENT_NAMES.split())
_PART = re.compile(
    r"""\\(?P<macro>[A-Za-z]+)
      | (?P<space>\\[,;:!\ ]|\ +)
      | [A-Za-z0-9'()+*/=.,|-]
      | [{}_^]""",
    re.VERBOSE,
)

#: As Pandoc has it: no blank beside the dollars within, no digit behind the second.
_BETWEEN_DOLLARS = re.compile(r"\$(?![\s$])([^$]*[^$\s])\$(?!\d)")


def between_dollars(text: str) -> Iterator[re.Match[str]]:
    """Yield what may be formulas in a text; group 1 is without the dollars."""
    return _BETWEEN_DOLLARS.finditer(text)


def with_formulas(text: str, words: Callable[[str], str], formula: Callable[[str], str]) -> str:
    """Write a text in which allowed formulas stand between dollars.

    Parameters
    ----------
    text
        Text of a scene.
    words
        Writes what is between formulas, formulas that are not allowed among it.
    formula
        Writes a formula, without its dollars.
    """
    parts, place = list[str](), 0
    for match in between_dollars(text):
        if check_latex(match[1]) is None:
            parts += [_words(text[place : match.start()], words), formula(match[1])]
            place = match.end()
    return "".join([*parts, _words(text[place:], words)])


def _words(text: str, words: Callable[[str], str]) -> str:
    """Write a text with a blank where it has some at its ends."""
    if not text.strip():
        return " " if text else ""
    return " " * text[0].isspace() + words(text.strip()) + " " * text[-1].isspace()


def check_latex(text: str) -> str | None:
    """Say why a text is not an allowed LaTeX symbol; None if it is.

    An allowed text is a complete formula: braces balance, every script and accent has its
    argument, and no symbol has two scripts of one kind.
    """
    if not text.strip():
        return "is empty"
    if len(text) > _LONGEST:
        return f"has more than {_LONGEST} characters"
    parts: list[str] = []
    position = 0
    while position < len(text):
        match = _PART.match(text, position)
        if match is None:
            return f"cannot hold '{text[position]}'"
        if match["macro"] and match["macro"] not in SYMBOLS | ACCENTS:
            return f"cannot hold the macro '\\{match['macro']}'"
        if not match["space"]:
            parts.append(match.group())
        position = match.end()
    return _Structure(parts).check()


class _Structure:
    """Follows a list of parts through groups, scripts and accents."""

    def __init__(self, parts: list[str]) -> None:
        self.parts = parts
        self.scripts: list[set[str]] = [set()]  # of the last symbol, for each open group
        self.wants: str | None = None  # what needs an argument next

    def check(self) -> str | None:
        for part in self.parts:
            refused = self._step(part)
            if refused:
                return refused
        if self.wants:
            return f"lacks the argument of '{self.wants}'"
        return "has an unclosed '{'" if len(self.scripts) > 1 else None

    def _step(self, part: str) -> str | None:
        if part == "{":
            self.wants = None
            self.scripts.append(set())
        elif self.wants and (part in "}_^'" or _is_accent(part)):
            return f"lacks the argument of '{self.wants}'"
        elif part == "}":
            if len(self.scripts) == 1:
                return "has a '}' that closes nothing"
            self.scripts.pop()
        elif part in ("_", "^", "'"):
            return self._script(part)
        elif self.wants:
            self.wants = None
        else:
            self.scripts[-1] = set()
            self.wants = part if _is_accent(part) else None
        return None

    def _script(self, part: str) -> str | None:
        kind = "^" if part == "'" else part
        repeated_prime = part == "'" and "'" in self.scripts[-1]
        if kind in self.scripts[-1] and not repeated_prime:
            return f"has two '{kind}' on one symbol"
        self.scripts[-1] |= {kind, part}
        self.wants = part if part != "'" else None
        return None


def _is_accent(part: str) -> bool:
    return part.startswith("\\") and part[1:] in ACCENTS


@dataclass(frozen=True, slots=True)
class Sign:
    """A character, or a macro that stands alone with its backslash, spaces among them."""

    text: str


@dataclass(frozen=True, slots=True)
class Accent:
    """A macro of one argument: an accent or an alphabet."""

    macro: str
    body: tuple[LatexPart, ...]


@dataclass(frozen=True, slots=True)
class Script:
    """An index (``_``), exponent (``^``) or prime (``'``, without a script) on a part."""

    base: LatexPart | None
    sign: str
    script: tuple[LatexPart, ...]


LatexPart: TypeAlias = Sign | Accent | Script

#: Macros of spaces, which bear no scripts.
_SPACES = frozenset((r"\quad", r"\qquad", r"\,", r"\:", r"\;", r"\!", r"\ "))


def latex_parts(text: str) -> tuple[LatexPart, ...]:
    """Read an allowed formula; braces that only group, and blanks, leave no part."""
    parts = (match.group() for match in _PART.finditer(text))
    return _group(part for part in parts if part.strip(" "))


def _group(parts: Iterator[str]) -> tuple[LatexPart, ...]:
    """Read up to the end of a group."""
    read: list[LatexPart] = []
    for part in parts:
        if part == "}":
            break
        if part in ("_", "^", "'"):
            base = read.pop() if read and not _is_space(read[-1]) else None
            read.append(Script(base, part, () if part == "'" else _symbol(next(parts), parts)))
        else:
            read += _symbol(part, parts)
    return tuple(read)


def _is_space(part: LatexPart) -> bool:
    return isinstance(part, Sign) and part.text in _SPACES


def _symbol(part: str, parts: Iterator[str]) -> tuple[LatexPart, ...]:
    """Read a group, a macro with its argument, or a character."""
    if part == "{":
        return _group(parts)
    if _is_accent(part):
        return (Accent(part[1:], _symbol(next(parts), parts)),)
    return (Sign(part),)
