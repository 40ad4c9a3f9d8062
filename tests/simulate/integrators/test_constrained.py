"""States that obey constraints: projected steps and samples of every method, in C and Python."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj

from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.base import UNMET
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED
from lagrange_cli.simulate.integrators.native.methods import COMPILED
from lagrange_cli.simulate.integrators.right_hand_side import FunctionRhs
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from tests.simulate.available import BY_VALUES
from tests.simulate.constrained_systems import constrained, interpreted, rods
from tests.simulate.native_systems import native_events

PROJECTING = [method for method in BY_VALUES if method.projects and not method.needs]
#: Those whose twin in Python is written like them.
TWINS = [m for m in PROJECTING if m.name in COMPILED and not m.implicit]
FIXED_ORDER = [m for m in PROJECTING if not m.variable_order and m.order <= 8]
names = {"ids": lambda method: method.name}

L, G, RATE = 1.5, 9.81, 7.0

#: m1, m2, l1, l2, g, and a start with both rods raised.
DOUBLE_PENDULUM = 1.0, 0.5, 1.0, 0.7, 9.81
ANGLES = 1.5, 2.0


def control(n, tolerance=1e-10, *, first_step=1e-3, max_step=1e9, step=None):
    return Control(np.full(n, tolerance), np.full(n, tolerance), first_step, max_step, step)


def pendulum_at(times):
    """A pendulum that turns over, from its lowest point: Jacobi's functions in closed form."""
    sn, cn, dn, _ = ellipj(RATE / 2 * times, 4 * G / (L * RATE**2))
    sin, cos, rate = 2 * sn * cn, 1 - 2 * sn**2, RATE * dn
    return np.column_stack([L * sin, -L * cos, L * cos * rate, L * sin * rate])


def raised():
    """The double pendulum at rest."""
    _, _, l1, l2, _ = DOUBLE_PENDULUM
    a, b = ANGLES
    first = np.array([l1 * math.sin(a), -l1 * math.cos(a)])
    second = first + np.array([l2 * math.sin(b), -l2 * math.cos(b)])
    return np.concatenate([first, second, np.zeros(4)])


def samples(rhs, method, y0, times, how):
    """States at all times, with the integrator that made them."""
    integrator = start_integrator(method, rhs, times[0], np.array(y0, dtype=float), times[-1], how)
    states = np.empty((len(times), len(y0)))
    filled = 0
    while filled < len(times):
        done = integrator.advance(
            times[filled:], states[filled:], most_steps=10**9, most_evaluations=math.inf
        )
        assert done.failure is None
        filled += done.filled
    return states, integrator


def pendulum_drift(states):
    """How far states are from the circle and from its tangents."""
    q, v = states[:, :2], states[:, 2:]
    length = np.linalg.norm(q, axis=1)
    return max(np.abs(length / L - 1).max(), np.abs((q * v).sum(axis=1) / L**2 / RATE).max())


@pytest.mark.slow
@pytest.mark.parametrize("method", PROJECTING, **names)
@pytest.mark.parametrize("native", [True, False])
def test_full_rotations_stay_on_the_circle(method, native):
    times = np.linspace(0.0, 4.0, 137)
    rhs = constrained("pendulum", L, G)
    rhs = rhs if native else interpreted(rhs)
    how = control(4, 1e-8, step=0.004)
    states, run = samples(rhs, method, pendulum_at(times[:1])[0], times, how)
    assert (type(run) in COMPILED.values()) == (native and method.name in COMPILED)
    exact = pendulum_at(times)
    assert (exact[:, 1] > 0.99 * L).sum() > 2  # it turns over
    assert pendulum_drift(states) < 1e-15
    assert np.abs(states - exact).max() < 1e-4


@pytest.mark.parametrize("method", FIXED_ORDER, **names)
def test_order_is_no_lower_than_without_constraints(method):
    """Steps of equal length: projection removes errors, it does not add any."""
    errors, counts = [], (16, 32) if method.order > 5 else (128, 256)
    for n in counts:
        h = 2.0 / n
        how = Control(np.full(4, 1e-11), np.full(4, 1e3), h, h, h)
        rhs = constrained("pendulum", L, G)
        states, run = samples(rhs, method, pendulum_at(np.zeros(1))[0], np.array([0.0, 2.0]), how)
        assert run.steps == n
        errors.append(np.abs(states[-1] - pendulum_at(np.array([2.0]))).max())
    assert math.log2(errors[0] / errors[1]) > method.order - 0.5


@pytest.mark.parametrize("name", ["DOP853", "Gauss16"])
def test_every_digit(name):
    """Forty rotations at the smallest tolerance: projection takes nothing away."""
    times = np.linspace(0.0, 40.0, 500)
    how = control(4, 1e-15)
    y0 = pendulum_at(times[:1])[0]
    states, _ = samples(constrained("pendulum", L, G), INTEGRATORS[name], y0, times, how)
    assert np.abs(states - pendulum_at(times)).max() < 3e-11
    assert pendulum_drift(states) < 1e-15


@pytest.mark.slow
def test_against_angles():
    times = np.linspace(0.0, 5.0, 101)
    m1, m2, l1, l2, g = DOUBLE_PENDULUM

    def rhs(t, y):
        a, b, va, vb = y
        c, s = math.cos(a - b), math.sin(a - b)
        m = np.array([[(m1 + m2) * l1, m2 * l2 * c], [l1 * c, l2]])
        f = [
            -m2 * l2 * s * vb**2 - (m1 + m2) * g * math.sin(a),
            l1 * s * va**2 - g * math.sin(b),
        ]
        return [va, vb, *np.linalg.solve(m, f)]

    found = solve_ivp(rhs, (0, 5), [*ANGLES, 0, 0], "DOP853", times, rtol=1e-13, atol=1e-14)
    a, b = found.y[:2]
    x1, z1 = l1 * np.sin(a), -l1 * np.cos(a)
    exact = np.column_stack([x1, z1, x1 + l2 * np.sin(b), z1 - l2 * np.cos(b)])
    system = constrained("double_pendulum", *DOUBLE_PENDULUM)
    states, _ = samples(system, INTEGRATORS["DOP853"], raised(), times, control(8, 1e-13))
    assert np.abs(states[:, :4] - exact).max() < 1e-9


@pytest.mark.slow
def test_drift_after_many_steps():
    """A hundred thousand steps of the double pendulum: rods keep their length to the last digit."""
    how = control(8, 1e-6, first_step=1e-3, max_step=1e-3)
    times = np.linspace(0.0, 100.0, 77)
    system = constrained("double_pendulum", *DOUBLE_PENDULUM)
    states, run = samples(system, INTEGRATORS["DOP853"], raised(), times, how)
    assert run.steps >= 100_000
    drift = rods(states) - [*DOUBLE_PENDULUM[2:4], 0, 0]
    assert np.abs(drift).max() < 1e-14


def test_without_projection_it_drifts():
    """What the projection is for."""
    system = constrained("double_pendulum", *DOUBLE_PENDULUM)
    times = np.linspace(0.0, 30.0, 77)
    how = control(8, 1e-6)
    free, _ = samples(lambda t, y: system(t, y), INTEGRATORS["DOP853"], raised(), times, how)
    held, _ = samples(system, INTEGRATORS["DOP853"], raised(), times, how)
    lengths = [*DOUBLE_PENDULUM[2:4], 0, 0]
    assert np.abs(rods(free) - lengths).max() > 1e-5
    assert np.abs(rods(held) - lengths).max() < 1e-14


@pytest.mark.parametrize("method", TWINS, **names)
def test_the_twin_in_python_makes_the_same_steps(method):
    times = np.linspace(0.0, 3.0, 41)
    system = constrained("double_pendulum", *DOUBLE_PENDULUM)
    how = control(8, 1e-9, step=0.01)
    mine, ours = samples(system, method, raised(), times, how)
    theirs, twin = samples(interpreted(system), method, raised(), times, how)
    assert abs(ours.steps - twin.steps) <= 1
    if ours.steps == twin.steps:
        assert np.abs(mine - theirs).max() < 1e-10


def test_one_slope_at_the_projected_end():
    """DOP853 takes the slope at the end of a step once, where the next one begins."""
    system = constrained("double_pendulum", *DOUBLE_PENDULUM)
    how = control(8, 1e-9)
    _, run = samples(system, INTEGRATORS["DOP853"], raised(), np.array([0.0, 2.0]), how)
    assert run.evaluations == 11 * (run.steps + run.rejections) + run.steps + 1


@pytest.mark.parametrize("method", PROJECTING, **names)
def test_steps_end_on_the_constraints(method):
    rhs = constrained("pendulum", L, G)
    y0 = pendulum_at(np.zeros(1))[0]
    run = start_integrator(method, rhs, 0.0, y0, 50.0, control(4, 1e-5, step=0.02))
    for _ in range(30):
        run.step(50.0)
        assert np.abs(rhs.project(run.t, run.y) - run.y).max() < 2e-15


@pytest.mark.parametrize("method", [m for m in PROJECTING if m.name in COMPILED], **names)
@pytest.mark.parametrize("block", [1, 7])
def test_however_divided_the_same_bits(method, block):
    times = np.linspace(0.0, 4.0, 60)
    rhs = constrained("pendulum", L, G)
    y0, how = pendulum_at(times[:1])[0], control(4, step=0.02)
    whole, _ = samples(rhs, method, y0, times, how)
    run = start_integrator(method, rhs, 0.0, y0, 4.0, how)
    parts = []
    for k in range(0, len(times), block):
        out = np.empty((len(times[k : k + block]), 4))
        filled = 0
        while filled < len(out):
            filled += run.advance(
                times[k + filled : k + block], out[filled:], most_steps=2, most_evaluations=math.inf
            ).filled
        parts.append(out)
    assert (np.concatenate(parts) == whole).all()


@pytest.mark.slow
@pytest.mark.parametrize("method", [m for m in PROJECTING if m.name in COMPILED], **names)
def test_loops_of_a_length_known_only_at_run_time_do_the_same(method):
    times = np.linspace(0.0, 2.0, 41)
    found = [
        samples(
            constrained("double_pendulum", *DOUBLE_PENDULUM, fixed_dimension=fixed),
            method,
            raised(),
            times,
            control(8, 1e-11, step=0.005),
        )[0]
        for fixed in (True, False)
    ]
    assert np.abs(found[0] - found[1]).max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("method", PROJECTING, **names)
@pytest.mark.parametrize("native", [True, False])
def test_a_projection_that_fails_ends_the_run(method, native):
    rhs = constrained("edge")
    rhs = rhs if native else interpreted(rhs)
    run = start_integrator(
        method, rhs, 0.0, np.array([0.0, 1.0]), 2.0, control(2, max_step=0.1, step=0.01)
    )
    done = run.advance(np.array([2.0]), np.empty((1, 2)), most_steps=999, most_evaluations=1e6)
    assert done.failure in (UNMET, "the step size underflowed")
    assert 0.85 <= run.t <= 1.0
    assert run.y == pytest.approx([run.t, 1.0], abs=1e-9)


def test_a_sample_that_cannot_be_projected_ends_the_run():
    """A step over a gap in which the constraints cannot be met."""

    def project(t, y):
        return np.full(2, np.nan) if 0.4 < t < 0.45 else y.copy()

    rhs = FunctionRhs(lambda t, y: np.array([y[1], 0.0]), project)
    how = control(2, first_step=0.25, max_step=0.25)
    run = start_integrator(INTEGRATORS["DOP853"], rhs, 0.0, np.array([0.0, 1.0]), 1.0, how)
    out = np.empty((3, 2))
    done = run.advance(np.array([0.1, 0.42, 0.6]), out, most_steps=99, most_evaluations=math.inf)
    assert (done.filled, done.failure) == (1, UNMET)


@pytest.mark.parametrize("name", ["DOP853", "Gauss16"])
def test_events_are_on_the_constraints(name):
    """A terminal event cuts the run where it turns over."""
    method, y0 = INTEGRATORS[name], pendulum_at(np.zeros(1))[0]
    rhs, how = constrained("pendulum", L, G), control(4, 1e-7)
    run = start_integrator(method, rhs, 0.0, y0, 9.0, how)
    run.stop_at(native_events("limit", 0.5))
    run.advance(np.array([9.0]), np.empty((1, 4)), most_steps=999, most_evaluations=1e6)
    assert run.end_event == 0
    assert pendulum_drift(run.y[None, :]) < 1e-15
    assert run.y[0] == pytest.approx(0.5, abs=1e-14)
    assert run.y == pytest.approx(pendulum_at(np.array([run.t]))[0], abs=1e-5)


def test_a_method_that_cannot_project_is_not_started():
    method = INTEGRATORS["LSODA"]
    assert not method.projects
    with pytest.raises(ValueError, match="constraints"):
        start_integrator(method, constrained("edge"), 0.0, np.zeros(2), 1.0, control(2))


@pytest.mark.slow
def test_in_wider_arithmetic():
    if EXTENDED.epsilon >= DOUBLE.epsilon:
        pytest.skip("this machine has no arithmetic wider than double")
    times = np.linspace(0.0, 40.0, 101)
    rhs = constrained("pendulum", L, G, real=EXTENDED)
    y0 = pendulum_at(times[:1])[0]
    problem = InitialValueProblem(rhs, y0, times, ("length",) * 2)
    run = Run(INTEGRATORS["DOP853"], problem, Control(np.zeros(4), np.full(4, 1e-18), 1e-4, 40.0))
    while run.go(len(times)):
        pass
    assert pendulum_drift(run.states) < 3e-16
    assert np.abs(run.states - pendulum_at(times)).max() < 1e-12
