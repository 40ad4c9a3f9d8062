"""Random open chains and trees of rigid bodies, as scenes and as SymPy's frames and points."""

from __future__ import annotations

import random
from dataclasses import dataclass

import numpy as np
import sympy as sp
from sympy.physics.mechanics import (
    Inertia,
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

GRAVITY = 9.81

#: Turn about an axis, by its letter or direction.
Turn = str | tuple[int, int, int]


@dataclass(frozen=True)
class TreeBody:
    """A body of a tree; numbers are exact in decimals."""

    parent: int | None
    at: tuple[str, str, str]
    turns: tuple[tuple[Turn, str], ...]
    mass: float
    centre: tuple[float, float, float]
    inertia: np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass(frozen=True)
class Tree:
    """A tree with its coordinates, in order."""

    bodies: tuple[TreeBody, ...]
    coordinates: tuple[str, ...]

    def scene(self) -> str:
        """The tree as a scene."""
        lines = ["bodies:"]
        for k, body in enumerate(self.bodies):
            turns = ", ".join(
                f"{{{axis}: {angle}}}"
                if isinstance(axis, str)
                else f"{{axis: {list(axis)}, angle: {angle}}}"
                for axis, angle in body.turns
            )
            on = "" if body.parent is None else f"on: b{body.parent}, "
            lines.append(
                f"  b{k}: {{{on}at: [{', '.join(body.at)}], turn: [{turns}], mass: {body.mass},"
                f" centre: {list(body.centre)}, inertia: {body.inertia.tolist()}}}"
            )
        lines.append(f"coordinates: [{', '.join(self.coordinates)}]")
        lines.append(f"potentials: {{weight: {{gravity: {GRAVITY}}}}}")
        return "\n".join(lines)


def random_tree(seed: int, number: int) -> Tree:
    """Draw a tree of some bodies with hinges, sliders, offsets and products of inertia."""
    source = random.Random(seed)
    bodies: list[TreeBody] = []
    names: list[str] = []

    def fresh() -> str:
        names.append(f"q{len(names)}")
        return names[-1]

    def length() -> float:
        return round(source.uniform(-0.6, 0.6), 2)

    for k in range(number):
        parent = None if k == 0 or source.random() < 0.15 else source.randrange(k)
        at = [str(length()) for _ in range(3)]
        turns: list[tuple[Turn, str]] = []
        for _ in range(source.choice((0, 1, 1, 2)) if number > 1 else 3):
            # Two turns about one axis would be one.
            axis: Turn = source.choice([e for e in "xyz" if not turns or e != turns[-1][0]])
            if source.random() < 0.2 and not turns:
                axis = source.choice(((1, 2, 2), (1, 0, 1), (0, 3, -4)))
            # Between joints there are fixed turns, too.
            turns.append((axis, fresh() if source.random() < 0.85 else "0.3"))
        if not any(angle.startswith("q") for _, angle in turns):
            at[source.randrange(3)] = fresh()
        bodies.append(
            TreeBody(
                parent,
                (at[0], at[1], at[2]),
                tuple(turns),
                round(source.uniform(0.5, 3), 2),
                (length(), length(), length()),
                _tensor(source),
            )
        )
    return Tree(tuple(bodies), tuple(names))


def _tensor(source: random.Random) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Draw the tensor of some particles about their centre, rounded."""
    places = np.array([[source.gauss(0, 0.3) for _ in range(3)] for _ in range(6)])
    places -= places.mean(axis=0)
    tensor = sum(r @ r * np.eye(3) - np.outer(r, r) for r in places)
    # Rounded numbers stay within the triangle inequality by the last part.
    rounded: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = np.round(tensor, 2) + 0.1 * np.eye(
        3
    )
    return np.round(rounded, 2)


def by_kane(tree: Tree) -> tuple[sp.Matrix, sp.Matrix, list[sp.Expr]]:
    """M, f and the coordinates with their rates, by SymPy's KanesMethod."""
    q = {name: dynamicsymbols(name) for name in tree.coordinates}
    t = dynamicsymbols._t
    space, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(space, 0)
    frames, points, parts, loads = [], [], [], []
    for k, body in enumerate(tree.bodies):
        below = space if body.parent is None else frames[body.parent]
        start = origin if body.parent is None else points[body.parent]
        place = Point(f"o{k}")
        at = [q[e] if e in q else sp.Rational(e) for e in body.at]
        place.set_pos(start, sum((e * n for e, n in zip(at, below, strict=True)), 0 * below.x))
        frame = below
        for j, (axis, angle) in enumerate(body.turns):
            turned = ReferenceFrame(f"b{k}_{j}")
            direction = (
                {"x": frame.x, "y": frame.y, "z": frame.z}[axis]
                if isinstance(axis, str)
                else sum((e * n for e, n in zip(axis, frame, strict=True)), 0 * frame.x)
            )
            turned.orient_axis(frame, direction, q[angle] if angle in q else sp.Rational(angle))
            frame = turned
        mass_centre = place.locatenew(
            f"c{k}",
            sum(
                (sp.Rational(str(e)) * n for e, n in zip(body.centre, frame, strict=True)),
                0 * frame.x,
            ),
        )
        for point in (place, mass_centre):
            point.set_vel(space, point.pos_from(origin).dt(space))
        moments = body.inertia
        tensor = inertia(
            frame,
            *(sp.Rational(str(moments[i, i])) for i in range(3)),
            *(sp.Rational(str(moments[i, j])) for i, j in ((0, 1), (1, 2), (2, 0))),
        )
        mass = sp.Rational(str(body.mass))
        parts.append(RigidBody(f"B{k}", mass_centre, frame, mass, Inertia(tensor, mass_centre)))
        loads.append((mass_centre, -mass * sp.Rational(str(GRAVITY)) * space.z))
        frames.append(frame)
        points.append(place)
    u = [dynamicsymbols(f"u_{name}") for name in tree.coordinates]
    rates = [q[name].diff(t) - u[k] for k, name in enumerate(tree.coordinates)]
    kane = KanesMethod(space, list(q.values()), u, kd_eqs=rates)
    kane.kanes_equations(parts, loads)
    return kane.mass_matrix, kane.forcing, [*q.values(), *u]
