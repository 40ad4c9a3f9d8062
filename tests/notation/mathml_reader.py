"""MathML as a reader of a page sees it: the rules of MathML Core, and the value of a formula.

It knows nothing of the printer but that a name is one element.
"""

import math
import operator
from xml.etree import ElementTree as ET

#: Elements of MathML Core that formulas use, with the number of children that they ask for.
ELEMENTS = {
    **dict.fromkeys(("math", "mrow", "msqrt", "mtable", "mtr", "mtd")),
    **dict.fromkeys(("mi", "mn", "mo", "mtext", "mspace"), 0),
    **dict.fromkeys(("mfrac", "msub", "msup", "munder", "mover"), 2),
    **dict.fromkeys(("msubsup", "munderover"), 3),
}
_GLOBAL = {"displaystyle", "style", "id"}
_ATTRIBUTES = {
    "math": {"display"},
    "mi": {"mathvariant"},
    "mo": {"form", "stretchy", "minsize", "maxsize", "lspace", "rspace"},
    "mspace": {"width"},
    "munder": {"accentunder"},
    "mover": {"accent"},
}

_FUNCTIONS = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")}
_FUNCTIONS |= {f"arc{name}": getattr(math, f"a{name}") for name in ("sin", "cos", "tan")}
_FUNCTIONS |= {f"ar{name}": getattr(math, f"a{name}") for name in ("sinh", "cosh", "tanh")}
_FUNCTIONS |= {"exp": math.exp, "ln": math.log, "atan2": math.atan2, "min": min, "max": max}
_FUNCTIONS |= {"abs": abs, "sgn": lambda x: (x > 0) - (x < 0)}
_TIMES = ("\u2062", "⋅", "×")
_APPLIED = "\u2061"
_RELATIONS = {">": operator.gt, "<": operator.lt, "≥": operator.ge, "≤": operator.le}


def parsed(text):
    """The element ``math`` of a formula."""
    return ET.fromstring(f"<math>{text}</math>")


def assert_is_core(element):
    """The elements, attributes and counts of children are those of MathML Core."""
    count = ELEMENTS[element.tag]
    assert count is None or len(element) == count, ET.tostring(element)
    assert set(element.attrib) <= _GLOBAL | _ATTRIBUTES.get(element.tag, set()), element.attrib
    between = "".join((element.text or "", *(child.tail or "" for child in element)))
    assert count == 0 or not between.strip()
    assert element.get("mathvariant", "normal") == "normal"
    rows = {"mtable": "mtr", "mtr": "mtd"}
    for child in element:
        assert element.tag not in rows or child.tag == rows[element.tag]
        assert_is_core(child)


def written(element):
    """An element as a key."""
    return ET.tostring(element, "unicode").strip()


def _name(text):
    (element,) = parsed(text)
    return written(element)


class MathmlReader:
    """Reads the value of a formula.

    ``values`` has that of each name as it is printed; a function where the name is applied.
    """

    def __init__(self, text, values):
        self.text = text
        self.values = {_name(name): value for name, value in values.items()}

    def read(self):
        element = parsed(self.text)
        assert_is_core(element)
        return self.row(element)

    def row(self, element):
        """The value of the children beside each other; lines of a table follow each other."""
        line = _Line(self, element)
        value = line.sum()
        line.end()
        return value

    def cases(self, rows):
        """The value of the row whose conditions hold, which is one."""
        values = []
        for value_cell, conditions_cell in rows:
            line, conditions = _Line(self, value_cell), _Line(self, conditions_cell)
            value = line.sum()
            assert line.takes(",")
            line.end()
            holds = conditions.relation()
            while conditions.takes(","):
                holds &= conditions.relation()
            conditions.end()
            values += [value] if holds else []
        (value,) = values
        return value

    def value(self, element):
        """The value of one element."""
        key = written(element)
        if key in self.values:
            return self.values[key]
        match element.tag:
            case "mn":
                return float(element.text)
            case "mi":
                return {"π": math.pi, "e": math.e}[element.text]
            case "mfrac":
                return self.value(element[0]) / self.value(element[1])
            case "msup":
                return self.value(element[0]) ** self.value(element[1])
            case "msubsup":
                base = ET.Element("msub")
                base.extend(element[:2])
                return self.values[written(base)] ** self.value(element[2])
            case "mrow" if _sign(element[0]) == "|" == _sign(element[-1]):
                body = ET.Element("mrow")
                body.extend(element[1:-1])
                return abs(self.row(body))
            case "mrow" if _sign(element[0]) == "{":
                return self.cases(element[1])
            case "mrow" | "msqrt" | "mtable":
                value = self.row(element)
                return math.sqrt(value) if element.tag == "msqrt" else value
        raise AssertionError(key)


class _Line:
    """Elements beside each other, which are read from left to right."""

    def __init__(self, reader, element):
        self.reader = reader
        self.parts = [part for child in element for part in _flat(child)]

    def end(self):
        assert not self.parts, [written(part) for part in self.parts]

    def takes(self, *signs):
        if self.parts and _sign(self.parts[0]) in signs:
            return _sign(self.parts.pop(0))
        return None

    def function(self, part):
        own = self.reader.values.get(written(part))
        return own if callable(own) else _function(part)

    def relation(self):
        left = self.sum()
        return _RELATIONS[self.takes(*_RELATIONS)](left, self.sum())

    def sum(self):
        total = -self.term() if self.takes("−") else self.term()
        while sign := self.takes("+", "−"):
            term = self.term()
            total += term if sign == "+" else -term
        return total

    def term(self):
        value = self.factor()
        while sign := self.takes(*_TIMES, "/"):
            factor = self.factor()
            value = value / factor if sign == "/" else value * factor
        return value

    def factor(self):
        if self.takes("("):
            return self.closed()
        part = self.parts.pop(0)
        if _applied(self.parts) and (function := self.function(part)):
            self.parts.pop(0)
            value = function(*self.arguments())
            return value ** self.reader.value(part[1]) if part.tag == "msup" else value
        return self.reader.value(part)

    def arguments(self):
        if not self.takes("("):
            # One letter, or a number and a letter.
            number = self.reader.value(self.parts.pop(0)) if self.parts[0].tag == "mn" else 1.0
            self.takes(_TIMES[0])
            return [number * self.reader.value(self.parts.pop(0))]
        first = self.sum()
        return [first, *self.further_arguments()]

    def further_arguments(self):
        while self.takes(","):
            yield self.sum()
        assert self.takes(")")

    def closed(self):
        """What stands in parentheses, of which the last one has the exponent."""
        value = self.sum()
        last = self.parts.pop(0)
        if last.tag == "msup":
            assert _sign(last[0][0] if last[0].tag == "mrow" else last[0]) == ")"
            return value ** self.reader.value(last[1])
        assert _sign(last) == ")"
        return value


def _flat(element):
    """The lines of a table beside each other, without spaces; fenced rows are parts of the line."""
    if element.tag == "mspace":
        return []
    if element.tag in ("mtable", "mtr", "mtd"):
        return [part for child in element for part in _flat(child)]
    if element.tag == "mrow" and len(element) and _sign(element[0]) == "(":
        return [part for child in element for part in _flat(child)]
    return [element]


def _sign(element):
    return element.text if element.tag == "mo" else None


def _function(element):
    name = element[0] if element.tag == "msup" else element
    return _FUNCTIONS.get(name.text) if name.tag == "mi" else None


def _applied(parts):
    return bool(parts) and _sign(parts[0]) == _APPLIED
