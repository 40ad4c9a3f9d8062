"""Value numbering: SymPy expressions as a graph in which equal values are one node.

Every value is a rational multiple of a node, so that signs and numeric factors
never hide a shared part: ``a - b`` and ``b - a`` are one node, and so are
``2*x*y`` and ``x*y/3``. Sums and products are flat and keep their terms in a
canonical order.

Sines and cosines of sums of angles follow from those of the angles: the positions of n links hold
n angles, but their mass matrix holds the cosines of n(n - 1)/2 differences, and
cos(a - b) = cos a cos b + sin a sin b needs fewer calls. The error of each is at most that of a
change of its angles by their own rounding error, but no one change need explain all: where an
exact solution of M a = f counts on small differences to fit together, they keep their own sines.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import sympy

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.kinks import STEPS, step_by_signs
from lagrange_cli.mechanics.symbols.convert import (
    EVEN_FUNCTIONS,
    ODD_FUNCTIONS,
    SYMPY_FUNCTIONS,
)
from lagrange_cli.mechanics.tabulated import Tabulated, in_pieces
from lagrange_cli.program.graph.operands import Coefficient, magnitude, quotient

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations

ScaledNode: TypeAlias = tuple[Coefficient, int]
"""A value: rational coefficient times node."""

#: The node of the number one.
ONE = 0

#: Integer powers up to this one become multiplications.
_LARGEST_MULTIPLIED_POWER = 64

#: Decimal digits to which irrational constants are evaluated.
_CONSTANT_DIGITS = 50

#: Largest exponent of two of an irrational constant that is written as a fraction: the fraction of
#: exp(-1e18) has more digits than a memory holds, and a call of exp gives 0.
_LARGEST_EXPONENT = 2**16

#: SymPy functions and the name each has in a program.
_CALLS: dict[object, str] = {function: name for name, function in SYMPY_FUNCTIONS.items()}

_RECIPROCALS: dict[object, str] = {sympy.cot: "tan", sympy.sec: "cos", sympy.csc: "sin"}


@dataclass(frozen=True, slots=True)
class InputNode:
    """An input of the program by its dummy name (``t``, ``q0``, ``v0``, ``p0``)."""

    name: str

    @property
    def parts(self) -> tuple[int, ...]:
        """No parts: an input is a leaf."""
        return ()


@dataclass(frozen=True, slots=True)
class SumNode:
    """Σ coefficient · node; the node :data:`ONE` stands for the constant term."""

    terms: tuple[tuple[int, Coefficient], ...]

    @property
    def parts(self) -> tuple[int, ...]:
        """The nodes of the terms."""
        return tuple([number for number, _ in self.terms])


@dataclass(frozen=True, slots=True)
class ProductNode:
    """Π node ** exponent, with nonzero integer exponents."""

    factors: tuple[tuple[int, int], ...]

    @property
    def parts(self) -> tuple[int, ...]:
        """The bases."""
        return tuple([number for number, _ in self.factors])


@dataclass(frozen=True, slots=True)
class CallNode:
    """An elementary function of nodes."""

    function: str
    arguments: tuple[int, ...]

    @property
    def parts(self) -> tuple[int, ...]:
        """The arguments."""
        return self.arguments


ValueNode: TypeAlias = InputNode | SumNode | ProductNode | CallNode


class ValueGraph:
    """A growing graph of values over named inputs.

    ``rank`` of a node tells its dependence: 0 on nothing, 1 parameters only,
    2 also t, 3 also q, 4 also v (the largest rank of its parts).

    Parameters
    ----------
    inputs
        (symbol, dummy name, rank) of every input, in a deterministic order.
    """

    def __init__(self, inputs: Sequence[tuple[Symbol, str, int]]) -> None:
        self.nodes: list[ValueNode] = [InputNode("1")]
        self.rank: list[int] = [0]
        self._numbers: dict[ValueNode, int] = {}
        self._known: dict[Expr, ScaledNode] = {}
        for symbol, name, rank in inputs:
            self._known[symbol] = (1, self.intern(InputNode(name), rank))

    def copy(self) -> ValueGraph:
        """Return a graph of the same values, which grows by itself."""
        copied = ValueGraph([])
        copied.nodes, copied.rank = list(self.nodes), list(self.rank)
        copied._numbers, copied._known = dict(self._numbers), dict(self._known)
        return copied

    def intern(self, node: ValueNode, rank: int) -> int:
        """The number of a node, new or known."""
        number = self._numbers.get(node)
        if number is None:
            number = self._numbers[node] = len(self.nodes)
            self.nodes.append(node)
            self.rank.append(rank)
        return number

    def parts(self, number: int) -> tuple[int, ...]:
        """The nodes that a node is made of."""
        return self.nodes[number].parts

    def add(self, values: Iterable[ScaledNode]) -> ScaledNode:
        """Add values; the sum is normalised so that its first coefficient is positive.

        The first coefficient is 1 where all have one magnitude.
        """
        terms: dict[int, Coefficient] = {}
        for coefficient, number in values:
            terms[number] = terms.get(number, 0) + coefficient
        ordered = sorted([term for term in terms.items() if term[1]])
        if not ordered:
            return 0, ONE
        if len(ordered) == 1:
            return ordered[0][1], ordered[0][0]
        first = ordered[0][1]
        size = magnitude(first)
        one_size = all(magnitude(c) == size for _, c in ordered)
        scale = first if one_size else 1 if first > 0 else -1
        node = SumNode(tuple([(n, quotient(c, scale)) for n, c in ordered]))
        return scale, self.intern(node, max([self.rank[n] for n, _ in ordered]))

    def multiply(self, factors: Iterable[tuple[ScaledNode, int]]) -> ScaledNode:
        """Multiply values to integer powers."""
        scale: Coefficient = 1
        powers: dict[int, int] = {}
        for (coefficient, number), exponent in factors:
            if coefficient == 0 and exponent < 0:
                raise _unprintable("division by zero")
            if coefficient != 1:
                power = coefficient ** abs(exponent)
                scale = scale * power if exponent > 0 else quotient(scale, power)
            if number != ONE:
                powers[number] = powers.get(number, 0) + exponent
        ordered = sorted([power for power in powers.items() if power[1]])
        if scale == 0 or not ordered:
            return scale, ONE
        if len(ordered) == 1 and ordered[0][1] == 1:
            return scale, ordered[0][0]
        rank = max([self.rank[n] for n, _ in ordered])
        return scale, self.intern(ProductNode(tuple(ordered)), rank)

    def node(self, value: ScaledNode) -> int:
        """Return the node equal to a value, its coefficient included."""
        coefficient, number = value
        if coefficient == 1:
            return number
        return self.intern(SumNode(((number, coefficient),)), self.rank[number])

    def call(self, function: str, *arguments: ScaledNode) -> ScaledNode:
        """Apply a function to values; signs are drawn out of odd and even functions."""
        sign = 1
        if function in ODD_FUNCTIONS or function in EVEN_FUNCTIONS:
            coefficient, number = arguments[0]
            if coefficient < 0 and function in ODD_FUNCTIONS:
                sign = -sign
            arguments = ((magnitude(coefficient), number),)
        numbers = tuple(self.node(a) for a in arguments)
        rank = max(self.rank[n] for n in numbers)
        return sign, self.intern(CallNode(function, numbers), rank)

    def define(self, expression: Expr, value: ScaledNode) -> None:
        """Take a value of the graph for an expression that is a sum; others are short enough."""
        if _holds_sum(expression):
            self._known[expression] = value

    def convert(self, expression: Expr) -> ScaledNode:
        """Convert a SymPy expression over the inputs to a value.

        Raises
        ------
        InternalError
            It holds something that has no counterpart in emitted code.
        """
        stack = [expression]
        while stack:
            top = stack[-1]
            if top in self._known:
                stack.pop()
                continue
            missing = [a for a in _arguments(top) if a not in self._known]
            if missing:
                stack.extend(reversed(missing))
            else:
                self._known[top] = self._convert_known(top)
                stack.pop()
        return self._known[expression]

    def _convert_known(self, e: Expr) -> ScaledNode:
        """Convert an expression whose arguments are converted."""
        known = self._known
        if e.is_Number:
            return _exact(e), ONE
        if e.is_Add:
            return self.add(known[a] for a in e.args)
        if e.is_Mul:
            return self.multiply(f for a in e.args for f in self._factors(a))
        if e.is_NumberSymbol or (e.args and all(known[a][1] == ONE for a in _arguments(e))):
            constant = _constant(e)
            if constant is not None:
                return constant, ONE
        if e.is_Pow:
            return self._power(e.base, e.exp)
        return self._function(e)

    def _factors(self, e: Expr) -> list[tuple[ScaledNode, int]]:
        """Split a factor of a product: (x·y)⁻¹ into x⁻¹ and y⁻¹."""
        coefficient, number = self._known[e]
        node = self.nodes[number]
        if e.is_Pow and isinstance(node, ProductNode):
            powers = [((1, base), exponent) for base, exponent in node.factors]
            return [((coefficient, ONE), 1), *powers]
        return [((coefficient, number), 1)]

    def _power(self, base: Expr, exponent: Expr) -> ScaledNode:
        if base is sympy.E:
            return self.call("exp", self._known[exponent])
        value = self._known[base]
        twice = 2 * exponent
        if not (twice.is_Integer and abs(exponent) <= _LARGEST_MULTIPLIED_POWER):
            if exponent.is_Rational:
                return self.call("pow", value, (_exact(exponent), ONE))
            return self.call("pow", value, self._known[exponent])
        whole, half = divmod(abs(int(twice)), 2)
        sign = 1 if exponent > 0 else -1
        factors = [(value, sign * whole)]
        if half:
            factors.append((self.call("sqrt", value), sign))
        return self.multiply(factors)

    def _function(self, e: Expr) -> ScaledNode:
        arguments = [self._known[a] for a in _arguments(e)]
        if e.func in _RECIPROCALS:
            return self.multiply([(self.call(_RECIPROCALS[e.func], *arguments), -1)])
        if isinstance(e, (*STEPS, Tabulated)):
            return arguments[0]
        name = _CALLS.get(e.func)
        if name is None:
            raise _unprintable(str(e.func))
        if name in ("min", "max"):
            return self._extremum(name, arguments)
        return self.call(name, *arguments)

    def _extremum(self, name: str, arguments: list[ScaledNode]) -> ScaledNode:
        arguments.sort(key=lambda value: (value[1], value[0]))
        result = arguments[0]
        for argument in arguments[1:]:
            result = self.call(name, result, argument)
        return result


def inputs_of(equations: Equations) -> list[tuple[Expr, str, int]]:
    """List symbol, dummy name and rank of every input of some equations."""
    inputs = [(p.symbol, f"p{i}", 1) for i, p in enumerate(equations.system.parameters)]
    inputs.append((equations.system.t, "t", 2))
    inputs.extend((source.symbol, f"u{i}", 2) for i, source in enumerate(equations.system.inputs))
    inputs.extend((c.q, f"q{i}", 3) for i, c in enumerate(equations.system.coordinates))
    inputs.extend((c.v, f"v{i}", 4) for i, c in enumerate(equations.system.coordinates))
    inputs.extend((s.symbol, f"z{i}", 4) for i, s in enumerate(equations.system.states))
    return inputs


def _holds_sum(e: Expr) -> bool:
    """Tell whether an expression is a sum, or holds one."""
    return bool(e.is_Add or any(map(_holds_sum, e.args)))


def _arguments(e: Expr) -> tuple[Expr, ...]:
    """List the arguments that must be converted first; exact exponents are not among them."""
    if e.is_Pow and e.exp.is_Rational:
        return (e.base,)
    if isinstance(e, STEPS):
        return (step_by_signs(e),)
    if isinstance(e, Tabulated):
        return (in_pieces(e),)
    return tuple(e.args)


def _exact(number: Expr) -> Coefficient:
    """Write a number as a fraction."""
    if not number.is_finite:
        raise _unprintable(f"the constant {number}")
    exact = sympy.Rational(number)
    return quotient(int(exact.p), int(exact.q))


def _constant(e: Expr) -> Coefficient | None:
    """Evaluate a constant expression; None for one whose fraction is too long."""
    number = e.evalf(_CONSTANT_DIGITS)
    if not number.is_Float:
        raise _unprintable(f"the constant {e}")
    _, mantissa, exponent, _ = number._mpf_
    if mantissa and abs(exponent) > _LARGEST_EXPONENT:
        return None
    return _exact(number)


def _unprintable(what: str) -> InternalError:
    return InternalError(Problem(f"{what} has no counterpart in emitted code", rule="unprintable"))


#: Calls that must be saved for each new one: where they are fewer, differences keep their own
#: sines, which are accurate however small.
_CALLS_SAVED = 4

_UNITS = (1, -1)


def expand_angle_sums(values: ValueGraph, order: Iterable[int]) -> None:
    """Rewrite sin(a ± b) and cos(a ± b) among the nodes ``order`` where far fewer calls result.

    Numbers of nodes keep their meaning.
    """
    circular: dict[int, CallNode] = {}
    for number in order:
        node = values.nodes[number]
        if isinstance(node, CallNode) and node.function in ("sin", "cos"):
            circular[number] = node
    angles = {number: _two_angles(values, node) for number, node in circular.items()}
    stay = {circular[number] for number, pair in angles.items() if pair is None}
    sums = {number: pair for number, pair in angles.items() if pair is not None}
    needed = {CallNode(f, (a,)) for pair in sums.values() for a in pair[:2] for f in ("sin", "cos")}
    if _CALLS_SAVED * len(needed - stay) < len(sums):
        for number, (a, b, sign) in sums.items():
            values.nodes[number] = _expanded(values, circular[number].function, a, b, sign)


def _two_angles(values: ValueGraph, node: CallNode) -> tuple[int, int, Coefficient] | None:
    """a, b and the sign of b where the argument is a ± b."""
    argument = values.nodes[node.arguments[0]]
    if not isinstance(argument, SumNode) or len(argument.terms) != 2:
        return None
    (a, first), (b, sign) = argument.terms
    return (a, b, sign) if first == 1 and sign in _UNITS and ONE not in (a, b) else None


def _expanded(values: ValueGraph, function: str, a: int, b: int, sign: Coefficient) -> SumNode:
    one = 1
    sin_a, cos_a, sin_b, cos_b = (
        (values.call(f, (one, angle)), 1) for angle in (a, b) for f in ("sin", "cos")
    )
    if function == "sin":
        products = [(sin_a, cos_b, one), (cos_a, sin_b, sign)]
    else:
        products = [(cos_a, cos_b, one), (sin_a, sin_b, -sign)]
    terms = {}
    for first, second, coefficient in products:
        scale, number = values.multiply([first, second])
        terms[number] = coefficient * scale
    return SumNode(tuple(sorted(terms.items())))
