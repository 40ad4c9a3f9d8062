"""Every declared property of every registered method, measured."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

from lagrange_cli.simulate.integrators import INTEGRATORS, Control, StepError
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from tests.simulate.available import BY_VALUES

METHODS = BY_VALUES
FIXED_ORDER = [m for m in METHODS if not m.variable_order and m.order <= 8]
VARIABLE_ORDER = [m for m in METHODS if m.variable_order]
ADAPTIVE = [m for m in METHODS if m.adaptive]


def pendulum(t, y):
    return np.array([y[1], -math.sin(y[0])])


def control(n, *, tolerance=1e-6, first_step=1e-4, max_step=1e9, step=None):
    return Control(np.full(n, tolerance), np.full(n, tolerance), first_step, max_step, step)


def problem(rhs, y0, until, samples=2):
    y0 = np.array(y0, dtype=float)
    kinds = ("length",) * (len(y0) // 2)
    return InitialValueProblem(rhs, y0, np.linspace(0.0, until, samples), kinds)


def one_step(run):
    """Whether a step was made."""
    before = run.steps
    run.advance(len(run.states) + 10**6, 1)
    return run.steps > before


def ended(method, of, how):
    run = Run(method, of, how)
    while one_step(run):
        pass
    assert run.failure is None
    return run


def steps_of(h, atol=1e-3):
    """A control that makes every method take steps of size h.

    The small relative tolerance makes implicit methods solve their equations well.
    """
    return Control(np.full(2, 1e-11), np.full(2, atol), h, h, h)


@pytest.fixture(scope="module")
def exact():
    """The pendulum at t = 2 from (1, 0.5), by a much finer run of another kind."""
    fine = Run(
        INTEGRATORS["DOP853"], problem(pendulum, [1.0, 0.5], 2.0), control(2, tolerance=1e-16)
    )
    while one_step(fine):
        pass
    return fine.y


@pytest.mark.parametrize("method", FIXED_ORDER, ids=lambda m: m.name)
def test_order_by_convergence(method, exact):
    intervals = [4, 8] if method.order > 5 else [16, 32]
    errors = []
    for n in intervals:
        run = ended(method, problem(pendulum, [1.0, 0.5], 2.0), steps_of(2.0 / n))
        assert run.steps == n
        errors.append(np.abs(run.y - exact).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(method.order, abs=0.7)


def test_order_of_collocation_by_quadrature():
    """Where the slope depends on t alone nothing is iterated, and order 16 can be seen."""

    def rhs(t, y):
        return np.array([y[1], math.cos(5 * t)])

    errors = []
    for n in (2, 4):
        how = Control(np.zeros(2), np.full(2, 1e3), 4 / n, 4 / n)
        run = ended(INTEGRATORS["Gauss16"], problem(rhs, [0.0, 0.0], 4.0), how)
        assert run.steps == n
        errors.append(abs(run.y[1] - math.sin(20) / 5))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(16, abs=0.7)


@pytest.mark.parametrize("method", VARIABLE_ORDER, ids=lambda m: m.name)
def test_variable_order_grows_with_the_tolerance(method):
    """Of order p, steps grow as tolerance^(-1/p): far less than order 2 would need."""
    counts = [
        ended(method, problem(pendulum, [1.0, 0.5], 20.0), control(2, tolerance=tol)).steps
        for tol in (1e-5, 1e-9)
    ]
    assert counts[1] / counts[0] < (1e-5 / 1e-9) ** (1 / 3)


@pytest.mark.parametrize("method", ADAPTIVE, ids=lambda m: m.name)
def test_error_follows_the_tolerance(method, exact):
    errors = []
    for tolerance in (1e-4, 1e-8):
        run = ended(method, problem(pendulum, [1.0, 0.5], 2.0), control(2, tolerance=tolerance))
        errors.append(np.abs(run.y - exact).max())
        assert errors[-1] < 1e3 * tolerance
    assert errors[1] < errors[0] / 100


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_adaptive_or_of_fixed_step(method):
    """Only an adaptive method takes fewer steps where the tolerance is loose."""
    loose, tight = (
        ended(
            method,
            problem(pendulum, [1.0, 0.5], 20.0),
            control(2, tolerance=tolerance, step=0.05),
        ).steps
        for tolerance in (1e-3, 1e-8)
    )
    assert (tight > loose) == method.adaptive


@pytest.mark.parametrize("method", ADAPTIVE, ids=lambda m: m.name)
def test_implicit_methods_pass_over_stiffness(method):
    def stiff(t, y):
        return np.array([y[1], -1e5 * (y[1] + y[0])])

    run = Run(method, problem(stiff, [1.0, -1.0], 2.0), control(2, tolerance=1e-5))
    while run.evaluations < 3_000 and one_step(run):
        pass
    assert (run.t == 2.0) == method.implicit


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_symplectic_methods_preserve_area(method):
    """With one degree of freedom a map is symplectic where its Jacobian has determinant 1."""

    def flow(y):
        how = steps_of(1.0, atol=0.1)
        return ended(method, problem(pendulum, y, 20.0), how).y

    d = 1e-5
    columns = [
        (flow([1.0 + d * a, 0.5 + d * b]) - flow([1.0 - d * a, 0.5 - d * b])) / (2 * d)
        for a, b in ((1, 0), (0, 1))
    ]
    defect = abs(np.linalg.det(np.array(columns)) - 1)
    assert (defect < 1e-8) == method.symplectic


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_samples_are_as_accurate_as_steps(method):
    of = problem(pendulum, [1.0, 0.5], 5.0, samples=77)
    run = ended(method, of, control(2, tolerance=1e-9, step=0.002))
    fine = ended(INTEGRATORS["DOP853"], of, control(2, tolerance=1e-15))
    assert np.abs(run.states - fine.states).max() < (2e-7 if method.order > 2 else 2e-6)


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_steps_stay_within_limits(method):
    limits = control(2, first_step=0.01, max_step=0.05, step=0.05)
    run = Run(method, problem(pendulum, [1.0, 0.5], 1.0, samples=3), limits)
    times = [run.t]
    while one_step(run):
        times.append(run.t)
    assert max(np.diff(times)) <= 0.05 * (1 + 1e-9)
    assert times[-1] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("method", [m for m in METHODS if not m.needs], ids=lambda m: m.name)
def test_failure_keeps_the_last_good_state(method):
    """y' = y² from 1 ends at t = 1."""

    def explode(t, y):
        return np.array([y[0] ** 2, 0.0])

    with np.errstate(all="ignore"):
        run = Run(method, problem(explode, [1.0, 0.0], 2.0), control(2, step=1e-3))
        while one_step(run):
            pass
    assert run.failure is not None
    assert np.isfinite(run.y).all()
    assert run.failure.time == run.t
    if method.adaptive:
        assert run.t == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_nan_at_the_start_fails_at_the_start(method):
    def nowhere(t, y):
        return np.full(2, np.nan)

    with np.errstate(all="ignore"):
        integrator = None
        of = problem(nowhere, [1.0, 0.0], 2.0)
        try:
            integrator = Run(method, of, control(2, step=0.1))
        except StepError:  # a constructor may already see it
            return
        assert not one_step(integrator)
    assert integrator.t == 0.0


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_states_are_kept_and_runs_are_independent(method):
    def run():
        return Run(method, problem(pendulum, [1.0, 0.5], 3.0), control(2, step=0.1))

    first, second = run(), run()
    kept = []
    while one_step(first):
        kept.append((first.y, first.y.copy()))
        one_step(second)
    assert all((a == b).all() for a, b in kept)
    assert (first.y == second.y).all()
    assert first.evaluations == second.evaluations


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_needs_are_structure_facts(method):
    from dataclasses import fields

    from lagrange_cli.mechanics.findings import Facts

    assert set(method.needs) <= {f.name for f in fields(Facts)}


def test_registry_is_keyed_by_name():
    assert all(name == method.name for name, method in INTEGRATORS.items())
    adaptive = {"RK45", "DOP853", "Gauss16", "Radau", "BDF", "LSODA", "taylor"}
    adaptive |= {"CVODE", "IDA"}
    assert set(INTEGRATORS) == adaptive | {"RK4", "Verlet", "RATTLE", "Gauss4", "Gauss6"}


@pytest.mark.slow
def test_sums_are_compensated():
    """Twenty thousand small steps lose no digits: y' = 1 by RK4."""

    def one(t, y):
        return np.array([1.0, 0.0])

    run = ended(INTEGRATORS["RK4"], problem(one, [0.0, 0.0], 0.1 * 2e4), control(2, step=0.1))
    assert abs(run.y[0] - 2e3) <= 2e-12


def test_integrators_see_neither_sympy_nor_equations():
    import ast
    from pathlib import Path

    import lagrange_cli.simulate.integrators as package

    simulating = ("integrators", "arrays", "kernels")
    packages = (
        *(f"simulate.{name}" for name in simulating),
        "toolchain",
        "cache",
        "files",
        "phrases",
    )
    allowed = {"numpy", "scipy", "heyoka", "sksundae", *(f"lagrange_cli.{p}" for p in packages)}
    for file in Path(package.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                standard = name.split(".")[0] in sys.stdlib_module_names
                assert standard or any(f"{name}.".startswith(f"{a}.") for a in allowed)
