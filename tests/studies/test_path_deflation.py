"""Further paths by deflation, against products of paths that elliptic integrals count."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from lagrange_cli.api import loads
from lagrange_cli.report.values.studies import PATHS
from lagrange_cli.studies.path.deflation import Solutions

PAIR = """
name: pair
parameters: {m: 1, l1: 1, l2: 1.3, g: 9.81}
particles:
  a: {mass: m, position: [l1*sin(u), 0, -l1*cos(u)]}
  b: {mass: m, position: [l2*sin(w), 0, -l2*cos(w)]}
coordinates: {u: {unit: rad}, w: {unit: rad}}
potentials: {weight: {gravity: g}}
"""

PLANE = """
name: oscillator
parameters: {m: 2, w: 3}
particles: {a: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {spring: m*w^2*(x^2 + y^2)/2}
"""


def speeds(length, span):
    """The speeds with which a pendulum comes back to its lowest point after half swings."""
    rate = math.sqrt(9.81 / length)
    found, halves = [0.0], 1
    while halves * math.pi / rate < span:

        def late(k, halves=halves):
            return halves * 2 * ellipk(k * k) / rate - span

        k = brentq(late, 1e-9, 1 - 1e-14, xtol=1e-15)
        found += [2 * k * rate, -2 * k * rate]
        halves += 1
    return found


def rounded(values):
    return tuple(round(v, 6) for v in values)


def paths(text, start, end):
    return loads(text).derive().path(start, end)


@pytest.mark.slow
def test_all_nine_paths_of_two_pendulums():
    found = paths(PAIR, {"u": 0, "w": 0, "t": 0}, {"u": 0, "w": 0, "t": 1.5})
    expected = list(itertools.product(speeds(1, 1.5), speeds(1.3, 1.5)))
    assert len(expected) == 9
    velocities = sorted((tuple(p.velocity.tolist()) for p in found.solutions), key=rounded)
    np.testing.assert_allclose(velocities, sorted(expected, key=rounded), rtol=0, atol=1e-8)
    assert 1 <= found.deflated <= 8
    assert PATHS.write(found)["deflated"] == found.deflated
    # Each pendulum that rests for longer than a half swing has a conjugate point; so has the pair.
    rest = next(p for p in found.solutions if not p.velocity.any())
    halves = [1.5 * math.sqrt(9.81 / length) / math.pi for length in (1, 1.3)]
    assert rest.conjugacy.index == sum(map(math.floor, halves)) == 2


@pytest.mark.slow
def test_every_path_is_a_pair_of_paths():
    found = paths(PAIR, {"u": 0, "w": 0, "t": 0}, {"u": 0, "w": 0, "t": 2.3})
    assert len(found.solutions) > 8
    for path in found.solutions:
        for velocity, length in zip(path.velocity, (1, 1.3), strict=True):
            assert min(abs(velocity - v) for v in speeds(length, 2.3)) < 1e-7


@pytest.mark.slow
def test_a_family_is_not_deflated():
    found = paths(PLANE, {"x": 1, "y": 0, "t": 0}, {"x": -1, "y": 0, "t": "pi/3"})
    assert [p.conjugacy.kind for p in found.solutions] == ["degenerate"]
    assert found.deflated == 0


def test_the_deflated_step_solves_the_deflated_equations():
    """(F′ + F ∇mᵀ/m) d = −F, with m and its gradient in differences."""
    random = np.random.default_rng(1)
    known = Solutions()
    shape = (7, 2)
    for _ in range(3):
        assert known.add(random.normal(size=shape))
    path = random.normal(size=shape)
    inner = path[1:-1].size
    jacobian, residual = random.normal(size=(inner, inner)), random.normal(size=inner)

    def logarithm(values):
        moved = path.copy()
        moved[1:-1] = values.reshape(path[1:-1].shape)
        squares = [np.mean((moved[1:-1] - other[1:-1]) ** 2) for other in known.paths]
        return sum(math.log(1 + 1 / s) for s in squares)

    base, step = path[1:-1].ravel(), 1e-6
    gradient = np.array(
        [
            (logarithm(base + step * e) - logarithm(base - step * e)) / (2 * step)
            for e in np.eye(inner)
        ]
    )
    expected = np.linalg.solve(jacobian + np.outer(residual, gradient), -residual)
    newton = -np.linalg.solve(jacobian, residual)
    factor = known.factor(path, newton.reshape(path[1:-1].shape))
    np.testing.assert_allclose(factor * newton, expected, rtol=1e-6)


def test_a_solution_is_taken_once():
    known = Solutions()
    path = np.linspace(0, 1, 9)[:, None]
    assert known.add(path)
    assert not known.add(path + 1e-6)
    assert known.add(path + 0.5 * np.sin(np.pi * path))
