"""Reading ``frames``, ``bodies`` and points on them.

A frame stands on another one, at a place in its axes, after turns about axes as the earlier turns
left them. What they imply, positions, axes and angular velocities, is written out as definitions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from lagrange_cli.errors import Mark
from lagrange_cli.scene.bodies import (
    AnyTurn,
    Body,
    ComposedExpression,
    Frame,
    QuaternionTurn,
    Shape,
    Vector,
    rotation_term,
)
from lagrange_cli.scene.language.expression import Expression, Node
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.language.rotations import Nodes, is_zero, times
from lagrange_cli.scene.model import Constraint, Definition, Point, Term
from lagrange_cli.scene.reading.chains import (
    NO_VECTOR,
    SPACE,
    Placed,
    in_tree,
    position_of,
    turned,
    turning_energy,
    with_names,
)
from lagrange_cli.scene.reading.declarations import read_latex, read_point, with_indices
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.inertia import number_of, read_inertia, shape_of
from lagrange_cli.scene.reading.source import Mapping as Entries
from lagrange_cli.scene.reading.source import Scalar, SourceNode
from lagrange_cli.scene.reading.turns import (
    across_plane,
    read_turns,
    unit_constraint,
    vector_in_plane,
    vector_of,
)

_Kind: TypeAlias = Literal["frame", "body"]

_PLACED = ("on", "at", "turn")


@dataclass(frozen=True)
class _Mass:
    """The mass of a body, its centre, and its inertia about that, in its axes."""

    mass: Expression
    centre: Vector | None
    tensor: Nodes
    shape: Shape | None
    mark: Mark
    latex: str | None
    planar: bool


@dataclass(frozen=True)
class _Declared:
    """A frame or a body as it is written.

    Attributes
    ----------
    key
        Its name and place.
    what
        Description of it in messages.
    on
        The frame that it stands on, with its place; None for space.
    at
        Its origin in the axes of that; None for the origin there.
    turns
        Its turns.
    mass
        Its mass and inertia; None for a frame.
    """

    key: Scalar
    what: str
    on: tuple[str, Mark] | None
    at: Vector | None
    turns: tuple[AnyTurn, ...]
    mass: _Mass | None


@dataclass
class Frames:
    """Frames and bodies of a scene as they are read.

    Attributes
    ----------
    declared
        Frames and bodies as written, by name.
    placed, tree
        Those that are composed so far, and their places in the tree of frames.
    definitions, constraints, kinetic
        Definitions, constraints of quaternions and kinetic energies that they stand for.
    bodies
        The rigid bodies.
    complete
        True once all are composed.
    """

    declared: dict[str, _Declared] = field(default_factory=dict)
    placed: dict[str, Placed] = field(default_factory=dict)
    tree: dict[str, Frame] = field(default_factory=dict)
    definitions: list[Definition] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)
    kinetic: list[Term] = field(default_factory=list)
    bodies: list[Body] = field(default_factory=list)
    complete: bool = False


def read_frames(node: SourceNode, reading: Reading) -> Frames:
    """Read ``frames``, which are composed once bodies are known as well."""
    frames = Frames()
    _declare(node, "frames", "frame", reading, frames)
    return frames


def read_bodies(node: SourceNode, reading: Reading) -> None:
    """Read ``bodies``, and compose them and all frames; bodies are among the particles then."""
    frames: Frames = reading.values.get("frames") or Frames()
    reading.values["frames"] = frames
    _declare(node, "bodies", "body", reading, frames)
    compose(frames, reading)
    particles = reading.values.get("particles") or ()
    reading.values["particles"] = (*particles, *frames.bodies)


def read_points(node: SourceNode, reading: Reading) -> tuple[Point, ...]:
    """Read ``points``: positions in space, or in the axes of a frame."""
    frames: Frames = reading.values.get("frames") or Frames()
    compose(frames, reading)
    points = []
    for key, value in reading.named(node, "points", symbols=False):
        point = (
            _point_on(key, value, reading)
            if isinstance(value, Entries) and any(k.text in ("on", "at") for k, _ in value.entries)
            else read_point(key, value, reading)
        )
        if point:
            points.append(point)
    return tuple(points)


def _point_on(key: Scalar, node: Entries, reading: Reading) -> Point | None:
    what = f"point '{key.text}'"
    fields = reading.fields(node, what, ("on", "at", "latex"), required=("on",))
    at = vector_of(fields["at"], "at", what, reading) if "at" in fields else None
    latex = with_indices(read_latex(fields, what, reading), key.text)
    on = frame_named(fields["on"], f"'on' of {what}", reading) if "on" in fields else None
    if on is None or ("at" in fields and at is None):
        return None
    place = on[1].place(NO_VECTOR if at is None else [part.node for part in at])
    position = position_of(place, key.text, key.mark)
    frames: Frames = reading.values["frames"]
    return Point(key.text, key.mark, position, latex, _body_below(on[0], frames))


def _body_below(name: str | None, frames: Frames) -> str | None:
    """Return the frame if it is a body, or the body that it stands on, None in space."""
    while name is not None and frames.declared[name].mass is None:
        on = frames.declared[name].on
        name = None if on is None else on[0]
    return name


def in_axes_of(on: SourceNode, components: Vector, what: str, reading: Reading) -> Vector | None:
    """Return components along the axes of a frame, along those of space."""
    named = frame_named(on, what, reading)
    if named is None:
        return None
    parts = times(named[1].last.rotation, [c.node for c in components])
    x, y, z = (
        ComposedExpression(part, written.text, written.origin, exact=False)
        for part, written in zip(parts, components, strict=True)
    )
    return x, y, z


def frame_named(node: SourceNode, what: str, reading: Reading) -> tuple[str, Placed] | None:
    """Read the name of a frame or body; return it with the frame."""
    frames: Frames = reading.values.get("frames") or Frames()
    compose(frames, reading)
    name = _frame_named(node, what, frames, reading)
    return None if name is None or name not in frames.placed else (name, frames.placed[name])


# Entries as they are written.


def _declare(node: SourceNode, section: str, kind: _Kind, reading: Reading, frames: Frames) -> None:
    taken = {b.name: "particle" for b in reading.values.get("particles") or ()}
    taken |= dict.fromkeys(frames.declared, "frame")
    for key, value in reading.named(node, section, symbols=False):
        what = f"{kind} '{key.text}'"
        if key.text in taken:
            reading.problems.add(
                f"'{key.text}' is both a {taken[key.text]} and a {kind}", key.mark, rule="clash"
            )
            continue
        wanted = (*_PLACED, "mass", "centre", "inertia", "latex") if kind == "body" else _PLACED
        mapping = reading.mapping(value, what, f"a mapping {{{', '.join(wanted)}}}")
        if mapping is not None:
            needed = ("mass",) if kind == "body" else ()
            fields = reading.fields(mapping, what, wanted, required=needed)
            entry = _declared(key, what, mapping, fields, reading)
            if entry is not None:
                frames.declared[key.text] = entry


def _declared(
    key: Scalar, what: str, node: Entries, fields: Mapping[str, SourceNode], reading: Reading
) -> _Declared | None:
    before = len(reading.problems.errors)
    on = None
    if "on" in fields:
        if isinstance(fields["on"], Scalar):
            name = reading.reference(fields["on"])
            on = None if name is None else (name, fields["on"].mark)
        else:
            reading.expected("a frame or body", f"'on' of {what}", fields["on"])
    at = vector_in_plane("at", fields, what, reading)
    turns = read_turns(fields["turn"], what, reading) if "turn" in fields else ()
    mass = _mass(key, what, node, fields, reading) if "mass" in fields else None
    if len(reading.problems.errors) > before or turns is None:
        return None
    return _Declared(key, what, on, at, turns, mass)


def _mass(
    key: Scalar, what: str, node: Entries, fields: Mapping[str, SourceNode], reading: Reading
) -> _Mass | None:
    """Read the mass of a body and its inertia; None for a body without mass, which is a frame."""
    mass = reading.expression(fields["mass"], f"the mass of {what}")
    centre = vector_in_plane("centre", fields, what, reading)
    latex = with_indices(read_latex(dict(fields), what, reading), key.text)
    if mass is None or ("centre" in fields and centre is None):
        return None
    if number_of(mass.node) == 0:
        if "inertia" in fields:
            reading.problems.add(
                f"{what} has inertia but no mass",
                fields["inertia"].mark,
                hint="a body without mass has no moments of inertia: leave 'inertia' out",
                rule="inertia",
            )
        return None
    if "inertia" not in fields:
        reading.problems.add(
            f"{what} has no 'inertia'",
            node.mark,
            hint="a mass that does not turn is a particle; that of a body has moments about its"
            " centre: inertia: [Ixx, Iyy, Izz] or {rod: l}",
            rule="missing",
        )
        return None
    place = NO_VECTOR if centre is None else tuple(part.node for part in centre)
    across = across_plane(reading)
    tensor = read_inertia(fields["inertia"], what, reading, mass.node, place, across)
    if tensor is None:
        return None
    shape = shape_of(fields["inertia"], what, reading, across)
    return _Mass(mass, centre, tensor, shape, fields["inertia"].mark, latex, across is not None)


def _frame_named(node: SourceNode, what: str, frames: Frames, reading: Reading) -> str | None:
    if not isinstance(node, Scalar):
        reading.expected("a frame or body", what, node)
        return None
    name = reading.reference(node)
    if name is None or name in frames.declared:
        return name
    if reading.doubtful.isdisjoint(("frames", "bodies")):
        _unknown_frame(name, node.mark, what, frames, reading)
    return None


def _unknown_frame(name: str, mark: Mark, what: str, frames: Frames, reading: Reading) -> None:
    known = list(frames.declared)
    otherwise = f"known are {', '.join(known)}" if known else "declare it in 'frames' or 'bodies'"
    reading.problems.add(
        f"unknown frame or body {shown(name)} in {what}",
        mark,
        hint=suggestion(name, known, otherwise),
        rule="unknown-name",
    )


# Composition along chains.


def compose(frames: Frames, reading: Reading) -> None:
    """Compose all frames, each after the one that it stands on."""
    if frames.complete:
        return
    frames.complete = True
    for name in frames.declared:
        _place(name, frames, reading, ())
    for name, entry in frames.declared.items():
        if name in frames.placed and entry.mass is not None:
            _add_body(entry, entry.mass, frames.placed[name], frames)


def _place(name: str, frames: Frames, reading: Reading, above: tuple[str, ...]) -> None:
    if name in frames.placed:
        return
    entry = frames.declared[name]
    base = SPACE
    if entry.on is not None:
        parent, mark = entry.on
        if parent in (*above, name):
            chain = [*above, name]
            circle = " -> ".join([*chain[chain.index(parent) :], parent])
            reading.problems.add(f"frames stand on each other: {circle}", mark, rule="cycle")
            return
        if parent not in frames.declared:
            if reading.doubtful.isdisjoint(("frames", "bodies")):
                _unknown_frame(parent, mark, entry.what, frames, reading)
            return
        _place(parent, frames, reading, (*above, name))
        if parent not in frames.placed:
            return
        base = frames.placed[parent]
    placed, turns = _moved(base, entry)
    below = None if entry.on is None else frames.tree[entry.on[0]]
    frames.tree[name] = in_tree(entry.key, below, base, entry.at, turns)
    unit = unit_constraint(name, entry.key.mark, entry.turns)
    frames.constraints += [unit] if unit else []
    frames.placed[name] = with_names(placed, name, entry.key.mark, frames.definitions)


def _moved(base: Placed, entry: _Declared) -> tuple[Placed, list[tuple[Nodes, AnyTurn]]]:
    """Move axes to the place of a frame that stands on them, and turn them as it is turned."""
    origin = base.origin if entry.at is None else base.place([part.node for part in entry.at])
    placing = (*base.placing, *(entry.at or ()), *_angles(entry.turns))
    stages, turns = turned(base.stages, entry.turns)
    return Placed(stages, origin, placing), turns


def placed_against(name: str, base: str, reading: Reading) -> Placed | None:
    """Compose a frame in the axes of another; None unless it stands on that."""
    frames: Frames = reading.values.get("frames") or Frames()
    chain = [frames.declared[name]]
    while (on := chain[-1].on) is not None and on[0] != base:
        chain.append(frames.declared[on[0]])
    if on is None:
        return None
    placed = SPACE
    for entry in reversed(chain):
        placed, _ = _moved(placed, entry)
    return placed


def _angles(turns: Iterable[AnyTurn]) -> Iterator[Expression]:
    for one in turns:
        if isinstance(one, QuaternionTurn):
            yield from one.parts
            continue
        if not isinstance(one.axis, str):
            yield from one.axis
        yield one.angle


def _turns_on_body(entry: _Declared, frames: Frames) -> tuple[AnyTurn, ...]:
    """Return the turns of a body and of the frames below, none if one of these displaces it."""
    turns = entry.turns
    while entry.on is not None and frames.declared[entry.on[0]].mass is None:
        if entry.at is not None:
            return ()
        entry = frames.declared[entry.on[0]]
        turns = (*entry.turns, *turns)
    return turns


def _add_body(entry: _Declared, mass: _Mass, placed: Placed, frames: Frames) -> None:
    """Add a body: its centre of mass as a particle's position, and its energy of turning."""
    name, mark = entry.key.text, entry.key.mark
    spin = placed.last.spin

    def implied(node: Node, text: str, place: Mark = mark) -> Expression:
        return ComposedExpression(node, text, place, exact=False)

    x, y, z = (implied(node, f"omega({name})") for node in spin)
    in_space = [implied(node, f"omega({name})") for node in placed.last.spin_in_space]
    moments = [implied(entry, "inertia", mass.mark) for entry in mass.tensor]
    at = NO_VECTOR if mass.centre is None else [part.node for part in mass.centre]
    body = Body(
        name,
        mark,
        mass.mass,
        position_of(placed.place(at), name, mark),
        mass.latex,
        on=None if entry.on is None else entry.on[0],
        base=None if entry.on is None else _body_below(entry.on[0], frames),
        chain=_turns_on_body(entry, frames),
        centre=mass.centre,
        shape=mass.shape,
        turns=entry.turns,
        frame=frames.tree[name],
        rotation=tuple(implied(e, f"R({name})") for e in placed.last.rotation),
        spin=(x, y, z),
        spin_in_space=(in_space[0], in_space[1], in_space[2]),
        inertia=(
            (moments[0], moments[1], moments[2]),
            (moments[3], moments[4], moments[5]),
            (moments[6], moments[7], moments[8]),
        ),
        inertia_mark=mass.mark,
        placing=placed.placing,
        planar=mass.planar,
    )
    frames.bodies.append(body)
    energy = turning_energy(mass.tensor, spin)
    if not is_zero(energy):
        term = rotation_term(name)
        frames.kinetic.append(Term(term, mark, implied(energy, term)))
