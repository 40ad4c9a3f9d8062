"""simulate(): requests resolved and refused, trajectories, their summary, files and plot."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import warnings

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.report.values.simulation import SIMULATION, TRAJECTORY, Simulated
from lagrange_cli.simulate import INTEGRATORS, Trajectory, simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.request import MOST_SAMPLES_IN_MEMORY
from tests.parts import changed
from tests.simulate.available import INSTALLED
from tests.simulate.compiling import compiled_or_skip

PENDULUM = """
name: pendulum
parameters: {m: 1.0, l: 1.0, g: 9.81}
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), y: 0, z: -l*cos(theta)}
potentials: {weight: m*g*z}
initial: {theta: 1.0, dot(theta): 0.0}
SIMULATE
"""


def equations(section="", scene=PENDULUM, **more):
    return loads(scene.replace("SIMULATE", section), **more).derive().equations


@pytest.fixture(scope="module")
def pendulum():
    return equations()


@pytest.fixture(scope="module")
def trajectory(pendulum):
    return simulate(pendulum, until=5.0, accuracy=1e-9, samples=51)


def refusal(*args, **kwargs):
    with pytest.raises(InputError) as caught:
        simulate(*args, **kwargs)
    (problem,) = caught.value.problems
    return f"{problem.message} | {problem.hint}"


# Requests


def test_defaults_come_from_the_scene():
    of = equations("simulate: {until: 2.0, from: 1.0, accuracy: 1e-7, samples: 11}")
    found = simulate(of)
    assert found.requested == 1e-7
    assert found.t.tolist() == np.linspace(1.0, 2.0, 11).tolist()
    assert simulate(of, until=3.0, accuracy=1e-4, samples=5).t[-1] == 3.0


def test_without_anything_the_accuracy_is_a_millionth(pendulum):
    found = simulate(pendulum, until=1.0)
    assert found.requested == 1e-6
    assert len(found.t) == 501


def test_options_replace_the_scenes_way_of_error_control():
    chosen = equations("simulate: {until: 1.0, method: RK45, rtol: 1e-7}")
    assert simulate(chosen).method == "RK45"
    assert simulate(chosen, accuracy=1e-5).requested == 1e-5
    promised = equations("simulate: {until: 1.0, accuracy: 1e-7}")
    assert simulate(promised, method="RK45", rtol=1e-5).requested is None


def test_step_sets_the_sample_times(pendulum):
    found = simulate(pendulum, until=1.0, step=0.3)
    assert found.t == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.0])
    assert simulate(pendulum, until=1.0, step=0.1).t == pytest.approx(np.linspace(0, 1, 11))


@pytest.mark.slow
def test_fixed_step_divides_the_samples(pendulum):
    found = simulate(pendulum, until=1.0, method="RK4", step=0.03, samples=11)
    assert len(found.t) == 11
    assert found.steps == 40
    assert simulate(pendulum, until=1.0, method="RK4", step=0.01).steps == 100


def test_missing_until_has_a_fix_to_paste(pendulum):
    assert "--until 10" in refusal(pendulum)


def test_missing_parameter_is_named():
    of = equations("simulate: {until: 1}", PENDULUM.replace("g: 9.81", "g: {unit: m/s^2}"))
    assert "'g'" in refusal(of)
    assert "-p g=" in refusal(of)


def test_missing_initial_state_is_named(pendulum):
    without = changed(pendulum, initial=None)
    assert refusal(without, until=1.0).endswith("-i theta=0")
    suggested = changed(without, suggested=(("theta", "0.5"),))
    assert refusal(suggested, until=1.0).endswith("-i theta=0.5")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"until": 0.0}, "not after the start"),
        ({"until": -1.0}, "not after the start"),
        ({"until": math.nan}, "not after the start"),
        ({"until": math.inf}, "not after the start"),
        ({"accuracy": 0.0}, "between 0 and 1"),
        ({"accuracy": math.nan}, "between 0 and 1"),
        ({"accuracy": -1e-6}, "between 0 and 1"),
        ({"accuracy": 1.0}, "between 0 and 1"),
        ({"samples": 1}, "samples must be"),
        ({"samples": 0}, "samples must be"),
        ({"samples": MOST_SAMPLES_IN_MEMORY + 1}, "samples must be"),
        ({"step": 0.0}, "step must be"),
        ({"step": math.nan}, "step must be"),
        ({"step": 1e-9}, "samples, more than"),
        ({"step": 5e-324}, "samples, more than"),
        ({"step": 0.1, "samples": 11}, "both set the sample times"),
        ({"budget": 0.0}, "budget must be"),
        ({"method": "RK45"}, "--rtol 1e-9"),
        ({"rtol": 2.0}, "between 0 and 1"),
        ({"rtol": 1e-6, "atol": -1.0}, "atol must be"),
        ({"method": "RK455", "rtol": 1e-6}, "did you mean 'RK45'?"),
        ({"method": "leapfrog", "rtol": 1e-6}, "methods: auto, DOP853"),
        ({"method": "RK4"}, "--step"),
        ({"method": "RK4", "step": 5e-324, "samples": 3}, "too small"),
        ({"method": "RK4", "step": 0.1, "rtol": 1e-6}, "no tolerance"),
        ({"method": "RK45", "accuracy": 1e-6}, "accuracy excludes"),
        ({"rtol": 1e-6, "accuracy": 1e-6}, "accuracy excludes"),
    ],
)
def test_what_cannot_be_served_is_refused(pendulum, options, says):
    assert says in refusal(pendulum, **{"until": 5.0, **options})


def test_sample_times_that_doubles_cannot_tell_apart():
    of = equations("simulate: {from: 1e16, until: 1e16 + 10}")
    assert "too close" in refusal(of)


def test_accuracy_below_the_floor(pendulum):
    assert "below what double precision" in refusal(pendulum, until=1.0, accuracy=1e-16)
    large = equations(scene=PENDULUM.replace("theta: 1.0", "theta: 1e8"))
    assert "--accuracy 6e-08" in refusal(large, until=1.0, accuracy=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", INSTALLED)
def test_every_method_serves(pendulum, trajectory, name):
    how = {"rtol": 1e-8} if INTEGRATORS[name].adaptive else {"step": 0.001}
    found = simulate(pendulum, until=5.0, method=name, samples=51, **how)
    assert found.status == "ok"
    assert found.method == name
    assert found.requested is found.estimated is found.holds_until is None
    assert np.abs(found.columns["theta"] - trajectory.columns["theta"]).max() < 1e-4


def test_auto_method_with_a_tolerance(pendulum):
    found = simulate(pendulum, until=1.0, method="auto", rtol=1e-8)
    assert found.method in ("Gauss16", "taylor", "DOP853")  # compiled; by heyoka; by neither
    assert "stiff" in found.choice


# Trajectories


def test_columns_hold_coordinates_and_cartesian_names(trajectory):
    names = ["theta", "x", "y", "z"]
    assert set(trajectory.columns) == {*names, *(f"dot({n})" for n in names)}
    theta, rate = trajectory.columns["theta"], trajectory.columns["dot(theta)"]
    assert trajectory.columns["x"] == pytest.approx(np.sin(theta))
    assert trajectory.columns["dot(z)"] == pytest.approx(np.sin(theta) * rate)
    assert (trajectory.columns["y"] == 0).all()


def test_energy_and_its_drift(trajectory):
    theta, rate = trajectory.columns["theta"], trajectory.columns["dot(theta)"]
    energy = rate**2 / 2 - 9.81 * np.cos(theta)
    assert trajectory.energy == pytest.approx(energy)
    assert 0 <= trajectory.energy_drift < 1e-9
    damped = equations(scene=PENDULUM + "forces: {drag: {on: theta, force: -0.1*dot(theta)}}\n")
    assert simulate(damped, until=1.0).energy_drift is None


def test_drift_does_not_depend_on_the_zero_of_energy(trajectory):
    raised = equations(scene=PENDULUM.replace("m*g*z", "m*g*(z + 1000)"))
    found = simulate(raised, until=5.0, accuracy=1e-9, samples=51)
    assert found.energy_drift < 1e-9


def test_summary_has_exactly_the_contracts_keys(trajectory):
    simulated = Simulated(trajectory, model_of(equations()), derive_seconds=0.5)
    summary = SIMULATION.write(simulated)
    assert list(summary) == [
        "name",
        "status",
        "t",
        "state",
        "accuracy",
        "holds_until",
        "energy_drift",
        "constraint_drift",
        "method",
        "implementation",
        "formulation",
        "steps",
        "rhs_evaluations",
        "reason",
        "remarks",
        "events",
        "slides",
        "seconds",
    ]
    assert list(summary["accuracy"]) == ["requested", "estimated", "scales", "exempt"]
    assert list(summary["seconds"]) == ["derive", "compile", "integrate", "estimate"]
    assert summary["accuracy"]["scales"] == dict(trajectory.scales)
    assert summary["holds_until"] == summary["t"] == 5.0
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_scales_of_an_angle(trajectory):
    assert trajectory.scales["theta"] == 1.0
    assert trajectory.scales["dot(theta)"] == np.abs(trajectory.columns["dot(theta)"]).max()


def test_csv_reads_back_bit_by_bit(trajectory):
    rows = list(csv.reader(io.StringIO(trajectory.csv(["energy"]))))
    assert rows[0][:3] == ["t", "theta", "dot(theta)"]
    assert rows[0][-1] == "energy"
    table = trajectory.table(["energy"])
    read = np.array([[float(v) for v in row] for row in rows[1:]])
    assert (read == np.column_stack(list(table.values()))).all()


def test_npz_reads_back(trajectory, tmp_path):
    trajectory.write(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz", allow_pickle=False) as read:
        assert set(read.files) == {"t", *trajectory.columns}
        assert (read["dot(theta)"] == trajectory.columns["dot(theta)"]).all()
    assert trajectory.npz() == trajectory.npz()


def test_names_that_numpy_or_the_table_could_trip_over():
    scene = PENDULUM.replace("theta", "file").replace("pendulum", "energy")
    found = simulate(equations(scene=scene), until=1.0)
    with np.load(io.BytesIO(found.npz())) as read:
        assert (read["file"] == found.columns["file"]).all()
    clash = simulate(equations(scene=PENDULUM.replace("theta", "energy")), until=1.0)
    with pytest.raises(InputError, match="name 'energy' of its own"):
        clash.csv(["energy"])


def test_files_are_written_whole_or_not_at_all(trajectory, tmp_path):
    target = tmp_path / "a.csv"
    trajectory.write(target)
    assert target.read_text() == trajectory.csv()
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]
    with pytest.raises(InputError, match=r"csv or \.npz"):
        trajectory.write(tmp_path / "a.txt")
    with pytest.raises(InputError, match="cannot write"):
        trajectory.write(tmp_path / "no" / "a.csv")


@pytest.mark.slow
def test_plot_draws_a_picture(trajectory, tmp_path):
    pytest.importorskip("matplotlib")
    trajectory.plot(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    trajectory.plot(tmp_path / "a.svg")
    first = (tmp_path / "a.svg").read_text()
    assert "<svg" in first
    with pytest.raises(InputError, match="cannot be written"):
        trajectory.plot(tmp_path / "a.exe")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "a.svg"]


@pytest.mark.slow
def test_plot_without_matplotlib_says_how_to_get_it(trajectory, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(InputError, match="lagrange-cli\\[plot\\]"):
        trajectory.plot(tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_blow_up_ends_at_the_last_good_sample():
    scene = """
name: runaway
particles: {p: {mass: 1, position: [x, y, z]}}
constraints: {a: y = 0, b: z = 0}
coordinates: [x]
forces: {push: {on: x, force: 2*x^3}}
initial: {x: 1, dot(x): 1}
"""
    for how in (
        {"accuracy": 1e-6},
        {"method": "LSODA", "rtol": 1e-8},
        {"method": "RK45", "rtol": 1e-8},
    ):
        found = simulate(equations(scene=scene), until=2.0, samples=201, **how)
        assert found.status == "blow_up"
        assert found.exit_code == 1
        assert "t = 1" in found.reason or "t = 0.9" in found.reason
        assert 0.97 < found.t[-1] < 1.001
        assert all(np.isfinite(v).all() for v in found.columns.values())
        json.dumps(TRAJECTORY.write(found), allow_nan=False)


@pytest.mark.slow
def test_accuracy_not_reached_keeps_the_part_that_holds():
    steep = equations(scene=PENDULUM.replace("theta: 1.0", "theta: pi - 1e-40"))
    found = simulate(steep, until=60.0, accuracy=1e-6)
    assert found.status == "accuracy_not_reached"
    assert found.exit_code == 1
    assert found.holds_until == found.t[-1] < 60.0
    assert found.estimated < 1e-6
    assert "holds until" in found.reason


@pytest.mark.slow
def test_interrupt_keeps_what_is_done(pendulum):
    def interrupt(fraction):
        if fraction > 0.6:
            raise KeyboardInterrupt

    # So long that the clock is looked at on the way.
    for until, how in ((5e3, {"accuracy": 1e-9}), (50.0, {"method": "RK45", "rtol": 1e-9})):
        found = simulate(pendulum, until=until, progress=interrupt, **how)
        assert found.status == "stopped"
        assert until / 10 < found.t[-1] < until
        assert found.exit_code == 1


@pytest.mark.slow
def test_nothing_is_printed_or_warned(pendulum, capfd):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name, method in INSTALLED.items():
            how = {"rtol": 1e-15} if method.adaptive else {"step": 0.1}
            simulate(pendulum, until=1.0, method=name, **how)
        simulate(pendulum, until=1.0, accuracy=1e-12)
    assert capfd.readouterr() == ("", "")


def test_the_same_bytes_twice(pendulum, trajectory):
    again = simulate(pendulum, until=5.0, accuracy=1e-9, samples=51)
    assert again.csv(["energy"]) == trajectory.csv(["energy"])
    assert again.estimated == trajectory.estimated


def test_a_trajectory_is_frozen(trajectory):
    assert isinstance(trajectory, Trajectory)
    with pytest.raises(dataclasses.FrozenInstanceError):
        trajectory.status = "ok"


@pytest.mark.slow
def test_the_report_says_who_makes_the_steps():
    model = model_of(equations())
    compiled_or_skip(model)
    steps = {
        method: simulate(model, until=0.1, method=method, rtol=1e-6).implementation
        for method in ("DOP853", "Gauss16", "RK45", "Radau", "BDF")
    }
    assert steps == {
        "DOP853": "compiled C",
        "Gauss16": "compiled C",
        "RK45": "compiled C, stepped by SciPy",
        "Radau": "compiled C",
        "BDF": "compiled C, stepped by SciPy",
    }


def test_samples_at_given_times_are_those_of_the_motion():
    derivation = load("systems/pendulums/pendulum.yaml").derive()
    times = [0.0, 0.001, 0.7, 2.0]
    given = derivation.simulate(times=times, accuracy=1e-9)
    assert given.t.tolist() == times
    even = derivation.simulate(until=2, samples=2001, accuracy=1e-9)
    picked = even.columns["theta"][[0, 1, 700, 2000]]
    np.testing.assert_allclose(given.columns["theta"], picked, rtol=0, atol=2e-9)
    for wrong in ([0, 1, 1], [0.5, 1], [0], [0, float("nan")]):
        with pytest.raises(InputError, match="times ascend from the start t = 0"):
            derivation.simulate(times=wrong)
    with pytest.raises(InputError, match="times exclude until"):
        derivation.simulate(times=times, until=2)
    with pytest.raises(InputError, match="RK4 end at samples"):
        derivation.simulate(times=times, method="RK4")
