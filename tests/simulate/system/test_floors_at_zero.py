"""Motions along floors and walls exactly where a coordinate is 0: those anywhere else, moved."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted
from tests.campaign import slice_of
from tests.zero_floors import SCENES

pytestmark = pytest.mark.slow


def simulated(text, by_python=False):
    model = model_of(loads(text).derive().equations)
    return simulate(model, functions=interpreted(model, "") if by_python else None)


@pytest.mark.parametrize("name", slice_of([*SCENES], 1, {"rod", "corner"}.__contains__))
def test_a_floor_at_zero_is_one_anywhere(name):
    text, moved = SCENES[name]
    for by_python in (False, True) if name == "rod" else (False,):
        text = text.replace("1e-8", "1e-4") if by_python else text
        here, above = simulated(text.format(0), by_python), simulated(text.format(10))
        assert here.status == above.status == "ok"
        assert here.constraint_drift < 1e-14
        assert [e.name for e in here.events] == [e.name for e in above.events]
        for one, other in zip(here.events, above.events, strict=True):
            assert one.t == pytest.approx(other.t, abs=here.requested * here.t[-1])
        for column, scale in here.scales.items():
            apart = above.columns[column] - 10 * (column in moved) - here.columns[column]
            assert np.abs(apart).max() <= here.requested * scale


def test_the_shot_lifts_off_where_it_does_elsewhere():
    (event,) = simulated(SCENES["trebuchet"][0].format(0)).events
    assert event.name == "release:ground"
    assert event.t == pytest.approx(0.170127044, abs=1e-8)


IMPACT = """
name: impact
parameters: {{m: 1, g: 9.81, e: {e}}}
plane: xz
particles: {{p: {{mass: m, position: [x, 0, z]}}}}
constraints: {{floor: {{unilateral: z >= {h}, restitution: e}}}}
coordinates: [x, z]
potentials: {{w: {{gravity: g}}}}
initial: {{x: 0, z: {h}, dot(x): 1, dot(z): -1}}
simulate: {{until: 1, accuracy: 1e-8}}
"""


@pytest.mark.parametrize("height", [0, 10])
def test_an_impact_at_the_first_instant_is_no_drift(height):
    """The first sample is the state before it; from then on the contact is kept."""
    found = simulated(IMPACT.format(e=0, h=height))
    assert found.status == "ok"
    assert found.constraint_drift == 0
    assert found.columns["dot(z)"][0] == -1
    assert (found.columns["dot(z)"][1:] == 0).all()
    bounced = simulated(IMPACT.format(e=1, h=height))
    # Nothing is ever closed: there is no constraint that could drift.
    assert bounced.constraint_drift is None
