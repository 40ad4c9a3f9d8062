"""Values of parameters and of the start with which a motion passes measurements most closely.

Σ ((x(tᵢ) − xᵢ)/σᵢ)² is made smallest by the trust-region method of
:func:`scipy.optimize.least_squares`. Its Jacobian matrix J is that of the variational equations,
integrated beside the motion, where coordinates and their rates were measured; other columns, and
motions with contacts or closures, take central differences of accurate motions. Standard errors are
those of linear regression, from (JᵀJ)⁻¹ (P. R. Bevington and D. K. Robinson, *Data Reduction and
Error Analysis for the Physical Sciences*, 3rd ed., chapters 7 and 8).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.phrases import Phrase
from lagrange_cli.studies.fit.measurements import Measurements, require_names, require_times
from lagrange_cli.studies.fit.result import Fit, FittedColumn, FittedValue

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory

#: Samples of a motion at first, and at most; in between, values are interpolated.
_SAMPLES, _MOST_SAMPLES = 1001, 64_001

#: Part of a column's range by which interpolated values may be wrong.
_INTERPOLATED = 1e-8

#: Part of a value by which it is moved for a difference: the cube root of the runs' errors.
_STEP = 1e-3

#: Ratio of singular values of J, its columns of one length, below which a combination of values
#: changes nothing that was measured.
_UNDETERMINED = 1e-7

#: Residuals at values with which there is no motion.
_NO_MOTION = 1e6

#: Runs for each value that is fitted.
_MOST_RUNS = 100

Run = Callable[[Mapping[str, float], Sequence[str], int], "Trajectory"]
"""Values by name, names to differentiate by, number of samples → the motion until the last
measurement."""


def fit_motion(
    run: Run,
    measurements: Measurements,
    start: Mapping[str, float],
    positive: Sequence[str] = (),
    progress: Callable[[float], None] | None = None,
) -> Fit:
    """Fit values to measurements.

    Parameters
    ----------
    run
        Simulates a motion.
    measurements
        The measurements.
    start
        Name of a free value → its first value.
    positive
        Names of parameters that are to stay above zero.
    progress
        Called with the part of the runs that may be needed.

    Raises
    ------
    InputError
        No value is free, or more than there are measurements; a column is none of the motion's;
        there is no motion with the first values.
    """
    from scipy.optimize import least_squares

    problem = _Problem(run, measurements, start, progress)
    first = np.array(list(start.values()))
    lowest = [np.finfo(float).tiny if name in positive else -np.inf for name in start]
    sizes = np.where(first != 0, np.abs(first), 1.0)
    solution: Any = None
    for _ in range(1 if problem.given else 2):
        # Deviations that are not given are, at first, the range of each column, then the root mean
        # square of its residuals.
        solution = least_squares(
            problem.residuals,
            first if solution is None else solution.x,
            problem.jacobian,
            bounds=(lowest, np.inf),
            x_scale=sizes,
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=_MOST_RUNS,
        )
        problem.take_deviations(solution.x)
    return problem.result(solution.x, converged=bool(solution.status > 0))


class _Problem:
    def __init__(
        self,
        run: Run,
        measurements: Measurements,
        start: Mapping[str, float],
        progress: Callable[[float], None] | None,
    ) -> None:
        self._run, self._measurements, self._start = run, measurements, start
        self._progress = progress
        self.names = tuple(start)
        self.present = {k: ~np.isnan(x) for k, x in measurements.values.items()}
        self._require_enough()
        self.runs, self._samples, self._exact = 0, _SAMPLES, True
        self._last: tuple[bytes, Trajectory] | None = None
        first = self._first_motion()
        require_names(
            measurements, [k for k in first.columns if not k.startswith(("d(", "dot(d("))]
        )
        require_times(measurements, float(first.t[0]))
        self._exact &= first.scales.keys() >= measurements.values.keys()
        self._choose_samples(first)
        self.given = measurements.deviations.keys() == measurements.values.keys()
        self.deviations = {
            name: measurements.deviations.get(name, np.full(len(x), _size(x)))
            for name, x in measurements.values.items()
        }

    def _require_enough(self) -> None:
        count = sum(int(x.sum()) for x in self.present.values())
        mark = Mark(self._measurements.path, 1, 1)
        if not self.names:
            raise InputError(Problem("nothing is free to be fitted", rule="fit"))
        if count <= len(self.names):
            message = f"{count} measurements do not determine {len(self.names)} values"
            raise InputError(Problem(message, mark, rule="fit"))

    def _first_motion(self) -> Trajectory:
        """Return the motion with the first values, without its derivatives where there are none."""
        values = np.array(list(self._start.values()))
        try:
            return self._motion(values)
        except InputError as refusal:
            if all(p.rule != "sensitivity" for p in refusal.problems):
                raise
            self._exact = False
            return self._motion(values)

    def _motion(self, values: Array) -> Trajectory:
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            self.runs += 1
            if self._progress is not None:
                self._progress(min(1.0, self.runs / (_MOST_RUNS * (1 + len(self.names)))))
            named = dict(zip(self.names, values.tolist(), strict=True))
            by = self.names if self._exact else ()
            self._last = key, self._run(named, by, self._samples)
        motion = self._last[1]
        if motion.status != "ok":
            message = f"the motion is not promised until the last measurement: {motion.reason}"
            raise InputError(Problem(message, rule="fit"))
        return motion

    def _choose_samples(self, motion: Trajectory) -> None:
        """Take samples so near each other that values between them are exact enough."""
        while self._samples < _MOST_SAMPLES:
            half = _every_second(motion)
            # The error of a cubic falls to a sixteenth with half the distance.
            worst = max(
                np.abs(_at(half, name, motion.t) - motion.columns[name]).max()
                / (16 * _size(motion.columns[name]))
                for name in self._measurements.values
            )
            if worst <= _INTERPOLATED:
                return
            self._samples, self._last = 2 * self._samples - 1, None
            motion = self._motion(np.array(list(self._start.values())))

    def fitted(self, values: Array) -> dict[str, Array]:
        """Return the columns of a motion at the times of all measurements."""
        motion, times = self._motion(values), self._measurements.times
        return {name: _at(motion.columns, name, times, motion.t) for name in self.present}

    def residuals(self, values: Array) -> Array:
        try:
            fitted = self.fitted(values)
        except InputError:
            if self.runs <= 1:
                raise
            count = sum(int(x.sum()) for x in self.present.values())
            return np.full(count, _NO_MOTION)
        return self._weighted({k: x - self._measurements.values[k] for k, x in fitted.items()})

    def _weighted(self, columns: Mapping[str, Array]) -> Array:
        parts = [
            (columns[name] / self.deviations[name])[present]
            for name, present in self.present.items()
        ]
        return np.concatenate(parts)

    def jacobian(self, values: Array) -> Array:
        """Return the derivatives of the residuals, shape (measurements, values)."""
        if not self._exact:
            return self._differences(values)
        motion, times = self._motion(values), self._measurements.times
        slopes = []
        for by in self.names:
            named = {name: _derivative(name, by) for name in self.present}
            columns = {k: _at(motion.columns, d, times, motion.t) for k, d in named.items()}
            slopes.append(self._weighted(columns))
        return np.stack(slopes, axis=1)

    def _differences(self, values: Array) -> Array:
        slopes = []
        for k, value in enumerate(values):
            step = _STEP * (abs(value) or 1.0)
            ends = []
            for sign in (1, -1):
                moved = values.copy()
                moved[k] += sign * step
                ends.append(self._weighted(self.fitted(moved)))
            slopes.append((ends[0] - ends[1]) / (2 * step))
        return np.stack(slopes, axis=1)

    def take_deviations(self, values: Array) -> None:
        """Estimate the deviations that are not given from the residuals."""
        fitted = self.fitted(values)
        for name, x in self._measurements.values.items():
            if name not in self._measurements.deviations:
                residuals = (fitted[name] - x)[self.present[name]]
                spread = np.sqrt(np.mean(residuals**2))
                # A column without any scatter must not outweigh all others.
                self.deviations[name] = np.full(len(x), max(spread, _INTERPOLATED * _size(x)))

    def result(self, values: Array, *, converged: bool) -> Fit:
        jacobian, residuals = self.jacobian(values), self.residuals(values)
        free = len(residuals) - len(values)
        lengths = np.linalg.norm(jacobian, axis=0)
        scaled = jacobian / np.where(lengths > 0, lengths, 1.0)
        _, singular, rows = np.linalg.svd(scaled, full_matrices=False)
        undetermined = bool(singular[-1] <= _UNDETERMINED * singular[0])
        count = len(values)
        covariance = np.full((count, count), np.nan)
        if not undetermined:
            covariance = np.linalg.inv(jacobian.T @ jacobian)
            if not self.given:
                covariance = covariance * float(residuals @ residuals) / free
        errors = np.sqrt(np.diag(covariance))
        status: Literal["ok", "undetermined", "not_converged"] = "ok"
        reason = ""
        if undetermined:
            status, reason = "undetermined", self._combination(rows[-1])
        elif not converged:
            status, reason = (
                "not_converged",
                Phrase("after {runs} runs values still change", runs=f"{self.runs}"),
            )
        motion, fitted = self._motion(values), self.fitted(values)
        return Fit(
            motion.name,
            status,
            reason,
            tuple(
                FittedValue(name, first, float(value), None if np.isnan(error) else float(error))
                for (name, first), value, error in zip(
                    self._start.items(), values, errors, strict=True
                )
            ),
            tuple(self._column(name, fitted[name]) for name in self.present),
            covariance / np.outer(errors, errors),
            float(residuals @ residuals),
            free,
            self.given,
            "variational equations" if self._exact else "differences",
            self.runs,
            motion,
        )

    def _combination(self, direction: Array) -> str:
        named = [n for n, x in zip(self.names, direction, strict=True) if abs(x) > 1e-3]
        if len(named) == 1:
            return Phrase("nothing that was measured depends on {name}", name=named[0])
        *first, last = named
        return Phrase(
            "changes of {names} together leave all measured values as they are",
            names=Phrase("{first} and {last}", first=" and ".join(first), last=last),
        )

    def _column(self, name: str, fitted: Array) -> FittedColumn:
        present = self.present[name]
        parts = (self._measurements.times, self._measurements.values[name], fitted)
        times, measured, seen = (x[present] for x in parts)
        return FittedColumn(name, times, measured, seen, self.deviations[name][present])


def _derivative(name: str, by: str) -> str:
    """Return the column of the derivative of a coordinate, or of its rate."""
    if name.startswith("dot(") and name.endswith(")"):
        return f"dot(d({name[4:-1]})/d({by}))"
    return f"d({name})/d({by})"


def _size(column: Array) -> float:
    """Return the range of a column; its size if it is constant, 1 if that is zero."""
    present = column[~np.isnan(column)]
    spread = float(np.ptp(present)) if len(present) else 0.0
    return spread or float(np.abs(present).max(initial=0.0)) or 1.0


def _every_second(motion: Trajectory) -> Mapping[str, Array]:
    return {name: x[::2] for name, x in motion.columns.items()} | {"t": motion.t[::2]}


def _at(columns: Mapping[str, Array], name: str, times: Array, t: Array | None = None) -> Array:
    """Interpolate a column by cubics, with its rate where there is a column of that."""
    from scipy.interpolate import CubicHermiteSpline, CubicSpline

    at = columns["t"] if t is None else t
    rate = columns.get(f"dot({name})")
    if rate is None:
        return np.asarray(CubicSpline(at, columns[name])(times))
    return np.asarray(CubicHermiteSpline(at, columns[name], rate)(times))


def require_free(names: Sequence[str], known: Mapping[str, float | None]) -> dict[str, float]:
    """Return the first values of the free parameters and starts.

    Parameters
    ----------
    known
        Parameters, coordinates and their ``dot`` → the scene's values; None if it has none.

    Raises
    ------
    InputError
        A name is not known, or has no value to begin with.
    """
    for name in names:
        if name not in known:
            message = f"'{name}' is neither a parameter nor a coordinate, whose start it would be"
            hint = nearest(name, list(known)) or f"there are {', '.join(known)}"
            raise InputError(Problem(message, hint=hint, rule="fit"))
        if known[name] is None:
            message, hint = f"no value of '{name}' to begin with", f"-p {name}=1"
            raise InputError(Problem(message, hint=hint, rule="fit"))
    return {name: value for name in names if (value := known[name]) is not None}
