"""Status of a finished simulation, and the reason in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from lagrange_cli.phrases import Phrase, pattern
from lagrange_cli.simulate.accuracy.event_agreement import UnclearContacts
from lagrange_cli.simulate.accuracy.measured import Disproof, LimitingComponent, Measured
from lagrange_cli.simulate.integrators.hybrid.contact_motion import (
    ENDLESS,
    IMPOSSIBLE,
    TOO_MANY,
    UNDETERMINED,
)
from lagrange_cli.simulate.integrators.hybrid.meeting import (
    AMBIGUOUS,
    MAY_SPIRAL,
    NOT_ONE_COMBINATION,
    TOO_MANY_AT_ONCE,
    UNSETTLED,
)
from lagrange_cli.simulate.integrators.hybrid.surface_motion import CROWDED, IMPULSIVE
from lagrange_cli.simulate.integrators.right_hand_side import structured
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Failure
from lagrange_cli.simulate.system.singular_guard import positive_values

#: Time by which an end is proposed earlier, as a part of the motion so far.
_BEFORE = 0.01

#: Time ahead of a failure, as a part of the motion so far, by which what is declared positive has
#: reached zero if the failure is due to that; and the same in steps of a given length.
_BEYOND, _STEPS_AHEAD = 1e-6, 2.0

#: What is positive until a slip vanishes is below this where the slip is next to that.
_NEAR_REST = 1.0

#: Contacts that are named in one sentence.
_MOST_NAMED = 6

Status = Literal["ok", "accuracy_not_reached", "stopped", "blow_up"]

#: Says that a motion has come to the border of what is declared positive.
_LEFT = pattern("'{where}' is declared positive and reaches 0, where these equations end")

#: Says that a motion has come to the end of a table.
_TABLE_ENDS = pattern(
    "tabulated values end at {where}, and these equations with them; 'outside: hold' or"
    " 'outside: extend' in the scene goes on"
)

#: Says that a slip has vanished.
_SLIP_VANISHES = pattern(
    "the slip {where} vanishes in all directions, and with it the direction of the friction: what"
    " holds the body there is not in the scene. A rounded force goes on, with sqrt(v^2 + w^2) of a"
    " small velocity w in place of v"
)

_ENDS: dict[str, str] = {"positive": _LEFT, "table": _TABLE_ENDS, "slip": _SLIP_VANISHES}

_DISPROOFS = {
    "energy": pattern(
        "the energy is not what it was. A force acts in less than a step; {option} with a {step}"
        " that resolves it goes on"
    ),
    "gap": pattern(
        "{contacts} violated, a contact was missed. It closes and opens within less than a step;"
        " {option} with a small {step} makes shorter ones"
    ),
    "impact": pattern(
        "Newton's law of impact adds energy where {contacts} struck at once. It does not with a"
        " restitution of 0"
    ),
    "uniqueness": pattern(
        "the motion comes to rest where {where} and a force pushes away with an infinite slope, so"
        " that more than one motion follows"
    ),
    **_ENDS,
}

#: Disproofs that are borders of the equations.
_BORDERS = ("positive", "table", "slip")

#: Options that go on where a run is disproved.
_BETTER = {
    "energy": {"option": "--method RK4", "step": "--step"},
    "gap": {"option": "--method RK45", "step": "--rtol"},
}

#: Why a motion with contacts cannot be continued: one is in the way, or several.
_STUCK: dict[str, tuple[str, str]] = {
    IMPOSSIBLE: (
        pattern(
            "the contact {contacts} leaves no motion: what it holds back is driven on, and no push"
            " of it can stop that"
        ),
        pattern(
            "the contacts {contacts} leave no motion: they push against each other, and what is"
            " between them cannot give way"
        ),
    ),
    UNDETERMINED: (
        pattern(
            "what the contact {contacts} does next cannot be determined: no impact satisfies"
            " Newton's law within rounding"
        ),
        pattern(
            "what the contacts {contacts} do next cannot be determined: no impact satisfies"
            " Newton's law within rounding"
        ),
    ),
    ENDLESS: (
        pattern("the contact {contacts} closes and opens without end"),
        pattern("the contacts {contacts} close and open without end"),
    ),
    TOO_MANY: (
        pattern("the contact {contacts} closes and opens more often than can be followed"),
        pattern("the contacts {contacts} close and open more often than can be followed"),
    ),
}

_WIDTH = Phrase("let what jumps grow within a width (tanh(x/w) for sign(x))")

#: Ways out for a user whose motion ends at a kink.
_KINKS: dict[str, str] = {
    AMBIGUOUS: Phrase("begin beside it, or {way_out}", way_out=_WIDTH),
    CROWDED: Phrase("{option} ends before, and tanh(x/w) for sign(x) goes on", option="--until"),
    **dict.fromkeys(
        (UNSETTLED, TOO_MANY_AT_ONCE, NOT_ONE_COMBINATION, MAY_SPIRAL),
        Phrase("tanh(x/w) for sign(x) makes it smooth"),
    ),
    IMPULSIVE: _WIDTH,
}

_NO_BOUNCE = pattern("a restitution of 0 for {contact} keeps it closed")

#: Ways out for a user whose motion ends at contacts.
_WAYS_OUT: dict[str, str] = {
    IMPOSSIBLE: pattern("a stiff spring in place of {contact} gives way"),
    UNDETERMINED: pattern("restitutions are from 0 to 1, and the same where contacts meet"),
    ENDLESS: _NO_BOUNCE,
    TOO_MANY: _NO_BOUNCE,
}


def status(problem: InitialValueProblem, measured: Measured) -> Status:
    """Return the status of a run, by what was asked for and what was measured."""
    if len(measured.states) == len(problem.times):
        return "ok"
    if measured.stopped:
        return "stopped"
    if measured.disproved is not None:
        return "blow_up" if measured.disproved.by in _BORDERS else "accuracy_not_reached"
    ends = measured.failure is not None and not measured.failure.by_rounding
    return "blow_up" if ends else "accuracy_not_reached"


def reason(model: Model, problem: InitialValueProblem, measured: Measured, request: Request) -> str:
    """Say in words why a result is not all that was asked for."""
    ended = status(problem, measured)
    last = f"{float(problem.times[len(measured.states) - 1]):.9g}"
    if ended == "ok":
        return ""
    if ended == "stopped":
        return Phrase("stopped; what is kept ends at t = {last}", last=last)
    accuracy = "" if request.accuracy is None else f"{request.accuracy:g}"
    if measured.disproved is not None:
        why, at = _disproof(model, measured.disproved), f"{measured.disproved.time:.9g}"
        if not accuracy or measured.disproved.by in ("uniqueness", *_BORDERS):
            return Phrase("what is kept ends at t = {last}: {why}", last=last, why=why)
        return Phrase(
            "accuracy {accuracy} is disproved at t = {at}: {why}", accuracy=accuracy, at=at, why=why
        )
    if measured.failure is not None:
        return _failed(model, problem, measured.failure, request)
    holds = Phrase(
        "accuracy {accuracy} holds until t = {last} of {until}",
        accuracy=accuracy,
        last=last,
        until=f"{problem.until:.9g}",
    )
    why = _unkept(model, measured, float(last))
    return Phrase("{text}: {why}", text=holds, why=why) if why else holds


def _unkept(model: Model, measured: Measured, last: float) -> str:
    """Say why a promise ends; empty where that is not known."""
    ends = [s for s in measured.switches if s.kind == "zeno" and s.t >= last]
    if ends:
        return Phrase(
            "the bounces on '{contact}' become infinitely many by t = {t}, and nothing is promised"
            " of what follows; {option} goes on with the contact closed",
            contact=model.contacts[ends[0].contact],
            t=f"{ends[0].t:.9g}",
            option="--method DOP853 --rtol 1e-9",
        )
    if measured.unclear is not None:
        return _unclear(model, measured.unclear)
    return _limiting_component(model, measured.limiting_component)


def _limiting_component(model: Model, component: LimitingComponent | None) -> str:
    """Say what is in the way of the accuracy, and what is not; empty where that is not known."""
    if component is None:
        return ""
    power = 10.0 ** math.floor(math.log10(2 * component.error))
    possible = math.ceil(2 * component.error / power) * power
    return Phrase(
        "{name} is off by {error} of its scale, {scale}, at the end; {option} can be held",
        name=model.state_names[component.component],
        error=f"{component.error:.1e}",
        scale=f"{component.scale:.1e}",
        option=f"--accuracy {possible:.0e}",
    )


def _failed(model: Model, problem: InitialValueProblem, failure: Failure, request: Request) -> str:
    return Phrase(
        "the motion cannot be continued past t = {t}: {why}",
        t=f"{failure.time:.9g}",
        why=_cause(model, problem, failure, request),
    )


def _cause(model: Model, problem: InitialValueProblem, failure: Failure, request: Request) -> str:
    name = _reaching_zero(model, failure, _BEYOND * (failure.time - problem.start), request)
    if name is not None:
        return Phrase(_ENDS[model.border_kind(name)], where=name)
    if failure.reason in _STUCK and failure.contacts:
        says = _STUCK[failure.reason][len(failure.contacts) > 1]
        stuck = Phrase(says, contacts=_listed(model, failure.contacts))
        last = _listed(model, failure.contacts[-1:])
        way_out: str = Phrase(_WAYS_OUT[failure.reason], contact=last)
        if failure.time != problem.start:
            before = f"--until {failure.time - _BEFORE * (failure.time - problem.start):.6g}"
            way_out = Phrase("{option} ends before, {text}", option=before, text=way_out)
        return Phrase("{text}; {way_out}", text=stuck, way_out=way_out)
    if failure.reason in _KINKS:
        return Phrase("{text}; {way_out}", text=failure.reason, way_out=_KINKS[failure.reason])
    if failure.by_rounding:
        return Phrase(
            "steps so short that the last place of t, {last_place}, counts beside them would be"
            " needed, though forces change little there; a larger {option}, or a time that counts"
            " from nearer, goes on",
            last_place=f"{math.ulp(failure.time):.1e}",
            option="--accuracy",
        )
    if structured(problem.rhs).project:
        return Phrase(
            "{text} (a singularity, a position where the constraints are singular, or the edge of"
            " where the equations exist)",
            text=failure.reason,
        )
    return Phrase(
        "{text} (a singularity, or the edge of where the equations exist)", text=failure.reason
    )


def _reaching_zero(model: Model, failure: Failure, ahead: float, request: Request) -> str | None:
    """Return the border of the equations that is reached a short time ahead; None without one."""
    if failure.state is None or not model.borders:
        return None
    ahead, layout = max(ahead, _STEPS_AHEAD * (request.step or 0.0)), model.layout
    moved = failure.state.copy()
    moved[layout.positions] += ahead * moved[layout.velocities]
    later = positive_values(model)(failure.time + ahead, moved)
    # Slips are of velocities, which do not stay as they are.
    slips = len(model.borders) - len(model.slips)
    later[slips:] = positive_values(model)(failure.time, failure.state)[slips:]
    # Numbers of tables are relative to their widths.
    least = [0.0] * len(model.positive) + [_BEYOND] * len(model.table_ends)
    least += [_NEAR_REST] * len(model.slips)
    return next((n for n, x, s in zip(model.borders, later, least, strict=True) if not x > s), None)


def _unclear(model: Model, unclear: UnclearContacts) -> str:
    t = f"{unclear.time:.9g}"
    if not unclear.differ:
        contacts = _listed(model, unclear.contacts)
        return Phrase(
            "what happens at {contacts} at t = {t} makes errors grow", contacts=contacts, t=t
        )
    return Phrase(
        "at t = {t} {contacts} met so slightly, or in such an order, that the rounding of the start"
        " decides what follows",
        t=t,
        contacts=_named(model, unclear.contacts),
    )


def _disproof(model: Model, disproof: Disproof) -> str:
    known = {"contacts": _named(model, disproof.contacts), "where": disproof.where}
    return Phrase(_DISPROOFS[disproof.by], **known, **_BETTER.get(disproof.by, {}))


def _named(model: Model, contacts: Sequence[int]) -> str:
    """Write contacts as the subject of a sentence, with its verb."""
    listed = _listed(model, contacts)
    if len(contacts) == 1:
        return Phrase("the contact {contacts} is", contacts=listed)
    return Phrase("the contacts {contacts} are", contacts=listed)


def _listed(model: Model, contacts: Sequence[int]) -> str:
    """List the names of contacts; of many the first ones."""
    names = [f"'{model.contacts[k]}'" for k in contacts]
    if len(names) > _MOST_NAMED:
        shown = ", ".join(names[:_MOST_NAMED])
        return Phrase("{first} and {count} more", first=shown, count=f"{len(names) - _MOST_NAMED}")
    if len(names) < 2:
        return "".join(names)
    return Phrase("{first} and {last}", first=", ".join(names[:-1]), last=names[-1])
