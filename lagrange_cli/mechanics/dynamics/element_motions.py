"""The motion of every particle and body over the coordinates."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import plain_sum
from lagrange_cli.mechanics.depiction import BodyOutline
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.elements.motion import ElementMotion, QuaternionParts, Turning
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.bodies import AnyTurn, Body, QuaternionTurn, Shape
from lagrange_cli.scene.language.expression import Expression

_Triple: TypeAlias = tuple[sp.Expr, sp.Expr, sp.Expr]

_ZERO = sp.Integer(0)


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


def body_outlines(reduced: Reduced, motions: Iterable[ElementMotion]) -> Iterator[BodyOutline]:
    """Yield what the rigid bodies of a scene are drawn by.

    A body whose inertia is given by moments has the shape with which it touches a surface.
    """
    joints = (constraint.joint for constraint in reduced.scene.constraints)
    touching = {
        joint.parts[0]: Shape(*joint.round, joint.radii[:1])
        for joint in joints
        if joint is not None and joint.round is not None
    }
    for body, motion in zip(reduced.scene.particles, motions, strict=True):
        if not isinstance(body, Body) or motion.turning is None:
            continue

        def in_space(vector: Sequence[sp.Expr], turning: Turning = motion.turning) -> _Triple:
            rows = (turning.rotation[k : k + 3] for k in (0, 3, 6))
            x, y, z = (
                # SymPy would ask whether a long entry times zero is finite.
                plain_sum(r * v for r, v in zip(row, vector, strict=True) if v != 0)
                for row in rows
            )
            return x, y, z

        centre = [_value(reduced, part) for part in body.centre or ()]
        back = in_space([-part for part in centre]) if centre else (_ZERO, _ZERO, _ZERO)
        x, y, z = map(plain_sum, zip(motion.position, back, strict=True))
        shape = body.shape or (touching.get(body.name) if body.centre is None else None)
        spans = () if shape is None else tuple(map(in_space, _spans(reduced, shape)))
        kind = None if shape is None else shape.kind
        yield BodyOutline(body.name, kind, spans, (x, y, z), body.base)


def _spans(reduced: Reduced, shape: Shape) -> Iterator[tuple[sp.Expr, ...]]:
    """Yield half extents of a shape in the body's axes, as :class:`BodyOutline` has them."""
    sizes = [_value(reduced, size) for size in shape.sizes]
    around = ((shape.axis + 1) % 3, (shape.axis + 2) % 3)
    if shape.kind == "rod":
        extents = [(shape.axis, sizes[0] / 2)]
    elif shape.kind == "box":
        extents = [(k, size / 2) for k, size in enumerate(sizes)]
    elif shape.kind == "sphere":
        extents = [(k, sizes[0]) for k in (*around, shape.axis)]
    else:
        extents = [(k, sizes[0]) for k in around]
        extents += [(shape.axis, height / 2) for height in sizes[1:]]
    for axis, extent in extents:
        yield tuple(extent if k == axis else _ZERO for k in range(3))


def _value(reduced: Reduced, expression: Expression) -> sp.Expr:
    return reduced.resolve(reduced.convert(expression))


def _turning(reduced: Reduced, body: Body) -> Turning:
    def placed(expression: Expression) -> sp.Expr:
        return _value(reduced, expression)

    x, y, z = map(placed, body.spin)

    def turned(turn: AnyTurn) -> tuple[str | tuple[sp.Expr, ...], sp.Expr] | QuaternionParts:
        if isinstance(turn, QuaternionTurn):
            return QuaternionParts(tuple(map(placed, turn.parts)))
        axis = turn.axis if isinstance(turn.axis, str) else tuple(map(placed, turn.axis))
        return axis, -placed(turn.angle) if turn.reverse else placed(turn.angle)

    return Turning(
        rotation=tuple(map(placed, body.rotation)),
        spin=(x, y, z),
        inertia=tuple(placed(moment) for row in body.inertia for moment in row),
        on=body.on,
        turns=tuple(map(turned, body.turns)),
    )
