"""Sharp forces, which may act between the evaluations of a step.

Compiled runs without contacts watch the exponents of sharp functions, so that their peaks are
resolved. In others a force that acts for less than a step may fall between all evaluations of all
runs: the result then has a remark.
"""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import partial

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.buffers import NativeLandmarks
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, structured
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.samples import RowSequence, decimated
from lagrange_cli.simulate.system.functions import RightHandSide


def watching(problem: InitialValueProblem) -> InitialValueProblem:
    """Return the problem with compiled integrators that resolve the peaks of sharp functions."""
    if problem.landmarks is None:
        return problem
    watched = partial(_watching, landmarks=problem.landmarks)
    perturbed = problem.perturbed
    return replace(
        problem,
        rhs=watched(problem.rhs),
        perturbed=None if perturbed is None else (watched(perturbed[0]), watched(perturbed[1])),
        wider=lambda: _wider(problem),
        landmarks=None,
    )


def _wider(problem: InitialValueProblem) -> InitialValueProblem | None:
    wider = problem.wider()
    return None if wider is None else watching(wider)


def _watching(rhs: Rhs, landmarks: NativeLandmarks) -> Rhs:
    if not isinstance(rhs, NativeRhs):
        return rhs
    copied = copy.copy(rhs)
    copied.landmarks = landmarks
    surfaces = structured(rhs).surfaces
    if surfaces is not None:
        copied.surfaces = surfaces.through(partial(_watching, landmarks=landmarks))
    return copied


#: What the exponent of a sharp function may change by in the longest step, beside a peak that no
#: step passes unseen (RESOLVED of kernels/landmarks.c).
RESOLVED_EXPONENT = 4.0

#: Samples at which the rate of an exponent is looked at.
_MOST_SAMPLES = 256

#: Part of a step over which that rate is taken.
_PART = 1 / 64


def unseen_forces(
    model: Model, functions: RightHandSide, problem: InitialValueProblem, states: RowSequence
) -> tuple[str, ...]:
    """Return the remark, if an exponent changes so fast somewhere that a step may pass its peak.

    There is one on driven inputs as well, which nothing is known of between two evaluations.
    """
    part = round(problem.span / problem.longest_step)
    if model.driven:
        return (
            Phrase(
                "of {inputs} steps see the values where they evaluate a Python function; what acts"
                " for less than a step, of up to 1/{part} of the time, they may miss: simulate its"
                " neighbourhood separately",
                inputs=" and ".join(model.driven),
                part=f"{part}",
            ),
        )
    watched = functions.native and not model.contacts
    if watched or not model.landmarks or len(states) < 2:
        return ()
    stride = -(-len(states) // _MOST_SAMPLES)
    times, rows = decimated(problem.times, stride), states[::stride]
    if not _is_sharp(functions, problem, np.asarray(times[: len(rows)]), np.asarray(rows)):
        return ()
    near_contacts, uncompiled = Phrase("beside contacts"), Phrase("without compiled code")
    return (
        Phrase(
            "exp, tanh, a quotient or a high power can act for less than a step, of up to 1/{part}"
            " of the time; {where} steps do not look for that: simulate its neighbourhood"
            " separately",
            part=f"{part}",
            where=near_contacts if functions.native else uncompiled,
        ),
    )


def _is_sharp(
    functions: RightHandSide, problem: InitialValueProblem, times: Array, states: Array
) -> bool:
    h = _PART * problem.longest_step
    pairs = zip(times.tolist(), states, strict=True)
    slopes = np.array([functions.rhs(t, y) for t, y in pairs])
    before = functions.exponents(times, states)
    behind = functions.exponents(times + h, states + h * slopes)
    with np.errstate(all="ignore"):
        change = np.abs(behind - before) / _PART
    return bool((change[np.isfinite(change)] > RESOLVED_EXPONENT).any())
