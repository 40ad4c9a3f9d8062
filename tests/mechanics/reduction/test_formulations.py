"""Forms of a scene: which closures it has in Cartesian names, and which form is taken."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.scene import read_text
from tests.mechanics.mechanics_support import DOUBLE_PENDULUM, POLAR

WEIGHT = "potentials: {weight: {gravity: g}}\n"

SPHERICAL = """
parameters: {m: 1, l: {value: 2, positive: true}, g: 9.81}
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta, phi]
definitions: {x: l*sin(theta)*cos(phi), y: l*sin(theta)*sin(phi), z: -l*cos(theta)}
"""

TORUS = """
parameters: {m: 1, a: 1, R: 3, g: 9.81}
particles: {bead: {mass: m, position: [x, y, z]}}
coordinates: [theta, phi]
definitions:
  x: (R + a*cos(theta))*cos(phi)
  y: (R + a*cos(theta))*sin(phi)
  z: a*sin(theta)
"""

ROOT = """
parameters: {m: 1, l: 1, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [x]
definitions: {z: -sqrt(l^2 - x^2)}
"""

#: Sums of squares up to each coordinate, so that M is full and a closure holds three names.
STAIRS = """
sizes: {n: 12}
parameters: {m: 1, a: 0.5, g: 9.81}
points: {"p[0]": [0, 0, 0]}
particles:
  p[i=1..n]: {mass: m, position: ["x[i]", "0", "z[i]"]}
constraints:
  first: z[1] = a*x[1]^2
  step[i=2..n]: z[i] = z[i-1] + a*x[i]^2
potentials: {weight: {gravity: g}}
"""


def formed(text, formulation="multiplier", **how):
    return derive(read_text("name: formed\n" + text), formulation=formulation, **how)


def refused(text, formulation="multiplier"):
    with pytest.raises(InputError) as caught:
        formed(text, formulation)
    return caught.value.problems[0]


def closures(e):
    return {c.name: sp.expand(c.expression) for c in e.system.closures}


def expr(text, e):
    names = {c.name: c.q for c in e.system.coordinates} | {
        p.name: p.symbol for p in e.system.parameters
    }
    return sp.expand(sp.sympify(text, locals={**names, "t": e.system.t}))


def is_same(closure, text, e):
    """φ = 0 is the equation, up to a number."""
    ratio = sp.cancel(closure / expr(text, e))
    return ratio.is_number and ratio != 0


@pytest.mark.parametrize("potential", [WEIGHT, "potentials: {weight: -m*g*l*cos(theta)}\n"])
def test_sphere(potential):
    """Both angles go, also where the potential is written in one of them."""
    e = formed(SPHERICAL + potential)
    assert [c.name for c in e.system.coordinates] == ["x", "y", "z"]
    assert is_same(closures(e)["bob"], "x**2 + y**2 + z**2 - l**2", e)
    assert sp.expand(e.system.potential - expr("m*g*z", e)) == 0
    assert (e.system.formulation, e.derivation.account.dof, e.derivation.account.constraints) == (
        "multiplier",
        2,
        1,
    )
    assert [c.name for c in e.system.chart.coordinates] == ["theta", "phi"]


def test_chain_of_rods():
    e = formed(DOUBLE_PENDULUM)
    assert [c.name for c in e.system.coordinates] == ["x1", "z1", "x2", "z2"]
    assert is_same(closures(e)["upper"], "x1**2 + z1**2 - l1**2", e)
    assert is_same(closures(e)["lower"], "(x2 - x1)**2 + (z2 - z1)**2 - l2**2", e)
    assert all(e.system.mass_matrix[j][k] == 0 for j in range(4) for k in range(4) if j != k)


def test_torus():
    """z gives the sine of one angle, the distance from the axis its cosine."""
    e = formed(TORUS + WEIGHT)
    assert [c.name for c in e.system.coordinates] == ["x", "y", "z"]
    expected = "(x**2 + y**2 + z**2 + R**2 - a**2)**2 - 4*R**2*(x**2 + y**2)"
    assert is_same(closures(e)["bead"], expected, e)


def test_torus_with_a_force_on_its_angle():
    """A coordinate that the scene uses otherwise stays, with the definitions that hold it."""
    e = formed(TORUS + "forces: {motor: {on: theta, force: 0.3}}\n")
    assert [c.name for c in e.system.coordinates] == ["theta", "x", "y", "z"]
    found = [sp.expand(c.expression) for c in e.system.closures]
    assert len(found) == 2
    assert any(is_same(c, "z - a*sin(theta)", e) for c in found)
    assert any(is_same(c, "x**2 + y**2 - (R + a*cos(theta))**2", e) for c in found)
    assert e.system.chart.coordinates[1].name == "phi"


@pytest.mark.parametrize(
    "uses",
    [
        "potentials: {spring: theta^2}\n",
        "dissipation: {hinge: dot(theta)^2}\n",
        "kinetic: {wheel: dot(theta)^2}\n",
        "definitions: {x: sin(theta), z: -cos(theta), turned: theta}\noutputs: {o: turned + 1}\n",
        "definitions: {x: sin(theta), z: -cos(theta), w: dot(theta)}\noutputs: {o: w}\n",
    ],
)
def test_what_uses_an_angle_keeps_it(uses):
    text = "particles: {bob: {mass: 1, position: [x, 0, z]}}\ncoordinates: [theta]\n" + uses
    if "definitions" not in uses:
        text += "definitions: {x: sin(theta), z: -cos(theta)}\n"
    e = formed(text)
    assert [c.name for c in e.system.coordinates] == ["theta", "x", "z"]
    assert len(e.system.closures) == 2


def test_a_root_is_squared():
    e = formed(ROOT + WEIGHT)
    assert [c.name for c in e.system.coordinates] == ["x", "z"]
    assert is_same(closures(e)["bob"], "x**2 + z**2 - l**2", e)


def test_stated_constraints_are_taken_where_they_suffice():
    """Also of coordinates that could not be eliminated: the angle stands outside of a sine."""
    text = """
    parameters: {a: 1}
    particles: {bead: {mass: 1, position: [x, y, 0]}}
    constraints: {line: y = 2*x}
    coordinates: [u]
    definitions: {x: u + sin(u)}
    """.replace("\n    ", "\n")
    e = formed(text)
    assert [c.name for c in e.system.coordinates] == ["x", "y"]
    assert is_same(closures(e)["line"], "y - 2*x", e)


def test_an_angle_beside_itself_stays():
    e = formed(
        "particles: {bead: {mass: 1, position: [x, 0, z]}}\ncoordinates: [u]\n"
        "definitions: {x: u + sin(u), z: 1 - cos(u)}\n"
    )
    assert [c.name for c in e.system.coordinates] == ["u", "x", "z"]


def test_time_is_not_divided_by():
    """x = r cos ωt gives r only while the cosine is not zero."""
    e = formed(
        "parameters: {w: 2}\nparticles: {bead: {mass: 1, position: [x, y, 0]}}\n"
        "coordinates: [r]\ndefinitions: {x: r*cos(w*t), y: r*sin(w*t)}\n"
    )
    assert [c.name for c in e.system.coordinates] == ["r", "x", "y"]
    assert len(e.system.closures) == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("coordinates: [q]\nkinetic: {t1: dot(q)^2}\n", "there are no particles"),
        (POLAR, "no constraint is left"),
        ("particles: {p: {mass: 1, position: [x, y, z]}}\n", "no constraint is left"),
    ],
)
def test_no_multiplier_form(text, said):
    problem = refused(text)
    assert said in problem.message
    assert problem.mark is not None
    assert problem.hint


def test_no_minimal_form():
    text = "particles: {p: {mass: 1, position: [x, 0, z]}}\nconstraints: {wire: x^4 + z^4 = 1}\n"
    problem = refused(text + "initial: {x: 1, z: 0}\n", "minimal")
    assert "'wire'" in problem.message
    assert problem.mark.line == 3
    assert formed(text + "initial: {x: 1, z: 0}\n", "multiplier").derivation.choice is None


@pytest.mark.slow
def test_declared_coordinates_are_kept():
    """Though a chain of many links takes fewer operations in Cartesian names; that is said."""
    links = 10
    lines = [f"  x{i}: x{i - 1} + sin(q{i})\n  z{i}: z{i - 1} - cos(q{i})" for i in range(2, links)]
    text = (
        "parameters: {g: 9.81}\nparticles:\n"
        + "".join(f"  p{i}: {{mass: 1, position: [x{i}, 0, z{i}]}}\n" for i in range(1, links))
        + f"coordinates: [{', '.join(f'q{i}' for i in range(1, links))}]\n"
        + "definitions:\n  x1: sin(q1)\n  z1: -cos(q1)\n"
        + "\n".join(lines)
        + "\n"
        + WEIGHT
    )
    e = formed(text, "auto")
    assert e.system.formulation == "minimal"
    assert e.derivation.choice.why == "the coordinates are declared"
    assert e.derivation.choice.minimal > 2 * e.derivation.choice.multiplier
    other = formed(text)
    assert (other.derivation.choice.minimal, other.derivation.choice.multiplier) == (
        e.derivation.choice.minimal,
        e.derivation.choice.multiplier,
    )
    assert len(other.system.closures) == links - 1


@pytest.mark.slow
def test_fewer_operations_are_taken_where_nothing_is_declared():
    e = formed(STAIRS, "auto")
    assert e.system.formulation == "multiplier"
    assert e.derivation.choice.why == "fewer operations"
    assert e.derivation.choice.minimal > 2 * e.derivation.choice.multiplier
    assert formed(STAIRS, "minimal").derivation.choice.why == "as asked"
    few = formed(STAIRS.replace("n: 12", "n: 3"), "auto")
    assert (few.system.formulation, few.derivation.choice.why) == ("minimal", "")


def test_choice_does_not_depend_on_the_order_of_sets():
    counts = {formed(DOUBLE_PENDULUM, "auto").derivation.choice for _ in range(3)}
    assert len(counts) == 1


STATE = "initial: {theta: 0.3, phi: 1, dot(theta): 0.5, dot(phi): -2}\n"


def test_an_initial_state_is_carried_over():
    e = formed(SPHERICAL + WEIGHT + STATE)
    theta, phi, dtheta, dphi = 0.3, 1.0, 0.5, -2.0
    sin, cos = sp.sin, sp.cos
    expected = [
        2 * sin(theta) * cos(phi),
        2 * sin(theta) * sin(phi),
        -2 * cos(theta),
        2 * (cos(theta) * cos(phi) * dtheta - sin(theta) * sin(phi) * dphi),
        2 * (cos(theta) * sin(phi) * dtheta + sin(theta) * cos(phi) * dphi),
        2 * sin(theta) * dtheta,
    ]
    found = [*e.system.initial.positions, *e.system.initial.velocities]
    assert found == pytest.approx([float(x) for x in expected], rel=1e-15)
    assert e.system.chart.start.positions == (theta, phi)


def test_missing_velocities_are_the_smallest_in_both():
    text = SPHERICAL + WEIGHT + "initial: {theta: 0.3, phi: 1, dot(x): 1}\n"
    few, many = formed(text, "minimal"), formed(text)
    x, y, z = many.system.initial.velocities
    assert x == pytest.approx(1)
    theta, _ = few.system.initial.positions
    speeds = few.system.initial.velocities
    energy = 4 * (speeds[0] ** 2 + float(sp.sin(theta)) ** 2 * speeds[1] ** 2)
    assert x**2 + y**2 + z**2 == pytest.approx(energy)


AT_POLE = "initial: {x: 0, y: 0, z: -l, dot(x): 1, dot(y): 0.5}\n"


def test_a_start_that_has_no_place_in_the_coordinates():
    """At the pole the angles cannot move as the particle does: auto takes Cartesian names."""
    e = formed(SPHERICAL + WEIGHT + AT_POLE, "auto")
    assert e.system.formulation == "multiplier"
    assert any("in multiplier form" in remark for remark in e.derivation.remarks)
    assert e.system.initial.velocities == (1.0, 0.5, 0.0)
    assert e.system.chart.start is None
    assert refused(SPHERICAL + WEIGHT + AT_POLE, "minimal").rule == "initial-inconsistent"


def test_a_start_at_the_elbow_of_a_root():
    text = ROOT.replace("definitions: {z: -sqrt(l^2 - x^2)}", "constraints: {rod: x^2 + z^2 = l^2}")
    start = WEIGHT + "initial: {x: 1, z: 0, dot(z): 1}\n"
    e = formed(text + start, "auto")
    assert [c.name for c in e.system.coordinates] == ["x", "z"]
    assert any("in multiplier form" in remark for remark in e.derivation.remarks)
    assert refused(text + start, "minimal").rule == "singular"


def test_what_is_missing_is_missing_in_every_form():
    assert refused(SPHERICAL + WEIGHT + "initial: {x: 0.3}\n", "auto").rule == "initial-missing"


TOP = """
parameters: {g: 9.81, m: 1, A: 1, B: 1.5, C: 2}
bodies:
  top: {turn: [z: phi, y: theta, x: psi], mass: m, centre: [0.1, 0.2, 1], inertia: [A, B, C]}
coordinates: [phi, theta, psi]
"""


def test_quaternions_replace_three_angles():
    system = formed(TOP + WEIGHT).system
    assert [c.name for c in system.coordinates] == ["q0", "q1", "q2", "q3"]
    assert [closure.name for closure in system.closures] == ["unit_top"]
    (turn,) = system.chart.turns
    assert (turn.axes, turn.angles) == ("zyx", ("phi", "theta", "psi"))
    start = "initial: {phi: 0.3, theta: 0.2, psi: -1, dot(phi): 1, dot(theta): 2, dot(psi): -0.5}\n"
    initial = formed(TOP + WEIGHT + start).system.initial
    turned = Rotation.from_euler("ZYX", [0.3, 0.2, -1])
    assert np.roll(initial.positions, -1) == pytest.approx(turned.as_quat(), abs=1e-15)
    assert np.dot(initial.positions, initial.velocities) == pytest.approx(0, abs=1e-15)


#: The same turns as those of a rotor in gimbals without mass.
GIMBALS = TOP.replace("turn: [z: phi, y: theta, x: psi]", "on: inner, turn: [x: psi]") + (
    "frames: {outer: {at: [1, 0, 2], turn: [z: phi]}, inner: {on: outer, turn: [y: theta]}}\n"
)


def test_quaternions_replace_angles_of_gimbals_without_mass():
    alone, gimbals = (formed(text + WEIGHT).system for text in (TOP, GIMBALS))
    assert [c.name for c in gimbals.coordinates] == ["q0", "q1", "q2", "q3"]
    assert gimbals.chart.turns == alone.chart.turns
    assert gimbals.mass_matrix == alone.mass_matrix
    assert gimbals.forcing == alone.forcing
    for one, other, away in zip(alone.particles, gimbals.particles, [(1, 0, 2)], strict=True):
        apart = [sp.expand(b - a) for a, b in zip(one.position, other.position, strict=True)]
        assert apart == list(away)


@pytest.mark.parametrize(
    "text",
    [
        GIMBALS.replace("turn: [x: psi]", "at: [0, 1, 0], turn: [x: psi]"),
        GIMBALS.replace("turn: [y: theta]}", "at: [0, 0, 1], turn: [y: theta]}"),
    ],
)
def test_no_quaternion_replaces_angles_of_gimbals_that_carry_something(text):
    assert refused(text + WEIGHT).rule == "formulation"
    assert formed(text + WEIGHT, "minimal").system.formulation == "minimal"


@pytest.mark.parametrize(("at", "is_replaced"), [("[0, 1, 0]", False), ("[1, 0, 0]", True)])
def test_a_point_on_a_gimbal_keeps_its_angles_unless_it_is_on_the_axis(at, is_replaced):
    point = f"points: {{mark: {{on: inner, at: {at}}}}}\noutputs: {{x: x_mark}}\n"
    system = formed(GIMBALS + point + WEIGHT).system
    assert bool(system.chart.turns) is is_replaced
    assert ("phi" in {c.name for c in system.coordinates}) is not is_replaced


def test_parts_of_quaternions_have_names_that_are_free():
    text = TOP.replace("m: 1", "m: 1, q2: 3").replace(
        "coordinates:", "definitions: {a: q2}\ncoordinates:"
    )
    names = [c.name for c in formed(text + WEIGHT).system.coordinates]
    assert names == ["q_0", "q_1", "q_2", "q_3"]


@pytest.mark.parametrize(
    "uses",
    [
        "forces: {motor: {on: psi, force: 1}}",
        "outputs: {spin: dot(psi)}",
        "definitions: {tilt: 2*theta}",
        "constraints: {above: theta >= 0.1}",
    ],
)
def test_no_quaternion_replaces_angles_that_the_scene_names(uses):
    assert refused(TOP + WEIGHT + uses).rule == "formulation"


@pytest.mark.parametrize(
    ("turn", "place"),
    [
        ("[z: phi, x: theta, z: psi]", "sin(theta)"),
        ("[x: phi, z: theta, x: psi]", "sin(theta)"),
        ("[z: phi, y: theta, x: psi]", "cos(theta)"),
        ("[z: phi, y: theta, x: psi + theta]", None),
    ],
)
def test_gimbal_locks_are_singular_however_long_the_inertia_is(turn, place):
    text = TOP.replace("[z: phi, y: theta, x: psi]", turn)
    free = text.replace("top: {", "top: {at: [x, y, z], ").replace("[phi", "[x, y, z, phi")
    for scene in (text, free):
        for uses in ("", "forces: {motor: {on: psi, force: 1}}\n"):
            places = formed(scene + WEIGHT + uses, "minimal").derivation.singular
            found = [(str(p.where), set(p.coordinates), p.infinite) for p in places]
            assert found == ([(place, {"phi", "psi"}, False)] if place else [])


@pytest.mark.parametrize(
    "reader",
    ["states: {i: q2 - i}", "inputs: {u: {}}\ncontrollers: {every: 1/7, hold: {u: q2}}"],
    ids=["state", "controller"],
)
def test_an_angle_that_a_state_or_a_controller_reads_stays(reader: str) -> None:
    scene = """
parameters: {m: 1, l: 1, g: 9.81}
plane: xz
particles:
  b1: {mass: m, position: [l*sin(q1), 0, -l*cos(q1)]}
  b2: {mass: m, position: [l*sin(q1) + l*sin(q2), 0, -l*cos(q1) - l*cos(q2)]}
coordinates: [q1, q2]
potentials: {weight: {gravity: g}}
"""
    equations = derive(read_text(scene + reader), formulation="multiplier")
    names = [c.name for c in equations.system.coordinates]
    assert names == ["q2", "x_b1", "z_b1", "x_b2", "z_b2"]
    assert derivation_text(equations)
