"""Modes against closed forms from books, and against SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from lagrange_cli.api import load, loads
from tests.systems.shipped import SYSTEMS

CHAIN = """\
sizes: {n: 8}
parameters: {m: 0.3, k: 7}
particles:
  p[i=1..n]: {mass: m, position: ["x[i]", 0, 0]}
coordinates: ["x[i=1..n]"]
potentials:
  springs: k/2*(x[1]^2 + x[n]^2 + sum((x[i+1] - x[i])^2, i=1..n-1))
initial: {"x[i=1..n]": 0.1*i}
"""

EQUAL = """\
parameters: {m: 2, l: {value: 0.5, positive: true}, g: 9.81}
particles:
  a: {mass: m, position: [l*sin(p), 0, -l*cos(p)]}
  b: {mass: m, position: [l*sin(p) + l*sin(q), 0, -l*cos(p) - l*cos(q)]}
coordinates: [p, q]
potentials: {weight: {gravity: g}}
initial: {p: 0.1, q: 0.2}
"""


@pytest.mark.slow
def test_chain_between_walls():
    """ω_j = 2 √(k/m) sin(jπ/(2(n + 1)))."""
    found = loads(CHAIN).derive().analyze("modes").modes
    expected = [2 * math.sqrt(7 / 0.3) * math.sin(j * math.pi / 18) for j in range(1, 9)]
    assert_allclose([mode.frequency for mode in found], expected, rtol=1e-12)
    for j, mode in enumerate(found, 1):
        sines = np.sin(np.arange(1, 9) * j * math.pi / 9)
        shape = np.real(mode.shape)
        assert_allclose(shape / shape[0], sines / sines[0], rtol=1e-9, atol=1e-12)


def test_equal_double_pendulum_in_closed_form():
    """Landau and Lifshitz, Mechanics, §23, problem 2: ω² = (2 ± √2) g/l."""
    found = loads(EQUAL).derive().analyze("modes").modes
    squares = [str(mode.exact_square) for mode in found]
    assert squares == ["-g*(-2 + sqrt(2))/l", "g*(sqrt(2) + 2)/l"]
    shapes = [tuple(map(str, mode.exact_shape)) for mode in found]
    assert shapes == [("sqrt(2)/2", "1"), ("-sqrt(2)/2", "1")]
    ratios = [mode.frequency**2 * 0.5 / 9.81 for mode in found]
    assert_allclose(ratios, [2 - math.sqrt(2), 2 + math.sqrt(2)], rtol=1e-13)


def test_triple_pendulum_against_scipy():
    derivation = load(SYSTEMS / "pendulums" / "triple_pendulum.yaml").derive()
    analysis = derivation.analyze()
    linear = analysis.linearization
    squares = eigh(linear.stiffness, linear.mass, eigvals_only=True)
    assert_allclose([mode.frequency**2 for mode in analysis.modes], squares, rtol=1e-12)
    for mode in analysis.modes:
        shape = np.real(mode.shape)
        left = linear.stiffness @ shape
        assert_allclose(left, mode.frequency**2 * linear.mass @ shape, atol=1e-10)
        assert np.abs(shape).max() == pytest.approx(1)


@pytest.mark.parametrize("c", [0.5, 4.0, 6.0])
def test_damped_oscillator_has_its_poles(c):
    """s = −c/2m ± √((c/2m)² − k/m): under, critically and over-damped."""
    scene = f"""\
particles: {{ball: {{mass: 1, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{spring: 2*x^2}}
dissipation: {{drag: {c}/2*dot(x)^2}}
initial: {{x: 1}}
"""
    found = loads(scene).derive().analyze("modes").modes
    expected = np.roots([1, c, 4])
    poles = [mode.pole for mode in found]
    kept = sorted((p for p in expected if p.imag >= 0), key=lambda p: -p.real)
    assert_allclose(sorted(poles, key=lambda p: -p.real), kept, atol=1e-6)


def test_modes_are_those_of_the_stable_equilibrium_or_of_the_one_named():
    derivation = load(SYSTEMS / "pendulums" / "pendulum.yaml").derive()
    (hanging,) = derivation.analyze("modes").modes
    (upright,) = derivation.analyze("modes", at={"theta": "pi"}).modes
    rate = math.sqrt(9.81)
    assert hanging.frequency == pytest.approx(rate, rel=1e-12)
    assert upright.frequency == 0
    assert upright.pole == pytest.approx(rate, rel=1e-12)


PENDULUMS_WITH_SPRING = """\
parameters: {m: 1, l: {value: 1, positive: true}, k: 2, g: 9.81}
plane: xz
particles:
  one: {mass: m, position: [l*sin(theta1), 0, -l*cos(theta1)]}
  two: {mass: m, position: [l*sin(theta2), 0, -l*cos(theta2)]}
coordinates: [theta1, theta2]
potentials:
  weight: {gravity: g}
  spring: k*l^2/2*(sin(theta1) - sin(theta2))^2
initial: {theta1: 0.1, theta2: 0}
"""


@pytest.mark.slow
def test_equilibria_of_symmetry_have_exact_frequencies():
    """Marion and Thornton 12.3: the equations have no closed solution, θ = 0 is tried."""
    found = loads(PENDULUMS_WITH_SPRING).derive().analyze("equilibria", "modes")
    assert [str(mode.exact_square) for mode in found.modes] == ["g/l", "g/l + 2*k/m"]
    assert {tuple(map(str, p.exact)) for p in found.equilibria.points} == {
        ("0", "0"),
        ("0", "pi"),
        ("pi", "0"),
        ("pi", "pi"),
    }
    assert not found.equilibria.complete


@pytest.mark.slow
@pytest.mark.parametrize("g", [9.81, -9.81])
def test_modes_of_the_double_pendulum_are_products(g):
    """Landau and Lifshitz, §23, problem 2; with g < 0 it oscillates upside down."""
    scene = (SYSTEMS / "pendulums" / "double_pendulum.yaml").read_text()
    found = loads(scene, parameters={"g": g}).derive().analyze("modes")
    slow, fast = found.modes
    assert slow.frequency < fast.frequency
    values = {p.symbol: p.value for p in found.equations.system.parameters}
    for mode in found.modes:
        assert float(mode.exact_square.subs(values)) == pytest.approx(mode.frequency**2)
        assert sp.count_ops(mode.exact_square) <= 30
