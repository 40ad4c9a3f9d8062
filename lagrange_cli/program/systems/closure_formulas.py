"""Residuals, rates and magnitudes of closures as formulas for loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.operands import magnitude
from lagrange_cli.program.graph.value_graph import ONE, ScaledNode, ValueGraph
from lagrange_cli.program.systems.loop_builder import Formula

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure, Coordinate


def _gradient_square(
    gradient: Sequence[Expr], masses: Sequence[Expr], values: ValueGraph
) -> list[ScaledNode]:
    """Add Σ gradient²/M to a graph."""
    pairs = zip(gradient, masses, strict=True)
    convert = values.convert
    return [values.add([values.multiply([(convert(g), 2), (convert(m), -1)]) for g, m in pairs])]


def gradient_squares(equations: Equations) -> list[Formula]:
    """Make gradient²/M of each closure of positions."""
    formulas = []
    for closure in equations.system.closures:
        if closure.kind == "position":
            row = entries(closure.gradient)
            gradient = tuple(row.values())
            masses = tuple(equations.system.mass_matrix[j][j] for j in row)
            make = partial(_gradient_square, gradient, masses)
            formulas.append(Formula("square", (*gradient, *masses), make))
    return formulas


_Coordinates: TypeAlias = "Sequence[Coordinate]"
"""Coordinates that a closure holds, in the order of its gradient."""
ClosureFunction: TypeAlias = "Callable[[ValueGraph, Closure, _Coordinates], ScaledNode]"
"""A value of a closure, put into a graph."""


def _products(values: ValueGraph, closure: Closure, by: Sequence[Expr]) -> list[ScaledNode]:
    """List the terms of gradient·x; ``by`` holds x at the coordinates of the closure."""
    gradient = entries(closure.gradient).values()
    pairs = zip(gradient, by, strict=True)
    return [values.multiply([(values.convert(g), 1), (values.convert(x), 1)]) for g, x in pairs]


def _rate_terms(values: ValueGraph, closure: Closure, row: _Coordinates) -> list[ScaledNode]:
    return [*_products(values, closure, [c.v for c in row]), values.convert(closure.rate)]


def closure_rate(values: ValueGraph, closure: Closure, row: _Coordinates) -> ScaledNode:
    """Add up φ̇ or ψ, which velocities make zero."""
    return values.add(_rate_terms(values, closure, row))


def _rate_size(values: ValueGraph, closure: Closure, row: _Coordinates) -> ScaledNode:
    """Add up the magnitudes of the terms of a rate."""
    return _magnitude(values, _rate_terms(values, closure, row))


def _size(values: ValueGraph, closure: Closure, row: _Coordinates) -> ScaledNode:
    """Add up the magnitudes of φ: its terms, and those of the coordinates to first order."""
    terms = [values.convert(term) for term in _terms(closure.expression)]
    return _magnitude(values, [*terms, *_products(values, closure, [c.q for c in row])])


def _magnitude(values: ValueGraph, terms: Sequence[ScaledNode]) -> ScaledNode:
    return values.add(
        (magnitude(c), n) if n == ONE else values.call("abs", (c, n)) for c, n in terms if c
    )


def _terms(expression: Expr) -> tuple[Expr, ...]:
    return tuple(expression.args) if expression.is_Add else (expression,)


def closure_expression(values: ValueGraph, closure: Closure, _: _Coordinates) -> ScaledNode:
    return values.convert(closure.expression)


def closure_bias(values: ValueGraph, closure: Closure, _: _Coordinates) -> ScaledNode:
    return values.convert(closure.bias)


#: Output → kind of its closures (empty: all), and its value.
CLOSURE_FORMULAS: dict[str, tuple[str, ClosureFunction]] = {
    "closure_sizes": ("position", _size),
    "closure_rates": ("", closure_rate),
    "closure_rate_sizes": ("", _rate_size),
}


def closure_formulas(equations: Equations, output: str) -> list[Formula]:
    """The formulas of an output of :data:`CLOSURE_FORMULAS`."""
    kind, make = CLOSURE_FORMULAS[output]
    values = (ClosureValue(make, c, equations) for c in equations.system.closures if kind in c.kind)
    return [Formula(make.__name__, value.parts, value) for value in values]


@dataclass(frozen=True)
class ClosureValue:
    """A value of a closure that a graph can compute.

    Attributes
    ----------
    make
        Puts the value into a graph.
    closure
        The closure.
    equations
        The equations that it belongs to.
    """

    make: ClosureFunction
    closure: Closure
    equations: Equations

    @property
    def coordinates(self) -> _Coordinates:
        return [self.equations.system.coordinates[j] for j in self.closure.coordinate_numbers]

    @property
    def parts(self) -> tuple[Expr, ...]:
        """Expressions of the value."""
        closure = self.closure
        if self.make is closure_expression:
            return (closure.expression,)
        if self.make is closure_bias:
            return (closure.bias,)
        gradient = entries(closure.gradient).values()
        if self.make is _size:
            return (*_terms(closure.expression), *gradient, *(c.q for c in self.coordinates))
        return (closure.rate, *gradient, *(c.v for c in self.coordinates))

    def __call__(self, values: ValueGraph) -> list[ScaledNode]:
        return [self.make(values, self.closure, self.coordinates)]
