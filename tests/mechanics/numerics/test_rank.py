"""Numerical ranks beside those that hold by construction."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from lagrange_cli.mechanics.numerics.rank import dependent_columns, rank


@given(
    size=st.tuples(st.integers(1, 6), st.integers(1, 6)), seed=st.integers(0, 999), data=st.data()
)
def test_products_of_orthogonal_matrices_have_the_rank_of_what_is_between(size, seed, data):
    random, least = np.random.default_rng(seed), min(size)
    full = data.draw(st.integers(0, least))
    left, right = (np.linalg.qr(random.normal(size=(n, n)))[0] for n in size)
    values = [10.0 ** random.uniform(-3, 3) for _ in range(full)]
    middle = np.zeros(size)
    middle[range(full), range(full)] = values
    assert rank(left @ middle @ right, 1e-9) == full


@pytest.mark.parametrize(("small", "expected"), [(0.9e-9, 1), (1.1e-9, 2)])
def test_the_tolerance_is_relative_to_the_largest(small, expected):
    assert rank(1e6 * np.diag([1.0, small]), 1e-9) == expected


def test_nothing_has_rank_0():
    assert rank(np.zeros((0, 3)), 1e-9) == rank(np.zeros((2, 0)), 1e-9) == 0
    assert rank(np.zeros((2, 2)), 1e-9) == 0


@pytest.mark.parametrize(
    ("later", "expected"), [(lambda x, y: x + y, 1), (lambda x, y: x + 2 * y, 0)]
)
def test_first_functions_that_hold_variables_do_not_decide_alone_that_some_depend(later, expected):
    x, y = sp.symbols("x y", real=True)
    functions = [sp.sin(k * (x + y)) for k in range(1, 9)] + [later(x, y)]
    null = dependent_columns(functions, [x, y], [{x: mpf("0.3"), y: mpf("0.4")}])
    assert (0 if null is None else len(null)) == expected


def test_many_functions_show_by_the_first_of_them_that_no_variables_depend():
    x, y = sp.symbols("x y", real=True)
    later = [sp.log(-x) + k for k in range(9)]  # which have no values there
    functions = [x, x * y, y, x + y, x - y, y**2, *later]
    assert dependent_columns(functions, [x, y], [{x: mpf("0.3"), y: mpf("0.4")}]) is None
