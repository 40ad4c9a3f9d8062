"""Report of ``lagrange fit``: fitted values with their standard errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from lagrange_cli.notation.page import Page, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, table

if TYPE_CHECKING:
    from lagrange_cli.studies.fit.result import Fit, FittedValue

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


def fit_summary(fit: Fit) -> dict[str, Any]:
    """Return what ``lagrange fit --json`` writes."""
    return {
        "name": fit.name,
        "status": fit.status,
        "reason": fit.reason,
        "values": [
            {"name": v.name, "value": v.value, "error": v.error, "start": v.start}
            for v in fit.values
        ],
        "correlation": fit.correlation.tolist(),
        "columns": [
            {"name": c.name, "measurements": len(c.times), "rms": c.root_mean_square}
            for c in fit.columns
        ],
        "chi_squared": fit.chi_squared if fit.given_deviations else None,
        "degrees_of_freedom": fit.degrees_of_freedom,
        "derivatives": fit.derivatives,
        "runs": fit.runs,
    }


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
    "json": lambda fit: json_text(fit_summary(fit)),
}
