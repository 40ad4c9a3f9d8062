"""Extremes of each kind: right, refused with a reason, or kept as far as it is right."""

from __future__ import annotations

import math

import pytest

from lagrange_cli import load
from tests.extremes.extreme_cases import CASES, SYSTEMS, found

pytestmark = pytest.mark.slow

QUICK = [case for case in CASES if not case.long]

#: Cases that take a second and more, and whose kind has others here or in tests of accuracy.
DEAR = ("double pendulum, m2/m1 = 1e-12", "double pendulum from (3, 3) for 30 s")


def test_dear_cases_are_cases():
    assert {case.title for case in QUICK} > {*DEAR}


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=pytest.mark.campaign if case.title in DEAR else ())
        for case in QUICK
    ],
    ids=lambda case: case.name,
)
def test_extreme(case):
    result = found(case)
    assert result.outcome in case.expected, result
    assert case.says in result.reason
    if result.outcome == "refused":
        assert result.reason
    else:
        assert result.error <= case.accuracy
        assert result.estimated < case.accuracy
    if result.outcome == "degraded":
        assert 0 < result.holds_until < case.until


def test_every_axis_has_cases():
    assert {case.axis for case in CASES} == {
        *("mass ratio", "stiffness", "eccentricity", "duration", "separatrix", "chart", "angle"),
        *("units", "degenerate", "constraints", "blow-up", "chaos"),
    }


# The same motion in other units.

START = {"theta1": 1.5, "theta2": 2.0}


def swung(mass, length, accuracy=1e-9):
    """A double pendulum in units of so many kilograms and metres."""
    given = {"m1": mass, "m2": 1.5 * mass, "l1": length, "l2": 0.75 * length, "g": 9.81 * length}
    scene = load(SYSTEMS / "pendulums/double_pendulum.yaml", parameters=given, initial=START)
    return scene.derive().simulate(until=5.0, samples=101, accuracy=accuracy)


NAMES = ("theta1", "theta2", "dot(theta1)", "dot(theta2)")


@pytest.fixture(scope="module")
def plain():
    return swung(1.0, 1.0)


@pytest.mark.parametrize(
    ("mass", "length"), [(1e-31, 1e9), (1e30, 1 / 149597870700.0), (1e-31, 1e12), (1e30, 1e-16)]
)
def test_units_do_not_matter(plain, mass, length):
    """In kilograms and nanometres, solar masses and astronomical units, and beyond."""
    other = swung(mass, length)
    assert other.status == plain.status == "ok"
    for name in NAMES:
        apart = abs(other.columns[name] - plain.columns[name]).max()
        assert apart <= 2e-9 * plain.scales[name]


@pytest.mark.parametrize(("mass", "length"), [(2.0**-100, 2.0**-40), (2.0**90, 2.0**60)])
def test_units_of_powers_of_two_change_no_bit(plain, mass, length):
    other = swung(mass, length)
    for name in NAMES:
        assert other.columns[name].tolist() == plain.columns[name].tolist()
    for name in ("x1", "z2", "dot(x2)"):
        assert other.columns[name].tolist() == (length * plain.columns[name]).tolist()
    assert other.estimated == plain.estimated


# A symplectic method for a long time.


def test_gauss6_keeps_the_energy_of_a_pendulum():
    """Over 500 periods the energy is off by no more than over the first 50."""
    scene = load(SYSTEMS / "pendulums/pendulum.yaml", parameters={"l": 1.0}).derive()
    drifts = [
        scene.simulate(
            until=periods * 2.2, method="Gauss6", step=0.05, samples=periods * 2 + 1
        ).energy_drift
        for periods in (50, 500)
    ]
    assert drifts[1] < 1.5 * drifts[0]
    assert drifts[1] < 1e-6
    assert not math.isnan(drifts[1])
