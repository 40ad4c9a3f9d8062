"""Bodies that come close to a centre, and coordinates that rounding moves beside their scale."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate.accuracy.method_selection import coarse_result, noise_of_steps
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.simulation import problem_of, simulate
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

#: Distance and velocity at the aphelion of an ellipse with half axis 1, from 1 − e = 1e-6.
APHELION = 2 - 1e-6, math.sqrt(1e-6 / (2 - 1e-6))

COMET = """
name: comet
parameters: {mu: 1}
plane: xy
particles: {comet: {mass: 1, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {gravitation: -mu/sqrt(x^2 + y^2)}
initial: {x: %r, y: 0, dot(x): 0, dot(y): %r}
simulate: {until: %r, samples: %d}
"""

SPRING = """
name: spring
parameters: {m: 1, k: 1e10, l: 1, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [r*sin(theta), 0, -r*cos(theta)]}}
coordinates: [r, theta]
potentials: {weight: {gravity: g}, spring: k*(r - l)^2/2}
initial: {r: 1, theta: 1, dot(r): 0, dot(theta): 0}
simulate: {until: 0.02, samples: 21}
"""


def model(text):
    return model_of(loads(text).derive().equations)


def problem(of, functions):
    request = resolve(of, SimulationOptions(accuracy=1e-6))
    return problem_of(of, request, functions)


def kepler(times, distance, velocity):
    """Positions by Kepler's equation in 40 digits, from the aphelion, shape (samples, 2)."""
    with mpmath.workdps(40):
        r, v = mpmath.mpf(distance), mpmath.mpf(velocity)
        a = 1 / (2 / r - v**2)
        e = r / a - 1
        rows = []
        for t in times.tolist():
            mean = mpmath.pi + mpmath.mpf(t) / mpmath.sqrt(a) ** 3
            low, high = mean - 1, mean + 1
            for _ in range(130):
                anomaly = (low + high) / 2
                if anomaly - e * mpmath.sin(anomaly) < mean:
                    low = anomaly
                else:
                    high = anomaly
            x, y = a * (mpmath.cos(anomaly) - e), a * mpmath.sqrt(1 - e**2) * mpmath.sin(anomaly)
            rows.append([-x, -y])
        return rows


@pytest.mark.slow
def test_a_comet_of_eccentricity_close_to_1_is_followed_past_the_sun():
    """Ten orbits with a perihelion of a millionth of the aphelion, at 1e-8 by wider arithmetic."""
    distance, velocity = APHELION
    of = model(COMET % (distance, velocity, 62.8, 41))
    functions = compiled_or_skip(of)
    if functions.wider() is None:
        pytest.skip("this machine has no arithmetic wider than double")
    found = simulate(of, accuracy=1e-8, functions=functions)
    assert found.status == "ok"
    exact = kepler(found.t, distance, velocity)
    errors = [
        float(abs(mpmath.mpf(float(found.columns[name][k])) - row[i])) / found.scales[name]
        for k, row in enumerate(exact)
        for i, name in enumerate(("x", "y"))
    ]
    assert max(errors) <= found.estimated < 1e-8


@pytest.mark.slow
def test_a_coarse_run_that_comes_close_is_made_finer():
    """Else it passes the sun on the wrong side, and winds about it without end."""
    of = model(COMET % (*APHELION, 62.8, 101))
    found = coarse_result(problem(of, compiled_or_skip(of)), 1e-14, Watch())
    assert found.evaluations < 100_000
    assert 1.9 < found.scales[0] <= 2.0 * (1 + 1e-9)
    assert found.closest[0] < 1e-5
    assert found.closest[2] == 1.0


def test_a_circle_is_not_close():
    of = model(COMET % (1.0, 1.0, 62.8, 101))
    found = coarse_result(problem(of, compiled_or_skip(of)), 1e-14, Watch())
    assert (found.closest == 1.0).all()


def test_rounding_is_seen_where_equal_numbers_move_alike():
    """The force of a stiff spring at its natural length is the difference of two equal numbers."""
    of = model(SPRING)
    stated = problem(of, interpreted(of, "for this test"))
    h = 1e-6
    noise = noise_of_steps(stated, np.zeros(1), stated.y0[None], np.full(1, h), [()])[0]
    ulp = np.spacing(1.0)
    assert h * 1e10 * ulp / 2 <= noise[2] <= 4 * h * 1e10 * ulp
    assert noise[0] >= h * noise[2]


def test_without_disturbed_functions_nothing_is_known_of_rounding():
    stated = InitialValueProblem(
        lambda t, y: np.array([y[1], -y[0]]),
        np.array([1.0, 0.0]),
        np.linspace(0.0, 1.0, 11),
        ("length",),
    )
    noise = noise_of_steps(stated, np.zeros(1), stated.y0[None], np.full(1, 0.1), [()])
    assert noise.tolist() == [[0.0, 0.0]]


def test_a_stiff_oscillation_is_not_taken_for_a_stiff_system():
    """Its steps are short for the rounding of r beside its tiny scale, not for stability."""
    of = model(SPRING)
    stated = problem(of, compiled_or_skip(of))
    found = coarse_result(stated, 1e-11, Watch())
    assert not found.stiff
    assert found.relative_noise > 1e-8
