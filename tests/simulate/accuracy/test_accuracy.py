"""The promise: at every sample, every error is below eps times its scale.

References are closed forms in mpmath, evaluated far below double precision.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.runs.problem import running_scales
from tests.campaign import values_of
from tests.simulate.accuracy.accuracy_systems import (
    SYSTEMS,
    compiled_double_pendulum,
    double_pendulum,
    pendulum,
    problem,
    true_errors,
)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "eps"), values_of([*SYSTEMS], [1e-3, 1e-6, 1e-9, 1e-11, 1e-12]))
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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "eps"),
    values_of(["pendulum", "oscillator", "kepler", "charge", "damped"], [1e-6, 1e-9, 1e-11]),
)
def test_estimating_costs_at_most_four_times_the_run(name, eps):
    *given, _ = SYSTEMS[name]
    measured = integrate_to_accuracy(problem(*given), eps, Watch())
    assert measured.all_evaluations <= 5 * measured.evaluations


@pytest.mark.slow
@pytest.mark.parametrize("number", [6, pytest.param(60, marks=pytest.mark.campaign)])
def test_seeded_pendulums(number):
    """A slice of many: random amplitudes, gravities by scaling of time, and accuracies."""
    chance = np.random.default_rng(1788)
    for _ in range(number):
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


@pytest.mark.slow
@pytest.mark.parametrize("eps", [1e-3, 1e-6, 1e-9])
def test_double_pendulum(eps):
    """Against a Taylor series integration with 25 digits (mpmath.odefun)."""
    of = problem(double_pendulum, [1.5, 2.0, 0.0, 0.0], 10.0, ("angle", "angle"), samples=501)
    measured = integrate_to_accuracy(of, eps, Watch())
    assert len(measured.states) == 501
    error = np.abs(measured.states[-1] - DOUBLE_PENDULUM_AT_10) / measured.scales
    assert error.max() < eps


@pytest.mark.slow
def test_chaos_has_a_horizon():
    """What is kept of a long chaotic run agrees with a run of twice the care."""
    of = compiled_double_pendulum([1.5, 2.0, 0.0, 0.0], 40.0, samples=401)
    coarse = integrate_to_accuracy(of, 1e-3, Watch())
    fine = integrate_to_accuracy(of, 1e-6, Watch())
    assert 10.0 < of.times[len(fine.states) - 1] < of.times[len(coarse.states) - 1] < 40.0
    apart = np.abs(coarse.states[: len(fine.states)] - fine.states) / fine.scales
    assert apart.max() < 1e-3


@pytest.mark.slow
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
