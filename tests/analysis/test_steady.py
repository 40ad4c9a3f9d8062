"""Steady motions against closed forms, and against the poles of the whole system turning."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.api import load, loads
from lagrange_cli.errors import InputError
from tests.systems.shipped import SYSTEMS

HOLE = SYSTEMS / "lecture" / "masses_through_hole.yaml"
SPHERICAL = SYSTEMS / "pendulums" / "spherical_pendulum.yaml"
TOP = SYSTEMS / "rigid" / "heavy_top.yaml"


def steady(scene, *parts, at=None, **parameters):
    derivation = load(scene, parameters=parameters).derive()
    return derivation.analyze(*parts, at=at, steady=True)


def whole_poles(derivation, analysis, point):
    """Poles of all coordinates about the motion, by SymPy's derivatives of M⁻¹ f: no reduction."""
    equations = derivation.equations
    place = {p.symbol: sp.Float(p.decimal, 30) for p in equations.system.parameters}
    place |= {c.v: 0 for c in equations.system.coordinates}
    place |= {c.q: sp.Float(1, 30) for c in equations.system.coordinates}
    resting = analysis.rest_equations.system.coordinates
    place |= {c.q: sp.Float(str(x), 30) for c, x in zip(resting, point.position, strict=True)}
    ignored = [m.coordinate for m in analysis.steady.momenta]
    rates = zip(ignored, point.turning.rates, strict=True)
    place |= {c.v: sp.Float(str(x), 30) for c, x in rates}
    state = [c.q for c in equations.system.coordinates] + [
        c.v for c in equations.system.coordinates
    ]
    n = len(equations.system.coordinates)
    mass = sp.Matrix(n, n, lambda i, j: equations.system.mass_matrix[i][j])
    force = sp.Matrix(equations.system.forcing)
    assert np.abs(np.array(force.subs(place).tolist(), dtype=float)).max() < 1e-12
    slopes = mass.subs(place).inv() * force.jacobian(state).subs(place)
    a = np.zeros((2 * n, 2 * n))
    a[:n, n:] = np.eye(n)
    a[n:] = np.array(slopes.tolist(), dtype=float)
    return np.linalg.eigvals(a)


def test_circular_orbit_of_the_hole_in_the_table():
    """R = m g / (M Ω²), and it oscillates with ω² = 3 M Ω² / (M + m)."""
    found = steady(HOLE, at={"dot(theta)": 3})
    (point,) = found.equilibria.points
    assert found.equilibria.complete
    assert str(point.exact[0]) == "g*m/(M*dot(theta)**2)"
    assert point.turning.momenta[0] == pytest.approx(2 * 3 * (9.81 / 18) ** 2)
    assert point.stability.verdict == "stable"
    (mode,) = found.modes
    assert str(mode.exact_square) == "3*M*dot(theta)**2/(M + m)"
    assert found.linearization.mass.tolist() == [[3.0]]
    assert found.linearization.stiffness[0, 0] == pytest.approx(3 * 2 * 9)


def test_momentum_of_the_initial_state_is_the_default():
    """p = M R² Ω: R³ = p² / (M m g)."""
    found = steady(HOLE)
    (point,) = found.equilibria.points
    assert found.equilibria.complete
    assert float(point.position[0]) == pytest.approx((36 / (2 * 9.81)) ** (1 / 3), rel=1e-15)
    assert found.steady.given_values[0][1] == 6.0
    assert point.turning.rates[0] == pytest.approx(6 / (2 * float(point.position[0]) ** 2))
    assert steady(HOLE, at={"p_theta": 6}).equilibria.points[0].position == point.position


def test_closed_forms_need_no_values():
    text = HOLE.read_text().replace("m: 1.0", "m: {}")
    found = loads(text).derive().analyze("equilibria", at={"dot(theta)": 3}, steady=True)
    (point,) = found.equilibria.points
    assert str(point.exact[0]) == "g*m/(M*dot(theta)**2)"
    assert point.stability.verdict == "undecided"


def test_conical_pendulum():
    """cos θ = g / (l Ω²), and ω² = Ω² + 3 g² / (l Ω)²; each cone is listed once."""
    found = steady(SPHERICAL, at={"dot(phi)": 5})
    cones = [p for p in found.equilibria.points if p.stability.verdict == "stable"]
    (cone,) = cones
    assert float(cone.position[0]) == pytest.approx(math.acos(9.81 / 25), rel=1e-15)
    (mode,) = found.modes
    assert mode.frequency**2 == pytest.approx(25 + 3 * 9.81**2 / 25, rel=1e-14)
    poles = [p for p in found.equilibria.points if p is not cone]
    assert {p.stability.verdict for p in poles} == {"undecided"}
    assert all("singular" in p.stability.reason for p in poles)


def test_slow_conical_pendulum_is_absent():
    found = steady(SPHERICAL, "equilibria", at={"dot(phi)": 3})
    assert len(found.equilibria.points) == 2
    assert len(found.equilibria.absent) == 2


def test_friction_makes_the_cone_attract():
    scene = SPHERICAL.read_text().replace(
        "potentials:", "dissipation: {pivot: 0.1*dot(theta)^2/2}\npotentials:"
    )
    expected = scene[: scene.index("expect:")]
    found = loads(expected).derive().analyze(steady=True, at={"dot(phi)": 5})
    verdicts = {p.stability.verdict for p in found.equilibria.points}
    assert verdicts == {"undecided", "asymptotically stable"}


@pytest.mark.slow
@pytest.mark.parametrize("rate", [3.6, 40.0])
def test_regular_precession_and_nutation_of_a_heavy_top(rate):
    """M g l = Ω (p_ψ − I1 Ω cos θ), and ω² = Ω² − 2 (M g l / I1) cos θ + (M g l / (I1 Ω))²."""
    inertia, torque, spin = 8e-4, 0.2 * 9.81 * 0.05, 2e-4 * 150
    level = (spin - torque / rate) / (inertia * rate)
    found = steady(TOP, at={"dot(phi)": rate, "theta": math.acos(level)})
    point = found.linearization.at
    assert math.cos(point.position[0]) == pytest.approx(level, rel=1e-12)
    assert point.stability.verdict == "stable"
    nutation = rate**2 - 2 * torque / inertia * level + (torque / (inertia * rate)) ** 2
    assert found.modes[0].frequency == pytest.approx(math.sqrt(nutation), rel=1e-12)
    again = steady(TOP, at={"p_phi": str(point.turning.momenta[0]), "p_psi": spin})
    nearest = again.linearization.at
    assert abs(nearest.position[0]) == pytest.approx(float(point.position[0]), rel=1e-9)


TWO_BODIES = """\
name: two_bodies
parameters: {G: 1, m1: 3, m2: 1}
particles:
  first: {mass: m1, position: [X - m2/(m1 + m2)*r*cos(phi), Y - m2/(m1 + m2)*r*sin(phi), 0]}
  second: {mass: m2, position: [X + m1/(m1 + m2)*r*cos(phi), Y + m1/(m1 + m2)*r*sin(phi), 0]}
coordinates:
  X: {}
  Y: {}
  r: {positive: true}
  phi: {}
potentials: {gravitation: -G*m1*m2/r}
initial: {X: 0, Y: 0, r: 1, phi: 0, dot(X): 0.1, dot(Y): 0, dot(r): 0.2, dot(phi): 2.2}
"""


@pytest.mark.slow
def test_the_condition_of_regular_precession_is_that_of_goldstein():
    """(I₁ cos θ φ̇² − I₃ ω₃ φ̇ + M g l) sin θ = 0 with ω₃ = ψ̇ + φ̇ cos θ (section 5.7)."""
    found = steady(TOP, "equilibria")
    (condition,) = found.steady.conditions
    system = load(TOP).derive().equations.system
    letters = {p.name: p.symbol for p in system.parameters}
    theta = next(c.q for c in system.coordinates if c.name == "theta")
    phi, psi = (c.v for c in system.coordinates if c.name in ("phi", "psi"))
    m, length, i1, i3, g = (letters[name] for name in ("M", "l", "I1", "I3", "g"))
    spin = psi + phi * sp.cos(theta)
    goldstein = i1 * sp.cos(theta) * phi**2 - i3 * spin * phi + m * g * length
    assert sp.simplify(condition - goldstein * sp.sin(theta)) == 0


def test_circular_orbit_of_two_bodies():
    """Kepler: r³ Ω² = G (m1 + m2), and the radius oscillates with Ω."""
    derivation = loads(TWO_BODIES).derive()
    found = derivation.analyze(steady=True, at={"dot(phi)": 2})
    (point,) = found.equilibria.points
    assert float(point.position[0]) == pytest.approx(1.0, rel=1e-15)
    assert [m.name for m in found.steady.momenta] == ["p_X", "p_Y", "p_phi"]
    assert [float(x) for x in point.turning.rates] == pytest.approx([0.1, 0.0, 2.0])
    assert point.turning.momenta[2] == pytest.approx(0.75 * 2)
    assert found.modes[0].frequency == pytest.approx(2.0, rel=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "at"),
    [
        ("pendulums/spherical_pendulum", {}),
        ("rigid/heavy_top", {}),
        ("rigid/free_asymmetric_top", {}),
        ("celestial/schwarzschild_orbit", {}),
        ("fields/charged_particle", {}),
        ("pendulums/furuta_pendulum", {"dot(phi)": 7}),
        ("surfaces/particle_on_torus", {}),
    ],
)
def test_reduced_modes_are_those_of_the_whole_system(scene, at):
    """Two poles at zero for each ignored coordinate; the others are those of Routh's equations."""
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    found = derivation.analyze(steady=True, at=at)
    whole = whole_poles(derivation, found, found.linearization.at)
    scale = np.abs(whole).max()
    reduced = np.linalg.eigvals(found.linearization.state_space.a)
    zeros = np.zeros(2 * len(found.steady.momenta))
    expected = np.sort_complex(np.round(np.concatenate([reduced, zeros]) ** 2 / scale**2, 7))
    assert np.allclose(np.sort_complex(np.round(whole**2 / scale**2, 7)), expected, atol=2e-6)


def test_inputs_drive_the_radius():
    text = HOLE.read_text()
    text = text[: text.index("expect:")] + "inputs: [F]\nforces: {pull: {on: r, force: F}}\n"
    found = loads(text + "outputs: {radius: r, place: r*cos(theta), turn: dot(theta)}\n")
    space = found.derive().analyze(steady=True, at={"dot(theta)": 3}).linearization.state_space
    assert space.states == ("r", "dot(r)")
    assert space.outputs == ("radius", "turn")
    assert space.b.tolist() == [[0.0], [pytest.approx(1 / 3)]]
    radius = 9.81 / 18
    assert space.c[1, 0] == pytest.approx(-2 * 3 / radius)  # p = M r² Ω stays


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "at", "fragment"),
    [
        ("pendulums/pendulum", {}, "no coordinate is cyclic"),
        ("lecture/masses_through_hole", {"p_theta": 1, "dot(theta)": 1}, "are both given"),
        ("lecture/masses_through_hole", {"p_r": 1}, "'p_r' is no coordinate"),
        ("lecture/masses_through_hole", {"r": 7}, "this is no steady motion"),
        ("lecture/masses_through_hole", {"dot(theta)": "r"}, "this is no number"),
    ],
)
def test_refusals(scene, at, fragment):
    with pytest.raises(InputError, match=fragment):
        steady(SYSTEMS / f"{scene}.yaml", at=at)


def test_every_motion_of_free_coordinates_is_steady():
    scene = "particles: {ball: {mass: 1, position: [x, 0, 0]}}\ncoordinates: [x]\n"
    with pytest.raises(InputError, match="every motion is steady"):
        loads(scene).derive().analyze(steady=True)


def test_a_force_that_turns_with_an_ignored_coordinate_leaves_nothing_steady():
    scene = """
    coordinates: [r, phi]
    kinetic: {T: dot(r)^2/2 + r^2*dot(phi)^2/2}
    potentials: {V: r^2}
    forces: {wind: {on: r, force: cos(phi)}}
    initial: {r: 2, phi: 0}
    """
    with pytest.raises(InputError, match="'phi' turns in the force on 'r': nothing is steady"):
        loads(scene).derive().analyze(steady=True)
