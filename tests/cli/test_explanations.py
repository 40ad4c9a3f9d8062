"""What is wrong with a scene is named, and what is suggested works where it is pasted."""

from __future__ import annotations

import re
import shlex

import pytest

from tests.cli.explaining import P, hints, pasted, rods, run, without
from tests.cli.terminal import ROOT, lagrange

pytestmark = pytest.mark.slow

CIRCLE = (
    "parameters: {l: 2, g: 9.81}\n" + P + "constraints: {plane: y = 0, rod: x^2 + z^2 = l^2}\n"
    "potentials: {weight: {gravity: g}}\nsimulate: {until: 0.1}\n"
)
POLAR = (
    P + "coordinates: [r, phi, h]\n"
    "definitions: {x: r*cos(phi), y: r*sin(phi), z: h}\nsimulate: {until: 0.1}\n"
)
CORNERS = ["a", "b", "c", "d"]
RODS = {f"{p}{q}": [p, q] for k, p in enumerate(CORNERS) for q in CORNERS[k + 1 :]}
FOUR_BAR = """
parameters: {a: 1, d: 3}
particles:
  A: {mass: 1, position: [a*cos(th), 0, a*sin(th)]}
  B: {mass: 1, position: [a*cos(th) + d*cos(ph), 0, a*sin(th) + d*sin(ph)]}
coordinates: [th, ph, ps]
constraints:
  loop: [a*cos(th) + d*cos(ph) = d + a*cos(ps), a*sin(th) + d*sin(ph) = a*sin(ps)]
initial: {th: 0, ph: 0, ps: 0}
simulate: {until: 0.1}
"""


TETRAHEDRON = rods(dict.fromkeys(RODS, 1))


# Suggested lines.


@pytest.mark.parametrize(
    ("command", "scene", "rule", "count"),
    [
        ("derive", P + "constraints: {plane: y = 0}\ncoordinates: [x]\n", "too few", 1),
        ("derive", P + "constraints: {c: z = x^2}\ncoordinates: [x, y, z]\n", "too many", 1),
        ("derive", P + "constraints: {c: z = 1}\ncoordinates: [x, y, z]\n", "too many", 1),
        ("derive", P + "constraints: {c: z = x^2}\ncoordinates: [z, x, y]\n", "too many", 1),
        (
            "derive",
            P + "coordinates: [x, y]\nconstraints: {c: x^2 + y^2 + z^2 = 9}\n",
            "leaves several branches",
            2,
        ),
        ("derive", P + "constraints: {c: x*(y - 1)*z = 0}\n", "holds in several ways", 3),
        ("derive", P + "constraints: {c: x^2 = 0}\n", "is singular", 1),
        ("derive", P + "constraints: {c: x^2 + (y - z)^2 = 0}\n", "is singular", 1),
        ("derive", P + "constraints: {c: (x - sin(z))^2 = 0}\n", "is singular", 1),
        (
            "derive",
            P + "coordinates: [x]\ninitial: {x: 2, z: 0}\n"
            "constraints: {plane: y = 0, c: x^2 + z^2 = 1}\n",
            "is not real",
            1,
        ),
        ("simulate", CIRCLE + "initial: {x: 1.2}\n", "several configurations", 2),
        ("simulate", CIRCLE + "initial: {dot(x): 0.6}\n", "do not determine 'x', 'z'", 1),
        ("simulate", CIRCLE + "initial: {x: 1, z: 1}\n", "violate constraint 'rod'", 1),
        ("simulate", CIRCLE + "initial: {x: 3}\n", "no configuration with the initial", 1),
        (
            "simulate",
            CIRCLE + "initial: {x: 1.2, z: 1.6, dot(x): 1, dot(z): 1}\n",
            "initial velocities violate",
            1,
        ),
        ("simulate", POLAR + "initial: {r: 1, phi: 'atan2(1, 2)'}\n", "do not determine 'h'", 1),
        ("simulate", POLAR + "initial: {r: 1, phi: 0, h: 0, x: 2}\n", "they ask for 1", 1),
        (
            "simulate",
            P + "constraints: {c: dot(x) = 2*dot(y)}\nsimulate: {until: 0.1}\n"
            "initial: {z: 0, x: 1, y: 1, dot(x): 1, dot(y): 1}\n",
            "violates the constraints",
            1,
        ),
    ],
)
def test_a_suggested_line_works_where_it_is_pasted(
    command: str, scene: str, rule: str, count: int
) -> None:
    done = run(command, scene)
    assert done.returncode == 2
    assert rule in done.stderr
    lines = [h for h in hints(done) if re.match(r"[\w\[\]]+: ", h)]
    assert len(lines) == count, done.stderr
    for line in lines:
        again = run(command, pasted(scene, line))
        assert again.returncode == 0, (line, again.stderr)


@pytest.mark.parametrize(
    ("scene", "wrong"),
    [
        (
            P + "coordinates: [a, b, c]\ndefinitions: {x: a + b, y: 2*a + 2*b, z: c}\n",
            "'a', 'b' are not independent",
        ),
        (
            "parameters: {l: 2}\n" + P + "coordinates: [r, s]\nconstraints: {rod: 2*r = l}\n"
            "definitions: {x: r*cos(s), y: r*sin(s), z: 0}\n",
            "constraint 'rod' fixes 'r'",
        ),
        (
            P + "coordinates: [u, v]\nconstraints: {tie: u - 2*v = 1}\n"
            "definitions: {x: u*v, y: v, z: 0}\n",
            "constraint 'tie' relates 'u', 'v'",
        ),
    ],
)
def test_a_surplus_coordinate_becomes_a_definition(scene: str, wrong: str) -> None:
    """It stands in other definitions: two lines belong together."""
    done = run("derive", scene)
    assert done.returncode == 2
    assert wrong in done.stderr
    *words, first, second = hints(done)
    inertia = ["give one of them inertia in 'kinetic', or leave it out:"]
    assert words == (inertia if "independent" in wrong else [])
    again = run("derive", pasted(pasted(scene, first), second))
    assert again.returncode == 0, again.stderr


@pytest.mark.parametrize(
    "scene",
    [
        CIRCLE,
        POLAR,
        FOUR_BAR.replace("initial: {th: 0, ph: 0, ps: 0}\n", ""),
        TETRAHEDRON + "simulate: {until: 0.1}\n",
        P + "constraints: {curve: x^4 + z^4 = 1e-36}\nsimulate: {until: 0.1}\n"
        "near: {x: 1e-9, z: 0}\n",
        P + "constraints: {c: dot(x) = 2*dot(y)}\ninitial: {z: 0, dot(z): 1}\n"
        "simulate: {until: 0.1}\n",
        "parameters: {k: {unit: N/m}}\n" + P + "potentials: {v: k*(x^2 + y^2 + z^2)/2}\n",
    ],
)
def test_options_that_are_suggested_work_on_the_command_line(scene: str) -> None:
    """As often as something is missing: parameters, a start, an end."""
    options: list[str] = []
    for _ in range(4):
        done = run("simulate", scene, *options)
        if done.returncode == 0:
            break
        assert done.returncode == 2, done.stderr
        *_, hint = hints(done)
        options += shlex.split(hint.split(", or ")[0])
    assert done.returncode == 0, done.stderr
    assert options


def test_a_rod_that_is_made_shorter() -> None:
    scene = rods({"ab": 1, "bc": 1, "ca": 3})
    done = run("derive", scene)
    assert done.returncode == 2
    assert "constraints 'ab', 'bc', 'ca' contradict each other" in done.stderr
    assert "'a' and 'c' are to be 3 apart, where 'ab' and 'bc' reach 2 at most" in done.stderr
    hint, line = hints(done)
    assert hint == "'ca' can be 0 to 2 long:"
    assert run("derive", pasted(scene, line)).returncode == 0
    assert run("derive", scene.replace("equals: 3", "equals: 1.99")).returncode == 0


@pytest.mark.parametrize(
    ("scene", "named"),
    [
        (P + "constraints: {floor: z = 0, wall: x = 1, shelf: z = 1}\n", ["floor", "shelf"]),
        (
            P + "constraints: {one: x + 2*y + z = 1, two: 2*x + 4*y + 2*z = 5, three: x = y}\n",
            ["one", "two"],
        ),
        (
            P + "constraints: {flat: y = 0, small: x^2 + z^2 = 1, large: x^2 + z^2 = 4}\n",
            ["small", "large"],
        ),
        (P + "constraints: {flat: y = 0, ring: x^2 + z^2 = 1, wall: x = 2}\n", ["ring", "wall"]),
        (P + "constraints: {flat: y = 0, ring: x^2 + z^2 = -1}\n", ["ring"]),
        (P + "constraints: {one: dot(x) = 1, two: dot(x) = 2}\n", ["one", "two"]),
        (rods({**dict.fromkeys(RODS, 1), "cd": 1.9}), list(RODS)),
        (rods({"ab": 1, "bc": 1, "ac": 2}), ["ab", "bc", "ac"]),
    ],
)
def test_any_of_the_constraints_that_are_named_may_be_left_out(
    scene: str, named: list[str]
) -> None:
    done = run("derive", scene)
    assert done.returncode == 2
    listed = ", ".join(f"'{n}'" for n in named)
    assert f"constraint{'s' if len(named) > 1 else ''} {listed} " in done.stderr
    (hint,) = hints(done)
    assert re.findall(r"'(\w+)'", hint) == named
    for name in dict.fromkeys((named[0], named[-1])):
        again = run("derive", without(scene, name))
        assert again.returncode == 0, (name, again.stderr)


# What is redundant or singular.


def test_the_rigid_tetrahedron() -> None:
    done = run("derive", TETRAHEDRON)
    assert done.returncode == 0
    assert "3N = 12, K = 6, DOF = 6" in done.stdout
    assert "warning" not in done.stderr


def test_a_fifth_particle_at_the_centre() -> None:
    scene = ROOT / "systems/lecture/rigid_tetrahedron_centre.yaml"
    done = lagrange("derive", str(scene))
    assert done.returncode == 0
    assert "DOF = 6" in done.stdout
    (warned,) = re.findall(r"warning: constraint '(\w+)' is redundant: implied by", done.stderr)
    strict = lagrange("derive", str(scene), "--strict")
    assert strict.returncode == 2
    assert f"constraint '{warned}' is redundant" in strict.stderr
    # Without it the warning is gone, and nothing else has changed.
    again = run("derive", without(scene.read_text(), warned), "--strict")
    assert again.returncode in (0, 2)
    assert "redundant" not in again.stderr


def test_a_folded_parallelogram() -> None:
    done = run("derive", FOUR_BAR)
    assert done.returncode == 0
    assert "warning: constraint 'loop_1' is singular at the initial configuration" in done.stderr
    assert run("derive", FOUR_BAR, "--strict").returncode == 2
    assert run("simulate", FOUR_BAR).returncode == 2
    (line,) = (h for h in hints(done) if h.startswith("initial:"))
    again = run("simulate", pasted(FOUR_BAR, line), "--strict")
    assert again.returncode == 0, again.stderr
