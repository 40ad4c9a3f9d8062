"""Studies as JSON: paths, trade-offs, runs at extremes and fits."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    INTEGER,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    REASON,
    TEXT,
    JsonObject,
    Key,
    by_name,
    counts,
    list_of,
    one_of,
    or_null,
    through,
)

if TYPE_CHECKING:
    from lagrange_cli.studies.fit.result import (
        Fit,
        FitFinding,
        FitMinimum,
        FittedColumn,
        FittedValue,
    )
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.measure import StationaryPath
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.path.scan import Scan
    from lagrange_cli.studies.reference import Reference
    from lagrange_cli.studies.stress.measure import Stress
    from lagrange_cli.studies.stress.runs import StressRun
    from lagrange_cli.studies.tradeoff.result import CostRatios, Recommendation, Trade
    from lagrange_cli.studies.tradeoff.runs import Setting, WorkPrecisionPoint

# Paths.


class _SolvedPath(NamedTuple):
    """A path of some paths."""

    paths: Paths
    path: StationaryPath

    @property
    def start(self) -> dict[str, float]:
        rates = [f"dot({name})" for name in self.paths.coordinates]
        return dict(zip(rates, self.path.velocity.tolist(), strict=True))


def _end(paths: Paths, end: End) -> dict[str, float]:
    return {"t": end.t, **dict(zip(paths.coordinates, end.q.tolist(), strict=True))}


_KIND = one_of("minimum", "saddle", "degenerate", "undecided")
_SCAN: JsonObject[Scan] = JsonObject(
    Key("reach", NUMBER, "Largest initial velocity, either way."),
    Key("energy", NUMBER, "Largest energy of these motions."),
    Key("motions", INTEGER, "Number of motions.", lambda scan: scan.count),
    Key(
        "resolved",
        BOOLEAN,
        "False if neighbours part too fast to tell all paths.",
        lambda s: s.is_resolved,
    ),
)
_SOLUTION: JsonObject[_SolvedPath] = JsonObject(
    Key("action", NUMBER, "∫ L dt.", lambda s: s.path.action),
    Key(
        "kind",
        _KIND,
        "What the action is beside that of varied paths; degenerate: the last end is conjugate to"
        " the first.",
        lambda s: s.path.conjugacy.kind,
    ),
    Key(
        "index",
        or_null(INTEGER),
        "Number of conjugate points between the ends; null if it is not known.",
        lambda s: s.path.conjugacy.index,
    ),
    Key("conjugate", list_of(NUMBER), "Their times.", lambda s: s.path.conjugacy.times),
    Key("start", by_name(NUMBER), "Initial velocities, as simulate -i takes them."),
    Key(
        "to", by_name(NUMBER), "The last end, angles turned.", lambda s: _end(s.paths, s.path.last)
    ),
    Key("action_error", NUMBER, "Bound of the error of the action.", lambda s: s.path.action_error),
    Key(
        "reached",
        NUMBER,
        "Distance from the end at which simulate arrives from the start, its own error included,"
        " over the scales.",
        lambda s: s.path.reached,
    ),
    Key("estimated", NUMBER, "Error of the path over the scales.", lambda s: s.path.estimated),
)
_PATH_ACCURACY: JsonObject[Paths] = JsonObject(
    Key("requested", NUMBER, "Largest error that was asked for, over the scales."),
    Key("estimated", NUMBER, "Largest estimated error of all paths, over the scales."),
)
PATHS: JsonObject[Paths] = JsonObject(
    Key("name", TEXT, "Name of the scene."),
    Key("from", by_name(NUMBER), "The first end: t and coordinates.", lambda p: _end(p, p.first)),
    Key("to", by_name(NUMBER), "The last end: t and coordinates.", lambda p: _end(p, p.last)),
    Key("action", NUMBER, "Action of the first solution.", lambda p: p.solutions[0].action),
    Key("kind", _KIND, "Kind of the first solution.", lambda p: p.solutions[0].conjugacy.kind),
    Key("t", list_of(NUMBER), "Its sample times.", lambda p: p.solutions[0].trajectory.t),
    Key(
        "path",
        by_name(list_of(NUMBER)),
        "Its samples, by coordinate.",
        lambda p: {name: p.solutions[0].trajectory.columns[name] for name in p.coordinates},
    ),
    Key("accuracy", _PATH_ACCURACY, "What is promised of all paths.", lambda p: p),
    Key("starts", INTEGER, "Number of paths from which the search started, for each end."),
    Key("lost", INTEGER, "Number of candidates that could not be certified."),
    Key("deflated", INTEGER, "Number of paths that were found by deflation of others."),
    Key(
        "scan",
        or_null(_SCAN),
        "Motions over the initial velocity, with one degree of freedom; null with more.",
    ),
    Key(
        "solutions",
        list_of(_SOLUTION),
        "All paths, in the order of their actions.",
        lambda p: [_SolvedPath(p, path) for path in p.solutions],
    ),
)

# Trade-offs.


def _checked(reference: Reference) -> Reference | None:
    return None if reference.checked is None else reference


_CHECK: JsonObject[Reference] = JsonObject(
    Key("method", TEXT, "Its name.", lambda reference: reference.checked),
    Key("difference", NUMBER, "Distance of its run at the end, relative to scales."),
)
_REFERENCE: JsonObject[Reference] = JsonObject(
    Key("method", TEXT, "Its method in words."),
    Key("error", NUMBER, "Its own error relative to scales."),
    Key(
        "checked", or_null(_CHECK), "Another method that confirmed it; null if none did.", _checked
    ),
)
_MEASURED: tuple[Key[WorkPrecisionPoint], ...] = (
    Key(
        "outcome",
        one_of("ok", "given_up", "failed"),
        "How the run ended; given_up: the budget was spent.",
    ),
    Key("reason", REASON, "Why it did not reach the end; null if it did."),
    Key("error", MAYBE_NUMBER, "Largest error relative to scales; null if the run did not end."),
    Key("resolved", BOOLEAN, "True if the error can be told from the reference's own."),
    Key(
        "seconds",
        MAYBE_NUMBER,
        "Median of its wall clock; null if the run did not end.",
        lambda point: point.median,
    ),
    Key(
        "quartiles",
        or_null(list_of(NUMBER, 2)),
        "First and third quartile of the seconds; null if the run did not end.",
        lambda point: point.quartiles if point.seconds else None,
    ),
    Key("timed", INTEGER, "How often it was timed.", lambda point: len(point.seconds)),
    Key("steps", INTEGER, "Number of steps."),
    Key(
        "rhs_evaluations",
        INTEGER,
        "Number of right-hand sides, until then if the run did not end.",
        lambda point: point.evaluations,
    ),
    Key(
        "energy_drift",
        MAYBE_NUMBER,
        "Drift of the energy; null if none is conserved or the run did not end.",
        lambda point: point.drift if point.outcome == "ok" else None,
    ),
)
_RUN: JsonObject[WorkPrecisionPoint] = JsonObject(
    Key("method", TEXT, "Name of the method.", lambda point: point.setting.method),
    Key("rtol", MAYBE_NUMBER, "Its tolerance; null for fixed steps.", lambda p: p.setting.rtol),
    Key("step", MAYBE_NUMBER, "Its step; null for tolerances.", lambda point: point.setting.step),
    *_MEASURED,
    Key("pareto", BOOLEAN, "True if no other run is more accurate in as little time."),
    Key(
        "pareto_rhs_evaluations",
        BOOLEAN,
        "True if no other run is more accurate with as few right-hand sides.",
        lambda point: point.pareto_evaluations,
    ),
)
_FRONT_FACTORS: JsonObject[CostRatios] = JsonObject(
    Key("seconds", MAYBE_NUMBER, "Factor of its seconds; null without such a run."),
    Key(
        "rhs_evaluations",
        MAYBE_NUMBER,
        "Factor of its right-hand sides; null without such a run.",
        lambda ratios: ratios.evaluations,
    ),
)
_NEEDED_FACTORS: JsonObject[CostRatios] = JsonObject(
    Key(
        "seconds",
        MAYBE_NUMBER,
        "Factor of its seconds; null without such a run.",
        lambda ratios: ratios.seconds_needed,
    ),
    Key(
        "rhs_evaluations",
        MAYBE_NUMBER,
        "Factor of its right-hand sides; null without such a run.",
        lambda ratios: ratios.evaluations_needed,
    ),
)
_AUTOMATIC: JsonObject[CostRatios] = JsonObject(
    Key("accuracy", NUMBER, "Accuracy asked for.", lambda ratios: ratios.point.setting.accuracy),
    Key("method", or_null(TEXT), "The method that it took.", lambda ratios: ratios.point.chosen),
    *through(lambda ratios: ratios.point, *_MEASURED),
    Key(
        "times_front",
        _FRONT_FACTORS,
        "Costs beside the cheapest run that is as good as this one turned out.",
        lambda ratios: ratios,
    ),
    Key(
        "times_needed",
        _NEEDED_FACTORS,
        "Costs beside the cheapest run with the accuracy that was asked for.",
        lambda ratios: ratios,
    ),
)


def options_of(setting: Setting) -> str:
    """Write the options by which ``lagrange simulate`` runs the same."""
    if setting.accuracy is not None:
        return f"--accuracy {setting.accuracy:.0e}"
    if setting.rtol is not None:
        return f"--method {setting.method} --rtol {setting.rtol:.0e}"
    return f"--method {setting.method} --step {setting.step!r}"


class _Recommended(NamedTuple):
    """A recommended run, and the number of samples of all runs."""

    recommendation: Recommendation
    samples: int

    @property
    def options(self) -> str:
        setting = self.recommendation.point.setting
        return f"{options_of(setting)} --samples {self.samples}"


_RECOMMENDED: JsonObject[_Recommended] = JsonObject(
    Key("accuracy", NUMBER, "The accuracy.", lambda entry: entry.recommendation.accuracy),
    *through(
        lambda entry: entry.recommendation.point,
        *(key for key in _RUN.keys if key.name in ("method", "rtol", "step")),
        *(key for key in _RUN.keys if key.name in ("error", "seconds", "rhs_evaluations")),
    ),
    Key("options", TEXT, "Options by which lagrange simulate runs the same."),
)
_LEFT_OUT: JsonObject[tuple[str, str]] = JsonObject(
    Key("method", TEXT, "Name of the method.", lambda pair: pair[0]),
    Key("reason", TEXT, "Why it is left out.", lambda pair: pair[1]),
)
TRADE: JsonObject[Trade] = JsonObject(
    Key("name", TEXT, "Name of the scene."),
    Key("until", NUMBER, "Time of the last sample."),
    Key("samples", INTEGER, "Number of samples."),
    Key("formulation", one_of("minimal", "multiplier"), "Form of the equations."),
    Key("implementation", TEXT, "What evaluates the equations."),
    Key("stiff", BOOLEAN, "True if the motion was found to be stiff."),
    Key("repeat", INTEGER, "How often a run was timed at most."),
    Key("budget", NUMBER, "Seconds after which a run was given up."),
    Key("reference", _REFERENCE, "The solution that errors are measured from."),
    Key("runs", list_of(_RUN), "Runs of methods.", lambda trade: trade.points),
    Key("auto", list_of(_AUTOMATIC), "Runs of auto.", lambda trade: trade.automatic),
    Key(
        "recommended",
        list_of(_RECOMMENDED),
        "The run to take for each accuracy that one reaches.",
        lambda trade: [_Recommended(entry, trade.samples) for entry in trade.recommended],
    ),
    Key(
        "left_out",
        list_of(_LEFT_OUT),
        "Methods that cannot run here or are too slow beside others.",
        lambda trade: trade.left_out.items(),
    ),
)

# Extremes.

_POINT: JsonObject[StressRun] = JsonObject(
    Key("axis", TEXT, "Name of the axis.", lambda run: run.point.axis),
    Key("value", NUMBER, "Place on the axis.", lambda run: run.point.value),
    Key(
        "outcome",
        one_of("holds", "degraded", "refused", "wrong"),
        "holds: to the end, as promised; degraded: until a time that is told; refused: nothing is"
        " promised; wrong: the error is larger than was promised.",
    ),
    Key("error", MAYBE_NUMBER, "Distance from the reference; null if there is none."),
    Key("estimated", MAYBE_NUMBER, "The estimate of the error; null if there is none."),
    Key("reason", REASON, "Why it does not hold; null if it does."),
    Key("requested", MAYBE_NUMBER, "The promised accuracy; null if nothing was promised."),
    Key("holds_until", MAYBE_NUMBER, "Time until which the promise holds."),
    Key("reference", REASON, "The reference in words; null if there is none."),
    Key(
        "set",
        by_name(TEXT),
        "Values that -p and -i would set.",
        lambda run: {**run.point.parameters, **run.point.initial},
    ),
    Key(
        "until",
        or_null(TEXT),
        "The end of the motion; null for that of the scene.",
        lambda run: run.point.until,
    ),
)
_COUNTS = counts(
    {
        "runs": "Number of points.",
        "holds": "Points that hold.",
        "degraded": "Points that hold for a part, as is told.",
        "refused": "Points of which nothing is promised.",
        "wrong": "Points whose promise is broken.",
        "unchecked": "Points with nothing to compare with.",
        "underestimated": "Points whose error is as small as promised, but not as estimated.",
    }
)
STRESS: JsonObject[Stress] = JsonObject(
    Key("name", TEXT, "Name of the scene."),
    Key("budget", NUMBER, "Seconds that the run of a point was allowed."),
    Key("points", list_of(_POINT), "The points.", lambda stress: stress.runs),
    Key("left_out", NAMES, "Axes of which the scene has no points."),
    Key("summary", _COUNTS, "Number of points of each outcome.", lambda stress: stress.counts),
)

# A fit.

#: Reasons against a fit, the gravest first.
FIT_KINDS = "undetermined", "not_converged", "contradicted", "ambiguous", "at_bound"

_FITTED_VALUE: JsonObject[FittedValue] = JsonObject(
    Key("name", TEXT, "A parameter, or a coordinate or its dot for its start."),
    Key("value", NUMBER, "The fitted value."),
    Key("error", MAYBE_NUMBER, "Its standard error; null if it is not determined."),
    Key("start", NUMBER, "The value that the fit began with."),
)
_FITTED_COLUMN: JsonObject[FittedColumn] = JsonObject(
    Key("name", TEXT, "Name of the column."),
    Key("measurements", INTEGER, "Number of measurements.", lambda column: len(column.times)),
    Key("rms", NUMBER, "Root mean square of what is left.", lambda column: column.root_mean_square),
    Key(
        "serial_probability",
        MAYBE_NUMBER,
        "Probability that neighbours in white noise are as correlated as the residuals, by Ljung"
        " and Box; null of few residuals, and of mere errors of the motion.",
        lambda column: None if column.serial is None else column.serial.probability,
    ),
)
_FINDING: JsonObject[FitFinding] = JsonObject(
    Key(
        "kind",
        one_of(*FIT_KINDS, "remark"),
        "A status, or remark: no reason against the fit.",
    ),
    Key("text", TEXT, "The reason or remark in words."),
)
_MINIMUM: JsonObject[FitMinimum] = JsonObject(
    Key("values", by_name(NUMBER), "The values there."),
    Key(
        "rms",
        NUMBER,
        "Root mean square of residuals over the ranges of columns.",
        lambda minimum: minimum.root_mean_square,
    ),
    Key("starts", INTEGER, "Number of starts that ended there."),
)
FIT: JsonObject[Fit] = JsonObject(
    Key("name", TEXT, "Name of the scene."),
    Key(
        "status",
        one_of("ok", *FIT_KINDS),
        "Outcome. undetermined: other values near by fit as well; contradicted: the residuals are"
        " no noise, or more than is stated; ambiguous: values elsewhere fit as well; at_bound:"
        " values are at their bounds.",
    ),
    Key("reason", TEXT, "Why the status is not ok; empty if it is."),
    Key("findings", list_of(_FINDING), "All reasons against the fit, and remarks."),
    Key("values", list_of(_FITTED_VALUE), "The fitted values, in the order of --free."),
    Key(
        "correlation",
        list_of(list_of(MAYBE_NUMBER)),
        "Correlations of their errors; null if these are not determined.",
    ),
    Key("columns", list_of(_FITTED_COLUMN), "The measured columns."),
    Key(
        "chi_squared",
        MAYBE_NUMBER,
        "Sum of the squares of residuals over deviations; null unless all deviations are given.",
        lambda fit: fit.chi_squared if fit.given_deviations else None,
    ),
    Key(
        "chi_squared_probability",
        MAYBE_NUMBER,
        "Probability of a larger one if the deviations are as given; null likewise.",
    ),
    Key("degrees_of_freedom", INTEGER, "Number of measurements less that of values."),
    Key("derivatives", TEXT, "Source of derivatives: variational equations or differences."),
    Key("runs", INTEGER, "Number of motions that were simulated."),
    Key("starts", INTEGER, "Number of starts that were tried."),
    Key("minima", list_of(_MINIMUM), "Minima that starts led to, the fitted one first."),
)
