"""States with two values, which change where conditions are met: relays with hysteresis.

Each has a function of the state that is positive as long as its value stays, and another one behind
the change (A. Visintin, *Differential Models of Hysteresis*, 1994, IV: the delayed relay). No
motion slides along its zeros, since behind the change it is no longer there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import (
    ON_SURFACE,
    Surfaces,
    SurfaceSides,
)

#: Why a motion cannot be continued.
BOTH = Phrase("both conditions of a state with two values hold, so that it has neither value")
RESTLESS = Phrase("a state with two values changes back and forth without end")


#: Between both values, which companions of a run may be off by rounding.
_MIDDLE = 0.5

#: Errors of steps beside the tolerance in a condition that has been left: many may add up.
_ADDED_UP = 100.0


@dataclass(frozen=True)
class Switched:
    """A state of a motion behind the changes of states with two values.

    Attributes
    ----------
    y
        The state, shape (2n + k,).
    toggled
        Numbers of the switches that changed.
    at_conditions
        Of those of them whose next change is there but for errors, these errors: their conditions
        meet, as where play is left in the direction from which it is entered again.
    """

    y: Array
    toggled: tuple[int, ...] = ()
    at_conditions: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SwitchPlace:
    """A state of a motion at which states with two values may change.

    Attributes
    ----------
    surfaces, sides
        The surfaces of the equations, and the sides of the motion.
    t, y
        The time and the state, shape (2n + k,).
    late
        Time by which conditions may have been passed; 0 at the start of a motion, where a
        condition that holds exactly counts.
    tolerances
        The tolerance of steps in each component, shape (2n + k,).
    """

    surfaces: Surfaces
    sides: SurfaceSides
    t: float
    y: Array
    late: float
    tolerances: Array

    def values(self, y: Array) -> Array:
        """Evaluate the functions of all switches, shape (switches,)."""
        return self.surfaces.until_switched(self.t, y, self.sides)[0]

    def errors(self, y: Array) -> Array:
        """Bound what of each function may be error of the state, or of the time of an event."""
        values, sizes = self.surfaces.until_switched(self.t, y, self.sides)
        errors = ON_SURFACE * sizes + self.late * np.abs(self._rates(y))
        for moved in self._moved(y):
            errors += _ADDED_UP * np.abs(self.values(moved) - values)
        return np.asarray(errors)

    def rates(self, y: Array) -> tuple[Array, Array]:
        """Evaluate the rates of all functions, and what of these may be error of the state."""
        rates, errors = self._rates(y), np.zeros(len(self.surfaces.switches))
        for moved in self._moved(y):
            errors += _ADDED_UP * np.abs(self._rates(moved) - rates)
        return rates, errors

    def _rates(self, y: Array) -> Array:
        slope = self.surfaces.side(self.sides)(self.t, y)
        first = self.surfaces.rates(self.t, y, self.sides, slope).first
        return first[len(first) - len(self.surfaces.switches) :].copy()

    def _moved(self, y: Array) -> Iterator[Array]:
        """Yield the state off by its tolerance in one component after the other."""
        for place, tolerance in enumerate(self.tolerances.tolist()):
            if place not in self.surfaces.switches:
                moved = y.copy()
                moved[place] += tolerance
                yield moved


def switched(at: SwitchPlace, met: Sequence[int]) -> Switched | str:
    """Change the states with two values that are due at a place, or say why they have no values.

    ``met``: numbers of switches that are due whatever rounding leaves of their functions.
    """
    y, values = at.y, at.values(at.y)
    due = values <= 0 if at.late == 0 else values < 0
    due[list(met)] = True
    toggled: list[int] = []
    while due.any():
        y = y.copy()
        for k in np.flatnonzero(due).tolist():
            place = at.surfaces.switches[k]
            y[place] = 0.0 if y[place] > _MIDDLE else 1.0
            toggled.append(k)
        values = at.values(y)
        due = values < 0
        due[toggled] = False
    if not toggled:
        return Switched(y)
    errors = at.errors(y)
    if (values[toggled] < -errors[toggled]).any():
        return BOTH
    rates, rate_errors = at.rates(y)
    # Before the change their functions fell, and behind it they fall again.
    if any(abs(values[k]) <= errors[k] and rates[k] < -rate_errors[k] for k in met):
        return RESTLESS
    near = {k: float(errors[k]) for k in toggled if abs(values[k]) <= errors[k]}
    return Switched(y, tuple(toggled), near)
