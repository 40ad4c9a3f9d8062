"""Motions with tables, against SciPy's integrator over SciPy's interpolants, and their ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from lagrange_cli import load
from lagrange_cli.errors import InputError

SPEEDS = [0, 100, 200, 300, 400, 500, 600]
TORQUES = [80, 140, 180, 190, 170, 120, 0]

ENGINE = """
name: engine
parameters: {J: 2, c: 0.2, k: LOAD}
functions: {T: {of: dot(phi), file: torque.csv, column: torque, interpolation: WAY, outside: END}}
coordinates: [phi]
kinetic: {wheel: J*dot(phi)^2/2}
forces: {engine: {on: phi, force: T(dot(phi))}, load: {on: phi, force: k - c*dot(phi)}}
initial: {phi: 0, dot(phi): 10}
"""


def engine(folder: Path, way="monotone", end="end", load_torque="0"):
    rows = "".join(f"{w},{t}\n" for w, t in zip(SPEEDS, TORQUES, strict=True))
    (folder / "torque.csv").write_text("speed,torque\n" + rows)
    text = ENGINE.replace("WAY", way).replace("END", end).replace("LOAD", load_torque)
    (folder / "engine.yaml").write_text(text)
    return load(folder / "engine.yaml").derive()


def expected(torque, times, load_torque=0.0):
    def rates(t, y):
        return [y[1], (torque(y[1]) + load_torque - 0.2 * y[1]) / 2]

    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12, "max_step": 0.01}
    return solve_ivp(rates, (0, times[-1]), [0, 10], t_eval=times, **options).y[1]


def speeds(run):
    return np.array(run.columns["dot(phi)"])


@pytest.mark.parametrize("way", ["monotone", "linear"])
def test_an_engine_runs_up_as_by_scipy(tmp_path, way):
    times = np.linspace(0, 8, 17)
    run = engine(tmp_path, way).simulate(accuracy=1e-10, times=times)
    rules = {
        "monotone": PchipInterpolator(SPEEDS, TORQUES),
        "linear": lambda w: np.interp(w, SPEEDS, TORQUES),
    }
    assert run.status == "ok"
    assert speeds(run) == pytest.approx(expected(rules[way], times), rel=1e-9)


@pytest.mark.parametrize("options", [{"accuracy": 1e-9}, {"method": "RK45", "rtol": 1e-6}])
def test_a_run_ends_at_the_end_of_its_table(tmp_path, options):
    times = np.linspace(0, 10, 101)
    run = engine(tmp_path, load_torque="150").simulate(**options, times=times)
    assert run.status == "blow_up"
    assert "tabulated values end at T(600)" in run.reason
    whole = expected(PchipInterpolator(SPEEDS, TORQUES), times, 150.0)
    crossing = np.flatnonzero(whole > 600)[0]
    assert len(speeds(run)) == crossing


@pytest.mark.parametrize("end", ["hold", "extend"])
def test_a_table_goes_on_as_the_scene_says(tmp_path, end):
    times = np.linspace(0, 20, 41)
    run = engine(tmp_path, end=end, load_torque="150").simulate(accuracy=1e-9, times=times)
    inner = PchipInterpolator(SPEEDS, TORQUES)
    slope = 0 if end == "hold" else float(inner(600, 1))

    def torque(w):
        return inner(w) if w <= 600 else slope * (w - 600)

    assert run.status == "ok"
    assert speeds(run) == pytest.approx(expected(torque, times, 150.0), rel=1e-8)


def test_a_start_beyond_the_table_is_refused(tmp_path):
    with pytest.raises(InputError, match="beyond the end of a table, T"):
        engine(tmp_path).simulate(initial={"dot(phi)": 700}, until=1)


def test_a_changed_file_changes_the_run(tmp_path):
    """Nothing is kept of a table that is read with its scene."""
    first = engine(tmp_path).simulate(until=6)
    TORQUES[3] += 40
    try:
        second = engine(tmp_path).simulate(until=6)
    finally:
        TORQUES[3] -= 40
    assert speeds(second)[-1] > speeds(first)[-1]


def test_emitted_python_holds_the_table(tmp_path):
    derivation = engine(tmp_path, end="extend")
    (text,) = derivation.emit("python").values()
    namespace: dict = {}
    exec(text, namespace)
    for speed in (-20.0, 0.0, 37.5, 100.0, 250.0, 599.0, 640.0):
        rates = namespace["rhs"](0.0, np.array([0.0, speed]), np.array([2, 0.2, 0.0]))
        inner = PchipInterpolator(SPEEDS, TORQUES)
        torque = inner(np.clip(speed, 0, 600))
        torque += inner(0, 1) * min(speed, 0) + inner(600, 1) * max(speed - 600, 0)
        assert rates[1] == pytest.approx((torque - 0.2 * speed) / 2, rel=1e-12)


TURNED = (
    ENGINE.replace("LOAD", "0, s: 1.1, g: 0.9")
    .replace("force: T(dot(phi))", "force: g*T(s*dot(phi))")
    .replace("END", "end")
)


def turned(folder: Path, way: str, **values):
    """The engine with parameters beside its table and in the argument."""
    engine(folder, way)
    (folder / "engine.yaml").write_text(TURNED.replace("WAY", way))
    return load(folder / "engine.yaml", **values).derive()


@pytest.mark.parametrize("way", ["monotone", "cubic"])
def test_derivatives_of_a_motion_go_on_through_the_points_of_a_table(tmp_path, way):
    """Runs over both sides of each number differ by them."""
    found = turned(tmp_path, way).simulate(
        until=6, accuracy=1e-10, sensitivity=["s", "g", "dot(phi)"]
    )
    h = 1e-4

    def end(**values):
        run = turned(tmp_path, way, **values).simulate(until=6, accuracy=1e-12)
        return np.array([run.columns[name][-1] for name in ("phi", "dot(phi)")])

    for name, value in (("s", 1.1), ("g", 0.9), ("dot(phi)", 10)):
        kind = "initial" if name == "dot(phi)" else "parameters"
        up, down = (end(**{kind: {name: value + step}}) for step in (h, -h))
        columns = f"d(phi)/d({name})", f"dot(d(phi)/d({name}))"
        exact = [found.columns[column][-1] for column in columns]
        assert (up - down) / (2 * h) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("way", "derivatives"), [("monotone", "variational equations"), ("linear", "differences")]
)
def test_parameters_beside_and_within_a_table_are_fitted(tmp_path, way, derivatives):
    run = turned(tmp_path, way, parameters={"s": 1.25, "g": 0.8}).simulate(until=6, samples=31)
    rows = zip(run.t, run.columns["phi"], run.columns["dot(phi)"], strict=True)
    text = "\n".join(",".join(repr(float(x)) for x in row) for row in rows)
    (tmp_path / "data.csv").write_text(f"t,phi,dot(phi)\n{text}\n")
    fit = turned(tmp_path, way).fit(str(tmp_path / "data.csv"), ["s", "g"])
    assert (fit.status, fit.derivatives) == ("ok", derivatives)
    assert [value.value for value in fit.values] == pytest.approx([1.25, 0.8], rel=1e-8)


@pytest.mark.parametrize("change", [("monotone", "linear"), ("end", "hold"), ("T(s", "T'(s")])
def test_derivatives_through_kinks_of_a_table_are_refused(tmp_path, change):
    engine(tmp_path)
    (tmp_path / "engine.yaml").write_text(TURNED.replace("WAY", "monotone").replace(*change))
    with pytest.raises(InputError, match="kinks and jumps of the forces"):
        load(tmp_path / "engine.yaml").derive().simulate(until=1, sensitivity=["g"])
