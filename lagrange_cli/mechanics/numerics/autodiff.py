"""Automatic differentiation of SymPy expressions in high precision.

A tape is the list of elementary operations of some expressions, each done
once. It is run on truncated Taylor series in one variable s (so that values,
first and second derivatives along a curve come out together) and backwards
(so that the gradient of a weighted sum of outputs costs one pass). Both are
textbook automatic differentiation: Griewank and Walther, Evaluating
Derivatives (2008), chapters 3, 5 and 13. Nothing here uses SymPy's own
differentiation: the certificate relies on that.

Sums and products are done in :mod:`decimal`, whose arithmetic is compiled. Numbers go in and come
out as mpf by :meth:`Tape.run`, and as decimals by :meth:`Tape.run_in_decimals`: a conversion takes
as long as twenty products.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal
from functools import lru_cache
from operator import attrgetter
from typing import Any

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.bounded_functions import DomainError, Mpf
from lagrange_cli.mechanics.numerics.elementary import (
    Jet,
    constant_decimal,
    finite,
    in_decimals,
    integer_power,
    numbers_as_decimals,
    rational_power,
    to_decimal,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.recording import Recording

__all__ = [
    "DecimalRun",
    "DomainError",
    "Jet",
    "Tape",
    "TapeRun",
    "TaylorSeries",
    "evaluate",
    "evaluate_in_decimals",
]

TaylorSeries = tuple[Mpf, Mpf, Mpf]
"""Value, first and second derivative with respect to s."""

_ZERO = mpf(0)
_DECIMAL_ZERO = Decimal(0)

#: Tapes of expressions that :func:`evaluate` keeps for further points.
_KEPT = 16


class DecimalRun:
    """A tape evaluated at one point in decimals.

    All numbers are those of the decimal context that is current: methods are called within
    :func:`.elementary.in_decimals`, and raise DomainError for numbers that are not finite.

    Attributes
    ----------
    nodes
        Series of each operation.
    local
        Derivatives of each operation by its operands, as its kind needs them.
    """

    def __init__(self, tape: Recording, inputs: Sequence[Jet], order: int) -> None:
        self.tape = tape
        self.order = order
        self.nodes: list[Jet] = []
        self.local: list[Any] = [None] * len(tape.operations)
        self._pending = iter(inputs)
        forward, nodes = self._forward, self.nodes
        for i, (operation, a, b) in enumerate(tape.operations):
            nodes.append(forward(i, operation, a, b))
        if order and not all(x.is_finite() for k in tape.outputs for x in nodes[k]):
            raise DomainError

    @property
    def outputs(self) -> list[Jet]:
        """Series of each output."""
        return [self.nodes[i] for i in self.tape.outputs]

    @property
    def values(self) -> list[Decimal]:
        """Value of each output."""
        return [finite(self.nodes[i][0]) for i in self.tape.outputs]

    def has_positive(self, count: int) -> bool:
        """Say whether the first ``count`` outputs are positive; DomainError if one is infinite."""
        values = [self.nodes[i][0] for i in self.tape.outputs]
        if not all(x.is_finite() for x in values):
            raise DomainError
        return all(x > 0 for x in values[:count])

    def magnitude(self) -> int:
        """Give the decimal exponent of the largest value of a node; 0 if all are zero."""
        return max((x[0].adjusted() for x in self.nodes if x[0]), default=0)

    def _forward(self, i: int, operation: str, a: Any, b: Any) -> Jet:
        nodes, order = self.nodes, self.order
        if operation == "mul":
            return self._multiply(nodes[a], nodes[b])
        if operation == "add":
            terms = [nodes[k] for k in a]
            if not order:
                return sum([x[0] for x in terms], _DECIMAL_ZERO), _DECIMAL_ZERO, _DECIMAL_ZERO
            return (
                sum([x[0] for x in terms], _DECIMAL_ZERO),
                sum([x[1] for x in terms], _DECIMAL_ZERO),
                sum([x[2] for x in terms], _DECIMAL_ZERO) if order > 1 else _DECIMAL_ZERO,
            )
        if operation == "input":
            return next(self._pending)
        if operation == "constant":
            return constant_decimal(a, mpmath.mp.dps), _DECIMAL_ZERO, _DECIMAL_ZERO
        if operation in ("unary", "power", "root"):
            self.local[i] = self._derivatives(operation, nodes[a][0], b)
            return self._compose(self.local[i], nodes[a])
        if operation in ("Min", "Max"):
            choose = min if operation == "Min" else max
            chosen: int = choose(a, key=lambda k: nodes[k][0])
            self.local[i] = chosen
            return nodes[chosen]
        return self._atan2(i, nodes[a[0]], nodes[a[1]])

    def _multiply(self, x: Jet, y: Jet) -> Jet:
        if not self.order:
            return x[0] * y[0], _DECIMAL_ZERO, _DECIMAL_ZERO
        first = x[0] * y[1] + x[1] * y[0]
        if self.order == 1:
            return x[0] * y[0], first, _DECIMAL_ZERO
        return x[0] * y[0], first, x[0] * y[2] + 2 * x[1] * y[1] + x[2] * y[0]

    @staticmethod
    def _derivatives(operation: str, x: Decimal, operand: Any) -> Jet:
        if operation == "power":
            return integer_power(x, operand)
        if operation == "root":
            return rational_power(x, operand)
        function: Callable[[Decimal], Jet] = operand
        return function(x)

    def _compose(self, f: Jet, x: Jet) -> Jet:
        if not self.order:
            return f[0], _DECIMAL_ZERO, _DECIMAL_ZERO
        if self.order == 1:
            return f[0], f[1] * x[1], _DECIMAL_ZERO
        return f[0], f[1] * x[1], f[1] * x[2] + f[2] * x[1] * x[1]

    def _atan2(self, i: int, y: Jet, x: Jet) -> Jet:
        r2 = x[0] * x[0] + y[0] * y[0]
        if not r2:
            raise DomainError
        # The angle's rate w = (x y' − y x')/r²; its derivative by the quotient rule.
        area, area_rate = x[0] * y[1] - y[0] * x[1], x[0] * y[2] - y[0] * x[2]
        rate = area / r2
        r2_rate = 2 * (x[0] * x[1] + y[0] * y[1])
        self.local[i] = (y, x, r2, r2_rate)
        value = to_decimal(mpmath.atan2(to_mpf(y[0]), to_mpf(x[0])))
        return value, rate, area_rate / r2 - rate * r2_rate / r2

    def gradient(self, seeds: Mapping[int, Decimal]) -> list[Decimal]:
        """Differentiate Σ seed·output by every input; ``seeds`` gives weights by output number."""
        below = reversed(range(self.tape.inputs, len(self.nodes)))
        slopes = self._adjoint(seeds, below)
        return [finite(slopes.get(i, _DECIMAL_ZERO)) for i in range(self.tape.inputs)]

    def moving_gradient(self, output: int = 0) -> list[tuple[Decimal, Decimal]]:
        """Differentiate an output by every input, each with its derivative along s.

        That is zero if the run has order 0.
        """
        if not self.order:
            slopes = DecimalRun.gradient(self, {output: Decimal(1)})
            return [(x, _DECIMAL_ZERO) for x in slopes]
        adjoint = {self.tape.outputs[output]: (Decimal(1), _DECIMAL_ZERO)}
        for i in reversed(range(self.tape.inputs, len(self.nodes))):
            bar = adjoint.get(i)
            if bar is not None:
                self._backward(adjoint, i, bar)
        none = _DECIMAL_ZERO, _DECIMAL_ZERO
        sums = (adjoint.get(i, none) for i in range(self.tape.inputs))
        return [(finite(x), finite(rate)) for x, rate in sums]

    def partials(self, output: int) -> dict[int, Decimal]:
        """Differentiate one output by each input that it holds: number → derivative."""
        inputs, slopes = self.tape.inputs, self._slopes_below(output)
        return {i: finite(x) for i, x in sorted(slopes.items()) if i < inputs}

    def _slopes_below(self, output: int) -> dict[int, Decimal]:
        """Differentiate one output by every node below it."""
        return self._adjoint({output: Decimal(1)}, self.tape.below(output))

    def _adjoint(
        self, seeds: Mapping[int, Decimal], operations: Iterable[int]
    ) -> dict[int, Decimal]:
        """Accumulate the derivatives of Σ seed·output by every node (reverse mode).

        ``operations`` are those below the outputs, the last first.
        """
        adjoint: dict[int, Decimal] = {}
        for output, seed in seeds.items():
            node = self.tape.outputs[output]
            adjoint[node] = adjoint[node] + seed if node in adjoint else seed
        for i in operations:
            bar = adjoint.get(i)
            if bar is None:
                continue
            for target, slope in self._local_slopes(i):
                value = bar if slope is None else bar * slope
                before = adjoint.get(target)
                adjoint[target] = value if before is None else before + value
        return adjoint

    def _local_slopes(self, i: int) -> Iterable[tuple[int, Decimal | None]]:
        """Differentiate an operation by each operand; None stands for 1."""
        operation, a, b = self.tape.operations[i]
        if operation == "mul":
            return (a, self.nodes[b][0]), (b, self.nodes[a][0])
        if operation == "add":
            return [(target, None) for target in a]
        if operation in ("unary", "power", "root"):
            return ((a, self.local[i][1]),)
        if operation in ("Min", "Max"):
            return ((self.local[i], None),)
        if operation == "atan2":
            y, x, r2, _ = self.local[i]
            return (a[0], x[0] / r2), (a[1], -y[0] / r2)
        return ()

    def _backward(
        self, adjoint: dict[int, tuple[Decimal, Decimal]], i: int, bar: tuple[Decimal, Decimal]
    ) -> None:
        nodes = self.nodes
        operation, a, b = self.tape.operations[i]
        if operation == "mul":
            for target, factor in ((a, nodes[b]), (b, nodes[a])):
                _accumulate(
                    adjoint, target, bar[0] * factor[0], bar[0] * factor[1] + bar[1] * factor[0]
                )
        elif operation == "add":
            for target in a:
                _accumulate(adjoint, target, bar[0], bar[1])
        elif operation in ("unary", "power", "root"):
            _, first, second = self.local[i]
            _accumulate(adjoint, a, bar[0] * first, bar[1] * first + bar[0] * second * nodes[a][1])
        elif operation in ("Min", "Max"):
            _accumulate(adjoint, self.local[i], bar[0], bar[1])
        elif operation == "atan2":
            y, x, r2, r2_rate = self.local[i]
            for target, part in ((a[0], x), (a[1], tuple(-c for c in y))):
                share = part[0] / r2
                rate = part[1] / r2 - share * r2_rate / r2
                _accumulate(adjoint, target, bar[0] * share, bar[0] * rate + bar[1] * share)


class TapeRun(DecimalRun):
    """A tape evaluated at one point in mpf, within the precision of mpmath."""

    @property
    def outputs(self) -> list[TaylorSeries]:
        """Series of each output."""
        return [(to_mpf(x[0]), to_mpf(x[1]), to_mpf(x[2])) for x in super().outputs]

    @property
    def values(self) -> list[Mpf]:
        """Value of each output."""
        return [to_mpf(self.nodes[i][0]) for i in self.tape.outputs]

    def gradient(self, seeds: Mapping[int, Mpf]) -> list[Mpf]:
        """Differentiate Σ seed·output by every input; ``seeds`` gives weights by output number."""
        with in_decimals():
            return [to_mpf(x) for x in super().gradient(numbers_as_decimals(seeds))]

    def moving_gradient(self, output: int = 0) -> list[tuple[Mpf, Mpf]]:
        """Differentiate an output by every input, each with its derivative along s."""
        with in_decimals():
            pairs = super().moving_gradient(output)
            return [(to_mpf(x), to_mpf(rate)) for x, rate in pairs]

    def partials(self, output: int) -> dict[int, Mpf]:
        """Differentiate one output by each input that it holds: number → derivative."""
        with in_decimals():
            return {i: to_mpf(x) for i, x in super().partials(output).items()}

    def slopes(self, output: int, stop: int) -> dict[int, float]:
        """Differentiate by the inputs before ``stop``, in doubles scaled to a largest one of 1."""
        with in_decimals():
            adjoint = self._slopes_below(output)
            slopes = {i: adjoint[i] for i in sorted(adjoint) if i < stop and adjoint[i]}
            if not all(x.is_finite() for x in slopes.values()):
                raise DomainError
            largest = max(map(abs, slopes.values()), default=_DECIMAL_ZERO)
            return {i: float(x / largest) for i, x in slopes.items()}


def _accumulate(
    adjoint: dict[int, tuple[Decimal, Decimal]], target: int, value: Decimal, rate: Decimal
) -> None:
    before = adjoint.get(target)
    adjoint[target] = (value, rate) if before is None else (before[0] + value, before[1] + rate)


class Tape(Recording):
    """Expressions recorded once, to be evaluated at many points."""

    def run(self, inputs: Sequence[TaylorSeries], order: int = 2) -> TapeRun:
        """Evaluate on Taylor series in s, truncated after ``order`` (0, 1 or 2).

        Raises
        ------
        DomainError
            A value or a derivative is not a finite real number.
        """
        with in_decimals():
            jets = [(to_decimal(x[0]), to_decimal(x[1]), to_decimal(x[2])) for x in inputs]
            return TapeRun(self, jets, order)

    def run_in_decimals(self, inputs: Sequence[Jet], order: int = 2) -> DecimalRun:
        """Evaluate on series of decimals, within :func:`.elementary.in_decimals`.

        Raises
        ------
        DomainError
            A derivative is not a finite real number; :func:`.elementary.in_decimals` raises it for
            values.
        """
        return DecimalRun(self, inputs, order)

    def value(self, expression: sp.Expr, inputs: Sequence[TaylorSeries]) -> Mpf:
        """Evaluate a further expression, which stays recorded with its operations."""
        index = self._record(expression, {})
        return to_mpf(self.run(inputs, 0).nodes[index][0])


def evaluate(expressions: Iterable[sp.Expr], point: Mapping[sp.Symbol, Mpf]) -> list[Mpf]:
    """Evaluate expressions at one point, in the working precision of mpmath."""
    tape, symbols = _tape_at(expressions, point)
    return tape.run([(mpf(point[s]), _ZERO, _ZERO) for s in symbols], order=0).values


def evaluate_in_decimals(
    expressions: Iterable[sp.Expr], point: Mapping[sp.Symbol, Decimal]
) -> list[Decimal]:
    """Evaluate expressions at one point, within :func:`.elementary.in_decimals`."""
    tape, symbols = _tape_at(expressions, point)
    inputs = [(point[s], _DECIMAL_ZERO, _DECIMAL_ZERO) for s in symbols]
    return tape.run_in_decimals(inputs, order=0).values


def _tape_at(
    expressions: Iterable[sp.Expr], point: Mapping[sp.Symbol, Any]
) -> tuple[Tape, tuple[sp.Symbol, ...]]:
    """Give the tape of expressions, and the symbols of a point that it needs."""
    outputs = tuple([sp.sympify(e) for e in expressions])
    present = set().union(*map(symbols_in, outputs))
    symbols = tuple(sorted((s for s in present if s in point), key=attrgetter("name")))
    return _kept_tape(outputs, symbols), symbols


@lru_cache(maxsize=_KEPT)
def _kept_tape(outputs: tuple[sp.Expr, ...], inputs: tuple[sp.Symbol, ...]) -> Tape:
    """The tape of expressions, which are evaluated at many points one after the other."""
    return Tape(outputs, inputs)
