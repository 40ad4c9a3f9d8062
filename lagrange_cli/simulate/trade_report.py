"""A measured trade as JSON, and as text for a terminal with a picture made of characters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any

from lagrange_cli.simulate.reference import Reference
from lagrange_cli.simulate.trade import Behind, Recommendation, Trade
from lagrange_cli.simulate.trade_runs import Point, Setting

__all__ = ["character_plot", "options_of", "summary", "text"]

#: Characters of the picture, and errors above which nothing is drawn.
WIDTH, HEIGHT, LARGEST = 64, 18, 1.0

_ENDS = {"ok": "", "given_up": "given up", "failed": "failed"}

LETTERS = "abcdefghijklmnopqrstuvwxyz"


def options_of(setting: Setting) -> str:
    """What makes ``lagrange simulate`` run the same."""
    if setting.accuracy is not None:
        return f"--accuracy {setting.accuracy:.0e}"
    if setting.rtol is not None:
        return f"--method {setting.method} --rtol {setting.rtol:.0e}"
    return f"--method {setting.method} --step {setting.step!r}"


# JSON.


def summary(trade: Trade) -> dict[str, Any]:
    """What ``lagrange tradeoff --json`` writes."""
    return {
        "name": trade.name,
        "until": trade.until,
        "samples": trade.samples,
        "formulation": trade.formulation,
        "implementation": trade.implementation,
        "stiff": trade.stiff,
        "repeat": trade.repeat,
        "budget": trade.budget,
        "reference": _reference(trade.reference),
        "runs": [_run(point) for point in trade.points],
        "auto": [_automatic(found) for found in trade.automatic],
        "recommended": [_recommended(found, trade.samples) for found in trade.recommended],
        "left_out": [{"method": m, "reason": why} for m, why in trade.left_out.items()],
    }


def _reference(found: Reference) -> dict[str, Any]:
    checked = None
    if found.checked is not None:
        checked = {"method": found.checked, "difference": found.difference}
    return {"method": found.method, "error": found.error, "checked": checked}


def _measured(point: Point) -> dict[str, Any]:
    ok = point.outcome == "ok"
    return {
        "outcome": point.outcome,
        "reason": point.reason or None,
        "error": point.error,
        "resolved": point.resolved,
        "seconds": point.median if point.seconds else None,
        "quartiles": list(point.quartiles) if point.seconds else None,
        "steps": point.steps,
        "rhs_evaluations": point.evaluations,
        "energy_drift": point.drift if ok else None,
    }


def _run(point: Point) -> dict[str, Any]:
    setting = point.setting
    return {
        "method": setting.method,
        "rtol": setting.rtol,
        "step": setting.step,
        **_measured(point),
        "pareto": point.pareto,
        "pareto_rhs_evaluations": point.pareto_evaluations,
    }


def _automatic(found: Behind) -> dict[str, Any]:
    return {
        "accuracy": found.point.setting.accuracy,
        "method": found.point.chosen,
        **_measured(found.point),
        "times_front": {"seconds": found.seconds, "rhs_evaluations": found.evaluations},
        "times_needed": {
            "seconds": found.seconds_needed,
            "rhs_evaluations": found.evaluations_needed,
        },
    }


def _recommended(found: Recommendation, samples: int) -> dict[str, Any]:
    point = found.point
    return {
        "accuracy": found.accuracy,
        "method": point.setting.method,
        "rtol": point.setting.rtol,
        "step": point.setting.step,
        "error": point.error,
        "seconds": point.median,
        "rhs_evaluations": point.evaluations,
        "options": f"{options_of(point.setting)} --samples {samples}",
    }


# Text.


def text(trade: Trade) -> str:
    """The table, the picture and what follows from them, for a person."""
    known = trade.reference
    checked = (
        "" if known.checked is None else f"; {known.checked} differs by {known.difference:.0e}"
    )
    return "\n".join(
        [
            f"{trade.name} until t = {trade.until:.9g}: {len(trade.points)} runs,"
            f" {trade.samples} samples each, timed {trade.repeat} times",
            "",
            f"Reference  {known.method}, error {known.error:.0e}{checked}",
            f"Code       {trade.implementation}",
            "",
            *(_compared(trade) if trade.points else ()),
            *_automatics(trade.automatic),
            *(f"Left out   {reason}" for reason in trade.left_out.values()),
        ]
    )


def _compared(trade: Trade) -> list[str]:
    """What there is to say of runs of methods."""
    return [
        *_table(trade.points),
        "",
        *character_plot(trade.points),
        "",
        *_recommendations(trade),
    ]


def _table(points: Sequence[Point]) -> list[str]:
    head = (
        f"  {'method':<8} {'setting':<14} {'error':>8} {'seconds':>9} {'quartiles':>19}"
        f" {'evaluations':>11} {'drift':>8}  front"
    )
    alike = groupby(points, key=lambda p: (p.setting.method, p.outcome, p.reason))
    rows = [[*map(_row, of)] if key[1] == "ok" else [_without_end([*of])] for key, of in alike]
    return [head, *(row for group in rows for row in group)]


def _start(setting: Setting) -> str:
    given = f"rtol {setting.rtol:.0e}" if setting.rtol is not None else f"step {setting.step:.3g}"
    return f"  {setting.method:<8} {given:<14}"


def _without_end(points: Sequence[Point]) -> str:
    """Runs of one method that did not come to the end for one reason."""
    first = points[0]
    work = sum(point.evaluations for point in points)
    more = "" if len(points) == 1 else f", with {len(points) - 1} finer ones,"
    what = f"{_ENDS[first.outcome]}{more} after {work} evaluations: {first.reason}"
    return f"{_start(first.setting)} {what}"


def _row(point: Point) -> str:
    first, third = point.quartiles
    error = f"{point.error:.1e}" if point.resolved else f"<{point.error:.0e}"
    drift = "-" if point.drift is None else f"{point.drift:.1e}"
    marks = ("", "time", "work", "both")[point.pareto + 2 * point.pareto_evaluations]
    row = (
        f"{_start(point.setting)} {error:>8} {point.median:>9.2e} {first:>9.2e} {third:>9.2e}"
        f" {point.evaluations:>11} {drift:>8}  {marks}"
    )
    return row.rstrip()


def _recommendations(trade: Trade) -> list[str]:
    lines = ["Recommended"]
    for found in trade.recommended:
        point = found.point
        lines.append(
            f"  {found.accuracy:.0e}  {options_of(point.setting):<32} error {point.error:.0e},"
            f" {point.median:.1e} s, {point.evaluations} evaluations"
        )
    return lines if len(lines) > 1 else ["Recommended  nothing: no run is good to 1e-03"]


def _automatics(found: Sequence[Behind]) -> list[str]:
    """What ``--accuracy`` takes, beside runs that are as good, and those that are good enough."""
    if not found:
        return []
    return [
        "Automatic, times the least of runs that are as good, and of those that are good enough",
        f"  {'':<16} {'':<24} {'error':>6} {'evaluations':>11} {'as good':>8} {'enough':>6}"
        f" {'seconds':>8} {'as good':>8} {'enough':>6}",
        *map(_automatic_row, found),
    ]


def _automatic_row(found: Behind) -> str:
    point = found.point
    start = f"  {options_of(point.setting):<16} "
    if point.outcome != "ok":
        return f"{start}{_ENDS[point.outcome]}: {point.reason}"
    return (
        f"{start}{point.chosen:<24} {point.error:>6.0e} {point.evaluations:>11}"
        f" {_times(found.evaluations):>8} {_times(found.evaluations_needed):>6}"
        f" {point.median:>8.1e} {_times(found.seconds):>8} {_times(found.seconds_needed):>6}"
    )


def _times(factor: float | None) -> str:
    """A factor; where no other run is as good there is none."""
    return "-" if factor is None else f"{factor:.2g}"


# The picture.


def character_plot(points: Sequence[Point], width: int = WIDTH, height: int = HEIGHT) -> list[str]:
    """The logarithm of the error over that of the seconds, a letter a method.

    Capitals are on the front; they cover what else falls on their place.
    """
    letters = _letters(points)
    drawn = [
        (math.log10(p.median), math.log10(p.distance), p)
        for p in points
        if p.seconds and 0 < p.distance <= LARGEST
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


def _letters(points: Sequence[Point]) -> dict[str, str]:
    names = dict.fromkeys(p.setting.method for p in points)
    return dict(zip(names, LETTERS, strict=False))


def _with_axis(rows: Sequence[Sequence[str]], low: int, high: int) -> list[str]:
    """Rows with the power of ten that each is nearest to, where there is one."""
    last = len(rows) - 1
    labels = {round((high - y) / (high - low) * last): f"1e{y:+03d}" for y in range(low, high + 1)}
    return [f"{labels.get(k, ''):>6} |{''.join(row)}".rstrip() for k, row in enumerate(rows)]
