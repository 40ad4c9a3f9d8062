"""Thousands of bounces, and bounces without end: what follows is right, and is come to soon."""

from __future__ import annotations

import time

import mpmath
import pytest
from mpmath import mp, mpf

from lagrange_cli import loads
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from tests.simulate.compiling import compiled_or_skip

pytestmark = pytest.mark.slow

BALL = """
name: ball
plane: xz
particles: {b: {mass: 1, position: [x, y, z]}}
constraints: {f: {unilateral: z >= 0, restitution: 1}}
potentials: {w: {gravity: 9.81}}
initial: {x: 0, z: 1e-4}
simulate: {accuracy: 1e-6, samples: 1001}
"""

SLOT = """
name: slot
parameters: {w: 1e-3}
plane: xz
particles: {b: {mass: 1, position: [x, y, z]}}
constraints:
  a: {unilateral: x <= w, restitution: 1}
  f: {unilateral: x >= 0, restitution: 1}
initial: {x: 0.0005, z: 1, dot(x): 1, dot(z): 0}
simulate: {accuracy: 1e-6, samples: 1000}
"""

#: A trebuchet whose sling is a rope: it and the ground are struck in turn, ever faster.
ROPE = """
name: trebuchet
parameters: {M: 100, m: 1, a: 1, b: 4, s: 3, h: 3, g: 9.81}
plane: xz
coordinates: [th, x, z]
particles:
  weight: {mass: M, position: [a*sin(th), 0, h - a*cos(th)]}
  shot: {mass: m, position: [x, 0, z]}
points: {tip: [-b*sin(th), 0, h + b*cos(th)]}
constraints:
  sling: (x - x_tip)^2 + (z - z_tip)^2 <= s^2
  ground: z >= 0
potentials: {weight: {gravity: g}}
initial: {th: 2.2, x: -b*sin(2.2) + s*0.97, z: 0}
simulate: {until: 1.2, accuracy: 1e-6}
"""


def simulated(text, **options):
    return simulate(model_of(loads(text).derive().equations), **options)


def ball(t):
    g, z0 = mpf("9.81"), mpf("1e-4")
    half = mpmath.sqrt(2 * z0 / g)
    return z0 - g * ((mpf(t) + half) % (2 * half) - half) ** 2 / 2


def slot(t):
    x = (mpf("0.0005") + mpf(t)) % mpf("0.002")
    return x if x < mpf("0.001") else mpf("0.002") - x


@pytest.mark.parametrize(
    ("text", "until", "coordinate", "exact"),
    [(BALL, 9.031, "z", ball), (SLOT, 0.99, "x", slot)],
    ids=["ball", "slot"],
)
def test_a_thousand_bounces_are_right(text, until, coordinate, exact):
    found = simulated(text, until=until)
    assert found.status == "ok"
    assert len(found.events) >= 990
    with mp.workdps(40):
        errors = [
            abs(value - exact(t))
            for t, value in zip(found.t.tolist(), found.columns[coordinate].tolist(), strict=True)
        ]
    assert max(errors) <= 1e-6 * found.scales[coordinate]


def test_an_event_costs_the_same_however_many_there_were():
    """Nothing goes through all events again: ten times as many take about ten times as long."""
    compiled_or_skip(model_of(loads(SLOT).derive().equations))
    taken = []
    for until in (0.2, 0.2, 2.0):
        started = time.process_time()
        found = simulated(SLOT, until=until, method="DOP853", rtol=1e-9)
        taken.append(time.process_time() - started)
        assert len(found.events) == round(until * 1000)
    assert taken[2] <= 25 * taken[1] + 0.5


def test_a_run_with_a_method_goes_on_behind_bounces_without_end():
    """The sling stays taut where its bounces end, and the shot lifts off."""
    model = model_of(loads(ROPE).derive().equations)
    runs = [simulate(model, method="DOP853", rtol=rtol) for rtol in (1e-9, 1e-11)]
    for run in runs:
        assert run.status == "ok"
        assert run.t[-1] == 1.2
        last = run.events[-1]
        assert last.name == "release:ground"
        # The sling is closed, since the ground is left with it taut.
        assert run.constraint_drift < 1e-12
    ends = [[e.t for e in run.events if e.name == "zeno:sling"][-1] for run in runs]
    assert ends == pytest.approx([0.1650255] * 2, abs=2e-6)
    lifts = [run.events[-1].t for run in runs]
    assert lifts[0] == pytest.approx(lifts[1], abs=1e-7)
    assert runs[0].state["th"] == pytest.approx(runs[1].state["th"], abs=1e-6)
    promised = simulate(model)
    assert promised.status == "accuracy_not_reached"
    assert "'sling'" in promised.reason
    assert promised.t[-1] >= 0.16
