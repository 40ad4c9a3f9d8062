"""Equilibria against closed forms from books, and what is said of those that are not known."""

from __future__ import annotations

import json
import math

import pytest
import sympy as sp

from lagrange_cli.analysis.equilibria.rest_system import rest_system
from lagrange_cli.analysis.equilibria.search import polished
from lagrange_cli.analysis.equilibria.single_equation import real_roots
from lagrange_cli.api import loads
from lagrange_cli.errors import InputError
from tests.cli.terminal import succeed
from tests.systems.shipped import SYSTEMS

HOOP = (SYSTEMS / "beads" / "bead_on_rotating_hoop.yaml").read_text()


def analyzed(text, *parts, parameters=None, at=None):
    return loads(text, parameters=parameters).derive().analyze(*parts, at=at)


def verdicts(analysis):
    return {
        tuple(round(float(x), 9) for x in point.position): point.stability.verdict
        for point in analysis.equilibria.points
    }


def test_hoop_above_its_critical_rate():
    found = analyzed(HOOP)
    angle = math.acos(9.81 / (0.3 * 8.0**2))
    assert found.equilibria.complete
    assert verdicts(found) == {
        (round(angle, 9),): "stable",
        (round(-angle, 9),): "stable",
        (0.0,): "unstable",
        (round(math.pi, 9),): "unstable",
    }
    exact = {str(point.exact[0]) for point in found.equilibria.points}
    assert exact == {"acos(g/(R*omega**2))", "-acos(g/(R*omega**2))", "0", "pi"}


def test_hoop_below_its_critical_rate():
    found = analyzed(HOOP, parameters={"omega": 5})
    assert verdicts(found) == {(0.0,): "stable", (round(math.pi, 9),): "unstable"}
    assert len(found.equilibria.absent) == 2
    (condition,) = found.equilibria.absent[0].conditions
    assert (str(condition.smaller), str(condition.larger)) == ("Abs(g)", "R*omega**2")


def test_hoop_at_its_critical_rate_is_decided_by_the_fourth_order():
    found = analyzed(HOOP, parameters={"omega": "sqrt(g/R)"})
    assert verdicts(found) == {(0.0,): "stable", (round(math.pi, 9),): "unstable"}
    point = next(p for p in found.equilibria.points if not p.position[0])
    assert "higher order" in point.stability.reason


@pytest.mark.parametrize(("near", "angle"), [(6.2, 0), (-12.6, 0), (-3, math.pi), (9.5, math.pi)])
def test_equilibria_reached_in_another_turn_are_those_of_the_first(near, angle):
    system = rest_system(loads(HOOP).derive().equations, {})
    (reached,) = polished(system, [near]).position
    assert float(reached) == pytest.approx(angle, abs=1e-15)


def turning(potential, coordinate="theta"):
    return f"""\
coordinates: {{{coordinate}}}
kinetic: {{T: dot(theta)^2/2}}
potentials: {{V: {potential}}}
near: {{theta: 0.1}}
"""


def plane(potential, y):
    return f"""\
coordinates: [x, y]
kinetic: {{T: (dot(x)^2 + dot(y)^2)/2}}
potentials: {{V: {potential}}}
initial: {{x: 0.1, y: {y}}}
"""


@pytest.mark.parametrize("y", [0.2, 1, 2])
def test_one_verdict_along_a_line_is_given_if_small_motions_do_not_change(y):
    (point,) = analyzed(plane("(y^2 - 1)*x^2", y)).equilibria.points
    assert (point.free, point.stability.verdict) == (("y",), "undecided")
    (point,) = analyzed(plane("x^3*y - x^2", y)).equilibria.points
    assert (point.free, point.stability.verdict) == (("y",), "unstable")


def test_points_of_lines_of_equilibria_are_not_isolated(tmp_path):
    scene = tmp_path / "cross.yaml"
    scene.write_text(plane("x^2*y^2", 1))
    points = json.loads(succeed("analyze", str(scene), "--equilibria", "--json"))["equilibria"]
    assert [(p["free"], p["isolated"]) for p in points] == [(["y"], False), (["x"], False)]


@pytest.mark.parametrize("coordinate", ["theta: {}", "theta: {unit: rad}"])
def test_roots_of_angles_with_radicals_are_not_lost(coordinate):
    """cos θ is put for sin θ: 4 sin² θ − 5 sin θ − 2 = 0, of which one root is a sine."""
    found = analyzed(turning("-cos(theta) + sin(2*theta)/5", coordinate)).equilibria
    angle = math.asin((5 - math.sqrt(57)) / 8)
    assert found.complete
    assert [float(p.position[0]) for p in found.points] == [
        pytest.approx(angle, rel=1e-14),
        pytest.approx(math.pi - angle, rel=1e-14),
    ]


def test_a_coordinate_without_places_is_an_angle_where_all_terms_repeat():
    found = analyzed(turning("-cos(theta)", "theta: {}")).equilibria
    assert found.complete
    assert [float(p.position[0]) for p in found.points] == [0, pytest.approx(math.pi)]


@pytest.mark.parametrize("coordinate", ["theta: {unit: m}", "theta: {}", "theta: {unit: rad}"])
def test_a_turn_apart_is_elsewhere_where_a_term_or_the_unit_says_so(coordinate):
    """With an inertia of 1 + θ² a turn changes the equations of motion, not the forces at rest."""
    text = turning("-cos(theta)", coordinate)
    if "unit: m}" not in coordinate:
        text = text.replace("dot(theta)^2/2", "(1 + theta^2)*dot(theta)^2/2")
    found = analyzed(text).equilibria
    assert not found.complete
    assert sum(p.stability.verdict == "stable" for p in found.points) > 1


def quartic(potential):
    return f"""\
particles: {{ball: {{mass: 2, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{well: {potential}}}
initial: {{x: 0.1}}
"""


@pytest.mark.parametrize(
    ("potential", "verdict"),
    [
        ("x^4", "stable"),
        ("-x^4", "unstable"),
        ("x^3", "unstable"),
        ("x^6 + x^7", "stable"),
        ("x^2 - x^4", "stable"),
        ("-x^2", "unstable"),
    ],
)
def test_degenerate_minima(potential, verdict):
    found = analyzed(quartic(potential))
    here = next(p for p in found.equilibria.points if not p.position[0])
    assert here.stability.verdict == verdict


@pytest.mark.parametrize(("sign", "verdict"), [("-", "unstable"), ("+", "stable")])
def test_degenerate_direction_in_two_coordinates(sign, verdict):
    """y follows x² along the null direction: x⁴ (1 − 2) against x⁴ (1 + 1/2)."""
    energy = "x^4 + (y^2 - 2*x^2*y)" if sign == "-" else "x^4 + y^2 + x^2*y"
    if sign == "-":
        energy = "x^4 + 2*y^2 - 4*x^2*y"  # y = x²: 1 + 2 − 4 = −1
    scene = f"""\
particles: {{ball: {{mass: 1, position: [x, y, 0]}}}}
coordinates: [x, y]
potentials: {{well: {energy}}}
initial: {{x: 0.1, y: 0}}
"""
    here = next(
        p for p in analyzed(scene).equilibria.points if not p.position[0] and not p.position[1]
    )
    assert here.stability.verdict == verdict


@pytest.mark.slow
def test_lagranges_five_points():
    """Collinear points: roots of Euler's quintic by bisection of the force; the others exact."""
    found = analyzed((SYSTEMS / "celestial" / "arenstorf_orbit.yaml").read_text())
    mu = 0.012277471

    def force(x):
        earth, moon = x + mu, x - 1 + mu
        return x - (1 - mu) * earth / abs(earth) ** 3 - mu * moon / abs(moon) ** 3

    def bisected(low, high):
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if force(middle) * force(low) > 0 else (low, middle)
        return low

    collinear = [bisected(*ends) for ends in ((-1.5, -0.5), (0.1, 0.95), (1.0, 2.0))]
    expected = {(round(x, 9), 0.0): "unstable" for x in collinear}
    for y in (1, -1):
        place = round(0.5 - mu, 9), round(y * math.sqrt(3) / 2, 9)
        expected[place] = "stable in the linear approximation"
    assert verdicts(found) == expected
    assert not found.equilibria.complete
    assert found.equilibria.starts > 0


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "stable"), [(0.0384, True), (0.0386, False)])
def test_rouths_mass_ratio(mu, stable):
    """Routh: mu < (1 − √(23/27))/2 = 0.03852."""
    scene = (SYSTEMS / "celestial" / "arenstorf_orbit.yaml").read_text()
    found = analyzed(scene, "equilibria", parameters={"mu": mu})
    triangular = [p for p in found.equilibria.points if abs(p.position[1]) > 0.1]
    expected = "stable in the linear approximation" if stable else "unstable"
    assert [p.stability.verdict for p in triangular] == [expected] * 2


DAMPED = """\
parameters: {m: 1, k: 4, c: 0.5}
particles: {ball: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
dissipation: {drag: c/2*dot(x)^2}
initial: {x: 1}
"""


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ({}, "asymptotically stable"),
        ({"c": 0}, "stable"),
        ({"c": -0.5}, "unstable"),
        ({"k": -4}, "unstable"),
    ],
)
def test_damping(values, verdict):
    found = analyzed(DAMPED, parameters=values)
    assert verdicts(found) == {(0.0,): verdict}


def test_partly_damped_is_stable_and_no_more():
    """The drag holds one of two uncoupled oscillators."""
    scene = """\
particles: {a: {mass: 1, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {springs: 2*x^2 + 3*y^2}
dissipation: {drag: dot(x)^2}
initial: {x: 1, y: 1}
"""
    assert verdicts(analyzed(scene)) == {(0.0, 0.0): "stable"}


def test_rotating_saddle_is_gyroscopically_stable_or_not():
    """x² − y² in axes that turn: K is indefinite, Coriolis forces hold the linear motion."""
    scene = """\
parameters: {W: 3}
particles: {ball: {mass: 1, position: [X, Y, 0]}}
coordinates: [x, y]
definitions:
  X: x*cos(W*t) - y*sin(W*t)
  Y: x*sin(W*t) + y*cos(W*t)
potentials: {saddle: (x^2 - y^2)/2}
initial: {x: 0.1, y: 0.2}
"""
    fast, slow = (analyzed(scene, parameters={"W": w}) for w in (3, 0.5))
    assert verdicts(fast) == {(0.0, 0.0): "stable in the linear approximation"}
    assert verdicts(slow) == {(0.0, 0.0): "unstable"}


@pytest.mark.slow
def test_follower_force_flutters_without_a_negative_direction():
    """Ziegler's column: masses 2m and m, P along the last link; P > 2.086 k/l flutters."""
    scene = """\
parameters: {m: 1, l: 1, k: 1, P: 1}
particles:
  a: {mass: 2*m, position: [l*cos(p), l*sin(p), 0]}
  b: {mass: m, position: [l*cos(p) + l*cos(q), l*sin(p) + l*sin(q), 0]}
coordinates: [p, q]
potentials: {joints: k*p^2/2 + k*(q - p)^2/2}
forces: {follower: {on: b, force: [-P*cos(q), -P*sin(q), 0]}}
initial: {p: 0.01, q: 0}
"""
    critical = 7 / 2 - math.sqrt(2)
    for load, verdict in (
        (critical - 0.01, "stable in the linear approximation"),
        (critical + 0.01, "unstable"),
    ):
        found = analyzed(scene, parameters={"P": load})
        here = next(p for p in found.equilibria.points if max(map(abs, p.position)) < 1e-9)
        assert here.stability.verdict == verdict


def test_cyclic_coordinates_are_free_and_may_drift():
    found = analyzed((SYSTEMS / "pendulums" / "pendulum_on_cart.yaml").read_text())
    hanging = next(p for p in found.equilibria.points if not p.position[1])
    assert hanging.free == ("x",)
    assert hanging.stability.verdict == "stable but for drift"


def test_inputs_that_do_no_work_at_rest_leave_the_verdict_of_a_free_cart():
    scene = """\
inputs: {F: 0}
coordinates: [x]
kinetic: {cart: dot(x)^2/2}
forces: {push: {on: x, force: F}}
"""
    (point,) = analyzed(scene).equilibria.points
    assert point.stability.verdict == "stable but for drift"
    assert str(point.stability.reason) == "no force acts; x may drift"


QUADROTOR = """\
parameters: {m: 0.5, J: 0.01, d: 0.2, g: 9.81}
inputs: {F1: m*g/2, F2: m*g/2}
coordinates: [x, z, theta]
kinetic: {T: m*(dot(x)^2 + dot(z)^2)/2 + J*dot(theta)^2/2}
potentials: {weight: m*g*z}
forces:
  sideways: {on: x, force: -(F1 + F2)*sin(theta)}
  upward: {on: z, force: (F1 + F2)*cos(theta)}
  turning: {on: theta, force: d*(F1 - F2)}
"""


def test_a_hovering_quadrotor_drifts_ever_faster():
    """Tilted by an angle that stays, it accelerates by -g sin(theta) for ever."""
    (point,) = analyzed(QUADROTOR).equilibria.points
    assert point.free == ("x", "z")
    assert point.stability.verdict == "unstable"
    reason = str(point.stability.reason)
    assert reason == "beside its rest theta may stay, and x, z drift ever faster"
    righted = QUADROTOR.replace("d*(F1 - F2)", "d*(F1 - F2) - theta/10")
    (held,) = analyzed(righted).equilibria.points
    assert held.stability.verdict == "undecided"


def test_the_lever_is_in_balance_by_its_law():
    """At any angle where a m g = b F, else only along the forces: cos θ = 0."""
    scene = (SYSTEMS / "lecture" / "lever.yaml").read_text()
    balanced = analyzed(scene)
    (anywhere,) = balanced.equilibria.points
    assert anywhere.free == ("theta",)
    (law,) = anywhere.conditions
    assert (str(law.smaller), law.relation, str(law.larger)) == ("a*g*m", "=", "F*b")
    heavier = analyzed(scene, parameters={"F": 5})
    assert {round(float(p.position[0]), 9) for p in heavier.equilibria.points} == {
        round(math.pi / 2, 9),
        round(-math.pi / 2, 9),
    }
    assert [a.conditions for a in heavier.equilibria.absent] == [anywhere.conditions]


def test_atwoods_machine_is_in_balance_with_equal_masses():
    scene = (SYSTEMS / "pulleys" / "atwood.yaml").read_text()
    apart = analyzed(scene)
    assert apart.equilibria.points == ()
    assert apart.equilibria.complete
    (law,) = apart.equilibria.absent[0].conditions
    assert (str(law.smaller), law.relation, str(law.larger)) == ("m1", "=", "m2")
    masses = {p.name: p.value for p in apart.equations.system.parameters}
    equal = analyzed(scene, parameters={"m1": masses["m2"]})
    assert [len(p.free) for p in equal.equilibria.points] == [1]


def test_springs_that_cancel_leave_no_equation():
    scene = """\
parameters: {a: 3, b: 3}
particles: {ball: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {springs: a/2*x^2 - b/2*x^2}
initial: {x: 1}
"""
    anywhere = analyzed(scene)
    assert [p.free for p in anywhere.equilibria.points] == [("x",)]
    there = analyzed(scene, parameters={"b": 2})
    assert [p.free for p in there.equilibria.points] == [()]


@pytest.mark.parametrize("size", ["1e400", "-1e400"])
def test_numbers_beyond_doubles_are_searched_without_an_end_in_overflow(size):
    scene = """\
parameters: {k: 2, l: 0.5}
plane: xz
particles: {b: {mass: 1, position: [x, 0, z]}}
points: {o: [SIZE, 0, 0]}
coordinates: [x, z]
potentials: {v: k*x^2/2, c: {spring: [o, b], stiffness: 3, length: l}}
initial: {x: 0.3, z: 0.2}
"""
    found = analyzed(scene.replace("SIZE", size), "equilibria").equilibria
    assert found.points == ()
    assert not found.complete


def test_an_unknown_that_cancels_beyond_the_budget_of_polynomials_is_not_solved_for():
    x, k = sp.symbols("x k", real=True)
    long = k * sp.Integer(10) ** 400
    assert real_roots(k * (x + 3) + long - k * x, x, is_angle=False) is None
    (root,) = real_roots(k * (x + 3) + long - 2 * k * x, x, is_angle=False).roots
    assert sp.simplify(root.value - 3 - 10**400) == 0


@pytest.mark.parametrize("size", [4000, 10**300])
def test_sines_of_high_multiples_are_not_multiplied_out(size):
    """sin(10^300 l) as a polynomial in sin l would have more terms than there is memory for."""
    u, c = sp.symbols("u l", real=True)
    assert real_roots(sp.sin(u) - sp.sin(size * c), u, is_angle=True) is not None
    assert real_roots(sp.sin(size * u) - c, u, is_angle=True) is None


def test_pendulum_in_cartesian_coordinates_has_forces_of_its_rod():
    scene = (SYSTEMS / "constraints" / "pendulum_in_cartesian_coordinates.yaml").read_text()
    found = analyzed(scene)
    assert found.equilibria.complete
    assert verdicts(found) == {(0.0, -1.0): "stable", (0.0, 1.0): "unstable"}


def test_nothing_holds_a_falling_body():
    scene = """\
particles: {ball: {mass: 1, position: [x, y, z]}}
coordinates: [x, y, z]
potentials: {weight: {gravity: 9.81}}
initial: {x: 0, y: 0, z: 0}
"""
    found = analyzed(scene)
    assert found.equilibria.points == ()
    assert found.equilibria.complete
    assert [left.part for left in found.left_out] == ["linearization", "modes"]


@pytest.mark.slow
def test_polar_coordinates_show_each_place_once():
    """(r, φ) and (−r, φ + π) are one place."""
    found = analyzed((SYSTEMS / "celestial" / "trojan_asteroid.yaml").read_text())
    regular = [p for p in found.equilibria.points if "singular" not in p.stability.reason]
    assert len(regular) == 5


def test_dry_friction_is_not_smooth_at_rest():
    scene = """\
particles: {ball: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: x^2}
forces: {friction: {on: x, force: -sign(dot(x))}}
initial: {x: 1}
"""
    found = analyzed(scene)
    assert [p.stability.verdict for p in found.equilibria.points] == ["undecided"]


def test_time_is_said_to_be_the_reason():
    scene = (SYSTEMS / "pendulums" / "kapitza_pendulum.yaml").read_text()
    found = analyzed(scene)
    assert [left.part for left in found.left_out] == ["equilibria", "linearization", "modes"]
    assert "depend on t" in found.left_out[0].reason
    with pytest.raises(InputError, match="depend on t"):
        analyzed(scene, "equilibria")


def test_without_values_closed_forms_are_kept():
    text = HOOP.replace("omega: {value: 8.0, ", "omega: {")
    found = analyzed(text)
    assert len(found.equilibria.points) == 4
    assert all(p.position is None for p in found.equilibria.points)
    assert "'omega'" in found.left_out[0].reason


def test_inputs_are_held():
    scene = """\
parameters: {k: 4}
inputs: {u: sin(t)}
particles: {ball: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*(x - u)^2/2}
initial: {x: 1}
"""
    assert analyzed(scene).equilibria.held_inputs == (("u", 0.0),)
    held = analyzed(scene, at={"u": "k/2"})
    assert verdicts(held) == {(2.0,): "stable in the linear approximation"}
    assert held.equilibria.held_inputs == (("u", 2.0),)


def test_states_with_two_values_are_held_beside_inputs():
    scene = """\
inputs: {u: sin(t)}
coordinates: [x]
kinetic: {block: dot(x)^2/2}
potentials: {spring: x^2}
states: {r: {on: x <= -1, off: x >= 2}}
forces: {push: {on: x, force: u + r}}
initial: {x: 0, r: 1}
"""
    found = analyzed(scene, "equilibria")
    assert verdicts(found) == {(0.5,): "stable in the linear approximation"}
    assert "Inputs are held at u = 0." in found.text()
    assert "States with two values are held at r = 1." in found.text()
    assert "Les états à deux valeurs sont maintenus à r = 1." in found.text(language="fr")


@pytest.mark.parametrize(
    ("at", "fragment"),
    [
        ({"thta": 0}, "'thta' is no coordinate and no input"),
        ({"theta": 1.5}, "this is no equilibrium"),
        ({"theta": "theta"}, "this is no number"),
        ({"theta": "1 +"}, "end"),
    ],
)
def test_wrong_configurations_are_refused_at_their_place(at, fragment):
    with pytest.raises(InputError, match=fragment) as refusal:
        analyzed(HOOP, at=at)
    (problem,) = refusal.value.problems
    assert problem.mark is not None
    assert problem.mark.file.startswith("--at th")


def test_positive_coordinates_stay_positive():
    """r and −r would both balance the springs about a circle of radius 2."""
    scene = """\
particles: {ball: {mass: 1, position: [r*cos(phi), r*sin(phi), 0]}}
coordinates: {r: {positive: true}, phi: {}}
potentials: {ring: (r^2 - 4)^2}
initial: {r: 1, phi: 0}
"""
    found = analyzed(scene)
    assert [float(p.position[0]) for p in found.equilibria.points] == [2.0]
    assert found.equilibria.points[0].free == ("phi",)


SKATE = """
name: skate
parameters: {m: 1, I: 0.5, k: 2}
particles: {p: {mass: m, position: [x, y, 0]}}
coordinates: [x, y, phi]
kinetic: {turn: I/2*dot(phi)^2}
potentials: {V: k/2*(x^2 + y^2)}
constraints: {blade: dot(y)*cos(phi) - dot(x)*sin(phi) = 0}
initial: {x: 0.3, y: 0, phi: 0, dot(x): 0, dot(phi): 0.2}
"""

BLOCK = """
name: block
parameters: {m: 1, k: 1, mu: 0.2}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {V: POTENTIAL}
forces: {drag: {on: x, force: FORCE}}
initial: {x: 1, dot(x): 0}
"""


def block(force, potential="k/2*x^2"):
    return loads(BLOCK.replace("FORCE", force).replace("POTENTIAL", potential)).derive()


@pytest.mark.slow
def test_a_skate_rests_where_the_spring_pulls_across_the_blade():
    """x cos φ + y sin φ = 0: the constraint force balances, and differs along the continuum."""
    found = loads(SKATE).derive().analyze("equilibria").equilibria
    assert not found.complete
    assert found.points
    for point in found.points:
        x, y, phi = map(float, point.position)
        assert x * math.cos(phi) + y * math.sin(phi) == pytest.approx(0, abs=1e-12)
        assert point.stability.verdict == "undecided"


@pytest.mark.parametrize(
    ("force", "potential"), [("-mu*sign(dot(x))", "k/2*x^2"), ("0*x", "abs(x) - x/2")]
)
def test_forces_that_jump_hold_more_than_what_is_found(force, potential):
    """Dry friction holds the block at |x| ≤ μ/k, the edge of |x| at 0."""
    derivation = block(force, potential)
    analysis = derivation.analyze()
    assert not analysis.equilibria.complete
    assert {left.part for left in analysis.left_out} == {"linearization", "modes"}
    with pytest.raises(InputError):
        derivation.analyze("modes")


def test_a_drag_of_second_order_has_a_linear_system():
    analysis = block("-mu*abs(dot(x))*dot(x)").analyze()
    assert analysis.equilibria.complete
    assert analysis.linearization.damping.tolist() == [[0.0]]
    assert analysis.modes[0].frequency == pytest.approx(1)
