"""What the promise of an accuracy costs in seconds, beside the run that is returned.

Every scene that can be simulated is integrated from Python at three accuracies, compiled and warm:
the median of some repetitions of everything between the call and the trajectory, and of the
returned run alone. The whole is counted in seconds of the processor, so that other processes on the
machine count less.

    python benchmarks/promise.py systems --json promise.json
"""

from __future__ import annotations

import argparse
import gc
import json
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from reporting import scene_files

from lagrange_cli import Derivation, LagrangeError, load

ACCURACIES = (1e-3, 1e-6, 1e-9)

#: Whole simulations that take less than this, in seconds, are outside the bar.
LONG_ENOUGH = 1e-3

#: Seconds after which a scene at one accuracy is not repeated.
PATIENCE = 2.0


@dataclass(frozen=True)
class Cost:
    """Cost of one scene at one accuracy.

    Attributes
    ----------
    scene
        Name of the file.
    accuracy
        What was asked for.
    whole, run
        Median seconds of everything, and of the run that is returned.
    estimate
        Estimated error.
    method, status
        As the trajectory says.
    """

    scene: str
    accuracy: float
    whole: float
    run: float
    estimate: float
    method: str
    status: str

    @property
    def ratio(self) -> float:
        """How many times the run the whole takes."""
        return self.whole / self.run


def cost(derivation: Derivation, name: str, accuracy: float, repeat: int) -> Cost:
    """Measure one scene at one accuracy; the first simulation is not counted."""
    trajectory = derivation.simulate(accuracy=accuracy)
    whole: list[float] = []
    runs: list[float] = []
    gc.collect()
    gc.disable()
    try:
        while len(whole) < repeat and sum(whole) < PATIENCE:
            started = time.process_time()
            trajectory = derivation.simulate(accuracy=accuracy)
            whole.append(time.process_time() - started)
            runs.append(trajectory.seconds["integrate"])
    finally:
        gc.enable()
    return Cost(
        name,
        accuracy,
        statistics.median(whole),
        statistics.median(runs),
        trajectory.estimated or 0.0,
        trajectory.method,
        trajectory.status,
    )


def costs(paths: Sequence[str], repeat: int) -> Iterator[Cost]:
    """Measure all scenes; those that cannot be simulated are named on the error stream."""
    for path in scene_files(paths):
        try:
            derivation = load(path).derive()
            for accuracy in ACCURACIES:
                yield cost(derivation, path.stem, accuracy, repeat)
        except LagrangeError as error:
            print(f"{path.stem}: {str(error).splitlines()[0]}", file=sys.stderr, flush=True)


def table(rows: Sequence[Cost]) -> str:
    """Markdown: quartiles of the ratio of the whole to the run, by accuracy."""
    lines = [
        "| accuracy | runs | quartile | median | quartile | 19 of 20 | largest | whole, ms |",
        "|---|---|---|---|---|---|---|---|",
    ]
    counted = [row for row in rows if row.whole > LONG_ENOUGH and row.status == "ok"]
    for accuracy in (*ACCURACIES, None):
        part = [row for row in counted if accuracy in (row.accuracy, None)]
        if len(part) < 2:
            continue
        ratios = sorted(row.ratio for row in part)
        quarters = statistics.quantiles(ratios, n=4)
        most = statistics.quantiles(ratios, n=20)[-1]
        figures = [*quarters, most, ratios[-1]]
        seconds = statistics.median(row.whole for row in part)
        name = "all" if accuracy is None else f"{accuracy:g}"
        shown = " | ".join(f"{figure:.1f}" for figure in figures)
        lines.append(f"| {name} | {len(part)} | {shown} | {1e3 * seconds:.2f} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", metavar="PATH")
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    rows = list(costs(options.paths, options.repeat))
    for row in sorted(rows, key=lambda row: row.ratio, reverse=True):
        print(
            f"{row.scene:36} {row.accuracy:.0e} {row.method:8} {row.status:22}"
            f" {1e3 * row.whole:9.2f} ms {1e3 * row.run:9.3f} ms {row.ratio:6.1f}"
            f" {row.estimate:.1e}"
        )
    print(f"\n{table(rows)}")
    if options.json:
        rows_json = [asdict(row) for row in rows]
        Path(options.json).write_text(json.dumps(rows_json, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
