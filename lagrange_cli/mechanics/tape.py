"""Straight-line evaluation of SymPy expressions with derivatives, in high precision.

A tape is the list of elementary operations of some expressions, each done
once. It is run on truncated Taylor series in one variable s (so that values,
first and second derivatives along a curve come out together) and backwards
(so that the gradient of a weighted sum of outputs costs one pass). Both are
textbook automatic differentiation: Griewank and Walther, Evaluating
Derivatives (2008), chapters 3, 5 and 13. Nothing here uses SymPy's own
differentiation: the certificate relies on that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InternalError, Problem

__all__ = ["DomainError", "Tape"]

Number = Any  # mpmath.mpf, which carries no types
Series = tuple[Number, Number, Number]
"""Value, first and second derivative with respect to s."""

_ZERO = mpf(0)


class DomainError(ArithmeticError):
    """A value is not a finite real number at this point."""


def _real(x: Number) -> Number:
    if isinstance(x, mpf) and mpmath.isfinite(x):
        return x
    raise DomainError


def _reciprocal(x: Number) -> Number:
    if x == 0:
        raise DomainError
    return 1 / x


def _sin(x: Number) -> Series:
    c, s = mpmath.cos_sin(x)
    return s, c, -s


def _cos(x: Number) -> Series:
    c, s = mpmath.cos_sin(x)
    return c, -s, -c


def _tan(x: Number) -> Series:
    y = mpmath.tan(x)
    return y, 1 + y * y, 2 * y * (1 + y * y)


def _asin(x: Number) -> Series:
    r = _reciprocal(mpmath.sqrt(_real(1 - x * x)))
    return mpmath.asin(x), r, x * r**3


def _acos(x: Number) -> Series:
    r = _reciprocal(mpmath.sqrt(_real(1 - x * x)))
    return mpmath.acos(x), -r, -x * r**3


def _atan(x: Number) -> Series:
    r = 1 / (1 + x * x)
    return mpmath.atan(x), r, -2 * x * r * r


def _sinh(x: Number) -> Series:
    s, c = mpmath.sinh(x), mpmath.cosh(x)
    return s, c, s


def _cosh(x: Number) -> Series:
    s, c = mpmath.sinh(x), mpmath.cosh(x)
    return c, s, c


def _tanh(x: Number) -> Series:
    y = mpmath.tanh(x)
    return y, 1 - y * y, -2 * y * (1 - y * y)


def _asinh(x: Number) -> Series:
    r = 1 / mpmath.sqrt(1 + x * x)
    return mpmath.asinh(x), r, -x * r**3


def _acosh(x: Number) -> Series:
    r = _reciprocal(mpmath.sqrt(_real(x * x - 1)))
    return mpmath.acosh(x), r, -x * r**3


def _atanh(x: Number) -> Series:
    r = _reciprocal(1 - x * x)
    return mpmath.atanh(x), r, 2 * x * r * r


def _exp(x: Number) -> Series:
    y = mpmath.exp(x)
    return y, y, y


def _log(x: Number) -> Series:
    r = _reciprocal(x)
    return mpmath.log(x), r, -r * r


def _abs(x: Number) -> Series:
    return abs(x), mpmath.sign(x), _ZERO


def _sign(x: Number) -> Series:
    return mpmath.sign(x), _ZERO, _ZERO


#: Each function with its first and second derivative.
_UNARY: dict[Any, Callable[[Number], Series]] = {
    sp.sin: _sin,
    sp.cos: _cos,
    sp.tan: _tan,
    sp.asin: _asin,
    sp.acos: _acos,
    sp.atan: _atan,
    sp.sinh: _sinh,
    sp.cosh: _cosh,
    sp.tanh: _tanh,
    sp.asinh: _asinh,
    sp.acosh: _acosh,
    sp.atanh: _atanh,
    sp.exp: _exp,
    sp.log: _log,
    sp.Abs: _abs,
    sp.sign: _sign,
}


def _power(x: Number, n: Any) -> Series:
    """x**n for a constant exponent, with both derivatives."""
    if n == 2:
        return x * x, 2 * x, mpf(2)
    if x == 0 and (n < 0 or n != int(n)):
        raise DomainError
    y = _real(mpmath.sqrt(x) if 2 * n == 1 else x**n)
    if x == 0:
        return y, mpf(1 if n == 1 else 0), mpf(2 if n == 2 else 0)
    return y, n * y / x, n * (n - 1) * y / (x * x)


class Tape:
    """Operations of ``outputs`` over ``inputs``, each distinct one once.

    Parameters
    ----------
    outputs
        SymPy expressions.
    inputs
        Symbols; every free symbol of the outputs must be among them.
    """

    def __init__(self, outputs: Sequence[sp.Expr], inputs: Sequence[sp.Symbol]) -> None:
        self.operations: list[tuple[str, Any, Any]] = []
        self._index: dict[sp.Basic, int] = {}
        self._products: dict[tuple[int, int], int] = {}
        for symbol in inputs:
            self._index[symbol] = self._append("input", None, None)
        self.inputs = len(inputs)
        self.outputs = [self._record(sp.sympify(e)) for e in outputs]

    def _append(self, operation: str, a: Any, b: Any) -> int:
        self.operations.append((operation, a, b))
        return len(self.operations) - 1

    def _record(self, expr: sp.Basic) -> int:
        """Index of the node of ``expr``, appended after its operands (iterative post-order)."""
        stack: list[tuple[sp.Basic, bool]] = [(expr, False)]
        while stack:
            top, ready = stack.pop()
            if top in self._index:
                continue
            if ready or not top.args:
                self._index[top] = self._node(top)
            else:
                stack.append((top, True))
                stack.extend((a, False) for a in reversed(top.args))
        return self._index[expr]

    def _node(self, expr: sp.Basic) -> int:
        args = [self._index[a] for a in expr.args]
        if expr.is_number and not expr.free_symbols:
            value = expr.evalf(mpmath.mp.dps + 5)
            if not (value.is_real and value.is_finite):
                raise DomainError
            return self._append("constant", expr, None)
        if expr.is_Add:
            return self._append("add", tuple(args), None)
        if expr.is_Mul:
            product = args[0]
            for factor in args[1:]:
                product = self._product(product, factor)
            return product
        if expr.is_Pow:
            return self._pow(expr, args)
        if expr.func in _UNARY:
            return self._append("unary", args[0], _UNARY[expr.func])
        if expr.func in (sp.atan2, sp.Min, sp.Max):
            return self._append(expr.func.__name__, tuple(args), None)
        raise InternalError(Problem(f"cannot evaluate {type(expr).__name__} in the certificate"))

    def _product(self, a: int, b: int) -> int:
        key = (a, b)
        if key not in self._products:
            self._products[key] = self._append("mul", a, b)
        return self._products[key]

    def _pow(self, expr: sp.Basic, args: list[int]) -> int:
        base, exponent = expr.args
        if exponent.is_Integer:
            return self._append("power", args[0], int(exponent))
        if exponent.is_Rational:
            return self._append("rational", args[0], exponent)
        if base is sp.E:
            return self._append("unary", args[1], _exp)
        logarithm = self._append("unary", args[0], _log)
        return self._append("unary", self._product(args[1], logarithm), _exp)

    def run(self, inputs: Sequence[Series], order: int = 2) -> Run:
        """Evaluate on series in s, truncated after ``order`` (0, 1 or 2)."""
        return Run(self, inputs, order)


class Run:
    """A tape evaluated at one point: series of every node, and local derivatives."""

    def __init__(self, tape: Tape, inputs: Sequence[Series], order: int) -> None:
        self.tape = tape
        self.order = order
        self.nodes: list[Series] = []
        self.local: list[Any] = [None] * len(tape.operations)
        self._pending = iter(inputs)
        for i, (operation, a, b) in enumerate(tape.operations):
            self.nodes.append(self._forward(i, operation, a, b))

    @property
    def outputs(self) -> list[Series]:
        return [self.nodes[i] for i in self.tape.outputs]

    @property
    def values(self) -> list[Number]:
        return [self.nodes[i][0] for i in self.tape.outputs]

    def _forward(self, i: int, operation: str, a: Any, b: Any) -> Series:
        nodes, order = self.nodes, self.order
        if operation == "mul":
            return self._multiply(nodes[a], nodes[b])
        if operation == "add":
            terms = [nodes[k] for k in a]
            return (
                sum((x[0] for x in terms), _ZERO),
                sum((x[1] for x in terms), _ZERO) if order else _ZERO,
                sum((x[2] for x in terms), _ZERO) if order > 1 else _ZERO,
            )
        if operation == "input":
            return next(self._pending)
        if operation == "constant":
            return mpf(a.evalf(mpmath.mp.dps + 5)), _ZERO, _ZERO
        if operation in ("unary", "power", "rational"):
            self.local[i] = self._derivatives(operation, nodes[a][0], b)
            return self._compose(self.local[i], nodes[a])
        if operation in ("Min", "Max"):
            choose = min if operation == "Min" else max
            self.local[i] = choose(a, key=lambda k: nodes[k][0])
            return nodes[self.local[i]]
        return self._atan2(i, nodes[a[0]], nodes[a[1]])

    def _multiply(self, x: Series, y: Series) -> Series:
        if not self.order:
            return x[0] * y[0], _ZERO, _ZERO
        first = x[0] * y[1] + x[1] * y[0]
        if self.order == 1:
            return x[0] * y[0], first, _ZERO
        return x[0] * y[0], first, x[0] * y[2] + 2 * x[1] * y[1] + x[2] * y[0]

    @staticmethod
    def _derivatives(operation: str, x: Number, how: Any) -> Series:
        if operation == "unary":
            values: Series = how(x)
        elif operation == "power":
            values = _power(x, how)
        else:
            values = _power(x, mpf(how.p) / mpf(how.q))
        return _real(values[0]), values[1], values[2]

    def _compose(self, f: Series, x: Series) -> Series:
        if not self.order:
            return f[0], _ZERO, _ZERO
        if self.order == 1:
            return f[0], f[1] * x[1], _ZERO
        return f[0], f[1] * x[1], f[1] * x[2] + f[2] * x[1] * x[1]

    def _atan2(self, i: int, y: Series, x: Series) -> Series:
        r2 = x[0] * x[0] + y[0] * y[0]
        if r2 == 0:
            raise DomainError
        # Angle's rate w = (x y' − y x')/r²; its derivative by the quotient rule.
        area, area_rate = x[0] * y[1] - y[0] * x[1], x[0] * y[2] - y[0] * x[2]
        rate = area / r2
        r2_rate = 2 * (x[0] * x[1] + y[0] * y[1])
        self.local[i] = (y, x, r2, r2_rate)
        return mpmath.atan2(y[0], x[0]), rate, area_rate / r2 - rate * r2_rate / r2

    def gradient(self, seeds: Mapping[int, Series]) -> list[Series]:
        """Gradient of Σ seed·output over all inputs, as series up to first order.

        ``seeds`` maps output numbers to the weights' series; the second entry of
        each result is its derivative along s (zero when the run has order 0).
        """
        adjoint: list[tuple[Number, Number] | None] = [None] * len(self.nodes)
        for output, weight in seeds.items():
            _accumulate(adjoint, self.tape.outputs[output], weight[0], weight[1])
        for i in range(len(self.nodes) - 1, self.tape.inputs - 1, -1):
            bar = adjoint[i]
            if bar is not None:
                operation, a, _ = self.tape.operations[i]
                self._backward(adjoint, i, operation, a, bar)
        found = adjoint[: self.tape.inputs]
        return [(x[0], x[1], _ZERO) if x is not None else (_ZERO,) * 3 for x in found]

    def _backward(
        self,
        adjoint: list[tuple[Number, Number] | None],
        i: int,
        operation: str,
        a: Any,
        bar: tuple[Number, Number],
    ) -> None:
        nodes = self.nodes
        if operation == "mul":
            b = self.tape.operations[i][2]
            for target, other in ((a, nodes[b]), (b, nodes[a])):
                _accumulate(
                    adjoint, target, bar[0] * other[0], bar[0] * other[1] + bar[1] * other[0]
                )
        elif operation == "add":
            for target in a:
                _accumulate(adjoint, target, bar[0], bar[1])
        elif operation in ("unary", "power", "rational"):
            _, first, second = self.local[i]
            _accumulate(
                adjoint, a, bar[0] * first, bar[1] * first + bar[0] * second * nodes[a][1]
            )
        elif operation in ("Min", "Max"):
            _accumulate(adjoint, self.local[i], bar[0], bar[1])
        elif operation == "atan2":
            y, x, r2, r2_rate = self.local[i]
            for target, part in ((a[0], x), (a[1], tuple(-c for c in y))):
                share = part[0] / r2
                rate = part[1] / r2 - share * r2_rate / r2
                _accumulate(adjoint, target, bar[0] * share, bar[0] * rate + bar[1] * share)


def _accumulate(
    adjoint: list[tuple[Number, Number] | None], target: int, value: Number, rate: Number
) -> None:
    before = adjoint[target]
    adjoint[target] = (value, rate) if before is None else (before[0] + value, before[1] + rate)


def values(
    expressions: Iterable[sp.Expr], point: Mapping[sp.Symbol, Number]
) -> list[Number]:
    """Values of expressions at one point, in the working precision of mpmath."""
    tape = Tape(list(expressions), list(point))
    return tape.run([(mpf(x), _ZERO, _ZERO) for x in point.values()], order=0).values
