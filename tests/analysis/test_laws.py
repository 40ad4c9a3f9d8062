"""Laws of equilibrium: relations between parameters under which a coordinate has any value."""

from __future__ import annotations

import pytest

from lagrange_cli.analysis.equilibria.laws import law_verdict
from lagrange_cli.analysis.equilibria.rest_system import rest_system
from lagrange_cli.api import loads
from lagrange_cli.errors import Mark
from lagrange_cli.mechanics.interpretation import interpret
from lagrange_cli.scene.language.families import read_expression

LEVER = """\
parameters: {m: {}, a: {positive: true}, b: {positive: true}, F: {}, g: {}}
plane: xz
points: {grip: [b*cos(theta), 0, b*sin(theta)]}
particles: {load: {mass: m, position: [-a*cos(theta), 0, -a*sin(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
forces: {effort: {on: grip, force: [0, 0, -F]}}
"""

WEDGE = """\
parameters: {m1: {}, m2: {}, alpha: {}, beta: {}, g: {positive: true}, l: {}}
plane: xz
particles:
  A: {mass: m1, position: [-s1*cos(alpha), 0, -s1*sin(alpha)]}
  B: {mass: m2, position: [s2*cos(beta), 0, -s2*sin(beta)]}
definitions: {s2: l - s1}
coordinates: [s1]
potentials: {weight: {gravity: g}}
"""

INCLINE = """\
parameters: {m: {}, g: {}, alpha: {}}
particles: {block: {mass: m, position: [-s*cos(alpha), 0, -s*sin(alpha)]}}
coordinates: [s]
potentials: {weight: {gravity: g}}
"""

SPRINGS = """\
parameters: {m: {}, k: {}, c: {}, w: {}}
particles: {ball: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {springs: (k - c)*x^2/2 + (k - c)*(k - w)*y^2/2}
"""

LADDER = """\
parameters: {m: {positive: true}, l: {positive: true}, F: {}, g: {positive: true}}
plane: xz
points: {foot: [l*cos(theta), 0, 0]}
particles: {middle: {mass: m, position: [l/2*cos(theta), 0, l/2*sin(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
forces: {rope: {on: foot, force: [-F, 0, 0]}}
"""

TORQUES = """\
parameters: {m: {}, a: {}, b: {}, P: {}, Q: {}}
particles: {ball: {mass: m, position: [cos(u), sin(u), 0]}}
coordinates: [u]
potentials: {first: (a - b)*sin(u) + (P - Q)*cos(u)}
"""


def solved(scene):
    found = loads(scene).derive().analyze("equilibria").equilibria
    laws = [
        (
            *(str(x) for x in point.exact),
            *(f"{c.smaller} {c.relation} {c.larger}" for c in point.conditions),
        )
        for point in found.points
    ]
    return laws, found


def test_a_lever_has_any_angle_under_its_law():
    laws, found = solved(LEVER)
    assert laws == [("theta", "a*g*m = F*b"), ("pi/2",), ("-pi/2",)]
    assert found.points[0].free == ("theta",)
    assert (found.complete, found.nonzero) == (True, ())


def test_blocks_on_a_wedge_balance_by_their_sines():
    laws, found = solved(WEDGE)
    assert laws == [("s1", "m1*sin(alpha) = m2*sin(beta)")]
    assert (found.complete, found.nonzero) == (True, ())


def test_a_sine_of_a_parameter_may_vanish_and_g_is_said_not_to():
    laws, found = solved(INCLINE)
    assert laws == [("s", "sin(alpha) = 0")]
    assert (found.complete, found.nonzero) == (True, ("g",))


@pytest.mark.slow
def test_a_relation_is_put_into_the_other_equations():
    """Where k = c both forces vanish; else x = 0, and y = 0 or k = w."""
    laws, found = solved(SPRINGS)
    assert laws == [("x", "y", "k = c"), ("0", "y", "k = w"), ("0", "0")]
    assert found.complete


@pytest.mark.slow
def test_what_is_divided_by_may_vanish():
    """(a − b) cos u = (P − Q) sin u; with P = Q alone cos u = 0."""
    laws, found = solved(TORQUES)
    assert set(laws) == {
        ("atan((a - b)/(P - Q))",),
        ("atan((a - b)/(P - Q)) + pi",),
        ("pi/2", "P = Q"),
        ("-pi/2", "P = Q"),
        ("u", "P = Q", "a = b"),
    }
    assert found.complete


def test_what_a_longer_list_of_conditions_adds_is_left_out():
    """With k + c = 0 the first equation has x and y change places; both are 0 as before."""
    scene = """\
parameters: {m: {}, k: {}, c: {}}
particles: {ball: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {springs: k*x^2/2 + c*(x - y)^2/2 + k*y^2/2}
"""
    laws, found = solved(scene)
    assert laws == [("c*y/(c + k)", "y", "2*c + k = 0"), ("0", "0")]
    assert found.nonzero == ("k", "c")


def test_a_ladder_needs_a_force():
    laws, found = solved(LADDER)
    assert laws == [("atan(g*m/(2*F))",), ("atan(g*m/(2*F)) + pi",)]
    assert (found.complete, found.nonzero) == (True, ("F",))


@pytest.mark.parametrize(
    ("scene", "laws", "verdict"),
    [
        (LEVER, ["m*g*a = b*F"], "proven"),
        (LEVER, ["F = m*g*a/b"], "proven"),
        (LEVER, ["m*g*a = 2*b*F"], "unbalanced"),
        (LEVER, ["m*g*a = b*F*cos(theta)"], "unbalanced"),
        (LEVER, ["m*g*a = b*F", "theta = 1"], "narrow"),
        (LEVER, ["theta = pi/2"], "proven"),
        (LEVER, ["cos(theta) = 0"], "proven"),
        (LEVER, ["sin(theta) = 0"], "unbalanced"),
        # F = 0 satisfies it too.
        (LEVER, ["m*g*a*F = b*F^2"], "unbalanced"),
        (LEVER, ["1 = 0"], "narrow"),
        (WEDGE, ["m1*sin(alpha) = m2*sin(beta)"], "proven"),
        (WEDGE, ["m1/m2 = sin(beta)/sin(alpha)"], "proven"),
        (WEDGE, ["m1*sin(beta) = m2*sin(alpha)"], "unbalanced"),
        (WEDGE, ["m1 = m2"], "unbalanced"),
        (WEDGE, ["sin(alpha) = 0", "sin(beta) = 0"], "narrow"),
        (WEDGE, ["m1 = m2", "alpha = beta"], "narrow"),
        (LADDER, ["tan(theta) = m*g/(2*F)"], "proven"),
        (LADDER, ["F = m*g/2/tan(theta)"], "proven"),
        (LADDER, ["tan(theta) = m*g/F"], "unbalanced"),
        (SPRINGS, ["k = c"], "proven"),
        (SPRINGS, ["x = 0", "k = w"], "proven"),
        (SPRINGS, ["k = w"], "unbalanced"),
    ],
)
def test_a_law_is_proven_both_ways(scene, laws, verdict):
    equations = loads(scene).derive().equations
    place = Mark("law", 1, 1)
    residuals = [
        interpret(equations, read_expression(left.strip(), place))
        - interpret(equations, read_expression(right.strip(), place))
        for left, right in (law.split("=") for law in laws)
    ]
    assert law_verdict(rest_system(equations, {}), residuals) == verdict


PARABOLA = """\
parameters: {m: {}, c: {}, omega: {}, g: {}}
particles:
  bead: {mass: m, position: [r*cos(omega*t), r*sin(omega*t), c*r^2]}
coordinates: [r]
potentials: {weight: {gravity: g}}
"""


def test_a_rotating_parabola_is_stable_below_its_critical_rate():
    """Marion and Thornton, example 7.5: ω² = 2 c g holds the bead anywhere."""
    laws, found = solved(PARABOLA)
    assert laws == [("r", "omega**2 = 2*c*g"), ("0",)]
    anywhere, lowest = found.points
    assert anywhere.stability.stable_where == ()
    (condition,) = lowest.stability.stable_where
    assert (str(condition.smaller), condition.relation) == ("omega**2", "<")
    assert str(condition.larger) == "2*c*g"
    assert lowest.stability.verdict == "undecided"


def test_signs_that_are_known_need_no_condition():
    scene = """\
parameters: {m: {}, k: {positive: true}, c: {}}
particles: {ball: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {springs: k*x^2/2 + c*x*y + k*y^2/2}
"""
    _, found = solved(scene)
    (point,) = (p for p in found.points if not p.free and not p.conditions)
    assert [f"{c.smaller} < {c.larger}" for c in point.stability.stable_where] == ["c**2 < k**2"]
    _, found = solved(scene.replace("+ c*x*y", ""))
    assert [p.stability.verdict for p in found.points] == ["stable"]
    _, found = solved(
        scene.replace("+ c*x*y", "").replace("k*y^2/2", "y^2/2").replace("k*x", "-k*x")
    )
    assert all(p.stability.verdict != "stable" for p in found.points)


def test_conditions_that_never_hold_are_not_given():
    """A saddle has no condition ``0 < 0`` or ``a² < 0``."""
    scene = """\
parameters: {a: {}, b: {}, k: {positive: true}}
coordinates: [q, p]
kinetic: {T: dot(q)^2/2 + dot(p)^2/2}
potentials: {v: a*q*p + b*q + k*p}
"""
    _, found = solved(scene)
    assert [p.stability.stable_where for p in found.points] == [()]


def test_friction_leaves_stability_open():
    scene = """\
parameters: {m: {}, k: {positive: true}, c: {}}
particles: {ball: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {drive: {on: x, force: c*dot(x)}}
"""
    _, found = solved(scene)
    assert [p.stability.verdict for p in found.points] == ["undecided"]
    assert found.points[0].stability.stable_where == ()


def test_positive_coordinates_are_positive_without_values_too():
    scene = """\
parameters: {m: {}, k: {positive: true}, b: {positive: true}}
particles: {ball: {mass: m, position: [r, 0, 0]}}
coordinates: {r: {positive: true}}
potentials: {spring: k*(r - b)^2*r^2}
"""
    laws, _ = solved(scene)
    assert sorted(laws) == [("b",), ("b/2",)]


def test_no_number_stands_for_values_beside_free_coordinates():
    """All of x = y balance, not x = 0.2 alone, where the start has y = 0.2."""
    scene = """\
coordinates: [x, y]
kinetic: {T: dot(x)^2/2 + dot(y)^2/2}
potentials: {spring: (x - y)^2}
initial: {x: 0.3, y: 0.2}
"""
    analysis = loads(scene).derive().analyze()
    text, latex = (str(analysis.written(form)) for form in ("text", "latex"))
    assert "x = y, y any" in text
    assert "0.2" not in text + latex
