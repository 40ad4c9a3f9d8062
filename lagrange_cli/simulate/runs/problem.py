"""The initial value problem as numbers, the scales of its errors, and checks of its start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property, partial

import numpy as np

from lagrange_cli.errors import InputError, Problem, SingularError
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.buffers import NativeLandmarks
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, NativeReal
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, structured
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.samples import Grid, MemoryBuffer, RowSequence, SampleBuffer, windows
from lagrange_cli.simulate.system.rounding import in_arithmetic, off_by_one_ulp
from lagrange_cli.simulate.system.singular_guard import positive_values
from lagrange_cli.state_layout import StateLayout

#: A coordinate that moves less than this part of the largest of its kind, or of its own motion
#: between the samples, is measured by the larger one. The number is part of the promise
#: (docs/accuracy.md).
_SMALL_BESIDE_OTHERS = 1e-3

#: Units in the last place of its start by which a coordinate at rest may drift: sums of a few
#: rounded terms.
_ROUNDING_ULPS = 8

#: Longest step as a part of the span. It trades seconds of smooth motions against narrow forces
#: that steps pass over (docs/accuracy.md); not tuned.
_LONGEST_STEP = 1 / 128

#: The same if something depends on time: a pulse may be narrow in a motion that is quiet.
_LONGEST_STEP_DRIVEN = 1 / 512


@dataclass(frozen=True)
class InitialValueProblem:
    """Initial value problem y' = rhs(t, y), y = [q, q̇], sampled at ``times``.

    Attributes
    ----------
    rhs
        Right-hand side, (t, y) → y', shape (2n,).
    y0
        Initial state, shape (2n,).
    times
        Sample times, ascending; the first is the start.
    kinds
        For each coordinate ``angle``, or a word that coordinates of one dimension share.
    perturbed
        Two more right-hand sides in which every given number and every operation is off by its
        rounding error, each in its own way: their effect is that of rounding. None if there are
        none.
    autonomous
        rhs does not depend on t.
    real
        Numbers that rhs computes with.
    exact
        y0 with more digits than doubles have, None for numbers of which no more is known.
    wider
        Makes the problem in the next wider arithmetic, or None if there is none.
    widens
        ``wider`` may give a problem.
    read_off
        Other coordinates are read off these.
    buffer
        Makes the buffer of a run's samples; None for memory.
    unsampled
        Motion of each component that the samples do not show, shape (2n,), see
        :func:`unsampled_motion`; None before it is known, or where they show it all.
    landmarks
        Exponents of sharp functions; None if there are none, or integrators watch them already.
    """

    rhs: Rhs
    y0: Array
    times: RowSequence
    kinds: tuple[str, ...]
    perturbed: tuple[Rhs, Rhs] | None = None
    autonomous: bool = True
    real: NativeReal = DOUBLE
    exact: tuple[Fraction | None, ...] = ()
    wider: Callable[[], InitialValueProblem | None] = lambda: None
    widens: bool = False
    read_off: bool = False
    buffer: Callable[[], SampleBuffer] | None = None
    unsampled: Array | None = None
    landmarks: NativeLandmarks | None = None

    @cached_property
    def layout(self) -> StateLayout:
        """Layout of y."""
        return StateLayout(len(self.kinds), len(self.y0) - 2 * len(self.kinds))

    def start_off(self, pattern: int) -> Array:
        """Return y0 in the numbers that rhs computes with; moved by one unit in the last place
        that is known in a pattern not 0."""
        if self.real is DOUBLE:
            return off_by_one_ulp(self.y0, pattern) if pattern else self.y0
        exact = self.exact or (None,) * len(self.y0)
        return np.asarray(in_arithmetic(self.y0.tolist(), exact, self.real, pattern))

    def samples(self) -> SampleBuffer:
        """Make the buffer of a run's samples."""
        if self.buffer is None or not isinstance(self.times, Grid):
            return MemoryBuffer(len(self.times), len(self.y0))
        return self.buffer()

    def with_unsampled(self, unsampled: Array) -> InitialValueProblem:
        """Return the same with motion that samples do not show, if there is any."""
        return replace(self, unsampled=unsampled) if unsampled.any() else self

    @property
    def epsilon(self) -> float:
        """Distance from 1 to the next number that rhs computes with."""
        return self.real.epsilon

    @cached_property
    def start(self) -> float:
        return float(self.times[0])

    @cached_property
    def until(self) -> float:
        return float(self.times[-1])

    @cached_property
    def span(self) -> float:
        return self.until - self.start

    @cached_property
    def longest_step(self) -> float:
        """Longest step, in time: a longer one may pass over something sharp in a quiet motion."""
        return self.span * (_LONGEST_STEP if self.autonomous else _LONGEST_STEP_DRIVEN)

    @cached_property
    def angles(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Flags of the coordinates that are angles, shape (n,)."""
        return np.array([kind == "angle" for kind in self.kinds])


def ulps(values: Array) -> Array:
    """Return one unit in the last place of each of |values|, 0 for 0."""
    return np.asarray(np.spacing(np.abs(values)) * (values != 0))


@cache
def groups(kinds: tuple[str, ...]) -> list[list[int] | slice]:
    """Return the coordinates of each kind of which there are more than one, as indices."""
    numbers = ([i for i, k in enumerate(kinds) if k == kind] for kind in dict.fromkeys(kinds))
    every = slice(0, len(kinds))
    return [every if len(alike) == len(kinds) else alike for alike in numbers if len(alike) > 1]


def running_scales(problem: InitialValueProblem, states: Array) -> Array:
    """Return the scales of q and q̇ over the samples up to each one.

    R = largest magnitude, from the start value for lengths, 1 for angles; G =
    largest R of the kind; scale(q) = max(R, 1e-3 G), 1 where all are 0;
    scale(q̇) = max(R of q̇, scale(q) / (until − from)). Of what goes a thousand times as far, or
    as fast in the mean, between the samples, that is G, and a thousandth of the mean speed the
    least scale of q̇.

    Parameters
    ----------
    states
        Shape (samples, 2n).

    Returns
    -------
    Shape (samples, 2n); the last row holds the scales of the whole.
    """
    return RunningScales(problem, states[0]).add(states)


class RunningScales:
    """:func:`running_scales` of samples added in parts, in order; ``start`` is the first."""

    def __init__(self, problem: InitialValueProblem, start: Array) -> None:
        self._problem, self._start = problem, start[: len(problem.kinds)]
        self._largest = np.zeros(len(start))

    def add(self, states: Array) -> Array:
        """Add samples (m, 2n); return the scales so far at each, shape (m, 2n)."""
        rows = np.maximum.accumulate(motion(self._start, states), axis=0)
        rows = np.maximum(rows, self._largest)
        self._largest = rows[-1].copy()
        return scales_from(self._problem, rows)


def motion(start: Array, states: Array) -> Array:
    """Return distances from the start (n,), and speeds, at each sample, shape (m, 2n)."""
    moved = states.copy()
    moved[:, : len(start)] -= start
    return np.abs(moved, out=moved)


def moved_scales(problem: InitialValueProblem, moved: Array) -> Array:
    """Return the scales of largest motions and speeds, both of shape (2n,)."""
    return np.asarray(scales_from(problem, moved[None])[0])


def last_scales(problem: InitialValueProblem, states: RowSequence) -> Array:
    """Return the last row of :func:`running_scales`, of states that may be in a file."""
    scales, last = RunningScales(problem, states[0]), np.empty(0)
    for _, part in windows(problem.times, states):
        last = scales.add(part)[-1]
    return last


def scales_from(problem: InitialValueProblem, moved: Array) -> Array:
    """Return the scales of largest motions and speeds, shape (m, 2n) each."""
    n, velocities = len(problem.kinds), problem.layout.velocities
    largest, speed = np.where(problem.angles, 1.0, moved[:, :n]), moved[:, velocities]
    scales = np.empty(moved.shape)
    unsampled = problem.unsampled
    of_kind = largest.copy() if unsampled is None else np.maximum(largest, unsampled[:n])
    for alike in groups(problem.kinds):
        of_kind[:, alike] = of_kind[:, alike].max(axis=1, keepdims=True)
    scales[:, :n] = np.maximum(largest, _SMALL_BESIDE_OTHERS * of_kind) + (of_kind == 0)
    if unsampled is not None:
        speed = np.maximum(speed, _SMALL_BESIDE_OTHERS * unsampled[velocities])
    np.maximum(speed, scales[:, :n] / problem.span, out=scales[:, velocities])
    states = problem.layout.first_order
    sizes = moved[:, states]
    if unsampled is not None:
        sizes = np.maximum(sizes, _SMALL_BESIDE_OTHERS * unsampled[states])
    scales[:, states] = sizes + (sizes == 0)
    return scales


def unsampled_motion(problem: InitialValueProblem, shown: Array, moved: Array) -> Array:
    """Return motions that samples show less than a thousandth of, 0 for other components, (2n,).

    Samples once a period show a coordinate always at the same place, but for rounding, which is
    no scale; nor is the rounding of a coordinate that rests. A short rush between samples, as of an
    azimuth past the pole, is no reason to allow larger errors at them: it leaves the mean speed as
    it is.

    Parameters
    ----------
    shown
        Largest distances of coordinates from the start at the samples, and speeds, shape (2n,).
    moved
        The largest distances of coordinates from the start, wherever they were seen, and mean
        speeds along the whole motion, shape (2n,).
    """
    n = len(problem.kinds)
    hidden = shown < _SMALL_BESIDE_OTHERS * moved
    if hidden.any():
        rests = moved[:n] <= _ROUNDING_ULPS * ulps(problem.y0[:n])
        hidden[:n] &= ~rests
        hidden[problem.layout.velocities] &= ~rests
    return np.where(hidden, moved, 0.0)


#: Samples of controllers that are followed: each begins a piece of the motion, at some 0.1 ms.
_MOST_SAMPLINGS = 1_000_000


def sampled_start(rhs: Rhs, times: RowSequence, y0: Array) -> Array:
    """Return the initial state, behind the first samples of controllers if there are any.

    Raises
    ------
    InputError
        What they set does not exist, or they sample too often to be followed.
    """
    sampling, start, until = structured(rhs).sampling, float(times[0]), float(times[-1])
    if sampling is None:
        return y0
    refused = partial(Problem, rule="controllers")
    if any(period <= 0 for period in sampling.periods):
        raise InputError(refused("the time between samples of a controller is not positive"))
    count = (until - start) * sum(1 / float(period) for period in sampling.periods)
    if count > _MOST_SAMPLINGS:
        hint = f"at most {_MOST_SAMPLINGS:,} samples are followed"
        raise InputError(
            refused(f"controllers sample {count:.3g} times until t = {until!r}", hint=hint)
        )
    state = sampling.started(start, y0)
    if not np.isfinite(state).all():
        said = "what a controller sets is not finite at the start"
        raise InputError(refused(said, hint="start elsewhere"))
    return state


#: Distance that a start may have from the constraints, as a part of the largest coordinate or
#: velocity: more than the rounding of its numbers, less than anyone would call a start.
_OFF = 1e-9


def require_a_start(model: Model, problem: InitialValueProblem) -> None:
    """Refuse an initial state without accelerations, or away from the constraints.

    Raises
    ------
    InputError
        It cannot be integrated from.
    """
    values = positive_values(model)(problem.start, problem.y0) if model.borders else ()
    for name, value in zip(model.borders, values, strict=True):
        if not value > 0:
            message = f"'{name}' is declared positive, at the start it is {value:.9g}"
            if name in model.table_ends:
                message = f"the start is beyond the end of a table, {name}"
            if name in model.slips:
                message = f"the slip {name} vanishes at the start: its friction has no direction"
            raise InputError(Problem(message, hint="start elsewhere", rule="not-positive"))
    if not np.isfinite(problem.rhs(problem.start, problem.y0)).all():
        if model.massless:
            raise _massless(model)
        singular = "constraints or mass matrix are" if model.multipliers else "the mass matrix is"
        raise _refused(
            f"the equations of motion give no accelerations at the start, {_state(model, problem)}:"
            f" {singular} singular there, or a force is not finite",
            "start elsewhere, or choose coordinates and parameters that are regular there",
        )
    project = structured(problem.rhs).project
    start = problem.start, problem.y0
    if project is not None and not _near(problem.layout, project(*start), problem.y0):
        raise _refused(
            f"the start is not on the constraints, {_state(model, problem)}",
            "lagrange derive shows the constraints that are kept",
        )


def _massless(model: Model) -> InputError:
    """Make the refusal of coordinates without inertia, naming parameters that may be why."""
    zeros = ", ".join(f"{p.name} = 0" for p in model.parameters if p.value == 0)
    named = ", ".join(f"'{name}'" for name in model.massless)
    return _refused(
        f"the inertia of {named} vanishes with {zeros}: no acceleration follows",
        "without it, leave the coordinate to a constraint, or give it a mass",
    )


def _near(layout: StateLayout, projected: Array, y: Array) -> bool:
    """Tell if positions and velocities are those of the projected state; NaN is near nothing."""
    parts = (layout.positions, layout.velocities)
    pairs = ((np.abs(projected - y)[part], np.abs(y)[part]) for part in parts)
    return all(bool(moved.max() <= _OFF * size.max()) for moved, size in pairs)


def _refused(message: str, hint: str) -> InputError:
    return SingularError(Problem(message, hint=hint, rule="singular"))


def _state(model: Model, problem: InitialValueProblem) -> str:
    return ", ".join(
        f"{q} = {x:.9g}" for q, x in zip(model.state_names, problem.y0.tolist(), strict=True)
    )
