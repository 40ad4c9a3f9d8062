"""How true the promise is that members of an ensemble have which are stepped side by side.

Members are random neighbours of the start of every shipped scene that has such members: each
number moves by up to a fifth of itself, numbers that are 0 by some hundredths. Their errors
are judged by runs of the same starts in ``long double`` at a tolerance of 1e-18: the series is
the same, so that what is judged is the estimate, by truncation and rounding. That the motions
are right is what calibration.py shows, by references of another method.

    python benchmarks/member_calibration.py --members 32
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field

import numpy as np
from calibration import ACCURACIES, SYSTEMS, system
from references import FOLDER, Array

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.ensemble.run.batched_results import BatchedResults, batched_results
from lagrange_cli.simulate.integrators.native.batched_taylor import TaylorSteps
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions

SAMPLES, SEED = 101, 7

#: How numbers of the start are moved: by a part of themselves, and those that are 0.
PART, FROM_ZERO = 0.2, 0.05

#: Runs that others are judged by.
EXACT_ORDER, EXACT_TOLERANCE, MOST_STEPS = 24, 1e-18, 20_000

#: Errors below this are taken to be so large.
LEAST = 1e-17


@dataclass
class Tally:
    """Of the members of an accuracy the ratios of estimate and error, how many errors were
    above the estimate and above the accuracy, and how many members had one companion."""

    ratios: list[float] = field(default_factory=list)
    above: int = 0
    wrong: int = 0
    by_one: int = 0

    def line(self, accuracy: float) -> str:
        count, ratios = len(self.ratios), np.array(self.ratios)
        low, median, high = np.quantile(ratios, (0.25, 0.5, 0.75))
        return (
            f"| {accuracy:.0e} | {count} | {self.wrong} | {100 * (1 - self.above / count):.2f} % "
            f"| {self.by_one} | {median:.0f} ({low:.0f} to {high:.0f}) |"
        )


def starts_of(model: Model, members: int) -> Array:
    """Starts of random members, shape (members, 2n)."""
    random, own = np.random.default_rng(SEED), np.array(model.initial, dtype=float)
    moved = own * (1 + random.uniform(-PART, PART, (members, len(own))))
    return moved + FROM_ZERO * random.standard_normal(moved.shape) * (own == 0)


def judge(batched: BatchedResults, members: int, accuracy: float, tally: Tally) -> None:
    """Add what the members of a scene come to."""
    together, model = batched.members, batched.model
    starts, given = starts_of(model, members), [p.value or 0.0 for p in model.parameters]
    parameters = np.tile(np.array(given, dtype=float), (members, 1))
    wider = together.wider
    if wider is None:
        raise SystemExit("no arithmetic wider than doubles on this machine")
    steps = TaylorSteps(EXACT_ORDER, EXACT_TOLERANCE, together.problem.longest_step, MOST_STEPS)
    exact = wider.run("rhs", batched.request.times[:], starts, parameters, steps)
    for runs in together.promised(accuracy, starts, parameters, lambda: None):
        errors = np.abs(runs.states - exact.states[runs.numbers]) / runs.scales[:, None, :]
        worst = errors.max(axis=(1, 2))
        for k in np.flatnonzero((runs.estimate < accuracy) & np.isfinite(worst)).tolist():
            tally.ratios.append(float(runs.estimate[k] / max(worst[k], LEAST)))
            tally.above += bool(worst[k] > runs.estimate[k])
            tally.wrong += bool(worst[k] > accuracy)
            # Two companions take more than half as much again.
            tally.by_one += bool(runs.all_evaluations[k] < 2.2 * runs.evaluations[k])


def families(accuracy: float) -> list[BatchedResults]:
    """Of all scenes whose members are stepped side by side."""
    found = []
    for path in sorted(FOLDER.rglob("*.minimal.json")):
        scene = SYSTEMS / path.relative_to(FOLDER).parent / f"{path.name.split('.')[0]}.yaml"
        try:
            model = system(scene, "minimal").model
            options = SimulationOptions(accuracy=accuracy, samples=SAMPLES)
            batched = batched_results(model, options, ())
        except InputError as refusal:
            print(f"{scene.stem}: {refusal.problems[0].message}", file=sys.stderr)
            continue
        found += [] if batched is None else [batched]
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--members", type=int, default=32, help="of each scene")
    options = parser.parse_args()
    tallies = {accuracy: Tally() for accuracy in ACCURACIES}
    for accuracy, tally in tallies.items():
        for batched in families(accuracy):
            judge(batched, options.members, accuracy, tally)
    print("| accuracy | members held | wrong | estimate above error | one companion | ratio |")
    print("|---" * 6 + "|")
    for accuracy, tally in tallies.items():
        print(tally.line(accuracy))
    return int(any(tally.wrong for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
