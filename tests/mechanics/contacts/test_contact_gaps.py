"""One-sided constraints: gaps with their derivatives, and what is said of them.

Gaps are typed anew and differentiated along functions of time by SymPy; accelerations and
multipliers in contact are compared with angle forms, and with SymPy's LagrangesMethod.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace

import mpmath
import pytest
import sympy as sp
from mpmath import mpf
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.system import Contact
from lagrange_cli.scene import read_text
from tests.mechanics.closures_support import close, state_of
from tests.mechanics.mechanics_support import derived, expression, number, random_point

SPHERE = """
parameters: {m: 2, g: 9.81, R: 3}
plane: xz
particles: {bead: {mass: m, position: [x, y, z]}}
constraints: {sphere: x^2 + z^2 >= R^2}
coordinates: [x, z]
potentials: {weight: {gravity: g}}
"""

DRIVEN = """
parameters: {m: 2, k: 3, A: 0.5, w: 2, e: 0.25}
particles: {puck: {mass: m, position: [r*cos(theta), r*sin(theta), z]}}
coordinates: [r, theta, z]
potentials: {spring: k*r^2/2}
constraints:
  wave: {unilateral: z >= A*sin(w*t - r), restitution: 2*e}
  spiral: r*theta <= exp(z) + t^2
  post: norm(x_puck - 1, y_puck) >= A
"""

LADDER = """
parameters: {m: 3, l: 2, g: 9.81}
plane: xz
particles:
  low: {mass: m/6, position: [x1, y1, z1]}
  mid: {mass: 2*m/3, position: [(x1 + x2)/2, 0, (z1 + z2)/2]}
  top: {mass: m/6, position: [x2, y2, z2]}
constraints: {wall: x1 >= 0, floor: z2 >= 0}
coordinates: [x1, z2, theta]
definitions: {x2: x1 + l*sin(theta), z1: z2 + l*cos(theta)}
potentials: {weight: {gravity: g}}
"""

BALL = """
parameters: {m: 1, g: 9.81, h: 1}
plane: xz
particles: {ball: {mass: m, position: [x, y, z]}}
constraints: {floor: z >= 0}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: h}
"""


@pytest.fixture(autouse=True)
def _precise() -> Iterator[None]:
    with mpmath.workdps(40):
        yield


def one(e: Equations, name: str) -> Contact:
    (found,) = (c for c in e.system.contacts if c.name == name)
    return found


def along(e: Equations, typed: Callable[[SimpleNamespace], sp.Expr]) -> list[sp.Expr]:
    """φ, ∂φ/∂q, φ̇ − Σ ∂φ/∂q v and φ̈ − Σ ∂φ/∂q a of a gap typed over names and t."""
    moving = {c.name: sp.Function(c.name, real=True)(e.system.t) for c in e.system.coordinates}
    parameters = {p.name: p.symbol for p in e.system.parameters}
    phi = typed(SimpleNamespace(**moving, **parameters, t=e.system.t))
    back = [(moving[c.name].diff(e.system.t, 2), c.a) for c in e.system.coordinates]
    back += [(moving[c.name].diff(e.system.t), c.v) for c in e.system.coordinates]
    back += [(moving[c.name], c.q) for c in e.system.coordinates]
    level, first, second = (
        x.subs(back) for x in (phi, phi.diff(e.system.t), phi.diff(e.system.t, 2))
    )
    still = {c.a: 0 for c in e.system.coordinates}
    at_rest = {c.v: 0 for c in e.system.coordinates}
    gradient = [level.diff(c.q) for c in e.system.coordinates]
    return [level, *gradient, first.subs(at_rest), second.subs(still)]


GAPS: dict[str, tuple[str, Callable[[SimpleNamespace], sp.Expr]]] = {
    "sphere": (SPHERE, lambda n: n.x**2 + n.z**2 - n.R**2),
    "wave": (DRIVEN, lambda n: n.z - n.A * sp.sin(n.w * n.t - n.r)),
    "spiral": (DRIVEN, lambda n: sp.exp(n.z) + n.t**2 - n.r * n.theta),
    "post": (
        DRIVEN,
        lambda n: sp.sqrt((n.r * sp.cos(n.theta) - 1) ** 2 + (n.r * sp.sin(n.theta)) ** 2) - n.A,
    ),
    "floor": (LADDER, lambda n: n.z2),
    "wall": (LADDER, lambda n: n.x1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", GAPS)
def test_gap_with_its_derivatives(name: str) -> None:
    text, typed = GAPS[name]
    e = derived(text)
    closure = one(e, name).closure
    assert closure.kind == "position"
    held = [closure.gradient[j] for j in range(len(e.system.coordinates))]
    ours = [closure.expression, *held, closure.rate, closure.bias]
    symbols = [e.system.t, *(s for c in e.system.coordinates for s in (c.q, c.v))]
    symbols += [p.symbol for p in e.system.parameters]
    for seed in range(4):
        state = random_point(symbols, seed)
        for found, expected in zip(ours, along(e, typed), strict=True):
            assert close(number(found, state), number(expected, state))


def pushed(e: Equations, closed: list[str], state: Mapping[sp.Symbol, mpf]) -> dict[str, mpf]:
    """a and λ of M a = f + Σ λ·gradient with gradient·a = −bias, for the contacts closed."""
    rows = [one(e, name).closure for name in closed]
    n, m = len(e.system.coordinates), len(rows)
    matrix, right = mpmath.zeros(n + m), mpmath.zeros(n + m, 1)
    for i in range(n):
        right[i] = number(e.system.forcing[i], state)
        for j in range(n):
            matrix[i, j] = number(e.system.mass_matrix[i][j], state)
    for k, closure in enumerate(rows):
        right[n + k] = -number(closure.bias, state)
        for i in range(n):
            matrix[n + k, i] = number(closure.gradient[i], state)
            matrix[i, n + k] = -matrix[n + k, i]
    found = mpmath.lu_solve(matrix, right)
    names = [*(c.name for c in e.system.coordinates), *closed]
    return {name: found[i] for i, name in enumerate(names)}


@pytest.mark.parametrize(("angle", "speed"), [(0.1, 0.5), (1.2, 2.0), (2.0, -1.0)])
def test_push_of_a_sphere(angle: float, speed: float) -> None:
    """In contact R θ̈ = g sin θ; the normal force is m g cos θ − m R θ̇²."""
    e = derived(SPHERE)
    m, length, g = mpf(2), mpf(3), mpf("9.81")
    s, c = mpmath.sin(angle), mpmath.cos(angle)
    rates = {"v_x": length * c * speed, "v_z": -length * s * speed}
    found = pushed(e, ["sphere"], state_of(e, x=length * s, z=length * c, **rates))
    alpha = g / length * s
    assert close(found["x"], length * (c * alpha - s * speed**2))
    assert close(found["z"], length * (-s * alpha - c * speed**2))
    assert close(found["sphere"] * 2 * length, m * g * c - m * length * speed**2)


@pytest.mark.slow
@pytest.mark.parametrize("closed", [["wall"], ["floor"], ["wall", "floor"]])
def test_ladder_as_lagranges_method_has_it(closed: list[str]) -> None:
    e = derived(LADDER)
    m, length, g = 3, 2, sp.Rational("9.81")
    x, z, theta = dynamicsymbols("x z theta")
    t = dynamicsymbols._t
    # A rod of mass m about its middle, which moves as the two ends do.
    cx, cz = x + length * sp.sin(theta) / 2, z + length * sp.cos(theta) / 2
    inertia = sp.Rational(m * length**2, 12)
    kinetic = sp.Rational(m, 2) * (cx.diff(t) ** 2 + cz.diff(t) ** 2)
    lagrangian = kinetic + inertia * theta.diff(t) ** 2 / 2 - m * g * cz
    typed = {"wall": x, "floor": z}
    method = LagrangesMethod(lagrangian, [x, z, theta], hol_coneqs=[typed[name] for name in closed])
    method.form_lagranges_equations()
    values = [(x.diff(t), 0.4), (z.diff(t), -0.6), (theta.diff(t), 1.1)]
    values += [(x, 0.3), (z, 0.2), (theta, 0.7)]
    whole, right = method.mass_matrix_full.subs(values), method.forcing_full.subs(values)
    theirs = whole.LUsolve(right)[3:]
    state = state_of(e, x1=0.3, z2=0.2, theta=0.7, v_x1=0.4, v_z2=-0.6, v_theta=1.1)
    ours = pushed(e, closed, state)
    for name, expected in zip(["x1", "z2", "theta"], theirs[:3], strict=True):
        assert abs(ours[name] - mpf(float(expected))) < 1e-11
    # Its multipliers have the other sign: they stand on the left.
    for name, expected in zip(closed, theirs[3:], strict=True):
        assert abs(abs(ours[name]) - abs(mpf(float(expected)))) < 1e-11


def test_equations_hold_the_forces_of_contacts() -> None:
    e = derived(SPHERE)
    assert (e.system.formulation, e.system.multipliers, e.system.closures) == (
        "multiplier",
        ("sphere",),
        (),
    )
    by = {c.name: c for c in e.system.coordinates}
    names = {p.name: p.symbol for p in e.system.parameters}
    push = one(e, "sphere").closure.multiplier
    assert push.name == "lambda_sphere"
    x, z = by["x"], by["z"]
    residuals = [s.residual for s in e.derivation.shown]
    assert sp.expand(residuals[0] - (names["m"] * x.a - 2 * push * x.q)) == 0
    weight = names["m"] * names["g"]
    assert sp.expand(residuals[1] - (names["m"] * z.a + weight - 2 * push * z.q)) == 0


def test_account_lists_them_beside_what_is_counted() -> None:
    account = derived(DRIVEN).derivation.account
    assert (account.constraints, account.dof, account.unilateral) == (0, 3, 3)
    lines = {line.name: line for line in account.lines}
    assert {line.status for line in lines.values()} == {"unilateral"}
    assert [lines[n].rheonomic for n in ("wave", "spiral", "post")] == [True, True, False]
    assert [lines[n].restitution for n in ("wave", "spiral")] == ["2*e", ""]


def test_restitution_is_over_parameters() -> None:
    e = derived(DRIVEN)
    (symbol,) = (p.symbol for p in e.system.parameters if p.name == "e")
    assert [c.restitution for c in e.system.contacts] == [2 * symbol, 0, 0]


def test_conserved_in_every_mode() -> None:
    """A floor takes p_z and nothing else; one that moves takes the energy too."""
    text = "parameters: {m: 1}\nparticles: {p: {mass: m, position: [x, y, z]}}\nconstraints: "
    assert derived(text + "{floor: z >= 0}").derivation.cyclic == ("x", "y")
    found = {c.name: c.reason for c in derived(text + "{floor: z >= 0}").derivation.conserved}
    assert found.keys() == {"p_x", "p_y", "energy"}
    assert found["energy"] == "L does not depend on t (between impacts)"
    elastic = derived(text + "{floor: {unilateral: z >= 0, restitution: 1}}").derivation.conserved
    assert elastic[-1].reason == "L does not depend on t"
    moved = [c.name for c in derived(text + "{floor: z >= sin(t)}").derivation.conserved]
    assert moved == ["p_x", "p_y"]
    tilted = [c.name for c in derived(text + "{floor: z + x >= 0}").derivation.conserved]
    assert tilted == ["p_y", "energy"]


def test_facts() -> None:
    driven, ball = derived(DRIVEN).derivation.facts, derived(BALL).derivation.facts
    assert (driven.rheonomic, driven.autonomous) == (True, False)
    assert (ball.rheonomic, ball.autonomous, ball.separable) == (False, True, False)
    assert ball.positive_definite_mass_matrix
    assert ball.unused_parameters == ()


def test_an_angle_that_meets_a_stop_is_none() -> None:
    text = (
        "particles: {p: {mass: 1, position: [cos(q), sin(q), 0]}}\ncoordinates: [q]\n"
        "constraints: {stop: STOP}\n"
    )
    assert derived(text.replace("STOP", "sin(q) <= 0.5")).system.coordinates[0].is_angle
    assert not derived(text.replace("STOP", "q <= 0.5")).system.coordinates[0].is_angle


def test_names_of_multipliers_are_free() -> None:
    text = BALL.replace("h: 1", "h: 1, lambda_floor: 2, floor: 1")
    assert one(derived(text), "floor").closure.multiplier.name == "lambda_floor_"
    several = "{floor: [z >= 0, z + x >= 0], floor_1: x + 2*z >= 0}"
    e = derived(BALL.replace("{floor: z >= 0}", several))
    names = ("floor_1", "floor_1_", "floor_2")
    assert sorted(c.name for c in e.system.contacts) == sorted(names)
    assert len({c.closure.multiplier for c in e.system.contacts}) == 3


def test_multipliers_stand_in_expressions() -> None:
    e = derived(BALL)
    assert interpret(e, expression("lambda_floor*2")) == 2 * one(e, "floor").closure.multiplier


# Forces.


def forced(text: str) -> Equations:
    return derive(read_text("name: forced\n" + text), forces=True)


def test_force_of_contact_and_rope() -> None:
    """A bead on a sphere and on an inextensible string: f = λ ∇φ of both."""
    text = SPHERE.replace("{sphere: x^2", "{string: x^2 + (z - 4)^2 <= 16, sphere: x^2")
    e = forced(text)
    (body,) = e.derivation.constraint_forces.bodies
    by = {c.name: c.q for c in e.system.coordinates}
    sphere, string = one(e, "sphere").closure.multiplier, one(e, "string").closure.multiplier
    x, z = by["x"], by["z"]
    expected = (2 * sphere * x - 2 * string * x, 0, 2 * sphere * z - 2 * string * (z - 4))
    assert [sp.expand(f - g) for f, g in zip(body.components, expected, strict=True)] == [0, 0, 0]
    reactions = {r.name: r for r in e.derivation.constraint_forces.reactions}
    assert reactions["sphere"].multiplier == sphere
    ((on, size),) = reactions["sphere"].sizes
    assert on == "bead"
    assert sp.simplify(size**2 - 4 * sphere**2 * (x**2 + z**2)) == 0


def test_force_of_a_constraint_beside_a_contact() -> None:
    """A mass on a rod that meets a stop: tension from the stop's push too."""
    text = (
        "parameters: {m: 2, l: {value: 3, positive: true}, g: 9.81}\n"
        "particles: {bob: {mass: m, position: [l*sin(q), 0, -l*cos(q)]}}\ncoordinates: [q]\n"
        "potentials: {weight: {gravity: g}}\nconstraints: {stop: q <= 1}\n"
    )
    e = forced(text)
    (body,) = e.derivation.constraint_forces.bodies
    push = one(e, "stop").closure.multiplier
    state = random_point([e.system.coordinates[0].q, e.system.coordinates[0].v, push], 3)
    state |= {p.symbol: mpf("9.81") if p.name == "g" else mpf(p.value) for p in e.system.parameters}
    q, v = state[e.system.coordinates[0].q], state[e.system.coordinates[0].v]
    fx, fz = (number(body.components[k], state) for k in (0, 2))
    # Along the rod m l q̇² + m g cos q, across it what the stop exerts: −λ/l.
    s, c = mpmath.sin(q), mpmath.cos(q)
    assert close(fz * c - fx * s, 6 * v**2 + 2 * mpf("9.81") * c)
    assert close(fx * c + fz * s, -state[push] / 3)
