"""Virtual displacements, and the parts of d'Alembert's principle for each of them.

Coordinates are displaced one by one. The four parts of a quaternion q of length 1 are not: its
body turns by small angles δφ about its own axes, δq = ½ q ∘ δφ, in which q keeps its length and
the multiplier of that does no work. Parts along such a turn are written over ω by
q̇ = ½ q ∘ ω and q̈ = ½ q ∘ ω̇ − ¼ ω² q, and by |q| = 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.dynamics.euler_form import (
    lone_quaternion,
    on_unit_sphere,
    rates_of_quaternion,
)
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.step_values import (
    BodySteps,
    Displacement,
    VirtualWork,
    moment_symbol,
    rate_symbol,
    spin_symbol,
)
from lagrange_cli.mechanics.steps.collector import Collector, along_motion
from lagrange_cli.mechanics.steps.turning_steps import turning_energy
from lagrange_cli.mechanics.system import Coordinate
from lagrange_cli.scene.bodies import bodies_of

_ZERO = sp.Integer(0)

#: Terms that a part along a small turn may be multiplied out to; a longer one stays in q and q̇.
_TERM_BUDGET = 4000


def quaternions(reduced: Reduced) -> dict[str, tuple[Coordinate, ...]]:
    """Bodies that a quaternion turns, with its four parts."""
    coordinates = {c.q: c for c in reduced.coordinates}
    turned = {}
    for body in bodies_of(reduced.scene):
        parts = [reduced.names.convert(part) for part in lone_quaternion(body)]
        if parts:
            turned[body.name] = tuple(coordinates[part] for part in parts)
    return turned


@dataclass(frozen=True)
class Displacements:
    """The virtual displacements of a scene.

    Attributes
    ----------
    reduced, collector
        The scene, and what gathers terms.
    """

    reduced: Reduced
    collector: Collector

    @cached_property
    def quaternions(self) -> dict[str, tuple[Coordinate, ...]]:
        """Bodies that a quaternion turns, with its four parts."""
        return quaternions(self.reduced)

    @cached_property
    def all(self) -> tuple[Displacement, ...]:
        """One of each coordinate, and three small turns in place of the parts of a quaternion."""
        body_of = {c.q: body for body, parts in self.quaternions.items() for c in parts}
        displacements = list[Displacement]()
        for c in self.reduced.coordinates:
            body = body_of.get(c.q)
            if body is None:
                displacements.append(Displacement(c.name, "", ((c.q, sp.Integer(1)),)))
            elif c is self.quaternions[body][0]:
                parts = [part.q for part in self.quaternions[body]]
                for axis, rates in zip("123", rates_of_quaternion(parts), strict=True):
                    displacements.append(
                        Displacement(body, axis, tuple(zip(parts, rates, strict=True)))
                    )
        return tuple(displacements)

    def of_body(self, body: BodySteps) -> BodySteps:
        """Return a body with its places and turns by the displacements."""
        x, y, z = (replace(p, slopes=tuple(self._slopes(p.partials))) for p in body.components)
        turning = body.turning
        if turning is not None:
            spins = (replace(c, slopes=tuple(self._slopes(c.partials))) for c in turning.components)
            turning = replace(turning, components=tuple(spins))
        return replace(body, components=(x, y, z), turning=turning)

    def _slopes(
        self, partials: Sequence[tuple[sp.Symbol, sp.Expr]]
    ) -> Iterator[tuple[sp.Symbol, sp.Expr]]:
        slopes = dict(partials)
        for one in self.all:
            slope = self.along(one, slopes)
            if slope != 0:
                yield one.symbol, slope

    def along(self, one: Displacement, by_coordinate: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
        """Return Σ ∂q/∂ε e_q, shortened along a small turn."""
        terms = [g * by_coordinate[q] for q, g in one.rates if q in by_coordinate]
        return self.shortened(one, sp.Add(*terms)) if one.axis else sp.Add(*terms)

    def shortened(self, one: Displacement, expr: sp.Expr) -> sp.Expr:
        """Collect an expression; along a small turn it is written over ω first, by |q| = 1."""
        if one.axis:
            expr = self._over_spins(expr)
        return self.collector.collected(expr)

    def _over_spins(self, expr: sp.Expr) -> sp.Expr:
        for body, parts in self.quaternions.items():
            over = expr.xreplace(self._rates[body])
            expr = on_unit_sphere(over, [c.q for c in parts], _TERM_BUDGET) or expr
        return expr

    @cached_property
    def _rates(self) -> dict[str, dict[sp.Symbol, sp.Expr]]:
        """Body → q̇ and q̈ of its quaternion over ω and ω̇."""
        return {body: dict(_over_spin(body, parts)) for body, parts in self.quaternions.items()}


def _over_spin(body: str, parts: Sequence[Coordinate]) -> Iterator[tuple[sp.Symbol, sp.Expr]]:
    spins = [spin_symbol(body, axis) for axis in "123"]
    quarter = sp.Add(*(s**2 for s in spins)) / 4
    steps = rates_of_quaternion([c.q for c in parts])
    for c, slopes in zip(parts, zip(*steps, strict=True), strict=True):
        pairs = list(zip(slopes, spins, strict=True))
        yield c.v, sp.Add(*(g * s for g, s in pairs))
        yield c.a, sp.Add(*(g * rate_symbol(s.name) for g, s in pairs), -quarter * c.q)


def virtual_work(
    derivation: Uncertified,
    displacements: Displacements,
    bodies: Sequence[BodySteps],
    applied: Mapping[sp.Symbol, sp.Expr],
) -> Iterator[VirtualWork]:
    """Parts of Σ (m r̈ − F)·∂r/∂ε + Σ (L̇ − M)·∂ω/∂ε̇ for each displacement ε.

    ``applied``: raw symbol → applied force along it.
    """
    cartesian = set(derivation.reduced.names.cartesian.values())
    alone = {c.q: -applied.get(c.q, _ZERO) for c in derivation.reduced.coordinates}
    alone = {q: force for q, force in alone.items() if q not in cartesian}
    energies = _energies(bodies)
    moments = {
        moment_symbol(body.name, name): moment
        for body in bodies
        for name, moment in (body.turning.moments if body.turning else ())
    }
    for one in displacements.all:
        inertia, work, turning, torques = _works(displacements, one, bodies)
        shortened = partial(displacements.shortened, one)
        if not one.axis:
            inertia, turning = (
                _by_energy(displacements, one, sum_of_works, energy)
                for sum_of_works, energy in zip((inertia, turning), energies, strict=True)
            )
        parts = VirtualWork(
            one,
            shortened(inertia),
            shortened(work),
            shortened(turning),
            shortened(torques),
            displacements.along(one, alone),
        )
        if one.axis:
            whole = displacements.collector.products(shortened(parts.coefficient.xreplace(moments)))
            parts = replace(parts, terms=(*whole, *_pushes(derivation, displacements, one)))
        yield parts


def _works(
    displacements: Displacements, one: Displacement, bodies: Sequence[BodySteps]
) -> tuple[sp.Expr, sp.Expr, sp.Expr, sp.Expr]:
    """Σ m r̈·∂r/∂ε, Σ F·∂r/∂ε, Σ L̇·∂ω/∂ε̇ and Σ M·∂ω/∂ε̇."""
    inertia, work, turning, torques = [], [], [], []
    for body in bodies:
        for part in body.components:
            slope = dict(part.slopes).get(one.symbol, _ZERO)
            acceleration = part.acceleration
            if one.axis and slope != 0:
                # Shorter before it is multiplied out.
                acceleration = displacements.shortened(one, acceleration)
            inertia.append((body.mass or _ZERO) * acceleration * slope)
            work.append(part.force * slope)
        for spin in body.turning.components if body.turning else ():
            slope = dict(spin.slopes).get(one.symbol, _ZERO)
            turning.append((spin.law if one.axis else spin.inertia) * slope)
            torques.append(spin.torque * slope)
    return sp.Add(*inertia), sp.Add(*work), sp.Add(*turning), sp.Add(*torques)


def _pushes(
    derivation: Uncertified, displacements: Displacements, one: Displacement
) -> Iterator[tuple[sp.Expr, sp.Expr]]:
    """Yield the forces of multipliers along a small turn, less those that keep lengths."""
    reduced = derivation.reduced
    lengths = reduced.scene.lengths
    for closure in derivation.pushing:
        gradient = {reduced.coordinates[k].q: e for k, e in entries(closure.gradient).items()}
        slope = _ZERO if closure.constraint in lengths else displacements.along(one, gradient)
        if slope != 0:
            yield -slope, closure.multiplier


def _energies(bodies: Sequence[BodySteps]) -> tuple[sp.Expr | None, sp.Expr | None]:
    """½ m v² of bodies and ½ ω·Iω, where there are any that turn."""
    turning = [body for body in bodies if body.turning is not None]
    if not turning:
        return None, None
    squares = [(body.mass or _ZERO) * (body.square or _ZERO) / 2 for body in bodies]
    return sp.Add(*squares), sp.Add(*map(turning_energy, turning))


def _by_energy(
    displacements: Displacements, one: Displacement, work: sp.Expr, energy: sp.Expr | None
) -> sp.Expr:
    """Return the shorter of the work of inertia and d/dt ∂T/∂v − ∂T/∂q of its energy, if known.

    Squares of sines and cosines add up in T before they are differentiated.
    """
    collected = displacements.collector.collected
    summed = collected(work)
    if energy is None:
        return summed
    (c,) = (c for c in displacements.reduced.coordinates if c.name == one.name)
    rate = along_motion(displacements.reduced, derivative(energy, c.v))
    lagrange = collected(rate - derivative(energy, c.q))
    return min(summed, lagrange, key=lambda e: int(e.count_ops()))
