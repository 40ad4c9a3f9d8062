"""What is told of a measured trade: JSON, text, characters, pictures."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.errors import InputError
from lagrange_cli.notation.page import UNBROKEN
from lagrange_cli.pictures import picture_of
from lagrange_cli.pictures.drawing import drawn
from lagrange_cli.report.contents.tradeoff import character_plot
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.values.studies import TRADE, options_of
from lagrange_cli.simulate import simulate
from lagrange_cli.studies.tradeoff.runs import Setting
from tests.studies.trade_systems import (
    made,
)

# Reports


@pytest.mark.slow
def test_summary_is_the_contract(traded):
    found = json.loads(json.dumps(TRADE.write(traded), allow_nan=False))
    assert found["name"] == "oscillator"
    assert set(found["reference"]) == {"method", "error", "checked"}
    contract = {"method", "rtol", "error", "seconds", "rhs_evaluations", "energy_drift", "pareto"}
    assert all(contract <= set(run) for run in found["runs"])
    assert len(found["runs"]) == len(traded.points)
    assert all({"accuracy", "method"} <= set(r) for r in found["recommended"])
    assert {(run["rtol"] is None) ^ (run["step"] is None) for run in found["runs"]} == {True}


@pytest.mark.slow
def test_recommended_options_run_the_same(oscillator, traded):
    for found in traded.recommended:
        words = options_of(found.point.setting).split()
        how = dict(zip(words[::2], words[1::2], strict=True))
        run = simulate(
            oscillator,
            method=how["--method"],
            rtol=float(how["--rtol"]) if "--rtol" in how else None,
            step=float(how["--step"]) if "--step" in how else None,
            samples=traded.samples,
        )
        assert run.rhs_evaluations == found.point.evaluations


def test_text_has_every_run_and_what_follows(traded):
    shown = ReportForm().written(traded).text(UNBROKEN)
    rows = [line for line in shown.splitlines() if line.startswith("  DOP853 ")]
    assert len(rows) == sum(p.setting.method == "DOP853" for p in traded.points)
    assert "Recommended\n  accuracy  options " in shown
    assert "\n     1e-03  --method" in shown
    assert "--accuracy 1e-06" in shown
    assert shown.isascii()


def test_runs_that_fail_alike_are_one_row(traded):
    points = [made(None, reason="no", setting=Setting("RK4", step=h)) for h in (0.2, 0.1, 0.05)]
    shown = ReportForm().written(replace(traded, points=tuple(points), automatic=())).text(UNBROKEN)
    assert "RK4, step 0.2  failed, with 2 finer ones, after 300 evaluations: no" in shown
    assert "Recommended  nothing" in shown
    assert "no run to draw" in shown


def test_auto_alone_has_no_table(traded):
    shown = ReportForm().written(replace(traded, points=())).text(UNBROKEN)
    assert "Recommended" not in shown
    assert "--accuracy 1e-06" in shown


def test_the_picture_of_characters_has_each_run_at_its_place():
    points = [
        made(1e-2, 1e-3, pareto=True),
        made(1e-8, 1e-1, pareto=True),
        made(1e-2, 1e-1, method="RK4"),
        made(5.0, 1e-3, method="RK4"),
        made(None),
    ]
    lines = character_plot(points, 41, 7)
    picture = [line[8:].ljust(41) for line in lines[:7]]
    assert (picture[0][0], picture[6][40], picture[0][40]) == ("A", "A", "b")
    assert sum(c != " " for row in picture for c in row) == 3
    assert lines[0].startswith(" 1e-02 |")
    assert lines[6].startswith(" 1e-08 |")
    assert lines[8].split() == ["1e-03", "1e-01", "s"]
    assert lines[9].split() == ["a", "DOP853", "b", "RK4"]


def test_one_run_makes_a_picture_too():
    assert any("A" in line for line in character_plot([made(1e-3, 1e-3, pareto=True)])[:-1])


@given(st.lists(st.tuples(st.floats(0, 1e300), st.floats(1e-9, 1e6)), max_size=6))
def test_pictures_keep_their_width_whatever_is_drawn(pairs):
    lines = character_plot([made(e, s) for e, s in pairs], 40, 10)
    assert all(len(line) <= 8 + 40 for line in lines[:-1])


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_work_precision_pictures(traded, ending, start):
    pytest.importorskip("matplotlib")
    data = drawn(picture_of(traded), ending)
    assert data.startswith(start)
    assert drawn(picture_of(traded), ending) == data


@pytest.mark.slow
def test_pictures_of_nothing_can_be_drawn(traded):
    pytest.importorskip("matplotlib")
    nothing = replace(traded, points=(made(None),), automatic=())
    assert drawn(picture_of(nothing), "png").startswith(b"\x89PNG")


def test_pictures_say_what_they_need(traded, monkeypatch):
    pytest.importorskip("matplotlib")
    with pytest.raises(InputError, match=r"\.txt"):
        drawn(picture_of(traded), "txt")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(InputError, match=r"lagrange-cli\[plot\]"):
        drawn(picture_of(traded), "png")
