"""Coordinates that are declared positive: no roots of their squares, and no start beyond zero."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli import loads
from lagrange_cli.mechanics.algebra.shorten import drawn_from_roots
from lagrange_cli.mechanics.equations import Equations
from tests.mechanics.mechanics_support import derived, refusal

CENTRAL = """
parameters: {m: 1, k: 1, g: 2}
plane: xy
points: {sun: [0, 0, 0]}
particles: {planet: {mass: m, position: [x, y, z]}}
coordinates: {r: {positive: true}, theta: {}}
definitions: {x: r*cos(theta), y: r*sin(theta)}
potentials: {attraction: "-k*m/norm(x, y)", weight: m*g*x}
"""

#: A pulley above the origin: the rope runs over it to a weight.
ROPE = """
parameters: {m: 1, M: 2, g: 9.81, l: {value: 3, positive: true}}
plane: xz
particles: {puck: {mass: m, position: [x1, y1, z1]}, weight: {mass: M, position: [x2, y2, z2]}}
constraints: {rope: "norm(x1, z1) + x2 = l", plumb: z2 = 0}
coordinates: {s: {positive: true}, theta: {}}
definitions: {x1: s*sin(theta), z1: -s*cos(theta)}
potentials: {weight: m*g*z1}
"""


def printed(equations: Equations) -> list[sp.Expr]:
    shown = [c * f for e in equations.derivation.shown for c, f in e.terms]
    matrix = [e for row in equations.system.mass_matrix for e in row]
    closures = [e for c in equations.system.closures for e in (c.expression, c.bias, *c.gradient)]
    energies = [equations.system.kinetic, equations.system.potential]
    names = [e for c in equations.system.cartesian_names for e in (c.position, c.velocity)]
    return [*shown, *matrix, *closures, *energies, *names, *equations.system.forcing]


def has_roots(e: sp.Expr) -> bool:
    return e.has(sp.Abs) or any(p.exp.is_Rational and p.exp.q != 1 for p in e.atoms(sp.Pow))


@pytest.mark.parametrize("scene", [CENTRAL, ROPE])
def test_there_are_no_roots_of_squares(scene: str) -> None:
    assert not any(map(has_roots, printed(derived(scene))))
    real = derived(scene.replace("{positive: true}", "{}").replace("l: {}", "l: 3"))
    assert any(map(has_roots, printed(real)))


def test_a_positive_coordinate_is_divided_out() -> None:
    azimuth = derived(CENTRAL).derivation.shown[1]
    r = derived(CENTRAL).system.coordinates[0].q
    assert azimuth.divided_by.has(r)
    signed = derived(CENTRAL.replace("{positive: true}", "{}"))
    assert not signed.derivation.shown[1].divided_by.has(signed.system.coordinates[0].q)


def test_nothing_is_singular_where_it_never_is() -> None:
    assert derived(CENTRAL).derivation.singular == ()
    signed = derived(CENTRAL.replace("{positive: true}", "{}"))
    assert [place.where for place in signed.derivation.singular] == [signed.system.coordinates[0].q]


def test_a_zero_of_the_inertia_above_zero_is_singular() -> None:
    scene = """
parameters: {m: 1, a: {value: 2, positive: true}}
coordinates: {r: {positive: true}, theta: {}}
kinetic: {spin: m*dot(r)^2/2 + m*(r - a)^2*dot(theta)^2/2}
"""
    (place,) = derived(scene).derivation.singular
    r, a = derived(scene).system.coordinates[0].q, derived(scene).system.parameters[1].symbol
    assert sp.expand(place.where**2 - (r - a) ** 2) == 0
    assert derived(scene.replace("r - a", "r + a")).derivation.singular == ()


@pytest.mark.parametrize("value", ["0", "-1", "-m"])
@pytest.mark.parametrize("section", ["initial", "near"])
def test_values_that_are_not_positive_are_refused_at_their_place(value: str, section: str) -> None:
    problem = refusal(f"{CENTRAL}{section}: {{theta: 1, r: {value}}}")
    assert problem.rule == "not-positive"
    assert problem.mark is not None
    assert (problem.mark.line, problem.mark.column) == (10, 21 + len(section) - len("near"))


def test_a_start_in_cartesian_values_has_the_sign() -> None:
    state = derived(CENTRAL + "initial: {x: -3, y: 4}").system.initial
    assert state is not None
    assert state.positions[0] == pytest.approx(5)


def test_cartesian_values_that_ask_for_a_sign_are_refused() -> None:
    scene = """
parameters: {m: 1}
particles: {p: {mass: m, position: [s + 1, 0, 0]}}
coordinates: {s: {positive: true}}
initial: {x_p: VALUE}
"""
    problem = refusal(scene.replace("VALUE", "0.5"))
    assert problem.rule == "not-positive"
    assert "s = -0.5" in problem.message
    start = derived(scene.replace("VALUE", "1.5")).system.initial
    assert start is not None
    assert start.positions == (0.5,)


def test_a_factor_that_is_positive_is_no_branch() -> None:
    scene = """
parameters: {m: 1, a: 2}
plane: xy
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {track: r*(y - a*r) = 0}
coordinates: {r: {positive: true}}
definitions: {x: 3*r}
"""
    positions = {c.name: c.position for c in derived(scene).system.cartesian_names}
    r, a = derived(scene).system.coordinates[0].q, derived(scene).system.parameters[1].symbol
    assert positions["y"] == a * r


def test_a_coordinate_that_is_eliminated_stays_positive() -> None:
    scene = """
parameters: {m: 1, R: 2}
plane: xy
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {rolls: dot(s) = R*dot(phi)}
coordinates: {s: {positive: true}, phi: {}}
definitions: {x: s*cos(phi), y: s*sin(phi)}
initial: {s: 1, phi: 0}
"""
    minimal = loads(scene).derive(formulation="minimal").equations
    ((name, above),) = minimal.system.positive
    assert name in {"s", "phi"}
    assert {s.name for s in above.free_symbols} & {"s", "phi"}


def test_results_of_one_element_are_not_those_of_another_sign() -> None:
    """Two closures of one shape, of which only one holds a positive coordinate."""
    scene = """
parameters: {m: 1, l: 2}
plane: xz
particles: {p: {mass: m, position: [x1, y1, z1]}, q: {mass: m, position: [x2, y2, z2]}}
constraints:
  a: sqrt(x1^2*sin(z1)^2 + x1^2*cos(z1)^2) + z1^2 = l
  b: sqrt(x2^2*sin(z2)^2 + x2^2*cos(z2)^2) + z2^2 = l
coordinates: {x1: {positive: true}, z1: {}, x2: {}, z2: {}}
initial: {z1: 1, x1: 1, z2: 1, x2: -1}
"""
    start = derived(scene).system.initial
    assert start is not None
    assert start.positions[0] > 0 > start.positions[2]


def test_roots_that_are_drawn_are_equal() -> None:
    r, s = sp.symbols("r s", positive=True)
    a, b = sp.symbols("a b", real=True)
    whole = (r**2 * sp.sin(a) ** 2 + r**2 * sp.cos(a) ** 2) ** sp.Rational(3, 2)
    assert drawn_from_roots(whole, [r]) == r**3
    assert drawn_from_roots(sp.sqrt(4 * r**2 + r * s**3), [r]) == sp.sqrt(r) * sp.sqrt(4 * r + s**3)
    for kept in (sp.sqrt(r**2 + b**2), sp.sqrt(b**2 * r**2 + b**2 * r), sp.sqrt(a**2 + a**2 * b)):
        assert drawn_from_roots(kept, [r]) == kept
