"""M of trees of bodies by composite bodies: a column is the momentum of all that a joint carries.

In a unit motion S_k of a joint, all that stands on it moves as one body, with a momentum F and a
moment of momentum N about the origin of the joint's frame. From there inwards

    M_jk = S_j · (N, F),   N' = N + d × F,

where d leads from the frame below to this one (R. Featherstone, Rigid Body Dynamics Algorithms,
2008, section 6.2). S, d, N and F are few numbers for each joint. The products, as many as the
square of the joints, are left to two loops where a tree is a chain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from lagrange_cli.mechanics.elements.tree import ENTRIES, BodyTree, TreeFrame, TreeMotion
from lagrange_cli.program.graph.value_graph import ScaledNode, ValueGraph
from lagrange_cli.program.solvers.vectors import (
    NO_VECTOR,
    Matrix,
    Vector,
    Vectors,
    negative,
    symmetric,
)


class ChainColumns(NamedTuple):
    """Values, or numbers, that the columns of M follow from, joint by joint from space outwards.

    Attributes
    ----------
    axes
        Axis of each joint as a turn; then as a displacement, if any joint of the chain is one.
    steps
        Place of each joint from that of the joint before it.
    momenta
        F, then N, in a unit motion of each joint.
    """

    axes: list[Any]
    steps: list[Any]
    momenta: list[Any]


@dataclass
class _Carried:
    """Mass, first moment and tensor of all that a frame carries, about the origin of the frame."""

    step: Vector
    mass: ScaledNode
    moment: Vector
    inertia: Matrix


@dataclass
class _Joint:
    """A motion of a frame with F and N."""

    motion: TreeMotion
    axis: Vector
    force: Vector
    torque: Vector
    step: Vector


def is_chain(tree: BodyTree) -> bool:
    """Tell whether each frame stands on the one before it, and coordinates follow each other."""
    parents = [frame.parent for frame in tree.frames]
    numbers = list(tree.coordinates)
    is_line = parents == [None, *range(len(parents) - 1)]
    return is_line and not tree.further and numbers == list(range(len(numbers)))


def chain_columns(values: ValueGraph, tree: BodyTree) -> ChainColumns:
    """Return the numbers that the columns of M of a chain follow from."""
    joints = _Composite(values, tree).joints
    columns = ChainColumns([], [], [])
    slides = any(not joint.motion.is_turn for joint in joints)
    for joint in joints:
        turn, shift = (joint.axis, NO_VECTOR) if joint.motion.is_turn else (NO_VECTOR, joint.axis)
        columns.axes.extend((*turn, *(shift if slides else ())))
        columns.steps.extend(joint.step)
        columns.momenta.extend((*joint.force, *joint.torque))
    return columns


def inertia_of_motions(values: ValueGraph, tree: BodyTree) -> dict[int, ScaledNode]:
    """Return the diagonal of M by coordinate, if each motion has its own one."""
    composite = _Composite(values, tree)
    diagonal = {}
    for joint in composite.joints:
        (number,) = joint.motion.coordinates
        along = joint.torque if joint.motion.is_turn else joint.force
        parts = [composite.dot(joint.axis, along)]
        if (number, number) in tree.further:
            parts.append(values.convert(tree.further[number, number]))
        diagonal[number] = values.add(parts)
    return diagonal


def upper_triangle(columns: ChainColumns) -> Iterator[tuple[int, int, Any]]:
    """Yield row, column and value of each entry of M on and above the diagonal, from numbers."""
    count = len(columns.steps) // 3
    width = len(columns.axes) // count
    for column in range(count):
        force, torque = (columns.momenta[6 * column + k :][:3] for k in (0, 3))
        for row in reversed(range(column + 1)):
            along = zip(columns.axes[width * row :], (*torque, *force)[:width], strict=False)
            yield row, column, sum(a * b for a, b in along)
            x, y, z = columns.steps[3 * row : 3 * row + 3]
            first, second, third = force
            torque = [
                torque[0] + y * third - z * second,
                torque[1] + z * first - x * third,
                torque[2] + x * second - y * first,
            ]


class _Composite(Vectors):
    """The joints of a tree from the first frame to the last, with the momentum of each."""

    def __init__(self, values: ValueGraph, tree: BodyTree) -> None:
        super().__init__(values)
        carried = [self._carried(frame) for frame in tree.frames]
        for frame, whole in zip(reversed(tree.frames), reversed(carried), strict=True):
            if frame.parent is not None:
                self._carry(whole, carried[frame.parent])
        self.joints: list[_Joint] = []
        step = NO_VECTOR
        for frame, whole in zip(tree.frames, carried, strict=True):
            # Frames without joints only add to the way from joint to joint.
            step = self.sum(step, whole.step)
            for motion in frame.motions:
                self.joints.append(self._joint(motion, whole, step))
                step = NO_VECTOR

    def _carried(self, frame: TreeFrame) -> _Carried:
        inertia = symmetric([self.values.convert(e) for e in frame.inertia])
        mass, moment = self.values.convert(frame.mass), self.vector(frame.moment)
        return _Carried(self.vector(frame.step), mass, moment, inertia)

    def _carry(self, whole: _Carried, below: _Carried) -> None:
        """Add what a frame carries to what that below it carries."""
        step, moment = whole.step, whole.moment
        shift = self.scaled(whole.mass, step)
        # About the other origin: J + (2 m·d + M d·d) 1 − m dᵀ − d mᵀ − M d dᵀ.
        first = self._products(self.sum(shift, moment), step)
        second = self._products(moment, step)
        change = [
            self.add([p[k][k] for k in range(3) if k != i for p in (first, second)])
            if i == j
            else negative(self.add([first[i][j], second[j][i]]))
            for i, j in ENTRIES
        ]
        below.mass = self.add([below.mass, whole.mass])
        below.moment = self.sum(below.moment, self.sum(moment, shift))
        below.inertia = self.plus(
            self.plus(below.inertia, whole.inertia, is_symmetric=True),
            symmetric(change),
            is_symmetric=True,
        )

    def _products(self, a: Vector, b: Vector) -> Sequence[Sequence[ScaledNode]]:
        return [[self.multiply(x, y) for y in b] for x in a]

    def _joint(self, motion: TreeMotion, whole: _Carried, step: Vector) -> _Joint:
        axis = self.vector(motion.direction)
        if motion.is_turn:
            force, torque = self.cross(axis, whole.moment), self.times(whole.inertia, axis)
        else:
            force, torque = self.scaled(whole.mass, axis), self.cross(whole.moment, axis)
        return _Joint(motion, axis, force, torque, step)
