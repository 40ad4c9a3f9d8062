"""``simulate --with conserved``: values by formulas of the test, drifts from the columns."""

from __future__ import annotations

import json

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS

TWO_BODIES = str(SYSTEMS / "celestial" / "two_bodies.yaml")
HOOP = str(SYSTEMS / "beads" / "bead_on_rotating_hoop.yaml")

#: A free body in turning axes: both h and T + V are conserved.
FREE_IN_TURNING_AXES = """
name: turning
parameters: {m: 2.0, Omega: 0.7}
particles:
  body: {mass: m, position: [X, Y, 0]}
definitions: {X: x*cos(Omega*t) - y*sin(Omega*t), Y: x*sin(Omega*t) + y*cos(Omega*t)}
coordinates: [x, y]
potentials: {}
initial: {x: 1.0, y: 0.5, dot(x): 0.3, dot(y): -0.2}
simulate: {until: 3}
"""


def csv_columns(path):
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        return dict(zip(names, np.loadtxt(file, delimiter=",").T, strict=True))


@pytest.mark.slow
def test_columns_are_momenta_of_the_test_and_drifts_follow_from_them(tmp_path):
    file = tmp_path / "two.csv"
    options = ("--with", "conserved,energy", "--method", "RK4", "--step", "0.05")
    done = succeed("simulate", TWO_BODIES, *options, "-o", str(file), "--json")
    drifts, table = json.loads(done)["conserved_drift"], csv_columns(file)
    derivation = load(TWO_BODIES).derive()
    m = {p.name: p.value for p in derivation.equations.system.parameters}
    momenta = {
        "P_x": [m[f"m{k}"] * table[f"dot(x{k})"] for k in (1, 2)],
        "P_y": [m[f"m{k}"] * table[f"dot(y{k})"] for k in (1, 2)],
        "L_z": [
            m[f"m{k}"] * sign * table[f"{q}{k}"] * table[f"dot({v}{k})"]
            for k in (1, 2)
            for q, v, sign in (("x", "y", 1), ("y", "x", -1))
        ],
    }
    for axis in "xy":
        # m x − t m ẋ of both.
        shifts = [m[f"m{k}"] * table[f"{axis}{k}"] for k in (1, 2)]
        shifts += [-table["t"] * p for p in momenta[f"P_{axis}"]]
        momenta[f"boost_{axis}"] = shifts
    assert {*momenta, "energy"} == drifts.keys()
    for name, terms in momenta.items():
        value, size = np.sum(terms, axis=0), np.abs(terms).sum(axis=0).max()
        np.testing.assert_allclose(table[name], value, atol=1e-13 * size)
        change = np.abs(table[name] - table[name][0]).max()
        assert drifts[name] == pytest.approx(change / size, rel=1e-6, abs=1e-15)
    # RK4 keeps what is linear in the state, and nothing else.
    assert drifts["P_x"] < 1e-14 < 1e-9 < drifts["L_z"]
    assert drifts["energy"] > 1e-9


def test_the_report_has_a_table_of_them():
    shown = succeed("simulate", TWO_BODIES, "--with", "conserved", "--until", "1")
    rows = {line.split()[0]: line.split()[1:] for line in shown.splitlines() if line.strip()}
    assert rows["conserved"] == ["value", "relative", "drift"]
    assert float(rows["P_x"][0]) == pytest.approx(0.4)
    assert float(rows["P_x"][1]) < 1e-14
    assert float(rows["energy"][1]) < 1e-9


@pytest.mark.slow
def test_an_energy_has_the_name_that_it_is_conserved_by():
    hoop = load(HOOP).derive().simulate(until=1.0, extra=["conserved"])
    assert list(hoop.conserved_drift) == ["jacobi"]
    assert np.array_equal(hoop.table(["conserved"])["jacobi"], hoop.energy)
    turning = loads(FREE_IN_TURNING_AXES).derive().simulate(extra=["conserved"], accuracy=1e-10)
    assert {"T + V", "jacobi"} <= turning.conserved_drift.keys()
    assert max(turning.conserved_drift.values()) < 1e-9
    v = [turning.columns["dot(X)"], turning.columns["dot(Y)"]]
    np.testing.assert_allclose(turning.columns["T + V"], v[0] ** 2 + v[1] ** 2, rtol=1e-12)


def test_nothing_is_conserved_and_this_is_said():
    shown = succeed(
        "simulate", str(SYSTEMS / "oscillators/van_der_pol_oscillator.yaml"), "--with", "conserved"
    )
    assert "nothing was found among energies and momenta of linear symmetries" in shown


@pytest.mark.slow
def test_from_python_with_other_values():
    derivation = load(TWO_BODIES).derive()
    heavy = derivation.simulate(until=1.0, extra=["conserved"], parameters={"m1": 3.0})
    start = {name: column[0] for name, column in heavy.columns.items()}
    _mass(derivation)
    assert start["P_x"] == pytest.approx(
        3 * start["dot(x1)"] + start["dot(x2)"] * _mass(derivation)
    )
    assert derivation.simulate(until=1.0).conserved_drift is None
    with pytest.raises(InputError, match="did you mean 'conserved'"):
        derivation.simulate(until=1.0, extra=["conserve"])
    with pytest.raises(InputError, match="leave out 'extra'"):
        derivation.simulate(until=1.0, extra=["conserved"], sensitivity=["m1"])


def _mass(derivation):
    return next(p.value for p in derivation.equations.system.parameters if p.name == "m2")


def test_names_of_the_scene_stay_its_own():
    scene = (SYSTEMS / "celestial" / "two_bodies.yaml").read_text()
    scene += "outputs: {P_x: 3*x1}\n"
    run = loads(scene).derive().simulate(until=1.0, extra=["conserved"])
    np.testing.assert_allclose(run.columns["P_x"], 3 * run.columns["x1"])
    assert run.conserved_drift["P_x_2"] < 1e-14


@pytest.mark.parametrize("words", [("--vary", "m1=[1,2]"), ("--section", "x1 = 0")])
def test_it_is_of_one_motion(words):
    done = lagrange("simulate", TWO_BODIES, "--with", "conserved", *words)
    assert done.returncode == 2
    assert "--with conserved" in done.stderr


def test_many_samples_pass_through_a_file(tmp_path):
    file = tmp_path / "two.npz"
    options = ("--until", "1", "--samples", "100000", "--with", "conserved", "-o", str(file))
    drifts = json.loads(succeed("simulate", TWO_BODIES, *options, "--json"))["conserved_drift"]
    columns = np.load(file)
    assert len(columns["L_z"]) == 100_000
    assert np.ptp(columns["L_z"]) < 1e-12
    assert drifts["L_z"] < 1e-12
