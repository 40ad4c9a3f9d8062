"""Linear systems against closed forms, the other formulation, and small motions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm, solve_continuous_are

from lagrange_cli.analysis.values import Linearization
from lagrange_cli.api import Derivation, load, loads
from lagrange_cli.errors import InputError
from tests.systems.shipped import SYSTEMS

CART = """\
name: cart
parameters: {M: 1.5, m: 0.4, l: 0.7, g: 9.81, c: 0.3}
inputs: [F]
particles:
  cart: {mass: M, position: [p, 0, 0]}
  bob: {mass: m, position: [p + l*sin(theta), 0, l*cos(theta)]}
coordinates: [p, theta]
potentials: {weight: {gravity: g}}
forces: {motor: {on: p, force: F}}
dissipation: {wheels: c/2*dot(p)^2}
outputs: {place: p, tip: p + l*sin(theta), push: 2*F + dot(p)}
initial: {p: 0, theta: 0.1, dot(p): 0, dot(theta): 0}
simulate: {until: 5}
"""

WAVE = """\
name: wave
parameters: {l: 1}
coordinates: [y]
kinetic: {t: dot(y)^2/2}
potentials: {v: cos(y/l)}
initial: {y: 0}
"""


def derived(text: str, **parameters: float) -> Derivation:
    return loads(text, parameters=parameters).derive()


def linear(derivation: Derivation, **at: float | str) -> Linearization:
    found = derivation.analyze("linearization", at=at).linearization
    assert found is not None
    return found


def test_inverted_pendulum_on_a_cart_is_the_textbook_one():
    """Friedland, Control System Design (1986), example 2E, with friction."""
    found = linear(derived(CART), theta=0)
    cart, bob, length, g, c = 1.5, 0.4, 0.7, 9.81, 0.3
    space = found.state_space
    assert space.states == ("p", "theta", "dot(p)", "dot(theta)")
    assert space.inputs == ("F",)
    assert space.outputs == ("place", "tip", "push")
    expected = [
        [0, 0, 1, 0],
        [0, 0, 0, 1],
        [0, -bob * g / cart, -c / cart, 0],
        [0, (cart + bob) * g / (cart * length), c / (cart * length), 0],
    ]
    assert_allclose(space.a, expected, atol=1e-14)
    assert_allclose(space.b, [[0], [0], [1 / cart], [-1 / (cart * length)]], atol=1e-14)
    assert_allclose(space.c, [[1, 0, 0, 0], [1, length, 0, 0], [0, 0, 1, 0]], atol=1e-14)
    assert_allclose(space.d, [[0], [0], [2]], atol=1e-14)


def test_closed_forms_have_the_values_of_the_numbers():
    derivation = derived(CART)
    found = linear(derivation, theta=0)
    assert found.exact is not None
    values = {p.symbol: p.value for p in derivation.equations.system.parameters}
    pairs = [
        (found.exact.mass, found.mass),
        (found.exact.damping, found.damping),
        (found.exact.stiffness, found.stiffness),
        (found.exact.a, found.state_space.a),
        (found.exact.b, found.state_space.b),
    ]
    for rows, numbers in pairs:
        assert rows is not None
        closed = np.array([[float(e.subs(values)) for e in row] for row in rows])
        assert_allclose(closed, numbers, atol=1e-13)


@pytest.mark.slow
def test_linear_quadratic_regulator_holds_the_pendulum_up():
    """Gains from A and B by SciPy's Riccati equation, put into the scene as a force."""
    space = linear(derived(CART), theta=0).state_space
    weights = np.diag([1.0, 10.0, 1.0, 1.0])
    riccati = solve_continuous_are(space.a, space.b, weights, np.eye(1))
    (gains,) = (space.b.T @ riccati).tolist()
    law = " - ".join(f"({gain!r})*{name}" for gain, name in zip(gains, space.states, strict=True))
    held = CART.replace("inputs: [F]\n", "").replace("force: F", f"force: -{law}")
    held = held.replace("outputs: {place: p, tip: p + l*sin(theta), push: 2*F + dot(p)}\n", "")
    start = {"theta": 0.3}
    free = derived(CART).simulate(until=15.0, accuracy=1e-6, initial=start)
    assert np.abs(free.columns["theta"]).max() > math.pi / 2
    trajectory = derived(held).simulate(until=15.0, accuracy=1e-6, initial=start)
    assert np.abs(trajectory.columns["theta"]).max() < 0.5
    assert abs(trajectory.state["theta"]) < 1e-4
    assert abs(trajectory.state["p"]) < 1e-2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pendulums/double_pendulum", "beads/bead_on_rotating_hoop"])
def test_small_motions_are_those_of_the_state_space(name):
    """Motions that begin 1e-4 and 1e-5 away differ from exp(A t) by the square of that."""
    derivation = load(SYSTEMS / f"{name}.yaml").derive()
    found = derivation.analyze("linearization").linearization
    assert found is not None
    space = found.state_space
    rest = np.array([float(x) for x in found.at.position or ()])
    n = len(rest)
    direction = np.arange(1.0, 2 * n + 1)
    misses = []
    for size in (1e-3, 1e-4):
        start = np.concatenate([rest, np.zeros(n)]) + size * direction
        initial = dict(zip(space.states, start.tolist(), strict=True))
        end = derivation.simulate(until=1.0, accuracy=1e-11, initial=initial).state
        reached = np.array([end[state] for state in space.states])
        expected = np.concatenate([rest, np.zeros(n)]) + size * expm(space.a) @ direction
        misses.append(np.abs(reached - expected).max())
    assert misses[0] < 1e-2 * 1e-3 * direction.max()
    assert misses[1] < misses[0] / 50


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pendulums/double_pendulum", "chains/pendulum_chain"])
def test_multipliers_give_the_same_poles(name):
    """Second derivatives of the rods enter K by their multipliers."""
    sizes = {"n": 3} if name == "chains/pendulum_chain" else {}
    loaded = load(SYSTEMS / f"{name}.yaml", parameters=sizes)
    poles = []
    for formulation in ("minimal", "multiplier"):
        derivation = loaded.derive(formulation=formulation)
        equations = derivation.equations
        assert equations.system.formulation == formulation
        at = {c.name: 0 for c in equations.system.coordinates if formulation == "minimal"}
        if formulation == "multiplier":
            hanging = loaded.derive(formulation="minimal").equations
            at = {
                place.name: float(place.position.subs(_values(hanging)).evalf())
                for place in hanging.system.cartesian_names
                if place.name in {c.name for c in equations.system.coordinates}
            }
        found = linear(derivation, **at)
        poles.append(np.sort(np.linalg.eigvals(found.state_space.a).imag))
    assert_allclose(poles[0], poles[1], rtol=1e-9)


def _values(equations):
    values = {p.symbol: p.value for p in equations.system.parameters}
    return values | {c.q: 0 for c in equations.system.coordinates}


def test_pendulum_in_cartesian_coordinates_swings_by_its_multiplier():
    scene = load(SYSTEMS / "constraints" / "pendulum_in_cartesian_coordinates.yaml")
    found = scene.derive().analyze().linearization
    assert found is not None
    assert found.coordinates == ("x",)
    assert_allclose(found.stiffness / found.mass, [[9.81]], rtol=1e-12)


@pytest.mark.campaign
@pytest.mark.slow
def test_bicycle_at_rest_has_its_published_poles():
    """Meijaard, Papadopoulos, Ruina, Schwab, Proc. R. Soc. A 463 (2007) 1955, table 2, v = 0."""
    derivation = load(SYSTEMS / "rolling" / "bicycle.yaml").derive()
    found = linear(derivation, alpha=0)
    poles = np.linalg.eigvals(found.state_space.a)
    largest = np.sort(poles.real)[-2:]
    assert_allclose(largest, [3.131643247906556, 5.530943717653933], rtol=1e-9)


def test_damping_and_gyroscopic_terms_are_told_apart():
    """A charge on springs in a magnetic field B along z, with drag c."""
    scene = """\
parameters: {m: 2, k: 3, c: 0.4, b: 0.7}
particles: {charge: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {springs: k*(x^2 + y^2)/2, field: -b/2*(x*dot(y) - y*dot(x))}
dissipation: {drag: c/2*(dot(x)^2 + dot(y)^2)}
initial: {x: 1, y: 0}
"""
    found = derived(scene).analyze().linearization
    assert found is not None
    assert_allclose(found.dissipative, [[0.4, 0], [0, 0.4]], atol=1e-15)
    assert_allclose(np.abs(found.gyroscopic), [[0, 0.7], [0.7, 0]], atol=1e-15)
    assert found.gyroscopic[0, 1] == -found.gyroscopic[1, 0]


def test_a_zero_is_exact_also_where_forces_change_within_1e_60():
    found = linear(loads(WAVE, parameters={"l": 1e-60}).derive(), y=0)
    assert_allclose(found.stiffness, [[-1e120]])


def test_numbers_beyond_doubles_are_refused():
    with pytest.raises(InputError, match="numbers of the linear system are beyond double"):
        linear(loads(WAVE, parameters={"l": 1e-100}).derive(), y=0)


@pytest.mark.parametrize("output", ["y^(-2)", "exp(exp(exp(exp(exp(exp(y + 1))))))"])
def test_outputs_without_values_at_the_equilibrium_are_refused_with_their_reason(output):
    text = (
        WAVE.replace("cos(y/l)", "y^2/2").replace("y: 0}", "y: 1}") + f"outputs: {{o: {output}}}\n"
    )
    with pytest.raises(InputError, match="the outputs have no derivatives"):
        linear(loads(text).derive())
