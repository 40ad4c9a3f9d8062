"""Conversion of the scene language's syntax trees to SymPy expressions.

The conversion walks the syntax tree; no text is ever evaluated. A lookup function
gives each name its meaning, so that the same conversion serves the reduction
(Cartesian names are symbols of their own) and everything after it (Cartesian
names are functions of q and t).

SymPy writes sqrt(12) as 2*sqrt(3), and looks for factors below 2^15 of any number under a root.
That is quick for what a person writes, and takes minutes for numbers of thousands of digits: roots
of such numbers are refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from types import MappingProxyType

import sympy as sp
from sympy.ntheory import factor_

from lagrange_cli.errors import InputError, NotRealError, Problem
from lagrange_cli.mechanics.algebra.arithmetic import (
    negative,
    nested_sum,
    plain_sum,
    power,
    product,
)
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.free_symbols import symbols_in, unknown_function
from lagrange_cli.mechanics.kinks import Cases
from lagrange_cli.mechanics.tabulated import tabulated
from lagrange_cli.scene.language.expression import (
    FUNCTIONS,
    PIECEWISE,
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

Lookup = Callable[[str], "sp.Expr | None"]
"""Gives the meaning of a name; None if it is unknown."""

Rate = Callable[[sp.Expr], sp.Expr]
"""Total time derivative of an expression."""

#: Bits that a power of two numbers may take at most: 6,000 digits, more than any formula means.
#: Larger ones fill memory.
_POWER_BITS = 20_000

#: Most decimal digits of a numerator or denominator under a root, without powers of ten.
LONGEST_ROOT = 600

#: The same in bits.
_BITS = LONGEST_ROOT * 3322 // 1000

#: Bits that SymPy may produce under a root of a number.
_LEFT = 20_000

#: Functions of the scene language in SymPy, except those that become powers and derivatives.
SYMPY_FUNCTIONS: dict[str, Callable[..., sp.Expr]] = {
    name: getattr(sp, name.capitalize() if name in ("abs", "min", "max", "heaviside") else name)
    for name in FUNCTIONS
    if name not in ("sqrt", "norm", PIECEWISE, *TIME_DERIVATIVES)
}

#: Odd functions, which change their sign with their argument, and even ones, which do not.
ODD_FUNCTIONS = frozenset(("sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "sign"))
EVEN_FUNCTIONS = frozenset(("cos", "cosh", "abs"))


def to_sympy(
    expression: Expression,
    lookup: Lookup,
    rate: Rate | None = None,
    functions: Mapping[str, DeclaredFunction] = MappingProxyType({}),
    longest_sum: float = math.inf,
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
    longest_sum
        Terms of a sum above which it stays as it is in sums that hold it.

    Raises
    ------
    InputError
        Located: an unknown name, a misplaced ``dot``, a number out of bounds, or a
        value that is not a real number (``1/0``, ``sqrt(-1)``).
    """
    result = _Conversion(expression, lookup, rate, functions, longest_sum).convert(expression.node)
    if not has_value(result):
        raise NotRealError(
            Problem(
                f"'{expression.text}' is not a finite real number",
                expression.mark(),
                rule="not-real",
            )
        )
    return result


class _Conversion:
    """One conversion, with the expression in whose text errors are located."""

    def __init__(
        self,
        expression: Expression,
        lookup: Lookup,
        rate: Rate | None,
        functions: Mapping[str, DeclaredFunction],
        longest_sum: float,
    ) -> None:
        self.expression = expression
        self.functions = functions
        self.longest_sum = longest_sum
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
                signed = [(sign, self.convert(term)) for sign, term in node.terms]
                terms = [negative(e) if sign == "-" else e for sign, e in signed]
                is_long = any(e.is_Add and len(e.args) > self.longest_sum for e in terms)
                return nested_sum(terms) if is_long else plain_sum(terms)
            case Mul():
                return product([self.factor(op, factor) for op, factor in node.factors])
            case Pow():
                power = self.power(node)
                # Parts are real: so are their integer powers.
                return power if power.is_Pow and power.exp.is_Integer else self.real(node, power)
            case Call():
                return self.real(node, self.call(node))

    def real(self, node: Node, value: sp.Expr) -> sp.Expr:
        """Refuse an imaginary part, even if the whole expression is real."""
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
        if value.is_Add:
            # SymPy multiplies 2 (m1 + m2) out.
            content, primitive = value.primitive()
            if content.is_Integer and content != 1:
                return sp.Pow(content, -1) * sp.Pow(primitive, -1)
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
        if node.function == PIECEWISE:
            return self.cases(node)
        arguments = [self.convert(a) for a in node.arguments]
        if node.function in TIME_DERIVATIVES:
            if self.rate is None:
                raise self.refuse(node, f"'{node.function}' is not allowed here", "misplaced-rate")
            value = self.rate(arguments[0])
            return self.rate(value) if node.function == "ddot" else value
        name = own_function(node.function)
        if name in self.functions:
            return self.scene_function(
                self.functions[name], len(node.function) - len(name), arguments
            )
        if node.function == "norm":
            return self.root(node, sp.Add(*(a**2 for a in arguments)), sp.S.Half)
        if node.function == "sqrt":
            return self.root(node, arguments[0], sp.S.Half)
        return SYMPY_FUNCTIONS[node.function](*arguments)

    def cases(self, node: Call) -> sp.Expr:
        """Build the values of ``piecewise``, of which the first counts whose condition holds."""
        *pieces, otherwise = node.arguments
        result = self.convert(otherwise)
        for piece in reversed(pieces):
            assert isinstance(piece, Call)
            value, left, right = map(self.convert, piece.arguments)
            side = left - right if piece.function.startswith(">") else right - left
            result = Cases(value, side, sp.Integer(not piece.function.endswith("=")), result)
        return result

    def scene_function(
        self, function: DeclaredFunction, order: int, arguments: Sequence[sp.Expr]
    ) -> sp.Expr:
        """Apply a function of the scene, or a derivative of it."""
        if function.table is not None:
            return tabulated(function.name, function.table, arguments, order)
        (argument,) = arguments
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
    present = symbols_in(expr)
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


def has_long_root(base: sp.Expr, exponent: sp.Expr) -> bool:
    """Say whether a power is a root of a number that is too long to be taken apart."""
    if not (base.is_Rational and exponent.is_Rational) or exponent.is_Integer:
        return False
    numbers = int(abs(base.p)), int(base.q)
    if any(_bits_beside_tens(n) > _BITS for n in numbers):
        return True
    powers = int(exponent.p), -int(exponent.p)
    return any(_bits_left(n, p, int(exponent.q)) > _LEFT for n in numbers for p in powers)


def _bits_left(number: int, power: int, root: int) -> int:
    """Bits of the number that stays under the root of number^power.

    Its factors stay there with their exponents modulo ``root``: 12^(5/7) = 2·1944^(1/7), say.
    Exponents of ten digits make numbers that fill the memory.
    """
    left = {k: m * power % root for k, m in sp.Integer(number).factors(limit=2**15).items()}
    shared = math.gcd(*left.values()) or 1
    return sum(exponent // shared * int(k).bit_length() for k, exponent in left.items())


def _bits_beside_tens(number: int) -> int:
    """Count the bits of a number without its powers of ten, which need no factorization."""
    number = abs(number)
    tens = _BITS
    while tens and number.bit_length() > _BITS:
        if number % 10**tens == 0:
            number //= 10**tens
        else:
            tens //= 2
    return number.bit_length()


class _Factors(getattr(factor_, "FactorCache", object)):  # type: ignore[misc]
    """SymPy's cache of factors, without composite parts that it takes for primes.

    A product of two close numbers is taken apart by Fermat's method; with the limit that roots
    ask for, its parts may be composite. SymPy 1.14 then raises instead of leaving them out.
    """

    def add(self, n: int, factors: Iterable[int]) -> None:
        """Keep the factors of a number if all of them are prime."""
        if all(sp.isprime(factor) for factor in factors):
            super().add(n, factors)


if hasattr(factor_, "factor_cache"):
    factor_.factor_cache = _Factors(maxsize=1000)


def is_plainly_real(expr: sp.Expr, *, nonnegative: bool = False) -> bool:
    """Tell whether sums, products and powers of real numbers plainly make a real number.

    SymPy infers the same by asking for many more properties of every part, which takes a hundred
    times as long for the root of a sum of squares.

    If ``nonnegative``, the number must not be negative either: a sum or product of even powers and
    of other numbers that are not negative.
    """
    if not expr.args:
        return bool(expr.is_nonnegative if nonnegative else expr.is_real)
    if expr.is_Add or expr.is_Mul:
        return all(is_plainly_real(part, nonnegative=nonnegative) for part in expr.args)
    if not expr.is_Pow or not expr.exp.is_Rational or expr.exp < 0:
        return False
    whole = expr.exp.is_Integer and (not nonnegative or expr.exp % 2 == 0)
    return is_plainly_real(expr.base, nonnegative=not whole)
