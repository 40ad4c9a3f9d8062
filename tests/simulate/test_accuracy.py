"""The promise: at every sample, every error is below eps times its scale.

References are closed forms in mpmath, evaluated far below double precision.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.accuracy import integrate_to_accuracy
from lagrange_cli.simulate.problem import InitialValueProblem, running_scales
from lagrange_cli.simulate.watch import Watch

G = 9.81


def disturbed(rhs):
    """The right-hand side with its argument and result off by a rounding error, in two ways."""

    def of(pattern):
        signs = np.random.default_rng(pattern).choice([-1.0, 1.0], size=(2, 20)) * 2.0**-52

        def off(t, y):
            before, after = 1 + signs[:, : len(y)]
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
        states = [[float(v) for v in exact(mpmath.mpf(float(t)))] for t in of.times]
        wrong = np.array(
            [
                [
                    float(mpmath.mpf(float(y)) - v)
                    for y, v in zip(row, exact(mpmath.mpf(float(t))), strict=True)
                ]
                for row, t in zip(measured.states, of.times, strict=False)
            ]
        )
    kept = np.array(states)[: len(measured.states)]
    return np.abs(wrong).max(axis=0) / running_scales(of, kept)[-1]


@pytest.mark.parametrize("eps", [1e-3, 1e-6, 1e-9, 1e-11, 1e-12])
@pytest.mark.parametrize("name", SYSTEMS)
def test_never_wrong_with_a_green_light(name, eps):
    *given, exact = SYSTEMS[name]
    of = problem(*given)
    measured = integrate_to_accuracy(of, eps, Watch())
    error = true_errors(of, measured, exact).max()
    assert error < eps
    assert error <= max(measured.estimate, 1e-16)
    assert measured.estimate < eps
    if eps >= 1e-9 and name not in ("pendulum-near-separatrix", "kepler-comet", "saddle"):
        assert len(measured.states) == len(of.times)


def test_the_estimate_is_typically_within_a_factor_of_100():
    ratios = []
    for name in ("pendulum", "oscillator", "kepler", "charge", "damped", "pendulum-large"):
        for eps in (1e-6, 1e-9):
            *given, exact = SYSTEMS[name]
            of = problem(*given)
            measured = integrate_to_accuracy(of, eps, Watch())
            ratios.append(measured.estimate / true_errors(of, measured, exact).max())
    assert np.median(ratios) < 100
    assert min(ratios) >= 1


@pytest.mark.parametrize("name", ["pendulum", "oscillator", "kepler", "charge", "damped"])
@pytest.mark.parametrize("eps", [1e-6, 1e-9, 1e-11])
def test_estimating_costs_at_most_four_times_the_run(name, eps):
    *given, _ = SYSTEMS[name]
    measured = integrate_to_accuracy(problem(*given), eps, Watch())
    assert measured.all_evaluations <= 5 * measured.evaluations


def test_seeded_pendulums():
    """A slice of many: random amplitudes, gravities by scaling of time, and accuracies."""
    chance = np.random.default_rng(1788)
    for _ in range(12):
        amplitude, until = chance.uniform(0.01, 3.1), chance.uniform(1.0, 15.0)
        eps = 10 ** chance.uniform(-11, -3)
        *given, exact = pendulum(float(amplitude), float(until))
        of = problem(*given, samples=21)
        measured = integrate_to_accuracy(of, eps, Watch())
        assert len(measured.states) == 21
        assert true_errors(of, measured, exact).max() <= measured.estimate < eps


DOUBLE_PENDULUM_AT_10 = [
    0.4880015231782601,
    -4.531731126955675,
    3.7669145738148244,
    -4.212507802325505,
]


def double_pendulum(t, y):
    a, b, u, v = y.tolist()
    s, c = math.sin(a - b), math.cos(a - b)
    f1 = -v * v * s - 2 * G * math.sin(a)
    f2 = u * u * s - G * math.sin(b)
    return np.array([u, v, (f1 - c * f2) / (1 + s * s), (2 * f2 - c * f1) / (1 + s * s)])


@pytest.mark.parametrize("eps", [1e-3, 1e-6, 1e-9])
def test_double_pendulum(eps):
    """Against a Taylor series integration with 25 digits (mpmath.odefun)."""
    of = problem(double_pendulum, [1.5, 2.0, 0.0, 0.0], 10.0, ("angle", "angle"), samples=501)
    measured = integrate_to_accuracy(of, eps, Watch())
    assert len(measured.states) == 501
    error = np.abs(measured.states[-1] - DOUBLE_PENDULUM_AT_10) / measured.scales
    assert error.max() < eps


def test_chaos_has_a_horizon():
    """What is kept of a long chaotic run agrees with a run of twice the care."""
    of = problem(double_pendulum, [1.5, 2.0, 0.0, 0.0], 40.0, ("angle", "angle"), samples=401)
    coarse = integrate_to_accuracy(of, 1e-3, Watch())
    fine = integrate_to_accuracy(of, 1e-6, Watch())
    assert 10.0 < of.times[len(fine.states) - 1] < of.times[len(coarse.states) - 1] < 40.0
    apart = np.abs(coarse.states[: len(fine.states)] - fine.states) / fine.scales
    assert apart.max() < 1e-3


@pytest.mark.parametrize("power", [(40, 0), (-40, -30), (100, 64), (0, -60)])
def test_units_by_powers_of_two_change_no_bit(power):
    length, duration = (2.0**p for p in power)

    def rhs(t, y):
        x = y[0] / length
        return np.array([y[1], (-x - 0.3 * x * x * x) * (length / duration**2)])

    def run(scaled_rhs, unit, d):
        y0 = [1.25 * unit, 0.5 * unit / d]
        of = problem(scaled_rhs, y0, 10.0 * d, ("length",))
        return integrate_to_accuracy(of, 1e-9, Watch())

    def plain(t, y):
        x = y[0]
        return np.array([y[1], -x - 0.3 * x * x * x])

    scaled, unit = run(rhs, length, duration), run(plain, 1.0, 1.0)
    assert (scaled.states == unit.states * [length, length / duration]).all()
    assert scaled.estimate == unit.estimate
    assert scaled.evaluations == unit.evaluations


@pytest.mark.parametrize(("length", "duration"), [(1e-9, 1e-12), (1.496e11, 3.156e7)])
def test_units_do_not_matter(length, duration):
    def rhs(t, y):
        x = y[0] / length
        return np.array([y[1], (-x - 0.3 * x * x * x) * (length / duration**2)])

    def plain(t, y):
        return np.array([y[1], -y[0] - 0.3 * y[0] ** 3])

    scaled = problem(rhs, [1.25 * length, 0.0], 10.0 * duration, ("length",))
    unit = problem(plain, [1.25, 0.0], 10.0, ("length",))
    a, b = (integrate_to_accuracy(of, 1e-9, Watch()) for of in (scaled, unit))
    apart = np.abs(a.states / [length, length / duration] - b.states) / b.scales
    assert apart.max() < 2e-9


def test_the_same_twice():
    *given, _ = SYSTEMS["kepler"]
    a, b = (integrate_to_accuracy(problem(*given), 1e-7, Watch()) for _ in range(2))
    assert (a.states == b.states).all()
    assert a.estimate == b.estimate


def test_scales():
    """R from the start for lengths, 1 for angles; at least a thousandth of the largest."""
    of = problem(
        double_pendulum, [5.0, 7.0, 3.0, 0.0, 0.0, 0.0], 10.0, ("length", "length", "angle")
    )
    states = np.array([[5.0, 7.0, 3.0, 0.0, 0.0, 0.0], [5.0, 9.0, 3.5, -4.0, 0.01, 0.0]])
    scales = running_scales(of, states)
    assert scales[-1].tolist() == [2e-3, 2.0, 1.0, 4.0, 0.2, 0.1]
    assert scales[0].tolist() == [1.0, 1.0, 1.0, 0.1, 0.1, 0.1]


@pytest.mark.parametrize(
    ("y0", "kinds", "eps"),
    [
        ([1e8, 0.0], ("angle",), 5e-8),
        ([1.0, 0.0], ("angle",), 1e-16),
        ([1e12, 1e-3], ("length",), 1e-9),
    ],
)
def test_below_four_ulps_is_refused(y0, kinds, eps):
    def rhs(t, y):
        return np.array([y[1], -math.sin(y[0])]) if kinds == ("angle",) else np.array([y[1], 0.0])

    with pytest.raises(InputError, match="below what double precision"):
        integrate_to_accuracy(problem(rhs, y0, 1.0, kinds), eps, Watch())


def test_large_angles():
    """θ ≈ 1e8: right where it says so, though sin θ carries an error of 1e-8."""
    turns = 15_915_494  # multiples of 2π near 1e8
    offset = float(turns * 2 * mpmath.pi)
    start = offset + 1.0
    of = problem(pendulum(1.0)[0], [start, 0.0], 5.0, ("angle",))
    measured = integrate_to_accuracy(of, 3e-6, Watch())
    with mpmath.workdps(40):
        amplitude = mpmath.mpf(start) - turns * 2 * mpmath.pi
        exact = pendulum(amplitude)[-1]
        at = [exact(mpmath.mpf(float(t)))[0] + turns * 2 * mpmath.pi for t in of.times]
    assert len(measured.states) == len(of.times)
    assert (
        max(
            abs(float(a - mpmath.mpf(float(y))))
            for a, y in zip(at, measured.states[:, 0], strict=True)
        )
        < 3e-6
    )


def test_finite_time_singularity():
    """x'' = 2x³ from (1, 1) is 1/(1 − t)."""

    def rhs(t, y):
        return np.array([y[1], 2 * y[0] ** 3])

    of = problem(rhs, [1.0, 1.0], 2.0, ("length",), samples=501)
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    assert measured.failure is not None
    assert measured.failure.time == pytest.approx(1.0, abs=1e-3)
    t = of.times[: len(measured.states)]
    assert 0.98 < t[-1] < 1.0
    error = np.abs(measured.states[:, 0] - 1 / (1 - t)) / measured.scales[0]
    assert error.max() < 1e-6


def test_overflow_keeps_what_was_finite():
    def rhs(t, y):
        return np.array([y[1], y[0]])

    of = problem(rhs, [1.0, 1.0], 1000.0, ("length",), samples=501)
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    assert measured.failure is not None
    assert 690 < of.times[len(measured.states) - 1] < 710
    assert np.isfinite(measured.states).all()


def test_edge_of_the_domain():
    def rhs(t, y):
        return np.array([y[1], -5 / math.sqrt(1 - y[0])]) if y[0] < 1 else np.full(2, np.nan)

    measured = integrate_to_accuracy(
        problem(rhs, [0.0, 5.0], 2.0, ("length",), samples=201), 1e-6, Watch()
    )
    assert measured.failure is not None
    assert measured.failure.time == pytest.approx(0.2412, abs=1e-3)


def test_undefined_start():
    def rhs(t, y):
        return np.full(2, np.nan)

    measured = integrate_to_accuracy(problem(rhs, [0.0, 0.0], 1.0, ("length",)), 1e-6, Watch())
    assert measured.failure is not None
    assert measured.failure.time == 0.0
    assert len(measured.states) == 1


def test_rest_stays_at_rest():
    def rhs(t, y):
        return np.array([y[1], -y[0]])

    measured = integrate_to_accuracy(problem(rhs, [0.0, 0.0], 5.0, ("length",)), 1e-12, Watch())
    assert (measured.states == 0).all()
    assert measured.scales[0] == 1.0


def test_stiff_systems_get_an_implicit_method():
    """x'' = −1e6 x' − x: the solution is the sum of two exponentials."""

    def rhs(t, y):
        return np.array([y[1], -1e6 * y[1] - y[0]])

    of = problem(rhs, [1.0, 0.0], 10.0, ("length",))
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    assert measured.method == "Radau"
    assert len(measured.states) == len(of.times)
    root = np.sqrt(1e12 - 4)
    slow, fast = -2 / (1e6 + root), -(1e6 + root) / 2
    x = (fast * np.exp(slow * of.times) - slow * np.exp(fast * of.times)) / (fast - slow)
    assert np.abs(measured.states[:, 0] - x).max() / measured.scales[0] < 1e-6
    assert measured.evaluations < 50_000


def test_fast_oscillation_is_not_called_stiff():
    """Five hundred turns are resolved by an explicit method, whatever their frequency."""
    *given, exact = oscillator(2.0**20, 3.0e-3)
    of = problem(*given)
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    assert measured.method == "DOP853"
    assert true_errors(of, measured, exact).max() < 1e-6


@pytest.mark.parametrize("width", [1.0, 0.1, 0.05, 0.02])
def test_a_pulse_in_a_quiet_motion_is_not_passed_over(width):
    """∫∫ of a Gaussian force; the system rests until t = 61. A narrow pulse may
    be refused, but what is kept is right."""

    def rhs(t, y):
        return np.array([y[1], math.exp(-(((t - 61.3) / width) ** 2))])

    of = problem(rhs, [0.0, 0.0], 100.0, ("length",), samples=501, autonomous=False)
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    reached = of.times[len(measured.states) - 1]
    assert reached == 100.0 if width >= 0.1 else reached > 60.0
    if reached > 61.3 + 10 * width:
        # Far behind the pulse: velocity w√π, position velocity·(t − 61.3).
        speed = width * math.sqrt(math.pi)
        exact = [speed * (reached - 61.3), speed]
        assert np.abs((measured.states[-1] - exact) / measured.scales).max() < 1e-6
    else:
        assert np.abs(measured.states[-1]).max() < 1e-20


def test_interrupt_keeps_what_holds():
    calls = 0

    def interrupt(fraction):
        nonlocal calls
        calls += 1
        if fraction > 0.5:
            raise KeyboardInterrupt

    *given, exact = SYSTEMS["pendulum"]
    of = problem(*given)
    measured = integrate_to_accuracy(of, 1e-9, Watch(interrupt))
    assert measured.stopped
    assert 5 < len(measured.states) < len(of.times)
    assert true_errors(of, measured, exact).max() < 1e-9


def test_budget_stops_a_run():
    def slow(t, y):
        return np.array([y[1], -1e12 * y[0]])

    of = problem(slow, [1.0, 0.0], 1e3, ("length",))
    measured = integrate_to_accuracy(of, 1e-6, Watch(budget=0.2))
    assert measured.stopped
    assert len(measured.states) == 1


def test_interrupt_in_the_pilot_keeps_the_start():
    def interrupt(fraction):
        raise KeyboardInterrupt

    *given, _ = SYSTEMS["pendulum"]
    measured = integrate_to_accuracy(problem(*given), 1e-9, Watch(interrupt))
    assert measured.stopped
    assert measured.states.tolist() == [[1.0, 0.0]]


def test_progress_never_falls():
    seen = []
    *given, _ = SYSTEMS["pendulum-near-separatrix"]
    watch = Watch(seen.append)
    integrate_to_accuracy(problem(*given), 1e-9, watch)
    watch.done()
    assert seen == sorted(seen)
    assert seen[0] >= 0
    assert seen[-1] == 1.0
    assert len(seen) > 10


def test_no_warning_escapes():
    import warnings

    def rhs(t, y):
        return np.exp(y * 1000) * np.array([1.0, 1.0])

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrate_to_accuracy(problem(rhs, [1.0, 1.0], 1.0, ("length",)), 1e-6, Watch())
