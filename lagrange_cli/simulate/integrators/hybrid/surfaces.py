"""Switching surfaces of right-hand sides: on which side of them a state is.

The argument of ``abs``, ``sign``, ``min`` or ``max`` vanishes on a surface in the space of states,
where the function has a kink or a jump. Beside it the equations are smooth, and go on past it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Rhs
from lagrange_cli.simulate.integrators.events import TerminalEvents

#: On which side of each surface: 1, −1, or the part between that keeps the motion on it.
SurfaceSides: TypeAlias = tuple[float, ...]

#: A surface is met where its function is below this part of the terms that it is the sum of.
ON_SURFACE = 1e-14


@dataclass(frozen=True)
class SurfaceRates:
    """Rates of the functions of the surfaces.

    Attributes
    ----------
    first, second
        First rates, and second ones of surfaces that do not hang on velocities, shape (S,).
    sizes
        Magnitudes that the first rates are sums of, shape (S,).
    """

    first: Array
    second: Array
    sizes: Array

    def leading(self, k: int, positional: bool) -> float:
        """Return the first rate of surface k that is not zero but for rounding, else 0."""
        if abs(self.first[k]) > ON_SURFACE * self.sizes[k]:
            return float(self.first[k])
        return float(self.second[k]) if positional else 0.0


class Surfaces(ABC):
    """The switching surfaces of a right-hand side, which has them as its attribute ``surfaces``.

    Attributes
    ----------
    positional
        Of each surface whether it hangs on positions and time alone.
    """

    positional: tuple[bool, ...]

    @abstractmethod
    def side(self, sides: SurfaceSides) -> Rhs:
        """Return the smooth right-hand side on these sides."""

    @abstractmethod
    def through(self, change: Callable[[Rhs], Rhs]) -> Surfaces:
        """Return surfaces with every right-hand side changed."""

    @abstractmethod
    def values(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        """Evaluate the functions of the surfaces, and the magnitudes of their sums, both (S,)."""

    @abstractmethod
    def rates(self, t: float, y: Array, sides: SurfaceSides, slope: Array) -> SurfaceRates:
        """Evaluate their rates, with ``slope`` the slope of y, shape (2n,)."""

    @abstractmethod
    def continuous(self, t: float, y: Array, sides: SurfaceSides) -> Array:
        """Evaluate what jumps only with an impulse: the energy function on these sides, momenta."""

    @abstractmethod
    def terminal_events(
        self,
        sides: SurfaceSides,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        beside: TerminalEvents | None,
    ) -> TerminalEvents:
        """Return the events ``beside``, then those at which the motion leaves these sides."""

    def placed(
        self, t: float, y: Array, sides: SurfaceSides, met: Sequence[int] = ()
    ) -> tuple[SurfaceSides, tuple[int, ...]]:
        """Return the sides of surfaces on which a state is not, and the numbers of the others.

        Surfaces that are ``met`` count as others. A surface may depend on the sides of those
        before it.
        """
        on = set(met)
        for _ in range(len(sides) + 1):
            values, sizes = self.values(t, y, sides)
            on = {*met, *map(int, np.flatnonzero(np.abs(values) <= ON_SURFACE * sizes))}
            clear = [k for k in range(len(sides)) if k not in on and values[k] != 0]
            placed = with_sides(sides, {k: float(np.sign(values[k])) for k in clear})
            if placed == sides:
                break
            sides = placed
        return sides, tuple(sorted(on))

    def around(self, t: float, y: Array) -> SurfaceSides:
        """Return the sides of a state; positive ones for surfaces on which it is."""
        return self.placed(t, y, (1.0,) * len(self.positional))[0]


def surfaces_of(rhs: Rhs) -> Surfaces | None:
    """Return the switching surfaces of a right-hand side, None if it has none."""
    surfaces: Surfaces | None = getattr(rhs, "surfaces", None)
    return surfaces


def with_sides(sides: SurfaceSides, changed: Mapping[int, float]) -> SurfaceSides:
    """Return the sides with those of some surfaces replaced."""
    return tuple(changed.get(k, side) for k, side in enumerate(sides))
