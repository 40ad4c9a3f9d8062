"""Residuals of measurements against motions, up to any of their times, with their derivatives.

Derivatives are those of the variational equations, integrated beside the motion, where coordinates
and their rates were measured; other columns, and motions with contacts or closures, take central
differences of accurate motions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, LagrangeError, Mark, Problem
from lagrange_cli.studies.fit.measurements import Measurements, require_names, require_times

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory

#: Part of a value's size by which it is moved for a difference: the cube root of runs' errors.
_STEP = 1e-3

#: Part of a column's range below which its residuals are errors of numbers, not of measurements.
SMALLEST_DEVIATION = 1e-8

#: Residual of each measurement, over its deviation, at values with which there is no motion.
_NO_MOTION = 1e6

#: Numbers above this have sums of squares that are beyond doubles, or will have.
_LARGEST = 1e100

#: Samples of a motion between measurements, at least and at most.
_SAMPLES, _MOST_SAMPLES = 1001, 64_001

#: Seconds that a motion may take, and how many times as long as the first one, beside which values
#: of a search may make one stiff.
_SECONDS, _TIMES_AS_LONG = 2.0, 100.0

Run = Callable[[Mapping[str, float], Sequence[str], "Array", "float | None"], "Trajectory"]
"""Values by name, names to differentiate by, sample times from the start on, seconds that it may
take → the motion."""


class Residuals:
    """Differences of a motion from measurements, over the deviations of these.

    Parameters
    ----------
    run
        Simulates a motion.
    measurements
        The measurements.
    first
        Name of a free value → its first value.
    origin
        Time at which motions start.
    moved
        Called after each motion with the number of motions.

    Attributes
    ----------
    names
        The free values.
    sizes
        Their sizes, shape (values,).
    times
        Times of the measurements, each once, shape (times,).
    present
        Column → whether there is a measurement, of the shape of the table's columns.
    ranges
        Column → its range, multiplied by the deviations that are given over their median.
    deviations
        Column → what residuals are divided by: the ranges, and standard deviations after
        :meth:`take_deviations`.
    runs
        Motions that were simulated.

    Raises
    ------
    InputError
        No value is free, or more than there are measurements; a column is none of the motion's;
        there is no motion with the first values.
    """

    def __init__(
        self,
        run: Run,
        measurements: Measurements,
        first: Mapping[str, float],
        origin: float,
        moved: Callable[[int], None],
    ) -> None:
        self._run, self.measurements, self._moved = run, measurements, moved
        self.names = tuple(first)
        values = np.array(list(first.values()))
        self.sizes = np.where(values != 0, np.abs(values), 1.0)
        self.present = {k: ~np.isnan(x) for k, x in measurements.values.items()}
        self._require_enough()
        require_times(measurements, origin)
        self.times, self._rows = np.unique(measurements.times, return_inverse=True)
        self._origin = origin
        self.given = measurements.deviations.keys() == measurements.values.keys()
        self.ranges = {
            name: column_size(x) * self._given_shape(name)
            for name, x in measurements.values.items()
        }
        self.deviations = self.ranges
        self.runs, self.by_variation = 0, True
        self._last: tuple[bytes, int, Trajectory] | None = None
        self._seconds: float | None = None
        begun = perf_counter()
        motion = self._first_motion(values)
        self._seconds = max(_SECONDS, _TIMES_AS_LONG * (perf_counter() - begun))
        columns = [k for k in motion.columns if not k.startswith(("d(", "dot(d("))]
        require_names(measurements, columns)
        derived = {_derivative(name, by) for name in self.present for by in self.names}
        self.by_variation &= motion.columns.keys() >= derived

    def _given_shape(self, name: str) -> Array:
        """Return the given deviations of a column over their median; else ones."""
        deviations = self.measurements.deviations.get(name)
        if deviations is None:
            return np.ones(len(self.measurements.times))
        return np.asarray(deviations / np.nanmedian(deviations[self.present[name]]))

    def _require_enough(self) -> None:
        count = sum(int(x.sum()) for x in self.present.values())
        if not self.names:
            raise InputError(Problem("nothing is free to be fitted", rule="fit"))
        if count <= len(self.names):
            message = f"{count} measurements do not determine {len(self.names)} values"
            raise InputError(Problem(message, Mark(self.measurements.path, 1, 1), rule="fit"))

    def _first_motion(self, values: Array) -> Trajectory:
        """Return the motion with the first values, without its derivatives where there are none."""
        try:
            return self._moved_motion(values, len(self.times))
        except InputError:
            # Contacts, closures and kinks have no variational equations.
            self.by_variation = False
            return self._moved_motion(values, len(self.times))

    def motion(self, values: Array, until: int | None = None) -> Trajectory:
        """Simulate until one of the times; by default until the last.

        Raises
        ------
        LagrangeError
            There is no motion with these values until then.
        """
        motion = self._moved_motion(values, len(self.times) if until is None else until)
        if motion.status != "ok":
            message = f"the motion is not promised until the last measurement: {motion.reason}"
            raise InputError(Problem(message, rule="fit"))
        return motion

    def _moved_motion(self, values: Array, last: int) -> Trajectory:
        """Simulate until one of the times, or as far as a motion with these values goes."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key or self._last[1] < last:
            self.runs += 1
            self._moved(self.runs)
            times = self.times[:last]
            if times[0] > self._origin:
                times = np.concatenate([[self._origin], times])
            named = dict(zip(self.names, values.tolist(), strict=True))
            by = self.names if self.by_variation else ()
            self._last = key, last, self._run(named, by, times, self._seconds)
        return self._last[2]

    def dense_motion(self, values: Array) -> Trajectory:
        """Simulate until the last time with samples at equal distances, dense between the times."""
        number = min(max(_SAMPLES, 4 * len(self.times) + 1), _MOST_SAMPLES)
        named = dict(zip(self.names, values.tolist(), strict=True))
        by = self.names if self.by_variation else ()
        self.runs += 1
        times = np.linspace(self._origin, self.times[-1], number)
        return self._run(named, by, times, None)

    def _at_rows(self, column: Array, until: int) -> Array:
        """Return a motion's column at the rows of the table before a time; NaN behind it."""
        head = int(self.times[0] > self._origin)
        known = np.full(len(self.times), np.nan)
        known[:until] = column[head : head + until]
        return known[self._rows]

    def fitted(self, values: Array, until: int | None = None) -> dict[str, Array]:
        """Return the columns of a motion at the rows of the table; NaN from ``until`` on."""
        last = len(self.times) if until is None else until
        motion = self.motion(values, last)
        return {name: self._at_rows(motion.columns[name], last) for name in self.present}

    def residuals(self, values: Array, until: int | None = None) -> Array:
        """Return residuals over deviations, column by column, of the times before ``until``.

        They are large where there is no motion with these values.
        """
        try:
            columns = self.fitted(values, until)
        except LagrangeError:
            return np.full(self.count(until), _NO_MOTION)
        measured = self.measurements.values
        return self._weighted({k: x - measured[k] for k, x in columns.items()}, until)

    def count(self, until: int | None = None) -> int:
        """Return the number of measurements before a time."""
        return sum(int(self._chosen(name, until).sum()) for name in self.present)

    def _chosen(self, name: str, until: int | None) -> NDArray[np.bool_]:
        present = self.present[name]
        return present if until is None else present & (self._rows < until)

    def _weighted(self, columns: Mapping[str, Array], until: int | None) -> Array:
        parts = [
            (columns[name] / self.deviations[name])[self._chosen(name, until)]
            for name in self.present
        ]
        return np.concatenate(parts)

    def by_time(self, values: Array) -> Array:
        """Return the sum of squares of residuals over the ranges of columns at each time."""
        squares = np.zeros(len(self.times))
        for name, column in self.fitted(values).items():
            part = (column - self.measurements.values[name]) / self.ranges[name]
            squares += np.bincount(self._rows, np.nan_to_num(part) ** 2, len(self.times))
        return squares

    @property
    def counts(self) -> Array:
        """Number of measurements at each time."""
        counts = (np.bincount(self._rows, x, len(self.times)) for x in self.present.values())
        return np.asarray(np.sum(list(counts), axis=0))

    def jacobian(self, values: Array, until: int | None = None) -> Array:
        """Return the derivatives of the residuals, shape (measurements, values).

        Raises
        ------
        InputError
            Their squares are beyond doubles, or there is no motion.
        """
        slopes = (self._slopes if self.by_variation else self._differences)(values, until)
        if not (np.abs(slopes) < _LARGEST).all():
            raise InputError(Problem("derivatives of the motion are beyond doubles", rule="fit"))
        return slopes

    def _slopes(self, values: Array, until: int | None) -> Array:
        last = len(self.times) if until is None else until
        motion = self.motion(values, last)
        slopes = []
        for by in self.names:
            named = {name: motion.columns[_derivative(name, by)] for name in self.present}
            at_rows = {name: self._at_rows(column, last) for name, column in named.items()}
            slopes.append(self._weighted(at_rows, until))
        return np.stack(slopes, axis=1)

    def _differences(self, values: Array, until: int | None) -> Array:
        slopes = []
        for k, value in enumerate(values):
            step = _STEP * max(abs(value), 1e-3 * self.sizes[k])
            ends = []
            for sign in (1, -1):
                moved = values.copy()
                moved[k] += sign * step
                ends.append(self._weighted(self.fitted(moved, until), until))
            slopes.append((ends[0] - ends[1]) / (2 * step))
        return np.stack(slopes, axis=1)

    def take_deviations(self, values: Array) -> None:
        """Take the deviations that are given, and those of the residuals for others."""
        fitted = self.fitted(values)
        taken = {}
        for name, x in self.measurements.values.items():
            residuals = (fitted[name] - x)[self.present[name]]
            # A column without any scatter must not outweigh all others.
            smallest = SMALLEST_DEVIATION * column_size(x)
            spread = max(float(np.sqrt(np.mean(residuals**2))), smallest)
            taken[name] = self.measurements.deviations.get(name, np.full(len(x), spread))
        self.deviations = taken


def _derivative(name: str, by: str) -> str:
    """Return the column of the derivative of a coordinate, or of its rate."""
    if name.startswith("dot(") and name.endswith(")"):
        return f"dot(d({name[4:-1]})/d({by}))"
    return f"d({name})/d({by})"


def column_size(column: Array) -> float:
    """Return the range of a column; its size if it is constant, 1 if that is zero."""
    present = column[~np.isnan(column)]
    spread = float(np.ptp(present)) if len(present) else 0.0
    return spread or float(np.abs(present).max(initial=0.0)) or 1.0
