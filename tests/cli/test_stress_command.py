"""``lagrange stress`` as a user runs it: table, JSON, files, refusals."""

from __future__ import annotations

import json

import pytest

from tests.cli.terminal import lagrange, succeed

pytestmark = pytest.mark.slow

SCENE = """\
name: weights
parameters: {m1: 2, m2: 1, g: 9.81}
particles:
  first: {mass: m1, position: [0, 0, x]}
  second: {mass: m2, position: [0, 0, -x]}
coordinates: [x]
potentials:
  weight: {gravity: g}
initial: {x: 1, dot(x): 0.5}
simulate: {until: 1, samples: 11}
"""

#: What every point of the JSON has by contract.
KEYS = ("axis", "value", "outcome", "error", "estimated", "reason")


def stressed(*words, axes="mass_ratio,degenerate"):
    return succeed("stress", "-", "-j", "1", "--axes", axes, *words, input=SCENE)


def test_json_is_the_contract():
    found = json.loads(stressed("--json"))
    assert found["name"] == "weights"
    assert list(found["points"][0])[: len(KEYS)] == list(KEYS)
    assert [p["value"] for p in found["points"] if p["axis"] == "mass_ratio"][:2] == [1e-12, 1e-9]
    assert found["summary"]["runs"] == len(found["points"]) == 12 + 3
    assert found["summary"]["wrong"] == found["summary"]["unchecked"] == 0
    for point in found["points"]:
        refused = point["outcome"] == "refused"
        assert refused is (point["axis"] == "degenerate" and "g" not in point["set"])
        assert (point["error"] is None) is refused
        assert (point["reason"] is not None) is refused


def test_what_is_set_can_be_given_as_options():
    found = json.loads(stressed("--json", axes="mass_ratio"))
    name, text = next(iter(found["points"][0]["set"].items()))
    assert (name, float(text)) == ("m1", 1e-12)
    done = succeed("simulate", "-", "-p", f"{name}={text}", "--json", input=SCENE)
    assert json.loads(done)["accuracy"]["estimated"] == found["points"][0]["estimated"]


def test_text_is_a_table_and_a_sentence():
    shown = stressed()
    assert shown.startswith("weights: 15 runs: 13 right, 0 degraded with a right estimate, 2 ref")
    assert "0 silently wrong" in shown.splitlines()[0]
    assert "  mass_ratio  1e-12  m1 = 1e-12" in shown
    assert "the mass of 'first' must be positive" in shown
    assert "Reference  " in shown
    assert max(map(len, shown.splitlines())) < 170


def test_axes_of_which_a_scene_has_no_points_are_named():
    assert "no points of chart, separatrix" in stressed(axes="accuracy,chart,separatrix")


def test_report_is_written_to_a_file(tmp_path):
    file = tmp_path / "report.json"
    shown = stressed("--json", "-o", str(file), axes="accuracy")
    assert file.read_text(encoding="utf-8") == shown


def test_the_same_on_several_cores():
    one, two = (
        succeed("stress", "-", "-j", n, "--axes", "accuracy", "--json", input=SCENE) for n in "12"
    )
    assert one == two


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--axes", "mas_ratio"), "did you mean 'mass_ratio'?"),
        (("--axes", ","), "is not names with commas between them"),
        (("-o", "report.csv"), ".html or .json"),
        (("--budget", "0"), "budget must be a positive number"),
        (("-p", "m3=1"), "unknown parameter 'm3'"),
    ],
)
def test_refusals(words, said):
    done = lagrange("stress", "-", *words, input=SCENE)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
