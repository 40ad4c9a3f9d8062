"""Bodies of a picture, the lines between them and the angles of these lines, as values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr

    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]

#: Relative agreement of numbers that are the same, and the least change of one that moves.
SAME, MOVES = 1e-9, 1e-6
#: Bodies between which ropes and springs are sought that no helper states.
MOST_SOUGHT = 12


@dataclass(frozen=True)
class Link:
    """A line between two bodies.

    Attributes
    ----------
    kind
        ``rod``: of constant length; ``radius``: a position vector of variable length.
    ends
        Numbers of two bodies.
    size
        The symbol that the scene has for its length, stiffness or coefficient; None if it has none.
    stated
        True if an entry of the scene is about these two bodies.
    length
        Length of a rope that may be slack; None of other links.
    constraint
        Name of the inequality that a rope is; empty for other links.
    """

    kind: Literal["rod", "radius", "rope", "spring", "damper"]
    ends: tuple[int, int]
    size: Expr | None = None
    stated: bool = False
    length: float | None = None
    constraint: str = ""

    @property
    def has_support(self) -> bool:
        """True if a fixed place at one of its ends is a support."""
        return self.kind not in ("radius", "rope") or self.length is not None


@dataclass(frozen=True)
class Angle:
    """A coordinate that is the angle of a line.

    Attributes
    ----------
    coordinate
        Its number.
    ends
        Numbers of the bodies between which the line goes.
    reference, towards
        Unit vectors: the direction from which the angle is counted, and that of a right angle.
    value
        The angle at the start, in radians, with its sign.
    projected
        True if the angle is that of the line's projection on the plane of both.
    """

    coordinate: int
    ends: tuple[int, int]
    reference: Array
    towards: Array
    value: float
    projected: bool


@dataclass
class Findings:
    """Bodies, links and angles.

    Attributes
    ----------
    configurations
        The configurations at which they hold.
    names
        Names of the bodies; empty for pivots, ``O`` for the origin.
    places
        Their positions, shape (K, bodies, 3).
    depends
        For each body the numbers of the coordinates that move it.
    links, angles
        Lines between them.
    barred
        Bodies at the end of a bar that turns about a fixed place.
    on_bodies
        Origins of rigid bodies on other ones.
    """

    configurations: Configurations
    names: list[str]
    places: Array
    depends: list[frozenset[int]]
    links: list[Link] = field(default_factory=list)
    angles: list[Angle] = field(default_factory=list)
    barred: set[int] = field(default_factory=set)
    on_bodies: set[int] = field(default_factory=set)

    @property
    def declared(self) -> int:
        """Number of particles and points, which stand before the origin and pivots."""
        return len(self.configurations.names)

    def is_fixed(self, body: int) -> bool:
        """Tell whether a body is at the same place in all configurations."""
        if self.is_particle(body) or body in self.on_bodies:
            return False
        return self._still(self.places[:, body])

    def is_particle(self, body: int) -> bool:
        return body < self.configurations.particles

    def linked(self, a: int, b: int) -> bool:
        return any({a, b} == set(link.ends) for link in self.links)

    def distances(self, a: int, b: int) -> Array:
        """Return the distance of two bodies in each configuration."""
        across: Array = np.linalg.norm(self.places[:, b] - self.places[:, a], axis=1)
        return across

    def slack(self, link: Link, number: int) -> float:
        """Return √(l² − d²) of a rope in a configuration; 0 where it is taut, and of other links.

        Configurations near the start may be beyond its length.
        """
        if link.length is None:
            return 0.0
        distance = float(self.distances(*link.ends)[number])
        missing = link.length**2 - distance**2
        return float(np.sqrt(missing)) if missing > MOVES * link.length**2 else 0.0

    def constant(self, a: int, b: int) -> bool:
        """Tell whether two bodies keep their distance, which is not zero."""
        lengths = self.distances(a, b)
        return len(lengths) > 2 and bool(np.ptp(lengths) <= SAME * lengths.max() > 0)

    def add(self, name: str, places: Array, depends: frozenset[int] = frozenset()) -> int:
        """Add a body, or return a point or pivot that is always at that place."""
        apart = np.abs(self.places - places[:, None]).max(axis=(0, 2))
        for number in np.flatnonzero(apart <= SAME * self.configurations.size):
            if number >= self.configurations.particles:
                return int(number)
        self.names.append(name)
        self.depends.append(depends)
        self.places = np.concatenate([self.places, places[:, None]], axis=1)
        return len(self.names) - 1

    def keep(self, count: int) -> None:
        """Remove the bodies that were added after the first ``count``."""
        del self.names[count:], self.depends[count:]
        self.places = self.places[:, :count]

    def _still(self, places: Array) -> bool:
        return bool(np.ptp(places, axis=0).max() <= SAME * self.configurations.size)
