"""``check`` passes no expectation that is off by a kink, a narrow or a tiny term."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import pytest

from lagrange_cli.check.check import check_scene
from lagrange_cli.errors import Problem

pytestmark = pytest.mark.slow

PLANE = (
    "name: tested\nparameters: {m: 2, k: {value: 3, positive: true}, a: 0.5}\n"
    "particles: {b: {mass: m, position: [x, y, 0]}}\ncoordinates: [x, y]\n"
    "initial: {x: 0, y: 0, dot(x): 1, dot(y): 1}\n"
)
FREE = "m/2*(dot(x)^2 + dot(y)^2)"

#: A potential, and its slope in x.
TERMS = {
    "k/2*max(0, x - 3)^2": "k*max(0, x - 3)",
    "k*abs(x - 3)": "k*sign(x - 3)",
    "k*max(0, min(1, x - 3))": "k*(1 + sign(x - 3))*(1 + sign(4 - x))/4",
    "k*sqrt(x^2 - 6*x + 9)": "k*(x - 3)/sqrt(x^2 - 6*x + 9)",
    "1e-60*x^2/2": "1e-60*x",
    "exp(-((x - 5)/1e-9)^2)": "-2e18*(x - 5)*exp(-((x - 5)/1e-9)^2)",
    "1e-30/(1 + ((x - 5)/1e-9)^2)": "-2e-12*(x - 5)/(1 + ((x - 5)/1e-9)^2)^2",
    "(x/10)^40": "4*(x/10)^39",
    "k*max(0, 1 - abs((x - 5)/1e-6))": "-k*sign(x - 5)*(1 + sign(1 - abs((x - 5)/1e-6)))*5e5",
}


def problems(tmp_path: Path, scene: str, expect: str) -> Sequence[Problem]:
    path = tmp_path / "scene.yaml"
    path.write_text(f"{scene}expect:\n{expect}")
    report = check_scene(str(path))
    assert report.outcome == ("fail" if report.problems else "pass"), report
    assert all(p.mark is not None for p in report.problems)
    return report.problems


def with_potential(term: str) -> str:
    return f"{PLANE}potentials: {{v: '{term}'}}\n"


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("factor", ["1", "-2*m", "x", "(1 + x^2)", "exp(x/1e-9)", "k"])
def test_true_equations_pass_times_what_is_not_zero(tmp_path, term, factor):
    equations = f"  equations: ['{factor}*(m*ddot(x) + {TERMS[term]}) = 0', 'ddot(y) = 0']\n"
    assert not problems(tmp_path, with_potential(term), equations)


@pytest.mark.parametrize("term", TERMS)
def test_equations_without_a_term_fail(tmp_path, term):
    for wrong in ("0", f"-({TERMS[term]})", f"(1 + 1e-12)*({TERMS[term]})"):
        equations = f"  equations: ['m*ddot(x) + {wrong} = 0']\n"
        (problem,) = problems(tmp_path, with_potential(term), equations)
        assert problem.rule == "equations"


@pytest.mark.parametrize(
    "factor",
    [
        *("max(0, x - 3)", "(x + abs(x))", "(sqrt(x^2 - 6*x + 9) + x - 3)", "(1 + sign(x - 3))"),
        *("0*x", "(asin(sin(x)) - x)", "(atan(x) + atan(1/x) - pi/2)"),
        *(
            "(log(2*k) - log(k) - log(2))",
            "(log(1 + k^2*x^2 + k^2 + x^2) - log(1 + k^2) - log(1 + x^2))",
        ),
    ],
)
def test_a_factor_that_is_zero_on_a_part_says_nothing(tmp_path, factor):
    scene = with_potential("k*x^2/2")
    (problem,) = problems(tmp_path, scene, f"  equations: ['{factor}*(m*ddot(x) + k*x) = 0']\n")
    assert problem.rule == "equations"


@pytest.mark.parametrize("term", TERMS)
def test_lagrangians_without_a_term_fail(tmp_path, term):
    scene = with_potential(term)
    shifted = term.replace("3)", "3*(1 + 1e-9))").replace("5)", "5*(1 + 1e-12))")
    for wrong in ("0", f"-({term})", f"(1 + 1e-12)*({term})", f"{term} + 1e-60*x"):
        (problem,) = problems(tmp_path, scene, f"  lagrangian: '{FREE} - ({wrong})'\n")
        assert problem.rule == "lagrangian"
    if shifted != term:
        assert problems(tmp_path, scene, f"  lagrangian: '{FREE} - ({shifted})'\n")


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize(
    "gauge", ["0", "x*dot(x)", "max(0, x)*dot(x)", "cos(y)*dot(y)", "y + t*dot(y)"]
)
def test_lagrangians_up_to_a_total_derivative_pass(tmp_path, term, gauge):
    expect = f"  lagrangian: '{FREE} - ({term}) + {gauge}'\n"
    assert not problems(tmp_path, with_potential(term), expect)


@pytest.mark.parametrize(
    "impulse", ["sign(x - 3)", "x/abs(x)", "abs(dot(x))", "max(0, dot(y))", "atan(1/x)"]
)
def test_lagrangians_that_differ_by_an_impulse_do_not_pass(tmp_path, impulse):
    """Their equations are the same on both sides of a surface, and a blow stands on it."""
    (problem,) = problems(tmp_path, PLANE, f"  lagrangian: '{FREE} + {impulse}'\n")
    assert problem.rule == "lagrangian"


@pytest.mark.parametrize("impulse", ["sign(x - 3)", "x/abs(x)", "atan2(y, x - 3)"])
def test_lagrangians_with_an_impulse_are_themselves(tmp_path, impulse):
    expect = f"  lagrangian: '{FREE} - k*({impulse})'\n"
    assert not problems(tmp_path, with_potential(f"k*({impulse})"), expect)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("log(k*(1 + x^2))", "log(k) + log(1 + x^2)"),
        ("asin(x/4)", "2*atan(x/(4 + sqrt(16 - x^2)))"),
        ("sqrt((1 + x^2)*(2 + x^2))", "sqrt(1 + x^2)*sqrt(2 + x^2)"),
        ("atan(x)", "asin(x/sqrt(1 + x^2))"),
        ("sqrt(k^2*x^2 + k^2)", "k*sqrt(x^2 + 1)"),
        ("acosh(2 + x^2)", "log(2 + x^2 + sqrt((2 + x^2)^2 - 1))"),
        ("cos(x)^3", "(3*cos(x) + cos(3*x))/4"),
        ("tanh(x/2)", "(cosh(x) - 1)/sinh(x)"),
        ("max(x, 0, y)", "max(0, max(y, x))"),
        ("abs(x)*sign(x)", "x"),
    ],
)
def test_identities_of_functions_pass(tmp_path, one, other):
    scene = with_potential(f"a*({one})")
    assert not problems(tmp_path, scene, f"  lagrangian: '{FREE} - a*({other})'\n")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("sqrt(a^2*x^2 + a^2)", "a*sqrt(x^2 + 1)"),  # the sign of a is not known
        ("asin(sin(x))", "x"),
        ("log(1 + x^2)", "(1 + 1e-15)*log(1 + x^2)"),
        ("log(1 + x^2)", "log(1 + x^2*(1 + 1e-15))"),
        ("log(1 + x^2)", "log(1 + x^2 + exp(-((x - 5)/1e-6)^2))"),
    ],
)
def test_what_holds_near_the_start_alone_fails(tmp_path, one, other):
    scene = with_potential(f"k*({one})")
    (problem,) = problems(tmp_path, scene, f"  lagrangian: '{FREE} - k*({other})'\n")
    assert problem.rule == "lagrangian"


@pytest.mark.parametrize("term", TERMS)
def test_lists_of_what_is_conserved_are_exact(tmp_path, term):
    scene = with_potential(term)
    assert not problems(tmp_path, scene, "  cyclic: [y]\n  conserved: [energy, p_y]\n")
    for wrong in ("cyclic: [x, y]", "cyclic: []", "conserved: [p_x]", "conserved: []"):
        (problem,) = problems(tmp_path, scene, f"  {wrong}\n")
        assert problem.rule == wrong.split(":")[0]


def test_what_symmetries_conserve_is_proven(tmp_path):
    """Two bodies on springs to each other, and to a wall along x alone."""
    bodies = """
        name: bodies
        particles:
          a: {mass: 1, position: [x, y, 0]}
          b: {mass: 2, position: [u, v, 0]}
        coordinates: [x, y, u, v]
        potentials: {pull: ((x - u)^2 + (y - v)^2)/2%s}
        initial: {x: 1, y: 0, u: 0, v: 0}
    """
    free, held = (textwrap.dedent(bodies % more) for more in ("", " + x^2"))
    named = "  conserved: [energy, P_x, P_y, L_z, boost_x]\n"
    assert not problems(tmp_path, free, named)
    assert not problems(tmp_path, held, "  conserved: [energy, P_y]\n")
    for wrong in ("P_x", "L_z", "boost_x"):
        (problem,) = problems(tmp_path, held, f"  conserved: [{wrong}]\n")
        assert problem.rule == "conserved"
        assert problem.message.startswith(f"'{wrong}' is not found to be conserved; found: ")


def test_what_is_open_is_neither_cyclic_nor_not(tmp_path):
    """atan x + atan 1/x is π/2 for x > 0 and −π/2 for x < 0: no state near the start says so."""
    scene = with_potential("k*(atan(x + 9) + atan(1/(x + 9)))")
    for expect in ("cyclic: [y]", "cyclic: [x, y]", "conserved: []"):
        found = problems(tmp_path, scene, f"  {expect}\n")
        assert found or expect == "cyclic: [y]"


def test_an_expectation_that_cannot_be_decided_says_so(tmp_path):
    scene = with_potential("k*sign(x - 3)")
    (problem,) = problems(tmp_path, scene, f"  lagrangian: '{FREE}'\n")
    assert "it cannot be decided whether the expected Lagrangian" in problem.message
    stop = with_potential("k/2*max(0, x - 3)^2")
    wrong = "max(0, x - 3)*(m*ddot(x) + k*max(0, x - 3))"
    (problem,) = problems(tmp_path, stop, f"  equations: ['{wrong} = 0']\n")
    assert "it cannot be decided whether this is a multiple" in problem.message


@pytest.mark.parametrize("start", ["pi/6", "0.3"])
def test_numbers_of_the_start_stand_for_constants_of_integration(tmp_path, start):
    scene = (
        "parameters: {m: 1, J: 0.3, R: 0.5, k: 3}\n"
        "particles: {load: {mass: m, position: [0, 0, y]}}\ncoordinates: [phi]\n"
        "kinetic: {drum: J*dot(phi)^2/2}\npotentials: {spring: k*y^2/2}\n"
        f"constraints: {{rope: dot(y) = -R*dot(phi)}}\ninitial: {{phi: {start}, y: 0.4}}\n"
    )
    equation = "(J + m*R^2)*ddot(phi) - k*R*(0.4 - R*(phi - %s)) = 0"
    lagrangian = "(J + m*R^2)*dot(phi)^2/2 - k/2*(0.4 - R*(phi - %s))^2"
    for expected in (f'  equations: ["{equation}"]\n', f'  lagrangian: "{lagrangian}"\n'):
        assert not problems(tmp_path, scene, expected % start)
        assert problems(tmp_path, scene, expected % "0.31")
