"""Sections of a scene: what is read, written out, and refused."""

import math
import random
from fractions import Fraction

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.scene import expected_error, read_text
from lagrange_cli.scene.language.expression import Name, names_in
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reader import SECTIONS
from tests.scene.scene_evaluation import value

BEAD = """
name: bead_on_parabola
title: Bead sliding on a parabola
parameters:
  m: 1.0
  a: {value: 0.5, unit: 1/m, positive: true, description: curvature, latex: '\\alpha_{1}'}
  g: 9.81
  k: {}
particles:
  bead: {mass: m, position: [x, y, z]}
constraints:
  plane: y = 0
  wire: z = a*x^2
coordinates: [x]
potentials:
  weight: m*g*z
initial: {x: 1.0, dot(x): 0.0}
simulate: {until: 20*pi, accuracy: 1e-9, samples: 501, from: 1, method: DOP853}
expect:
  dof: 1
  cyclic: []
  equations:
    - (1 + 4*a^2*x^2)*ddot(x) + 4*a^2*x*dot(x)^2 + 2*a*g*x = 0
  conserved: [energy]
  state: [{t: 1, x: 0.5, dot(x): 1, within: 1e-8}]
  drift: {energy: 1e-9}
"""

#: Two particles in general positions and a point, for helpers.
BODIES = """
parameters: {m1: 1, m2: 2, g: 9.81, k: 3, l: 1, alpha: 0.4}
points: {pivot: [l*cos(t), 0, 2]}
particles:
  a: {mass: m1}
  b: {mass: m1 + m2, position: [u, v, w]}
"""
PLACES = {
    **dict(zip(("x_a", "y_a", "z_a"), (0.3, -1.2, 0.7), strict=True)),
    **dict(zip(("x_b", "y_b", "z_b"), (-0.4, 2.2, 1.7), strict=True)),
    **dict(zip(("x_pivot", "y_pivot", "z_pivot"), (0.9, 0.1, 2.0), strict=True)),
    "m1": 1.3,
    "m2": 2.1,
    "g": 9.7,
    "k": 3.3,
    "l": 0.8,
    "alpha": 0.4,
}


def refused(text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        read_text(text)
    return [problem.message for problem in caught.value.problems]


def position(name: str) -> tuple[float, ...]:
    return tuple(PLACES[f"{axis}_{name}"] for axis in "xyz")


def test_a_scene_is_read_whole() -> None:
    scene = read_text(BEAD, "somewhere.yaml")
    assert (scene.name, scene.title, scene.file) == (
        "bead_on_parabola",
        "Bead sliding on a parabola",
        "somewhere.yaml",
    )
    m, a, _, k = scene.parameters
    assert m.value is not None
    assert value(m.value.node, {}) == 1
    assert (a.unit, a.positive, a.description, a.latex) == (
        "1/m",
        True,
        "curvature",
        "\\alpha_{1}",
    )
    assert k.value is None
    assert [p.node.name for p in scene.particles[0].position if isinstance(p.node, Name)] == [
        "x",
        "y",
        "z",
    ]
    assert [(c.name, [e.text for e in c.equations]) for c in scene.constraints] == [
        ("plane", ["y = 0"]),
        ("wire", ["z = a*x^2"]),
    ]
    assert [(v.name, v.order, v.value.text) for v in scene.initial] == [
        ("x", 0, "1.0"),
        ("x", 1, "0.0"),
    ]
    simulate = scene.simulate
    assert simulate.until is not None
    assert value(simulate.until.node, {}) == pytest.approx(20 * math.pi)
    assert (simulate.start.text, simulate.samples.text, simulate.method) == ("1", "501", "DOP853")
    expect = scene.expect
    assert (expect.dof, expect.cyclic, expect.conserved) == (1, (), ("energy",))
    (state,) = expect.states
    assert [(v.name, v.order) for v in state.values] == [("x", 0), ("x", 1)]
    assert expect.drift[0][0] == "energy"
    assert expect.equations is not None
    assert expect.equations[0].origin.line == 23
    assert scene.warnings == ()
    assert len(scene.digest) == 64


def test_every_section_is_read_from_the_registry() -> None:
    fields = set(Scene.__dataclass_fields__)
    # Bodies are among the particles, and frames are definitions.
    assert set(SECTIONS) - fields == {"plane", "frames", "bodies"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1e3", 1000),
        ("010", 10),
        ("0x10", 16),
        ("0o17", 15),
        ("+1.5", Fraction(3, 2)),
        (".5", Fraction(1, 2)),
        ("'2'", 2),
        ("1_000", None),
        ("0b1", None),
        ("1:30", None),
        ("true", None),
        ("2001-01-01", 1999),
    ],
)
def test_numbers_follow_the_core_schema(text: str, expected: Fraction | None) -> None:
    scene = f"parameters: {{a: {text}}}\ncoordinates: [x]\n"
    if expected is None:
        assert refused(scene)
    else:
        parameter = read_text(scene).parameters[0].value
        assert parameter is not None
        assert value(parameter.node, {}, exact=True) == expected


def test_words_that_were_booleans_are_names() -> None:
    scene = read_text("parameters: {on: 1, no: 2, y: 3, off: on + no}\ncoordinates: [n]\n")
    assert [p.name for p in scene.parameters] == ["on", "no", "y", "off"]
    assert refused("parameters: {a: {positive: yes}}") == [
        "expected true or false for 'positive' of parameter 'a', found 'yes'"
    ]


def test_particle_without_position_has_its_components_as_coordinates() -> None:
    scene = read_text("particles: {bob: {mass: 1}}\ncoordinates: [x_bob, y_bob, z_bob]\n")
    assert [p.text for p in scene.particles[0].position] == ["x_bob", "y_bob", "z_bob"]


@pytest.mark.parametrize("plane", ["xy", "zx", "yz"])
def test_plane_is_written_out_for_every_particle(plane: str) -> None:
    scene = read_text(f"plane: {plane}\n{BODIES}")
    (constraint,) = scene.constraints
    across = ({"x", "y", "z"} - set(plane)).pop()
    assert constraint.name == "plane"
    assert [e.text for e in constraint.equations] == [f"{across}_a = 0", f"{across}_b = 0"]


def test_distance_is_written_out() -> None:
    scene = read_text(BODIES + "constraints: {rod: {distance: [a, pivot], equals: l + 1}}\n")
    (equation,) = scene.constraints[0].equations
    assert value(equation.left.node, PLACES) == pytest.approx(
        math.dist(position("a"), position("pivot")) ** 2
    )
    assert value(equation.right.node, PLACES) == pytest.approx((0.8 + 1) ** 2)


@pytest.mark.parametrize(
    ("length", "rest"), [("", 0.0), (", length: l/2 - 1", -0.6), (", length: -l", -0.8)]
)
def test_spring_is_written_out(length: str, rest: float) -> None:
    scene = read_text(BODIES + f"potentials: {{s: {{spring: [a, b], stiffness: k + 1{length}}}}}\n")
    stretch = math.dist(position("a"), position("b")) - rest
    found = value(scene.potentials[0].expression.node, PLACES)
    assert found == pytest.approx(0.5 * 4.3 * stretch**2)


@pytest.mark.parametrize(
    ("direction", "vector"),
    [
        (None, (0, 0, -1)),
        ("[0, 0, -1]", (0, 0, -1)),
        ("[0, 0, 2]", (0, 0, 1)),
        ("[0, -3, 0]", (0, -1, 0)),
        ("[3, 0, -4]", (0.6, 0, -0.8)),
        ("[1, 1, -1]", (1, 1, -1)),
        ("[sin(alpha), 0, -cos(alpha)]", (math.sin(0.4), 0, -math.cos(0.4))),
        ("[k, -l, 1]", (3.3, -0.8, 1)),
        ("[0, l - g, 0]", (0, -1, 0)),
        ("[sqrt(2)/2, 0, -sqrt(2)/2]", (1, 0, -1)),
    ],
)
@pytest.mark.parametrize("strength", ["g", "-g", "2*g + 1"])
def test_gravity_is_written_out(
    direction: str | None, vector: tuple[float, ...], strength: str
) -> None:
    entry = f"gravity: {strength}" + (f", direction: {direction}" if direction else "")
    scene = read_text(BODIES + f"potentials: {{w: {{{entry}}}}}\n")
    size = math.hypot(*vector)
    g = {"g": 9.7, "-g": -9.7, "2*g + 1": 20.4}[strength]
    height = {
        name: sum(v * r for v, r in zip(vector, position(name), strict=True)) / size
        for name in "ab"
    }
    found = value(scene.potentials[0].expression.node, PLACES)
    assert found == pytest.approx(-1.3 * g * height["a"] - 3.4 * g * height["b"])


def test_written_out_text_parses_to_the_same_value() -> None:
    scene = read_text(BODIES + "potentials: {w: {gravity: g}, s: {spring: [a, b], stiffness: k}}\n")
    lines = "".join(f"  {p.name}: {p.expression.text}\n" for p in scene.potentials)
    again = read_text(BODIES + "potentials:\n" + lines)
    for first, second in zip(scene.potentials, again.potentials, strict=True):
        names = {n.name: random.Random(n.name).random() for n in names_in(first.expression.node)}
        assert value(first.expression.node, names) == value(second.expression.node, names)
    assert scene.potentials[0].expression.text == "m1*g*z_a + (m1 + m2)*g*z_b"


def test_units_vectors_in_directions_are_not_divided() -> None:
    text = "potentials: {w: {gravity: g, direction: [sin(alpha), 0, -cos(alpha)]}}\n"
    assert "norm" not in read_text(BODIES + text).potentials[0].expression.text
    text = "potentials: {w: {gravity: g, direction: [sin(alpha), 0, -2*cos(alpha)]}}\n"
    assert "norm" in read_text(BODIES + text).potentials[0].expression.text


def test_helpers_are_reported_where_they_stand() -> None:
    scene = read_text(BODIES + "potentials:\n  w: {gravity: g}\n")
    expression = scene.potentials[0].expression
    mark = expression.mark(expression.node.span)
    assert (mark.line, mark.text[mark.column - 1 :][: mark.length]) == (8, "gravity")


@pytest.mark.slow
def test_many_particles_in_one_helper() -> None:
    text = "particles:\n" + "".join(f"  p{i}: {{mass: 1}}\n" for i in range(3000))
    scene = read_text(text + "potentials: {w: {gravity: 9.81}}\n")
    assert len(scene.potentials[0].expression.text) > 20_000


def test_forces() -> None:
    scene = read_text(
        BODIES + "coordinates: [u, v, w]\n"
        "forces: {f: {on: b, force: [1, dot(u), t]}, h: {on: u, force: -k*dot(u)}}\n"
    )
    assert [(f.on, len(f.components)) for f in scene.forces] == [("b", 3), ("u", 1)]


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("systems/double-pendulum.yaml", "double_pendulum"),
        ("2body.yaml", "scene_2body"),
        ("<text>", "text"),
        ("é.yaml", "scene"),
        ("", "scene"),
        ("a" * 300, "a" * 100),
    ],
)
def test_absent_name_is_the_files_stem(file: str, name: str) -> None:
    assert read_text("particles: {a: {mass: 1}}", file).name == name


def test_independent_problems_are_reported_together() -> None:
    messages = refused(
        "parameters: {m: 1}\nparticles: {p: {mass: m, position: [x, y, z]}}\n"
        "potentials: {v: qq*x, w: x +}\nconstraints: {c: rr = 1}\nsimulate: {untl: 1}\n"
    )
    assert len(messages) == 4


def test_names_are_not_looked_up_where_declarations_failed() -> None:
    assert refused("paramters: {m: 1}\npotentials: {v: m*x}\n") == ["unknown section 'paramters'"]


def test_expected_error_is_found_in_a_refused_scene() -> None:
    text = "potentials: {v: x +}\nexpect: {error: {kind: syntax, contains: expected}}\n"
    found = expected_error(text)
    assert found is not None
    assert (found.kind, found.contains) == ("syntax", "expected")
    assert refused(text)
    assert expected_error("potentials: {v: 1}\n") is None
    assert expected_error("expect: [error]\n") is None
    assert expected_error("a: [") is None


def test_same_text_gives_equal_scenes() -> None:
    assert read_text(BEAD) == read_text(BEAD.encode())
