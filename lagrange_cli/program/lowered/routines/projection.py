"""A state is led back to its closures, which integration leaves.

Positions change as little as possible in the metric of the kinetic energy, by Newton's method,
until only rounding is left; then velocities do, in one step (Lubich, Engstler, Nowak and Pöhle,
*Mechanics of Structures and Machines* 23 (1995) 473). Residuals are judged in units of the last
place of the magnitudes that they are differences of.
"""

from __future__ import annotations

from math import sqrt
from typing import Protocol

from lagrange_cli.program.lowered.routines.numbers import EPSILON, LARGEST, Array, power_of_two

#: Residuals of closures of as many units in the last place are left alone.
RESIDUAL_AT_REST = 1.0

#: Larger ones are not taken for rounding, however slowly they shrink.
RESIDUAL_ROUNDING = 1024.0

#: Steps of Newton's method onto the closures before giving up.
NEWTON_STEPS = 50

#: A start may be changed by this part of its scale, as it takes from rounding alone.
START_TOLERANCE = 1e-9

#: Velocities that move no coordinate by more than this part of its scale in a run are none.
START_ROUNDING = 64.0 * EPSILON


class Closures(Protocol):
    """Functions of closures at one time: each stores its results and tells whether there are any.

    ``position_error`` and ``velocity_error`` store residuals, then the sums of the magnitudes of
    their terms; ``position_reach`` squares of gradients; ``position_change`` and
    ``velocity_change`` what is added to coordinates and velocities.
    """

    def position_error(self, y: Array, results: Array, /) -> bool: ...

    def position_reach(self, y: Array, results: Array, /) -> bool: ...

    def position_change(self, y: Array, results: Array, /) -> bool: ...

    def velocity_error(self, y: Array, results: Array, /) -> bool: ...

    def velocity_change(self, y: Array, results: Array, /) -> bool: ...


def lead_positions(
    n: int, m: int, closures: Closures, y: Array, error: Array, square: Array, change: Array
) -> bool:
    """Lead n coordinates back to m closures of positions, by the smallest changes.

    Their metric is the kinetic energy. Newton's method goes on until only rounding is left, or
    little more that no change makes smaller. The arrays behind y are overwritten. Tell whether the
    closures hold; else the configuration is singular, or too far from any that obeys them.
    """
    last = 0.0
    for number in range(NEWTON_STEPS + 1):
        if not closures.position_error(y, error):
            return False
        size = residual(m, error)
        if size <= RESIDUAL_AT_REST:
            return True
        if number > 0:
            if not closures.position_reach(y, square):
                return False
            size = coupled_residual(m, error, square)
            if size <= RESIDUAL_AT_REST:
                return True
            if size <= RESIDUAL_ROUNDING and 2.0 * size > last:
                return True
        last = size
        if not closures.position_change(y, change):
            return False
        for i in range(n):
            y[i] += change[i]
    return False


def lead_velocities(
    n: int, m: int, closures: Closures, y: Array, error: Array, change: Array
) -> bool:
    """Lead the velocities of n coordinates back to m closures, in the same metric.

    The arrays behind y are overwritten. Tell whether the closures hold.
    """
    if not closures.velocity_error(y, error):
        return False
    if not residual(m, error) <= RESIDUAL_AT_REST:
        if not closures.velocity_change(y, change):
            return False
        for i in range(n):
            y[n + i] += change[i]
    return True


def residual(m: int, error: Array) -> float:
    """Return the largest of m residuals, in units of the last place of the magnitude m behind."""
    largest = 0.0
    for k in range(m):
        size = abs(error[k]) / (2.0 * EPSILON * power_of_two(error[m + k]))
        if size > largest:
            largest = size
    return largest


def coupled_residual(m: int, error: Array, square: Array) -> float:
    """Return the same where changes of all coordinates are found, and rounded, together.

    The magnitude of one residual counts for another as far as a change of the coordinates that
    makes the one does the other: square holds the squares of their gradients. A residual that is
    the difference of nothing (a height that is zero) has no magnitude of its own.
    """
    reach = 0.0
    for k in range(m):
        if square[k] > 0.0:
            length = error[m + k] / sqrt(square[k])
            if length > reach:
                reach = length
    for k in range(m):
        magnitude = reach * sqrt(square[k])
        if magnitude > error[m + k] and magnitude <= LARGEST:
            error[m + k] = magnitude
    return residual(m, error)


def is_near(n: int, span: float, stated: Array, y: Array) -> bool:
    """Tell whether a state of n coordinates obeys closures, but for rounding of its numbers.

    y is the state led back to them, span the duration of a run: velocities that move no coordinate
    by more than rounding in it are none.
    """
    place = 0.0
    rate = 0.0
    for i in range(n):
        if abs(stated[i]) > place:
            place = abs(stated[i])
        if abs(stated[n + i]) > rate:
            rate = abs(stated[n + i])
    bound = START_TOLERANCE * rate
    if span != 0.0:
        bound += START_ROUNDING * place / abs(span)
    for i in range(n):
        if not abs(y[i] - stated[i]) <= START_TOLERANCE * place:
            return False
        if not abs(y[n + i] - stated[n + i]) <= bound:
            return False
    return True
