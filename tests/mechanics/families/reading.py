"""Reads forms of families back as the scene language, and gives their value at a state.

The route shares nothing with what found the forms: their ASCII text is parsed as an expression of a
scene, its sums and indices are written out by the reader of scenes, and the numbers are mpmath's.
"""

import mpmath

from lagrange_cli.errors import Mark
from lagrange_cli.notation.build import display_row
from lagrange_cli.notation.families import FamilyNotation
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.scene.language.expression import Add, Call, Mul, Name, Neg, Number, Pow
from lagrange_cli.scene.language.families import read_expression

DIGITS = 40

_FUNCTIONS = {
    name: getattr(mpmath, name) for name in ("sin", "cos", "tan", "exp", "sqrt", "sinh", "cosh")
}
_FUNCTIONS |= {"abs": abs, "max": max, "min": min, "log": mpmath.log}


class Page:
    """What a page shows of the families of some equations, as text that can be read back."""

    def __init__(self, equations, families):
        self.equations, self.families = equations, families
        self.notation = FamilyNotation(families, vocabulary(equations))
        self.sizes = {size.name: value for size, value in families.sizes.items()}

    def text(self, node):
        return ScenePrinter().inline(node)

    def row(self, row):
        return self.text(display_row(row.shown, self.notation.words_of(row)))

    def whole(self, row):
        return self.text(self.notation.whole(row))

    def form(self, form):
        return self.text(self.notation.form(form))

    def beyond(self):
        """Names of elements beyond the ends, with the texts that the page gives them."""
        meanings = {}
        for row in self.families.beyond:
            text = self.whole(row)
            for at in self.places(row):
                meanings[self.name(row.name, at)] = self.plain(text, at)
        return meanings

    def places(self, row):
        """The values of a row's indices, the last one running fastest."""
        found = [{}]
        for span in row.ranges:
            found = [
                {**at, span.letter.name: k}
                for at in found
                for k in range(self.end(span.first), self.end(span.last) + 1)
            ]
        return found

    def end(self, index):
        return self.plain(str(index), {}).node_value()

    def name(self, name, at):
        return self.plain(name, at).node.name

    def plain(self, text, at):
        values = {**self.sizes, **at}
        return Plain(read_expression(text, Mark("form", 1, 1, text), values=values).node)


class Plain:
    """An expression of plain names."""

    def __init__(self, node):
        self.node = node

    def node_value(self):
        return int(self.value({}, {}))

    def value(self, values, meanings):
        """Its value at values of names; ``meanings`` are those of further names."""

        def of(node):
            match node:
                case Number():
                    return mpmath.mpf(node.value.numerator) / node.value.denominator
                case Name():
                    if node.name in values:
                        return values[node.name]
                    return mpmath.pi if node.name == "pi" else of(meanings[node.name].node)
                case Neg():
                    return -of(node.operand)
                case Add():
                    return sum(of(t) if sign == "+" else -of(t) for sign, t in node.terms)
                case Mul():
                    product = mpmath.mpf(1)
                    for sign, factor in node.factors:
                        product = product * of(factor) if sign == "*" else product / of(factor)
                    return product
                case Pow():
                    return of(node.base) ** of(node.exponent)
                case Call():
                    return self._called(node, of, values, meanings)

        return of(self.node)

    @staticmethod
    def _called(node, of, values, meanings):
        if node.function not in ("dot", "ddot"):
            return _FUNCTIONS[node.function](*map(of, node.arguments))
        (argument,) = node.arguments
        name = argument.name
        if name not in values:
            # The rate of an element that is another one, or a constant.
            meant = meanings[name].node
            if not isinstance(meant, Name):
                return mpmath.mpf(0)
            name = meant.name
        return values[f"{node.function}({name})"]
