"""Generalized forces by virtual work, and d'Alembert's principle part by part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import sympy as sp

from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.step_values import BodySteps, ForceSteps, VirtualWork
from lagrange_cli.mechanics.steps.collected_steps import Collector

_ZERO = sp.Integer(0)


def force_steps(derivation: Uncertified, collector: Collector) -> tuple[ForceSteps, ...]:
    """The virtual work of each force of the scene."""
    names = derivation.reduced.names
    bodies = dict(zip((b.name for b in names.bodies), names.body_symbols, strict=True))
    coordinates = [c.q for c in derivation.reduced.coordinates]
    steps = []
    for force in derivation.forces:
        along = [force.on]
        if len(force.components) == 3:
            along = [s.name for s in bodies[force.on]]
        components = zip(along, force.components, strict=True)
        generalized = zip(coordinates, map(collector.collected, force.generalized), strict=True)
        steps.append(
            ForceSteps(
                force.name,
                force.on,
                tuple((name, component) for name, component in components if component != 0),
                tuple((q, work) for q, work in generalized if work != 0),
            )
        )
    return tuple(steps)


def virtual_work(
    derivation: Uncertified,
    collector: Collector,
    bodies: Sequence[BodySteps],
    applied: Mapping[sp.Symbol, sp.Expr],
) -> Iterator[VirtualWork]:
    """Parts of Σ (m r̈ − F)·∂r/∂q for each coordinate."""
    cartesian = set(derivation.reduced.names.cartesian.values())
    for c in derivation.reduced.coordinates:
        inertia, work = [], []
        for body in bodies:
            for part in body.components:
                slope = dict(part.partials).get(c.q, _ZERO)
                inertia.append((body.mass or _ZERO) * part.acceleration * slope)
                work.append(part.force * slope)
        alone = _ZERO if c.q in cartesian else -applied.get(c.q, _ZERO)
        yield VirtualWork(
            collector.collected(sp.Add(*inertia)),
            collector.collected(sp.Add(*work)),
            collector.collected(alone),
        )
