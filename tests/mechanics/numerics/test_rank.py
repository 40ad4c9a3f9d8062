"""Numerical ranks beside those that hold by construction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.mechanics.numerics.rank import rank


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
