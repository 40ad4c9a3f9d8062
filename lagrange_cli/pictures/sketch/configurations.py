"""Positions of all bodies at the start, and at feasible configurations near it.

A picture shows the start. What it claims of distances and angles has to hold at the configurations
around it too, for at one alone anything may look like anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import mpmath
import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.depiction import MOST_BODIES, PlacedPoint
from lagrange_cli.mechanics.free_symbols import require_given, unknown_names
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, TapeRun
from lagrange_cli.mechanics.symbols.quoting import quoted

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.depiction import Depiction
    from lagrange_cli.mechanics.elements.motion import ElementMotion
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import BodyForce, Closure

    Array: TypeAlias = NDArray[np.float64]
    _Bodies: TypeAlias = tuple[ElementMotion | PlacedPoint, ...]

#: Configurations near the start.
_NEARBY = 9
#: How far angles are from those of the start at most, in radians, and lengths relative to the
#: distance of neighbours.
_FARTHEST = 0.35
_DIGITS = 20
#: Largest number that a picture is made of: squares of such numbers are doubles.
_LARGEST = 1e150


class Function:
    """Expressions as a function of numbers."""

    def __init__(self, outputs: Sequence[Expr], inputs: Sequence[Symbol]) -> None:
        import sympy

        self._tape = Tape([sympy.sympify(e) for e in outputs], inputs)

    def __call__(self, numbers: Sequence[float]) -> Array:
        """Evaluate at numbers, one for each input.

        Raises
        ------
        DomainError
            A value is not real there, or too large for a picture.
        """
        with mpmath.workdps(_DIGITS):
            values = np.array([float(x) for x in self._run(numbers, 0).values])
        if not (np.abs(values) <= _LARGEST).all():
            raise DomainError
        return values

    def with_gradient(self, numbers: Sequence[float]) -> tuple[float, Array]:
        """Evaluate the first output, and differentiate it by the inputs."""
        gradient = np.zeros(len(numbers))
        with mpmath.workdps(_DIGITS):
            run = self._run(numbers, 1)
            for number, slope in run.partials(0).items():
                gradient[number] = float(slope)
            return float(run.values[0]), gradient

    def _run(self, numbers: Sequence[float], order: int) -> TapeRun:
        zero = mpmath.mpf(0)
        return self._tape.run([(mpmath.mpf(float(x)), zero, zero) for x in numbers], order)


class Places:
    """Positions of bodies as functions of coordinates, time and parameters.

    Parameters
    ----------
    bodies
        Particles and points.
    coordinates
        Coordinates and time, as symbols.
    values
        Values of parameters.
    """

    def __init__(
        self, bodies: _Bodies, coordinates: Sequence[Symbol], values: Mapping[Symbol, float]
    ) -> None:
        self._bodies, self._values, self._inputs = bodies, values, [*coordinates, *values]
        self._positions = Function([e for body in bodies for e in body.position], self._inputs)

    def at(self, q: Array, t: float, values: Mapping[Symbol, float] | None = None) -> Array:
        """Return positions, shape (bodies, 3); raises DomainError as :class:`Function` does."""
        return self._positions(self._numbers(q, t, values or {})).reshape(-1, 3)

    def _numbers(self, q: Array, t: float, others: Mapping[Symbol, float]) -> list[float]:
        return [*q, t, *{**self._values, **others}.values()]

    def drawn(self, q: Array, t: float) -> Array:
        """Return positions, shape (bodies, 3).

        Raises
        ------
        InputError
            A body has no place there that could be drawn.
        """
        try:
            return self.at(q, t)
        except DomainError:
            names = [b.name for b in self._bodies if not self._has_place(b, q, t)]
            message = f"the position of {quoted(names)} is not real here, or too large to draw"
            hint = "a picture shows the start: give another one in 'initial'"
            raise _refusal(message, hint) from None

    def _has_place(self, body: ElementMotion | PlacedPoint, q: Array, t: float) -> bool:
        try:
            Function(body.position, self._inputs)(self._numbers(q, t, {}))
        except DomainError:
            return False
        return True


@dataclass(frozen=True)
class Configurations:
    """The start and configurations near it; the start is the first of each.

    Attributes
    ----------
    equations, depiction
        The equations, and what their pictures are drawn from.
    names
        Names of the bodies: particles, then points.
    values
        Values of parameters.
    q
        Coordinates, shape (K, n).
    times
        Times, shape (K,).
    places
        Positions of the bodies, shape (K, bodies, 3).
    is_given
        True if the scene gives this start, with all parameters.
    """

    equations: Equations
    depiction: Depiction
    names: tuple[str, ...]
    values: Mapping[Symbol, float]
    q: Array
    times: Array
    places: Array
    is_given: bool
    _places: Places

    @property
    def particles(self) -> int:
        return len(self.equations.system.particles)

    @property
    def size(self) -> float:
        """Return a length that distances are relative to: the extent at the start, or else 1."""
        return size_of(self.places[0])

    def moved(self, q: Array, t: float, values: Mapping[Symbol, float] | None = None) -> Array:
        """Return positions, shape (bodies, 3); raises DomainError as :class:`Function` does."""
        return self._places.at(q, t, values)

    def drawn(self, q: Array, t: float) -> Array:
        """Return positions; raises InputError as :class:`Places` does."""
        return self._places.drawn(q, t)

    def slopes(self, number: int) -> Array:
        """Return ∂r/∂q of all bodies by one coordinate, shape (K, bodies, 3)."""
        bodies: _Bodies = (*self.equations.system.particles, *self.depiction.points)
        coordinates = [c.q for c in self.equations.system.coordinates]
        rows = [derivative(e, coordinates[number]) for body in bodies for e in body.position]
        function = Function(rows, [*coordinates, self.equations.system.t, *self.values])
        states = zip(self.q, self.times, strict=True)
        values = [function([*q, float(t), *self.values.values()]) for q, t in states]
        return np.array(values).reshape(len(self.q), -1, 3)

    def turned(self, number: int, angle: float, state: int = 0) -> Array:
        """Return the positions with one coordinate off by ``angle``, closures left aside."""
        q = self.q[state].copy()
        q[number] += angle
        return self.moved(q, float(self.times[state]))

    def symbol_values(self, state: int) -> dict[str, float]:
        """Return the values of all names at one of the configurations."""
        known = {s.name: value for s, value in self.values.items()}
        known["t"] = float(self.times[state])
        coordinates = self.equations.system.coordinates
        known |= {c.name: float(x) for c, x in zip(coordinates, self.q[state], strict=True)}
        for place, components in zip(self.places[state], self.components, strict=True):
            known |= dict(zip(components, map(float, place), strict=True))
        return known

    @property
    def depends(self) -> list[frozenset[int]]:
        """Return for each body the numbers of the coordinates in its position."""
        numbers = {c.q: k for k, c in enumerate(self.equations.system.coordinates)}
        bodies: _Bodies = (*self.equations.system.particles, *self.depiction.points)
        return [
            frozenset(numbers[s] for e in body.position for s in e.free_symbols if s in numbers)
            for body in bodies
        ]

    def pulls(self) -> Iterator[tuple[BodyForce, Array]]:
        """Return the forces on bodies with their values at the start, inputs taken for 1.

        Forces that depend on velocities are left out.
        """
        system = self.equations.system
        known = {**self.values, system.t: float(self.times[0])}
        known |= {c.q: float(x) for c, x in zip(system.coordinates, self.q[0], strict=True)}
        known |= {x.symbol: 1.0 for x in system.external}
        for force in system.forces:
            symbols = sorted(set().union(*(e.free_symbols for e in force.components)), key=str)
            if len(force.components) == 3 and not force.is_torque and known.keys() >= {*symbols}:
                try:
                    yield force, Function(force.components, symbols)([known[s] for s in symbols])
                except DomainError:
                    continue

    @property
    def components(self) -> list[tuple[str, str, str]]:
        """Return the Cartesian names of each body."""
        bodies: _Bodies = (*self.equations.system.particles, *self.depiction.points)
        return [body.components for body in bodies]


def configurations(equations: Equations) -> Configurations:
    """Find the start of some equations and configurations near it.

    Raises
    ------
    InputError
        There are no particles and no points, or too many, or no configuration is known, or an
        unknown function says where something is, or something is nowhere at the start.
    """
    depiction = _depiction(equations)
    placing = frozenset[str]().union(*map(unknown_names, _placing(equations, depiction)))
    require_given(f for f in equations.system.functions if f.name in placing)
    start = _start(equations)
    if start is None:
        hint = "give the initial state in 'initial', and a value for every parameter"
        raise _refusal("no configuration of this scene is known that could be drawn", hint)
    values, q = start
    t = float(equations.system.simulate.start)
    bodies: _Bodies = (*equations.system.particles, *depiction.points)
    coordinates = [*(c.q for c in equations.system.coordinates), equations.system.t]
    places = Places(bodies, coordinates, values)
    first = places.drawn(q, t)
    states = [(q, t, first), *_nearby(equations, values, q, t, size_of(first), places.at)]
    return Configurations(
        equations,
        depiction,
        tuple(body.name for body in bodies),
        values,
        np.array([state[0] for state in states]),
        np.array([state[1] for state in states]),
        np.array([state[2] for state in states]),
        equations.system.initial is not None,
        places,
    )


def _depiction(equations: Equations) -> Depiction:
    depiction = equations.presentation.depiction
    if depiction is None:
        why = f"there are more than {MOST_BODIES} particles and points: a sketch would be a blot"
        raise _refusal(why, "draw the scene with smaller sizes, as in -p n=10")
    if not equations.system.particles and not depiction.points:
        hint = "name places that move, as points: {axis: [l*sin(theta), 0, l*cos(theta)]}"
        why = "this scene has no particles and no points: nothing says where anything is"
        raise _refusal(why, hint)
    known = tuple(p for p in depiction.potentials if not unknown_names(p[1]))
    system = equations.system
    angles = {c.q: c.is_angle for c in system.coordinates}
    return replace(depiction, potentials=known).completed(system.particles, angles)


def _placing(equations: Equations, depiction: Depiction) -> Iterator[Expr]:
    """Return positions and constraints, which say where things are."""
    bodies: _Bodies = (*equations.system.particles, *depiction.points)
    for body in bodies:
        yield from body.position
    yield from (relation.expression for relation in depiction.relations)
    yield from (closure.expression for closure in equations.system.closures)


def _refusal(message: str, hint: str) -> InputError:
    return InputError(Problem(message, hint=hint, rule="sketch"))


def size_of(places: Array) -> float:
    """Return the extent of places, or their distance from the origin, or 1."""
    extent = float(np.ptp(places, axis=0).max())
    far = float(np.abs(places).max())
    return extent if extent > 1e-9 * far else far or 1.0


def _start(equations: Equations) -> tuple[dict[Symbol, float], Array] | None:
    """Return values of parameters and coordinates: of the start, or a state of the certificate."""
    initial, parameters = equations.system.initial, equations.system.parameters
    if initial is not None:
        values = {p.symbol: p.value for p in parameters if p.value is not None}
        return values, np.array(initial.positions, dtype=float)
    if equations.derivation.sources is None:
        return None
    state = equations.derivation.sources.state
    known = {p.symbol: float(state[p.symbol]) for p in parameters if p.symbol in state}
    return known, np.array([float(state[c.q]) for c in equations.system.coordinates])


def _nearby(
    equations: Equations,
    values: Mapping[Symbol, float],
    q: Array,
    t: float,
    size: float,
    places: Callable[[Array, float], Array],
) -> Iterator[tuple[Array, float, Array]]:
    """Feasible configurations near the start, at times near its own."""
    # In a chain only neighbours may be pulled apart, by part of their distance.
    length = size / max(1, len(equations.system.particles))
    reach = np.array(
        [_FARTHEST * (1 if c.is_angle else length) for c in equations.system.coordinates]
    )
    closures = [c for c in equations.system.closures if c.kind == "position"]
    feasible = _Feasible(equations, closures, values)
    for k in range(1, _NEARBY + 1):
        shift = np.array([_spread(k, i) for i in range(len(q))])
        time = t + (0.1 * k if equations.derivation.facts.rheonomic else 0.0)
        for part in (1.0, 0.3, 0.05):
            try:
                near = feasible.nearest(q + part * reach * shift, time, reach)
                if near is not None:
                    yield near, time, places(near, time)
                    break
            except DomainError:
                continue


def _spread(k: int, i: int) -> float:
    """The ``i``-th number of the ``k``-th of some points spread evenly over −1 to 1 (Weyl)."""
    return 2 * math.modf((k + 0.31) * math.sqrt(2 + i) * (1 + math.sqrt(5)) / 2)[0] - 1


def feasible_near(known: Configurations, q: Array) -> Array:
    """Return coordinates moved onto the closures between positions; as they are if that fails."""
    equations = known.equations
    closures = [c for c in equations.system.closures if c.kind == "position"]
    length = known.size / max(1, len(equations.system.particles))
    reach = np.array(
        [_FARTHEST * (1 if c.is_angle else length) for c in equations.system.coordinates]
    )
    feasible = _Feasible(equations, closures, known.values)
    near = feasible.nearest(np.asarray(q, dtype=float), float(known.times[0]), reach)
    return q if near is None else near


class _Feasible:
    """The configurations that closures between positions leave."""

    def __init__(
        self, equations: Equations, closures: Sequence[Closure], values: Mapping[Symbol, float]
    ) -> None:
        inputs = [*(c.q for c in equations.system.coordinates), equations.system.t, *values]
        entries = [(k, i) for k, c in enumerate(closures) for i in c.coordinate_numbers]
        outputs = [c.expression for c in closures]
        outputs += [closures[k].gradient[i] for k, i in entries]
        self._function = Function(outputs, inputs)
        self._closures = len(closures)
        self._entries = np.array(entries, dtype=int).reshape(-1, 2)
        self._values = list(values.values())

    def nearest(self, q: Array, t: float, reach: Array) -> Array | None:
        """Solve the closures by Gauss–Newton steps from q; None if they do not converge.

        Steps converge quadratically: after one of 1e-9 of the ``reach`` the error is of rounding.
        """
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        for _ in range(12 if self._closures else 0):
            outputs = self._function([*q, t, *self._values])
            residuals = outputs[: self._closures]
            slopes, (rows, columns) = outputs[self._closures :], self._entries.T
            gradients = csc_array((slopes, (rows, columns)), shape=(self._closures, len(q)))
            try:
                solved = splu((gradients @ gradients.T).tocsc()).solve(residuals)
            except RuntimeError:
                return None  # the closures are singular here
            step = np.asarray(gradients.T @ solved)
            q = q - step
            if (np.abs(step) <= 1e-9 * reach).all():
                return q
        return None if self._closures else q
