"""Motions: recorded inputs, steps to events, whose times are bisected to rounding, states with two
values (A. Visintin, *Differential Models of Hysteresis*, 1994, IV), and fixed steps (E. Hairer,
S. P. Norsett and G. Wanner, *Solving Ordinary Differential Equations I*, 1993, II.1; E. Hairer, C.
Lubich and G. Wanner, *Geometric Numerical Integration*, 2006, II.1 and VIII.6)."""

from __future__ import annotations

from typing import Protocol

from lagrange_cli.program.lowered.routines.numbers import Array, Integers

#: Part of the largest number so far that is noise: no event falls through it.
NOISE = 2.0**-43

#: Part of a time that is one unit in its last place.
LAST_PLACE = 2.0**-52

#: Part of a number, with its change, below which iterations have settled.
SETTLED = 2.0**-48

#: Iterations of an implicit step: more do not fit into real time.
MOST_ITERATIONS = 50


#: Status where a number is not known.
UNDETERMINED = 1

#: Status where both conditions of a state hold, so that it has neither value.
NO_VALUE = 4

#: Part of the largest number of a state by which a condition may hold behind a change: it may be
#: error of the steps so far, as where play is left in the direction from which it is entered again.
ERROR_OF_STEPS = 2.0**-20


class Motion(Protocol):
    """A motion in a mode, 1 for each closed contact: functions tell whether there are results.

    ``step`` stores the state a step of size h behind a start, ``falls`` what falls through zero
    where contacts open or close.
    """

    def step(self, t: float, h: float, start: Array, mode: Integers, results: Array, /) -> bool: ...

    def falls(self, t: float, y: Array, mode: Integers, results: Array, /) -> bool: ...


def advance(
    n: int,
    c: int,
    motion: Motion,
    t: float,
    h: float,
    mode: Integers,
    y: Array,
    start: Array,
    before: Array,
    values: Array,
    largest: Array,
    taken: Array,
) -> int:
    """Advance the n numbers of a state from t by h, or to the first event of c
    contacts and relays.

    Return the number of the contact, c without an event, c + 1 without a result; the time that it
    took is stored in taken. largest holds the largest numbers so far, of open contacts, then of
    closed ones. start, before and values are overwritten.
    """
    for i in range(n):
        start[i] = y[i]
    taken[0] = h
    if not motion.falls(t, y, mode, before):
        return c + 1
    event = c
    early = 0.0
    late = h
    trial = h
    searching = True
    while searching:
        if not motion.step(t, trial, start, mode, y):
            return c + 1
        if not motion.falls(t + trial, y, mode, values):
            return c + 1
        due = first_due(c, mode, before, values, largest)
        if due == c and event == c:
            return c
        if due < c:
            event = due
            late = trial
        else:
            early = trial
        trial = early + (late - early) / 2.0
        searching = early < trial and trial < late and late - early > LAST_PLACE * abs(t)
    taken[0] = late
    if not motion.step(t, late, start, mode, y):
        return c + 1
    return event


def first_due(c: int, mode: Integers, before: Array, values: Array, largest: Array) -> int:
    """Return the first of c contacts that has to open or close, c without any.

    Numbers are measured by the largest so far, so that rounding is no event; nor is what was below
    zero before (a gap that only touches).
    """
    due = c
    for k in range(c):
        place = k
        if mode[k] > 0:
            place = c + k
        if abs(values[k]) > largest[place]:
            largest[place] = abs(values[k])
        least = -NOISE * largest[place]
        if before[k] < 0.0:
            least += before[k]
        if due == c and values[k] < least:
            due = k
    return due


class Relays(Protocol):
    """Functions of such states at one time: ``switches`` stores their numbers and tells whether
    there are any."""

    def switches(self, y: Array, results: Array, /) -> bool: ...


def change_values(
    n: int,
    s: int,
    relays: Relays,
    event: int,
    places: Integers,
    y: Array,
    values: Array,
    changed: Array,
) -> int:
    """Change the states with two values that are due: that of an event, and those whose number is
    below zero; at a start, where event is s, zero counts as that.

    y has n numbers, places says where the s states stand among them. values and changed are
    overwritten. Return 0, or why nothing follows: 1 where a number is not known, 4 where both
    conditions of a state hold.
    """
    for k in range(s):
        changed[k] = 0.0
    if event < s:
        y[places[event]] = 1.0 - y[places[event]]
        changed[event] = 1.0
    touches = event == s
    changing = True
    while changing:
        changing = False
        if not relays.switches(y, values):
            return UNDETERMINED
        for k in range(s):
            due = values[k] < 0.0
            if touches:
                due = values[k] <= 0.0
            if due and not changed[k] > 0.0:
                y[places[k]] = 1.0 - y[places[k]]
                changed[k] = 1.0
                changing = True
        touches = False
    largest = 0.0
    for i in range(n):
        if abs(y[i]) > largest:
            largest = abs(y[i])
    for k in range(s):
        if changed[k] > 0.0 and values[k] < -ERROR_OF_STEPS * largest:
            return NO_VALUE
    return 0


def interpolated(rows: int, width: int, table: Array, t: float, at: float) -> float:
    """Return a recorded input at time t, by the polynomial that holds at another time.

    Each row of the table has the time at which its polynomial begins, and width - 1 coefficients of
    powers of the time since then, the lowest first. The first polynomial holds before, the last
    one behind all rows.
    """
    low = 0
    high = rows
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle * width] <= at:
            low = middle
        else:
            high = middle
    value = 0.0
    for k in reversed(range(1, width)):
        value = value * (t - table[low * width]) + table[low * width + k]
    return value


class Dynamics(Protocol):
    """The right-hand side with inputs held: it tells whether there are results."""

    def rhs(self, t: float, y: Array, results: Array, /) -> bool: ...


def runge_kutta(
    n: int,
    dynamics: Dynamics,
    t: float,
    h: float,
    y: Array,
    stage: Array,
    slope: Array,
    change: Array,
) -> bool:
    """Advance the n numbers of y from t by h with Runge and Kutta's method of order four.

    Return whether there is a result; y stays without one. stage, slope and change are overwritten.
    """
    if not dynamics.rhs(t, y, slope):
        return False
    for i in range(n):
        change[i] = slope[i] / 6.0
        stage[i] = y[i] + h / 2.0 * slope[i]
    if not dynamics.rhs(t + h / 2.0, stage, slope):
        return False
    for i in range(n):
        change[i] += slope[i] / 3.0
        stage[i] = y[i] + h / 2.0 * slope[i]
    if not dynamics.rhs(t + h / 2.0, stage, slope):
        return False
    for i in range(n):
        change[i] += slope[i] / 3.0
        stage[i] = y[i] + h * slope[i]
    if not dynamics.rhs(t + h, stage, slope):
        return False
    for i in range(n):
        y[i] += h * (change[i] + slope[i] / 6.0)
    return True


def implicit_midpoint(
    n: int, dynamics: Dynamics, t: float, h: float, y: Array, stage: Array, slope: Array
) -> bool:
    """Advance the n numbers of y from t by h with the implicit midpoint rule, by iteration.

    Return whether there is a result; y stays without one, as where the iteration does not settle
    because h is too long. stage and slope are overwritten.
    """
    for i in range(n):
        stage[i] = y[i]
    left = MOST_ITERATIONS
    moving = True
    while moving:
        if left == 0:
            return False
        if not dynamics.rhs(t + h / 2.0, stage, slope):
            return False
        left -= 1
        moving = False
        for i in range(n):
            moved = y[i] + h / 2.0 * slope[i]
            if abs(moved - stage[i]) > SETTLED * (abs(y[i]) + abs(h * slope[i])):
                moving = True
            stage[i] = moved
    for i in range(n):
        y[i] += h * slope[i]
    return True
