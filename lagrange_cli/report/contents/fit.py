"""Report of ``lagrange fit``: fitted values with their standard errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Page, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, table
from lagrange_cli.report.values.json_types import (
    INTEGER,
    MAYBE_NUMBER,
    NUMBER,
    TEXT,
    JsonObject,
    Key,
    list_of,
    one_of,
)

if TYPE_CHECKING:
    from lagrange_cli.studies.fit.result import Fit, FittedColumn, FittedValue

_VALUES = (
    TableColumn("name"),
    TableColumn("value", align=">"),
    TableColumn("error", align=">"),
    TableColumn("start", align=">"),
)
_COLUMNS = (
    TableColumn("column"),
    TableColumn("measurements", align=">"),
    TableColumn("root mean square", align=">"),
)


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
)
FIT: JsonObject[Fit] = JsonObject(
    Key("name", TEXT, "Name of the scene."),
    Key(
        "status",
        one_of("ok", "undetermined", "not_converged"),
        "Outcome; undetermined: other values fit as well.",
    ),
    Key("reason", TEXT, "Why the status is not ok; empty if it is."),
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
    Key("degrees_of_freedom", INTEGER, "Number of measurements less that of values."),
    Key("derivatives", TEXT, "Source of derivatives: variational equations or differences."),
    Key("runs", INTEGER, "Number of motions that were simulated."),
)


def _text(fit: Fit) -> Page:
    rows = table(_VALUES, [[v.name, *_rounded(v), f"{v.start:.6g}"] for v in fit.values])
    columns = [[c.name, f"{len(c.times)}", f"{c.root_mean_square:.3g}"] for c in fit.columns]
    return page([rows, table(_COLUMNS, columns), labelled(*_remarks(fit))])


def _remarks(fit: Fit) -> Iterator[tuple[str, str]]:
    if fit.reason:
        yield fit.status.replace("_", " "), fit.reason
    if fit.given_deviations:
        yield "χ²", f"{fit.chi_squared:.4g} at {fit.degrees_of_freedom} degrees of freedom"
    close = [
        f"{a.name} and {b.name} {fit.correlation[j][k]:+.2f}"
        for j, a in enumerate(fit.values)
        for k, b in enumerate(fit.values)
        if j < k and abs(fit.correlation[j][k]) > _CORRELATED
    ]
    if close:
        yield "correlated", ", ".join(close)
    yield "runs", f"{fit.runs}, derivatives by {fit.derivatives}"


#: Correlations that are told in the text.
_CORRELATED = 0.9

#: Decimal places of a value that is written without a power of ten.
_MOST_PLACES = 8


def _rounded(value: FittedValue) -> tuple[str, str]:
    """Write a value to two digits of its error, and the error."""
    if value.error is None or not 0 < value.error < math.inf:
        return f"{value.value:.6g}", "-"
    places = 1 - math.floor(math.log10(value.error))
    if 0 <= places <= _MOST_PLACES:
        return f"{value.value:.{places}f}", f"{value.error:.2g}"
    digits = places + 1 + math.floor(math.log10(abs(value.value) or value.error))
    return f"{value.value:.{max(2, min(digits, 17))}g}", f"{value.error:.2g}"


FORMATS: Mapping[str, Callable[[Fit], str | Page]] = {
    "text": _text,
    "json": lambda fit: json_text(FIT.write(fit)),
}
