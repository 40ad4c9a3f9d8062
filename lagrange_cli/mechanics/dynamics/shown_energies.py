"""T and V in display form, computed on demand: mass matrix and forcing need neither."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import monomial, plain_sum
from lagrange_cli.mechanics.algebra.collect import Splitter, collected_terms
from lagrange_cli.mechanics.algebra.energies import by_parameters, shortest_energy
from lagrange_cli.mechanics.algebra.factor import grouped_sum, tidy
from lagrange_cli.mechanics.algebra.polynomials import expand_terms, term_count
from lagrange_cli.mechanics.algebra.rate_sums import RateSum, over_rate_sums
from lagrange_cli.mechanics.algebra.substitution import Element, Shape, Template
from lagrange_cli.mechanics.dynamics.potential_forces import RawTerms
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.bodies import bodies_of

#: Terms that the squares of all velocities may be multiplied out to.
_TERM_BUDGET = 200


def spins_in_brackets(reduced: Reduced) -> list[sp.Expr]:
    """Return components of ω that stay in brackets: ½ I3 (ψ̇ + φ̇ cos θ)².

    About an axis of symmetry; the squares of two others with one moment add up to less.
    """
    brackets = []
    for body in bodies_of(reduced.scene):
        moments = [reduced.names.convert(body.inertia[k][k]) for k in range(3)]
        spins = [reduced.resolve(reduced.convert(spin)) for spin in body.spin]
        brackets += [
            spin
            for spin, moment in zip(spins, moments, strict=True)
            if spin.is_Add and moment != 0 and moments.count(moment) == 1
        ]
    return brackets


class ShownEnergies:
    """Kinetic and potential energy over q, v, t.

    Parameters
    ----------
    reduced, terms
        The scene over its coordinates, and its potentials and kinetic terms.
    velocity
        Raw symbol of a particle's component → ṙ(q, v, t).
    mass
        Row and column ≥ row of the mass matrix → entry that is not zero.
    splitter
        Splits terms, and knows the masses and the order in which factors appeared.
    brackets
        Sums that stay as they are, since the scene wrote them.
    rate_sums
        Sums of a velocity and what drives it, over which T of particles is written if shorter.
    is_written
        False where they are too long to be read, and stay as they are.
    """

    def __init__(
        self,
        reduced: Reduced,
        terms: RawTerms,
        velocity: Mapping[sp.Symbol, sp.Expr],
        mass: Mapping[tuple[int, int], sp.Expr],
        splitter: Splitter,
        brackets: Sequence[sp.Expr],
        rate_sums: Sequence[RateSum],
        *,
        is_written: bool = True,
    ) -> None:
        self._reduced, self._terms = reduced, terms
        self._velocity, self._mass = velocity, mass
        self._splitter, self._rate_sums = splitter, rate_sums
        self._is_written = is_written
        self._brackets = list(dict.fromkeys((*brackets, *(rate.whole for rate in rate_sums))))
        self._v = [c.v for c in reduced.coordinates]
        self._constants = frozenset(reduced.names.parameters.values())
        #: Tidied potentials by their shapes; None for those that stay as they are.
        self._tidy: dict[Shape, Template | None] = {}

    @property
    def kinetic(self) -> sp.Expr:
        """T = Σ ½ m ṙ², each particle's square collected, or the shortest other form."""
        return self._both[0]

    @property
    def potential(self) -> sp.Expr:
        """V, each term with a common factor in front, or the shortest other form."""
        return self._both[1]

    @cached_property
    def _both(self) -> tuple[sp.Expr, sp.Expr]:
        """T, then V: factors appear in this order."""
        if not self._is_written:
            potential = map(self._reduced.resolve, self._terms.positional)
            return self._plain_kinetic(), sp.Add(*potential, *self._terms.velocity_dependent)
        kinetic = self._shortest(plain_sum((*self._particles(), *self._terms.kinetic)))
        tidied = map(self._tidied, self._terms.elements)
        return kinetic, self._shortest(plain_sum((*tidied, *self._terms.velocity_dependent)))

    def _plain_kinetic(self) -> sp.Expr:
        """Σ ½ m ṙ² with the terms of the section, sums and products left as they are."""
        reduced, half = self._reduced, sp.Rational(1, 2)
        terms = list(self._terms.kinetic)
        for mass, centre in zip(reduced.masses, reduced.names.particle_symbols, strict=True):
            rates = [self._velocity[s] for s in centre]
            squares = [sp.Pow(rate, 2, evaluate=False) for rate in rates if rate != 0]
            if squares:
                terms.append(sp.Mul(half, mass, sp.Add(*squares, evaluate=False), evaluate=False))
        return sp.Add(*terms, evaluate=False)

    def _shortest(self, energy: sp.Expr) -> sp.Expr:
        return shortest_energy(energy, self._v, self._splitter, self._constants, self._brackets)

    def _particles(self) -> list[sp.Expr]:
        """Terms of the particles' kinetic energy."""
        reduced, velocity, n = self._reduced, self._velocity, len(self._v)
        symbols = reduced.chart.geometry.position_symbols
        scleronomic = not any(reduced.names.t in symbols[s] for s in velocity)
        particles = None
        bodies = reduced.names.particle_symbols
        squares = [sp.Add(*(velocity[s] ** 2 for s in body)) for body in bodies]
        if sum(term_count(e) for e in squares) <= _TERM_BUDGET:
            collected = [collected_terms(expand_terms(e, _TERM_BUDGET) or ()) for e in squares]
            particles = [
                m * self._grouped(c) / 2 for m, c in zip(reduced.masses, collected, strict=True)
            ]
            size = sum(map(len, collected))
        quadratic = scleronomic and not (self._terms.kinetic or self._terms.velocity_dependent)
        if quadratic and (particles is None or n * (n + 1) < size):
            particles = self._quadratic_form()
        if particles is None:
            particles = [m * e / 2 for m, e in zip(reduced.masses, squares, strict=True)]
        return particles

    def _grouped(self, terms: Sequence[sp.Expr]) -> sp.Expr:
        """Sum of terms by velocities, or by their sums with what drives them."""
        shown, sums = over_rate_sums(terms, self._rate_sums)
        symbols = {rate.velocity: symbol for symbol, rate in sums.items()}
        whole = grouped_sum(shown, [symbols.get(v, v) for v in self._v])
        return whole.xreplace({symbol: rate.whole for symbol, rate in sums.items()})

    def _quadratic_form(self) -> list[sp.Expr]:
        """Terms of ½ Σ M q̇ q̇, those with the same parameters together."""
        terms = []
        for (j, k), entry in self._mass.items():
            number, factor = entry.as_coeff_Mul(rational=True)
            rates = [self._v[j] ** 2] if j == k else [self._v[j], self._v[k]]
            half = number / 2 if j == k else number
            terms.append(monomial(half, [*sp.Mul.make_args(factor), *rates]))
        if len(terms) > _TERM_BUDGET:
            return terms
        return [*sp.Add.make_args(by_parameters(terms, self._constants, self._v))]

    def _tidied(self, potential: Element) -> sp.Expr:
        """A potential over coordinates, with a common factor in front; once for each shape."""
        element = self._reduced.resolved_element(potential)
        shape = element.shape
        if shape not in self._tidy:
            expr = tidy(shape.expr, self._splitter.masses)
            self._tidy[shape] = None if expr == shape.expr else Template(expr, shape.symbols)
        template = self._tidy[shape]
        return element.expr if template is None else template.over(element.symbols)
