"""Linear systems modulo primes, put back into their equations."""

from __future__ import annotations

import random

import pytest

from lagrange_cli.mechanics.proofs.finite_field import (
    SAFE_PRIMES,
    NoValueError,
    solved_linear_system,
)


@pytest.mark.parametrize("p", [7, SAFE_PRIMES[0]])
def test_solutions_solve(p):
    """Among small numbers modulo 7 some pivots vanish, so that rows are exchanged."""
    draw = random.Random(p)
    solved = 0
    for _ in range(100):
        rows = [[draw.randrange(p) for _ in range(5)] for _ in range(4)]
        try:
            x = solved_linear_system(rows, p)
        except NoValueError:
            continue
        solved += 1
        for row in rows:
            assert (sum(a * b for a, b in zip(row, x, strict=False)) - row[-1]) % p == 0
    assert solved > 50


def test_a_singular_system():
    with pytest.raises(NoValueError):
        solved_linear_system([[1, 2, 1], [2, 4, 1]], SAFE_PRIMES[0])
