"""Coordinates that integrated rates relate, where a minimal form is asked for."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli import loads

PLANET = """
name: planet
parameters: {m: 1, R: 2, a: 0.5, I: 0.1, g: 9.81}
particles: {c: {mass: m, position: [(R + a)*sin(theta), 0, (R + a)*cos(theta)]}}
coordinates: [theta, phi]
kinetic: {spin: I/2*dot(phi)^2}
potentials: {weight: {gravity: g}}
constraints: {rolling: a*dot(phi) = (R + a)*dot(theta)}
"""
START = "initial: {theta: 0.25, phi: 3, dot(theta): 0}\n"


def test_one_of_them_is_eliminated() -> None:
    equations = loads(PLANET + START).derive(formulation="minimal").equations
    assert equations.system.formulation == "minimal"
    assert [c.name for c in equations.system.coordinates] == ["theta"]
    account = equations.derivation.account
    assert (account.extra, account.constraints, account.dof) == (1, 3, 1)
    p = {p.name: p.symbol for p in equations.system.parameters}
    theta = equations.system.coordinates[0].q
    arm = p["R"] + p["a"]
    assert (
        sp.simplify(equations.system.mass_matrix[0][0] - arm**2 * (p["m"] + p["I"] / p["a"] ** 2))
        == 0
    )
    assert sp.simplify(equations.system.forcing[0] - p["m"] * p["g"] * arm * sp.sin(theta)) == 0
    (phi,) = [c.position for c in equations.system.cartesian_names if c.name == "phi"]
    turned = p["a"] * (phi - p["phi_0"]) - arm * (theta - p["theta_0"])
    assert sp.simplify(turned) == 0
    values = {p.name: p.exact for p in equations.system.parameters if p.start_of}
    assert values == {"phi_0": 3, "theta_0": sp.Rational(1, 4)}


@pytest.mark.slow
def test_both_forms_have_the_same_motion() -> None:
    states = [
        loads(PLANET + START).derive(formulation=form).simulate(until=1.0, accuracy=1e-9).state
        for form in ("minimal", "multiplier")
    ]
    for name in ("theta", "phi", "dot(phi)", "x_c"):
        assert abs(states[0][name] - states[1][name]) < 1e-7


@pytest.mark.parametrize(
    ("more", "left"),
    [
        ("", "theta"),
        ("forces: {motor: {on: phi, force: 1}}\n", "phi"),
        ("expect: {state: {t: 1, phi: 1, within: 9}}\n", "phi"),
    ],
)
def test_what_the_scene_asks_for_stays(more: str, left: str) -> None:
    equations = loads(PLANET + START + more).derive(formulation="minimal").equations
    assert [c.name for c in equations.system.coordinates] == [left]


def test_two_wheels_on_one_axle() -> None:
    scene = """
name: axle
parameters: {R: 0.5, m: 2, I: 0.1}
particles: {c: {mass: m, position: [s, 0, 0]}}
coordinates: [s, a, b]
kinetic: {spin: I/2*(dot(a)^2 + dot(b)^2)}
constraints: {left: dot(s) = R*dot(a), right: dot(a) = dot(b)}
initial: {s: 1, a: 2, b: 3}
"""
    equations = loads(scene).derive(formulation="minimal").equations
    assert [c.name for c in equations.system.coordinates] == ["s"]
    p = {p.name: p.symbol for p in equations.system.parameters}
    inertia = p["m"] + 2 * p["I"] / p["R"] ** 2
    assert sp.simplify(equations.system.mass_matrix[0][0] - inertia) == 0
    assert equations.derivation.account.extra == 2
    places = {c.name: c.position for c in equations.system.cartesian_names}
    assert sp.simplify(places["b"] - places["a"] - (p["b_0"] - p["a_0"])) == 0
