"""Events of contacts: impacts, and the contacts that are closed behind them.

At an event the closed contacts take an impact if one of them approaches, by Newton's law with
impulses that only push (Moreau, *Unilateral contact and dry friction in finite freedom dynamics*,
1988; Glocker and Pfeiffer, *Nonlinear Dynamics* 7 (1995) 471): w = u⁺ + e·min(u⁻, 0) ≥ 0, Λ ≥ 0,
w·Λ = 0 for the rates u. Contacts that do not leave stay closed if they have to push: λ ≥ 0, φ̈ ≥ 0,
λ·φ̈ = 0.

A mode is c flags of closed contacts, 1 or 0, then c targets, changes of rates that an impulse
causes. Terms of gaps are c gradients of n numbers, then c rates, biases and restitutions.
"""

from __future__ import annotations

from typing import Protocol

from lagrange_cli.program.lowered.routines.numbers import Array
from lagrange_cli.program.lowered.routines.pushes import push
from lagrange_cli.program.solvers.tolerances import IMPACT_TOLERANCES, RATE_TOLERANCE

#: Status where a configuration is singular or a number not finite.
UNDETERMINED = 1

#: Status where contacts leave no motion (walls that close in), or restitutions are impossible.
NO_MOTION = 4

#: Part of a time that is its rounding error, some units in the last place.
INSTANT = 2.0**-46


class Contacts(Protocol):
    """Functions of contacts at one time: each stores its results and tells whether there are any.

    ``gaps`` stores them, then the sums of the magnitudes of their terms; ``gap_terms`` is what
    this module describes; ``flight_rhs`` is the state derivative with all contacts open;
    ``impulse`` is the change of velocities, ``contact_multipliers`` the multipliers in a mode.
    """

    def gaps(self, y: Array, results: Array, /) -> bool: ...

    def gap_terms(self, y: Array, results: Array, /) -> bool: ...

    def flight_rhs(self, y: Array, results: Array, /) -> bool: ...

    def impulse(self, y: Array, mode: Array, results: Array, /) -> bool: ...

    def contact_multipliers(self, y: Array, mode: Array, results: Array, /) -> bool: ...


def falling(
    c: int, m: int, contacts: Contacts, y: Array, mode: Array, out: Array, gap: Array, force: Array
) -> bool:
    """Store what falls through zero where one of c contacts opens or closes.

    It is the multiplier of a closed one, behind those of m closures, and the gap of an open one.
    gap and force are overwritten. Tell whether all are known.
    """
    if not contacts.gaps(y, gap):
        return False
    closed = False
    for k in range(c):
        out[k] = gap[k]
        if mode[k] > 0.0:
            closed = True
    if closed:
        if not contacts.contact_multipliers(y, mode, force):
            return False
        for k in range(c):
            if mode[k] > 0.0:
                out[k] = force[m + k]
    return True


def reset_contacts(
    n: int,
    c: int,
    contacts: Contacts,
    event: int,
    bounce: float,
    late: float,
    y: Array,
    mode: Array,
    gap: Array,
    terms: Array,
    before: Array,
    closed: Array,
    speed: Array,
    size: Array,
    start: Array,
    w: Array,
    x: Array,
    d: Array,
    change: Array,
    slope: Array,
    force: Array,
    r: Array,
    a: Array,
) -> int:
    """Change state and mode behind an event of a contact, or at a start, where event is c.

    bounce is 1, or 0 for an impact without restitution; what closes within the time late closes
    now. The arrays behind the mode are overwritten. Return 0, or why nothing follows: 1 in a
    singular configuration or where a number is not finite, 4 where contacts leave no motion, which
    are then those of the mode.
    """
    if not look(n, c, contacts, event, late, y, mode, gap, terms, before, closed, speed, size):
        clear(c, mode)
        return UNDETERMINED
    respond(n, c, contacts, y, mode, terms, closed, d, change)
    clear(c, mode)
    approaching = False
    for k in range(c):
        if closed[k] > 0.0 and not before[k] > 0.0 and speed[k] < -RATE_TOLERANCE * size[k]:
            approaching = True
    if approaching:
        outcome = collide(
            n,
            c,
            contacts,
            bounce,
            y,
            mode,
            terms,
            before,
            closed,
            speed,
            size,
            start,
            w,
            x,
            d,
            change,
            r,
            a,
        )
        if outcome > 0:
            return outcome
    for k in range(c):
        stays = speed[k] <= RATE_TOLERANCE * size[k]
        if before[k] > 0.0 and not approaching:
            stays = k != event
        if not stays:
            closed[k] = 0.0
    return settle(n, c, contacts, y, mode, terms, closed, size, start, w, x, d, slope, force, r, a)


def settle(
    n: int,
    c: int,
    contacts: Contacts,
    y: Array,
    mode: Array,
    terms: Array,
    closed: Array,
    size: Array,
    start: Array,
    w: Array,
    x: Array,
    d: Array,
    slope: Array,
    force: Array,
    r: Array,
    a: Array,
) -> int:
    """Store the mode in which those of the closed contacts are closed that have to push now.

    Return 0, or why nothing follows.
    """
    if not contacts.gap_terms(y, terms):
        return UNDETERMINED
    if not contacts.flight_rhs(y, slope):
        return UNDETERMINED
    for k in range(c):
        start[k] = terms[c * n + c + k]
        size[k] = abs(start[k])
        for i in range(n):
            start[k] += terms[k * n + i] * slope[n + i]
            size[k] += abs(terms[k * n + i] * slope[n + i])
    if not push(c, d, closed, start, size, w, x, mode, r, a):
        return NO_MOTION
    pushing = False
    for k in range(c):
        mode[c + k] = 0.0
        if mode[k] > 0.0:
            pushing = True
    if not pushing:
        return 0
    if not contacts.contact_multipliers(y, mode, force):
        clear(c, mode)
        return UNDETERMINED
    return 0


def look(
    n: int,
    c: int,
    contacts: Contacts,
    event: int,
    late: float,
    y: Array,
    mode: Array,
    gap: Array,
    terms: Array,
    before: Array,
    closed: Array,
    speed: Array,
    size: Array,
) -> bool:
    """Store gaps and terms at a state, what was closed and is now, and rates of the gaps.

    Tell whether all are known.
    """
    if not contacts.gaps(y, gap):
        return False
    if not contacts.gap_terms(y, terms):
        return False
    for k in range(c):
        speed[k] = gap_rate(n, c, k, y, terms)
        size[k] = gap_size(n, c, k, y, terms)
        near = RATE_TOLERANCE * gap[c + k]
        if speed[k] < 0.0:
            near -= late * speed[k]
        before[k] = mode[k]
        closed[k] = 0.0
        if before[k] > 0.0 or k == event or gap[k] <= near:
            closed[k] = 1.0
    return True


def gap_rate(n: int, c: int, k: int, y: Array, terms: Array) -> float:
    """Return the rate of gap k."""
    rate = terms[c * n + k]
    for i in range(n):
        rate += terms[k * n + i] * y[n + i]
    return rate


def gap_size(n: int, c: int, k: int, y: Array, terms: Array) -> float:
    """Return the sum of the magnitudes of the terms of the rate of gap k."""
    size = abs(terms[c * n + k])
    for i in range(n):
        size += abs(terms[k * n + i] * y[n + i])
    return size


def clear(c: int, mode: Array) -> None:
    """Open all contacts of a mode."""
    for k in range(2 * c):
        mode[k] = 0.0


def respond(
    n: int,
    c: int,
    contacts: Contacts,
    y: Array,
    mode: Array,
    terms: Array,
    closed: Array,
    d: Array,
    change: Array,
) -> None:
    """Store by columns what a unit impulse of each closed contact adds to the rates of all gaps."""
    for k in range(c):
        clear(c, mode)
        mode[k] = 1.0
        mode[c + k] = 1.0
        moves = False
        if closed[k] > 0.0:
            moves = contacts.impulse(y, mode, change)
        # One that the closures alone hold back takes no impulse.
        for j in range(c):
            d[j * c + k] = 0.0
            for i in range(n):
                if moves:
                    d[j * c + k] += terms[j * n + i] * change[i]


def collide(
    n: int,
    c: int,
    contacts: Contacts,
    bounce: float,
    y: Array,
    mode: Array,
    terms: Array,
    before: Array,
    closed: Array,
    speed: Array,
    size: Array,
    start: Array,
    w: Array,
    x: Array,
    d: Array,
    change: Array,
    r: Array,
    a: Array,
) -> int:
    """Change velocities by the impact of what is closed, and the rates of the gaps with them.

    Return 0, or why that is impossible.
    """
    for k in range(c):
        e = terms[c * n + 2 * c + k]
        if closed[k] > 0.0 and not (e >= 0.0 and e <= 1.0 + RATE_TOLERANCE):
            return NO_MOTION
        if before[k] > 0.0:
            speed[k] = 0.0
        start[k] = speed[k]
        if speed[k] < 0.0:
            start[k] += bounce * e * speed[k]
    if not push(c, d, closed, start, size, w, x, mode, r, a):
        return NO_MOTION
    # The least rate after the impact, and that of active contacts.
    for k in range(c):
        least = 0.0
        if speed[k] < 0.0:
            least = -bounce * terms[c * n + 2 * c + k] * speed[k]
        speed[k] = least
    # A second time for what rounding has left of the first.
    rounds = 2
    while rounds > 0:
        rounds -= 1
        for k in range(c):
            mode[c + k] = speed[k] - gap_rate(n, c, k, y, terms)
        if not contacts.impulse(y, mode, change):
            clear(c, mode)
            return UNDETERMINED
        for i in range(n):
            y[n + i] += change[i]
    for k in range(c):
        rate = gap_rate(n, c, k, y, terms)
        size[k] += gap_size(n, c, k, y, terms)
        error = speed[k] - rate
        if mode[k] > 0.0:
            error = abs(error)
        if closed[k] > 0.0 and not error <= IMPACT_TOLERANCES * RATE_TOLERANCE * size[k]:
            clear(c, mode)
            return NO_MOTION
        if not mode[k] > 0.0:
            speed[k] = rate
    return 0


def reset_arrays(n: int, rates: int, c: int, m: int) -> dict[str, int]:
    """Return how many numbers the arrays hold that ``reset_contacts`` overwrites, in their order.

    rates is the number of rates of the state, m that of multipliers, those of closures among them.
    """
    single = ("before", "closed", "speed", "size", "start", "w", "x")
    arrays = {"gap": 2 * c, "terms": c * (n + 3), **dict.fromkeys(single, c), "d": c * c}
    return {**arrays, "change": n, "slope": rates, "force": m, "r": c, "a": c * c}
