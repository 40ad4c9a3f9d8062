"""Products that recur from particle to particle: each once, with all that hold it."""

from __future__ import annotations

from collections import Counter
from itertools import product

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.mechanics.algebra.identities import shorten_trigonometric
from lagrange_cli.mechanics.algebra.shared_products import MovingComponent, recurring_products

A, B, C = sp.symbols("a b c")

parts = st.lists(st.sampled_from([A, B, C]), max_size=3)
moving = st.builds(
    lambda rows, convective: MovingComponent(list(enumerate(rows)), convective),
    st.lists(parts, min_size=1, max_size=3),
    parts,
)


@pytest.mark.slow
@given(st.lists(moving, max_size=5))
def test_every_product_is_there_as_often_as_when_written_out(components):
    """Σ_k of all pairs of parts of component k, as the definition of JᵀJ and Jᵀγ has it."""
    expected: Counter = Counter()
    for k, component in enumerate(components):
        rows = [(j, p) for j, row in component.jacobian for p in row]
        for (i, a), (j, b) in product(rows, rows):
            if i <= j:
                expected[k, i, j, a * b] += 1
        for (i, a), g in product(rows, component.convective):
            expected[k, i, -1, a * g] += 1
    found: Counter = Counter()
    gathered = recurring_products(components)
    for row, column, a, b, held in gathered:
        for k in range(len(components)):
            if held >> k & 1:
                found[k, row, column, a * b] += 1
    assert found == expected
    assert gathered.number == sum(1 for _ in gathered)


def chain(links):
    """The x components of a chain: component k holds the terms of links 0 to k."""
    terms = [sp.Symbol(f"s{i}") for i in range(links)]
    return [
        MovingComponent([(j, [terms[j]]) for j in range(k + 1)], terms[: k + 1])
        for k in range(links)
    ]


def test_work_of_a_chain_grows_with_the_square():
    assert [recurring_products(chain(n)).number for n in (10, 20, 40)] == [
        n * (n + 1) // 2 + n * n for n in (10, 20, 40)
    ]


def test_components_without_anything_in_common_are_not_compared():
    apart = [MovingComponent([(k, [sp.Symbol(f"s{k}")])], ()) for k in range(500)]
    assert recurring_products(apart).number == 500


names = st.sampled_from(["theta1", "theta2", "theta10", "a", "Z", "phi", "x_1", "lambda", "q"])


@pytest.mark.slow
@given(names, names)
def test_differences_begin_with_a_plus_as_sympy_decides(first, second):
    """cos a cos b + sin a sin b = cos(a − b), written as SymPy would write the argument."""
    x, y = sp.Symbol(first, real=True), sp.Symbol(second, real=True)
    if x == y:
        return
    cosines = ((("cos", x), 1), (("cos", y), 1))
    sines = ((("sin", x), 1), (("sin", y), 1))
    group = {cosines: {sp.Integer(1): 1}, sines: {sp.Integer(1): 1}}
    order = {key: k for k, key in enumerate([("cos", x), ("cos", y), ("sin", x), ("sin", y)])}
    shorten_trigonometric(
        group, lambda trig: tuple(sorted(trig.items(), key=lambda i: order.get(i[0], 9)))
    )
    ((monomial, weights),) = group.items()
    (((name, argument), power),) = monomial
    assert (name, power, weights) == ("cos", 1, {sp.Integer(1): 1})
    assert argument in (x - y, y - x)
    assert not argument.could_extract_minus_sign()
