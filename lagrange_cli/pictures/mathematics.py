"""Texts of the scene language, as options write them, as mathematics in labels.

``max(abs(theta2))`` becomes max |θ₂|, and ``theta2 = 0, dot(theta2) > 0`` becomes θ₂ = 0, θ̇₂ > 0.
"""

from __future__ import annotations

import re

from lagrange_cli.errors import InputError
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRoot,
    DisplaySum,
    DisplaySymbol,
    OrderTraits,
    SignedNode,
)
from lagrange_cli.pictures.picture import Axis
from lagrange_cli.scene import parse_expression
from lagrange_cli.scene.language.expression import (
    RANGE,
    SUM,
    TIME_DERIVATIVES,
    Add,
    Call,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
)
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
_TRAITS = OrderTraits(Dependence.COORDINATE, 0.0, 0.0, "")


def reduction_axis(reduction: Reduction, unit: Label | None, labels: Labels) -> Axis:
    """Write a number of a motion; ``unit`` is that of the number."""
    inner = _condition(reduction, reduction.start, reduction.end, labels)
    if inner is None:
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
    written = WrittenText(text, "")
    parts = [_condition(written, *bounds, labels) for bounds in written.parts()]
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return _as_written(text)
    latex = ", ".join(f"${part.latex}$" for part in known)
    return Label(latex, ", ".join(part.plain for part in known))


def _as_written(text: str) -> Label:
    return Label(latex_text(text), text)


def _condition(written: WrittenText, start: int, end: int, labels: Labels) -> Label | None:
    """Write an expression, or the sides of an equation or inequality; None if it has sums."""
    latex, plain, place = "", "", start
    for sign in written.relations(start, end):
        side = _expression(written.text[place : sign.start()], labels)
        if side is None or sign[0] not in _RELATIONS:
            return None
        in_latex, in_plain = _RELATIONS[sign[0]]
        latex, plain = f"{latex}{side.latex} {in_latex} ", f"{plain}{side.plain} {in_plain} "
        place = sign.end()
    last = _expression(written.text[place:end], labels)
    return None if last is None else Label(latex + last.latex, plain + last.plain)


def _expression(text: str, labels: Labels) -> Label | None:
    try:
        tree = _display(
            parse_expression(text.strip(), WrittenText(text, "").mark(0, 1)).node, labels
        )
    except (InputError, KeyError):
        return None
    return Label(LatexPrinter().inline(tree), UnicodePrinter().inline(tree))


def _display(node: Node, labels: Labels) -> DisplayNode:
    """Return the display tree of a syntax tree; KeyError for sums over indices, which have none."""
    match node:
        case Number():
            value = node.value
            literal = None if value.denominator == 1 else node.text
            return DisplayNumber(value.numerator, value.denominator, _TRAITS, literal)
        case Name():
            return _symbol(node, 0, labels)
        case Neg():
            return DisplaySum((SignedNode(True, _display(node.operand, labels)),), _TRAITS)
        case Add():
            terms = (SignedNode(sign == "-", _display(part, labels)) for sign, part in node.terms)
            return DisplaySum(tuple(terms), _TRAITS)
        case Mul():
            above = [_display(part, labels) for sign, part in node.factors if sign == "*"]
            below = [_display(part, labels) for sign, part in node.factors if sign == "/"]
            return (
                DisplayFraction(_product(above), _product(below), _TRAITS)
                if below
                else _product(above)
            )
        case Pow():
            base, exponent = _display(node.base, labels), _display(node.exponent, labels)
            return DisplayPower(base, exponent, _TRAITS)
        case Call():
            return _call(node, labels)


def _product(factors: list[DisplayNode]) -> DisplayNode:
    if len(factors) == 1:
        return factors[0]
    return DisplayProduct(tuple(factors), _TRAITS) if factors else DisplayNumber(1, 1, _TRAITS)


def _symbol(name: Name, order: int, labels: Labels) -> DisplayNode:
    if name.name == "pi":
        return DisplayPi(_TRAITS)
    indices = [index.text for index in name.indices if isinstance(index, Number)]
    if len(indices) < len(name.indices):
        raise KeyError(name.name)
    written = f"{name.name}[{','.join(indices)}]" if indices else name.name
    symbol = labels.energy if written == "energy" else written
    return DisplaySymbol(symbol, order, labels.latex.get(written), _TRAITS)


def _call(call: Call, labels: Labels) -> DisplayNode:
    if call.function in (SUM, RANGE):
        raise KeyError(call.function)
    (first, *_) = call.arguments
    order = TIME_DERIVATIVES.get(call.function)
    if order is not None and isinstance(first, Name):
        return _symbol(first, order, labels)
    arguments = tuple(_display(part, labels) for part in call.arguments)
    if call.function == "sqrt":
        return DisplayRoot(arguments[0], _TRAITS)
    return DisplayCall(call.function, arguments, _TRAITS)
