"""What a calibration showed, as lines and as a page of the documentation."""

from __future__ import annotations

import math
import platform
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

__all__ = ["Row", "below", "line", "page", "ratio", "summary", "wrong"]

#: Errors of the estimate's own size: one rounding of a sample.
ROUNDING = 2.0**-53

#: How many times a run its estimation may cost.
MOST = 4.0


@dataclass(frozen=True)
class Row:
    """One simulation, judged.

    ``error`` and ``estimate`` are over the scales, None where it was refused; ``held`` is the last
    time that is kept of ``until``.
    """

    scene: str
    formulation: str
    accuracy: float
    status: str
    until: float
    held: float
    error: float | None
    estimate: float | None
    method: str
    evaluations: int
    all_evaluations: int
    reason: str = ""

    @property
    def overhead(self) -> float:
        """What estimating the error cost, in times the run."""
        return (self.all_evaluations - self.evaluations) / max(self.evaluations, 1)


def wrong(row: Row) -> bool:
    """Whether what is kept misses the accuracy."""
    return row.error is not None and not row.error <= row.accuracy


def below(row: Row) -> bool:
    """Whether the estimate is smaller than the error."""
    return row.error is not None and not row.error <= max(row.estimate or 0.0, ROUNDING)


def ratio(row: Row) -> float | None:
    """Estimate over error, None where one of them is nothing."""
    return row.estimate / row.error if row.error and row.estimate else None


def line(row: Row) -> str:
    """A row for a terminal."""
    head = f"{row.scene}, {row.formulation}, {row.accuracy:.0e}:"
    if row.error is None:
        return f"{head} refused: {row.reason}"
    kept = "" if row.status == "ok" else f" {row.status} at {row.held:.6g} of {row.until:.6g},"
    mark = " WRONG" if wrong(row) else " BELOW" if below(row) else ""
    figures = f"error {row.error:.1e}, estimated {row.estimate:.1e}, {row.method}"
    return f"{head}{kept} {figures}, overhead {row.overhead:.1f}{mark}"


def summary(rows: Sequence[Row]) -> list[str]:
    """The counts and what is typical, one line each."""
    judged = [row for row in rows if row.error is not None]
    right = [row for row in judged if not wrong(row)]
    to_the_end = [row for row in right if row.status == "ok"]
    ratios = [found for found in map(ratio, judged) if found is not None]
    quartiles = np.quantile(ratios, [0.25, 0.5, 0.75]) if ratios else [math.nan] * 3
    true = 100 * sum(not below(row) for row in judged) / max(len(judged), 1)
    far = 100 * sum(r <= 100 for r in ratios) / max(len(ratios), 1)
    costs = [row.overhead for row in to_the_end] or [math.nan]
    many = sum(cost > MOST for cost in costs)
    return [
        f"{len(rows)} runs, {len(to_the_end)} right to the end,"
        f" {len(right) - len(to_the_end)} right as far as they are kept,"
        f" {len(rows) - len(judged)} refused, {sum(map(wrong, rows))} silently wrong",
        f"estimate not below the error in {true:.2f} % of {len(judged)} runs;"
        f" estimate over error: median {quartiles[1]:.2g},"
        f" quartiles {quartiles[0]:.2g} and {quartiles[2]:.2g}, at most 100 in {far:.0f} %",
        f"estimating cost {np.median(costs):.2g} times the run (median of those kept to the end;"
        f" 90 % below {np.quantile(costs, 0.9):.2g}, most {max(costs):.2g}), more than"
        f" {MOST:g} in {many}",
    ]


_PAGE = """\
# How true the promise is

Every scene of `systems/` that has an initial state and an end (but those that are shown to be
refused) is simulated at four accuracies, in each formulation that it has, and compared with a
reference. This page is the output of

    python benchmarks/calibration.py --docs docs/quality/calibration.md

{summary}

Measured on {machine}.

The references (`tests/references`, made by `python benchmarks/calibration.py --references`) are
motions in numbers of 113 binary digits by the extrapolated modified midpoint rule: the equations
are the same, arithmetic, method and the search for events are others. Each was made with two
tolerances and says how far these are apart, {worst:.0e} of the scales at most. The initial
state and the parameters are what the scenes write, to 40 digits.

The error is the largest of any coordinate or velocity at {samples} or more samples of a run (fewer
of large systems), over the [scales](../accuracy.md#scales) of the promise; among these are, of each
number, the one where it changes fastest. With contacts, times of events count over the whole time.

Cells hold the true error and, behind the slash, the estimate. `to t` is how long the accuracy
could be kept: what is kept is judged. `*` marks runs in wider arithmetic than doubles, `°` those
by an implicit method.

| scene | | {heads} |
|---|---|{rules}|
{rows}
"""


def page(rows: Sequence[Row], worst: float, samples: int) -> str:
    """The page of the documentation."""
    accuracies = sorted({row.accuracy for row in rows}, reverse=True)
    groups: dict[tuple[str, str], dict[float, Row]] = {}
    for row in rows:
        groups.setdefault((row.scene, row.formulation), {})[row.accuracy] = row
    lines = [
        f"| {scene} | {formulation} | {' | '.join(_cell(of[x]) for x in accuracies)} |"
        for (scene, formulation), of in groups.items()
    ]
    return _PAGE.format(
        summary="\n".join(f"- {text}" for text in summary(rows)),
        machine=machine(),
        worst=worst,
        samples=samples,
        heads=" | ".join(f"{x:.0e}" for x in accuracies),
        rules="|".join("---" for _ in accuracies),
        rows="\n".join(lines),
    )


def _cell(row: Row) -> str:
    if row.error is None:
        return "refused"
    mark = (
        "*"
        if row.method.endswith(("long double", "quadruple"))
        else "°"
        if row.method == "Radau"
        else ""
    )
    kept = "" if row.status == "ok" else f"to t = {row.held:.4g}: "
    bad = "**" if wrong(row) or below(row) else ""
    return f"{kept}{bad}{row.error:.1e}{bad} / {row.estimate:.1e}{mark}"


def machine() -> str:
    """The machine and what computed on it, in words."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        text = ""
    model = re.search(r"^model name\s*:\s*(.*)$", text, re.MULTILINE)
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=False)
    name = model[1].strip() if model else "a processor without a name"
    first = compiler.stdout.splitlines()[:1] or ["no C compiler"]
    return f"{platform.machine()}, {name}; {first[0]}; NumPy {np.__version__}"
