"""Motions that doubles cannot hold to 1e-9 until their end: what `--accuracy` makes of them.

Close passages, chaos and an unstable equilibrium amplify the last place of a double beyond the
accuracy. References are solutions in closed form (Kepler's equation, Jacobi's elliptic functions)
and otherwise Taylor series that heyoka compiles, of equations written by hand, in 60 digits.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Any

import mpmath
from calibration_report import machine
from mpmath import mpf

from lagrange_cli import loads
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.simulation import simulate

#: Digits of references, and the bits that heyoka takes for them.
DIGITS, BITS = 60, 200

#: Every so many samples are compared, and the last.
EVERY = 5

ACCURACY = 1e-9

KEPLER = """
name: kepler
parameters: {{m: 1, mu: 1, e: {e}}}
particles: {{body: {{mass: m, position: [x, y, 0]}}}}
coordinates: [x, y]
potentials: {{gravity: -mu*m/sqrt(x^2 + y^2)}}
initial: {{x: 1 - e, y: 0, dot(x): 0, dot(y): sqrt((1 + e)/(1 - e))}}
simulate: {{until: 2*pi*{orbits}}}
"""

DOUBLE_PENDULUM = """
name: double_pendulum
parameters: {m: 1, l: 1, g: 9.81}
particles:
  one: {mass: m, position: [l*sin(a), -l*cos(a), 0]}
  two: {mass: m, position: [l*sin(a) + l*sin(b), -l*cos(a) - l*cos(b), 0]}
coordinates: [a, b]
potentials: {weight: m*g*(y_one + y_two)}
initial: {a: 2.0, b: 2.5, dot(a): 0, dot(b): 0}
simulate: {until: 30}
"""

PENDULUM = """
name: pendulum
parameters: {m: 1, l: 1, g: 9.81}
particles: {bob: {mass: m, position: [l*sin(a), -l*cos(a), 0]}}
coordinates: [a]
potentials: {weight: m*g*y_bob}
initial: {a: pi - 1e-9, dot(a): 0}
simulate: {until: 40}
"""

HENON_HEILES = """
name: henon_heiles
parameters: {m: 1}
particles: {body: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {well: (x^2 + y^2)/2 + x^2*y - y^3/3}
initial: {x: 0, y: 0.1, dot(x): sqrt(1/3 - 0.01 + 0.002/3), dot(y): 0}
simulate: {until: 200}
"""

PYTHAGOREAN = """
name: pythagorean
particles:
  a: {mass: 3, position: [xa, ya, 0]}
  b: {mass: 4, position: [xb, yb, 0]}
  c: {mass: 5, position: [xc, yc, 0]}
coordinates: [xa, ya, xb, yb, xc, yc]
potentials:
  ab: -12/sqrt((xa - xb)^2 + (ya - yb)^2)
  ac: -15/sqrt((xa - xc)^2 + (ya - yc)^2)
  bc: -20/sqrt((xb - xc)^2 + (yb - yc)^2)
initial: {xa: 1, ya: 3, xb: -2, yb: -1, xc: 1, yc: -1, dot(xa): 0, dot(ya): 0, dot(xb): 0,
          dot(yb): 0, dot(xc): 0, dot(yc): 0}
simulate: {until: 70}
"""

#: From a time, at which the motion is asked for, to its state.
Solution = Callable[[mpf], Sequence[mpf]]


@dataclass(frozen=True)
class Motion:
    """A scene, and what makes its exact solution; ascending times are asked for."""

    title: str
    scene: str
    solution: Callable[[], Solution]


def kepler(text: str) -> Solution:
    """Kepler's equation; the eccentricity is a text that mpmath evaluates exactly enough."""
    e = 1 - mpf(text.removeprefix("1 - ")) if text.startswith("1 - ") else mpf(text)

    def at(t: mpf) -> Sequence[mpf]:
        turns = mpmath.floor(t / (2 * mpmath.pi) + mpf(1) / 2)
        mean = t - 2 * mpmath.pi * turns
        anomaly = _root(lambda x: x - e * mpmath.sin(x) - mean, lambda x: 1 - e * mpmath.cos(x))
        sine, cosine = mpmath.sin(anomaly), mpmath.cos(anomaly)
        root, rate = mpmath.sqrt(1 - e * e), 1 / (1 - e * cosine)
        return cosine - e, root * sine, -sine * rate, root * cosine * rate

    return at


def _root(function: Callable[[mpf], mpf], slope: Callable[[mpf], mpf]) -> mpf:
    """The zero between −4 and 4 of a function that rises: bisection, then Newton's method."""
    low, high = mpf(-4), mpf(4)
    while high - low > mpf(10) ** -25:
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    x = (low + high) / 2
    for _ in range(4):
        x -= function(x) / slope(x)
    return x


def pendulum() -> Solution:
    """sin(θ/2) = k sn(K − ωt), with k the sine of half the amplitude."""
    rate, modulus = mpmath.sqrt(mpf("9.81")), mpmath.cos(mpf("1e-9") / 2)
    quarter = mpmath.ellipk(modulus**2)

    def at(t: mpf) -> Sequence[mpf]:
        phase = quarter - rate * t
        sn, cn = (mpmath.ellipfun(name, phase, k=modulus) for name in ("sn", "cn"))
        return 2 * mpmath.asin(modulus * sn), -2 * modulus * rate * cn

    return at


def series(
    equations: Callable[[Any, Sequence[Any], Sequence[Any]], Sequence[Any]], start: Sequence[mpf]
) -> Solution:
    """Taylor series by heyoka; ``equations`` make accelerations of its expressions."""
    import heyoka as hy

    half = len(start) // 2
    q = hy.make_vars(*(f"q{k}" for k in range(half)))
    v = hy.make_vars(*(f"v{k}" for k in range(half)))
    q, v = ([q], [v]) if half == 1 else (q, v)
    pairs = [*zip(q, v, strict=True), *zip(v, equations(hy, q, v), strict=True)]
    state = [_real(hy, x) for x in start]
    adaptive = hy.taylor_adaptive(pairs, state=state, fp_type=hy.real, prec=BITS)

    def at(t: mpf) -> Sequence[mpf]:
        adaptive.propagate_until(_real(hy, t))
        return [mpf(str(x)) for x in adaptive.state]

    return at


def _real(hy: Any, x: mpf) -> Any:
    return hy.real(mpmath.nstr(x, DIGITS + 5), BITS)


def double_pendulum(hy: Any, q: Sequence[Any], v: Sequence[Any]) -> Sequence[Any]:
    """Accelerations of two equal bobs on rods of length 1."""
    (a, b), (u, w), g = q, v, hy.expression(_real(hy, mpf("9.81")))
    sine, cosine = hy.sin(a - b), hy.cos(a - b)
    one = -w * w * sine - 2.0 * g * hy.sin(a)
    two = u * u * sine - g * hy.sin(b)
    below = 2.0 - cosine * cosine
    return (one - cosine * two) / below, (2.0 * two - cosine * one) / below


def henon_heiles(hy: Any, q: Sequence[Any], v: Sequence[Any]) -> Sequence[Any]:
    x, y = q
    return -x - 2.0 * x * y, y * y - y - x * x


def pythagorean(hy: Any, q: Sequence[Any], v: Sequence[Any]) -> Sequence[Any]:
    places = [q[2 * k : 2 * k + 2] for k in range(3)]
    masses, pushes = (3.0, 4.0, 5.0), [0.0 * q[0] for _ in q]
    for i, j in combinations(range(3), 2):
        x, y = (places[j][k] - places[i][k] for k in range(2))
        cube = (x * x + y * y) ** -1.5
        for k, way in enumerate((x, y)):
            pushes[2 * i + k] += masses[j] * way * cube
            pushes[2 * j + k] -= masses[i] * way * cube
    return pushes


def motions() -> list[Motion]:
    """All of them."""
    orbits = [
        Motion(
            f"Kepler, e = {e}, orbits: {count}",
            KEPLER.format(e=e, orbits=count),
            partial(kepler, e),
        )
        for e in ("0.99", "0.9999", "1 - 1e-6")
        for count in (1, 10)
    ]
    speed = mpmath.sqrt(mpf(1) / 3 - mpf("0.01") + mpf("0.002") / 3)
    four = [mpf(2), mpf("2.5"), mpf(0), mpf(0)]
    wells = [mpf(0), mpf("0.1"), speed, mpf(0)]
    three = [mpf(x) for x in (1, 3, -2, -1, 1, -1, 0, 0, 0, 0, 0, 0)]
    return [
        *orbits,
        Motion(
            "double pendulum to t = 30", DOUBLE_PENDULUM, partial(series, double_pendulum, four)
        ),
        Motion("pendulum 1e-9 from the top, to t = 40", PENDULUM, pendulum),
        Motion("Hénon–Heiles to t = 200", HENON_HEILES, partial(series, henon_heiles, wells)),
        Motion(
            "Pythagorean three bodies to t = 70", PYTHAGOREAN, partial(series, pythagorean, three)
        ),
    ]


def error(trajectory: Trajectory, model: Model, solution: Solution) -> float:
    """The largest error over its scale at some of the samples that are kept."""
    last = len(trajectory.t) - 1
    worst = 0.0
    for k in [*range(0, last, EVERY), last]:
        exact = solution(mpf(float(trajectory.t[k])))
        for name, value in zip(model.state_names, exact, strict=True):
            off = abs(mpf(float(trajectory.columns[name][k])) - value)
            worst = max(worst, float(off) / trajectory.scales[name])
    return worst


def row(motion: Motion) -> tuple[str, bool]:
    """A line of the table, and whether nothing is promised that is not so."""
    model = model_of(loads(motion.scene).derive().equations)
    simulate(model, accuracy=ACCURACY)  # compiles
    started = time.perf_counter()
    trajectory = simulate(model, accuracy=ACCURACY)
    seconds = time.perf_counter() - started
    off = error(trajectory, model, motion.solution())
    held = f"{trajectory.holds_until:.6g}" + ("" if trajectory.status == "ok" else " (refused)")
    ran = f"{trajectory.method}, {trajectory.implementation}"
    estimated = trajectory.estimated or 0.0
    cells = (motion.title, held, f"{estimated:.0e}", f"{off:.0e}", f"{seconds:.2f}", ran)
    return "| " + " | ".join(cells) + " |", off <= ACCURACY


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="parts of titles; by default all")
    names = parser.parse_args(arguments).names
    right = True
    with mpmath.workdps(DIGITS):
        print(machine())
        print("| motion | holds until | estimated | error made | seconds | by |")
        print("|---|---|---|---|---|---|")
        for motion in motions():
            if not names or any(name in motion.title for name in names):
                line, good = row(motion)
                right = right and good
                print(line, flush=True)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
