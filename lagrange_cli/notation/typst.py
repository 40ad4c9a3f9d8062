"""Expressions as Typst's mathematics: ``frac(1, 2) M (dot(r)^2 + r^2 dot(theta)^2)``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from lagrange_cli.notation.tree import DisplayCall, DisplayNumber, DisplayRange
from lagrange_cli.notation.typeset import TypesetPrinter
from lagrange_cli.notation.typst_symbols import EMPTY, typst_name, typst_scripted

#: Function of the scene language → its name in Typst.
TYPST_FUNCTIONS = {
    **{name: name for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "min", "max")},
    **{f"a{name}": f"arc{name}" for name in ("sin", "cos", "tan")},
    **{f"a{name}": f'op("ar{name}")' for name in ("sinh", "cosh", "tanh")},
    **{name: f'op("{name}")' for name in ("atan2", "abs")},
    "sign": 'op("sgn")',
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
    ratio_opening = "frac("
    root_opening = "sqrt("
    sum_opening = "sum_("
    bars_opening = "abs("
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

    def condition(self, index: DisplayRange) -> str:
        if index.after:
            return f"{index.after} < {index.letter}"
        return f"{index.letter} != {index.besides}" if index.besides else ""

    def magnitude(self, body: str) -> str:
        return f"abs({body})"

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
    """A decimal as the scene wrote it: ``9.81``, ``1e-31`` as a power of ten."""
    mantissa, _, exponent = literal.lower().partition("e")
    if not exponent:
        return mantissa
    power = f"10^({int(exponent)})"
    return power if mantissa in ("1", "1.0", "1.") else f"{mantissa} times {power}"
