"""Integrators in C: closed forms, their twins in Python, and what must not change a bit."""

from __future__ import annotations

import math
import shutil
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, StepError, start_integrator
from lagrange_cli.simulate.integrators.native.methods import COMPILED
from tests.campaign import values_of
from tests.simulate.native_systems import SYSTEMS, interpreted, native

METHODS = [INTEGRATORS[name] for name in COMPILED]
ADAPTIVE = [method for method in METHODS if method.adaptive]
#: Those that take any right-hand side, not that of a mechanical system alone.
GENERAL = [method for method in METHODS if not method.needs]
#: Those whose twin in Python is written like them; that of Radau is SciPy's.
TWINS = [method for method in METHODS if not method.implicit]
names = {"ids": lambda method: method.name}


def control(n=2, tolerance=1e-10, *, first_step=1e-3, max_step=1e9, step=None):
    return Control(np.full(n, tolerance), np.full(n, tolerance), first_step, max_step, step)


def begun(method, rhs, y0, until, how, t0=0.0):
    return start_integrator(method, rhs, t0, np.array(y0, dtype=float), until, how)


def samples(integrator, times, **limits):
    """States at all times, however many calls it takes."""
    states = np.empty((len(times), len(integrator.y)))
    how = {"most_steps": 10**9, "most_evaluations": math.inf, **limits}
    filled = 0
    while filled < len(times):
        done = integrator.advance(times[filled:], states[filled:], **how)
        assert done.failure is None
        filled += done.filled
    return states


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("lanes", [True, False])
def test_harmonic_oscillator(method, lanes):
    times = np.linspace(0.0, 20.0, 333)
    rhs = native("oscillator", 4.0, lanes=lanes)
    integrator = begun(method, rhs, [1.0, 0.0], 20.0, control(step=0.002))
    assert type(integrator) is COMPILED[method.name]
    found = samples(integrator, times)
    exact = np.column_stack([np.cos(2 * times), -2 * np.sin(2 * times)])
    assert np.abs(found - exact).max() < (1e-8 if method.order > 2 else 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_kepler_returns_after_ten_periods(method):
    """Eccentricity 0.6: position and velocity at the perihelion."""
    y0 = [0.4, 0.0, 0.0, 2.0]
    until = 10 * 2 * math.pi
    integrator = begun(method, native("kepler", 1.0), y0, until, control(4, 1e-13))
    found = samples(integrator, np.array([until]))
    assert np.abs(found[0] - y0).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pair", "tolerance"),
    values_of(
        [(m, name) for m in TWINS for name in ("pendulum", "rotation", "driven")]
        + [(m, "three") for m in TWINS if m in GENERAL],
        [1e-5, 1e-9, 1e-13],
    ),
)
def test_the_twin_in_python_makes_the_same_steps(pair, tolerance):
    method, name = pair
    rhs = native(name)
    y0 = [1.0, 0.5, 0.25][: 3 if name == "three" else 2]
    times = np.linspace(0.0, 6.0, 41)
    how = control(len(y0), tolerance, step=0.01)
    ours, twin = (begun(method, f, y0, 6.0, how) for f in (rhs, interpreted(rhs)))
    assert type(twin) is method
    mine, theirs = samples(ours, times), samples(twin, times)
    assert abs(ours.steps - twin.steps) <= (1 if method.adaptive else 0)
    if ours.steps == twin.steps:
        # Iterations end at a part of the tolerance, Runge–Kutta steps at rounding error.
        assert np.abs(mine - theirs).max() < 1e-12 + 1e-2 * tolerance


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, **names)
def test_loops_of_a_length_known_only_at_run_time_do_the_same(method):
    times = np.linspace(0.0, 6.0, 41)
    found = []
    for fixed in (True, False):
        rhs = native("kepler", 1.0, fixed_dimension=fixed)
        run = begun(method, rhs, [0.5, 0.0, 0.0, 1.7], 6.0, control(4, 1e-12, step=0.01))
        found.append(samples(run, times))
    assert np.abs(found[0] - found[1]).max() < 1e-10


def test_order_of_runge_kutta():
    """Fixed steps, forced on the adaptive method by a loose tolerance."""
    exact = samples(
        begun(INTEGRATORS["DOP853"], native("pendulum"), [1.0, 0.5], 2.0, control(2, 1e-16)),
        np.array([2.0]),
    )[0]
    for name, counts in (("RK4", (16, 32)), ("DOP853", (4, 8))):
        errors = []
        for count in counts:
            h = 2.0 / count
            how = Control(np.zeros(2), np.full(2, 1e-3), h, h, h)
            run = begun(INTEGRATORS[name], native("pendulum"), [1.0, 0.5], 2.0, how)
            errors.append(np.abs(samples(run, np.array([2.0]))[0] - exact).max())
            assert run.steps == count
        assert math.log2(errors[0] / errors[1]) == pytest.approx(INTEGRATORS[name].order, abs=0.7)


def test_order_of_collocation_by_quadrature():
    errors = []
    for n in (2, 4):
        how = Control(np.zeros(2), np.full(2, 1e3), 4 / n, 4 / n)
        run = begun(INTEGRATORS["Gauss16"], native("driven"), [0.0, 0.0], 4.0, how)
        end = samples(run, np.array([4.0]))[0]
        assert run.steps == n
        errors.append(abs(end[1] - math.sin(20) / 5))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(16, abs=0.7)


def error_between(name, begin, h):
    """Largest error of q̇ = sin(5t)/5 within one step of h."""
    # Coarse enough for one step, not so coarse that a cubic will do between its ends.
    how = Control(np.zeros(2), np.full(2, 0.02 if name == "DOP853" else 1e3), h, h)
    run = begun(INTEGRATORS[name], native("driven"), [0.0, 0.0], begin + 9.0, how, t0=begin)
    times = np.linspace(begin, begin + h, 51)
    v = samples(run, times)[:, 1]
    assert run.steps == 1
    return np.abs(v - (np.sin(5 * times) - math.sin(5 * begin)) / 5).max()


@pytest.mark.parametrize(("name", "order"), [("DOP853", 8), ("Gauss16", 9), ("Radau", 6)])
def test_order_of_the_interpolant(name, order):
    """Of one step: that of Radau is a step itself, whose error falls as h^6."""
    begins = np.linspace(0.0, 1.2, 13)
    coarse, fine = (max(error_between(name, t, h) for t in begins) for h in (0.6, 0.3))
    assert math.log2(coarse / fine) == pytest.approx(order, abs=0.5)


@pytest.mark.parametrize("tolerance", [1e-15, 1e-17, 1e-30])
def test_collocation_ends_where_rounding_does(tolerance):
    """Iterations that only shuffle the last digits stop, however small the tolerance."""
    integrator = begun(
        INTEGRATORS["Gauss16"],
        native("kepler", 1.0),
        [0.4, 0.0, 0.0, 2.0],
        2 * math.pi,
        control(4, tolerance),
    )
    end = samples(integrator, np.array([2 * math.pi]))[-1]
    assert np.abs(end - [0.4, 0.0, 0.0, 2.0]).max() < 5e-14
    assert integrator.evaluations < 30_000


def test_a_million_steps_lose_no_digits():
    how = control(step=0.1)
    run = begun(INTEGRATORS["RK4"], native("constant"), [0.0, 0.0], 1e5, how)
    end = samples(run, np.array([1e5]))[0]
    assert run.steps >= 999_999
    assert abs(end[0] - 1e5) <= 1.5e-11  # one unit in the last place


@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_adaptive_sums_are_compensated(method):
    """Fifty thousand steps against an offset of 1: the error stays at the last place."""
    how = control(first_step=1e-4, max_step=1e-4)
    run = begun(method, native("oscillator", 0.0), [1.0, 1e-3], 5.0, how)
    end = samples(run, np.array([5.0]))[0]
    assert run.steps >= 49_999
    assert abs(end[0] - 1.005) <= 4e-16


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("block", [1, 2, 7, 64])
def test_blocks_of_samples_give_the_same_bits(method, block):
    times = np.linspace(0.0, 9.0, 200)
    whole = samples(begun(method, native("pendulum"), [1.0, 0.5], 9.0, control(step=0.02)), times)
    run = begun(method, native("pendulum"), [1.0, 0.5], 9.0, control(step=0.02))
    parts = [samples(run, times[k : k + block]) for k in range(0, len(times), block)]
    assert (np.concatenate(parts) == whole).all()


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("limit", [{"most_steps": 1}, {"most_evaluations": 30.0}])
def test_limits_interrupt_and_do_not_change_a_bit(method, limit):
    times = np.linspace(0.0, 9.0, 50)
    whole = begun(method, native("pendulum"), [1.0, 0.5], 9.0, control(step=0.02))
    parts = begun(method, native("pendulum"), [1.0, 0.5], 9.0, control(step=0.02))
    assert (samples(whole, times) == samples(parts, times, **limit)).all()
    assert (whole.steps, whole.evaluations) == (parts.steps, parts.evaluations)


@pytest.mark.parametrize("method", METHODS, **names)
def test_a_limit_of_steps_is_kept(method):
    run = begun(method, native("pendulum"), [1.0, 0.5], 9.0, control(step=0.02))
    out = np.empty((1, 2))
    done = run.advance(np.array([9.0]), out, most_steps=3, most_evaluations=math.inf)
    assert (done.filled, done.failure, run.steps) == (0, None, 3)
    before = run.evaluations
    run.advance(np.array([9.0]), out, most_steps=99, most_evaluations=0.0)
    assert run.evaluations == before


@pytest.mark.parametrize("method", METHODS, **names)
def test_the_end_is_reached_exactly(method):
    end = 7.3
    run = begun(method, native("pendulum"), [1.0, 0.5], end, control(step=0.1), t0=0.1)
    while run.t < end:
        run.step(end)
    assert run.t == end


@pytest.mark.parametrize("method", METHODS, **names)
def test_states_are_fresh_arrays(method):
    run = begun(method, native("pendulum"), [1.0, 0.5], 5.0, control(step=0.1))
    kept = []
    for _ in range(10):
        run.step(5.0)
        kept.append((run.y, run.y.copy()))
    assert all((a == b).all() for a, b in kept)


@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_tolerances_may_change_between_calls(method):
    """The arrays of the control are looked at in every call."""
    how = control(tolerance=1e-4)
    run = begun(method, native("pendulum"), [1.0, 0.5], 100.0, how)
    samples(run, np.array([50.0]))
    loose = run.steps
    how.atol[:] = how.rtol[:] = 1e-13
    samples(run, np.array([100.0]))
    assert run.steps - loose > 2 * loose


@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_longest_step_and_first_step(method):
    how = control(tolerance=1e-2, first_step=0.01, max_step=0.05)
    run = begun(method, native("pendulum"), [0.1, 0.0], 1.0, how)
    times = [0.0]
    while run.t < 1.0:
        run.step(1.0)
        times.append(run.t)
    assert times[1] == 0.01
    assert max(np.diff(times)) <= 0.05 * (1 + 1e-12)


@pytest.mark.parametrize("method", GENERAL, **names)
@pytest.mark.parametrize(("name", "y0"), [("explode", [1.0, 0.0]), ("wall", [0.0, 1.0])])
def test_where_the_equations_end_the_last_good_state_is_kept(method, name, y0):
    """y' = y² ends at t = 1; beyond the wall at y = 1 nothing is defined."""
    rhs = native(name)
    run = begun(method, rhs, y0, 2.0, control(step=1e-3))
    out = np.empty((1, 2))
    assert run.advance(np.array([2.0]), out, most_steps=10**6, most_evaluations=1e9).failure
    stood, state = run.t, run.y
    assert np.isfinite(state).all()
    if name == "wall" or method.adaptive:
        assert stood == pytest.approx(1.0, abs=2e-3)
    with pytest.raises(StepError):
        run.step(2.0)
    assert run.t == stood
    assert (run.y == state).all()


@pytest.mark.parametrize("method", METHODS, **names)
def test_overflow_is_a_failure(method):
    run = begun(method, native("overflow"), [0.0, 1.0], 1e9, control(step=1.0))
    done = run.advance(np.array([1e9]), np.empty((1, 2)), most_steps=9999, most_evaluations=1e9)
    assert done.failure
    assert np.isfinite(run.y).all()


@pytest.mark.parametrize("method", METHODS, **names)
def test_nothing_at_the_start_fails_there(method):
    with pytest.raises(StepError):
        begun(method, native("nowhere"), [1.0, 0.0], 2.0, control(step=0.1)).step(2.0)


@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_a_tolerance_of_zero_underflows(method):
    how = Control(np.zeros(2), np.zeros(2), 1e-3, 1.0)
    run = begun(method, native("pendulum"), [1.0, 0.5], 2.0, how)
    with pytest.raises(StepError, match="underflow"):
        run.step(2.0)
    assert run.t == 0.0


@pytest.mark.parametrize("method", METHODS, **names)
@pytest.mark.parametrize("exponent", [-340, 300])
def test_units_that_are_powers_of_two_change_no_bit(method, exponent):
    """Lengths in other units: q'' = p₀ − p₁ q with q, p₀ and the tolerance scaled."""
    unit = 2.0**exponent
    times = np.linspace(0.0, 5.0, 30)
    found = []
    for size in (1.0, unit):
        how = Control(np.full(2, 1e-9), np.full(2, 1e-11 * size), 1e-3, 1.0, 0.02)
        run = begun(method, native("sums", 3.0 * size, 4.0), [size, 0.0], 5.0, how)
        found.append(samples(run, times) / size)
    assert (found[0] == found[1]).all()


@pytest.mark.parametrize("method", METHODS, **names)
def test_units_of_time_that_are_powers_of_two_change_no_bit(method):
    """Step control compares errors with tolerances only, and times with each other."""
    found = []
    for unit in (1.0, 2.0**-40):
        how = Control(np.full(2, 1e-9), np.array([1e-9, 1e-9 / unit]), 2.0**-10 * unit, 1e9, 0.0625)
        how = Control(how.rtol, how.atol, how.first_step, 1e9, 0.0625 * unit)
        rhs = native("oscillator", 4.0 / unit**2)
        run = begun(method, rhs, [1.0, 0.0], 5.0 * unit, how)
        found.append(samples(run, np.linspace(0.0, 5.0, 30) * unit) * np.array([1.0, unit]))
    assert (found[0] == found[1]).all()


@pytest.mark.parametrize("method", METHODS, **names)
def test_lanes_and_single_states_agree(method):
    """Lanes that refuse are computed one by one; so are all where there are none."""
    times = np.linspace(0.0, 5.0, 30)
    found = [
        samples(
            begun(method, native("pendulum", lanes=lanes), [1.0, 0.5], 5.0, control(step=0.02)),
            times,
        )
        for lanes in (True, False)
    ]
    assert (found[0] == found[1]).all()


@pytest.mark.slow
@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_threads_do_not_see_each_other(method):
    """Four runs at once over one right-hand side give the bits of one alone."""
    rhs = native("pendulum")
    times = np.linspace(0.0, 400.0, 2000)
    alone = samples(begun(method, rhs, [1.0, 0.5], 400.0, control(2, 1e-13)), times)
    found = [None] * 4

    def work(k):
        found[k] = samples(begun(method, rhs, [1.0, 0.5], 400.0, control(2, 1e-13)), times)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((states == alone).all() for states in found)


def test_python_goes_on_during_a_long_call():
    """The GIL is released: another thread counts while one call makes a million steps."""
    run = begun(INTEGRATORS["RK4"], native("pendulum"), [1.0, 0.5], 1e6, control(step=1e-3))
    begin, done, counted = threading.Event(), threading.Event(), []

    def count():
        begin.wait()
        while not done.is_set():
            counted.append(run.t)

    thread = threading.Thread(target=count)
    thread.start()
    begin.set()
    run.advance(np.array([1e6]), np.empty((1, 2)), most_steps=10**6, most_evaluations=math.inf)
    seen = len(counted)
    done.set()
    thread.join()
    assert run.steps == 10**6
    assert seen > 1000


@pytest.mark.parametrize("method", ADAPTIVE, **names)
def test_stiffness_forces_small_steps(method):
    run = begun(method, native("stiff"), [1.0, -1.0], 2.0, control(tolerance=1e-5))
    run.advance(np.array([2.0]), np.empty((1, 2)), most_steps=10**9, most_evaluations=3000)
    assert (run.t == 2.0) == method.implicit


def test_rejections_and_evaluations_are_counted():
    run = begun(INTEGRATORS["DOP853"], native("kepler", 1.0), [0.1, 0, 0, 4.2], 9.0, control(4))
    samples(run, np.array([9.0]))
    # Eleven slopes for each try, and one more at the start and at each end of a step.
    tries = run.steps + run.rejections
    assert run.rejections > 0
    assert run.evaluations == 11 * tries + run.steps + 1


@pytest.mark.slow
@pytest.mark.compiler
def test_sources_are_strict_c99(tmp_path):
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler was found")
    for name, text in {**kernels.kernel_files(), **kernels.kernel_headers()}.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "header.c").write_text(
        '#include "lanes.h"\ndouble f(double x);\n'
        "double f(double x) { return lagrange_lane_sin(x) + lagrange_lane_cos(x); }\n"
    )
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-c"]
    # Values that may be used before they are set are found by the optimizer.
    for options in (["-O2", "-DLAGRANGE_DIM=3"], ["-fsyntax-only"]):
        command = [compiler, *strict, *options, *map(str, tmp_path.glob("*.c"))]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_kernels_have_no_globals():
    """Nothing outlives a call but the memory that the caller gave."""
    for name, text in kernels.kernel_files().items():
        for line in text.splitlines():
            if line.startswith("static ") and "(" not in line and "=" in line:
                assert line.startswith("static const "), (name, line)
            assert not line.startswith("    static "), (name, line)


def test_every_system_of_these_tests_is_used():
    here = Path(__file__).parent
    tests = "".join(path.read_text() for path in here.glob("test_kernel*.py"))
    assert all(f'"{name}"' in tests for name in SYSTEMS)


def test_rest_takes_one_evaluation_a_step_where_nothing_depends_on_time():
    for autonomous, most in ((True, 1 + 4), (False, 1 + 4 * 12)):
        how = Control(np.zeros(2), np.full(2, 1e-9), 0.5, 0.5, autonomous=autonomous)
        run = begun(INTEGRATORS["DOP853"], native("oscillator", 1.0), [0.0, 0.0], 2.0, how)
        assert (samples(run, np.linspace(0.0, 2.0, 21)) == 0).all()
        assert (run.steps, run.evaluations) == (4, most)


@pytest.mark.slow
def test_a_parabola_needs_no_further_slopes_between_steps(real_compiler, monkeypatch):
    monkeypatch.setenv("CC", real_compiler)  # The error is that of the code that users run.
    how = Control(np.zeros(2), np.full(2, 1e-9), 1.0, 1.0)
    run = begun(INTEGRATORS["DOP853"], native("sums", 3.0, 0.0), [0.5, 1.0], 2.0, how)
    times = np.linspace(0.0, 2.0, 21)
    exact = np.column_stack([0.5 + times + 1.5 * times**2, 1.0 + 3.0 * times])
    assert np.abs(samples(run, times) - exact).max() < 1e-14
    assert run.evaluations == 1 + 2 * 12
    run = begun(INTEGRATORS["DOP853"], native("pendulum"), [0.5, 1.0], 2.0, how)
    samples(run, times)
    assert run.evaluations > run.steps * (12 + 3)
