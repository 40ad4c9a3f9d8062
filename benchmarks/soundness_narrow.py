"""Whether forces in narrow places are missed.

A particle is struck by a box, a triangle or a trapezoid, made of ``sign``, ``abs``, ``max`` and
``min``, of the time or of its position: flying freely, on a spring, in gravity, beside a second
coordinate, or as the second one passes a place; of widths from 1e-2 to 1e-9 of the way and
strengths down to a millionth of its momentum or energy. The exact motion is made of pieces, each
in closed form, in 40 digits. What is kept may not be wrong: a run that ends early is none. Smooth
pulses of the same widths, beside motions as exact (:mod:`soundness_pulses`), are counted by
decades.

    python benchmarks/soundness_narrow.py --runs 1000 --smooth 1000 --seed 1 -j 2
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from mpmath import mp, mpf
from soundness_pulses import past_a_moment, past_a_place

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import Trajectory, simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model, ModelParameter

ACCURACIES = (1e-3, 1e-6, 1e-9)

#: Powers of ten: widths as parts of the way, strengths beside momentum or energy.
WIDTHS, STRENGTHS = (-9.0, -2.0), (-6.0, 0.3)

SCENE = """
name: narrow
parameters: {{A: 1, w: 0.01, c: 0.5, k: 0, h: 0}}
particles: {{p: {{mass: 1, position: [x, {y}, 0]}}}}
coordinates: {coordinates}
potentials: {{V: "k*x^2/2 + h*x"}}
forces: {{f: {{on: p, force: ["{force}", 0, 0]}}}}
initial: {initial}
simulate: {{until: 1, samples: 9}}
"""

#: Shapes over s = (place − c)/w, which vanish beyond |s| = 1: by linear pieces, of which each
#: has its ends and the values there.
SHAPES: dict[str, tuple[str, tuple[tuple[float, float, float, float], ...]]] = {
    "box": ("A*(sign(S + 1) - sign(S - 1))/2", ((-1, 1, 1, 1),)),
    "step": ("A*(sign(1 - abs(S)) + 1)/2", ((-1, 1, 1, 1),)),
    "triangle": ("A*max(0, 1 - abs(S))", ((-1, 0, 0, 1), (0, 1, 1, 0))),
    "trapezoid": (
        "A*max(0, min(1, 2 - 2*abs(S)))",
        ((-1, -0.5, 0, 1), (-0.5, 0.5, 1, 1), (0.5, 1, 1, 0)),
    ),
    "ramp": ("A*(max(0, S + 1) - max(0, S - 1))/2*(1 - sign(S - 1))/2", ((-1, 1, 0, 1),)),
}

#: Smooth pulses over s.
PULSES = {
    "Gauss": "A*exp(-(S)^2)",
    "Lorentz": "A/(1 + (S)^2)",
    "sech²": "A/cosh(S)^2",
    "tanh difference": "A*(tanh(S + 1) - tanh(S - 1))/2",
    "power": "A*(1 + (S)^2)^(-8)",
}

#: Where the place of the force is looked at, and whether there is a second coordinate.
ALONG: dict[str, tuple[str, bool]] = {
    "time": ("t", False),
    "position": ("x", False),
    "time, two coordinates": ("t", True),
    "position, two coordinates": ("x", True),
    "the other coordinate": ("y", True),
}


@cache
def model(expression: str, along: str) -> Model:
    """The model of a kind; its code is compiled once, parameters are numbers at run time."""
    variable, two = ALONG[along]
    text = SCENE.format(
        force=expression.replace("S", f"({variable} - c)/w"),
        y="y" if two else "0",
        coordinates="[x, y]" if two else "[x]",
        initial="{x: 0, y: 0, dot(x): 1, dot(y): 1}" if two else "{x: 0, dot(x): 1}",
    )
    return model_of(derive(read_text(text)))


@dataclass(frozen=True)
class Strike:
    """One run: what strikes where, with the numbers of the scene.

    ``A`` strength, ``w`` half the width, ``c`` the place, ``k`` the spring, ``h`` the weight.
    """

    kind: str
    along: str
    numbers: dict[str, float]
    accuracy: float

    def run(self, expression: str) -> Trajectory:
        of = model(expression, self.along)
        parameters = tuple(
            ModelParameter(p.name, self.numbers.get(p.name, p.value), p.used) for p in of.parameters
        )
        return simulate(replace(of, parameters=parameters), accuracy=self.accuracy)


def strikes(
    kinds: Sequence[str], runs: int, rng: np.random.Generator, hosts: bool = True
) -> Iterator[Strike]:
    """Random strikes."""
    for _ in range(runs):
        w = float(10 ** rng.uniform(*WIDTHS)) / 2
        strength = float(rng.choice([-1, 1]) * 10 ** rng.uniform(*STRENGTHS))
        host = int(rng.integers(3)) if hosts else 0
        numbers = {
            "A": strength / (2 * w),
            "w": w,
            "c": float(rng.uniform(0.02, 0.95)),
            "k": float(rng.uniform(0.5, 30)) if host == 1 else 0.0,
            "h": float(rng.uniform(-1, 1)) if host == 2 else 0.0,
        }
        along = list(ALONG)[: len(ALONG) if hosts else 2]
        yield Strike(
            str(rng.choice(list(kinds))),
            str(rng.choice(along)),
            numbers,
            float(rng.choice(ACCURACIES)),
        )


# Exact motions of pieces.


@dataclass(frozen=True)
class _Linear:
    """Motion under x″ = a + b x + d t from (x, v) at t = 0."""

    a: mpf
    b: mpf
    d: mpf
    x: mpf
    v: mpf

    def at(self, t: mpf) -> tuple[mpf, mpf]:
        a, b, d = self.a, self.b, self.d
        if b == 0:
            return (
                self.x + self.v * t + a * t**2 / 2 + d * t**3 / 6,
                self.v + a * t + d * t**2 / 2,
            )
        # A particular solution is −(a + d t)/b.
        u, rate = self.x + a / b, self.v + d / b
        if b < 0:
            omega = mp.sqrt(-b)
            c, s = mp.cos(omega * t), mp.sin(omega * t)
            x, v = u * c + rate / omega * s, rate * c - u * omega * s
        else:
            omega = mp.sqrt(b)
            c, s = mp.cosh(omega * t), mp.sinh(omega * t)
            x, v = u * c + rate / omega * s, rate * c + u * omega * s
        return x - (a + d * t) / b, v - d / b

    def turns(self) -> mpf:
        """The first time at which it turns round (d = 0)."""
        never = mp.inf
        if self.b == 0:
            t = -self.v / self.a if self.a else never
            return t if t > 0 else never
        u, omega = self.x + self.a / self.b, mp.sqrt(abs(self.b))
        if self.b < 0:
            phase = mp.atan2(self.v, omega * u) % mp.pi
            return (phase if phase > mpf("1e-30") else mp.pi) / omega
        ratio = -self.v / (omega * u) if u else mpf(2)
        return mp.atanh(ratio) / omega if 0 < ratio < 1 else never

    def reaches(self, place: mpf, until: mpf) -> mpf | None:
        """When it is at a place before it turns, or until a time; None where it is not."""
        end = min(self.turns(), until)
        low, high = mpf(0), end
        first, last = self.x - place, self.at(high)[0] - place
        if first == 0 or last == 0 or (first > 0) == (last > 0):
            return high if last == 0 and first != 0 else None
        for _ in range(140):
            middle = (low + high) / 2
            if ((self.at(middle)[0] - place) > 0) == (first > 0):
                low = middle
            else:
                high = middle
        return high


def pieces_of(strike: Strike) -> list[tuple[mpf, mpf, mpf, mpf]]:
    """Pieces of the force along its variable: from, to, value at 0 and slope; nothing between."""
    size, w, c = (mpf(strike.numbers[name]) for name in ("A", "w", "c"))
    found = []
    for s0, s1, f0, f1 in SHAPES[strike.kind][1]:
        slope = size * (mpf(f1) - mpf(f0)) / (mpf(s1) - mpf(s0)) / w
        start = c + w * mpf(s0)
        found.append((start, c + w * mpf(s1), size * mpf(f0) - slope * start, slope))
    return found


def of_time(strike: Strike, times: Sequence[float]) -> list[tuple[mpf, mpf]]:
    """x and its rate at some times, struck at a time."""
    k, h = mpf(strike.numbers["k"]), mpf(strike.numbers["h"])
    begin, zero = mpf(0), mpf(0)
    parts = [(zero, zero, zero)] if pieces_of(strike)[0][0] > 0 else []
    ends = []
    for start, end, value, slope in pieces_of(strike):
        ends.append(start)
        parts.append((start, value, slope))
        begin = end
    parts.append((begin, zero, zero))
    t, x, v, found = mpf(0), mpf(0), mpf(1), []
    bounds = [*(p[0] for p in parts[1:]), mp.inf]
    wanted = [mpf(s) for s in times]
    for (_, value, slope), bound in zip(parts, bounds, strict=True):
        motion = _Linear(value + slope * t - h, -k, slope, x, v)
        found += [motion.at(s - t) for s in wanted if t <= s < bound]
        if bound == mp.inf or bound > wanted[-1]:
            break
        if bound > t:
            x, v = motion.at(bound - t)
            t = bound
    return found


def of_position(strike: Strike, times: Sequence[float]) -> list[tuple[mpf, mpf]]:
    """The same struck at a place, region by region."""
    k, h = mpf(strike.numbers["k"]), mpf(strike.numbers["h"])
    zero, pieces = mpf(0), pieces_of(strike)
    regions = [(-mp.inf, pieces[0][0], zero, zero), *pieces, (pieces[-1][1], mp.inf, zero, zero)]
    number = next(j for j, r in enumerate(regions) if r[0] <= 0 < r[1])
    t, x, v = zero, zero, mpf(1)
    found, wanted = [], [mpf(s) for s in times]
    while len(found) < len(wanted):
        low, high, value, slope = regions[number]
        motion = _Linear(value - h, slope - k, zero, x, v)
        end, moves = min(motion.turns(), wanted[-1] - t + 1), 0
        for place, way in ((low, -1), (high, 1)):
            towards = mp.sign(motion.at(end / 2)[1]) == way
            reached = motion.reaches(place, end) if towards and abs(place) < mp.inf else None
            if reached is not None and reached <= end:
                end, moves = reached, way
        found += [motion.at(s - t) for s in wanted[len(found) :] if s - t < end]
        x, v = motion.at(end)
        if moves:
            x = high if moves > 0 else low
        else:
            v = zero if end == motion.turns() else v
        t, number = t + end, number + moves
    return found


# Judgement.


@dataclass(frozen=True)
class Result:
    """A strike with its status, and the largest error in accuracies of the scales."""

    strike: Strike
    status: str
    excess: float

    @property
    def missed(self) -> bool:
        """Kept, and wrong."""
        return not self.excess <= 1


def judged(strike: Strike, run: Trajectory, exact: Sequence[tuple[float, float]]) -> Result:
    """The run beside the exact motion at its samples."""
    worst = 0.0
    for name, number in (("x", 0), ("dot(x)", 1)):
        own = run.columns[name]
        errors = np.array(
            [float(mpf(float(a)) - b[number]) for a, b in zip(own, exact, strict=True)]
        )
        if number:
            errors[np.isin(run.t, run.exempt)] = 0
        worst = max(worst, float(np.abs(errors).max()) / run.scales[name])
    return Result(strike, run.status, worst / strike.accuracy)


def kinked(strike: Strike) -> Result:
    """One run past a force with kinks."""
    run = strike.run(SHAPES[strike.kind][0])
    with mp.workdps(40):
        by = of_position if ALONG[strike.along][0] == "x" else of_time
        return judged(strike, run, by(strike, run.t.tolist()))


def smooth(strike: Strike) -> Result:
    """One run past a smooth pulse."""
    run = strike.run(PULSES[strike.kind])
    with mp.workdps(40):
        by = past_a_place if ALONG[strike.along][0] == "x" else past_a_moment
        return judged(strike, run, by(strike.kind, strike.numbers, run.t.tolist()))


def measured(
    of: Callable[[Strike], Result], todo: Sequence[Strike], processes: int
) -> list[Result]:
    """All results, in order."""
    if processes == 1:
        return list(map(of, todo))
    with ProcessPoolExecutor(processes) as pool:
        return list(pool.map(of, todo, chunksize=8))


def decade(strike: Strike) -> int:
    """The power of ten below the width."""
    return int(np.floor(np.log10(2 * strike.numbers["w"])))


def table(results: Sequence[Result]) -> str:
    """Runs and missed ones of each kind by decades of the width, as Markdown."""
    decades = range(int(WIDTHS[1]) - 1, int(WIDTHS[0]) - 1, -1)
    lines = ["| kind | of | " + " | ".join(f"1e{d}" for d in decades) + " |"]
    lines.append("|---" * (2 + len(decades)) + "|")
    kinds = dict.fromkeys((r.strike.kind, r.strike.along) for r in results)
    for kind, along in sorted(kinds):
        cells = []
        for d in decades:
            here = [
                r
                for r in results
                if (r.strike.kind, r.strike.along, decade(r.strike)) == (kind, along, d)
            ]
            cells.append(f"{sum(r.missed for r in here)} of {len(here)}")
        lines.append(f"| {kind} | {along} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Forces in narrow places.")
    parser.add_argument("--runs", type=int, default=1000, help="with kinks")
    parser.add_argument("--smooth", type=int, default=1000, help="of smooth pulses")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", dest="processes", type=int, default=1)
    given = parser.parse_args(arguments)
    rng = np.random.default_rng(given.seed)
    run = partial(measured, processes=given.processes)
    found = run(kinked, list(strikes(list(SHAPES), given.runs, rng)))
    for bad in (r for r in found if r.missed):
        print(bad, file=sys.stderr)
    wrong = sum(r.missed for r in found)
    if found:
        counts = Counter(r.status for r in found)
        print(f"With kinks: {len(found)} runs, {counts['ok']} ok, wrong {wrong}\n")
        print(table(found), flush=True)
    pulses = run(smooth, list(strikes(list(PULSES), given.smooth, rng, hosts=False)))
    if pulses:
        missed = sum(r.missed for r in pulses)
        print(f"\nSmooth: {len(pulses)} runs, missed {missed}\n")
        print(table(pulses))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
