"""How long `auto` takes beside the fastest runs that are as good, on every scene.

``lagrange tradeoff SCENE`` measures one scene: methods at many tolerances, and ``auto`` at four
accuracies, each with its true error. This goes through scenes and folders and asks one question:
how many times the seconds of the fastest run with no larger error does the run of ``auto`` take,
where it takes more than 0.2 ms? Right-hand sides stand beside the seconds, to explain them.

    python benchmarks/auto.py systems --json auto.json
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from reporting import scene_files

#: Accuracies that the bar is about.
ACCURACIES = (1e-3, 1e-6, 1e-9)

#: Largest multiple of the front's seconds that is within the bar.
BAR = 2.0

#: Errors below this are as good as none.
FINE_ENOUGH = 1e-13

#: Seconds of runs that are too short to be compared.
SHORT = 0.2e-3


def measured(scene: Path, budget: float, repeat: int) -> dict[str, Any] | str:
    """Return the report of ``lagrange tradeoff``, or why there is none."""
    program = [sys.executable, "-m", "lagrange_cli", "tradeoff", str(scene), "--json"]
    limits = ["--budget", str(budget), "--repeat", str(repeat)]
    done = subprocess.run([*program, *limits], capture_output=True, text=True, check=False)
    if not done.stdout:
        return done.stderr.strip().splitlines()[0] if done.stderr.strip() else "no report"
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def rows_of(scene: Path, report: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield one row for each accuracy."""
    for run in report["auto"]:
        if run["accuracy"] in ACCURACIES:
            yield {
                "scene": scene.stem,
                "accuracy": run["accuracy"],
                "method": run["method"],
                "outcome": run["outcome"] if run["error"] is not None else run["reason"],
                "error": run["error"],
                "rhs_evaluations": run["rhs_evaluations"],
                "seconds": run["seconds"],
                **{f"times_{k}": v for k, v in run["times_front"].items()},
                "front": _fastest(report, run),
            }


def _fastest(report: dict[str, Any], run: dict[str, Any]) -> str | None:
    """Return the method and setting that is the fastest with the same error."""
    if run["error"] is None:
        return None
    most = max(run["error"], FINE_ENOUGH)
    good = [r for r in report["runs"] if r["error"] is not None and r["error"] <= most]
    best = min(good, key=lambda r: r["seconds"], default=None)
    return None if best is None else f"{best['method']} {best['rtol'] or best['step']:.0e}"


def counts(row: dict[str, Any]) -> bool:
    """Tell if a run is long enough to be compared, and has something to be compared with."""
    return row["times_seconds"] is not None and row["seconds"] > SHORT


def misses(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Write the runs that are beyond the bar as Markdown, the worst first."""
    lines = [
        "| scene | accuracy | auto | error | seconds | times the front's | right-hand sides |"
        " times the front's | fastest |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    beyond = [row for row in rows if counts(row) and row["times_seconds"] > BAR]
    for row in sorted(beyond, key=lambda r: -float(r["times_seconds"])):
        lines.append(
            f"| {row['scene']} | {row['accuracy']:.0e} | {row['method']} | {row['error']:.1e} |"
            f" {row['seconds']:.1e} | {row['times_seconds']:.2f} | {row['rhs_evaluations']} |"
            f" {row['times_rhs_evaluations']:.2f} | {row['front']} |"
        )
    return lines


def summary(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Write how far runs are behind the front as Markdown, one line for each accuracy."""
    lines = [
        "| accuracy | runs | kept | over 0.2 ms | within 2 | median | nine of ten | largest |"
        " right-hand sides, median |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for accuracy in ACCURACIES:
        asked = [row for row in rows if row["accuracy"] == accuracy]
        kept = [row for row in asked if row["error"] is not None]
        long = [row for row in kept if counts(row)]
        times = sorted(row["times_seconds"] for row in long) or [0.0]
        work = statistics.median([row["times_rhs_evaluations"] for row in long] or [0.0])
        lines.append(
            f"| {accuracy:.0e} | {len(asked)} | {len(kept)} | {len(long)} |"
            f" {sum(t <= BAR for t in times)} | {statistics.median(times):.2f} |"
            f" {times[9 * len(times) // 10]:.2f} | {times[-1]:.2f} | {work:.2f} |"
        )
    return lines


def fronts(reports: Sequence[dict[str, Any]]) -> list[str]:
    """Write on the fronts of how many scenes, by seconds, each method is, as Markdown."""
    on_fronts = Counter(
        method
        for report in reports
        for method in {run["method"] for run in report["runs"] if run["pareto"]}
    )
    lines = ["| method | on the fronts of scenes |", "|---|---|"]
    return lines + [f"| {method} | {count} |" for method, count in on_fronts.most_common()]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", metavar="PATH")
    parser.add_argument("--budget", type=float, default=0.1, help="seconds of a run")
    parser.add_argument("--repeat", type=int, default=20)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    left_out: dict[str, str] = {}
    reports: list[dict[str, Any]] = []
    for scene in scene_files(options.paths):
        report = measured(scene, options.budget, options.repeat)
        if isinstance(report, str):
            left_out[scene.stem] = report
        else:
            rows += rows_of(scene, report)
            reports.append(report)
        print(f"{scene.stem}: {left_out.get(scene.stem, 'done')}", file=sys.stderr, flush=True)
    print(*misses(rows), "", *summary(rows), "", *fronts(reports), sep="\n")
    print(f"\nscenes without a reference or not simulated: {len(left_out)}")
    if options.json:
        Path(options.json).write_text(
            json.dumps({"rows": rows, "left_out": left_out}, indent=1), encoding="utf-8"
        )
    return 0 if all(row["times_seconds"] <= BAR for row in rows if counts(row)) else 1


if __name__ == "__main__":
    sys.exit(main())
