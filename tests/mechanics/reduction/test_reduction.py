"""The account 3N + E − K of many scenes, and refusals of geometry that does not add up."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_file, read_text
from lagrange_cli.scene.model import Scene
from tests.mechanics.mechanics_support import (
    DOUBLE_PENDULUM,
    POLAR,
    derived,
    number,
    random_point,
    refusal,
)

FREE = "particles: {bead: {mass: 1, position: [x, y, z]}}\n"

RODS = """
points: {hook: [0, 0, 0]}
constraints:
  rod1: {distance: [hook, upper], equals: l1}
  rod2: {distance: [upper, lower], equals: l2}
"""


def account(text: str) -> tuple[int, int, int, int, int]:
    """3N, E, K, DOF and how many of K no constraint states."""
    a = derived(text).derivation.account
    return a.cartesian, a.extra, a.constraints, a.dof, a.implied


def statuses(text: str) -> dict[str, str]:
    return {line.name: line.status for line in derived(text).derivation.account.lines}


ACCOUNTS = {
    "free": (FREE + "potentials: {v: x + y + z}", (3, 0, 0, 3, 0)),
    "double pendulum": (DOUBLE_PENDULUM, (6, 0, 4, 2, 2)),
    "double pendulum, rods stated": (DOUBLE_PENDULUM + RODS, (6, 0, 4, 2, 0)),
    "positions as expressions": (
        "parameters: {l: 1}\n"
        "particles: {bob: {mass: 1, position: [l*sin(q), 0, -l*cos(q)]}}\ncoordinates: [q]",
        (3, 0, 2, 1, 2),
    ),
    "positions as expressions, rod stated": (
        "parameters: {l: 1}\n"
        "particles: {bob: {mass: 1, position: [l*sin(q), 0, -l*cos(q)]}}\ncoordinates: [q]\n"
        "constraints: {rod: 'norm(x_bob, y_bob, z_bob) = l', flat: y_bob = 0}",
        (3, 0, 2, 1, 0),
    ),
    "a wheel": (
        FREE + "parameters: {J: 1}\nplane: xy\ncoordinates: [x, y, phi]\n"
        "kinetic: {spin: J*dot(phi)^2/2}",
        (3, 1, 1, 3, 0),
    ),
    "a wheel that rolls": (
        FREE + "parameters: {J: 1, R: 2}\nconstraints: {roll: x = R*phi, rest: [y = 0, z = 0]}\n"
        "coordinates: [phi]\nkinetic: {spin: J*dot(phi)^2/2}",
        (3, 0, 3 - 1, 1, 0),
    ),
    "kinetic only": (
        "parameters: {J: 1}\ncoordinates: [u, v]\nkinetic: {T: J*(dot(u)^2 + dot(v)^2)/2}",
        (0, 2, 0, 2, 0),
    ),
    "a wire that turns": (
        FREE + "parameters: {w: 2}\nconstraints: {plane: z = 0, wire: y*cos(w*t) = x*sin(w*t)}\n"
        "coordinates: [r]\ndefinitions: {x: r*cos(w*t), y: r*sin(w*t)}",
        (3, 0, 2, 1, 0),
    ),
    "definitions in a chain": (
        FREE + "coordinates: [s]\ndefinitions: {z: y^2, y: 2*x, x: b + s, b: 3*s}",
        (3, 0, 2, 1, 2),
    ),
    "one name in two positions": (
        "particles:\n  a: {mass: 1, position: [x, 0, 0]}\n  b: {mass: 2, position: [x, y, 0]}\n"
        "potentials: {v: x^2 + y^2}",
        (6, 0, 4, 2, 4),
    ),
    "three weights on two ropes": (
        "parameters: {g: 9.81}\nparticles:\n  a: {mass: 1, position: [0, 0, z1]}\n"
        "  b: {mass: 2, position: [0, 0, z2]}\n  c: {mass: 4, position: [0, 0, z3]}\n"
        "points: {pulley: [0, 0, zp]}\n"
        "constraints: {long: z1 + zp = -3, short: (z2 - zp) + (z3 - zp) = -2}\n"
        "potentials: {weight: {gravity: g}}",
        (9, 0, 7, 2, 6),
    ),
    "a rod on a table": (
        "plane: xy\nparticles:\n  a: {mass: 1, position: [x1, y1, z1]}\n"
        "  b: {mass: 1, position: [x2, y2, z2]}\n"
        "constraints: {rod: {distance: [a, b], equals: 2}}\n"
        "initial: {x1: 0, y1: 0, x2: 2, y2: 0}",
        (6, 0, 3, 3, 0),
    ),
    "a cycle of equalities": (
        FREE + "constraints: {p: x = y, q: y = z, r: x = z}",
        (3, 0, 2, 1, 0),
    ),
    "a constraint on parameters": (
        FREE + "parameters: {h: 1, k: 2}\nconstraints: {p: 2*h = k, floor: z = h}\n"
        "potentials: {v: x + y}",
        (3, 0, 1, 2, 0),
    ),
}


@pytest.mark.parametrize("name", ACCOUNTS)
def test_account(name: str) -> None:
    text, expected = ACCOUNTS[name]
    assert account(text) == expected
    cartesian, extra, constraints, dof, _ = account(text)
    e = derived(text)
    assert (
        cartesian + extra - constraints == dof == len(e.system.coordinates) - len(e.system.closures)
    )


def test_stating_what_definitions_imply_changes_only_the_wording() -> None:
    plain, stated = derived(DOUBLE_PENDULUM), derived(DOUBLE_PENDULUM + RODS)
    assert statuses(DOUBLE_PENDULUM + RODS) == {
        "plane": "independent",
        "rod1": "satisfied",
        "rod2": "satisfied",
    }
    assert plain.system.mass_matrix == stated.system.mass_matrix
    assert plain.system.forcing == stated.system.forcing
    assert not stated.derivation.warnings


def test_a_plane_restricts_every_particle() -> None:
    (line,) = derived(DOUBLE_PENDULUM).derivation.account.lines
    assert (line.name, len(line.equations), line.status) == ("plane", 2, "independent")


def test_restrictions_solved_among_themselves_are_independent() -> None:
    """No definition satisfies ``sum``: the order of solving must not change its status."""
    text = FREE + "constraints: {floor: z = 1, sum: x + z = 3, wall: x = 2}\npotentials: {v: y}"
    e = derived(text)
    found = statuses(text)
    assert sorted(found.values()) == ["independent", "independent", "redundant"]
    assert [w.rule for w in e.derivation.warnings] == ["redundant"]


def test_rheonomic_constraints_are_told_apart() -> None:
    text = (
        FREE + "parameters: {A: 1, w: 2}\nconstraints: {shaken: x = A*cos(w*t), flat: y = 0}\n"
        "potentials: {v: z}"
    )
    e = derived(text)
    assert {line.name: line.rheonomic for line in e.derivation.account.lines} == {
        "shaken": True,
        "flat": False,
    }
    assert e.derivation.facts.rheonomic
    assert not derived(DOUBLE_PENDULUM).derivation.facts.rheonomic


# Coordinates.


def test_coordinates_are_chosen_where_none_are_declared() -> None:
    e = derived(FREE + "constraints: {flat: y = 0, parabola: z = x^2}")
    assert [c.name for c in e.system.coordinates] == ["x"]
    assert e.derivation.account.chosen_automatically
    assert not derived(POLAR).derivation.account.chosen_automatically


def test_a_name_that_nothing_mentions_is_warned_of() -> None:
    e = derived(FREE + "constraints: {flat: y = 0}\npotentials: {weight: z}")
    assert [w.message for w in e.derivation.warnings] == [
        "'x' stands in no other section; it is taken as a coordinate"
    ]


@pytest.mark.parametrize(
    ("sections", "rule", "named"),
    [
        ("coordinates: [x]", "too-few-coordinates", ["'y'", "'z'", "3"]),
        ("constraints: {c: y + z = x}\ncoordinates: [x]", "too-few-coordinates", ["2"]),
        ("constraints: {c: y = x, d: z = 0}\ncoordinates: [x, y]", "too-many-coordinates", ["'c'"]),
        ("constraints: {c: y = 2, d: z = 0}\ncoordinates: [x, y]", "too-many-coordinates", ["'y'"]),
        (
            "constraints: {c: x^2 = sin(y)^2}\ncoordinates: [x, y, z]",
            "too-many-coordinates",
            ["'c'", "'x'", "'y'"],
        ),
        (
            "plane: xz\nconstraints: {u: z = 0}\ndefinitions: {x: sin(p + q)}\ncoordinates: [p, q]",
            "dependent-coordinates",
            ["'p'", "'q'", "1"],
        ),
        (
            "plane: xy\ndefinitions: {x: r*cos(p - q), y: r*sin(p - q)}\ncoordinates: [r, p, q]",
            "dependent-coordinates",
            ["'p'", "'q'"],
        ),
        ("plane: xz\ncoordinates: [x, z, s]\npotentials: {u: s^2}", "no-inertia", ["'s'"]),
        ("plane: xy\ncoordinates: [x, y, s]", "no-inertia", ["'s'"]),
        ("definitions: {x: y + 1, y: x + 1}", "cycle", ["x", "y"]),
    ],
)
def test_coordinates_that_do_not_fit_are_explained(
    sections: str, rule: str, named: list[str]
) -> None:
    problem = refusal(FREE + sections)
    assert problem.rule == rule
    assert problem.mark is not None
    for word in named:
        assert word in problem.message


def test_dependent_coordinates_do_not_name_innocent_ones() -> None:
    problem = refusal(
        FREE + "plane: xy\ndefinitions: {x: r*cos(p - q), y: r*sin(p - q)}\ncoordinates: [r, p, q]"
    )
    assert "'r'" not in problem.message
    words, first, second = problem.hint.splitlines()
    assert words == "give one of them inertia in 'kinetic', or leave it out:"
    assert first in ("coordinates: [r, p]", "coordinates: [r, q]")
    assert second.startswith("definitions: {" + ({"p", "q"} - set(first)).pop() + ": ")


# Constraints that say the same, or the contrary.


def redundant(text: str) -> dict[str, set[str]]:
    """Constraint → those that imply it, from the account; every one has its warning."""
    e = derived(text)
    lines = {
        x.name: set(x.implied_by) for x in e.derivation.account.lines if x.status == "redundant"
    }
    warned = [w.message for w in e.derivation.warnings if w.rule == "redundant"]
    assert len(warned) == len(lines)
    for name, by in lines.items():
        (message,) = [w for w in warned if f"'{name}'" in w.split(" is redundant")[0]]
        assert all(f"'{b}'" in message for b in by)
    return lines


def test_a_constraint_written_twice() -> None:
    text = DOUBLE_PENDULUM + "constraints: {a: x1^2 + z1^2 = l1^2, b: 2*x1^2 = 2*l1^2 - 2*z1^2}"
    assert redundant(text) == {"b": {"a"}}
    assert account(text) == (6, 0, 4, 2, 1)


def test_a_constraint_implied_by_two_others() -> None:
    text = FREE + "constraints: {p: x = y, q: y = z, r: x = z}"
    assert redundant(text) == {"r": {"p", "q"}}


def test_an_identity_restricts_nothing() -> None:
    text = FREE + "constraints: {p: x + 1 = 1 + x, floor: z = 0}\npotentials: {v: x + y}"
    assert redundant(text) == {"p": set()}
    assert account(text) == (3, 0, 1, 2, 0)


def test_four_rods_hold_one_particle() -> None:
    """Three distances fix a point; the fourth follows from them and is named."""
    text = (
        FREE + "points: {a: [0, 0, 0], b: [2, 0, 0], c: [0, 2, 0], d: [2, 2, 0]}\n"
        "constraints:\n  ra: {distance: [a, bead], equals: sqrt(3)}\n"
        "  rb: {distance: [b, bead], equals: sqrt(3)}\n"
        "  rc: {distance: [c, bead], equals: sqrt(3)}\n"
        "  rd: {distance: [d, bead], equals: sqrt(3)}\n"
        "initial: {x: 1, y: 1, z: 1}\n"
    )
    assert account(text) == (3, 0, 3, 0, 0)
    assert redundant(text) == {"rd": {"ra", "rb", "rc"}}


@pytest.mark.parametrize("size", ["1e-12", "1", "1e16"])
def test_gradients_of_unequal_size_are_not_taken_for_dependent(size: str) -> None:
    """Two racks on one pinion, in metres and in any other unit."""
    text = (
        f"parameters: {{R: {size}}}\nparticles:\n  a: {{mass: 1, position: [x, 0, 0]}}\n"
        "  b: {mass: 1, position: [u, 0, 0]}\npoints: {mark: [phi, 0, 0]}\n"
        "constraints: {first: phi - x/R = 0, second: phi - u/(2*R) = 0}\ncoordinates: [phi]"
    )
    assert set(statuses(text).values()) == {"independent"}
    assert account(text)[:4] == (6, 0, 5, 1)


@pytest.mark.parametrize("seed", range(6))
def test_a_fixed_coordinate_is_surplus_wherever_it_is_looked_at(seed: int) -> None:
    """The random configurations depend on the text; what is said of the scene must not."""
    problem = refusal(FREE + f"constraints: {{c: y = 2, d: z = 0}}\ncoordinates: [x, y]  # {seed}")
    assert problem.rule == "too-many-coordinates"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sections", "named"),
    [
        ("constraints: {p: z = 0, q: z = 1}", {"'p'", "'q'"}),
        ("constraints: {p: z = 0, q: x = 3, r: z = 1e-3}", {"'p'", "'r'"}),
        ("parameters: {h: 1, k: 2.1}\nconstraints: {p: z = h, q: 2*z = k}", {"'p'", "'q'"}),
        ("parameters: {h: 1, k: {unit: m}}\nconstraints: {p: z = h, q: z = k}", {"'p'", "'q'"}),
        ("parameters: {h: 1, k: 2}\nconstraints: {p: 3*h = k}", {"'p'"}),
        ("constraints: {p: z = 2, q: x^2 + z^2 = 1, r: y = 0}", {"'p'", "'q'"}),
        ("constraints: {p: x^2 = -1}", {"'p'"}),
        ("constraints: {p: x + y = 1, q: y + z = 2, r: x - z = 5}", {"'p'", "'q'", "'r'"}),
        ("constraints: {p: sin(x) = 2}", {"'p'"}),
        ("constraints: {p: exp(x) = -2}", {"'p'"}),
        ("constraints: {p: sqrt(z) = -1}", {"'p'"}),
        ("constraints: {p: acos(z) = 4}", {"'p'"}),
        ("constraints: {p: asin(z) = 2}", {"'p'"}),
        ("constraints: {p: atan(z) = 2}", {"'p'"}),
        ("constraints: {p: acosh(z) = -1}", {"'p'"}),
        (
            "parameters: {l: 1}\nplane: xz\nconstraints: {p: 'norm(x, z) = -l'}\n"
            "initial: {x: 0.6, z: 0.8}",
            {"'p'"},
        ),
        ("definitions: {z: 2}\nconstraints: {p: z = 1}", {"'p'"}),
    ],
)
def test_contradictions_name_the_constraints(sections: str, named: set[str]) -> None:
    problem = refusal(FREE + sections)
    assert problem.rule == "inconsistent"
    assert problem.mark is not None
    for name in ("'p'", "'q'", "'r'"):
        assert (name in problem.message) == (name in named)


def test_irrational_numbers_may_be_written_in_decimals() -> None:
    text = FREE + "constraints: {p: z = %s, q: z = sqrt(6)/4}\npotentials: {v: x + y}"
    assert redundant(text % "0.6123724356957945") == {"q": {"p"}}
    assert redundant(text % "0.61237243570") == {"q": {"p"}}
    assert refusal(FREE + "constraints: {p: z = 0.612372, q: z = sqrt(6)/4}").rule == "inconsistent"


# Masses.


@pytest.mark.parametrize(
    ("mass", "parameters"),
    [("0", ""), ("-1", ""), ("m", "m: -2"), ("m", "m: 0"), ("m - n", "m: 1, n: 1"), ("1 - 2", "")],
)
def test_masses_are_positive(mass: str, parameters: str) -> None:
    problem = refusal(
        f"parameters: {{{parameters}}}\nparticles: {{bead: {{mass: {mass}, position: [x, y, z]}}}}"
    )
    assert problem.rule == "mass"
    assert problem.mark is not None
    assert "'bead'" in problem.message


@pytest.mark.parametrize("mass", ["1 + x", "1 + t", "exp(t)"])
def test_masses_are_constant(mass: str) -> None:
    problem = refusal(f"particles: {{bead: {{mass: {mass}, position: [x, y, z]}}}}")
    assert problem.mark is not None


# Every particle is where its constraints and definitions put it.


def test_resolved_positions_satisfy_every_constraint() -> None:
    """Atwood's tree of pulleys and the shipped scenes, at random coordinates."""
    texts = [text for text, _ in ACCOUNTS.values()]
    texts = [t for t in texts if "constraints" in t]
    assert len(texts) >= 8
    for text in texts:
        if not derived(text).system.closures:
            _require_satisfied(read_text("name: tested\n" + text), derived(text))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["lecture/masses_through_hole", "lecture/rigid_triangle", "pulleys/double_atwood"]
)
def test_shipped_positions_satisfy_every_constraint(name: str) -> None:
    path = Path(__file__).parents[3] / "systems" / f"{name}.yaml"
    scene = read_file(str(path))
    _require_satisfied(scene, derive(scene))


def _require_satisfied(scene: Scene, e: Equations) -> None:
    point = random_point([e.system.t, *(c.q for c in e.system.coordinates)], 5)
    start = e.system.initial.positions if e.system.initial else None
    if start is not None:
        for c, q0 in zip(e.system.coordinates, start, strict=True):
            point[c.q] = q0 + (point[c.q] - 1) / 50
    for p in e.system.parameters:
        point[p.symbol] = p.value
    for constraint in scene.constraints:
        for equation in constraint.equations:
            left, right = (interpret(e, side) for side in (equation.left, equation.right))
            size = 1 + abs(number(sp.sympify(left), point))
            assert abs(number(left - right, point)) < size * 1e-14
