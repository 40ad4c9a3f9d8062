"""Inputs from CSV files: motions with closed forms, steps that end at the rows, ranges."""

from __future__ import annotations

import json
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from lagrange_cli.cli.main import run
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_file
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system import inputs as recorded_inputs
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.available import INSTALLED
from tests.simulate.compiling import compiled_or_skip

#: A damped oscillator on a table that is shaken.
OSCILLATOR = """
name: oscillator
parameters: {m: 2.0, k: 18.0, c: 0.8}
inputs: {a: {file: a.csv, column: a, interpolation: KIND}}
particles: {body: {mass: m, position: [x, y, z]}}
constraints: {rail: [y = 0, z = 0]}
coordinates: [x]
potentials: {spring: k*x^2/2}
dissipation: {damper: c*dot(x)^2/2}
forces: {shaking: {on: x, force: -m*a}}
outputs: {shown: a}
initial: {x: 0.5, dot(x): -1}
simulate: {until: 5, accuracy: 1e-10, samples: 101}
"""

TIMES = (0.0, 0.31, 0.5, 1.7, 1.73, 2.9, 4.0, 5.0)
VALUES = (1.0, -3.0, 2.5, 0.0, 40.0, -1.0, 6.0, 5.0)


def rows(times, values):
    return "t,a\n" + "".join(f"{t!r},{v!r}\n" for t, v in zip(times, values, strict=True))


def equations(folder, kind, times=TIMES, values=VALUES, scene=OSCILLATOR):
    (folder / "scene.yaml").write_text(scene.replace("KIND", kind), encoding="ascii")
    (folder / "a.csv").write_text(rows(times, values), encoding="ascii")
    return derive(read_file(str(folder / "scene.yaml")))


def polynomials(kind):
    """Coefficients of each piece in the time since its first row, by other means than SciPy's."""
    gaps = np.diff(TIMES)
    if kind == "previous":
        return [[v] for v in VALUES]
    if kind == "linear":
        return [[v, (w - v) / h] for v, w, h in zip(VALUES, VALUES[1:], gaps, strict=False)]
    return not_a_knot(gaps)


def not_a_knot(gaps):
    """The cubic spline from all its conditions at once, as one linear system in 30 digits."""
    n = len(gaps)
    matrix, right = mpmath.zeros(4 * n), mpmath.zeros(4 * n, 1)
    row = 0

    def condition(entries, value):
        nonlocal row
        for column, entry in entries:
            matrix[row, column] += entry
        right[row] = value
        row += 1

    for k, gap in enumerate(gaps):
        h = mpmath.mpf(gap)
        powers = [mpmath.mpf(1), h, h**2, h**3]
        condition([(4 * k, 1)], VALUES[k])
        condition([(4 * k + i, powers[i]) for i in range(4)], VALUES[k + 1])
        if k + 1 < n:
            slope = [(4 * k + i, i * h ** (i - 1)) for i in (1, 2, 3)]
            condition([*slope, (4 * k + 5, -1)], 0)
            condition([(4 * k + 2, 2), (4 * k + 3, 6 * h), (4 * k + 6, -2)], 0)
    for k in (0, n - 2):
        condition([(4 * k + 3, 1), (4 * k + 7, -1)], 0)
    found = mpmath.lu_solve(matrix, right)
    return [[found[4 * k + i] for i in range(4)] for k in range(n)]


def response(kind, at):
    """x and its rate by the exact response of the oscillator to a polynomial, piece by piece."""
    with mpmath.workdps(30):
        pieces, x, v = polynomials(kind), mpmath.mpf("0.5"), mpmath.mpf(-1)
        found = []
        for k, start in enumerate(TIMES):
            end = TIMES[k + 1] if k + 1 < len(TIMES) else math.inf
            coefficients = pieces[min(k, len(pieces) - 1)]
            for t in at:
                if start <= t < end:
                    found.append(moved(x, v, coefficients, mpmath.mpf(t) - start))
            if k + 1 < len(TIMES):
                x, v = moved(x, v, coefficients, mpmath.mpf(end) - start)
        return np.array(found, dtype=float)


def moved(x, v, coefficients, t):
    """The state a time t later: x'' + (c/m) x' + (k/m) x = −polynomial."""
    decay, stiffness = mpmath.mpf("0.8") / 2, mpmath.mpf(9)
    # A polynomial that solves the equation, from its highest coefficient down.
    part = [mpmath.mpf(0)] * (len(coefficients) + 2)
    for i in reversed(range(len(coefficients))):
        rest = (i + 2) * (i + 1) * part[i + 2] + decay * (i + 1) * part[i + 1]
        part[i] = (-mpmath.mpf(coefficients[i]) - rest) / stiffness
    value = sum(p * t**i for i, p in enumerate(part))
    rate = sum(i * p * t ** (i - 1) for i, p in enumerate(part) if i)
    x, v = x - part[0], v - part[1]
    w = mpmath.sqrt(stiffness - decay**2 / 4)
    fade, turn = mpmath.exp(-decay * t / 2), (v + decay * x / 2) / w
    cosine, sine = mpmath.cos(w * t), mpmath.sin(w * t)
    free = fade * (x * cosine + turn * sine)
    slope = -decay / 2 * free + fade * w * (turn * cosine - x * sine)
    return free + value, slope + rate


def assert_exact(found, kind, within):
    x = response(kind, found.t)
    for number, name in enumerate(("x", "dot(x)")):
        error = np.abs(found.columns[name] - x[:, number]).max()
        assert error <= within * found.scales[name], (name, error)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
def test_the_response_is_exact(tmp_path, kind):
    found = simulate(equations(tmp_path, kind))
    assert found.status == "ok"
    assert_exact(found, kind, 1e-10)
    assert found.estimated is not None
    # At the rows themselves the new row holds, and every interpolation meets it.
    at = {t: v for t, v in zip(TIMES, VALUES, strict=True) if t in found.t.tolist()}
    assert len(at) >= 4
    for t, v in at.items():
        shown = found.columns["shown"][found.t.tolist().index(t)]
        assert shown == pytest.approx(v, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
def test_interpreted_code_gives_the_same(tmp_path, kind):
    model = model_of(equations(tmp_path, kind))
    found = simulate(model, functions=interpreted(model, "asked for"), accuracy=1e-9)
    assert_exact(found, kind, 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("method", [name for name, m in INSTALLED.items() if m.adaptive])
def test_every_method_ends_its_steps_at_the_rows(tmp_path, method):
    found = simulate(equations(tmp_path, "previous"), method=method, rtol=1e-9)
    assert_exact(found, "previous", 1e-4 if method == "BDF" else 1e-6)


#: Methods of fixed step that take a system with damping.
FIXED = [name for name, m in INSTALLED.items() if not m.adaptive and not m.needs]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
@pytest.mark.parametrize("method", FIXED)
def test_fixed_steps_keep_their_order(tmp_path, kind, method):
    model = model_of(equations(tmp_path, kind))
    errors = []
    for step in (0.05, 0.025, 0.0125):
        found = simulate(model, method=method, step=step, samples=101)
        errors.append(np.abs(found.columns["x"] - response(kind, found.t)[:, 0]).max())
    factor = 2 ** INTEGRATORS[method].order
    assert errors[0] / errors[1] == pytest.approx(factor, rel=0.35)
    assert errors[1] / errors[2] == pytest.approx(factor, rel=0.35)


@pytest.mark.slow
def test_ten_thousand_rows_cost_in_proportion(tmp_path):
    model = model_of(equations(tmp_path, "linear"))
    compiled_or_skip(model)
    counts = []
    for n in (1_000, 10_000):
        times = np.linspace(0, 5, n + 1)
        (tmp_path / "a.csv").write_text(rows(times.tolist(), np.sin(times).tolist()))
        found = simulate(model)
        assert found.status == "ok"
        counts.append((found.steps, found.all_evaluations))
    assert counts[1][0] <= 1.05 * 10_000
    # One run of explicit steps takes 13 evaluations a row, and there are four runs.
    assert counts[1][1] <= 60 * 10_000
    # A straight line in 5 seconds: x'' + 0.4 x' + 9 x = −sin t.
    a, b = np.linalg.solve([[8, -0.4], [0.4, 8]], [-1, 0])
    w = math.sqrt(9 - 0.04)
    x0, v0 = 0.5 - b, -1 - a
    free = np.exp(-0.2 * found.t) * (
        x0 * np.cos(w * found.t) + (v0 + 0.2 * x0) / w * np.sin(w * found.t)
    )
    smooth = a * np.sin(found.t) + b * np.cos(found.t) + free
    # Between rows a straight line is off by up to h²/8.
    assert np.abs(found.columns["x"] - smooth).max() < (5e-4) ** 2 / 8


def test_close_rows_do_not_make_steps_short_after_them(tmp_path):
    times = [0.0, *(1 + 1e-9 * k for k in range(50)), 5.0]
    model = model_of(equations(tmp_path, "previous", times, [1.0] * len(times)))
    found = simulate(model, method="DOP853", rtol=1e-8)
    alone = simulate(
        model_of(equations(tmp_path, "previous", [0.0], [1.0])), method="DOP853", rtol=1e-8
    )
    assert found.steps <= alone.steps + 60
    assert found.columns["x"] == pytest.approx(alone.columns["x"], abs=1e-7)


@pytest.mark.slow
def test_constraints_are_kept_with_recorded_forces(tmp_path):
    pendulum = """
inputs: {a: {file: a.csv, column: a, interpolation: KIND}}
plane: xz
particles: {bob: {mass: 2, position: [x, y, z]}}
constraints: {rod: {distance: [pivot, bob], equals: 1.5}}
points: {pivot: [0, 0, 0]}
potentials: {weight: {gravity: 9.81}}
forces: {wind: {on: bob, force: [2*a, 0, 0]}}
FORM
initial: {x: 0.9, z: -1.2}
simulate: {until: 5, accuracy: 1e-9, samples: 51}
"""
    kept = equations(tmp_path, "linear", scene=pendulum.replace("FORM", "coordinates: [x, z]"))
    assert kept.system.closures
    found = simulate(kept)
    angle = """
inputs: {a: {file: a.csv, column: a, interpolation: KIND}}
particles: {bob: {mass: 2, position: [1.5*sin(q), 0, -1.5*cos(q)]}}
coordinates: [q]
potentials: {weight: {gravity: 9.81}}
forces: {wind: {on: bob, force: [2*a, 0, 0]}}
initial: {q: asin(0.6)}
simulate: {until: 5, accuracy: 1e-10, samples: 51}
"""
    other = simulate(equations(tmp_path, "linear", scene=angle))
    assert found.status == other.status == "ok"
    assert found.constraint_drift is not None
    assert found.constraint_drift < 1e-13
    assert np.abs(found.columns["x"] - other.columns["x_bob"]).max() < 2e-9


@pytest.mark.slow
def test_two_files_with_rows_at_different_times(tmp_path):
    scene = OSCILLATOR.replace(
        "interpolation: KIND}}",
        "interpolation: previous}, b: {file: b.csv, column: b, interpolation: cubic}}",
    ).replace("-m*a", "-m*(a + b)")
    made = equations(tmp_path, "", scene=scene)
    # A cubic is met exactly by its spline through any rows.
    times = [0.0, 0.4, 2.0, 2.1, 5.0]
    lines = [f"{t!r},{t**3 - 4 * t!r}" for t in times]
    (tmp_path / "b.csv").write_text("\n".join(["t,b", *lines]))
    written = scene.replace("{file: b.csv, column: b, interpolation: cubic}", "t^3 - 4*t")
    found = simulate(made)
    other = simulate(equations(tmp_path, "", scene=written))
    assert np.abs(found.columns["x"] - other.columns["x"]).max() < 3e-10 * found.scales["x"]


@pytest.mark.parametrize(
    ("kind", "options", "hint"),
    [
        ("linear", {"until": 5.5}, "--until 5.0"),
        ("cubic", {"until": 6}, "--until 5.0"),
        ("linear", {"until": 5}, None),
        ("previous", {"until": 50}, None),
    ],
)
def test_a_run_stays_within_what_is_recorded(tmp_path, kind, options, hint):
    made = equations(tmp_path, kind)
    if hint is None:
        assert simulate(made, **options).status == "ok"
        return
    with pytest.raises(InputError) as refused:
        simulate(made, **options)
    (problem,) = refused.value.problems
    assert problem.hint == hint
    assert problem.mark is not None
    assert problem.mark.line == 4
    assert "ends at t = 5.0" in problem.message


def test_a_recording_that_begins_later_is_refused(tmp_path):
    made = equations(tmp_path, "previous", TIMES[1:], VALUES[1:])
    with pytest.raises(InputError, match=r"begins at t = 0\.31") as refused:
        simulate(made)
    assert refused.value.problems[0].hint == "--from 0.31"


def test_one_row_holds_on(tmp_path):
    found = simulate(equations(tmp_path, "previous", [0.0], [9.0]), until=30)
    # The oscillator comes to rest at −m a/k.
    assert found.columns["x"][-1] == pytest.approx(-1, abs=0.02)


def test_the_file_is_read_at_each_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("LAGRANGE_CACHE_DIR", str(tmp_path / "cache"))
    equations(tmp_path, "linear")
    command = ["simulate", str(tmp_path / "scene.yaml"), "--json", "--accuracy", "1e-6"]
    ends = []
    for values in (VALUES, [2 * v for v in VALUES], VALUES):
        (tmp_path / "a.csv").write_text(rows(TIMES, values))
        assert run(command) == 0
        ends.append(json.loads(capsys.readouterr().out)["state"]["x"])
    assert ends[0] == ends[2] != ends[1]
    (tmp_path / "a.csv").unlink()
    assert run(command) == 2
    assert "no such file" in capsys.readouterr().err
    assert run(["derive", str(tmp_path / "scene.yaml")]) == 0
    assert "column a of a.csv, linear between rows" in capsys.readouterr().out


def test_a_model_is_its_json(tmp_path):
    model = model_of(equations(tmp_path, "cubic"))
    assert Model.from_json(json.loads(json.dumps(model.to_json()))) == model
    assert len(model.recordings) == 1


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_what_changes_faster_than_doubles_can_say_is_refused(tmp_path, kind):
    made = equations(tmp_path, kind, [0.0, 1.0, 1.0 + 2**-52, 5.0], [0.0, 1e300, -1e300, 1.0])
    with pytest.raises(InputError, match="changes faster than doubles can say after t = ") as seen:
        simulate(made)
    (problem,) = seen.value.problems
    assert problem.mark is not None
    assert problem.mark.line == 4


@pytest.mark.slow
def test_too_many_different_times_are_refused(tmp_path, monkeypatch):
    scene = OSCILLATOR.replace("KIND}}", "linear}, b: {file: b.csv, column: a}}")
    made = equations(tmp_path, "", scene=scene)
    (tmp_path / "b.csv").write_text(rows([t + 1e-3 * (t < 5) for t in (-1, *TIMES)], range(9)))
    assert simulate(made).status == "ok"
    monkeypatch.setattr(recorded_inputs, "MOST_TABLE_NUMBERS", 80)
    with pytest.raises(InputError, match="15 different times are too many"):
        simulate(made)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from(["previous", "linear", "cubic"]),
    st.lists(st.tuples(st.floats(1e-3, 1), st.floats(-5, 5)), min_size=2, max_size=9),
)
def test_any_rows_give_what_their_pieces_say(tmp_path_factory, kind, steps):
    """The input itself is a column: between rows it is the polynomial, at them the rows."""
    times = np.concatenate([[0.0], np.cumsum([gap for gap, _ in steps])])
    values = [0.5, *(value for _, value in steps)]
    scene = OSCILLATOR.replace(
        "until: 5, accuracy: 1e-10", f"until: {float(times[-1])!r}, accuracy: 1e-6"
    )
    folder = tmp_path_factory.mktemp("rows")
    found = simulate(equations(folder, kind, times.tolist(), values, scene))
    assert found.status == "ok"
    wanted = {
        "previous": lambda t: np.array(values)[np.searchsorted(times, t, side="right") - 1],
        "linear": lambda t: np.interp(t, times, values),
        "cubic": make_interp_spline(times, values, k=min(3, len(steps)))
        if len(steps) != 2
        else lambda t: np.polyval(np.polyfit(times, values, 2), t),
    }[kind](found.t)
    size = max(map(abs, values)) + np.abs(wanted).max()
    assert np.abs(found.columns["shown"] - wanted).max() < 1e-9 * size
