"""Linear symmetries of a Lagrangian, with their conserved quantities by Noether's theorem.

A displacement q → q + ε ξ(q, t) with ξ = A q + b + c t is a symmetry if it changes the Lagrangian
by a rate alone, with the work of the other forces:

    Σ ξ ∂L/∂q + ξ̇ ∂L/∂q̇ + ξ·Q = dF/dt,    ξ·∇φ = 0 of each constraint φ.

Then Σ ξ ∂L/∂q̇ − F is conserved (E. Noether, Invariante Variationsprobleme, Nachr. Ges. Wiss.
Göttingen 1918, 235). The conditions are linear in A, b, c and the coefficients of F. They are
solved at random states in doubles; each solution is then made exact, and is reported only if its
condition is proven to hold at all states.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
import sympy as sp

from lagrange_cli.analysis.sampled_values import Array, SampledValues
from lagrange_cli.analysis.symmetries.body_turns import spin_momentum, turn_rows
from lagrange_cli.analysis.symmetries.rigid_displacements import (
    Displacement,
    displacement,
    translations_among,
)
from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.energies import by_parameters
from lagrange_cli.mechanics.algebra.factor import grouped_sum
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.free_symbols import is_unknown
from lagrange_cli.mechanics.proofs.continuity import is_continuous
from lagrange_cli.mechanics.proofs.zero_test import vanish
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.phrases import Phrase

_ZERO = sp.Integer(0)

#: Coordinates up to which the matrix A is arbitrary: its n² entries are unknowns.
MOST_COORDINATES = 24

#: Coordinates up to which F may hold products of two of them.
_MOST_QUADRATIC = 12

#: States beyond the number of unknowns.
_SPARE = 30

#: Singular values below this part of the largest one are zero, and numbers below it.
_NOTHING, _SMALL = 1e-11, 1e-7

#: Largest denominator of an exact entry.
_DENOMINATOR = 12

#: Terms that the condition of a symmetry is multiplied out to.
_TERM_BUDGET = 2000


@dataclass(frozen=True)
class Symmetry:
    """A symmetry and its conserved quantity.

    Attributes
    ----------
    name
        ``P_x``: momentum; ``L_z``, ``L_3_top``: angular momentum; ``boost_x``; else ``J_1``, ….
    displacement
        The rigid displacement of all particles; None if it moves them otherwise.
    field
        ξ, one entry a coordinate, over q and t.
    gauge
        F.
    expression
        Σ ξ ∂L/∂q̇ − F over q, v and t.
    """

    name: str
    displacement: Displacement | None
    field: tuple[sp.Expr, ...]
    gauge: sp.Expr
    expression: sp.Expr

    def described(self, coordinates: Sequence[str]) -> Phrase:
        """Say how the particles move, or else which of the coordinates of these names do."""
        if self.displacement is not None:
            return self.displacement.described
        moved = tuple(n for n, x in zip(coordinates, self.field, strict=True) if x != 0)
        return Phrase("displacement of {names}", names=moved)


@dataclass(frozen=True)
class Symmetries:
    """Symmetries other than those of cyclic coordinates.

    Attributes
    ----------
    proven
        The symmetries; together with momenta of cyclic coordinates they span all that were sought.
    complete
        True if A was arbitrary in the search, False if it was 0.
    unproven
        Number of solutions at random states that could not be made exact or proven.
    """

    proven: tuple[Symmetry, ...]
    complete: bool
    unproven: int


def linear_symmetries(equations: Equations) -> Symmetries:
    """Find linear symmetries other than those of cyclic coordinates.

    A symmetry whose quantity is a function of earlier ones is left out, and so is one that depends
    on t and is not rigid: every coordinate under a constant force has such a quantity.
    """
    search = _Search(equations)
    rows = search.solutions()
    turns = turn_rows(equations, [(c.number, c.factor) for c in search.columns], rows)
    rows = np.concatenate([search.rigid_translations(rows), turns, rows])
    fields = [search.exact(row) for row in rows]
    moved = [None if field is None else displacement(equations, field[0]) for field in fields]
    order = sorted(range(len(rows)), key=lambda k: (_rank(moved[k]), fields[k] is None, k))
    proven: list[Symmetry] = []
    slopes = search.cyclic_slopes()
    unproven = 0
    for k in order:
        slope = search.slope(rows[k])
        known, slopes = slopes, np.concatenate([slopes, slope[None]])
        field, rigid = fields[k], moved[k]
        if rigid is None and _dimension(slopes) == _dimension(known):
            slopes = known  # a function of those before
        elif field is None:
            unproven += 1
        elif rigid is not None or not search.holds_time(field):
            proven.append(search.symmetry(field, rigid, proven))
    moving = {equations.system.t, *(s for c in equations.system.coordinates for s in (c.q, c.v))}
    steady = tuple(s for s in proven if is_continuous(s.expression, moving))
    return Symmetries(steady, search.with_matrices, unproven)


def _rank(rigid: Displacement | None) -> tuple[int, int, int]:
    return (1, 0, 0) if rigid is None else (0, *rigid.rank)


@dataclass(frozen=True)
class _Column:
    """One unknown: ξ with a one in it, or a term of F.

    Attributes
    ----------
    number
        The coordinate along which ξ points; -1 for a term of F.
    factor
        The entry of ξ there, or the term of F.
    rate
        Its rate along a motion.
    """

    number: int
    factor: sp.Expr
    rate: sp.Expr


class _Search:
    """The conditions of a symmetry at random states, and their solutions made exact."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.coordinates = equations.system.coordinates
        self.n = len(self.coordinates)
        self.with_matrices = self.n <= MOST_COORDINATES
        lagrangian, drag = equations.system.lagrangian, equations.system.dissipation
        q, v = [c.q for c in self.coordinates], [c.v for c in self.coordinates]
        self.momenta = [derivative(lagrangian, s) for s in v]
        self._terms = expand_terms(lagrangian, _TERM_BUDGET) or [lagrangian]
        self._forces = [
            sp.Add(*(f.generalized[j] for f in equations.system.forces), -derivative(drag, s))
            for j, s in enumerate(v)
        ]
        self.pushes = [derivative(lagrangian, s) + f for s, f in zip(q, self._forces, strict=True)]
        self.gradients = [entries(closure.gradient) for closure in equations.system.pushing]
        cyclic = {c.coordinate for c in equations.derivation.conserved if c.coordinate is not None}
        self.free = [c.name not in cyclic for c in self.coordinates]
        self.columns = list(self._columns())
        self._samples = SampledValues(equations, len(self.columns) + _SPARE)
        self._slopes = np.zeros((len(self.columns), 2 * self.n))

    def _columns(self) -> Iterator[_Column]:
        """Yield entries of A, first the off-diagonal ones; c; b; then terms of F."""
        t, one = self.equations.system.t, sp.Integer(1)
        if self.with_matrices:
            for off_diagonal in (True, False):
                for j in range(self.n):
                    for c in self.coordinates:
                        if (c is not self.coordinates[j]) == off_diagonal:
                            yield _Column(j, c.q, c.v)
        yield from (_Column(j, t, one) for j in range(self.n))
        yield from (_Column(j, one, _ZERO) for j in range(self.n) if self.free[j])
        yield from (_Column(-1, c.q, c.v) for c in self.coordinates)
        yield from (_Column(-1, t**k, k * t ** (k - 1)) for k in (1, 2))
        if self.n <= _MOST_QUADRATIC:
            for j, a in enumerate(self.coordinates):
                for b in self.coordinates[j:]:
                    yield _Column(-1, a.q * b.q, a.v * b.q + a.q * b.v)

    @cached_property
    def _directions(self) -> int:
        """Number of unknowns of ξ."""
        return sum(column.number >= 0 for column in self.columns)

    @np.errstate(over="ignore", invalid="ignore")
    def solutions(self) -> Array:
        """Return null vectors of the conditions at random states, in reduced echelon form."""
        samples = self._samples
        functions = [*self.momenta, *self.pushes]
        functions += [g for row in self.gradients for g in row.values()]
        factors = list(dict.fromkeys(e for c in self.columns for e in (c.factor, c.rate)))
        values = samples.values_at_states([*functions, *factors])
        if values.shape[1] < len(self.columns):
            return np.zeros((0, len(self.columns)))
        state = {symbol: float(x[0]) for symbol, x in samples.states.items()}
        self._slopes = self._slopes_at(state, values[: self.n, 0])
        number = {e: len(functions) + k for k, e in enumerate(factors)}
        momenta, pushes = values[: self.n], values[self.n : 2 * self.n]
        changes = (self._change(c, values, number, momenta, pushes) for c in self.columns)
        blocks = [np.array(list(changes))]
        first = 2 * self.n
        for row in self.gradients:
            slopes = dict(zip(row, values[first : first + len(row)], strict=True))
            first += len(row)
            along = (slopes.get(c.number, 0.0) * values[number[c.factor]] for c in self.columns)
            blocks.append(np.array(list(along)))
        return _null_space(np.concatenate(blocks, axis=1).T, self._directions)

    def rigid_translations(self, rows: Array) -> Array:
        """Return combinations of null vectors that translate all particles, as no single one does.

        Two bodies with a dashpot between keep m ẋ + c (x − X) each, and so their momentum.
        """
        is_constant = np.array([c.number >= 0 and c.factor == 1 for c in self.columns])
        is_moving = np.array([c.number >= 0 for c in self.columns])
        steady = rows[(np.abs(rows[:, is_moving & ~is_constant]) <= _SMALL).all(axis=1)]
        fields = np.zeros((len(steady), self.n))
        for place in np.flatnonzero(is_constant):
            fields[:, self.columns[place].number] = steady[:, place]
        return np.asarray(translations_among(self.equations, fields) @ steady)

    @staticmethod
    def _change(
        column: _Column, values: Array, number: dict[sp.Expr, int], momenta: Array, pushes: Array
    ) -> Array:
        """Return the column's contribution to Σ ξ (∂L/∂q + Q) + ξ̇ ∂L/∂q̇ − dF/dt."""
        rate: Array = values[number[column.rate]]
        if column.number < 0:
            return -rate
        factor: Array = values[number[column.factor]]
        change: Array = factor * pushes[column.number] + rate * momenta[column.number]
        return change

    def cyclic_slopes(self) -> Array:
        """Return the derivatives of the momenta of cyclic coordinates, as :meth:`slope`."""
        cyclic = [j for j in range(self.n) if not self.free[j]]
        return np.eye(2 * self.n)[cyclic]

    def slope(self, row: Array) -> Array:
        """Return the derivatives of ξ·p − F by p and q at one state, for a null vector."""
        slope = row @ self._slopes
        return np.asarray(slope / np.hypot.reduce(slope))

    def _slopes_at(self, state: dict[sp.Symbol, float], momenta: Array) -> Array:
        """Return the derivatives of ξ·p − F for each unknown by itself, shape (unknowns, 2n)."""
        number = {c.q: k for k, c in enumerate(self.coordinates)}
        slopes = np.zeros((len(self.columns), 2 * self.n))
        for place, column in enumerate(self.columns):
            weight = -1.0
            if column.number >= 0:
                slopes[place, column.number] = float(column.factor.xreplace(state))
                weight = momenta[column.number]
            for symbol in column.factor.free_symbols & number.keys():
                by = float(derivative(column.factor, symbol).xreplace(state))
                slopes[place, self.n + number[symbol]] += weight * by
        return slopes

    def exact(self, row: Array) -> tuple[tuple[sp.Expr, ...], sp.Expr] | None:
        """Return ξ and F of a null vector with exact entries; None unless proven a symmetry."""
        parts: list[list[sp.Expr]] = [[] for _ in range(self.n)]
        for column, entry in zip(self.columns[: self._directions], row, strict=False):
            if abs(entry) > _SMALL:
                number = self._recognized(float(entry))
                if number is None:
                    return None
                parts[column.number].append(number * column.factor)
        field = tuple(sp.Add(*terms) for terms in parts)
        works = (sp.Add(*(field[j] * x for j, x in row.items())) for row in self.gradients)
        if not vanish(*works):
            return None
        changes = [change for change in self._changes(field) if not vanish(change)]
        gauge = self._gauge(row, sp.Add(*changes))
        if gauge is None or not vanish(sp.Add(*changes, -self._rate(gauge))):
            return None
        return field, gauge

    @cached_property
    def _ratios(self) -> list[tuple[float, sp.Expr]]:
        """Numbers that entries may be multiples of: 1, values of parameters, and quotients."""
        numbers = self._samples.parameters
        gradients = (g for row in self.gradients for g in row.values())
        sources = [self.equations.system.lagrangian, *gradients]
        functions = {f for e in sources for f in e.atoms(sp.Function)}
        known = sorted((f for f in functions if f.free_symbols <= numbers.keys()), key=str)
        values = {f: float(f.xreplace(numbers)) for f in known if not is_unknown(f)}
        sizes = numbers | {f: x for f, x in values.items() if 0 < abs(x) < np.inf}  # exp(-1e18) = 0
        ratios = [(1.0, sp.Integer(1))]
        for a, x in sizes.items():
            ratios += [(x, a), (1 / x, 1 / a)]
            ratios += [(x / y, a / b) for b, y in sizes.items() if a is not b]
        return ratios

    def _recognized(self, entry: float) -> sp.Expr | None:
        for size, ratio in self._ratios:
            number = Fraction(entry / size).limit_denominator(_DENOMINATOR)
            if number and abs(entry / size - number) < _SMALL * abs(number):
                return sp.Rational(number.numerator, number.denominator) * ratio
        return None

    def _changes(self, field: Sequence[sp.Expr]) -> Iterator[sp.Expr]:
        """Yield Σ ξ ∂/∂q + ξ̇ ∂/∂q̇ of each term of L, then ξ·Q: many vanish by themselves."""
        pairs = [
            (symbol, by)
            for c, x in zip(self.coordinates, field, strict=True)
            for symbol, by in ((c.q, x), (c.v, self._rate(x)))
            if by != 0
        ]
        for term in self._terms:
            symbols = term.free_symbols
            yield sp.Add(*(by * derivative(term, s) for s, by in pairs if s in symbols))
        yield sp.Add(*(x * f for x, f in zip(field, self._forces, strict=True)))

    def _rate(self, value: sp.Expr) -> sp.Expr:
        """Return the rate of a function of q and t along a motion."""
        rates = (c.v * derivative(value, c.q) for c in self.coordinates)
        return sp.Add(derivative(value, self.equations.system.t), *rates)

    def _gauge(self, row: Array, change: sp.Expr) -> sp.Expr | None:
        """Integrate a change to F, over the symbols that F has in the null vector."""
        terms = zip(self.columns[self._directions :], row[self._directions :], strict=True)
        present = {s for c, x in terms if abs(x) > _SMALL for s in c.factor.free_symbols}
        gauge = _ZERO
        for c in self.coordinates:
            if c.q in present:
                slope = sp.expand(derivative(change, c.v)) - derivative(gauge, c.q)
                gauge += _integral(slope, c.q)
        t = self.equations.system.t
        if t in present:
            moving = {s for c in self.coordinates for s in (c.q, c.v)}
            parts = sp.Add.make_args(sp.expand(change))
            gauge += _integral(sp.Add(*(e for e in parts if e.free_symbols.isdisjoint(moving))), t)
        return gauge

    def holds_time(self, exact: tuple[tuple[sp.Expr, ...], sp.Expr]) -> bool:
        """Tell whether ξ or F depends on t: of such symmetries only rigid ones are reported."""
        field, gauge = exact
        return any(self.equations.system.t in x.free_symbols for x in (*field, gauge))

    def symmetry(
        self,
        exact: tuple[tuple[sp.Expr, ...], sp.Expr],
        rigid: Displacement | None,
        before: Sequence[Symmetry],
    ) -> Symmetry:
        """Name a symmetry, and write its conserved quantity."""
        field, gauge = exact
        # A boost is turned round, so that its quantity begins with the centre of mass.
        if rigid is not None and (rigid.sense < 0) != (rigid.kind == "boost"):
            field, gauge = tuple(-x for x in field), -gauge
        if rigid is not None and rigid.size != 1:
            field, gauge = tuple(x / rigid.size for x in field), gauge / rigid.size
        unnamed = sum(s.displacement is None for s in before)
        name = f"J_{unnamed + 1}" if rigid is None else rigid.name
        quantity = self._quantity(field, gauge)
        if rigid is not None and rigid.kind == "spin":
            quantity = spin_momentum(self.equations, rigid.body, rigid.axis, quantity)
        return Symmetry(name, rigid, field, gauge, quantity)

    def _quantity(self, field: Sequence[sp.Expr], gauge: sp.Expr) -> sp.Expr:
        """Return Σ ξ ∂L/∂q̇ − F, collected by velocities."""
        moments = (x * p for x, p in zip(field, self.momenta, strict=True))
        whole = sp.Add(*moments, -gauge)
        terms = expand_terms(whole, _TERM_BUDGET)
        if terms is None:
            return whole
        constants = frozenset(p.symbol for p in self.equations.system.parameters)
        by_velocities = grouped_sum(collected_terms(terms), [c.v for c in self.coordinates])
        gathered = by_parameters(collected_terms(terms), constants, ())
        return min(by_velocities, gathered, key=printed_length)


def _dimension(rows: Array) -> int:
    return int(np.linalg.matrix_rank(rows, tol=_SMALL)) if len(rows) else 0


def _integral(slope: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Integrate terms that are powers of a symbol; others are left out."""
    parts = []
    for term in sp.Add.make_args(sp.expand(slope)):
        others, power = term.as_independent(symbol)
        exponent = sp.Integer(0) if power == 1 else power.as_base_exp()[1]
        if power in (1, symbol**exponent) and exponent.is_Integer and exponent >= 0:
            parts.append(others * symbol ** (exponent + 1) / (exponent + 1))
    return sp.Add(*parts)


def _null_space(conditions: Array, directions: int) -> Array:
    """Return null vectors in reduced echelon form over the first ``directions`` unknowns.

    ``conditions``: one row a condition, one column an unknown; none hold where numbers overflow.
    """
    if not np.isfinite(conditions).all():
        return np.zeros((0, conditions.shape[1]))
    sizes = np.abs(conditions).max(axis=1, keepdims=True)
    rows = conditions / np.where(sizes > 0, sizes, 1.0)
    lengths = np.linalg.norm(rows, axis=0)
    weights = np.where(lengths > 0, lengths, 1.0)
    _, singular, vectors = np.linalg.svd(rows / weights, full_matrices=True)
    rank = int((singular > _NOTHING * singular.max(initial=0.0) * len(singular)).sum())
    return _echelon(vectors[rank:] / weights, directions)


def _echelon(basis: Array, directions: int) -> Array:
    """Reduce rows to echelon form; those without entries in the first columns are left out."""
    basis = basis.copy()
    done = 0
    for column in range(directions):
        if done == len(basis):
            break
        pivot = done + int(np.abs(basis[done:, column]).argmax())
        if abs(basis[pivot, column]) < _SMALL * np.abs(basis[pivot]).max():
            continue
        basis[[done, pivot]] = basis[[pivot, done]]
        basis[done] /= basis[done, column]
        others = np.arange(len(basis)) != done
        basis[others] -= np.outer(basis[others, column], basis[done])
        done += 1
    return basis[:done]
