"""Studies of systems with states of first order, and what is refused of them."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from lagrange_cli import load
from lagrange_cli.errors import InputError
from tests.systems.shipped import APART

pytestmark = pytest.mark.slow

SOLID = str(APART["standard_linear_solid"])


@pytest.fixture(scope="module")
def solid():
    return load(SOLID).derive()


def test_sensitivities_are_those_of_differences(solid):
    found = solid.simulate(sensitivity=["T", "F"], accuracy=1e-10)
    h, columns = 1e-4, ("x", "F")

    def ends(**changed):
        motion = load(SOLID, **changed).derive().simulate(accuracy=1e-12)
        return np.array([motion.columns[name][-1] for name in columns])

    slopes = {
        "T": ends(parameters={"T": 0.25 + h}) - ends(parameters={"T": 0.25 - h}),
        "F": ends(initial={"F": 13 + h}) - ends(initial={"F": 13 - h}),
    }
    for by, slope in slopes.items():
        exact = [found.columns[f"d({name})/d({by})"][-1] for name in columns]
        assert np.abs(slope / (2 * h) - exact).max() <= 1e-6


def test_a_fit_finds_a_time_constant_and_a_start(tmp_path):
    motion = load(SOLID, parameters={"T": 0.3}, initial={"F": 12}).derive().simulate(samples=41)
    with open(tmp_path / "data.csv", "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["t", "x", "F"])
        columns = motion.t, motion.columns["x"], motion.columns["F"]
        rows.writerows([repr(float(x)) for x in row] for row in zip(*columns, strict=True))
    fit = load(SOLID).derive().fit(str(tmp_path / "data.csv"), free=["T", "F"])
    assert {value.name: value.value for value in fit.values} == pytest.approx(
        {"T": 0.3, "F": 12}, rel=1e-5
    )


def test_members_vary_starts_of_states(solid):
    ends = solid.ensemble({"F": [0, 13]}, accuracy=1e-9).columns["F"][:, -1]
    alone = solid.simulate(accuracy=1e-9).columns["F"][-1]
    assert ends[1] == pytest.approx(alone, abs=1e-8)
    assert ends[0] != pytest.approx(alone, abs=1e-3)


def test_exponents_are_real_parts_of_poles(solid):
    found = solid.lyapunov(until=60).exponents
    assert sorted(found) == pytest.approx([-2, -1, -1], abs=0.1)


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (lambda d: d.path({"x": 1, "t": 0}, {"x": 0, "t": 1}), "no action has it"),
        (lambda d: d.emit("c", canonical=True), "state"),
        (lambda d: d.analyze(steady=True), "equilibria alone are sought"),
        (lambda d: d.text(form="small-oscillations"), r":1:1: there are no .* of states"),
    ],
)
def test_what_knows_no_states_is_refused(solid, asked, reason):
    with pytest.raises(InputError, match=reason):
        asked(solid)


@pytest.mark.parametrize(
    ("language", "title"),
    [
        ("en", "States of first order"),
        ("de", "Zustände erster Ordnung"),
        ("fr", "États du premier ordre"),
    ],
)
def test_documents_list_rates(solid, language, title):
    for written in ("text", "latex", "markdown", "typst", "html"):
        assert title in str(solid.written(written, language=language)), written


def test_json_has_rates(solid):
    (state,) = solid.report()["states"]
    assert (state["name"], state["unit"], state["rate"]) == ("F", "N", "K*dot(x) - F/T")
