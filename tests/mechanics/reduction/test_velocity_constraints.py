"""Constraints on velocities: integrable ones count to K, the others are nonholonomic."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

import mpmath
import pytest
import sympy as sp
from mpmath import mpf
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.reduction.integrability import (
    PfaffianForm,
    integrable_rank,
    integrate_form,
)
from lagrange_cli.report.contents.derivation.contents import derivation_text
from tests.mechanics.closures_support import close, holds, solved, state_of
from tests.mechanics.mechanics_support import derived, number, refusal

SLEIGH = """
parameters: {m: 2, J: 3, a: {value: 0.5, positive: true}}
particles: {centre: {mass: m, position: [x + a*cos(th), y + a*sin(th), 0]}}
coordinates: [x, y, th]
kinetic: {spin: J*dot(th)^2/2}
constraints: {blade: dot(y)*cos(th) = dot(x)*sin(th)}
"""
DISK = """
parameters: {m: 1, I: 2, J: 3, R: 0.5}
particles: {centre: {mass: m, position: [x, y, z]}}
plane: xy
coordinates: [x, y, phi, th]
kinetic: {spin: I*dot(phi)^2/2, turn: J*dot(th)^2/2}
constraints: {roll: [dot(x) = R*cos(th)*dot(phi), dot(y) = R*sin(th)*dot(phi)]}
"""
BOARD = """
particles: {board: {mass: m, position: [x, y, 0]}}
coordinates: [x, y, theta, phi]
kinetic: {turn: J*(dot(theta)^2 + dot(phi)^2)/2}
constraints:
  back: dot(y)*cos(theta + phi) - dot(x)*sin(theta + phi) = -r*cos(phi)*dot(theta)
  front: dot(y)*cos(theta - phi) - dot(x)*sin(theta - phi) = r*cos(phi)*dot(theta)
initial: {x: 0, y: 0, theta: 0, phi: 0.4, dot(x): 0.3}
"""
CYLINDER = """
parameters: {m: 1, J: 3, R: 0.5, s: 0.2, g: 9.81}
particles: {axle: {mass: m, position: [x, y, z]}}
constraints: {roll: dot(x) = R*dot(phi), plane: [y = 0, z = s*x]}
coordinates: [%s]
kinetic: {spin: J*dot(phi)^2/2}
potentials: {weight: m*g*z}
initial: {x: 1, phi: 0.3}
"""


@pytest.fixture(autouse=True)
def _precise() -> Iterator[None]:
    with mpmath.workdps(40):
        yield


def draw(seed: int, count: int) -> list[mpf]:
    numbers = random.Random(seed)
    return [mpf(numbers.uniform(-3, 3)) for _ in range(count)]


def starts(e: Equations) -> dict[sp.Expr, sp.Expr]:
    """Values of constants of integration."""
    return {p.symbol: p.exact for p in e.system.parameters if p.start_of and p.exact is not None}


@pytest.mark.parametrize("seed", range(4))
def test_chaplygin_sleigh(seed: int) -> None:
    """v' = a ω², ω' = −m a v ω/(J + m a²) (Bloch, Nonholonomic Mechanics and Control, 1.7)."""
    e = derived(SLEIGH)
    assert (e.derivation.account.dof, e.derivation.account.nonholonomic) == (3, 1)
    x, y, th, v, w = draw(seed, 5)
    s, c = mpmath.sin(th), mpmath.cos(th)
    state = state_of(e, x=x, y=y, th=th, v_x=v * c, v_y=v * s, v_th=w)
    holds(e, state)
    acceleration, _ = solved(e, state)
    m, spin, arm = mpf(2), mpf(3), mpf("0.5")
    assert close(acceleration["x"] * c + acceleration["y"] * s, arm * w**2)
    assert close(acceleration["th"], -m * arm * v * w / (spin + m * arm**2))


def test_sleigh_against_sympy() -> None:
    """SymPy's Lagrange equations with the same nonholonomic constraint."""
    e = derived(SLEIGH)
    x, y, th = dynamicsymbols("x y th")
    u, v, w = (q.diff() for q in (x, y, th))
    place = sp.Matrix([x + sp.Rational(1, 2) * sp.cos(th), y + sp.Rational(1, 2) * sp.sin(th)])
    rate = place.diff(dynamicsymbols._t)
    method = LagrangesMethod(
        rate.dot(rate) + sp.Rational(3, 2) * w**2,
        [x, y, th],
        nonhol_coneqs=[v * sp.cos(th) - u * sp.sin(th)],
    )
    method.form_lagranges_equations()
    at = {u: sp.Rational(6, 5), v: sp.Rational(8, 5), w: sp.Rational(7, 3)}
    angle = {sp.cos(th): sp.Rational(3, 5), sp.sin(th): sp.Rational(4, 5)}
    mass = method.mass_matrix_full.xreplace(at).xreplace(angle)
    force = method.forcing_full.xreplace(at).xreplace(angle)
    expected = mass.LUsolve(force)
    state = state_of(
        e, x=0, y=0, th=mpmath.acos(mpf(3) / 5), v_x=mpf("1.2"), v_y=mpf("1.6"), v_th=mpf(7) / 3
    )
    found, multipliers = solved(e, state)
    for k, name in enumerate(("x", "y", "th")):
        assert close(found[name], mpf(expected[3 + k].p) / expected[3 + k].q)
    assert close(abs(multipliers["blade"]), abs(mpf(expected[6].p) / expected[6].q))


@pytest.mark.parametrize("seed", range(3))
def test_rolling_disk(seed: int) -> None:
    """Spin and turn are uniform; the contact force carries the centre around."""
    e = derived(DISK)
    assert (
        e.derivation.account.dof,
        e.derivation.account.extra,
        e.derivation.account.nonholonomic,
    ) == (4, 2, 2)
    assert [c.name for c in e.system.closures] == ["roll_1", "roll_2"]
    assert {line.name: line.status for line in e.derivation.account.lines}["roll"] == "nonholonomic"
    x, y, phi, th, spin, turn = draw(seed, 6)
    radius = mpf("0.5")
    s, c = mpmath.sin(th), mpmath.cos(th)
    state = state_of(
        e,
        x=x,
        y=y,
        phi=phi,
        th=th,
        v_phi=spin,
        v_th=turn,
        v_x=radius * c * spin,
        v_y=radius * s * spin,
    )
    holds(e, state)
    found, multipliers = solved(e, state)
    assert close(found["phi"], mpf(0))
    assert close(found["th"], mpf(0))
    assert close(found["x"], -radius * s * turn * spin)
    assert close(multipliers["roll_2"], radius * c * turn * spin)


@pytest.mark.parametrize("seed", range(3))
def test_a_knife_edge_on_an_incline(seed: int) -> None:
    """Along the blade gravity alone accelerates (Neimark and Fufaev, 1972, III.2)."""
    e = derived(
        "parameters: {m: 1, J: 2, k: 3}\nparticles: {edge: {mass: m, position: [x, y, 0]}}\n"
        "coordinates: [x, y, th]\nkinetic: {spin: J*dot(th)^2/2}\npotentials: {weight: -m*k*x}\n"
        "constraints: {blade: dot(x)*sin(th) - dot(y)*cos(th) = 0}"
    )
    assert [c.name for c in e.derivation.conserved] == ["p_th", "energy"]
    x, y, th, v, w = draw(seed, 5)
    s, c = mpmath.sin(th), mpmath.cos(th)
    found, _ = solved(e, state_of(e, x=x, y=y, th=th, v_x=v * c, v_y=v * s, v_th=w))
    assert close(found["x"] * c + found["y"] * s, 3 * c)
    assert close(found["th"], mpf(0))


def test_an_affine_constraint_does_work() -> None:
    """On a belt that moves sideways the blade slides with it: energy is not conserved."""
    e = derived(SLEIGH.replace("= dot(x)*sin(th)", "= dot(x)*sin(th) + 2"))
    assert e.derivation.conserved == ()
    (closure,) = e.system.closures
    assert closure.rate == -2
    assert closure.kind == "velocity"


# Integrable ones.


def test_rolling_along_a_line_is_holonomic() -> None:
    """dot(x) = R dot(phi) with x eliminated: the cylinder's textbook equation."""
    e = derived(CYLINDER % "phi")
    assert e.system.formulation == "minimal"
    assert (
        e.derivation.account.constraints,
        e.derivation.account.dof,
        e.derivation.account.nonholonomic,
    ) == (2, 1, 0)
    (x,) = [c.position for c in e.system.cartesian_names if c.name == "x"]
    phi, r = e.system.coordinates[0].q, next(p.symbol for p in e.system.parameters if p.name == "R")
    assert sp.expand(x.xreplace(starts(e)) - (r * (phi - sp.Rational(3, 10)) + 1)) == 0
    assert any("counts to K" in remark for remark in e.derivation.remarks)


def test_rolling_with_both_coordinates_declared() -> None:
    """Declared beside each other, x and phi keep their closure; the motion is the same."""
    both, one = derived(CYLINDER % "x, phi"), derived(CYLINDER % "phi")
    assert both.derivation.account.dof == 1
    assert [c.kind for c in both.system.closures] == ["position"]
    found, multipliers = solved(both, state_of(both, x=1, phi=mpf("0.3"), v_x=1, v_phi=2))
    alone, _ = solved(one, state_of(one, phi=mpf("0.3"), v_phi=2))
    assert close(found["phi"], alone["phi"])
    assert close(-multipliers["roll"] / 2, 3 * found["phi"])  # friction turns the cylinder


def test_the_constant_is_named_by_the_initial_state() -> None:
    for start, x_0, phi_0 in (
        ("initial: {x: 1, phi: 0.3}\n", 1, sp.Rational(3, 10)),
        ("initial: {phi: 0.3}\n", None, sp.Rational(3, 10)),
        ("", None, None),
    ):
        e = derived((CYLINDER % "phi").replace("initial: {x: 1, phi: 0.3}\n", start))
        named = {p.name: p for p in e.system.parameters}
        assert (named["x_0"].start_of, named["x_0"].exact) == ("x", x_0)
        assert (named["phi_0"].start_of, named["phi_0"].exact) == ("phi", phi_0)
        (x,) = [c.position for c in e.system.cartesian_names if c.name == "x"]
        turned = e.system.coordinates[0].q - named["phi_0"].symbol
        assert sp.expand(x - named["x_0"].symbol - named["R"].symbol * turned) == 0
        assert not e.derivation.warnings
        assert (e.system.initial is None) == (start.count(":") < 3)


def test_integrals_are_written_from_the_start() -> None:
    scene = (
        "parameters: {a: 1, R: 2, phi_0: 3}\nparticles: {c: {mass: phi_0, position: [u, 0, 0]}}\n"
        "coordinates: [u, theta, phi]\nkinetic: {spin: dot(phi)^2 + dot(theta)^2}\n"
        "constraints: {rolling: a*dot(phi) = (R + a)*dot(theta)}\n"
    )
    e = derived(scene)
    assert e.derivation.remarks == (
        "constraint 'rolling' is the rate of a*(phi - phi_0_) = (R + a)*(theta - theta_0):"
        " it counts to K",
    )
    assert "  rolling   a (φ - phi_0_) - (R + a) (θ - θ_0) = 0\n" in derivation_text(e)
    nonlinear = derived(scene.replace("(R + a)*dot(theta)", "theta*dot(theta)"))
    assert nonlinear.derivation.remarks[0].startswith(
        "constraint 'rolling' is the rate of a*phi - theta^2/2 = "
    )


def test_what_is_eliminated_is_written_from_the_start() -> None:
    scene = (
        "particles: {load: {mass: 2, position: [0, 0, y]}}\ncoordinates: [phi]\n"
        "parameters: {k: 3, R: 0.5}\nkinetic: {drum: dot(phi)^2}\npotentials: {v: k*y^2/2}\n"
        "constraints: {rope: dot(y) = -R*dot(phi)}\ninitial: {phi: 0.3, y: 0}"
    )
    text = derivation_text(derived(scene))
    assert "V = ½ k (y_0 - R (φ - φ_0))²\n" in text
    assert "Coordinates   φ        y = y_0 - R (φ - φ_0)\n" in text


@pytest.mark.slow
def test_the_time_of_the_start_is_named_too() -> None:
    scene = (
        "parameters: {w: 2}\nparticles: {b: {mass: 1, position: [r*cos(u), r*sin(u), 0]}}\n"
        "coordinates: [r, u]\nconstraints: {motor: dot(u) = w*t}\ninitial: {r: 1, u: 0.5}\n"
        "simulate: {from: %s, until: 3}\n"
    )
    e = derived(scene % 1)
    assert [(p.name, p.exact) for p in e.system.parameters if p.start_of] == [
        ("u_0", sp.Rational(1, 2)),
        ("t_0", 1),
    ]
    assert "t_0" not in {p.name for p in derived(scene % 0).system.parameters}
    end = loads(scene % 1).derive().simulate().columns["u"][-1]
    assert math.isclose(end, 0.5 + 9 - 1, rel_tol=1e-9)


def test_a_run_asks_for_the_start_of_the_constant() -> None:
    scene = (CYLINDER % "x, phi").replace("initial: {x: 1, phi: 0.3}", "initial: {phi: 0.3}")
    system = loads("name: s\n" + scene).derive()
    with pytest.raises(InputError, match="does not give the whole initial state") as refused:
        system.simulate(until=1.0)
    assert refused.value.problems[0].hint == "-i x=0 -i phi=0.3"


def test_a_circle_by_its_rate() -> None:
    e = derived(
        "particles: {bead: {mass: 1, position: [x, y, z]}}\nplane: xy\n"
        "constraints: {ring: x*dot(x) + y*dot(y) = 0}\npotentials: {v: x}\ninitial: {x: 3, y: 4}"
    )
    assert [c.kind for c in e.system.closures] == ["position"]
    assert e.derivation.account.dof == 1


def test_an_integrable_one_without_an_integral_counts_to_k() -> None:
    """y dx = x dy keeps the direction from the origin, by a factor that is not looked for."""
    e = derived(
        "particles: {bead: {mass: 1, position: [x, y, z]}}\nplane: xy\n"
        "constraints: {ray: y*dot(x) = x*dot(y)}\npotentials: {v: x}\ninitial: {x: 3, y: 4}"
    )
    assert [c.kind for c in e.system.closures] == ["velocity"]
    assert (
        e.derivation.account.constraints,
        e.derivation.account.dof,
        e.derivation.account.nonholonomic,
    ) == (2, 1, 0)


def test_a_driven_angle() -> None:
    """dot(th) = w is th = w t + constant: rheonomic."""
    e = derived(
        "parameters: {w: 2, l: 1}\nparticles:\n"
        "  bead: {mass: 1, position: [r*cos(th), r*sin(th), 0]}\ncoordinates: [r, th]\n"
        "constraints: {motor: dot(th) = w}\ninitial: {r: 1, th: 0.5}"
    )
    assert e.derivation.facts.rheonomic
    assert e.derivation.account.dof == 1
    assert "energy" not in [c.name for c in e.derivation.conserved]
    state = state_of(e, t=1, r=mpf(3), th=mpf("2.5"), v_r=mpf("0.2"), v_th=2)
    holds(e, state)
    found, _ = solved(e, state)
    assert close(found["r"], 4 * mpf(3))


# What is wrong.


@pytest.mark.parametrize(
    ("constraint", "rule"),
    [
        ("dot(y)/dot(x) = tan(th)", "not-linear"),
        ("dot(x)^2 + dot(y)^2 = 1", "not-linear"),
        ("[dot(x) = 1, dot(x) = 2]", "inconsistent"),
        ("[dot(y)*cos(th) = dot(x)*sin(th), dot(y)*cos(th) = dot(x)*sin(th) + 1]", "inconsistent"),
    ],
)
def test_refusals(constraint: str, rule: str) -> None:
    text = SLEIGH.replace("dot(y)*cos(th) = dot(x)*sin(th)", constraint)
    problem = refusal(text + "initial: {x: 0, y: 0, th: 0}\n")
    assert problem.rule == rule
    assert problem.mark is not None
    assert "'blade'" in problem.message


def test_redundant_ones_are_named() -> None:
    e = derived(
        SLEIGH.replace("dot(x)*sin(th)}", "dot(x)*sin(th), again: dot(y) = dot(x)*tan(th)}")
    )
    assert [w.rule for w in e.derivation.warnings] == ["redundant"]
    assert e.system.multipliers == ("blade",)


@pytest.mark.parametrize("y", ["0.5", "-0.5"])
def test_a_logarithm_is_real_on_either_side_of_its_pole(y: str) -> None:
    """ẋ + ẏ/y = 0 integrates to x + log |y| = constant."""
    e = derived(
        "particles: {bead: {mass: 1, position: [x, y, z]}}\n"
        "constraints: {a: dot(x) + dot(y)/y = 0, b: z = 0}\ncoordinates: [y]\n"
        f"initial: {{x: 1, y: {y}}}\n"
    )
    assert (e.derivation.account.dof, e.derivation.account.nonholonomic, e.system.closures) == (
        1,
        0,
        (),
    )
    (x,) = [c for c in e.system.cartesian_names if c.name == "x"]
    for factor in (mpf(1), mpf(3)):
        position = x.position.xreplace(starts(e))
        there = number(position, {e.system.coordinates[0].q: factor * mpf(y)})
        assert abs(there - (1 - mpmath.log(factor))) < mpf(10) ** -25


def test_a_logarithm_of_what_is_negative_at_the_start() -> None:
    e = derived(
        "particles: {bead: {mass: 1, position: [x, y, z]}}\n"
        "constraints: {a: dot(x)*cos(y) - x*sin(y)*dot(y) + dot(z) = 3*t^2,"
        " b: dot(x) + dot(y)/y = 0}\ninitial: {x: 1, y: -0.5, z: 0}\n"
    )
    assert (e.derivation.account.dof, e.derivation.account.nonholonomic) == (1, 0)


def test_an_integral_that_is_not_real_at_the_start_is_not_taken() -> None:
    """∫ dy/√(y² − 1) by acosh holds where y > 1 only."""
    e = derived(
        "particles: {bead: {mass: 1, position: [x, y, z]}}\n"
        "constraints: {a: dot(x) + dot(y)/sqrt(y^2 - 1) = 0, b: z = 0}\n"
        "initial: {x: 1, y: -2}\n"
    )
    assert (e.derivation.account.dof, e.derivation.account.nonholonomic) == (1, 0)


def test_too_few_coordinates_beside_nonholonomic_constraints() -> None:
    assert refusal(DISK.replace("[x, y, phi, th]", "[phi, th]")).rule == "too-few-coordinates"


def test_initial_velocities_follow_from_the_constraints() -> None:
    e = derived(DISK + "initial: {x: 0, y: 0, phi: 0, th: pi/6, dot(phi): 2, dot(th): 1}\n")
    assert e.system.initial is not None
    expected = (float(mpmath.sqrt(3)) / 2, 0.5, 2.0, 1.0)
    assert e.system.initial.velocities == pytest.approx(expected, rel=1e-15)
    assert (
        refusal(DISK + "initial: {x: 0, y: 0, phi: 0, th: 0, dot(phi): 2, dot(y): 1}\n").rule
        == "initial-inconsistent"
    )


# Frobenius.

X, Y, Z, W, T = sp.symbols("x y z w t", real=True)
VARIABLES = (X, Y, Z, W, T)
POINTS = [
    {X: mpf("0.3") + k, Y: mpf("1.7") - k, Z: mpf("0.9"), W: mpf("0.4") * (k + 1), T: mpf(k)}
    for k in range(3)
]


def form(*coefficients: object) -> PfaffianForm:
    return PfaffianForm(VARIABLES, tuple(sp.sympify(c) for c in coefficients))


CONTACT = form(-Y, 0, 1, 0, 0)  # dz − y dx


@pytest.mark.parametrize(
    ("forms", "rank"),
    [
        ([CONTACT], 0),
        ([form(Y, -X, 0, 0, 0)], 1),
        ([form(sp.exp(Z), 0, X * sp.exp(Z), 0, 0)], 1),
        ([CONTACT, form(0, 0, 0, 1, 0)], 1),
        ([CONTACT, form(-Y, 0, 1, 1, 0)], 1),
        ([CONTACT, form(0, 1, 0, 0, -X)], 0),
        ([CONTACT, form(0, 1, 0, 0, 0)], 2),
        ([CONTACT, form(-W, 1, 0, 0, 0)], 0),  # Engel's: the derived flag ends at zero
        ([form(-W, 0, 1, 0, 0), form(0, 0, 0, 1, -2)], 1),
        ([], 0),
    ],
)
def test_rank_of_the_integrable_part(forms: list[PfaffianForm], rank: int) -> None:
    assert integrable_rank(forms, POINTS, [1.0] * len(VARIABLES)) == rank


@pytest.mark.parametrize("length", [1e16, 1e-12])
def test_units_do_not_make_a_form_integrable(length: float) -> None:
    """dz − y dx and dy − l x dt, where y and z are lengths, of any unit."""
    points = [{**p, Y: length * p[Y], Z: length * p[Z]} for p in POINTS]
    forms = [form(-Y, 0, 1, 0, 0), form(0, 1, 0, 0, -sp.Float(length, 40) * X)]
    assert integrable_rank(forms, points, [1.0, length, length, 1.0, 1.0]) == 0


@pytest.mark.parametrize("length", ["0.5", "2^60", "2^-60"])
def test_disks_of_any_size_roll_in_both_directions(length: str) -> None:
    e = derived(DISK.replace("I: 2, J: 3, R: 0.5", f"R: {length}, I: R^2, J: R^2"))
    assert (e.derivation.account.dof, e.derivation.account.nonholonomic) == (4, 2)
    assert not e.derivation.warnings


@pytest.mark.parametrize("power", [-50, -2, 50])
def test_two_blades_of_a_board_of_any_size_tell_how_it_turns(power: int) -> None:
    """The board turns about the point where the lines across both blades meet."""
    e = derived(f"{BOARD}parameters: {{m: 1, r: 2^({power}), J: r^2}}\n")
    assert e.derivation.account.nonholonomic == 2
    assert e.system.initial is not None
    dx, dy, dtheta, _ = e.system.initial.velocities
    assert (dx, dy) == (0.3, 0)
    assert dtheta == pytest.approx(0.3 * math.tan(0.4) / 2.0**power, rel=1e-14)


@pytest.mark.parametrize(
    "whole",
    [X * Y, sp.sin(X * Y) + Z**2, X * sp.cos(Y) - 3 * W * T, sp.exp(X) * sp.sin(Y) + Z, X / Y],
)
def test_closed_forms_are_integrated(whole: sp.Expr) -> None:
    found = integrate_form(PfaffianForm(VARIABLES, tuple(whole.diff(s) for s in VARIABLES)), POINTS)
    assert found is not None
    assert all(sp.simplify((found - whole).diff(s)) == 0 for s in VARIABLES)


@pytest.mark.parametrize("open_form", [CONTACT, form(Y, -X, 0, 0, 0)])
def test_forms_that_are_not_closed_have_no_integral(open_form: PfaffianForm) -> None:
    assert integrate_form(open_form, POINTS) is None


def test_rates_that_vanish_but_for_rounding_are_no_endless_search() -> None:
    """A car with two wheels: one residual is exactly zero, the other shrinks with every step."""
    car = derived(
        "parameters: {a: 0.7}\nparticles: {b: {mass: 1, position: [x, y, 0]}}\n"
        "coordinates: [x, y, th, ps]\n"
        "kinetic: {s: dot(th)^2/4 + (dot(th) + dot(ps))^2/20}\n"
        "constraints:\n  rear: dot(x)*sin(th) - dot(y)*cos(th) = 0\n"
        "  front: (dot(x) - a*sin(th)*dot(th))*sin(th+ps)"
        " - (dot(y) + a*cos(th)*dot(th))*cos(th+ps) = 0\n"
        "forces: {steer: {on: ps, force: -0.3*ps}}\n"
        "initial: {x: 0, y: 0, th: 0, ps: 0.5, dot(x): 1, dot(ps): 0}\n"
    )
    assert car.system.initial is not None
    x, y, turn, steering = car.system.initial.velocities
    assert (x, y, steering) == (1, 0, 0)
    assert turn == pytest.approx(math.tan(0.5) / 0.7, rel=1e-14)


def test_no_slip_on_an_inclined_plane_that_slides_reads_as_in_books() -> None:
    """A cylinder on a movable wedge: sin² α/cos α + cos α is written 1/cos α."""
    equations = (
        loads("""
plane: xz
parameters: {M: 3, m: 1, R: 0.2, alpha: 0.4, g: 9.81}
frames: {slope: {at: [s, 0, 0], turn: alpha}}
particles: {wedge: {mass: M, position: [s, 0, 0]}}
bodies: {cylinder: {at: [x, 0, z], turn: -phi, mass: m, inertia: {disk: R}}}
constraints: {slope: {roll: cylinder, radius: R, on: {normal: z, on: slope}}}
coordinates: [s, phi]
potentials: {weight: {gravity: g}}
""")
        .derive()
        .equations
    )
    text = derivation_text(equations)
    assert "  x = s - s_0 + x_0 + R (φ - φ_0) cos α\n" in text
    assert "T = ½ (M + m) ṡ² + ¾ m R² φ̇² + m R ṡ φ̇ cos α\n" in text
    assert "\n  s   (M + m) s̈ + m R φ̈ cos α = 0\n  φ   s̈ cos α + 3/2 R φ̈ + g sin α = 0 " in text
