"""The energy function for code, added up on the value graph from positions.

Collected, as it is shown, the kinetic energy of a chain has a term for each pair of links. As
Σ ½ m ṙ² over particles it has one for each of them, and no term is negative: with
ṙ = J q̇ + ∂r/∂t and L' the part of the Lagrangian that is no particle's,

    Σ q̇ ∂L/∂q̇ − L = Σ ½ m ((J q̇)² − (∂r/∂t)²) + Σ q̇ ∂L'/∂q̇ − L'.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.program.graph.derivatives import UNIT, derivatives, product, scaled
from lagrange_cli.program.systems.direct_derivation import at_certificate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.graph.value_graph import ScaledNode, ValueGraph

#: Operations of a collected term, at the least: it holds two velocities and a mass.
_LEAST_OF_TERM = 3

#: A difference that is rounding, relative to the terms: both forms are one but for their sums.
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
        Operations that the energy as it is shown takes at the least.
    """

    def __init__(self, values: ValueGraph, equations: Equations) -> None:
        self.values, self._equations = values, equations
        self._terms = [*_of_particles(values, equations), *_of_others(values, equations)]
        self.energy = values.add(self._terms)
        self.operations_shown = _LEAST_OF_TERM * len(equations.energy.args)

    def agrees(self) -> bool:
        """Compare with the energy that is shown, at the state of the certificate, in doubles."""
        equations, sources = self._equations, self._equations.sources
        if sources is not None and equations.energy is sources.energy:
            shown = float(sources.energy_value)
            terms = at_certificate(self.values, self._terms, equations, digits=False)
        else:
            values = self.values.copy()
            wanted = [values.convert(equations.energy), *self._terms]
            shown, *terms = at_certificate(values, wanted, equations, digits=False)
        return bool(abs(sum(terms) - shown) <= _ROUNDING * sum(map(abs, terms)))


def _of_particles(values: ValueGraph, equations: Equations) -> Iterator[ScaledNode]:
    """Yield ½ m ((J q̇)² − (∂r/∂t)²) of each particle."""
    positions = [values.convert(r) for p in equations.particles for r in p.position]
    rates = {values.convert(c.q)[1]: {0: values.convert(c.v)} for c in equations.coordinates}
    time = {values.convert(equations.t)[1]: {0: UNIT}}
    half = Fraction(1, 2)
    squares = [
        scaled(product(values, tangent[0], tangent[0]), sign * half) if tangent else (0, 0)
        for sign, seeds in ((1, rates), (-1, time))
        for tangent in derivatives(values, positions, seeds)
    ]
    for k, particle in enumerate(equations.particles):
        own = slice(3 * k, 3 * k + 3)
        square = values.add([*squares[own], *squares[len(positions) :][own]])
        yield product(values, values.convert(particle.mass), square)


def _of_others(values: ValueGraph, equations: Equations) -> Iterator[ScaledNode]:
    """Yield the terms of Σ q̇ ∂L'/∂q̇ − L'."""
    assert equations.sources is not None
    rest = values.convert(equations.sources.rest)
    velocities = [values.convert(c.v) for c in equations.coordinates]
    seeds = {number: {k: UNIT} for k, (_, number) in enumerate(velocities)}
    (momenta,) = derivatives(values, [rest], seeds)
    for k, momentum in momenta.items():
        yield product(values, velocities[k], momentum)
    yield scaled(rest, -1)
