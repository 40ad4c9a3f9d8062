"""Forces and constraints at rest as functions of configuration and one parameter.

The unknowns y are the coordinates that forces depend on, multipliers and, last, the parameter.
Residuals F(y), their first and second derivatives, and the matrices M, C and K of small motions
are values of one graph, in doubles over many points at once or in many digits at one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_functions import MANY_DIGITS, enclosed_value
from lagrange_cli.analysis.interval_values import (
    BY_ENDS,
    BY_ENDS_WITHOUT_JUMPS,
    Interval,
    enclosed,
)
from lagrange_cli.analysis.sampled_values import DOUBLES
from lagrange_cli.analysis.values import Matrix, Mpf
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.derivatives import UNIT, Tangent, derivatives
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.graph.value_graph import ScaledNode, ValueGraph

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem


_Nodes: TypeAlias = "dict[tuple[int, ...], ScaledNode]"


@dataclass(frozen=True)
class _Entries:
    """Entries of an array that are not plainly zero, by their indices."""

    shape: tuple[int, ...]
    nodes: Mapping[tuple[int, ...], ScaledNode]


@dataclass(frozen=True)
class Derivatives:
    """F, ∂F/∂y and ∂²F/∂y∂y at a point or over a box, entries by row and unknowns."""

    levels: Sequence[Any]
    slopes: Mapping[tuple[int, ...], Any]
    curvatures: Mapping[tuple[int, ...], Any]


_SPECIAL: dict[str, Callable[..., float]] = {
    "abs": abs,
    "sign": lambda x: float((x > 0) - (x < 0)),
    "min": min,
    "max": max,
}
_IN_FLOATS = {name: getattr(math, name) for name in PROGRAM_FUNCTIONS.keys() - _SPECIAL} | _SPECIAL


class _Plan:
    """Values of a graph that are found together."""

    def __init__(self, graph: ValueGraph, tables: Sequence[_Entries]) -> None:
        self.tables = tables
        wanted = [node for table in tables for node in table.nodes.values()]
        self.evaluation = Evaluation(graph, wanted)

    def __call__(self, inputs: Mapping[str, Any], arithmetic: Arithmetic) -> list[Any]:
        return self.evaluation.at(inputs, arithmetic)


class BranchFunctions:
    """F(y), its derivatives, and the matrices of small motions.

    Parameters
    ----------
    system
        The equations of equilibrium; its values of the parameter do not matter.
    parameter
        The parameter that varies.
    follows
        Parameters that vary with it, as expressions over it and others.

    Attributes
    ----------
    size
        Number N of unknowns beside the parameter, and of equations.
    moving
        Numbers of the coordinates among the unknowns, in their order.
    """

    def __init__(
        self, system: RestSystem, parameter: sp.Symbol, follows: Mapping[sp.Symbol, sp.Expr]
    ) -> None:
        equations = system.equations
        coordinates, closures = equations.system.coordinates, equations.system.closures
        self._put = {**follows}
        self._inputs = {u: e.xreplace(self._put) for u, e in system.inputs.items()}
        self.moving = tuple(k for k in range(len(coordinates)) if k not in system.free)
        self.multipliers = len(closures)
        unknown = [*(coordinates[k].q for k in self.moving), *(c.multiplier for c in closures)]
        self.size = len(unknown)
        velocities = [c.v for c in coordinates]
        fixed = [coordinates[k].q for k in system.free]
        known = {equations.system.t: mpf(0), **system.known}
        known |= {coordinates[k].q: system.start[k] for k in system.free}
        known |= {v: mpf(0) for v in velocities}
        varying = {parameter, *follows, *system.inputs}
        others = [s for s in (*velocities, *fixed, *known) if s not in varying]
        self._known = {s: known[s] for s in dict.fromkeys(others)}
        self._exact_known = {p.symbol: p.exact for p in equations.system.parameters}
        self._order = [*unknown, parameter]
        self._names = {s: f"x{k}" for k, s in enumerate([*self._order, *self._known])}
        self._graph = ValueGraph([(s, name, 0) for s, name in self._names.items()])
        self._by_unknown = self._seeds(self._order)
        self._residuals = self._nonzero((*system.forces, *system.constraints))
        self.is_square = len(self._residuals) == self.size
        slopes = derivatives(self._graph, self._residuals, self._by_unknown)
        self._level = _Entries((len(self._residuals),), dict(_numbered(self._residuals)))
        self._slopes = _table(slopes, (len(self._residuals), self.size + 1))
        self._curvatures = self._second(slopes)
        self._exact = _Plan(self._graph, [self._level])
        self._linear = _Plan(self._graph, [self._level, self._slopes])
        self._bent = _Plan(self._graph, [self._curvatures])
        self._motions = _Plan(self._graph, self._small_motions(system, velocities))
        self._fixed: dict[str, Any] = {self._names[s]: float(x) for s, x in self._known.items()}

    def _converted(self, expressions: Sequence[sp.Expr]) -> list[ScaledNode]:
        """Put what follows the parameter, and inputs, into expressions."""
        placed = (e.xreplace(self._inputs).xreplace(self._put) for e in expressions)
        return [self._graph.convert(e) for e in placed]

    def _nonzero(self, expressions: Sequence[sp.Expr]) -> list[ScaledNode]:
        """Leave out equations of coordinates that no force acts on."""
        return [node for node in self._converted(expressions) if node[0]]

    def _seeds(self, symbols: Sequence[sp.Symbol]) -> dict[int, Tangent]:
        return {self._graph.convert(s)[1]: {k: UNIT} for k, s in enumerate(symbols)}

    def _second(self, slopes: Sequence[Tangent]) -> _Entries:
        """Differentiate the derivatives again."""
        places = [(row, by) for row, tangent in enumerate(slopes) for by in tangent]
        again = derivatives(self._graph, [slopes[r][by] for r, by in places], self._by_unknown)
        shape = (len(slopes), self.size + 1, self.size + 1)
        nodes: _Nodes = {
            (*place, by): node
            for place, tangent in zip(places, again, strict=True)
            for by, node in tangent.items()
        }
        return _Entries(shape, nodes)

    def _small_motions(
        self, system: RestSystem, velocities: Sequence[sp.Symbol]
    ) -> tuple[_Entries, ...]:
        """Prepare M, C, K and the gradients of closures between positions."""
        equations = system.equations
        n = len(equations.system.coordinates)
        reactions = list(equations.system.forcing)
        for closure in equations.system.closures:
            for j, entry in entries(closure.gradient).items():
                reactions[j] += closure.multiplier * entry
        forces = self._converted(reactions)
        by_place = derivatives(self._graph, forces, self._by_unknown)
        by_rate = derivatives(self._graph, forces, self._seeds(velocities))
        closures = self._converted([c.expression for c in equations.system.closures])
        gradients = derivatives(self._graph, closures, self._by_unknown)
        masses: _Nodes = {
            (i, j): self._converted([entry])[0]
            for i, row in enumerate(equations.system.mass_matrix)
            for j, entry in entries(row).items()
        }
        return (
            _Entries((n, n), masses),
            _table(by_rate, (n, n), sign=-1),
            self._of_coordinates(by_place, n, sign=-1),
            self._of_coordinates(gradients, n),
        )

    def _of_coordinates(self, tangents: Sequence[Tangent], n: int, sign: int = 1) -> _Entries:
        """Keep derivatives by coordinates, numbered among all of them."""
        nodes: _Nodes = {
            (row, self.moving[by]): (sign * node[0], node[1])
            for row, tangent in enumerate(tangents)
            for by, node in tangent.items()
            if by < len(self.moving)
        }
        return _Entries((len(tangents), n), nodes)

    @property
    def operations(self) -> int:
        """Return the number of values of the graph."""
        return len(self._graph.nodes)

    # In doubles.

    def residuals(self, y: Matrix) -> tuple[Matrix, Matrix]:
        """Evaluate F, shape (N,), and J = ∂F/∂y, shape (N, N + 1); not finite without values."""
        plan = self._linear
        inputs = dict(self._fixed)
        inputs |= {self._names[s]: x for s, x in zip(self._order, y.tolist(), strict=True)}
        try:
            numbers = plan(inputs, Arithmetic(_IN_FLOATS, float))
        except (ArithmeticError, ValueError):
            return np.full(self._level.shape, np.nan), np.full(self._slopes.shape, np.nan)
        level, slopes = np.zeros(self._level.shape), np.zeros(self._slopes.shape)
        level[:] = numbers[: self.size]
        for place, value in zip(self._slopes.nodes, numbers[self.size :], strict=True):
            slopes[place] = value
        return level, slopes

    def small_motions(self, points: Matrix) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """Evaluate M, C, K and gradients of closures, each with a first axis of points.

        ``points``: shape (N + 1, points).
        """
        inputs = {**self._fixed, **{self._names[s]: points[k] for k, s in enumerate(self._order)}}
        with np.errstate(all="ignore"):
            numbers = iter(self._motions(inputs, DOUBLES))
        arrays = []
        for table in self._motions.tables:
            array = np.zeros((points.shape[1], *table.shape))
            for place in table.nodes:
                index: tuple[Any, ...] = (slice(None), *place)
                array[index] = next(numbers)
            arrays.append(array)
        mass, damping, stiffness, gradients = arrays
        return mass, damping, stiffness, gradients

    # In digits.

    def level_at(self, y: Sequence[Mpf]) -> list[Mpf]:
        """Evaluate F in the digits that are set.

        Raises
        ------
        DomainError
            It has no value.
        """
        return self._in_digits(self._exact, y)

    def slopes_at(self, y: Sequence[Mpf]) -> tuple[list[Mpf], mpmath.matrix]:
        """Evaluate F and J in the digits that are set; raises as :meth:`level_at`."""
        numbers = self._in_digits(self._linear, y)
        slopes = mpmath.zeros(*self._slopes.shape)
        for place, value in zip(self._slopes.nodes, numbers[self.size :], strict=True):
            slopes[place] = value
        return numbers[: self.size], slopes

    def curvatures_at(self, y: Sequence[Mpf]) -> dict[tuple[int, ...], Mpf]:
        """Evaluate ∂²F/∂y∂y, its entries by (row, first, second); raises as :meth:`level_at`."""
        numbers = self._in_digits(self._bent, y)
        return dict(zip(self._curvatures.nodes, numbers, strict=True))

    def entries_at(self, y: Sequence[Mpf]) -> Derivatives:
        """Evaluate F and its first and second derivatives; raises as :meth:`level_at`."""
        numbers = self._in_digits(self._linear, y)
        slopes = dict(zip(self._slopes.nodes, numbers[self.size :], strict=True))
        return Derivatives(numbers[: self.size], slopes, self.curvatures_at(y))

    # Over intervals.

    def enclosed_levels(self, y: Sequence[Interval]) -> list[Interval]:
        """Enclose F.

        Raises
        ------
        ArithmeticError, ValueError
            It has no values somewhere, or jumps.
        """
        return self._enclosed(self._exact, y, BY_ENDS_WITHOUT_JUMPS)

    def enclosed_slopes(self, y: Sequence[Interval]) -> dict[tuple[int, ...], Interval]:
        """Enclose J, its entries by row and column; raises as :meth:`enclosed_levels`."""
        numbers = self._enclosed(self._linear, y, BY_ENDS)[self.size :]
        return dict(zip(self._slopes.nodes, numbers, strict=True))

    def enclosed_entries(self, y: Sequence[Interval]) -> Derivatives:
        """Enclose F and its first and second derivatives; raises as :meth:`enclosed_levels`."""
        curvatures = self._enclosed(self._bent, y, BY_ENDS)
        bent = dict(zip(self._curvatures.nodes, curvatures, strict=True))
        return Derivatives(self.enclosed_levels(y), self.enclosed_slopes(y), bent)

    def _enclosed(
        self,
        plan: _Plan,
        y: Sequence[Interval],
        arithmetic: Arithmetic,
    ) -> list[Interval]:
        point = {self._names[s]: x for s, x in self._enclosed_known.items()}
        point |= {self._names[s]: y[k] for k, s in enumerate(self._order)}
        return enclosed(plan.evaluation, point, arithmetic)

    @cached_property
    def _enclosed_known(self) -> dict[sp.Symbol, Interval]:
        return {s: enclosed_value(x, self._exact_known.get(s)) for s, x in self._known.items()}

    def _in_digits(self, plan: _Plan, y: Sequence[Mpf]) -> list[Mpf]:
        point = {self._names[s]: x for s, x in self._known.items()}
        point |= {self._names[s]: y[k] for k, s in enumerate(self._order)}
        try:
            numbers = plan(point, MANY_DIGITS)
        except (ZeroDivisionError, ValueError) as error:
            raise DomainError from error
        if not all(isinstance(x, mpf) and mpmath.isfinite(x) for x in numbers):
            raise DomainError
        return numbers


def _numbered(nodes: Sequence[ScaledNode]) -> list[tuple[tuple[int, ...], ScaledNode]]:
    return [((row,), node) for row, node in enumerate(nodes)]


def _table(tangents: Sequence[Tangent], shape: tuple[int, int], sign: int = 1) -> _Entries:
    nodes: _Nodes = {
        (row, by): (sign * node[0], node[1])
        for row, tangent in enumerate(tangents)
        for by, node in tangent.items()
    }
    return _Entries(shape, nodes)
