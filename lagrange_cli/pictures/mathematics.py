"""Texts of the scene language, as options write them, as mathematics in labels.

``max(abs(theta2))`` becomes max |θ₂|, and ``theta2 = 0, dot(theta2) > 0`` becomes θ₂ = 0, θ̇₂ > 0.
"""

from __future__ import annotations

import re

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.notation import tree
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.pictures.picture import Axis, in_dollars, listed
from lagrange_cli.scene import parse_expression
from lagrange_cli.scene.language import expression as written
from lagrange_cli.scene.language.written_text import WrittenText
from lagrange_cli.simulate.model.labels import Label, Labels
from lagrange_cli.simulate.model.requested_outputs import Reduction

_RELATIONS = {"=": ("=", "="), "<": ("<", "<"), ">": (">", ">")}
_RELATIONS |= {"<=": (r"\le", "≤"), ">=": (r"\ge", "≥")}

#: Kind of a reduction → what stands before and behind what is reduced, in LaTeX and in Unicode.
_REDUCED = {
    "max": (r"$\max\,", "$", "max ", ""),
    "min": (r"$\min\,", "$", "min ", ""),
    "mean": (r"$\langle ", r"\rangle$", "⟨", "⟩"),
    "first": ("with $", "$", "with ", ""),
}

#: An absolute value, whose bars enclose a sum.
_SIZE = re.compile(r"\|[^|]*\|")

#: Nothing is ordered here: terms stand as they were written.
_TRAITS = tree.OrderTraits(tree.Dependence.COORDINATE, 0.0, 0.0, "")
_ONE = tree.DisplayNumber(1, 1, _TRAITS)

#: Errors at texts that have no form here, as sums over indices.
_WITHOUT_FORM = (InputError, KeyError)


def reduction_axis(reduction: Reduction, unit: Label | None, labels: Labels) -> Axis:
    """Write a number of a motion; ``unit`` is that of the number."""
    try:
        inner = _condition(reduction, (reduction.start, reduction.end), labels)
    except _WITHOUT_FORM:
        return Axis(_as_written(reduction.text), unit)
    is_sum = {"+", "-"} & {*inner.plain.split()} and not _SIZE.fullmatch(inner.plain)
    if reduction.kind in ("max", "min") and is_sum:
        inner = Label(rf"\left( {inner.latex} \right)", f"({inner.plain})")
    before, behind, plain_before, plain_behind = _REDUCED[reduction.kind]
    name = Label(f"{before}{inner.latex}{behind}", f"{plain_before}{inner.plain}{plain_behind}")
    if reduction.kind != "first":
        return Axis(name, unit)
    # The unit stands with the time, not behind the condition.
    time = Axis(Label("first $t$", "first t"), unit).label
    return Axis(Label(f"{time.latex} {name.latex}", f"{time.plain} {name.plain}"))


def condition_label(text: str, labels: Labels) -> Label:
    """Write equations and inequalities with commas between them."""
    conditions = WrittenText(text, "")
    try:
        parts = [_condition(conditions, bounds, labels) for bounds in conditions.parts()]
    except _WITHOUT_FORM:
        return _as_written(text)
    return listed([in_dollars(part) for part in parts])


def _as_written(text: str) -> Label:
    return Label(latex_text(text), text)


def _condition(text: WrittenText, bounds: tuple[int, int], labels: Labels) -> Label:
    """Write an expression, or the sides of an equation or inequality."""
    place, end = bounds
    latex, plain = "", ""
    for sign in text.relations(*bounds):
        side = _expression(text.text[place : sign.start()], labels)
        in_latex, in_plain = _RELATIONS[sign[0]]
        latex, plain = f"{latex}{side.latex} {in_latex} ", f"{plain}{side.plain} {in_plain} "
        place = sign.end()
    last = _expression(text.text[place:end], labels)
    return Label(latex + last.latex, plain + last.plain)


def _expression(text: str, labels: Labels) -> Label:
    shown = _display(parse_expression(text.strip(), Mark("", 1, 1)).node, labels)
    return Label(LatexPrinter().inline(shown), UnicodePrinter().inline(shown))


def _display(node: written.Node, labels: Labels) -> tree.DisplayNode:
    """Return the display tree of a syntax tree; KeyError for sums over indices, which have none."""

    def parts(*nodes: written.Node) -> list[tree.DisplayNode]:
        return [_display(part, labels) for part in nodes]

    match node:
        case written.Number():
            value = node.value
            literal = None if value.denominator == 1 else node.text
            return tree.DisplayNumber(value.numerator, value.denominator, _TRAITS, literal)
        case written.Name():
            return _symbol(node, 0, labels)
        case written.Neg():
            (term,) = parts(node.operand)
            return tree.DisplaySum((tree.SignedNode(True, term),), _TRAITS)
        case written.Add():
            terms = parts(*(part for _, part in node.terms))
            signs = (sign == "-" for sign, _ in node.terms)
            return tree.DisplaySum(tuple(map(tree.SignedNode, signs, terms)), _TRAITS)
        case written.Mul():
            above, below = (
                _product(parts(*(part for sign, part in node.factors if sign == wanted)))
                for wanted in "*/"
            )
            return above if below == _ONE else tree.DisplayFraction(above, below, _TRAITS)
        case written.Pow():
            base, exponent = parts(node.base, node.exponent)
            return tree.DisplayPower(base, exponent, _TRAITS)
    (first, *_) = node.arguments
    order = written.TIME_DERIVATIVES.get(node.function)
    if order is not None and isinstance(first, written.Name):
        return _symbol(first, order, labels)
    if node.function in (written.SUM, written.RANGE):
        raise KeyError(node.function)
    arguments = tuple(parts(*node.arguments))
    if node.function == "sqrt":
        return tree.DisplayRoot(arguments[0], _TRAITS)
    return tree.DisplayCall(node.function, arguments, _TRAITS)


def _product(factors: list[tree.DisplayNode]) -> tree.DisplayNode:
    if len(factors) > 1:
        return tree.DisplayProduct(tuple(factors), _TRAITS)
    return factors[0] if factors else _ONE


def _symbol(name: written.Name, order: int, labels: Labels) -> tree.DisplayNode:
    if name.name == "pi":
        return tree.DisplayPi(_TRAITS)
    indices = [index.text for index in name.indices if isinstance(index, written.Number)]
    if len(indices) < len(name.indices):
        raise KeyError(name.name)
    spelling = f"{name.name}[{','.join(indices)}]" if indices else name.name
    symbol = labels.energy if spelling == "energy" else spelling
    return tree.DisplaySymbol(symbol, order, labels.latex.get(spelling), _TRAITS)
