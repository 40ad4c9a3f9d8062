"""Whether coordinates are right where a motion all but meets their singular places.

Free particles, particles on springs and on spheres, and free tops, also as bodies that turn, pass
the origin of polar coordinates, the axis of spherical ones, the vertical of Euler's angles at
distances from 1e-3 down to the smallest number there is, and through them. There the true angles
turn by half a turn within no time. Runs are compared with closed forms in 50 digits, every sample
that is kept: each coordinate and rate within the accuracy of its scale. Angles of bodies that a run
calls one choice of several are compared by the axis that they give.

    python benchmarks/soundness_passages.py --runs 200 --seed 1
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import mpmath
import numpy as np
from mpmath import mp, mpf

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import Trajectory

ACCURACIES = (1e-3, 1e-6, 1e-9)

#: The largest and the smallest distance, and the part of runs that go through exactly.
FARTHEST, NEAREST, THROUGH = -3.0, -300.0, 0.05

#: Samples that are compared at most, the last one among them.
COMPARED = 40

#: Coordinates of a time.
Motion = Callable[[mpf], dict[str, mpf]]

POLAR = """
name: polar
parameters: {k: K}
particles: {b: {mass: 1, position: [r*cos(th), r*sin(th), 0]}}
coordinates: [r, th]
potentials: {spring: k*r^2/2}
"""

#: The same by names, of which there is a form with multipliers.
NAMED = """
name: named
parameters: {k: K, m: 1}
plane: xy
particles: {b: {mass: m, position: [x, y, z]}}
coordinates: [r, th]
definitions: {x: r*cos(th), y: r*sin(th)}
potentials: {spring: k*(x^2 + y^2)/2}
"""

SPHERE = """
name: sphere
parameters: {m: 1}
particles: {b: {mass: m, position: [x, y, z]}}
coordinates: [th, ph]
definitions: {x: sin(th)*cos(ph), y: sin(th)*sin(ph), z: cos(th)}
"""

SPACE = """
name: space
particles: {b: {mass: 1, position: [r*sin(th)*cos(ph), r*sin(th)*sin(ph), r*cos(th)]}}
coordinates: [r, th, ph]
"""

TOP = """
name: top
parameters: {A: 1, C: 0.5}
coordinates: [ph, th, ps]
kinetic:
  turning: A/2*(dot(th)^2 + sin(th)^2*dot(ph)^2) + C/2*(dot(ps) + cos(th)*dot(ph))^2
"""

BODY = """
name: body
parameters: {A: 1, C: 0.5}
bodies: {top: {turn: [z: ph, y: th, z: ps], mass: 1, inertia: [A, A, C]}}
coordinates: [ph, th, ps]
"""


def _around(x0: mpf, dx: mpf, dy: mpf, omega: mpf, t: mpf) -> tuple[mpf, mpf, mpf]:
    """Distance, continuous angle and its sine of x0 cos ωt + (dx, dy)/ω sin ωt, from (x0, 0)."""
    halves = int(mpmath.floor(omega * t / mp.pi))
    sign = (-1) ** halves
    c, s = mpmath.cos(omega * t), mpmath.sin(omega * t)
    x, y = x0 * c + dx / omega * s, dy / omega * s
    if dy == 0:
        return x, mpf(0), y
    angle = mpmath.sign(dy) * (halves * mp.pi + mpmath.atan2(abs(y), x * sign))
    return mpmath.hypot(x, y), angle, y


def _straight(x0: mpf, dx: mpf, dy: mpf, t: mpf) -> tuple[mpf, mpf]:
    """Distance and continuous angle of (x0 + dx t, dy t), from (x0, 0)."""
    x, y = x0 + dx * t, dy * t
    return (x, mpf(0)) if dy == 0 else (mpmath.hypot(x, y), mpmath.atan2(y, x))


@dataclass(frozen=True)
class Passage:
    """A scene with its start, its duration and the exact motion; how near it comes."""

    kind: str
    text: str
    initial: dict[str, float]
    until: float
    exact: Motion
    distance: float


def _distance(rng: np.random.Generator) -> float:
    """Zero now and then, else a random power of ten; down to the smallest numbers."""
    if rng.random() < THROUGH:
        return 0.0
    lowest = NEAREST if rng.random() < 0.5 else -20.0
    distance = float(10 ** rng.uniform(lowest, FARTHEST))
    return 5e-324 if rng.random() < 0.02 else distance


def polar(rng: np.random.Generator) -> Passage:
    """Past the origin once, or twice a period on a spring."""
    d, sign = _distance(rng), float(rng.choice([-1, 1]))
    r, th, v = (float(rng.uniform(*bounds)) for bounds in ((0.3, 2), (-3, 3), (0.5, 2)))
    k = float(rng.choice([0.0, 0.0, 4.0, rng.uniform(1, 400)]))
    given = {"r": r, "th": th, "dot(r)": -v, "dot(th)": sign * d * v / r**2}
    dth = mpf(given["dot(th)"])

    def exact(t: mpf) -> dict[str, mpf]:
        if k == 0:
            distance, angle = _straight(mpf(r), mpf(-v), r * dth, t)
        else:
            distance, angle, _ = _around(mpf(r), mpf(-v), r * dth, mpmath.sqrt(mpf(k)), t)
        return {"r": distance, "th": th + angle}

    text = (POLAR if rng.random() < 0.6 else NAMED).replace("K", repr(k))
    until = float(rng.uniform(1, 3)) * (r / v if k == 0 else 1.0)
    return Passage("polar" if "named" not in text else "named", text, given, until, exact, d)


def sphere(rng: np.random.Generator) -> Passage:
    """Along a great circle past both poles."""
    d, sign = _distance(rng), float(rng.choice([-1, 1]))
    th, ph, v = (float(rng.uniform(*bounds)) for bounds in ((0.3, 2.8), (-3, 3), (-3, 3)))
    rate = sign * d * v / np.sin(th) ** 2
    given = {"th": th, "ph": ph, "dot(th)": v, "dot(ph)": float(rate)}
    sine, cosine, dph = mpmath.sin(mpf(th)), mpmath.cos(mpf(th)), mpf(given["dot(ph)"])
    omega = mpmath.sqrt(mpf(v) ** 2 + (sine * dph) ** 2)

    def exact(t: mpf) -> dict[str, mpf]:
        distance, angle, _ = _around(sine, cosine * v, sine * dph, omega, t)
        z = cosine * mpmath.cos(omega * t) - sine * v / omega * mpmath.sin(omega * t)
        polar_angle = mpmath.atan2(distance, z) if dph else th + v * t
        return {"th": polar_angle, "ph": ph + angle}

    return Passage("sphere", SPHERE, given, float(rng.uniform(1, 4)), exact, d)


def space(rng: np.random.Generator) -> Passage:
    """Along a straight line past the axis of spherical coordinates, and perhaps the origin."""
    d, sign = _distance(rng), float(rng.choice([-1, 1]))
    r, th, ph, v = (
        float(rng.uniform(*bounds)) for bounds in ((0.3, 2), (0.5, 2.6), (-3, 3), (0.5, 2))
    )
    # At the axis after r sin(th)/v, at the height where z is then.
    height = float(rng.choice([1.0, -1.0, 0.0]) * 10 ** rng.uniform(-12, 0))
    sine, cosine = float(np.sin(th)), float(np.cos(th))
    along, rise = -v, (height - r * cosine) / (r * sine / v)
    given = {
        "r": r,
        "th": th,
        "ph": ph,
        "dot(r)": along * sine + rise * cosine,
        "dot(th)": (along * cosine - rise * sine) / r,
        "dot(ph)": sign * d * v / (r * sine) ** 2,
    }
    s, c = mpmath.sin(mpf(th)), mpmath.cos(mpf(th))
    dr, dth, dph = (mpf(given[name]) for name in ("dot(r)", "dot(th)", "dot(ph)"))

    def exact(t: mpf) -> dict[str, mpf]:
        distance, angle = _straight(r * s, dr * s + r * c * dth, r * s * dph, t)
        z = r * c + (dr * c - r * s * dth) * t
        if dph:
            return {
                "r": mpmath.hypot(distance, z),
                "th": mpmath.atan2(distance, z),
                "ph": ph + angle,
            }
        x = r * s + (dr * s + r * c * dth) * t
        # In the plane of the meridian the angle goes on beyond the axis, as th does.
        turn = mpmath.atan2(r * r * dth * t, r * r + r * dr * t)
        return {"r": mpmath.hypot(x, z), "th": th + turn, "ph": mpf(ph)}

    return Passage("space", SPACE, given, float(rng.uniform(0.5, 3)) * r * sine / v, exact, d)


def top(rng: np.random.Generator) -> Passage:
    """A free top whose axis goes round its angular momentum, past the vertical."""
    d, sign = _distance(rng), float(rng.choice([-1, 1]))
    th, ph, v = (float(rng.uniform(*bounds)) for bounds in ((0.5, 2.5), (-3, 3), (-2, -0.5)))
    spin = float(rng.choice([0.0, rng.uniform(-3, 3)]))
    rate = float(sign * d * -v / np.sin(th) ** 2)
    # Spin about the axis moves the passage away; without it the axis goes along a great circle.
    given = {"ph": ph, "th": th, "ps": 0.3, "dot(th)": v, "dot(ph)": rate}
    given["dot(ps)"] = spin - float(np.cos(th)) * rate
    sine, cosine, dph = mpmath.sin(mpf(th)), mpmath.cos(mpf(th)), mpf(rate)
    about = mpf(given["dot(ps)"]) + cosine * dph
    # Angular momentum over A, in the frame turned by ph: of the axis, and across it.
    axis = mpmath.matrix([sine, 0, cosine])
    across = mpmath.matrix([cosine, 0, -sine])
    velocity = across * mpf(v) + mpmath.matrix([0, 1, 0]) * (sine * dph)
    momentum = _cross(axis, velocity) + axis * (about / 2)
    omega = mpmath.norm(momentum)
    unit = momentum / omega

    def exact(t: mpf) -> dict[str, mpf]:
        if not dph and not about:
            return {"th": th + v * t, "ph": mpf(ph)}
        turned = _rotated(axis, unit, omega * t)
        # Its azimuth is continuous while it keeps away from the vertical: told from many times.
        angle, before = mpf(0), axis
        steps = 64
        for k in range(1, steps + 1):
            now = _rotated(axis, unit, omega * t * k / steps)
            cross, dot = before[0] * now[1] - before[1] * now[0], before[0] * now[0]
            angle += mpmath.atan2(cross, dot + before[1] * now[1])
            before = now
        return {"th": mpmath.acos(turned[2]), "ph": ph + angle}

    return Passage("top", TOP, given, float(rng.uniform(0.3, 1.5)), exact, d)


def body(rng: np.random.Generator) -> Passage:
    """A top as a body, which goes on by a quaternion where its angles end."""
    return replace(top(rng), kind="body", text=BODY)


def _cross(a: mpmath.matrix, b: mpmath.matrix) -> mpmath.matrix:
    return mpmath.matrix(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def _rotated(a: mpmath.matrix, unit: mpmath.matrix, angle: mpf) -> mpmath.matrix:
    """A vector turned about a unit vector (Rodrigues)."""
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    dot = sum(a[i] * unit[i] for i in range(3))
    return a * c + _cross(unit, a) * s + unit * (dot * (1 - c))


KINDS: dict[str, Callable[[np.random.Generator], Passage]] = {
    "polar": polar,
    "sphere": sphere,
    "space": space,
    "top": top,
    "body": body,
}


@dataclass(frozen=True)
class Result:
    """What became of a passage: its status, how much was kept, the largest error in accuracies."""

    passage: Passage
    accuracy: float
    status: str
    kept: float
    excess: float
    worst: str

    @property
    def wrong(self) -> bool:
        return not self.excess <= 1


def simulated(passage: Passage, accuracy: float, samples: int) -> Result:
    """One run, compared sample by sample."""
    state = ", ".join(f"{name}: {value!r}" for name, value in passage.initial.items())
    text = passage.text + f"initial: {{{state}}}\n"
    try:
        run = loads(text).derive().simulate(until=passage.until, accuracy=accuracy, samples=samples)
    except InputError:
        return Result(passage, accuracy, "refused", 0.0, 0.0, "")
    name, excess = _worst(passage, run, accuracy)
    return Result(passage, accuracy, run.status, float(run.t[-1] / passage.until), excess, name)


def _worst(passage: Passage, run: Trajectory, accuracy: float) -> tuple[str, float]:
    """The coordinate that is the farthest off, in accuracies of its scale."""
    with mp.workdps(50):
        numbers = np.unique(np.linspace(0, len(run.t) - 1, COMPARED).astype(int))
        rows = [passage.exact(mpf(t)) for t in run.t[numbers].tolist()]
        true = {name: [row[name] for row in rows] for name in rows[0]}
        columns = {name: run.columns[name][numbers] for name in true}
        if passage.kind == "body" and any("one choice" in str(said) for said in run.remarks):
            columns, true = _axis(columns), _axis(true)
        found = {}
        for name, values in true.items():
            own = columns[name]
            size = max(abs(x - values[0]) for x in values)
            scale = max(size, mpf("1e-3")) if name == "r" else mpf(1)
            errors = [
                abs(mpf(a) - b) / scale
                for a, b in zip(own, values, strict=True)
                if mpmath.isfinite(a)
            ]
            found[name] = float(max(errors, default=mpf(0)) / accuracy)
    worst = max(found, key=lambda name: found[name])
    return worst, found[worst]


def _axis(angles: Mapping[str, Sequence[float | mpf]]) -> dict[str, list[mpf]]:
    """The axis of a top, by its angles."""
    pairs = [(mpf(th), mpf(ph)) for th, ph in zip(angles["th"], angles["ph"], strict=True)]
    return {
        "x": [mpmath.sin(th) * mpmath.cos(ph) for th, ph in pairs],
        "y": [mpmath.sin(th) * mpmath.sin(ph) for th, ph in pairs],
        "z": [mpmath.cos(th) for th, _ in pairs],
    }


def results(
    kind: str, runs: int, rng: np.random.Generator, accuracies: Sequence[float] = ACCURACIES
) -> Iterator[Result]:
    """Random passages of one kind."""
    for _ in range(runs):
        passage, accuracy = KINDS[kind](rng), float(rng.choice(accuracies))
        yield simulated(passage, accuracy, int(rng.choice([2, 11, 102, 500])))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Passages of singular places.")
    parser.add_argument("--runs", type=int, default=50, help="of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    print("| kind | runs | ok | promise ends | refused | wrong |")
    print("|---|---|---|---|---|---|")
    failed = 0
    for kind in given.kinds:
        found = list(results(kind, given.runs, np.random.default_rng(given.seed)))
        for bad in (r for r in found if r.wrong):
            print(bad, file=sys.stderr)
        counts = Counter(r.status for r in found)
        ended = len(found) - counts["ok"] - counts["refused"]
        wrong = sum(r.wrong for r in found)
        row = (kind, len(found), counts["ok"], ended, counts["refused"], wrong)
        print(f"| {' | '.join(map(str, row))} |", flush=True)
        failed += wrong
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
