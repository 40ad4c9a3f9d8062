"""Helpers of what acts between bodies, against sums over pairs written here."""

import math
from itertools import combinations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.expression import Call, Name, Node, walk
from tests.scene.scene_evaluation import value

BODIES = """
parameters: {G: 2, c: 3, M: 5}
particles:
  p[i=1..3]: {mass: i}
points:
  sun: [1, 2, 4]
  star: [0, 0, -7]
"""
AT = {
    **{f"p[{i}]": (0.3 * i, 1.1 - i * i, 0.7 * i) for i in (1, 2, 3)},
    "sun": (1.0, 2.0, 4.0),
    "star": (0.0, 0.0, -7.0),
}
NAMES = {
    **{f"{axis}_{name}": r for name, at in AT.items() for axis, r in zip("xyz", at, strict=True)},
    "G": 2.0,
    "c": 3.0,
    "M": 5.0,
}


def potential(entry: str) -> float:
    (term,) = read_text(f"{BODIES}potentials:\n  v: {entry}\n").potentials
    return float(value(term.expression.node, NAMES))


def over_pairs(amounts: dict[str, float], still: tuple[str, ...] = ("sun", "star")) -> float:
    return sum(
        amounts[a] * amounts[b] / math.dist(AT[a], AT[b])
        for a, b in combinations(amounts, 2)
        if not (a in still and b in still)
    )


MASSES = {"p[1]": 1.0, "p[2]": 2.0, "p[3]": 3.0}


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        ("{newton: G}", -2 * over_pairs(MASSES)),
        ("{newton: G, masses: {sun: M}}", -2 * over_pairs({**MASSES, "sun": 5})),
        (
            "{newton: 2*G, masses: {sun: M, star: 1 + M}}",
            -4 * over_pairs({**MASSES, "sun": 5, "star": 6}),
        ),
        ('{newton: G, between: ["p[1]", "p[3]"]}', -2 * 3 / math.dist(AT["p[1]"], AT["p[3]"])),
        (
            '{newton: G, between: [sun, "p[2]"], masses: {sun: M}}',
            -2 * 10 / math.dist(AT["sun"], AT["p[2]"]),
        ),
        (
            '{coulomb: c, charges: {"p[i=1..2]": -i, sun: M}}',
            3 * over_pairs({"p[1]": -1, "p[2]": -2, "sun": 5}),
        ),
    ],
)
def test_potentials_of_pairs(entry: str, expected: float) -> None:
    assert potential(entry) == pytest.approx(expected, rel=1e-14)


def test_families_of_potentials_of_pairs() -> None:
    scene = read_text(
        BODIES + 'potentials:\n  v[i=1..3]: {newton: G, between: [sun, "p[i]"], masses: {sun: i}}\n'
    )
    found = [value(term.expression.node, NAMES) for term in scene.potentials]
    expected = [-2 * i * i / math.dist(AT["sun"], AT[f"p[{i}]"]) for i in (1, 2, 3)]
    assert found == pytest.approx(expected, rel=1e-14)


def rates(node: Node, speeds: dict[str, float]) -> dict[str, float]:
    """The value of every ``dot(...)`` in a tree, by its text; components are linear."""
    found = {}
    for part in walk(node):
        if isinstance(part, Call) and part.function == "dot":
            inner = part.arguments[0]
            found[str(inner)] = value(inner, speeds)
    return found


def force(node: Node, speeds: dict[str, float]) -> float:
    """Evaluate a force that is a product with rates, by putting numbers for them."""
    known = rates(node, speeds)

    def replaced(part: Node) -> Node:
        if isinstance(part, Call) and part.function == "dot":
            return Name(str(part.arguments[0]), part.span)
        return part

    def of(part: Node) -> float:
        part = replaced(part)
        if isinstance(part, Name):
            return known[part.name] if part.name in known else NAMES[part.name]
        match part:
            case _ if hasattr(part, "terms"):
                return sum(of(t) if s == "+" else -of(t) for s, t in part.terms)
            case _ if hasattr(part, "factors"):
                product = 1.0
                for operator, factor in part.factors:
                    product = product * of(factor) if operator == "*" else product / of(factor)
                return product
            case _ if hasattr(part, "operand"):
                return -of(part.operand)
            case _ if hasattr(part, "base"):
                return of(part.base) ** of(part.exponent)
        return value(part, NAMES)

    return of(node)


SPEEDS = {name: math.sin(7 * k) for k, name in enumerate(sorted(NAMES))}


def test_drag_is_against_the_velocity() -> None:
    scene = read_text(
        BODIES + 'forces: {"d[i=2..3]": {drag: c + 1, on: "p[i]"}, h: {drag: c, on: "x_p[1]"}}\n'
        'coordinates: ["x_p[i=1..3]", "y_p[i=1..3]", "z_p[i=1..3]"]\n'
    )
    assert [(f.name, f.on, len(f.components)) for f in scene.forces] == [
        ("d[2]", "p[2]", 3),
        ("d[3]", "p[3]", 3),
        ("h", "x_p[1]", 1),
    ]
    found = [force(part.node, SPEEDS) for part in scene.forces[1].components]
    expected = [-4 * SPEEDS[f"{axis}_p[3]"] for axis in "xyz"]
    assert found == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("pair", [("p[1]", "p[2]"), ("sun", "p[3]")])
def test_damper_acts_along_the_line_and_on_both_ends(pair: tuple[str, str]) -> None:
    text = BODIES + f'forces: {{d: {{damper: ["{pair[0]}", "{pair[1]}"], coefficient: c}}}}\n'
    first, second = read_text(text).forces
    assert (first.on, second.on) == pair
    along = [a - b for a, b in zip(AT[pair[0]], AT[pair[1]], strict=True)]
    rate = [SPEEDS[f"{axis}_{pair[0]}"] - SPEEDS[f"{axis}_{pair[1]}"] for axis in "xyz"]
    stretching = sum(d * w for d, w in zip(along, rate, strict=True)) / math.hypot(*along)
    pull = [-3 * stretching * d / math.hypot(*along) for d in along]
    assert [force(p.node, SPEEDS) for p in first.components] == pytest.approx(pull, rel=1e-13)
    opposite = [-f for f in pull]
    assert [force(p.node, SPEEDS) for p in second.components] == pytest.approx(opposite, rel=1e-13)


@pytest.mark.parametrize(
    ("section", "entry", "message"),
    [
        (
            "potentials",
            "{newton: G, between: [sun, star]}",
            "the mass of the point 'sun' in potential 'v' is not given",
        ),
        (
            "potentials",
            "{newton: G, between: [sun, star], masses: {sun: 1, star: 2}}",
            "no two bodies act on each other in potential 'v'",
        ),
        (
            "potentials",
            '{newton: G, masses: {"p[1]": 2}}',
            "'p[1]' in 'masses' of potential 'v' has its mass as a particle",
        ),
        ("potentials", "{newton: G, masses: [1]}", "expected a mapping of particles and points"),
        ("potentials", "{newton: k}", "unknown name 'k' in potential 'v'"),
        ("potentials", "{coulomb: 1, charges: {moon: 2}}", "unknown particle or point 'moon'"),
        ("potentials", "{coulomb: 1, charges: {sun: 2}}", "no two bodies act on each other"),
        ("potentials", "{coulomb: 1}", "potential 'v' has no 'charges'"),
        ("potentials", "{newton: G, betwen: [a, b]}", "unknown key 'betwen' in potential 'v'"),
        ("forces", "{drag: c}", "force 'v' has no 'on'"),
        ("forces", "{drag: k, on: sun}", "unknown name 'k' in force 'v'"),
        ("forces", "{drag: c, on: moon}", "unknown particle, point or coordinate 'moon'"),
        ("forces", "{drag: c, on: [sun]}", "expected a particle, point or coordinate"),
        ("forces", "{damper: [sun, sun], coefficient: c}", "'damper' needs two different ends"),
        ("forces", "{damper: [sun, star]}", "force 'v' has no 'coefficient'"),
    ],
)
def test_refused(section: str, entry: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_text(f"{BODIES}{section}:\n  v: {entry}\n")
    assert any(message in problem.message for problem in caught.value.problems)


def test_pairs_are_counted_before_they_are_made() -> None:
    text = "particles: {'p[i=1..2000]': {mass: 1}}\npotentials: {v: {newton: 1}}\n"
    with pytest.raises(InputError) as caught:
        read_text(text)
    assert [problem.rule for problem in caught.value.problems] == ["limit"]


ORIGIN = """
plane: xz
parameters: {m: 1, l: 1, k: 2, M: 5, G: 1, c: 0.1}
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: {distance: [origin, bob], equals: l}}
potentials:
  spring: {spring: [bob, origin], stiffness: k, length: l}
  pull: {newton: G, between: [bob, origin], masses: {origin: M}}
forces: {brake: {damper: [origin, bob], coefficient: c}}
"""


def test_the_origin_needs_no_declaration() -> None:
    declared = ORIGIN + "points: {origin: [0, 0, 0]}\n"
    implied, stated = read_text(ORIGIN), read_text(declared)
    assert [e.text for e in implied.expressions()] == [e.text for e in stated.expressions()]
    assert [p.name for p in implied.points] == ["origin"]
    assert derive(implied).system.forcing == derive(stated).system.forcing


def test_a_point_called_origin_may_lie_elsewhere() -> None:
    elsewhere = read_text(ORIGIN + "points: {origin: [0, 0, 3]}\n")
    assert [p.position[2].text for p in elsewhere.points] == ["3"]


def test_nothing_is_added_where_the_origin_is_not_named() -> None:
    text = "particles: {bob: {mass: 1, position: [x, y, z]}}\ncoordinates: [x, y, z]\n"
    assert read_text(text).points == ()
    with pytest.raises(InputError, match="unknown particle or point 'orign'") as caught:
        read_text(ORIGIN.replace("[origin, bob], equals", "[orign, bob], equals"))
    assert caught.value.problems[0].hint == "did you mean 'origin'?"
