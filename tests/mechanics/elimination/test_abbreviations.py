"""Abbreviations that hold velocities stand for what they are short for, in every section."""

from __future__ import annotations

import re

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.mechanics.equations import Equations
from tests.mechanics.mechanics_support import derived, few, number, random_point, refusal

#: A rod that slides and turns: its centre is a particle off the origin of x and y.
BODY = """
parameters: {{m: 2, r: 0.4, J: 0.1, c: 0.3, k: 3}}
coordinates: [x, y, q1]
definitions: {{u: dot(x), w: dot(q1), v: "u + r*w", e: J/2*w^2, s: "sin(q1)*w"}}
particles:
  centre: {{mass: m, position: [x + r*cos(q1), y + r*sin(q1), 0]}}
kinetic: {kinetic}
{sections}
"""
SHORT = {"u": "dot(x)", "w": "dot(q1)", "v": "(u + r*w)", "e": "(J/2*w^2)", "s": "(sin(q1)*w)"}

#: Sections in abbreviations, of which the kinetic energy makes the three coordinates independent.
SECTIONS = {
    "kinetic": ("{disc: e}", ""),
    "kinetic of a sum": ("{disc: J/2*(w + u)^2 + e}", ""),
    "potential": ("{disc: e}", "potentials: {field: k*x*v + s, spring: k/2*x^2}"),
    "dissipation": ("{disc: e}", "dissipation: {hinge: c/2*v^2}"),
    "force on a coordinate": ("{disc: e}", "forces: {motor: {on: q1, force: -c*v*w}}"),
    "force on a particle": ("{disc: e}", "forces: {push: {on: centre, force: [-c*u, s, 0]}}"),
    "output": ("{disc: e}", "outputs: {speed: v + s, energy: e}"),
    "velocity constraint": ("{disc: e}", "constraints: {blade: u*sin(q1) = dot(y)*cos(q1) - w*r}"),
}


def written_out(text: str) -> str:
    """A text of a scene without its abbreviations."""
    while True:
        after = re.sub(r"\b([uwves])\b(?!:)", lambda found: SHORT[found[1]], text)
        if after == text:
            return text
        text = after


def numbers(e: Equations) -> list[mpmath.mpf]:
    """Mass matrix, forcing, closures and outputs at a random state."""
    symbols = [
        *(s for c in e.system.coordinates for s in (c.q, c.v)),
        *(p.symbol for p in e.system.parameters),
    ]
    state = random_point([*symbols, e.system.t], seed=7)
    entries = [x for row in e.system.mass_matrix for x in row]
    entries += [*e.system.forcing, *(x for c in e.system.closures for x in (*c.gradient, c.bias))]
    return [number(x, state) for x in (*entries, *(x for _, x in e.system.outputs))]


def same(kinetic: str, sections: str) -> None:
    short = derived(BODY.format(kinetic=kinetic, sections=sections))
    body = re.sub("definitions: .*\n", "", BODY)
    long = body.format(kinetic=written_out(kinetic), sections=written_out(sections))
    assert "w" not in re.findall(r"\b\w\b", long)
    assert short.derivation.account.dof == derived(long).derivation.account.dof
    for x, y in zip(numbers(short), numbers(derived(long)), strict=True):
        assert abs(x - y) <= mpmath.mpf(10) ** -20 * (1 + abs(y))


@pytest.mark.slow
@pytest.mark.parametrize("name", SECTIONS)
def test_an_abbreviation_stands_for_what_it_is_short_for(name: str) -> None:
    same(*SECTIONS[name])


@pytest.mark.slow
@few
@given(
    st.lists(st.sampled_from(["u*v", "w*v", "s*u", "cos(q1)*e", "v^2", "u*w"]), max_size=3),
    st.lists(st.sampled_from(["x*u", "s", "x^2*w", "v*y", "k*x^2"]), min_size=1, max_size=3),
    st.lists(st.sampled_from(["-c*u", "s*w", "t*v", "e"]), min_size=1, max_size=2),
)
def test_sums_of_abbreviations(kinetic: list[str], potential: list[str], force: list[str]) -> None:
    energy = " + ".join(["e", *(f"J*({term})" for term in kinetic)])
    work = f"potentials: {{field: {' + '.join(potential)}}}\n"
    work += f"forces: {{motor: {{on: q1, force: {' + '.join(force)}}}}}"
    same(f"{{all: {energy}}}", work)


def test_a_rate_makes_coordinates_independent_whatever_it_is_called() -> None:
    e = derived(BODY.format(kinetic="{disc: e}", sections=""))
    assert (e.derivation.account.extra, e.derivation.account.dof) == (1, 3)
    assert (
        number(
            e.system.mass_matrix[2][2], dict.fromkeys(e.system.mass_matrix[2][2].free_symbols, 1)
        )
        == 2
    )


def test_the_rate_of_a_name_of_positions_is_that_of_its_coordinates() -> None:
    """A shaft that turns by a Cartesian name: no declared coordinate stands in the energy."""
    e = derived(
        "particles: {a: {mass: 1, position: [x + cos(q), y + sin(q), 0]}}\n"
        "points: {b: [h, 0, 0]}\n"
        "coordinates: [x, y, q]\ndefinitions: {h: 3*q}\nkinetic: {turn: dot(h)^2/2}\n"
    )
    assert e.derivation.account.dof == 3
    state = random_point(e.system.mass_matrix[2][2].free_symbols, seed=3)
    assert abs(number(e.system.mass_matrix[2][2], state) - 10) < mpmath.mpf(10) ** -25


def test_a_position_in_the_kinetic_energy_is_no_inertia() -> None:
    """A coordinate that stands there without its rate moves nothing by itself."""
    problem = refusal(BODY.format(kinetic="{disc: m*cos(q1)}", sections=""))
    assert problem.rule == "dependent-coordinates"
    assert "'x', 'y', 'q1' are not independent" in problem.message
