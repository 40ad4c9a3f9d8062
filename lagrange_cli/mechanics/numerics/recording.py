"""Expressions recorded as lists of elementary operations, for :mod:`.autodiff`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath
import sympy as sp

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.free_symbols import is_unknown
from lagrange_cli.mechanics.kinks import STEPS, step_by_signs
from lagrange_cli.mechanics.numerics.bounded_functions import DomainError
from lagrange_cli.mechanics.numerics.elementary import (
    ELEMENTARY_FUNCTIONS,
    unknown_jet,
)
from lagrange_cli.mechanics.tabulated import Tabulated, in_pieces

#: Operations that are recorded as others that they stand for.
_WRITTEN_OUT = (*STEPS, Tabulated)


class Recording:
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
        self._constants: set[int] = set()
        self._products: dict[tuple[int, int], int] = {}
        self._below: dict[int, list[int]] = {}
        self._written_out: dict[sp.Basic, sp.Expr] = {}
        for symbol in inputs:
            self._index[symbol] = self._append("input", None, None)
        self.inputs = len(inputs)
        expressions = [sp.sympify(e) for e in outputs]
        places: dict[int, int] = {}
        self.outputs = [self._record(e, places) for e in expressions]

    def _append(self, operation: str, a: Any, b: Any) -> int:
        self.operations.append((operation, a, b))
        return len(self.operations) - 1

    def _record(self, expr: sp.Expr, places: dict[int, int]) -> int:
        """Give the index of ``expr``, appended after its operands (iterative post-order).

        ``places`` gives the index of each earlier object by its ``id``, which is quicker to look up
        than an equal expression: all objects must be kept meanwhile.
        """
        stack: list[tuple[sp.Basic, bool]] = [(expr, False)]
        while stack:
            top, ready = stack.pop()
            if id(top) in places:
                continue
            known = None if ready else self._index.get(top)
            if known is not None:
                places[id(top)] = known
            elif ready or not top.args:
                self._index[top] = places[id(top)] = self._node(top, places)
            else:
                stack.append((top, True))
                operands = self._operands(top)
                stack.extend([(a, False) for a in reversed(operands) if id(a) not in places])
        return places[id(expr)]

    def _operands(self, expr: sp.Basic) -> tuple[sp.Basic, ...]:
        """Return the arguments of an operation; that of a step or of a table is it written out."""
        if not isinstance(expr, _WRITTEN_OUT):
            operands: tuple[sp.Basic, ...] = expr.args
            return operands
        if expr not in self._written_out:
            is_step = isinstance(expr, STEPS)
            self._written_out[expr] = step_by_signs(expr) if is_step else in_pieces(expr)
        return (self._written_out[expr],)

    def _node(self, expr: sp.Basic, places: Mapping[int, int]) -> int:
        args = [places[id(a)] for a in self._operands(expr)]
        if isinstance(expr, _WRITTEN_OUT):
            return args[0]
        if self._constants.issuperset(args):
            if not expr.is_Rational:
                value = expr.evalf(mpmath.mp.dps + 5)
                if not (value.is_real and value.is_finite):
                    raise DomainError
            constant = self._append("constant", expr, None)
            self._constants.add(constant)
            return constant
        if expr.is_Add:
            return self._append("add", tuple(args), None)
        if expr.is_Mul:
            product = args[0]
            for factor in args[1:]:
                product = self._product(product, factor)
            return product
        if expr.is_Pow:
            return self._pow(expr, args)
        if expr.func in ELEMENTARY_FUNCTIONS:
            return self._append("unary", args[0], ELEMENTARY_FUNCTIONS[expr.func])
        if is_unknown(expr):
            return self._append("unary", args[0], unknown_jet(expr.func.__name__))
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
            return self._append("root", args[0], exponent)
        if base is sp.E:
            return self._append("unary", args[1], ELEMENTARY_FUNCTIONS[sp.exp])
        logarithm = self._append("unary", args[0], ELEMENTARY_FUNCTIONS[sp.log])
        return self._append(
            "unary", self._product(args[1], logarithm), ELEMENTARY_FUNCTIONS[sp.exp]
        )

    def below(self, output: int) -> list[int]:
        """List the operations that an output needs, the last first."""
        if output not in self._below:
            needed, stack = set[int](), [self.outputs[output]]
            while stack:
                i = stack.pop()
                if i >= self.inputs and i not in needed:
                    needed.add(i)
                    stack.extend(self.operands(i))
            self._below[output] = sorted(needed, reverse=True)
        return self._below[output]

    def operands(self, i: int) -> tuple[int, ...]:
        """Give the numbers of the operations that operation ``i`` reads."""
        operation, a, b = self.operations[i]
        if operation == "constant":
            return ()
        if operation == "mul":
            return a, b
        return a if isinstance(a, tuple) else (a,)
