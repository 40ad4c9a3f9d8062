"""Values of the equations of motion at rest, with exact derivatives, over any numbers.

All are values of one graph, differentiated on it (:mod:`~lagrange_cli.program.graph.derivatives`)
and evaluated in doubles over many configurations at once, or in many digits at one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.interval_values import (
    BY_ENDS,
    BY_ENDS_WITHOUT_JUMPS,
    Interval,
    around,
    enclosed,
    interval_of_ratio,
)
from lagrange_cli.analysis.sampled_values import DOUBLES, double
from lagrange_cli.analysis.values import Matrix, Mpf
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.numerics.bounded_functions import BOUNDED_FUNCTIONS
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.derivatives import UNIT, Tangent, derivatives
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.graph.value_graph import ScaledNode, ValueGraph

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.graph.operands import Coefficient

_OTHERS: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "sign": mpmath.sign,
    "min": min,
    "max": max,
} | BOUNDED_FUNCTIONS

#: Functions of programs in the digits of mpmath; they raise DomainError beyond what memory holds.
IN_DIGITS = {name: getattr(mpmath, name) for name in PROGRAM_FUNCTIONS.keys() - _OTHERS} | _OTHERS


#: Part of a number by which its decimals differ from it at most, and bits of one without rounding.
_DECIMALS, _SHORT = mpf(10) ** -38, 64


def exact_number(x: Coefficient) -> Mpf:
    return mpf(x.numerator) / x.denominator


def exact_value(value: Mpf, exact: sp.Expr | None) -> sp.Expr | None:
    """Return the exact number that decimals of a parameter stand for; None if it is not known.

    ``exact``: the number that the scene gives; ``value`` may be another one.
    """
    if exact is not None and not exact.free_symbols:
        near = abs(mpf(sp.N(exact, 50)) - value) <= _DECIMALS * abs(value)
        if near:
            return exact
    if value.man.bit_length() <= _SHORT:
        return sp.Rational(*mpmath.libmp.to_rational(value._mpf_))
    return None


def enclosed_value(value: Mpf, exact: sp.Expr | None) -> Interval:
    """Enclose the exact number that decimals of a parameter stand for, as :func:`exact_value`."""
    number = exact_value(value, exact)
    if number is not None and number.is_Rational:
        return interval_of_ratio(number)
    return around(value, _DECIMALS * abs(value))


class _Sized:
    """A number with the size of the terms that it is a sum of: one small beside it is rounding."""

    __slots__ = ("size", "value")

    def __init__(self, value: Mpf, size: Mpf) -> None:
        self.value, self.size = value, size

    def __add__(self, addend: _Sized) -> _Sized:
        return _Sized(self.value + addend.value, self.size + addend.size)

    def __mul__(self, factor: _Sized) -> _Sized:
        return _Sized(self.value * factor.value, self.size * factor.size)

    def __truediv__(self, divisor: _Sized) -> _Sized:
        return _Sized(self.value / divisor.value, self.size / abs(divisor.value))

    def __pow__(self, exponent: int) -> _Sized:
        return _Sized(self.value**exponent, self.size**exponent)


def _sized(x: Mpf) -> _Sized:
    return _Sized(x, abs(x))


def _of_sized(function: Callable[..., Mpf]) -> Callable[..., _Sized]:
    return lambda *arguments: _sized(function(*(x.value for x in arguments)))


#: Arithmetic in the digits of mpmath.
MANY_DIGITS = Arithmetic(IN_DIGITS, exact_number)


def _of_sizes(plain: Arithmetic) -> Arithmetic:
    functions = {name: _of_sized(function) for name, function in plain.functions.items()}
    return Arithmetic(functions, lambda x: _sized(plain.number(x)))


_SIZED_DOUBLES, _SIZED_DIGITS = _of_sizes(DOUBLES), _of_sizes(MANY_DIGITS)


@dataclass(frozen=True)
class _Table:
    """Values of the graph and their derivatives by all directions.

    Attributes
    ----------
    values
        The values.
    tangents
        The derivatives of each value that are not identically zero.
    """

    values: list[ScaledNode]
    tangents: list[Tangent]


class RestFunctions:
    """Forces, constraints, masses and outputs at rest, with their derivatives.

    With n coordinates, m closures and i inputs, directions of derivatives are numbered: n
    positions, n velocities, m multipliers, i inputs.

    Parameters
    ----------
    equations
        The equations of motion.
    known
        Values of parameters and inputs.
    """

    def __init__(self, equations: Equations, known: Mapping[sp.Symbol, Mpf]) -> None:
        self._known = known
        self._exact = {p.symbol: p.exact for p in equations.system.parameters}
        closures, n = equations.system.closures, len(equations.system.coordinates)
        moving = [
            *(c.q for c in equations.system.coordinates),
            *(c.v for c in equations.system.coordinates),
            *(c.multiplier for c in closures),
            *(u.symbol for u in equations.system.inputs),
        ]
        self._fixed = [equations.system.t, *(p.symbol for p in equations.system.parameters)]
        self._unknown = [*moving[:n], *moving[2 * n : 2 * n + len(closures)]]
        symbols = [*moving, *self._fixed]
        self._names = {s: f"x{k}" for k, s in enumerate(symbols)}
        self._velocities = moving[n : 2 * n]
        self._inputs = moving[2 * n + len(closures) :]
        self._graph = ValueGraph([(s, name, 0) for s, name in self._names.items()])
        self._seeds: dict[int, Tangent] = {
            self._graph.convert(s)[1]: {k: UNIT} for k, s in enumerate(moving)
        }
        self.n, self.m, self.width = n, len(closures), len(moving)
        reactions = list(equations.system.forcing)
        for closure in closures:
            for j, entry in entries(closure.gradient).items():
                reactions[j] += closure.multiplier * entry
        self.positional = [c for c in closures if c.kind == "position"]
        self.differential = [c for c in closures if c.kind == "velocity"]
        self._forces = self._table(reactions)
        self._positions = self._table([c.expression for c in self.positional])
        self._rates = self._table([c.expression for c in self.differential])
        self._outputs = self._table([e for _, e in equations.system.outputs])
        self._masses = {
            (i, j): self._graph.convert(entry)
            for i, row in enumerate(equations.system.mass_matrix)
            for j, entry in entries(row).items()
        }
        self._evaluations: dict[tuple[ScaledNode, ...], Evaluation] = {}

    def _table(self, expressions: Sequence[sp.Expr]) -> _Table:
        values = [self._graph.convert(e) for e in expressions]
        return _Table(values, derivatives(self._graph, values, self._seeds))

    def with_values(self, known: Mapping[sp.Symbol, Mpf]) -> RestFunctions:
        """Return the same functions with other values of parameters and inputs."""
        functions = copy(self)
        functions._known = known
        return functions

    @property
    def operations(self) -> int:
        """Return the number of values of the graph: a measure of the work of one evaluation."""
        return len(self._graph.nodes)

    def _evaluation(self, wanted: Sequence[ScaledNode]) -> Evaluation:
        """Return the steps to values of the graph; a search wants the same ones at many points."""
        key = tuple(wanted)
        if key not in self._evaluations:
            self._evaluations[key] = Evaluation(self._graph, wanted)
        return self._evaluations[key]

    @property
    def levels(self) -> list[ScaledNode]:
        """Return forces, then closures between positions, then those between velocities."""
        tables = self._forces, self._positions, self._rates
        return [value for table in tables for value in table.values]

    def _slopes_at_rest(self) -> dict[tuple[int, int], ScaledNode]:
        """Return their derivatives by positions and multipliers, by row and column."""
        tables = self._forces, self._positions, self._rates
        return {
            (row, by if by < self.n else by - self.n): slope
            for row, tangent in enumerate(t for table in tables for t in table.tangents)
            for by, slope in tangent.items()
            if by < self.n or 2 * self.n <= by < 2 * self.n + self.m
        }

    # Many configurations in doubles.

    def residuals(self, unknown: Matrix) -> tuple[Matrix, Matrix]:
        """Evaluate forces and constraints at rest, with their derivatives.

        Parameters
        ----------
        unknown
            Positions and multipliers of many configurations, shape (n + m, points).

        Returns
        -------
        Values, shape (points, n + m), and derivatives, shape (points, n + m, n + m); not finite
        where there is none.
        """
        points = unknown.shape[1]
        inputs: dict[str, Any] = {self._names[s]: double(0) for s in self._velocities}
        fixed = self._fixed + self._inputs
        inputs |= {self._names[s]: double(self._known.get(s, 0)) for s in fixed}
        # Operations of a single double take a fraction of the time of those of an array.
        rows = unknown[:, 0] if points == 1 else unknown
        inputs |= {self._names[s]: rows[k] for k, s in enumerate(self._unknown)}
        values, slopes = self.levels, self._slopes_at_rest()
        with np.errstate(all="ignore"):
            wanted = [*values, *slopes.values()]
            numbers = self._evaluation(wanted).at(inputs, DOUBLES)
        size = len(self._unknown)
        jacobian = np.zeros((points, size, size))
        for (row, column), slope in zip(slopes, numbers[len(values) :], strict=True):
            jacobian[:, row, column] = slope
        levels = np.zeros((points, size))
        for row, value in enumerate(numbers[: len(values)]):
            levels[:, row] = value
        return levels, jacobian

    # One box of configurations.

    def enclosed_levels(self, unknown: Sequence[Interval]) -> list[Interval]:
        """Enclose forces and closures at rest, as :meth:`levels_at` orders them.

        ``unknown``: an interval for each position and multiplier.

        Raises
        ------
        ArithmeticError, ValueError
            They have no values somewhere, or jump.
        """
        return self._enclosed(self.levels, unknown, BY_ENDS_WITHOUT_JUMPS)

    def enclosed_slopes(self, unknown: Sequence[Interval]) -> dict[tuple[int, int], Interval]:
        """Enclose the derivatives of the same by positions and multipliers; raises as they do."""
        slopes = self._slopes_at_rest()
        return dict(zip(slopes, self._enclosed([*slopes.values()], unknown, BY_ENDS), strict=True))

    def enclosed_force_slopes(self, unknown: Sequence[Interval]) -> dict[tuple[int, int], Interval]:
        """Enclose the derivatives of forces by all directions; raises as :meth:`enclosed_levels`.

        They are numbered by row and direction.
        """
        tangents = self._forces.tangents
        slopes = {(row, by): x for row, tangent in enumerate(tangents) for by, x in tangent.items()}
        numbers = self._enclosed([*slopes.values()], unknown, BY_ENDS)
        return dict(zip(slopes, numbers, strict=True))

    def _enclosed(
        self,
        wanted: list[ScaledNode],
        unknown: Sequence[Interval],
        arithmetic: Arithmetic,
    ) -> list[Interval]:
        point = {self._names[s]: around(mpf(0), mpf(0)) for s in self._velocities}
        point |= {self._names[s]: self._enclosed_value(s) for s in self._fixed + self._inputs}
        point |= {self._names[s]: x for s, x in zip(self._unknown, unknown, strict=True)}
        return enclosed(self._evaluation(wanted), point, arithmetic)

    def _enclosed_value(self, symbol: sp.Symbol) -> Interval:
        return enclosed_value(self._known.get(symbol, mpf(0)), self._exact.get(symbol))

    # One configuration in many digits.

    def levels_at(self, position: Sequence[Mpf], multipliers: Sequence[Mpf]) -> list[Mpf]:
        """Evaluate forces, then closures between positions, then those between velocities."""
        return self._numbers(self.levels, position, multipliers)

    def forces_at(self, position: Sequence[Mpf], multipliers: Sequence[Mpf]) -> RestTable:
        """Evaluate f + Σ λ ∇φ."""
        return self._evaluate(self._forces, position, multipliers)

    def force_sizes_at(self, position: Sequence[Mpf], multipliers: Sequence[Mpf]) -> mpmath.matrix:
        """Return the sizes of the terms that derivatives of forces by positions are sums of."""
        tangents = self._forces.tangents
        places = [
            (row, by) for row, tangent in enumerate(tangents) for by in tangent if by < self.n
        ]
        slopes = [tangents[row][by] for row, by in places]
        point, evaluation = self._point(position, multipliers), self._evaluation(slopes)
        with np.errstate(all="ignore"):
            rounded = {name: _sized(double(x)) for name, x in point.items()}
            numbers = evaluation.at(rounded, _SIZED_DOUBLES)
        if not all(np.isfinite(x.size) for x in numbers):
            sized = {name: _sized(x) for name, x in point.items()}
            try:
                numbers = evaluation.at(sized, _SIZED_DIGITS)
            except (ZeroDivisionError, ValueError) as error:
                raise DomainError from error
        matrix = mpmath.zeros(self.n, self.n)
        for place, value in zip(places, numbers, strict=True):
            matrix[place] = mpf(value.size)
        return matrix

    def constraints_at(self, position: Sequence[Mpf]) -> RestTable:
        """Evaluate the closures between positions."""
        return self._evaluate(self._positions, position, [mpf(0)] * self.m)

    def rates_at(self, position: Sequence[Mpf]) -> RestTable:
        """Evaluate the closures between velocities."""
        return self._evaluate(self._rates, position, [mpf(0)] * self.m)

    def outputs_at(self, position: Sequence[Mpf], multipliers: Sequence[Mpf]) -> RestTable:
        """Evaluate the outputs of the scene."""
        return self._evaluate(self._outputs, position, multipliers)

    def masses_at(self, position: Sequence[Mpf]) -> mpmath.matrix:
        """Evaluate the mass matrix."""
        mass = mpmath.zeros(self.n, self.n)
        numbers = self._numbers(list(self._masses.values()), position, [mpf(0)] * self.m)
        for (i, j), value in zip(self._masses, numbers, strict=True):
            mass[i, j] = value
        return mass

    def _evaluate(
        self, table: _Table, position: Sequence[Mpf], multipliers: Sequence[Mpf]
    ) -> RestTable:
        places = [(row, by) for row, tangent in enumerate(table.tangents) for by in tangent]
        slopes = [table.tangents[row][by] for row, by in places]
        numbers = self._numbers([*table.values, *slopes], position, multipliers)
        matrix = mpmath.zeros(len(table.values), self.width) if table.values else mpmath.matrix(0)
        for place, value in zip(places, numbers[len(table.values) :], strict=True):
            matrix[place] = value
        return RestTable(numbers[: len(table.values)], matrix)

    def _point(self, position: Sequence[Mpf], multipliers: Sequence[Mpf]) -> dict[str, Mpf]:
        """Assign values to all inputs of the graph."""
        point = {self._names[s]: mpf(0) for s in self._velocities}
        point |= {self._names[s]: self._known.get(s, mpf(0)) for s in self._fixed + self._inputs}
        unknown = zip(self._unknown, [*position, *multipliers], strict=True)
        return point | {self._names[s]: x for s, x in unknown}

    def _numbers(
        self, wanted: list[ScaledNode], position: Sequence[Mpf], multipliers: Sequence[Mpf]
    ) -> list[Mpf]:
        point = self._point(position, multipliers)
        try:
            numbers = self._evaluation(wanted).at(point, MANY_DIGITS)
        except (ZeroDivisionError, ValueError) as error:
            raise DomainError from error
        if not all(isinstance(x, mpf) and mpmath.isfinite(x) for x in numbers):
            raise DomainError
        return numbers


@dataclass(frozen=True)
class RestTable:
    """Numbers at one configuration.

    Attributes
    ----------
    values
        The values.
    slopes
        Their derivatives, a row each, with a column for each direction.
    """

    values: list[Mpf]
    slopes: mpmath.matrix
