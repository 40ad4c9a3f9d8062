"""Random closed loops of rigid bodies, each as two scenes that are cut open in different places."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lagrange_cli.mechanics.equations import Equations

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Loop:
    """A loop as two scenes, and values of the coordinates of both at one state.

    Attributes
    ----------
    scenes
        Relative coordinates with the loop cut at its end, and every body with coordinates of its
        own, or another cut.
    states
        For each scene the coordinates, by name, that satisfy its equations.
    common
        Names of the coordinates of the first scene, which the second one has too.
    """

    scenes: tuple[str, str]
    states: tuple[dict[str, float], dict[str, float]]
    common: tuple[str, ...]


def planar_loop(seed: int) -> Loop:
    """Draw a loop of three to five bars in a plane: hinges as angles, and as pins of free bars."""
    source = random.Random(seed)
    count = source.choice((3, 3, 4, 5))
    lengths = [source.uniform(0.5, 1.5) for _ in range(count)]
    angles = [source.uniform(-1.5, 1.5) for _ in range(count)]
    centres = [(source.uniform(0, 1), 0, source.uniform(-0.3, 0.3)) for _ in range(count)]
    masses = [(source.uniform(0.5, 2), source.uniform(0.05, 0.5)) for _ in range(count)]
    # Decimals as the scene has them; the place of the last hinge is that of the end of the chain.
    arms = [(a * math.cos(t), a * math.sin(t)) for a, t in zip(lengths, angles, strict=True)]
    ends = np.cumsum(arms, axis=0)
    x, z = map(float, ends[-1])

    def body(k: int) -> str:
        mass, moment = masses[k]
        return f"centre: {list(centres[k])}, mass: {mass}, inertia: {moment}"

    chain = "plane: xz\nbodies:\n"
    free = chain
    for k in range(count):
        below = f"on: b{k - 1}, at: [{lengths[k - 1]}, 0, 0], turn: t{k} - t{k - 1}"
        chain += f"  b{k}: {{{below if k else 'turn: t0'}, {body(k)}}}\n"
        free += f"  b{k}: {{at: [x{k}, 0, z{k}], turn: t{k}, {body(k)}}}\n"
    last = f"  end: {{on: b{count - 1}, at: [{lengths[-1]}, 0, 0]}}\n  base: [{x!r}, 0, {z!r}]\n"
    chain += f"points:\n{last}constraints: {{loop: {{pin: [end, base]}}}}\n"
    free += f"points:\n{last}"
    pins = ["pin0: {pin: [origin, start0]}", "loop: {pin: [end, base]}"]
    for k in range(count):
        free += f"  start{k}: {{on: b{k}}}\n  tip{k}: {{on: b{k}, at: [{lengths[k]}, 0, 0]}}\n"
        pins += [f"pin{k}: {{pin: [tip{k - 1}, start{k}]}}"] if k else []
    free += f"constraints: {{{', '.join(pins)}}}\n"
    names = [f"t{k}" for k in range(count)]
    own = [n for k in range(count) for n in (f"x{k}", f"z{k}", f"t{k}")]
    tail = "potentials: {weight: {gravity: 9.81}}\n"
    starts = np.vstack([[0, 0], ends[:-1]])
    values = dict(zip(names, angles, strict=True))
    places = {f"{a}{k}": float(starts[k][j]) for k in range(count) for j, a in enumerate("xz")}
    return Loop(
        (
            chain + f"coordinates: [{', '.join(names)}]\n" + tail + _near(values),
            free + f"coordinates: [{', '.join(own)}]\n" + tail + _near({**values, **places}),
        ),
        (values, {**values, **places}),
        tuple(names),
    )


def _near(values: dict[str, float]) -> str:
    return "near: {" + ", ".join(f"{name}: {value!r}" for name, value in values.items()) + "}\n"


def spatial_loop(seed: int) -> Loop:
    """Draw a crank, a coupler and a rocker in space: the coupler on the crank, and free."""
    source = random.Random(seed)
    crank, coupler = source.uniform(0.5, 1), source.uniform(1, 2)
    q, p, a, b, c = (source.uniform(-1, 1) for _ in range(5))
    tip = np.array([crank * math.cos(q), crank * math.sin(q), 0])
    # Axes of the coupler after turns a about x and b about y; it lies along z.
    along = np.array([math.sin(b), -math.sin(a) * math.cos(b), math.cos(a) * math.cos(b)])
    end = tip + coupler * along
    rocker = source.uniform(0.5, 1)
    pivot = end - rocker * np.array([0, math.cos(p), math.sin(p)])
    moments = [sorted(source.uniform(0.2, 0.35) for _ in range(3)) for _ in range(3)]
    turn = "turn: [x: a, y: b, z: c]"
    shared = f"centre: [0.1, 0, {coupler / 3}], mass: 1.5, inertia: {moments[1]}"
    arms = (
        f"  crank: {{turn: {{z: q}}, centre: [0.3, 0.1, 0], mass: 1, inertia: {moments[0]}}}\n"
        f"  rocker: {{at: {[float(x) for x in pivot]}, turn: {{x: p}}, centre: [0, 0.2, 0.1],"
        f" mass: 2, inertia: {moments[2]}}}\n"
    )
    points = (
        f"points:\n  tip: {{on: crank, at: [{crank}, 0, 0]}}\n  end: {{on: coupler, at: [0, 0,"
        f" {coupler}]}}\n  joint: {{on: rocker, at: [0, {rocker}, 0]}}\n  start: {{on: coupler}}\n"
    )
    weight = "potentials: {weight: {gravity: 9.81}}\n"
    place = f"[{crank}*cos(q), {crank}*sin(q), 0]"
    values = {"q": q, "p": p, "a": a, "b": b, "c": c}
    places = dict(zip("xyz", map(float, tip), strict=True))
    return Loop(
        (
            f"bodies:\n{arms}  coupler: {{at: {place}, {turn}, {shared}}}\n{points}"
            "constraints: {loop: {pin: [end, joint]}}\n"
            f"coordinates: [q, p, a, b, c]\n{weight}{_near(values)}",
            f"bodies:\n{arms}  coupler: {{at: [x, y, z], {turn}, {shared}}}\n{points}"
            "constraints: {one: {pin: [tip, start]}, two: {pin: [end, joint]}}\n"
            f"coordinates: [q, p, a, b, c, x, y, z]\n{weight}{_near({**values, **places})}",
        ),
        (values, {**values, **places}),
        tuple("qpabc"),
    )


class Motion:
    """Velocities that the closures of equations allow at a state, and accelerations."""

    def __init__(self, equations: Equations, state: dict[str, float]) -> None:
        system = equations.system
        self.names = [c.name for c in system.coordinates]
        self._q = np.array([state[name] for name in self.names])
        own = [*(c.q for c in system.coordinates), *(c.v for c in system.coordinates)]
        n, m = len(self.names), len(system.closures)
        entries = [row[k] for row in system.mass_matrix for k in range(n)]
        slopes = [c.gradient[k] for c in system.closures for k in range(n)]
        biases = [c.bias for c in system.closures]
        missed = [c.expression for c in system.closures]
        self._shape = n, m
        self._function = sp.lambdify(
            [own], [*entries, *system.forcing, *slopes, *biases, *missed], cse=True
        )

    def _parts(self, v: Vector) -> tuple[Vector, Vector, Vector, Vector, Vector]:
        n, m = self._shape
        values = np.array(self._function(np.concatenate([self._q, v])), dtype=float)
        cuts = np.cumsum([n * n, n, m * n, m])
        mass, forcing, slopes, bias, missed = np.split(values, cuts)
        return mass.reshape(n, n), forcing, slopes.reshape(m, n), bias, missed

    @property
    def missed(self) -> float:
        """The largest value of a closure."""
        return float(np.abs(self._parts(np.zeros(self._shape[0]))[-1]).max())

    def velocity(self, wanted: dict[str, float]) -> Vector:
        """Return velocities that have the wanted ones among them, as far as closures allow."""
        n, _ = self._shape
        slopes = self._parts(np.zeros(n))[2]
        free = np.linalg.svd(slopes)[2][np.linalg.matrix_rank(slopes) :]
        rows = [self.names.index(name) for name in wanted]
        amounts = np.linalg.lstsq(free[:, rows].T, np.array(list(wanted.values())), rcond=None)[0]
        velocity: Vector = amounts @ free
        return velocity

    def accelerations(self, v: Vector) -> dict[str, float]:
        mass, forcing, slopes, bias, _ = self._parts(v)
        m = len(slopes)
        whole = np.block([[mass, -slopes.T], [slopes, np.zeros((m, m))]])
        solution = np.linalg.solve(whole, np.concatenate([forcing, -bias]))
        return dict(zip(self.names, map(float, solution), strict=False))
