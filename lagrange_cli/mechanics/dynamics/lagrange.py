"""Mass matrix and forcing by d'Alembert's principle.

For particle components r(q, t) with Jacobian J and convective term γ,

    M = Σ m JᵀJ,   h = Σ m Jᵀγ,   M q̈ + h = Q(q, q̇, t),

which equals Lagrange's equations and needs no expansion of the kinetic energy
(Goldstein, Poole and Safko, Classical Mechanics, 3rd ed., section 1.4).
Kinetic energy beyond the particles' and generalized potentials enter through
the Euler–Lagrange expression of T_extra − U. Products that recur across
particles are gathered with summed masses before anything is multiplied.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.arithmetic import negative, plain_sum
from lagrange_cli.mechanics.algebra.collect import (
    Splitter,
    TermParts,
    TermSum,
    python_rational,
)
from lagrange_cli.mechanics.algebra.derivatives import POSITION_TERMS, Kinematics, derivative
from lagrange_cli.mechanics.algebra.factor import factored
from lagrange_cli.mechanics.algebra.identities import Weights
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.rate_sums import RateSum, rate_sums
from lagrange_cli.mechanics.algebra.shared_products import MovingComponent, recurring_products
from lagrange_cli.mechanics.algebra.substitution import Element
from lagrange_cli.mechanics.contacts.gaps import contacts
from lagrange_cli.mechanics.dynamics.body_recursion import has_long_chain, recursion_of
from lagrange_cli.mechanics.dynamics.constraints import closures
from lagrange_cli.mechanics.dynamics.inertia import CollectedInertia, TreeInertia, full_rows
from lagrange_cli.mechanics.dynamics.potential_forces import (
    CoordinateForce,
    PotentialForces,
    raw_terms,
)
from lagrange_cli.mechanics.dynamics.shown_energies import ShownEnergies, spins_in_brackets
from lagrange_cli.mechanics.elements.tree import BodyTree
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.sparse import ExpressionRow
from lagrange_cli.mechanics.symbols.written_sums import written_sums
from lagrange_cli.mechanics.system import BodyForce, Closure, Contact
from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.model import Force

_Entry = TypeVar("_Entry")

#: Most products that are multiplied out and collected; beyond it sums are left factored.
MOST_COLLECTED_PRODUCTS = 50_000

#: Times as many if every entry of a Jacobian is one term, so that M has no products of sums: links
#: of a chain, of which 256 are collected so. Chosen for these.
_PLAIN_JACOBIANS = 8

#: Terms that one factor of a force may be multiplied out to.
_TERM_BUDGET = 200


@dataclass(frozen=True)
class Uncertified:
    """Equations before they are certified: M, f, and the energies and forces they came from.

    ``mass[j][k]`` and ``forcing[j]`` are lists of collected terms.
    Rows of ``mass`` hold the columns that are not zero; ``mass_matrix`` has each list as one
    factored sum.

    Attributes
    ----------
    inertia
        M.
    energies
        T and V over q, v, t in display form.
    extra
        T_extra − U: the part of L that enters by its Euler–Lagrange expression.
    position
        Raw symbol of a body's component → r(q, t) as it follows from frame to frame with ``tree``.
    velocity
        Raw symbol of a particle's component → ṙ(q, v, t).
    collected
        False where the product budget was exceeded and sums were left factored.
    tree
        The frames over which M and f follow by recursion: each is one expression whose parts are
        shared, and far too long to be walked part by part, or written. None if they do not.
    closures
        Equations beside the coordinates, whose multipliers enter M a = f + Σ λ·gradient.
    contacts
        One-sided constraints, whose multipliers enter in the same way while they touch.
    sums
        Sums in brackets, each as its terms in the order of the scene.
    rate_sums
        Sums of a velocity and what drives it, as ``φ̇ + ω``.
    """

    reduced: Reduced
    inertia: CollectedInertia | TreeInertia
    forcing: tuple[tuple[sp.Expr, ...], ...]
    energies: ShownEnergies
    extra: sp.Expr
    dissipation: sp.Expr
    forces: tuple[BodyForce, ...]
    velocity: dict[sp.Symbol, sp.Expr]
    collected: bool
    closures: tuple[Closure, ...] = ()
    contacts: tuple[Contact, ...] = ()
    sums: tuple[tuple[sp.Expr, ...], ...] = ()
    rate_sums: tuple[RateSum, ...] = ()
    tree: BodyTree | None = None
    position: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)

    @property
    def pushing(self) -> tuple[Closure, ...]:
        """Equations with a multiplier: closures, then the gaps of contacts."""
        return (*self.closures, *(c.closure for c in self.contacts))

    @property
    def mass(self) -> Sequence[Mapping[int, tuple[sp.Expr, ...]]]:
        return self.inertia.terms

    @property
    def mass_matrix(self) -> tuple[ExpressionRow, ...]:
        return self.inertia.rows

    @property
    def kinetic(self) -> sp.Expr:
        return self.energies.kinetic

    @property
    def potential(self) -> sp.Expr:
        return self.energies.potential

    @cached_property
    def lagrangian(self) -> sp.Expr:
        if self.tree is not None:
            opposite = sp.Mul(sp.S.NegativeOne, self.potential, evaluate=False)
            return sp.Add(self.kinetic, opposite, evaluate=False)
        return plain_sum((self.kinetic, negative(self.potential)))

    @cached_property
    def forcing_sums(self) -> tuple[sp.Expr, ...]:
        """Each entry of f as the sum of its terms."""
        return tuple(map(self._total, self.forcing))

    def _total(self, terms: tuple[sp.Expr, ...]) -> sp.Expr:
        return terms[0] if self.tree is not None and terms else plain_sum(terms)


def derive_uncertified(reduced: Reduced) -> Uncertified:
    """Derive mass matrix, forcing and energies of a reduced scene, not yet checked."""
    return _Builder(reduced).build()


class _Builder:
    def __init__(self, reduced: Reduced) -> None:
        self.reduced = reduced
        self.q = [c.q for c in reduced.coordinates]
        self.v = [c.v for c in reduced.coordinates]
        self.t = reduced.names.t
        self.n = len(self.q)
        self.number = {q: j for j, q in enumerate(self.q)}
        self._is_chain = has_long_chain(reduced)
        self.recursion = recursion_of(reduced)
        budget = 1 if self._is_chain else POSITION_TERMS
        self.kinematics = Kinematics(reduced.resolved, self.q, self.v, self.t, budget)
        self.masses = frozenset(f for m in reduced.masses for f in symbols_in(m))
        self.splitter = Splitter(self.masses)
        self.sums: tuple[tuple[sp.Expr, ...], ...] = ()
        self.rate_sums: tuple[RateSum, ...] = ()
        self.brackets: list[sp.Expr] = []
        if self.recursion is None:
            self._find_brackets()
        self.mass: dict[tuple[int, int], TermSum] = {}
        self.forcing = [TermSum(self.splitter) for _ in range(self.n)]
        self.terms = raw_terms(reduced)
        self.components = [
            (symbol, mass)
            for body, mass in zip(reduced.names.particle_symbols, reduced.masses, strict=True)
            for symbol in body
            if reduced.chart.geometry.position_symbols[symbol]
            and not (self.recursion and self.recursion.moves(symbol))
        ]
        self.jacobians = {s: self.kinematics.jacobian(s) for s, _ in self.components}
        self._masses: dict[tuple[int, int], Weights] = {}
        self._budget = _TERM_BUDGET
        self._potential_forces = PotentialForces(reduced, self._moves, self._split_terms)

    def _find_brackets(self) -> None:
        """Find sums that stay in brackets, since the scene wrote them or a body turns with them."""
        reduced = self.reduced
        self.sums = written_sums(
            reduced.scene.expressions(),
            [expression for _, expression in reduced.names.abbreviations()],
            lambda e: reduced.resolve(reduced.names.convert(e, reduced.rate)),
        )
        self.brackets = [sp.Add(*terms) for terms in self.sums]
        self.rate_sums = rate_sums(self.brackets, dict(zip(self.q, self.v, strict=True)), self.t)
        self.brackets += spins_in_brackets(reduced)

    def build(self) -> Uncertified:
        collected = self._add_inertia()
        if not collected:
            # Sums that are left factored there are so everywhere.
            self._budget = 1
        for potential in self.terms.elements:
            self._add_potential(potential)
        extra = sp.Add(*self.terms.kinetic, *(-u for u in self.terms.velocity_dependent))
        further = (
            extra if self.recursion is None else sp.Add(extra, *map(negative, self.terms.turning))
        )
        for term in self._terms(further):
            self._add_extra(term)
        forces = tuple(self._add_force(f) for f in self.reduced.scene.forces)
        dissipation = self._add_dissipation()
        upper = {place: tuple(self.mass[place].collected()) for place in sorted(self.mass)}
        upper = {place: terms for place, terms in upper.items() if terms}
        forcing = tuple(tuple(f.collected()) for f in self.forcing)
        tree = None if self.recursion is None else self.recursion.tree(upper)
        inertia: CollectedInertia | TreeInertia
        if self.recursion is None:
            shown = {place: factored(list(terms)) for place, terms in upper.items()}
            rows = tuple(ExpressionRow(self.n, row) for row in full_rows(self.n, shown))
            inertia = CollectedInertia(full_rows(self.n, upper), rows)
        else:
            shown = {}
            inertia, sums = self.recursion.equations(upper, forcing)
            forcing = tuple((f,) if f is not sp.S.Zero else () for f in sums)
        velocity = {
            s: self._velocity(s) for body in self.reduced.names.particle_symbols for s in body
        }
        closure_equations, gaps = closures(self.reduced)
        return Uncertified(
            self.reduced,
            inertia,
            forcing,
            ShownEnergies(
                self.reduced,
                self.terms,
                velocity,
                shown,
                self.splitter,
                self.brackets,
                self.rate_sums,
                is_written=self.recursion is None,
            ),
            extra,
            dissipation,
            forces,
            velocity,
            collected,
            closure_equations,
            contacts(self.reduced, gaps),
            self.sums,
            self.rate_sums,
            tree,
            {} if self.recursion is None else self.recursion.position,
        )

    def _velocity(self, symbol: sp.Symbol) -> sp.Expr:
        if self.recursion is not None and self.recursion.moves(symbol):
            return self.recursion.velocity[symbol]
        return plain_sum(self.kinematics.velocity(symbol))

    def _moves(self, symbol: sp.Symbol) -> bool:
        """Tell whether a coordinate moves a raw symbol."""
        return bool((self.recursion and self.recursion.moves(symbol)) or self._jacobian(symbol))

    def _inertia(self, j: int, k: int) -> TermSum:
        """The entry of the mass matrix in row j ≤ column k."""
        if (j, k) not in self.mass:
            self.mass[j, k] = TermSum(self.splitter)
        return self.mass[j, k]

    # Inertia: M = Σ m JᵀJ and −h = −Σ m Jᵀγ.

    def _add_inertia(self) -> bool:
        gathered = recurring_products(self._moving_components(factored=False))
        is_plain = all(len(a) == 1 for row in self.jacobians.values() for a in row.values())
        limit = MOST_COLLECTED_PRODUCTS * (_PLAIN_JACOBIANS if is_plain else 1)
        fits = gathered.number <= limit and not self._is_chain
        if not fits:
            gathered = recurring_products(self._moving_components(factored=True))
        for row, column, a, b, carried in gathered:
            target = self.forcing[row] if column < 0 else self._inertia(row, column)
            weights = self._carried(carried, sign=-1 if column < 0 else 1)
            if fits:
                target.add_product(a, b, weights)
            else:
                target.add(a * b, weights)
        return fits

    def _moving_components(self, *, factored: bool) -> Iterator[MovingComponent]:
        """Parts of each component's Jacobian and convective term, or each as one factor."""
        for symbol, _ in self.components:
            rows = [(j, tuple(parts)) for j, parts in self.jacobians[symbol].items()]
            convective = tuple(self.kinematics.convective(symbol))
            if factored:
                rows = [(j, (sp.Add(*parts),)) for j, parts in rows]
                convective = (sp.Add(*convective),) if convective else ()
            yield MovingComponent(rows, tuple(g for g in convective if g != 0))

    def _carried(self, components: int, sign: int) -> Weights:
        """The mass of a set of components, times a sign."""
        if (components, sign) not in self._masses:
            weights: Weights = {}
            left = components
            while left:
                _, mass = self.components[(left & -left).bit_length() - 1]
                left &= left - 1
                count, factor = mass.as_coeff_Mul(rational=True)
                weights[factor] = weights.get(factor, 0) + python_rational(count)
            whole = self.splitter.as_one(weights)
            self._masses[components, sign] = {m: sign * c for m, c in whole.items()}
        return self._masses[components, sign]

    # Forces.

    def _add_work(self, symbol: sp.Symbol, force: sp.Expr, into: Sequence[TermSum]) -> None:
        """Add the virtual work of a force along one Cartesian component, F ∂r/∂q."""
        if self.recursion is not None and self.recursion.moves(symbol):
            self.recursion.push(symbol, force)
            return
        parts = self._terms(force)
        for j, row in self._jacobian(symbol).items():
            for a in row:
                for p in parts:
                    into[j].add_product(p, a)

    def _jacobian(self, symbol: sp.Symbol) -> dict[int, list[sp.Expr]]:
        """The row ∂r/∂q of a Cartesian component; empty if no coordinate moves it."""
        if symbol not in self.jacobians:
            self.jacobians[symbol] = self.kinematics.jacobian(symbol)
        return self.jacobians[symbol]

    def _add_potential(self, potential: Element) -> None:
        """−∂V/∂q through the Cartesian names that V is written in."""
        for force in self._potential_forces.forces_of(potential):
            if isinstance(force, CoordinateForce):
                into = self.forcing[self.number[force.symbol]]
                for parts in force.terms:
                    into.add_parts(parts)
            elif force.symbol in self.number:
                self.forcing[self.number[force.symbol]].add_all(self._terms(force.force))
            else:
                self._add_work(force.symbol, force.force, self.forcing)

    def _split_terms(self, force: sp.Expr) -> list[TermParts]:
        return [self.splitter.split(term) for term in self._terms(force)]

    def _add_extra(self, term: sp.Expr) -> None:
        """Add the Euler–Lagrange expression of a term of T_extra − U."""
        present = symbols_in(term)
        for j in range(self.n):
            if self.q[j] in present:
                self.forcing[j].add_all(self._terms(derivative(term, self.q[j])))
            if self.v[j] not in present:
                continue
            momentum = derivative(term, self.v[j])
            for k in range(self.n):
                if k >= j and self.v[k] in present:
                    self._inertia(j, k).add_all(self._terms(derivative(momentum, self.v[k])))
                if self.q[k] in present:
                    change = -derivative(momentum, self.q[k]) * self.v[k]
                    self.forcing[j].add_all(self._terms(change))
            if self.t in present:
                self.forcing[j].add_all(self._terms(-derivative(momentum, self.t)))

    def _add_force(self, force: Force) -> BodyForce:
        reduced = self.reduced
        components = tuple(reduced.resolve(reduced.convert(c)) for c in force.components)
        if self.recursion is not None and self.recursion.holds(force.on) and len(components) == 3:
            work = self.recursion.load(force.on, components, is_torque=force.is_torque)
            return BodyForce(force.name, force.on, components, work, force.is_torque)
        sums = [TermSum(self.splitter) for _ in range(self.n)]
        if force.is_torque:
            self._add_turning_work(force, components, sums)
        pushed = () if force.is_torque else zip(self._targets(force), components, strict=True)
        for symbol, component in pushed:
            if symbol in self.number:
                sums[self.number[symbol]].add_all(self._terms(component))
            else:
                self._add_work(symbol, component, sums)
        generalized = tuple(factored(s.collected()) for s in sums)
        for into, expr in zip(self.forcing, generalized, strict=True):
            into.add_all(self._terms(expr))
        return BodyForce(force.name, force.on, components, generalized, force.is_torque)

    def _add_turning_work(
        self, force: Force, components: Sequence[sp.Expr], into: Sequence[TermSum]
    ) -> None:
        """Add the virtual work of a torque on a body, τ·∂ω/∂q̇."""
        reduced = self.reduced
        body = next(b for b in bodies_of(reduced.scene) if b.name == force.on)
        for spin, component in zip(body.spin_in_space, components, strict=True):
            omega = reduced.resolve(reduced.convert(spin))
            parts = self._terms(component)
            for j, v in enumerate(self.v):
                if component != 0 and v in symbols_in(omega):
                    for a in self._terms(derivative(omega, v)):
                        for p in parts:
                            into[j].add_product(p, a)

    def _targets(self, force: Force) -> Sequence[sp.Symbol]:
        names = self.reduced.names
        bodies = dict(zip((b.name for b in names.bodies), names.body_symbols, strict=True))
        if len(force.components) == 1:
            for c in self.reduced.coordinates:
                if c.name == force.on:
                    return [c.q]
        elif force.on in bodies:
            return bodies[force.on]
        raise InputError(
            Problem(
                f"force '{force.name}' acts on '{force.on}', which is no coordinate of this scene",
                force.on_mark,
                hint="coordinates: " + ", ".join(c.name for c in self.reduced.coordinates),
                rule="unknown-name",
            )
        )

    def _add_dissipation(self) -> sp.Expr:
        reduced = self.reduced
        total = sp.Add(
            *(reduced.resolve(reduced.convert(d.expression)) for d in reduced.scene.dissipation)
        )
        for into, v in zip(self.forcing, self.v, strict=True):
            into.add_all(self._terms(-derivative(total, v)))
        return total

    def _terms(self, expr: sp.Expr) -> Sequence[sp.Expr]:
        """Terms of a sum, multiplied out within the budget; none for zero."""
        if expr == 0:
            return ()
        expanded = expand_terms(expr, self._budget)
        return [e for e in expanded if e != 0] if expanded is not None else sp.Add.make_args(expr)
