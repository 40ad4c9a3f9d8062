"""Layout of a state vector: coordinates, then their velocities, then states of first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class StateLayout:
    """Places of the numbers of y = [q, v, s] and of its rate [v, a, ṡ].

    Attributes
    ----------
    coordinates
        Number of coordinates, and of their velocities.
    states
        Number of states of first order.
    """

    coordinates: int
    states: int = 0

    @property
    def size(self) -> int:
        """The number of numbers of y."""
        return 2 * self.coordinates + self.states

    @cached_property
    def positions(self) -> slice:
        """Places of the coordinates."""
        return slice(0, self.coordinates)

    @cached_property
    def velocities(self) -> slice:
        """Places of the velocities, which are those of the accelerations in a rate."""
        return slice(self.coordinates, 2 * self.coordinates)

    @cached_property
    def first_order(self) -> slice:
        """Places of the states of first order."""
        return slice(2 * self.coordinates, self.size)

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """Names of the numbers of y in programs: ``q0, …``, ``v0, …``, ``z0, …``."""
        counts = {"q": self.coordinates, "v": self.coordinates, "z": self.states}
        return tuple(f"{letter}{k}" for letter, count in counts.items() for k in range(count))

    def place(self, letter: str, number: int) -> int:
        """Place in y of a variable of programs."""
        first = {"q": self.positions, "v": self.velocities, "z": self.first_order}
        return int(first[letter].start) + number

    def names(self, coordinates: Sequence[str], states: Sequence[str] = ()) -> tuple[str, ...]:
        """Name the numbers of y: coordinates, then their ``dot``, then states."""
        return (*coordinates, *(f"dot({name})" for name in coordinates), *states)
