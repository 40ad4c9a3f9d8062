"""Initial states: what is given stays, what is missing follows, what contradicts is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.mechanics.system import InitialState
from tests.mechanics.mechanics_support import DOUBLE_PENDULUM, POLAR, derived, few, refusal

FREE = "plane: xy\nparticles: {bead: {mass: 1, position: [x, y, z]}}\ncoordinates: [x, y]\n"
ROD = (
    "parameters: {l: 2}\nplane: xz\nparticles: {bob: {mass: 1, position: [x, y, z]}}\n"
    "coordinates: [q]\ndefinitions: {x: l*sin(q), z: -l*cos(q)}\n"
)


#: A particle in a plane, on a curve.
CURVE = "plane: xz\nparticles: {bead: {mass: 1, position: [x, y, z]}}\nconstraints: {curve: %s}\n"


def start(text: str) -> InitialState:
    found = derived(text).system.initial
    assert found is not None
    return found


def test_given_coordinates_stay_exactly() -> None:
    found = start(DOUBLE_PENDULUM + "initial: {theta1: 0.1, theta2: 1e-300, dot(theta2): -0.3}")
    assert found == InitialState((0.1, 1e-300), (0.0, -0.3), 0.0)


def test_values_may_be_expressions() -> None:
    found = start(ROD + "initial: {q: pi/3, dot(q): sqrt(l)/4}")
    # The nearest doubles, which products of rounded numbers need not be.
    assert found.positions == (float(sp.pi.evalf(40) / 3),)
    assert found.velocities == (float(sp.sqrt(2).evalf(40) / 4),)


@pytest.mark.slow
@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.floats(-2, 2), st.floats(-2, 2))
@few
def test_cartesian_values_give_the_coordinates(q1: float, q2: float, v1: float, v2: float) -> None:
    """Both bobs' places and velocities, without any angle."""
    x1, z1 = math.sin(q1), -math.cos(q1)
    x2, z2 = x1 + 3 * math.sin(q2), z1 - 3 * math.cos(q2)
    u1, w1 = v1 * math.cos(q1), v1 * math.sin(q1)
    u2, w2 = u1 + 3 * v2 * math.cos(q2), w1 + 3 * v2 * math.sin(q2)
    values = {"x1": x1, "z1": z1, "x2": x2, "z2": z2}
    values |= {"dot(x1)": u1, "dot(z1)": w1, "dot(x2)": u2, "dot(z2)": w2}
    listed = ", ".join(f"{name}: {value!r}" for name, value in values.items())
    found = start(DOUBLE_PENDULUM + f"initial: {{{listed}}}")
    for angle, expected in zip(found.positions, (q1, q2), strict=True):
        assert math.cos(angle - expected) == pytest.approx(1, abs=1e-14)
        assert abs(math.remainder(angle - expected, 2 * math.pi)) < 1e-12
    assert found.velocities == pytest.approx((v1, v2), abs=1e-11)


def test_one_cartesian_value_may_be_enough() -> None:
    found = start(ROD + "initial: {x: 1, q: pi/6, dot(x): 3}")
    assert found.velocities[0] == pytest.approx(3 / (2 * math.cos(math.pi / 6)), rel=1e-14)


def test_places_by_component_name() -> None:
    found = start(FREE + "initial: {x_bead: 3, y_bead: 4, dot(y_bead): 5}")
    assert found == InitialState((3.0, 4.0), (0.0, 5.0), 0.0)


@pytest.mark.parametrize(
    ("text", "initial", "missing"),
    [
        (DOUBLE_PENDULUM, "theta1: 1", ["theta2"]),
        (DOUBLE_PENDULUM, "dot(theta1): 1", ["theta1", "theta2"]),
        (FREE, "x: 1", ["y"]),
        (ROD, "dot(x): 1", ["q"]),
    ],
)
def test_missing_coordinates_are_named(text: str, initial: str, missing: list[str]) -> None:
    problem = refusal(text + f"initial: {{{initial}}}")
    assert problem.rule == "initial-missing"
    assert problem.mark is not None
    for name in missing:
        assert f"'{name}'" in problem.message
        assert f"{name}:" in problem.hint


def test_coordinates_that_are_given_are_not_called_missing() -> None:
    assert "'theta1'" not in refusal(DOUBLE_PENDULUM + "initial: {theta1: 1}").message


@pytest.mark.slow
@pytest.mark.parametrize(
    "initial",
    [
        "x: 0.5, q: 0",
        "x: 0.5, z: 3",
        "x: 2.1",
        "q: 0, y: 1",
        "q: 0, dot(z): 1",
        "q: 0, dot(q): 1, dot(x): 3",
        "q: 0.5, dot(x): 1, dot(z): -5",
        "q: 0, y: 1e-8",
    ],
)
def test_contradictions_are_refused_with_their_place(initial: str) -> None:
    problem = refusal(ROD + f"initial: {{{initial}}}")
    assert problem.rule.startswith("initial-")
    assert problem.mark is not None


def test_a_value_within_tolerance_is_projected_and_the_change_reported() -> None:
    found = start(ROD + "initial: {x: 1.0000000001, q: pi/6}")
    assert found.positions == (float(sp.pi.evalf(40) / 6),)
    assert found.projected == pytest.approx(1e-10, rel=1e-3)
    assert start(ROD + "initial: {x: 1, q: pi/6}").projected < 1e-15


@pytest.mark.parametrize(("length", "miss"), [("2e16", "1e5"), ("2e-12", "1e-23")])
def test_the_tolerance_is_relative_to_the_scene(length: str, miss: str) -> None:
    scene = ROD.replace("l: 2", f"l: {length}")
    found = start(scene + f"initial: {{q: pi/6, x: l/2 + {miss}}}")
    assert found.projected == pytest.approx(float(miss), rel=1e-3)
    assert (
        refusal(scene + f"initial: {{q: pi/6, x: l/2 + 1e4*{miss}}}").rule == "initial-inconsistent"
    )


def test_missing_velocities_are_zero_where_nothing_moves() -> None:
    assert start(DOUBLE_PENDULUM + "initial: {theta1: 1, theta2: 2}").velocities == (0.0, 0.0)


def test_velocities_have_the_least_kinetic_energy() -> None:
    """The end of two links moves at (1, 0): of all angular velocities the cheapest."""
    text = (
        "parameters: {a: 1, b: 5}\nplane: xz\nparticles:\n  one: {mass: a, position: [x, y, z]}\n"
        "  two: {mass: b, position: [u, v, w]}\npoints: {middle: [(x + 2*u)/3, 0, 0]}\n"
        "coordinates: [x, z, u, w]\ninitial: {x: 0, z: 0, u: 1, w: 1, dot(x_middle): 1}\n"
    )
    e = derived(text)
    assert e.system.initial is not None
    mass = np.diag([1.0, 1.0, 5.0, 5.0])
    row = np.array([1 / 3, 0, 2 / 3, 0])
    expected = np.linalg.solve(mass, row)
    expected /= row @ expected
    assert e.system.initial.velocities == pytest.approx(expected, abs=1e-14)


def test_a_singular_chart_at_the_start_is_no_crash() -> None:
    """At r = 0 the angle has no inertia; the velocity along x is that of r."""
    found = start(POLAR + "initial: {r: 0, theta: 0, dot(x): 1}")
    assert found.velocities == pytest.approx((1.0, 0.0))


def test_a_moving_support_carries_what_hangs_on_it() -> None:
    """Given Cartesian velocities are met, the support's own motion included."""
    text = (
        "parameters: {u: 3}\nparticles: {bob: {mass: 1, position: [x, 0, 0]}}\ncoordinates: [s]\n"
        "definitions: {x: s + u*t}\nsimulate: {from: 2}\ninitial: {x: 10, dot(x): 5}\n"
    )
    assert start(text) == InitialState((4.0,), (2.0,), 0.0)


@pytest.mark.parametrize(
    "text",
    [
        ROD,
        ROD.replace("l: 2", "l: {unit: m}") + "initial: {q: 1}",
        ROD.replace("l: 2", "l: {positive: true}") + "initial: {q: 1, x: 5}",
    ],
)
def test_no_state_without_initial_or_without_values(text: str) -> None:
    assert derived(text).system.initial is None


@pytest.mark.parametrize("name", ["nobody", "l", "z_nobody"])
def test_only_places_have_initial_values(name: str) -> None:
    problem = refusal(ROD + f"initial: {{q: 1, {name}: 2}}")
    assert problem.mark is not None
    assert name in problem.message


# Closures take part.

RING = (
    "parameters: {l: 1}\nplane: xz\nparticles: {bob: {mass: 2, position: [x, y, z]}}\n"
    "constraints: {ring: x^2 + z^2 = l^2}\n"
)
LINKS = (
    "parameters: {a: 1, b: 3, c: 2, d: 3}\nplane: xz\nparticles:\n"
    "  A: {mass: 1, position: [a*cos(alpha), 0, a*sin(alpha)]}\n"
    "points: {B: ['a*cos(alpha) + b*cos(beta)', 0, 'a*sin(alpha) + b*sin(beta)']}\n"
    "coordinates: [alpha, beta, gamma]\n"
    "constraints: {loop: [x_B = d + c*cos(gamma), z_B = c*sin(gamma)]}\n"
)


def test_given_values_on_a_closure_stay() -> None:
    found = start(RING + "initial: {x: 0.6, z: 0.8, dot(x): 1, dot(z): -0.75}")
    assert found == InitialState((0.6, 0.8), (1.0, -0.75), 0.0)


def test_the_closure_gives_what_is_missing() -> None:
    assert start(RING + "initial: {x: 0.6}\nnear: {z: -0.5}").positions == (0.6, -0.8)
    found = start(RING + "initial: {x: 0.6, z: 0.8, dot(x): 1}")
    assert found.velocities == pytest.approx((1.0, -0.75), rel=1e-15)


def test_several_configurations_are_listed() -> None:
    problem = refusal(RING + "initial: {x: 0.6}")
    assert problem.rule == "initial-ambiguous"
    assert "z: 0.8" in problem.hint
    assert "z: -0.8" in problem.hint


def test_positions_that_agree_in_twelve_digits_stay_in_a_hint() -> None:
    """A wrong velocity does not question positions that are off by 1e-12 of the length."""
    x, z = 1.2e6, -1.6e6 * (1 + 1e-12)
    text = ROD.replace("l: 2", "l: 2e6")
    problem = refusal(text + f"initial: {{x: {x!r}, z: {z!r}, dot(x): 1, dot(z): 1}}")
    assert problem.rule == "initial-inconsistent"
    assert f"x: {x!r}, z: {z!r}" in problem.hint


@pytest.mark.slow
def test_an_assembly_of_links_is_chosen_by_near() -> None:
    """One angle is given; two triangles close the linkage."""
    problem = refusal(LINKS + "initial: {alpha: 1}")
    assert problem.rule == "initial-ambiguous"
    assert problem.hint.count("beta") == 2
    text = LINKS + "initial: {alpha: 1, dot(alpha): 2}\nnear: {beta: %s, gamma: %s}"
    for beta, gamma, sign in (("0.3", "1.5", 1), ("-1", "-2", -1)):
        alpha, b, c = start(text % (beta, gamma)).positions
        assert alpha == 1.0
        assert math.cos(1) + 3 * math.cos(b) == pytest.approx(3 + 2 * math.cos(c), abs=1e-14)
        assert math.sin(1) + 3 * math.sin(b) == pytest.approx(2 * math.sin(c), abs=1e-14)
        assert sign * math.sin(c) > 0


def test_missing_velocities_of_closures_have_the_least_kinetic_energy() -> None:
    """A rod that is drawn at one end along a line: least ½ Σ m v², not least Σ v²."""
    text = (
        "plane: xz\nparticles:\n  a: {mass: 1, position: [x, y, z]}\n"
        "  b: {mass: 5, position: [u, v, w]}\n"
        "constraints: {rod: {distance: [a, b], equals: 5}}\n"
        "initial: {x: 0, z: 0, u: 3, w: 4, dot(x): 1}\n"
    )
    found = derived(text).system.initial
    assert found is not None
    weights, row = np.array([1.0, 5.0, 5.0]), np.array([-4.0, 3.0, 4.0])  # z, u, w
    expected = row / weights
    expected *= 3.0 / (row @ expected)
    assert found.velocities == pytest.approx((1.0, *expected), rel=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize(
    "initial",
    [
        "x: 0.6, z: 0.80001",
        "x: 2",
        "x: 2, z: 2",
        "x: 0.6, z: 0.8, dot(x): 1, dot(z): 1",
        "x: 0.6, z: 0.8, dot(x): 1, dot(z): -0.75000001",
    ],
)
def test_values_beside_a_closure_are_refused(initial: str) -> None:
    problem = refusal(RING + f"initial: {{{initial}}}")
    assert problem.rule == "initial-inconsistent"
    assert problem.mark is not None
    assert "'ring'" in problem.message


def test_a_small_violation_of_a_closure_is_projected() -> None:
    found = start(RING + "initial: {x: 0.6, z: 0.8000000001}")
    assert math.hypot(*found.positions) == pytest.approx(1, abs=1e-15)
    assert 3e-11 < found.projected < 1e-10
    tiny = RING.replace("l: 1", "l: 1e-9")
    assert refusal(tiny + "initial: {x: 0.6e-9, z: 0.80001e-9}").rule == "initial-inconsistent"


def test_what_closures_leave_open_is_named() -> None:
    problem = refusal(RING + "initial: {dot(x): 1}")
    assert problem.rule == "initial-missing"
    assert "'x', 'z'" in problem.message


def test_a_start_where_a_definition_divides_by_zero() -> None:
    """x = z³/(z³ − sin² z) is 0/0 at z = 0, and so is its rate."""
    problem = refusal(
        "plane: xz\nparticles: {bead: {mass: 1, position: [x, y, z]}}\ncoordinates: [z]\n"
        "definitions: {x: z^3/(z^3 - sin(z)^2)}\ninitial: {z: 0, dot(x): -1}\n"
    )
    assert (problem.rule, problem.mark.line) == ("singular", 6)
    assert "singular at the initial configuration" in problem.message


def test_a_solution_that_divides_by_what_vanishes_at_the_start() -> None:
    problem = refusal(CURVE % "x*sin(z)^2 = (x-1)*z^3" + "initial: {x: 1, z: 0, dot(x): -1}\n")
    assert problem.rule == "singular"
    assert "'curve'" in problem.message


@pytest.mark.parametrize(
    ("curve", "x", "z", "free"),
    [
        ("z*exp(x) = z", 0, 1, "z"),
        ("z*exp(x) + sin(z) = 0", 3, 0, "x"),
        ("z*(exp(x) - 1)*cos(x) = 0", 0, 2, "z"),
    ],
)
def test_equations_divided_by_what_vanishes_at_the_start(
    curve: str, x: float, z: float, free: str
) -> None:
    """The point satisfies them, whatever a solution for one name says."""
    e = derived(CURVE % curve + f"initial: {{x: {x}, z: {z}, dot({free}): 1}}\n")
    assert e.derivation.account.dof == 1
    values = dict(
        zip([c.name for c in e.system.coordinates], e.system.initial.positions, strict=True)
    )
    assert values == {n: v for n, v in {"x": x, "z": z}.items() if n in values}
    assert free in values


def test_a_triple_zero_is_called_singular() -> None:
    """sin x − x = −x³/6 + …: the point satisfies it, and its gradient vanishes."""
    problem = refusal(CURVE % "sin(x) = x" + "initial: {x: 0, z: 1}\n")
    assert problem.rule == "singular"
    assert "its gradient vanishes" in problem.message


def test_a_start_outside_the_domain_of_a_closure() -> None:
    problem = refusal(CURVE % "log(x)*x = z + sin(z)*x*z" + "initial: {x: -1, z: 0}\n")
    assert problem.rule == "inconsistent"
    assert problem.mark.line == 4


BOARD = """
particles: {board: {mass: 6, position: [x, y, 0]}}
coordinates: [x, y, theta, psi]
kinetic: {turning: 0.02*dot(theta)^2, rotor: 0.01*(dot(theta) + dot(psi))^2}
constraints:
  back: dot(y)*cos(theta + 0.4) - dot(x)*sin(theta + 0.4) = 0.2*cos(0.4)*dot(theta)
  front: dot(y)*cos(theta - 0.4) - dot(x)*sin(theta - 0.4) = -0.2*cos(0.4)*dot(theta)
initial: {x: 0, y: 0, theta: 0, psi: 0, dot(x): 0.3, dot(psi): 2}
"""


def test_zeros_that_are_solved_for_are_zeros() -> None:
    initial = start(BOARD)
    names = dict(zip(("x", "y", "theta", "psi"), initial.velocities, strict=True))
    assert names["y"] == 0
    assert names["x"] == 0.3
    assert names["theta"] == pytest.approx(-0.3 * math.tan(0.4) / 0.2)


@pytest.mark.parametrize("size", ["1e-30", "-1e-66", "1e-200"])
def test_small_numbers_that_are_solved_for_stay(size: str) -> None:
    """Neither given ones nor those that follow from them are taken for rounding."""
    initial = start(
        "particles: {p: {mass: 1, position: [x, y, z]}}\n"
        "constraints: {track: z = 0, curve: y + y^5 = x + x^7}\n"
        f"initial: {{x: {size}, dot(x): 3}}\n"
    )
    assert initial.positions == pytest.approx((float(size), float(size)), rel=1e-15)
    assert initial.velocities == pytest.approx((3.0, 3.0), rel=1e-15)


@pytest.mark.parametrize("size", ["1", "1e-9", "1e9"])
def test_a_place_at_the_origin_is_one_configuration(size: str) -> None:
    """What a converged search leaves of zero does not tell configurations apart."""
    incline = (
        f"parameters: {{al: pi/6, l: {size}}}\nparticles: {{p: {{mass: 1, position: [x, 0, z]}}}}\n"
        "coordinates: [s]\ndefinitions: {x: l*s*cos(al), z: -l*s*sin(al)}\n"
    )
    (position,) = start(incline + "initial: {x: 0}").positions
    assert abs(position) < 1e-30


def test_close_configurations_at_the_origin_of_a_name_stay_apart() -> None:
    ring = ROD.replace("l: 2", "l: 1e-14") + "initial: {z: 0}"
    assert refusal(ring).rule == "initial-ambiguous"


@pytest.mark.slow
@pytest.mark.parametrize("power", [-40, 0, 50])
def test_a_start_at_the_pole_of_a_sphere_of_any_size(power: int) -> None:
    e = derived(
        f"parameters: {{m: 1, l: {{value: 2^({power}), positive: true}}}}\n"
        "particles: {bob: {mass: m, position: [x, y, z]}}\n"
        "coordinates: [theta, phi]\n"
        "definitions: {x: l*sin(theta)*cos(phi), y: l*sin(theta)*sin(phi), z: -l*cos(theta)}\n"
        "initial: {x: 0, y: 0, z: -l, dot(x): 4*l, dot(y): 3*l}\n"
    )
    assert e.system.initial is not None
    assert [c.name for c in e.system.coordinates] == ["x", "y", "z"]
    assert e.system.initial.velocities == (4 * 2.0**power, 3 * 2.0**power, 0)
