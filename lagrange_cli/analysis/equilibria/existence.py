"""Proof that there is an equilibrium where numbers balance.

A simple one is proven by Krawczyk's operator, over as many unknowns as there are independent
equations. Where derivatives are degenerate, numbers prove nothing: there exact values of the
coordinates are put into the equations, and symmetries of them are sought, along which equilibria
come in continua.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import islice, product
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import scipy.linalg
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_system import RestSystem
from lagrange_cli.analysis.interval_roots import IntervalSystem
from lagrange_cli.analysis.interval_values import BITS, Interval, around, holds_zero
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Matrix, Mpf
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.zero_test import vanish

if TYPE_CHECKING:
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetry

#: Singular values below this part of the largest one are taken for zero; what follows is proven.
_FLAT = 1e-9
#: Size of an unknown that may be zero.
_NOTHING = mpf(10) ** -30
#: Distance, relative to 1 and to a coordinate, of exact values from where Newton's method ends: at
#: multiple roots it ends early, and each value is proven.
_NEAR = mpf(10) ** -2
#: Largest denominators of exact values, and parts of a half turn.
_DENOMINATORS, _PARTS = (1, 12, 1000), 12
#: Combinations of exact values that are tried.
_MOST_COMBINATIONS = 8
#: Size of forces, relative to 1, above which exact values are none of an equilibrium.
_BALANCED = mpf(10) ** -30
#: Unknowns of systems in which all combinations are tried, of others the first; operations of a
#: force of these.
_COORDINATES, _OPERATIONS = 8, 400
#: Radius, relative to 1 and to the unknowns, of the box in which forces are seen not to balance.
_BESIDE = 1e-6


@dataclass(frozen=True)
class _Part:
    """Equations and unknowns, by number, in which a root is regular; others have their values.

    ``isolated``: False if the other positions may have neighbouring values, too.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    isolated: bool = True


class EquilibriumProver:
    """Proves equilibria of one system.

    Parameters
    ----------
    system
        The equations of equilibrium, with values of all parameters.

    Attributes
    ----------
    rows, columns
        Numbers of the equations that are not plainly 0 = 0, and of the unknowns.
    free
        Names of the coordinates that have any value at an equilibrium.
    """

    def __init__(self, system: RestSystem) -> None:
        self.system = system
        functions = system.functions
        closures = list(zip(system.equations.system.closures, system.constraints, strict=True))
        positional = [e for c, e in closures if c.kind == "position"]
        differential = [e for c, e in closures if c.kind == "velocity"]
        self._equations = [*system.forces, *positional, *differential]
        self.rows = [k for k, expression in enumerate(self._equations) if expression != 0]
        self.columns = [k for k in range(functions.n + functions.m) if k not in system.free]
        self.free = tuple(system.equations.system.coordinates[k].name for k in system.free)

    def established(self, unknown: Sequence[Mpf]) -> Equilibrium | None:
        """Return the equilibrium near a point, in positions and multipliers; None without proof."""
        with mpmath.workdps(DIGITS):
            for numbers, part in self._parts(list(unknown)):
                radii = self._radii(part, numbers)
                if radii is not None:
                    return self._in_continuum(self._numeric(numbers, part, radii))
            point = self._exact_near(unknown)
            return None if point is None else self._in_continuum(point)

    def _in_continuum(self, point: Equilibrium) -> Equilibrium:
        """Say of an equilibrium whether symmetries carry it on, whatever proved that it is one.

        The flow of a symmetry of potential forces and constraints takes equilibria to equilibria.
        """
        if not point.isolated or not is_of_potential(self.system):
            return point
        numbers = [*(point.position or ()), *(point.multipliers or ())]
        jacobian = self.system.functions.residuals(np.array([[float(x)] for x in numbers]))[1][0]
        if not np.isfinite(jacobian).all() or not self._is_degenerate(jacobian[self.rows]):
            return point
        fields = self._fields_at(numbers)
        moving = [k for k in self.columns if k < self.system.functions.n]
        return replace(point, isolated=not (np.abs(fields[:, moving]) > _FLAT).any())

    def is_excluded(self, unknown: Sequence[Mpf]) -> bool:
        """Say whether it is proven that there is no equilibrium near a point."""
        functions = self.system.functions
        with mpmath.workprec(BITS):
            box = [
                around(x, mpf(_BESIDE) * max(1, abs(x)) if k in self.columns else mpf(0))
                for k, x in enumerate(unknown)
            ]
            try:
                return not all(map(holds_zero, functions.enclosed_levels(box)))
            except (ArithmeticError, ValueError):
                return False

    # Simple equilibria.

    def _parts(self, unknown: list[Mpf]) -> Iterator[tuple[list[Mpf], _Part]]:
        """Yield points, and equations and unknowns in which a root near them is regular.

        All equations come first; then those that are left where small unknowns are zero; then
        those that a symmetry leaves independent.
        """
        point = np.array([[float(x)] for x in unknown])
        jacobian = self.system.functions.residuals(point)[1][0]
        if not np.isfinite(jacobian).all():
            return
        yield from self._chosen(jacobian, unknown, self.rows, self.columns)
        ways = [self._without_small(jacobian, unknown), self._by_symmetry(jacobian, unknown)]
        # A symmetry shows a continuum, but is sought for long beside closures.
        for way in ways if self.system.functions.m else ways[::-1]:
            yield from way

    def _without_small(
        self, jacobian: Matrix, unknown: list[Mpf]
    ) -> Iterator[tuple[list[Mpf], _Part]]:
        """Set small unknowns to zero, multipliers alone at first: fewer equations may be left.

        With no force of a constraint, all configurations that these allow may be equilibria.
        """
        small = [k for k in self.columns if abs(unknown[k]) < _NOTHING]
        multipliers = [k for k in small if k >= self.system.functions.n]
        for zeros in filter(None, (multipliers, small)):
            without = [mpf(0) if k in zeros else x for k, x in enumerate(unknown)]
            columns = [k for k in self.columns if k not in zeros]
            yield from self._chosen(jacobian, without, self._rows_without(zeros), columns)

    def _by_symmetry(
        self, jacobian: Matrix, unknown: list[Mpf]
    ) -> Iterator[tuple[list[Mpf], _Part]]:
        """Keep the coordinates that symmetries move, and leave out their equations."""
        missing = len(self.rows) - self._rank(jacobian, self.rows)
        fields = self._fields_at(unknown) if missing else np.zeros((0, 0))
        fields = fields[_independent(fields)]
        if missing and len(fields) == missing:
            fixed = _pivots(fields)
            rows = [row for row in self.rows if row not in fixed]
            columns = [k for k in self.columns if k not in fixed]
            for numbers, part in self._chosen(jacobian, unknown, rows, columns):
                yield numbers, replace(part, isolated=False)

    def _chosen(
        self, jacobian: Matrix, unknown: list[Mpf], rows: Sequence[int], columns: Sequence[int]
    ) -> Iterator[tuple[list[Mpf], _Part]]:
        """Yield as many of some unknowns as there are equations, if these are independent."""
        if self._rank(jacobian[:, columns], rows) < len(rows):
            return
        scaled = _row_scaled(jacobian[np.ix_(rows, columns)])
        chosen = sorted(columns[k] for k in _pivots(scaled)) if len(rows) else []
        others = {*columns} - {*chosen}
        isolated = not any(k < self.system.functions.n for k in others)
        yield unknown, _Part(tuple(rows), tuple(chosen), isolated)

    def _rows_without(self, zeros: Sequence[int]) -> list[int]:
        """Return the numbers of the equations that do not vanish where some unknowns are zero."""
        system = self.system
        coordinates = [c.q for c in system.equations.system.coordinates]
        symbols = [*coordinates, *(c.multiplier for c in system.equations.system.closures)]
        put = {symbols[k]: sp.S.Zero for k in zeros}
        left = {k: self._equations[k].xreplace(put) for k in self.rows}
        return [k for k, e in left.items() if e != 0 and not vanish(e)]

    def _rank(self, jacobian: Matrix, rows: Sequence[int]) -> int:
        scaled = _row_scaled(jacobian[list(rows)])
        return int(np.linalg.matrix_rank(scaled, tol=_FLAT)) if scaled.size else 0

    def _is_degenerate(self, rows: Matrix) -> bool:
        """Say whether equations may depend on each other: a small row may be rounding."""
        sizes = np.abs(rows).max(axis=1, initial=0.0)
        is_small = sizes <= _FLAT * sizes.max(initial=0.0)
        return bool(is_small.any()) or self._rank(rows, range(len(rows))) < len(rows)

    def _fields_at(self, unknown: Sequence[Mpf]) -> Matrix:
        """Return the directions at a point along which forces keep their balance, one a row."""
        coordinates = self.system.equations.system.coordinates
        place = {c.q: float(x) for c, x in zip(coordinates, unknown, strict=False)}
        place |= {s: float(x) for s, x in self.system.known.items()}
        rows = [[float(x.subs(place)) for x in field] for field in self._fields]
        return np.array(rows).reshape(len(rows), len(coordinates))

    @cached_property
    def _fields(self) -> list[tuple[sp.Expr, ...]]:
        """Displacements ξ of the coordinates with Σ ξ·force = 0 at all configurations."""
        system = self.system
        if system.free_to_give:
            return []
        symmetries: Sequence[Symmetry] = linear_symmetries(system.equations).proven
        at_rest = (
            [x.xreplace({system.equations.system.t: sp.S.Zero}) for x in s.field]
            for s in symmetries
        )
        return [
            tuple(field)
            for field in at_rest
            if vanish(sp.Add(*(x * f for x, f in zip(field, system.forces, strict=True))))
        ]

    def _radii(self, part: _Part, unknown: Sequence[Mpf]) -> Matrix | None:
        functions = self.system.functions
        row_of = {row: k for k, row in enumerate(part.rows)}
        column_of = {column: k for k, column in enumerate(part.columns)}
        fixed = [around(x, mpf(0)) for x in unknown]

        def whole(chosen: Sequence[Interval]) -> list[Interval]:
            everything = list(fixed)
            for k, x in zip(part.columns, chosen, strict=True):
                everything[k] = x
            return everything

        def levels(chosen: Sequence[Interval]) -> list[Interval]:
            values = functions.enclosed_levels(whole(chosen))
            return [values[row] for row in part.rows]

        def slopes(chosen: Sequence[Interval]) -> dict[tuple[int, int], Interval]:
            return {
                (row_of[row], column_of[column]): slope
                for (row, column), slope in functions.enclosed_slopes(whole(chosen)).items()
                if row in row_of and column in column_of
            }

        equations = IntervalSystem(levels, slopes, len(part.rows))
        return equations.root_radii([unknown[k] for k in part.columns])

    def _numeric(self, unknown: Sequence[Mpf], part: _Part, radii: Matrix) -> Equilibrium:
        numbers, n = list(unknown), self.system.functions.n
        uncertainty = mpf(10) ** -DIGITS
        for k, radius in zip(part.columns, map(mpf, radii.tolist()), strict=True):
            # Zero, where it is as good as the number that was found.
            numbers[k] = mpf(0) if abs(numbers[k]) <= radius else numbers[k]
            uncertainty = max(uncertainty, 2 * radius / max(1, abs(numbers[k])))
        return Equilibrium(
            tuple(numbers[:n]),
            tuple(numbers[n:]),
            free=self.free,
            uncertainty=float(uncertainty),
            isolated=part.isolated,
        )

    # Exact values.

    def _exact_near(self, unknown: Sequence[Mpf]) -> Equilibrium | None:
        """Find exact values of the coordinates near a point that satisfy all equations."""
        system = self.system
        if self._is_long:
            return None
        known = system.exact_known
        symbols = set().union(*(e.free_symbols for e in (*system.forces, *system.constraints)))
        if not (symbols & system.known.keys()) <= known.keys():
            return None
        most = _MOST_COMBINATIONS if len(system.unknowns) <= _COORDINATES else 1
        for values in islice(self._exact_positions(unknown), most):
            point = self._exact_at(values, known)
            if point is not None:
                return point
        return None

    @cached_property
    def _is_long(self) -> bool:
        equations = (*self.system.forces, *self.system.constraints)
        return any(sp.count_ops(e) > _OPERATIONS for e in equations)

    def _exact_positions(self, unknown: Sequence[Mpf]) -> Iterator[dict[sp.Symbol, sp.Expr]]:
        """Yield exact values of the coordinates that are sought, the shortest ones first."""
        coordinates = self.system.equations.system.coordinates
        moving = [k for k in range(len(coordinates)) if k not in self.system.free]
        choices = [list(self._exact_numbers(unknown[k])) for k in moving]
        for values in product(*choices):
            yield {coordinates[k].q: x for k, x in zip(moving, values, strict=True)}

    def _exact_numbers(self, x: Mpf) -> Iterator[sp.Expr]:
        """Yield exact numbers near one: fractions, parts of a turn, parameters."""
        room = _NEAR * max(1, abs(x))
        ratio = Fraction(*mpmath.libmp.to_rational(x._mpf_))
        turns = Fraction(*mpmath.libmp.to_rational((_PARTS * x / mpmath.pi)._mpf_))
        fractions = [ratio.limit_denominator(most) for most in _DENOMINATORS]
        numbers: list[sp.Expr] = [sp.Rational(f.numerator, f.denominator) for f in fractions]
        numbers.insert(1, sp.Rational(round(turns), _PARTS) * sp.pi)
        numbers += [s * e for e in self.system.exact_known.values() for s in (1, -1)]
        tried: list[sp.Expr] = []
        for number in numbers:
            if number not in tried and abs(mpf(sp.N(number, DIGITS)) - x) < room:
                tried.append(number)
                yield number

    def _exact_at(
        self, values: Mapping[sp.Symbol, sp.Expr], known: Mapping[sp.Symbol, sp.Expr]
    ) -> Equilibrium | None:
        """Return the equilibrium at exact values; None if these are none of one."""
        system = self.system
        coordinates = system.equations.system.coordinates
        place = {**known, **values}
        multipliers = [c.multiplier for c in system.equations.system.closures]
        if not self._nearly_balance(system.constraints if multipliers else system.forces, place):
            return None
        equations = [e.xreplace(place) for e in (*system.forces, *system.constraints)]
        forces = _solved(equations, multipliers)
        if forces is None:
            return None
        exact = tuple(values.get(c.q, c.q) for c in coordinates)
        try:
            numbers, uncertainty = system.numbers([*exact, *forces])
        except DomainError:
            return None
        n = len(exact)
        return Equilibrium(
            tuple(numbers[:n]),
            tuple(numbers[n:]),
            exact,
            forces,
            self.free,
            uncertainty=uncertainty,
        )

    def _nearly_balance(self, sums: Sequence[sp.Expr], place: Mapping[sp.Symbol, sp.Expr]) -> bool:
        """Say whether numbers do not tell that sums differ from zero: that saves a proof."""
        try:
            numbers = {s: mpf(sp.N(x, DIGITS)) for s, x in place.items()}
            values = evaluate([*sums], numbers)
        except (DomainError, KeyError, TypeError):
            return True
        return all(abs(x) < _BALANCED for x in values)


def is_of_potential(system: RestSystem) -> bool:
    """Say whether a potential over coordinates and constraints between them alone balance."""
    mechanical = system.equations.system
    return not (
        mechanical.forces
        or system.states
        or system.free_to_give
        or any(c.kind == "velocity" for c in mechanical.closures)
        or not {c.v for c in mechanical.coordinates}.isdisjoint(symbols_in(mechanical.potential))
    )


def _row_scaled(matrix: Matrix) -> Matrix:
    sizes = np.abs(matrix).max(axis=1, initial=0.0)
    return np.asarray(matrix / np.where(sizes > 0, sizes, 1.0)[:, None])


def _pivots(rows: Matrix) -> list[int]:
    """Return the numbers of columns in which rows are independent, as many as there are rows."""
    return [int(k) for k in scipy.linalg.qr(rows, mode="r", pivoting=True)[1][: len(rows)]]


def _independent(rows: Matrix) -> list[int]:
    """Return the numbers of rows that are independent: turns may coincide at a configuration."""
    if not rows.any():
        return []
    rank = int(np.linalg.matrix_rank(_row_scaled(rows), tol=_FLAT))
    return sorted(int(k) for k in scipy.linalg.qr(rows.T, mode="r", pivoting=True)[1][:rank])


def _solved(
    equations: Sequence[sp.Expr], multipliers: Sequence[sp.Symbol]
) -> tuple[sp.Expr, ...] | None:
    """Solve exact equations, linear in multipliers, for these; None if they do not hold."""
    if not all(map(has_value, equations)):
        return None
    if not multipliers:
        return () if vanish(*equations) else None
    solutions = sp.linsolve([sp.expand(e) for e in equations], *multipliers)
    for solution in solutions:
        values = tuple(x.xreplace(dict.fromkeys(multipliers, sp.S.Zero)) for x in solution)
        put = dict(zip(multipliers, values, strict=True))
        return values if vanish(*(e.xreplace(put) for e in equations)) else None
    return None
