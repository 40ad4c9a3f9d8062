"""``lagrange path`` as a user runs it: table, JSON, files, pictures, refusals."""

from __future__ import annotations

import json
import math

import pytest

from tests.cli.terminal import lagrange, succeed

pytestmark = pytest.mark.slow

SCENE = """\
name: swing
parameters: {m: 1, l: 0.5, g: 9.81, "T": 2*pi*sqrt(l/g)}
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
"""

ENDS = ("--from", "theta=-1,t=0", "--to", "theta=1,t=0.5*T")


def found(*words, ends=ENDS, scene=SCENE):
    return succeed("path", "-", "--starts", "6", *ends, *words, input=scene)


def refused(*words, ends=ENDS, scene=SCENE, code=2):
    done = lagrange("path", "-", *ends, *words, input=scene)
    assert done.returncode == code
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    return done.stderr


def test_json_is_the_contract():
    report = json.loads(found("--json", "--samples", "5"))
    assert report["name"] == "swing"
    assert report["kind"] == "minimum"
    assert report["t"] == pytest.approx([k / 4 * math.pi * math.sqrt(0.5 / 9.81) for k in range(5)])
    assert report["path"]["theta"][0] == -1
    assert report["path"]["theta"][-1] == pytest.approx(1, abs=1e-9)
    assert {"action", "kind"} <= report["solutions"][0].keys()
    assert report["solutions"][0]["action"] == report["action"]


def test_the_start_can_be_given_to_simulate():
    report = json.loads(found("--json"))
    rate = report["solutions"][0]["start"]["dot(theta)"]
    words = ("-i", "theta=-1", "-i", f"dot(theta)={rate!r}", "--until", "T/2")
    done = json.loads(
        succeed("simulate", "-", *words, "--accuracy", "1e-10", "--json", input=SCENE)
    )
    assert done["state"]["theta"] == pytest.approx(1, abs=1e-9)


def test_text_says_that_there_may_be_others():
    shown = found()
    assert "path of stationary action" in shown.splitlines()[0]
    flat = " ".join(shown.split())
    assert "found from 6 starts and by " in flat
    assert "; there may be others beyond" in flat
    assert "--turns 1 looks a whole turn of theta further" in shown


def test_files_are_written(tmp_path):
    for ending in ("json", "csv"):
        found("-o", str(tmp_path / f"p.{ending}"))
    assert json.loads((tmp_path / "p.json").read_text())["kind"] == "minimum"
    assert (tmp_path / "p.csv").read_text().startswith("solution,t,theta,dot(theta)\n1,0,-1,")


def test_pictures_are_drawn(tmp_path):
    for ending, beginning in (("svg", b"<?xml"), ("tex", b"% Made by lagrange")):
        file = tmp_path / f"p.{ending}"
        found("--plot", str(file))
        assert file.read_bytes().startswith(beginning)
    text = (tmp_path / "p.tex").read_text()
    assert text.count("forget plot") == 12 + 2  # varied paths, and a mark at each end
    assert r"\varepsilon" in text


@pytest.mark.parametrize(
    ("start", "end", "said"),
    [
        ("theta=0", "theta=1,t=1", "no value of 't'"),
        ("t=0", "theta=1,t=1", "no value of 'theta'"),
        ("theta=0,t=0", "theta=1,t=0", "not after t = 0"),
        ("theta=0,t=1", "theta=1,t=0.5", "not after t = 1"),
        ("theta=0,t=0,theta=1", "theta=1,t=1", "'theta' is given twice"),
        ("theta=0,t=0,x=1", "theta=1,t=1", "'x' is not a coordinate"),
        ("thta=0,t=0", "theta=1,t=1", "did you mean 'theta'?"),
        ("theta=0,t=0,dot(theta)=1", "theta=1,t=1", "'dot(theta)' is not given at an end"),
        ("theta,t=0", "theta=1,t=1", "a part is NAME=VALUE"),
        ("", "theta=1,t=1", "a part is NAME=VALUE"),
        ("theta=,t=0", "theta=1,t=1", "a part is NAME=VALUE"),
        ("theta=0,,t=0", "theta=1,t=1", "a part is NAME=VALUE"),
        ("theta=k,t=0", "theta=1,t=1", "unknown name 'k'"),
        ("theta=t,t=0", "theta=1,t=1", "'t'"),
        ("theta=1/0,t=0", "theta=1,t=1", "1/0"),
        ("theta=nan,t=0", "theta=1,t=1", "unknown name 'nan'"),
        ("theta=1e999,t=0", "theta=1,t=1", "1e999"),
        ("theta=sqrt(-1),t=0", "theta=1,t=1", "sqrt(-1)"),
        ("theta=__import__('os'),t=0", "theta=1,t=1", "__import__"),
        ("theta=" + "(" * 500 + ",t=0", "theta=1,t=1", "--from:1:"),
        ("theta=0\x1b[31m,t=0", "theta=1,t=1", "--from:1:"),
    ],
)
def test_ends_that_are_none_are_refused_at_their_place(start, end, said):
    message = refused(ends=("--from", start, "--to", end))
    assert said in message
    assert "\x1b" not in message


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--accuracy", "0"), "accuracy must be between 0 and 1"),
        (("--accuracy", "nan"), "accuracy must be between 0 and 1"),
        (("--starts", "0"), "starts must be from 1"),
        (("--starts", "1000000"), "starts must be from 1"),
        (("--turns", "-1"), "turns must be from 0"),
        (("--turns", "10000"), "more than 20,000 starts"),
        (("--samples", "1"), "samples must be from 2"),
        (("-o", "p.pdf"), ".html or .json or .csv"),
    ],
)
def test_options_out_of_range_are_refused(words, said):
    assert said in refused(*words)


def test_both_ends_are_needed():
    assert "--to" in refused(ends=("--from", "theta=0,t=0"))


def test_no_path_is_told_with_exit_code_1():
    """Nothing joins two places of an oscillator after half a period."""
    scene = SCENE.replace("weight: {gravity: g}", "twist: m*l^2*theta^2/2")
    ends = ("--from", "theta=0,t=0", "--to", "theta=1,t=pi")
    assert "no path of stationary action was found" in refused(ends=ends, scene=scene, code=1)
