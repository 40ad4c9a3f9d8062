"""Sampled controllers against exact steps of linear systems, SciPy and falls in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from lagrange_cli import loads
from lagrange_cli.errors import InputError

OSCILLATOR = """
parameters: {m: 2, k: 3, c: 0.4, h: 0.15, p: 5, d: 2}
particles: {block: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
dissipation: {damper: c*dot(x)^2/2}
inputs: [F]
forces: {motor: {on: x, force: F}}
controllers: {every: h, hold: {F: -p*x - d*dot(x)}}
initial: {x: 1, dot(x): -0.5}
simulate: {until: 6, samples: 81}
"""

PID = """
parameters: {m: 1, l: 0.5, g: 9.81, P: 30, I: 40, D: 5, h: 0.05, w: 0.5}
plane: xz
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
inputs: [tau]
forces: {motor: {on: theta, force: tau}}
controllers:
  every: h
  hold: {tau: "max(-8, min(8, P*(w - theta) + I*e - D*(theta - before)/h))"}
  memory: {e: e + h*(w - theta), before: theta}
initial: {theta: 0, e: 0, before: 0}
simulate: {until: 3}
"""

CASCADE = """
parameters: {m: 1}
particles: {block: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
inputs: [F, target]
forces: {motor: {on: x, force: F}}
controllers:
  inner: {every: 1/200, hold: {F: 40*(target - x) - 8*dot(x)}}
  outer: {every: 3/200, hold: {target: 1 - x}}
initial: {x: 0.2}
simulate: {until: 1}
"""


def exact_steps(until: float, h: float, between: int) -> np.ndarray:
    """States of the oscillator, F behind them, by the matrix exponential over parts of samples."""
    m, k, c, p, d = 2, 3, 0.4, 5, 2
    rates = np.array([[0, 1, 0], [-k / m, -c / m, 1 / m], [0, 0, 0]])
    part, y = expm(rates * h / between), np.array([1, -0.5, 0.0])
    rows = []
    for step in range(round(until / h) * between + 1):
        if step % between == 0:
            y = np.array([y[0], y[1], -p * y[0] - d * y[1]])
        rows.append(y)
        y = part @ y
    return np.array(rows)


@pytest.mark.parametrize("accuracy", [1e-6, 1e-11])
def test_motion_takes_exact_steps_of_the_linear_system(accuracy):
    motion = loads(OSCILLATOR).derive().simulate(accuracy=accuracy)
    exact = exact_steps(6, 0.15, 2)
    assert motion.status == "ok"
    for name, column in zip(("x", "dot(x)", "F"), exact.T, strict=True):
        error = np.abs(motion.columns[name] - column).max()
        assert error <= accuracy * np.abs(column).max()


@pytest.mark.parametrize("method", ["DOP853", "Gauss16", "Radau", "BDF"])
def test_methods_stop_at_samples(method):
    motion = loads(OSCILLATOR).derive().simulate(method=method, rtol=1e-9, atol=1e-9)
    assert np.abs(motion.columns["x"] - exact_steps(6, 0.15, 2)[:, 0]).max() < 1e-6


def test_fixed_steps_end_at_samples():
    derivation, exact = loads(OSCILLATOR).derive(), exact_steps(6, 0.15, 2)[-1, 0]
    runs = [derivation.simulate(method="RK4", step=h) for h in (0.05, 0.025)]
    coarse, fine = (abs(run.columns["x"][-1] - exact) for run in runs)
    # The order of the method is left.
    assert coarse / fine > 12
    assert all(run.steps >= steps for run, steps in zip(runs, (120, 240), strict=True))
    assert all(run.rhs_evaluations == 4 * run.steps for run in runs)


def pid_by_scipy() -> list[float]:
    y, e, before, tau, h = np.array([0.0, 0.0]), 0.0, 0.0, 0.0, 0.05
    for number in range(61):
        theta = float(y[0])
        tau = max(-8.0, min(8.0, 30 * (0.5 - theta) + 40 * e - 5 * (theta - before) / h))
        e, before = e + h * (0.5 - theta), theta
        if number < 60:
            y = solve_ivp(
                lambda t, y, tau=tau: [y[1], tau / 0.25 - 9.81 / 0.5 * np.sin(y[0])],
                (number * h, (number + 1) * h),
                y,
                "DOP853",
                rtol=1e-13,
                atol=1e-15,
            ).y[:, -1]
    return [*y, e, before, tau]


def test_memory_is_set_at_once_with_what_is_held():
    motion = loads(PID).derive().simulate(accuracy=1e-10)
    names = ("theta", "dot(theta)", "e", "before", "tau")
    for name, exact in zip(names, pid_by_scipy(), strict=True):
        assert abs(motion.columns[name][-1] - exact) < 1e-9


def test_interpreted_functions_sample_alike(monkeypatch):
    compiled = loads(PID).derive().simulate(accuracy=1e-9)
    monkeypatch.setattr("lagrange_cli.toolchain.compiler.find_compiler", _no_compiler)
    from lagrange_cli.simulate.model.build import model_of
    from lagrange_cli.simulate.simulation import simulate
    from lagrange_cli.simulate.system.functions import interpreted

    model = model_of(loads(PID).derive().equations)
    motion = simulate(model, accuracy=1e-9, functions=interpreted(model, "asked for"))
    assert np.abs(motion.columns["theta"] - compiled.columns["theta"]).max() < 2e-9


def _no_compiler():
    raise AssertionError("nothing is to be compiled")


def test_controllers_of_several_rates_meet_at_exact_times():
    motion = loads(CASCADE).derive().simulate(accuracy=1e-11, samples=201)
    y, target, force = np.array([0.2, 0.0]), 0.0, 0.0
    h = 1 / 200
    step = expm(np.array([[0, 1, 0], [0, 0, 1], [0, 0, 0]]) * h)
    for number in range(201):
        x, v = y
        new = 1 - x if number % 3 == 0 else target
        force, target = 40 * (target - x) - 8 * v, new
        assert abs(motion.columns["x"][number] - x) < 1e-11
        assert abs(motion.columns["F"][number] - force) < 1e-9
        y = (step @ [x, v, force])[:2]


def test_a_run_that_begins_between_samples_goes_on_with_multiples():
    text = OSCILLATOR.replace("until: 6, samples: 81", "from: 0.05, until: 0.35, samples: 31")
    motion = loads(text).derive().simulate(accuracy=1e-10)
    changes = np.flatnonzero(np.diff(motion.columns["F"])) + 1
    assert motion.t[changes].tolist() == pytest.approx([0.15, 0.3])


BALL = """
particles: {ball: {mass: 1, position: [x, 0, z]}}
coordinates: [x, z]
constraints: {floor: {unilateral: z >= 0}}
potentials: {weight: {gravity: 10}}
inputs: [F]
forces: {push: {on: z, force: F}}
controllers: {every: 0.5, hold: {F: 15*heaviside(t - 0.9)}}
initial: {x: 0, z: 1.25, dot(x): 1}
simulate: {until: 1.5}
"""


def test_a_contact_closes_and_opens_at_samples():
    # It falls for exactly 0.5, where the controller samples, rests, and is lifted from t = 1 on.
    motion = loads(BALL).derive().simulate(accuracy=1e-9)
    events = [(e.name, round(e.t, 9)) for e in motion.events]
    assert events == [("contact:floor", 0.5), ("release:floor", 1.0)]
    assert motion.status == "ok"
    assert motion.columns["z"][-1] == pytest.approx(5 * 0.5**2 / 2, abs=1e-8)


@pytest.mark.parametrize(
    ("change", "options", "said"),
    [
        (("every: h", "every: 1e-9"), {}, "controllers sample 6e+09 times"),
        (("F: -p*x", "F: log(x - 1)"), {}, "not finite at the start"),
        (("h: 0.15", "h: 0"), {}, "must be positive, found h"),
        ((" p: 5", " p: 5"), {"method": "Verlet", "step": 0.1}, "no place for the states"),
        ((" p: 5", " p: 5"), {"sensitivity": ["p"]}, "a controller samples it"),
    ],
)
def test_what_does_not_go_is_refused(change, options, said):
    with pytest.raises(InputError, match=said.replace("+", r"\+")):
        loads(OSCILLATOR.replace(*change)).derive().simulate(**options)


def test_programs_that_would_not_sample_are_refused():
    derivation = loads(OSCILLATOR).derive()
    for language in ("c", "cpp", "rust", "fortran"):
        with pytest.raises(InputError, match="does not sample the motion"):
            derivation.emit(language, main=True)


def test_a_run_ends_where_nothing_finite_is_set():
    text = OSCILLATOR.replace("F: -p*x - d*dot(x)", "F: sqrt(x)")
    motion = loads(text).derive().simulate()
    assert motion.status == "blow_up"
    assert "what a controller sets is not finite" in str(motion.reason)


def test_members_have_their_own_time_between_samples():
    derivation = loads(OSCILLATOR).derive()
    ensemble = derivation.ensemble({"h": [0.15, 0.3]}, accuracy=1e-9)
    alone = loads(OSCILLATOR.replace("h: 0.15", "h: 0.3")).derive().simulate(accuracy=1e-9)
    assert ensemble.columns["x"][1, -1] == pytest.approx(alone.columns["x"][-1], abs=2e-9)
    assert abs(ensemble.columns["x"][0, -1] - alone.columns["x"][-1]) > 1e-4
