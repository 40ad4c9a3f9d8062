"""Samples of a motion with the measured error, and why it ends early."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from lagrange_cli.simulate.accuracy.error_estimate import ErrorEstimate
from lagrange_cli.simulate.accuracy.event_agreement import UnclearContacts
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import Slides
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, ModeChange
from lagrange_cli.simulate.model.model import Border
from lagrange_cli.simulate.runs.problem import InitialValueProblem, running_scales
from lagrange_cli.simulate.runs.run import Failure
from lagrange_cli.simulate.samples import RowSequence

#: A result says which component misses the accuracy if it does so by no more than this factor: a
#: run that is off by more shows chaos or a singularity rather than a component.
_NEARLY = 1e3


@dataclass(frozen=True)
class Disproof:
    """Evidence that a result is wrong from some time on.

    Attributes
    ----------
    time
        Time from which nothing is promised.
    by
        ``energy``: a conserved energy changes; ``gap``: gaps are negative; ``impact``: an impact
        adds energy; ``uniqueness``: the motion comes to rest where more than one follows;
        ``positive``: what the scene declares positive is not; ``table``: a table has ended.
    contacts
        Numbers of the contacts whose gaps or impacts they are.
    where
        Equation in words that holds where the motion comes to rest; name of what is not positive,
        or end of a table.
    """

    time: float
    by: Literal["energy", "gap", "impact", "uniqueness"] | Border
    contacts: tuple[int, ...] = ()
    where: str = ""


@dataclass(frozen=True)
class LimitingComponent:
    """Component of the state with the largest error over its scale at the end.

    Attributes
    ----------
    component
        Its number in [q, q̇].
    error
        Estimated error, relative to its scale.
    scale
        Scale, in the component's unit.
    """

    component: int
    error: float
    scale: float


@dataclass(frozen=True)
class Measured:
    """Samples of a motion that hold, with the estimate of their error.

    Attributes
    ----------
    states
        Samples that hold, shape (samples, 2n).
    scales
        Scales of q and q̇ at the last of them, shape (2n,).
    estimate
        Largest estimated error, relative to scales; 0 where nothing is estimated.
    failure
        Where and why the motion itself ends; None if it does not.
    stopped
        The user or the budget ended the run.
    method
        Name of the integrator.
    choice
        Why it was taken, in words.
    steps, evaluations
        Steps and right-hand sides of the run.
    all_evaluations
        Right-hand sides of the coarse run, the run, its companions and runs given up.
    run_seconds, estimate_seconds
        Seconds of the run, and of everything else.
    disproved
        Evidence that further samples are wrong; None if there is none.
    arithmetic
        What the numbers of the run are called.
    switches
        Changes of contacts up to the last sample, and the end of bounces next behind it.
    slides
        Slides along switching surfaces up to the last sample: number of the surface, time from
        and until, infinite where it goes on.
    began
        ContactMode of the contacts that were closed at first.
    unclear
        Contacts at which the promise ends; None if it ends elsewhere, or not.
    exempt
        Times at which velocities, or states with two values, are as close to a jump as the error
        of its time.
    limiting_component
        Component that keeps runs which reach the end from the accuracy; None if there is none.
    """

    states: RowSequence
    scales: Array
    estimate: float
    failure: Failure | None
    stopped: bool
    method: str
    choice: str
    steps: int
    evaluations: int
    all_evaluations: int
    run_seconds: float
    estimate_seconds: float
    disproved: Disproof | None = None
    arithmetic: str = "double"
    switches: tuple[ModeChange, ...] = ()
    slides: Slides = ()
    began: ContactMode = ()
    unclear: UnclearContacts | None = None
    exempt: Array = field(default_factory=lambda: np.empty(0))
    limiting_component: LimitingComponent | None = None


def limiting_component(estimates: Sequence[ErrorEstimate], eps: float) -> LimitingComponent | None:
    """Return what limits the best of some complete attempts; None if it misses by far."""
    if not estimates:
        return None
    nearest = min(estimates, key=lambda estimate: estimate.excess)
    worst = int(nearest.errors.argmax())
    error, every = float(nearest.errors[worst]), nearest.excess * eps
    if error < every * (1 - 1e-9) or error > _NEARLY * eps:
        return None
    return LimitingComponent(worst, error, float(nearest.last[worst]))


def switches_until(
    switches: Sequence[ModeChange], problem: InitialValueProblem, samples: int
) -> tuple[ModeChange, ...]:
    """Return the switches up to the last of so many samples, and the next end of bounces."""
    last, all_of_them = float(problem.times[samples - 1]), samples == len(problem.times)
    inside = [s for s in switches if s.t <= last]
    beyond = [s for s in switches if s.t > last and s.kind == "zeno"]
    return (*inside, *([] if all_of_them else beyond[:1]))


def slides_until(
    slides: Slides, problem: InitialValueProblem, samples: int
) -> tuple[tuple[int, float, float], ...]:
    """Return the slides up to the last of so many samples, in order; parts of one are joined."""
    last = float(problem.times[samples - 1])
    known = [(k, start, end if end < last else math.inf) for k, start, end in slides]
    joined: list[tuple[int, float, float]] = []
    for k, start, end in sorted(known, key=lambda slide: (slide[0], slide[1])):
        if joined and joined[-1][0] == k and joined[-1][2] >= start:
            joined[-1] = k, joined[-1][1], end
        else:
            joined.append((k, start, end))
    return tuple(sorted((s for s in joined if s[1] < last), key=lambda slide: slide[1]))


def start_alone(problem: InitialValueProblem, seconds: float) -> Measured:
    """Return the initial state alone, of a run stopped before anything else was finished."""
    states = problem.y0[None, :].copy()
    return Measured(
        states=states,
        scales=running_scales(problem, states)[-1],
        estimate=0.0,
        failure=None,
        stopped=True,
        method="DOP853",
        choice="stopped before a choice was made",
        steps=0,
        evaluations=0,
        all_evaluations=0,
        run_seconds=0.0,
        estimate_seconds=seconds,
    )
