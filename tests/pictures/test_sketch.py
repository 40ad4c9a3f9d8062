"""Sketches: where things stand, what is drawn and what is not, and two printers that hold it."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import run
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.depiction import MOST_BODIES
from lagrange_cli.pictures.sketch.composition import sketch_of
from lagrange_cli.pictures.sketch.configurations import configurations
from lagrange_cli.pictures.sketch.guides import frame_of, guides
from lagrange_cli.pictures.sketch.labels import half_size
from lagrange_cli.pictures.sketch.links import findings
from lagrange_cli.pictures.sketch.view import gravity, view_of
from lagrange_cli.scene.reader import read_text
from tests.systems.shipped import SCENES, derived, sliced

#: A bob that two definitions put somewhere, with a potential.
BOB = """
parameters: {{m: 2, l: 1.5, g: 9.81, k: 40, F: 3}}
plane: xz
particles: {{bob: {{mass: m, position: [x, y, z]}}}}
coordinates: {{theta: {{unit: rad}}}}
definitions: {{x: "{x}", z: "{z}"}}
potentials: {{energy: "{potential}"}}
initial: {{theta: 0.7}}
"""


def bob(x="l*sin(theta)", z="-l*cos(theta)", potential="m*g*z"):
    return loads(BOB.format(x=x, z=z, potential=potential)).derive().equations


def strokes(sketch, kind):
    return [s for s in sketch.strokes if s.kind == kind]


def captions(sketch):
    return [label.caption.plain for label in sketch.labels]


def place_of(sketch, name):
    (dot,) = [dot for dot in sketch.dots if dot.name == name]
    return np.array(dot.at)


def starts(equations):
    """Positions at the start, found by putting numbers into r(q, t)."""
    known = {
        c.q: x
        for c, x in zip(
            equations.system.coordinates, equations.system.initial.positions, strict=True
        )
    }
    known |= {p.symbol: p.value for p in equations.system.parameters}
    known[equations.system.t] = equations.system.simulate.start
    return {
        p.name: np.array([float(e.subs(known)) if e.free_symbols else float(e) for e in p.position])
        for p in equations.system.particles
    }


def curves(equations):
    configuration = configurations(equations)
    known = findings(configuration)
    view = view_of(configuration, gravity(configuration))
    return guides(known, view, frame_of(known))


# Geometry.


def test_a_pendulum_hangs_from_its_pivot_by_its_angle():
    sketch = sketch_of(derived("pendulum"))
    (rod,) = strokes(sketch, "rod")
    pivot, end = map(np.array, rod.points)
    assert np.allclose(end, place_of(sketch, "bob"))
    along = (end - pivot) / np.linalg.norm(end - pivot)
    assert np.allclose(along, [math.sin(2.0), -math.cos(2.0)], atol=1e-3)
    (arc,) = strokes(sketch, "angle")
    first, last = (np.array(arc.points[k]) - pivot for k in (0, -1))
    assert np.allclose(first / np.linalg.norm(first), [0, -1], atol=2e-3)  # from below
    assert np.allclose(last / np.linalg.norm(last), along, atol=2e-3)  # to the rod
    turns = np.diff(np.unwrap(np.arctan2(*(np.array(arc.points) - pivot).T[::-1])))
    assert turns.sum() == pytest.approx(2.0, abs=0.01)
    assert (turns > 0).all()
    assert strokes(sketch, "ground")
    assert sorted(captions(sketch)) == ["g", "l", "m", "x", "z", "θ"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("double_pendulum", (0, 2)),
        ("pendulum_on_cart", (0, 2)),
        ("four_bar_linkage", (0, 2)),
        ("andrews_squeezer", (0, 1)),
        ("pleiades", (0, 1)),
        ("chain_of_rods", (0, 2)),
        ("block_on_wedge", (0, 2)),
    ],
)
def test_particles_of_a_plane_stand_where_they_start(name, axes):
    """The picture is that plane up to a shift and one scale."""
    equations = derived(name)
    sketch = sketch_of(equations)
    drawn = np.array([place_of(sketch, p.name) for p in equations.system.particles])
    true = np.array([starts(equations)[p.name][list(axes)] for p in equations.system.particles])
    drawn, true = drawn - drawn[0], true - true[0]
    scale = np.abs(drawn).max() / max(np.abs(true).max(), 1e-300)
    assert np.allclose(drawn, scale * true if np.abs(true).max() > 0 else 0, atol=3e-3)


def test_gravity_is_down_also_where_an_axis_points_down():
    """The third axis of a bicycle points downwards, as in its literature."""
    text = BOB.format(x="l*sin(theta)", z="l*cos(theta)", potential="-m*g*z")
    sketch = sketch_of(loads(text).derive().equations)
    (fall,) = strokes(sketch, "gravity")
    axis = next(s for s in strokes(sketch, "axis") if s.name == "z")
    for arrow in (fall, axis):
        assert arrow.points[1][0] == pytest.approx(arrow.points[0][0])
        assert arrow.points[1][1] < arrow.points[0][1]
    (rod,) = strokes(sketch, "rod")
    assert rod.points[1][1] < rod.points[0][1]  # it hangs


@pytest.mark.slow
def test_a_parabola_satisfies_its_equation():
    equations = derived("bead_on_parabola")
    (guide,) = curves(equations)
    x, y, z = guide.curve.points.T
    assert np.abs(z - 0.5 * x**2).max() < 1e-6
    assert not y.any()
    assert x.min() < 0 < 1 < x.max()  # past the vertex, and around the bead
    assert guide.name == "wire"
    sketch = sketch_of(equations)
    (stroke,) = strokes(sketch, "curve")
    assert np.hypot(*(np.array(stroke.points) - place_of(sketch, "bead")).T).min() < 0.3


@pytest.mark.slow
def test_a_cone_is_shown_by_sections_that_lie_on_it():
    equations = derived("particle_on_cone")
    shown = curves(equations)
    assert len(shown) == 2
    for guide in shown:
        x, y, z = guide.curve.points.T
        assert np.abs(np.hypot(x, y) - np.abs(z) * math.tan(math.pi / 6)).max() < 1e-6
    assert [guide.curve.closed for guide in shown] == [True, False]


@pytest.mark.slow
def test_a_helix_is_the_line_of_two_equations():
    (guide,) = curves(derived("bead_on_helix"))
    x, y, z = guide.curve.points.T
    assert np.abs(x - 0.3 * np.cos(z / 0.1)).max() < 1e-6
    assert np.abs(y - 0.3 * np.sin(z / 0.1)).max() < 1e-6
    assert np.ptp(z) > 1


def bowl():
    """A particle within an ellipse."""
    return loads(
        "name: bowl\nparameters: {m: 1, a: 1}\nplane: xz\n"
        "particles: {p: {mass: m, position: [x, y, z]}}\n"
        "constraints: {wall: x^2/2 + z^2 <= a^2}\ninitial: {x: 0, z: -a}\n"
    ).derive().equations  # fmt: skip


def test_a_distance_that_is_at_most_a_length_is_a_rope():
    """It ends at the centre of its circle, and its length is that of the scene."""
    known = findings(configurations(derived("slack_rope")))
    (rope,) = known.links
    assert (rope.kind, str(rope.size), rope.length) == ("rope", "l", pytest.approx(1.0))
    assert np.abs(known.places[:, rope.ends[0]]).max() < 1e-9
    assert not strokes(sketch_of(derived("slack_rope")), "curve")


def test_a_rope_between_two_particles_is_drawn():
    text = (
        "name: pair\nparameters: {m: 1, l: 2}\nplane: xy\n"
        "particles:\n  a: {mass: m, position: [x1, y1, z1]}\n"
        "  b: {mass: m, position: [x2, y2, z2]}\n"
        "constraints: {rope: 'norm(x2 - x1, y2 - y1) <= l'}\n"
        "initial: {x1: 0, y1: 0, x2: 1, y2: 0}\n"
    )
    known = findings(configurations(loads(text).derive().equations))
    (rope,) = known.links
    assert (rope.kind, rope.ends, rope.length) == ("rope", (0, 1), pytest.approx(2.0))
    assert known.slack(rope, 0) == pytest.approx(math.sqrt(3))


def test_points_by_which_a_turning_body_touches_are_at_its_ends():
    known = findings(configurations(derived("dropped_rod")))
    places = dict(zip(known.names, known.places[0], strict=False))
    middle, arm = np.array([0, 0, 0.5]), 0.5 * np.array([math.cos(0.1), 0, math.sin(0.1)])
    np.testing.assert_allclose(places["right"], middle + arm, atol=1e-12)
    np.testing.assert_allclose(places["left"], middle - arm, atol=1e-12)
    assert [link.kind for link in known.links] == ["rod", "rod"]
    (floor,) = strokes(sketch_of(derived("dropped_rod")), "curve")
    assert len({y for _, y in floor.points}) == 1


@pytest.mark.slow
@pytest.mark.parametrize("outwards", [-1, 1])
def test_boundaries_are_hatched_where_the_particle_cannot_be(outwards):
    sketch = sketch_of(derived("particle_leaving_sphere") if outwards < 0 else bowl())
    (circle,) = strokes(sketch, "curve")
    centre = np.mean(circle.points, axis=0)
    ticks = strokes(sketch, "hatch")
    assert len(ticks) > 20
    for tick in ticks:
        foot, end = (np.linalg.norm(np.array(point) - centre) for point in tick.points)
        assert outwards * (end - foot) > 0


def test_a_spring_ends_at_its_bodies():
    sketch = sketch_of(derived("coupled_pendulums"))
    (spring,) = strokes(sketch, "spring")
    ends = {tuple(place_of(sketch, name)) for name in ("left", "right")}
    assert {spring.points[0], spring.points[-1]} == ends
    along = np.subtract(spring.points[-1], spring.points[0])
    offsets = [along[0] * (y - spring.points[0][1]) - along[1] * (x - spring.points[0][0])
               for x, y in spring.points]  # fmt: skip
    assert (np.diff(np.sign(np.round(offsets[2:-2], 6))) != 0).all()  # from side to side
    assert "k" in captions(sketch)


def test_a_spring_beside_a_damper_is_drawn_beside_it():
    text = """
    parameters: {m: 1, k: 2, c: 0.1, l: 1}
    particles: {block: {mass: m, position: [x, 0, 0]}}
    points: {wall: [0, 0, 0]}
    coordinates: [x]
    potentials: {spring: {spring: [wall, block], stiffness: k, length: l}}
    forces: {damper: {damper: [wall, block], coefficient: c}}
    initial: {x: 1.5}
    """
    assert [(k.kind, k.ends, k.size.text) for k in read_text(text).links] == [
        ("spring", ("wall", "block"), "k"),
        ("damper", ("wall", "block"), "c"),
    ]
    sketch = sketch_of(loads(text).derive().equations)
    (spring,) = strokes(sketch, "spring")
    damper = strokes(sketch, "damper")
    assert len(damper) == 4
    lowest = min(y for stroke in damper for _, y in stroke.points)
    assert lowest > max(y for _, y in spring.points) or lowest < min(y for _, y in spring.points)
    assert {"k", "c"} <= set(captions(sketch))


def test_a_rope_runs_over_the_hole():
    sketch = sketch_of(derived("masses_through_hole"))
    ropes = strokes(sketch, "rope")
    assert [rope.name for rope in ropes] == ["puck-O", "weight-O"]
    assert ropes[0].points[1] == ropes[1].points[1]
    assert ropes[0].points[0] == tuple(place_of(sketch, "puck"))


def turns(sketch, name):
    """The other ends of the pieces of rope that end at a body."""
    at = place_of(sketch, name)
    lines = [r.points for r in strokes(sketch, "rope")]
    return [b if tuple(a) == tuple(at) else a for a, b in lines if tuple(at) in (a, b)]


def test_a_rope_runs_over_pulleys_that_are_not_declared():
    sketch = sketch_of(derived("swinging_atwood"))
    (over_bob,), (over_weight,) = turns(sketch, "bob"), turns(sketch, "counterweight")
    # d = 1 apart, the second one above the counterweight, and the rope between them.
    pieces = {frozenset(r.points) for r in strokes(sketch, "rope")}
    assert frozenset((over_bob, over_weight)) in pieces
    assert len(pieces) == 3
    assert over_weight[0] == place_of(sketch, "counterweight")[0]
    length = sum(math.dist(*piece) for piece in pieces)
    assert math.dist(over_bob, over_weight) / length == pytest.approx(1 / 3, abs=2e-3)


def test_both_weights_of_an_atwood_machine_hang_from_the_origin():
    sketch = sketch_of(derived("atwood"))
    (first,), (second,) = turns(sketch, "first"), turns(sketch, "second")
    assert first == second
    assert len(strokes(sketch, "rope")) == 2


def test_a_rope_runs_over_a_pulley_that_moves():
    sketch = sketch_of(derived("double_atwood"))
    (below, also_below) = turns(sketch, "two"), turns(sketch, "three")
    assert tuple(place_of(sketch, "pulley")) in below
    assert tuple(place_of(sketch, "pulley")) in also_below
    assert len(strokes(sketch, "rope")) == 5


@pytest.mark.parametrize(
    "constraint",
    ["x_b - x_a = 2", "x_a + x_b = 0", "2*x_a + x_b = -3", "x_a = x_b^3 - 2"],
)
def test_no_rope_is_drawn_between_bodies_that_keep_no_length(constraint):
    text = f"""
parameters: {{m: 1}}
particles: {{a: {{mass: m, position: [x_a, 0, 0]}}, b: {{mass: 2*m, position: [x_b, 0, 0]}}}}
constraints: {{between: {constraint}}}
potentials: {{force: m*x_b}}
initial: {{x_b: 1}}
"""
    assert not strokes(sketch_of(loads(text).derive().equations), "rope")


# What is drawn, and what is not.


def test_a_spring_is_found_in_the_potential_of_its_length():
    """V = k x²/2 with x the extension of a line of length l + x."""
    sketch = sketch_of(derived("elastic_pendulum"))
    assert len(strokes(sketch, "spring")) == 1
    assert not strokes(sketch, "rod")
    assert not strokes(sketch, "radius")


def test_an_ellipse_has_neither_rod_nor_angle():
    """At the start of a circle of the same height nothing is different."""
    assert strokes(sketch_of(bob()), "angle")
    sketch = sketch_of(bob(x="2*l*sin(theta)"))
    assert not strokes(sketch, "angle")
    assert not strokes(sketch, "rod")
    assert len(strokes(sketch, "curve")) == 1  # the path that its definitions say


def test_twice_an_angle_is_none():
    sketch = sketch_of(bob(x="l*sin(2*theta)", z="-l*cos(2*theta)"))
    assert not strokes(sketch, "angle")


@pytest.mark.parametrize(
    ("potential", "falls"),
    [
        ("m*g*z", True),
        ("m*g*(z - l)", True),
        ("m*g*l*(1 - cos(theta))", True),
        ("F*z", False),
        ("m*g*z^2", False),
        ("k*theta^2/2", False),
    ],
)
def test_gravity_is_drawn_where_a_potential_is_a_weight(potential, falls):
    assert bool(strokes(sketch_of(bob(potential=potential)), "gravity")) == falls


def test_an_incline_says_only_what_its_potential_says():
    """Along a line V = m a s is a weight, but not in which direction the rest of it is."""
    text = """
    parameters: {m: 1, g: 9.81, a: 0.5}
    particles: {block: {mass: m, position: [s*cos(a), 0, -s*sin(a)]}}
    coordinates: [s]
    potentials: {weight: -m*g*sin(a)*s}
    initial: {s: 1}
    """
    assert not strokes(sketch_of(loads(text).derive().equations), "gravity")


def test_the_pivot_of_a_driven_support_is_no_ground():
    sketch = sketch_of(derived("pendulum_support_on_circle"))
    assert not strokes(sketch, "ground")
    assert [dot.kind for dot in sketch.dots] == ["joint", "mass"]
    assert len(strokes(sketch, "rod")) == 1


@pytest.mark.slow
def test_a_lever_is_a_bar_through_its_fulcrum():
    """Its ends and the fulcrum stay on one line: the circle of the load is no wire."""
    sketch = sketch_of(derived("lever"))
    assert strokes(sketch, "curve") == []
    fulcrum = {point for bar in strokes(sketch, "rod") for point in bar.points}
    assert len(strokes(sketch, "rod")) == 2
    assert len(fulcrum) == 3
    (force,) = strokes(sketch, "force")
    assert np.allclose(force.points[0], place_of(sketch, "grip"))
    assert force.points[1][1] < force.points[0][1]
    assert "F" in captions(sketch)


LADDER = """
parameters: {m: 1, l: 2, g: 9.81}
plane: xz
particles: {middle: {mass: m, position: [l*cos(a), 0, l*sin(a)]}}
points: {top: [0, 0, 2*l*sin(a)], foot: [2*l*cos(a), 0, 0]}
coordinates: [a]
potentials: {weight: {gravity: g}}
initial: {a: 1}
"""


def test_the_middle_of_a_ladder_is_on_its_bar_and_on_no_rod_from_the_corner():
    sketch = sketch_of(loads(LADDER).derive().equations)
    assert len(strokes(sketch, "rod")) == 2
    assert len(strokes(sketch, "radius")) == 1
    assert strokes(sketch, "ground") == []


HOOP_WITH_BEAD = """
parameters: {a: 1.5, b: 1}
plane: xz
particles: {hoop: {mass: 1, position: [a*phi, 0, a]}, bead: {mass: 2, position: SPOT}}
coordinates: [phi]
initial: {phi: 0.3}
"""


ROLLER = """
parameters: {m: 1e200, R: 0.5}
particles: {hub: {mass: m, position: [s, 0, R]}}
coordinates: [s, phi]
kinetic: {spin: m*R^2*dot(phi)^2/4}
constraints: {rolls: dot(s) = R*dot(phi)}
"""


def test_parameters_of_any_size_are_tried_as_radii():
    wheels = strokes(sketch_of(loads(ROLLER).derive().equations), "wheel")
    assert wheels == strokes(
        sketch_of(loads(ROLLER, parameters={"m": 1}).derive().equations), "wheel"
    )
    assert wheels


@pytest.mark.parametrize(
    ("spot", "rolls"),
    [
        ("[a*phi - a*sin(phi), 0, a - a*cos(phi)]", True),
        ("[a*phi + a*sin(phi), 0, a - a*cos(phi)]", False),  # it turns the other way
        ("[a*phi - b*sin(phi), 0, a - b*cos(phi)]", False),  # within the rim
    ],
)
def test_a_hoop_has_a_particle_on_its_rim(spot, rolls):
    """Its circle, a spoke and the ground; the ladder's middle is no wheel though it moves like
    one on a circle."""
    sketch = sketch_of(loads(HOOP_WITH_BEAD.replace("SPOT", spot)).derive().equations)
    assert len(strokes(sketch, "wheel")) == (2 if rolls else 0)
    assert bool(strokes(sketch, "ground")) == rolls
    assert not strokes(sketch_of(loads(LADDER).derive().equations), "wheel")


def test_a_force_along_a_rod_pushes_against_its_end():
    """Beck's follower load on Ziegler's column, which is seen above the column."""
    sketch = sketch_of(derived("zieglers_column"))
    (force,) = strokes(sketch, "force")
    start, tip = np.array(force.points)
    top = place_of(sketch, "tip")
    assert np.linalg.norm(tip - top) < np.linalg.norm(start - top)
    assert start[1] > tip[1] > top[1]


def test_forces_that_depend_on_rates_are_not_drawn():
    text = BOB.format(x="l*sin(theta)", z="-l*cos(theta)", potential="m*g*z")
    text += "inputs: [u]\nforces: {drag: {on: bob, force: [-k*dot(x), 0, 0]},"
    text += " pull: {on: bob, force: [u, 0, 0]}}\n"
    sketch = sketch_of(loads(text).derive().equations)
    assert [s.name for s in strokes(sketch, "force")] == ["pull"]
    assert "u" in captions(sketch)


def test_a_closed_linkage_has_the_angles_of_all_its_bars():
    sketch = sketch_of(derived("four_bar_linkage"))
    assert [arc.name for arc in strokes(sketch, "angle")] == ["alpha", "beta", "gamma"]
    lengths = [np.linalg.norm(np.subtract(*rod.points)) for rod in strokes(sketch, "rod")]
    assert np.allclose(np.array(lengths) / lengths[0], np.array([0.5, 1.5, 1.25]) / 0.5, atol=5e-3)


@pytest.mark.slow
def test_a_circle_of_a_rod_is_not_drawn_again():
    assert not strokes(sketch_of(derived("chain_of_rods")), "curve")


@pytest.mark.slow
def test_many_bodies_are_dots_and_lines():
    sketch = sketch_of(
        loads(SCENES["net_of_springs"].read_text(), parameters={"n": "5"}).derive().equations
    )
    assert sum(dot.kind == "mass" for dot in sketch.dots) == 25
    assert all(len(spring.points) == 2 for spring in strokes(sketch, "spring"))
    assert not any(caption.startswith("p[") for caption in captions(sketch))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["pendulum", "double_pendulum", "coupled_oscillators", "spherical_pendulum",
             "rigid_tetrahedron", "four_bar_linkage", "penning_trap", "triple_pendulum"]
)  # fmt: skip
def test_labels_lie_beside_each_other(name):
    for one, other in combinations(sketch_of(derived(name)).labels, 2):
        apart = np.abs(np.subtract(one.at, other.at))
        room = half_size(one.caption.plain) + half_size(other.caption.plain)
        assert (apart > 0.7 * room).any(), (one, other)


# Refusals, and scenes without a start.


def test_a_scene_without_particles_is_refused(capsys):
    assert run(["emit", str(SCENES["heavy_top"]), "--to", "svg"]) == 2
    said = capsys.readouterr()
    assert "this scene has no particles" in said.err
    assert not said.out


TOP = """
parameters: {I: 1, l: 1, g: 9.81}
points:
  tip: [0, 0, 0]
  axis: [l*sin(theta)*cos(phi), l*sin(theta)*sin(phi), l*cos(theta)]
coordinates: [phi, theta]
kinetic: {turning: I/2*(dot(theta)^2 + dot(phi)^2*sin(theta)^2)}
potentials: {weight: g*l*cos(theta)}
initial: {phi: 1, theta: 0.5}
"""


def test_points_are_drawn_without_particles():
    sketch = sketch_of(loads(TOP, file="top.yaml").derive().equations)
    assert [(dot.kind, dot.name) for dot in sketch.dots] == [("joint", "axis")]
    # The angle is drawn at the fixed point, which stands on the ground.
    assert [s.name for s in sketch.strokes if s.kind == "angle"] == ["theta"]
    assert {s.name for s in sketch.strokes if s.kind == "ground"} == {"tip"}
    (rod,) = (s for s in sketch.strokes if s.kind == "rod")
    tip, axis = map(np.array, rod.points)
    # In units of l: up by cos θ and, as x comes towards the viewer, down by a part of x.
    assert axis[1] - tip[1] > abs(axis[0] - tip[0]) > 0


UNKNOWN = """
parameters: {m: 1}
functions: {f: x, V: x}
particles: {bead: {mass: m, position: [x, y, z]}}
constraints: {plane: y = 0, wire: z = CURVE}
coordinates: [x]
potentials: {field: V(x)}
initial: {x: 1}
"""


@pytest.mark.slow
def test_an_unknown_potential_is_no_obstacle_and_an_unknown_curve_is():
    scene = loads(UNKNOWN.replace("CURVE", "x^2"), file="it.yaml")
    drawn = sketch_of(scene.derive().equations)
    assert [dot.kind for dot in drawn.dots] == ["mass"]
    assert strokes(drawn, "curve")
    with pytest.raises(InputError, match="function 'f' is not given"):
        sketch_of(loads(UNKNOWN.replace("CURVE", "f(x)"), file="it.yaml").derive().equations)


SINGULAR_PLACES = """
name: singular
parameters: {R: 0.5, g: 9.81}
plane: xz
particles:
  b: {mass: 1, position: ["x^(1/3)", 0, z]}
  c: {mass: 1, position: [x + R*sin(th), 0, z + R*cos(th)]}
points: {o: [POINT, 0, 0]}
coordinates: [x, z, th]
potentials: {w: {gravity: g}}
initial: {x: 0, z: 0, th: 0}
"""


@pytest.mark.parametrize("point", ["0", "x^(1/3)", "1e400*x"])
def test_places_without_a_derivative_at_the_start_are_drawn(point):
    scene = loads(SINGULAR_PLACES.replace("POINT", point), file="it.yaml")
    assert [dot.kind for dot in sketch_of(scene.derive().equations).dots].count("mass") == 2


@pytest.mark.parametrize("point", ["log(x)", "1/x", "1e400"])
def test_a_body_that_is_nowhere_at_the_start_is_refused(point):
    scene = loads(SINGULAR_PLACES.replace("POINT", point), file="it.yaml")
    with pytest.raises(InputError, match="position of 'o' is not real here, or too large"):
        sketch_of(scene.derive().equations)


@pytest.mark.slow
def test_too_many_bodies_are_refused(monkeypatch):
    assert MOST_BODIES == 400
    for module in ("mechanics.assembly", "pictures.sketch.configurations"):
        monkeypatch.setattr(f"lagrange_cli.{module}.MOST_BODIES", 40)
    derivation = loads(SCENES["chain_of_rods"].read_text(), parameters={"n": "40"}).derive()
    with pytest.raises(InputError, match="more than 40 particles and points"):
        derivation.emit("tikz")


@pytest.mark.slow
def test_without_a_start_the_picture_says_what_it_shows():
    text = """
    name: rod
    parameters: {m: {}, l: {positive: true}}
    plane: xz
    particles: {bob: {mass: m, position: [x, y, z]}}
    constraints: {rod: x^2 + z^2 = l^2}
    coordinates: [phi]
    definitions: {x: l*cos(phi), z: l*sin(phi)}
    """
    equations = loads(text).derive().equations
    assert equations.system.initial is None
    sketch = sketch_of(equations)
    state = equations.derivation.sources.state
    assert (
        sketch.remarks[0] == "the scene gives no start: a configuration that its constraints allow"
    )
    assert f"phi = {float(state[equations.system.coordinates[0].q]):.6g}" in sketch.remarks[1]
    assert "l = " in sketch.remarks[2]
    assert strokes(sketch, "curve")
    tikz = next(iter(EMITTERS["tikz"].emit(equations).values()))
    assert "% the scene gives no start" in tikz


# The printers.

HOSTILE = '\\input{/etc/passwd} ^^M\n\\end{tikzpicture} ]]> --> <script>&amp; "q" \u202e\x07 % $ #1'


def hostile_scene():
    return loads(
        f"name: hostile\ntitle: {repr_yaml(HOSTILE)}\n"
        "parameters: {__m_: 1, g: 9.81}\n"
        "particles:\n  _a__b: {mass: 1, position: [x, 0, 0]}\n"
        "  c_1_: {mass: __m_, position: [1, 0, z]}\n"
        "coordinates: [x, z]\npotentials: {weight: {gravity: g}}\ninitial: {x: 0, z: 0}\n"
    ).derive()


def repr_yaml(text):
    """A text as a double-quoted YAML scalar."""
    escapes = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\x07": "\\a", "\u202e": "\\u202e"}
    return '"' + "".join(escapes.get(c, c) for c in text) + '"'


def svg_tree(text):
    return ElementTree.fromstring(text)


def compiled(tmp_path, pictures):
    """Compile pictures with nothing but the package tikz."""
    if shutil.which("pdflatex") is None or shutil.which("kpsewhich") is None:
        assert os.environ.get("CI") != "true", "CI needs pdflatex (texlive-pictures)"
        pytest.skip("pdflatex is not installed")
    if not subprocess.run(["kpsewhich", "tikz.sty"], capture_output=True).stdout.strip():
        assert os.environ.get("CI") != "true", "CI needs the package tikz (texlive-pictures)"
        pytest.skip("the LaTeX package tikz is not installed (texlive-pictures)")
    for name, text in pictures.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    body = "\n".join(rf"\input{{{name}}}" for name in pictures)
    document = (
        rf"\documentclass{{article}}\usepackage{{tikz}}\begin{{document}}{body}\end{{document}}"
    )
    (tmp_path / "a.tex").write_text(document, encoding="utf-8")
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "a.tex"],
        cwd=tmp_path,
        capture_output=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert (tmp_path / "a.pdf").stat().st_size > 1000


@pytest.mark.slow
@pytest.mark.latex
def test_pictures_are_input_into_a_document(tmp_path):
    names = ["pendulum", "masses_through_hole", "coupled_pendulums", "particle_leaving_sphere"]
    pictures: dict[str, str] = {}
    for name in names:
        pictures |= EMITTERS["tikz"].emit(derived(name))
    pictures |= hostile_scene().emit("tikz")
    assert list(pictures) == [*(f"{name}.tikz.tex" for name in names), "hostile.tikz.tex"]
    compiled(tmp_path, pictures)


def test_texts_of_a_scene_are_no_markup():
    derivation = hostile_scene()
    (tikz,) = derivation.emit("tikz").values()
    comments = [line for line in tikz.splitlines() if line.startswith("%")]
    assert len(comments) == 2  # the title is on one line
    assert tikz.splitlines()[2].startswith(r"\begin{tikzpicture}")
    assert not any("/etc/passwd" in line for line in tikz.splitlines() if line not in comments)
    (svg,) = derivation.emit("svg").values()
    tree = svg_tree(svg)
    assert "<script>&amp;" in (tree[0].text or "")
    assert {element.tag.split("}")[1] for element in tree.iter()} == {
        "svg", "title", "desc", "rect", "defs", "marker", "path", "g", "polyline", "circle", "text"
    }  # fmt: skip


def test_both_printers_hold_the_same_picture():
    sketch = sketch_of(derived("double_pendulum"))
    (tikz,) = EMITTERS["tikz"].emit(derived("double_pendulum")).values()
    (svg,) = EMITTERS["svg"].emit(derived("double_pendulum")).values()
    lines = [e for e in svg_tree(svg).iter() if e.tag.endswith(("polyline", "polygon"))]
    assert len(lines) == len(sketch.strokes) == tikz.count(r"\draw[")
    for element, stroke in zip(lines, sketch.strokes, strict=True):
        places = [tuple(map(float, pair.split(","))) for pair in element.attrib["points"].split()]
        assert np.allclose(places, np.array(stroke.points) * [40, -40], atol=0.006)
    assert r"{$\theta_{1}$}" in tikz
    assert "θ1" in [e.text for e in svg_tree(svg).iter() if e.tag.endswith("text")]
    left, top, width, height = map(float, svg_tree(svg).attrib["viewBox"].split())
    for stroke in sketch.strokes:
        for x, y in stroke.points:
            assert left <= 40 * x <= left + width
            assert top <= -40 * y <= top + height


PICTURES = sorted((Path(__file__).parents[2] / "docs" / "pictures").glob("sketch_*.svg"))


@pytest.mark.slow
@pytest.mark.parametrize("path", PICTURES, ids=lambda path: path.stem)
def test_pictures_of_the_documents_are_those_that_are_emitted(path):
    (svg,) = EMITTERS["svg"].emit(derived(path.stem.removeprefix("sketch_"))).values()
    assert path.read_text(encoding="utf-8") == svg


DRAWN = [name for name, path in SCENES.items() if "\nparticles:" in Path(path).read_text()]


@pytest.mark.slow
@sliced(DRAWN)
def test_every_shipped_scene_with_particles_is_drawn(name):
    equations = derived(name)
    (svg,) = EMITTERS["svg"].emit(equations).values()
    (tikz,) = EMITTERS["tikz"].emit(equations).values()
    svg_tree(svg)
    assert tikz.count(r"\begin{tikzpicture}") == tikz.count(r"\end{tikzpicture}") == 1
    assert "nan" not in tikz
    sketch = sketch_of(equations)
    masses = [dot for dot in sketch.dots if dot.kind == "mass"]
    assert [dot.name for dot in masses] == [p.name for p in equations.system.particles]
    assert max(np.abs([*sketch.low, *sketch.high])) < 15


# Wheels.

ROLLING = """
parameters: {{m: 2, R: {{value: 0.5, positive: true}}, I: 0.25, al: 0.4, g: 9.81}}
particles: {{c: {{mass: m, position: {position}}}}}
coordinates: [s, psi]
kinetic: {{spin: I/2*dot(psi)^2}}
potentials: {{weight: {{gravity: g}}}}
constraints: {{{name}: {equation}}}
initial: {{s: 0.6, psi: {psi}}}
"""
ON_SLOPE = "[s*cos(al) + R*sin(al), 0, -s*sin(al) + R*cos(al)]"
ALONG_SLOPE = "[s*cos(al), 0, -s*sin(al)]"


def rolling(position=ON_SLOPE, name="touch", equation="dot(s) = R*dot(psi)", psi="0.9"):
    text = ROLLING.format(position=position, name=name, equation=equation, psi=psi)
    return sketch_of(loads(text).derive().equations)


@pytest.mark.parametrize(("position", "name"), [(ON_SLOPE, "touch"), (ALONG_SLOPE, "rolling")])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_wheel_has_its_radius_and_its_angle(position, name, sign):
    """The spoke is turned by psi from the ground, so that the rim rests where it touches."""
    equation = "dot(s) = R*dot(psi)" if sign > 0 else "dot(s) = -R*dot(psi)"
    sketch = rolling(position, name, equation)
    rim, spoke = strokes(sketch, "wheel")
    centre = place_of(sketch, "c")
    radii = np.linalg.norm(np.array(rim.points) - centre, axis=1)
    assert rim.closed
    assert np.ptp(radii) < 0.002
    assert np.linalg.norm(np.array(spoke.points[0]) - centre) < 1e-9
    # Down the slope is right and down: a wheel that rolls there turns clockwise.
    down = np.array([-math.sin(0.4), -math.cos(0.4)])
    turn = -sign * 0.9
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]) @ down
    assert np.abs(np.array(spoke.points[1]) - centre - radii[0] * turned).max() < 0.003
    line, *ticks = strokes(sketch, "ground")
    along = np.array([math.cos(0.4), -math.sin(0.4)])
    ends = np.array(line.points) - centre
    assert np.abs(ends @ down - radii[0]).max() < 0.003
    assert np.abs(ends @ along).min() > radii[0]
    assert all((np.array(t.points[1]) - centre) @ down > radii[0] for t in ticks)
    assert {"R", "ψ"} <= set(captions(sketch))


@pytest.mark.slow
def test_a_load_on_the_rope_of_a_drum_is_no_wheel():
    assert not strokes(rolling(ALONG_SLOPE, "rope"), "wheel")
    assert not strokes(rolling("[0, 0, -s]", "rolling"), "wheel")
    assert not strokes(rolling(ALONG_SLOPE, "rolling", "dot(s) = 2*psi*dot(psi)"), "wheel")
    assert not strokes(sketch_of(derived("coupled_gears")), "wheel")


HOOP = """
parameters: {m: 1, R: 0.3, alpha: 0.4, g: 9.81}
plane: xz
particles: {c: {mass: m, position: [s*cos(alpha), 0, -s*sin(alpha)]}}
coordinates: [s]
constraints: {rolling: EQUATION}
kinetic: {spin: m*R^2/2*dot(psi)^2}
potentials: {weight: {gravity: g}}
initial: {s: 0.4}
"""


@pytest.mark.parametrize("equation", ["s = R*psi", "dot(s) = R*dot(psi)"])
def test_a_wheel_whose_angle_a_constraint_determines_is_drawn(equation):
    sketch = sketch_of(loads(HOOP.replace("EQUATION", equation), file="it.yaml").derive().equations)
    rim, spoke = strokes(sketch, "wheel")
    radii = np.linalg.norm(np.array(rim.points) - place_of(sketch, "c"), axis=1)
    assert np.ptp(radii) < 0.002
    assert spoke.name == "psi"
    assert not strokes(
        sketch_of(loads(HOOP.replace("EQUATION", "s = 2*psi"), file="it.yaml").derive().equations),
        "wheel",
    )


def test_what_a_cylinder_rolls_on_is_drawn():
    sketch = sketch_of(derived("rolling_cylinder"))
    (ground,) = strokes(sketch, "curve")
    rim, _ = strokes(sketch, "wheel")
    (rod,) = strokes(sketch, "rod")
    outer = np.linalg.norm(np.array(ground.points) - np.array(rod.points[0]), axis=1)
    inner = np.linalg.norm(np.array(rim.points) - place_of(sketch, "axis"), axis=1)
    assert ground.closed
    assert np.abs(outer / inner.mean() - 5).max() < 0.02


def test_a_disk_on_a_plane_is_seen_in_space():
    """It stands upright, and its spoke points to the plane at first."""
    sketch = sketch_of(derived("rolling_disk"))
    assert {s.name for s in strokes(sketch, "axis")} == {"x", "y", "z"}
    rim, spoke = strokes(sketch, "wheel")
    assert spoke.points[1] in rim.points
    assert spoke.points[1][0] == spoke.points[0][0]
    assert spoke.points[1][1] < spoke.points[0][1]
