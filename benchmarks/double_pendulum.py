"""The double pendulum of the benchmarks: its scene, its equations, its motion to 30 digits.

All parameters 1, g = 9.81 m/s², released at rest; the state is
[theta1, theta2, rate of theta1, rate of theta2].
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from operator import mul
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Release = tuple[float, float]

GRAVITY = 9.81

SCENE = """
name: double_pendulum
parameters: {m1: 1, m2: 1, l1: 1, l2: 1, g: %r}
plane: xz
particles:
  upper: {mass: m1, position: [x1, y1, z1]}
  lower: {mass: m2, position: [x2, y2, z2]}
coordinates: [theta1, theta2]
definitions:
  x1: l1*sin(theta1)
  z1: -l1*cos(theta1)
  x2: x1 + l2*sin(theta2)
  z2: z1 - l2*cos(theta2)
potentials: {weight: {gravity: g}}
initial: {theta1: %r, theta2: %r}
"""


def slopes(y: Sequence[Any], sin: Callable[..., Any], cos: Callable[..., Any]) -> list[Any]:
    """y' of the state y, from the equations written by hand."""
    a, b, u, v = y
    s, c = sin(a - b), cos(a - b)
    f = -(v**2) * s - 2 * GRAVITY * sin(a)
    g = u**2 * s - GRAVITY * sin(b)
    determinant = 1 + s**2
    return [u, v, (f - c * g) / determinant, (2 * g - c * f) / determinant]


#: Numbers of the reference are integers, this many binary digits behind the point; terms of a
#: series are summed until two are smaller than SMALL units.
DIGITS, SMALL = 128, 64

#: Longest step of the reference, s: a small part of the radius of convergence.
STEP = 0.02


def fixed(x: Any) -> int:
    """A number in units of the last digit."""
    return int(mpmath.ldexp(x, DIGITS))


def product(x: Sequence[int], y: Sequence[int]) -> int:
    """The last coefficient of the product of two series of one length."""
    return sum(map(mul, x, reversed(y))) >> DIGITS


def circular(x: int) -> tuple[list[int], list[int]]:
    """sin and cos of x, each the beginning of a series."""
    with mpmath.workprec(DIGITS + 16):
        angle = mpmath.ldexp(x, -DIGITS)
        return [fixed(mpmath.sin(angle))], [fixed(mpmath.cos(angle))]


def continued(sine: list[int], cosine: list[int], rate: Sequence[int]) -> None:
    """The next coefficients of sin x and cos x, those of x' being ``rate``."""
    s, c = product(cosine, rate) // len(rate), -product(sine, rate) // len(rate)
    sine.append(s)
    cosine.append(c)


def quotient(x: int, divisor: Sequence[int], before: Sequence[int]) -> int:
    """The next coefficient of a quotient: ``before`` are those found, x that of the dividend."""
    rest = x - (sum(map(mul, divisor[1:], reversed(before))) >> DIGITS)
    return (rest << DIGITS) // divisor[0]


def taylor_step(state: Sequence[int], h: int, gravity: int) -> list[int]:
    """The state a time h later, by the recurrences of the Taylor coefficients.

    Coefficients are those in t/h: each is the term of the series at the end of the step. The
    unit of velocities is one over h.
    """
    a, b, u, v = ([value] for value in state)
    u, v = ([value * h >> DIGITS for value in series] for series in (u, v))
    weight = gravity * h * h >> 2 * DIGITS
    (sa, ca), (sb, cb), (s, c) = circular(a[0]), circular(b[0]), circular(a[0] - b[0])
    uu, vv, f, g, determinant = ([] for _ in range(5))
    first, second = [], []
    relative = [u[0] - v[0]]
    for k in itertools.count(1):
        uu.append(product(u, u))
        vv.append(product(v, v))
        f.append(-product(vv, s) - (2 * weight * sa[-1] >> DIGITS))
        g.append(product(uu, s) - (weight * sb[-1] >> DIGITS))
        determinant.append(product(s, s) + (0 if k > 1 else 1 << DIGITS))
        first.append(quotient(f[-1] - product(c, g), determinant, first))
        second.append(quotient(2 * g[-1] - product(c, f), determinant, second))
        for sine, cosine, rate in ((sa, ca, u), (sb, cb, v), (s, c, relative)):
            continued(sine, cosine, rate)
        a.append(u[-1] // k)
        b.append(v[-1] // k)
        u.append(first[-1] // k)
        v.append(second[-1] // k)
        relative.append(u[-1] - v[-1])
        if all(abs(term) < SMALL for x in (a, b, u, v) for term in x[-2:]):
            return [sum(a), sum(b), (sum(u) << DIGITS) // h, (sum(v) << DIGITS) // h]
    raise AssertionError


def reference(times: Array, release: Release) -> list[list[Any]]:
    """The states at ``times`` to some 30 digits, as numbers of mpmath."""
    with mpmath.workprec(DIGITS + 16):
        gravity, moments = fixed(GRAVITY), [fixed(t) for t in times.tolist()]
        states = [[fixed(x) for x in (*release, 0.0, 0.0)]]
        for before, after in itertools.pairwise(moments):
            parts = math.ceil((after - before) / fixed(STEP))
            state = states[-1]
            for part in range(parts):
                end, start = ((after - before) * n // parts for n in (part + 1, part))
                state = taylor_step(state, end - start, gravity)
            states.append(state)
        return [[mpmath.ldexp(x, -DIGITS) for x in state] for state in states]


def energy(y: Sequence[Any]) -> Any:
    """The energy of a state, J."""
    a, b, u, v = y
    kinetic = u**2 + v**2 / 2 + u * v * mpmath.cos(a - b)
    return kinetic - GRAVITY * (2 * mpmath.cos(a) + mpmath.cos(b))


def reference_error(times: Array, exact: Sequence[Sequence[Any]]) -> float:
    """How far a reference is from mpmath.odefun at the third sample after the start, and its
    energy anywhere from that at the start: the larger of the two."""
    with mpmath.workdps(30):
        soon = mpmath.odefun(lambda t, y: slopes(y, mpmath.sin, mpmath.cos), 0, list(exact[0]))
        differences = [x - y for x, y in zip(soon(times[3]), exact[3], strict=True)]
        differences += [energy(state) - energy(exact[0]) for state in exact]
        return float(max(map(abs, differences)))
