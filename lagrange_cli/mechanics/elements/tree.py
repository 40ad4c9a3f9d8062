"""Trees of moving frames with the inertia that stands at them, as frozen values.

Components are along the axes of space, and inertia is about the origin of each frame. Expressions
share their parts, and are never walked as trees.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from sympy import Expr

Components: TypeAlias = "tuple[Expr, Expr, Expr]"

#: Places of the entries xx, yy, zz, xy, xz, yz of a symmetric tensor.
ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class TreeMotion:
    """An elementary motion of a frame.

    Attributes
    ----------
    coordinates
        Numbers of the coordinates that its angle or displacement e(q, t) holds.
    direction
        Its axis, times ∂e/∂q if it holds one coordinate.
    is_turn
        True of a turn, False of a displacement of the origin.
    """

    coordinates: tuple[int, ...]
    direction: Components
    is_turn: bool


@dataclass(frozen=True, eq=False)
class TreeFrame:
    """A frame of a tree.

    Attributes
    ----------
    parent
        Number of the frame below it, which is less than its own; None on space.
    step
        Its origin from that of the parent.
    motions
        Its displacements, then its turns in order.
    mass, moment, inertia
        Mass, first moment and tensor, by the entries of :data:`ENTRIES`, of the body at it.
    """

    parent: int | None
    step: Components
    motions: tuple[TreeMotion, ...]
    mass: Expr
    moment: Components
    inertia: tuple[Expr, ...]


@dataclass(frozen=True, eq=False)
class BodyTree:
    """The frames of a scene of bodies, each behind that below it.

    Attributes
    ----------
    frames
        The frames.
    further
        Entries of M on and above the diagonal that are not of these bodies, by row and column.
    """

    frames: tuple[TreeFrame, ...]
    further: Mapping[tuple[int, int], Expr] = field(default_factory=dict)

    @cached_property
    def has_own_coordinates(self) -> bool:
        """True if each motion has one coordinate, which no other motion nor element has."""
        motions = [motion.coordinates for frame in self.frames for motion in frame.motions]
        uses = Counter(number for numbers in motions for number in numbers)
        is_single = all(len(numbers) == 1 for numbers in motions) and set(uses.values()) == {1}
        return is_single and all(j == k and j in uses for j, k in self.further)

    @property
    def coordinates(self) -> Sequence[int]:
        """Numbers of the coordinates of all motions, in the order of the frames."""
        motions = (motion for frame in self.frames for motion in frame.motions)
        return [number for motion in motions for number in motion.coordinates]
