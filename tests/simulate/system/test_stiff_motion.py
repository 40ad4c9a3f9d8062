"""Stiff systems: right-hand sides counted, values from closed forms and from other methods."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from lagrange_cli.api import loads
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.simulation import simulate
from tests.simulate.compiling import compiled_or_skip

#: Van der Pol's equation, in units of its fast motion.
RELAXATION = """
name: relaxation
parameters: {mu: 1000}
coordinates: [x]
kinetic: {inertia: dot(x)^2/2}
potentials: {spring: x^2/2}
forces: {valve: {on: x, force: mu*(1 - x^2)*dot(x)}}
initial: {x: 2, dot(x): 0}
simulate: {until: 2000, samples: 201}
"""

#: A rod of a pendulum replaced by a very stiff spring, and its damper.
SPRING = """
name: spring
parameters: {m: 1, l: 1, k: 1e10, c: 1e6, g: 9.81}
coordinates: [x, z]
particles: {bob: {mass: m, position: [x, 0, z]}}
potentials: {weight: m*g*z, spring: k*(sqrt(x^2 + z^2) - l)^2/2}
dissipation: {damper: c*(x*dot(x) + z*dot(z))^2/(x^2 + z^2)/2}
initial: {x: 0.6, z: -0.8, dot(x): 0, dot(z): 0}
simulate: {until: 2, samples: 101}
"""

#: A ball that sinks in oil and stays on the ground.
SINKING = """
name: sinking
parameters: {m: 1, g: 9.81, c: 1e6}
particles: {p: {mass: m, position: [0, 0, z]}}
coordinates: [z]
constraints: {floor: {unilateral: "z >= 0", restitution: 0}}
potentials: {weight: m*g*z}
dissipation: {oil: c*dot(z)^2/2}
initial: {z: 1e-5, dot(z): 0}
simulate: {until: 2, samples: 101}
"""


@cache
def model(text):
    return model_of(loads(text).derive().equations)


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
def test_relaxation_oscillations(accuracy):
    of = model(RELAXATION)
    compiled_or_skip(of)
    found = simulate(of, accuracy=accuracy)
    fine = simulate(of, method="Radau", rtol=1e-11)
    assert (found.status, found.method) == ("ok", "Radau")
    assert found.rhs_evaluations < 200_000  # DOP853 needs seven million at 1e-6
    for name, scale in found.scales.items():
        assert np.abs(found.columns[name] - fine.columns[name]).max() < accuracy * scale


@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_errors_of_radau_follow_the_tolerance(rtol):
    """Also between steps, and as SciPy's do."""
    of = model(RELAXATION)
    compiled_or_skip(of)
    found, fine = (simulate(of, method="Radau", rtol=r, samples=2001) for r in (rtol, 1e-12))
    slow = np.abs(fine.columns["dot(x)"]) < 0.1
    assert np.abs(found.columns["x"] - fine.columns["x"])[slow].max() < 300 * rtol


@pytest.mark.slow
def test_a_stiff_spring_is_nearly_a_rod():
    of = model(SPRING)
    compiled_or_skip(of)
    found = simulate(of, accuracy=1e-6)
    assert (found.status, found.method) == ("ok", "Radau")
    assert found.all_evaluations < 600_000
    rod = simulate(
        model(
            "name: rod\nparameters: {g: 9.81}\ncoordinates: [a]\nkinetic: {t: dot(a)^2/2}\n"
            "potentials: {w: -g*cos(a)}\ninitial: {a: asin(3/5), dot(a): 0}\n"
            "simulate: {until: 2, samples: 101}\n"
        ),
        accuracy=1e-9,
    )
    assert np.abs(found.columns["x"] - np.sin(rod.columns["a"])).max() < 1e-6


@pytest.mark.slow
def test_a_stiff_motion_meets_a_contact():
    """It sinks by v (t - tau (1 - exp(-t/tau))), with v = m g/c and tau = m/c."""
    of = model(SINKING)
    compiled_or_skip(of)
    found = simulate(of, accuracy=1e-6)
    speed, tau = 9.81e-6, 1e-6
    hit = brentq(lambda t: 1e-5 - speed * (t + tau * math.expm1(-t / tau)), 0.5, 2.0, xtol=1e-15)
    assert (found.status, found.method) == ("ok", "Radau")
    assert found.all_evaluations < 300_000  # DOP853 needs more than nine million
    assert [e.name for e in found.events] == ["contact:floor"]
    assert found.events[0].t == pytest.approx(hit, abs=2e-6)
