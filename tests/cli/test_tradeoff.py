"""``lagrange tradeoff`` as a user runs it: table, JSON, files, refusals."""

from __future__ import annotations

import functools
import importlib.util
import json

import pytest

from lagrange_cli.simulate.integrators import INTEGRATORS
from tests.cli.terminal import lagrange, succeed

pytestmark = pytest.mark.slow

SCENE = """\
name: pendulum
parameters: {l: 1, g: 9.81}
particles:
  bob: {mass: 1, position: [l*sin(theta), 0, -l*cos(theta)]}
coordinates: [theta]
potentials:
  weight: {gravity: g}
initial: {theta: 1}
simulate: {until: 2, samples: 41}
"""

QUICK = ("--methods", "DOP853,RK4,auto", "--repeat", "1")


def traded(*words):
    return succeed("tradeoff", "-", *QUICK, *words, input=SCENE)


@functools.cache
def printed_json():
    return json.loads(traded("--json"))


def refused(*words):
    done = lagrange("tradeoff", "-", *words, input=SCENE)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


def test_json_is_the_contract():
    found = printed_json()
    assert found["name"] == "pendulum"
    assert found["reference"]["error"] < 1e-11
    assert {run["method"] for run in found["runs"]} == {"DOP853", "RK4"}
    assert [entry["accuracy"] for entry in found["auto"]] == [1e-3, 1e-6, 1e-9, 1e-12]
    assert [entry["accuracy"] for entry in found["recommended"]][:2] == [1e-3, 1e-6]
    assert any(run["pareto"] for run in found["runs"])
    for run in found["runs"]:
        if run["outcome"] == "ok":
            assert run["seconds"] > 0
            assert run["rhs_evaluations"] > 0
            assert run["energy_drift"] is not None


def test_text_has_table_picture_and_recommendation_and_files_are_written(tmp_path):
    report = tmp_path / "trade.json"
    words = ["-o", str(report)]
    if importlib.util.find_spec("matplotlib") is not None:
        words += ["--plot", str(tmp_path / "trade.svg")]
    shown = traded(*words)
    assert shown.startswith("pendulum until t = 2: ")
    assert "Reference  " in shown
    assert "rtol 1e-06" in shown
    assert "\n  a DOP853  b RK4\n" in shown
    assert "Recommended\n  accuracy  options " in shown
    assert "\n     1e-03  --method" in shown
    assert "--accuracy 1e-09" in shown
    assert "\x1b" not in shown
    assert json.loads(report.read_text())["name"] == "pendulum"
    if "--plot" in words:
        assert "<svg" in (tmp_path / "trade.svg").read_text()
    assert {p.suffix for p in tmp_path.iterdir()} <= {".json", ".svg"}


def test_options_change_the_scene():
    found = json.loads(
        succeed(
            *("tradeoff", "-", "--methods", "DOP853", "--repeat", "1", "--json"),
            *("--until", "pi/4", "-p", "l=4", "-i", "theta=0.5"),
            input=SCENE,
        )
    )
    assert found["until"] == pytest.approx(0.785398163)
    assert found["auto"] == []


def test_recommended_options_can_be_pasted():
    found = printed_json()
    for entry in found["recommended"]:
        words = entry["options"].split()
        run = json.loads(succeed("simulate", "-", *words, "--json", input=SCENE))
        assert (run["method"], run["rhs_evaluations"]) == (
            entry["method"],
            entry["rhs_evaluations"],
        )


def test_without_matplotlib_the_plot_is_refused_before_the_work(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    code, said = refused("--plot", "trade.png")
    assert code == 2
    assert "pip install 'lagrange-cli[plot]'" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--methods", "DOP835"), "did you mean 'DOP853'"),
        (("--methods", "DOP853,,RK4"), "commas"),
        (("--methods", ""), "commas"),
        (("--repeat", "0"), "--repeat"),
        (("--budget", "-1"), "budget must be a positive number"),
        (("--budget", "nan"), "budget must be a positive number"),
        (("--until", "-3"), "not after the start"),
        (("-o", "trade.csv"), ".json"),
        (("-o", "/nowhere/trade.json"), "cannot write"),
        (("-p", "k=1"), "k"),
    ],
)
def test_mistakes_are_refused_before_the_work(words, said):
    code, message = refused(*words)
    assert code == 2
    assert said in message


def test_no_time_for_a_reference_exits_with_one():
    code, said = refused("--budget", "1e-12")
    assert code == 1
    assert "--budget 60" in said


def test_help_names_every_method():
    text = succeed("tradeoff", "--help")
    assert all(name in text for name in INTEGRATORS)
