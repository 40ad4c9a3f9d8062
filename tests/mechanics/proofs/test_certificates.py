"""Proofs that equations have no common real solution, and none where they have one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from lagrange_cli.mechanics.proofs.sum_of_squares import contradicting_equations
from tests.mechanics.mechanics_support import generated

x, y, z = sp.symbols("x y z", real=True)
a, b, c = sp.symbols("a b c", real=True)
p = sp.Symbol("p", positive=True)
R = sp.Rational


@pytest.fixture(autouse=True)
def _precise() -> Iterator[None]:
    with mpmath.workdps(50):
        yield


def rods(*lengths: object, bodies: int = 4) -> list[sp.Expr]:
    """Squared distances of all pairs of bodies in space, less those of the lengths."""
    places = [sp.symbols(f"x{k} y{k} z{k}", real=True) for k in range(bodies)]
    pairs = combinations(places, 2)
    return [
        sp.Add(*((u - v) ** 2 for u, v in zip(one, other, strict=True))) - sp.nsimplify(length) ** 2
        for (one, other), length in zip(pairs, lengths, strict=True)
    ]


IMPOSSIBLE = {
    "concentric circles": [x**2 + z**2 - 1, x**2 + z**2 - 4],
    "a line past a circle": [x**2 + z**2 - 1, x + z - 2],
    "a hyperbola around a circle": [x**2 + z**2 - 1, x * z - 3],
    "a negative square": [x**2 + z**2 + 1],
    "a quartic": [x**4 + z**4 - x * z + 1],
    "a line past a quartic": [x**4 + z**4 - 1, x + z - 2],
    "parallel planes": [x + 2 * y + z - 1, 2 * x + 4 * y + 2 * z - 5],
    "a triangle": rods(1, 1, 3, bodies=3),
    "a tetrahedron that is too long": rods(1, 1, 1, 1, 1, "1.74"),
    "a tetrahedron that is too flat": rods(1, 1, "0.55", 1, "0.55", "0.55"),
    "a sine": [sp.sin(a) - 2],
    "a sum of cosines": [sp.cos(a) + sp.cos(b) - 4 - sp.cos(c)],
    "a linkage": [
        sp.cos(a) + sp.cos(b) - 2 - sp.cos(c) / 2,
        sp.sin(a) + sp.sin(b) - 3 - sp.sin(c) / 2,
    ],
    "an exponential": [sp.exp(x) + y**2 + 2],
    "a catenary": [sp.cosh(x) - R(1, 2) + y**2],
    "a root": [sp.sqrt(x**2 + z**2) + 1],
    "a logarithm": [sp.log(x) - z, x + 1],
    "arccosine": [sp.acos(z) - 4],
    "arcsine": [sp.asin(z) - 2],
    "arctangent": [sp.atan(z) - 2],
    "arcosh": [sp.acosh(z) + 1],
    "tanh": [sp.tanh(z) - 1 - x**2 - R(1, 10)],
    "a reciprocal": [1 / x - y, x * y - 2],
    "a factor that is zero": [x * y - 1, x * z, z**2 - 1],
    "a positive parameter": [x**2 + p + 1],
    "tiny lengths": [x**2 + z**2 - R(1, 10**18), x - R(2, 10**9)],
    "huge lengths": [x**2 + z**2 - 10**32, x - 2 * 10**16],
    "a near miss": [x**2 + z**2 - 1, x - 1 - R(1, 10**5)],
}

POSSIBLE = {
    "a circle and its tangent": [x**2 + z**2 - 1, x - 1],
    "within the tolerance": [x**2 + z**2 - 1, x - 1 - R(1, 10**10)],
    "numbers within the tolerance": [x * y - 1, x * y - 1 - R(1, 10**10)],
    "a hyperbola and a circle": [x**2 + z**2 - 1, x * z - R(1, 3)],
    "a regular tetrahedron": rods(1, 1, 1, 1, 1, 1),
    "a flat tetrahedron": rods(1, 1, 1, 1, 1, sp.sqrt(3)),
    "a taut triangle": rods(1, 3, 2, bodies=3),
    "a linkage": [
        sp.cos(a) + sp.cos(b) - 2 - sp.cos(c),
        sp.sin(a) + sp.sin(b) - sp.sin(c),
    ],
    "an arctangent": [sp.atan(z) - 1],
    "a logarithm": [sp.log(x) + 3],
    "a catenary at its lowest": [sp.cosh(x) - 1],
    "a reciprocal": [1 / x - y, x * y - 1],
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_what_nothing_satisfies_is_proven(name: str) -> None:
    equations = IMPOSSIBLE[name]
    found = contradicting_equations(equations, {})
    assert found
    # What is named suffices, and something feasible beside it changes nothing.
    assert contradicting_equations([equations[k] for k in found], {})
    w = sp.Symbol("w", real=True)
    among = contradicting_equations([w - x**2, *equations], {})
    assert among is None or max(among) > 0


@pytest.mark.parametrize("name", POSSIBLE)
def test_nothing_is_proven_of_what_can_hold(name: str) -> None:
    assert contradicting_equations(POSSIBLE[name], {}) is None


def test_values_of_parameters() -> None:
    r = sp.Symbol("r", real=True)
    equations = [x**2 + z**2 - r**2, x - 2]
    assert contradicting_equations(equations, {r: mpf(1)}) == [0, 1]
    assert contradicting_equations(equations, {r: mpf(3)}) is None
    assert contradicting_equations(equations, {}) is None  # r may be anything


def test_the_bars_of_a_linkage_just_reach() -> None:
    def chain(reach: sp.Expr) -> list[sp.Expr]:
        total = sp.Add(*(sp.cos(s) for s in (a, b, c)))
        return [total - reach, sp.Add(*(sp.sin(s) for s in (a, b, c)))]

    assert contradicting_equations(chain(R(301, 100)), {})
    assert contradicting_equations(chain(R(299, 100)), {}) is None


TERMS = [x, y, z, x * y, x**2, z**2, x**2 * z, sp.sin(x), sp.cos(x), sp.exp(y), sp.sqrt(z**2 + 1)]


@pytest.mark.slow
@generated
@given(
    st.lists(st.lists(st.integers(-3, 3), min_size=11, max_size=11), min_size=1, max_size=4),
    st.lists(st.integers(-8, 8), min_size=3, max_size=3),
)
def test_equations_with_a_solution_are_never_proven_to_have_none(
    rows: list[list[int]], place: list[int]
) -> None:
    """Each is shifted so that it holds at a point."""
    at = {s: R(k, 4) for s, k in zip((x, y, z), place, strict=True)}
    equations = []
    for row in rows:
        total = sp.Add(*(k * term for k, term in zip(row, TERMS, strict=True)))
        value = total.xreplace(at).evalf(60)
        equations.append(total - sp.Rational(str(value)) if value else total)
    assert contradicting_equations(equations, {}) is None


def test_many_equations_are_left_alone() -> None:
    """There is a budget, and beyond it no proof."""
    names = sp.symbols("q0:200", real=True)
    assert contradicting_equations([s**2 + k for k, s in enumerate(names, 1)], {}) is None


def test_an_equation_without_symbols_is_judged_too() -> None:
    assert contradicting_equations([sp.Integer(1)], {}) == [0]
    assert contradicting_equations([sp.Integer(0)], {}) is None
    assert contradicting_equations([], {}) is None
