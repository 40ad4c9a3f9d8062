"""Sums collected the textbook's way: equal to what went in, and never longer."""

from __future__ import annotations

from itertools import permutations

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum
from lagrange_cli.mechanics.algebra.factor import common_factor, factored
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from tests.mechanics.mechanics_support import generated, random_point

a, b, c, x = sp.symbols("a b c x", real=True)
l, k = sp.symbols("l k", positive=True)  # noqa: E741
m1, m2, m3 = sp.symbols("m1 m2 m3", positive=True)
MASSES = frozenset({m1, m2, m3})


def collected(terms: list[sp.Expr]) -> list[sp.Expr]:
    total = TermSum(Splitter(MASSES))
    total.add_all(terms)
    return total.collected()


def difference(first: sp.Expr, second: sp.Expr, size: sp.Expr, seed: int = 1) -> mpf:
    """Largest relative difference at two random points, in 40 digits."""
    symbols = first.free_symbols | second.free_symbols | size.free_symbols
    worst = mpf(0)
    with mpmath.workdps(40):
        for k in (seed, seed + 1):
            point = random_point(symbols, k)
            one, two, scale = evaluate([first, second, size], point)
            worst = max(worst, abs(one - two) / max(abs(scale), 1))
    return worst


FACTORS = st.one_of(
    st.sampled_from(
        [a, x, l, k, 1 / l, x**2, sp.sqrt(k), sp.sqrt(2), 1 / (x**2 + l**2), sp.exp(x)]
    ),
    st.builds(
        lambda f, angle, power: f(angle) ** power,
        st.sampled_from([sp.sin, sp.cos]),
        st.sampled_from([a, b, a + b, a - b, 2 * a, b - a]),
        st.integers(1, 4),
    ),
    st.builds(
        lambda angle, power: sp.tan(angle) ** power, st.sampled_from([a, b]), st.integers(1, 2)
    ),
    st.builds(lambda angle: 1 / sp.cos(angle), st.sampled_from([a, b])),
)
TERMS = st.builds(
    lambda number, mass, factors: number * mass * sp.Mul(*factors),
    st.fractions(-3, 3, max_denominator=4)
    .filter(bool)
    .map(lambda f: sp.Rational(f.numerator, f.denominator)),
    st.sampled_from([sp.Integer(1), m1, m2, m3, m1 * m2, m1**2]),
    st.lists(FACTORS, max_size=3),
)


@pytest.mark.slow
@given(st.lists(TERMS, min_size=1, max_size=12), st.integers(1, 1000))
@generated
def test_a_collected_sum_is_the_sum_and_no_longer(terms: list[sp.Expr], seed: int) -> None:
    found = collected(terms)
    size = sp.Add(*(abs(t) for t in terms))
    assert difference(sp.Add(*found), sp.Add(*terms), size, seed) < mpf(10) ** -30
    assert len(found) <= len(terms)


@pytest.mark.slow
@given(
    st.lists(
        st.tuples(
            TERMS,
            TERMS,
            st.dictionaries(st.sampled_from([m1, m2, sp.Integer(1)]), st.integers(-3, 3)),
        ),
        min_size=1,
        max_size=6,
    ),
    st.integers(1, 1000),
)
@generated
def test_products_are_collected_without_being_formed(
    products: list[tuple[sp.Expr, sp.Expr, dict[sp.Expr, int]]], seed: int
) -> None:
    total = TermSum(Splitter(MASSES))
    expected = []
    for first, second, weights in products:
        total.add_product(first, second, weights)
        # No weights means one, as in ``add``.
        whole = sp.Add(*(mass * count for mass, count in weights.items())) if weights else 1
        expected.append(first * second * whole)
    found = total.collected()
    size = sp.Add(*(abs(p) for first, second, w in products for p in [20 * first * second * 10]))
    assert difference(sp.Add(*found), sp.Add(*expected), size, seed) < mpf(10) ** -30


ANGLES = st.sampled_from([(a, b), (a, 2 * b), (a + b, c), (a, sp.pi / 3 + b), (2 * a, a), (a, -b)])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("scale", [1, -3, sp.Rational(2, 7)])
@given(angles=ANGLES)
@generated
def test_addition_theorems(sign: int, scale: sp.Expr, angles: tuple[sp.Expr, sp.Expr]) -> None:
    u, v = angles
    for terms in (
        [sp.cos(u) * sp.cos(v), sign * sp.sin(u) * sp.sin(v)],
        [sp.sin(u) * sp.cos(v), sign * sp.cos(u) * sp.sin(v)],
    ):
        weighted = [scale * l * m1 * t for t in terms]
        found = collected(weighted)
        assert len(found) == 1
        assert difference(found[0], sp.Add(*weighted), l) < mpf(10) ** -30


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ([sp.sin(a) ** 2, sp.cos(a) ** 2], [sp.Integer(1)]),
        ([m1 * l**2 * sp.sin(a) ** 2, m1 * l**2 * sp.cos(a) ** 2], [m1 * l**2]),
        ([sp.Integer(1), -(sp.cos(a) ** 2)], [sp.sin(a) ** 2]),
        ([-x, x * sp.sin(a) ** 2], [-x * sp.cos(a) ** 2]),
        (
            [
                sp.sin(a) ** 2 * sp.sin(b) ** 2,
                sp.sin(a) ** 2 * sp.cos(b) ** 2,
                sp.cos(a) ** 2,
            ],
            [sp.Integer(1)],
        ),
        ([sp.cos(a) * sp.tan(a)], [sp.sin(a)]),
        ([sp.tan(a) * sp.tan(a) * sp.cos(a)], [sp.sin(a) * sp.tan(a)]),
        ([x, -x], []),
        ([sp.sin(a) * sp.cos(b), -sp.cos(b) * sp.sin(a)], []),
        ([m1 * x, m2 * x], [(m1 + m2) * x]),
        ([-2 * m1 * x, -2 * m2 * x], [-2 * (m1 + m2) * x]),
        (
            [m1 * sp.sin(a) ** 2, m2 * sp.sin(a) ** 2, m1 * sp.cos(a) ** 2, m2 * sp.cos(a) ** 2],
            [m1 + m2],
        ),
    ],
)
def test_identities(terms: list[sp.Expr], expected: list[sp.Expr]) -> None:
    assert [sp.expand(e) for e in collected(terms)] == [sp.expand(e) for e in expected]


def test_only_the_masses_that_pair_up_are_merged() -> None:
    found = collected([m1 * sp.sin(a) ** 2, m1 * sp.cos(a) ** 2, m2 * sp.sin(a) ** 2])
    assert set(found) == {m1, m2 * sp.sin(a) ** 2}


SUMS = st.recursive(
    st.sampled_from([a, b, x, l, sp.Integer(2), sp.sin(a), 1 / (1 + x**2), sp.Integer(0)]),
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] * p[1]),
        st.tuples(inner, st.integers(2, 4)).map(lambda p: p[0] ** p[1]),
    ),
    max_leaves=8,
)


@pytest.mark.slow
@given(SUMS)
@generated
def test_expanded_terms_add_up_and_hold_no_sums(expr: sp.Expr) -> None:
    terms = expand_terms(expr, 10_000)
    if terms is None:
        return
    assert difference(sp.Add(*terms), expr, 1 + sp.Add(*map(abs, terms))) < mpf(10) ** -30
    for term in terms:
        for factor in sp.Mul.make_args(term):
            base, exponent = factor.as_base_exp()
            assert not (base.is_Add and exponent.is_Integer and exponent > 0)


@pytest.mark.parametrize(
    ("expr", "count"),
    [
        ((a + b + c) ** 5, 243),
        ((a + b) * (a + c) * (b + x), 8),
        ((a + b) ** 2 + x, 5),
        (sp.sin(a + b) * (a + b), 2),
        ((a + b) ** -2, 1),
    ],
)
def test_terms_are_counted_before_they_are_made(expr: sp.Expr, count: int) -> None:
    assert expand_terms(expr, count - 1) is None
    made = expand_terms(expr, count)
    assert made is not None
    assert len(made) <= count


@pytest.mark.parametrize("power", [60, 64, 65, 1000, 10**9])
def test_a_power_beyond_the_budget_costs_nothing(power: int) -> None:
    assert expand_terms((a + b) ** power, 1_000_000) is None
    assert expand_terms(sp.Pow(a + b + c, power) * (a + 1) ** power, 1_000_000) is None


@pytest.mark.slow
@given(st.lists(TERMS, min_size=1, max_size=8), st.integers(1, 1000))
@generated
def test_a_factored_sum_is_the_sum(terms: list[sp.Expr], seed: int) -> None:
    size = sp.Add(*(abs(t) for t in terms))
    assert difference(factored(terms), sp.Add(*terms), size, seed) < mpf(10) ** -30


@pytest.mark.slow
@given(
    st.lists(st.sampled_from([a, b, x, l, sp.Integer(1), sp.Integer(2)]), min_size=2, max_size=4),
    st.integers(1, 3),
)
@generated
def test_factored_polynomials_are_the_sum(parts: list[sp.Expr], power: int) -> None:
    expr = sp.expand(sp.Add(*parts) ** power * (x - l))
    terms = list(sp.Add.make_args(expr))
    assert sp.expand(factored(terms) - expr) == 0


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ([l**2, 2 * l * x, x**2], "(l + x)**2"),
        ([m1 * l * x, m1 * l * a], "l*m1*(a + x)"),
        ([-m1 * x, -m2 * x], "-x*(m1 + m2)"),
        ([sp.Integer(2) * x, 4 * a], "2*(2*a + x)"),
        ([x / 2, 5 * a / 2], "(5*a + x)/2"),
    ],
)
def test_textbook_factors(terms: list[sp.Expr], expected: str) -> None:
    assert str(factored(terms)) == expected


def test_powers_that_sympy_does_not_join_are_no_denominators() -> None:
    # u^(π/4 - 2) u^(2 - π/4) stays: each division by one of them would bring in two more.
    power = sp.Pow(a + x, sp.pi / 4 - 2) * sp.Pow(a + x, 2 - sp.pi / 4)
    terms = [-sp.pi * power / 8, sp.pi**2 * power / 32]
    assert sp.simplify(factored(terms) - sp.Add(*terms)) == 0


@pytest.mark.slow
@given(st.lists(TERMS, min_size=1, max_size=6))
@generated
def test_a_common_factor_divides_every_term(terms: list[sp.Expr]) -> None:
    whole = common_factor(terms)
    number, _ = whole.as_coeff_Mul(rational=True)
    assert number > 0
    quotients = [t / whole for t in terms]
    if all(t.as_coeff_Mul(rational=True)[0].is_Integer for t in terms):
        assert all(q.as_coeff_Mul(rational=True)[0].is_Integer for q in quotients)
    for base in {f.as_base_exp()[0] for f in sp.Mul.make_args(whole) if not f.is_number}:
        exponents = [sp.Mul.make_args(q) for q in quotients]
        powers = [
            sum((f.as_base_exp()[1] for f in fs if f.as_base_exp()[0] == base), sp.Integer(0))
            for fs in exponents
        ]
        # Greatest: nothing more can be taken out of all of them with one sign.
        assert not (all(p > 0 for p in powers))
        assert not (all(p < 0 for p in powers))


@pytest.mark.parametrize("number", [1, -1, 3, sp.Rational(1, 2)])
def test_products_are_those_that_sympy_forms(number: sp.Expr) -> None:
    """Products put together without SymPy's search for equal bases are the same objects."""
    x, y, m, n = sp.symbols("x y m n", real=True)
    factors = [y**2, m + n, sp.sin(x - y), x, 1 / m]
    for factor in permutations(factors, 3):
        expected = sp.Mul(number, *factor)
        total = TermSum(Splitter(frozenset({m, n})))
        total.add(expected)
        (found,) = total.collected()
        assert found == expected
        assert found.args == expected.args
