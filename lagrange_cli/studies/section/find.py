"""Points at which a motion meets a section, to the accuracy of the motion.

The motion is run with samples at the Chebyshev nodes of panels of time, so that it is promised
there; between the nodes of a panel it is a polynomial, whose own error its last coefficients show.
So the crossings are zeros of polynomials, of which none can hide; where a polynomial is not good
enough to tell how many there are, or where, its panel is divided and the motion run again. An error
of the motion displaces a crossing along the motion as well, the more the flatter it meets the
section. Where that takes points beyond the accuracy, everything is done once more with a higher
one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions, is_automatic
from lagrange_cli.simulate.request import MOST_SAMPLES_IN_MEMORY, method_of
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.simulation import RunContext
from lagrange_cli.studies.chebyshev import DEGREE, nodes_between
from lagrange_cli.studies.section.followed import PARTS, FollowedMotion, Mesh
from lagrange_cli.studies.section.result import SectionPoints

#: Panels of the first run: no step of a run is longer.
_PANELS = 128

#: Steps that panels may have in the mean: there are as many nodes.
_STEPS = DEGREE

#: Runs of a motion, each over panels that may be a quarter as long as before: twelve come to a
#: millionth of the first length. Not tuned.
_MOST_RUNS = 12

#: Numbers of all columns at the samples of a run.
_MOST_NUMBERS = 2**24

#: Error that polynomials may leave out, over the accuracy; over the tolerance where no accuracy is
#: promised, since steps then differ by it from one smooth motion.
_SHARE, _OF_TOLERANCE = 0.1, 10.0

#: How much higher an accuracy is tried for the sake of flat crossings.
_MOST_TIGHTER = 1e3


@dataclass
class _Runs:
    """Runs of one motion, one after the other.

    Attributes
    ----------
    model, options, context
        The model of the motion, its options, and the means of its runs.
    deadline
        Moment of the monotonic clock after which no run begins; None without a budget.
    count
        Runs so far.
    ended
        The first run that did not reach its end; None if all did.
    """

    model: Model
    options: SimulationOptions
    context: RunContext
    deadline: float | None
    count: int = 0
    ended: Trajectory | None = field(default=None)

    def over(self, mesh: Mesh) -> Trajectory:
        """Run over a mesh."""
        left = self.options.budget
        if self.deadline is not None:
            left = max(self.deadline - time.monotonic(), 1e-3)
        times = tuple(nodes_between(mesh.edges).tolist())
        options = replace(
            self.options, until=None, samples=None, step=None, times=times, budget=left
        )
        self.count += 1
        return simulate_past_singularities(self.model, options, None, self.context)

    def follow(self, mesh: Mesh, tolerance: float) -> FollowedMotion | None:
        """Run over finer and finer meshes until the section is resolved; None without a motion."""
        while True:
            run = self.over(mesh)
            self.context = replace(self.context, progress=None)
            end = float(run.t[-1])
            if end < mesh.edges[-1]:
                self.ended = self.ended or run
                if run.status == "stopped":
                    return self._as_far_as(run, mesh, tolerance)
                if len(run.t) < 2:
                    return None
                mesh = mesh.until(end)
                if self.count < _MOST_RUNS:
                    continue
                return self._as_far_as(run, mesh, tolerance)
            followed = FollowedMotion(self.model, run, mesh, tolerance)
            finer = self._finer(followed)
            if finer is None or self.count >= _MOST_RUNS:
                return followed
            mesh = finer

    def _finer(self, followed: FollowedMotion) -> Mesh | None:
        """Return a finer mesh; None if this one resolves the section as far as possible."""
        mesh, steps = followed.mesh, followed.run.steps
        count = len(mesh.edges) - 1
        wanted = -(-steps // _STEPS)
        if wanted > count:
            self._require_possible(wanted, mesh)
            return Mesh.equal(mesh.edges[0], mesh.edges[-1], wanted)
        which = followed.to_divide()
        if not which.any():
            return None
        wanted = count + (PARTS - 1) * int(which.sum())
        if followed.blurred.any():
            self._require_possible(wanted, mesh)
        elif wanted > self._most_panels:
            return None
        return mesh.divided(which)

    @property
    def _most_panels(self) -> int:
        width = len(self.model.columns) + 1
        return min(_MOST_NUMBERS // width, MOST_SAMPLES_IN_MEMORY - 1) // DEGREE

    def _require_possible(self, panels: int, mesh: Mesh) -> None:
        """Refuse more samples than memory holds."""
        if panels <= self._most_panels:
            return
        start, until = mesh.edges[[0, -1]].tolist()
        possible = start + (until - start) * self._most_panels / panels
        message = f"the motion goes to and fro more often until t = {until:.6g} than memory holds"
        raise InputError(Problem(message, hint=f"--until {possible:.3g}", rule="section"))

    def _as_far_as(self, run: Trajectory, mesh: Mesh, tolerance: float) -> FollowedMotion | None:
        """Return the motion over the panels that a run has completed; None if there are none."""
        panels = (len(run.t) - 1) // DEGREE
        if panels < 1:
            return None
        complete = slice(panels * DEGREE + 1)
        columns = {name: values[complete] for name, values in run.columns.items()}
        cut = replace(run, t=run.t[complete], columns=columns, energy=run.energy[complete])
        return FollowedMotion(self.model, cut, Mesh(mesh.edges[: panels + 1]), tolerance)


def _require_interpolant(options: SimulationOptions) -> None:
    """Refuse a method that an option names and that makes its steps end at samples."""
    if options.method is None or is_automatic(options.method):
        return
    method = method_of(options.method)
    if not method.interpolates:
        said = f"steps of {method.name} end at samples, so that each finer look at the motion"
        message = f"{said} is at another one"
        raise InputError(Problem(message, hint="--method DOP853 --rtol 1e-9", rule="section"))


def section_points(
    model: Model,
    options: SimulationOptions,
    context: RunContext,
    deadline: float | None = None,
) -> SectionPoints:
    """Compute the points at which the motion of a model meets its section.

    Parameters
    ----------
    model
        Model with the outputs of :func:`.simulate.model.requested_outputs.with_section`.
    options
        Simulation options of the motion.
    context
        Means and listeners of the runs.
    deadline
        Moment of the monotonic clock after which no run begins, and by which runs stop.

    Raises
    ------
    InputError
        As :func:`.simulate.simulation.simulate`; the motion takes more steps than fit in memory, or
        the method makes its steps end at samples.
    """
    began = time.perf_counter()
    _require_interpolant(options)
    request = context.resolved(model, options)
    start, until = float(request.times[0]), float(request.times[len(request.times) - 1])
    tolerance = _OF_TOLERANCE * (request.rtol or 0.0)
    if request.accuracy is not None:
        tolerance = _SHARE * request.accuracy
    runs = _Runs(model, options, context, deadline)
    followed = runs.follow(Mesh.equal(start, until, _PANELS), tolerance)
    if followed is not None and request.accuracy is not None and runs.ended is None:
        followed = _tightened(runs, followed, request.accuracy)
    return _result(model, followed, runs, request.accuracy, time.perf_counter() - began)


def _tightened(runs: _Runs, followed: FollowedMotion, accuracy: float) -> FollowedMotion:
    """Follow the motion with a higher accuracy, if points need it and it can be had."""
    errors, left_out = followed.point_errors()
    worst = float((errors + left_out).max(initial=0.0)) / accuracy
    if worst <= 1 and not len(followed.open):
        return followed
    if len(followed.open):
        wanted = accuracy / _MOST_TIGHTER
    else:
        # A run is often better than was asked for: less than that would give the same one again.
        reached = min(accuracy, followed.estimated or accuracy)
        wanted = max(reached / (2 * worst), accuracy / _MOST_TIGHTER)
    options = replace(runs.options, accuracy=wanted)
    tighter = _Runs(runs.model, options, runs.context, runs.deadline)
    try:
        again = tighter.follow(followed.mesh, followed.tolerance)
    except InputError:  # below the floor of double precision
        return followed
    finally:
        runs.count += tighter.count
    return followed if again is None or tighter.ended is not None else again


def _result(
    model: Model,
    followed: FollowedMotion | None,
    runs: _Runs,
    accuracy: float | None,
    seconds: float,
) -> SectionPoints:
    """Gather the points and the figures of the motion."""
    last = runs.ended or (None if followed is None else followed.run)
    assert last is not None
    names = _columns(last)
    t = np.empty(0) if followed is None else followed.points
    of_run, left_out = (t, t) if followed is None else followed.point_errors()
    error = None if accuracy is None else of_run + left_out
    run = last if followed is None else followed.run
    return SectionPoints(
        t=t,
        columns={name: _at(followed, name) for name in names},
        energy=_at(followed, "energy"),
        error=error,
        open=() if followed is None else tuple(followed.open.tolist()),
        status=last.status,
        reason=last.reason,
        requested=accuracy,
        estimated=run.estimated,
        scales=run.scales,
        holds_until=last.holds_until,
        energy_drift=run.energy_drift,
        method=run.method,
        runs=runs.count,
        seconds=seconds,
    )


def _columns(run: Trajectory) -> Sequence[str]:
    """Return the names of the columns that a trajectory has without a section."""
    return [name for name in run.columns if not name.startswith("section ")]


def _at(followed: FollowedMotion | None, name: str) -> Array:
    return np.empty(0) if followed is None else followed.column_at(name, followed.points).values
