"""T + V beside Jacobi's integral, and what energies are lost to: against motions in closed form."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli import load, loads
from lagrange_cli.analysis.symmetries.conserved_quantities import energy_loss, energy_sum
from tests.systems.shipped import SYSTEMS


def shipped(name):
    return load(SYSTEMS / f"{name}.yaml").derive()


def written(text):
    return loads(text, file="it.yaml").derive()


#: A free body in polar coordinates whose axis turns: h = T2 - T0, and T is conserved as well.
TURNING = """
parameters: {m: 2, omega: 3}
particles: {p: {mass: m, position: [x, y, 0]}}
coordinates: [r, phi]
definitions: {x: r*cos(phi + omega*t), y: r*sin(phi + omega*t)}
initial: {r: 1, phi: 0.2, dot(r): 0.1, dot(phi): 0.3}
simulate: {until: 1}
"""

#: A free body seen from an accelerated frame: L depends on t, yet T is conserved.
ACCELERATED = """
parameters: {m: 2, a: 3}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [q]
definitions: {x: q + a*t^2/2}
initial: {q: 1, dot(q): 0.2}
simulate: {until: 1}
"""


def test_a_hoop_that_is_turned_does_work():
    equations = shipped("beads/bead_on_rotating_hoop").equations
    found = energy_sum(equations)
    assert (found.conserved, found.with_jacobi) == (False, True)
    (bead,) = equations.system.coordinates
    symbols = {p.name: p.symbol for p in equations.system.parameters}
    m, radius, omega = (symbols[name] for name in ("m", "R", "omega"))
    torque = 2 * m * radius**2 * omega * sp.sin(bead.q) * sp.cos(bead.q) * bead.v
    # The motor's power is its rate times the rate of the angular momentum about the axis.
    assert sp.simplify(found.rate - torque * omega) == 0
    turned = 2 * (m * radius**2 * omega**2 * sp.sin(bead.q) ** 2 / 2)
    assert sp.simplify(found.difference - turned) == 0


def along(derivation, value):
    """The values of T + V at the samples of a motion."""
    equations = derivation.equations
    motion = derivation.simulate(accuracy=1e-10, samples=21)
    known = {p.symbol: p.value for p in equations.system.parameters}
    for k, t in enumerate(motion.t):
        state = known | {equations.system.t: t}
        for c in equations.system.coordinates:
            state[c.q] = motion.columns[c.name][k]
            state[c.v] = motion.columns[f"dot({c.name})"][k]
        yield float(value.subs(state))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "with_jacobi"),
    [(TURNING, True), (ACCELERATED, False)],
    ids=["turning", "accelerated"],
)
def test_both_or_the_sum_alone_may_be_conserved(text, with_jacobi):
    derivation = written(text)
    equations = derivation.equations
    found = energy_sum(equations)
    assert (found.conserved, found.with_jacobi) == (True, with_jacobi)
    kinds = {c.kind for c in equations.derivation.conserved}
    assert ("jacobi" in kinds) == with_jacobi
    kinetic = [*along(derivation, equations.system.kinetic)]
    assert kinetic == pytest.approx([kinetic[0]] * 21, rel=1e-8)
    assert equations.system.potential == 0


@pytest.mark.slow
def test_a_body_on_a_turning_table_under_a_spring_keeps_only_the_integral():
    """With a spring to a point of the table, T + V is not conserved, as a motion shows."""
    derivation = written(
        TURNING.replace(
            "initial:", "potentials: {spring: 5*(r*cos(phi) - 1)^2 + 5*r^2*sin(phi)^2}\ninitial:"
        )
    )
    assert energy_sum(derivation.equations).conserved is False
    values = [
        *along(
            derivation, derivation.equations.system.kinetic + derivation.equations.system.potential
        )
    ]
    assert max(values) - min(values) > 0.1 * max(map(abs, values))


@pytest.mark.parametrize(
    "name",
    [
        "pendulums/pendulum",
        "fields/charged_particle",
        "fields/relativistic_particle",
        "pendulums/damped_driven_pendulum",
        "lecture/pendulum_driven_support",
    ],
)
def test_where_the_sum_is_the_integral_or_neither_is_kept_nothing_is_said(name):
    assert energy_sum(shipped(name).equations) is None


def test_losses_are_named():
    driven = energy_loss(shipped("pendulums/damped_driven_pendulum").equations)
    assert (driven.friction, driven.forces, driven.depends_on_time) == (True, ("drive",), False)
    moved = energy_loss(shipped("lecture/pendulum_driven_support").equations)
    assert (moved.depends_on_time, moved.friction, moved.forces) == (True, False, ())
    assert energy_loss(shipped("oscillators/driven_spring").equations).inputs == ("u",)
    assert energy_loss(shipped("pendulums/pendulum").equations) is None
    # A force across the motion does no work.
    across = written("""
        particles: {p: {mass: 1, position: [x, y, 0]}}
        coordinates: [x, y]
        forces: {turn: {on: p, force: [dot(y), -dot(x), 0]}, push: {on: p, force: [1, 0, 0]}}
        dissipation: {drag: dot(x)^2}
    """)
    assert energy_loss(across.equations).forces == ("push",)


def test_constraints_that_move_are_named():
    text = """
        parameters: {l: 1, A: 0.1, w: 2}
        particles: {p: {mass: 1, position: [x, y, 0]}}
        constraints: {rod: x^2 + (y - A*cos(w*t))^2 = l^2}
        potentials: {weight: 9.81*y}
        initial: {x: 0, dot(x): 1}
        near: {y: -0.9}
    """
    held = loads(text, file="it.yaml").derive(formulation="multiplier").equations
    assert energy_loss(held).moving == ("rod",)


def test_text_and_documents_say_it():
    hoop = shipped("beads/bead_on_rotating_hoop")
    for text in (hoop.text(), hoop.analyze("symmetries").text()):
        assert "T + V - h = m R² ω² sin²θ\n" in text
        assert "not conserved: the prescribed motion does work" in text
        assert "d(T + V)/dt = 2 m R² ω² θ̇ sin θ cos θ" in text
    (document,) = hoop.emit("latex").values()
    assert r"T + V - h & = m R^{2} \omega^{2} \sin^{2} \theta" in document
    both = written(TURNING).text()
    assert "conserved too" in both
    assert "not conserved: friction takes energy; the force drive does work" in (
        shipped("pendulums/damped_driven_pendulum").text()
    )
    rotors = shipped("bodies/planar_quadrotor").text()
    assert "not conserved: the forces first, second do work" in rotors
