"""How errors follow tolerances, and which explicit method is the faster one for the same error.

Every scene that can be simulated is run with both methods at tolerances from 1e-3 to 1e-13,
compiled, and compared with a run whose accuracy was measured to be far better. What comes out set
the first tolerance of a promise and the choice between the methods.

    python benchmarks/tolerances.py systems
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from reporting import scene_files

from lagrange_cli import Derivation, LagrangeError, load
from lagrange_cli.simulate import Trajectory

METHODS = ("DOP853", "Gauss16")
TOLERANCES = tuple(10.0**-k for k in range(3, 14))

#: Errors for which the methods are compared.
ERRORS = (1e-4, 1e-5, 1e-7, 1e-8, 1e-10, 1e-11)

#: Accuracies of references, of which the first that is kept is taken.
REFERENCES = (1e-11, 1e-10, 1e-9)

#: Seconds for a reference, and for a run.
PATIENCE = 8.0


@dataclass(frozen=True)
class ToleranceRun:
    """One run of a scene.

    Attributes
    ----------
    scene, method
        Their names.
    tolerance
        Relative tolerance.
    error
        Largest error at a sample over its scale.
    seconds
        Least seconds of some repetitions.
    """

    scene: str
    method: str
    tolerance: float
    error: float
    seconds: float


def reference(derivation: Derivation) -> Trajectory | None:
    """A motion that is measured to be right; None if there is none."""
    for accuracy in REFERENCES:
        trajectory = derivation.simulate(accuracy=accuracy, budget=PATIENCE)
        if trajectory.status == "ok":
            return trajectory
    return None


def error(trajectory: Trajectory, exact: Trajectory) -> float:
    """The largest error of a trajectory over the scales."""
    return max(
        float(np.abs(trajectory.columns[name] - exact.columns[name]).max()) / scale
        for name, scale in exact.scales.items()
        if name in trajectory.columns
    )


def runs_of(scene: str, derivation: Derivation, repeat: int) -> Iterator[ToleranceRun]:
    """Run a scene by both methods at all tolerances."""
    exact = reference(derivation)
    if exact is None:
        raise LagrangeError("no reference")
    for method in METHODS:
        for tolerance in TOLERANCES:
            runs = [
                derivation.simulate(method=method, rtol=tolerance, budget=PATIENCE)
                for _ in range(repeat)
            ]
            if runs[0].status == "ok":
                seconds = min(run.seconds["integrate"] for run in runs)
                yield ToleranceRun(scene, method, tolerance, error(runs[0], exact), seconds)


def errors_table(runs: Sequence[ToleranceRun]) -> str:
    """Markdown: errors over tolerances."""
    lines = [
        "| method | tolerance | median of error over tolerance | 19 of 20 |",
        "|---|---|---|---|",
    ]
    for method in METHODS:
        for tolerance in TOLERANCES:
            alike = [r for r in runs if (r.method, r.tolerance) == (method, tolerance)]
            # Errors of 1e-14 are those of rounding.
            ratios = sorted(run.error / tolerance for run in alike if run.error > 1e-14)
            if len(ratios) > 1:
                most = statistics.quantiles(ratios, n=20)[-1]
                lines.append(
                    f"| {method} | {tolerance:.0e} | {statistics.median(ratios):.1e} | {most:.1e} |"
                )
    return "\n".join(lines)


def seconds_for(runs: Sequence[ToleranceRun], scene: str, method: str, most: float) -> float | None:
    """The least seconds of a method for an error."""
    alike = (r for r in runs if (r.scene, r.method) == (scene, method) and r.error <= most)
    return min((run.seconds for run in alike), default=None)


def seconds_table(runs: Sequence[ToleranceRun]) -> str:
    """Markdown: how many times the seconds of Gauss16 DOP853 takes for the same error."""
    lines = [
        "| error | scenes | least | quartile | median | quartile | largest |",
        "|" + "---|" * 7,
    ]
    for most in ERRORS:
        ratios = []
        for scene in {run.scene for run in runs}:
            one, other = (seconds_for(runs, scene, method, most) for method in METHODS)
            if one is not None and other is not None:
                ratios.append(one / other)
        if len(ratios) > 1:
            figures = [min(ratios), *statistics.quantiles(ratios, n=4), max(ratios)]
            shown = " | ".join(f"{figure:.2f}" for figure in figures)
            lines.append(f"| {most:.0e} | {len(ratios)} | {shown} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", metavar="PATH")
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    runs: list[ToleranceRun] = []
    for path in scene_files(options.paths):
        try:
            runs += runs_of(path.stem, load(path).derive(), options.repeat)
        except LagrangeError as refusal:
            print(f"{path.stem}: {str(refusal).splitlines()[0]}", file=sys.stderr, flush=True)
    print(f"{errors_table(runs)}\n\n{seconds_table(runs)}")


if __name__ == "__main__":
    main()
