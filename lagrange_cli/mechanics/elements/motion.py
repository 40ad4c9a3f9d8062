"""Motions of what carries mass, particles and rigid bodies, as frozen values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sympy import Expr


@dataclass(frozen=True)
class QuaternionParts:
    """A turn by a quaternion of length 1; its four parts, that of the scalar first."""

    parts: tuple[Expr, ...]


@dataclass(frozen=True)
class Turning:
    """The turning of a rigid body.

    Attributes
    ----------
    rotation
        Entries of R(q, t) by rows: its columns are the axes of the body in those of space.
    spin
        ω(q, v, t) along the axes of the body.
    inertia
        Entries of the tensor of inertia about the centre of mass, by rows.
    on
        Name of the frame or body that it turns against, None for space.
    turns
        Axes, ``x``, ``y``, ``z`` or components of a direction, each with the angle about it; or a
        quaternion.
    """

    rotation: tuple[Expr, ...]
    spin: tuple[Expr, Expr, Expr]
    inertia: tuple[Expr, ...]
    on: str | None
    turns: tuple[tuple[str | tuple[Expr, ...], Expr] | QuaternionParts, ...]

    def rewritten(self, put: Callable[[Expr], Expr]) -> Turning:
        """Apply a function to all its expressions."""
        x, y, z = map(put, self.spin)
        turns = [
            QuaternionParts(tuple(map(put, turn.parts)))
            if isinstance(turn, QuaternionParts)
            else (turn[0] if isinstance(turn[0], str) else tuple(map(put, turn[0])), put(turn[1]))
            for turn in self.turns
        ]
        return replace(
            self,
            rotation=tuple(map(put, self.rotation)),
            spin=(x, y, z),
            inertia=tuple(map(put, self.inertia)),
            turns=tuple(turns),
        )

    @property
    def spin_in_space(self) -> tuple[Expr, ...]:
        """ω along the axes of space."""
        return tuple(_times(self.rotation, self.spin))


@dataclass(frozen=True)
class ElementMotion:
    """A particle, or a rigid body at its centre of mass, and its motion.

    Attributes
    ----------
    name, mass
        Its name and its mass.
    components
        Names of its x, y and z.
    position, velocity
        r(q, t) and ṙ(q, v, t), each along x, y, z.
    latex
        LaTeX of the scene, None if absent.
    turning
        The turning of a body, None of a particle.
    """

    name: str
    mass: Expr
    components: tuple[str, str, str]
    position: tuple[Expr, Expr, Expr]
    velocity: tuple[Expr, Expr, Expr]
    latex: str | None = None
    turning: Turning | None = None

    def rewritten(self, put: Callable[[Expr], Expr]) -> ElementMotion:
        """Apply a function to all its expressions."""
        x, y, z = map(put, self.position)
        u, v, w = map(put, self.velocity)
        turning = None if self.turning is None else self.turning.rewritten(put)
        return replace(
            self, mass=put(self.mass), position=(x, y, z), velocity=(u, v, w), turning=turning
        )

    @property
    def material_points(self) -> tuple[tuple[Expr, ...], ...]:
        """Positions of points fixed in it, as many as tell where it is: four of a body."""
        if self.turning is None:
            return (self.position,)
        columns = (self.turning.rotation[k::3] for k in range(3))
        ends = (tuple(r + e for r, e in zip(self.position, axis, strict=True)) for axis in columns)
        return (self.position, *ends)

    @property
    def angular_momentum(self) -> tuple[Expr, ...]:
        """Its angular momentum about the origin, m r × ṙ + R I ω."""
        (x, y, z), (u, v, w) = self.position, self.velocity
        orbital = [self.mass * e for e in (y * w - z * v, z * u - x * w, x * v - y * u)]
        if self.turning is None:
            return tuple(orbital)
        turning = self.turning
        spin_momentum = _times(turning.rotation, _times(turning.inertia, turning.spin))
        return tuple(a + b for a, b in zip(orbital, spin_momentum, strict=True))


def _times(matrix: Sequence[Expr], vector: Sequence[Expr]) -> list[Expr]:
    a, b, c = vector
    return [matrix[k] * a + matrix[k + 1] * b + matrix[k + 2] * c for k in (0, 3, 6)]
