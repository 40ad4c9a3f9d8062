"""Whether motion is right behind contacts that are only just met, or only just missed.

Particles are thrown up to ceilings and at walls that lie askew, swing on springs to a wall, pass
spheres, and hang on pendulums beside a stop, exactly as far as these or a little more or less: the
start is moved by up to 10,000 units in the last place, on both sides. There is an impact, or
none; a graze turns errors into their square root. Each run is compared with the exact motion in
60 digits, at every sample that is kept, each coordinate and rate within the accuracy of its scale.

    python benchmarks/soundness_grazes.py --runs 500 --seed 1 -j 2
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import mpmath
import numpy as np
from mpmath import mp, mpf

from lagrange_cli import loads

RESTITUTIONS = (0.0, 0.5, 0.9, 1.0)
ACCURACIES = tuple(10.0**-k for k in range(3, 10))
DIGITS = 60

#: Units in the last place by which starts are moved at most.
FARTHEST = 10_000

#: Coordinates and rates at a time.
Motion = Callable[[mpf], dict[str, mpf]]

CEILING = """
name: ceiling
parameters: {g: 10, h: 1, e: 1, v: 1, u: 0}
plane: xz
particles: {b: {mass: 1, position: [x, y, z]}}
constraints: {c: {unilateral: z <= h, restitution: e}}
potentials: {w: {gravity: g}}
initial: {x: 0, z: 0, dot(x): u, dot(z): v}
"""

#: The plane c·x + s·z = d, with a pull of size a away from it, and another along it.
WALL = """
name: wall
parameters: {a: 1, b: 0, c: 1, s: 0, d: 1, e: 1, vx: 1, vz: 0}
plane: xz
particles: {p: {mass: 1, position: [x, y, z]}}
constraints: {w: {unilateral: c*x + s*z <= d, restitution: e}}
forces: {pull: {on: p, force: [-a*c - b*s, 0, b*c - a*s]}}
initial: {x: 0, z: 0, dot(x): vx, dot(z): vz}
"""

SPRING = """
name: spring
parameters: {k: 1, d: 1, e: 1, v: 1}
particles: {p: {mass: 1, position: [x, 0, 0]}}
constraints: {w: {unilateral: x <= d, restitution: e}}
potentials: {s: k*x^2/2}
initial: {x: 0, dot(x): v}
"""

SPHERE = """
name: sphere
parameters: {R: 1, e: 1, x0: -2, b: 1, v: 1}
plane: xz
particles: {p: {mass: 1, position: [x, y, z]}}
constraints: {ball: {unilateral: x^2 + z^2 >= R^2, restitution: e}}
initial: {x: x0, z: b, dot(x): v, dot(z): 0}
"""

PENDULUM = """
name: pendulum
parameters: {m: 1, l: 1, g: 9.81, e: 1, stop: 1, th0: 1}
plane: xz
particles: {bob: {mass: m, position: [l*sin(th), 0, -l*cos(th)]}}
coordinates: [th]
constraints: {stop: {unilateral: th <= stop, restitution: e}}
potentials: {w: {gravity: g}}
initial: {th: th0}
"""


@dataclass(frozen=True)
class Graze:
    """A motion that all but meets a contact: its scene with its parameters, when it ends, the
    exact motion, and by how many units in the last place the start is moved."""

    kind: str
    text: str
    given: dict[str, float]
    until: float
    exact: Motion
    off: int


def _moved(value: float, units: int) -> float:
    return float(value + units * np.spacing(value))


def _off(rng: np.random.Generator) -> int:
    size = int(np.floor(10 ** rng.uniform(0, np.log10(FARTHEST + 1))))
    return int(rng.choice([-1, 0, 1], p=[0.45, 0.1, 0.45])) * size


def _restitution(rng: np.random.Generator) -> float:
    return float(rng.choice(RESTITUTIONS))


def _nice(rng: np.random.Generator, low: float, high: float) -> float:
    """A number as a user may write it, or any."""
    value = rng.uniform(low, high)
    return float(round(value, 2)) if rng.uniform() < 0.5 else float(value)


def _thrown(speed: mpf, pull: mpf, limit: mpf, e: mpf) -> Callable[[mpf], tuple[mpf, mpf]]:
    """Way and speed of what is thrown against a pull towards a limit, and bounces there."""
    square = speed**2 - 2 * pull * limit
    met = None if square < 0 else (speed - mpmath.sqrt(square)) / pull

    def at(t: mpf) -> tuple[mpf, mpf]:
        if met is None or t <= met:
            return speed * t - pull * t**2 / 2, speed - pull * t
        since, back = t - met, -e * mpmath.sqrt(square)
        return limit + back * since - pull * since**2 / 2, back - pull * since

    return at


def ceiling(rng: np.random.Generator) -> Graze:
    g, h, e, u = _nice(rng, 1, 20), _nice(rng, 0.1, 3), _restitution(rng), _nice(rng, -2, 2)
    off = _off(rng)
    v = _moved(float(np.sqrt(2 * g * h)), off)
    up = _thrown(mpf(v), mpf(g), mpf(h), mpf(e))

    def exact(t: mpf) -> dict[str, mpf]:
        z, rate = up(t)
        return {"x": u * t, "z": z, "dot(x)": mpf(u), "dot(z)": rate}

    given = {"g": g, "h": h, "e": e, "v": v, "u": u}
    return Graze("ceiling", CEILING, given, 2 * v / g * rng.uniform(0.6, 1.2), exact, off)


def wall(rng: np.random.Generator) -> Graze:
    a, b, e, d = _nice(rng, 0.5, 5), _nice(rng, -2, 2), _restitution(rng), _nice(rng, 0.2, 2)
    angle, along, off = rng.uniform(0, 2 * np.pi), _nice(rng, -2, 2), _off(rng)
    c, s = float(np.cos(angle)), float(np.sin(angle))
    fast = float(np.sqrt(2 * a * d))
    vx, vz = _moved(fast * c - along * s, off), fast * s + along * c
    given = {"a": a, "b": b, "c": c, "s": s, "d": d, "e": e, "vx": vx, "vz": vz}
    with mp.workdps(DIGITS):
        # The normal is not quite of length 1, nor is the gap then a distance.
        ca, sa, square = mpf(c), mpf(s), mpf(c) ** 2 + mpf(s) ** 2
        towards = _thrown(ca * vx + sa * vz, a * square, mpf(d), mpf(e))
        across = -sa * vx + ca * vz

    def exact(t: mpf) -> dict[str, mpf]:
        n, rate = towards(t)
        m, turn = across * t + b * square * t**2 / 2, across + b * square * t
        return {
            "x": (ca * n - sa * m) / square,
            "z": (sa * n + ca * m) / square,
            "dot(x)": (ca * rate - sa * turn) / square,
            "dot(z)": (sa * rate + ca * turn) / square,
        }

    return Graze("wall", WALL, given, fast / a * rng.uniform(1.2, 2.4), exact, off)


def spring(rng: np.random.Generator) -> Graze:
    k, d, e, off = _nice(rng, 0.5, 40), _nice(rng, 0.1, 2), _restitution(rng), _off(rng)
    v = _moved(float(np.sqrt(k) * d), off)
    with mp.workdps(DIGITS):
        omega = mpmath.sqrt(mpf(k))
        reach = mpf(v) / omega

        def swing(t: mpf, size: mpf) -> tuple[mpf, mpf]:
            return size * mpmath.sin(omega * t), size * omega * mpmath.cos(omega * t)

        met = None if reach < d else mpmath.asin(d / reach) / omega

        def exact(t: mpf) -> dict[str, mpf]:
            if met is None or t <= met:
                x, rate = swing(t, reach)
                return {"x": x, "dot(x)": rate}
            x, rate = mpf(d), -mpf(e) * swing(met, reach)[1]
            c, s, since = mpmath.cos(omega * (t - met)), mpmath.sin(omega * (t - met)), 0
            return {
                "x": x * c + rate / omega * s + since,
                "dot(x)": rate * c - x * omega * s,
            }

        # Before the wall is met again.
        until = float(mpmath.pi / omega) * rng.uniform(0.6, 2.2)
    return Graze("spring", SPRING, {"k": k, "d": d, "e": e, "v": v}, until, exact, off)


def sphere(rng: np.random.Generator) -> Graze:
    radius, e, v = _nice(rng, 0.3, 2), _restitution(rng), _nice(rng, 0.3, 3)
    x0, off = -radius * rng.uniform(1.1, 3), _off(rng)
    b = _moved(radius, off)
    square = mpf(radius) ** 2 - mpf(b) ** 2
    with mp.workdps(DIGITS):
        square = mpf(radius) ** 2 - mpf(b) ** 2
        met = None if square < 0 else (-mpmath.sqrt(square) - mpf(x0)) / v

    def exact(t: mpf) -> dict[str, mpf]:
        if met is None or t <= met:
            return {"x": mpf(x0) + v * t, "z": mpf(b), "dot(x)": mpf(v), "dot(z)": mpf(0)}
        x = -mpmath.sqrt(square)
        normal = -(1 + mpf(e)) * v * x / mpf(radius) ** 2
        vx, vz = v + normal * x, normal * b
        since = t - met
        return {"x": x + vx * since, "z": b + vz * since, "dot(x)": vx, "dot(z)": vz}

    until = -x0 / v * rng.uniform(1.3, 3)
    return Graze(
        "sphere", SPHERE, {"R": radius, "e": e, "x0": x0, "b": b, "v": v}, until, exact, off
    )


def pendulum(rng: np.random.Generator) -> Graze:
    length, e, stop, off = _nice(rng, 0.3, 3), _restitution(rng), _nice(rng, 0.2, 2.5), _off(rng)
    th0, g = _moved(-stop, off), 9.81
    with mp.workdps(DIGITS):
        omega = mpmath.sqrt(mpf(g) / length)
        k = mpmath.sin(mpf(-th0) / 2)
        quarter = mpmath.ellipk(k**2)

        def swing(u: mpf, k: mpf) -> tuple[mpf, mpf]:
            """Angle and rate, u quarters of a swing from the lowest place on."""
            m = k**2
            angle = 2 * mpmath.asin(k * mpmath.ellipfun("sn", u, m=m))
            return angle, 2 * k * omega * mpmath.ellipfun("cn", u, m=m)

        def phase(angle: mpf, k: mpf) -> mpf:
            return mpmath.ellipf(mpmath.asin(mpmath.sin(angle / 2) / k), k**2)

        struck = -mpf(th0) >= stop
        if struck:
            at = phase(mpf(stop), k)
            met = (at + quarter) / omega
            rate = -mpf(e) * swing(at, k)[1]
            # The same energy, as half an angle's sine at rest.
            after = mpmath.sqrt(mpmath.sin(mpf(stop) / 2) ** 2 + (rate / (2 * omega)) ** 2)
            began = phase(mpf(stop), after) if rate else mpmath.ellipk(after**2)
            began = 2 * mpmath.ellipk(after**2) - began

        def exact(t: mpf) -> dict[str, mpf]:
            if not struck or t <= met:
                angle, speed = swing(omega * t - quarter, k)
            else:
                angle, speed = swing(began + omega * (t - met), after)
            return {"th": angle, "dot(th)": speed}

        until = float(quarter / omega) * rng.uniform(2.2, 4.2)
    given = {"l": length, "e": e, "stop": stop, "th0": th0}
    return Graze("pendulum", PENDULUM, given, until, exact, off)


KINDS: dict[str, Callable[[np.random.Generator], Graze]] = {
    "ceiling": ceiling,
    "wall": wall,
    "spring": spring,
    "sphere": sphere,
    "pendulum": pendulum,
}


@dataclass(frozen=True)
class Result:
    """What became of a graze: its status, how much was kept, the largest error in accuracies."""

    kind: str
    given: dict[str, float]
    off: int
    accuracy: float
    samples: int
    status: str
    reason: str
    kept: float
    events: int
    excess: float

    @property
    def wrong(self) -> bool:
        return not self.excess <= 1


def result(kind: str, seed: Sequence[int]) -> Result:
    """A random graze of a kind, compared sample by sample."""
    rng = np.random.default_rng(seed)
    with mp.workdps(DIGITS):
        graze = KINDS[kind](rng)
    accuracy, samples = float(rng.choice(ACCURACIES)), int(rng.choice([5, 21, 101]))
    run = (
        loads(graze.text, parameters=graze.given)
        .derive()
        .simulate(until=graze.until, accuracy=accuracy, samples=samples)
    )
    excess, exempt = 0.0, set(run.exempt)
    with mp.workdps(DIGITS):
        for number, t in enumerate(run.t.tolist()):
            for name, truth in graze.exact(mpf(t)).items():
                if t in exempt and name.startswith("dot"):
                    continue
                error = abs(mpf(float(run.columns[name][number])) - truth)
                excess = max(excess, float(error / (accuracy * mpf(run.scales[name]))))
    kept = float(run.t[-1] / graze.until)
    found = (run.status, run.reason, kept, len(run.events), excess)
    return Result(kind, graze.given, graze.off, accuracy, samples, *found)


def results(kind: str, runs: int, seed: int, jobs: int = 1) -> list[Result]:
    """Random grazes of one kind."""
    seeds = [(seed, list(KINDS).index(kind), k) for k in range(runs)]
    if jobs == 1:
        return [result(kind, of) for of in seeds]
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(partial(result, kind), seeds))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Contacts that are only just met, or missed.")
    parser.add_argument("--runs", type=int, default=100, help="in all")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    given = parser.parse_args(arguments)
    columns = "held, struck | held, not struck | ended at the graze | ended where errors grow"
    print(f"| kind | runs | {columns} | wrong |")
    print("|---|---|---|---|---|---|---|")
    failed = 0
    for kind in given.kinds:
        found = results(kind, given.runs // len(given.kinds), given.seed, given.jobs)
        for bad in (r for r in found if r.wrong):
            print(bad, file=sys.stderr)
        counts = Counter(
            ("struck" if r.events else "free")
            if r.status == "ok"
            else "graze"
            if "slightly" in r.reason
            else "other"
            for r in found
        )
        wrong = sum(r.wrong for r in found)
        row = (len(found), *(counts[name] for name in ("struck", "free", "graze", "other")), wrong)
        print(f"| {kind} | {' | '.join(map(str, row))} |", flush=True)
        failed += wrong
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
