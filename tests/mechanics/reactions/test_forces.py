"""Constraint forces against closed forms, Newton's law, and each formulation against the other."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp

from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.reactions import constraint_forces as forces
from lagrange_cli.scene import read_file, read_text
from tests.mechanics.mechanics_support import DOUBLE_PENDULUM
from tests.systems.shipped import BODIES, IN_PIECES, sliced

SYSTEMS = Path(__file__).parents[3] / "systems"
SCENES = {p.stem: p for p in sorted(SYSTEMS.rglob("*.yaml")) if p.parent.name != "refused"}

#: Scenes whose forces take seconds; the certificate of each derivation checks them anyway.
LARGE = {"andrews_squeezer", "balance", "double_pendulum", "net_of_springs", "pendulum_chain"}
LARGE |= {"pleiades", "rigid_tetrahedron", "rigid_tetrahedron_centre", "rigid_triangle"}
LARGE |= {"tautochrone", "triple_pendulum"}


def shipped(name):
    return derive(read_file(str(SCENES[name])), forces=True)


def written(text):
    return derive(read_text("name: tested\n" + text), forces=True)


def names(e):
    """Symbols by name."""
    found = {p.name: p.symbol for p in e.system.parameters} | {"t": e.system.t}
    for c in e.system.coordinates:
        found |= {c.name: c.q, f"{c.name}_dot": c.v, f"{c.name}_ddot": c.a}
    return found


def reaction(e, name):
    return next(r for r in e.derivation.constraint_forces.reactions if r.name == name)


def same(e, found, expected):
    """Whether an expression is the one written with the names of a scene."""
    symbols = names(e)
    expected = sp.sympify(expected, locals=symbols)
    free = sorted((found.free_symbols | expected.free_symbols), key=str)
    rng = random.Random(7)
    for _ in range(5):
        point = {s: sp.Float(rng.uniform(0.3, 1.7), 30) for s in free}
        a, b = (sp.sympify(x).xreplace(point).evalf(30) for x in (found, expected))
        if abs(a - b) > sp.Float("1e-24") * (abs(a) + abs(b)):
            return False
    return True


# Closed forms.


def test_tension_of_the_rod_of_a_pendulum():
    e = shipped("pendulum")
    (bob,) = e.derivation.constraint_forces.bodies
    assert same(e, bob.size, "m*g*cos(theta) + m*l*theta_dot**2")
    pull = "(m*g*cos(theta) + m*l*theta_dot**2)"
    assert same(e, bob.components[0], f"-{pull}*sin(theta)")
    assert bob.components[1] == 0
    assert same(e, bob.components[2], f"{pull}*cos(theta)")


def test_tension_of_the_rope_through_a_hole():
    e = shipped("masses_through_hole")
    rope = reaction(e, "rope")
    tension = "M*m*(g + r*theta_dot**2)/(M + m)"
    # φ = r − z2 − l: a taut rope pulls r inwards and z2 upwards, so that λ is negative.
    assert same(e, rope.multiplier, f"-{tension}")
    puck, weight = e.derivation.constraint_forces.bodies
    assert same(e, puck.size, tension) or same(e, -puck.size, tension)
    assert same(e, weight.components[2], tension)
    assert e.derivation.constraint_forces.form == "motion"


def test_normal_force_on_the_parabola():
    e = shipped("bead_on_parabola")
    wire = reaction(e, "wire")
    assert same(e, wire.multiplier, "m*(g + 2*a*x_dot**2)/(1 + 4*a**2*x**2)")
    ((name, size),) = wire.sizes
    assert name == "bead"
    assert same(e, size, "m*(g + 2*a*x_dot**2)/sqrt(1 + 4*a**2*x**2)")


@pytest.mark.slow
def test_the_sphere_lets_go_where_it_should():
    """From rest at θ0 a particle leaves at cos θ = 2/3 cos θ0: there λ changes sign."""
    e = shipped("particle_on_sphere")
    s = names(e)
    top = sp.Symbol("top", real=True)
    energy = 2 * s["g"] / s["a"] * (sp.cos(top) - sp.cos(s["theta"]))
    multiplier = reaction(e, "sphere").multiplier.subs(s["phi_dot"], 0)
    multiplier = multiplier.subs(s["theta_dot"] ** 2, energy)
    values = {s["m"]: 1.3, s["a"]: 0.7, s["g"]: 9.81, top: 0.4, s["phi"]: 0.9}
    leaving = float(sp.acos(sp.Rational(2, 3) * sp.cos(0.4)))
    at = {d: multiplier.subs({**values, s["theta"]: leaving + d}) for d in (-1e-3, 0, 1e-3)}
    assert at[-1e-3] > 1e-3
    assert abs(at[0]) < 1e-12
    assert at[1e-3] < -1e-3


def test_tension_of_atwoods_rope():
    e = shipped("atwood")
    rope = reaction(e, "rope")
    assert same(e, rope.multiplier, "2*m1*m2*g/(m1 + m2)")
    assert {name for name, _ in rope.sizes} == {"first", "second"}
    for _, size in rope.sizes:
        assert same(e, size, "2*m1*m2*g/(m1 + m2)")


@pytest.mark.slow
def test_rods_of_a_double_pendulum_that_are_stated():
    rods = """
constraints:
  first: x1^2 + z1^2 = l1^2
  second: {distance: [upper, lower], equals: l2}
"""
    e = written(DOUBLE_PENDULUM + rods)
    hanging = {s: 0 for c in e.system.coordinates for s in (c.q, c.v)}
    s = names(e)
    for name, length, carried in (
        ("first", s["l1"], s["m1"] + s["m2"]),
        ("second", s["l2"], s["m2"]),
    ):
        still = reaction(e, name).multiplier.subs(hanging)
        assert sp.simplify(still * 2 * length + carried * s["g"]) == 0
    # The lower rod acts on both bobs equally.
    assert len({size for _, size in reaction(e, "second").sizes}) == 1


def test_a_force_on_a_point_is_taken_up_there():
    e = shipped("lever")
    grip = next(b for b in e.derivation.constraint_forces.bodies if b.name == "grip")
    assert [str(c) for c in grip.components] == ["0", "0", "F"]
    assert e.derivation.constraint_forces.open == ("arm",)


# The formulations.

ANGLE = """
parameters: {m: 1.4, l: {value: 0.8, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
potentials: {weight: {gravity: g}}
"""
CARTESIAN = """
parameters: {m: 1.4, l: {value: 0.8, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: -0.8}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("theta", "rate"), [(0.4, 1.7), (2.1, -3.0), (-1.2, 0.0)])
def test_both_formulations_give_the_same_multiplier(theta, rate):
    angle, cartesian = written(ANGLE), written(CARTESIAN)
    assert angle.system.formulation == "minimal"
    assert cartesian.system.formulation == "multiplier"
    s = names(angle)
    minimal = float(
        reaction(angle, "rod").multiplier.subs(
            {s["m"]: 1.4, s["l"]: 0.8, s["g"]: 9.81, s["theta"]: theta, s["theta_dot"]: rate}
        )
    )
    state = {
        "x": 0.8 * np.sin(theta),
        "z": -0.8 * np.cos(theta),
        "x_dot": 0.8 * np.cos(theta) * rate,
        "z_dot": 0.8 * np.sin(theta) * rate,
        "m": 1.4,
        "l": 0.8,
        "g": 9.81,
        "t": 0.0,
    }
    point = {v: state[k] for k, v in names(cartesian).items() if k in state}
    *_, multiplier = solved(cartesian, point)
    assert abs(multiplier - minimal) < 1e-12 * abs(minimal)
    f_x = cartesian.derivation.constraint_forces.bodies[0].components[0]
    point[cartesian.system.closures[0].multiplier] = multiplier
    ours = (
        angle.derivation.constraint_forces.bodies[0]
        .components[0]
        .subs({s["m"]: 1.4, s["l"]: 0.8, s["g"]: 9.81, s["theta"]: theta, s["theta_dot"]: rate})
    )
    assert abs(float(f_x.subs(point)) - float(ours)) < 1e-11


def solved(e, point):
    """Accelerations, then multipliers, of the equations of motion, with all contacts closed."""
    n, m = len(e.system.coordinates), len(e.system.pushing)
    matrix, right = np.zeros((n + m, n + m)), np.zeros(n + m)
    number = sp.lambdify(
        list(point), sp.Matrix([*e.system.forcing, *(-c.bias for c in e.system.pushing)])
    )
    right[:] = np.array(number(*point.values()), dtype=float).ravel()
    if n:
        mass = sp.lambdify(list(point), sp.Matrix(e.system.mass_matrix))
        matrix[:n, :n] = np.array(mass(*point.values()), dtype=float)
    for k, closure in enumerate(e.system.pushing):
        row = sp.lambdify(list(point), sp.Matrix(closure.gradient))
        gradient = np.array(row(*point.values()), dtype=float).ravel()
        matrix[:n, n + k], matrix[n + k, :n] = -gradient, gradient
    return np.linalg.solve(matrix, right)


# Every shipped scene.


@pytest.mark.slow
@sliced(n for n in SCENES if n not in LARGE | BODIES | IN_PIECES)
def test_no_virtual_displacement_feels_them(name):
    """Σ f·∂r/∂q is what closures exert: nothing where there are none.

    Of coordinates that move particles: others, as of a spin, have their own terms.
    """
    e = shipped(name)
    found = e.derivation.constraint_forces
    if found.included or not e.system.coordinates or len(e.system.coordinates) > 8:
        return
    rng = random.Random(name)
    point = {e.system.t: 0.3} | {p.symbol: p.value or 1.0 for p in e.system.parameters}
    point |= {u.symbol: rng.uniform(-1, 1) for u in e.system.inputs}
    start = e.system.initial.positions if e.system.initial else [0.7] * len(e.system.coordinates)
    for c, q in zip(e.system.coordinates, start, strict=True):
        point |= {c.q: q + rng.uniform(-0.05, 0.05), c.v: rng.uniform(-1, 1)}
    solution = solved(e, point)
    unknowns = [*(c.a for c in e.system.coordinates), *(c.multiplier for c in e.system.pushing)]
    point |= dict(zip(unknowns, solution.tolist(), strict=True))
    place = {c.name: c.position for c in e.system.cartesian_names}
    place |= {c.name: c.q for c in e.system.coordinates}
    place |= {
        n: r for p in e.system.particles for n, r in zip(p.components, p.position, strict=True)
    }
    particles = {p.name: p.position for p in e.system.particles}
    moving = set().union(*(x.free_symbols for r in particles.values() for x in r))
    for c in [c for c in e.system.coordinates if c.q in moving]:
        terms = [k.multiplier * k.gradient[e.system.coordinates.index(c)] for k in e.system.pushing]
        for body in found.bodies:
            r = particles.get(body.name) or [place[f"{x}_{body.name}"] for x in "xyz"]
            terms += [-f * x.diff(c.q) for f, x in zip(body.components, r, strict=True)]
        values = [float(term.subs(point)) for term in map(sp.sympify, terms)]
        assert abs(sum(values)) <= 1e-10 * sum(map(abs, values)) + 1e-10


# What cannot be told, and what nobody asked for.


BOB = """
parameters: {m: 1, l: {value: 2, positive: true}, k: 3, g: 9.81, M: 2}
plane: xz
particles: {bob: {mass: m, position: [r*sin(theta), y, -r*cos(theta)]}}
coordinates: {r: {positive: true}, theta: {}}
potentials: {weight: {gravity: g}, spring: k*(r - l)^2/2}
"""


def test_a_spring_is_no_constraint_force():
    """Nothing constrains an elastic pendulum in its plane."""
    found = written(BOB).derivation.constraint_forces
    assert [body.components for body in found.bodies] == [(0, 0, 0)]
    assert (found.included, found.shared) == ((), ())


@pytest.mark.parametrize(
    "term",
    [
        "potentials: {torsion: k*theta^2/2}",
        "forces: {motor: {on: theta, force: k*cos(t)}}",
        "dissipation: {bearing: k*dot(theta)^2/2}",
    ],
)
def test_what_is_written_in_coordinates_acts_on_the_particle_that_moves_with_them(term):
    """The rod pulls along itself whatever turns it."""
    e = written(f"""
parameters: {{m: 1, l: 2, k: 3}}
plane: xz
particles: {{bob: {{mass: m, position: [l*sin(theta), y, -l*cos(theta)]}}}}
coordinates: [theta]
{term}
""")
    found, by_name = e.derivation.constraint_forces, names(e)
    (bob,) = found.bodies
    theta, turning = by_name["theta"], by_name["theta_dot"]
    pull = by_name["m"] * by_name["l"] * turning**2
    expected = [-pull * sp.sin(theta), 0, pull * sp.cos(theta)]
    assert [sp.simplify(f - x) for f, x in zip(bob.components, expected, strict=True)] == [0, 0, 0]
    assert found.included == ()


@pytest.mark.parametrize(
    ("coordinates", "first", "second"),
    [
        ("[X, s]", "[X + s, 0, 0]", "[X - s, 0, 0]"),
        ("[X, Y, s, q]", "[X + s*cos(q), Y + s*sin(q), 0]", "[X - s*cos(q), Y - s*sin(q), 0]"),
    ],
)
def test_two_bodies_that_move_freely_share_their_force_in_one_way(coordinates, first, second):
    e = written(f"""
parameters: {{m: 1, M: 2, k: 3}}
particles: {{a: {{mass: m, position: {first}}}, b: {{mass: M, position: {second}}}}}
coordinates: {coordinates}
potentials: {{spring: k*(s - 1)^2/2}}
""")
    found = e.derivation.constraint_forces
    assert [body.components for body in found.bodies] == [(0, 0, 0)] * 2
    assert (found.shared, found.included) == ((), ())


@pytest.mark.parametrize(
    ("terms", "shared"),
    [
        ("kinetic: {spin: M*l^2*dot(phi)^2/2}", ("hoop", "spot")),
        ("potentials: {spring: k*phi^2/2}", ("hoop", "spot")),
        ("potentials: {weight: {gravity: g}}", ()),
    ],
)
def test_what_several_bodies_share_is_not_unique(terms, shared):
    e = written(f"""
parameters: {{m: 1, M: 2, l: 1, k: 3, g: 9.81}}
plane: xz
particles:
  hoop: {{mass: M, position: [l*phi, 0, l]}}
  spot: {{mass: m, position: [l*phi - l*sin(phi), 0, l - l*cos(phi)]}}
  far: {{mass: m, position: [x, 0, 0]}}
coordinates: [phi, x]
{terms}
""")
    found = e.derivation.constraint_forces
    assert found.shared == shared
    assert bool(found.included) == bool(shared)


def test_what_moves_no_particle_is_not_passed_on():
    e = written("""
parameters: {m: 1, J: 2, k: 3}
particles: {block: {mass: m, position: [x, 0, 0]}}
coordinates: [x, phi]
kinetic: {spin: J*dot(phi)^2/2}
potentials: {torsion: k*phi^2/2}
""")
    assert e.derivation.constraint_forces.included == ()


def test_a_spring_beside_an_inertia_in_coordinates_is_not_unique():
    e = written("""
parameters: {m: 1, R: 1, k: 3}
particles: {wheel: {mass: m, position: [R*phi, 0, R]}}
coordinates: [phi]
kinetic: {spin: m*R^2*dot(phi)^2/4}
potentials: {spring: k*phi^2/2}
""")
    assert e.derivation.constraint_forces.shared == ("wheel",)


@pytest.mark.parametrize(
    ("weight", "without"),
    [("m*g*z", ("puck",)), ("{gravity: g}", ()), ("m*g*z^2", ()), ("-M*g*y_puck", ("weight",))],
)
def test_a_particle_without_weight_beside_one_that_has_some(weight, without):
    e = written(f"""
parameters: {{m: 1, M: 2, g: 9.81}}
particles: {{puck: {{mass: M, position: [x1, y1, 0]}}, weight: {{mass: m, position: [0, 0, z]}}}}
coordinates: [x1, y1, z]
potentials: {{weight: {weight}}}
""")
    assert e.derivation.constraint_forces.weightless == without


def test_redundant_constraints_share_a_force_in_no_particular_way():
    e = written("""
parameters: {m: 1, g: 9.81}
particles: {block: {mass: m, position: [x, y, z]}}
constraints: {floor: z = 0, table: 2*z = 0, rail: y = 0}
potentials: {weight: {gravity: g}}
""")
    assert e.derivation.constraint_forces.open == ("floor", "table")
    assert reaction(e, "rail").multiplier == 0
    (block,) = e.derivation.constraint_forces.bodies
    assert str(block.components[2]) == "g*m"


def test_nothing_is_found_unless_it_is_asked_for(monkeypatch):
    asked = []
    original = forces.derive_constraint_forces
    monkeypatch.setattr(
        forces, "derive_constraint_forces", lambda *args: asked.append(1) or original(*args)
    )
    scene = read_text("name: tested\n" + ANGLE)
    assert derive(scene).derivation.constraint_forces is None
    assert not asked
    assert derive(scene, forces=True).derivation.constraint_forces is not None
    assert len(asked) == 1


@pytest.mark.slow
def test_nothing_is_even_imported_unless_it_is_asked_for():
    path = SCENES["pendulum"]
    code = (
        "import sys; from lagrange_cli.scene import read_file; "
        "from lagrange_cli.mechanics import derive; "
        f"derive(read_file({str(path)!r})); "
        "print([m for m in sys.modules if m.endswith(('.forces', '.loads', '.multipliers'))])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == "[]"


def test_wrong_forces_are_never_shown(monkeypatch):
    original = forces.shortened
    monkeypatch.setattr(forces, "shortened", lambda e: original(e) * sp.Rational(10001, 10000))
    with pytest.raises(InternalError):
        written(ANGLE)


def test_a_missing_normal_part_is_noticed(monkeypatch):
    """A force without its part along the normal does the same work: none."""
    original = forces.applied_forces

    def without_weight(derivation):
        found = original(derivation)
        return forces.AppliedForces({}, found.dynamic, found.unattached)

    monkeypatch.setattr(forces, "applied_forces", without_weight)
    with pytest.raises(InternalError):
        written("""
parameters: {m: 1, g: 9.81}
particles: {block: {mass: m, position: [x, y, z]}}
constraints: {floor: z = 0, rail: y = 0}
potentials: {weight: {gravity: g}}
""")


@pytest.mark.slow
def test_precision_of_the_caller_is_left_alone():
    before = mpmath.mp.dps
    written(ANGLE)
    assert mpmath.mp.dps == before


def test_what_cannot_move_is_held():
    e = written("""
parameters: {m: 1, g: 9.81, k: 2}
particles: {a: {mass: m, position: [x, y, z]}}
constraints: {post: [x = 1, y = 2], floor: z = 0}
potentials: {weight: m*g*z, pull: k*x^2/2}
""")
    (body,) = e.derivation.constraint_forces.bodies
    assert [str(c) for c in body.components] == ["k", "0", "g*m"]
    found = {r.name: str(r.multiplier) for r in e.derivation.constraint_forces.reactions}
    assert found == {"post_1": "k", "post_2": "0", "floor": "g*m"}


def test_particles_that_share_a_name():
    e = written("""
parameters: {m: 1, M: 2, g: 9.81}
particles: {a: {mass: m, position: [x, 0, z1]}, b: {mass: M, position: [x, 0, z2]}}
constraints: {rod: z1 - z2 = 3}
potentials: {weight: {gravity: g}}
""")
    assert all(c == 0 for body in e.derivation.constraint_forces.bodies for c in body.components)


def test_a_belt_that_moves():
    """y = A t²: the belt pushes with m 2A and against the drag, beside a force of velocities."""
    e = written("""
parameters: {m: 1, g: 9.81, c: 0.3, A: 1}
particles: {a: {mass: m, position: [x, y, z]}}
constraints: {belt: y = A*t^2, floor: z = 0}
potentials: {weight: m*g*z, field: x*dot(y) - y*dot(x)}
dissipation: {air: c*(dot(x)^2 + dot(y)^2)/2}
""")
    # U = x ẏ − y ẋ: d/dt ∂U/∂ẏ − ∂U/∂y = 2 ẋ acts on y.
    assert same(e, reaction(e, "belt").multiplier, "2*A*m + 2*c*A*t - 2*x_dot")
    assert same(e, reaction(e, "floor").multiplier, "m*g")
