"""A pendulum over a million periods, by a symplectic method of fixed step.

The exact motion is known: sin(θ/2) = k sn(K − ωt) with k the sine of half the amplitude, evaluated
in 40 digits at the doubles that the samples are taken at. What the run at a step says of itself
is its energy drift, and as an estimate of its phase error the distance to a run at twice the step.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import mpmath
import numpy as np
from calibration_report import machine
from numpy.typing import NDArray

from lagrange_cli import loads
from lagrange_cli.simulate.results.trajectory import Trajectory

Array = NDArray[np.float64]

#: Gravity over length, 1/s², and the amplitude.
RATE, AMPLITUDE = 9.75, 1.5

SCENE = f"""
name: pendulum
parameters: {{m: 1, g: {RATE}, l: 1}}
plane: xz
particles: {{bob: {{mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}}}
coordinates: [theta]
potentials: {{weight: {{gravity: g}}}}
initial: {{theta: {AMPLITUDE}, dot(theta): 0}}
"""

DIGITS = 40

#: Samples, spread evenly, each in another part of a period (the golden section).
SAMPLES, BESIDES = 201, 0.618

#: Parts of the time after which the largest errors so far are shown.
SHOWN = (0.05, 0.1, 0.3, 1.0)


@dataclass(frozen=True)
class Row:
    """The largest figures up to a number of periods."""

    method: str
    steps_a_period: int
    periods: float
    drift: float
    phase: float
    estimate: float
    seconds: float


def period() -> float:
    """The period, s."""
    with mpmath.workdps(DIGITS):
        modulus = mpmath.sin(mpmath.mpf(AMPLITUDE) / 2) ** 2
        return float(4 * mpmath.ellipk(modulus) / mpmath.sqrt(RATE))


def exact(times: Array) -> Array:
    """Angle and rate at times, shape (samples, 2)."""
    with mpmath.workdps(DIGITS):
        k, rate = mpmath.sin(mpmath.mpf(AMPLITUDE) / 2), mpmath.sqrt(RATE)
        quarter = mpmath.ellipk(k**2)
        rows = []
        for t in times.tolist():
            u = mpmath.fmod(quarter - rate * mpmath.mpf(t), 4 * quarter)
            sn, cn, dn = (mpmath.ellipfun(name, u, m=k**2) for name in ("sn", "cn", "dn"))
            angle = 2 * mpmath.asin(k * sn)
            rows.append(
                [float(angle), float(-2 * k * rate * cn * dn / mpmath.sqrt(1 - (k * sn) ** 2))]
            )
        return np.array(rows)


def phases(of: Array, other: Array) -> Array:
    """How far two motions are apart in phase, rad, at each sample: along the motion."""
    difference = of - other
    along = np.column_stack([other[:, 1], -RATE * np.sin(other[:, 0])])
    weights = np.array([1.0, 1.0 / RATE])
    shift = (weights * difference * along).sum(axis=1) / (weights * along**2).sum(axis=1)
    return np.asarray(np.abs(shift) * 2 * math.pi / period())


def run(method: str, steps: int, periods: int, samples: int) -> tuple[Trajectory, float]:
    """The motion with so many steps a period, and what it took."""
    until = (samples - 1) * (periods // (samples - 1) + BESIDES) * period()
    started = time.perf_counter()
    found = (
        loads(SCENE)
        .derive()
        .simulate(until=until, method=method, step=period() / steps, samples=samples)
    )
    return found, time.perf_counter() - started


def states(found: Trajectory) -> Array:
    return np.column_stack([found.columns["theta"], found.columns["dot(theta)"]])


def measured(
    method: str, steps: int, periods: int, found: Trajectory, coarser: Trajectory, seconds: float
) -> list[Row]:
    """What a run says of itself, beside one of twice the step, and what is true."""
    true = phases(states(found), exact(found.t))
    estimate = phases(states(found), states(coarser))
    kinetic = 0.5 * float(np.abs(found.columns["dot(theta)"]).max()) ** 2
    drift = np.abs(found.energy - found.energy[0]) / kinetic
    rows = []
    for part in SHOWN:
        upto = slice(0, math.ceil(part * (len(true) - 1)) + 1)
        worst = (float(of[upto].max()) for of in (drift, true, estimate))
        rows.append(Row(method, steps, part * periods, *worst, seconds))
    return rows


def all_measured(method: str, steps: Sequence[int], periods: int, samples: int) -> list[Row]:
    """The figures of a method with several numbers of steps a period."""
    rows, runs = list[Row](), dict[int, tuple[Trajectory, float]]()
    for number in sorted({*steps, *(count // 2 for count in steps)}):
        runs[number] = run(method, number, periods, samples)
        print(f"{method}, {number} steps a period: {runs[number][1]:.1f} s", flush=True)
    for number in steps:
        found, seconds = runs[number]
        rows += measured(method, number, periods, found, runs[number // 2][0], seconds)
    return rows


def table(rows: Sequence[Row]) -> str:
    lines = [
        "| method | steps a period | periods | energy drift | phase error, rad | estimated, rad |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.method} | {r.steps_a_period} | {r.periods:g} | {r.drift:.1e} | {r.phase:.1e} |"
        f" {r.estimate:.1e} |"
        for r in rows
    ]
    return "\n".join(lines)


_PAGE = """\
# A million periods

A pendulum of amplitude {amplitude} rad over {periods:,} periods, by symplectic methods of fixed
step. This page is the output of

    python benchmarks/long_run.py --docs docs/quality/long-runs.md

{table}

The energy drift is the largest change of the energy at {samples} samples up to that time, over the
largest kinetic energy: it does not grow with the number of steps, but for rounding. The phase error
is taken from the exact motion (Jacobi's elliptic functions in {digits} digits) at the same samples;
it grows in proportion to the time. The estimate is the distance to a run of twice the step.

Measured on {machine}.
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--periods", type=int, default=1_000_000)
    parser.add_argument("--steps", type=int, nargs="+", default=[20, 40], help="a period")
    parser.add_argument("--methods", nargs="+", default=["Gauss6"])
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--docs", metavar="FILE", help="write the page with the table")
    parser.add_argument("--json", metavar="FILE", help="write all figures")
    given = parser.parse_args()
    rows = list[Row]()
    for method in given.methods:
        rows += all_measured(method, given.steps, given.periods, given.samples)
    print("\n" + table(rows))
    if given.docs:
        text = _PAGE.format(
            amplitude=AMPLITUDE,
            periods=given.periods,
            table=table(rows),
            samples=given.samples,
            digits=DIGITS,
            machine=machine(),
        )
        Path(given.docs).write_text(text, encoding="utf-8")
    if given.json:
        Path(given.json).write_text(json.dumps([asdict(row) for row in rows], indent=1))
    return 0 if all(row.phase <= row.estimate for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
