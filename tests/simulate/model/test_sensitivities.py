"""Derivatives of motions by starts and parameters, beside differences of runs in 40 digits."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp

from lagrange_cli import load, loads
from lagrange_cli.errors import AccuracyError, InputError
from lagrange_cli.simulate.model import sensitivities
from tests.cli.terminal import lagrange

SYSTEMS = Path(__file__).parents[3] / "systems"
DIGITS = 40
STEP = mpmath.mpf(10) ** -12


def extrapolated(rhs, t0, y0, t1, steps, columns=14):
    """Integrate by Gragg's midpoint rule, extrapolated (Hairer, Nørsett, Wanner I, II.9)."""
    t, y, h = mpmath.mpf(t0), list(y0), (mpmath.mpf(t1) - t0) / steps
    for _ in range(steps):
        table: list[list[list[mpmath.mpf]]] = []
        for k in range(columns):
            n = 2 * (k + 1)
            row = [_midpoint(rhs, t, y, h, n)]
            for j in range(1, k + 1):
                ratio = (mpmath.mpf(n) / (2 * (k + 1 - j))) ** 2 - 1
                pairs = zip(row[j - 1], table[k - 1][j - 1], strict=True)
                row.append([a + (a - b) / ratio for a, b in pairs])
            table.append(row)
        y, t = table[-1][-1], t + h
    return y


def _midpoint(rhs, t, y, h, n):
    step = h / n
    before, now = y, [a + step * b for a, b in zip(y, rhs(t, y), strict=True)]
    for k in range(1, n):
        slopes = rhs(t + k * step, now)
        before, now = now, [a + 2 * step * b for a, b in zip(before, slopes, strict=True)]
    return now


def exact_motion(equations, values, start, until, steps):
    """The state at the end in 40 digits, with these parameters, from this state."""
    n = len(equations.system.coordinates)
    symbols = [equations.system.t, *(c.q for c in equations.system.coordinates)]
    symbols += [
        *(c.v for c in equations.system.coordinates),
        *(p.symbol for p in equations.system.parameters),
    ]
    matrix = [entry for row in equations.system.mass_matrix for entry in row]
    evaluate = sp.lambdify(
        symbols, [*matrix, *equations.system.forcing], modules="mpmath", cse=True
    )

    def rhs(t, y):
        numbers = evaluate(t, *y, *values)
        rows = mpmath.matrix(n, n)
        for k in range(n * n):
            rows[k // n, k % n] = numbers[k]
        return [*y[n:], *mpmath.lu_solve(rows, mpmath.matrix(numbers[n * n :]))]

    return extrapolated(rhs, 0, start, until, steps)


def differences(derivation, names, until, steps):
    """Derivatives of the state at the end by starts and parameters, shape (names, 2n)."""
    equations = derivation.equations
    model = derivation.model()
    states = [*model.state_names]
    with mpmath.workdps(DIGITS):
        values = [mpmath.mpf(x.numerator) / x.denominator for x in model.exact_numbers]
        start = [mpmath.mpf(x.numerator) / x.denominator for x in model.exact_initial]
        columns = []
        for name in names:
            ends = []
            for sign in (1, -1):
                p, y = list(values), list(start)
                moved, k = (
                    (y, states.index(name))
                    if name in states
                    else (
                        p,
                        [x.name for x in equations.system.parameters].index(name),
                    )
                )
                step = STEP * (abs(moved[k]) or 1)
                moved[k] += sign * step
                ends.append(exact_motion(equations, p, y, until, steps))
            columns.append([float((a - b) / (2 * step)) for a, b in zip(*ends, strict=True)])
    return np.array(columns)


CASES = {
    "pendulums/double_pendulum": (["theta1", "dot(theta2)", "m2", "l1", "g"], 0.5, 6),
    "celestial/kepler": (["r", "dot(phi)", "G", "M"], 1.75e6, 6),
}


@cache
def minimal(name):
    return load(SYSTEMS / f"{name}.yaml").derive(formulation="minimal")


@cache
def exact_derivatives(name):
    """The same for both accuracies, and what takes long."""
    return differences(minimal(name), *CASES[name])


@pytest.mark.slow
@pytest.mark.parametrize("eps", [1e-6, 1e-10])
@pytest.mark.parametrize("name", list(CASES))
def test_differences_of_exact_runs(name, eps):
    names, until, _ = CASES[name]
    derivation = minimal(name)
    run = derivation.simulate(sensitivity=names, accuracy=eps, until=until)
    assert run.status == "ok"
    exact = exact_derivatives(name)
    coordinates = [c.name for c in derivation.equations.system.coordinates]
    for by, row in zip(names, exact, strict=True):
        columns = [f"d({c})/d({by})" for c in coordinates]
        columns += [f"dot({column})" for column in columns]
        for column, value in zip(columns, row, strict=True):
            assert abs(run.state[column] - value) <= eps * run.scales[column], column


OSCILLATOR = """
parameters: {m: 2.0, w: 3.0, k: m*w^2, x0: 0.5}
particles: {bob: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k/2*x^2}
initial: {x: 2*x0}
simulate: {until: 1.25, accuracy: 1e-10, samples: 51}
"""


@pytest.mark.slow
@pytest.mark.usefixtures("without_packaged_compiler")
@pytest.mark.parametrize("compiled", [True, False])
def test_parameters_that_others_and_the_start_depend_on(compiled, monkeypatch):
    """x = 2·x0·cos(√(k/m) t), where k = m·w² follows m and w."""
    if not compiled:
        monkeypatch.setenv("PATH", "")
        monkeypatch.delenv("CC", raising=False)
    run = loads(OSCILLATOR).derive().simulate(sensitivity=["x0", "w", "k", "m", "x"])
    t = run.t
    exact = {
        "x0": 2 * np.cos(3 * t),
        "w": -t * np.sin(3 * t),
        "k": -t * np.sin(3 * t) / (2 * 3.0 * 2.0),
        "m": 0 * t,
        "x": np.cos(3 * t),
    }
    for name, values in exact.items():
        column = f"d(x)/d({name})"
        error = np.abs(run.columns[column] - values).max()
        assert error <= 1e-10 * max(run.scales[column], 1e-3), name
    rates = run.columns["dot(d(x)/d(w))"]
    assert np.abs(rates + np.sin(3 * t) + 3 * t * np.cos(3 * t)).max() < 1e-9


@pytest.mark.slow
def test_other_values_of_a_derivation():
    derivation = loads(OSCILLATOR).derive()
    run = derivation.simulate(sensitivity=["w"], parameters={"w": 2}, initial={"x": 1})
    assert np.abs(run.columns["d(x)/d(w)"] + run.t * np.sin(2 * run.t)).max() < 1e-9
    again = derivation.simulate(sensitivity=["w"])
    assert np.abs(again.columns["d(x)/d(w)"] + again.t * np.sin(3 * again.t)).max() < 1e-9


SPRING = """
sizes: {n: 1, k: 1}
parameters: {m: 2.0, K: 3.0, x0: 0.5}
particles: {"bead[i=1..n]": {mass: m, position: ["x[i]", 0, 0]}}
coordinates: ["x[i=1..n]"]
potentials: {"spring[i=1..n]": "k*K/2*x[i]^2 + x[i]^4"}
initial: {"x[i=1..n]": 2*x0}
simulate: {until: 2*sqrt(m/K), accuracy: 1e-9, samples: 21}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "values", [{"m": 0.7}, {"K": 5, "x0": -0.2}, {"x0": "1/3", "m": "sqrt(2)"}]
)
def test_other_values_are_those_of_a_scene_that_has_them(values):
    names = ["K", "x0", "x[1]"]
    derivation = loads(SPRING).derive()
    derivation.simulate(sensitivity=names)
    run = derivation.simulate(sensitivity=names, parameters=values)
    anew = loads(SPRING, parameters=values).derive().simulate(sensitivity=names)
    assert run.t[-1] == anew.t[-1]
    for name, column in anew.columns.items():
        scale = max(anew.scales.get(name, 1.0), 1e-6)
        assert np.abs(run.columns[name] - column).max() <= 2e-9 * scale, name


@pytest.mark.slow
def test_code_is_made_once_for_all_values(monkeypatch):
    made = []
    model_of = sensitivities.model_of
    monkeypatch.setattr(
        sensitivities, "model_of", lambda equations: made.append(equations) or model_of(equations)
    )
    derivation = loads(SPRING).derive()
    for values in ({}, {"m": 3}, {"K": 4, "x0": 0.1}):
        derivation.simulate(sensitivity=["x0", "m"], parameters=values)
    derivation.simulate(sensitivity=["x0", "m"], initial={"x[1]": 2})
    assert len(made) == 1
    derivation.simulate(sensitivity=["m"])
    assert len(made) == 2


ROD = """
parameters: {m: 1, l: {value: 1, positive: true}, K: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [x]
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: K}}
initial: {x: 0.6, z: -0.8}
simulate: {until: 0.3, formulation: minimal}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "values"),
    [
        (SPRING, {"parameters": {"n": 2}}),
        (SPRING, {"parameters": {"k": 2}}),
        (ROD, {"initial": {"z": 0.8}}),
    ],
)
def test_values_that_lead_to_other_equations(text, values):
    """A size, also one that is only a factor, and the other root of a constraint."""
    derivation = loads(text).derive()
    assert derivation.simulate(**values).status == "ok"
    with pytest.raises(InputError, match="other equations"):
        derivation.simulate(sensitivity=["K"], **values)
    assert loads(text, **values).derive().simulate(sensitivity=["K"]).status == "ok"


def test_inputs_that_are_functions():
    text = SPRING + "inputs: {F: 0}\nforces: {push: {on: 'bead[1]', force: [F, 0, 0]}}\n"
    derivation = loads(text).derive()
    inputs = {"F": lambda t: 1.0}
    assert derivation.simulate(inputs=inputs).status == "ok"
    with pytest.raises(InputError, match="Python functions"):
        derivation.simulate(inputs=inputs, sensitivity=["m"])


SPHERICAL = """
parameters: {m: 1.0, l: {value: 1.0, positive: true}, g: 9.81}
coordinates: [theta, phi]
definitions: {x: l*sin(theta)*cos(phi), y: l*sin(theta)*sin(phi), z: -l*cos(theta)}
particles: {bob: {mass: m, position: [x, y, z]}}
potentials: {weight: {gravity: g}}
initial: {theta: 1.2, phi: 0, dot(theta): 0, dot(phi): 1e-6}
simulate: {until: 1, samples: 101}
"""


def test_a_step_over_the_pole():
    """Steps of fixed size pass the pole unseen: from there on derivatives would be wrong."""
    derivation = loads(SPHERICAL).derive()
    how = {"method": "RK4", "step": 0.01, "sensitivity": ["theta"]}
    with pytest.raises(AccuracyError, match=r"singular where sin\(theta\) = 0") as caught:
        derivation.simulate(**how)
    (problem,) = caught.value.problems
    last = float(problem.hint.removeprefix("--until ").partition(",")[0])
    assert 0.3 < last < 0.6  # a quarter of the period
    assert derivation.simulate(**how, until=last).status == "ok"
    through = derivation.simulate(**how, initial={"dot(phi)": 0})
    assert through.status == "ok", "phi stands still: the angles' own equations go through"


@pytest.mark.slow
def test_coupled_coordinates_that_a_loop_would_solve():
    """Eight links: the sum of all displacements' derivatives is that of one more run."""
    derivation = load(SYSTEMS / "chains" / "pendulum_chain.yaml", parameters={"n": 8}).derive(
        formulation="minimal"
    )
    run = derivation.simulate(sensitivity=["g"], accuracy=1e-9, until=1.0)
    g = next(p.value for p in derivation.equations.system.parameters if p.name == "g")
    ends = [
        derivation.simulate(parameters={"g": g + s * 1e-3}, accuracy=1e-12, until=1.0).state
        for s in (1, -1)
    ]
    for c in derivation.equations.system.coordinates:
        slope = (ends[0][c.name] - ends[1][c.name]) / 2e-3
        assert run.state[f"d({c.name})/d(g)"] == pytest.approx(slope, rel=1e-5, abs=1e-7)


FALLING = """
parameters: {m: 2.0, g: 9.81, A: 1.0, w: 1e-3}
coordinates: [x, z]
definitions: {y: 0}
particles: {stone: {mass: m, position: [x, y, z]}}
potentials: {weight: {gravity: g}, wall: A*exp(-(x/w)^2)}
initial: {x: 1e-4, z: 0, dot(x): 0, dot(z): 0}
simulate: {until: 1e-4, accuracy: 1e-9, samples: 11}
"""


def test_parameters_that_drop_out():
    """Nothing but rounding would be left of the derivative by the planet's mass."""
    derivation = load(SYSTEMS / "celestial" / "kepler.yaml").derive()
    run = derivation.simulate(sensitivity=["m"], accuracy=1e-9)
    assert run.status == "ok"
    assert {v for name, v in run.state.items() if "d(m)" in name} == {0.0}


def test_a_parameter_that_acts_in_a_narrow_place():
    """At nearly all states the mass drops out in all digits, but not beside x = 0."""
    near = loads(FALLING).derive().simulate(sensitivity=["m"])
    # To first order in time x − x₀ = ½ t² F/m, so that its derivative by m is −½ t² F/m².
    force = 2 * 1e-4 / 1e-6 * np.exp(-0.01)
    assert near.state["d(x)/d(m)"] == pytest.approx(-(1e-4**2) / 2 * force / 4, rel=0.01)
    assert near.state["d(z)/d(m)"] == pytest.approx(0.0, abs=1e-12)


REFUSALS = {
    "constraints/four_bar_linkage": "constraints are kept beside the coordinates",
    "contact/bouncing_ball": "make it change by jumps",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(REFUSALS))
def test_refusals(name):
    derivation = load(SYSTEMS / f"{name}.yaml").derive()
    with pytest.raises(InputError, match=REFUSALS[name]):
        derivation.simulate(sensitivity=[derivation.equations.system.parameters[0].name])


def test_an_unknown_name():
    derivation = loads(OSCILLATOR).derive()
    with pytest.raises(InputError, match="did you mean 'x0'"):
        derivation.simulate(sensitivity=["x00"])


@pytest.mark.slow
def test_the_command(tmp_path):
    scene = tmp_path / "oscillator.yaml"
    scene.write_text(OSCILLATOR)
    words = ["simulate", str(scene)]
    done = lagrange(*words, "--sensitivity", "x, w", "-o", str(tmp_path / "x.csv"))
    assert done.returncode == 0, done.stderr
    assert "d(x)/d(w)" in done.stdout
    header = (tmp_path / "x.csv").read_text().splitlines()[0].split(",")
    assert header[:4] == ["t", "x", "d(x)/d(x)", "d(x)/d(w)"]
    for wrong, said in (
        (["--sensitivity", "x,,w"], "a name is missing"),
        (["--sensitivity", "x", "--vary", "w=1,2"], "not of an ensemble"),
        (["--sensitivity", "y"], "neither a coordinate"),
    ):
        done = lagrange(*words, *wrong)
        assert done.returncode == 2
        assert said in done.stderr


def test_starts_in_constants_of_integration():
    """A wheel rolls against a spring: x(t) = x_0 cos t and phi = phi_0 + (x - x_0)/R."""
    scene = (
        "parameters: {m: 2, R: 0.5, I: 0.25, k: 3}\n"
        "particles: {wheel: {mass: m, position: [x, 0, 0]}}\n"
        "constraints: {rolls: dot(x) = R*dot(phi)}\ncoordinates: [phi]\n"
        "kinetic: {spin: I*dot(phi)^2/2}\npotentials: {spring: k*x^2/2}\n"
        "initial: {x: 1, phi: 0.4, dot(phi): 0}\n"
    )
    motion = loads(scene).derive().simulate(until=3, accuracy=1e-9, sensitivity=["phi", "x", "R"])
    swing = np.cos(motion.t)
    assert np.abs(motion.columns["d(phi)/d(phi)"] - 1).max() < 1e-8
    assert np.abs(motion.columns["d(phi)/d(x)"] - (swing - 1) / 0.5).max() < 1e-8
    with pytest.raises(InputError, match="'phi_0' is neither a coordinate"):
        loads(scene).derive().simulate(until=3, sensitivity=["phi_0"])


def test_parameters_in_the_expression_of_an_input():
    """A mass on a spring, driven by F = A sin(w t): x is linear in A, and known in closed form."""
    scene = (
        "parameters: {m: 2, k: 6, A: 0.7, w: 1.3}\ninputs: {F: A*sin(w*t)}\n"
        "particles: {p: {mass: m, position: [x, 0, 0]}}\ncoordinates: [x]\n"
        "potentials: {spring: k*x^2/2}\nforces: {drive: {on: x, force: F}}\n"
        "initial: {x: 0, dot(x): 0}\n"
    )
    motion = loads(scene).derive().simulate(until=5, accuracy=1e-10, sensitivity=["A", "w"])
    t, own = motion.t, np.sqrt(3.0)

    def swing(w):
        return 0.35 / (3 - w**2) * (np.sin(w * t) - w / own * np.sin(own * t))

    assert np.abs(motion.columns["x"] - swing(1.3)).max() < 1e-8
    assert np.abs(motion.columns["d(x)/d(A)"] - swing(1.3) / 0.7).max() < 1e-8
    slope = (swing(1.3 + 1e-5) - swing(1.3 - 1e-5)) / 2e-5
    assert np.abs(motion.columns["d(x)/d(w)"] - slope).max() < 1e-8
