"""``events`` and ``reset`` of Python with one-sided constraints.

The same as in C (:mod:`lagrange_cli.emit.c_reset`), which explains the method.
"""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.constants import IMPACT_TOLERANCES, PUSH_STEPS, RATE_TOLERANCE
from lagrange_cli.emit.program import Program, results_of

__all__ = ["reset_source"]

_PUSHES = '''\
class _Deadlock(ArithmeticError):
    """There is no motion behind an event; ``flags`` are 1.0 for contacts that leave none."""

    def __init__(self, flags):
        self.flags = np.asarray(flags, dtype=float)


def _raise(k, d, w, x, active):
    """Raises push k until w[k] is zero; active pushes that are used up end."""
    while True:
        held = np.flatnonzero(active)
        r = np.linalg.solve(d[np.ix_(held, held)], d[held, k])
        rise = d[k, k] - d[k, held] @ r
        full = -w[k] / rise if rise > @TOLERANCE@ else np.inf
        ends = [(x[j] / ratio, j) for j, ratio in zip(held, r) if ratio > 0.0]
        least, first = min(ends, default=(np.inf, -1))
        if min(full, least) == np.inf:
            flags = np.arange(len(w)) == k
            flags[held] = r < -@TOLERANCE@
            raise _Deadlock(flags)
        x[held] = np.maximum(x[held] - min(full, least) * r, 0.0)
        x[k] += min(full, least)
        if full <= least:
            active[k] = True
            return
        w[k] = min(w[k] + least * rise, 0.0)
        x[first], active[first] = 0.0, False


def _pushes(d, w, size, closed):
    """Which closed contacts push, with w + d x >= 0 for pushes x >= 0, one of both zero for each
    (the dual method of Goldfarb and Idnani, Math. Programming 27 (1983) 1).
    """
    x, active = np.zeros(len(w)), np.zeros(len(w), dtype=bool)
    given, sizes = np.where(np.abs(w) > @TOLERANCE@ * size, w, 0.0), size
    for _ in range(@STEPS@ * (len(w) + 1)):
        w = given + d @ x
        size = sizes + np.abs(d) @ x
        w[active | (np.abs(w) <= @TOLERANCE@ * size)] = 0.0
        violated = np.flatnonzero(closed & (w < 0.0))
        if not violated.size:
            return active
        _raise(violated[0], d, w, x, active)
    raise _Deadlock(np.zeros(len(w)))


def _known(values):
    """The values, all of which must be finite."""
    if not np.isfinite(values).all():
        raise ArithmeticError("not finite")
    return values
'''

_EVENTS = '''\
def @EVENTS@(t, y, @P@):
    """What falls through zero at an event: multipliers of what is in contact, else gaps."""
    flags = np.array(@FLAGS@)
    found = @OWN@gaps(t, y, @P@)[:@U@]
    if not flags.any():
        return found
    return np.where(flags > 0.0, @OWN@contact_multipliers(t, y, @P@)[-@U@:], found)
'''

_TERMS = '''\
def _gap_table(t, y, @P@):
    """Gradients of the gaps by rows, then rates, biases and restitutions."""
    terms = _known(@OWN@gap_terms(t, y, @P@))
    n = len(y) // 2
    return terms[: @U@ * n].reshape(@U@, n), *terms[@U@ * n :].reshape(3, @U@)


def _responses(t, y, @P@, gradient, closed):
    """What a unit impulse of each closed contact adds to the rates of all, in its own unit."""
    d = np.zeros((@U@, @U@))
    for k in np.flatnonzero(closed):
        flags = targets = (np.arange(@U@) == k).astype(float)
        @SET@
        change = @OWN@impulse(t, y, @P@)
        # One that the closures alone hold back takes no impulse.
        if np.isfinite(change).all():
            d[:, k] = gradient @ change
    return d
'''

_HIT = '''\
def _hit(t, y, @P@, bounce, d, table, speed, size, closed, held):
    """The state after an impact of what is closed, the rates of the gaps and their magnitudes."""
    gradient, rate, _, restitution = table
    if not ((restitution >= 0.0) & (restitution <= 1.0 + @TOLERANCE@))[closed].all():
        raise ArithmeticError("a restitution is not between 0 and 1")
    speed = np.where(held, 0.0, speed)
    # The least rate after the impact, and that of active contacts.
    least = -bounce * restitution * np.minimum(speed, 0.0)
    flags = _pushes(d, speed - least, size, closed)
    n = len(y) // 2
    # A second time for what rounding has left of the first.
    for _ in range(2):
        targets = least - gradient @ y[n:] - rate
        @SET@
        y[n:] += _known(@OWN@impulse(t, y, @P@))
    speed = gradient @ y[n:] + rate
    size = size + np.abs(gradient) @ np.abs(y[n:]) + np.abs(rate)
    off = np.where(flags, np.abs(speed - least), least - speed)
    if not (off <= @LOOSER@ * @TOLERANCE@ * size)[closed].all():
        raise ArithmeticError("an impact that is not resolved")
    return y, np.where(flags, least, speed), size


def _settle(t, y, @P@, d, closed):
    """The contacts among what is closed that have to push now (1.0, else 0.0)."""
    gradient, _, bias, _ = _gap_table(t, y, @P@)
    a = _known(@FLIGHT@(t, y, @FREE@))[len(y) // 2 :]
    w, size = gradient @ a + bias, np.abs(gradient) @ np.abs(a) + np.abs(bias)
    flags, targets = _pushes(d, w, size, closed).astype(float), np.zeros(@U@)
    @SET@
    if flags.any():
        _known(@OWN@contact_multipliers(t, y, @P@))
    return flags
'''

_RESET = '''\
def _after(t, y, @P@, event, bounce):
    """The state and what is in contact after an event, or an ArithmeticError."""
    gap, near = _known(@OWN@gaps(t, y, @P@)).reshape(2, @U@)
    table = _gap_table(t, y, @P@)
    gradient, rate = table[:2]
    v = y[len(y) // 2 :]
    speed, size = gradient @ v + rate, np.abs(gradient) @ np.abs(v) + np.abs(rate)
    # What closes within the rounding error of the time closes now.
    near = @TOLERANCE@ * near - @ULPS@ * abs(t) * np.minimum(speed, 0.0)
    held = np.array(@FLAGS@) > 0.0
    closed = held | (np.arange(@U@) == event) | (gap <= near)
    d = _responses(t, y, @P@, gradient, closed)
    stays = held
    if (closed & ~held & (speed < -@TOLERANCE@ * size)).any():
        y, speed, size = _hit(t, y, @P@, bounce, d, table, speed, size, closed, held)
        stays = np.zeros(@U@, dtype=bool)
    # One that was in contact and has its event is released, unless an impact came between.
    closed &= ~(stays & (np.arange(@U@) == event))
    closed &= stays | (speed <= @TOLERANCE@ * size)
    return y, _settle(t, y, @P@, d, closed)


def @RESET@(t, y, @P@, event, bounce):
    """The state after an event, and which contacts are then closed (1.0, else 0.0).

    ``event``: the number of the contact whose event it is (-1: a start); ``bounce``: 1.0, or 0.0
    for an impact without restitution. Where there is no such state it is None, and the contacts
    are those that leave no motion, if that is the reason.
    """
    try:
        with np.errstate(all="ignore"):
            return _after(t, np.array(y, dtype=float), @P@, event, bounce)
    except _Deadlock as found:
        return None, found.flags
    except (ArithmeticError, np.linalg.LinAlgError):
        return None, np.zeros(@U@)
'''


def reset_source(programs: Mapping[str, Program], parameter: str) -> list[str]:
    """Definitions of ``events`` and ``reset``, none where there are no contacts.

    Parameters
    ----------
    parameter
        The text of the arguments of all functions behind ``t`` and ``y``. Flags and targets
        stand in ``p`` behind the parameters, or in ``contact`` where that is among them.
    """
    if "gaps" not in programs:
        return []
    u = results_of(programs["gaps"]) // 2
    own = programs["gaps"].parameters - 2 * u
    apart = parameter.endswith("contact")
    replacements = {
        "@SET@": "contact = [*map(float, flags), *map(float, targets)]"
        if apart
        else f"p = [*p[:{own}], *map(float, flags), *map(float, targets)]",
        "@FLAGS@": f"contact[:{u}]" if apart else f"p[{own}:{own + u}]",
        "@OWN@": "_" if apart else "",
        "@FLIGHT@": "_flight_rhs" if apart else "rhs",
        "@FREE@": parameter.removesuffix(", contact"),
        "@EVENTS@": "_contact_events" if apart else "events",
        "@RESET@": "_contact_reset" if apart else "reset",
        "@P@": parameter,
        "@U@": str(u),
        "@TOLERANCE@": repr(RATE_TOLERANCE),
        "@LOOSER@": repr(IMPACT_TOLERANCES),
        "@ULPS@": repr(2.0**-46),
        "@STEPS@": str(PUSH_STEPS),
    }
    parts = []
    for part in (_EVENTS, _PUSHES, _TERMS, _HIT, _RESET):
        for token, replacement in replacements.items():
            part = part.replace(token, replacement)
        parts.append(part)
    return parts
