"""All paths of a pendulum up to an energy, counted and placed by elliptic integrals."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from lagrange_cli.api import load, loads
from lagrange_cli.report.values.studies import PATHS

PENDULUM = "systems/pendulums/pendulum.yaml"
OMEGA = math.sqrt(9.81)


def oscillations(span):
    """Speeds at the lowest point of the oscillations that come back to it after n half periods.

    A half period is 2 K(k)/ω with θ̇ = 2 ω k.
    """
    for n in range(1, math.ceil(span * OMEGA / math.pi)):

        def late(x, n=n):
            return n * 2 * ellipk(1 - math.exp(-2 * x)) / OMEGA - span

        x = brentq(late, 1e-12, 17.0)
        yield 2 * OMEGA * math.sqrt(1 - math.exp(-2 * x))


@pytest.mark.parametrize("span", [1.5, 3.0, pytest.param(6.0, marks=pytest.mark.slow)])
def test_a_pendulum_comes_back_on_every_one_of_its_paths(span):
    speeds = [*oscillations(span)]
    expected = sorted([0.0, *speeds, *(-v for v in speeds)])
    assert len(expected) == 2 * math.ceil(span * OMEGA / math.pi) - 1
    found = load(PENDULUM).derive().path({"theta": 0, "t": 0}, {"theta": 0, "t": span}, starts=2)
    starts = sorted(float(path.velocity[0]) for path in found.solutions)
    assert starts == pytest.approx(expected, abs=1e-6)
    # The most energetic one returns before any other is conjugate: its action is least.
    assert abs(found.solutions[0].velocity[0]) == pytest.approx(max(starts), abs=1e-9)
    scan = found.scan
    assert scan.is_resolved
    assert scan.reach > max(starts)
    # The scene's pendulum has m = l = 1.
    assert scan.energy == pytest.approx(scan.reach**2 / 2 - 9.81)
    assert PATHS.write(found)["scan"]["motions"] == scan.count


@pytest.mark.slow
def test_whole_turns_are_found_among_the_same_motions():
    """Rotations: one turn takes 2 K(1/k)/(ω k)."""
    derivation = load(PENDULUM).derive()
    found = derivation.path({"theta": 0, "t": 0}, {"theta": 0, "t": 1.5}, starts=2, turns=1)
    turning = [p for p in found.solutions if p.last.q[0] > 1]

    def late(k):
        return 2 * ellipk(1 / k**2) / (OMEGA * k) - 1.5

    speed = 2 * OMEGA * brentq(late, 1 + 1e-12, 10)
    assert [float(p.velocity[0]) for p in turning] == pytest.approx([speed], abs=1e-6)


def test_systems_of_more_coordinates_are_not_scanned():
    plane = """
        particles: {a: {mass: 1, position: [x, y, 0]}}
        coordinates: [x, y]
    """
    found = loads(plane).derive().path({"x": 0, "y": 0, "t": 0}, {"x": 1, "y": 1, "t": 1}, starts=1)
    assert found.scan is None
    assert PATHS.write(found)["scan"] is None
