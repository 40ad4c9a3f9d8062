"""Branches of constraints with several solutions, linear blocks, pivots that may vanish."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.mechanics.elimination.solve_equation import (
    factor_branches,
    linear_parts,
    solutions,
)
from tests.mechanics.mechanics_support import derived, few, number, refusal

FREE = "particles: {bead: {mass: 1, position: [x, y, z]}}\n"
FLAT = FREE + "plane: xz\n"
CIRCLE = FLAT + "parameters: {l: 1}\nconstraints: {ring: x^2 + z^2 = l^2}\n"
QUADRATIC = FLAT + "constraints: {curve: z^2 + 2*z*x - 3 = 0}\ncoordinates: [x]\n"


def place(text: str, name: str) -> sp.Expr:
    """Position of a Cartesian name, with the values of parameters put in."""
    e = derived(text)
    values = {p.symbol: sp.nsimplify(p.value) for p in e.system.parameters}
    (found,) = [c.position for c in e.system.cartesian_names if c.name == name]
    return found.xreplace(values)


def at_start(text: str, name: str) -> float:
    e = derived(text)
    assert e.system.initial is not None
    start = dict(zip((c.q for c in e.system.coordinates), e.system.initial.positions, strict=True))
    return float(number(place(text, name), start))


@pytest.mark.parametrize("section", ["initial", "near"])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_circle_has_an_upper_and_a_lower_half(section: str, sign: int) -> None:
    text = CIRCLE + f"coordinates: [x]\n{section}: {{x: 0.6, z: {sign * 0.8}}}"
    e = derived(text)
    value = place(text, "z").xreplace({e.system.coordinates[0].q: sp.Rational(3, 5)})
    assert value == sign * sp.Rational(4, 5)


def test_an_initial_value_wins_over_near() -> None:
    text = CIRCLE + "coordinates: [x]\nnear: {x: 0, z: 1}\ninitial: {x: 0.6, z: -0.8}"
    assert at_start(text, "z") == pytest.approx(-0.8, abs=1e-15)


@pytest.mark.parametrize(("start", "expected"), [("1", 1), ("-3", -3)])
def test_a_quadratic_with_a_linear_term(start: str, expected: int) -> None:
    text = QUADRATIC + f"initial: {{x: 1, z: {start}}}"
    assert at_start(text, "z") == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (CIRCLE + "coordinates: [x]", "initial"),
        (QUADRATIC, "initial"),
        (FLAT + "constraints: {c: z^2 = 4}", "c: z - 2 = 0"),
    ],
)
def test_branches_that_nothing_chooses_are_listed(text: str, hint: str) -> None:
    problem = refusal(text)
    assert problem.rule == "ambiguous-branch"
    assert problem.mark is not None
    assert problem.message.count(" = ") == 2
    assert hint in problem.hint


def test_a_product_is_zero_in_two_ways() -> None:
    """x = 0 and z = 0 both satisfy the constraint: neither may be dropped in silence."""
    assert refusal(FLAT + "constraints: {cross: x*z = 0}").rule == "ambiguous-branch"


@pytest.mark.parametrize(("x", "z", "fixed"), [("0", "2", "x"), ("2", "0", "z")])
def test_the_initial_state_chooses_a_factor(x: str, z: str, fixed: str) -> None:
    e = derived(FLAT + f"constraints: {{cross: x*z = 0}}\ninitial: {{x: {x}, z: {z}}}")
    assert [c.name for c in e.system.coordinates] == [{"x": "z", "z": "x"}[fixed]]


PENDULUM = FLAT + (
    "points: {arm: [angle, 0, 0]}\nparameters: {l: 2}\n"
    "constraints: {across: x = l*sin(angle), down: z = -l*cos(angle)}\ncoordinates: [x]\n"
)


@pytest.mark.parametrize(
    "angle", ["pi/6", "5*pi/6", "pi/6 + 4*pi", "5*pi/6 - 2*pi", "pi/6 - 100*pi"]
)
def test_an_angle_keeps_its_turns(angle: str) -> None:
    text = PENDULUM + f"initial: {{x: 1, angle: {angle}}}"
    assert at_start(text, "angle") == pytest.approx(float(sp.sympify(angle)), rel=1e-14)
    assert at_start(text, "z") == pytest.approx(-2 * float(sp.cos(sp.sympify(angle))), rel=1e-14)


@pytest.mark.parametrize(
    ("equation", "angle"),
    [
        ("z = 2*tan(angle)", "pi/4"),
        ("z = 2*tan(angle)", "5*pi/4"),
        ("z = 2*tan(angle)", "pi/4 + 2*pi"),
        ("z = 4*cos(2*angle)", "pi/6"),
        ("z = 4*cos(2*angle)", "-pi/6"),
        ("z = 4*cos(2*angle)", "pi/6 + pi"),
        ("z = 4*cos(2*angle)", "pi/6 + 2*pi"),
        ("z = 4*sin(angle + pi/3)", "pi/2 + 2*pi"),
    ],
)
def test_every_period_of_an_angle_is_a_solution(equation: str, angle: str) -> None:
    text = FLAT + (
        f"points: {{arm: [angle, 0, 0]}}\nconstraints: {{c: {equation}}}\n"
        f"coordinates: [x, z]\ninitial: {{x: 0, z: 2, angle: {angle}}}"
    )
    assert at_start(text, "angle") == pytest.approx(float(sp.sympify(angle)), rel=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "kept"), [("x: -2, y: 1, z: 5", "z"), ("x: -3, y: 9, z: 1", "y")]
)
def test_the_pivot_is_the_one_that_does_not_vanish_at_the_start(start: str, kept: str) -> None:
    """Where x + 2 is zero the constraint gives no z, and where x + 3 is zero no y."""
    text = FREE + f"constraints: {{c: x*z + 2*z = y*(x + 3) - 1}}\ninitial: {{{start}}}"
    assert kept in [c.name for c in derived(text).system.coordinates]


@pytest.mark.slow
def test_no_chart_is_chosen_where_none_is_declared() -> None:
    """A root would end at the diameter: both names stay."""
    for initial in ("initial: {x: 0, z: 1}", "initial: {x: 1, z: 0}", ""):
        e = derived(CIRCLE + initial)
        assert [c.name for c in e.system.coordinates] == ["x", "z"]
        assert e.system.formulation == "multiplier"


def test_a_chart_that_ends_at_the_start_is_left_for_the_multiplier_form() -> None:
    e = derived(CIRCLE + "coordinates: [x]\ninitial: {x: 1, z: 0}")
    assert e.system.formulation == "multiplier"
    assert [c.name for c in e.system.coordinates] == ["x", "z"]
    assert any("singular at the initial state" in remark for remark in e.derivation.remarks)


def test_a_start_beside_the_constraint_is_refused_with_its_place() -> None:
    problem = refusal(CIRCLE + "coordinates: [x]\ninitial: {x: 2, z: 0}")
    assert problem.mark is not None
    assert "'ring'" in problem.message or "'z'" in problem.message


MATRICES = st.lists(st.lists(st.integers(-4, 4), min_size=3, max_size=3), min_size=3, max_size=3)


@pytest.mark.slow
@given(MATRICES, st.lists(st.integers(-5, 5), min_size=3, max_size=3))
@few
def test_linear_blocks_are_solved_whatever_their_rank(
    rows: list[list[int]], right: list[int]
) -> None:
    """Three equations in six heights; the first three names stand for the free ones."""
    names = [f"z{k}" for k in range(6)]
    particles = ", ".join(f"p{k}: {{mass: 1, position: [0, 0, {n}]}}" for k, n in enumerate(names))
    equations = []
    for k, row in enumerate(rows):
        terms = " + ".join(f"({c})*{n}" for c, n in zip(row, names[:3], strict=True))
        equations.append(f"e{k}: {terms} + 2*{names[3 + k]} = {right[k]}")
    text = f"particles: {{{particles}}}\nconstraints: {{{', '.join(equations)}}}\n"
    text += f"potentials: {{v: {' + '.join(f'{n}^2' for n in names)}}}"
    e = derived(text)
    assert e.derivation.account.dof == 3
    places = {c.name: c.position for c in e.system.cartesian_names}
    places.update({c.name: c.q for c in e.system.coordinates})
    for k, row in enumerate(rows):
        total = sum(c * places[n] for c, n in zip(row, names[:3], strict=True))
        assert sp.expand(total + 2 * places[names[3 + k]] - right[k]) == 0


def test_movable_pulleys() -> None:
    """Weights a, b, c on a tree of two ropes: accelerations of the closed form."""
    text = (
        "parameters: {g: 9.81}\nparticles:\n  a: {mass: 1, position: [0, 0, z1]}\n"
        "  b: {mass: 2, position: [0, 0, z2]}\n  c: {mass: 4, position: [0, 0, z3]}\n"
        "points: {pulley: [0, 0, zp]}\n"
        "constraints: {long: z1 + zp = -3, short: (z2 - zp) + (z3 - zp) = -2}\n"
        "potentials: {weight: {gravity: g}}"
    )
    e = derived(text)
    g = sp.Rational(981, 100)
    mass = sp.Matrix(e.system.mass_matrix)
    force = sp.Matrix(e.system.forcing).xreplace({e.system.parameters[0].symbol: g})
    found = dict(zip((c.name for c in e.system.coordinates), mass.LUsolve(force), strict=True))
    # With tension s in the short rope: 2 s in the long one; a_p = (4 s − ...)/..., solved by hand:
    # m1 a1 = 2s − m1 g, m2 a2 = s − m2 g, m3 a3 = s − m3 g, a2 + a3 = −2 a1.
    s = 4 * g / (sp.Integer(4) / 1 + sp.Rational(1, 2) + sp.Rational(1, 4))
    expected = {"z1": 2 * s - g, "z2": s / 2 - g, "z3": s / 4 - g}
    for name, value in found.items():
        assert value == expected[name]


u, p = sp.symbols("u p", real=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("phi", "expected"),
    [
        (3 * u - p, {p / 3}),
        (u**2 - p, {sp.sqrt(p), -sp.sqrt(p)}),
        (u**2 + 2 * u - 3, {sp.Integer(1), sp.Integer(-3)}),
        ((u - 1) * (u + 2) - u**2, {sp.Integer(2)}),
        (sp.exp(2 * u) - p, {sp.log(p) / 2}),
        (sp.tanh(u) - p, {sp.atanh(p)}),
        (sp.cosh(u) - p, {sp.acosh(p), -sp.acosh(p)}),
        (1 / u - p, {1 / p}),
        (sp.log(u) - p, {sp.exp(p)}),
    ],
)
def test_closed_forms(phi: sp.Expr, expected: set[sp.Expr]) -> None:
    found = solutions(phi, u)
    assert found is not None
    assert {sp.simplify(f) for f in found} == expected


@pytest.mark.parametrize("phi", [u + sp.sin(u), u**3 + u - p, sp.exp(u) + u, u ** sp.Symbol("k")])
def test_what_has_no_certain_closed_form_is_left(phi: sp.Expr) -> None:
    assert solutions(phi, u) is None


@pytest.mark.parametrize("power", [3, 5])
def test_odd_powers_have_one_real_root_or_none_is_claimed(power: int) -> None:
    found = solutions(u**power - p, u)
    if found is not None:
        (root,) = found
        assert root.subs(p, -8).is_real


def test_linear_parts() -> None:
    assert linear_parts(p * u + 2 - u, u) == (p - 1, sp.Integer(2))
    assert linear_parts((u + p) ** 2 - u**2, u) == (2 * p, p**2)
    assert linear_parts(u**2, u) is None
    assert linear_parts(sp.sin(u), u) is None
    assert linear_parts((u + 1) ** 2 - u**2 - 2 * u, u) is None
    assert linear_parts(sp.sympify(p), u) is None


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("constraint", "x", "middle", "branch"),
    [
        ("x^2 + z^2 = l^2", "l*sin(u)", 0, lambda u: 2 * math.cos(u)),
        ("x^2 + (z - h)^2 = l^2", "l*cos(u)", 3, lambda u: 2 * math.sin(u)),
        ("x^2/l^2 + z^2/h^2 = 1", "l*sin(u)", 0, lambda u: 3 * math.cos(u)),
        ("(z - h)^2 = x^2", "l*u", 3, lambda u: 2 * u),
    ],
)
def test_a_branch_goes_on_smoothly_where_it_meets_the_other(
    constraint: str, x: str, middle: float, branch: Callable[[float], float], sign: int
) -> None:
    """The particle runs through, where the sign of a root would throw it back."""
    start = middle + sign * branch(0.5)
    text = (
        FLAT
        + f"parameters: {{l: 2, h: 3}}\nconstraints: {{c: '{constraint}'}}\ncoordinates: [u]\n"
        + f"definitions: {{x: {x}}}\ninitial: {{u: 0.5, z: {start!r}}}\n"
    )
    u = derived(text).system.coordinates[0].q
    for at in (0.5, 2.0, 4.0, -1.0):
        found = float(number(place(text, "z"), {u: at}))
        assert found == pytest.approx(middle + sign * branch(at), rel=1e-12)


def test_high_powers_of_sums_are_not_multiplied_out() -> None:
    """(x + y + z)¹⁰⁰ has 5151 terms: what is looked for factors stays as it is written."""
    x, y, z = sp.symbols("x y z", real=True)
    for phi in ((x + y + z) ** 100 - 14, (x + y) ** 9 * (x - y) ** 9 - z, x**5000 - y**5000):
        assert factor_branches(phi, frozenset()) == [phi]
    assert len(factor_branches(x**2 - y**2, frozenset())) == 2
    problem = refusal(
        "sizes: {n: 3}\ncoordinates: ['q[i=1..n]']\n"
        "kinetic: {T: 'sum(dot(q[i])^2, i=1..n)'}\n"
        "constraints: {c: 'sum(q[i], i=1..n)^100 = 14'}\n"
    )
    assert problem.rule == "too-many-coordinates"


def test_a_coefficient_that_is_zero_at_the_parameters_is_not_divided_by() -> None:
    """A vertical incline: z·cos(π/2) = x·sin(π/2) says x = 0."""
    text = FLAT + "parameters: {al: pi/2}\nconstraints: {incline: z*cos(al) = x*sin(al)}"
    assert [c.name for c in derived(text).system.coordinates] == ["z"]
    assert abs(place(text, "x").coeff(sp.Symbol("z", real=True))) < 1e-12


@pytest.mark.parametrize(
    "constraints",
    ["c1: x = a + b, c2: x*z = 0", "c1: x + y = a + b, c2: x - y = a + b, c3: x*z = 0"],
)
def test_an_equation_that_vanishes_at_the_parameters_restricts_nothing(constraints: str) -> None:
    text = FREE + f"parameters: {{a: 1, b: -1}}\nconstraints: {{plane: y = 0, {constraints}}}"
    e = derived(text)
    assert [c.name for c in e.system.coordinates] == ["z"]
    assert e.derivation.account.dof == 1


def test_a_small_coefficient_is_divided_by() -> None:
    e = derived(FLAT + "parameters: {a: 1e-12}\nconstraints: {slope: a*z = x^2}")
    assert [c.name for c in e.system.coordinates] == ["x"]
