"""Pushes of contacts: w + d x >= 0 and x >= 0, of which one is zero for each contact.

w are rates or accelerations of gaps, d[j, k] what a unit of push k adds to w[j]. These are the
optimality conditions of a projection in the metric of the kinetic energy, which the dual method of
Goldfarb and Idnani finds (*Math. Programming* 27 (1983) 1): it copes with contacts that depend on
others. Flags are 1 or 0.
"""

from __future__ import annotations

from lagrange_cli.program.lowered.routines.numbers import Array
from lagrange_cli.program.solvers.tolerances import COMPLEMENTARITY_STEPS, RATE_TOLERANCE

#: Number of contacts from which on those that push are guessed first: the dual method alone is
#: cheap for few contacts, and each guess costs a factorization. Chosen as that trade; not tuned.
FEWEST_GUESSED = 8

#: Rounds of guesses of the contacts that push: most sets settle in a few, and a set that has not
#: is left to the dual method, which always ends. Chosen as that trade; not tuned.
GUESSES = 12

#: Pivot of a matrix with ones on the diagonal that ends the guesses: contacts that nearly depend on
#: others would give pushes without digits. Chosen well above rounding; not tuned.
LEAST_PIVOT = 1e-6


def push(
    n: int,
    d: Array,
    closed: Array,
    start: Array,
    size: Array,
    w: Array,
    x: Array,
    active: Array,
    r: Array,
    a: Array,
) -> bool:
    """Find pushes x of the n contacts of which some are closed, and which of them are active.

    start are the numbers w without pushes, size the magnitudes that they are sums of: what is
    rounding becomes zero. The arrays behind are overwritten. Tell whether there are such pushes;
    else active are contacts that cannot all be met, none where that is not known.
    """
    for k in range(n):
        x[k] = 0.0
        active[k] = 0.0
        if not abs(start[k]) > RATE_TOLERANCE * size[k]:
            start[k] = 0.0
    if n >= FEWEST_GUESSED:
        guess_pushes(n, d, closed, start, size, x, active, r, a)
    steps = COMPLEMENTARITY_STEPS * (n + 1)
    while steps > 0:
        steps -= 1
        violated = n
        for k in reversed(range(n)):
            w[k] = start[k]
            magnitude = size[k]
            for j in range(n):
                w[k] += d[k * n + j] * x[j]
                magnitude += abs(d[k * n + j] * x[j])
            if active[k] > 0.0 or abs(w[k]) <= RATE_TOLERANCE * magnitude:
                w[k] = 0.0
            if closed[k] > 0.0 and w[k] < 0.0:
                violated = k
        if violated == n:
            return True
        if not raise_push(n, violated, d, w, x, active, r, a):
            return False
    for k in range(n):
        active[k] = 0.0
    return False


def raise_push(
    n: int, k: int, d: Array, w: Array, x: Array, active: Array, r: Array, a: Array
) -> bool:
    """Raise push k until w[k] is zero; active pushes that are used up end.

    r and a are overwritten. Tell whether that has an effect; else active are the contacts that
    take all of it.
    """
    while not active[k] > 0.0:
        for j in range(n):
            r[j] = 0.0
            if active[j] > 0.0:
                r[j] = d[j * n + k]
        if not solve_active(n, 0.0, d, active, r, a):
            for j in range(n):
                active[j] = 0.0
            return False
        rise = d[k * n + k]
        first = n
        least = 0.0
        for j in range(n):
            if active[j] > 0.0:
                rise -= d[k * n + j] * r[j]
                if r[j] > 0.0 and (first == n or x[j] / r[j] < least):
                    first = j
                    least = x[j] / r[j]
        if first == n and not rise > RATE_TOLERANCE:
            for j in range(n):
                active[j] = 0.0
                if j == k or r[j] < -RATE_TOLERANCE:
                    active[j] = 1.0
            return False
        if rise > RATE_TOLERANCE and (first == n or -w[k] / rise <= least):
            first = n
            least = -w[k] / rise
        for j in range(n):
            if active[j] > 0.0:
                x[j] -= least * r[j]
                if not x[j] > 0.0:
                    x[j] = 0.0
        x[k] += least
        if first == n:
            active[k] = 1.0
        else:
            w[k] += least * rise
            if w[k] > 0.0:
                w[k] = 0.0
            active[first] = 0.0
            x[first] = 0.0
    return True


def guess_pushes(
    n: int,
    d: Array,
    closed: Array,
    start: Array,
    size: Array,
    x: Array,
    active: Array,
    r: Array,
    a: Array,
) -> None:
    """Store x and active of what pushes at first sight: zeros where that does not end soon.

    It is all that is violated, without what would pull, with what is violated then
    (Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2002) 865). r and a are overwritten.
    """
    for k in range(n):
        active[k] = 0.0
        if closed[k] > 0.0 and start[k] < 0.0:
            active[k] = 1.0
    rounds = GUESSES
    changing = True
    while changing and rounds > 0:
        rounds -= 1
        for k in range(n):
            r[k] = 0.0
            if active[k] > 0.0:
                r[k] = -start[k]
        if not solve_active(n, LEAST_PIVOT, d, active, r, a):
            break
        changing = False
        for k in range(n):
            rate = start[k]
            magnitude = size[k]
            for j in range(n):
                rate += d[k * n + j] * r[j]
                magnitude += abs(d[k * n + j] * r[j])
            pushes = closed[k] > 0.0 and rate < -RATE_TOLERANCE * magnitude
            if active[k] > 0.0:
                pushes = r[k] > 0.0
            x[k] = 0.0
            if pushes:
                x[k] = 1.0
            if x[k] != active[k]:
                changing = True
        for k in range(n):
            if changing:
                active[k] = x[k]
            x[k] = r[k]
    if changing:
        for k in range(n):
            active[k] = 0.0
            x[k] = 0.0


def solve_active(n: int, least: float, d: Array, active: Array, r: Array, a: Array) -> bool:
    """Solve d x = r for active pushes alone; x replaces r, and a is overwritten.

    What is zero costs nothing (contacts that act on their neighbours). Tell whether all pivots are
    larger than the least one.
    """
    for i in range(n):
        for j in range(n):
            a[i * n + j] = 0.0
            if active[i] > 0.0 and active[j] > 0.0:
                a[i * n + j] = d[i * n + j]
            elif i == j:
                a[i * n + j] = 1.0
    for j in range(n):
        if not a[j * n + j] > least:
            return False
        for i in range(j + 1, n):
            ratio = a[i * n + j] / a[j * n + j]
            if ratio < 0.0 or ratio > 0.0:
                for k in range(j, n):
                    a[i * n + k] -= ratio * a[j * n + k]
                r[i] -= ratio * r[j]
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            r[i] -= a[i * n + j] * r[j]
        r[i] /= a[i * n + i]
    return True
