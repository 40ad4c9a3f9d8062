"""Expressions as Typst's mathematics: ``frac(1, 2) M (dot(r)^2 + r^2 dot(theta)^2)``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import ClassVar

from lagrange_cli.latex_allowlist import (
    Accent,
    LatexPart,
    Script,
    Sign,
    latex_parts,
    with_formulas,
)
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
from lagrange_cli.notation.tree import DisplayCall, DisplayNumber
from lagrange_cli.scene.language.expression import CONDITIONS

#: Greek letters as Typst calls them where it has another name for what LaTeX prints.
_VARIANTS = {
    "epsilon": "epsilon.alt",
    "varepsilon": "epsilon",
    "phi": "phi.alt",
    "varphi": "phi",
    "vartheta": "theta.alt",
}
_GREEK = {name: _VARIANTS.get(name, name) for name in GREEK}
_GREEK_LETTERS = {letter: _GREEK[name] for name, letter in GREEK.items()}

_DOTS = {1: "dot", 2: "dot.double"}

_SPACES = {
    "quad": "quad",
    "qquad": "wide",
    ",": "thin",
    ":": "med",
    ";": "thick",
    "!": "",
    " ": "space",
}

#: Macros of one argument in ``latex`` keys.
_MACROS = {
    **{name: name for name in ("hat", "tilde", "overline", "underline", "breve", "acute", "grave")},
    "widehat": "hat",
    "widetilde": "tilde",
    "bar": "macron",
    "vec": "arrow",
    "dot": "dot",
    "ddot": "dot.double",
    "check": "caron",
    "mathring": "circle",
    "mathrm": "upright",
    "operatorname": "upright",
    "mathit": "italic",
    "mathsf": "sans",
    "mathtt": "mono",
    "mathcal": "cal",
    "mathscr": "cal",
    "mathbb": "bb",
    "mathfrak": "frak",
    "boldsymbol": "bold",
}

#: A symbol that prints nothing: scripts need one that bears them, signs one on each side.
EMPTY = '""'

#: What needs no parentheses as an index or exponent.
_SOLID = re.compile(r'\d+|[A-Za-z]+|"[^"\\]*"')

#: Punctuation of ASCII that stands for itself anywhere in a paragraph.
_PLAIN = frozenset(" ,;:!?()%^&|{}>.")


def typst_text(text: str) -> str:
    """Escape text for Typst's markup: no character of it acts as markup or code.

    Line breaks and characters that do not print become spaces, so that no line begins a list, a
    heading or a comment.
    """
    plain = " ".join(printable(text).split())
    shown = "".join(
        rf"\{c}" if c.isascii() and not c.isalnum() and c not in _PLAIN else c for c in plain
    )
    # Numbers of lists, and ellipses.
    return re.sub(r"^(\d+)\.|(?<=\.)\.", r"\1\\.", shown)


def typst_prose(text: str) -> str:
    """Write a title or description, which may hold formulas of LaTeX between dollars."""
    return with_formulas(text, typst_text, lambda formula: f"${_of_latex(formula)}$")


def typst_string(text: str) -> str:
    """Text as a string of Typst, which prints upright in formulas."""
    plain = printable(text)
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"') + '"'


def typst_name(name: str, order: int = 0, override: str | None = None, primes: int = 0) -> str:
    """Return a name in Typst's mathematics: ``dot(theta)_1``, ``x_"bob"``, ``V'_1``.

    A parenthesis that follows an index without a blank would belong to it.

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
    if override is not None:
        return _of_latex(latex_name(name, order, override)) + "'" * primes
    parts = split_name(name)
    base = _word(parts.base)
    base = (f"{_DOTS[order]}({base})" if order else base) + "'" * primes
    if not parts.subscripts:
        return base
    return typst_scripted(
        base, "_", ", ".join(subscript(s, typst_name, _word) for s in parts.subscripts)
    )


def typst_scripted(base: str, sign: str, script: str) -> str:
    """Return a base with an index or exponent, in parentheses where it is more than a word."""
    return f"{base}{sign}{script}" if _SOLID.fullmatch(script) else f"{base}{sign}({script})"


def _word(word: str) -> str:
    """Return a base or subscript: letter, number, Greek letter or upright word."""
    if word in _GREEK:
        return _GREEK[word]
    if word in _GREEK_LETTERS:
        return _GREEK_LETTERS[word]
    single = word.isascii() and len(word) == 1 and word.isalpha()
    return word if single or (word.isascii() and word.isdigit()) else typst_string(word)


#: Units in Typst's mathematics, in upright letters.
typst_unit = UnitLetters(
    symbol=lambda name: f"upright({typst_string(name)})",
    number=str,
    sign=lambda sign: rf"\{sign}",
    power=lambda base, exponent: typst_scripted(base, "^", exponent.replace("/", r"\/")),
    words=typst_string,
    between=" thin ",
    nothing=EMPTY,
).written


# -- ``latex`` keys -----------------------------------------------------------------------


def _of_latex(text: str) -> str:
    """Return the allowed LaTeX of a ``latex:`` key in Typst."""
    shown = _parts(latex_parts(text))
    # What follows must not become a part of an index or exponent.
    return f"scripts({shown})" if set("^'_") & set(text) else shown


def _parts(parts: Iterable[LatexPart]) -> str:
    return " ".join(map(_part, parts))


def _part(part: LatexPart) -> str:
    """Return a part of a formula with its scripts or accents."""
    match part:
        case Script(base, sign, script):
            bearer = EMPTY if base is None else _part(base)
            return bearer + sign if sign == "'" else typst_scripted(bearer, sign, _body(script))
        case Accent("mathbf", body):
            return f"upright(bold({_body(body)}))"
        case Accent(macro, body):
            return f"{_MACROS[macro]}({_body(body)})"
        case Sign(text) if text.startswith("\\"):
            name = text[1:]
            return _SPACES[name] if name in _SPACES else _GREEK.get(name) or SIGNS[name]
        case Sign(text):
            return rf"\{text}" if text in "(),/" else text


def _body(parts: Iterable[LatexPart]) -> str:
    return _parts(parts) or EMPTY


#: Function of the scene language → its name in Typst.
TYPST_FUNCTIONS = {
    **{name: name for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "min", "max")},
    **{f"a{name}": f"arc{name}" for name in ("sin", "cos", "tan")},
    **{f"a{name}": f'op("ar{name}")' for name in ("sinh", "cosh", "tanh")},
    **{name: f'op("{name}")' for name in ("atan2", "abs")},
    "sign": 'op("sgn")',
    "heaviside": 'op("H")',
    "log": "ln",
}

#: Begins a line that goes on with a sign, which then stands between two terms.
CONTINUED = f"{EMPTY} "

#: A string or an escaped character, or a parenthesis.
_PART = re.compile(r'"(?:\\.|[^"\\])*"|\\.|[()]')


class TypstPrinter(TypesetPrinter):
    """Typst, whose parentheses are as tall as what they hold."""

    functions = TYPST_FUNCTIONS
    lead = "dot.op "
    pi = "pi"
    ddt = "frac(upright(d), upright(d) t)"
    dot = " dot.op "
    thin = " thin "
    tall = r"lr(\(, size: #2em) ", r" lr(\), size: #2em)"
    unequal = "!="
    ratio_opening = "frac("
    root_opening = "sqrt("
    sum_opening = "sum_("
    bars_opening = "abs("
    cases_opening = "cases("
    relations: ClassVar = {relation: relation for relation in CONDITIONS}
    # Typst sets spaces beside words by itself, but not beside those with dots.
    word_openings = ('dot("', 'dot.double("')
    group_openings = ("(", "lr(")

    def name(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return typst_name(name, order, latex)

    def function(self, node: DisplayCall) -> str:
        return typst_name(node.function, 0, node.latex, node.order or 0) + " "

    def decimal(self, literal: str) -> str:
        return typst_number(literal)

    def ratio(self, above: str, below: str) -> str:
        return f"frac({above}, {below})"

    def radical(self, body: str) -> str:
        return f"sqrt({body})"

    def stack(self, lines: Sequence[str]) -> str:
        return "& " + rf" \ & quad {CONTINUED}".join(balanced(lines))

    def big_sum(self, under: str, over: str) -> str:
        return f"sum_({under})" + (f"^({over})" if over else "")

    def magnitude(self, body: str) -> str:
        return f"abs({body})"

    def cases(self, rows: Sequence[tuple[str, Sequence[str]]]) -> str:
        lines = (rf"{value}\, & " + r"\, thick ".join(conditions) for value, conditions in rows)
        return f"cases({', '.join(lines)})"

    def exponential(self, exponent: str) -> str:
        return typst_scripted("upright(e)", "^", exponent)

    def slashed(self, node: DisplayNumber) -> str:
        return rf"{node.numerator}\/{node.denominator}"

    def raised(self, exponent: str) -> str:
        return typst_scripted("", "^", exponent)

    def exponent_width(self, exponent: str) -> float:
        return 0.8 * len(re.sub(r"[A-Za-z]{2,}", "x", re.sub(r'[()^\s"]', "", exponent)))

    def fenced(self, body: str) -> str:
        return f"({body})"


def balanced(lines: Iterable[str]) -> list[str]:
    """Escape parentheses whose other one is on another line, which Typst would join to it."""
    return [_balanced(line) for line in lines]


def _balanced(line: str) -> str:
    opened, lonely = [], []
    for part in _PART.finditer(line):
        if part.group() == "(":
            opened.append(part.start())
        elif part.group() == ")":
            lonely += [] if opened else [part.start()]
            opened[-1:] = []
    lonely += opened
    return "".join("\\" * (place in lonely) + c for place, c in enumerate(line))


def typst_number(literal: str) -> str:
    """Return a decimal as the scene wrote it: ``9.81``, ``1e-31`` as a power of ten."""
    mantissa, exponent = scientific(literal)
    if exponent is None:
        return mantissa
    power = f"10^({exponent})"
    return f"{mantissa} times {power}" if mantissa else power
