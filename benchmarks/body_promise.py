"""Whether the promise of ``--accuracy`` holds for scenes of bodies, and for random trees of them.

    python benchmarks/body_promise.py [--count 20] [--seed 36] [--most 4]

Shipped scenes of bodies, robots and rolling are judged by their stored references, trees of
bodies.py, released from random states for two seconds, by references that are made now. The table
is the one of docs/quality/bodies.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence

import calibration_report as report
import numpy as np
from bodies import random_tree, scene_of
from calibration import System, judgements, measured, reference_of, scenes
from calibration_report import Row
from references import SYSTEMS

from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.model.build import model_of

ACCURACIES = (1e-6, 1e-9)

FOLDERS = ("bodies", "rigid", "robots", "rolling")


def tree(rng: np.random.Generator, size: int) -> Equations:
    """Derive a random tree that starts at a random state."""
    text = scene_of(random_tree(rng, size))
    start = [f"q{k}: {x:.3f}" for k, x in enumerate(rng.uniform(-1, 1, size))]
    start += [f"dot(q{k}): {x:.3f}" for k, x in enumerate(rng.uniform(-2, 2, size))]
    lines = [line for line in text.splitlines() if not line.startswith("initial")]
    lines += [f"initial: {{{', '.join(start)}}}", "simulate: {until: 2, samples: 41}"]
    return derive(read_text("\n".join(lines) + "\n"))


def trees(count: int, seed: int, most: int) -> Iterator[Row]:
    for number in range(count):
        size = 1 + number % most
        equations = tree(np.random.default_rng([seed, number]), size)
        name = (SYSTEMS / f"trees of {size}" / str(number)).with_suffix(".yaml")
        system = System(name, "minimal", equations, model_of(equations))
        reference = reference_of(system)
        yield from (measured(system, accuracy, reference) for accuracy in ACCURACIES)


def table(rows: Sequence[Row]) -> str:
    """Errors over the accuracy by groups of scenes: the largest, and what is silently wrong."""
    lines = [
        "| scenes | number | accuracy | runs | to the end | largest error / accuracy | wrong |",
        "|---|---|---|---|---|---|---|",
    ]
    for group in dict.fromkeys(row.scene.split("/")[0] for row in rows):
        for accuracy in ACCURACIES:
            alike = [
                row for row in rows if row.scene.split("/")[0] == group and row.accuracy == accuracy
            ]
            errors = [row.error / accuracy for row in alike if row.error is not None]
            ended = sum(row.held == row.until for row in alike)
            silent = sum(map(report.wrong, alike))
            number = len({row.scene for row in alike})
            lines.append(
                f"| {group} | {number} | {accuracy:.0e} | {len(alike)} | {ended}"
                f" | {max(errors, default=0.0):.1e} | {silent} |"
            )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=36)
    parser.add_argument("--most", type=int, default=4)
    chosen = parser.parse_args()
    rows = []
    for row in trees(chosen.count, chosen.seed, chosen.most):
        rows.append(row)
        print(report.line(row), file=sys.stderr, flush=True)
    for row in judgements(scenes(FOLDERS), ACCURACIES, 0, chosen.seed):
        rows.append(row)
        print(report.line(row), file=sys.stderr, flush=True)
    print(table(rows))
    return 1 if any(map(report.wrong, rows)) else 0


if __name__ == "__main__":
    sys.exit(main())
