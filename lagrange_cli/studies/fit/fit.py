"""Values of parameters and of the start with which a motion passes measurements most closely.

Σ ((x(tᵢ) − xᵢ)/σᵢ)² is made smallest by the trust-region method of
:func:`scipy.optimize.least_squares` (:mod:`.search`), with the derivatives of :mod:`.residuals`.
What is left is compared with noise (:mod:`.verdict`). Standard errors are those of linear
regression, from (JᵀJ)⁻¹ (P. R. Bevington and D. K. Robinson, *Data Reduction and Error Analysis for
the Physical Sciences*, 3rd ed., chapters 7 and 8).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf, isfinite, tau
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.phrases import Phrase
from lagrange_cli.studies.fit.measurements import Measurements
from lagrange_cli.studies.fit.noise import LEVEL
from lagrange_cli.studies.fit.residuals import Residuals, Run
from lagrange_cli.studies.fit.result import (
    Fit,
    FitFinding,
    FitMinimum,
    FittedColumn,
    FittedValue,
)
from lagrange_cli.studies.fit.search import COMPARED, EXACT, Box, Search
from lagrange_cli.studies.fit.verdict import Judged, judged, standing

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory

#: Lowest value of a parameter that is to stay above zero.
POSITIVE = float(np.finfo(float).tiny)

#: Motions that a start is expected to take, for the progress that is shown.
_RUNS_OF_START = 30

#: Starts of parameters without bounds are drawn within this factor of their first values.
_DECADE = 10.0


@dataclass(frozen=True, kw_only=True)
class FreeValue:
    """A value that is fitted.

    Attributes
    ----------
    name
        A parameter, or a coordinate or its ``dot`` for its start.
    first
        Its first value.
    lowest, highest
        Bounds; infinite where there are none.
    is_start
        Whether it is the start of a coordinate.
    is_angle
        Whether a whole turn of it changes nothing.
    """

    name: str
    first: float
    lowest: float = -inf
    highest: float = inf
    is_start: bool = False
    is_angle: bool = False


# Sums of squares beyond doubles are told by what they are.
@np.errstate(over="ignore", invalid="ignore")
def fit_motion(
    run: Run,
    measurements: Measurements,
    free: Sequence[FreeValue],
    *,
    origin: float = 0.0,
    starts: int | None = None,
    accuracy: float = 1e-8,
    progress: Callable[[float], None] | None = None,
) -> Fit:
    """Fit values to measurements.

    Parameters
    ----------
    run
        Simulates a motion.
    measurements
        The measurements.
    free
        The values.
    origin
        Time at which motions start.
    starts
        Number of starts: the first values and points of a Latin hypercube. None if the search may
        end when residuals are noise beyond doubt, or enough starts agree.
    accuracy
        That of the motions.
    progress
        Called with the part of the runs that may be needed.

    Raises
    ------
    InputError
        No value is free, or more than there are measurements; a column is none of the motion's;
        there is no motion with the first values; these are not within their bounds.
    """
    _require_within(free)
    expected = _RUNS_OF_START * (starts or 1)

    def moved(runs: int) -> None:
        if progress is not None:
            progress(1 - 1 / (1 + runs / expected))

    first = {value.name: value.first for value in free}
    residuals = Residuals(run, measurements, first, origin, moved)
    box = _box(free, measurements)
    search = Search(residuals, box, np.array([tau if v.is_angle else inf for v in free]))
    judge = partial(judged, residuals, box=box, accuracy=accuracy)

    search.go(np.array([v.first for v in free]), starts, lambda m: standing(residuals, judge(m)))
    if not search.minima:
        residuals.motion(np.array([v.first for v in free]))  # raises with its reason
        raise InputError(Problem("no motion passes the measurements", rule="fit"))
    known = [judge(m) for m in search.minima if m.cost < COMPARED * search.minima[0].cost + EXACT]
    best = min(known, key=lambda judgement: judgement.score)
    residuals.deviations = best.deviations
    motion = residuals.dense_motion(best.minimum.values)
    others = [x for x in known if x is not best and not search.are_same(x.minimum, best.minimum)]
    findings = _findings(residuals, best, [x for x in others if x.is_as_good_as(best)], free)
    return _fit(residuals, free, search, best, motion, tuple(findings))


def _require_within(free: Sequence[FreeValue]) -> None:
    for value in free:
        if not value.lowest < value.highest:
            bounds = f"{value.lowest:g} and {value.highest:g}"
            message = f"the bounds of '{value.name}' do not ascend: {bounds}"
            raise InputError(Problem(message, rule="fit"))
        if not value.lowest <= value.first <= value.highest:
            message = (
                f"'{value.name}' = {value.first:g}, with which the fit begins, is not within its"
                f" bounds, {value.lowest:g} and {value.highest:g}"
            )
            hint = f"-{'i' if value.is_start else 'p'} {value.name}={value.lowest:g}"
            raise InputError(Problem(message, hint=hint, rule="fit"))


def _box(free: Sequence[FreeValue], measurements: Measurements) -> Box:
    drawn = [_drawn_between(value, measurements) for value in free]
    return Box(
        np.array([value.lowest for value in free]),
        np.array([value.highest for value in free]),
        np.array([first for first, _ in drawn]),
        np.array([last for _, last in drawn]),
        # Over more than a decade of one sign, sizes count.
        np.array([_spans_a_decade(first, last) for first, last in drawn]),
    )


def _spans_a_decade(first: float, last: float) -> bool:
    smaller, larger = sorted((abs(first), abs(last)))
    return first * last > 0 and larger >= _DECADE * smaller


def _drawn_between(value: FreeValue, measurements: Measurements) -> tuple[float, float]:
    """Return the bounds of the starts of a value: its own, or those of measurements, or decades."""
    size = 2 * abs(value.first) or 1.0
    column = measurements.values.get(value.name)
    if value.is_start and column is not None:
        first = min(float(np.nanmin(column)), value.first)
        last = max(float(np.nanmax(column)), value.first)
        if first == last:
            first, last = first - size, last + size
    elif value.is_start or value.first == 0:
        first, last = value.first - size, value.first + size
    else:
        first, last = sorted((value.first / _DECADE, value.first * _DECADE))
    # A bound that only keeps a parameter positive is no end of starts.
    lowest = value.lowest if value.lowest > POSITIVE or value.lowest <= 0 else -inf
    return (
        lowest if isfinite(lowest) else first,
        value.highest if isfinite(value.highest) else last,
    )


def _findings(
    residuals: Residuals, best: Judged, rivals: Sequence[Judged], free: Sequence[FreeValue]
) -> Iterator[FitFinding]:
    """Yield reasons against a fit, the gravest first, then remarks.

    Parameters
    ----------
    rivals
        Other minima that are as good.
    """
    if best.undetermined is not None:
        yield FitFinding("undetermined", _combination(best.undetermined, residuals.names))
    if not best.minimum.converged:
        text = Phrase("after {runs} runs values still change", runs=f"{residuals.runs}")
        yield FitFinding("not_converged", text)
    if not best.is_exact:
        yield from _contradictions(best)
    if best.undetermined is None:
        for rival in rivals:
            listed = _assignments(residuals.names, rival.minimum.values)
            yield FitFinding(
                "ambiguous", Phrase("the measurements agree with {values} as well", values=listed)
            )
    yield from _ends(best, free)
    size = best.size_probability
    if size is not None and 1 - size < LEVEL:
        said = "the residuals are smaller than the stated deviations: errors are too large"
        yield FitFinding("remark", Phrase(said))


def _contradictions(best: Judged) -> Iterator[FitFinding]:
    if best.size_probability is not None and best.size_probability < LEVEL:
        text = Phrase(
            "the residuals are {ratio} times the stated deviations (level {level})",
            ratio=f"{np.sqrt(np.mean(best.residuals**2)):.2g}",
            level=f"{LEVEL:g}",
        )
        yield FitFinding("contradicted", text)
    if best.serial_probability < LEVEL:
        name = min(best.serial, key=lambda column: best.serial[column].probability)
        text = Phrase(
            "the residuals of {name} are no noise, since neighbours are correlated (level {level})",
            name=name,
            level=f"{LEVEL:g}",
        )
        yield FitFinding("contradicted", text)


def _ends(best: Judged, free: Sequence[FreeValue]) -> Iterator[FitFinding]:
    for value, side in zip(free, best.minimum.at_bound, strict=True):
        if side:
            bound = (
                0.0
                if value.lowest == POSITIVE and side < 0
                else (value.lowest if side < 0 else value.highest)
            )
            said = Phrase("{name} is at its bound {bound}", name=value.name, bound=f"{bound:.6g}")
            yield FitFinding("at_bound", said)


def _assignments(names: Sequence[str], values: Array) -> str:
    return ", ".join(f"{name} = {x:.6g}" for name, x in zip(names, values, strict=True))


def _combination(direction: Array, names: Sequence[str]) -> str:
    named = [n for n, x in zip(names, direction, strict=True) if abs(x) > 1e-3]
    if len(named) == 1:
        return Phrase("nothing that was measured depends on {name}", name=named[0])
    *first, last = named
    return Phrase(
        "changes of {names} together leave all measured values as they are",
        names=Phrase("{first} and {last}", first=" and ".join(first), last=last),
    )


def _fit(
    residuals: Residuals,
    free: Sequence[FreeValue],
    search: Search,
    best: Judged,
    motion: Trajectory,
    findings: tuple[FitFinding, ...],
) -> Fit:
    errors = np.sqrt(np.diag(best.covariance))
    scales = np.where(errors > 0, errors, np.nan)
    fitted = residuals.fitted(best.minimum.values)
    minima = sorted(
        zip(search.minima, search.ended, strict=True),
        key=lambda m: m[0].start is not best.minimum.start,
    )
    return Fit(
        motion.name,
        findings,
        tuple(
            FittedValue(
                value.name, value.first, float(x), None if np.isnan(error) else float(error)
            )
            for value, x, error in zip(free, best.minimum.values, errors, strict=True)
        ),
        tuple(_column(residuals, best, name, x) for name, x in fitted.items()),
        best.covariance / np.outer(scales, scales),
        float(best.residuals @ best.residuals),
        best.degrees,
        residuals.given,
        best.size_probability,
        "variational equations" if residuals.by_variation else "differences",
        residuals.runs,
        search.tried,
        tuple(
            FitMinimum(
                dict(zip(residuals.names, minimum.values.tolist(), strict=True)),
                float(np.sqrt(minimum.cost / len(best.residuals))),
                ended,
            )
            for minimum, ended in minima
        ),
        motion,
    )


def _column(residuals: Residuals, best: Judged, name: str, fitted: Array) -> FittedColumn:
    present = residuals.present[name]
    table = residuals.measurements
    return FittedColumn(
        name,
        table.times[present],
        table.values[name][present],
        fitted[present],
        best.deviations[name][present],
        None if best.is_exact else best.serial.get(name),
    )


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
