"""Text from a scene as LaTeX text, and the letters that have a Greek name."""

from __future__ import annotations

import unicodedata

from lagrange_cli.latex_allowlist import with_formulas

_GREEK_NAMES = """
    alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi rho sigma tau upsilon
    phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega
    vartheta varphi varepsilon
"""
#: Greek letters by name. Capitals that look like Latin ones (``Alpha``) are left
#: as words, because they would print as another name.
GREEK = dict(zip(_GREEK_NAMES.split(), "αβγδεζηθικλμνξρστυφχψωΓΔΘΛΞΠΣΥΦΨΩϑϕϵ", strict=True))

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


def latex_text(text: str) -> str:
    """Escape text for LaTeX text mode: no character of it acts as a command.

    Greek letters, common signs, Latin letters with accents and small digits print as they
    are; whatever pdfLaTeX has no glyph for prints as its code point
    (``[U+4E2D]``); line breaks and control characters become spaces, so that
    no line can end a group or begin a paragraph.
    """
    composed = unicodedata.normalize("NFC", text)
    return " ".join("".join(_latex_character(c) for c in composed).split())
