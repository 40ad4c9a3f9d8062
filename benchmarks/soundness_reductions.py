"""Whether numbers of --reduce are within the errors stated with them.

Oscillators x = A cos(w t) with random A and w, samples far apart or close, at three accuracies. The
numbers have closed forms, which are evaluated in 40 digits: passages as short as 1e-9 of the way,
peaks as narrow, kinks, steps, means.

    python benchmarks/soundness_reductions.py --members 60 --seed 1
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mpmath import acos, inf, mp, mpf, pi, quad, sin

from lagrange_cli import loads

DIGITS = 40

SCENE = """
name: oscillator
parameters: {{w: 1, a: 0, b: 1e-3}}
coordinates: [x]
kinetic: {{T: dot(x)^2/2}}
potentials: {{V: w^2*x^2/2}}
initial: {{x: 1, dot(x): 0}}
simulate: {{until: {until}, accuracy: {accuracy:g}, samples: {samples}}}
"""

#: Members whose number is unknown by more than this part of the truth, or of the time, are counted.
LOOSE = 1e-6


@dataclass(frozen=True)
class Member:
    """A motion A cos(w t) until a time, a place a and a width b."""

    size: mpf
    w: mpf
    a: mpf
    b: mpf
    until: mpf

    def passes(self, place: mpf) -> mpf:
        """First time at which x falls to a place; infinite if not until the end."""
        if abs(place) > self.size:
            return inf
        time = acos(place / self.size) / self.w
        return time if time < self.until else inf

    @property
    def lowest(self) -> mpf:
        """Least x."""
        turn = pi / self.w
        return -self.size if turn <= self.until else self.size * mp.cos(self.w * self.until)

    @property
    def nearest(self) -> mpf:
        """Least distance of x from a."""
        return max(self.lowest - self.a, self.a - self.size, mpf(0))


def _mean_square(m: Member) -> mpf:
    phase = 2 * m.w * m.until
    return m.size**2 * (1 + sin(phase) / phase) / 2


def _mean_distance(m: Member) -> mpf:
    crossings = [m.passes(m.a)] if m.passes(m.a) < m.until else []
    places = [mpf(0), *crossings]
    count = 1
    while crossings and places[-1] < m.until and count < 60:
        turn = 2 * pi * count / m.w
        places += [turn - crossings[0], turn + crossings[0]]
        count += 1
    ends = [t for t in sorted(places) if t < m.until] + [m.until]
    return quad(lambda t: abs(m.size * mp.cos(m.w * t) - m.a), ends) / m.until


#: Reduction → its number; infinite for never.
KINDS: dict[str, Callable[[Member], mpf]] = {
    "first(abs(x - a) < b)": lambda m: m.passes(m.a + m.b),
    "first(x < a)": lambda m: m.passes(m.a),
    "first(tanh((x - a)/b) < 0)": lambda m: m.passes(m.a),
    "first(max(x - a, a - x) < b)": lambda m: m.passes(m.a + m.b),
    "max(exp(-((x - a)/b)^2))": lambda m: mp.exp(-((m.nearest / m.b) ** 2)),
    "max(1/(b^2 + (x - a)^2))": lambda m: 1 / (m.b**2 + m.nearest**2),
    "min(abs(x - a))": lambda m: m.nearest,
    "min(x)": lambda m: m.lowest,
    "mean(x^2)": _mean_square,
    "mean(abs(x - a))": _mean_distance,
}


@dataclass(frozen=True)
class Counts:
    """Numbers of one reduction: in all, open, loose, and off by more than stated."""

    members: int
    open: int
    loose: int
    wrong: tuple[str, ...]


def counts(call: str, members: int, seed: int) -> Counts:
    """Compare the numbers of some members with their closed forms."""
    rng = np.random.default_rng([seed, list(KINDS).index(call)])
    is_open, is_loose, wrong = 0, 0, []
    for accuracy, samples in ((1e-4, 201), (1e-8, 51), (1e-10, 501)):
        count, until = members // 3, 20.0
        values = {
            "x": rng.uniform(0.5, 2, count),
            # Up to a whole turn between two of the fewest samples.
            "w": 10.0 ** rng.uniform(-0.5, 1.2, count),
            "a": rng.uniform(-0.4, 0.4, count),
            "b": 10.0 ** rng.uniform(-9, -1, count),
        }
        scene = SCENE.format(until=until, accuracy=accuracy, samples=samples)
        rows = zip(*(column.tolist() for column in values.values()), strict=True)
        grid = [dict(zip(values, row, strict=True)) for row in rows]
        ensemble = loads(scene).derive().ensemble(grid, columns=[], reduce=[call])
        pairs = zip(ensemble.reduced[call], ensemble.reduced_error[call], grid, strict=True)
        for number, error, row in pairs:
            with mp.workdps(DIGITS):
                m = Member(*(mpf(row[name]) for name in ("x", "w", "a", "b")), mpf(until))
                truth = KINDS[call](m)
                if not np.isfinite(error):
                    is_open += 1
                    continue
                never = truth == inf
                off = 0.0 if never and np.isnan(number) else float(abs(mpf(float(number)) - truth))
                is_loose += bool(error > LOOSE * max(1.0, 0.0 if never else float(abs(truth))))
            if not off <= error:
                wrong.append(f"{call} {row} {accuracy:g} {samples}: {number!r} +- {error!r}")
    return Counts(3 * (members // 3), is_open, is_loose, tuple(wrong))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Numbers of motions beside closed forms.")
    parser.add_argument("--members", type=int, default=60, help="of each reduction")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    print(
        "| reduction | members | open | known to less than six digits | off by more than stated |"
    )
    print("|---|---:|---:|---:|---:|")
    failed = 0
    for call in given.kinds:
        row = counts(call, given.members, given.seed)
        for line in row.wrong:
            print(line, file=sys.stderr)
        numbers = row.members, row.open, row.loose, len(row.wrong)
        print(f"| `{call}` | {' | '.join(map(str, numbers))} |", flush=True)
        failed += len(row.wrong)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
