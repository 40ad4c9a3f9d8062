"""The mass matrix of a derivation: its terms as they were collected, or what they follow from.

Of a tree of bodies a few expressions for each joint tell all of M: its axis, its step from the
frame below, and the momentum F and moment of momentum N about its origin, in a unit motion of it,
of all that stands on it. From there inwards

    M_jk = S_j · (N, F),   N' = N + d × F

(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.2). Entries are as many as the
square of the joints. They are made of numbers for the certificate, and of expressions by the same
steps once these are asked for, as code for long trees never does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from typing import Any, TypeAlias, TypeVar

import sympy as sp

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.algebra.arithmetic import plain_sum
from lagrange_cli.mechanics.dynamics.shared_vectors import NumberVectors, Shared, Vector
from lagrange_cli.mechanics.sparse import ExpressionRow

_Entry = TypeVar("_Entry")

Place: TypeAlias = tuple[int, int]
"""Row and column of an entry on or above the diagonal."""

Terms: TypeAlias = tuple[sp.Expr, ...]

_Values: TypeAlias = Callable[[sp.Expr], Any]
"""Number of an expression."""


def _vector(value: _Values, vector: Vector) -> tuple[Any, Any, Any]:
    x, y, z = map(value, vector)
    return x, y, z


@dataclass(frozen=True, eq=False)
class CollectedInertia:
    """M as sums of collected terms.

    Attributes
    ----------
    terms
        Rows of M by column without entries that are zero, each entry as its terms.
    rows
        Rows of entries that are each one factored sum.
    """

    terms: Sequence[Mapping[int, Terms]]
    rows: tuple[ExpressionRow, ...]

    @cached_property
    def _upper(self) -> Mapping[Place, sp.Expr]:
        """Entries on and above the diagonal as sums of their terms."""
        entries = [(j, k) for j, row in enumerate(self.terms) for k in row]
        if any(self.terms[j][k] != self.terms[k].get(j) for j, k in entries):
            raise InternalError(Problem("the derived mass matrix is not symmetric"))
        return {(j, k): plain_sum(self.terms[j][k]) for j, k in entries if j <= k}

    @property
    def parts(self) -> Sequence[sp.Expr]:
        """Expressions that :meth:`numbers` takes the values of."""
        return [*self._upper.values()]

    @property
    def is_diagonal(self) -> bool:
        """True if all other entries are zero as they stand."""
        return all(entry == 0 for (j, k), entry in self._upper.items() if j != k)

    def numbers(self, values: Sequence[Decimal]) -> dict[Place, Decimal]:
        """Return entries on and above the diagonal, from the values of ``parts``."""
        return dict(zip(self._upper, values, strict=True))


@dataclass(frozen=True, eq=False)
class UnitMotion:
    """An angle or displacement e(q, t) of a frame, or a turn by a rate ω alone.

    Attributes
    ----------
    axis, is_turn
        Its axis along those of space; True of a turn.
    slopes
        Coordinate number → ∂e/∂q, or ∂ω/∂q̇.
    force, torque
        F and N in a motion with ė or ω of 1.
    """

    axis: Vector
    is_turn: bool
    slopes: Mapping[int, sp.Expr]
    force: Vector
    torque: Vector

    def over(self, value: _Values) -> UnitMotion:
        """The motion with numbers in place of expressions."""
        slopes = {j: value(slope) for j, slope in self.slopes.items()}
        axis, force, torque = (_vector(value, v) for v in (self.axis, self.force, self.torque))
        return UnitMotion(axis, self.is_turn, slopes, force, torque)


@dataclass(frozen=True, eq=False)
class CarryingFrame:
    """A frame with its motions.

    Attributes
    ----------
    parent
        Number of the frame below it, None on space.
    step
        Its origin from that of the parent.
    motions
        Its angles and displacements in order.
    """

    parent: int | None
    step: Vector
    motions: tuple[UnitMotion, ...]

    @property
    def parts(self) -> Iterator[sp.Expr]:
        """Yield the expressions that it is described by."""
        yield from self.step
        for motion in self.motions:
            yield from (*motion.axis, *motion.slopes.values(), *motion.force, *motion.torque)

    def over(self, value: _Values) -> CarryingFrame:
        """The frame with numbers in place of expressions."""
        motions = tuple(motion.over(value) for motion in self.motions)
        return CarryingFrame(self.parent, _vector(value, self.step), motions)


@dataclass(frozen=True, eq=False)
class TreeInertia:
    """M of a tree of bodies.

    Attributes
    ----------
    size
        Number of coordinates.
    frames
        The frames, each behind that below it.
    further
        Terms of M that are not of these bodies.
    """

    size: int
    frames: tuple[CarryingFrame, ...]
    further: Mapping[Place, Terms]

    #: No entry is proven zero.
    is_diagonal = False

    @property
    def rows(self) -> tuple[ExpressionRow, ...]:
        """Rows of M, whose entries are made once one of them is asked for."""
        return tuple(TreeRow(self, number) for number in range(self.size))

    @cached_property
    def terms(self) -> Sequence[Mapping[int, Terms]]:
        """Rows of M by column, each entry as one term."""
        return [{k: (entry,) for k, entry in row.items()} for row in self.full]

    @cached_property
    def full(self) -> Sequence[Mapping[int, sp.Expr]]:
        """Entries that are not zero by row and column."""
        entries = _entries(Shared(), self.frames, self.further)
        present = {place: e for place, e in sorted(entries.items()) if e is not sp.S.Zero}
        return full_rows(self.size, present)

    @cached_property
    def parts(self) -> Sequence[sp.Expr]:
        """Expressions that :meth:`numbers` takes the values of, each object once."""
        parts = [e for frame in self.frames for e in frame.parts]
        parts += [term for terms in self.further.values() for term in terms]
        return [*{id(part): part for part in parts}.values()]

    def numbers(self, values: Sequence[Decimal]) -> dict[Place, Decimal]:
        """Return entries on and above the diagonal, from the values of ``parts``."""
        known = dict(zip(map(id, self.parts), values, strict=True))

        def value(part: sp.Expr) -> Decimal:
            return known[id(part)]

        further = {place: tuple(map(value, terms)) for place, terms in self.further.items()}
        frames = [frame.over(value) for frame in self.frames]
        entries = _entries(NumberVectors(), frames, further)
        return {place: entry for place, entry in entries.items() if entry}


class TreeRow(ExpressionRow):
    """A row of M of a tree, whose entries are made once they are asked for."""

    __slots__ = ("_inertia", "_number")

    def __init__(self, inertia: TreeInertia, number: int) -> None:
        self._length = inertia.size
        self._inertia, self._number = inertia, number

    @property
    def nonzero(self) -> Mapping[int, sp.Expr]:
        """The entries that are not zero by column, ascending."""
        return self._inertia.full[self._number]


def _entries(
    vectors: Shared, frames: Sequence[CarryingFrame], further: Mapping[Place, Sequence[Any]]
) -> dict[Place, Any]:
    """Add up the entries of M on and above the diagonal, of expressions or of numbers."""
    entries = {place: [*terms] for place, terms in further.items()}
    for number in reversed(range(len(frames))):
        for order, motion in enumerate(frames[number].motions):
            torque, at = motion.torque, frames[number]
            before = at.motions[: order + 1]
            while True:
                for earlier in before:
                    along = vectors.dot(earlier.axis, torque if earlier.is_turn else motion.force)
                    if along:
                        _add_products(entries, motion, earlier, along, vectors)
                if at.parent is None:
                    break
                torque = vectors.total((torque, vectors.cross(at.step, motion.force)))
                at = frames[at.parent]
                before = at.motions
    return {place: vectors.add(*terms) for place, terms in entries.items()}


def _add_products(
    entries: dict[Place, list[Any]],
    motion: UnitMotion,
    earlier: UnitMotion,
    along: Any,
    vectors: Shared,
) -> None:
    """Add what two motions have in common to the entries of their coordinates."""
    for j, first in motion.slopes.items():
        for k, second in earlier.slopes.items():
            if earlier is motion and k < j:
                continue
            value = vectors.multiply(first, second, along)
            terms = entries.setdefault((min(j, k), max(j, k)), [])
            terms += [value, value] if j == k and earlier is not motion else [value]


def full_rows(size: int, upper: Mapping[Place, _Entry]) -> list[dict[int, _Entry]]:
    """The rows of a symmetric matrix, from its upper triangle in the order of rows."""
    rows: list[dict[int, _Entry]] = [{} for _ in range(size)]
    for (j, k), entry in upper.items():
        rows[j][k] = rows[k][j] = entry
    return rows
