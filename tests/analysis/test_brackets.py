"""Poisson brackets: algebras of textbooks, Jacobi's identity, motions, and what is refused."""

from __future__ import annotations

import json
import random

import pytest
import sympy as sp

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from tests.analysis.form_motions import read_back
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS

TWO_BODIES = str(SYSTEMS / "celestial" / "two_bodies.yaml")

KEPLER = """
name: kepler
parameters: {m: 2, k: 3}
particles: {p: {mass: m, position: [x, y, z]}}
coordinates: [x, y, z]
potentials: {V: -k/sqrt(x^2 + y^2 + z^2)}
initial: {x: 1, y: 0.2, z: 0.3, dot(x): 0.1, dot(y): 0.9, dot(z): 0.2}
"""

#: A charge in a uniform magnetic field along z, by U = −q v·A with A = B (−y, x)/2.
CHARGE = """
name: charge
parameters: {m: 2, e: 3, B: 0.5}
particles: {p: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {U: -e*B/2*(x*dot(y) - y*dot(x))}
initial: {x: 1, y: 0}
"""

FRICTION = """
name: friction
parameters: {m: 2, c: 0.5}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
dissipation: {drag: c/2*dot(x)^2}
initial: {x: 1}
"""


def brackets(text, *pairs):
    derivation = loads(text).derive().with_brackets(*pairs)
    return derivation.report(form="hamiltonian")["brackets"]


@pytest.mark.slow
def test_angular_momenta_and_the_vector_of_runge_and_lenz():
    """{L_x, L_y} = L_z, {A, H} = 0 and {A_x, A_y} = −2 m H L_z of Kepler's problem."""
    r = "sqrt(x^2 + y^2 + z^2)"
    lenz = {
        "x": f"p_y*L_z - p_z*L_y - m*k*x/{r}",
        "y": f"p_z*L_x - p_x*L_z - m*k*y/{r}",
    }
    pairs = ["L_x, L_y", "L_z, L_x", "L_y, L_x", f"{lenz['x']}, H", f"{lenz['x']}, L_x"]
    found = brackets(KEPLER, *pairs)
    assert [b["value"] for b in found] == ["L_z", "L_y", "-L_z", "0", "0"]
    assert found[3]["conserved"] is True
    both = loads(KEPLER).derive().with_brackets(f"{lenz['x']}, {lenz['y']}")
    state = {"x": 1.1, "y": 0.4, "z": -0.3, "p_x": 0.2, "p_y": 1.3, "p_z": -0.5}
    bracket, energy = numbers_at(both.report(form="hamiltonian"), state)
    angular = state["x"] * state["p_y"] - state["y"] * state["p_x"]
    assert bracket == pytest.approx(-2 * 2 * energy * angular, rel=1e-12)


def numbers_at(report, state):
    """The bracket and H at a state, by SymPy's own functions."""
    known = {sp.Symbol(n): x for n, x in {**state, "m": 2, "k": 3}.items()}
    hamiltonian = read_back(report["hamiltonian"]).subs(known)
    momenta = {n: read_back(e).subs(known) for n, e in report["quantities"].items()}
    over = known | {sp.Symbol(n): x for n, x in momenta.items()} | {sp.Symbol("H"): hamiltonian}
    value = read_back(report["brackets"][0]["value"]).subs(over)
    return float(value), float(hamiltonian)


def test_velocities_in_a_magnetic_field_do_not_commute():
    """{v_x, v_y} = e B / m²."""
    (found,) = brackets(CHARGE, "dot(x), dot(y)")
    values = {sp.Symbol(n): x for n, x in {"m": 2, "e": 3, "B": sp.Rational(1, 2)}.items()}
    assert read_back(found["value"]).subs(values) == sp.Rational(3, 8)


@pytest.mark.slow
def test_boosts_are_conserved_though_they_hold_the_time():
    report = load(TWO_BODIES).derive().with_brackets("boost_x, H", "boost_x, P_x", "x1, H")
    boost, mass, place = report.report(form="hamiltonian")["brackets"]
    assert (boost["value"], boost["rate"], boost["conserved"]) == ("P_x", "0", True)
    assert mass["value"] == "m1 + m2"
    assert place["conserved"] is False


@pytest.mark.slow
def test_jacobis_identity_of_polynomials_drawn_at_random():
    draw = random.Random(4)
    derivation = loads(KEPLER).derive()

    def polynomial():
        names = ["x", "y", "z", "p_x", "p_y", "p_z"]
        terms = ["*".join(draw.sample(names, 2)) for _ in range(3)]
        return " + ".join(f"{draw.randint(1, 5)}*{term}" for term in terms)

    def bracket(f, g):
        value = derivation.with_brackets(f"{f}, {g}").report(form="hamiltonian")["brackets"][0]
        return value["value"]

    for _ in range(2):
        f, g, h = (polynomial() for _ in range(3))
        cyclic = [bracket(a, bracket(b, c)) for a, b, c in ((f, g, h), (g, h, f), (h, f, g))]
        named = {"L_x": "y*p_z - z*p_y", "L_y": "z*p_x - x*p_z", "L_z": "x*p_y - y*p_x"}
        symbols = {sp.Symbol(name): read_back(text) for name, text in named.items()}
        assert sp.expand(sum(read_back(value) for value in cyclic).subs(symbols)) == 0


def test_friction_changes_more_than_a_bracket_says():
    (found,) = brackets(FRICTION, "p_x, H")
    assert found == {
        "first": "p_x",
        "second": "H",
        "value": "0",
        "rate": None,
        "conserved": None,
    }
    told = loads(FRICTION).derive().with_brackets("p_x, H").text(form="hamiltonian")
    assert "{p_x, H} is not all of the rate" in told


@pytest.mark.slow
def test_the_formats_print_them():
    options = ("--form", "hamiltonian", "--bracket", "boost_x, P_x", "--bracket", "L_z, H")
    text = succeed("derive", TWO_BODIES, *options)
    assert "{boost_x, P_x} = m1 + m2" in text
    assert "L_z is conserved: {L_z, H} + ∂L_z/∂t vanishes." in text
    latex = succeed("derive", TWO_BODIES, *options, "--format", "latex", "--style", "snippet")
    assert r"\lbrace" in latex
    assert "Poisson brackets" in latex
    for further in (("--format", "typst"), ("--format", "markdown", "--language", "fr")):
        assert "m_" in succeed("derive", TWO_BODIES, *options, *further)
    report = json.loads(succeed("derive", TWO_BODIES, *options, "--json"))
    assert report["bracket_certificate"]["points"] == 8
    assert report["quantities"].keys() == {"boost_x", "P_x", "L_z"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x1", "two functions"),
        ("", "two functions"),
        ("x1, y1, x2", "two functions"),
        ("x1, dot(p_x1)", "'p_x1, H'"),
        ("x1, dot(L_z)", "'L_z, H'"),
        ("x1, ddot(x1)", "accelerations"),
        ("x1, L_q", "unknown name 'L_q'"),
        ("x1, H^H^H", "no real value"),
        ("x1, __import__('os')", "unexpected character"),
        ("x1, 1/0", "division by zero"),
    ],
)
def test_other_texts_are_refused_at_their_place(text, says):
    derivation = load(TWO_BODIES).derive()
    with pytest.raises(InputError, match="--bracket:1:") as refused:
        derivation.with_brackets(text)
    assert says in str(refused.value)


@pytest.mark.slow
def test_velocities_without_a_closed_form_are_not_differentiated():
    chain = load(SYSTEMS / "chains" / "pendulum_chain.yaml").derive()
    found = chain.with_brackets("theta[1], p_theta[1]^2").report(form="hamiltonian")["brackets"]
    assert found[0]["value"] == "2*p_theta[1]"
    for text in ("theta[1], H", "theta[1], dot(theta[2])"):
        with pytest.raises(InputError, match="no closed form over the momenta"):
            chain.with_brackets(text)


def test_it_is_of_hamiltons_form():
    done = lagrange("derive", TWO_BODIES, "--bracket", "x1, y1")
    assert done.returncode == 2
    assert "--form hamiltonian" in done.stderr


def test_momenta_of_any_size_are_compared():
    """{p_y, y²} = −2 y, beside numbers, where p_y is 1e300 times as large as y."""
    (bracket,) = brackets(KEPLER.replace("m: 2", "m: 1e300"), "p_y, y^2")
    assert read_back(bracket["value"]) == -2 * sp.Symbol("y")
