"""Wheels, disks and spheres that roll: bodies whose turning moves a particle.

An angle that no position depends on, and whose rate times a constant length is the speed of a
particle in all motions that the constraints allow, is that of a wheel about the particle if the
scene says where it touches the ground: the particle is at that length from a curve or surface that
the length is no part of, or gravity presses it on a slope and a constraint says that it rolls. A
load on the rope of a drum moves like a wheel, and is none. A coordinate that moves a particle
straight on and turns another body about it at the same speed is that of a wheel with the body on
its rim.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import sympy

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.pictures.sketch.configurations import Function
from lagrange_cli.pictures.sketch.findings import MOST_SOUGHT, SAME

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr, Symbol

    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]
    #: Velocities of a particle, shape (3, k), and rates of an angle in independent motions; the
    #: angle.
    _Rates: TypeAlias = tuple[Array, Array, float]

#: Names of constraints that say of a body that it rolls begin with this.
_ROLLS = "roll"


@dataclass(frozen=True)
class Wheel:
    """A wheel at the start.

    Attributes
    ----------
    particle
        Number of the particle at its centre.
    name
        Name of its angle.
    angle
        The angle at the start, in radians, counted from the place that touches the ground.
    radius, size
        Its radius, and the parameter that it is equal to.
    normal, towards
        Unit vectors: from the ground to the centre, and where the centre goes as the angle grows.
    ground
        The line of places that it can touch, shape (P, 3); None where that is no line.
    """

    particle: int
    name: str
    angle: float
    radius: float
    size: Symbol
    normal: Array
    towards: Array
    ground: Array | None

    def rim(self, centre: Array, turns: Array) -> Array:
        """Return places of the rim, by angles from the place that touches the ground."""
        across = np.cos(turns)[:, None] * self.normal + np.sin(turns)[:, None] * self.towards
        places: Array = centre - self.radius * across
        return places


def find_wheels(configurations: Configurations, down: Array | None) -> list[Wheel]:
    """Find the wheels of a scene; ``down`` is the acceleration of gravity, None without it."""
    equations = configurations.equations
    if max(configurations.particles, len(equations.system.coordinates)) > MOST_SOUGHT:
        return []
    if any(c.rate != 0 and c.kind == "position" for c in equations.system.closures):
        return []
    wheels = list(_with_a_body_on_the_rim(configurations))
    for name, angle in _angles(configurations):
        wheel = next(_about_particles(configurations, down, name, angle), None)
        if wheel is not None and all(
            wheel.particle != known_wheel.particle for known_wheel in wheels
        ):
            wheels.append(wheel)
    return wheels


def _angles(configurations: Configurations) -> Iterator[tuple[str, Expr]]:
    """Return coordinates that no position depends on, and further names of the scene.

    These are abbreviations, and what constraints determine beside the places of bodies.

    Not those that a constraint relates to each other, as of gears: what they roll on may turn.
    """
    moving = frozenset[int]().union(*configurations.depends)
    coordinates = configurations.equations.system.coordinates
    turning = [set(c.coordinate_numbers) - moving for c in configurations.equations.system.closures]
    geared = set().union(*(numbers for numbers in turning if len(numbers) > 1))
    for k, c in enumerate(coordinates):
        if k not in moving | geared:
            yield c.name, c.q
    symbols = {c.q for c in coordinates} | set(configurations.values)
    placed = {name for names in configurations.components for name in names}
    determined = [(c.name, c.position) for c in configurations.equations.system.cartesian_names]
    further = [(name, place) for name, place in determined if name not in placed]
    for name, expression in (*configurations.equations.presentation.abbreviations, *further):
        if expression.free_symbols <= symbols:
            yield name, expression


def _about_particles(
    configurations: Configurations, down: Array | None, name: str, angle: Expr
) -> Iterator[Wheel]:
    for particle in range(configurations.particles):
        try:
            motion = _Motion(configurations, particle, angle)
            for size in configurations.values:
                wheel = _wheel(motion, down, name, size)
                if wheel is not None:
                    yield wheel
        except DomainError:
            continue


def _with_a_body_on_the_rim(configurations: Configurations) -> Iterator[Wheel]:
    """Find wheels whose angle alone moves their centre and a body on their rim."""
    for centre in range(configurations.particles):
        alone = configurations.depends[centre]
        rims = [k for k, on in enumerate(configurations.depends) if on == alone and k != centre]
        if len(alone) == 1:
            tried = (_rim_wheel(configurations, centre, rim, *alone) for rim in rims)
            yield from [wheel for wheel in tried if wheel is not None][:1]


def _rim_wheel(configurations: Configurations, centre: int, rim: int, number: int) -> Wheel | None:
    """Tell whether a body goes round a particle as the rim of a wheel that rolls straight on."""
    try:
        return _rolling_rim(configurations, centre, rim, number)
    except DomainError:
        return None


def _rolling_rim(
    configurations: Configurations, centre: int, rim: int, number: int
) -> Wheel | None:
    spokes = configurations.places[:, rim] - configurations.places[:, centre]
    radius = float(np.linalg.norm(spokes[0]))
    size = _size_of_spoke(configurations, centre, rim, radius)
    if size is None:
        return None
    places = configurations.slopes(number)
    speeds = places[:, centre] / radius
    turning, spokes = (places[:, rim] - places[:, centre]) / radius, spokes / radius
    along, across = ((speeds * part).sum(axis=1)[:, None] for part in (spokes, turning))
    normals = across * spokes - along * turning
    units = [np.linalg.norm(rows, axis=1) - 1 for rows in (spokes, turning, speeds, normals)]
    angles = np.arctan2(-along, -across)[:, 0] - configurations.q[:, number]
    off = [*units, np.ptp(speeds, axis=0), np.ptp(normals, axis=0), np.sin(angles / 2)]
    if max(float(np.abs(part).max()) for part in off) > SAME:
        return None
    contact = configurations.places[0, centre] - radius * normals[0]
    ground = np.array([contact - 2.2 * radius * speeds[0], contact + 2.2 * radius * speeds[0]])
    name, angle = configurations.equations.system.coordinates[number].name, configurations.q[0]
    return Wheel(centre, name, float(angle[number]), radius, size, normals[0], speeds[0], ground)


def _size_of_spoke(
    configurations: Configurations, centre: int, rim: int, radius: float
) -> Symbol | None:
    """Return the parameter that is the distance of two bodies, whatever its value."""
    for size, value in configurations.values.items():
        if radius > 0 and abs(value - radius) <= SAME * radius:
            longer = {size: 1.17 * value}
            places = configurations.moved(configurations.q[0], configurations.times[0], longer)
            if abs(np.linalg.norm(places[rim] - places[centre]) - 1.17 * value) <= SAME * value:
                return size
    return None


class _Motion:
    """The velocity of a particle beside the rate of an angle, in all that constraints allow."""

    def __init__(self, configurations: Configurations, particle: int, angle: Expr) -> None:
        equations = configurations.equations
        self.configurations, self.particle = configurations, particle
        self.position = equations.system.particles[particle].position
        q = [c.q for c in equations.system.coordinates]
        rows = [[sympy.sympify(entry) for entry in c.gradient] for c in equations.system.closures]
        rows += [[derivative(e, s) for s in q] for e in (*self.position, angle)]
        self._shape = (len(rows), len(q))
        self.inputs = [*q, equations.system.t, *configurations.values]
        self._slopes = Function([*(e for row in rows for e in row), angle], self.inputs)
        values = configurations.values.items()
        self.others = {s: v * (1.17 + 0.05 * k) for k, (s, v) in enumerate(values)}

    def numbers(self, state: int) -> list[float]:
        return self._numbers(state, self.configurations.values)

    def _numbers(self, state: int, values: Mapping[Symbol, float]) -> list[float]:
        known = self.configurations
        return [*known.q[state], known.times[state], *values.values()]

    @cached_property
    def rates(self) -> list[_Rates]:
        """Return rates in all configurations."""
        return [self._rates(self.numbers(k)) for k in range(len(self.configurations.q))]

    @cached_property
    def other_rates(self) -> _Rates:
        """Return rates at the start with other values of all parameters."""
        return self._rates(self._numbers(0, self.others))

    def _rates(self, numbers: list[float]) -> _Rates:
        *slopes, angle = self._slopes(numbers)
        rows = np.array(slopes).reshape(self._shape)
        fixed_rows, moving = rows[:-4], rows[-4:]
        allowed = moving
        if len(fixed_rows):
            _, sizes, directions = np.linalg.svd(fixed_rows)
            allowed = moving @ directions[int((sizes > SAME * sizes[0]).sum()) :].T
        return allowed[:3], allowed[3], float(angle)

    def slope(self, size: Symbol) -> Array:
        """Return ∂r/∂size in all configurations, shape (K, 3)."""
        function = Function([derivative(e, size) for e in self.position], self.inputs)
        states = range(len(self.configurations.q))
        return np.array([function(self.numbers(k)) for k in states])


def _wheel(motion: _Motion, down: Array | None, name: str, size: Symbol) -> Wheel | None:
    """Tell whether a particle moves as the centre of a wheel of this radius."""
    configurations = motion.configurations
    value = configurations.values[size]
    if value <= 0 or not all(_rolls(rates, value) for rates in motion.rates):
        return None
    if not _rolls(motion.other_rates, motion.others[size]):
        return None
    velocities, turning, angle = motion.rates[0]
    fastest = int(np.abs(turning).argmax())
    towards = velocities[:, fastest] / (value * turning[fastest])
    slopes = motion.slope(size)
    normal = slopes[0] if _is_normal(slopes, [rates[0] for rates in motion.rates]) else None
    if normal is None and down is not None and _says_that_it_rolls(configurations):
        normal = None if slopes.any() else _pressed(towards, down)
    if normal is None:
        return None
    ground = _ground(motion, size)
    ground = _slope(motion, value, normal, towards) if ground is None else ground
    return Wheel(motion.particle, name, angle, value, size, normal, towards, ground)


def _rolls(rates: _Rates, radius: float) -> bool:
    """Tell whether the speed is the radius times the rate of the angle, whatever moves."""
    velocities, turning, _ = rates
    with np.errstate(all="ignore"):
        turned = velocities / radius
        off = turned.T @ turned - np.outer(turning, turning)
    return bool(turning.any() and np.abs(off).max() <= SAME * (turning @ turning))


def _is_normal(slopes: Array, velocities: list[Array]) -> bool:
    """Tell whether these are unit vectors across all velocities."""
    return bool(np.abs(np.linalg.norm(slopes, axis=1) - 1).max() <= SAME) and all(
        np.abs(n @ v).max() <= SAME * max(1.0, float(np.abs(v).max()))
        for n, v in zip(slopes, velocities, strict=True)
    )


def _says_that_it_rolls(configurations: Configurations) -> bool:
    lines = configurations.equations.derivation.account.lines
    return any(line.name.lower().startswith(_ROLLS) for line in lines)


def _pressed(towards: Array, down: Array) -> Array | None:
    """Return the direction against which gravity presses; None where it is along the motion."""
    across = -(down - (down @ towards) * towards)
    size = float(np.linalg.norm(across))
    return across / size if size > 1e-6 * float(np.linalg.norm(down)) else None


def _slope(motion: _Motion, radius: float, normal: Array, towards: Array) -> Array | None:
    """Return a piece of the plane below a wheel that goes straight on; None if it does not."""
    for velocities, turning, _ in motion.rates[1:]:
        if np.abs(velocities - radius * np.outer(towards, turning)).max() > SAME * radius:
            return None
    contact = motion.configurations.places[0, motion.particle] - radius * normal
    return np.array([contact - 2.2 * radius * towards, contact + 2.2 * radius * towards])


def _ground(motion: _Motion, size: Symbol) -> Array | None:
    """The curve of places that a wheel touches as one coordinate goes round; None of others."""
    configurations = motion.configurations
    numbers = sorted(configurations.depends[motion.particle])
    if len(numbers) != 1:
        return None
    touched = [e - size * derivative(e, size) for e in motion.position]
    function = Function(touched, motion.inputs)
    start = motion.numbers(0)
    first = start[numbers[0]]
    line = []
    for turn in np.linspace(0, 2 * np.pi, 121):
        start[numbers[0]] = first + float(turn)
        line.append(function(start))
    extent = float(np.ptp(line, axis=0).max())
    return np.array(line) if np.abs(line[-1] - line[0]).max() <= SAME * extent else None
