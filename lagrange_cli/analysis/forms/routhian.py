"""Routh's reduction: cyclic coordinates ignored, their momenta constants of the motion.

With the momenta p of unforced cyclic coordinates c, R = L − Σ p q̇_c over the others is

    R = ½ q̇·S q̇ + b·q̇ − V_eff,    V_eff = V − T0 + ½ w·M_cc⁻¹ w,    w = p − b_c,

where S = M − M_rc M_cc⁻¹ M_cr; terms linear in q̇ are gyroscopic. Lagrange's equations of R are
those of the other coordinates, and q̇_c = M_cc⁻¹ (w − M_cr q̇) (L. A. Pars, A Treatise on
Analytical Dynamics, chapter 10; H. Goldstein, C. Poole and J. Safko, Classical Mechanics, 3rd ed.,
section 8.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.forms.certificate import (
    Evaluated,
    LagrangianSlopes,
    Pair,
    Residuals,
    State,
    certify_form,
    lagrangian_symbols,
)
from lagrange_cli.analysis.forms.legendre import (
    Momenta,
    at_rest,
    blocks_of,
    collected,
    compact,
    inverse_form,
    is_quadratic,
    momenta_of,
)
from lagrange_cli.analysis.forms.momenta import Momentum, momenta
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.energies import by_parameters
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.dynamics.textbook_form import RowSystem, shown_rows
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.findings import Certificate
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.system import Closure, Coordinate

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Terms that a part of the equations may be multiplied out to: longer sums print no shorter.
_TERM_BUDGET = 60

_ZERO = mpf(0)


@dataclass(frozen=True)
class Routhian:
    """R and the equations of the coordinates that are not ignored.

    Attributes
    ----------
    coordinates
        The remaining coordinates, in their order.
    momenta
        The momenta of the ignored coordinates.
    velocities
        q̇ of each ignored coordinate over (q, q̇, p, t) of the others.
    kinetic, gyroscopic
        The parts of R that are quadratic and linear in velocities.
    potential
        The terms of V_eff in the order of print.
    mass_matrix, forcing
        M a = f + Σ λ·gradient of the remaining coordinates, unscaled.
    closures
        Closures, then contacts, with gradients over these coordinates.
    shown
        Textbook form of their equations.
    start
        Momenta at the initial state, as doubles; empty if it is not known.
    certificate
        The comparison with L, M and f.
    """

    coordinates: tuple[Coordinate, ...]
    momenta: tuple[Momentum, ...]
    velocities: tuple[sp.Expr, ...]
    kinetic: sp.Expr
    gyroscopic: sp.Expr
    potential: tuple[sp.Expr, ...]
    mass_matrix: tuple[ExpressionRow, ...]
    forcing: tuple[sp.Expr, ...]
    closures: tuple[Closure, ...]
    shown: tuple[ShownEquation, ...]
    start: tuple[float, ...]
    certificate: Certificate

    @property
    def effective_potential(self) -> sp.Expr:
        """V_eff over (q, p, t)."""
        return sp.Add(*self.potential)

    @property
    def expression(self) -> sp.Expr:
        """R over (q, q̇, p, t)."""
        return self.kinetic + self.gyroscopic - self.effective_potential


def ignorable(equations: Equations) -> list[int]:
    """Return the numbers of the cyclic coordinates whose momenta are conserved."""
    conserved = {c.coordinate for c in equations.derivation.conserved if c.kind == "momentum"}
    return [j for j, c in enumerate(equations.system.coordinates) if c.name in conserved]


def routhian_form(equations: Equations, only: Sequence[int] | None = None) -> Routhian:
    """Ignore the cyclic coordinates whose momenta are conserved.

    Parameters
    ----------
    only
        Numbers of the coordinates to ignore; None for all of :func:`ignorable`.

    Raises
    ------
    InputError
        There are none, L is not quadratic in their velocities, or these have no short closed form.
    InternalError
        The result disagrees with the certified equations.
    """
    ignored = ignorable(equations) if only is None else list(only)
    left = [j for j in range(len(equations.system.coordinates)) if j not in ignored]
    _require_cyclic(equations, ignored)
    functions = momenta_of(equations)
    named = momenta(
        equations,
        [equations.system.coordinates[j] for j in ignored],
        [functions.expressions[j] for j in ignored],
    )
    reduction = _Reduction(equations, ignored, left, functions, named)
    result = reduction.result()
    certificate = certify_form(equations, "Routh's form", _Comparison(equations, result, ignored))
    return replace(result, certificate=certificate)


def _require_cyclic(equations: Equations, ignored: Sequence[int]) -> None:
    """Refuse scenes that have no coordinate to ignore, with the reason."""
    if ignored:
        if not is_quadratic(equations, range(len(equations.system.coordinates))):
            message = "there is no Routhian: the Lagrangian is not quadratic in the velocities"
            raise _refused(equations, message)
        return
    message = "there is no Routhian: no coordinate is cyclic"
    if equations.derivation.cyclic:
        listed = ", ".join(f"'{name}'" for name in equations.derivation.cyclic)
        is_one = len(equations.derivation.cyclic) == 1
        noun, verb = ("coordinate", "is") if is_one else ("coordinates", "are")
        momenta_of_these = "its momentum is" if is_one else "their momenta are"
        message = (
            f"there is no Routhian: the {noun} {listed} {verb} cyclic, but forces act on"
            f" {'it' if is_one else 'them'}, and {momenta_of_these} not conserved"
        )
    elif equations.derivation.open_questions:
        message = "there is no Routhian: no coordinate is found to be cyclic"
    raise _refused(equations, message)


def _refused(equations: Equations, message: str) -> InputError:
    hint = "coordinates that L does not depend on can be ignored, as the angle of a central motion"
    return InputError(
        Problem(message, Mark(equations.presentation.file, 1, 1), hint=hint, rule="no-routhian")
    )


class _Reduction:
    """The parts of R and the reduced equations."""

    def __init__(
        self,
        equations: Equations,
        ignored: Sequence[int],
        left: Sequence[int],
        functions: Momenta,
        named: tuple[Momentum, ...],
    ) -> None:
        self.equations, self.ignored, self.left = equations, ignored, left
        self.named = named
        self.coordinates = tuple(equations.system.coordinates[j] for j in left)
        self.rates = [c.v for c in self.coordinates]
        self.shifts = functions.shifts
        self.constants = frozenset(p.symbol for p in equations.system.parameters)
        self.mass = [entries(row) for row in equations.system.mass_matrix]
        number = {j: k for k, j in enumerate(ignored)}
        self.inner = [
            {number[i]: e for i, e in self.mass[j].items() if i in number} for j in ignored
        ]
        shifted = zip(named, ignored, strict=True)
        self.free = [m.symbol - self.shifts[j] for m, j in shifted]
        self.form, self.at_rest = self._solved(self.free)
        #: M_cc⁻¹ M_cr by number of the other coordinate.
        self.dragged = {
            j: self._solved(column)[1]
            for j in left
            if any(column := [self.mass[i].get(j, sp.S.Zero) for i in ignored])
        }

    def _solved(self, w: Sequence[sp.Expr]) -> tuple[list[sp.Expr], list[sp.Expr]]:
        """Return the terms of w·M_cc⁻¹ w, and M_cc⁻¹ w, block by block."""
        forms: list[sp.Expr] = []
        solution = [sp.S.Zero] * len(w)
        for block in blocks_of(self.inner):
            if not any(w[k] for k in block):
                continue
            number = {k: place for place, k in enumerate(block)}
            rows = [{number[i]: e for i, e in self.inner[k].items()} for k in block]
            solved = inverse_form(rows, [w[k] for k in block], self.constants)
            if solved is None:
                listed = ", ".join(f"'{self.named[k].coordinate.name}'" for k in block)
                message = f"no Routhian is found: the velocities of {listed} have no short form"
                raise _refused(self.equations, message)
            forms += sp.Add.make_args(solved[0])
            for k, value in zip(block, solved[1], strict=True):
                solution[k] = value
        return forms, solution

    def result(self) -> Routhian:
        """Assemble the Routhian, not yet certified."""
        inertia = [self._inertia(j) for j in self.left]
        linear = [self._linear(j) for j in self.left]
        potential = tuple(e for e in self._potential() if e != 0)
        velocities = tuple(self._velocities())
        forcing = [
            self._shortest(terms)
            for terms in self._forcing(inertia, linear, sp.Add(*potential), velocities)
        ]
        mass = tuple(ExpressionRow(len(self.left), row) for row in inertia)
        closures = tuple(self._closures())
        fixed = self.constants.union(m.symbol for m in self.named)
        system = RowSystem(
            self.coordinates,
            fixed,
            mass,
            forcing,
            closures,
            self.equations.presentation.sums,
            frozenset(m.symbol for m in self.named),
            [expression for _, expression in self.equations.presentation.abbreviations],
        )
        return Routhian(
            self.coordinates,
            self.named,
            velocities,
            self._kinetic(inertia),
            collected(
                sp.Add(*(b * v for b, v in zip(linear, self.rates, strict=True))), self.rates
            ),
            potential,
            mass,
            tuple(sp.Add(*terms) for terms in forcing),
            closures,
            shown_rows(system, [value for value, _ in self.equations.presentation.literals]),
            tuple(self._start()),
            self.equations.derivation.certificate,
        )

    def _inertia(self, j: int) -> dict[int, sp.Expr]:
        """Return a row of S = M_rr − M_rc M_cc⁻¹ M_cr, by place among the remaining coordinates."""
        row = {}
        for place, k in enumerate(self.left):
            entry = self.mass[j].get(k, sp.S.Zero)
            drag = self.dragged.get(k)
            if drag is not None and j in self.dragged:
                less = sp.Add(*(self._coupling(j, i) * x for i, x in enumerate(drag)))
                entry = compact(sp.expand_mul(entry - less), self.constants)
            row[place] = entry
        return row

    def _coupling(self, j: int, i: int) -> sp.Expr:
        """Return the entry of M between a remaining coordinate and the ignored one at place i."""
        return self.mass[j].get(self.ignored[i], sp.S.Zero)

    def _linear(self, j: int) -> sp.Expr:
        """Return the coefficient of q̇_j in the gyroscopic part."""
        moved = (self._coupling(j, i) * x for i, x in enumerate(self.at_rest))
        return sp.Add(self.shifts[j], *moved)

    def _kinetic(self, inertia: Sequence[Mapping[int, sp.Expr]]) -> sp.Expr:
        terms = [
            entry * self.rates[j] * self.rates[k] / 2
            for j, row in enumerate(inertia)
            for k, entry in row.items()
        ]
        whole = sp.Add(*terms)
        expanded = expand_terms(whole, _TERM_BUDGET)
        if expanded is None:
            return whole
        gathered = by_parameters(collected_terms(expanded), self.constants, self.rates)
        return min(whole, gathered, key=printed_length)

    def _potential(self) -> Iterator[sp.Expr]:
        """Yield the terms of V_eff: ½ w·M_cc⁻¹ w, −T0, V at rest."""
        every = [c.v for c in self.equations.system.coordinates]
        yield from (term / 2 for term in self.form)
        yield -at_rest(self.equations.system.kinetic, every)
        yield at_rest(self.equations.system.potential, every)

    def _velocities(self) -> list[sp.Expr]:
        """Return the ignored velocities M_cc⁻¹ (w − M_cr q̇)."""
        w = [
            free
            - sp.Add(
                *(self._coupling(j, i) * v for j, v in zip(self.left, self.rates, strict=True))
            )
            for i, free in enumerate(self.free)
        ]
        return self._solved(w)[1]

    def _forcing(
        self,
        inertia: Sequence[Mapping[int, sp.Expr]],
        linear: Sequence[sp.Expr],
        potential: sp.Expr,
        velocities: Sequence[sp.Expr],
    ) -> Iterator[list[sp.Expr]]:
        """Yield f of each remaining coordinate: Lagrange's equation of R without S a."""
        t, numbers = self.equations.system.t, range(len(self.left))
        ignored = [m.coordinate.v for m in self.named]
        solved = dict(zip(ignored, velocities, strict=True))
        for j in numbers:
            q = self.coordinates[j].q
            terms = [-derivative(potential, q), -derivative(linear[j], t)]
            for k in numbers:
                v, place = self.rates[k], self.coordinates[k].q
                slope = derivative(linear[k], q) - derivative(linear[j], place)
                terms.append(slope * v)
                entry = inertia[j].get(k, sp.S.Zero)
                terms.append(-derivative(entry, t) * v)
                for i in numbers:
                    u = self.rates[i]
                    change = derivative(inertia[k].get(i, sp.S.Zero), q) / 2
                    change -= derivative(entry, self.coordinates[i].q)
                    terms.append(change * u * v)
            yield [*terms, *(force.xreplace(solved) for force in self._forces(self.left[j]))]

    def _shortest(self, terms: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Multiply the terms out, those with momenta only if that is shorter."""
        symbols = {m.symbol for m in self.named}
        parts = [sp.factor_terms(e) for t in terms for e in sp.Add.make_args(t) if e != 0]
        with_momenta = [e for e in parts if not symbols_in(e).isdisjoint(symbols)]
        others = [e for e in parts if symbols_in(e).isdisjoint(symbols)]
        written = [
            _multiplied_out([*others, *with_momenta]),
            [*_multiplied_out(others), *with_momenta],
        ]
        return min(written, key=lambda way: sum(map(printed_length, way)))

    def _forces(self, j: int) -> Iterator[sp.Expr]:
        """Yield the generalized forces Q_j and friction."""
        yield from (force.generalized[j] for force in self.equations.system.forces)
        yield -derivative(self.equations.system.dissipation, self.equations.system.coordinates[j].v)

    def _closures(self) -> Iterator[Closure]:
        number = {j: k for k, j in enumerate(self.left)}
        for closure in self.equations.system.pushing:
            row = {number[j]: e for j, e in entries(closure.gradient).items()}
            yield replace(closure, gradient=ExpressionRow(len(self.left), row))

    def _start(self) -> list[float]:
        """Evaluate the momenta at the initial state; none if they have no value."""
        system, initial = self.equations.system, self.equations.system.initial
        if initial is None:
            return []
        values: dict[sp.Symbol, mpf] = {system.t: mpf(system.simulate.start)}
        values |= {p.symbol: mpf(p.value) for p in system.parameters if p.value is not None}
        for k, c in enumerate(system.coordinates):
            values[c.q], values[c.v] = mpf(initial.positions[k]), mpf(initial.velocities[k])
        try:
            return [float(x) for x in evaluate([m.expression for m in self.named], values)]
        except (DomainError, KeyError):
            return []


def _multiplied_out(terms: Sequence[sp.Expr]) -> list[sp.Expr]:
    return collected_terms([e for t in terms for e in expand_terms(t, _TERM_BUDGET) or [t]])


class _Comparison:
    """Comparison at a state of R, the ignored velocities, and the reduced equations."""

    def __init__(self, equations: Equations, form: Routhian, ignored: Sequence[int]) -> None:
        self.equations, self.form, self.ignored = equations, form, ignored
        self.left = [j for j in range(len(equations.system.coordinates)) if j not in ignored]
        self.lagrangian = Tape([equations.system.lagrangian], lagrangian_symbols(equations))
        self.values = Evaluated([form.expression, *form.velocities])
        self.momenta = Evaluated([m.expression for m in form.momenta])
        self.residuals = Residuals(equations)
        self.inner = [
            [equations.system.mass_matrix[i][j] for j in (*ignored, *self.left)] for i in ignored
        ]
        self.matrix = Evaluated([e for row in self.inner for e in row])
        terms = []
        for j, shown in enumerate(form.shown):
            pushes = [c.multiplier * c.gradient[j] for c in form.closures]
            row = form.mass_matrix[j].nonzero
            inertia = [e * form.coordinates[k].a for k, e in row.items()]
            terms.append(sp.Add(*inertia, -form.forcing[j], *(-x for x in pushes)))
            terms.append(shown.divided_by * shown.residual)
        self.reduced = Evaluated(terms)

    def __call__(self, state: State) -> Iterator[Pair]:
        seen = LagrangianSlopes(self.equations, self.lagrangian, state)
        routhian = {**state}
        for momentum, i in zip(self.form.momenta, self.ignored, strict=True):
            routhian[momentum.symbol] = seen.momenta[i]
        for i, value in zip(self.ignored, self.momenta.at(state), strict=True):
            yield value, seen.momenta[i], abs(value) + abs(seen.momenta[i])
        value, *velocities = self.values.at(routhian)
        rates = [state[m.coordinate.v] for m in self.form.momenta]
        work = [seen.momenta[i] * v for i, v in zip(self.ignored, rates, strict=True)]
        yield value, seen.value - sum(work, _ZERO), sum(map(abs, work), abs(seen.value))
        for velocity, rate in zip(velocities, rates, strict=True):
            yield velocity, rate, abs(velocity) + abs(rate)
        yield from self._equations(state, routhian)

    def _equations(self, state: State, routhian: State) -> Iterator[Pair]:
        """Compare reduced residuals with r − M_rc M_cc⁻¹ r_c of the certified residuals r."""
        residuals = [*self.residuals.at(state)]
        values = iter(self.matrix.at(state))
        rows = [[next(values) for _ in row] for row in self.inner]
        n = len(self.ignored)
        inner = mpmath.matrix([row[:n] for row in rows])
        drags = mpmath.lu_solve(inner, mpmath.matrix([residuals[i][0] for i in self.ignored]))
        written = iter(self.reduced.at(routhian))
        for place, j in enumerate(self.left):
            parts = [rows[i][n + place] * drags[i] for i in range(n)]
            residual, size = residuals[j]
            size += sum(map(abs, parts), _ZERO)
            for _ in range(2):
                yield next(written), residual - sum(parts, _ZERO), size
