"""M, f and the energy function for code, derived on the value graph from positions and energies.

A person reads sums that are collected from products; code need not execute these. On the graph

    M = Σ m JᵀJ + ∂²L'/∂q̇²,   f = −Σ m Jᵀγ + ∂L'/∂q − (d/dt ∂L'/∂q̇ without accelerations) + Q

with J = ∂r/∂q, γ = the second derivative of r along the motion without accelerations, and L' the
part of the Lagrangian that is no particle's ½ m ṙ². Each follows by forward differentiation, and
shares what positions share: nothing is multiplied out. Nothing but the positions, L' and the
forces is taken from the derivation that is shown, which is compared with this one.

The energy function is added up from positions too. Collected, as it is shown, the kinetic energy of
a chain has a term for each pair of links. As Σ ½ m ṙ² over particles it has one for each of them,
and no term is negative:

    Σ q̇ ∂L/∂q̇ − L = Σ ½ m ((J q̇)² − (∂r/∂t)²) + Σ q̇ ∂L'/∂q̇ − L'.
"""

from __future__ import annotations

from decimal import localcontext
from fractions import Fraction
from functools import cache
from itertools import combinations_with_replacement, islice
from typing import TYPE_CHECKING, TypeAlias

from mpmath import mpf

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.derivatives import (
    UNIT,
    Tangent,
    derivatives,
    product,
    scaled,
)
from lagrange_cli.program.graph.schedule import order_of
from lagrange_cli.program.graph.value_graph import (
    ONE,
    CallNode,
    InputNode,
    ProductNode,
    ScaledNode,
    SumNode,
    ValueGraph,
)
from lagrange_cli.program.systems.agreement import DECIMALS, at_certificate

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import DerivationSources
    from lagrange_cli.program.graph.operands import Coefficient


_ZERO: ScaledNode = (0, ONE)
_MINUS = -1

#: Relative difference that counts as rounding of the certificate, whose terms may cancel.
_AGREE = mpf(10) ** -12

#: The rank of accelerations and multipliers (see :class:`.value_graph.ValueGraph`).
_GIVEN = 5


_Slope: TypeAlias = tuple[int, "Coefficient", int]
"""Number of a coordinate, and the derivative of a component of a position by it."""

_Pair: TypeAlias = tuple[_Slope, _Slope, int]
"""Two slopes, and the components that have both, as bits."""


class _Totals(dict[int, ScaledNode]):
    """Sums of some of several values, by the number whose bits select them."""

    def __init__(self, values: ValueGraph, parts: Sequence[ScaledNode]) -> None:
        super().__init__()
        self._values, self._parts = values, parts

    def __missing__(self, chosen: int) -> ScaledNode:
        total = self[chosen] = self._values.add(self._parts[place] for place in _bits(chosen))
        return total


def _bits(number: int) -> Iterator[int]:
    """Yield the places of the ones of a number."""
    while number:
        yield (number & -number).bit_length() - 1
        number &= number - 1


def _pairs(rows: Sequence[Sequence[_Slope]], holders: Mapping[_Slope, int]) -> list[_Pair]:
    """List pairs of slopes that one component has, each once, in the order of first appearance."""
    pairs: Iterable[tuple[_Slope, _Slope]]
    if len(holders) ** 2 < sum(len(row) ** 2 for row in rows):
        pairs = combinations_with_replacement(sorted(holders), 2)
    else:
        pairs = {pair for row in rows for pair in combinations_with_replacement(row, 2)}
    common = ((a, b, holders[a] & holders[b]) for a, b in pairs)
    ordered = sorted((both & -both, a, b, both) for a, b, both in common if both)
    return [(a, b, both) for _, a, b, both in ordered]


class DirectDerivation:
    """Mass matrix and forcing as values of a graph.

    Attributes
    ----------
    values
        The graph.
    mass
        Rows of M without zeros.
    forcing
        f.
    """

    def __init__(self, values: ValueGraph, equations: Equations) -> None:
        self.values, self._equations = values, equations
        assert equations.derivation.sources is not None
        self._sources: DerivationSources = equations.derivation.sources
        coordinates = equations.system.coordinates[: len(equations.system.mass_matrix)]
        self._n = len(coordinates)
        self._v = [values.convert(c.v) for c in coordinates]
        q = [values.convert(c.q)[1] for c in coordinates]
        self._by_q: dict[int, Tangent] = {number: {k: UNIT} for k, number in enumerate(q)}
        self._by_v: dict[int, Tangent] = {v[1]: {k: UNIT} for k, v in enumerate(self._v)}
        self._along: dict[int, Tangent] = {
            number: {0: v} for number, v in zip(q, self._v, strict=True)
        }
        self._along[values.convert(equations.system.t)[1]] = {0: UNIT}
        self._masses: dict[tuple[int, int], list[ScaledNode]] = {}
        self._forces: list[list[ScaledNode]] = [[] for _ in range(self._n)]
        self._add_particles()
        self._add_energy(values.convert(self._sources.other_lagrangian))
        self._add_forces()
        self.mass: list[dict[int, ScaledNode]] = [{} for _ in range(self._n)]
        for (j, k), terms in self._masses.items():
            value = values.add(terms)
            if value[0]:
                self.mass[j][k] = self.mass[k][j] = value
        self.forcing = [values.add(terms) for terms in self._forces]

    def _rate(self, wanted: Sequence[ScaledNode]) -> list[ScaledNode]:
        """Differentiate by time along the motion, without accelerations."""
        tangents = derivatives(self.values, wanted, self._along)
        return [tangent.get(0, _ZERO) for tangent in tangents]

    def _add_particles(self) -> None:
        """Add products that recur in several particles, as in a chain, once, times the mass sum."""
        values, particles = self.values, self._equations.system.particles
        masses = [values.convert(p.mass) for p in particles for _ in range(3)]
        positions = [values.convert(r) for p in particles for r in p.position]
        rows = [
            [(j, *slope) for j, slope in sorted(row.items())]
            for row in derivatives(values, positions, self._by_q)
        ]
        holders: dict[_Slope, int] = {}
        for place, row in enumerate(rows):
            for slope in row:
                holders[slope] = holders.get(slope, 0) | 1 << place
        self._add_squares(_Totals(values, masses), _pairs(rows, holders), holders)
        self._add_pushes(masses, self._rate(self._rate(positions)), holders)

    def _add_squares(
        self, mass_of: _Totals, pairs: Iterable[_Pair], holders: Mapping[_Slope, int]
    ) -> None:
        """Add Σ m JᵀJ of particles whose components of positions have these slopes."""
        values = self.values

        @cache
        def moved(both: int, inner: int) -> ScaledNode:
            """Multiply a slope by the mass of all particles that move with it."""
            return values.multiply([(mass_of[both], 1), ((1, inner), 1)])

        for first, second, both in pairs:
            (j, c, a), (k, d, b) = first, second
            if j != k and both & (both - 1) and both in (holders[first], holders[second]):
                # All particles that move with one slope move with the other.
                inner, outer = (b, a) if both == holders[second] else (a, b)
                square = values.multiply([((1, outer), 1), (moved(both, inner), 1)])
                square = scaled(square, c * d)
            else:
                square = product(values, mass_of[both], (c, a), (d, b))
            self._masses.setdefault((j, k), []).append(square)

    def _add_pushes(
        self,
        masses: Sequence[ScaledNode],
        convective: Sequence[ScaledNode],
        holders: Mapping[_Slope, int],
    ) -> None:
        """Add −Σ m Jᵀγ of particles."""
        values = self.values
        pairs = zip(masses, convective, strict=True)
        inertia_of = _Totals(values, [product(values, *pair) for pair in pairs])
        # Multiplied out, a slope that is no sum may cancel with that of another component.
        alone = sum(
            1 << place
            for place, (_, number) in enumerate(convective)
            if isinstance(values.nodes[number], ProductNode)
        )
        for (j, c, a), components in holders.items():
            for part in (*(1 << place for place in _bits(components & alone)), components & ~alone):
                push = product(values, (c, a), inertia_of[part])
                self._forces[j].append(scaled(push, _MINUS))

    def _add_energy(self, energy: ScaledNode) -> None:
        """Add the Euler–Lagrange expression of the other part of the Lagrangian."""
        values = self.values
        (slopes,) = derivatives(values, [energy], self._by_q)
        for j, slope in slopes.items():
            self._forces[j].append(slope)
        (momenta,) = derivatives(values, [energy], self._by_v)
        rows = derivatives(values, list(momenta.values()), self._by_v)
        rates = self._rate(list(momenta.values()))
        for j, row, rate in zip(momenta, rows, rates, strict=True):
            for k, value in row.items():
                if j <= k:
                    self._masses.setdefault((j, k), []).append(value)
            if rate[0]:
                self._forces[j].append(scaled(rate, _MINUS))

    def _add_forces(self) -> None:
        values, equations = self.values, self._equations
        for force in equations.system.forces:
            for terms, component in zip(self._forces, force.generalized, strict=True):
                terms.append(values.convert(component))
        (drag,) = derivatives(values, [values.convert(equations.system.dissipation)], self._by_v)
        for j, value in drag.items():
            self._forces[j].append(scaled(value, _MINUS))

    @property
    def operations(self) -> int:
        """Count operations before common parts of sums and products are shared."""
        values = self.values
        wanted = [*(entry for row in self.mass for entry in row.values()), *self.forcing]
        count = 0
        for number in order_of(values, [number for _, number in wanted]):
            node = values.nodes[number]
            if isinstance(node, SumNode):
                scaled_terms = sum(abs(c) != 1 and part != ONE for part, c in node.terms)
                count += len(node.terms) - 1 + scaled_terms
            elif isinstance(node, ProductNode):
                count += sum(abs(exponent) for _, exponent in node.factors) - 1
            else:
                count += isinstance(node, CallNode)
        return count

    def define(self) -> None:
        """Make these values those of the collected expressions in the graph."""
        for row, derived in zip(self._equations.system.mass_matrix, self.mass, strict=True):
            for k, entry in entries(row).items():
                self.values.define(entry, derived.get(k, _ZERO))
        for entry, value in zip(self._equations.system.forcing, self.forcing, strict=True):
            self.values.define(entry, value)

    def agrees(self) -> bool:
        """Compare M a − f with the residuals of the certificate, at one of its states.

        The upper triangle of M stands for both: they hold the same nodes.
        """
        values, equations, sources = self.values.copy(), self._equations, self._sources

        def solution_value(name: str) -> ScaledNode:
            return 1, values.intern(InputNode(name), _GIVEN)

        upper = [(j, k) for j, row in enumerate(self.mass) for k in row if j <= k]
        pushed = [
            (j, number, values.convert(entry))
            for number, closure in enumerate(equations.system.pushing)
            for j, entry in entries(closure.gradient).items()
        ]
        wanted = [
            *self.forcing,
            *(solution_value(f"a{k}") for k in range(self._n)),
            *(solution_value(f"l{k}") for k in range(len(equations.system.pushing))),
            *(self.mass[j][k] for j, k in upper),
            *(slope for _, _, slope in pushed),
        ]
        numbers = iter(at_certificate(values, wanted, equations))
        with localcontext(DECIMALS):
            residuals = [-x for x in islice(numbers, self._n)]
            a = list(islice(numbers, self._n))
            pushes = list(islice(numbers, len(equations.system.pushing)))
            for (j, k), inertia in zip(upper, numbers, strict=False):
                residuals[j] += inertia * a[k]
                if j != k:
                    residuals[k] += inertia * a[j]
            for (j, number, _), slope in zip(pushed, numbers, strict=True):
                residuals[j] -= pushes[number] * slope
        pairs = zip(residuals, sources.residuals, strict=True)
        return all(abs(mpf(str(x)) - residual) <= _AGREE * size for x, (residual, size) in pairs)


def is_derivable(equations: Equations) -> bool:
    """Tell whether mass matrix and forcing are still those of a derivation without recursion."""
    sources = equations.derivation.sources
    is_current = sources is not None and sources.forcing is equations.system.forcing
    return sources is not None and is_current and sources.tree is None


#: Least number of operations of a collected term, which holds two velocities and a mass.
_LEAST_OF_TERM = 3

#: Difference that counts as rounding, relative to the terms: both forms differ in the order of
#: sums.
_ROUNDING = 1e-11


class DirectEnergy:
    """The energy function as a value of a graph.

    Attributes
    ----------
    values
        The graph.
    energy
        The value.
    operations_shown
        Least number of operations of the energy as it is shown.
    """

    def __init__(self, values: ValueGraph, equations: Equations) -> None:
        self.values, self._equations = values, equations
        self._terms = [*_of_particles(values, equations), *_of_others(values, equations)]
        self.energy = values.add(self._terms)
        self.operations_shown = _LEAST_OF_TERM * len(equations.system.energy.args)

    def agrees(self) -> bool:
        """Compare with the energy that is shown, at the state of the certificate, in doubles."""
        equations, sources = self._equations, self._equations.derivation.sources
        if sources is not None and equations.system.energy is sources.energy:
            shown = float(sources.energy_value)
            terms = at_certificate(self.values, self._terms, equations, digits=False)
        else:
            values = self.values.copy()
            wanted = [values.convert(equations.system.energy), *self._terms]
            shown, *terms = at_certificate(values, wanted, equations, digits=False)
        return bool(abs(sum(terms) - shown) <= _ROUNDING * sum(map(abs, terms)))


def _of_particles(values: ValueGraph, equations: Equations) -> Iterator[ScaledNode]:
    """Yield ½ m ((J q̇)² − (∂r/∂t)²) of each particle."""
    positions = [values.convert(r) for p in equations.system.particles for r in p.position]
    rates = {values.convert(c.q)[1]: {0: values.convert(c.v)} for c in equations.system.coordinates}
    time = {values.convert(equations.system.t)[1]: {0: UNIT}}
    half = Fraction(1, 2)
    squares = [
        scaled(product(values, tangent[0], tangent[0]), sign * half) if tangent else (0, 0)
        for sign, seeds in ((1, rates), (-1, time))
        for tangent in derivatives(values, positions, seeds)
    ]
    for k, particle in enumerate(equations.system.particles):
        axes = slice(3 * k, 3 * k + 3)
        square = values.add([*squares[axes], *squares[len(positions) :][axes]])
        yield product(values, values.convert(particle.mass), square)


def _of_others(values: ValueGraph, equations: Equations) -> Iterator[ScaledNode]:
    """Yield the terms of Σ q̇ ∂L'/∂q̇ − L'."""
    assert equations.derivation.sources is not None
    remainder = values.convert(equations.derivation.sources.other_lagrangian)
    velocities = [values.convert(c.v) for c in equations.system.coordinates]
    seeds = {number: {k: UNIT} for k, (_, number) in enumerate(velocities)}
    (momenta,) = derivatives(values, [remainder], seeds)
    for k, momentum in momenta.items():
        yield product(values, velocities[k], momentum)
    yield scaled(remainder, -1)
