"""Loss of contacts in symbols: textbook results, and the events of shipped scenes."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from lagrange_cli.analysis.contacts.loss import ContactLoss, ContactLosses
from lagrange_cli.api import load, loads
from lagrange_cli.errors import InputError

POLAR = """\
name: {name}
parameters: {{m: 1.0, g: 9.81, R: {{value: 1.0, positive: true}}, v0: {v0}, c: 0.1, B: 0.3}}
coordinates: {{r: {{}}, theta: {{}}}}
particles: {{p: {{mass: m, position: [r*sin(theta), 0, {height}*r*cos(theta)]}}}}
constraints: {{wall: {wall}}}
potentials: {{weight: {{gravity: g}}{potential}}}
{more}
initial: {{r: R, theta: {theta}, dot(theta): {rate}}}
"""


def scene(wall: str = "r >= R", theta: str = "0", rate: str = "v0/R", **changed: str) -> str:
    words = {"v0": "1.0", "height": "1", "potential": "", "more": "", "name": "polar", **changed}
    return POLAR.format(wall=wall, theta=theta, rate=rate, **words)


def polar(wall: str = "r >= R", **changed: str) -> ContactLosses:
    return losses(scene(wall, **changed))


def losses(text: str) -> ContactLosses:
    found = loads(text).derive().analyze("contacts").contacts
    assert found is not None
    return found


def only(found: ContactLosses) -> ContactLoss:
    (contact,) = found.contacts
    return contact


def same(found: sp.Expr, text: str) -> bool:
    """Compare with a text over the same names, whatever is declared of these."""
    symbols = {s.name: s for s in found.free_symbols}
    return bool(sp.simplify(found - sp.sympify(text, symbols)) == 0)


def test_a_hemisphere_with_a_speed_at_the_top() -> None:
    (zero,) = only(polar()).zeros
    assert zero.left.func is sp.cos
    assert same(zero.right, "2/3 + v0**2/(3*g*R)")


def test_a_loop_is_left_above_its_middle() -> None:
    contact = only(polar("r <= R", height="-1", v0="6.0"))
    assert same(contact.force, "m*(3*g*cos(theta) - 2*g + v0**2/R)")
    assert same(contact.zeros[0].right, "(2*g*R - v0**2)/(3*g*R)")
    assert contact.at_start == pytest.approx(9.81 + 36)


def test_a_cosine_above_one_is_no_place() -> None:
    contact = only(polar("r <= R", height="-1", v0="9.0"))
    assert contact.zeros == ()
    assert not contact.reason


def test_a_contact_that_pulls_is_lost_at_once() -> None:
    assert (only(polar(v0="4.0")).at_start or 0) < 0


def test_a_decimal_of_the_start_has_a_name() -> None:
    found = polar(theta="0.2", rate="0")
    (constant,) = found.constants
    assert (constant.symbol.name, constant.value) == ("theta_0", 0.2)
    assert same(only(found).zeros[0].right, "2/3*cos(theta_0)")


def test_the_energy_stands_for_decimals_of_velocities() -> None:
    found = polar(theta="0.2", rate="0.3")
    assert [c.symbol.name for c in found.constants] == ["E"]
    (zero,) = only(found).zeros
    assert same(zero.right, "2*E/(3*m*g*R)")
    assert zero.number == pytest.approx((2 * 9.81 * math.cos(0.2) + 0.3**2) / (3 * 9.81))


def test_friction_leaves_the_velocity() -> None:
    contact = only(polar(more="dissipation: {air: c*dot(theta)^2}"))
    assert "no energy" in contact.reason
    assert not contact.zeros


def test_a_magnetic_force_leaves_the_velocity() -> None:
    contact = only(polar(potential=", field: B*r^2*dot(theta)/2"))
    assert "energy and conserved momenta" in contact.reason


CARTESIAN = """\
name: cartesian
parameters: {{m: 1.0, g: 9.81, a: {{value: 1.0, positive: true}},
  b: {{value: 2.0, positive: true}}, v0: 0.4, F: 2.0}}
plane: {plane}
particles: {{p: {{mass: m, position: [x, y, z]}}}}
constraints: {{wall: "{wall}"}}
potentials: {{weight: {{gravity: g}}}}
{more}
initial: {{x: 0, z: {z}, dot(x): {speed}}}
"""


def cartesian(
    wall: str, z: str, plane: str = "xz", speed: str = "v0", more: str = ""
) -> ContactLoss:
    return only(losses(CARTESIAN.format(wall=wall, z=z, plane=plane, speed=speed, more=more)))


@pytest.mark.slow
def test_a_cubic_condition_is_printed_as_it_is() -> None:
    (zero,) = cartesian("x^2/a^2 + z^2/b^2 >= 1", "b").zeros
    assert zero.right == 0
    assert zero.number is None
    assert same(zero.left, "g*(a**2 - b**2)*z**3 + 3*g*b**4*z - b**4*(2*g*b + v0**2)")


@pytest.mark.slow
def test_a_distance_is_a_gap_as_its_square_is() -> None:
    contact = cartesian("sqrt(x^2 + (z - a)^2) >= b", "a + b")
    assert same(contact.force, "m*(3*g*z - (a + 2*(a + b))*g - v0**2)/b")
    assert same(contact.zeros[0].right, "a + 2*b/3 + v0**2/(3*g)")


def test_a_high_multiple_of_an_angle_is_not_multiplied_out() -> None:
    """cos 4000 θ as a polynomial in cos θ would have thousands of terms."""
    contact = only(polar(potential=", ripple: c*cos(4000*theta)"))
    assert contact.force.has(sp.cos)
    assert not contact.reason


@pytest.mark.slow
def test_a_divisor_that_is_zero_leaves_the_condition() -> None:
    """On an ellipse with equal axes the cubic term of the condition is zero."""
    found = losses(
        CARTESIAN.format(
            wall="x^2/a^2 + z^2/b^2 >= 1", z="b", plane="xz", speed="v0", more=""
        ).replace("value: 2.0", "value: 1.0")
    )
    (zero,) = only(found).zeros
    assert zero.right == 0
    growing = "forces: {lift: {on: p, force: [0, 0, (F - 2)*t]}}"
    (zero,) = cartesian("z >= 0", "0", more=growing).zeros
    assert zero.number is None


def test_a_parabola_is_left_nowhere_or_at_once() -> None:
    assert cartesian("z >= -a*x^2", "0").zeros == ()
    assert (cartesian("z >= -a*x^2", "0", speed="10*v0").at_start or 0) < 0


def test_a_growing_lift_takes_a_block_off_the_floor() -> None:
    more = "forces: {lift: {on: p, force: [0, 0, F*t]}}"
    (zero,) = cartesian("z >= 0", "0", more=more).zeros
    assert zero.left.name == "t"
    assert zero.number == pytest.approx(9.81 / 2)


@pytest.mark.slow
def test_the_energy_suffices_on_a_sphere_in_space() -> None:
    text = CARTESIAN.replace("plane: {plane}\n", "").replace("{{x: 0,", "{{x: 0, y: 0,")
    wall = "x^2 + y^2 + z^2 >= b^2"
    (zero,) = only(losses(text.format(wall=wall, z="b", speed="v0", more=""))).zeros
    assert same(zero.right, "(2*g*b + v0**2)/(3*g)")


def test_the_angle_that_the_scene_puts_out_is_named() -> None:
    found = load("systems/contact/particle_leaving_sphere.yaml").derive().analyze()
    assert "cos θ = ⅔ cos θ0" in found.text()
    (closed,) = found.report()["contacts"]["closed"]
    (zero,) = closed["zeros"]
    assert zero["condition"] == "z = 2/3*R*cos(theta0)"
    assert zero["angle"] == "cos(theta) = 2/3*cos(theta0)"


def test_documents_name_the_constants_of_the_start() -> None:
    found = loads(scene(theta="0.2", rate="0")).derive().analyze("contacts")
    text = found.emit("latex")["polar.tex"]
    assert r"\cos \theta = \frac{2}{3} \cos \theta_{0} = 0.653378" in text


def test_scenes_without_contacts_are_refused() -> None:
    pendulum = load("systems/pendulums/pendulum.yaml").derive()
    with pytest.raises(InputError, match="no constraint of the scene is one-sided"):
        pendulum.analyze("contacts")
    assert pendulum.analyze("symmetries").contacts is None


def test_a_ball_that_rolls_leaves_later() -> None:
    rolling = 'kinetic: {spin: "1/5*m*R^2*dot(theta)^2"}'
    (zero,) = only(polar(theta="0.2", rate="0", more=rolling)).zeros
    assert same(zero.right, "10/17*cos(theta_0)")


@pytest.mark.slow
def test_a_dome_that_slides_needs_momentum_and_energy() -> None:
    text = scene(theta="0.2", rate="0").replace("{r: {}", "{X: {}, r: {}").replace("[r*", "[X + r*")
    text = text.replace("particles: {", "particles: {dome: {mass: m, position: [X, 0, 0]}, ")
    contact = only(losses(text.replace("initial: {", "initial: {X: 0, ")))
    (zero,) = contact.zeros
    assert same(zero.left, "4*cos(theta_0) - 6*cos(theta) + cos(theta)**3")
    here = {"m": 1.0, "g": 9.81, "theta": 0.2, "theta_0": 0.2}
    value = contact.force.xreplace({s: sp.Float(here[s.name]) for s in contact.force.free_symbols})
    assert float(value) == pytest.approx(contact.at_start)


def test_an_input_may_make_the_force_jump() -> None:
    more = "inputs: {u: 2}\nforces: {push: {on: p, force: [0, 0, u]}}"
    contact = cartesian("x^2 + z^2 >= b^2", "b", more=more)
    assert contact.jumps
    assert contact.at_start == pytest.approx((9.81 - 2) / 4 - 0.4**2 / 8)


def test_a_kink_of_a_potential_is_reduced_around() -> None:
    """The square of a coordinate is replaced beside |x|, which is no polynomial."""
    bent = losses(
        CARTESIAN.format(wall="x^2 + z^2 >= b^2", z="b", plane="xz", speed="v0", more="").replace(
            "{gravity: g}", "{gravity: g}, well: F*abs(x)"
        )
    )
    assert not only(bent).reason
    assert only(bent).jumps
