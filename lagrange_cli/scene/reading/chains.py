"""Chains of frames: where each stands and turns, composed over those below it.

Turns about one axis that follow each other are one turn by the sum of their angles, so that links
in a plane have the angles that books give them. The angular velocity along a frame's axes follows
turn by turn, ω' = Eᵀ ω + n α̇ (J. Angeles, Fundamentals of Robotic Mechanical Systems, 4th ed. 2014,
section 3.2).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from lagrange_cli.errors import Mark
from lagrange_cli.scene.bodies import (
    AnyTurn,
    Axis,
    ComposedExpression,
    Frame,
    FreeTurn,
    Motion,
    QuaternionTurn,
    Turn,
    Vector,
)
from lagrange_cli.scene.language.expression import (
    ANGULAR_VELOCITIES,
    Expression,
    Mul,
    Name,
    Node,
)
from lagrange_cli.scene.language.rotations import (
    IDENTITY,
    ONE,
    ZERO,
    Nodes,
    called,
    composed,
    implied_name,
    is_atom,
    is_zero,
    minus,
    named,
    product,
    quaternion_matrix,
    quaternion_spin,
    quotient,
    square,
    times,
    total,
    transposed,
    turn,
    whole,
)
from lagrange_cli.scene.model import Definition
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.inertia import number_of
from lagrange_cli.scene.reading.source import Scalar

#: Names of a frame's axes in those of space, of its origin, and of ω in space and along its axes.
_ENTRIES = [f"R_{i}{j}" for i in "123" for j in "123"]
_ORIGIN = [f"o_{i}" for i in "123"]
_IN_SPACE, _ALONG_AXES = ANGULAR_VELOCITIES[:3], ANGULAR_VELOCITIES[3:]

NO_VECTOR: tuple[Node, ...] = (ZERO, ZERO, ZERO)


@dataclass(frozen=True)
class Stage:
    """The axes after one turn of a chain.

    Attributes
    ----------
    axis, angle, reverse
        The turn; an axis of coordinates by its number, None for another direction.
    rotation
        Its axes in those of space, entries by rows.
    spin, spin_in_space
        ω along its axes, and along those of space.
    """

    axis: int | None
    angle: Node
    reverse: bool
    rotation: Nodes
    spin: Nodes
    spin_in_space: Nodes


_SPACE = Stage(None, ZERO, False, IDENTITY, NO_VECTOR, NO_VECTOR)


@dataclass(frozen=True)
class Placed:
    """A frame with its chain of turns, over the names of the scene."""

    stages: tuple[Stage, ...]
    origin: Nodes
    placing: tuple[Expression, ...] = ()

    @property
    def last(self) -> Stage:
        return self.stages[-1]

    def place(self, at: Nodes) -> tuple[Node, ...]:
        """Return a place given in the frame's axes, in those of space."""
        parts = times(self.last.rotation, at)
        return tuple(total([o, part]) for o, part in zip(self.origin, parts, strict=True))


#: The axes of space.
SPACE = Placed((_SPACE,), NO_VECTOR)


def turned(
    chain: Sequence[Stage], turns: Iterable[AnyTurn]
) -> tuple[tuple[Stage, ...], list[tuple[Nodes, AnyTurn]]]:
    """Add turns to a chain; return it with the turns.

    Each has its axis along those of space; one by a quaternion has R before it.
    """
    stages = list(chain)
    axes: list[tuple[Nodes, AnyTurn]] = []
    for one in turns:
        if isinstance(one, QuaternionTurn):
            axes.append((stages[-1].rotation, one))
            stages.append(_turned_freely(stages[-1], one))
        else:
            axes.append((_add_turn(stages, one), one))
    return tuple(stages), axes


def _turned_freely(base: Stage, one: QuaternionTurn) -> Stage:
    parts = [part.node for part in one.parts]
    matrix = quaternion_matrix(parts)
    before = times(transposed(matrix), base.spin)
    in_space = times(base.rotation, quaternion_spin(parts, in_space=True))
    spin = zip(before, quaternion_spin(parts, in_space=False), strict=True)
    return Stage(
        None,
        ZERO,
        False,
        composed(base.rotation, matrix),
        [total(pair) for pair in spin],
        [total(pair) for pair in zip(base.spin_in_space, in_space, strict=True)],
    )


def _add_turn(stages: list[Stage], one: Turn) -> Nodes:
    """Add a turn to a chain, and return its axis along those of space.

    It is one turn with that before it if both are about the same axis.
    """
    number = AXES.index(one.axis) if isinstance(one.axis, str) else None
    angle, reverse = one.angle.node, one.reverse
    if number is not None and stages[-1].axis == number:
        merged = stages.pop()
        same = merged.reverse == reverse
        angle = total([merged.angle, angle if same else minus(angle)])
        reverse = merged.reverse
    base = stages[-1]
    axis = _unit(one.axis)
    matrix = turn(axis, angle, reverse=reverse)
    rate = called("dot", angle)
    if reverse:
        rate = minus(rate)
    before = times(transposed(matrix), base.spin)
    added = [product(part, rate) for part in axis]
    spin = [total(pair) for pair in zip(before, added, strict=True)]
    axis_in_space = times(base.rotation, axis)
    in_space = [product(part, rate) for part in axis_in_space]
    stages.append(
        Stage(
            number,
            angle,
            reverse,
            composed(base.rotation, matrix),
            spin,
            [total(pair) for pair in zip(base.spin_in_space, in_space, strict=True)],
        )
    )
    return tuple(map(minus, axis_in_space)) if one.reverse else axis_in_space


def in_tree(
    key: Scalar,
    parent: Frame | None,
    base: Placed,
    at: Vector | None,
    turns: Iterable[tuple[Nodes, AnyTurn]],
) -> Frame:
    """Return a frame with its motions against the one that it stands on, ``base``.

    The turns are as :func:`turned` gives them.
    """
    rotation = base.last.rotation

    def along(nodes: Nodes) -> Vector:
        return _along(nodes, key.text, key.mark)

    slides = [
        Motion(along(rotation[k::3]), amount, is_turn=False)
        for k, amount in enumerate(at or ())
        if not is_zero(amount.node)
    ]

    def turning(axis: Nodes, one: AnyTurn) -> Motion | FreeTurn:
        if isinstance(one, QuaternionTurn):
            return free_turn(axis, one, key.text, key.mark)
        return Motion(along(axis), one.angle, is_turn=True)

    hinges = [turning(axis, one) for axis, one in turns]
    step = times(rotation, NO_VECTOR if at is None else [part.node for part in at])
    return Frame(key.text, parent, along(step), (*slides, *hinges))


def free_turn(rotation: Nodes, one: QuaternionTurn, name: str, mark: Mark) -> FreeTurn:
    """Return the motion of a frame that a quaternion turns, from the axes before the turn."""
    spin = quaternion_spin([part.node for part in one.parts], in_space=True)
    axes = tuple(_along(rotation[k::3], name, mark) for k in range(3))
    return FreeTurn(axes, _along(spin, name, mark), one.parts)


def _along(nodes: Nodes, name: str, mark: Mark) -> Vector:
    x, y, z = (ComposedExpression(n, f"axis of {name}", mark, exact=False) for n in nodes)
    return x, y, z


def _unit(axis: Axis) -> tuple[Node, ...]:
    """Return the unit vector along an axis."""
    if isinstance(axis, str):
        return tuple(ONE if name == axis else ZERO for name in AXES)
    values = [number_of(part.node) for part in axis]
    exact = [Fraction(v) for v in values if isinstance(v, Fraction | int)]
    if len(exact) == 3:
        squared = sum((v * v for v in exact), Fraction(0))
        root = Fraction(math.isqrt(squared.numerator), math.isqrt(squared.denominator))
        if root * root == squared:
            return tuple(_number(v / root) for v in exact)
        length = called("sqrt", _number(squared))
        return tuple(quotient(_number(v), length) for v in exact)
    length = called("sqrt", total([square(part.node) for part in axis]))
    return tuple(quotient(part.node, length) for part in axis)


def _number(value: Fraction) -> Node:
    if value < 0:
        return minus(_number(-value))
    if value.denominator == 1:
        return ONE if value == 1 else ZERO if value == 0 else whole(value.numerator)
    return quotient(whole(value.numerator), whole(value.denominator))


def with_names(placed: Placed, frame: str, mark: Mark, definitions: list[Definition]) -> Placed:
    """Name what a frame is composed of, so that frames on it are written over these names."""

    def over_names(stems: Iterable[str], nodes: Nodes, *, always: bool = False) -> list[Node]:
        results = []
        for stem, node in zip(stems, nodes, strict=True):
            name = implied_name(stem, frame)
            if always or not is_atom(node):
                meaning = ComposedExpression(node, name, mark, exact=False)
                definitions.append(Definition(name, mark, meaning))
            results.append(node if is_atom(node) else named(name))
        return results

    last = placed.last
    stage = Stage(
        last.axis,
        last.angle,
        last.reverse,
        over_names(_ENTRIES, last.rotation),
        over_names(_ALONG_AXES, last.spin, always=True),
        over_names(_IN_SPACE, last.spin_in_space, always=True),
    )
    origin = over_names(_ORIGIN, placed.origin)
    return Placed((*placed.stages[:-1], stage), origin, placed.placing)


def position_of(place: Nodes, name: str, mark: Mark) -> Vector:
    """Return a position; a name that stands alone there is one of the scene's own."""
    x, y, z = (
        ComposedExpression(
            Mul((("*", ONE), ("*", node)), node.span) if _is_implied(node) else node,
            f"{axis}_{name}",
            mark,
            exact=False,
        )
        for axis, node in zip(AXES, place, strict=True)
    )
    return x, y, z


def _is_implied(node: Node) -> bool:
    return isinstance(node, Name) and "(" in node.name


def turning_energy(tensor: Nodes, spin: Nodes) -> Node:
    """Return ½ ω·Iω, terms with one moment together."""
    terms = [product(tensor[4 * i], square(spin[i])) for i in range(3)]
    terms += [
        product(whole(2), tensor[3 * i + j], spin[i], spin[j]) for i, j in ((0, 1), (0, 2), (1, 2))
    ]
    energy = total(terms)
    return energy if is_zero(energy) else quotient(energy, whole(2))
