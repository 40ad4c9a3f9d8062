"""The textbook form: the lecture's own equations, and which factors may be divided out."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_file
from tests.mechanics.mechanics_support import DOUBLE_PENDULUM, POLAR, derived, expression

SYSTEMS = Path(__file__).parents[3] / "systems"


def shipped(name: str) -> Equations:
    return derive(read_file(str(SYSTEMS / f"{name}.yaml")))


def equals(found: sp.Expr, e: Equations, text: str) -> bool:
    """Equal up to the order of terms, not up to factors."""
    return sp.expand(found - interpret(e, expression(text))) == 0


@pytest.mark.parametrize(
    ("name", "residuals"),
    [
        (
            "lecture/bead_on_parabola",
            ["(1 + 4*a^2*x^2)*ddot(x) + 4*a^2*x*dot(x)^2 + 2*a*g*x"],
        ),
        (
            "lecture/masses_through_hole",
            ["(M + m)*ddot(r) - M*r*dot(theta)^2 + m*g"],
        ),
        ("pendulums/pendulum", ["l*ddot(theta) + g*sin(theta)"]),
    ],
)
def test_the_lectures_equations(name: str, residuals: list[str]) -> None:
    e = shipped(name)
    for equation, expected in zip(e.derivation.shown, residuals, strict=False):
        assert equals(equation.residual, e, expected)


def test_a_conservation_law_is_left_whole_unless_expect_divides() -> None:
    """As printed: M r² θ̈ + 2 M r ṙ θ̇ = 0, which is ṗ = 0."""
    text = POLAR + "potentials: {spring: k*r^2/2}\n"
    e = derived(text)
    assert equals(e.derivation.shown[1].residual, e, "m*r^2*ddot(theta) + 2*m*r*dot(r)*dot(theta)")
    assert e.derivation.shown[1].divided_by == 1


def test_energies_of_the_lecture() -> None:
    e = shipped("lecture/bead_on_parabola")
    assert equals(e.system.kinetic, e, "m*dot(x)^2*(1 + 4*a^2*x^2)/2")
    assert equals(e.system.potential, e, "m*g*a*x^2")
    e = shipped("lecture/masses_through_hole")
    assert equals(e.system.kinetic, e, "M*(dot(r)^2 + r^2*dot(theta)^2)/2 + m*dot(r)^2/2")
    assert equals(e.system.potential, e, "m*g*(r - l)")
    assert equals(
        e.system.lagrangian, e, "M*(dot(r)^2+r^2*dot(theta)^2)/2 + m*dot(r)^2/2 + m*g*(l - r)"
    )


def test_the_double_pendulum_has_no_sines_squared() -> None:
    e = derived(DOUBLE_PENDULUM)
    assert equals(
        e.derivation.shown[0].residual,
        e,
        "(m1 + m2)*l1*ddot(theta1) + m2*l2*ddot(theta2)*cos(theta1 - theta2)"
        " + m2*l2*dot(theta2)^2*sin(theta1 - theta2) + (m1 + m2)*g*sin(theta1)",
    )
    assert equals(
        e.derivation.shown[1].residual,
        e,
        "l2*ddot(theta2) + l1*ddot(theta1)*cos(theta1 - theta2)"
        " - l1*dot(theta1)^2*sin(theta1 - theta2) + g*sin(theta2)",
    )
    assert [str(s.divided_by) for s in e.derivation.shown] == ["l1", "l2*m2"]


ONE = "particles: {bead: {mass: m, position: [x, 0, 0]}}\ncoordinates: [x]\n"


@pytest.mark.parametrize(
    ("parameters", "potential", "divided", "residual"),
    [
        # A mass goes; a positive parameter goes; a sign that is unknown stays.
        ("m: 2, g: 9.81", "m*g*x", "m", "ddot(x) + g"),
        ("m: 2, k: 3", "k*x^2/2", "1", "m*ddot(x) + k*x"),
        ("m: {value: 2, positive: true}, c: 3", "m*c*sin(x)", "m", "ddot(x) + c*cos(x)"),
        ("m: 2", "m^2*x", "m", "ddot(x) + m"),
        ("m: 2", "-3*m*x", "m", "ddot(x) - 3"),
    ],
)
def test_masses_are_divided_out(
    parameters: str, potential: str, divided: str, residual: str
) -> None:
    e = derived(f"parameters: {{{parameters}}}\n" + ONE + f"potentials: {{v: {potential}}}")
    assert str(e.derivation.shown[0].divided_by) == divided
    assert equals(e.derivation.shown[0].residual, e, residual)


def stretched(parameter: str) -> Equations:
    return derived(
        f"parameters: {{m: 1, g: 9.81, l: {parameter}}}\nplane: xz\n"
        "particles: {bob: {mass: m, position: [x, y, z]}}\ncoordinates: [q]\n"
        "definitions: {x: l*sin(q), z: -l*cos(q)}\npotentials: {w: {gravity: g}}"
    )


@pytest.mark.parametrize("length", ["{value: 2, positive: true}", "2", "-2"])
def test_a_parameter_of_the_accelerations_is_divided_out(length) -> None:
    e = stretched(length)
    assert equals(e.derivation.shown[0].residual, e, "l*ddot(q) + g*sin(q)")


def test_a_factor_that_vanishes_at_times_is_divided_out() -> None:
    e = derived(
        "coordinates: [q]\nkinetic: {T: (1 - t)^2*dot(q)^2/2}\npotentials: {V: (t - 1)*q^2}\n"
    )
    assert equals(e.derivation.shown[0].residual, e, "(t - 1)*ddot(q) + 2*dot(q) + 2*q")


def test_numbers_are_divided_out() -> None:
    e = derived("coordinates: [x]\nkinetic: {T: 3*dot(x)^2}\npotentials: {V: 6*x^2 + 12*x}\n")
    assert e.derivation.shown[0].divided_by == 6
    assert equals(e.derivation.shown[0].residual, e, "ddot(x) + 2*x + 2")


FALL = POLAR + "potentials: {spring: k*r^2/2}\nforces: {turn: {on: theta, force: m*r*cos(theta)}}\n"


def test_a_coordinate_is_divided_out_only_where_expect_writes_it_so() -> None:
    e = derived(FALL)
    assert equals(
        e.derivation.shown[1].residual, e, "r^2*ddot(theta) + 2*r*dot(r)*dot(theta) - r*cos(theta)"
    )
    asked = "expect: {equations: ['r*ddot(theta) + 2*dot(r)*dot(theta) - cos(theta) = 0']}"
    e = derived(FALL + asked)
    assert equals(
        e.derivation.shown[1].residual, e, "r*ddot(theta) + 2*dot(r)*dot(theta) - cos(theta)"
    )
    assert {s.name for s in e.derivation.shown[1].divided_by.free_symbols} == {"m", "r"}
    unrelated = "expect: {equations: ['r*ddot(theta) + 2*dot(r)*dot(theta) - 7*cos(theta) = 0']}"
    e = derived(FALL + unrelated)
    assert {s.name for s in e.derivation.shown[1].divided_by.free_symbols} == {"m"}


def test_matrices_are_never_scaled() -> None:
    e = derived(FALL)
    m, r = (sp.Symbol("m", positive=True), e.system.coordinates[0].q)
    assert sp.expand(e.system.mass_matrix[1][1] - m * r**2) == 0


@pytest.mark.parametrize("text", [DOUBLE_PENDULUM, FALL, POLAR + "potentials: {v: k*r}"])
def test_terms_come_by_acceleration_velocity_and_place(text: str) -> None:
    e = derived(text)
    accelerations = [c.a for c in e.system.coordinates]
    velocities = {c.v for c in e.system.coordinates}
    for equation in e.derivation.shown:
        kinds = []
        for coefficient, factor in equation.terms:
            assert coefficient != 0
            assert not coefficient.free_symbols & set(accelerations)
            kinds.append(
                0 if factor in accelerations else 1 if factor.free_symbols & velocities else 2
            )
        assert kinds == sorted(kinds)
        assert kinds[0] == 0


def test_every_shown_equation_is_the_derived_one() -> None:
    for text in (DOUBLE_PENDULUM, FALL):
        e = derived(text)
        for j, equation in enumerate(e.derivation.shown):
            inertia = sp.Add(
                *(
                    x * c.a
                    for x, c in zip(e.system.mass_matrix[j], e.system.coordinates, strict=True)
                )
            )
            whole = inertia - e.system.forcing[j]
            assert sp.expand(equation.residual * equation.divided_by - whole) == 0


@pytest.mark.parametrize(
    ("scene", "kinetic", "first", "divided"),
    [
        # A fraction stays where the inertia has none.
        ("fields/penning_trap", "m*", "m", False),
        ("oscillators/wilberforce_pendulum", "*m/2", "m", False),
        # Squares of differences stand one way round, and are not multiplied out.
        ("rigid/rolling_cylinder", "3*dot(phi)**2*m*(R - a)**2/4", "3*(R - a)", True),
        # cosh² − sinh² = 1, without a difference that loses digits.
        ("celestial/two_centres", "(sin(eta)**2 + sinh(xi)**2)", "c**2*(sin(eta)**2 +", False),
        # A square of two terms is seen with functions in it.
        ("surfaces/particle_on_torus", "(R + a*cos(theta))**2", "a", True),
    ],
)
def test_numbers_and_squares_as_in_a_textbook(
    scene: str, kinetic: str, first: str, divided: bool
) -> None:
    e = derive(read_file(str(SYSTEMS / f"{scene}.yaml")))
    assert kinetic in str(e.system.kinetic)
    assert str(e.derivation.shown[0].terms[0][0]).startswith(first)
    assert (e.derivation.shown[0].divided_by != 1) == divided


def test_forces_that_are_no_polynomials_keep_their_velocities() -> None:
    e = derived(
        """
parameters: {m: 1.5, u: 0.5}
coordinates: [y]
particles: {b: {mass: m, position: [0, y, 0]}}
dissipation: {drag: "u*max(0, 1 - abs((dot(y) - 7.5)/1e-9))"}
"""
    )
    (equation,) = e.derivation.shown
    (c,) = e.system.coordinates
    whole = e.system.mass_matrix[0][0] * c.a - e.system.forcing[0]
    assert (equation.residual * equation.divided_by).free_symbols == whole.free_symbols
    at = {
        c.a: 2,
        c.v: sp.Rational(15, 2) + sp.Rational(1, 10**10),
        **{p.symbol: p.value for p in e.system.parameters},
    }
    shown = (equation.residual * equation.divided_by).subs(at)
    assert shown == whole.subs(at)
