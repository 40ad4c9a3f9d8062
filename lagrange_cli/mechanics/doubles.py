"""Tapes evaluated in doubles: the first steps towards a point that is wanted in many digits.

Whatever doubles do not reach (an overflow, a value that is not real) is an error of
arithmetic; the same evaluation in high precision tells what it means.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from typing import Any

from lagrange_cli.mechanics.functions import DomainError, constant, context
from lagrange_cli.mechanics.tape import Tape

__all__ = ["DoubleRun"]

#: Digits of functions that are taken from high precision.
_DIGITS = 20


class DoubleRun:
    """A tape evaluated at one point.

    Raises
    ------
    ArithmeticError, ValueError
        A value is no finite real number in doubles.
    """

    def __init__(self, tape: Tape, inputs: Sequence[float]) -> None:
        self._tape = tape
        self._nodes: list[float] = list(inputs)
        #: What each operation multiplies an adjoint by, for each of its operands.
        self._shares: dict[int, Sequence[float]] = {}
        with localcontext(context(_DIGITS)):
            for i in range(tape.inputs, len(tape.operations)):
                self._nodes.append(self._forward(i, *tape.operations[i]))
        if not all(map(math.isfinite, self.values)):
            raise DomainError

    @property
    def values(self) -> list[float]:
        """Value of each output."""
        return [self._nodes[k] for k in self._tape.outputs]

    def _forward(self, i: int, operation: str, a: Any, b: Any) -> float:
        nodes = self._nodes
        if operation == "mul":
            self._shares[i] = nodes[b], nodes[a]
            return nodes[a] * nodes[b]
        if operation == "add":
            return math.fsum([nodes[k] for k in a])
        if operation == "constant":
            return float(constant(a, _DIGITS))
        if operation == "power":
            self._shares[i] = (b * nodes[a] ** (b - 1) if b else 0.0,)
            power: float = nodes[a] ** b
            return power
        if operation in ("Min", "Max"):
            choose = min if operation == "Min" else max
            chosen: int = choose(a, key=nodes.__getitem__)
            self._shares[i] = [float(k == chosen) for k in a]
            return nodes[chosen]
        if operation == "atan2":
            y, x = nodes[a[0]], nodes[a[1]]
            self._shares[i] = x / (x * x + y * y), -y / (x * x + y * y)
            return math.atan2(y, x)
        return self._function(i, operation, a, b)

    def _function(self, i: int, operation: str, a: int, b: Any) -> float:
        """A root, or one of the functions of one argument."""
        x = self._nodes[a]
        if operation == "root":
            if x < 0:
                raise DomainError
            value = x ** float(b)
            self._shares[i] = (float(b) * value / x,)
            return float(value)
        found = b(Decimal(x))
        self._shares[i] = (float(found[1]),)
        return float(found[0])

    def partials(self, output: int) -> dict[int, float]:
        """Derivatives of one output by the inputs that it holds, by their numbers."""
        tape, shares = self._tape, self._shares
        adjoint: dict[int, float] = {tape.outputs[output]: 1.0}
        for i in tape.below(output):
            bar = adjoint.pop(i, 0.0)
            if not bar:
                continue
            operands = tape.operands(i)
            for k, share in zip(operands, shares.get(i) or (1.0,) * len(operands), strict=True):
                adjoint[k] = adjoint.get(k, 0.0) + bar * share
        return {j: adjoint[j] for j in sorted(adjoint) if j < tape.inputs and adjoint[j]}
