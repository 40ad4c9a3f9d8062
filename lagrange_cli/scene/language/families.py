"""Indices and sums written out: ``x[i-1]`` is ``x[2]`` where ``i`` is 3.

Once the sizes and the indices of a family's element have their values, every
expression becomes one of plain names: that of an element is its name with the
values of its indices, ``x[2]`` or ``p[1,4]``. Whatever is written out is counted
before it is made.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import MappingProxyType
from typing import Literal

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.scene.language.expression import (
    RANGE,
    SUM,
    Add,
    Call,
    Equation,
    Expression,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    Span,
    children,
    walk,
)
from lagrange_cli.scene.language.grammar import parse_equation, parse_expression
from lagrange_cli.scene.language.problems import shown
from lagrange_cli.scene.language.tokens import (
    ExpressionError,
    ExpressionLimitError,
    NotRealExpressionError,
)

#: Most elements of a family.
MAX_FAMILY = 100_000
#: Most names and numbers in all that is written out from families and sums.
MAX_TERMS = 1_000_000

#: Most indices of a family.
_MAX_INDICES = 2
#: Largest magnitude of an index.
_MAX_INDEX = 10**9

IndexValues = Mapping[str, int]
"""Sizes and indices by name."""

_NO_VALUES: IndexValues = MappingProxyType({})


@dataclass(slots=True)
class Budget:
    """Count of terms that families are written out to; ``exceeded`` beyond ``most``."""

    most: int = MAX_TERMS
    terms: int = 0
    exceeded: bool = False

    def charge(self, terms: int, span: Span) -> None:
        """Count ``terms`` names and numbers before they are made.

        Raises
        ------
        ExpressionError
            All together would be more than ``most``.
        """
        self.terms += terms
        if self.terms > self.most:
            self.exceeded = True
            raise ExpressionLimitError(
                f"families and sums are written out to more than {self.most} terms",
                span,
                rule="limit",
            )


def read_expression(
    text: str,
    origin: Mark,
    *,
    exact: bool = True,
    limited: bool = True,
    values: IndexValues = _NO_VALUES,
) -> Expression:
    """Parse an expression and write its indices and sums out.

    See :func:`~lagrange_cli.scene.language.grammar.parse_expression`; ``values`` are those
    of sizes and indices.
    """
    parsed = parse_expression(text, origin, exact=exact, limited=limited)
    return written_expression(parsed, values, Budget())


def read_equation(
    text: str,
    origin: Mark,
    *,
    exact: bool = True,
    limited: bool = True,
    values: IndexValues = _NO_VALUES,
) -> Equation:
    """Parse an equation and write its indices and sums out; see :func:`read_expression`."""
    parsed = parse_equation(text, origin, exact=exact, limited=limited)
    return written_equation(parsed, values, Budget())


def written_expression(expression: Expression, values: IndexValues, budget: Budget) -> Expression:
    """Write an expression out to plain names only.

    Raises
    ------
    InputError
        At an index that is not a whole number, or where all that is written out
        exceeds the budget.
    """
    if _is_plain(expression.node, values):
        return expression
    node = _written(expression, values, budget)
    text = _substituted(expression.text, (expression.node,), values)
    return replace(expression, node=node, text=text)


def written_equation(equation: Equation, values: IndexValues, budget: Budget) -> Equation:
    """Write an equation out to plain names only; see :func:`written_expression`."""
    sides = (equation.left.node, equation.right.node)
    if all(_is_plain(side, values) for side in sides):
        return equation
    left, right = (_written(side, values, budget) for side in (equation.left, equation.right))
    text = _substituted(equation.text, sides, values)
    return Equation(
        replace(equation.left, node=left, text=text),
        replace(equation.right, node=right, text=text),
        text,
        equation.origin,
        equation.relation,
    )


def _written(expression: Expression, values: IndexValues, budget: Budget) -> Node:
    try:
        return _Writer(values, budget).written(expression.node)
    except ExpressionError as error:
        raise _located(error, expression) from None


def _located(error: ExpressionError, expression: Expression) -> InputError:
    return error.located(expression.mark(error.span))


def _is_plain(node: Node, values: IndexValues) -> bool:
    return not any(
        part.indices or part.name in values
        if isinstance(part, Name)
        else isinstance(part, Call) and part.function == SUM
        for part in walk(node)
    )


def element_name(name: str, indices: Sequence[int]) -> str:
    """Return the plain name of a family's element: ``x[3]``, ``p[1,2]``."""
    return f"{name}[{','.join(map(str, indices))}]"


def whole_number(node: Node, values: IndexValues, what: str = "an index") -> int:
    """Return the value of an index or of the end of a range.

    Raises
    ------
    ExpressionError
        It is not a whole number made from sizes, indices and numbers.
    """
    if isinstance(node, Name) and not node.indices and node.name in values:
        return values[node.name]
    value = _rational(node, values)
    if value.denominator != 1:
        raise ExpressionError(
            f"{what} is a whole number, found {value.numerator}/{value.denominator}",
            node.span,
            rule="index",
        )
    if not -_MAX_INDEX <= value.numerator <= _MAX_INDEX:
        raise ExpressionLimitError(f"{what} beyond {_MAX_INDEX}", node.span, rule="limit")
    return value.numerator


def _rational(node: Node, values: IndexValues) -> Fraction:
    match node:
        case Number():
            return node.value
        case Name() if not node.indices and node.name in values:
            return Fraction(values[node.name])
        case Neg():
            return -_rational(node.operand, values)
        case Add():
            terms = ((sign, _rational(term, values)) for sign, term in node.terms)
            return sum((v if sign == "+" else -v for sign, v in terms), Fraction(0))
        case Mul():
            product = Fraction(1)
            for operator, factor in node.factors:
                value = _rational(factor, values)
                if operator == "/" and not value:
                    raise NotRealExpressionError("division by zero", factor.span, rule="not-real")
                product = product * value if operator == "*" else product / value
            return product
    raise _not_an_index(node, values)


def _not_an_index(node: Node, values: IndexValues) -> ExpressionError:
    hint = "an index is made with + - * / of indices, sizes and whole numbers"
    if isinstance(node, Name) and not node.indices:
        message = f"{shown(node.name)} is neither an index here nor a size"
        return ExpressionError(message, node.span, hint, rule="index")
    if isinstance(node, Call) and node.function == RANGE:
        return ExpressionError(
            "a range cannot stand here", node.span, "one member is meant, as in x[1]", rule="index"
        )
    return ExpressionError("this is no index", node.span, hint, rule="index")


def assignments(
    ranges: Sequence[Node], values: IndexValues, budget: Budget
) -> Iterator[dict[str, int]]:
    """Yield ``values`` with those of the indices of ranges, the last index running fastest.

    Raises
    ------
    ExpressionError
        At an end that is not a whole number, an index that has a meaning already,
        a range or number of indices beyond the limits.
    """
    if len(ranges) > _MAX_INDICES:
        raise _too_many_indices(ranges[_MAX_INDICES])
    if not ranges:
        yield dict(values)
        return
    index, span = _ends(ranges[0], values)
    for value in span:
        budget.charge(1, ranges[0].span)
        yield from assignments(ranges[1:], {**values, index: value}, budget)


def _ends(node: Node, values: IndexValues) -> tuple[str, range]:
    """Return the index of a range and the values that it takes."""
    assert isinstance(node, Call)
    index, first, last = node.arguments
    assert isinstance(index, Name)
    if index.name in values:
        raise ExpressionError(
            f"{shown(index.name)} is an index or a size already", index.span, rule="clash"
        )
    start = whole_number(first, values, "the end of a range")
    stop = whole_number(last, values, "the end of a range")
    if stop - start >= MAX_FAMILY:
        raise ExpressionLimitError(
            f"a range of more than {MAX_FAMILY} values",
            node.span,
            f"{index.name} goes from {start} to {stop}",
            rule="limit",
        )
    return index.name, range(start, stop + 1)


def check_family(name: Name, ranges: Sequence[Node], values: IndexValues) -> None:
    """Check the declaration of a family before its elements are made.

    Raises
    ------
    ExpressionError
        It has too many indices or elements, or a range whose numbers run backwards.
    """
    if len(name.indices) > _MAX_INDICES:
        raise _too_many_indices(name)
    for part in ranges:
        first, last = children(part)[1:]
        if isinstance(first, Number) and isinstance(last, Number) and last.value < first.value:
            raise ExpressionError("this range runs backwards", part.span, rule="index")
    if _family_size(ranges, values) > MAX_FAMILY:
        raise ExpressionLimitError(
            f"a family of more than {MAX_FAMILY} members", name.span, rule="limit"
        )


def _family_size(ranges: Sequence[Node], values: IndexValues) -> int:
    """Count the elements of ranges, not beyond :data:`MAX_FAMILY`."""
    if not ranges:
        return 1
    index, span = _ends(ranges[0], values)
    if len(ranges) == 1:
        return len(span)
    total = 0
    for value in span:
        total += len(_ends(ranges[1], {**values, index: value})[1])
        if total > MAX_FAMILY:
            break
    return total


def _too_many_indices(node: Node) -> ExpressionError:
    return ExpressionLimitError(f"more than {_MAX_INDICES} indices", node.span, rule="limit")


class _Writer:
    """Writes trees out with the values of sizes and indices."""

    def __init__(self, values: IndexValues, budget: Budget) -> None:
        self.values = values
        self.budget = budget

    def written(self, node: Node) -> Node:
        match node:
            case Number():
                return node
            case Name():
                return self.name(node)
            case Neg():
                return Neg(self.written(node.operand), node.span)
            case Add():
                terms = tuple((sign, self.written(term)) for sign, term in node.terms)
                return Add(terms, node.span)
            case Mul():
                factors = tuple((op, self.written(factor)) for op, factor in node.factors)
                return Mul(factors, node.span)
            case Pow():
                return Pow(self.written(node.base), self.written(node.exponent), node.span)
            case Call():
                if node.function == SUM:
                    return self.sum(node)
                arguments = tuple(self.written(argument) for argument in node.arguments)
                return Call(node.function, arguments, node.span)

    def name(self, node: Name) -> Node:
        if node.indices:
            return Name(self.element(node), node.span)
        if node.name not in self.values:
            return node
        value = self.values[node.name]
        number = Number(Fraction(abs(value)), str(abs(value)), node.span)
        return Neg(number, node.span) if value < 0 else number

    def element(self, node: Name) -> str:
        if len(node.indices) > _MAX_INDICES:
            raise _too_many_indices(node)
        return element_name(node.name, [whole_number(n, self.values) for n in node.indices])

    def sum(self, node: Call) -> Node:
        body, *ranges = node.arguments
        weight = leaves(body)
        terms: list[tuple[Literal["+", "-"], Node]] = []
        for values in assignments(ranges, self.values, self.budget):
            self.budget.charge(weight, node.span)
            terms.append(("+", _Writer(values, self.budget).written(body)))
        if not terms:
            return Number(Fraction(0), "0", node.span)
        return Add(tuple(terms), node.span) if len(terms) > 1 else terms[0][1]


def leaves(node: Node) -> int:
    """Count the names and numbers of a tree, those in indices included."""
    return sum(isinstance(part, Name | Number) for part in walk(node))


def _substituted(text: str, nodes: Sequence[Node], values: IndexValues) -> str:
    """Substitute values for indices and sizes in a text; sums stay sums."""
    pieces = []
    position = 0
    for (start, end), written in sorted(r for n in nodes for r in _replacements(n, values)):
        pieces += [text[position:start], written]
        position = end
    return "".join([*pieces, text[position:]])


def _replacements(node: Node, values: IndexValues) -> Iterator[tuple[Span, str]]:
    if isinstance(node, Name) and node.indices:
        inside = [part for index in node.indices for part in walk(index)]
        if all(part.name in values for part in inside if isinstance(part, Name)):
            yield (
                node.span,
                element_name(node.name, [whole_number(n, values) for n in node.indices]),
            )
            return
    elif isinstance(node, Name) and node.name in values:
        value = values[node.name]
        yield node.span, f"({value})" if value < 0 else str(value)
    for part in children(node):
        yield from _replacements(part, values)
