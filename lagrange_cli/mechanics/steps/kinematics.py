"""Positions, velocities by the chain rule, and accelerations of every particle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.step_values import BodySteps, ComponentSteps
from lagrange_cli.mechanics.steps.collected_steps import Collector
from lagrange_cli.mechanics.symbols.convert import total_derivative

_ZERO = sp.Integer(0)


def body_steps(
    derivation: Uncertified, collector: Collector, applied: Mapping[sp.Symbol, sp.Expr]
) -> tuple[BodySteps, ...]:
    """Steps of all particles, and of the points that forces act on.

    ``applied``: raw symbol → applied force along it.
    """
    return tuple(_bodies(derivation, collector, dict(applied)))


def _bodies(
    derivation: Uncertified, collector: Collector, pending: dict[sp.Symbol, sp.Expr]
) -> Iterator[BodySteps]:
    reduced = derivation.reduced
    names = reduced.names
    pulled = {force.on for force in derivation.forces}
    masses = [*reduced.masses, *(None for _ in names.point_symbols)]
    for body, symbols, mass in zip(names.bodies, names.body_symbols, masses, strict=True):
        if mass is None and body.name not in pulled and pending.keys().isdisjoint(symbols):
            continue
        x, y, z = (_component(reduced, collector, s, pending.pop(s, _ZERO)) for s in symbols)
        square = None
        if mass is not None:
            square = collector.collected(x.velocity**2 + y.velocity**2 + z.velocity**2)
        yield BodySteps(body.name, mass, (x, y, z), square)


def _component(
    reduced: Reduced, collector: Collector, symbol: sp.Symbol, force: sp.Expr
) -> ComponentSteps:
    position, t = reduced.resolved[symbol], reduced.names.t
    partials = [
        (s, collector.collected(derivative(position, s)))
        for s in (*(c.q for c in reduced.coordinates), t)
    ]
    kept = tuple((s, slope) for s, slope in partials if slope != 0)
    rates = {c.q: c.v for c in reduced.coordinates}
    velocity = collector.collected(sp.Add(*(slope * rates.get(s, 1) for s, slope in kept)))
    return ComponentSteps(
        name=symbol.name,
        position=position,
        partials=kept,
        velocity=velocity,
        acceleration=collector.collected(along_motion(reduced, velocity)),
        force=collector.collected(force),
    )


def along_motion(reduced: Reduced, expr: sp.Expr) -> sp.Expr:
    """The total time derivative of an expression over q, v, t."""
    chain = [(c.q, c.v) for c in reduced.coordinates] + [(c.v, c.a) for c in reduced.coordinates]
    return total_derivative(expr, reduced.names.t, chain)
