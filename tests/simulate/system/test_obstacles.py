"""Accuracies that are nearly reached: the report says by what they are missed."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import right_hand_side

#: Three beads on a string, of which the middle one rests in this mode but for rounding.
NODE = """
sizes: {n: 3}
particles:
  p[i=1..n]: {mass: 0.5, position: [i, 0, "u[i]"]}
coordinates: ["u[i=1..n]"]
definitions: {"u[0]": 0, "u[n+1]": 0}
potentials: {"spring[i=0..n]": "4*(u[i+1] - u[i])^2"}
initial: {"u[1]": 0.3, "u[2]": 0, "u[3]": -0.3}
simulate: {until: 40, samples: 101}
"""

LIMIT = re.compile(r"(\S+) is off by (\S+) of its scale, (\S+), at the end; --accuracy (\S+) can")


@pytest.fixture(scope="module")
def node():
    return model_of(derive(read_text(NODE)))


def up_to_long_doubles(model, accuracy):
    """Simulated without quadruple arithmetic, which holds what these cannot."""
    functions = right_hand_side(model)
    wider = functions.wider()
    last = wider and replace(wider, wider=lambda: None)
    return simulate(model, accuracy=accuracy, functions=replace(functions, wider=lambda: last))


@pytest.mark.slow
def test_the_report_names_what_is_in_the_way_and_what_can_be_held(node):
    missed = up_to_long_doubles(node, 4e-13)
    assert missed.status == "accuracy_not_reached"
    found = LIMIT.search(missed.reason)
    assert found is not None
    assert 4e-13 < float(found[2]) < float(found[4]) < 4 * float(found[2])
    held = up_to_long_doubles(node, float(found[4]))
    assert held.status == "ok"
    assert float(found[3]) == pytest.approx(held.scales[found[1]], rel=0.05)
    # Scales of the middle bead: a thousandth of 0.6, and that over the time.
    assert held.scales["dot(u[2])"] == pytest.approx(0.6e-3 / 40, rel=0.05)
    assert abs(held.columns["u[2]"]).max() < 1e-15


@pytest.mark.slow
def test_nothing_is_said_where_the_accuracy_is_far():
    chaos = """
particles:
  a: {mass: 1, position: [sin(p), 0, -cos(p)]}
  b: {mass: 1, position: [sin(p) + sin(q), 0, -cos(p) - cos(q)]}
coordinates: [p, q]
potentials: {weight: {gravity: 9.81}}
initial: {p: 2, q: 2.5}
simulate: {until: 60, samples: 31}
"""
    ended = up_to_long_doubles(model_of(derive(read_text(chaos))), 1e-8)
    assert ended.status == "accuracy_not_reached"
    assert ended.holds_until > 5
    assert "can be held" not in ended.reason
