"""Scenes with a quaternion in place of three angles that turn a body.

Three angles end where the second turn makes two axes one; a quaternion reaches every orientation.
Nothing else of a scene changes, since whatever stands on a body is written over the names of its
axes and of its angular velocity.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from lagrange_cli.scene.bodies import (
    Body,
    Frame,
    FreeTurn,
    Motion,
    QuaternionTurn,
    ThreeAngles,
    Turn,
    bodies_of,
)
from lagrange_cli.scene.language.expression import Expression, Name, Node, names_in
from lagrange_cli.scene.language.rotations import (
    ONE,
    ZERO,
    Nodes,
    called,
    minus,
    named,
    product,
    quotient,
    total,
    whole,
)
from lagrange_cli.scene.model import DeclaredCoordinate, Particle, Scene
from lagrange_cli.scene.reading.chains import SPACE, Placed, Stage, free_turn, turned
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.turns import unit_constraint


@dataclass(frozen=True)
class SceneByQuaternions:
    """A scene in which quaternions turn bodies that three angles turned before.

    Attributes
    ----------
    scene
        The scene.
    parts
        Each part of the quaternions over the angles that it replaces, by its name.
    """

    scene: Scene
    parts: Mapping[str, Expression]


def by_quaternions(scene: Scene, taken: Container[str]) -> SceneByQuaternions | None:
    """Replace angles by quaternions where nothing else refers to them; None if none are.

    Parameters
    ----------
    scene
        The scene.
    taken
        Names that it declares.
    """
    form = SceneByQuaternions(scene, {})
    for body in bodies_of(scene):
        angles = _three_angles(scene, body, _fresh(taken, form.parts))
        form = form if angles is None else _replaced(form, body.name, angles) or form
    return form if form.parts else None


def replaced_angles(former: Scene, present: Scene) -> Iterator[ThreeAngles]:
    """Yield the angles that quaternions have replaced in a scene, by :func:`by_quaternions`."""
    for before, after in zip(bodies_of(former), bodies_of(present), strict=True):
        if before.turns != after.turns:
            (turn,) = after.turns
            assert isinstance(turn, QuaternionTurn)
            angles = _three_angles(former, before, [part.text for part in turn.parts])
            yield from filter(None, [angles])


def _three_angles(scene: Scene, body: Body, parts: Sequence[str]) -> ThreeAngles | None:
    """Return the angles of a body's three turns, each a coordinate; None if it has none such.

    Each turn is about an axis across that of the last; frames without mass may stand between.
    """
    coordinates = {c.name for c in scene.coordinates or () if not c.positive}
    turns = [one for one in body.chain if isinstance(one, Turn) and one.axis in AXES]
    angles = [one.angle.node.name for one in turns if isinstance(one.angle.node, Name)]
    across = all(one.axis != after.axis for one, after in pairwise(turns))
    if len(body.chain) != 3 or len(coordinates.intersection(angles)) != 3 or not across:
        return None
    return ThreeAngles("".join(str(one.axis) for one in turns), tuple(angles), tuple(parts))


def _fresh(taken: Container[str], others: Container[str]) -> list[str]:
    """Return names for the parts of a quaternion."""
    stem = "q"
    while any(f"{stem}{k}" in taken or f"{stem}{k}" in others for k in range(4)):
        stem += "_"
    return [f"{stem}{k}" for k in range(4)]


def _replaced(
    form: SceneByQuaternions, name: str, angles: ThreeAngles
) -> SceneByQuaternions | None:
    """Replace the angles of a body; None if the scene refers to them elsewhere."""
    scene = form.scene
    body = _body(scene, name)
    base = SPACE if body.base is None else _axes_of(_body(scene, body.base))
    written = body.placing[-1]
    parts = tuple(replace(written, node=named(part), text=part) for part in angles.parts)
    turn = QuaternionTurn(parts)
    meanings = _meanings(body, turned(base.stages, [turn])[0][-1])
    between = tuple(f"({frame.name})" for frame in _frames_on_base(body)[:-1])
    dropped = {d.name for d in scene.definitions if d.name.endswith(between)} - meanings.keys()
    remaining = (d for d in scene.definitions if d.name not in dropped)
    unit = unit_constraint(name, body.mark, [turn])
    assert unit is not None  # there is a quaternion
    rewritten = replace(
        scene,
        particles=tuple(_moved(scene, body, turn, base.last.rotation)),
        definitions=tuple(
            replace(d, expression=meanings.get(d.name, d.expression)) for d in remaining
        ),
        constraints=(*scene.constraints, unit),
        coordinates=tuple(_coordinates(scene, angles)),
    )
    names = {part.name for e in rewritten.expressions() for part in names_in(e.node)}
    if not names.union(force.on for force in scene.forces).isdisjoint(dropped.union(angles.angles)):
        return None
    values = zip(angles.parts, _quaternion_of(angles), strict=True)
    over_angles = {part: replace(written, node=value) for part, value in values}
    return SceneByQuaternions(rewritten, {**form.parts, **over_angles})


def _body(scene: Scene, name: str) -> Body:
    return next(body for body in bodies_of(scene) if body.name == name)


def _meanings(body: Body, stage: Stage) -> dict[str, Expression]:
    """Return what the names stand for by which the axes of a body and its ω are written.

    The last column of R after a turn about the third axis has names of the frame below.
    """
    written = (*body.rotation, *body.spin, *body.spin_in_space)
    nodes = (*stage.rotation, *stage.spin, *stage.spin_in_space)
    pairs = zip(written, nodes, strict=True)
    return {e.node.name: replace(e, node=node) for e, node in pairs if isinstance(e.node, Name)}


def _axes_of(body: Body) -> Placed:
    """Return the axes of a body, over the names of the scene."""
    rotation, spin, in_space = (
        [entry.node for entry in entries]
        for entries in (body.rotation, body.spin, body.spin_in_space)
    )
    stage = replace(SPACE.last, rotation=rotation, spin=spin, spin_in_space=in_space)
    return replace(SPACE, stages=(stage,))


def _moved(scene: Scene, body: Body, turn: QuaternionTurn, rotation: Nodes) -> Iterator[Particle]:
    """Yield the particles, with a body that turns by a quaternion and those that stand on it.

    ``rotation`` has the axes before the turn.
    """
    gone = {id(one.angle) for one in body.chain if isinstance(one, Turn)}
    first = _frames_on_base(body)[0]
    slides = (m for m in first.motions if isinstance(m, Motion) and not m.is_turn)
    motions: tuple[Motion | FreeTurn, ...] = (
        *slides,
        free_turn(rotation, turn, body.name, body.mark),
    )
    frames = {body.frame: replace(first, name=body.name, motions=motions)}
    for particle in scene.particles:
        if not isinstance(particle, Body):
            yield particle
            continue
        placing = tuple(e for e in particle.placing if id(e) not in gone)
        if len(placing) < len(particle.placing):
            placing = (*placing, *turn.parts)
        moved = replace(particle, frame=_over(particle.frame, frames), placing=placing)
        if particle is body:
            moved = replace(moved, turns=(turn,), chain=(turn,), on=body.base)
        yield moved


def _frames_on_base(body: Body) -> list[Frame]:
    """List the frames between a body and the one that it stands on, the lowest first."""
    frames = [body.frame]
    while frames[0].parent is not None and frames[0].parent.name != body.base:
        frames.insert(0, frames[0].parent)
    return frames


def _over(frame: Frame, frames: dict[Frame, Frame]) -> Frame:
    """Return a frame that stands on others in place of some; each frame is replaced once."""
    if frame not in frames and frame.parent is not None:
        frames[frame] = replace(frame, parent=_over(frame.parent, frames))
    return frames.setdefault(frame, frame)


def _coordinates(scene: Scene, angles: ThreeAngles) -> Iterator[DeclaredCoordinate]:
    """Yield the declared coordinates, with the parts of a quaternion in place of three angles."""
    fresh: Iterable[str] = angles.parts
    for coordinate in scene.coordinates or ():
        if coordinate.name not in angles.angles:
            yield coordinate
            continue
        yield from (DeclaredCoordinate(name, coordinate.mark) for name in fresh)
        fresh = ()


def _quaternion_of(angles: ThreeAngles) -> list[Node]:
    """Compose half the angles: q ∘ (c + s e₁) = (q₀c − q₁s, q₁c + q₀s, q₂c + q₃s, q₃c − q₂s)."""
    parts: list[Node] = [ONE, ZERO, ZERO, ZERO]
    for axis, angle in zip(angles.axes, angles.angles, strict=True):
        half = quotient(named(angle), whole(2))
        cosine, sine = called("cos", half), called("sin", half)
        a, b, c = (1 + (AXES.index(axis) + k) % 3 for k in range(3))
        q = parts.copy()
        parts[0] = total([product(q[0], cosine), minus(product(q[a], sine))])
        parts[a] = total([product(q[a], cosine), product(q[0], sine)])
        parts[b] = total([product(q[b], cosine), product(q[c], sine)])
        parts[c] = total([product(q[c], cosine), minus(product(q[b], sine))])
    return parts
