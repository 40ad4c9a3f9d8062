"""Tapes of the derived equations and of the two routes that check them.

All numbers are decimals: methods are called within :func:`.elementary.in_decimals`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.arithmetic import negative, plain_sum
from lagrange_cli.mechanics.algebra.substitution import at_rest
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.potential_forces import raw_terms
from lagrange_cli.mechanics.elements.body import BodyElement
from lagrange_cli.mechanics.elements.particle import MassElement
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DecimalRun, DomainError, Jet, Tape
from lagrange_cli.mechanics.numerics.elementary import DecimalValues
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.system import BodyForce

_ZERO, _ONE = Decimal(0), Decimal(1)
_CONSTANT: Jet = (_ONE, _ZERO, _ZERO)
#: The energy where there is none: it equals no other number.
_NO_ENERGY = Decimal("1e999")


@dataclass(frozen=True)
class Observation:
    """Values of a derivation at one state.

    Attributes
    ----------
    point
        The state.
    series
        Symbol → its Taylor series along the motion.
    forces
        Generalized forces Q.
    values
        Values of L, T and V.
    gradient
        The derivatives of L, each with its rate along the motion.
    magnitude
        Decimal exponent of the largest number on the way to L.
    """

    point: DecimalValues
    series: Mapping[sp.Symbol, Jet]
    forces: list[Decimal]
    values: list[Decimal]
    gradient: list[tuple[Decimal, Decimal]]
    magnitude: int


class Tapes:
    """The tapes of one derivation; states give t, q, v, a, parameters and inputs."""

    def __init__(self, derivation: Uncertified) -> None:
        reduced = derivation.reduced
        self.reduced = reduced
        self.t = reduced.names.t
        self.q = [c.q for c in reduced.coordinates]
        self.v = [c.v for c in reduced.coordinates]
        self.a = [c.a for c in reduced.coordinates]
        self.n = len(self.q)
        self.number = {q: j for j, q in enumerate(self.q)}
        self.parameters = [*reduced.names.parameters.values(), *reduced.names.external_symbols]
        self.still = [self.t, *self.q, *self.parameters]
        self.moving = [self.t, *self.q, *self.v, *self.parameters]
        self.inertia = derivation.inertia
        self.derived = Tape([*self.inertia.parts, *derivation.forcing_sums], self.moving)
        lagrangian = derivation.lagrangian
        shown = [lagrangian, derivation.kinetic, derivation.potential]
        self.lagrangian = Tape(shown, self.moving)
        self._newton_tapes(derivation)
        self._declared_tapes(derivation)

    def _newton_tapes(self, derivation: Uncertified) -> None:
        reduced = self.reduced
        self.symbols = list(reduced.resolved)
        number = {s: k for k, s in enumerate(self.symbols)}
        self.components = [number[s] for body in reduced.names.particle_symbols for s in body]
        self.elements = reduced.elements
        places = [reduced.resolved[s] for s in self.symbols]
        #: Numbers of the outputs of ``positions`` whose motion each element follows.
        self.places: list[list[int]] = []
        for element in self.elements:
            further = [reduced.resolve(e) for e in element.places if e not in number]
            fresh = iter(range(len(places), len(places) + len(further)))
            self.places.append([number[e] if e in number else next(fresh) for e in element.places])
            places += further
        self.positions = Tape(places, self.still)
        self.constants = Tape([c for e in self.elements for c in e.constants], self.parameters)
        self.terms = raw_terms(reduced)
        self.raw = [*self.symbols, *(q for q in self.q if q not in number)]
        self.potential = Tape(
            [plain_sum(self.terms.positional)], [*self.raw, self.t, *self.parameters]
        )
        extra = sp.Add(derivation.extra, *map(negative, self.terms.turning))
        self.extra = Tape([extra], self.moving)
        self.dissipation = Tape([derivation.dissipation], self.moving)
        self.forces = derivation.forces
        self.dissipates = derivation.dissipation != 0
        self.force_values = Tape([c for f in self.forces for c in f.components], self.moving)
        bodies = {
            body.name: [number[s] for s in symbols]
            for body, symbols in zip(reduced.names.bodies, reduced.names.body_symbols, strict=True)
        }
        rows = {c.name: [-1 - j] for j, c in enumerate(reduced.coordinates)}
        self.targets = [(bodies if len(f.components) == 3 else rows)[f.on] for f in self.forces]
        self.turned = {
            e.name: (e, places)
            for e, places in zip(self.elements, self.places, strict=True)
            if isinstance(e, BodyElement)
        }

    def _declared_tapes(self, derivation: Uncertified) -> None:
        """Tapes of values that the scene declares or geometry implies, and of those reported."""
        self.declared = Tape(
            [sp.Add(*self.terms.declared), sp.Add(*self.terms.velocity_dependent)], self.moving
        )
        number = {s: k for k, s in enumerate(self.symbols)}
        moved = [(s, v) for s, v in derivation.velocity.items() if s in number]
        self.moved = [number[s] for s, _ in moved]
        placed = derivation.position
        self.placed = [number[s] for s in placed]
        work = [sp.Add(*(f.generalized[j] for f in self.forces)) for j in range(self.n)]
        self.reported = Tape([*(v for _, v in moved), *placed.values(), *work], self.moving)
        potential = derivation.potential
        self.at_rest: Tape | None = None
        self.resting = symbols_in(potential).isdisjoint(self.v)
        if not self.resting:
            value = at_rest(potential, self.v)
            if value is not None:
                self.at_rest = Tape([value], self.still)

    # Evaluations at one state (q, v, a, t, parameters).

    def derived_parts(self, point: DecimalValues) -> tuple[list[dict[int, Decimal]], list[Decimal]]:
        """M, by rows without zeros, and f at a state."""
        values = self.derived.run_in_decimals(
            [(point[s], _ZERO, _ZERO) for s in self.moving], 0
        ).values
        count = len(self.inertia.parts)
        mass: list[dict[int, Decimal]] = [{} for _ in range(self.n)]
        for (j, k), value in self.inertia.numbers(values[:count]).items():
            mass[j][k] = mass[k][j] = value
        return mass, values[count:]

    def series(self, point: DecimalValues) -> dict[sp.Symbol, Jet]:
        """t, q, v and parameters along the motion with the state's accelerations."""
        series: dict[sp.Symbol, Jet] = {self.t: (point[self.t], _ONE, _ZERO)}
        for q, v, a in zip(self.q, self.v, self.a, strict=True):
            series[q] = (point[q], point[v], point[a])
            series[v] = (point[v], point[a], _ZERO)
        for p in self.parameters:
            series[p] = (point[p], _ZERO, _ZERO)
        return series

    def work(self, series: Mapping[sp.Symbol, Jet]) -> list[tuple[Decimal, Decimal]]:
        """Generalized forces of ``forces`` by virtual work, each with the size of its parts."""
        totals, sizes = [_ZERO] * self.n, [_ZERO] * self.n
        if not self.forces:
            return list(zip(totals, sizes, strict=True))
        run = self.positions.run_in_decimals([series[s] for s in self.still], 0)
        for works in self.works(series, run):
            for parts in works:
                totals = [f + x for f, x in zip(totals, parts, strict=True)]
                sizes = [s + abs(x) for s, x in zip(sizes, parts, strict=True)]
        return list(zip(totals, sizes, strict=True))

    def works(
        self, series: Mapping[sp.Symbol, Jet], run: DecimalRun
    ) -> Iterator[list[list[Decimal]]]:
        """Yield the generalized forces of the components of each force, of a torque as a whole."""
        if not self.forces:
            return
        pending = iter(
            self.force_values.run_in_decimals([series[s] for s in self.moving], 0).values
        )
        for force, targets in zip(self.forces, self.targets, strict=True):
            values = [next(pending) for _ in force.components]
            yield list(self._works(force, targets, values, run))

    def _works(
        self, force: BodyForce, targets: Sequence[int], values: Sequence[Decimal], run: DecimalRun
    ) -> Iterator[list[Decimal]]:
        """Yield the generalized forces of each component of a force; of a torque as a whole."""
        if force.is_torque:
            body, places = self.turned[force.on]
            seeds = body.work_of_torque(values, [run.values[k] for k in places])
            yield run.gradient(dict(zip(places[3:], seeds, strict=True)))[1 : 1 + self.n]
            return
        for target, value in zip(targets, values, strict=True):
            if target < 0:
                yield [value if j == -1 - target else _ZERO for j in range(self.n)]
            else:
                yield run.gradient({target: value})[1 : 1 + self.n]

    def generalized_forces(self, series: Mapping[sp.Symbol, Jet]) -> list[Decimal]:
        """Q of forces and dissipation."""
        work = [w for w, _ in self.work(series)]
        if not self.dissipates:
            return work
        drag = self.dissipation.run_in_decimals([series[s] for s in self.moving], 0).gradient(
            {0: _ONE}
        )
        return [w - drag[1 + self.n + j] for j, w in enumerate(work)]

    def newton(
        self, series: Mapping[sp.Symbol, Jet], forces: Sequence[Decimal]
    ) -> list[tuple[Decimal, Decimal]]:
        """Σ (m r̈ − F)·∂r/∂q for each coordinate, with the size of its parts.

        Bodies turn by Euler's law. T_extra − U enters by its Euler–Lagrange expression.
        """
        run = self.positions.run_in_decimals([series[s] for s in self.still], 2)
        outputs = run.outputs
        seeds = self.inertial_forces(series, run)
        slopes = self.potential_slopes(series, outputs)
        direct = [_ZERO] * self.n
        for k, (s, slope) in enumerate(slopes.items()):
            if k < len(self.symbols):
                seeds[k] = seeds.get(k, _ZERO) + slope
            else:
                direct[self.number[s]] += slope
        work = run.gradient(seeds)
        extra = self._euler_lagrange(self.extra, series)
        parts = [(work[1 + j], direct[j], extra[j], -forces[j]) for j in range(self.n)]
        return [(sum(p, _ZERO), sum(map(abs, p), _ZERO)) for p in parts]

    def inertial_forces(
        self, series: Mapping[sp.Symbol, Jet], run: DecimalRun
    ) -> dict[int, Decimal]:
        """Forces of inertia by the number of the place that they act along.

        ``run``: that of the positions, with rates and accelerations.
        """
        outputs = run.outputs
        seeds: dict[int, Decimal] = {}
        for element, places, constants in self._elements_at(series):
            forces_of_inertia = element.inertial_forces([outputs[k] for k in places], constants)
            for k, force in zip(places, forces_of_inertia, strict=True):
                seeds[k] = seeds.get(k, _ZERO) + force
        return seeds

    def turned_at(
        self, name: str, series: Mapping[sp.Symbol, Jet]
    ) -> tuple[BodyElement, list[int], list[Decimal]]:
        """A rigid body with the numbers of its places, and the values of its constants."""
        (one,) = (
            (element, places, constants)
            for element, places, constants in self._elements_at(series)
            if isinstance(element, BodyElement) and element.name == name
        )
        return one

    def potential_slopes(
        self, series: Mapping[sp.Symbol, Jet], outputs: Sequence[Jet]
    ) -> dict[sp.Symbol, Decimal]:
        """∂V/∂s of Cartesian names, which have the values ``outputs``, and of coordinates."""
        inputs = self.raw_inputs(series, outputs)
        slope = self.potential.run_in_decimals(inputs, 0).gradient({0: _ONE})
        return dict(zip(self.raw, slope, strict=False))

    def _euler_lagrange(self, tape: Tape, series: Mapping[sp.Symbol, Jet]) -> list[Decimal]:
        """d/dt ∂L/∂q̇ − ∂L/∂q of the tape's first output."""
        gradient = tape.run_in_decimals([series[s] for s in self.moving], 1).moving_gradient()
        return [gradient[1 + self.n + j][1] - gradient[1 + j][0] for j in range(self.n)]

    def _elements_at(
        self, series: Mapping[sp.Symbol, Jet]
    ) -> Iterator[tuple[MassElement, list[int], list[Decimal]]]:
        """Yield each element with the numbers of its places, and the values of its constants."""
        parameters = [series[s] for s in self.parameters]
        values = iter(self.constants.run_in_decimals(parameters, 0).values)
        for element, places in zip(self.elements, self.places, strict=True):
            yield element, places, [next(values) for _ in element.constants]

    def mass_values(self, series: Mapping[sp.Symbol, Jet]) -> list[Decimal]:
        """Mass of each entry of ``components``."""
        return [m for _, _, (m, *_) in self._elements_at(series) for _ in range(3)]

    def raw_inputs(self, series: Mapping[sp.Symbol, Jet], outputs: Sequence[Jet]) -> list[Jet]:
        """``raw``, t and parameters, where Cartesian names have the values ``outputs``."""
        place = dict(zip(self.symbols, outputs, strict=False))
        raw = [place.get(s, series.get(s, _CONSTANT)) for s in self.raw]
        return [*raw, series[self.t], *(series[p] for p in self.parameters)]

    def reports(
        self, seen: Observation
    ) -> tuple[list[tuple[Decimal, Decimal]], list[tuple[Decimal, Decimal]]]:
        """Differences between what is reported and declared, each with the size of its parts.

        T and V, velocities and positions, as implied by the positions; then generalized forces by
        coordinates.
        """
        series = seen.series
        moving = [series[s] for s in self.moving]
        outputs = self.positions.run_in_decimals([series[s] for s in self.still], 1).outputs
        energies = [
            term
            for element, places, constants in self._elements_at(series)
            for term in element.kinetic_terms([outputs[k] for k in places], constants)
        ]
        kinetic, velocity_dependent = self.declared.run_in_decimals(moving, 0).values
        positional = self.potential.run_in_decimals(self.raw_inputs(series, outputs), 0).values[0]
        pairs = [
            (seen.values[1], sum(energies, kinetic)),
            (seen.values[2], positional + velocity_dependent),
        ]
        reported = self.reported.run_in_decimals(moving, 0).values
        motion = [
            *(outputs[k][1] for k in self.moved),
            *(outputs[k][0] for k in self.placed),
        ]
        pairs += zip(reported[: len(motion)], motion, strict=True)
        work = zip(reported[len(motion) :], self.work(series), strict=True)
        return (
            [(x - y, max(abs(x), abs(y))) for x, y in pairs],
            [(x - w, max(abs(x), size)) for x, (w, size) in work],
        )

    def observe(self, point: DecimalValues, order: int = 1) -> Observation:
        """Series, Q and the gradient of L at a state; of order 0 without rates along the motion."""
        series = self.series(point)
        run = self.lagrangian.run_in_decimals([series[s] for s in self.moving], order)
        forces, gradient = self.generalized_forces(series), run.moving_gradient()
        return Observation(point, series, forces, run.values, gradient, run.magnitude())

    def value(self, expression: sp.Expr, point: SymbolValues) -> mpf:
        """Evaluate an expression over t, q, v and parameters on the tape of L, in mpf."""
        inputs = [(point[s], mpf(0), mpf(0)) for s in self.moving]
        return self.lagrangian.value(expression, inputs)

    def energy_function(self, seen: Observation) -> tuple[Decimal, Decimal]:
        """Σ q̇ ∂L/∂q̇ − L, with the size of its terms."""
        momenta = self.momenta(seen)
        terms = [p[0] * seen.point[v] for p, v in zip(momenta, self.v, strict=True)]
        lagrangian = seen.values[0]
        return sum(terms, -lagrangian), sum(map(abs, terms), abs(lagrangian))

    def slopes(self, seen: Observation) -> list[tuple[Decimal, Decimal]]:
        """∂L/∂q."""
        return seen.gradient[1 : 1 + self.n]

    def momenta(self, seen: Observation) -> list[tuple[Decimal, Decimal]]:
        """∂L/∂q̇."""
        return seen.gradient[1 + self.n : 1 + 2 * self.n]

    def delicate(self, seen: Observation) -> list[Decimal]:
        """Numbers that the facts claim to vanish.

        ∂L/∂q, then Q, for each coordinate; the rate of the energy function
        Q·q̇ − ∂L/∂t; and its difference to T + V.
        """
        velocities = [seen.point[v] for v in self.v]
        rate = sum(
            (f * v for f, v in zip(seen.forces, velocities, strict=True)), -seen.gradient[0][0]
        )
        function, _ = self.energy_function(seen)
        slopes = [s[0] for s in self.slopes(seen)]
        return [*slopes, *seen.forces, rate, function - self._energy(seen)]

    def _energy(self, seen: Observation) -> Decimal:
        """T + V with V at rest; a huge number where V has no value at rest."""
        if self.resting:
            return seen.values[1] + seen.values[2]
        if self.at_rest is None:
            return _NO_ENERGY
        try:
            potential = self.at_rest.run_in_decimals(
                [seen.series[s] for s in self.still], 0
            ).values[0]
        except DomainError:
            return _NO_ENERGY
        return seen.values[1] + potential
