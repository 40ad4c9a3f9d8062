"""The linear system of second order at an equilibrium, as a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mpmath


@dataclass(frozen=True)
class LinearSystem:
    """A linear system in many digits, over independent coordinates.

    Attributes
    ----------
    mass, damping, stiffness, inputs
        ZᵀM Z, ZᵀC Z, ZᵀK Y and ZᵀB.
    velocities
        Z, which gives all velocities of those of independent coordinates; shape (n, k).
    sizes
        Sizes of the terms that the entries of ZᵀK Y are sums of.
    errors
        Bounds of the errors of these entries.
    positions
        Y, which gives all positions of those that closures between positions leave independent;
        it is Z without closures between velocities.
    independent, placed
        Numbers of the coordinates whose velocities, whose positions are independent.
    """

    mass: mpmath.matrix
    damping: mpmath.matrix
    stiffness: mpmath.matrix
    inputs: mpmath.matrix
    velocities: mpmath.matrix
    positions: mpmath.matrix
    independent: tuple[int, ...]
    placed: tuple[int, ...]
    sizes: mpmath.matrix
    errors: mpmath.matrix

    @property
    def is_holonomic(self) -> bool:
        """True if all closures are between positions."""
        return self.independent == self.placed

    @property
    def has_velocity_forces(self) -> bool:
        """True if C is not zero."""
        return any(self.damping)
