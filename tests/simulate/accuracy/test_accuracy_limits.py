"""The promise where motions end, stay at rest, are stiff, or are interrupted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
from lagrange_cli.simulate.checkpoint.progress import Deadline, RunProgress, Watch
from lagrange_cli.simulate.runs import run
from tests.simulate.accuracy.accuracy_systems import (
    SYSTEMS,
    oscillator,
    problem,
    true_errors,
)


@pytest.mark.slow
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


@pytest.mark.slow
def test_overflow_keeps_what_was_finite():
    def rhs(t, y):
        return np.array([y[1], y[0]])

    of = problem(rhs, [1e150, 1e150], 500.0, ("length",), samples=251)
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    assert measured.failure is not None
    assert 350 < of.times[len(measured.states) - 1] < 365
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_fast_oscillation_is_not_called_stiff():
    """Two hundred turns are resolved by an explicit method, whatever their frequency."""
    *given, exact = oscillator(2.0**20, 1.2e-3)
    of = problem(*given)
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    assert measured.method == "DOP853"
    assert true_errors(of, measured, exact).max() < 1e-6


@pytest.mark.slow
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


@pytest.fixture
def looked_at_often(monkeypatch):
    """Runs are looked at often, so that they can be stopped at many places."""
    monkeypatch.setattr(run, "FIRST_LOOK", 32)
    monkeypatch.setattr(run, "FASTER", 1.0)


@pytest.mark.usefixtures("looked_at_often")
def test_interrupt_keeps_what_holds():
    calls = 0

    def interrupt(fraction):
        nonlocal calls
        calls += 1
        if fraction > 0.5:
            raise KeyboardInterrupt

    *given, exact = SYSTEMS["pendulum"]
    of = problem(*given)
    measured = integrate_to_accuracy(of, 1e-9, Watch(RunProgress(interrupt)))
    assert measured.stopped
    assert 5 < len(measured.states) < len(of.times)
    assert true_errors(of, measured, exact).max() < 1e-9


def test_budget_stops_a_run():
    def slow(t, y):
        return np.array([y[1], -1e12 * y[0]])

    of = problem(slow, [1.0, 0.0], 1e3, ("length",))
    measured = integrate_to_accuracy(of, 1e-6, Watch(deadline=Deadline.after(0.2)))
    assert measured.stopped
    assert len(measured.states) == 1


@pytest.mark.usefixtures("looked_at_often")
def test_interrupt_in_the_coarse_run_keeps_the_start():
    def interrupt(fraction):
        raise KeyboardInterrupt

    *given, _ = SYSTEMS["pendulum"]
    measured = integrate_to_accuracy(problem(*given), 1e-9, Watch(RunProgress(interrupt)))
    assert measured.stopped
    assert measured.states.tolist() == [[1.0, 0.0]]


@pytest.mark.slow
@pytest.mark.usefixtures("looked_at_often")
def test_progress_never_falls():
    seen = []
    *given, _ = SYSTEMS["pendulum-near-separatrix"]
    watch = Watch(RunProgress(seen.append))
    integrate_to_accuracy(problem(*given), 1e-9, watch)
    watch.progress.done()
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
