"""Typography of a user's names: Greek letters, subscripts, dots; in text and in LaTeX.

Names are split into a base and a subscript (``theta1``, ``theta_1`` and
``theta[1]`` are θ with 1). Every name is the user's own: ``lambda``, ``E`` or
``beta`` mean nothing more than ``x``.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass

from lagrange_cli.latex_allowlist import with_formulas

_GREEK_NAMES = """
    alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi rho sigma tau upsilon
    phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega
    vartheta varphi varepsilon
"""
#: Greek letters by name. Capitals that look like Latin ones (``Alpha``) are left
#: as words, because they would print as another name.
GREEK = dict(zip(_GREEK_NAMES.split(), "αβγδεζηθικλμνξρστυφχψωΓΔΘΛΞΠΣΥΦΨΩϑϕϵ", strict=True))

#: Signs of ``latex`` keys beside Greek letters, as characters.
_SIGN_NAMES = """
    ell hbar imath jmath wp Re Im aleph partial nabla infty prime dagger ddagger ast star
    circ bullet parallel perp top bot cdot times pm mp odot oplus otimes pi varpi varrho varsigma
    varkappa
"""
SIGNS = dict(zip(_SIGN_NAMES.split(), "ℓℏıȷ℘ℜℑℵ∂∇∞′†‡∗⋆∘∙∥⟂⊤⊥⋅×±∓⊙⊕⊗πϖϱςϰ", strict=True))

_LATEX_SPECIAL = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    "`": r"\textasciigrave{}",
    "-": r"{-}",
    # A bracket after \item would begin an optional argument.
    "[": "{[}",
    "]": "{]}",
}

#: Letters beyond ASCII that a pdfLaTeX document with T1 fonts sets by itself.
_LATEX_LETTERS = frozenset(
    "ÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÐÑÒÓÔÕÖØÙÚÛÜÝÞßàáâãäåæçèéêëìíîïðñòóôõöøùúûüýþÿ"
    "ĂăĄąĆćČčĎďĐđĘęĚěĞğĹĺĽľŁłŃńŇňŊŋŐőŒœŔŕŘřŚśŞşŠšŢţŤťŮůŰűŸŹźŻżŽž"
)

_LATEX_SIGNS = {
    "–": "--",
    "—": "---",
    "‘": "`",
    "’": "'",
    "“": "``",
    "”": "''",
    "…": r"\ldots{}",
    "×": r"\ensuremath{\times}",
    "·": r"\ensuremath{\cdot}",
    "°": r"\ensuremath{{}^{\circ}}",
    "±": r"\ensuremath{\pm}",
    "−": r"\ensuremath{-}",
    "²": r"\ensuremath{{}^{2}}",
    "³": r"\ensuremath{{}^{3}}",
    "½": r"\ensuremath{\frac{1}{2}}",
    "√": r"\ensuremath{\surd}",
    "≤": r"\ensuremath{\le}",
    "≥": r"\ensuremath{\ge}",
    "→": r"\ensuremath{\to}",
    "∞": r"\ensuremath{\infty}",
    "µ": r"\ensuremath{\mu}",
    "§": r"\S{}",
    "¶": r"\P{}",
    "©": r"\copyright{}",
    "£": r"\pounds{}",
    "«": r"\guillemotleft{}",
    "»": r"\guillemotright{}",
    "„": r"\quotedblbase{}",
    "‚": r"\quotesinglbase{}",
    "¡": r"\textexclamdown{}",
    "¿": r"\textquestiondown{}",
    "′": r"\ensuremath{{}'}",
    "″": r"\ensuremath{{}''}",
    "¼": r"\ensuremath{\frac{1}{4}}",
    "¾": r"\ensuremath{\frac{3}{4}}",
    "⅓": r"\ensuremath{\frac{1}{3}}",
    "⅔": r"\ensuremath{\frac{2}{3}}",
    "≈": r"\ensuremath{\approx}",
    "≠": r"\ensuremath{\ne}",
    "≪": r"\ensuremath{\ll}",
    "≫": r"\ensuremath{\gg}",
    "∝": r"\ensuremath{\propto}",
    "∼": r"\ensuremath{\sim}",
    "∂": r"\ensuremath{\partial}",
    "∇": r"\ensuremath{\nabla}",
    "∑": r"\ensuremath{\Sigma}",
    "∫": r"\ensuremath{\int}",
    "∥": r"\ensuremath{\parallel}",
    "⊥": r"\ensuremath{\perp}",
    "∠": r"\ensuremath{\angle}",
    "⋅": r"\ensuremath{\cdot}",
    "ℏ": r"\ensuremath{\hbar}",
    "ℓ": r"\ensuremath{\ell}",
}

#: Combining accents, as LaTeX puts them on a letter.
_ACCENTS = {
    "\u0300": r"\`",
    "\u0301": r"\'",
    "\u0302": r"\^",
    "\u0303": r"\~",
    "\u0304": r"\=",
    "\u0306": r"\u",
    "\u0307": r"\.",
    "\u0308": r"\"",
    "\u030a": r"\r",
    "\u030b": r"\H",
    "\u030c": r"\v",
    "\u0327": r"\c",
    "\u0328": r"\k",
}

_GREEK_MACROS = {letter: name for name, letter in GREEK.items()} | {"π": "pi"}


def _latex_character(character: str) -> str:
    if character in _LATEX_SPECIAL:
        return _LATEX_SPECIAL[character]
    if character.isascii():
        return character if character.isprintable() else " "
    if character in _LATEX_LETTERS:
        return character
    if character in _LATEX_SIGNS:
        return _LATEX_SIGNS[character]
    if character in _GREEK_MACROS:
        return rf"\ensuremath{{\{_GREEK_MACROS[character]}}}"
    if unicodedata.category(character).startswith("Z"):
        return " "
    # Nothing that pdfLaTeX has no glyph for may stop the document.
    return _composed(character) or f"{{[}}U+{ord(character):04X}{{]}}"


def _composed(character: str) -> str | None:
    """A letter with an accent, or a digit as a script, by what it is made of; None of others."""
    kind, _, parts = unicodedata.decomposition(character).rpartition("> ")
    made_of = [chr(int(part, 16)) for part in parts.split()]
    sign = {"<super": "^", "<sub": "_"}.get(kind)
    if sign is not None and len(made_of) == 1 and made_of[0].isascii() and made_of[0].isalnum():
        return rf"\ensuremath{{{{}}{sign}{{{made_of[0]}}}}}"
    if not kind and len(made_of) == 2 and made_of[0].isascii() and made_of[0].isalpha():
        accent = _ACCENTS.get(made_of[1])
        return None if accent is None else f"{accent}{{{made_of[0]}}}"
    return None


def latex_prose(text: str) -> str:
    """Write a title or description, which may hold formulas between dollars."""
    return with_formulas(text, latex_text, lambda formula: f"${formula}$")


def printable(text: str) -> str:
    """Return text with spaces in place of control characters, which XML and LaTeX do not allow."""
    return "".join(c if c.isprintable() else " " for c in text)


def latex_text(text: str) -> str:
    """Escape text for LaTeX text mode: no character of it acts as a command.

    Greek letters, common signs, Latin letters with accents and small digits print as they
    are; whatever pdfLaTeX has no glyph for prints as its code point
    (``[U+4E2D]``); line breaks and control characters become spaces, so that
    no line can end a group or begin a paragraph.
    """
    composed = unicodedata.normalize("NFC", text)
    return " ".join("".join(_latex_character(c) for c in composed).split())


_NAMES_OF_GREEK = {letter: name for name, letter in GREEK.items()}

_DOTS = {1: "\u0307", 2: "\u0308"}
#: The scene language's functions for first and second total time derivative.
DOT_WORDS = {1: "dot", 2: "ddot"}
_DOT_MACROS = {1: r"\dot", 2: r"\ddot"}


@dataclass(frozen=True, slots=True)
class NameParts:
    """A name's base and the parts of its subscript (``x_1_2`` has two)."""

    base: str
    subscripts: tuple[str, ...] = ()

    @property
    def is_letter(self) -> bool:
        """Return the base shows as one letter, so that a dot can stand over it."""
        return len(self.base) == 1 or self.base in GREEK


_MULTIPLIER = re.compile(r"lambda\((.+)\)")


def multiplier_name(constraint: str) -> str:
    """Name of a constraint's multiplier: ``lambda(rod)``.

    No name of a scene holds parentheses, so that none can be meant by it.
    """
    return f"lambda({constraint})"


def multiplier_symbol(name: str) -> str:
    """A name as the scene language writes it: the symbol ``lambda_rod`` for ``lambda(rod)``."""
    multiplier = _MULTIPLIER.fullmatch(name)
    return f"lambda_{multiplier[1]}" if multiplier else name


def split_name(name: str) -> NameParts:
    """Split ``theta1``, ``x_bob``, ``x[1,2]``, ``lambda(rod)`` into base and subscripts."""
    multiplier = _MULTIPLIER.fullmatch(name)
    if multiplier:
        words = multiplier[1].split("_")
        if len(words) > 2 and all(len(word) > 1 and word.isalpha() for word in words):
            # A constraint named by a phrase: its words are no indices, between which commas stand.
            return NameParts("lambda", (" ".join(words),))
        inner = split_name(multiplier[1])
        return NameParts("lambda", (inner.base, *inner.subscripts))
    indexed = re.fullmatch(r"([^\[\]]+)\[([^\[\]]+)\]", name)
    if indexed:
        inner = split_name(indexed[1])
        indices = tuple(part.strip() for part in indexed[2].split(","))
        return NameParts(inner.base, inner.subscripts + indices)
    head, *subscripts = name.split("_")
    if not head or not all(subscripts):
        return NameParts(name)
    numbered = re.fullmatch(r"([^\W\d_]+)(\d+)", head)
    if numbered:
        return NameParts(numbered[1], (numbered[2], *subscripts))
    lettered = re.fullmatch(r"([^\W\d_])(\d\w*)", head)
    if lettered:
        return NameParts(lettered[1], (lettered[2], *subscripts))
    return NameParts(head, tuple(subscripts))


#: Letters and signs of indices that stand below and above the line in Unicode.
_BELOW = str.maketrans("0123456789+-=<aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉₊₋₌<ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
_ABOVE = str.maketrans("0123456789+-ijkmn", "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ⁱʲᵏᵐⁿ")
_INDICES = re.compile(r"\[([^\]]+)\]|(?<=[^\W\d_]|[\u0307\u0308])(\d+)(?=[_)]|$)")


def below(text: str) -> str | None:
    """Return an index below the line, ``ᵢ₊₁``; None if Unicode has not all of its letters there."""
    lowered = text.translate(_BELOW)
    known = all(c in ",≠<" or c != d for c, d in zip(text, lowered, strict=True))
    return lowered if known else None


def above(text: str) -> str | None:
    """Return the end of a sum above the line, ``ⁿ⁻¹``; None as of :func:`below`."""
    raised = text.translate(_ABOVE)
    return raised if all(c != d for c, d in zip(text, raised, strict=True)) else None


def with_indices_below(text: str) -> str:
    """A name that was printed, with its indices below the line: ``u₂`` for ``u[2]`` and ``u2``."""
    return _INDICES.sub(lambda m: below(m[1] or m[2]) or m[0], text)


def text_name(name: str, order: int = 0) -> str:
    """Return a name in Unicode text with ``order`` dots: ``θ̇1``, ``ẍ``, ``p_θ``, ``dot(angle)``.

    Words keep the scene's ``dot(...)``: a dot over one letter of a word reads
    as an accent.
    """
    multiplier = _MULTIPLIER.fullmatch(name)
    if multiplier:
        return f"{GREEK['lambda']}_{text_name(multiplier[1])}"
    parts = split_name(name)
    base = GREEK.get(parts.base, parts.base)
    head, *subscripts = name[len(parts.base) :].split("_")
    indices = "_".join((head, *(text_name(s) if s else s for s in subscripts)))
    if order == 0:
        return base + indices
    if not parts.is_letter:
        return f"{DOT_WORDS[order]}({base}{indices})"
    return unicodedata.normalize("NFC", base + _DOTS[order]) + indices


_MACRO = re.compile(r"\\(\w+) ?")
_SCRIPT = re.compile(r"([\^_])(?:\{([^{}]*)\}|(.))")
_PLAIN_MACROS = {"pi": "π", "ell": "ℓ", "times": "×", "cdot": "·", "infty": "∞", "pm": "±"}
_ACCENTED = re.compile(r"\\(d?dot) *(?:\{(\w)\}|(\w))")


def text_prose(text: str) -> str:
    """Write a title whose formulas between dollars have plain letters: ``α`` for ``$\\alpha$``.

    Formulas that Unicode has no letters for stay as they are.
    """
    return with_formulas(text, str, lambda formula: _plain_formula(formula) or f"${formula}$")


def _plain_formula(formula: str) -> str | None:
    """Return a formula of LaTeX in Unicode, None if it holds more than letters and scripts."""
    letters = GREEK | _PLAIN_MACROS
    plain = _MACRO.sub(lambda m: letters.get(m[1], m[0]), formula)
    orders = {word: order for order, word in DOT_WORDS.items()}
    plain = _ACCENTED.sub(
        lambda m: unicodedata.normalize("NFC", (m[2] or m[3]) + _DOTS[orders[m[1]]]), plain
    )
    written = {"^": above, "_": below}
    plain = _SCRIPT.sub(lambda m: written[m[1]](m[2] or m[3]) or m[0], plain)
    return None if any(c in "\\{}^" for c in plain) else plain


def _latex_word(word: str, *, upright: bool = False) -> str:
    """Return a base or subscript in math mode: letter, number, Greek macro or upright word."""
    if word in GREEK:
        return "\\" + word
    if word in _NAMES_OF_GREEK:
        return "\\" + _NAMES_OF_GREEK[word]
    if word.isascii() and (word.isdigit() or (len(word) == 1 and word.isalpha() and not upright)):
        return word
    return rf"\mathrm{{{word}}}" if word.isascii() and word.isalnum() else _in_text(word)


def _in_text(word: str) -> str:
    return rf"\text{{{latex_text(word)}}}"


#: One letter, and what stands below it: dots stand over the letter.
_LETTER_BELOW = re.compile(r"(\\[A-Za-z]+|[A-Za-z])(_.+)")


def latex_name(name: str, order: int = 0, override: str | None = None) -> str:
    """Return a name in LaTeX math with ``order`` dots over its base: ``\\dot{\\theta}_{1}``.

    ``override`` is the scene's ``latex:`` key, which its reader has checked
    against an allowlist of math macros.
    """
    if override is not None:
        letter = _LETTER_BELOW.fullmatch(override) if order else None
        if letter:
            return f"{_DOT_MACROS[order]}{{{letter[1]}}}{letter[2]}"
        return f"{_DOT_MACROS[order]}{{{override}}}" if order else f"{{{override}}}"
    parts = split_name(name)
    base = _latex_word(parts.base)
    if order:
        base = f"{_DOT_MACROS[order]}{{{base}}}"
    if not parts.subscripts:
        return base
    return f"{base}_{{{','.join(subscript(s, latex_name, _latex_word) for s in parts.subscripts)}}}"


def subscript(
    part: str,
    name: Callable[[str], str],
    word: Callable[[str], str],
    shift: Callable[[str], str] = str,
) -> str:
    """Return a subscript, which may have one itself: that of ``p_theta1`` is θ₁.

    Parameters
    ----------
    part
        A letter with subscripts, a word, or an index that is moved, as ``i-1``.
    name, word
        Write a name, and a word or number.
    shift
        Writes what an index is moved by.
    """
    moved = re.fullmatch(r"([^\W\d]\w*)?([+-]\d+)", part)
    if moved:
        return (subscript(moved[1], name, word) if moved[1] else "") + shift(moved[2])
    is_letter = split_name(part).is_letter and not part[0].isdigit()
    return name(part) if is_letter else word(part)


def scientific(literal: str) -> tuple[str, int | None]:
    """Split a decimal at its power of ten: ``("6.67", -11)``, ``("9.81", None)``, ``("", -31)``."""
    mantissa, _, exponent = literal.lower().partition("e")
    if not exponent:
        return mantissa, None
    return "" if mantissa in ("1", "1.0", "1.") else mantissa, int(exponent)


#: A symbol, a number or a sign in the text of a unit.
_UNIT_PART = re.compile(r"([^\W\d_]+)|(\d+)|\s*([*·]|\s)\s*|\^\(([-+\d/.]+)\)|\^(-?\d+)|([/()])")


@dataclass(frozen=True)
class UnitLetters:
    """Letters of units in a format.

    ``symbol``, ``number`` and ``sign`` write ``kg``, a whole number and one of ``/()``, ``power`` a
    base with its exponent, and ``words`` a text that is no unit; ``nothing`` stands for the base of
    a power without one, ``between`` for a product.
    """

    symbol: Callable[[str], str]
    number: Callable[[str], str]
    sign: Callable[[str], str]
    power: Callable[[str, str], str]
    words: Callable[[str], str]
    between: str
    nothing: str = ""

    def written(self, unit: str) -> str:
        """Return a unit, ``kg*m^2/s`` with upright symbols; other texts as they are."""
        parts: list[str] = []
        place = 0
        while place < len(unit):
            part = _UNIT_PART.match(unit, place)
            if part is None:
                return self.words(unit)
            symbol, number, between, power, short_power, sign = part.groups()
            if symbol:
                parts.append(self.symbol(symbol))
            elif between is not None:
                parts.append(self.between)
            elif power or short_power:
                base = parts.pop() if parts else self.nothing
                parts.append(self.power(base, power or short_power))
            else:
                parts.append(self.number(number) if number else self.sign(sign))
            place = part.end()
        return "".join(parts)


#: Units in LaTeX.
latex_unit = UnitLetters(
    symbol=lambda name: rf"\mathrm{{{name}}}" if name.isascii() else _in_text(name),
    number=str,
    sign=str,
    power=lambda base, exponent: f"{base}^{{{exponent}}}",
    words=_in_text,
    between=r"\,",
).written
