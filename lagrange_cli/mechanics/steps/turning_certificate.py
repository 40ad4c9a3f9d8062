"""Lines of the turning of one body beside values from R along the motion alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TypeAlias

import sympy as sp

from lagrange_cli.mechanics.certify.routes import Observation, Tapes
from lagrange_cli.mechanics.numerics.autodiff import DecimalRun, evaluate_in_decimals
from lagrange_cli.mechanics.step_values import (
    Displacement,
    ForceSteps,
    TurningSteps,
    VirtualWork,
    rate_symbol,
    spin_symbol,
)
from lagrange_cli.mechanics.system import BodyForce

#: A line, and its value by another route.
ComparedLine: TypeAlias = "tuple[sp.Expr, Decimal]"
#: Parts of d'Alembert's principle, each with the values of its displacement's rates.
MovedParts: TypeAlias = "Sequence[tuple[VirtualWork, list[Decimal]]]"

_ZERO, _ONE = Decimal(0), Decimal(1)
_NONE = sp.Integer(0)


class TurningCheck:
    """The turning of one body at a state."""

    def __init__(
        self,
        tapes: Tapes,
        name: str,
        steps: TurningSteps,
        forces: Sequence[tuple[BodyForce, ForceSteps]],
        seen: Observation,
        run: DecimalRun,
    ) -> None:
        self.name, self.steps = name, steps
        element, places, constants = tapes.turned_at(name, seen.series)
        outputs = [run.outputs[k] for k in places]
        self.values = element.turning(outputs[3:], constants[1:])
        self.energy = element.kinetic_terms(outputs, constants)[3]
        slopes = [run.gradient({k: _ONE}) for k in places[3:]]
        variables = [tapes.t, *tapes.q]
        self.partials = {
            s: self.values.spin_by([by[k] for by in slopes]) for k, s in enumerate(variables)
        }
        self.torques = [
            (written, self.values.along_axes(evaluate_in_decimals(list(f.components), seen.point)))
            for f, written in forces
            if f.is_torque and f.on == name
        ]
        self.q = tapes.q

    def _component(self, direction: Sequence[int], vector: Sequence[Decimal]) -> Decimal:
        """A component of a vector along the axes of the body."""
        if self.steps.axes == "space":
            vector = self.values.along_space(vector)
        return sum((d * x for d, x in zip(direction, vector, strict=True)), _ZERO)

    def _turns(self, direction: Sequence[int]) -> dict[sp.Symbol, Decimal]:
        """∂ω/∂q̇ along a direction for each coordinate."""
        return {s: self._component(direction, slope) for s, slope in self.partials.items()}

    def spins(self) -> dict[sp.Symbol, Decimal]:
        """Components of ω, and their rates, by their symbols."""
        spins: dict[sp.Symbol, Decimal] = {}
        for c in self.steps.components:
            s = spin_symbol(self.name, c.axis)
            spins[s] = self._component(c.direction, self.values.spin)
            spins[rate_symbol(s.name)] = self._component(c.direction, self.values.change)
        return spins

    def lines(self, moved: MovedParts) -> Iterator[ComparedLine]:
        yield self.steps.energy, self.energy
        for c in self.steps.components:
            inertia = self._component(c.direction, self.values.torque)
            yield c.law, inertia
            yield c.inertia, inertia
            yield c.spin, self._component(c.direction, self.values.spin)
            yield c.rate, self._component(c.direction, self.values.change)
            partials = dict(c.partials)
            for s, slope in self.partials.items():
                # Slopes that vanish are compared with 1, the size of the axes of the body.
                size = 0 if s in partials else 1
                yield partials.get(s, _NONE) + size, self._component(c.direction, slope) + size
            turns, by_displacement = self._turns(c.direction), dict(c.slopes)
            for parts, rates in moved:
                written = by_displacement.get(parts.displacement.symbol, _NONE)
                yield written + 1, along(parts.displacement, rates, turns) + 1
            torques = [self._component(c.direction, m) for _, m in self.torques]
            yield c.torque, sum(torques, _ZERO)
            for (force, _), value in zip(self.torques, torques, strict=True):
                yield dict(force.components).get(c.axis, _NONE), value
        for force, torque in self.torques:
            for s in self.q:
                work = sum((m * x for m, x in zip(torque, self.partials[s], strict=True)), _ZERO)
                yield dict(force.generalized).get(s, _NONE), work


def along(
    one: Displacement, rates: Sequence[Decimal], by_coordinate: Mapping[sp.Symbol, Decimal]
) -> Decimal:
    """Σ ∂q/∂ε e_q of a displacement whose rates have these values."""
    pairs = zip(one.rates, rates, strict=True)
    return sum((g * by_coordinate[q] for (q, _), g in pairs), _ZERO)
