"""The motion of every particle and body over the coordinates."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.elements.motion import ElementMotion, Turning
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.bodies import Body
from lagrange_cli.scene.language.expression import Expression


def element_motions(derivation: Uncertified) -> Iterator[ElementMotion]:
    """Yield particles and bodies with their positions and velocities, in the scene's order."""
    reduced = derivation.reduced
    elements = zip(
        reduced.scene.particles, reduced.names.particle_symbols, reduced.masses, strict=True
    )
    for particle, (x, y, z), mass in elements:
        yield ElementMotion(
            name=particle.name,
            mass=mass,
            components=(x.name, y.name, z.name),
            position=(reduced.resolved[x], reduced.resolved[y], reduced.resolved[z]),
            velocity=(derivation.velocity[x], derivation.velocity[y], derivation.velocity[z]),
            latex=particle.latex,
            turning=_turning(reduced, particle) if isinstance(particle, Body) else None,
        )


def _turning(reduced: Reduced, body: Body) -> Turning:
    def placed(expression: Expression) -> sp.Expr:
        return reduced.resolve(reduced.convert(expression))

    x, y, z = map(placed, body.spin)
    turns = [
        (
            turn.axis if isinstance(turn.axis, str) else tuple(map(placed, turn.axis)),
            -placed(turn.angle) if turn.reverse else placed(turn.angle),
        )
        for turn in body.turns
    ]
    return Turning(
        rotation=tuple(map(placed, body.rotation)),
        spin=(x, y, z),
        inertia=tuple(placed(moment) for row in body.inertia for moment in row),
        on=body.on,
        turns=tuple(turns),
    )
