"""Linear systems of first order: positions, velocities, then states of first order.

States are coordinates of a rest system (:mod:`.equilibria.state_coordinates`), so that the
equations of second order have a row M ẍ = … for each. What stands there for a state is its rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import mpmath

from lagrange_cli.analysis.values import DIGITS, Equilibrium

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.analysis.linear.second_order import LinearSystem

_Entry = TypeVar("_Entry")


@dataclass(frozen=True)
class FirstOrder:
    """Numbers of a linear system that are of first order, among those of second order.

    Attributes
    ----------
    positions, velocities
        Numbers of positions and of velocities of the equations of second order.
    placed, moving
        How many of them are of coordinates that are no states, which come first.
    """

    positions: int
    velocities: int
    placed: int
    moving: int

    @classmethod
    def of_system(cls, system: RestSystem, linear: LinearSystem) -> FirstOrder:
        placed, moving = (
            sum(j < system.moving for j in chosen) for chosen in (linear.placed, linear.independent)
        )
        return cls(len(linear.placed), len(linear.independent), placed, moving)

    @property
    def rows(self) -> list[int]:
        """Rows of the equations of second order, with velocities behind positions, that are kept:
        those of a state have its rate in the place of an acceleration."""
        return [*range(self.placed), *range(self.positions, self.positions + self.velocities)]

    @property
    def columns(self) -> list[int]:
        """Columns that are kept: a state stands where positions do."""
        moving = range(self.positions, self.positions + self.moving)
        return [*range(self.placed), *moving, *range(self.placed, self.positions)]

    def ordered(self, numbers: Sequence[_Entry]) -> list[_Entry]:
        """Return what belongs to the columns, in their order."""
        return [numbers[k] for k in self.columns]


def first_order(system: RestSystem, at: Equilibrium, linear: LinearSystem) -> mpmath.matrix:
    """Write A of the motions near an equilibrium, without the positions that drift."""
    order, k, placed = FirstOrder.of_system(system, linear), len(linear.independent), linear.placed
    names = [c.name for c in system.equations.system.coordinates]
    p = len(placed)
    with mpmath.workdps(DIGITS):
        inverse = mpmath.inverse(linear.mass)
        stiff, damped = inverse * linear.stiffness, inverse * linear.damping
        whole = mpmath.zeros(p + k, p + k)
        for i, j in enumerate(placed):
            for column in range(k):
                whole[i, p + column] = linear.velocities[j, column]
        for row in range(k):
            for column in range(p):
                whole[p + row, column] = -stiff[row, column]
            for column in range(k):
                whole[p + row, p + column] = -damped[row, column]
        drifting = {i for i, j in enumerate(placed) if names[j] in at.free}
        pairs = zip(order.rows, order.columns, strict=True)
        kept_places = [(row, column) for row, column in pairs if column not in drifting]
        a = mpmath.zeros(len(kept_places), len(kept_places))
        for new_row, (row, _) in enumerate(kept_places):
            for new_column, (_, column) in enumerate(kept_places):
                a[new_row, new_column] = whole[row, column]
    return a
