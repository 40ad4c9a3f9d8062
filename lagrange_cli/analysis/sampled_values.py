"""Values of expressions at many random states at once, in doubles.

They only suggest relations, each of which is proven afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.free_symbols import is_open, name_and_order
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.graph.value_graph import ValueGraph

Array: TypeAlias = NDArray[np.float64]

_OTHERS: dict[str, Callable[..., Any]] = {
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "asinh": np.arcsinh,
    "acosh": np.arccosh,
    "atanh": np.arctanh,
    "atan2": np.arctan2,
    "pow": np.power,
    "min": np.minimum,
    "max": np.maximum,
}
#: Functions of programs over arrays of doubles.
IN_DOUBLES = {name: getattr(np, name) for name in PROGRAM_FUNCTIONS.keys() - _OTHERS} | _OTHERS


def double(value: Any) -> np.float64:
    """Return a double that divides by zero and overflows as arrays do, without an exception."""
    try:
        return np.float64(float(value))
    except OverflowError:
        return np.float64(np.inf if value > 0 else -np.inf)


#: Arithmetic over arrays of doubles.
DOUBLES = Arithmetic(IN_DOUBLES, double)

#: States drawn for each wanted one: at some an expression is not real.
_DRAWN = 3

#: Widths of draws around the initial state, tried in turn; None for states of size 1 about zero.
_WIDTHS = (None, 0.3, 0.03)


class SampledValues:
    """Random states of a system: q, v and t differ from state to state, parameters do not.

    Parameters
    ----------
    number
        States that are wanted.
    seed
        Seed of the random numbers, so that results are the same from run to run.

    Attributes
    ----------
    parameters
        Symbol → its number. Numbers of size 1 are drawn, so that none is lost beside another, where
        expressions have values with them; else they are near those of the scene.
    states
        Symbol of q, v, t, an input or a state → its numbers, shape (states,).
    """

    def __init__(self, equations: Equations, number: int, seed: int = 1) -> None:
        self._equations, self._number = equations, number
        self._random = np.random.default_rng(seed)
        self.parameters: dict[sp.Symbol, float] = {}
        self.states: dict[sp.Symbol, Array] = {}
        self._draw(None)

    def _draw(self, width: float | None) -> None:
        """Draw states of size 1, or around the initial one and with the scene's parameters."""
        equations, random = self._equations, self._random
        coordinates = equations.system.coordinates
        symbols = [equations.system.t, *(x.symbol for x in equations.system.external)]
        symbols += [s for c in coordinates for s in (c.q, c.v)]
        numbers = [p.value if width else None for p in equations.system.parameters]
        self.parameters = {
            p.symbol: float(random.uniform(1.0, 2.0) if x is None else x * random.uniform(0.9, 1.1))
            for p, x in zip(equations.system.parameters, numbers, strict=True)
        }
        start: dict[sp.Symbol, float] = {}
        if width and equations.system.initial is not None:
            start = dict(
                zip((c.q for c in coordinates), equations.system.initial.positions, strict=False)
            )
        shape = _DRAWN * self._number
        reach = 2.0 * (width or 1.0)
        self.states = {s: start.get(s, 0.0) + random.uniform(-reach, reach, shape) for s in symbols}

    def values_at_states(self, expressions: Sequence[sp.Expr]) -> Array:
        """Evaluate expressions at as many states as are wanted, shape (expressions, states).

        ``parameters`` and ``states`` become those of the result: states at which all expressions
        are finite, fewer or none if there are not enough.
        """
        stood_in = [_with_stand_ins(e) for e in expressions]
        for width in _WIDTHS:
            self._draw(width)
            numbers = self._values(stood_in)
            real = np.flatnonzero(np.isfinite(numbers).all(axis=0))[: self._number]
            if len(real) == self._number:
                break
        self.states = {s: x[real] for s, x in self.states.items()}
        return numbers[:, real]

    def _values(self, expressions: Sequence[sp.Expr]) -> Array:
        inputs = [(s, f"p{k}", 1) for k, s in enumerate(self.parameters)]
        inputs += [(s, f"q{k}", 2) for k, s in enumerate(self.states)]
        numbers = [*self.parameters.values(), *self.states.values()]
        values = ValueGraph(inputs)
        wanted = [values.convert(e) for e in expressions]
        named = {name: x for (_, name, _), x in zip(inputs, numbers, strict=True)}
        with np.errstate(all="ignore"):
            rows = Evaluation(values, wanted).at(named, DOUBLES)
        count = _DRAWN * self._number
        return np.array([np.broadcast_to(row, (count,)) for row in rows]).reshape(-1, count)


def _with_stand_ins(expression: sp.Expr) -> sp.Expr:
    """Substitute a smooth function for each unknown one."""
    unknown = [e for e in sp.preorder_traversal(expression) if is_open(e)]
    return expression.xreplace({e: _stand_in(e) for e in unknown}) if unknown else expression


def _stand_in(applied: sp.Expr) -> sp.Expr:
    name, order = name_and_order(applied)
    x, phase = sp.Dummy(), sp.Rational(sum(map(ord, name)) % 97, 31)
    smooth = sp.sin(sp.Rational(13, 10) * x + phase) + sp.sin(sp.Rational(7, 10) * x + 2 * phase)
    return smooth.diff(x, order).xreplace({x: _with_stand_ins(applied.args[0])})
