"""Report of ``lagrange fit``: fitted values with their standard errors."""

from __future__ import annotations

import math
from typing import TypeGuard

from lagrange_cli.report.contents.numbers import decimal, digits, phrased
from lagrange_cli.report.inlines import Inline, Listed, Plain, Text, say, square, symbol
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import Column, Document, Labelled, Section, table_of
from lagrange_cli.report.values.studies import FIT
from lagrange_cli.studies.fit.result import Fit, FittedColumn, FittedValue

json_of.register(Fit, FIT.write)


@contents_of.register
def fit_document(fit: Fit) -> Document:
    """Return fitted values with their errors, and what is left of each column."""
    title = say.counted(
        len(fit.values),
        "{name}: {count} fitted value",
        "{name}: {count} fitted values",
        name=Plain(fit.name),
    )
    blocks = table_of(fit.values, *_VALUES), table_of(fit.columns, *_COLUMNS), Labelled(_known(fit))
    return Document(fit.name, "a fit", title, tuple(Section("", (block,)) for block in blocks))


_VALUES: tuple[Column[FittedValue], ...] = (
    Column(say("name"), lambda value: Plain(value.name)),
    Column(say("value"), lambda value: digits(_rounded(value)), True),
    Column(
        say("error"),
        lambda value: decimal(value.error, ".2g") if _is_known(value.error) else "-",
        True,
    ),
    Column(say("start"), lambda value: decimal(value.start, ".6g"), True),
)
_COLUMNS: tuple[Column[FittedColumn], ...] = (
    Column(say("column"), lambda column: Plain(column.name)),
    Column(say("measurements"), lambda column: f"{len(column.times)}", True),
    Column(say("root mean square"), lambda column: decimal(column.root_mean_square, ".3g"), True),
    Column(
        say("p (Ljung–Box)"),
        lambda column: "-" if column.serial is None else decimal(column.serial.probability, ".2g"),
        True,
    ),
)

#: Kind of a finding → its words.
_KINDS = {
    "undetermined": say("undetermined"),
    "not_converged": say("not converged"),
    "contradicted": say("contradicted"),
    "ambiguous": say("ambiguous"),
    "at_bound": say("at a bound"),
    "remark": say("remark"),
}

#: Source of derivatives → its words.
_DERIVATIVES = {
    "variational equations": say("variational equations"),
    "differences": say("differences"),
}


def _known(fit: Fit) -> tuple[tuple[Text, Text], ...]:
    """Return what else is known of a fit, and what is not."""
    rows: list[tuple[Text, Text]] = []
    rows += ((_KINDS[finding.kind], phrased(finding.text)) for finding in fit.findings)
    if fit.chi_squared_probability is not None:
        rows.append(
            (
                Inline(square(symbol("chi"))),
                say.counted(
                    fit.degrees_of_freedom,
                    "{value} at {count} degree of freedom, p = {probability}",
                    "{value} at {count} degrees of freedom, p = {probability}",
                    value=decimal(fit.chi_squared, ".4g"),
                    probability=decimal(fit.chi_squared_probability, ".2g"),
                ),
            )
        )
    close = [
        say(
            "{first} and {second} {value}",
            first=Plain(a.name),
            second=Plain(b.name),
            value=decimal(fit.correlation[j][k], "+.2f"),
        )
        for j, a in enumerate(fit.values)
        for k, b in enumerate(fit.values)
        if j < k and abs(fit.correlation[j][k]) > _CORRELATED
    ]
    if close:
        rows.append((say("correlated"), Listed(tuple(close))))
    by = _DERIVATIVES[fit.derivatives]
    if fit.starts > 1:
        ended = fit.minima[0].starts
        rows.append(
            (
                say("starts"),
                say("{count}, {ended} of them to these values", count=fit.starts, ended=ended),
            )
        )
    rows.append((say("runs"), say("{count}, derivatives by {by}", count=fit.runs, by=by)))
    return tuple(rows)


#: Correlations that are told in the text.
_CORRELATED = 0.9

#: Decimal places of a value that is written without a power of ten.
_MOST_PLACES = 8


def _is_known(error: float | None) -> TypeGuard[float]:
    return error is not None and 0 < error < math.inf


def _rounded(value: FittedValue) -> str:
    """Write a value to two digits of its error."""
    if not _is_known(value.error):
        return f"{value.value:.6g}"
    places = 1 - math.floor(math.log10(value.error))
    if 0 <= places <= _MOST_PLACES:
        return f"{value.value:.{places}f}"
    digits = places + 1 + math.floor(math.log10(abs(value.value) or value.error))
    return f"{value.value:.{max(2, min(digits, 17))}g}"
