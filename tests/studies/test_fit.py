"""Fits: values and errors are those of regression by other means."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import curve_fit

from lagrange_cli import load, loads
from lagrange_cli.api import Derivation
from lagrange_cli.errors import InputError
from lagrange_cli.simulate.ensemble.plan.recipe import Recipe

OSCILLATOR = """
name: oscillator
parameters: {m: 2, k: {value: 3, positive: true}}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
outputs: {twice: 2*x}
initial: {x: 1, dot(x): 0}
simulate: {until: 5}
"""


@pytest.fixture(scope="module")
def oscillator() -> Derivation:
    return loads(OSCILLATOR, parameters={"k": 3.2}).derive()


def swing(t, k, start):
    return start * np.cos(np.sqrt(k / 2) * t)


def table(path, columns) -> str:
    rows = [",".join(columns)]
    rows += [
        ",".join("" if np.isnan(x) else repr(float(x)) for x in row)
        for row in zip(*columns.values(), strict=True)
    ]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return str(path)


@pytest.fixture
def measured(tmp_path):
    t = np.sort(np.random.default_rng(1).uniform(0, 5, 60))
    x = swing(t, 3.0, 1.05) + 0.01 * np.random.default_rng(2).normal(size=60)
    return t, x, tmp_path / "data.csv"


def test_values_and_errors_are_those_of_a_closed_form(oscillator, measured) -> None:
    t, x, path = measured
    values, covariance = curve_fit(swing, t, x, [3.2, 1.0])
    found = oscillator.fit(table(path, {"t": t, "x": x}), ["k", "x"])
    assert (found.status, found.derivatives) == ("ok", "variational equations")
    errors = np.sqrt(np.diag(covariance))
    for value, expected, error in zip(found.values, values, errors, strict=True):
        assert value.value == pytest.approx(expected, abs=1e-4 * error)
        assert value.error == pytest.approx(error, rel=1e-4)
    expected = covariance[0, 1] / errors.prod()
    assert found.correlation[0, 1] == pytest.approx(expected, abs=1e-4)
    assert found.degrees_of_freedom == 58


def test_given_deviations_count(oscillator, measured) -> None:
    t, x, path = measured
    deviations = np.where(t < 2.5, 0.01, 0.05)
    values, covariance = curve_fit(swing, t, x, [3.2, 1.0], deviations, absolute_sigma=True)
    columns = {"t": t, "x": x, "sigma(x)": deviations}
    found = oscillator.fit(table(path, columns), ["k", "x"])
    for value, expected, spread in zip(found.values, values, np.diag(covariance), strict=True):
        assert value.value == pytest.approx(expected, abs=1e-4 * np.sqrt(spread))
        assert value.error == pytest.approx(np.sqrt(spread), rel=1e-4)
    rest = (x - swing(t, *values)) / deviations
    assert found.given_deviations
    assert found.chi_squared == pytest.approx(rest @ rest, rel=1e-6)


def test_rates_and_gaps_are_measured_too(oscillator, measured) -> None:
    t, x, path = measured
    rate = -np.sqrt(1.5) * np.sin(np.sqrt(1.5) * t)
    x = np.where(np.arange(60) % 3 == 0, np.nan, swing(t, 3.0, 1.0))
    found = oscillator.fit(table(path, {"t": t, "x": x, "dot(x)": rate}), ["k"])
    assert found.values[0].value == pytest.approx(3.0, abs=1e-6)
    assert [len(c.times) for c in found.columns] == [40, 60]


def test_other_columns_by_differences(oscillator, measured) -> None:
    t, x, path = measured
    expected, covariance = curve_fit(swing, t, x, [3.2, 1.0])
    found = oscillator.fit(table(path, {"t": t, "twice": 2 * x}), ["k", "x"])
    assert found.derivatives == "differences"
    assert found.values[0].value == pytest.approx(expected[0], abs=1e-3 * covariance[0, 0] ** 0.5)
    assert found.values[0].error == pytest.approx(covariance[0, 0] ** 0.5, rel=1e-3)


@pytest.mark.slow
def test_motions_with_closures_too(tmp_path) -> None:
    """A pendulum in Cartesian coordinates has no variational equations."""
    scene = "systems/constraints/pendulum_in_cartesian_coordinates.yaml"
    motion = load(scene).derive().simulate(until=1.0, samples=41, accuracy=1e-10)
    name = motion.coordinates[0]
    path = table(tmp_path / "data.csv", {"t": motion.t, name: motion.columns[name]})
    start = load(scene, parameters={"g": 9.5}).derive()
    found = start.fit(path, ["g"])
    assert found.derivatives == "differences"
    assert found.values[0].value == pytest.approx(9.81, abs=1e-4)


def test_what_the_measurements_do_not_tell(oscillator, measured) -> None:
    t, x, path = measured
    found = oscillator.fit(table(path, {"t": t, "x": x}), ["k", "m"])
    assert (found.status, found.exit_code) == ("undetermined", 1)
    assert "m and k" in found.reason or "k and m" in found.reason
    assert all(v.error is None for v in found.values)
    assert found.values[0].value / found.values[1].value == pytest.approx(1.5, rel=0.01)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no column is named 't'"),
        ("t,x\n", "no rows"),
        ("t\n0\n1\n", "nothing is measured"),
        ("t,x,x\n0,1,1\n", "two columns"),
        ("t,x\n0,1\n1,2,3\n", "3 cells"),
        ("t,x\n1,1\n0,2\n", "before"),
        ("t,x\n0,one\n", "expected a finite number"),
        ("t,x,sigma(x)\n0,1,0\n1,1,1\n2,1,1\n", "above zero"),
        ("t,x,sigma(y)\n0,1,1\n", "no column is named 'y'"),
        ("t,z\n0,1\n1,1\n2,1\n", "'z' is nothing that a motion"),
        ("t,x\n-1,1\n0,1\n1,1\n", "before the start"),
        ("t,x\n1,1\n", "do not determine"),
    ],
)
def test_tables_that_are_refused(oscillator, tmp_path, text: str, says: str) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refusal:
        oscillator.fit(str(path), ["k"])
    (problem,) = refusal.value.problems
    assert says in problem.message
    assert problem.mark is not None
    assert problem.mark.file == str(path)


@pytest.mark.filterwarnings("error")
def test_differences_beyond_doubles_are_refused(tmp_path) -> None:
    far = loads(OSCILLATOR.replace("{x: 1,", "{x: 1e301,")).derive()
    path = tmp_path / "data.csv"
    path.write_text("t,x\n0,0.3\n0.1,0.31\n0.2,0.29\n", encoding="utf-8")
    with pytest.raises(InputError, match="no motion passes the measurements"):
        far.fit(str(path), ["k"])


def test_names_that_are_refused(oscillator, measured) -> None:
    t, x, path = measured
    data = table(path, {"t": t, "x": x})
    for free, says in ((["kk"], "neither a parameter"), ([], "nothing is free")):
        with pytest.raises(InputError, match=says):
            oscillator.fit(data, free)


CART = "systems/pendulums/pendulum_on_cart.yaml"


def noisy(columns, deviations, seed=0):
    source = np.random.default_rng(seed)
    return {
        k: x + deviations.get(k, 0) * source.standard_normal(len(x)) for k, x in columns.items()
    }


def test_a_long_record_is_fitted_from_afar(tmp_path) -> None:
    """Oscillations lost on the way are false minima of the whole record."""
    motion = (
        load(CART, parameters={"l": 0.45})
        .derive()
        .simulate(until=6, samples=121, accuracy=1e-10, initial={"phi": 2, "dot(x)": 0})
    )
    columns = {k: motion.columns[k] for k in ("x", "phi")}
    path = tmp_path / "data.csv"
    data = table(path, {"t": motion.t, **noisy(columns, {"x": 0.005, "phi": 0.01})})
    for length in (0.15, 0.8, 1.7):
        start = load(CART, parameters={"l": length}, initial={"phi": 2, "dot(x)": 0}).derive()
        found = start.fit(data, ["l", "phi"])
        assert (found.status, found.starts) == ("ok", 1)
        assert found.values[0].value == pytest.approx(0.45, abs=4 * found.values[0].error)
        assert found.runs < 45


DRIVEN = """
parameters: {k: 6.2, c: 0.11, A: 0.57, w: 3.36}
inputs: {F: A*sin(w*t)}
particles: {p: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {drive: {on: x, force: F}}
dissipation: {damper: c*dot(x)^2/2}
initial: {x: 0.2, dot(x): 0}
"""


@pytest.mark.slow
def test_false_minima_are_told_and_left(tmp_path) -> None:
    """A drive at four times its frequency fits nothing; the parameters stand in an input."""
    motion = loads(DRIVEN).derive().simulate(until=12, samples=80, accuracy=1e-10)
    columns = {"t": motion.t, **noisy({"x": motion.columns["x"]}, {"x": 0.01})}
    data = table(tmp_path / "data.csv", columns)
    first = {"k": 9.8, "c": 0.05, "A": 0.6, "w": 13}
    start = loads(DRIVEN, parameters=first).derive()
    alone = start.fit(data, list(first), starts=1)
    assert alone.derivatives == "variational equations"
    assert alone.exit_code == 1
    assert "contradicted" in [finding.kind for finding in alone.findings]
    found = start.fit(data, list(first))
    assert found.status == "ok"
    assert found.starts > 1
    truth = {"k": 6.2, "c": 0.11, "A": 0.57, "w": 3.36}
    for value in found.values:
        assert value.value == pytest.approx(truth[value.name], abs=4.5 * value.error)


def test_values_elsewhere_that_fit_as_well(oscillator, tmp_path) -> None:
    """Of samples at equal distances, two frequencies are the same."""
    t = 1.4 * np.arange(1, 25)
    x = noisy({"x": np.cos(np.sqrt(1.5) * t)}, {"x": 0.01})["x"]
    data = table(tmp_path / "data.csv", {"t": t, "x": x})
    found = oscillator.fit(data, ["k"], starts=40)
    assert (found.status, found.exit_code) == ("ambiguous", 1)
    alias = 2 * (2 * np.pi / 1.4 - np.sqrt(1.5)) ** 2
    pair = [m.values["k"] for m in found.minima[:2]]
    assert sorted(pair) == pytest.approx([3.0, alias], rel=0.01)


def test_stated_deviations_that_are_wrong(oscillator, measured) -> None:
    """Their noise is 0.01."""
    t, x, path = measured
    columns = {"t": t, "x": x, "sigma(x)": np.full(60, 0.006)}
    small = oscillator.fit(table(path, columns), ["k", "x"])
    assert (small.status, small.exit_code) == ("contradicted", 1)
    assert "times the stated deviations" in small.reason
    large = oscillator.fit(table(path, columns | {"sigma(x)": np.full(60, 0.02)}), ["k", "x"])
    assert (large.status, [f.kind for f in large.findings]) == ("ok", ["remark"])


def test_a_motion_that_is_another(oscillator, measured) -> None:
    """The oscillation was damped, and the scene knows no damping."""
    t, x, path = measured
    found = oscillator.fit(table(path, {"t": t, "x": x * np.exp(-0.03 * t)}), ["k", "x"])
    assert (found.status, found.exit_code) == ("contradicted", 1)
    assert "neighbours are correlated" in found.reason


@pytest.mark.slow
def test_contacts_by_differences(tmp_path) -> None:
    scene = "systems/contact/bouncing_ball.yaml"
    motion = load(scene).derive().simulate(until=1, samples=41, accuracy=1e-10)
    columns = noisy({"z": motion.columns["z"]}, {"z": 0.004})
    data = table(tmp_path / "data.csv", {"t": motion.t, **columns})
    found = load(scene, parameters={"e": 0.6}).derive().fit(data, ["e"])
    assert (found.status, found.derivatives) == ("ok", "differences")
    assert found.values[0].value == pytest.approx(0.8, abs=4 * found.values[0].error)


@pytest.mark.slow
def test_many_rows(oscillator, tmp_path) -> None:
    t = np.linspace(0, 20, 50_000)
    x = noisy({"x": np.cos(np.sqrt(1.5) * t)}, {"x": 0.05})["x"]
    found = oscillator.fit(table(tmp_path / "data.csv", {"t": t, "x": x}), ["k", "x"])
    assert (found.status, found.starts) == ("ok", 1)
    assert found.runs < 25
    assert found.values[0].error < 2e-4


def test_measurements_at_the_start_alone(oscillator, tmp_path) -> None:
    path = table(tmp_path / "data.csv", {"t": np.zeros(3), "x": np.ones(3)})
    with pytest.raises(InputError, match="all measurements are at the start"):
        oscillator.fit(path, ["k"])


def test_a_sign_that_changes_derives_once(oscillator, monkeypatch, tmp_path) -> None:
    """With each choice of signs the equations are derived once, not with each motion."""
    derived = []
    model = Recipe.model

    def counted(self, *member):
        derived.append(member)
        return model(self, *member)

    monkeypatch.setattr(Recipe, "model", counted)
    t = np.linspace(0.1, 5, 60)
    x = noisy({"x": -swing(t, 3.0, 1.05)}, {"x": 0.01})["x"]
    scene = OSCILLATOR.replace("k*x^2/2", "k*x^2/2 + b*x").replace("m: 2", "m: 2, b: 0.3")
    found = loads(scene).derive().fit(table(tmp_path / "d.csv", {"t": t, "x": x}), ["b", "x"])
    assert found.values[1].value == pytest.approx(-1.05, abs=0.02)
    assert found.runs > 3
    assert len(derived) < 20
