"""Status of a finished simulation, and the reason in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from lagrange_cli.simulate.accuracy.event_agreement import UnclearContacts
from lagrange_cli.simulate.accuracy.measured import Disproof, LimitingComponent, Measured
from lagrange_cli.simulate.integrators.hybrid.contact_motion import (
    ENDLESS,
    IMPOSSIBLE,
    TOO_MANY,
    UNDETERMINED,
)
from lagrange_cli.simulate.integrators.hybrid.surface_motion import (
    AMBIGUOUS,
    CROWDED,
    IMPULSIVE,
    UNSETTLED,
)
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

#: Contacts that are named in one sentence.
_MOST_NAMED = 6

Status = Literal["ok", "accuracy_not_reached", "stopped", "blow_up"]

#: Says that a motion has come to the border of what is declared positive.
_LEFT = "'{where}' is declared positive and reaches 0, where these equations end"

_DISPROOFS = {
    "energy": "the energy is not what it was. A force acts in less than a step;"
    " --method RK4 with a --step that resolves it goes on",
    "gap": "{contacts} violated, a contact was missed. It closes and opens within less than a"
    " step; --method RK45 with a small --rtol makes shorter ones",
    "impact": "Newton's law of impact adds energy where {contacts} struck at once. It does not"
    " with a restitution of 0",
    "uniqueness": "the motion comes to rest where {where} and a force pushes away with an"
    " infinite slope, so that more than one motion follows",
    "positive": _LEFT,
}

#: Why a motion with contacts cannot be continued: one is in the way, or several.
_STUCK = {
    IMPOSSIBLE: (
        "the contact {} leaves no motion: what it holds back is driven on, and no push of it can"
        " stop that",
        "the contacts {} leave no motion: they push against each other, and what is between them"
        " cannot give way",
    ),
    UNDETERMINED: (
        "what the contact {} does next cannot be determined: no impact satisfies Newton's law"
        " within rounding",
        "what the contacts {} do next cannot be determined: no impact satisfies Newton's law"
        " within rounding",
    ),
    ENDLESS: (
        "the contact {} closes and opens without end",
        "the contacts {} close and open without end",
    ),
    TOO_MANY: (
        "the contact {} closes and opens more often than can be followed",
        "the contacts {} close and open more often than can be followed",
    ),
}

#: Ways out for a user whose motion ends at a kink.
_KINKS = {
    AMBIGUOUS: "begin beside it, or let what jumps grow within a width (tanh(x/w) for sign(x))",
    CROWDED: "--until ends before, and tanh(x/w) for sign(x) goes on",
    UNSETTLED: "tanh(x/w) for sign(x) makes it smooth",
    IMPULSIVE: "let what jumps grow within a width (tanh(x/w) for sign(x))",
}

#: Ways out for a user whose motion ends at contacts.
_WAYS_OUT = {
    IMPOSSIBLE: "a stiff spring in place of {} gives way",
    UNDETERMINED: "restitutions are from 0 to 1, and the same where contacts meet",
    ENDLESS: "a restitution of 0 for {} keeps it closed",
    TOO_MANY: "a restitution of 0 for {} keeps it closed",
}


def status(problem: InitialValueProblem, measured: Measured) -> Status:
    """Return the status of a run, by what was asked for and what was measured."""
    if len(measured.states) == len(problem.times):
        return "ok"
    if measured.stopped:
        return "stopped"
    if measured.disproved is not None:
        return "blow_up" if measured.disproved.by == "positive" else "accuracy_not_reached"
    ends = measured.failure is not None and not measured.failure.by_rounding
    return "blow_up" if ends else "accuracy_not_reached"


def reason(model: Model, problem: InitialValueProblem, measured: Measured, request: Request) -> str:
    """Say in words why a result is not all that was asked for."""
    ended = status(problem, measured)
    last = float(problem.times[len(measured.states) - 1])
    if ended == "ok":
        return ""
    if ended == "stopped":
        return f"stopped; what is kept ends at t = {last:.9g}"
    if measured.disproved is not None:
        what, at = _disproof(model, measured.disproved), measured.disproved.time
        if request.accuracy is None or measured.disproved.by in ("uniqueness", "positive"):
            return f"what is kept ends at t = {last:.9g}: {what}"
        return f"accuracy {request.accuracy:g} is disproved at t = {at:.9g}: {what}"
    if measured.failure is not None:
        return _failed(model, problem, measured.failure, request)
    holds = f"accuracy {request.accuracy:g} holds until t = {last:.9g} of {problem.until:.9g}"
    ends = [s for s in measured.switches if s.kind == "zeno" and s.t >= last]
    if not ends and measured.unclear is not None:
        return f"{holds}: {_unclear(model, measured.unclear)}"
    if not ends:
        return holds + _limiting_component(model, measured.limiting_component)
    return (
        f"{holds}: the bounces on '{model.contacts[ends[0].contact]}' become infinitely many"
        f" by t = {ends[0].t:.9g}, and nothing is promised of what follows;"
        " --method DOP853 --rtol 1e-9 goes on with the contact closed"
    )


def _limiting_component(model: Model, component: LimitingComponent | None) -> str:
    """Say what is in the way of the accuracy, and what is not; empty where that is not known."""
    if component is None:
        return ""
    name = model.state_names[component.component]
    power = 10.0 ** math.floor(math.log10(2 * component.error))
    possible = math.ceil(2 * component.error / power) * power
    return (
        f": {name} is off by {component.error:.1e} of its scale, {component.scale:.1e}, at the end;"
        f" --accuracy {possible:.0e} can be held"
    )


def _failed(model: Model, problem: InitialValueProblem, failure: Failure, request: Request) -> str:
    past = f"the motion cannot be continued past t = {failure.time:.9g}"
    name = _reaching_zero(model, failure, _BEYOND * (failure.time - problem.start), request)
    if name is not None:
        return f"{past}: {_LEFT.format(where=name)}"
    if failure.reason in _STUCK and failure.contacts:
        says = _STUCK[failure.reason][len(failure.contacts) > 1]
        way_out = _WAYS_OUT[failure.reason].format(_listed(model, failure.contacts[-1:]))
        before = failure.time - _BEFORE * (failure.time - problem.start)
        ends = "" if failure.time == problem.start else f"--until {before:.6g} ends before, "
        return f"{past}: {says.format(_listed(model, failure.contacts))}; {ends}{way_out}"
    if failure.reason in _KINKS:
        return f"{past}: {failure.reason}; {_KINKS[failure.reason]}"
    if failure.by_rounding:
        last_place = math.ulp(failure.time)
        return (
            f"{past}: steps so short that the last place of t, {last_place:.1e}, counts beside them"
            " would be needed, though forces change little there; a larger --accuracy, or a time"
            " that counts from nearer, goes on"
        )
    singular = (
        " a position where the constraints are singular," if structured(problem.rhs).project else ""
    )
    cause = f" (a singularity,{singular} or the edge of where the equations exist)"
    return f"{past}: {failure.reason}{cause}"


def _reaching_zero(model: Model, failure: Failure, ahead: float, request: Request) -> str | None:
    """Return what is declared positive and would not be so a short time ahead, or None."""
    if failure.state is None or not model.positive:
        return None
    ahead, n = max(ahead, _STEPS_AHEAD * (request.step or 0.0)), len(model.coordinates)
    moved = failure.state.copy()
    moved[:n] += ahead * moved[n:]
    later = positive_values(model)(failure.time + ahead, moved)
    return next((name for name, x in zip(model.positive, later, strict=True) if not x > 0), None)


def _unclear(model: Model, unclear: UnclearContacts) -> str:
    at = f"at t = {unclear.time:.9g}"
    if not unclear.differ:
        return f"what happens at {_listed(model, unclear.contacts)} {at} makes errors grow"
    return (
        f"{at} {_named(model, unclear.contacts)} met so slightly, or in such an order, that"
        " the rounding of the start decides what follows"
    )


def _disproof(model: Model, disproof: Disproof) -> str:
    contacts = _named(model, disproof.contacts)
    return _DISPROOFS[disproof.by].format(contacts=contacts, where=disproof.where)


def _named(model: Model, contacts: Sequence[int]) -> str:
    """Write contacts as the subject of a sentence, with its verb."""
    if len(contacts) == 1:
        return f"the contact {_listed(model, contacts)} is"
    return f"the contacts {_listed(model, contacts)} are"


def _listed(model: Model, contacts: Sequence[int]) -> str:
    """List the names of contacts; of many the first ones."""
    names = [f"'{model.contacts[k]}'" for k in contacts]
    if len(names) > _MOST_NAMED:
        return f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more"
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)
