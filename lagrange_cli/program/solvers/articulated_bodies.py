"""M x = f of trees of bodies by articulated bodies, in a number of operations linear in the frames.

From the ends of the tree inwards, each frame has the inertia that is felt at it while the joints
behind it are free; a joint takes away what it cannot transmit. With S the motion of a joint,

    U = I S,   D = Sᵀ U,   u = f − Sᵀ p,   I' = I − U Uᵀ/D,   p' = p + U u/D,

and outwards x = (u − Uᵀ a')/D, a = a' + S x (R. Featherstone, Rigid Body Dynamics Algorithms, 2008,
section 7.3, without velocities, which are in f). D are the pivots of M in that order, M = L D Lᵀ,
positive where M is positive definite.

Components are along the axes of space, and inertia is about the origin of each frame: I has the
blocks J (of turns), H (of turns by displacements) and K (of displacements).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from lagrange_cli.mechanics.elements.tree import ENTRIES, BodyTree, TreeFrame, TreeMotion
from lagrange_cli.program.graph.value_graph import ScaledNode, ValueGraph
from lagrange_cli.program.solvers.vectors import (
    NO_VECTOR,
    ZERO,
    Matrix,
    Vector,
    Vectors,
    cross_matrix,
    negative,
    symmetric,
    transposed,
)


class ArticulatedSolution(NamedTuple):
    """The solution of M x = f and the pivots D, by coordinate; no digits cancel in the last one."""

    solution: dict[int, ScaledNode]
    pivots: dict[int, ScaledNode]


@dataclass
class _Felt:
    """Inertia that is felt at a frame, J, H, K, and moment and force that drive joints behind."""

    turning: Matrix
    mixed: Matrix
    moving: Matrix
    moment: Vector = NO_VECTOR
    force: Vector = NO_VECTOR


@dataclass
class _Joint:
    """A motion with its coordinate, Uᵀ, D and u; U has moments, then forces."""

    motion: TreeMotion
    direction: Vector
    moments: Vector
    forces: Vector
    pivot: ScaledNode
    drive: ScaledNode


@dataclass
class _Frame:
    """A frame with the inertia of what it carries, and its joints from the last to the first."""

    step: Vector
    felt: _Felt
    joints: list[_Joint] = field(default_factory=list)


def solve_tree(
    values: ValueGraph, tree: BodyTree, right: Sequence[ScaledNode]
) -> ArticulatedSolution:
    """Solve M x = ``right``, one value a coordinate; each motion has its own one."""
    return _Articulated(values, tree, right).solved()


class _Articulated(Vectors):
    def __init__(self, values: ValueGraph, tree: BodyTree, right: Sequence[ScaledNode]) -> None:
        super().__init__(values)
        self._tree, self._right = tree, right
        self._frames = [self._frame(frame) for frame in tree.frames]

    def solved(self) -> ArticulatedSolution:
        pairs = list(zip(self._tree.frames, self._frames, strict=True))
        for declared, frame in reversed(pairs):
            for motion in reversed(declared.motions):
                self._free(frame, motion)
            if declared.parent is not None:
                self._carry(frame, self._frames[declared.parent].felt)
        motions: list[tuple[Vector, Vector]] = []
        whole = ArticulatedSolution({}, {})
        for declared, frame in pairs:
            turn, shift = NO_VECTOR, NO_VECTOR
            if declared.parent is not None:
                turn, shift = motions[declared.parent]
                shift = self.sum(shift, self.cross(turn, frame.step))
            for joint in reversed(frame.joints):
                felt = self.add([self.dot(joint.moments, turn), self.dot(joint.forces, shift)])
                x = self.over(self.add([joint.drive, negative(felt)]), joint.pivot)
                added = self.scaled(x, joint.direction)
                if joint.motion.is_turn:
                    turn = self.sum(turn, added)
                else:
                    shift = self.sum(shift, added)
                (number,) = joint.motion.coordinates
                whole.solution[number], whole.pivots[number] = x, joint.pivot
            motions.append((turn, shift))
        return whole

    def _frame(self, frame: TreeFrame) -> _Frame:
        values = self.values
        mass = values.convert(frame.mass)
        mixed = cross_matrix(self.vector(frame.moment))
        turning = symmetric([values.convert(e) for e in frame.inertia])
        moving = symmetric([mass, mass, mass, ZERO, ZERO, ZERO])
        return _Frame(self.vector(frame.step), _Felt(turning, mixed, moving))

    def _free(self, frame: _Frame, motion: TreeMotion) -> None:
        """Take away from the felt inertia what a joint does not transmit."""
        felt, (number,) = frame.felt, motion.coordinates
        direction = self.vector(motion.direction)
        if motion.is_turn:
            moments = self.times(felt.turning, direction)
            forces = self.times(transposed(felt.mixed), direction)
            along, against = moments, felt.moment
        else:
            moments = self.times(felt.mixed, direction)
            forces = self.times(felt.moving, direction)
            along, against = forces, felt.force
        parts = [self.dot(direction, along)]
        if (number, number) in self._tree.further:
            parts.append(self.values.convert(self._tree.further[number, number]))
        pivot = self.add(parts)
        drive = self.add([self._right[number], negative(self.dot(direction, against))])
        frame.joints.append(_Joint(motion, direction, moments, forces, pivot, drive))
        twist, pull = (self.divided(vector, pivot) for vector in (moments, forces))
        felt.turning = self.less(felt.turning, moments, twist, is_symmetric=True)
        felt.mixed = self.less(felt.mixed, moments, pull)
        felt.moving = self.less(felt.moving, forces, pull, is_symmetric=True)
        felt.moment = self.sum(felt.moment, self.scaled(drive, twist))
        felt.force = self.sum(felt.force, self.scaled(drive, pull))

    def _carry(self, frame: _Frame, below: _Felt) -> None:
        """Add what is felt at a frame to what is felt at the origin of that below it."""
        felt, step = frame.felt, frame.step
        # With d the step and [d] its cross product: H' = H + [d] K, J' = J + [d] Hᵀ + ([d] H'ᵀ)ᵀ.
        carried = transposed(self.crossed(step, felt.moving))
        mixed = self.plus(felt.mixed, carried)
        first, second = self.crossed(step, felt.mixed), self.crossed(step, mixed)
        turning = symmetric(
            [self.add([felt.turning[i][j], first[j][i], second[i][j]]) for i, j in ENTRIES]
        )
        below.turning = self.plus(below.turning, turning, is_symmetric=True)
        below.mixed = self.plus(below.mixed, mixed)
        below.moving = self.plus(below.moving, felt.moving, is_symmetric=True)
        moment = self.sum(felt.moment, self.cross(step, felt.force))
        below.moment = self.sum(below.moment, moment)
        below.force = self.sum(below.force, felt.force)
