"""Exact motions in 40 digits and more, from the textbook's equations and the doubles given.

Closed forms where there are any; else extrapolation of the modified midpoint rule (Gragg 1965;
Bulirsch and Stoer 1966; Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*,
II.9) in mpmath. Nothing here is shared with the program: not the equations, not the method, not
the arithmetic.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from mpmath import mp, mpf

__all__ = [
    "DIGITS",
    "chain",
    "double_pendulum",
    "extrapolated",
    "kepler",
    "pendulum",
    "spherical_pendulum",
    "springs",
    "stored",
]

DIGITS = 40

Row = list[mpf]
Motion = Callable[[Sequence[float]], list[Row]]

#: Steps of the midpoint rule within one of the extrapolation.
SEQUENCE = tuple(range(2, 34, 2))


def extrapolated(
    slopes: Callable[[mpf, Row], Row],
    start: Sequence[float],
    times: Sequence[float],
    tolerance: float,
) -> list[Row]:
    """States at the times, the first of which is the start; ``tolerance`` is that of one step."""
    with mp.workdps(DIGITS):
        t, y = mpf(times[0]), [mpf(x) for x in start]
        step, rows = (mpf(times[-1]) - t) / 64, [list(y)]
        for end in map(mpf, times[1:]):
            while t < end:
                h = min(step, end - t)
                found, error = _step(slopes, t, y, h, mpf(tolerance))
                if error > 1:
                    step = h / 3
                    continue
                t, y = (end, found) if h == end - t else (t + h, found)
                step = max(step, h) if error > mpf(10) ** -4 else h * mpf("1.5")
            rows.append(list(y))
    return rows


def _step(
    slopes: Callable[[mpf, Row], Row], t: mpf, y: Row, h: mpf, tolerance: mpf
) -> tuple[Row, mpf]:
    """The state after a step and its error over the tolerance."""
    table: list[Row] = []
    slope, error = slopes(t, y), mpf("inf")
    for k, n in enumerate(SEQUENCE):
        row = _midpoint(slopes, t, y, slope, h, n)
        new = [row]
        for j in range(k):
            ratio = (mpf(n) / SEQUENCE[k - 1 - j]) ** 2 - 1
            row = [a + (a - b) / ratio for a, b in zip(new[-1], table[j], strict=True)]
            new.append(row)
        if k > 2:
            size = [max(abs(a), abs(b)) + mpf(10) ** -30 for a, b in zip(y, new[-1], strict=True)]
            off = (abs(a - b) / s for a, b, s in zip(new[-1], new[-2], size, strict=True))
            error = max(off) / tolerance
            if error < 1:
                return new[-1], error
        table = new
    return table[-1], error


def _midpoint(slopes: Callable[[mpf, Row], Row], t: mpf, y: Row, slope: Row, h: mpf, n: int) -> Row:
    """Gragg's rule with n steps and its smoothing."""
    part = h / n
    before, here = y, [a + part * b for a, b in zip(y, slope, strict=True)]
    for k in range(1, n):
        rates = slopes(t + k * part, here)
        before, here = here, [a + 2 * part * b for a, b in zip(before, rates, strict=True)]
    last = slopes(t + h, here)
    return [(a + b + part * c) / 2 for a, b, c in zip(here, before, last, strict=True)]


# Closed forms.


def pendulum(
    start: float, times: Sequence[float], g: float = 9.81, length: float = 1.0
) -> list[Row]:
    """θ and dot(θ) of a pendulum released at rest, by Jacobi's elliptic functions.

    sin(θ/2) = k cd(ω t, k), k = sin(θ₀/2); any number of full turns of θ₀ stays.
    """
    with mp.workdps(DIGITS + 20):
        turns = mp.nint(mpf(start) / (2 * mp.pi))
        k = mp.sin(mpf(start) / 2 - turns * mp.pi)
        omega, rows = mp.sqrt(mpf(g) / mpf(length)), []
        for t in map(mpf, times):
            sn, cn, dn = (mp.ellipfun(f, omega * t, m=k**2) for f in ("sn", "cn", "dn"))
            cd, sd = cn / dn, sn / dn
            theta = 2 * mp.asin(k * cd) + 2 * mp.pi * turns
            # d/du cd(u) = −(1 − k²) sd(u)/dn(u), and cos(θ/2) = sqrt(1 − k² cd²) = k'/dn.
            rate = -2 * k * omega * mp.sqrt(1 - k**2) * sd
            rows.append([theta, rate])
    return rows


def kepler(r: float, speed: float, times: Sequence[float], mu: float = 1.0) -> list[Row]:
    """x, y, dot(x), dot(y) of a body that is at its perihelion (r, 0) with a speed across."""
    with mp.workdps(DIGITS):
        a = 1 / (2 / mpf(r) - mpf(speed) ** 2 / mpf(mu))
        e = 1 - mpf(r) / a
        n, across, rows = mp.sqrt(mpf(mu) / a**3), mp.sqrt(1 - e**2), []
        for t in map(mpf, times):
            u = _eccentric(n * t, e)
            rate = n / (1 - e * mp.cos(u))
            rows.append(
                [
                    a * (mp.cos(u) - e),
                    a * across * mp.sin(u),
                    -a * mp.sin(u) * rate,
                    a * across * mp.cos(u) * rate,
                ]
            )
    return rows


def _eccentric(mean: mpf, e: mpf) -> mpf:
    """The solution of u − e sin u = M, bracketed by bisection, then by Newton's method."""
    turns = mp.nint(mean / (2 * mp.pi))
    m = mean - 2 * mp.pi * turns
    low, high = -mp.pi, mp.pi
    for _ in range(60):
        u = (low + high) / 2
        low, high = (u, high) if u - e * mp.sin(u) < m else (low, u)
    u = (low + high) / 2
    for _ in range(8):
        u -= (u - e * mp.sin(u) - m) / (1 - e * mp.cos(u))
    return u + 2 * mp.pi * turns


def springs(
    x: Sequence[float], v: Sequence[float], times: Sequence[float], m: float, k: float, k2: float
) -> list[Row]:
    """Two equal masses between walls, joined by a spring k2: the two modes of each."""
    with mp.workdps(DIGITS):
        slow, fast = mp.sqrt(mpf(k) / m), mp.sqrt((mpf(k) + 2 * mpf(k2)) / m)
        x, v = [mpf(a) for a in x], [mpf(a) for a in v]
        rows = []
        for t in map(mpf, times):
            parts = []
            for sign, w in ((1, slow), (-1, fast)):
                s, r = (x[0] + sign * x[1]) / 2, (v[0] + sign * v[1]) / 2
                parts.append(
                    (
                        s * mp.cos(w * t) + r / w * mp.sin(w * t),
                        r * mp.cos(w * t) - s * w * mp.sin(w * t),
                    )
                )
            (p, pv), (q, qv) = parts
            rows.append([p + q, p - q, pv + qv, pv - qv])
    return rows


# Equations of textbooks.


def double_pendulum(
    start: Sequence[float],
    times: Sequence[float],
    m1: float,
    m2: float,
    g: float = 9.81,
    l1: float = 1.0,
    l2: float = 1.0,
    tolerance: float = 1e-24,
) -> list[Row]:
    """θ1, θ2 and rates; Landau and Lifshitz, *Mechanics*, section 5, problem 1."""
    with mp.workdps(DIGITS):
        m1, m2, g, l1, l2 = map(mpf, (m1, m2, g, l1, l2))

    def slopes(t: mpf, y: Row) -> Row:
        a, b, va, vb = y
        s, c = mp.sin(a - b), mp.cos(a - b)
        first = -m2 * l2 * vb**2 * s - (m1 + m2) * g * mp.sin(a)
        second = l1 * va**2 * s - g * mp.sin(b)
        size = m1 + m2 * s**2
        return [
            va,
            vb,
            (first - m2 * c * second) / (l1 * size),
            ((m1 + m2) * second - c * first) / (l2 * size),
        ]

    return extrapolated(slopes, start, times, tolerance)


def spherical_pendulum(
    start: Sequence[float], times: Sequence[float], g: float = 9.81, length: float = 1.0
) -> list[Row]:
    """x, y, z and rates of a bob on a rod about the origin, with the rod's tension."""
    with mp.workdps(DIGITS):
        g, length = mpf(g), mpf(length)

    def slopes(t: mpf, y: Row) -> Row:
        place, rate = y[:3], y[3:]
        pull = (sum(v * v for v in rate) - g * place[2]) / length**2
        return [*rate, -pull * place[0], -pull * place[1], -pull * place[2] - g]

    return extrapolated(slopes, start, times, 1e-24)


def chain(start: Sequence[float], times: Sequence[float], length: float, g: float) -> list[Row]:
    """Angles and rates of n equal links hung from a fixed point, absolute angles from below."""
    n = len(start) // 2
    with mp.workdps(DIGITS):
        ratio = mpf(g) / mpf(length)

    def slopes(t: mpf, y: Row) -> Row:
        q, v = y[:n], y[n:]
        below = [[n - max(i, j) for j in range(n)] for i in range(n)]
        matrix = mp.matrix(n, n)
        force = mp.matrix(n, 1)
        for i in range(n):
            force[i] = -(n - i) * ratio * mp.sin(q[i])
            for j in range(n):
                matrix[i, j] = below[i][j] * mp.cos(q[i] - q[j])
                force[i] -= below[i][j] * mp.sin(q[i] - q[j]) * v[j] ** 2
        return [*v, *mp.lu_solve(matrix, force)]

    return extrapolated(slopes, start, times, 1e-20)


# Those that take minutes are stored.

STORED = Path(__file__).with_name("references.json")

#: Mass of the lower bob over that of the upper one → end.
RATIOS = {1e-12: 2.0, 1e-9: 10.0, 1e-6: 2.0, 1e6: 2.0, 1e9: 10.0, 1e12: 2.0}


def stored(name: str) -> tuple[list[float], list[list[float]]]:
    """Times and states of a stored reference."""
    found = json.loads(STORED.read_text(encoding="utf-8"))["references"][name]
    return found["times"], found["states"]


def _work() -> Iterator[tuple[str, list[float], Callable[[list[float]], list[Row]]]]:
    for ratio, end in RATIOS.items():
        # A power of ten is the mass of the heavier one.
        m1, m2 = (1.0, ratio) if ratio > 1 else (1 / ratio, 1.0)
        times = [end * k / 4 for k in range(5)]
        make = partial(double_pendulum, [1.5, 2.0, 0.0, 0.0], m1=m1, m2=m2)
        yield f"double pendulum {ratio:.0e}", times, make
    times = [0.5 * k for k in range(5)]
    taut = [1e-3 * (-1) ** k for k in range(6)]
    yield "taut chain", times, lambda times: chain([*taut, *[0.0] * 6], times, 0.5, 9.81)
    times = [2.0 * k for k in range(16)]
    yield "chaos", times, lambda times: double_pendulum([3.0, 3.0, 0.0, 0.0], times, 1.0, 1.0)


def main() -> None:
    """Make all stored references again."""
    references = {}
    for name, times, make in _work():
        rows = make(times)
        references[name] = {"times": times, "states": [[float(x) for x in row] for row in rows]}
        print(name, references[name]["states"][-1], flush=True)
    how = (
        f"python tests/extremes/extreme_exact.py: extrapolated midpoint rule, {DIGITS} digits,"
        " tolerance of a step 1e-24 (chain: 1e-20), rounded to doubles"
    )
    text = json.dumps({"how": how, "references": references}, indent=1)
    STORED.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
