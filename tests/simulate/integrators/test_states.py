"""Methods for systems whose closures are kept beside states of first order."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError

pytestmark = pytest.mark.slow

SCENE = """
name: driven_rod
parameters: {m: 1, l: 1, g: 9.81, a: 0.5}
particles:
  bob: {mass: m, position: [x, 0, z]}
coordinates: [x, z]
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: g}}
states:
  s1: (x - s1)/a
  s2: s1 - s2*dot(z)
  s3: -s3 + x*s2
  s4: z - s4
forces: {push: {on: x, force: 2*s1 + s3}}
initial: {x: l, z: 0, dot(x): 0, dot(z): 0, s1: 0, s2: 0.1, s3: 0.2, s4: 0}
simulate: {until: 3, formulation: multiplier}
"""

#: The same over an angle.
MINIMAL = (
    SCENE.replace("coordinates: [x, z]", "coordinates: [phi]")
    .replace("constraints: {rod: x^2 + z^2 = l^2}", "definitions: {x: l*cos(phi), z: l*sin(phi)}")
    .replace("x: l, z: 0, dot(x): 0, dot(z): 0,", "phi: 0, dot(phi): 0,")
    .replace("on: x, force: 2*s1 + s3", "on: phi, force: -l*sin(phi)*(2*s1 + s3)")
    .replace(", formulation: multiplier", "")
)

COLUMNS = ("x", "z", "s1", "s2", "s3", "s4")


@pytest.fixture(scope="module")
def minimal():
    return loads(MINIMAL).derive().simulate(accuracy=1e-11)


@pytest.fixture(scope="module")
def driven_rod():
    return loads(SCENE).derive()


def test_multiplier_form_moves_as_the_minimal_form(driven_rod, minimal):
    found = driven_rod.simulate(accuracy=1e-10)
    for name in COLUMNS:
        assert np.abs(found.columns[name] - minimal.columns[name]).max() <= 2e-10


def test_ida_projects_positions_and_velocities_alone(driven_rod, minimal):
    pytest.importorskip("sksundae.ida")
    found = driven_rod.simulate(method="IDA", rtol=1e-9, atol=1e-11)
    for name in COLUMNS:
        assert np.abs(found.columns[name] - minimal.columns[name]).max() <= 1e-6


@pytest.mark.parametrize("method", ["Verlet", "RATTLE"])
def test_methods_that_split_the_state_are_refused(driven_rod, method):
    with pytest.raises(InputError, match="has no place for the states of first order: 's1', 's2'"):
        driven_rod.simulate(method=method, step=1e-3)
