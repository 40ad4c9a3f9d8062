"""What a run with contacts says where it ends: which contacts, when, why, and a way out."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from lagrange_cli import loads
from lagrange_cli.report.values.simulation import TRAJECTORY
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

#: A wall that moves in, a wall that stands, and a particle between them; a third wall far off.
SQUEEZED = """
name: squeezed
particles: {p: {mass: 1, position: [x, 0, 0]}}
constraints: {piston: x >= t - 1, far: x >= -5, wall: x <= 1}
initial: {x: 0.5, dot(x): 0}
simulate: {until: 3, accuracy: 1e-8, samples: 31}
"""


def run(text: str, path: str = "compiled", **options: float | str) -> Trajectory:
    model: Model = model_of(loads(text).derive().equations)
    functions = (
        interpreted(model, "asked for") if path == "interpreted" else compiled_or_skip(model)
    )
    return simulate(model, functions=functions, **options)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["compiled", "interpreted"])
def test_walls_that_close_in_are_named_with_the_time(path: str):
    found = run(SQUEEZED, path)
    assert found.status == "blow_up"
    assert "past t = 2: the contacts 'piston' and 'wall' leave no motion" in found.reason
    assert "'far'" not in found.reason
    assert "spring" in found.reason
    # What is kept ends at the impact with the piston or later, and the way out works.
    assert 1.4 < found.t[-1] <= 2
    until = re.search(r"--until (\S+) ends before", found.reason)
    assert until is not None
    shorter = run(SQUEEZED, path, until=float(until[1]))
    assert shorter.status == "ok"
    assert shorter.state["x"] == pytest.approx(float(until[1]) - 1, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["compiled", "interpreted"])
def test_walls_that_begin_to_close_in_are_named(path: str):
    """At rest on both walls, of which one begins to move: accelerations leave nothing."""
    text = """
name: pressed
particles: {p: {mass: 1, position: [x, 0, 0]}}
constraints: {piston: x >= t^2, wall: x <= 0}
initial: {x: 0, dot(x): 0}
simulate: {until: 3, accuracy: 1e-8, samples: 31}
"""
    found = run(text, path)
    assert found.status == "blow_up"
    assert "past t = 0: the contacts 'piston' and 'wall' leave no motion" in found.reason
    assert "--until" not in found.reason


@pytest.mark.slow
@pytest.mark.parametrize("path", ["compiled", "interpreted"])
def test_two_ropes_and_a_floor_that_rises(path: str):
    """Three contacts are needed to hold the particle; a fourth beside them is not named."""
    text = """
name: hung
plane: xz
particles: {p: {mass: 1, position: [x, y, z]}}
constraints:
  left: {unilateral: (x + 0.8)^2 + (z - 1)^2 >= 1}
  right: {unilateral: (x - 0.8)^2 + (z - 1)^2 >= 1}
  lift: z >= t - 1
  beside: z >= -7
initial: {x: 0, z: -0.2, dot(x): 0, dot(z): 0}
simulate: {until: 3, accuracy: 1e-8, samples: 31}
"""
    found = run(text, path)
    assert found.status == "blow_up", found.reason
    assert "past t = 1.4: the contacts 'left', 'right' and 'lift' leave no motion" in found.reason


@pytest.mark.slow
def test_reasons_are_part_of_the_summary():
    summary = TRAJECTORY.write(run(SQUEEZED))
    assert "'piston' and 'wall'" in summary["reason"]
    assert TRAJECTORY.write(run(SQUEEZED, until=1))["reason"] is None


@pytest.mark.slow
@pytest.mark.parametrize("depth", [1e-15, 1e-13])
def test_a_graze_names_its_contact(depth: float):
    text = f"""
name: grazing
plane: xz
particles: {{p: {{mass: 1, position: [x, y, z]}}}}
constraints:
  below: {{unilateral: z >= -9, restitution: 1}}
  disc: {{unilateral: x^2 + z^2 >= 1, restitution: 1}}
initial: {{x: -3, z: {1 - depth!r}, dot(x): 1, dot(z): 0}}
simulate: {{until: 6, samples: 61, accuracy: 1e-6}}
"""
    found = run(text)
    assert found.status == "accuracy_not_reached"
    assert "holds until t = 2.9 of 6: " in found.reason
    assert "'disc'" in found.reason
    assert "'below'" not in found.reason


@pytest.mark.slow
@pytest.mark.parametrize("e", ["0.5", "1"])
def test_an_impact_that_adds_energy_names_its_contacts(e: str):
    """The floor throws the particle against a slope that it was leaving: Newton's law lets the
    rate there end at zero, where it was positive, and the push that does so works."""
    text = f"""
name: wedged
plane: xz
particles: {{p: {{mass: 1, position: [x, y, z]}}}}
constraints:
  far: z >= -1
  floor: {{unilateral: z >= 0, restitution: 1}}
  slope: {{unilateral: x >= 0.3*z, restitution: {e}}}
initial: {{x: 0, z: 0, dot(x): 0.2, dot(z): -1}}
simulate: {{until: 3, accuracy: 1e-8}}
"""
    found = run(text)
    assert found.status == "accuracy_not_reached"
    assert "the contacts 'floor' and 'slope' are struck at once" in found.reason
    assert run(re.sub("restitution: [0-9.]+", "restitution: 0", text)).status == "ok"


@pytest.mark.slow
def test_what_touches_is_named_where_an_impact_is_not_resolved():
    """A restitution that becomes 2 when the motion is on its way."""
    text = SQUEEZED.replace("wall: x <= 1", "wall: {unilateral: x <= 1, restitution: e}")
    text = text.replace("particles:", "parameters: {e: 0.5}\nparticles:", 1)
    model = model_of(loads(text).derive().equations)
    (e,) = (p for p in model.parameters if p.name == "e")
    changed = tuple(replace(p, value=2.0) if p is e else p for p in model.parameters)
    found = simulate(replace(model, parameters=changed))
    assert found.status == "blow_up"
    assert re.search(
        r"past t = 2: what the contacts? .*'wall'.* cannot be determined", found.reason
    )
