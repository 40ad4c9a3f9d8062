"""Routines against NumPy and numbers of many digits, and where there is no solution."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.program.lowered.routines.bands import solve_banded, solve_sparse
from lagrange_cli.program.lowered.routines.elimination import (
    solve_columns,
    solve_definite,
    solve_pivoted,
)
from lagrange_cli.program.lowered.routines.motions import (
    ERROR_OF_STEPS,
    NO_VALUE,
    change_values,
)
from lagrange_cli.program.lowered.routines.numbers import EPSILON, SMALLEST, power_of_two
from lagrange_cli.program.lowered.routines.projection import (
    NEWTON_STEPS,
    coupled_residual,
    is_near,
    lead_positions,
)
from lagrange_cli.program.lowered.routines.saddle import equilibrate, solve_saddle
from lagrange_cli.program.solvers.sparse_factorization import couplings, supernodes
from lagrange_cli.program.systems.loops import supernode_tables

generated = settings(max_examples=40, deadline=None)
seeds = st.integers(0, 2**32)
sizes = st.integers(1, 11)


def definite(numbers, n):
    """A positive definite matrix, whose rows have units over six orders of magnitude."""
    root = numbers.standard_normal((n, n))
    units = 10.0 ** numbers.uniform(-3, 3, n)
    return (root @ root.T + np.eye(n)) * units * units[:, None]


def scratch(n):
    return [math.nan] * n


def close(found, matrix, right):
    """The solution has residuals of the rounding of their terms, but for growth."""
    found = np.array(found)
    terms = np.abs(matrix) @ np.abs(found) + np.abs(right)
    assert (np.abs(matrix @ found - right) <= 1e-11 * terms).all()


@generated
@given(sizes, seeds)
def test_definite_systems(n, seed):
    numbers = np.random.default_rng(seed)
    matrix, b = definite(numbers, n), numbers.standard_normal(n)
    upper = np.where(np.triu(np.ones((n, n))), matrix, math.nan)
    a, x = upper.ravel().tolist(), b.tolist()
    assert solve_definite(n, a, x, scratch(n))
    np.testing.assert_allclose(x, np.linalg.solve(matrix, b), rtol=1e-8)


@generated
@given(sizes, seeds)
def test_pivoted_systems(n, seed):
    numbers = np.random.default_rng(seed)
    matrix, b = numbers.standard_normal((n, n)), numbers.standard_normal(n)
    x = b.tolist()
    assert solve_pivoted(n, matrix.ravel().tolist(), x)
    close(x, matrix, b)


def saddle(numbers, n, m):
    """Mass matrix, gradients and the whole, with -l among the unknowns."""
    mass, gradients = definite(numbers, n), numbers.standard_normal((m, n))
    whole = np.block([[mass, gradients.T], [gradients, np.zeros((m, m))]])
    return mass, gradients, whole


def by_rows(mass, gradients, n, m):
    """The numbers of a saddle that are given, NaN for the others."""
    a = np.full((n + m, n + m), math.nan)
    a[:n, :n] = np.where(np.triu(np.ones((n, n))), mass, math.nan)
    a[n:, :n] = gradients
    a[range(n, n + m), range(n, n + m)] = 0.0
    return a.ravel().tolist()


@generated
@given(sizes, st.integers(0, 5), seeds)
def test_saddles(n, m, seed):
    m = min(n, m)
    numbers = np.random.default_rng(seed)
    mass, gradients, whole = saddle(numbers, n, m)
    b, s = numbers.standard_normal(n + m), n + m
    x = b.tolist()
    a = by_rows(mass, gradients, n, m)
    assert solve_saddle(n, m, a, x, scratch(s), scratch(s * s), scratch(s))
    expected = np.linalg.solve(whole, b) * np.repeat([1, -1], [n, m])
    np.testing.assert_allclose(x, expected, rtol=1e-6, atol=1e-9 * abs(expected).max())


def test_rows_without_scales_start_from_the_diagonal():
    """Diagonal entries 4^k become 1/4 by squares of 2^-(k+1)."""
    powers = [3, -5, 0, 8]
    d = [0.0] * 4
    assert equilibrate(4, np.diag([4.0**k for k in powers]).ravel().tolist(), d)
    assert d == [2.0 ** -(k + 1) for k in powers]


def test_a_saddle_without_inertia_is_solved_to_the_rounding_of_its_rows():
    """A mass matrix of three masses of which one is nothing, on two rods (Skeel's refinement)."""
    mass = np.diag([1e-14, 1.0, 1.0])
    gradients = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, 2.0]])
    right = [1e-14, 2.0, 3.0, 0.5, 0.25]
    x = list(right)
    s = 5
    assert solve_saddle(
        3, 2, by_rows(mass, gradients, 3, 2), x, scratch(s), scratch(s * s), scratch(s)
    )
    whole = np.block([[mass, gradients.T], [gradients, np.zeros((2, 2))]])
    with mpmath.workdps(50):
        exact = mpmath.lu_solve(mpmath.matrix(whole.tolist()), mpmath.matrix(right))
    np.testing.assert_allclose(x[:3], [float(e) for e in exact[:3]], atol=2e-16)
    np.testing.assert_allclose(x[3:], [-float(e) for e in exact[3:]], rtol=1e-15)


@generated
@given(sizes, st.integers(0, 6), seeds)
def test_bands(m, w, seed):
    numbers = np.random.default_rng(seed)
    matrix = np.zeros((m, m))
    for i in range(m):
        for j in range(i, min(m, i + w + 1)):
            matrix[i, j] = matrix[j, i] = numbers.uniform(-1, 1)
    matrix += np.diag(np.abs(matrix).sum(axis=1) + 0.1)
    padded = np.pad(matrix, (0, w), constant_values=math.nan)
    a = [padded[i, i + j] for i in range(m) for j in range(w + 1)]
    b = numbers.standard_normal(m)
    x = b.tolist()
    assert solve_banded(m, w, a, x, scratch(m))
    close(x, matrix, b)


@generated
@given(st.integers(3, 20), seeds)
def test_supernodes(count, seed):
    numbers = np.random.default_rng(seed)
    touching = couplings([set(numbers.integers(0, count, 2).tolist()) for _ in range(2 * count)])
    m = len(touching)
    matrix = np.zeros((m, m))
    for k, others in enumerate(touching):
        for j in others:
            if j < k:
                matrix[k, j] = matrix[j, k] = numbers.uniform(-1, 1)
    matrix += np.diag(np.abs(matrix).sum(axis=1) + 0.1)
    factors = supernodes(touching)
    order = list(factors.order)
    a, b = [0.0] * factors.numbers, numbers.uniform(-1, 1, m)
    for i, row in enumerate(order):
        for j, column in enumerate(order[: i + 1]):
            if matrix[row, column]:
                a[factors.place(i, j)] = matrix[row, column]
    x = b[order].tolist()
    tables = supernode_tables(factors)
    assert solve_sparse(m, len(factors.nodes), *tables, a, x, scratch(m), scratch(m))
    close(x, matrix[np.ix_(order, order)], b[order])


@generated
@given(sizes, st.integers(0, 4), st.integers(1, 6), seeds)
def test_columns(n, m, c, seed):
    m, numbers = min(n, m), np.random.default_rng(seed)
    mass, gradients, whole = saddle(numbers, n, m)
    s, b = n + m, numbers.standard_normal((n + m, c))
    x = b.ravel().tolist()
    assert solve_columns(n, s, c, by_rows(mass, gradients, n, m), x, scratch(s))
    expected = np.linalg.solve(whole, b)[:n]
    found = np.array(x).reshape(s, c)[:n]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * abs(expected).max())


def test_digits_of_a_definite_system_are_those_of_its_numbers():
    with mpmath.workdps(60):
        matrix = mpmath.hilbert(6)
        ones = matrix * mpmath.matrix([1] * 6)
        a, x = list(matrix), list(ones)
        assert solve_definite(6, a, x, [mpmath.mpf(0)] * 6)
        assert max(abs(value - 1) for value in x) < mpmath.mpf("1e-50")


@pytest.mark.parametrize("last", [1.0, 1.0 + 2.0**-53, -1.0, math.nan, -math.inf])
def test_pivots_below_rounding_are_singular(last):
    """The second pivot is nothing beside its diagonal, or no number above it."""
    b, d = [1.0, 1.0], [0.0, 0.0]
    assert not solve_definite(2, [1.0, 1.0, math.nan, last], b, d)
    assert not solve_banded(2, 1, [1.0, 1.0, last, math.nan], b, d)
    assert not solve_sparse(
        2, 1, [0, 2, 2, 0, 0, 0], [0, 1], [], [], [1.0, 1.0, 0.0, last], b, d, d
    )


@pytest.mark.parametrize(
    ("mass", "gradients"),
    [
        ([[1.0, 0.0], [0.0, 1.0]], [[0.0, 0.0]]),  # no gradient
        ([[1.0, 0.0], [0.0, 1.0]], [[math.nan, 1.0]]),
        ([[1.0, 0.0], [0.0, 1.0]], [[1.0, 1.0], [2.0, 2.0]]),  # closures that are one
        ([[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0]]),  # neither inertia nor a closure
    ],
)
def test_singular_configurations_have_no_solution(mass, gradients):
    n, m = 2, len(gradients)
    a, s = by_rows(np.array(mass), np.array(gradients), n, m), n + m
    assert not solve_saddle(n, m, a, [1.0] * s, scratch(s), scratch(s * s), scratch(s))


def test_matrices_of_lower_rank_have_no_solution():
    assert not solve_pivoted(2, [1.0, 2.0, 2.0, 4.0], [1.0, 2.0])
    assert not solve_columns(2, 2, 1, [1.0, 1.0, math.nan, 1.0], [1.0, 1.0], [0.0, 0.0])


@generated
@given(st.floats(0, exclude_min=True))
def test_powers_of_two(x):
    power = power_of_two(x)
    expected = x if math.isinf(x) else math.ldexp(1.0, math.frexp(x)[1] - 1)
    assert power == max(expected, SMALLEST)
    assert 2.0**-52 * power == math.ulp(x) or math.isinf(x)


class Circle:
    """The unit circle, for a particle of mass 1."""

    def __init__(self, reach=1.0):
        self.reach = reach

    def position_error(self, y, results):
        results[:] = [y[0] ** 2 + y[1] ** 2 - 1, y[0] ** 2 + y[1] ** 2 + 1]
        return math.isfinite(results[0])

    def position_reach(self, y, results):
        results[0] = self.reach * 4 * (y[0] ** 2 + y[1] ** 2)
        return True

    def position_change(self, y, results):
        square = y[0] ** 2 + y[1] ** 2
        factor = (1 - square) / (2 * square) if square else math.nan
        results[:] = [factor * y[0], factor * y[1]]
        return bool(square)


@pytest.mark.parametrize("y", [[3.0, 4.0], [1e-3, 0.0], [0.6, 0.8], [1e150, 0.0], [0.0, 0.0]])
def test_positions_are_led_to_the_closures(y):
    led = [*y, 0.0, 0.0]
    done = lead_positions(2, 1, Circle(), led, [0.0] * 2, [0.0], [0.0] * 2)
    size = math.hypot(*y)
    assert done == (0 < size < 1e10)
    if done:
        assert abs(math.hypot(*led[:2]) - 1) <= 2.0**-52
        np.testing.assert_allclose(led[:2], [x / size for x in y], atol=1e-15)


class Countdown:
    """Closures that hold after some steps, and not before."""

    def __init__(self, steps):
        self.steps = steps

    def position_error(self, y, results):
        results[:] = [float(y[0] < self.steps), 1.0]
        return True

    def position_reach(self, y, results):
        results[0] = 1.0
        return True

    def position_change(self, y, results):
        results[0] = 1.0
        return True


@pytest.mark.parametrize("more", [0, 1])
def test_what_newtons_method_reaches_by_its_last_step_counts(more):
    closures = Countdown(NEWTON_STEPS + more)
    assert lead_positions(1, 1, closures, [0.0, 0.0], [0.0] * 2, [0.0], [0.0]) == (not more)


def test_a_residual_without_magnitude_has_that_of_the_closures_beside_it():
    """Coordinates of size 8/2, a height of gradient 3 that is zero: 12 is its magnitude."""
    error = [0.0, 40 * EPSILON, 8.0, 0.0]
    assert coupled_residual(2, error, [4.0, 9.0]) == 40 / (2 * 8)
    assert error[2:] == [8.0, 12.0]


def test_a_start_may_differ_by_rounding():
    assert is_near(1, 1.0, [1.0, 0.0], [1.0 + 1e-10, 1e-16])
    assert not is_near(1, 1.0, [1.0, 0.0], [1.0 + 1e-8, 0.0])
    assert not is_near(1, 1.0, [1.0, 0.0], [1.0, 1e-13])
    assert is_near(1, 1e-6, [1.0, 0.0], [1.0, 1e-13])
    assert not is_near(1, 0.0, [1.0, 0.0], [1.0, 1e-16])
    assert not is_near(1, 1.0, [1.0, 0.0], [math.nan, 0.0])


class Relay:
    """A state that stands behind the coordinate, with a number for each of its values."""

    def __init__(self, off, on):
        self.numbers = off, on

    def switches(self, y, results):
        results[0] = self.numbers[int(y[1])]
        return True


@pytest.mark.parametrize("size", [4.0, -4.0])
def test_a_state_has_no_value_where_both_of_its_conditions_hold_by_more_than_errors_of_steps(size):
    """Errors are measured by the largest number of the state, here that of the coordinate."""
    for part, code in ((0.5, 0), (2.0, NO_VALUE)):
        y = [size, 0.0]
        relay = Relay(-1.0, -part * ERROR_OF_STEPS * 4.0)
        assert change_values(2, 1, relay, 0, [1], y, [0.0], [0.0]) == code
        assert y == [size, 1.0]
