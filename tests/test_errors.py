"""Errors are the same after they went to another process."""

from __future__ import annotations

import pickle

import pytest

from lagrange_cli.errors import AccuracyError, InputError, LagrangeError, Mark, Problem
from lagrange_cli.mechanics.elimination.branches import NoRealSolutionError

PROBLEMS = (
    Problem("one", Mark("scene.yaml", 3, 5, "x: 1", 2), "a way out", "unknown-name"),
    Problem("two", severity="warning"),
)


@pytest.mark.parametrize(
    "error",
    [InputError(*PROBLEMS), AccuracyError(PROBLEMS[1]), NoRealSolutionError(PROBLEMS[0], (2, 7))],
)
def test_an_error_is_raised_elsewhere_with_all_that_it_says(error: LagrangeError) -> None:
    found = pickle.loads(pickle.dumps(error))
    assert type(found) is type(error)
    assert str(found) == str(error)
    assert vars(found) == vars(error)
    assert found.problems == error.problems
