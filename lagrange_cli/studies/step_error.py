"""Errors of fixed steps in emitted code: the routine itself, run beside an accurate motion.

Sampled controllers set inputs, which are held; those of the scene vary within a step.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import LagrangeError
from lagrange_cli.program.lowered.routines.registry import ROUTINES
from lagrange_cli.simulate.integrators.right_hand_side import structured
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.runs.problem import sampled_start
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import KeptFunctions

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.integrators.right_hand_side import Rhs
    from lagrange_cli.simulate.model.model import Model

#: Accuracy of the motion that steps are compared with.
_ACCURACY = 1e-10

#: Steps over the time of the scene where no controller says how long they are; the most of others.
_STEPS, _MOST_STEPS = 1000, 20_000


@dataclass(frozen=True)
class _Dynamics:
    """The right-hand side as a routine of steps calls it."""

    function: Rhs

    def rhs(self, t: float, y: Array, results: Array) -> bool:
        results[:] = self.function(t, y)
        return bool(np.isfinite(results).all())


def step_error(equations: Equations, routine: str, arrays: int) -> str:
    """Say in a sentence which error the steps of a routine make along the motion of a scene.

    Parameters
    ----------
    routine
        Its name.
    arrays
        Number of the arrays that it overwrites.
    """
    try:
        return _measured(model_of(equations), routine, arrays) + _unheld(equations)
    except LagrangeError:
        return "Its error was not measured: the scene by itself has no motion."


def _unheld(equations: Equations) -> str:
    """Say that inputs of the scene, unlike those of a controller, were not held over a step."""
    held_names = {name for c in equations.system.controllers for name, _ in c.held_inputs}
    varying = [u.name for u in equations.system.inputs if u.name not in held_names and u.expression]
    if not varying:
        return ""
    return f" There {', '.join(varying)} varied within steps: held, it adds an error of order h."


def _measured(model: Model, routine: str, arrays: int) -> str:
    unlike = model.driven or model.surfaces or model.multipliers or model.recordings
    if unlike:
        return "Its error was not measured: forces have kinks, constraints stay, or files are read."
    start, until = model.defaults.start, model.defaults.until
    if until is None:
        return "Its error was not measured: the scene does not say until when it moves."
    h = min(model.periods, default=Fraction(until - start) / _STEPS)
    count = min(int(Fraction(until - start) / h), _MOST_STEPS)
    if any((p / h).denominator != 1 for p in model.periods) or (start != 0 and model.periods):
        return "Its error was not measured: no step fits all controllers."
    times = [float(Fraction(start) + k * h) for k in range(count + 1)]
    functions = KeptFunctions()(model)
    motion = simulate(model, accuracy=_ACCURACY, times=times, functions=functions)
    if motion.status != "ok":
        return "Its error was not measured: no accurate motion is known."
    exact = np.array([motion.columns[name] for name in model.state_names]).T
    stepped = _stepped(model, functions.rhs, np.array(times), float(h), (routine, arrays), exact[0])
    errors = np.abs(stepped - exact).max(axis=0)
    sizes = np.abs(exact).max(axis=0)
    largest = float((errors[sizes > 0] / sizes[sizes > 0]).max(initial=0.0))
    if not np.isfinite(largest):
        return f"With h = {float(h):g} it has no result before t = {times[-1]:g}."
    return (
        f"With h = {float(h):g} until t = {times[-1]:g} the largest error of a number of y, beside"
        f" its largest value, was {largest:.0e}, measured against a motion of accuracy"
        f" {_ACCURACY:.0e} from the start of the scene."
    )


def _stepped(
    model: Model,
    rhs: Rhs,
    times: Array,
    h: float,
    method: tuple[str, int],
    first: Array,
) -> Array:
    """Return the states at all times, not a number behind a step without a result."""
    sampling = structured(rhs).sampling
    step, arrays = ROUTINES[method[0]], np.empty((method[1], len(first)))
    y = np.array(sampled_start(rhs, times, np.array(model.initial)))
    rows = np.full((len(times), len(y)), np.nan)
    rows[0] = y
    spacing = min(model.periods, default=Fraction(1))
    for k in range(1, len(times)):
        if not step(len(y), _Dynamics(rhs), float(times[k - 1]), h, y, *arrays):
            break
        if sampling is not None:
            due = [c for c, p in enumerate(model.periods) if (k * spacing / p).denominator == 1]
            y = sampling.sampled(float(times[k]), y, due)
        rows[k] = y
    return rows
