"""Report of ``lagrange tradeoff``: a measured trade of speed against accuracy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby

from lagrange_cli.report.contents.numbers import decimal, phrased
from lagrange_cli.report.inlines import Plain, Text, Typed, Written, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import (
    Block,
    Column,
    Document,
    Labelled,
    Paragraph,
    Section,
    Verbatim,
    section,
    sections,
    table_of,
)
from lagrange_cli.report.values.studies import TRADE, options_of
from lagrange_cli.studies.tradeoff.result import CostRatios, Recommendation, Trade
from lagrange_cli.studies.tradeoff.runs import Setting, WorkPrecisionPoint

json_of.register(Trade, TRADE.write)


@contents_of.register
def trade_document(trade: Trade) -> Document:
    """Return runs of methods in a table and a picture, recommendations, and runs of ``auto``."""
    title = say(
        "{name} until t = {until}: {runs} runs, {samples} samples each, short ones timed up to"
        " {repeat} times",
        name=Plain(trade.name),
        until=decimal(trade.until, ".9g"),
        runs=len(trade.points),
        samples=trade.samples,
        repeat=trade.repeat,
    )
    known = Labelled(((say("Reference"), _reference(trade)), (say("Code"), _code(trade))))
    written = sections(
        section("", known),
        *(_compared(trade.points) if trade.points else ()),
        _recommendations(trade.recommended) if trade.points else None,
        _automatics(trade.automatic),
        _left_out(trade),
    )
    return Document(trade.name, "speed against accuracy", title, written)


def _reference(trade: Trade) -> Text:
    known = trade.reference
    method, error = Plain(known.method), decimal(known.error, ".0e")
    if known.checked is None:
        return say("{method}, error {error}", method=method, error=error)
    return say(
        "{method}, error {error}; {other} differs by {difference}",
        method=method,
        error=error,
        other=Plain(known.checked),
        difference=decimal(known.difference, ".0e"),
    )


def _code(trade: Trade) -> Text:
    return Plain(trade.implementation)


def _compared(points: Sequence[WorkPrecisionPoint]) -> Iterator[Section]:
    """Return the table of runs of methods, those that failed, and the picture."""
    ended = [point for point in points if point.outcome == "ok"]
    alike = groupby(
        (p for p in points if p.outcome != "ok"),
        key=lambda p: (p.setting.method, p.outcome, p.reason),
    )
    failed = tuple(_without_end([*group]) for _, group in alike)
    blocks: list[Block] = [table_of(ended, *_RUNS)] if ended else []
    blocks += [Labelled(failed)] if failed else []
    yield Section("", tuple(blocks))
    drawn = tuple(character_plot(points))
    if not drawn:
        yield Section("", (Paragraph(say("no run to draw")),))
        return
    said = say("error over seconds, a letter for each method, a capital on the front of time")
    yield Section("", (Paragraph(said), Verbatim(drawn)))


def _setting(setting: Setting) -> Text:
    if setting.rtol is not None:
        return say("rtol {value}", value=decimal(setting.rtol, ".0e"))
    return say("step {value}", value=decimal(setting.step, ".3g"))


def _without_end(points: Sequence[WorkPrecisionPoint]) -> tuple[Text, Text]:
    """Say why runs of one method did not reach the end, which failed for one reason."""
    first = points[0]
    run = say("{method}, {setting}", method=first.setting.method, setting=_setting(first.setting))
    parts: dict[str, Written | str | int] = {
        "others": len(points) - 1,
        "work": sum(point.evaluations for point in points),
        "reason": phrased(first.reason),
    }
    if first.outcome == "failed" and len(points) == 1:
        return run, say("failed after {work} evaluations: {reason}", **parts)
    if first.outcome == "failed":
        return run, say(
            "failed, with {others} finer ones, after {work} evaluations: {reason}", **parts
        )
    if len(points) == 1:
        return run, say("given up after {work} evaluations: {reason}", **parts)
    return run, say(
        "given up, with {others} finer ones, after {work} evaluations: {reason}", **parts
    )


def _error(point: WorkPrecisionPoint) -> Text:
    if point.resolved:
        return decimal(point.error, ".1e")
    return say("below {error}", error=decimal(point.error, ".0e"))


def _quartiles(point: WorkPrecisionPoint) -> Text:
    first, third = (decimal(seconds, ".1e") for seconds in point.quartiles)
    return say("{first} to {last}", first=first, last=third)


#: Fronts on which a run is.
_FRONTS = ("", say("time"), say("work"), say("both"))

_RUNS: tuple[Column[WorkPrecisionPoint], ...] = (
    Column(say("method"), lambda point: point.setting.method),
    Column(say("setting"), lambda point: _setting(point.setting)),
    Column(say("error"), _error, True),
    Column(say("seconds"), lambda point: decimal(point.median, ".2e"), True),
    Column(say("quartiles"), _quartiles, True),
    Column(say("evaluations"), lambda point: f"{point.evaluations}", True),
    Column(say("drift"), lambda point: decimal(point.drift, ".1e"), True),
    Column(say("front"), lambda p: _FRONTS[p.pareto + 2 * p.pareto_evaluations]),
)

_RECOMMENDED: tuple[Column[Recommendation], ...] = (
    Column(say("accuracy"), lambda entry: decimal(entry.accuracy, ".0e"), True),
    Column(say("options"), lambda entry: Typed(options_of(entry.point.setting))),
    Column(say("error"), lambda entry: decimal(entry.point.error, ".0e"), True),
    Column(say("seconds"), lambda entry: decimal(entry.point.median, ".1e"), True),
    Column(say("evaluations"), lambda entry: f"{entry.point.evaluations}", True),
)


def _recommendations(recommended: Sequence[Recommendation]) -> Section:
    if recommended:
        return Section(say("Recommended"), (table_of(recommended, *_RECOMMENDED),))
    nothing = say("nothing: no run is good to {accuracy}", accuracy=decimal(1e-3, ".0e"))
    return Section("", (Labelled(((say("Recommended"), nothing),)),))


def _automatics(ratios: Sequence[CostRatios]) -> Section | None:
    """Compare the costs of ``--accuracy`` with those of as good, and of good enough runs."""
    if not ratios:
        return None
    ended = [entry for entry in ratios if entry.point.outcome == "ok"]
    failed = tuple(
        (Typed(options_of(entry.point.setting)), _without_end([entry.point])[1])
        for entry in ratios
        if entry.point.outcome != "ok"
    )
    return section(
        say("Automatic"),
        say("costs over the least of runs that are as good, and of those that are good enough"),
        table_of(ended, *_AUTOMATIC) if ended else None,
        Labelled(failed) if failed else None,
    )


#: Options, the method that was chosen, and its costs in units of the front.
_AUTOMATIC: tuple[Column[CostRatios], ...] = (
    Column(say("options"), lambda entry: Typed(options_of(entry.point.setting))),
    Column(say("method"), lambda entry: Plain(entry.point.chosen or "")),
    Column(say("error"), lambda entry: decimal(entry.point.error, ".0e"), True),
    Column(say("seconds"), lambda entry: decimal(entry.point.median, ".1e"), True),
    Column(say("as good"), lambda entry: decimal(entry.seconds, ".2g"), True),
    Column(say("enough"), lambda entry: decimal(entry.seconds_needed, ".2g"), True),
    Column(say("evaluations"), lambda entry: f"{entry.point.evaluations}", True),
    Column(say("as good"), lambda entry: decimal(entry.evaluations, ".2g"), True),
    Column(say("enough"), lambda entry: decimal(entry.evaluations_needed, ".2g"), True),
)


def _left_out(trade: Trade) -> Section | None:
    reasons = dict.fromkeys(trade.left_out.values())
    if not reasons:
        return None
    return Section("", (Labelled(tuple((say("Left out"), phrased(why)) for why in reasons)),))


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
    """Draw the logarithm of the error over that of the seconds; nothing if there is no run.

    Capitals are on the front; they cover other letters at their place.
    """
    letters = _letters(points)
    drawn = [
        (math.log10(p.median), math.log10(p.distance), p)
        for p in points
        if p.seconds and 0 < p.distance <= _LARGEST_ERROR
    ]
    if not drawn:
        return []
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
