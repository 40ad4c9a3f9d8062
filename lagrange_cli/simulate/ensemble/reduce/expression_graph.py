"""An expression over t, the state and the parameters as a graph, evaluated with interval series.

A model's outputs are evaluated once over objects, each of which remembers by which
operation it was made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.interpreter.arithmetic import objects
from lagrange_cli.program.lowered.stored import StoredFunctions
from lagrange_cli.simulate.ensemble.reduce import interval_series as series
from lagrange_cli.simulate.ensemble.reduce.interval_series import Series
from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.rounding import parameter_values
from lagrange_cli.simulate.system.tracing import over_objects

#: A flag for each interval.
Flags = NDArray[np.bool_]


class Node:
    """A number that an operation makes of others, or an input."""

    __slots__ = ("arguments", "operation")

    def __init__(self, operation: str, *arguments: Node | float) -> None:
        self.operation, self.arguments = operation, arguments

    def __add__(self, second: Node | float) -> Node:
        return Node("+", self, second)

    def __radd__(self, second: float) -> Node:
        return Node("+", second, self)

    def __sub__(self, second: Node | float) -> Node:
        return Node("-", self, second)

    def __rsub__(self, second: float) -> Node:
        return Node("-", second, self)

    def __mul__(self, second: Node | float) -> Node:
        # A product of two equal factors is a square, which is not negative.
        if second is self:
            return Node("square", self)
        if self.operation == "*" and self.arguments[1] is second:
            return Node("*", self.arguments[0], Node("square", second))
        return Node("*", self, second)

    def __rmul__(self, second: float) -> Node:
        return Node("*", second, self)

    def __truediv__(self, second: Node | float) -> Node:
        return Node("/", self, second)

    def __rtruediv__(self, second: float) -> Node:
        return Node("/", second, self)

    def __pow__(self, second: Node | float) -> Node:
        return Node("pow", self, second)

    def __neg__(self) -> Node:
        return Node("neg", self)

    def __abs__(self) -> Node:
        return Node("abs", self)

    def __gt__(self, second: float) -> bool:
        # Comparisons tell whether a state has accelerations; graphs are of those that have.
        return True


@dataclass(frozen=True)
class Outputs:
    """The outputs of a model as graphs.

    Attributes
    ----------
    t, state, parameters
        Time, state and parameters.
    inputs
        Numbers of the present pieces of recorded inputs.
    values
        Name of an output → its graph.
    rates
        Time derivatives of the state; None if they need more than numbers.
    """

    t: Node
    state: tuple[Node, ...]
    parameters: tuple[Node, ...]
    inputs: tuple[Node, ...]
    values: Mapping[str, Node | float]
    rates: tuple[Node | float, ...] | None


def outputs_of(model: Model, inputs: int) -> Outputs | None:
    """Trace the outputs of a model; None if they need more than numbers.

    ``inputs``: numbers of a piece of recorded inputs.
    """
    if model.driven:
        return None
    sizes = model.layout.size, len(parameter_values(model)), inputs
    return _traced(model.code.functions, model.outputs, *sizes)


@cache
def _traced(
    code: StoredFunctions, names: tuple[str, ...], size: int, parameters: int, inputs: int
) -> Outputs | None:
    t, *leaves = (Node("input") for _ in range(1 + size + parameters + inputs))
    state, known, pieces = leaves[:size], leaves[size:][:parameters], leaves[size:]
    pieces = pieces[parameters:]
    called = over_objects(code, objects({name: partial(Node, name) for name in PROGRAM_FUNCTIONS}))
    try:
        values = called("outputs", t, state, known, pieces)
    except UnfitError:
        return None
    made = dict(zip(names, values, strict=False))
    try:
        rates = tuple(called("rhs", t, state, known, pieces))
    except UnfitError:
        rates = None
    return Outputs(t, tuple(state), tuple(known), tuple(pieces), made, rates)


@dataclass
class Domain:
    """Places at which an expression has no value, flags of shape (m,).

    Attributes
    ----------
    partly
        It has none at some place of an interval, or may have none.
    nowhere
        It has none at any place.
    """

    partly: Flags
    nowhere: Flags

    @classmethod
    def whole(cls, count: int) -> Domain:
        """Return flags of places none of which is known to be without a value."""
        return cls(np.zeros(count, bool), np.zeros(count, bool))

    def require(self, u: Series, least: float, most: float) -> None:
        """Note where an argument is not between bounds."""
        self.partly |= (u.low[0] < least) | (u.high[0] > most)
        self.nowhere |= (u.high[0] < least) | (u.low[0] > most)


#: Function → least and largest argument.
_DOMAINS = {
    "sqrt": (0.0, np.inf),
    "log": (0.0, np.inf),
    "asin": (-1.0, 1.0),
    "acos": (-1.0, 1.0),
    "atanh": (-1.0, 1.0),
    "acosh": (1.0, np.inf),
}

_FUNCTIONS: Mapping[str, Callable[..., Series]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "neg": lambda a: -a,
    "square": series.square,
    "sqrt": partial(series.power, exponent=0.5),
    "exp": series.exponential,
    "log": series.logarithm,
    "sin": lambda a: series.sine_and_cosine(a)[0],
    "cos": lambda a: series.sine_and_cosine(a)[1],
    "tan": series.tangent,
    "asin": series.arc_sine,
    "acos": series.arc_cosine,
    "atan": series.arc_tangent,
    "sinh": lambda a: series.hyperbolic_pair(a)[0],
    "cosh": lambda a: series.hyperbolic_pair(a)[1],
    "tanh": series.hyperbolic_tangent,
    "asinh": series.area_sine,
    "acosh": series.area_cosine,
    "atanh": series.area_tangent,
    "abs": series.magnitude,
    "sign": series.sign,
    "max": series.largest,
    "min": lambda a, b: -series.largest(-a, -b),
    "atan2": series.angle,
}


def evaluated(
    roots: Sequence[Node | float], inputs: Mapping[Node, Series], domain: Domain
) -> list[Series]:
    """Evaluate graphs; every operation once."""
    like = next(iter(inputs.values()))
    known: dict[Node, Series] = dict(inputs)
    stack: list[Node] = [root for root in roots if isinstance(root, Node)]
    while stack:
        node = stack[-1]
        missing = [a for a in node.arguments if isinstance(a, Node) and a not in known]
        if node in known or not missing:
            stack.pop()
            if node not in known:
                known[node] = _made(node, known, like, domain)
        else:
            stack.extend(missing)
    return [_argument(root, known, like) for root in roots]


def _argument(value: Node | float, known: Mapping[Node, Series], like: Series) -> Series:
    if isinstance(value, Node):
        return known[value]
    return Series.constant(np.array(float(value)), like)


def _made(node: Node, known: Mapping[Node, Series], like: Series, domain: Domain) -> Series:
    """Apply the operation of a node."""
    arguments: list[Any] = [_argument(a, known, like) for a in node.arguments]
    if node.operation == "pow":
        base, exponent = arguments
        return _power(base, exponent, domain)
    if node.operation in _DOMAINS:
        domain.require(arguments[0], *_DOMAINS[node.operation])
    return _FUNCTIONS[node.operation](*arguments)


def _power(base: Series, exponent: Series, domain: Domain) -> Series:
    """Return a power, whose exponent may be the same number everywhere."""
    first = float(exponent.low[0, 0])
    same = (exponent.low[0] == first).all() and (exponent.high[0] == first).all()
    if same and not exponent.low[1:].any() and not exponent.high[1:].any():
        if first != int(first):
            domain.require(base, 0.0, np.inf)
        return series.power(base, first)
    domain.require(base, 0.0, np.inf)
    return series.exponential(exponent * series.logarithm(base))
