"""Right-hand sides as expressions, for methods that differentiate them.

A right-hand side may have an attribute ``expressions``. Its text is then run over objects in
place of numbers: what it does with them is the expression.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs

#: (functions, t, y, p, u) → slopes: a right-hand side run over objects. The functions are those
#: of :mod:`math` by name, and ``solve``, of a matrix, right sides, and the number of rows that
#: are the mass matrix's; the text calls no others.
Tracer: TypeAlias = Callable[
    [Mapping[str, Callable[..., Any]], Any, Sequence[Any], Sequence[Any], Sequence[Any]],
    Sequence[Any],
]


@dataclass(frozen=True)
class Expressions:
    """A right-hand side that can be traced.

    Attributes
    ----------
    trace
        Runs it over objects.
    parameters
        Values of its parameters, shape (parameters,).
    inputs
        Values of its inputs, shape (inputs,).
    """

    trace: Tracer
    parameters: Array
    inputs: Array


def expressions(rhs: Rhs) -> Expressions | None:
    """Return the tracer and numbers of a right-hand side, None if only values are to be had."""
    parts: Expressions | None = getattr(rhs, "expressions", None)
    return parts
