"""States of first order as coordinates beside the others, where rest and small motions are sought.

At rest the rates of states vanish as forces do. So a state becomes a coordinate whose force is its
rate, with inertia 1: equilibria, their existence and their uniqueness are then those of forces. The
motion of such a coordinate is of first order all the same, which :mod:`.linear.first_order` knows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.system import BodyForce, Coordinate, InitialState, Input

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure, State, System


def with_state_coordinates(equations: Equations) -> Equations:
    """Return the equations with states of first order as coordinates behind the others, and states
    of two values as inputs."""
    equations = _with_held_switches(equations)
    system = equations.system
    if not system.states:
        return equations
    n, k = system.layout.coordinates, system.layout.states
    rows = [dict(entries(row).items()) for row in system.mass_matrix]
    rows += [{n + j: sp.S.One} for j in range(k)]
    forces = [replace(f, generalized=(*f.generalized, *[sp.S.Zero] * k)) for f in system.forces]
    for j, state in enumerate(system.states, n):
        along = tuple(state.rate if i == j else sp.S.Zero for i in range(n + k))
        forces.append(BodyForce(state.name, state.name, (state.rate,), along))
    closures = tuple(_wider(closure, n + k) for closure in system.closures)
    return replace(
        equations,
        system=replace(
            system,
            coordinates=(*system.coordinates, *map(_coordinate, system.states)),
            mass_matrix=tuple(ExpressionRow(n + k, row) for row in rows),
            forcing=(*system.forcing, *(state.rate for state in system.states)),
            forces=tuple(forces),
            closures=closures,
            initial=_start(system),
            states=(),
        ),
    )


def _with_held_switches(equations: Equations) -> Equations:
    """Return the equations with states of two values as inputs that are what they are at first."""
    system = equations.system
    if all(state.switch is None for state in system.states):
        return equations
    initial = system.initial
    starts = (0.0,) * len(system.states) if initial is None else initial.states
    switches = tuple(
        Input(state.name, state.symbol, sp.Integer(round(start)))
        for state, start in zip(system.states, starts, strict=True)
        if state.switch is not None
    )
    others = [k for k, state in enumerate(system.states) if state.switch is None]
    if initial is not None:
        first = 2 * len(system.coordinates)
        behind = tuple(initial.decimals[first + k] for k in others) if initial.decimals else ()
        initial = replace(
            initial,
            states=tuple(initial.states[k] for k in others),
            decimals=(*initial.decimals[:first], *behind),
        )
    states = tuple(system.states[k] for k in others)
    inputs = (*system.inputs, *switches)
    return replace(equations, system=replace(system, states=states, inputs=inputs, initial=initial))


def _coordinate(state: State) -> Coordinate:
    v, a = (sp.Dummy(f"{tag}_{state.name}", real=True) for tag in "va")
    return Coordinate(
        state.name,
        state.symbol,
        v,
        a,
        unit=state.unit,
        description=state.description,
        latex=state.latex,
    )


def _wider(closure: Closure, size: int) -> Closure:
    return replace(closure, gradient=ExpressionRow(size, dict(entries(closure.gradient))))


def _start(system: System) -> InitialState | None:
    """Return the start with states among the positions, whose rates count as nothing."""
    initial, layout = system.initial, system.layout
    if initial is None:
        return None
    none, decimals = (0.0,) * layout.states, initial.decimals
    if decimals:
        parts = layout.positions, layout.first_order, layout.velocities
        decimals = (*(x for part in parts for x in decimals[part]), *map(str, none))
    positions, velocities = (*initial.positions, *initial.states), (*initial.velocities, *none)
    return InitialState(positions, velocities, initial.projected, decimals)
