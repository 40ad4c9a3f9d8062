"""Readers of formulas, which know nothing of the printers.

Factors stand side by side, a function without parentheses holds the one letter behind it, what
follows a slash is one factor.
"""

import math
import operator
import re
import unicodedata

_FRACTIONS = {c: unicodedata.numeric(c) for c in "½⅓⅔¼¾⅕⅖⅗⅘⅙⅚⅛⅜⅝⅞"}
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")
_FUNCTIONS = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")}
_FUNCTIONS |= {name: getattr(math, name) for name in ("asin", "acos", "atan", "exp", "atan2")}
_FUNCTIONS |= {"ln": math.log, "abs": abs, "min": min, "max": max, "√": math.sqrt}
_FUNCTIONS["sign"] = lambda x: math.copysign(1.0, x) if x else 0.0
_RELATIONS = {">": operator.gt, "<": operator.lt, "≥": operator.ge, "≤": operator.le}
_RELATIONS |= {">=": operator.ge, "<=": operator.le}
#: What ends a product.
_ENDS = (" + ", " - ", *(f" {relation} " for relation in _RELATIONS))


class Reader:
    """Reads a formula from left to right.

    ``values`` has numbers of names, and functions of names that are applied.
    """

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
        while not self.text.startswith(_ENDS, self.at):
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

    def cases(self):
        """Read values with conditions in brackets; one without a condition is the last."""
        values = []
        while self.takes("["):
            value = self.sum()
            assert self.takes(", ")
            values += [value] if self.condition() else []
            assert self.takes("], ")
        values.append(self.closed())
        return values[0]

    def condition(self):
        left = self.sum()
        relation = next(r for r in _RELATIONS if self.takes(f" {r} "))
        return _RELATIONS[relation](left, self.sum())

    def primary(self):
        if self.takes("piecewise("):
            return self.cases()
        for name in sorted(_FUNCTIONS, key=len, reverse=True):
            if self.text.startswith(name, self.at) and not self.is_letter_ahead(len(name)):
                self.at += len(name)
                return self.applied(_FUNCTIONS[name])
        if self.takes("("):
            return self.closed()
        number = self.matches(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?(?:/\d+)?")
        if number:
            above, _, below = number[0].partition("/")
            return float(above) / float(below or 1)
        if self.text[self.at] in _FRACTIONS:
            self.at += 1
            return _FRACTIONS[self.text[self.at - 1]]
        return math.pi if self.takes("π") else self.letter()

    def closed(self):
        value = self.sum()
        assert self.takes(")")
        return value

    def is_letter_ahead(self, length):
        """Tell whether a name of the scene begins as a function does: ``since``, ``tan_1``."""
        own = [n for n in self.names if self.text.startswith(n, self.at)]
        return bool(own) and len(own[0]) >= length

    def applied(self, function):
        raised = self.matches(r"[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
        if self.takes("("):
            arguments = self.arguments()
        else:
            self.takes(" ")
            number = self.matches(r"\d+") if function is math.sqrt else None
            arguments = [float(number[0])] if number else [self.letter_or_pi()]
        value = function(*arguments)
        return value ** int(raised[0].translate(_SUPERSCRIPTS)) if raised else value

    def arguments(self):
        """What stands between parentheses, of which the first is read."""
        arguments = [self.sum()]
        while self.takes(", "):
            arguments.append(self.sum())
        assert self.takes(")")
        return arguments

    def letter_or_pi(self):
        return math.pi if self.takes("π") else self.letter()

    def letter(self):
        for name in self.names:
            if self.takes(name):
                value = self.values[name]
                if not callable(value):
                    return value
                assert self.takes("(") or self.takes(" (")
                return value(*self.arguments())
        raise AssertionError(f"no name at {self.text[self.at :]!r}")


class TypstReader(Reader):
    """Reads a formula of Typst's mathematics, on one line or on several."""

    def __init__(self, text, values):
        text = text.replace(r"lr(\(, size: #2em) ", "(").replace(r" lr(\), size: #2em)", ")")
        text = re.sub(r' ?\\ +& (?:quad )?(?:"" )?', " ", text)
        # The beginnings of parts of a fraction that have several lines.
        text = text.replace("(& ", "(").replace(", & ", ", ")
        text = text.replace(r"\(", "(").replace(r"\)", ")")
        super().__init__(text, values)

    def term(self):
        value = self.factor()
        while not self.text.startswith(_ENDS, self.at):
            if not (self.takes(" dot.op ") or self.takes(" thin ") or self.takes(" ")):
                break
            self.takes("dot.op ")
            value *= self.factor()
        return value

    def power(self, base):
        if self.takes("^("):
            fraction = self.matches(r"(\d+)\\/(\d+)(?=\))")
            exponent = int(fraction[1]) / int(fraction[2]) if fraction else self.sum()
            assert self.takes(")")
            return base**exponent
        number = self.matches(r"\^(\d+)")
        if number:
            return base ** int(number[1])
        return base ** self.letter() if self.takes("^") else base

    def cases(self):
        """Read rows of a value and its conditions, which hold in one of them."""
        values = []
        while True:
            value, holds = self.sum(), True
            while self.takes(r"\, "):
                self.takes("thick ")
                holds &= self.condition()
            values += [value] if holds else []
            if not self.takes(", "):
                break
        assert self.takes(")")
        (value,) = values
        return value

    def primary(self):
        if self.takes("cases("):
            return self.cases()
        if self.takes("upright(e)"):
            return self.power(math.e)
        if self.takes("frac("):
            above = self.sum()
            assert self.takes(", ")
            return above / self.closed()
        number = self.matches(r"\d+(?:\.\d+)?")
        if number:
            power = self.matches(r" times 10\^\((-?\d+)\)")
            return float(number[0]) * 10.0 ** int(power[1] if power else 0)
        for name in sorted(_TYPST_FUNCTIONS, key=len, reverse=True):
            if self.text.startswith(name, self.at) and not self.is_letter_ahead(len(name)):
                self.at += len(name)
                return self.applied(_TYPST_FUNCTIONS[name])
        if self.takes("("):
            return self.closed()
        return self.letter_or_pi()

    def applied(self, function):
        raised = self.matches(r"\^(\d+)")
        if self.takes("("):
            arguments = self.arguments()
        else:
            self.takes(" ")
            number = self.matches(r"(\d+) ")
            factor = float(number[1]) if number else 1.0
            arguments = [factor * self.letter_or_pi()]
        value = function(*arguments)
        return value ** int(raised[1]) if raised else value

    def letter_or_pi(self):
        return math.pi if self.takes("pi") else self.letter()


_TYPST_FUNCTIONS = {
    name: _FUNCTIONS[name] for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "ln")
}
_TYPST_FUNCTIONS |= {name: _FUNCTIONS[name] for name in ("min", "max", "abs")}
_TYPST_FUNCTIONS |= {f"arc{name}": getattr(math, f"a{name}") for name in ("sin", "cos", "tan")}
_TYPST_FUNCTIONS |= {'op("atan2")': math.atan2, 'op("sgn")': _FUNCTIONS["sign"], "sqrt": math.sqrt}
