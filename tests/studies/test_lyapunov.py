"""Lyapunov exponents: those of linear systems, what all of them add up to, and a second route."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError

pytestmark = pytest.mark.slow

LINE = "name: s\nparameters: {{a: 0.7}}\ncoordinates: [x]\nkinetic: {{T: dot(x)^2/2}}\n{}\n"


def test_a_saddle_parts_at_its_own_rate() -> None:
    text = LINE.format("potentials: {V: -a^2*x^2/2}\ninitial: {x: 0.001, dot(x): 0.0007}")
    found = loads(text).derive().lyapunov(until=20)
    assert found.exponents == pytest.approx((0.7, -0.7), abs=0.01)


def test_friction_is_what_all_exponents_add_up_to() -> None:
    found = load("systems/pendulums/damped_driven_pendulum.yaml").derive().lyapunov(until=100)
    beta = 3 * np.pi / 4
    assert sum(found.exponents) == pytest.approx(-2 * beta, rel=1e-9)


def test_exponents_of_a_hamiltonian_come_in_pairs_and_chaos_is_told() -> None:
    found = load("systems/pendulums/double_pendulum.yaml").derive().lyapunov(until=300)
    largest, *others, smallest = found.exponents
    assert largest > 10 * found.spreads[0]
    assert largest + smallest == pytest.approx(0, abs=0.02)
    assert others == pytest.approx([0, 0], abs=0.05)
    assert found.averages[-1] == pytest.approx(largest, rel=1e-9)


def henon_heiles(t, y):
    """The motion, and one displacement beside it."""
    x, z, u, w, dx, dz, du, dw = y
    return [u, w, -x - 2 * x * z, -z - x * x + z * z, du, dw,
            -(1 + 2 * z) * dx - 2 * x * dz, -2 * x * dx - (1 - 2 * z) * dz]  # fmt: skip


def test_the_largest_exponent_by_another_route() -> None:
    """A chaotic orbit of Hénon and Heiles' at the energy 1/8."""
    start = {"x": 0.0, "y": -0.25, "dot(x)": 0.0, "dot(y)": 0.0}
    # The speed along x follows from the energy.
    potential = 0.25**2 / 2 + 0.25**3 / 3
    start["dot(x)"] = float(np.sqrt(2 * (1 / 8 - potential)))
    found = load("systems/oscillators/henon_heiles.yaml", initial=start).derive()
    ours = found.lyapunov(until=2000, accuracy=1e-9)
    y = np.array([*start.values(), 1, 0, 0, 0], dtype=float)
    total = 0.0
    for _ in range(200):
        y = solve_ivp(henon_heiles, (0, 10), y, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        length = np.linalg.norm(y[4:])
        total, y[4:] = total + np.log(length), y[4:] / length
    assert ours.exponents[0] == pytest.approx(total / 2000, abs=6 * ours.spreads[0] + 0.005)
    assert ours.exponents[0] > 0.02


def test_what_has_no_exponents() -> None:
    with pytest.raises(InputError, match="jumps"):
        load("systems/contact/bouncing_ball.yaml").derive().lyapunov(until=1)
    with pytest.raises(InputError, match="not after the start"):
        load("systems/pendulums/pendulum.yaml").derive().lyapunov(until=0)


def test_a_parameter_without_a_value_is_named() -> None:
    scene = """
    parameters: {k: {}}
    coordinates: [x]
    kinetic: {T: dot(x)^2/2}
    potentials: {V: k*x^4}
    initial: {x: 1}
    """
    with pytest.raises(InputError, match="no value for 'k'"):
        loads(scene).derive().lyapunov(until=1.0)
