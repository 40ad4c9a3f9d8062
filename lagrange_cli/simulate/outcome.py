"""How a simulation ended: its status, and in words why."""

from __future__ import annotations

import math
from typing import Literal

from lagrange_cli.simulate.accuracy import Measured, Obstacle
from lagrange_cli.simulate.integrators.base import projection
from lagrange_cli.simulate.integrators.switching import FAILURES
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.problem import InitialValueProblem
from lagrange_cli.simulate.request import Request

__all__ = ["Status", "reason", "status"]

Status = Literal["ok", "accuracy_not_reached", "stopped", "blow_up"]

_DISPROOFS = {
    "energy": "the energy is not what it was. A force acts in less than a step;"
    " --method RK4 with a --step that resolves it goes on",
    "gap": "a one-sided constraint is violated, a contact was missed."
    " It closes and opens within less than a step",
    "impact": "Newton's law of impact adds energy, with several contacts of different restitution"
    " at once. Give them the same one",
}


def status(problem: InitialValueProblem, measured: Measured) -> Status:
    """What became of what was asked."""
    if len(measured.states) == len(problem.times):
        return "ok"
    if measured.stopped:
        return "stopped"
    if measured.disproved is not None:
        return "accuracy_not_reached"
    return "blow_up" if measured.failure is not None else "accuracy_not_reached"


def reason(model: Model, problem: InitialValueProblem, measured: Measured, request: Request) -> str:
    """Why the samples end where they do, empty where they are all there."""
    ended = status(problem, measured)
    last = float(problem.times[len(measured.states) - 1])
    if ended == "ok":
        return ""
    if ended == "stopped":
        return f"stopped; what is kept ends at t = {last:.9g}"
    if measured.disproved is not None:
        what, at = _DISPROOFS[measured.disproved.by], measured.disproved.time
        if request.accuracy is None:
            return f"what is kept ends at t = {last:.9g}: {what}"
        return f"accuracy {request.accuracy:g} is disproved at t = {at:.9g}: {what}"
    if measured.failure is not None:
        return _failed(problem, measured.failure.time, measured.failure.reason)
    holds = f"accuracy {request.accuracy:g} holds until t = {last:.9g} of {problem.until:.9g}"
    ends = [s for s in measured.switches if s.kind == "zeno" and s.t > last]
    if not ends and measured.unclear is not None:
        return (
            f"{holds}: at t = {measured.unclear:.9g} contacts are met in an order, or so"
            " slightly, that the rounding of the start decides what follows"
        )
    if not ends:
        return holds + _obstacle(model, measured.obstacle)
    return (
        f"{holds}: the bounces on '{model.contacts[ends[0].contact]}' become infinitely many"
        f" by t = {ends[0].t:.9g}, and nothing is promised of what follows;"
        " --method DOP853 --rtol 1e-9 goes on with the contact closed"
    )


def _obstacle(model: Model, found: Obstacle | None) -> str:
    """What is in the way of the accuracy, and which one is not; nothing where that is not known."""
    if found is None:
        return ""
    n = len(model.coordinates)
    name = model.coordinates[found.component % n]
    name = name if found.component < n else f"dot({name})"
    power = 10.0 ** math.floor(math.log10(2 * found.error))
    possible = math.ceil(2 * found.error / power) * power
    return (
        f": {name} is off by {found.error:.1e} of its scale, {found.scale:.1e}, at the end;"
        f" --accuracy {possible:.0e} can be held"
    )


def _failed(problem: InitialValueProblem, time: float, why: str) -> str:
    cause = ""
    if why not in FAILURES:
        kept = " a position where the constraints are singular," if projection(problem.rhs) else ""
        cause = f" (a singularity,{kept} or the edge of where the equations exist)"
    return f"the motion cannot be continued past t = {time:.9g}: {why}{cause}"
