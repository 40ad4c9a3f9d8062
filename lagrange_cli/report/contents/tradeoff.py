"""Report of ``lagrange tradeoff``: a measured trade of speed against accuracy."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Page, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table
from lagrange_cli.report.values.studies import TRADE, options_of

if TYPE_CHECKING:
    from lagrange_cli.studies.tradeoff.result import CostRatios, Trade
    from lagrange_cli.studies.tradeoff.runs import Setting, WorkPrecisionPoint

#: Outcome of a run → its words in tables.
_ENDS = {"ok": "", "given_up": "given up", "failed": "failed"}

_RUNS = (
    TableColumn("method", 8),
    TableColumn("setting", 14, before=" "),
    TableColumn("error", 8, ">", " "),
    TableColumn("seconds", 9, ">", " "),
    TableColumn("quartiles", 19, ">", " "),
    TableColumn("evaluations", 11, ">", " "),
    TableColumn("drift", 8, ">", " "),
    TableColumn("front"),
)

#: Options, the method that was chosen, and its costs in units of the front.
_AUTOMATIC = (
    TableColumn("", 16),
    TableColumn("", 24, before=" "),
    TableColumn("error", 6, ">", " "),
    TableColumn("seconds", 8, ">", " "),
    TableColumn("as good", 8, ">", " "),
    TableColumn("enough", 6, ">", " "),
    TableColumn("evaluations", 11, ">", " "),
    TableColumn("as good", 8, ">", " "),
    TableColumn("enough", 6, ">", " "),
)

_RECOMMENDED = (TableColumn("", 5), TableColumn("", 32), TableColumn(before=" "))


def tradeoff_text(trade: Trade) -> Page:
    """Write the table, the picture and the recommendations, for a person."""
    known = trade.reference
    checked = (
        "" if known.checked is None else f"; {known.checked} differs by {known.difference:.0e}"
    )
    title = (
        f"{trade.name} until t = {trade.until:.9g}: {len(trade.points)} runs,"
        f" {trade.samples} samples each, short ones timed up to {trade.repeat} times"
    )
    reference = f"{known.method}, error {known.error:.0e}{checked}"
    left_out = labelled(
        *(("Left out", reason) for reason in dict.fromkeys(trade.left_out.values()))
    )
    last = [*_automatics(trade.automatic), *left_out]
    return page(
        [
            [sentence_row(title, "heading")],
            labelled(("Reference", reference), ("Code", trade.implementation)),
            *(_compared(trade) if trade.points else ()),
            [*(_recommendations(trade) if trade.points else ()), *last],
        ]
    )


def _compared(trade: Trade) -> list[list[Row]]:
    """Write the table and the picture of runs of methods."""
    return [_table(trade.points), [Row("", line) for line in character_plot(trade.points)]]


def _table(points: Sequence[WorkPrecisionPoint]) -> list[Row]:
    alike = groupby(points, key=lambda p: (p.setting.method, p.outcome, p.reason))
    rows: list[list[str]] = []
    for (_, outcome, _), group in alike:
        rows += map(_row, group) if outcome == "ok" else [_without_end([*group])]
    return table(_RUNS, rows)


def _start(setting: Setting) -> list[str]:
    value = f"rtol {setting.rtol:.0e}" if setting.rtol is not None else f"step {setting.step:.3g}"
    return [setting.method, value]


def _without_end(points: Sequence[WorkPrecisionPoint]) -> list[str]:
    """Write runs of one method that did not reach the end for one reason as one row."""
    first = points[0]
    work = sum(point.evaluations for point in points)
    more = "" if len(points) == 1 else f", with {len(points) - 1} finer ones,"
    what = f"{_ENDS[first.outcome]}{more} after {work} evaluations: {first.reason}"
    return [*_start(first.setting), what]


def _row(point: WorkPrecisionPoint) -> list[str]:
    first, third = point.quartiles
    return [
        *_start(point.setting),
        f"{point.error:.1e}" if point.resolved else f"<{point.error:.0e}",
        f"{point.median:.2e}",
        f"{first:>9.2e} {third:>9.2e}",
        f"{point.evaluations}",
        "-" if point.drift is None else f"{point.drift:.1e}",
        ("", "time", "work", "both")[point.pareto + 2 * point.pareto_evaluations],
    ]


def _recommendations(trade: Trade) -> list[Row]:
    if not trade.recommended:
        return labelled(("Recommended", "nothing: no run is good to 1e-03"))
    rows = [
        [
            f"{entry.accuracy:.0e}",
            options_of(entry.point.setting),
            f"error {entry.point.error:.0e}, {entry.point.median:.1e} s,"
            f" {entry.point.evaluations} evaluations",
        ]
        for entry in trade.recommended
    ]
    return [Row("Recommended", role="heading"), *table(_RECOMMENDED, rows, heading=False)]


def _automatics(ratios: Sequence[CostRatios]) -> list[Row]:
    """Compare the costs of ``--accuracy`` with those of as good, and of good enough runs."""
    if not ratios:
        return []
    return [
        sentence_row(
            "Automatic, times the least of runs that are as good, and of those that are"
            " good enough",
            "heading",
        ),
        *table(_AUTOMATIC, list(map(_automatic_row, ratios))),
    ]


def _automatic_row(ratios: CostRatios) -> list[str]:
    point = ratios.point
    start = options_of(point.setting)
    if point.outcome != "ok":
        return [start, f"{_ENDS[point.outcome]}: {point.reason}"]
    return [
        start,
        point.chosen or "",
        f"{point.error:.0e}",
        f"{point.median:.1e}",
        _times(ratios.seconds),
        _times(ratios.seconds_needed),
        f"{point.evaluations}",
        _times(ratios.evaluations),
        _times(ratios.evaluations_needed),
    ]


def _times(factor: float | None) -> str:
    """Write a factor; it is None if no other run is as good."""
    return "-" if factor is None else f"{factor:.2g}"


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[Trade], str | Page]] = {
    "text": tradeoff_text,
    "json": lambda trade: json_text(TRADE.write(trade)),
}


#: Characters of a row of the picture.
_WIDTH = 64

#: Rows of the picture.
_HEIGHT = 18

#: Largest error that is drawn, relative to scales.
_LARGEST_ERROR = 1.0

_LETTERS = "abcdefghijklmnopqrstuvwxyz"


def character_plot(
    points: Sequence[WorkPrecisionPoint], width: int = _WIDTH, height: int = _HEIGHT
) -> list[str]:
    """Draw the logarithm of the error over that of the seconds, a letter for each method.

    Capitals are on the front; they cover other letters at their place.
    """
    letters = _letters(points)
    drawn = [
        (math.log10(p.median), math.log10(p.distance), p)
        for p in points
        if p.seconds and 0 < p.distance <= _LARGEST_ERROR
    ]
    if not drawn:
        return ["no run to draw"]
    low, high = math.floor(min(y for _, y, _ in drawn)), math.ceil(max(y for _, y, _ in drawn))
    left, right = math.floor(min(x for x, _, _ in drawn)), math.ceil(max(x for x, _, _ in drawn))
    low, left = min(low, high - 1), min(left, right - 1)
    rows = [[" "] * width for _ in range(height)]
    for x, y, point in sorted(drawn, key=lambda d: d[2].pareto):
        column = round((x - left) / (right - left) * (width - 1))
        row = round((high - y) / (high - low) * (height - 1))
        letter = letters[point.setting.method]
        rows[row][column] = letter.upper() if point.pareto else letter
    return [
        "error",
        *_with_axis(rows, low, high),
        f"{'':7}+{'-' * width}",
        f"{'':7}{f'1e{left:+03d}':<{width - 6}}{f'1e{right:+03d} s':>7}",
        "  " + "  ".join(f"{letter} {name}" for name, letter in letters.items()),
    ]


def _letters(points: Sequence[WorkPrecisionPoint]) -> dict[str, str]:
    names = dict.fromkeys(p.setting.method for p in points)
    return dict(zip(names, _LETTERS, strict=False))


def _with_axis(rows: Sequence[Sequence[str]], low: int, high: int) -> list[str]:
    """Write each power of ten before the row that is nearest to it."""
    last = len(rows) - 1
    labels = {round((high - y) / (high - low) * last): f"1e{y:+03d}" for y in range(low, high + 1)}
    return [f"{labels.get(k, ''):>6} |{''.join(row)}".rstrip() for k, row in enumerate(rows)]
