"""A free asymmetric body over a million turns, by a quaternion of length 1.

Its angular velocities are known, ω1 = −a sd(nt), ω2 = b cd(nt), ω3 = c nd(nt), Jacobi's functions
(L. D. Landau and E. M. Lifshitz, Mechanics, 3rd ed. 1976, section 37), evaluated in 40 digits at
the times of the samples. Energy, length of the quaternion and angular momentum in space stay.
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
from numpy.typing import NDArray

from lagrange_cli import loads
from lagrange_cli.simulate.results.trajectory import Trajectory

Array = NDArray[np.float64]

MOMENTS = (1, 2, 3)
MIDDLE, LAST = 1.0, 0.5

SCENE = f"""
name: tumbling
bodies: {{body: {{turn: {{quaternion: [q0, q1, q2, q3]}}, mass: 1, inertia: {list(MOMENTS)}}}}}
coordinates: [q0, q1, q2, q3]
outputs: {{w1: omega_1(body), w2: omega_2(body), w3: omega_3(body)}}
initial: {{q0: 1, q1: 0, q2: 0, q3: 0, dot(q1): 0, dot(q2): {MIDDLE / 2}, dot(q3): {LAST / 2}}}
"""

DIGITS = 40

#: Samples, spread evenly, each in another part of a turn (the golden section).
SAMPLES, BESIDES = 201, 0.618

#: Parts of the time after which the largest figures so far are shown.
SHOWN = (0.01, 0.1, 0.3, 1.0)


@dataclass(frozen=True)
class Row:
    """The largest figures up to a number of turns; seconds are those of the processor."""

    method: str
    turns: float
    energy: float
    length: float
    momentum: float
    spin: float
    seconds: float


def turn() -> float:
    """The mean time of a turn about the angular momentum, s: ω has the part 2T/J along it."""
    parts = (0.0, MIDDLE, LAST)
    energy = sum(i * w * w for i, w in zip(MOMENTS, parts, strict=True))
    momentum = math.hypot(*(i * w for i, w in zip(MOMENTS, parts, strict=True)))
    return 2 * math.pi * momentum / energy


def exact(times: Array) -> Array:
    """Angular velocities along the axes of the body, shape (samples, 3)."""
    with mpmath.workdps(DIGITS):
        one, two, three = map(mpmath.mpf, MOMENTS)
        energy = two * MIDDLE**2 + three * LAST**2
        square = two**2 * MIDDLE**2 + three**2 * LAST**2
        above, below = square - energy * one, energy * three - square
        m = (two - one) * below / ((three - two) * above)
        rate = mpmath.sqrt((three - two) * above / (one * two * three))
        first = -mpmath.sqrt(below / (one * (three - one)) * (1 - m))
        period = 4 * mpmath.ellipk(m)
        rows = []
        for t in times.tolist():
            u = mpmath.fmod(rate * mpmath.mpf(t), period)
            sd, cd, nd = (mpmath.ellipfun(name, u, m=m) for name in ("sd", "cd", "nd"))
            rows.append([float(first * sd), float(MIDDLE * cd), float(LAST * nd)])
        return np.array(rows)


def momentum(spins: Array, parts: Array) -> Array:
    """The angular momentum along the axes of space, shape (samples, 3)."""
    scalar, vector = parts[:, :1], parts[:, 1:]
    along = spins * MOMENTS
    crossed = np.cross(vector, along)
    return np.asarray(along + 2 * (scalar * crossed + np.cross(vector, crossed)))


def run(method: str, rtol: float, turns: int, samples: int) -> tuple[Trajectory, float]:
    """The motion over some turns, and the seconds of the processor that it took."""
    until = (samples - 1) * (turns // (samples - 1) + BESIDES) * turn()
    derivation = loads(SCENE).derive()
    started = time.process_time()
    found = derivation.simulate(
        until=until, method=method, rtol=rtol, atol=rtol / 100, samples=samples
    )
    return found, time.process_time() - started


def measured(method: str, turns: int, found: Trajectory, seconds: float) -> list[Row]:
    parts = np.column_stack([found.columns[f"q{k}"] for k in range(4)])
    spins = np.column_stack([found.columns[f"w{k}"] for k in (1, 2, 3)])
    energy = spins**2 @ np.array(MOMENTS)
    vectors = momentum(spins, parts)
    figures = (
        np.abs(energy / energy[0] - 1),
        np.abs((parts**2).sum(axis=1) - 1),
        np.abs(vectors - vectors[0]).max(axis=1) / np.hypot.reduce(vectors[0]),
        np.abs(spins - exact(found.t)).max(axis=1),
    )
    rows = []
    for part in SHOWN:
        upto = slice(0, math.ceil(part * (len(energy) - 1)) + 1)
        worst = (float(of[upto].max()) for of in figures)
        rows.append(Row(method, part * turns, *worst, seconds))
    return rows


def table(rows: Sequence[Row]) -> str:
    lines = [
        "| method | turns | energy | length | angular momentum | ω | seconds of all |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.method} | {r.turns:g} | {r.energy:.1e} | {r.length:.1e} | {r.momentum:.1e} |"
        f" {r.spin:.1e} | {r.seconds:.0f} |"
        for r in rows
    ]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=1_000_000)
    parser.add_argument("--methods", nargs="+", default=["DOP853"])
    parser.add_argument("--rtol", type=float, default=3e-16)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--json", metavar="FILE", help="write all figures")
    given = parser.parse_args()
    rows = list[Row]()
    for method in given.methods:
        found, seconds = run(method, given.rtol, given.turns, given.samples)
        rows += measured(method, given.turns, found, seconds)
    print(table(rows))
    if given.json:
        Path(given.json).write_text(json.dumps([asdict(row) for row in rows], indent=1))
    return 0 if all(row.energy <= 1e-10 and row.length <= 1e-15 for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
