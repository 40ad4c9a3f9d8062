"""Redundancy of velocity constraints beside the rates of position constraints.

Over the names of the scene and their rates every constraint is a row A v + b = 0: constraints on
velocities as they stand, constraints on positions by their total derivatives. Rows that depend on
each other at random feasible configurations are redundant, or contradict each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, InputError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.diagnosis.errors import remaining_coordinates
from lagrange_cli.mechanics.diagnosis.inconsistency import proven_inconsistency
from lagrange_cli.mechanics.elimination.eliminate import Elimination, StatedEquation, substitute
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import (
    RANK_TOLERANCE,
    SymbolValues,
    column_factors,
    dependent_rows,
    normalized_row,
    scale_columns,
)
from lagrange_cli.mechanics.numerics.sampling import SamplePoint
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import contradict, leave_out, quoted, written
from lagrange_cli.scene.language.expression import Equation, names_in

#: Terms that a slope may be multiplied out to.
_TERM_BUDGET = 200

#: Most rows of which a combination is computed in closed form: minors of more rows are too long for
#: a message.
_ROWS = 4
#: Most operations of such a combination.
_OPERATIONS = 120

_ZERO = sp.Integer(0)


@dataclass(frozen=True)
class RedundantRate:
    """A constraint on velocities that others imply.

    Attributes
    ----------
    constraint
        Its name.
    equation
        Its equation as written.
    implied_by
        Names of the constraints that imply it.
    by_definitions
        True if definitions imply it with no other constraint.
    """

    constraint: str
    equation: Equation
    implied_by: tuple[str, ...]
    by_definitions: bool = False


@dataclass(frozen=True)
class _Row:
    """A v + b = 0: a constraint on velocities, or the rate of one on positions.

    Attributes
    ----------
    constraint
        Name of the constraint.
    equation
        Its equation as written.
    slopes
        Velocity → its factor, A.
    drift
        b.
    position
        The equation between positions; None for a constraint on velocities.
    """

    constraint: str
    equation: Equation
    slopes: Mapping[sp.Symbol, sp.Expr]
    drift: sp.Expr
    position: StatedEquation | None = None


class _Rates:
    """Moving names, each with a rate of its own, after substitution of definitions."""

    def __init__(self, names: Names) -> None:
        self.names = names
        declared = names.coordinates.values()
        unknowns = [s for s in names.cartesian.values() if s not in names.given]
        free = [s for s in unknowns if s not in {*declared}]
        settled = frozenset(names.parameters.values())
        self._given = dict(substitute([], names.given, free, settled).solved)
        self.moving = list(dict.fromkeys([*unknowns, *declared]))
        self.rates = {s: sp.Symbol(f"dot({s.name})", real=True) for s in self.moving}

    def holds_definitions(self, equation: Equation) -> bool:
        """Tell whether a name stands in the equation that definitions give."""
        defined = {s.name for s in self.names.given}
        sides = (equation.left.node, equation.right.node)
        return any(n.name in defined for side in sides for n in names_in(side))

    def put_in(self, expr: sp.Expr) -> sp.Expr:
        return expr.xreplace({s: self._given[s] for s in expr.free_symbols if s in self._given})

    def rate(self, expr: sp.Expr) -> sp.Expr:
        return total_derivative(self.put_in(expr), self.names.t, self.rates.items())

    def row(
        self,
        constraint: str,
        equation: Equation,
        psi: sp.Expr,
        position: StatedEquation | None = None,
    ) -> _Row | None:
        """ψ as a row; None if it is not linear in rates."""
        present = psi.free_symbols
        slopes = {s: derivative(psi, v) for s, v in self.rates.items() if v in present}
        slopes = {s: _expanded(a) for s, a in slopes.items()}
        if any(a.free_symbols & {*self.rates.values()} for a in slopes.values()):
            return None
        drift = psi.xreplace({v: _ZERO for v in self.rates.values() if v in present})
        return _Row(constraint, equation, slopes, drift, position)

    def of_position(self, stated: StatedEquation) -> _Row | None:
        return self.row(stated.constraint, stated.equation, self.rate(stated.phi), stated)

    def of_velocity(self, constraint: str, equation: Equation) -> _Row | None:
        left, right = (
            self.put_in(self.names.convert(side, self.rate))
            for side in (equation.left, equation.right)
        )
        return self.row(constraint, equation, left - right)


def _expanded(slope: sp.Expr) -> sp.Expr:
    """Multiply a slope out, so that rates in it may cancel; kept where it has too many terms."""
    terms = expand_terms(slope, _TERM_BUDGET)
    return slope if terms is None else sp.Add(*terms)


def redundant_rates(
    names: Names,
    elimination: Elimination,
    stated_rates: Sequence[tuple[str, Equation]],
    resolved: Mapping[sp.Symbol, sp.Expr],
    points: Sequence[SamplePoint],
    reference: Mapping[sp.Symbol, mpf],
) -> dict[int, RedundantRate]:
    """Constraints on velocities that those on positions, or earlier ones, imply; by number.

    Parameters
    ----------
    stated_rates
        Names and equations of the constraints on velocities.
    points
        Configurations that satisfy those on positions.

    Raises
    ------
    InputError
        Constraints that no velocities satisfy together.
    """
    rates = _Rates(names)
    levels = [rates.of_velocity(*one) for one in stated_rates]
    rows = [row for row in map(rates.of_position, elimination.stated) if row is not None]
    first = len(rows)
    numbers = [k for k, level in enumerate(levels) if level is not None]
    rows += [level for level in levels if level is not None]
    seen = [_Seen(rows, _everywhere(resolved, p)) for p in points]
    if not all(s.is_real for s in seen):
        return {}
    implied = {}
    for k in range(first, len(rows)):
        if not all(k in s.dependent for s in seen):
            continue
        circuit = [*seen[0].dependent[k], k]
        combination = _Combination(rates, elimination, [rows[j] for j in circuit])
        wrong = next((s for s in seen if s.contradicts(k)), None)
        if wrong is not None:
            mending = [j for j in circuit if not wrong.without(j).is_contradictory()]
            raise combination.refusal(reference, [rows[j].constraint for j in mending])
        by = tuple(dict.fromkeys([*(rows[j].constraint for j in circuit[:-1]), *combination.put]))
        constraint, equation = rows[k].constraint, rows[k].equation
        defined = not by and rates.holds_definitions(equation)
        implied[numbers[k - first]] = RedundantRate(constraint, equation, by, defined)
    return implied


def _everywhere(resolved: Mapping[sp.Symbol, sp.Expr], point: SymbolValues) -> dict[sp.Symbol, mpf]:
    """Values of all names at a configuration."""
    names = [s for s in resolved if s not in point]
    placed = evaluate([resolved[s] for s in names], point)
    return {**point, **dict(zip(names, placed, strict=True))}


class _Seen:
    """Rows at one configuration."""

    def __init__(self, rows: Sequence[_Row], point: SymbolValues) -> None:
        self.is_real = True
        place: dict[sp.Symbol, int] = {}
        for row in rows:
            for s in row.slopes:
                place.setdefault(s, len(place))
        everything = [e for row in rows for e in (*row.slopes.values(), row.drift)]
        try:
            pending = iter(evaluate(everything, _held(everything, point)))
        except (DomainError, KeyError):
            self.is_real = False
            return
        self._slopes: list[dict[int, mpf]] = []
        self._drifts: list[mpf] = []
        for row in rows:
            self._slopes.append({place[s]: next(pending) for s in row.slopes})
            self._drifts.append(next(pending))
        self._compare()

    def _compare(self) -> None:
        rows = [normalized_row(row) for row in self._slopes]
        width = 1 + max((j for row in rows for j in row), default=-1)
        self.dependent = dependent_rows(scale_columns(rows, column_factors(rows, width)))

    def without(self, number: int) -> _Seen:
        """All rows but one."""
        remaining = copy(self)
        remaining._slopes = [row for k, row in enumerate(self._slopes) if k != number]
        remaining._drifts = [x for k, x in enumerate(self._drifts) if k != number]
        remaining._compare()
        return remaining

    def is_contradictory(self) -> bool:
        return any(map(self.contradicts, self.dependent))

    def contradicts(self, number: int) -> bool:
        """Tell whether a dependent row contradicts the rows on which it depends."""
        circuit = self.dependent[number]
        columns = sorted({j for k in (*circuit, number) for j in self._slopes[k]})
        residual, parts = self._drifts[number], [self._drifts[number]]
        if circuit:
            matrix = mpmath.matrix(
                [[self._slopes[k].get(j, mpf(0)) for k in circuit] for j in columns]
            )
            target = mpmath.matrix([self._slopes[number].get(j, mpf(0)) for j in columns])
            shares = mpmath.lu_solve(matrix, target)
            parts += [x * self._drifts[k] for x, k in zip(shares, circuit, strict=True)]
            residual -= sum(parts[1:], mpf(0))
        return bool(abs(residual) > RANK_TOLERANCE * sum(map(abs, parts), mpf(0)))


def _held(expressions: Sequence[sp.Expr], point: SymbolValues) -> dict[sp.Symbol, mpf]:
    symbols = set().union(*map(symbols_in, expressions))
    return {s: point[s] for s in sorted(symbols, key=str)}


class _Combination:
    """Dependent rows, the last a combination of those before it, in closed form."""

    def __init__(self, rates: _Rates, elimination: Elimination, rows: Sequence[_Row]) -> None:
        self._rates, self._elimination, self._rows = rates, elimination, rows

    @cached_property
    def remainder(self) -> sp.Expr | None:
        """Remainder of the combination of rows in which all rates cancel; None if it is long."""
        *basis, last = self._rows
        if len(basis) >= _ROWS:
            return None
        columns = list(dict.fromkeys(s for row in self._rows for s in row.slopes))
        matrix = sp.Matrix([[row.slopes.get(s, _ZERO) for s in columns] for row in basis])
        for chosen in _minors(matrix, len(basis)):
            square = matrix.extract(range(len(basis)), chosen).T
            target = sp.Matrix([last.slopes.get(columns[j], _ZERO) for j in chosen])
            shares = square.LUsolve(target) if basis else []
            parts = (x * row.drift for x, row in zip(shares, basis, strict=True))
            whole = sp.fraction(sp.together(last.drift - sp.Add(*parts)))[0]
            whole = sp.expand(whole)
            return whole if whole.count_ops() <= _OPERATIONS else None
        return None

    @property
    def put(self) -> list[str]:
        """Constraints on positions whose solutions were substituted."""
        if self.remainder is None or not self.remainder.free_symbols:
            return []
        return [
            self._elimination.stated[k].constraint
            for k in sorted(self._elimination.sources_of(self.remainder))
        ]

    def refusal(self, reference: Mapping[sp.Symbol, mpf], mending: Sequence[str]) -> InputError:
        """Build the error of rows that no rates satisfy; removal of ``mending`` resolves it."""
        names, last = self._rates.names, self._rows[-1]
        outcome = self.remainder
        settled = {names.t, *names.parameters.values()}
        if outcome is not None and not outcome.free_symbols <= settled:
            value = self._elimination.reduce(outcome)
            if value.free_symbols <= settled and value != 0:
                used = [
                    self._elimination.stated[k]
                    for k in sorted(self._elimination.sources_of(outcome))
                ]
                velocity_names = [s for s in used if s not in self._positions]
                return self._contradiction(value, velocity_names, mending)
            stated = [
                *self._elimination.stated,
                StatedEquation(last.constraint, last.equation, outcome, _ZERO),
            ]
            proven = proven_inconsistency(names, stated, range(len(stated)), reference)
            return proven or self._elsewhere(outcome)
        return self._contradiction(outcome, [], mending)

    @property
    def _positions(self) -> list[StatedEquation]:
        return [row.position for row in self._rows if row.position is not None]

    def _contradiction(
        self, outcome: sp.Expr | None, names: Sequence[StatedEquation], mending: Sequence[str]
    ) -> InputError:
        last = self._rows[-1]
        named = [*(row.constraint for row in self._rows), *(s.constraint for s in names)]
        rates = [
            f"the rate of {quoted([row.constraint])} is {self._rate(row.position)}"
            for row in self._rows
            if row.position is not None
        ]
        alone = len(dict.fromkeys(named)) == 1
        come = "no velocities satisfy them together"
        if outcome is not None:
            come = f"{'it gives' if alone else 'together they give'} {self._false(outcome)}"
        because = f"{' and '.join(rates)}, and " if rates else ""
        return InconsistentError(
            Problem(
                f"{contradict(named)}: {because}{come}",
                last.equation.mark(),
                hint=leave_out(mending or named),
                rule="inconsistent",
            )
        )

    def _rate(self, stated: StatedEquation) -> str:
        left, right = (self._rates.rate(side) for side in (stated.left, stated.right))
        return f"{written(left)} = {written(right)}"

    def _false(self, outcome: sp.Expr) -> str:
        if outcome.is_number:
            return f"0 = {written(abs(outcome))}"
        why = "the parameters do not satisfy"
        if self._rates.names.t in outcome.free_symbols:
            why = "does not hold all the time"
        return f"{written(outcome)} = 0, which {why}"

    def _elsewhere(self, outcome: sp.Expr) -> InputError:
        """Build the error of rows that hold together only if positions satisfy another equation."""
        names, last = self._rates.names, self._rows[-1]
        named = quoted([row.constraint for row in self._rows])
        equation = f"{written(outcome)} = 0"
        return InconsistentError(
            Problem(
                f"constraints {named} hold together only where {equation}:"
                f" a constraint on positions, to be stated in place of '{last.constraint}'",
                last.equation.mark(),
                hint="\n".join(
                    [f"{last.constraint}: {equation}", *remaining_coordinates(names.scene, outcome)]
                ),
                rule="inconsistent",
            )
        )


def _minors(matrix: sp.Matrix, size: int) -> list[list[int]]:
    """List one choice of columns in which the rows are independent, or none."""
    chosen: list[int] = []
    for j in range(matrix.cols):
        if len(chosen) == size:
            break
        trial = matrix.extract(range(size), [*chosen, j])
        if trial.rank(simplify=True) == len(chosen) + 1:
            chosen.append(j)
    return [chosen] if len(chosen) == size else []
