"""Equations of motion over independent velocities, without multipliers.

Constraints between velocities leave some velocities u independent: the others are A(q) u + b(q).
With the displacements that they allow, δq = Z δq_I, d'Alembert's principle Zᵀ (M q̈ − f) = 0 gives
as many equations as there are independent velocities (P. V. Voronets, 1901; J. I. Neimark and
N. A. Fufaev, Dynamics of Nonholonomic Systems, 1972, chapter 3; where the coordinates of the others
stand in none of them, these are S. A. Chaplygin's, 1897).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.forms.certificate import Evaluated, Pair, State, certify_form
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import cancelled
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.proofs.zero_test import does_not_depend
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.system import Coordinate

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Operations of M, f and the closures beyond which velocities are not eliminated: the rattleback
#: has 9,000 and takes 3 s; the bicycle of four bodies has 47,000, and Z alone 70,000.
_OPERATIONS = 12_000
#: Digits of numbers that are compared, and the part by which different ones differ.
_DIGITS, _DIFFERENT = 30, mpf(10) ** -12
#: Change of a coordinate by which it is seen whether accelerations depend on it.
_ASIDE = mpf("0.37")


@dataclass(frozen=True)
class VoronetsForm:
    """Equations of motion over independent velocities.

    Attributes
    ----------
    coordinates, dependent
        The coordinates whose velocities are independent, and the others.
    velocities
        The velocities of the others, over positions and the independent velocities.
    mass_matrix, forcing
        S and h of S u̇ = h.
    ignored
        The independent coordinates that stand in none of these; the dependent ones do not either.
    """

    coordinates: tuple[Coordinate, ...]
    dependent: tuple[Coordinate, ...]
    velocities: tuple[sp.Expr, ...]
    mass_matrix: tuple[tuple[sp.Expr, ...], ...]
    forcing: tuple[sp.Expr, ...]
    ignored: tuple[Coordinate, ...]


def voronets_form(equations: Equations) -> VoronetsForm:
    """Write equations of motion over independent velocities, certified by the given ones.

    Raises
    ------
    InputError
        There are constraints between positions, too; the expressions are long; or all choices of
        independent velocities leave equations that hold coordinates of the others, or t.
    InternalError
        The result disagrees with the certified equations.
    """
    system = equations.system
    if not system.closures or any(c.kind != "velocity" for c in system.closures):
        message = "velocities are eliminated where all constraints are between velocities"
        raise InputError(Problem(message, rule="no-velocities"))
    expressions = _expressions(equations)
    length = sum(int(sp.count_ops(e)) for e in expressions)
    if length > _OPERATIONS:
        size = f"{length:,} operations"
        message = f"the equations of motion, of {size}, are too long to eliminate velocities"
        raise InputError(Problem(message, rule="no-velocities"))
    accelerations = _Accelerations(equations)
    # Coordinates that stand nowhere come first: their places do not matter.
    seen = frozenset[sp.Symbol]().union(*(e.free_symbols for e in expressions))
    numbers = sorted(range(len(system.coordinates)), key=lambda j: system.coordinates[j].q in seen)
    for dependent in combinations(numbers, len(system.closures)):
        if accelerations.may_be_over(dependent):
            elimination = _Elimination(equations, dependent)
            form = elimination.form()
            if form is not None:
                certify_form(equations, "Voronets' form", _Comparison(accelerations, elimination))
                return form
    message = "other velocities than those of coordinates would have to be independent"
    raise InputError(Problem(message, system.closures[0].mark, rule="no-velocities"))


def _expressions(equations: Equations) -> list[sp.Expr]:
    """List M, f and the gradients of the closures."""
    system = equations.system
    rows = [*system.mass_matrix, *(c.gradient for c in system.closures)]
    return [*system.forcing, *(e for row in rows for e in entries(row).values())]


@dataclass(frozen=True)
class _Motion:
    """A state, its accelerations, and the size of the terms of the equations there."""

    state: State
    accelerations: list[mpf]
    size: mpf


class _Accelerations:
    """Numbers of the certified equations: dependent velocities, and all accelerations."""

    def __init__(self, equations: Equations) -> None:
        system = equations.system
        self.equations, self.coordinates = equations, system.coordinates
        self.n, self.m = len(system.coordinates), len(system.closures)
        gradients = [c.gradient[j] for c in system.closures for j in range(self.n)]
        self.gradients = Evaluated([*gradients, *(c.rate for c in system.closures)])
        masses = [row[j] for row in system.mass_matrix for j in range(self.n)]
        self.others = Evaluated([*masses, *system.forcing, *(c.bias for c in system.closures)])

    def at(self, state: State, dependent: Sequence[int]) -> _Motion:
        """Return a state whose dependent velocities satisfy the closures, and its accelerations.

        Raises
        ------
        ZeroDivisionError
            The others do not determine them there, or the equations no accelerations.
        """
        n, m = self.n, self.m
        numbers = self.gradients.at(state)
        table = [numbers[k * n : (k + 1) * n] for k in range(m)]
        others = [j for j in range(n) if j not in dependent]
        inner = mpmath.matrix([[row[j] for j in dependent] for row in table])
        pushes = [
            -sum((row[j] * state[self.coordinates[j].v] for j in others), constant)
            for row, constant in zip(table, numbers[m * n :], strict=True)
        ]
        velocities = _solved(inner, pushes)
        pairs = zip(dependent, velocities, strict=True)
        whole = {**state, **{self.coordinates[j].v: x for j, x in pairs}}
        values = self.others.at(whole)
        saddle = mpmath.zeros(n + m, n + m)
        for i in range(n):
            for j in range(n):
                saddle[i, j] = values[i * n + j]
            for k in range(m):
                saddle[i, n + k], saddle[n + k, i] = -table[k][i], table[k][i]
        right = [*values[n * n : n * n + n], *(-x for x in values[n * n + n :])]
        solution = _solved(saddle, right)
        terms = (abs(saddle[i, j] * solution[j]) for i in range(n) for j in range(n + m))
        return _Motion(whole, solution[:n], max((*terms, *map(abs, right))))

    def may_be_over(self, dependent: Sequence[int]) -> bool:
        """Tell whether numbers let the equations be without the places of dependent coordinates.

        One state is compared with others, at which a dependent coordinate has another value; and
        at the start, if there is one, the others are to be determined.
        """
        sources, system = self.equations.derivation.sources, self.equations.system
        if sources is None:
            return False
        others = [j for j in range(self.n) if j not in dependent]
        state = {s: mpf(x) for s, x in sources.state.items()}
        start = dict(state)
        if system.initial is not None:
            start |= {p.symbol: mpf(p.value) for p in system.parameters if p.value is not None}
            pairs = zip(system.coordinates, system.initial.positions, strict=True)
            start |= {c.q: mpf(x) for c, x in pairs}
        with mpmath.workdps(_DIGITS):
            try:
                self.at(start, dependent)
                here = self.at(state, dependent).accelerations
                for moved in (*(self.coordinates[j].q for j in dependent), system.t):
                    place = {**state, moved: state[moved] + _ASIDE}
                    there = self.at(place, dependent).accelerations
                    size = max(map(abs, (*here, *there)))
                    if any(abs(here[j] - there[j]) > _DIFFERENT * size for j in others):
                        return False
            except (DomainError, ZeroDivisionError, KeyError):
                return False
        return True


def _solved(matrix: mpmath.matrix, right: Sequence[mpf]) -> list[mpf]:
    """Solve a linear system.

    Raises
    ------
    ZeroDivisionError
        The matrix is singular; of a column of zeros mpmath has no pivot, and no error of its own.
    """
    try:
        return list(mpmath.lu_solve(matrix, mpmath.matrix(right)))
    except TypeError as error:
        raise ZeroDivisionError from error


class _Elimination:
    """The elimination of the velocities of some coordinates."""

    def __init__(self, equations: Equations, dependent: Sequence[int]) -> None:
        system = equations.system
        n = len(system.coordinates)
        self.equations, self.dependent = equations, list(dependent)
        self.independent = [j for j in range(n) if j not in self.dependent]
        rates = sp.Matrix([system.coordinates[j].v for j in self.independent])
        gradients = sp.Matrix([[c.gradient[j] for j in range(n)] for c in system.closures])
        rows = list(range(gradients.rows))
        inner = gradients.extract(rows, self.dependent)
        determinant = inner.det(method="berkowitz")
        constant = sp.Matrix([c.rate for c in system.closures])
        follow, shift = (
            (-inner.adjugate() * right).applyfunc(lambda e: cancelled(e / determinant))
            for right in (gradients.extract(rows, self.independent), constant)
        )
        self.allowed = sp.zeros(n, len(self.independent))
        for column, j in enumerate(self.independent):
            self.allowed[j, column] = sp.S.One
        for row, j in enumerate(self.dependent):
            self.allowed[j, :] = follow.row(row)
        self.velocities = list(follow * rates + shift)
        self.mass, self.forcing = self._equations()

    def _equations(self) -> tuple[sp.Matrix, sp.Matrix]:
        """Return S = Zᵀ M Z, and h = Zᵀ (f − M q̈) with the accelerations q̈ at constant u."""
        system, z = self.equations.system, self.allowed
        n = len(system.coordinates)
        mass = sp.Matrix(n, n, lambda i, j: system.mass_matrix[i][j])
        symbols = [system.coordinates[j].v for j in self.dependent]
        rates = dict(zip(symbols, self.velocities, strict=True))
        forces = sp.Matrix([f.xreplace(rates) for f in system.forcing])
        moved = [(c.q, rates.get(c.v, c.v)) for c in system.coordinates]
        turned = sp.zeros(n, 1)
        for j, velocity in zip(self.dependent, self.velocities, strict=True):
            slopes = ((derivative(velocity, s), v) for s, v in (*moved, (system.t, sp.S.One)))
            turned[j] = sp.Add(*(slope * v for slope, v in slopes))
        return z.T * mass * z, z.T * (forces - mass * turned)

    def form(self) -> VoronetsForm | None:
        """Return the equations; None if they hold coordinates of dependent velocities, or t."""
        coordinates, t = self.equations.system.coordinates, self.equations.system.t
        expressions = [*self.mass, *self.forcing]
        absent = {
            s
            for s in (*(c.q for c in coordinates), t)
            if all(does_not_depend(e, s) for e in expressions)
        }
        if not {t, *(coordinates[j].q for j in self.dependent)} <= absent:
            return None
        self.mass, self.forcing = (_without(m, absent) for m in (self.mass, self.forcing))
        independent = [coordinates[j] for j in self.independent]
        return VoronetsForm(
            tuple(independent),
            tuple(coordinates[j] for j in self.dependent),
            tuple(self.velocities),
            tuple(tuple(self.mass.row(k)) for k in range(self.mass.rows)),
            tuple(self.forcing),
            tuple(c for c in independent if c.q in absent),
        )


def _without(matrix: sp.Matrix, symbols: Collection[sp.Symbol]) -> sp.Matrix:
    """Write expressions without symbols that they are proven not to depend on."""
    for value in (sp.S.Zero, sp.S.One):
        place = dict.fromkeys(symbols, value)
        written = matrix.xreplace(place)
        if all(map(has_value, written)):
            return written
    return matrix


class _Comparison:
    """Comparison at a state of S u̇ with h, u̇ being those of the certified equations."""

    def __init__(self, accelerations: _Accelerations, elimination: _Elimination) -> None:
        self.accelerations, self.chosen = accelerations, elimination
        self.written = Evaluated([*elimination.mass, *elimination.forcing, *elimination.velocities])

    def __call__(self, state: State) -> Iterator[Pair]:
        independent = self.chosen.independent
        motion = self.accelerations.at(state, self.chosen.dependent)
        k, rates = len(independent), motion.accelerations
        values = self.written.at(motion.state)
        mass, forces, velocities = values[: k * k], values[k * k : k * k + k], values[k * k + k :]
        for row, force in enumerate(forces):
            terms = [mass[row * k + i] * rates[j] for i, j in enumerate(independent)]
            yield sum(terms, mpf(0)), force, sum(map(abs, terms), abs(force) + motion.size)
        for j, velocity in zip(self.chosen.dependent, velocities, strict=True):
            certified = motion.state[self.accelerations.coordinates[j].v]
            yield velocity, certified, abs(velocity) + abs(certified)
