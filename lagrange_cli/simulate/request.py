"""Requests: options of a user over the scene's defaults, checked."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem, nearest, placed
from lagrange_cli.scene.conditions import MOST_SAMPLES
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators import INTEGRATORS, Integrator
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import AUTO, SimulationOptions
from lagrange_cli.simulate.samples import Grid, RowSequence

_DEFAULT_ACCURACY = 1e-6
_DEFAULT_SAMPLES = 501

#: Most samples whose states are all in memory.
MOST_SAMPLES_IN_MEMORY = 1_000_000

#: Words for the facts that methods need.
_NEEDS = {
    "separable": "forces of positions alone beside a constant mass matrix, and no constraints kept",
    "separable_on_closures": "forces of positions alone beside a constant mass matrix, and"
    " constraints of positions that do not move",
}

#: Needs of methods that step positions and velocities in turn.
_PARTITIONED = frozenset(_NEEDS)

#: Steps of a fixed size between two samples.
_MOST_STEPS = 1e9

#: Numbers in all samples of a run (several runs are held at a time).
_MOST_NUMBERS = 20_000_000


@dataclass(frozen=True)
class Request:
    """Resolved options that can be served: an accuracy, or a method with a tolerance or step.

    Attributes
    ----------
    times
        Sample times; a :class:`.samples.Grid` if memory does not hold all states.
    initial
        Initial state, shape (2n,).
    accuracy, rtol, atol, budget
        As in :class:`SimulationOptions`; ``accuracy`` is None if nothing is promised.
    method
        None if the program chooses.
    step
        Step of a method with fixed steps, which divides the time between samples; else None.
    mark
        Place of the scene's section if no option gives the accuracy; else None.
    """

    times: RowSequence
    initial: Array
    accuracy: float | None
    method: type[Integrator] | None
    rtol: float | None
    atol: float | None
    step: float | None
    budget: float | None
    mark: Mark | None = None

    def refined(self, every: int) -> Request:
        """Divide the time between samples into ``every`` equal parts; the present times stay."""
        if every == 1:
            return self
        times = self.times[:]
        steps = np.diff(times)[:, None] * (np.arange(every) / every)
        between = (times[:-1, None] + steps).ravel()
        return replace(self, times=np.append(between, times[-1]))


def resolve(model: Model, options: SimulationOptions, in_memory: int | None = None) -> Request:
    """Fill in the scene's defaults and refuse what cannot be served.

    A way to control the error that is given as an option (accuracy, or method
    and tolerances) replaces the scene's; both ways at once are refused. If the states of
    all samples are more than ``in_memory`` numbers, their times are a :class:`.samples.Grid`;
    by default they are refused.

    Raises
    ------
    InputError
        It cannot be served. Its place is the scene's section if no option is given, or if the scene
        lacks something.
    """
    try:
        initial = required_start(model)
    except InputError as refusal:
        raise placed(refusal, model.defaults.mark) from refusal
    try:
        return _resolved(model, options, initial, in_memory)
    except InputError as refusal:
        if replace(options, usual_accuracy=None) != SimulationOptions():
            raise
        raise placed(refusal, model.defaults.mark) from refusal


def _resolved(
    model: Model, options: SimulationOptions, initial: Array, in_memory: int | None
) -> Request:
    mark = model.defaults.mark if options.accuracy is None else None
    at_equal_distances = (options.until, options.samples, options.step)
    if options.times is not None and any(x is not None for x in at_equal_distances):
        raise _refused("times exclude until, samples and step", "times=[0, 0.5, 2]")
    options = options.completed(model.defaults)
    accuracy, rtol, atol, step = options.accuracy, options.rtol, options.atol, options.step
    uncontrolled = not any(x is not None for x in options.controls)
    if accuracy is not None and not uncontrolled:
        raise _refused(
            "accuracy excludes method, rtol and atol: it chooses them",
            "--accuracy 1e-9, or --method DOP853 --rtol 1e-9",
        )
    method = None if options.method is None else method_of(options.method)
    until = _until(model, options.until) if options.times is None else 0.0
    _check_numbers(options)
    if accuracy is None and uncontrolled:
        accuracy = _DEFAULT_ACCURACY
    fixed = method is not None and not method.adaptive
    times: RowSequence
    if options.times is None:
        grid = _grid(model, until, method, step, options.samples)
        times = _times(model, grid, step, fixed=fixed, in_memory=in_memory)
    else:
        times = _given_times(model, options.times, method)
    if accuracy is None and (method is None or method.adaptive) and rtol is None:
        raise _refused("a method needs its tolerance", "--rtol 1e-9")
    if method is not None:
        require_fit(model, method)
        _check_control(method, step, rtol, atol)
    inner = _dividing(float(times[1] - times[0]), step) if fixed and step is not None else None
    return Request(times, initial, accuracy, method, rtol, atol, inner, options.budget, mark)


def _refused(message: str, hint: str) -> InputError:
    return InputError(Problem(message, hint=hint, rule="simulate"))


def required_start(model: Model) -> Array:
    """Return the initial state, shape (2n,).

    Raises
    ------
    InputError
        The model cannot move: coordinates, values or a part of the start are missing.
    """
    if not model.coordinates:
        raise _refused(
            f"nothing can move: '{model.name}' has no degrees of freedom",
            "lagrange derive shows how the constraints use them up",
        )
    missing = [p.name for p in model.parameters if p.value is None and p.used]
    if missing and not model.suggested:
        raise _refused(
            f"no value for {_and(missing)}", " ".join(f"-p {name}=1" for name in missing)
        )
    if model.initial is None:
        raise _refused("the scene does not give the whole initial state", _initial_options(model))
    state = np.array(model.initial, dtype=float)
    if not np.isfinite(state).all():
        raise _refused("the initial state is not finite", "look at the section initial")
    return state


def _initial_options(model: Model) -> str:
    """Write options that state an initial state; missing velocities are 0 if they can be."""
    import shlex

    values = model.suggested or tuple((name, "0") for name in model.coordinates)
    return " ".join("-i " + shlex.quote(f"{name}={value}") for name, value in values)


def _and(names: list[str]) -> str:
    shown = [f"'{name}'" for name in names]
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"


def method_of(name: str) -> type[Integrator]:
    """Return the method of a name, whose capitals do not matter.

    Raises
    ------
    InputError
        There is none.
    """
    methods = {known.casefold(): method for known, method in INTEGRATORS.items()}
    if name.casefold() not in methods:
        known = f"methods: {AUTO}, {', '.join(INTEGRATORS)}"
        close = nearest(name, INTEGRATORS) or nearest(name.upper(), INTEGRATORS)
        raise _refused(f"unknown method '{name}'", f"{close}\n{known}" if close else known)
    return methods[name.casefold()]


def _until(model: Model, until: float | None) -> float:
    start = model.defaults.start
    until = model.defaults.until if until is None else until
    if until is None:
        raise _refused(
            "nothing says how long to simulate",
            f"--until {start + 10:g}, or in the scene: simulate: {{until: {start + 10:g}}}",
        )
    if not (math.isfinite(until) and until > start):
        raise _refused(
            f"the end t = {until:g} is not after the start t = {start:g}", f"--until {start + 10:g}"
        )
    return float(until)


def _check_numbers(options: SimulationOptions) -> None:
    for name, fix in (("accuracy", "1e-9"), ("rtol", "1e-9")):
        value = getattr(options, name)
        if value is not None and not 0 < value < 1:
            raise _refused(f"{name} must be between 0 and 1, not {value:g}", f"--{name} {fix}")
    for name, fix in (("atol", "1e-12"), ("step", "0.01"), ("budget", "60")):
        value = getattr(options, name)
        if value is not None and not (math.isfinite(value) and value > 0):
            raise _refused(f"{name} must be a positive number, not {value:g}", f"--{name} {fix}")


def _grid(
    model: Model,
    until: float,
    method: type[Integrator] | None,
    step: float | None,
    samples: int | None,
) -> Grid:
    """Make the grid of sample times; the last is ``until`` exactly."""
    start = model.defaults.start
    fixed = method is not None and not method.adaptive
    if step is not None and samples is not None and not fixed:
        raise _refused("samples and step both set the sample times", "--samples 501")
    if samples is None and step is not None:
        intervals = (until - start) / step * (1 - 1e-12)
        # Beyond the largest number of samples it only matters that there are too many.
        return Grid(start, until, step, math.ceil(min(intervals, 10.0 * MOST_SAMPLES)) + 1)
    samples = _DEFAULT_SAMPLES if samples is None else samples
    if not 2 <= samples <= MOST_SAMPLES:
        raise _not_so_many(samples, MOST_SAMPLES_IN_MEMORY)
    return Grid(start, until, (until - start) / (samples - 1), samples)


def _times(
    model: Model, grid: Grid, step: float | None, *, fixed: bool, in_memory: int | None
) -> RowSequence:
    """Return the sample times, as an array if the states of all are to be in memory."""
    width = model.layout.size
    many = in_memory is not None and len(grid) * width > in_memory
    most = MOST_SAMPLES if many else MOST_SAMPLES_IN_MEMORY
    if len(grid) > most and grid.step != step:
        raise _not_so_many(len(grid), most)
    if len(grid) > most:
        raise _refused(
            f"step {step:g} makes {len(grid):.3g} samples, more than {most:,}",
            "--samples 501" if fixed else f"--step {(grid.until - grid.start) / 500:g}",
        )
    if not many and len(grid) * width > _MOST_NUMBERS:
        raise _refused(f"{len(grid):,} samples of this system are too many", "--samples 501")
    between = min(grid.step, grid.until - grid[len(grid) - 2])
    if not between > np.spacing(max(abs(grid.start), abs(grid.until))):
        raise _refused("the sample times are too close for double precision", "--samples 501")
    return grid if many else grid[:]


def _given_times(model: Model, times: tuple[float, ...], method: type[Integrator] | None) -> Array:
    """Check sample times that a caller has chosen."""
    start = model.defaults.start
    sample_times = np.array(times, dtype=float)
    ascend = np.isfinite(sample_times).all() and (np.diff(sample_times) > 0).all()
    if (
        not 2 <= len(sample_times) <= MOST_SAMPLES_IN_MEMORY
        or sample_times[0] != start
        or not ascend
    ):
        raise _refused(
            f"times ascend from the start t = {start:g}, two or more", f"times=[{start:g}, ...]"
        )
    if method is not None and not method.interpolates:
        raise _refused(
            f"steps of {method.name} end at samples, which are asked for at unequal distances here",
            "--method DOP853 --rtol 1e-9",
        )
    return sample_times


def _not_so_many(samples: int, most: int) -> InputError:
    return _refused(f"samples must be from 2 to {most:,}, not {_counted(samples)}", "--samples 501")


def _counted(number: int) -> str:
    """Write a number as a person reads it, with few digits if it is long."""
    if abs(number) < 10**12:
        return f"{number}"
    from decimal import Decimal

    return f"{Decimal(number):.3g}"


def require_fit(model: Model, method: type[Integrator]) -> None:
    """Refuse a method that needs what a system has not.

    Raises
    ------
    InputError
        With the reason.
    """
    _require_package(method)
    if model.states and not _PARTITIONED.isdisjoint(method.needs):
        raise _refused(
            f"{method.name} steps positions and velocities in turn, and has no place for the states"
            f" of first order: {_and(list(model.states))}",
            "--method DOP853 --rtol 1e-9",
        )
    if model.switches and (method.traces or not method.interpolates):
        raise _refused(
            f"{method.name} has no interpolant on which to find where"
            f" {_and([model.states[k] for k in model.switches])} changes between its two values",
            "--method DOP853 --rtol 1e-9",
        )
    unmet = [need for need in method.needs if not model.facts[need]]
    if unmet:
        raise _refused(
            f"{method.name} needs what this system has not:"
            f" {', '.join(_NEEDS.get(need, need.replace('_', ' ')) for need in unmet)}",
            "--method DOP853 --rtol 1e-9",
        )
    if model.multipliers and not method.projects:
        raise _refused(
            f"{method.name} cannot move its past states onto the constraints that are kept"
            f" beside the coordinates: {_and(list(model.multipliers))}",
            f"--method {'BDF' if method.package is None else 'IDA'} --rtol 1e-9",
        )
    if model.contacts and not (method.interpolates and method.projects):
        raise _refused(
            f"{method.name} cannot end its steps where a contact closes or opens, here"
            f" {_and(list(model.contacts))}",
            "--method DOP853 --rtol 1e-9",
        )


def _require_package(method: type[Integrator]) -> None:
    """Refuse a method whose optional package is not there."""
    if method.package is None:
        return
    name, extra = method.package
    if importlib.util.find_spec(name) is None:
        raise _refused(
            f"{method.name} needs the package {name}, which is not installed",
            f"pip install 'lagrange-cli[{extra}]'",
        )


def _check_control(
    method: type[Integrator], step: float | None, rtol: float | None, atol: float | None
) -> None:
    if not method.adaptive and step is None:
        raise _refused(f"{method.name} has a fixed step, which is not given", "--step 0.01")
    if not method.adaptive and (rtol is not None or atol is not None):
        raise _refused(
            f"{method.name} has a fixed step and no tolerance",
            f"--method {method.name} --step 0.01",
        )


def _dividing(spacing: float, step: float) -> float:
    """Return the largest step up to ``step`` that divides the time between samples."""
    parts = spacing / step * (1 - 1e-12)
    if parts > _MOST_STEPS:
        raise _refused(
            f"step {step:g} is too small beside {spacing:g} between samples", "--step 0.01"
        )
    return spacing / math.ceil(parts)
