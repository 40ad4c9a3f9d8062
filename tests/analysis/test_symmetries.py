"""Linear symmetries: what is known of a system is found, and nothing that is not so."""

from __future__ import annotations

import mpmath
import pytest
import sympy as sp

from lagrange_cli.analysis.symmetries.conserved_quantities import energy_loss, energy_sum
from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries, linear_symmetries
from lagrange_cli.api import loads
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import simulate
from tests.systems.shipped import SCENES, derived, sliced

BODIES = """
parameters: {m1: 2, m2: 3, m3: 5, k: 7}
particles:
  a: {mass: m1, position: [x1, y1, z1]}
  b: {mass: m2, position: [x2, y2, z2]}
"""
TWO_BODIES = BODIES + "potentials: {V: {newton: k}}\n"


def searched(text: str) -> Symmetries:
    return linear_symmetries(derive(read_text("name: s\n" + text)))


def names(found: Symmetries) -> list[str]:
    return [s.name for s in found.proven]


def written(found: Symmetries) -> dict[str, sp.Expr]:
    """Quantities over plain symbols, by name."""
    return {s.name: s.expression.xreplace(_plain(s.expression)) for s in found.proven}


def _plain(expression: sp.Expr) -> dict[sp.Symbol, sp.Symbol]:
    return {s: sp.Symbol(s.name.replace("dot(", "v").rstrip(")")) for s in expression.free_symbols}


def test_two_bodies_in_space() -> None:
    found = searched(TWO_BODIES)
    axes = "xyz"
    expected = [*(f"P_{k}" for k in axes), *(f"L_{k}" for k in axes), *(f"boost_{k}" for k in axes)]
    assert names(found) == expected
    assert (found.complete, found.unproven) == (True, 0)
    m1, m2, x1, y1, x2, y2, t = sp.symbols("m1 m2 x1 y1 x2 y2 t")
    vx1, vy1, vx2, vy2 = sp.symbols("vx1 vy1 vx2 vy2")
    quantities = written(found)
    assert sp.expand(quantities["P_x"] - m1 * vx1 - m2 * vx2) == 0
    turning = m1 * (x1 * vy1 - y1 * vx1) + m2 * (x2 * vy2 - y2 * vx2)
    assert sp.expand(quantities["L_z"] - turning) == 0
    assert sp.expand(quantities["boost_x"] - (m1 * x1 + m2 * x2 - t * (m1 * vx1 + m2 * vx2))) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "expected"),
    [
        # A spring between both and one to the origin: only turning is left.
        (
            "potentials: {V: {spring: [a, b], stiffness: k}, W: k*(x1^2 + y1^2 + z1^2)}",
            "L_x L_y L_z",
        ),
        # The same, squeezed along z.
        ("potentials: {V: {spring: [a, b], stiffness: k}, W: k*(x1^2 + y1^2 + 2*z1^2)}", "L_z"),
        # Squeezed along two axes: nothing.
        ("potentials: {V: {spring: [a, b], stiffness: k}, W: k*(x1^2 + 2*y1^2 + 3*z1^2)}", ""),
        # A rod instead of a spring: its equation is kept beside Cartesian names.
        (
            "constraints: {rod: {distance: [a, b], equals: 1}}\n"
            "simulate: {formulation: multiplier}",
            "P_x P_y P_z L_x L_y L_z boost_x boost_y boost_z",
        ),
    ],
)
def test_what_breaks_a_symmetry(section: str, expected: str) -> None:
    scene = read_text(f"name: s\n{BODIES}{section}\n")
    equations = derive(scene, formulation=scene.simulate.formulation or "auto")
    assert names(linear_symmetries(equations)) == expected.split()


def test_friction_keeps_a_sum() -> None:
    found = searched(
        "parameters: {m: 1, c: 2, k: 3}\nparticles: {p: {mass: m, position: [x, 0, 0]}}\n"
        "dissipation: {drag: c/2*dot(x)^2}\n"
    )
    m, c, x, vx = sp.symbols("m c x vx")
    assert sp.expand(written(found)["P_x"] - (m * vx + c * x)) == 0


def test_uniform_field_and_weight() -> None:
    found = searched(
        "parameters: {m: 1, q: 2, B: 3, g: 4}\nparticles: {p: {mass: m, position: [x, y, z]}}\n"
        "potentials: {U: q*B*y*dot(x), weight: {gravity: g}}\n"
    )
    m, q, b, g, x, t, vy, vz = sp.symbols("m q B g x t vy vz")
    quantities = written(found)
    assert sp.expand(quantities["P_y"] - (m * vy + q * b * x)) == 0
    assert sp.expand(quantities["P_z"] - (m * vz + m * g * t)) == 0
    assert "L_z" in quantities
    assert "L_x" not in quantities


def test_angles_that_turn_together() -> None:
    found = searched(
        "parameters: {m: 1, k: 3}\ncoordinates: [a, b]\n"
        "kinetic: {T: m/2*(dot(a)^2 + 2*dot(b)^2)}\npotentials: {V: k*cos(a - b)}\n"
    )
    (symmetry,) = found.proven
    assert (symmetry.name, symmetry.field) == ("J_1", (1, 1))


def test_an_entry_may_be_a_quotient_of_parameters() -> None:
    found = searched(
        "parameters: {m: 1, r: 2, s: 3, k: 4}\ncoordinates: [a, b]\n"
        "kinetic: {T: m/2*(dot(a)^2 + 2*dot(b)^2)}\npotentials: {V: k*(r*a - s*b)^4}\n"
    )
    r, s = sp.symbols("r s")
    (symmetry,) = found.proven
    ratio = (symmetry.field[0] / symmetry.field[1]).xreplace(
        {x: sp.Symbol(x.name) for x in symmetry.field[1].free_symbols}
    )
    assert sp.simplify(ratio - s / r) == 0


def test_an_unknown_central_force() -> None:
    found = searched(
        "functions: {V: s}\ndefinitions: {s: x^2 + y^2 + z^2}\nparameters: {m: 1}\n"
        "particles: {p: {mass: m, position: [x, y, z]}}\n"
        "potentials: {V: V(s)}\n"
    )
    assert names(found) == ["L_x", "L_y", "L_z"]


def test_nothing_holds_beyond_a_switch() -> None:
    """Around the start the particle is free; a wall far away pushes it."""
    found = searched(
        "parameters: {m: 1, k: 2}\nparticles: {p: {mass: m, position: [x, y, 0]}}\n"
        'potentials: {wall: "k*max(0, x - 30)^2"}\ninitial: {x: 0, y: 0}\n'
    )
    assert names(found) == ["boost_y"]


@pytest.mark.slow
def test_products_of_others_are_left_out() -> None:
    """Three bodies have a sixth matrix: that of the centre's angular momentum."""
    found = linear_symmetries(derived("figure_eight"))
    assert names(found) == ["P_x", "P_y", "L_z", "boost_x", "boost_y"]


@pytest.mark.slow
def test_many_coordinates_are_looked_at_for_translations_alone() -> None:
    text = (
        "sizes: {n: 26}\nparameters: {m: 1, k: 2}\ncoordinates: ['x[i=1..n]']\n"
        "kinetic: {'T[i=1..n]': 'm/2*dot(x[i])^2'}\n"
        "potentials: {'V[i=1..n-1]': 'k*(x[i+1] - x[i])^4'}\n"
    )
    found = searched(text)
    assert not found.complete
    assert [set(s.field) for s in found.proven] == [{1}]


def quantities_at(equations: Equations, found: Symmetries, k: int, trajectory) -> list[mpmath.mpf]:
    """The conserved quantities at one sample of a motion."""
    point = {equations.system.t: trajectory.t[k]}
    point |= {c.q: trajectory.columns[c.name][k] for c in equations.system.coordinates}
    point |= {c.v: trajectory.columns[f"dot({c.name})"][k] for c in equations.system.coordinates}
    point |= {p.symbol: p.value for p in equations.system.parameters}
    return evaluate([s.expression for s in found.proven], point)


@pytest.mark.slow
@sliced(SCENES)
def test_quantities_stay_along_accurate_motions(name: str) -> None:
    equations = derived(name)
    found = linear_symmetries(equations)
    assert found.unproven == 0
    if not found.proven or equations.system.initial is None:
        return
    trajectory = simulate(equations)
    ends = [quantities_at(equations, found, k, trajectory) for k in (0, len(trajectory.t) // 2)]
    sizes = [1 + abs(a) for a in ends[0]]
    moved = [abs(a - b) / size for a, b, size in zip(*ends, sizes, strict=True)]
    assert max(moved) < 1e-6, dict(zip(names(found), moved, strict=True))


def test_a_constant_that_is_zero_in_doubles_is_no_divisor():
    scene = "{particles: {b: {mass: 1, position: [x, y, 0]}}, coordinates: [x, y],"
    scene += " potentials: {v: exp(-1e18)*(x - y)^2 + sqrt(2)*(x - y)^2}, initial: {x: 0, y: 1}}"
    found = linear_symmetries(loads(scene).derive().equations).proven
    assert [len(s.expression.free_symbols) for s in found][:1] == [2]


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_masses_of_very_different_size_decide_energies():
    """The inertias of p and q differ by 300 digits, and M is not singular."""
    scene = """
name: rods
parameters: {l: 1}
plane: xz
particles:
  a: {mass: 10^300, position: [l*sin(p), 0, -l*cos(p)]}
  b: {mass: 2, position: [x_a + l*L*sin(q), 0, z_a - l*L*cos(q)]}
definitions: {L: 1 + sin(t)/10}
coordinates: [p, q]
potentials: {w: {gravity: 1}}
initial: {p: 0.5, q: 0.3}
"""
    equations = loads(scene).derive().equations
    assert linear_symmetries(equations).proven == ()
    assert energy_sum(equations) is None
    assert energy_loss(equations).depends_on_time


@pytest.mark.slow
def test_two_bodies_with_a_dashpot_keep_their_momentum():
    """Each keeps m ẋ + c (x − X); what both give is the momentum of the whole."""
    scene = """
name: dashpot
parameters: {m: 1, M: 3, c: 2}
particles: {a: {mass: m, position: [x, 0, 0]}, b: {mass: M, position: [X, 0, 0]}}
coordinates: [x, X]
potentials: {}
dissipation: {d: c/2*(dot(x) - dot(X))^2}
initial: {x: 0, X: 1, dot(x): 0.2, dot(X): 0}
simulate: {until: 2}
"""
    derivation = loads(scene).derive()
    found = {s.name: s.expression for s in derivation.analyze("symmetries").symmetries.proven}
    assert list(found) == ["P_x", "boost_x", "J_1"]
    run = derivation.simulate(extra=["conserved"], accuracy=1e-10)
    assert run.columns["P_x"][0] == pytest.approx(0.2)
    assert max(run.conserved_drift.values()) < 1e-9


def test_numbers_that_overflow_hold_no_symmetry():
    stiff = "potentials: {c: {spring: [a, b], stiffness: 1.7e308, length: k}}\n"
    assert not searched(BODIES + stiff + "coordinates: [x1, y1, z1, x2, y2, z2]\n").proven


#: A top by a quaternion, its centre of mass beside the fixed point.
TOP = """
parameters: {m: 0.2, h: 0.05, A: 8e-4, B: 8e-4, C: 2e-4, g: 9.81}
bodies:
  top:
    turn: {quaternion: [q0, q1, q2, q3]}
    mass: m
    centre: [0, 0, h]
    inertia: {about: origin, moments: [A, B, C]}
coordinates: [q0, q1, q2, q3]
initial: {q0: 1, q1: 0, q2: 0, q3: 0}
"""
WEIGHT = "potentials: {weight: {gravity: g}}\n"


@pytest.mark.slow
def test_a_symmetric_top_by_a_quaternion_keeps_two_angular_momenta() -> None:
    """About the vertical and its axis; with other moments one, without weight four."""
    symmetric = TOP.replace("B: 8e-4, ", "").replace("[A, B, C]", "[A, A, C]")
    found = searched(symmetric + WEIGHT)
    assert names(found) == ["L_z", "L_3_top"]
    assert found.unproven == 0
    q0, q1, q2, q3, v0, v1, v2, v3, c = sp.symbols("q0:4 vq0:4 C")
    spin = 2 * (q0 * v3 - q3 * v0 + q2 * v1 - q1 * v2)
    assert sp.expand(written(found)["L_3_top"] - c * spin) == 0
    described = found.proven[1].described([])
    assert described == "rotation of top around its axis 3"
    assert names(searched(TOP + WEIGHT)) == ["L_z"]
    assert names(searched(symmetric)) == ["L_x", "L_y", "L_z", "L_3_top"]
