"""Expressions as MathML Core, as browsers show it: fractions, roots, scripts, dots.

Each piece of a formula is well-formed by itself, so that parentheses are signs without an element
around what they hold, wherever a line may be broken between them.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from html import escape, unescape
from typing import ClassVar

from lagrange_cli.latex_allowlist import Accent, LatexPart, Script, Sign, latex_parts
from lagrange_cli.notation.printers.typeset import TypesetPrinter
from lagrange_cli.notation.symbols import (
    GREEK,
    SIGNS,
    UnitLetters,
    latex_name,
    printable,
    scientific,
    split_name,
    subscript,
)
from lagrange_cli.notation.tree import DisplayCall, DisplayNode, DisplayNumber

_NAMESPACE = "http://www.w3.org/1998/Math/MathML"

_DOTS = {1: "˙", 2: "¨"}

#: Accents of ``latex`` keys that are as wide as a letter, and those that stretch over all.
_ACCENTS = {
    "hat": "ˆ",
    "tilde": "˜",
    "bar": "¯",
    "vec": "→",
    "check": "ˇ",
    "breve": "˘",
    "acute": "´",
    "grave": "`",
    "mathring": "˚",
    "dot": _DOTS[1],
    "ddot": _DOTS[2],
}
_STRETCHED = {"widehat": "ˆ", "widetilde": "˜", "overline": "¯"}

#: Alphabets of ``latex`` keys, as Unicode calls them.
_ALPHABETS = {
    "mathbf": "BOLD",
    "boldsymbol": "BOLD ITALIC",
    "mathsf": "SANS-SERIF",
    "mathtt": "MONOSPACE",
    "mathcal": "SCRIPT",
    "mathscr": "SCRIPT",
    "mathbb": "DOUBLE-STRUCK",
    "mathfrak": "FRAKTUR",
}

#: Widths of spaces of ``latex`` keys, in em.
_SPACES = {"quad": 1, "qquad": 2, ",": 0.167, ":": 0.222, ";": 0.278, "!": 0, " ": 0.333}

#: Signs of ASCII that mathematics has others for.
_TYPESET = {"-": "−", "*": "∗"}

_TAG = re.compile(r"<(/?)[^>]*?(/?)>")
_INDEX_PART = re.compile(r"([^\W\d_]+)|(\d+)|(\S)")
#: A name of several letters at the beginning, whatever it bears.
_WORD = re.compile(r"(?:<m[^>]*>)*?<mi[^>]*>\w{2,}")
_MARKUP = re.compile(r"<[^>]*>|&#x206[12];")
_LEAF = re.compile(r"(<m(?:i|n|o|text)\b[^>]*>[^<]*</\w+>|<[^>]*>)")
#: A number, a name or a sign between elements.
_BARE = re.compile(
    r"(\d+(?:\.\d+)?(?:e[-+]?\d+)?)|([^\W\d_]\w*)|((?<=[\w)])-|[-+](?=\s)|=)|(\S)|\s+"
)


def mathml(body: str, *, block: bool = False) -> str:
    """Return a formula as an element of HTML; ``block``: in the middle of a line of its own."""
    display = ' display="block"' if block else ""
    return f'<math xmlns="{_NAMESPACE}"{display}>{body}</math>'


def mathml_table(rows: Iterable[Sequence[str]], sides: Sequence[str]) -> str:
    """Return rows of cells, at the ``left`` or ``right`` side of each column.

    Chromium aligns what is within cells by a keyword of its own.
    """
    styles = [f"text-align:{side};text-align:-webkit-{side}" for side in sides]
    lines = (
        "".join(f'<mtd style="{style}">{c}</mtd>' for style, c in zip(styles, row, strict=True))
        for row in rows
    )
    return f'<mtable displaystyle="true">{"".join(f"<mtr>{line}</mtr>" for line in lines)}</mtable>'


def mathml_text(text: str) -> str:
    """Return text in upright letters; no character of it acts as markup."""
    return f"<mtext>{escape(printable(text), quote=False)}</mtext>"


def mathml_space(width: float) -> str:
    """Return a space of a width in em."""
    return f'<mspace width="{width:g}em"/>'


def mathml_name(name: str, order: int = 0, override: str | None = None, primes: int = 0) -> str:
    """Return a name in MathML, as one element.

    Parameters
    ----------
    name
        A name of the scene.
    order
        Number of dots over its base.
    override
        The scene's ``latex:`` key, which its reader has checked.
    primes
        Number of primes.
    """
    prime = _operator("′" * primes) if primes else ""
    if override is not None:
        return mathml_scripted(mathml_of_latex(latex_name(name, order, override)), above=prime)
    parts = split_name(name)
    base = _word(parts.base)
    base = _accented(base, _operator(_DOTS[order])) if order else base
    below = _tight(",").join(subscript(s, mathml_name, _word, _index) for s in parts.subscripts)
    return mathml_scripted(base, below, prime)


def mathml_scripted(base: str, below: str = "", above: str = "") -> str:
    """Return one element with an index and an exponent, each empty for none."""
    if not (below or above):
        return base
    tag = "msub" * bool(below) + ("sup" if below else "msup") * bool(above)
    scripts = "".join(mathml_row(script) for script in (below, above) if script)
    return f"<{tag}>{base}{scripts}</{tag}>"


def mathml_number(literal: str) -> str:
    """Return a decimal as the scene wrote it: ``9.81``, ``1e-31`` as a power of ten."""
    mantissa, exponent = scientific(literal)
    if exponent is None:
        return f"<mn>{mantissa}</mn>"
    power = mathml_scripted("<mn>10</mn>", above=_index(str(exponent)))
    return f"<mrow><mn>{mantissa}</mn><mo>×</mo>{power}</mrow>" if mantissa else power


def mathml_of_latex(text: str) -> str:
    """Return an allowed formula of LaTeX in MathML, as one element."""
    return mathml_row(_parts(latex_parts(text)))


def mathml_signs(text: str) -> str:
    """Return a formula whose numbers, letters and signs between elements are elements, too.

    A minus is that of a difference if a blank follows, or an operand stands before it.
    """
    return "".join(p if p[:1] == "<" else _BARE.sub(_bare, p) for p in _LEAF.split(text))


def _bare(match: re.Match[str]) -> str:
    number, name, infix, sign = match.groups()
    if number or name:
        return mathml_number(number) if number else mathml_name(name)
    if infix:
        return f'<mo form="infix">{_TYPESET.get(infix, infix)}</mo>'
    return '<mo form="prefix">−</mo>' if sign == "-" else _character(sign) if sign else ""


def mathml_row(text: str) -> str:
    """Return any number of elements as one."""
    depth = 0
    for tag in _TAG.finditer(text):
        depth += -1 if tag[1] else 0 if tag[2] else 1
        if depth == 0:
            return text if tag.end() == len(text) else f"<mrow>{text}</mrow>"
    return "<mrow/>"


def _operator(sign: str, size: str = "") -> str:
    """Return a sign; parentheses and bars are of the height of letters, or of a given one."""
    fixed = f' minsize="{size}" maxsize="{size}"' if size else ' stretchy="false"'
    return f"<mo{fixed if sign in '()|' else ''}>{escape(_TYPESET.get(sign, sign))}</mo>"


def _tight(sign: str) -> str:
    """Return a sign of an index or exponent, without the spaces of a line."""
    fixed = ' stretchy="false"' if sign in "()" else ""
    return f'<mo lspace="0em" rspace="0em"{fixed}>{escape(_TYPESET.get(sign, sign))}</mo>'


def _accented(base: str, accent: str) -> str:
    return f'<mover accent="true">{base}{accent}</mover>'


def _identifier(text: str, *, upright: bool = False) -> str:
    """Return letters; browsers slant a single one if it is not to be upright."""
    variant = ' mathvariant="normal"' if upright or len(text) > 1 else ""
    return f"<mi{variant}>{escape(text)}</mi>"


def _character(character: str) -> str:
    """Return a letter, digit or sign; capital Greek letters and ∇ are upright, as in LaTeX."""
    if character.isdecimal():
        return f"<mn>{character}</mn>"
    if character.isalpha() or character in "∂∇∞…":
        return _identifier(character, upright="Α" <= character <= "Ω" or character == "∇")
    return _operator(character)


def _word(word: str) -> str:
    """Return a base or subscript: letter, number, Greek letter or upright word."""
    letter = GREEK.get(word, word)
    if letter in GREEK.values() or (len(word) == 1 and word.isascii()):
        return _character(letter)
    is_number = word.isascii() and word.isdigit()
    return f"<mn>{word}</mn>" if is_number else _identifier(printable(word), upright=True)


def _index(text: str) -> str:
    """Return an index, an end of its values, or a relation between indices: ``j = i+1``."""
    return "".join(
        _word(letters) if letters else f"<mn>{digits}</mn>" if digits else _tight(sign)
        for letters, digits, sign in _INDEX_PART.findall(text)
    )


# -- ``latex`` keys -----------------------------------------------------------------------


def _parts(parts: Iterable[LatexPart]) -> str:
    """Return parts beside each other, with digits in one number."""
    shown = [""]
    for text in map(_part, parts):
        if text.startswith("<mn>") and shown[-1].endswith("</mn>"):
            text = shown.pop().removesuffix("</mn>") + text.removeprefix("<mn>")
        shown.append(text)
    return "".join(shown)


def _part(part: LatexPart) -> str:
    """Return a part of a formula with its scripts or accents, as one element or a space."""
    match part:
        case Script(Script(base, "_", below), sign, above) if sign != "_":
            return mathml_scripted(_bearer(base), _script("_", below), _script(sign, above))
        case Script(Script(base, sign, above), "_", below):
            return mathml_scripted(_bearer(base), _script("_", below), _script(sign, above))
        case Script(base, "_", below):
            return mathml_scripted(_bearer(base), _script("_", below))
        case Script(base, sign, above):
            return mathml_scripted(_bearer(base), above=_script(sign, above))
        case Accent(macro, body):
            return _with_macro(macro, body)
        case Sign(text) if text.startswith("\\") and text[1:] in _SPACES:
            return mathml_space(_SPACES[text[1:]])
        case Sign(text):
            return _character(_printed(text))


def _bearer(base: LatexPart | None) -> str:
    return "<mrow/>" if base is None else _part(base)


def _script(sign: str, script: Sequence[LatexPart]) -> str:
    return _operator("′") if sign == "'" else mathml_row(_parts(script))


def _with_macro(macro: str, body: Sequence[LatexPart]) -> str:
    """Return a body with an accent or in an alphabet."""
    inner = mathml_row(_parts(body))
    if macro in _ACCENTS:
        return _accented(inner, f'<mo stretchy="false">{_ACCENTS[macro]}</mo>')
    if macro in _STRETCHED:
        return _accented(inner, _operator(_STRETCHED[macro]))
    if macro == "underline":
        return f'<munder accentunder="true">{inner}<mo>_</mo></munder>'
    signs = [part.text for part in body if isinstance(part, Sign)]
    if macro == "mathit" or len(signs) != len(body) or not signs:
        return inner
    letters = "".join("" if sign[1:] in _SPACES else _printed(sign) for sign in signs)
    alphabet = _ALPHABETS.get(macro)
    return _identifier(letters if alphabet is None else _styled(letters, alphabet), upright=True)


def _printed(sign: str) -> str:
    """Return the character of a sign."""
    return GREEK.get(sign[1:]) or SIGNS[sign[1:]] if sign.startswith("\\") else sign


def _styled(letters: str, alphabet: str) -> str:
    """Return letters in an alphabet of Unicode's, where it has them."""
    return "".join(_styled_letter(letter, alphabet) for letter in letters)


def _styled_letter(letter: str, alphabet: str) -> str:
    name = re.sub("LATIN |GREEK |LETTER ", "", unicodedata.name(letter))
    for styled in (f"MATHEMATICAL {alphabet} {name}", f"{alphabet} {name}", f"BLACK-LETTER {name}"):
        try:
            return unicodedata.lookup(styled)
        except KeyError:
            continue
    return letter


# -- expressions --------------------------------------------------------------------------

_NAMES = {
    **{name: name for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "min", "max")},
    **{f"a{name}": f"arc{name}" for name in ("sin", "cos", "tan")},
    **{f"a{name}": f"ar{name}" for name in ("sinh", "cosh", "tanh")},
    **{name: name for name in ("atan2", "abs")},
    "sign": "sgn",
    "heaviside": "H",
    "log": "ln",
}

#: Function of the scene language → its name.
MATHML_FUNCTIONS = {function: f"<mi>{name}</mi>" for function, name in _NAMES.items()}

_UPRIGHT_D = '<mi mathvariant="normal">d</mi>'


class MathmlPrinter(TypesetPrinter):
    """MathML Core; the width of pieces is in columns of half an em."""

    functions = MATHML_FUNCTIONS
    times = "<mo>&#x2062;</mo>"
    lead = '<mo form="infix">⋅</mo>'
    negation = '<mo form="prefix">−</mo>'
    pi = "<mi>π</mi>"
    at_least = "<mo>≥</mo>"
    ddt = f"<mfrac>{_UPRIGHT_D}<mrow>{_UPRIGHT_D}<mi>t</mi></mrow></mfrac>"
    dot = "<mo>⋅</mo>"
    thin = times + mathml_space(0.167)
    tall = _operator("(", size="1.8em"), _operator(")", size="1.8em")
    brackets = _operator("("), _operator(")")
    comma = _operator(",")
    unequal = "≠"
    applied = "<mo>&#x2061;</mo>"
    applied_to_letter = applied + mathml_space(0.167)
    number_openings = ("<mn>", "<msup><mn>", "<mrow><mn>")
    ratio_opening = "<mfrac>"
    root_opening = "<msqrt>"
    sum_opening = "<mo>∑</mo>"
    bars_opening = "<mrow><mo>|</mo>"
    cases_opening = "<mrow><mo>{</mo>"
    relations: ClassVar = {
        ">=": "<mo>≥</mo>",
        "<=": "<mo>≤</mo>",
        ">": "<mo>&gt;</mo>",
        "<": "<mo>&lt;</mo>",
    }
    word_openings = ()
    group_openings = ("<mo", "<mrow><mo>(</mo>")

    def name(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return mathml_name(name, order, latex)

    def function(self, node: DisplayCall) -> str:
        return mathml_name(node.function, 0, node.latex, node.order or 0)

    def decimal(self, literal: str) -> str:
        return mathml_number(literal)

    def integer(self, number: int) -> str:
        return f"<mn>{number}</mn>"

    def ratio(self, above: str, below: str) -> str:
        return f"<mfrac>{mathml_row(above)}{mathml_row(below)}</mfrac>"

    def radical(self, body: str) -> str:
        return f"<msqrt>{body}</msqrt>"

    def stack(self, lines: Sequence[str]) -> str:
        indents = ("", *[mathml_space(1)] * (len(lines) - 1))
        rows = ((indent + line,) for indent, line in zip(indents, lines, strict=True))
        return mathml_table(rows, ("left",))

    def big_sum(self, under: str, over: str) -> str:
        tag = "munderover" if over else "munder"
        parts = "".join(mathml_row(_index(part)) for part in (under, over) if part)
        return f"<{tag}>{self.sum_opening}{parts}</{tag}>"

    def magnitude(self, body: str) -> str:
        return f"{self.bars_opening}{body}<mo>|</mo></mrow>"

    def cases(self, rows: Sequence[tuple[str, Sequence[str]]]) -> str:
        separator = self.comma + mathml_space(0.5)
        cells = ((value + self.comma, separator.join(conditions)) for value, conditions in rows)
        return f"{self.cases_opening}{mathml_table(cells, ('left', 'left'))}</mrow>"

    def exponential(self, exponent: str) -> str:
        return mathml_scripted(_identifier("e", upright=True), above=exponent)

    def slashed(self, node: DisplayNumber) -> str:
        return f"{self.integer(node.numerator)}{_tight('/')}{self.integer(node.denominator)}"

    def raised(self, exponent: str) -> str:
        return exponent

    def superscript(self, base: str, exponent: str) -> str:
        """Return a base with an exponent, which stands at the last parenthesis if there is one."""
        for closing in (self.brackets[1], self.tall[1]):
            if base.endswith(closing):
                # Chromium gives a sign that has an exponent its size within a row alone.
                bearer = f"<mrow>{closing}</mrow>" if closing == self.tall[1] else closing
                return base.removesuffix(closing) + mathml_scripted(bearer, above=exponent)
        if base.startswith("<msub>"):
            inner = base.removeprefix("<msub>").removesuffix("</msub>")
            return f"<msubsup>{inner}{mathml_row(exponent)}</msubsup>"
        return mathml_scripted(base, above=exponent)

    def fenced(self, body: str) -> str:
        return f"<mrow><mo>(</mo>{body}<mo>)</mo></mrow>"

    def sign(self, negative: bool) -> tuple[str, str]:
        sign = "−" if negative else "+"
        return f"<mo>{sign}</mo>", f'<mo form="infix">{sign}</mo>'

    def separator(self, before: DisplayNode, after: str) -> str:
        usual = super().separator(before, after)
        return self.thin if usual == self.times and _WORD.match(after) else usual

    def columns(self, text: str) -> float:
        return len(unescape(_MARKUP.sub("", text)))

    def spelled_width(self, text: str) -> float:
        return self.columns(text) * (1 if text.startswith("<mtext>") else 1.2)

    def exponent_width(self, exponent: str) -> float:
        return 0.8 * self.columns(exponent)


#: Units in upright letters.
mathml_unit = UnitLetters(
    symbol=lambda name: _identifier(name, upright=True),
    number=lambda digits: f"<mn>{digits}</mn>",
    sign=_tight,
    power=lambda base, exponent: mathml_scripted(base, above=_index(exponent)),
    words=mathml_text,
    between=mathml_space(0.167),
    nothing="<mrow/>",
).written
