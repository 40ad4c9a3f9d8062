"""Conversion of the scene language's syntax trees to SymPy expressions.

The conversion walks the syntax tree; no text is ever evaluated. A lookup function
gives each name its meaning, so that the same conversion serves the reduction
(Cartesian names are symbols of their own) and everything after it (Cartesian
names are functions of q and t).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from types import MappingProxyType

import sympy as sp

from lagrange_cli.errors import InputError, NotRealError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.plain_products import power, product
from lagrange_cli.mechanics.algebra.plain_sums import negative, plain_sum
from lagrange_cli.mechanics.symbols.exact_roots import LONGEST_ROOT, has_long_root
from lagrange_cli.mechanics.symbols.plain_signs import is_plainly_real
from lagrange_cli.mechanics.unknown_functions import unknown_function
from lagrange_cli.scene.language.expression import (
    FUNCTIONS,
    TIME_DERIVATIVES,
    Add,
    Call,
    Expression,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    own_function,
    walk,
)
from lagrange_cli.scene.model import DeclaredFunction

_Lookup = Callable[[str], "sp.Expr | None"]
"""Gives the meaning of a name; None if it is unknown."""

Rate = Callable[[sp.Expr], sp.Expr]
"""Total time derivative of an expression."""

#: Bits that a power of two numbers may take at most; a larger one fills memory. Set by hand.
_POWER_BITS = 20_000

#: Functions of the scene language in SymPy, but those that are made of powers and derivatives.
SYMPY_FUNCTIONS: dict[str, Callable[..., sp.Expr]] = {
    name: getattr(sp, name.capitalize() if name in ("abs", "min", "max") else name)
    for name in FUNCTIONS
    if name not in ("sqrt", "norm", *TIME_DERIVATIVES)
}

#: Those that change their sign with their argument, and those that do not change with its sign.
ODD_FUNCTIONS = frozenset(("sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "sign"))
EVEN_FUNCTIONS = frozenset(("cos", "cosh", "abs"))


def to_sympy(
    expression: Expression,
    lookup: _Lookup,
    rate: Rate | None = None,
    functions: Mapping[str, DeclaredFunction] = MappingProxyType({}),
) -> sp.Expr:
    """Convert an expression with exact numbers.

    Parameters
    ----------
    lookup
        Meaning of each name; ``pi`` and the functions are known beforehand.
    rate
        Meaning of ``dot``; None if rates are not allowed.
    functions
        The scene's own functions.

    Raises
    ------
    InputError
        Located: an unknown name, a misplaced ``dot``, a number out of bounds, or a
        value that is not a real number (``1/0``, ``sqrt(-1)``).
    """
    result = _Conversion(expression, lookup, rate, functions).convert(expression.node)
    if result.has(sp.zoo, sp.nan, sp.oo, -sp.oo, sp.I):
        raise NotRealError(
            Problem(
                f"'{expression.text}' is not a finite real number",
                expression.mark(),
                rule="not-real",
            )
        )
    return result


class _Conversion:
    """One conversion; keeps the expression to locate errors in its text."""

    def __init__(
        self,
        expression: Expression,
        lookup: _Lookup,
        rate: Rate | None,
        functions: Mapping[str, DeclaredFunction],
    ) -> None:
        self.expression = expression
        self.functions = functions
        self.lookup = lookup
        self.rate = rate

    def refuse(self, node: Node, message: str, rule: str) -> InputError:
        return InputError(Problem(message, self.expression.mark(node.span), rule=rule))

    def not_real(self, node: Node, message: str) -> NotRealError:
        return NotRealError(Problem(message, self.expression.mark(node.span), rule="not-real"))

    def convert(self, node: Node) -> sp.Expr:
        match node:
            case Number():
                return sp.Rational(node.value.numerator, node.value.denominator)
            case Name():
                return self.name(node)
            case Neg():
                return negative(self.convert(node.operand))
            case Add():
                terms = [(sign, self.convert(term)) for sign, term in node.terms]
                return plain_sum(negative(e) if sign == "-" else e for sign, e in terms)
            case Mul():
                return product([self.factor(op, factor) for op, factor in node.factors])
            case Pow():
                power = self.power(node)
                # Parts are real: so are their integer powers.
                return power if power.is_Pow and power.exp.is_Integer else self.real(node, power)
            case Call():
                return self.real(node, self.call(node))

    def real(self, node: Node, value: sp.Expr) -> sp.Expr:
        """Refuse an imaginary part, even where the whole would be real again."""
        if value.has(sp.I) or (not is_plainly_real(value) and value.is_real is False):
            raise self.not_real(node, "this is not a real number")
        return value

    def name(self, node: Name) -> sp.Expr:
        if node.name == "pi":
            return sp.pi
        value = self.lookup(node.name)
        if value is None:
            raise self.refuse(node, f"unknown name '{node.name}'", "unknown-name")
        return value

    def factor(self, operator: str, node: Node) -> sp.Expr:
        value = self.convert(node)
        if operator == "*":
            return value
        if value.is_zero:
            raise self.not_real(node, "division by zero")
        return sp.Pow(value, -1)

    def power(self, node: Pow) -> sp.Expr:
        base, exponent = self.convert(node.base), self.convert(node.exponent)
        if exponent.is_negative and base.is_zero:
            raise self.not_real(node, "division by zero")
        if base.is_Rational and exponent.is_Rational:
            bits = max(int(base.p).bit_length(), int(base.q).bit_length())
            if abs(exponent) * bits > _POWER_BITS:
                raise self.refuse(node, "this power is too large", "too-large")
        return self.root(node, base, exponent)

    def root(self, node: Node, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        """Build a power; refuse a root of a number too long to be factored."""
        if has_long_root(base, exponent):
            says = f"this root is of a number of more than {LONGEST_ROOT} digits"
            raise self.refuse(node, says, "too-large")
        return power(base, exponent)

    def call(self, node: Call) -> sp.Expr:
        arguments = [self.convert(a) for a in node.arguments]
        if node.function in TIME_DERIVATIVES:
            if self.rate is None:
                raise self.refuse(node, f"'{node.function}' is not allowed here", "misplaced-rate")
            value = self.rate(arguments[0])
            return self.rate(value) if node.function == "ddot" else value
        name = own_function(node.function)
        if name in self.functions:
            return self.own(self.functions[name], len(node.function) - len(name), arguments[0])
        if node.function == "norm":
            return self.root(node, sp.Add(*(a**2 for a in arguments)), sp.S.Half)
        if node.function == "sqrt":
            return self.root(node, arguments[0], sp.S.Half)
        return SYMPY_FUNCTIONS[node.function](*arguments)

    def own(self, function: DeclaredFunction, order: int, argument: sp.Expr) -> sp.Expr:
        """Apply a function of the scene, or a derivative of it."""
        if function.expression is None:
            return unknown_function(function.name + "'" * order, argument)
        place = sp.Dummy(real=True)

        def lookup(name: str) -> sp.Expr | None:
            return place if name == function.argument else self.lookup(name)

        # Only functions that are declared before it stand in its expression.
        value = to_sympy(function.expression, lookup, None, self.functions)
        for _ in range(order):
            value = derivative(value, place)
        return value.xreplace({place: argument})


def total_derivative(
    expr: sp.Expr, t: sp.Symbol, chain: Iterable[tuple[sp.Symbol, sp.Expr]]
) -> sp.Expr:
    """Differentiate by time: ``∂/∂t + Σ rate·∂/∂symbol`` over the symbols of ``expr``."""
    present = expr.free_symbols
    terms = [derivative(expr, t)] if t in present else []
    terms.extend(derivative(expr, s) * rate for s, rate in chain if s in present)
    return sp.Add(*terms)


def decimal_literals(expressions: Iterable[Expression]) -> tuple[tuple[Fraction, str], ...]:
    """Collect non-integer decimals as first written, by exact value, in ascending order."""
    literals: dict[Fraction, str] = {}
    for expression in expressions:
        for node in walk(expression.node):
            if isinstance(node, Number) and node.value.denominator != 1:
                literals.setdefault(node.value, node.text)
    return tuple(sorted(literals.items()))
