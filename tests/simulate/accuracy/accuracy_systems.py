"""Systems with exact solutions, and how far what was measured is from them."""

from __future__ import annotations

import math

import mpmath
import numpy as np

from lagrange_cli.simulate.runs.problem import InitialValueProblem, running_scales
from tests.simulate.native_systems import native_body

G = 9.81


def rounding_errors(pattern):
    """Factors of arguments and of results, each off by a rounding error."""
    return 1 + np.random.default_rng(pattern).choice([-1.0, 1.0], size=(2, 20)) * 2.0**-52


def disturbed(rhs):
    """The right-hand side with its argument and result off by a rounding error, in two ways."""

    def of(pattern):
        factors = rounding_errors(pattern)

        def off(t, y):
            before, after = factors[:, : len(y)]
            return rhs(t, y * before) * after

        return off

    return of(1), of(2)


def problem(rhs, y0, until, kinds, samples=61, **more):
    y0 = np.array(y0, dtype=float)
    return InitialValueProblem(
        rhs, y0, np.linspace(0.0, until, samples), kinds, disturbed(rhs), **more
    )


# Systems with closed solutions: right-hand side, start, until, kinds, exact state at t.


def pendulum(amplitude, until=10.0):
    def rhs(t, y):
        return np.array([y[1], -G * math.sin(y[0])])

    def exact(t):
        """Libration through θ = A at rest: sin(θ/2) = k sn(K + ωt; k)."""
        k = mpmath.sin(mpmath.mpf(amplitude) / 2)
        w = mpmath.sqrt(mpmath.mpf(G))
        u = mpmath.ellipk(k**2) + w * t
        sn, cn = (mpmath.ellipfun(f, u, m=k**2) for f in ("sn", "cn"))
        return [2 * mpmath.asin(k * sn), 2 * k * w * cn]

    return rhs, [amplitude, 0.0], until, ("angle",), exact


def oscillator(omega, until):
    def rhs(t, y):
        return np.array([y[1], -omega * omega * y[0]])

    def exact(t):
        w = mpmath.sqrt(mpmath.mpf(omega * omega))
        return [mpmath.cos(w * t), -w * mpmath.sin(w * t)]

    return rhs, [1.0, 0.0], until, ("length",), exact


def kepler(e, until):
    y0 = [1 - e, 0.0, 0.0, math.sqrt((1 + e) / (1 - e))]

    def rhs(t, y):
        x, z, u, v = y.tolist()
        r3 = math.hypot(x, z) ** 3
        return np.array([u, v, -x / r3, -z / r3])

    def exact(t):
        """Kepler's equation for the elements of the very doubles the run starts from."""
        r, v = mpmath.mpf(y0[0]), mpmath.mpf(y0[3])
        a = 1 / (2 / r - v * v)
        ecc = 1 - r / a
        n = a ** mpmath.mpf("-1.5")
        # Kepler's equation is increasing: bisection cannot miss.
        anomaly = mpmath.findroot(
            lambda q: q - ecc * mpmath.sin(q) - n * t, (n * t - 1, n * t + 1), solver="anderson"
        )
        s, c = mpmath.sin(anomaly), mpmath.cos(anomaly)
        b = a * mpmath.sqrt(1 - ecc**2)
        rate = n / (1 - ecc * c)
        return [a * (c - ecc), b * s, -a * s * rate, b * c * rate]

    return rhs, y0, until, ("length", "length"), exact


def charge(b, until):
    """A charge in a magnetic field along z with an electric field along x."""

    def rhs(t, y):
        return np.array([y[2], y[3], b * y[3] + 0.25, -b * y[2]])

    def exact(t):
        w = mpmath.mpf(b)
        d = mpmath.mpf(0.25) / w
        s, c = mpmath.sin(w * t), mpmath.cos(w * t)
        # In the frame that drifts with −d along y the motion is a circle from velocity (1, d).
        return [
            (s + d * (1 - c)) / w,
            (c - 1 + d * s) / w - d * t,
            c + d * s,
            -s + d * c - d,
        ]

    return rhs, [0.0, 0.0, 1.0, 0.0], until, ("length", "length"), exact


def damped(until):
    def rhs(t, y):
        return np.array([y[1], -2.0 * y[1] - 5.0 * y[0]])

    def exact(t):
        e, s, c = mpmath.exp(-t), mpmath.sin(2 * t), mpmath.cos(2 * t)
        return [e * (c + s / 2), -e * s * mpmath.mpf(5) / 2]

    return rhs, [1.0, 0.0], until, ("length",), exact


def saddle(until):
    def rhs(t, y):
        return np.array([y[1], y[0]])

    def exact(t):
        return [mpmath.exp(-t), -mpmath.exp(-t)]

    return rhs, [1.0, -1.0], until, ("length",), exact


SYSTEMS = {
    "pendulum": pendulum(1.0),
    "pendulum-large": pendulum(3.0),
    "pendulum-near-separatrix": pendulum(math.pi - 1e-12, 9.0),
    "pendulum-small": pendulum(1e-6),
    "oscillator": oscillator(3.0, 40.0),
    "oscillator-fast": oscillator(1e9, 1e-7),
    "kepler-circle": kepler(0.0, 12.0),
    "kepler": kepler(0.5, 20.0),
    "kepler-comet": kepler(0.999, 6.0),
    "charge": charge(2.0, 20.0),
    "damped": damped(12.0),
    "saddle": saddle(12.0),
}


def true_errors(of, measured, exact):
    """Largest error of each component over its scale, with the exact solution's scales."""
    with mpmath.workdps(40):
        times = of.times[: len(measured.states)]
        states = [exact(mpmath.mpf(float(t))) for t in times]
        wrong = np.array(
            [
                [float(mpmath.mpf(float(y)) - v) for y, v in zip(row, state, strict=True)]
                for row, state in zip(measured.states, states, strict=True)
            ]
        )
    kept = np.array([[float(v) for v in state] for state in states])
    return np.abs(wrong).max(axis=0) / running_scales(of, kept)[-1]


#: The body of a double pendulum in C, with factors of arguments and results as parameters.
DOUBLE_PENDULUM = f"""
    const double a = y[0]*p[0], b = y[1]*p[1], va = y[2]*p[2], vb = y[3]*p[3];
    const double s = sin(a - b), c = cos(a - b);
    const double f1 = -vb*vb*s - 2*{G!r}*sin(a), f2 = va*va*s - {G!r}*sin(b);
    out[0] = va*p[4]; out[1] = vb*p[5];
    out[2] = (f1 - c*f2)/(1 + s*s)*p[6]; out[3] = (2*f2 - c*f1)/(1 + s*s)*p[7];"""


def compiled_double_pendulum(y0, until, samples):
    """The motion of a double pendulum in C, with its two disturbed sides."""
    factors = [np.ones((2, 4)), *(rounding_errors(pattern)[:, :4] for pattern in (1, 2))]
    rhs, *sides = (native_body(DOUBLE_PENDULUM, 4, each.ravel()) for each in factors)
    times, kinds = np.linspace(0.0, until, samples), ("angle", "angle")
    return InitialValueProblem(rhs, np.array(y0), times, kinds, tuple(sides))


def double_pendulum(t, y):
    a, b, u, v = y.tolist()
    s, c = math.sin(a - b), math.cos(a - b)
    f1 = -v * v * s - 2 * G * math.sin(a)
    f2 = u * u * s - G * math.sin(b)
    return np.array([u, v, (f1 - c * f2) / (1 + s * s), (2 * f2 - c * f1) / (1 + s * s)])
