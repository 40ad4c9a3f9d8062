"""Forces of unbounded slope, past which more than one motion may follow.

If accelerations have bounded slopes, one motion follows from a state (Picard, Lindelöf). The
slope of a force as sqrt(x) is unbounded at x = 0: a particle at rest there may stay, or leave at
any time (J. Norton, *Philosophers' Imprint* 3 (2003) 4). An integrator shows one of these motions,
and the runs that are to show its error the same one. So the places where slopes are unbounded are
looked at where a motion begins, and where it comes to rest on the way.

Let g be an argument whose power below 1 stands in a force. One motion follows where g, or its
first rate, or its second rate is not zero: g then leaves zero as a known power of time, faster than
any two motions can part. It follows, too, where the force points back to g = 0, as a spring does:
the distance of two motions does not grow then (a one-sided Lipschitz condition, or the energy at
its minimum). The forces that remain push away, more steeply than any proportional force.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import Rhs
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import RightHandSide
from lagrange_cli.simulate.system.rounding import parameter_values
from lagrange_cli.simulate.system.tracing import functions_of

#: Values and rates below this part of their largest neighbours are zero but for rounding.
_ZERO = 1e-13

#: Larger distance from a place at which a force is evaluated, as a part of the coordinates.
_COARSE = 2.0**-20

#: Smaller distance.
_FINE = 2.0**-45

#: Growth, from the coarse to the fine distance, of the ratio of a force to the distance, that shows
#: an unbounded slope: (COARSE/FINE)^(1 − p) of a power p is above this for p up to 0.99.
_GROWS = 1.15

#: A change of a force counts that is this many times its rounding error.
_CLEAR_OF_NOISE = 64.0

#: Steps of Newton's method: where a gradient vanishes, too, each halves the distance.
_MOST_STEPS = 60

#: Directions in which a force is looked at: all combinations of up to so many coordinates.
_MOST_DIRECTIONS = 243


@dataclass(frozen=True)
class UnboundedSlopes:
    """Places of unbounded slopes along one motion.

    Attributes
    ----------
    where
        Each place as an equation in words of the scene.
    rates
        (t, [q, v], a) → value, first and second rate of each argument, shape (3, places).
    sides
        The right-hand side, and others in which every operation is off by its rounding.
    n
        The number of coordinates.
    """

    where: tuple[str, ...]
    rates: Callable[[float, Array, Array], Array]
    sides: tuple[Rhs, ...]
    n: int

    def not_unique(self, t: float, y: Array) -> str | None:
        """Return the place from which more than one motion may follow, None if one follows."""
        resting = np.flatnonzero(self._rests(t, y))
        if not len(resting) or not self._pushes_away(t, y):
            return None
        return self.where[int(resting[0])]

    def pushes_away_from(self, number: int, t: float, y: Array) -> bool:
        """Tell whether accelerations lead away, steeply, from the place next to a state."""
        return self._pushes_away(t, self._at_place(number, t, y))

    def _at_place(self, number: int, t: float, y: Array) -> Array:
        """Move a state to where an argument vanishes, by Newton's method."""
        still, place = np.zeros(self.n), y.copy()

        def value(state: Array) -> float:
            return float(self.rates(t, state, still)[0, number])

        for _ in range(_MOST_STEPS):
            here = value(place)
            moves = _FINE * self._sizes(y)
            up = np.array([value(place + move) for move in np.diag(moves)])
            gradient = (up - here) / moves
            square = float(gradient @ gradient)
            if here == 0 or not 0 < square < np.inf:
                break
            place = place - here * gradient / square
        return place

    def _rests(self, t: float, y: Array) -> Array:
        """Tell whether each argument is zero, and both its rates, but for rounding."""
        slopes = [side(t, y) for side in self.sides]
        n = self.n
        rates = np.array([self.rates(t, y, slope[n : 2 * n]) for slope in slopes])
        # What a unit in the last place of each number of the state changes.
        moved = np.array(
            [
                self.rates(t, y + step, slopes[0][n : 2 * n])
                for step in np.diag(_ZERO * np.maximum(np.abs(y), np.finfo(float).tiny))
            ]
        )
        noise = np.abs(moved - rates[0]).sum(axis=0) + 4 * np.ptp(rates, axis=0)
        return np.asarray((np.abs(rates[0]) <= noise).all(axis=0))

    def _pushes_away(self, t: float, y: Array) -> bool:
        """Tell whether accelerations lead away from a state, more steeply than in proportion."""
        return any(self._steeply(t, y, direction) for direction in self._directions(y))

    def _directions(self, y: Array) -> Iterator[Array]:
        """Yield displacements of coordinates, or of velocities, by their size or 1."""
        n, sizes = self.n, self._sizes(y)
        combined = max(1, int(np.log(_MOST_DIRECTIONS) / np.log(3)))
        for first in (0, n):
            axes = range(n) if n > combined else ()
            signs: Iterator[Sequence[int]] = product((1, 0, -1), repeat=min(n, combined))
            for pattern in islice(signs, _MOST_DIRECTIONS):
                if any(pattern):
                    yield _placed(pattern, first, sizes)
            for k in axes:
                for sign in (1, -1):
                    yield _placed([0] * k + [sign], first, sizes)

    def _sizes(self, y: Array) -> Array:
        n = self.n
        return np.concatenate([_sizes(y[:n]), _sizes(y[n : 2 * n]), _sizes(y[2 * n :])])

    def _steeply(self, t: float, y: Array, direction: Array) -> bool:
        ratios, n = [], self.n
        for part in (_COARSE, _FINE):
            values = [_outward(side, t, y, part * direction, n) for side in self.sides]
            noise = float(np.ptp(values))
            if not values[0] > _CLEAR_OF_NOISE * noise:
                return False
            ratios.append(values[0] / part)
        return bool(ratios[1] > _GROWS * ratios[0])


def _sizes(values: Array) -> Array:
    largest = float(np.abs(values).max(initial=0.0))
    return np.where(values != 0, np.abs(values), largest or 1.0)


def _placed(pattern: Sequence[int], first: int, sizes: Array) -> Array:
    displacement = np.zeros(len(sizes))
    displacement[first : first + len(pattern)] = pattern
    return displacement * sizes


def _outward(rhs: Rhs, t: float, y: Array, step: Array, n: int) -> float:
    """Return the change of accelerations along a displacement of coordinates or velocities."""
    there, here = rhs(t, y + step), rhs(t, y)
    size = float(np.linalg.norm(step))
    along = (step[:n] + step[n : 2 * n]) / size
    return float(along @ (there - here)[n : 2 * n])


def unbounded_slopes(model: Model, functions: RightHandSide) -> UnboundedSlopes | None:
    """Find the places of unbounded slopes of a model's forces; None if there are none."""
    if not model.steep:
        return None
    numbers = parameter_values(model).tolist()
    function, recorded = functions_of(model.code.functions)["steep"], functions.recorded_inputs

    def rates(t: float, y: Array, a: Array) -> Array:
        inputs = [] if recorded is None else recorded.pieces.values(t)
        values = function(t, y, [*numbers, *a.tolist()], inputs)
        return np.asarray(values, dtype=float).reshape(3, -1)

    sides = (functions.rhs, *functions.perturbed)
    return UnboundedSlopes(model.steep, rates, sides, len(model.coordinates))


def require_unique_start(places: UnboundedSlopes | None, t: float, y: Array) -> None:
    """Refuse a start from which more than one motion follows.

    Raises
    ------
    InputError
        It says where slopes are unbounded.
    """
    where = None if places is None else places.not_unique(t, y)
    if where is None:
        return
    raise InputError(
        Problem(
            f"the motion from this start is not unique: where {where}, a force pushes away with an"
            " infinite slope, so that it may stay there or leave at any time",
            hint="begin beside it or with a velocity, or make the force smooth there",
            rule="not-unique",
        )
    )
