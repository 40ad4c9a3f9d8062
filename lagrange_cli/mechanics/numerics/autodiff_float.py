"""Automatic differentiation of tapes in doubles, with a sparse Jacobian.

Independent operations are done at once, level by level, and the Jacobian matrix is carried along as
a sparse one (forward accumulation; Griewank and Walther, Evaluating Derivatives, 2008, sections 3.1
and 7.2). It brings Newton's method close to points of which many digits are needed. Overflow, or a
value that is not real, is an error of arithmetic here; the same evaluation in high precision tells
the cause.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.mechanics.numerics.autodiff import Tape
from lagrange_cli.mechanics.numerics.bounded_functions import DomainError
from lagrange_cli.mechanics.numerics.elementary import (
    constant_decimal,
    decimal_context,
)

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_Array: TypeAlias = NDArray[np.float64]
_Numbers: TypeAlias = NDArray[np.int64]

#: Decimal digits of functions that are evaluated in high precision: more than a double has.
_DIGITS = 20


@dataclass(frozen=True)
class _Group:
    """Operations of one kind on one level.

    Attributes
    ----------
    operands
        Numbers of nodes, shape (operations, arity).
    by
        Exponent, function or constant that the kind needs.
    """

    operation: str
    operands: _Numbers
    by: Any


class DoubleTape:
    """A tape whose nodes are numbered by levels.

    Parameters
    ----------
    width
        Number of leading inputs by which derivatives are taken.
    """

    def __init__(self, tape: Tape, width: int) -> None:
        self._inputs, self._width = tape.inputs, width
        groups: dict[tuple[int, str, int, Any], list[int]] = {}
        level = [0] * tape.inputs
        for i in range(tape.inputs, len(tape.operations)):
            operation, a, b = tape.operations[i]
            operands = tape.operands(i)
            level.append(1 + max((level[k] for k in operands), default=0))
            by = a if operation == "constant" else b if operation != "mul" else None
            groups.setdefault((level[i], operation, len(operands), by), []).append(i)
        place = list(range(tape.inputs)) + [0] * (len(tape.operations) - tape.inputs)
        self._levels: list[list[_Group]] = [[] for _ in range(max(level, default=0))]
        count = tape.inputs
        for key in sorted(groups, key=lambda key: key[0]):
            (height, operation, arity, by), members = key, groups[key]
            for i in members:
                place[i], count = count, count + 1
            places = [[place[k] for k in tape.operands(i)] for i in members]
            shaped = np.array(places, dtype=np.int64).reshape(len(members), arity)
            self._levels[height - 1].append(_Group(operation, shaped, by))
        self._outputs = np.array([place[k] for k in tape.outputs], dtype=np.int64)

    def run(self, inputs: Sequence[float]) -> tuple[_Array, csr_array]:
        """Evaluate the outputs, shape (m,), and their Jacobian matrix, shape (m, width).

        Raises
        ------
        ArithmeticError
            A value or a derivative is no finite real number in doubles.
        """
        from scipy.sparse import csr_array, eye_array, vstack

        nodes = np.array(inputs, dtype=np.float64)
        slopes = eye_array(self._inputs, self._width, format="csr")
        with np.errstate(all="ignore"), localcontext(decimal_context(_DIGITS)):
            for groups in self._levels:
                results = [_FORWARD[g.operation](nodes[g.operands], g.by) for g in groups]
                shares = np.concatenate([share.ravel() for _, share in results])
                columns = np.concatenate([g.operands.ravel() for g in groups])
                counts = np.concatenate([np.full(*g.operands.shape) for g in groups])
                ends = np.concatenate([[0], np.cumsum(counts)])
                local = csr_array((shares, columns, ends), shape=(len(counts), len(nodes)))
                slopes = vstack([slopes, local @ slopes], format="csr")
                nodes = np.concatenate([nodes, *(value for value, _ in results)])
        values, jacobian = nodes[self._outputs], slopes[self._outputs]
        if not (np.isfinite(values).all() and np.isfinite(jacobian.data).all()):
            raise DomainError
        return values, jacobian


#: Operands, shape (operations, arity), and ``by`` → values, and slopes by each operand.
_Forward: TypeAlias = Callable[[_Array, Any], tuple[_Array, _Array]]


def _constant(x: _Array, number: Any) -> tuple[_Array, _Array]:
    return np.full(len(x), float(constant_decimal(number, _DIGITS))), x


def _add(x: _Array, _: Any) -> tuple[_Array, _Array]:
    return x.sum(axis=1), np.ones_like(x)


def _multiply(x: _Array, _: Any) -> tuple[_Array, _Array]:
    return x.prod(axis=1), x[:, ::-1]


def _power(x: _Array, exponent: Any) -> tuple[_Array, _Array]:
    n = float(exponent)
    return (x**n)[:, 0], n * x ** (n - 1) if n else np.zeros_like(x)


def _function(x: _Array, function: Any) -> tuple[_Array, _Array]:
    jets = [function(Decimal(value)) for value in x[:, 0].tolist()]
    values, slopes = (np.array([float(f[k]) for f in jets]) for k in (0, 1))
    return values, slopes[:, None]


def _chosen(x: _Array, numbers: _Numbers) -> tuple[_Array, _Array]:
    rows = np.arange(len(x))
    shares = np.zeros_like(x)
    shares[rows, numbers] = 1.0
    return x[rows, numbers], shares


def _atan2(x: _Array, _: Any) -> tuple[_Array, _Array]:
    rise, run = x[:, 0], x[:, 1]
    return np.arctan2(rise, run), np.stack([run, -rise], axis=1) / (x**2).sum(axis=1)[:, None]


_FORWARD: dict[str, _Forward] = {
    "constant": _constant,
    "add": _add,
    "mul": _multiply,
    "power": _power,
    "root": _power,
    "unary": _function,
    "Min": lambda x, _: _chosen(x, x.argmin(axis=1)),
    "Max": lambda x, _: _chosen(x, x.argmax(axis=1)),
    "atan2": _atan2,
}
