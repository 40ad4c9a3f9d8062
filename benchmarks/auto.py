"""What ``auto`` chooses, beside the cheapest runs that are as good, on every scene.

``lagrange tradeoff SCENE`` measures one scene: all methods at many tolerances, and ``auto`` at
four accuracies, each with its true error. This goes through scenes and folders and asks one
question: how many times the right-hand sides, and where runs take longer than 10 ms how many
times the seconds, of the cheapest run with no larger error does the run of ``auto`` take?

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

#: What accuracies the bar is about, and how many times the front's costs it allows.
ACCURACIES, BAR = (1e-3, 1e-6, 1e-9), 2.0

#: Runs that take less than this are compared by their right-hand sides alone.
LONG_ENOUGH = 0.010


def scenes(paths: Sequence[str]) -> Iterator[Path]:
    """Scene files, those of folders in order."""
    for path in map(Path, paths):
        yield from sorted(path.rglob("*.yaml")) if path.is_dir() else [path]


def measured(scene: Path, budget: float, repeat: int) -> dict[str, Any] | str:
    """The report of ``lagrange tradeoff``, or why there is none."""
    program = [sys.executable, "-m", "lagrange_cli", "tradeoff", str(scene), "--json"]
    how = ["--budget", str(budget), "--repeat", str(repeat)]
    done = subprocess.run([*program, *how], capture_output=True, text=True, check=False)
    if not done.stdout:
        return done.stderr.strip().splitlines()[0] if done.stderr.strip() else "no report"
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def rows_of(scene: Path, report: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """One row an accuracy."""
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
                "front": _cheapest(report, run),
            }


def _cheapest(report: dict[str, Any], run: dict[str, Any]) -> str | None:
    """The method that needs the fewest right-hand sides for the same error."""
    if run["error"] is None:
        return None
    good = [r for r in report["runs"] if r["error"] is not None and r["error"] <= run["error"]]
    best = min(good, key=lambda r: r["rhs_evaluations"], default=None)
    return None if best is None else f"{best['method']} {best['rtol'] or best['step']:.0e}"


def beyond(row: dict[str, Any]) -> float:
    """How many times the front's cost a run of ``auto`` takes, by what counts."""
    times = [row["times_rhs_evaluations"]]
    if row["seconds"] is not None and row["seconds"] > LONG_ENOUGH:
        times.append(row["times_seconds"])
    return max((t for t in times if t is not None), default=0.0)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown: the runs that take the most, first."""
    lines = [
        "| scene | accuracy | auto | error | right-hand sides | times the front's |"
        " seconds | times the front's | fewest right-hand sides by |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in sorted(rows, key=beyond, reverse=True):
        times = [
            "–" if row[name] is None else f"{row[name]:.2f}"
            for name in ("times_rhs_evaluations", "times_seconds")
        ]
        lines.append(
            f"| {row['scene']} | {row['accuracy']:.0e} | {row['method']} | {row['error']:.1e} |"
            f" {row['rhs_evaluations']} | {times[0]} | {row['seconds']:.2g} | {times[1]} |"
            f" {row['front'] or '–'} |"
        )
    return "\n".join(lines)


def fronts(reports: Sequence[dict[str, Any]]) -> str:
    """Markdown: on the fronts of how many scenes, by seconds, each method is."""
    methods = Counter(
        method
        for report in reports
        for method in {run["method"] for run in report["runs"] if run["pareto"]}
    )
    lines = ["| method | on the fronts of scenes |", "|---|---|"]
    lines += [f"| {method} | {count} |" for method, count in methods.most_common()]
    return "\n".join(lines)


def summary(rows: Sequence[dict[str, Any]], left_out: int) -> str:
    """How many runs are within the bar."""
    kept = [row for row in rows if row["error"] is not None]
    costs = [beyond(row) for row in kept]
    inside = sum(cost <= BAR for cost in costs)
    return (
        f"{len(rows)} runs: {len(kept)} kept their accuracy, of these {inside} within a factor"
        f" {BAR:g} of the front (median {statistics.median(costs):.2f}, largest"
        f" {max(costs):.2f}); scenes without a reference or not simulated: {left_out}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", metavar="PATH")
    parser.add_argument("--budget", type=float, default=0.5, help="seconds of a run")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    left_out: dict[str, str] = {}
    reports: list[dict[str, Any]] = []
    for scene in scenes(options.paths):
        report = measured(scene, options.budget, options.repeat)
        if isinstance(report, str):
            left_out[scene.stem] = report
        else:
            rows += rows_of(scene, report)
            reports.append(report)
        print(f"{scene.stem}: {left_out.get(scene.stem, 'done')}", file=sys.stderr, flush=True)
    print(table([row for row in rows if row["error"] is not None]))
    print(f"\n{summary(rows, len(left_out))}\n\n{fronts(reports)}")
    if options.json:
        Path(options.json).write_text(
            json.dumps({"rows": rows, "left_out": left_out}, indent=1), encoding="utf-8"
        )
    return 0 if all(beyond(row) <= BAR for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
