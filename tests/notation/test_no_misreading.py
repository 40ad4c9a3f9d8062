"""No printed expression can be misread: formulas are read back as a reader reads a line of text.

The reader here knows nothing of the printer: factors stand side by side, a function without
parentheses holds the one letter behind it, what follows a slash is one factor.
"""

import math
import random
import re
import unicodedata
from pathlib import Path

import pytest

from lagrange_cli import api
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.notation.build import display, display_row
from lagrange_cli.notation.layout import joined
from lagrange_cli.notation.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import vocabulary

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"
#: The bicycle's formulas have thousands of terms of the kinds that others have.
SCENES = [
    path
    for path in sorted(SYSTEMS.glob("*/*.yaml"))
    if path.parent.name != "refused" and path.stem != "bicycle"
]

_FRACTIONS = {c: unicodedata.numeric(c) for c in "½⅓⅔¼¾⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞"}
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")
_FUNCTIONS = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")}
_FUNCTIONS |= {name: getattr(math, name) for name in ("asin", "acos", "atan", "exp", "atan2")}
_FUNCTIONS |= {"ln": math.log, "abs": abs, "min": min, "max": max, "√": math.sqrt}
_FUNCTIONS["sign"] = lambda x: math.copysign(1.0, x) if x else 0.0


class Reader:
    """Reads a formula from left to right."""

    def __init__(self, text, values):
        self.text, self.at, self.values = text, 0, values
        self.names = sorted(values, key=len, reverse=True)

    def read(self):
        value = self.sum()
        assert self.at == len(self.text), self.text[self.at :]
        return value

    def takes(self, token):
        if self.text.startswith(token, self.at):
            self.at += len(token)
            return True
        return False

    def matches(self, pattern):
        found = re.compile(pattern).match(self.text, self.at)
        self.at = found.end() if found else self.at
        return found

    def sum(self):
        total = -self.term() if self.takes("-") else self.term()
        while True:
            if self.takes(" + "):
                total += self.term()
            elif self.takes(" - "):
                total -= self.term()
            else:
                return total

    def term(self):
        value = self.factor()
        while not self.text.startswith((" + ", " - "), self.at):
            if self.takes(" / "):
                value /= self.factor()
            elif self.takes(" · ") or self.takes(" "):
                value *= self.factor()
            else:
                break
        return value

    def factor(self):
        return self.power(self.primary())

    def power(self, base):
        raised = self.matches(r"[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
        if raised:
            return base ** int(raised[0].translate(_SUPERSCRIPTS))
        if self.takes("^("):
            exponent = self.sum_of_slashes()
            assert self.takes(")")
            return base**exponent
        return base ** self.letter() if self.takes("^") else base

    def sum_of_slashes(self):
        fraction = self.matches(r"(\d+)/(\d+)(?=\))")
        return int(fraction[1]) / int(fraction[2]) if fraction else self.sum()

    def primary(self):
        for name in sorted(_FUNCTIONS, key=len, reverse=True):
            if self.text.startswith(name, self.at) and not self.is_letter_ahead(len(name)):
                self.at += len(name)
                return self.applied(_FUNCTIONS[name])
        if self.takes("("):
            value = self.sum()
            assert self.takes(")")
            return value
        number = self.matches(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?(?:/\d+)?")
        if number:
            above, _, below = number[0].partition("/")
            return float(above) / float(below or 1)
        if self.text[self.at] in _FRACTIONS:
            self.at += 1
            return _FRACTIONS[self.text[self.at - 1]]
        return math.pi if self.takes("π") else self.letter()

    def is_letter_ahead(self, length):
        """Tell whether a name of the scene begins as a function does: ``since``, ``tan_1``."""
        own = [n for n in self.names if self.text.startswith(n, self.at)]
        return bool(own) and len(own[0]) >= length

    def applied(self, function):
        raised = self.matches(r"[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
        if self.takes("("):
            arguments = [self.sum()]
            while self.takes(", "):
                arguments.append(self.sum())
            assert self.takes(")")
        else:
            self.takes(" ")
            number = self.matches(r"\d+") if function is math.sqrt else None
            arguments = [float(number[0])] if number else [self.letter_or_pi()]
        value = function(*arguments)
        return value ** int(raised[0].translate(_SUPERSCRIPTS)) if raised else value

    def letter_or_pi(self):
        return math.pi if self.takes("π") else self.letter()

    def letter(self):
        for name in self.names:
            if self.takes(name):
                return self.values[name]
        raise AssertionError(f"no name at {self.text[self.at :]!r}")


def _formulas(equations, words):
    yield display(equations.kinetic, words), equations.kinetic
    yield display(equations.potential, words), equations.potential
    for shown in equations.shown:
        yield display_row(shown, words), shown.residual
    for quantity in equations.conserved:
        yield display(quantity.expression, words), quantity.expression


def _of_rate(text):
    """The quantity whose rate a text says to take."""
    assert text.startswith("d/dt (")
    assert text.endswith(")")
    return text.removeprefix("d/dt (").removesuffix(")")


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_formulas_read_back(path):
    equations = api.load(path).derive().equations
    words = vocabulary(equations, abbreviating=True)
    printer = UnicodePrinter()
    chance = random.Random(7)
    point = {symbol: chance.uniform(0.1, 0.9) for symbol in words.atoms}
    values = {printer.inline(node): point[symbol] for symbol, node in words.atoms.items()}
    for name, expression in equations.abbreviations:
        try:
            values[printer.symbol(name)] = float(evaluate([expression], point)[0])
        except (ArithmeticError, ValueError):
            continue
    compared = 0
    texts = [(printer.inline(tree), expression) for tree, expression in _formulas(equations, words)]
    momenta = [shown.momentum for shown in equations.shown if shown.momentum is not None]
    texts += [(_of_rate(joined(printer.rate(display(p, words)))), p) for p in momenta]
    for text, expression in texts:
        try:
            expected = float(evaluate([expression], point)[0])
        except (ArithmeticError, ValueError):
            continue
        if not math.isfinite(expected):
            continue
        assert Reader(text, values).read() == pytest.approx(expected, rel=1e-9, abs=1e-9), text
        compared += 1
    assert compared


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("½ m ẋ² sin²θ", 0.5 * 2 * 9 * math.sin(5) ** 2),
        ("sin θ cos θ", math.sin(5) * math.cos(5)),
        ("2 m / (3 ẋ)", 4 / 9),
        ("m / ẋ^(3/2)", 2 / 3**1.5),
        ("-m (ẋ - θ)", 4),
        ("√(m ẋ) - √2", math.sqrt(6) - math.sqrt(2)),
    ],
)
def test_the_reader(text, expected):
    assert Reader(text, {"m": 2.0, "ẋ": 3.0, "θ": 5.0}).read() == pytest.approx(expected)
