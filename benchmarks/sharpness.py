"""Whether sharp forces are overlooked where steps are long.

A particle passes a bump, a pole, a step, a wave or a high power of the position, or is hit by a
pulse: of random width (a thousandth to twice the path) and strength (1e-8 of its energy and more),
with a spring or without, at a random accuracy. Each run is compared with SciPy's DOP853 at steps
of a quarter of the width: what is kept may not be wrong by more than the accuracy, nor by more
than its estimate.

    python benchmarks/sharpness.py --runs 100
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from lagrange_cli import loads

SCENE = """
name: passage
parameters: {{A: 1, w: 1, c: 0.5, k: 0}}
particles: {{p: {{mass: 1, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{V: "{potential}"}}
forces: {{f: {{on: p, force: ["{force}", 0, 0]}}}}
initial: {{x: 0, dot(x): 1}}
simulate: {{until: 1, samples: 21}}
"""

#: What acts at time t and position x: strength a, width w, place c.
Law = Callable[[float, float, float, float, float], float]

#: Potential, force, and what both together are without the spring.
KINDS: dict[str, tuple[str, str, Law]] = {
    "bump": (
        "A*exp(-((x - c)/w)^2)",
        "0",
        lambda t, x, a, w, c: 2 * a * (x - c) / w**2 * math.exp(-(((x - c) / w) ** 2)),
    ),
    "pole": (
        "A/(1 + ((x - c)/w)^2)",
        "0",
        lambda t, x, a, w, c: 2 * a * (x - c) / w**2 / (1 + ((x - c) / w) ** 2) ** 2,
    ),
    "step": (
        "A*tanh((x - c)/w)",
        "0",
        lambda t, x, a, w, c: -a / w / math.cosh(min(abs(x - c) / w, 300.0)) ** 2,
    ),
    "wave": ("A*w*sin(x/w)", "0", lambda t, x, a, w, c: -a * math.cos(x / w)),
    "power": (
        "A*(x/(2*c))^24",
        "0",
        lambda t, x, a, w, c: -24 * a * (x / (2 * c)) ** 23 / (2 * c),
    ),
    "pulse": (
        "0",
        "A*exp(-((t - c)/w)^2)",
        lambda t, x, a, w, c: a * math.exp(-(((t - c) / w) ** 2)),
    ),
}

ACCURACIES = (1e-3, 1e-6, 1e-9)

#: A particle of this energy passes every potential of that strength.
MOST = 0.4

#: Estimates are not below this part of the scales, which the comparison does not resolve.
LEAST = 3e-13

#: Runs of fewer steps have long ones.
FEW = 100


@dataclass(frozen=True)
class Passage:
    """One run: what it was about, its error, what was estimated, and its steps."""

    kind: str
    parameters: dict[str, float]
    accuracy: float
    error: float
    estimated: float
    steps: int

    @property
    def wrong(self) -> bool:
        return self.error > self.accuracy

    @property
    def deceived(self) -> bool:
        return self.error > max(self.estimated, LEAST)


def passages(kind: str, runs: int, rng: np.random.Generator) -> Iterator[Passage]:
    """Random runs of one kind."""
    potential, force, law = KINDS[kind]
    text = SCENE.format(potential=f"{potential} + k*x^2/2", force=force)
    for _ in range(runs):
        given = {
            "A": float(rng.choice([-1, 1]) * min(10 ** rng.uniform(-8, 0), MOST)),
            "w": float(10 ** rng.uniform(-3, 0.3)),
            "c": float(rng.uniform(0.05, 0.95)),
            "k": float(rng.choice([0.0, 0.0, 1.0, rng.uniform(0, 30)])),
        }
        accuracy = float(rng.choice(ACCURACIES))
        yield passage(kind, text, law, given, accuracy)


def passage(kind: str, text: str, law: Law, given: dict[str, float], accuracy: float) -> Passage:
    """One run, compared."""
    run = loads(text, parameters=given).derive().simulate(accuracy=accuracy)
    size, width, place, spring = given.values()

    def slopes(t: float, y: np.ndarray) -> list[float]:
        return [y[1], law(t, y[0], size, width, place) - spring * y[0]]

    how = {"rtol": 3e-14, "atol": 1e-15, "max_step": min(width / 4, 0.05)}
    true = solve_ivp(slopes, (0, 1), [0, 1], "DOP853", run.t, **how).y
    names = ("x", "dot(x)")
    off = np.array([run.columns[name] for name in names]) - true
    error = np.abs(off / np.array([[run.scales[name]] for name in names])).max()
    assert run.estimated is not None
    return Passage(kind, given, accuracy, float(error), run.estimated, run.steps)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Sharp forces and long steps.")
    parser.add_argument("--runs", type=int, default=150, help="of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--seed", type=int, default=13)
    given = parser.parse_args(arguments)
    print("| kind | runs | in long steps | wrong | estimate below error |")
    print("|---|---|---|---|---|")
    failed = 0
    for kind in given.kinds:
        found = list(passages(kind, given.runs, np.random.default_rng(given.seed)))
        for bad in (p for p in found if p.wrong or p.deceived):
            print(bad, file=sys.stderr)
        wrong, deceived = sum(p.wrong for p in found), sum(p.deceived for p in found)
        few = sum(p.steps < FEW for p in found)
        print(f"| {kind} | {len(found)} | {few} | {wrong} | {deceived} |", flush=True)
        failed += wrong + deceived
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
