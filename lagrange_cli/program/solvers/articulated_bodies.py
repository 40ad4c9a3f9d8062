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

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from lagrange_cli.mechanics.elements.tree import ENTRIES, BodyTree, TreeFrame, TreeMotion
from lagrange_cli.program.graph.value_graph import ONE, ScaledNode, ValueGraph

if TYPE_CHECKING:
    from sympy import Expr

_ZERO: ScaledNode = (0, ONE)

_Vector: TypeAlias = tuple[ScaledNode, ScaledNode, ScaledNode]
_Matrix: TypeAlias = tuple[_Vector, _Vector, _Vector]

_NONE: _Vector = (_ZERO, _ZERO, _ZERO)


class ArticulatedSolution(NamedTuple):
    """The solution of M x = f and the pivots D, by coordinate; no digits cancel in the last one."""

    solution: dict[int, ScaledNode]
    pivots: dict[int, ScaledNode]


@dataclass
class _Felt:
    """Inertia that is felt at a frame, J, H, K, and moment and force that drive joints behind."""

    turning: _Matrix
    mixed: _Matrix
    moving: _Matrix
    moment: _Vector = _NONE
    force: _Vector = _NONE


@dataclass
class _Joint:
    """A motion with its coordinate, Uᵀ, D and u; U has moments, then forces."""

    motion: TreeMotion
    direction: _Vector
    moments: _Vector
    forces: _Vector
    pivot: ScaledNode
    drive: ScaledNode


@dataclass
class _Frame:
    """A frame with the inertia of what it carries, and its joints from the last to the first."""

    step: _Vector
    felt: _Felt
    joints: list[_Joint] = field(default_factory=list)


def solve_tree(
    values: ValueGraph, tree: BodyTree, right: Sequence[ScaledNode]
) -> ArticulatedSolution:
    """Solve M x = ``right``, one value a coordinate; each motion has its own one."""
    return _Articulated(values, tree, right).solved()


class _Articulated:
    def __init__(self, values: ValueGraph, tree: BodyTree, right: Sequence[ScaledNode]) -> None:
        self._values, self._tree, self._right = values, tree, right
        self._frames = [self._frame(frame) for frame in tree.frames]

    def solved(self) -> ArticulatedSolution:
        pairs = list(zip(self._tree.frames, self._frames, strict=True))
        for declared, frame in reversed(pairs):
            for motion in reversed(declared.motions):
                self._free(frame, motion)
            if declared.parent is not None:
                self._carry(frame, self._frames[declared.parent].felt)
        motions: list[tuple[_Vector, _Vector]] = []
        whole = ArticulatedSolution({}, {})
        for declared, frame in pairs:
            turn, shift = _NONE, _NONE
            if declared.parent is not None:
                turn, shift = motions[declared.parent]
                shift = self._sum(shift, self._cross(turn, frame.step))
            for joint in reversed(frame.joints):
                felt = self._add([self._dot(joint.moments, turn), self._dot(joint.forces, shift)])
                x = self._over(self._add([joint.drive, _negative(felt)]), joint.pivot)
                added = self._scaled(x, joint.direction)
                if joint.motion.is_turn:
                    turn = self._sum(turn, added)
                else:
                    shift = self._sum(shift, added)
                (number,) = joint.motion.coordinates
                whole.solution[number], whole.pivots[number] = x, joint.pivot
            motions.append((turn, shift))
        return whole

    def _frame(self, frame: TreeFrame) -> _Frame:
        values = self._values
        mass = values.convert(frame.mass)
        x, y, z = self._vector(frame.moment)
        turning = _symmetric([values.convert(e) for e in frame.inertia])
        mixed = (
            (_ZERO, _negative(z), y),
            (z, _ZERO, _negative(x)),
            (_negative(y), x, _ZERO),
        )
        moving = _symmetric([mass, mass, mass, _ZERO, _ZERO, _ZERO])
        return _Frame(self._vector(frame.step), _Felt(turning, mixed, moving))

    def _free(self, frame: _Frame, motion: TreeMotion) -> None:
        """Take away from the felt inertia what a joint does not transmit."""
        felt, (number,) = frame.felt, motion.coordinates
        direction = self._vector(motion.direction)
        if motion.is_turn:
            moments = self._times(felt.turning, direction)
            forces = self._times(_transposed(felt.mixed), direction)
            along, against = moments, felt.moment
        else:
            moments = self._times(felt.mixed, direction)
            forces = self._times(felt.moving, direction)
            along, against = forces, felt.force
        parts = [self._dot(direction, along)]
        if (number, number) in self._tree.further:
            parts.append(self._values.convert(self._tree.further[number, number]))
        pivot = self._add(parts)
        drive = self._add([self._right[number], _negative(self._dot(direction, against))])
        frame.joints.append(_Joint(motion, direction, moments, forces, pivot, drive))
        twist, pull = (self._divided(vector, pivot) for vector in (moments, forces))
        felt.turning = self._less(felt.turning, moments, twist, is_symmetric=True)
        felt.mixed = self._less(felt.mixed, moments, pull)
        felt.moving = self._less(felt.moving, forces, pull, is_symmetric=True)
        felt.moment = self._sum(felt.moment, self._scaled(drive, twist))
        felt.force = self._sum(felt.force, self._scaled(drive, pull))

    def _carry(self, frame: _Frame, below: _Felt) -> None:
        """Add what is felt at a frame to what is felt at the origin of that below it."""
        felt, step = frame.felt, frame.step
        # With d the step and [d] its cross product: H' = H + [d] K, J' = J + [d] Hᵀ + ([d] H'ᵀ)ᵀ.
        carried = _transposed(self._crossed(step, felt.moving))
        mixed = self._plus(felt.mixed, carried)
        first, second = self._crossed(step, felt.mixed), self._crossed(step, mixed)
        turning = _symmetric(
            [self._add([felt.turning[i][j], first[j][i], second[i][j]]) for i, j in ENTRIES]
        )
        below.turning = self._plus(below.turning, turning, is_symmetric=True)
        below.mixed = self._plus(below.mixed, mixed)
        below.moving = self._plus(below.moving, felt.moving, is_symmetric=True)
        moment = self._sum(felt.moment, self._cross(step, felt.force))
        below.moment = self._sum(below.moment, moment)
        below.force = self._sum(below.force, felt.force)

    # Vectors and matrices of values.

    def _add(self, terms: Iterable[ScaledNode]) -> ScaledNode:
        return self._values.add(terms)

    def _multiply(self, a: ScaledNode, b: ScaledNode) -> ScaledNode:
        return self._values.multiply([(a, 1), (b, 1)])

    def _over(self, a: ScaledNode, b: ScaledNode) -> ScaledNode:
        return self._multiply(a, self._values.multiply([(b, -1)]))

    def _vector(self, components: Sequence[Expr]) -> _Vector:
        x, y, z = map(self._values.convert, components)
        return x, y, z

    def _scaled(self, factor: ScaledNode, vector: _Vector) -> _Vector:
        x, y, z = (self._multiply(factor, part) for part in vector)
        return x, y, z

    def _divided(self, vector: _Vector, pivot: ScaledNode) -> _Vector:
        return self._scaled(self._values.multiply([(pivot, -1)]), vector)

    def _sum(self, a: _Vector, b: _Vector) -> _Vector:
        x, y, z = (self._add(pair) for pair in zip(a, b, strict=True))
        return x, y, z

    def _dot(self, a: _Vector, b: _Vector) -> ScaledNode:
        return self._add([self._multiply(x, y) for x, y in zip(a, b, strict=True)])

    def _cross(self, a: _Vector, b: _Vector) -> _Vector:
        x, y, z = (
            self._add([self._multiply(a[i], b[j]), _negative(self._multiply(a[j], b[i]))])
            for i, j in ((1, 2), (2, 0), (0, 1))
        )
        return x, y, z

    def _times(self, matrix: _Matrix, vector: _Vector) -> _Vector:
        x, y, z = (self._dot(row, vector) for row in matrix)
        return x, y, z

    def _crossed(self, vector: _Vector, rows: _Matrix) -> _Matrix:
        """Return the cross products of a vector with the rows of a matrix, as rows."""
        x, y, z = (self._cross(vector, row) for row in rows)
        return x, y, z

    def _plus(self, a: _Matrix, b: _Matrix, *, is_symmetric: bool = False) -> _Matrix:
        if is_symmetric:
            return _symmetric([self._add([a[i][j], b[i][j]]) for i, j in ENTRIES])
        x, y, z = map(self._sum, a, b)
        return x, y, z

    def _less(
        self, matrix: _Matrix, a: _Vector, b: _Vector, *, is_symmetric: bool = False
    ) -> _Matrix:
        """Return a matrix less a bᵀ."""

        def entry(i: int, j: int) -> ScaledNode:
            return self._add([matrix[i][j], _negative(self._multiply(a[i], b[j]))])

        if is_symmetric:
            return _symmetric([entry(i, j) for i, j in ENTRIES])
        x, y, z = ((entry(i, 0), entry(i, 1), entry(i, 2)) for i in range(3))
        return x, y, z


def _negative(value: ScaledNode) -> ScaledNode:
    return -value[0], value[1]


def _transposed(matrix: _Matrix) -> _Matrix:
    x, y, z = zip(*matrix, strict=True)
    return x, y, z


def _symmetric(entries: Sequence[ScaledNode]) -> _Matrix:
    """Return the matrix of the entries at :data:`ENTRIES`."""
    xx, yy, zz, xy, xz, yz = entries
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)
