"""Emitted Python with contacts: functions that take a mode, and the script that follows it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.constants import BOUNCES, EVENTS
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.program import Program
from lagrange_cli.emit.python_project import project_source
from lagrange_cli.emit.python_reset import reset_source
from lagrange_cli.emit.starting import TOLERANCE

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["CONTACT_NOTES", "contact_constants", "contact_script", "interface_source"]

#: What the module says of them.
CONTACT_NOTES = [
    "",
    "A contact, one of CONTACTS, pushes while it is closed. mode says which are: a sequence of",
    "as many 0 (open) and 1 (closed), FLIGHT if absent. Integrate with a fixed mode until one of",
    "the numbers that events gives falls through zero, say number k; find when; call reset with",
    "event=k there; go on with the state and the mode that it returns. Begin with reset alone.",
    "As a script the module does so.",
]

_FLAGS = '''\
def _flags(mode):
    """1.0 for what is closed, then zeros (targets of impulses)."""
    if len(mode) != len(CONTACTS):
        raise ValueError("mode has one entry for each of CONTACTS")
    return [*(float(bool(closed)) for closed in mode), *[0.0] * len(CONTACTS)]
'''

_RHS = '''\
def rhs(t, y, @P@, mode=FLIGHT):
    """State derivative [v, a] at time t while mode stays; all NaN where it does not exist."""
    if not any(mode):
        return _flight_rhs(t, y, @GIVEN@)
    return _contact_rhs(t, y, @GIVEN@, _flags(mode))
'''

_FUNCTION = '''\
def @FUNCTION@(t, y, @P@, mode=FLIGHT):
    """@DOC@"""
    return _contact_@FUNCTION@(t, y, @GIVEN@, _flags(mode))
'''

_DOCS = {
    "multipliers": "Multipliers, in the order of MULTIPLIERS, zero for what is open; NaN if none.",
    "constraints": "What is zero, in the order of RESIDUALS; so is all of what is open.",
    "events": "What falls through zero at events: multipliers of what is closed, else gaps.",
}

_PROJECT = '''\
def project(t, y, p=DEFAULTS, mode=FLIGHT):
    """The state led back to what is closed (all NaN where it is too far from it): q by the
    smallest changes in the metric of the kinetic energy, until only rounding is left
    (Newton's method), then v in the same metric.
    """
    return _contact_project(t, y, p, _flags(mode))
'''

_RESET = '''\
def reset(t, y, @P@, mode=FLIGHT, event=-1, bounce=1.0):
    """The state and the mode to go on with after an event, or from a start (event=-1).

    What closes takes an impact, by Newton's law with impulses that only push (bounce=0.0:
    without restitution, to end a sequence of ever shorter bounces). None where there is no such
    impact, or a restitution is not between 0 and 1.
    """
    state, flags = _contact_reset(t, y, @GIVEN@, _flags(mode), event, bounce)
    return None if state is None else (state, tuple(int(flag) for flag in flags))
'''

_SCRIPT = '''\
def step(t, y, h, p, mode):
    """State after one classical Runge-Kutta step of size h, led back to what is closed."""
@HELD@    k1 = rhs(t, y, p@U@, mode=mode)
    k2 = rhs(t + h / 2, y + h / 2 * k1, p@U@, mode=mode)
    k3 = rhs(t + h / 2, y + h / 2 * k2, p@U@, mode=mode)
    k4 = rhs(t + h, y + h * k3, p@U@, mode=mode)
    return project(t + h, y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), p, mode)


def find(before, found, mode, largest):
    """A contact that has to open or close, or None. Numbers are measured by the largest so far,
    so that rounding is no event; nor is what was below zero before (a gap that only touches).
    """
    for k, closed in enumerate(mode):
        largest[closed][k] = max(largest[closed][k], abs(found[k]))
        if found[k] < min(before[k], 0.0) - @NOISE@ * largest[closed][k]:
            return k
    return None


def advance(t, y, h, p, mode, largest):
    """State and mode after a step of size h, with its events, whose times are bisected."""
    end = t + h
    for count in range(@EVENTS@ + 1):
        if not t < end:
            return y, mode
        early, late, event = 0.0, end - t, None
        trial, rounding = late, @ULP@ * abs(t)
        before = events(t, y, p, mode=mode)
        while event is None or (early < trial < late and late - early > rounding):
            state = step(t, y, trial, p, mode)
            due = find(before, events(t + trial, state, p, mode=mode), mode, largest)
            if event is None and due is None:
                return state, mode
            if due is None:
                early = trial
            else:
                event, late = due, trial
            trial = early + (late - early) / 2
        y, t = step(t, y, late, p, mode), t + late
        name = f"{'release' if mode[event] else 'contact'}:{CONTACTS[event]}"
        print(f"t = {t!r}: {name}", file=sys.stderr)
        after = reset(t, y, p, mode=mode, event=event, bounce=float(count < @BOUNCES@))
        if after is None:
            break
        y, mode = after
        if count == @BOUNCES@:
            print(f"t = {t!r}: ever shorter bounces end here", file=sys.stderr)
    return np.full(len(y), nan), mode


def integrate(y, t, until, steps, p=DEFAULTS, mode=FLIGHT, largest=None):
    """State and mode after ``steps`` steps of fixed size from t to until."""
    h = (until - t) / steps
    largest = np.zeros((2, len(mode))) if largest is None else largest
    for k in range(steps):
        y, mode = advance(t + k * h, y, h, p, mode, largest)
    return y, mode


def begin(y, until, p):
    """State and mode at the start, and what is wrong with it: a gap below zero."""
    if until < START:
        return y, FLIGHT, "until=T: impacts cannot be followed back in time"
    bound = -@TOLERANCE@ * np.abs(y[: len(y) // 2]).max()
    for name, gap in zip(CONTACTS, events(START, y, p).tolist()):
        if gap < bound:
            return y, FLIGHT, f"the initial state violates {name} by {-gap:.3g}"
    after = reset(START, y, p)
    if after is None:
        return y, FLIGHT, "no motion begins at the initial state"
    return *after, ""
'''

#: Lines of the script, and what they are with contacts.
_CHANGES = (
    (
        "    times = np.linspace(",
        """\
    y, mode, wrong = begin(y, run["until"], p)
    if wrong:
        return wrong
    largest = np.zeros((2, len(mode)))
    times = np.linspace(""",
    ),
    (
        'y = integrate(y, t, following, run["steps"], p)',
        'y, mode = integrate(y, t, following, run["steps"], p, mode, largest)',
    ),
)


def contact_constants(equations: Equations) -> list[str]:
    """Names of the contacts, and the mode with all of them open."""
    contacts = equations.contacts
    if not contacts:
        return []
    texts = [f"# {comment_text(f'{c.name}: {c.closure.text}')}" for c in contacts]
    names = tuple(contact.name for contact in contacts)
    return [*texts, f"CONTACTS = {names!a}", f"FLIGHT = {(0,) * len(contacts)!r}"]


def interface_source(programs: Mapping[str, Program], parameter: str) -> list[str]:
    """Projection, events and impacts, and the functions of the interface around them.

    Parameters
    ----------
    parameter
        Parameters of the functions of the interface, with their defaults.
    """
    if "gaps" not in programs:
        return []
    given = ", ".join(argument.split("=")[0] for argument in parameter.split(", "))
    functions = [
        _FUNCTION.replace("@FUNCTION@", name).replace("@DOC@", doc) for name, doc in _DOCS.items()
    ]
    texts = [_FLAGS, _RHS, *functions, _PROJECT, _RESET]
    return [
        project_source(programs, "p, contact", "contact_"),
        *reset_source(programs, f"{given}, contact"),
        *(text.replace("@P@", parameter).replace("@GIVEN@", given) for text in texts),
    ]


def contact_script(script: str, held: str, rounding: float) -> str:
    """The script with steps that follow contacts.

    Parameters
    ----------
    script
        The script without contacts.
    held
        Lines that hold recorded inputs to a step from ``t`` on, empty without any.
    rounding
        Half the distance from 1 to the next number.
    """
    main = script.partition("    return y\n\n\n")[2]
    for line, changed in _CHANGES:
        main = main.replace(line, changed)
    text = f"{_SCRIPT}\n\n{main}"
    for token, replacement in {
        "@HELD@": held,
        "@U@": ", held" if held else "",
        "@TOLERANCE@": repr(TOLERANCE),
        "@NOISE@": repr(1024 * rounding),
        "@ULP@": repr(2 * rounding),
        "@EVENTS@": str(EVENTS),
        "@BOUNCES@": str(BOUNCES),
    }.items():
        text = text.replace(token, replacement)
    return text
