"""Implicit closures: what stays beside the coordinates, and the motion they force.

Accelerations of the multiplier form are compared with those of minimal forms and with
formulas of textbooks, at random feasible states.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping

import mpmath
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import Mark
from lagrange_cli.mechanics import interpret
from lagrange_cli.scene.language.families import read_expression
from tests.mechanics.closures_support import (
    FLAT,
    FOUR_BAR,
    FOUR_BAR_OF_RODS,
    PENDULUM,
    SLIDER_CRANK,
    close,
    holds,
    solved,
    state_of,
)
from tests.mechanics.mechanics_support import derived


@pytest.fixture(autouse=True)
def _precise() -> Iterator[None]:
    with mpmath.workdps(40):
        yield


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("declared", ["", "coordinates: [x, z]\n"])
def test_pendulum_in_cartesian_names(seed: int, declared: str) -> None:
    """The angle form: l θ̈ = −g sin θ, at any angle; tension m g cos θ + m l θ̇²."""
    e = derived(PENDULUM + declared)
    assert e.system.formulation == "multiplier"
    assert (e.derivation.account.dof, e.derivation.account.constraints) == (1, 2)
    draw = random.Random(seed)
    theta, omega = mpf(draw.uniform(-9, 9)), mpf(draw.uniform(-3, 3))
    m, length, g = mpf(2), mpf(3), mpf("9.81")
    s, c = mpmath.sin(theta), mpmath.cos(theta)
    state = state_of(e, x=length * s, z=-length * c, v_x=length * c * omega, v_z=length * s * omega)
    holds(e, state)
    a, multipliers = solved(e, state)
    alpha = -g / length * s
    assert close(a["x"], length * (c * alpha - s * omega**2))
    assert close(a["z"], length * (s * alpha + c * omega**2))
    # λ ∇φ is the force of the rod: along −r with the tension.
    tension = m * g * c + m * length * omega**2
    assert close(multipliers["rod"] * 2 * length, -tension)


def four_bar_state(seed: int) -> dict[str, mpf]:
    """Angles of a four-bar by the circle intersection, rates from the loop's derivative."""
    draw = random.Random(seed)
    a, b, c, d = 1, 3, 2, 3
    alpha, rate = mpf(draw.uniform(-3, 3)), mpf(draw.uniform(-2, 2))
    dx, dz = d - a * mpmath.cos(alpha), -a * mpmath.sin(alpha)
    r2 = dx**2 + dz**2
    r = mpmath.sqrt(r2)
    beta = mpmath.atan2(dz, dx) + mpmath.acos((b**2 + r2 - c**2) / (2 * b * r))
    xb, zb = (
        a * mpmath.cos(alpha) + b * mpmath.cos(beta),
        a * mpmath.sin(alpha) + b * mpmath.sin(beta),
    )
    gamma = mpmath.atan2(zb, xb - d)
    loop = mpmath.matrix(
        [
            [-b * mpmath.sin(beta), c * mpmath.sin(gamma)],
            [b * mpmath.cos(beta), -c * mpmath.cos(gamma)],
        ]
    )
    right = mpmath.matrix([a * mpmath.sin(alpha) * rate, -a * mpmath.cos(alpha) * rate])
    rates = mpmath.lu_solve(loop, right)
    return {
        "alpha": alpha,
        "beta": beta,
        "gamma": gamma,
        "v_alpha": rate,
        "v_beta": rates[0],
        "v_gamma": rates[1],
        "xa": a * mpmath.cos(alpha),
        "za": a * mpmath.sin(alpha),
        "xb": xb,
        "zb": zb,
        "v_xa": -a * mpmath.sin(alpha) * rate,
        "v_za": a * mpmath.cos(alpha) * rate,
        "v_xb": -c * mpmath.sin(gamma) * rates[1],
        "v_zb": c * mpmath.cos(gamma) * rates[1],
    }


def reduced_four_bar(at: Mapping[str, mpf]) -> mpf:
    """α̈ from the one-dimensional Lagrangian ½ I(α) α̇² − V(α), by numerical derivatives."""
    a, b, c, d, g = 1, 3, 2, 3, mpf("9.81")

    def loop(alpha: mpf) -> tuple[mpf, mpf]:
        dx, dz = d - a * mpmath.cos(alpha), -a * mpmath.sin(alpha)
        r2 = dx**2 + dz**2
        beta = mpmath.atan2(dz, dx) + mpmath.acos((b**2 + r2 - c**2) / (2 * b * mpmath.sqrt(r2)))
        return (
            a * mpmath.cos(alpha) + b * mpmath.cos(beta),
            a * mpmath.sin(alpha) + b * mpmath.sin(beta),
        )

    def inertia(alpha: mpf) -> mpf:
        x = mpmath.diff(lambda s: loop(s)[0], alpha)
        z = mpmath.diff(lambda s: loop(s)[1], alpha)
        return a**2 + 2 * (x**2 + z**2)

    def potential(alpha: mpf) -> mpf:
        return g * (a * mpmath.sin(alpha) + 2 * loop(alpha)[1])

    alpha, rate = at["alpha"], at["v_alpha"]
    slope, force = mpmath.diff(inertia, alpha), mpmath.diff(potential, alpha)
    return -(slope * rate**2 / 2 + force) / inertia(alpha)


@pytest.mark.slow
@pytest.mark.parametrize("text", [FOUR_BAR, FOUR_BAR_OF_RODS])
@pytest.mark.parametrize("seed", range(3))
def test_four_bar_linkage(text: str, seed: int) -> None:
    """Three angles with a loop, or four Cartesian names with three rods: the same motion."""
    e = derived(text)
    assert e.derivation.account.dof == 1
    at = four_bar_state(seed)
    state = state_of(e, **at)
    holds(e, state)
    a, _ = solved(e, state)
    expected = reduced_four_bar(at)
    if "alpha" in a:
        assert abs(a["alpha"] - expected) < 1e-12 * (1 + abs(expected))
        return
    # d²/dt² of (cos α, sin α)
    normal = -mpmath.sin(at["alpha"]) * a["xa"] + mpmath.cos(at["alpha"]) * a["za"]
    assert abs(normal - expected) < 1e-12 * (1 + abs(expected))


@pytest.mark.slow
def test_accounts_of_the_four_bar() -> None:
    """An angle of a massless link counts to E."""
    angles, rods = derived(FOUR_BAR), derived(FOUR_BAR_OF_RODS)
    assert (angles.derivation.account.cartesian, angles.derivation.account.extra) == (6, 1)
    assert angles.derivation.account.constraints == rods.derivation.account.constraints + 1 == 6
    assert [c.name for c in angles.system.closures] == ["loop_1", "loop_2"]
    assert rods.system.multipliers == ("crank", "coupler", "rocker")
    assert all(c.is_angle for c in angles.system.coordinates)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_slider_crank(seed: int) -> None:
    """Against the minimal form in the crank's angle, whose piston stands on a root."""
    e = derived(SLIDER_CRANK)
    minimal = derived(
        "parameters: {m: 1, M: 4, r: 1, l: 3, g: 9.81}\nparticles:\n"
        "  pin: {mass: m, position: [r*cos(q), 0, r*sin(q)]}\n"
        "  piston: {mass: M, position: ['r*cos(q) + sqrt(l^2 - r^2*sin(q)^2)', 0, 0]}\n"
        "coordinates: [q]\npotentials: {weight: {gravity: g}}"
    )
    assert (e.derivation.account.dof, len(e.system.closures), minimal.system.formulation) == (
        1,
        2,
        "minimal",
    )
    draw = random.Random(seed)
    q, w = mpf(draw.uniform(-9, 9)), mpf(draw.uniform(-3, 3))
    s, c = mpmath.sin(q), mpmath.cos(q)
    root = mpmath.sqrt(9 - s**2)
    place = {"xp": c, "zp": s, "s": c + root}
    rates = {"v_xp": -s * w, "v_zp": c * w, "v_s": (-s - s * c / root) * w}
    state = state_of(e, **place, **rates)
    holds(e, state)
    a, _ = solved(e, state)
    expected, _ = solved(minimal, state_of(minimal, q=q, v_q=w))
    assert close(a["zp"] * c - a["xp"] * s, expected["q"])


@pytest.mark.parametrize(
    ("curve", "x", "z"),
    [
        ("x^3 + z^3 = 3*x*z", lambda p: 3 * p / (1 + p**3), lambda p: 3 * p**2 / (1 + p**3)),
        (
            "(x^2 + z^2)^2 = x^2 - z^2",
            lambda p: mpmath.cos(p) / (1 + mpmath.sin(p) ** 2),
            lambda p: mpmath.sin(p) * mpmath.cos(p) / (1 + mpmath.sin(p) ** 2),
        ),
    ],
)
def test_a_bead_on_a_curve(curve: str, x: Callable[[mpf], mpf], z: Callable[[mpf], mpf]) -> None:
    """Folium and lemniscate against their parametrizations: ½ (x'² + z'²) ṗ² − g z."""
    text = f"parameters: {{m: 1, g: 9.81}}\n{FLAT}constraints: {{wire: '{curve}'}}\n"
    e = derived(text + "potentials: {weight: m*g*z}")
    p, w, g = mpf("0.7"), mpf("1.3"), mpf("9.81")
    x1, z1 = mpmath.diff(x, p), mpmath.diff(z, p)
    x2, z2 = mpmath.diff(x, p, 2), mpmath.diff(z, p, 2)
    state = state_of(e, x=x(p), z=z(p), v_x=x1 * w, v_z=z1 * w)
    a, _ = solved(e, state)
    rate = -((x1 * x2 + z1 * z2) * w**2 + g * z1) / (x1**2 + z1**2)
    assert abs(a["x"] - (x1 * rate + x2 * w**2)) < 1e-15
    assert abs(a["z"] - (z1 * rate + z2 * w**2)) < 1e-15


def test_a_moving_closure() -> None:
    """A pendulum whose support shakes: energy is not conserved, the closure has a rate."""
    text = PENDULUM.replace("x^2 + z^2", "(x - sin(3*t))^2 + z^2")
    e = derived(text)
    assert e.derivation.conserved == ()
    assert e.derivation.facts.rheonomic
    assert not e.derivation.facts.autonomous
    (closure,) = e.system.closures
    assert closure.rate != 0
    length, g, t, theta, omega = mpf(3), mpf("9.81"), mpf("0.4"), mpf("0.9"), mpf("-1.1")
    s, c = mpmath.sin(theta), mpmath.cos(theta)
    support, moves, pushed = mpmath.sin(3 * t), 3 * mpmath.cos(3 * t), -9 * mpmath.sin(3 * t)
    state = state_of(
        e,
        t=t,
        x=support + length * s,
        z=-length * c,
        v_x=moves + length * c * omega,
        v_z=length * s * omega,
    )
    holds(e, state)
    a, _ = solved(e, state)
    alpha = -(g * s + pushed * c) / length
    assert close(a["x"], pushed + length * (c * alpha - s * omega**2))
    assert close(a["z"], length * (s * alpha + c * omega**2))


def test_momenta_that_closures_leave_alone() -> None:
    """Two bodies on a rod on a table: neither x is cyclic for the motion, energy stays."""
    e = derived(
        "plane: xz\nparticles:\n  a: {mass: 1, position: [x1, y1, z1]}\n"
        "  b: {mass: 1, position: [x2, y2, z2]}\n  c: {mass: 1, position: [x3, y3, z3]}\n"
        "constraints: {rod: {distance: [a, b], equals: 2}}\npotentials: {v: z3}"
    )
    assert e.derivation.cyclic == ("x3",)
    assert [c.name for c in e.derivation.conserved] == ["p_x3", "energy"]


def test_facts_of_the_multiplier_form() -> None:
    e = derived(FOUR_BAR)
    assert not e.derivation.facts.positive_definite_mass_matrix  # gamma has no inertia
    assert not e.derivation.facts.separable
    assert derived(PENDULUM).derivation.facts.positive_definite_mass_matrix
    assert derived(PENDULUM).derivation.facts.constant_mass_matrix


def test_shown_equations_have_multipliers() -> None:
    e = derived(PENDULUM)
    (closure,) = e.system.closures
    assert closure.multiplier.name == "lambda_rod"
    for shown, gradient, mass, force in zip(
        e.derivation.shown, closure.gradient, e.system.mass_matrix, e.system.forcing, strict=True
    ):
        inertia = sum(m * c.a for m, c in zip(mass, e.system.coordinates, strict=True))
        expected = inertia - force - closure.multiplier * gradient
        assert sp.expand(shown.residual * shown.divided_by - expected) == 0
        assert shown.terms[-1][1] == closure.multiplier


def test_a_multiplier_does_not_take_a_users_name() -> None:
    e = derived(PENDULUM.replace("g: 9.81", "g: 9.81, lambda_rod: 3").replace("= l^2", "= l^2"))
    assert e.system.closures[0].multiplier.name not in {p.name for p in e.system.parameters}


@pytest.mark.parametrize(
    "equation", ["log(x^2 + z^2) = 0", "sin(x^2 + z^2 - 1) = 0", "exp(x)*(x^2 + z^2 - 1) = 0"]
)
def test_a_single_term_that_definitions_make_zero(equation: str) -> None:
    e = derived(
        FLAT + "parameters: {m: 2}\ncoordinates: [q]\ndefinitions: {x: sin(q), z: -cos(q)}\n"
        "constraints: {curve: '" + equation + "'}\n"
    )
    assert (e.derivation.account.dof, e.system.closures) == (1, ())
    assert e.derivation.account.lines[-1].status == "satisfied"


HOOP = (
    "parameters: {m: 1.1, R: 0.8, w: 3, g: 9.81}\n"
    "particles: {bead: {mass: m, position: [x, y, z]}}\n"
    "constraints: {sphere: x^2 + y^2 + z^2 = R^2, turn: x*sin(w*t) - y*cos(w*t) = 0}\n"
    "potentials: {weight: m*g*z}\n"
)


@pytest.mark.parametrize("declared", ["", "coordinates: [x, y, z]\n"])
@pytest.mark.parametrize("turned", ["0", "0.5", "1", "1.25"])
def test_a_turning_plane_is_no_fraction(declared: str, turned: str) -> None:
    """q'' = w² sin q cos q − (g/R) sin q for a bead on a hoop, at every angle of the hoop.

    y = x tan(ω t) would not pass a quarter of a turn.
    """
    e = derived(HOOP + declared)
    assert (e.derivation.account.dof, e.system.multipliers) == (1, ("sphere", "turn"))
    radius, w, q, rate, g = (
        mpf(e.system.parameters[1].value),
        3,
        mpf("0.7"),
        mpf("0.4"),
        mpf("9.81"),
    )
    t = mpf(turned) * mpmath.pi / w
    sin, cos = mpmath.sin(q), mpmath.cos(q)
    r, v_r = radius * sin, radius * cos * rate
    state = state_of(
        e,
        t=t,
        x=r * mpmath.cos(w * t),
        y=r * mpmath.sin(w * t),
        z=-radius * cos,
        v_x=v_r * mpmath.cos(w * t) - r * w * mpmath.sin(w * t),
        v_y=v_r * mpmath.sin(w * t) + r * w * mpmath.cos(w * t),
        v_z=radius * sin * rate,
    )
    acceleration = w**2 * sin * cos - g / radius * sin
    found, _ = solved(e, state)
    expected = radius * (cos * rate**2 + sin * acceleration)
    assert abs(found["z"] - expected) < mpf(10) ** -12


def test_members_of_families_with_several_equations_have_names_to_read_back() -> None:
    """The number stands before the index: ``rail_2[1]`` is a name of the scene language."""
    e = derived(
        "sizes: {n: 2}\nparticles:\n"
        "  p[i=1..n]: {mass: 1, position: ['x[i]', 'y[i]', 'z[i]']}\n"
        "constraints:\n  rail[i=1..n]:\n  - y[i] + y[i]^5 = x[i] + x[i]^7\n"
        "  - z[i] + z[i]^5 = y[i]^3 + x[i] + x[i]^7\n"
        "initial: {'x[i=1..n]': 0, 'y[i=1..n]': 0, 'z[i=1..n]': 0}\n"
    )
    names = [f"rail_{k}[{i}]" for i in (1, 2) for k in (1, 2)]
    assert [c.name for c in e.system.closures] == names
    for closure in e.system.closures:
        text = f"2*{closure.multiplier.name}"
        found = interpret(e, read_expression(text, Mark("report", 1, 1, text)))
        assert found == 2 * closure.multiplier
