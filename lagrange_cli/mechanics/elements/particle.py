"""A point mass: Newton's law, m r̈ = F."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Protocol

import sympy as sp

from lagrange_cli.mechanics.numerics.elementary import Jet


class MassElement(Protocol):
    """An element that carries mass.

    Attributes
    ----------
    name
        Name of the particle or body.
    centre
        Raw symbols of its position, a body's at its centre of mass.
    places
        Expressions over raw symbols whose motion its inertia follows.
    constants
        Its mass, and what else its inertia is of, over parameters.
    """

    @property
    def name(self) -> str: ...
    @property
    def centre(self) -> tuple[sp.Symbol, ...]: ...
    @property
    def places(self) -> tuple[sp.Expr, ...]: ...
    @property
    def constants(self) -> tuple[sp.Expr, ...]: ...

    def inertial_forces(self, places: Sequence[Jet], constants: Sequence[Decimal]) -> list[Decimal]:
        """Return the factors of displacements of its places that the work of inertia has: m r̈.

        ``places`` have their rates and accelerations along the motion.
        """

    def kinetic_terms(self, places: Sequence[Jet], constants: Sequence[Decimal]) -> list[Decimal]:
        """The terms of its kinetic energy, of the rates of its places."""


@dataclass(frozen=True)
class ParticleElement:
    """A point mass, as an :class:`MassElement`."""

    name: str
    centre: tuple[sp.Symbol, ...]
    mass: sp.Expr

    @property
    def places(self) -> tuple[sp.Expr, ...]:
        return self.centre

    @property
    def constants(self) -> tuple[sp.Expr, ...]:
        return (self.mass,)

    def inertial_forces(self, places: Sequence[Jet], constants: Sequence[Decimal]) -> list[Decimal]:
        (mass,) = constants
        return [mass * acceleration for _, _, acceleration in places]

    def kinetic_terms(self, places: Sequence[Jet], constants: Sequence[Decimal]) -> list[Decimal]:
        (mass,) = constants
        return [mass * rate**2 / 2 for _, rate, _ in places]
