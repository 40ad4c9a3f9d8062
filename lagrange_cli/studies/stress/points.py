"""Extreme points of a scene: parameters, start, end and accuracy.

The dimension of a parameter tells its kind (:mod:`lagrange_cli.scene.dimensions`). An axis is a
function of a scene's :class:`Ground` that yields points; to add one, write the function and list it
in :data:`STRESS_AXES`. The first line of its docstring says what it sets, the second what the
``value`` of its points is. The values along the axes span the range of doubles rather than of
scenes: they are chosen by decades, not tuned.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.rounding import parameter_values
from lagrange_cli.simulate.system.singular_guard import singular_factors
from lagrange_cli.simulate.system.tracing import functions_of

if TYPE_CHECKING:
    from lagrange_cli.scene.dimensions import Base, Dimensions
    from lagrange_cli.scene.model import Scene

#: Most parameters, or coordinates, of one kind that an axis goes through.
_MOST_OF_A_KIND = 3

#: One mass over the largest other one.
_MASS_RATIOS = (1e-12, 1e-9, 1e-6, 1e6, 1e9, 1e12)
#: One length over the largest other one.
_LENGTH_RATIOS = (1e-6, 1e-3, 1e3, 1e6)
#: Factors of stiffnesses.
_STIFFNESSES = (1e3, 1e6, 1e9, 1e12)
#: Factors of parameters of any other kind.
_FACTORS = (1e-6, 1e6)
#: Factors of all velocities of the start.
_SPEEDS = (0.0, 1e-6, 1e-3, 1e3)
#: Factors of the simulated time.
_DURATIONS = (10.0, 100.0)
#: Sizes of an angle, in radians.
_ANGLES = (1e2, 1e4, 1e8, 1e12)
#: Distances of an angle from π, in radians.
_DISTANCES = (1e-3, 1e-6, 1e-9, 1e-12)
#: Distances of a coordinate from a singular configuration, in its unit.
_NEAR = (0.0, 1e-12, 1e-6)
#: Accuracies that are asked for, relative to scales.
_ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12, 1e-15)

#: Units of mass, length and time: powers of two, then those of atoms and of galaxies.
_UNITS: tuple[Mapping[Base, float], ...] = (
    {"mass": 2.0**-100, "length": 2.0**-40},
    {"mass": 2.0**100, "length": 2.0**50},
    {"time": 2.0**30},
    {"mass": 1e-31, "length": 1e-12},
    {"mass": 1e30, "length": 1e16},
)

#: Random points: powers of ten by which parameters change at most.
_DECADES = (1, 2, 3, 4, 5, 6)

#: Factors of a chart that are smaller vanish.
_VANISHES = 1e-9


@dataclass(frozen=True)
class StressPoint:
    """One extreme of a scene, and the options that make it.

    Attributes
    ----------
    axis
        Name of its axis.
    value
        Its place on the axis, in the axis's unit.
    parameters, initial
        Name → text, as ``--param`` and ``--initial`` take them.
    until
        End of the motion as a text; None for the scene's.
    accuracy
        Accuracy to ask for, relative to scales; None for the scene's.
    scaled
        Base dimension → factor, if this is the scene's own motion in other units; else None.
    """

    axis: str
    value: float
    parameters: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, str] = field(default_factory=dict)
    until: str | None = None
    accuracy: float | None = None
    scaled: Mapping[Base, float] | None = None


@dataclass(frozen=True)
class Ground:
    """The numbers that all axes start from.

    Attributes
    ----------
    scene
        The scene, with the values that options give.
    model
        Its model.
    parameters
        Name → value of parameters that have a number.
    initial
        Name → initial value, ``dot(NAME)`` for velocities.
    dimensions
        Dimensions of all names of the scene.
    """

    scene: Scene
    model: Model
    parameters: Mapping[str, float]
    initial: Mapping[str, float]
    dimensions: Dimensions

    def alike(self, mass: int, length: int, time: int) -> list[str]:
        """Return the first parameters of a dimension that are not 0; none if it is unclear."""
        wanted = mass, length, time
        if not self.dimensions.complete:
            return []
        exponents_of = self.dimensions.exponents_of
        names = [name for name, x in self.parameters.items() if x and exponents_of(name) == wanted]
        return names[:_MOST_OF_A_KIND]

    @cached_property
    def angles(self) -> list[str]:
        """The first angles among the coordinates that the scene gives an initial value."""
        kinds = zip(self.model.coordinates, self.model.kinds, strict=True)
        names = [name for name, kind in kinds if kind == "angle" and name in self.initial]
        return names[:_MOST_OF_A_KIND]

    def is_felt(self, name: str) -> bool:
        """Return if accelerations at the start depend on a coordinate; True with recordings."""
        model, start = self.model, self.model.initial
        if start is None or model.recordings:
            return start is not None
        function, k = functions_of(model.code.functions)["rhs"], model.coordinates.index(name)
        numbers, t = parameter_values(model).tolist(), model.defaults.start
        moved = [*start[:k], start[k] + 1.0, *start[k + 1 :]]
        here, there = (function(t, state, numbers) for state in (list(start), moved))
        return not np.array_equal(here, there, equal_nan=True)

    @property
    def speeds(self) -> dict[str, float]:
        """Name → velocity of the start, without those that are 0."""
        return {name: v for name, v in self.initial.items() if name.startswith("dot(") and v}

    @property
    def at_rest(self) -> dict[str, str]:
        """Initial values that set all velocities of the start to 0."""
        return dict.fromkeys(self.speeds, "0")


def points_of(ground: Ground, axes: Sequence[str] | None = None) -> list[StressPoint]:
    """Return the points of some axes, by default of all."""
    return [point for axis in axes or STRESS_AXES for point in STRESS_AXES[axis](ground)]


def _changed(axis: str, name: str, value: float, number: float) -> StressPoint:
    return StressPoint(axis, value, {name: f"{number:.15g}"})


def _ratios(
    ground: Ground, axis: str, names: Sequence[str], ratios: Sequence[float]
) -> Iterator[StressPoint]:
    """Yield points at which each parameter has some ratios to the largest of the others."""
    for name in names if len(names) > 1 else ():
        largest = max(abs(ground.parameters[n]) for n in names if n != name)
        yield from (_changed(axis, name, ratio, ratio * largest) for ratio in ratios)


def _mass_ratio(ground: Ground) -> Iterator[StressPoint]:
    """One mass beside the largest other.
    the ratio"""
    return _ratios(ground, "mass_ratio", ground.alike(1, 0, 0), _MASS_RATIOS)


def _length_ratio(ground: Ground) -> Iterator[StressPoint]:
    """One length beside the largest other.
    the ratio"""
    return _ratios(ground, "length_ratio", ground.alike(0, 1, 0), _LENGTH_RATIOS)


def _stiffness(ground: Ground) -> Iterator[StressPoint]:
    """The stiffness of a spring.
    the factor"""
    for name in (*ground.alike(1, 0, -2), *ground.alike(1, 2, -2)):
        number = ground.parameters[name]
        yield from (_changed("stiffness", name, x, x * number) for x in _STIFFNESSES)


def _parameter(ground: Ground) -> Iterator[StressPoint]:
    """Any other parameter.
    the factor"""
    known = {*ground.alike(1, 0, -2), *ground.alike(1, 2, -2)}
    for several in (ground.alike(1, 0, 0), ground.alike(0, 1, 0)):
        known |= set(several) if len(several) > 1 else set()
    others = [name for name, x in ground.parameters.items() if x and name not in known]
    for name in others[:_MOST_OF_A_KIND]:
        number = ground.parameters[name]
        yield from (_changed("parameter", name, x, x * number) for x in _FACTORS)


def _degenerate(ground: Ground) -> Iterator[StressPoint]:
    """A parameter that vanishes.
    0"""
    for name in list(ground.parameters)[: 2 * _MOST_OF_A_KIND]:
        yield StressPoint("degenerate", 0.0, {name: "0"})


def _random(ground: Ground) -> Iterator[StressPoint]:
    """All parameters, by random factors.
    the most powers of ten"""
    for decades in _DECADES if ground.parameters else ():
        chance = random.Random(decades)
        texts = {
            name: f"{x * 10.0 ** chance.uniform(-decades, decades):.6g}"
            for name, x in ground.parameters.items()
        }
        yield StressPoint("random", decades, texts)


def _speed(ground: Ground) -> Iterator[StressPoint]:
    """The velocities of the start.
    the factor"""
    for factor in _SPEEDS if ground.speeds else ():
        start = {name: f"{factor * v + 0.0:.15g}" for name, v in ground.speeds.items()}
        yield StressPoint("speed", factor, initial=start)


def _separatrix(ground: Ground) -> Iterator[StressPoint]:
    """An angle released just before pi.
    the distance from pi"""
    for name in filter(ground.is_felt, ground.angles):
        for distance in _DISTANCES:
            start = {**ground.at_rest, name: repr(math.pi - distance)}
            yield StressPoint("separatrix", distance, initial=start)


def _chart(ground: Ground) -> Iterator[StressPoint]:
    """A coordinate at or near where it is singular.
    the distance"""
    places = {name for place in ground.model.singular for name in place.lost}
    for name, number in _vanishing(ground) if places else ():
        for distance in _NEAR:
            yield StressPoint("chart", distance, initial={name: repr(number + distance)})


def _vanishing(ground: Ground) -> Iterator[tuple[str, float]]:
    """Yield values of one coordinate of the start at which a chart is singular."""
    model, start = ground.model, ground.model.initial
    if start is None:
        return
    factors = singular_factors(model)
    for k, (name, kind) in enumerate(zip(model.coordinates, model.kinds, strict=True)):
        for number in (0.0, math.pi / 2, math.pi) if kind == "angle" else (0.0,):
            state = [*start[:k], number, *start[k + 1 :]]
            values = factors(model.defaults.start, np.array(state))
            if name in ground.initial and any(abs(x) < _VANISHES for x in values):
                yield name, number


def _angle(ground: Ground) -> Iterator[StressPoint]:
    """An angle counted many turns away.
    its size"""
    for name in ground.angles[:1]:
        for size in _ANGLES:
            turns = round(size / (2 * math.pi))
            number = ground.initial[name] + 2 * math.pi * turns
            yield StressPoint("angle", size, initial={name: repr(number)})


def _duration(ground: Ground) -> Iterator[StressPoint]:
    """A longer motion.
    the factor"""
    start, until = ground.model.defaults.start, ground.model.defaults.until
    if until is None:
        return
    for factor in _DURATIONS:
        end = start + factor * (until - start)
        yield StressPoint("duration", factor, until=repr(end))


def _accuracy(ground: Ground) -> Iterator[StressPoint]:
    """The accuracy itself.
    the accuracy"""
    for accuracy in _ACCURACIES:
        yield StressPoint("accuracy", accuracy, accuracy=accuracy)


def _units(ground: Ground) -> Iterator[StressPoint]:
    """The same motion in other units of mass, length and time.
    the factor of lengths, or of what else is scaled"""
    known, defaults = ground.dimensions.exponents, ground.model.defaults
    # Options cannot change these, so they would stay in the scene's units.
    if defaults.until is None or ground.scene.near or defaults.start or defaults.step:
        return
    for factors in _UNITS:
        scaled = {base: x for base, x in factors.items() if base in known and x != 1}
        if scaled:
            yield StressPoint(
                "units",
                scaled.get("length", next(iter(scaled.values()))),
                _scaled(ground, ground.parameters, scaled),
                _scaled(ground, ground.initial, scaled),
                repr(defaults.until * scaled.get("time", 1.0)),
                scaled=scaled,
            )


def _scaled(
    ground: Ground, values: Mapping[str, float], factors: Mapping[Base, float]
) -> dict[str, str]:
    return {name: repr(x * ground.dimensions.factor(name, factors)) for name, x in values.items()}


#: Name of an axis → its points.
STRESS_AXES: Mapping[str, Callable[[Ground], Iterator[StressPoint]]] = {
    "mass_ratio": _mass_ratio,
    "length_ratio": _length_ratio,
    "stiffness": _stiffness,
    "parameter": _parameter,
    "degenerate": _degenerate,
    "random": _random,
    "speed": _speed,
    "separatrix": _separatrix,
    "chart": _chart,
    "angle": _angle,
    "duration": _duration,
    "units": _units,
    "accuracy": _accuracy,
}
