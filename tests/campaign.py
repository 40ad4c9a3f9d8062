"""Slices of campaigns: what the suite runs of many cases; ``--campaigns`` runs the others too.

A campaign repeats one mechanism on many cases. Its slice is the same in every run: the test chooses
cases that differ in structure, and a seed draws others.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Collection, Sequence
from typing import Any

import pytest


def slice_of(
    cases: Sequence[Any], number: int, always: Callable[[Any], bool] = lambda case: False
) -> list[Any]:
    """Return cases as parameters of a test, those beside the slice marked as a campaign.

    Parameters
    ----------
    cases
        All cases; a tuple is one value for each argument.
    number
        Number of cases that a seed draws.
    always
        Tells which cases belong to the slice beside those that are drawn.
    """
    others = [case for case in cases if not always(case)]
    drawn = random.Random(len(cases)).sample(others, min(number, len(others)))
    return _parameters(cases, [case for case in cases if always(case) or case in drawn])


def pairs_of(*factors: Sequence[Any]) -> list[Any]:
    """Return combinations as parameters; each pair of values of two factors is in the slice.

    Rows of the slice are chosen one by one, each the first of those that hold most pairs that no
    earlier row holds.
    """
    product = list(itertools.product(*factors))
    missing = {pair for row in product for pair in _pairs(row)}
    chosen = []
    while missing:
        best = max(product, key=lambda row: len(_pairs(row) & missing))
        missing -= _pairs(best)
        chosen.append(best)
    return _parameters(product, chosen)


def values_of(*factors: Sequence[Any]) -> list[Any]:
    """Return combinations as parameters; each value of each factor is in the slice."""
    number = max(map(len, factors))
    rows = [tuple(values[row % len(values)] for values in factors) for row in range(number)]
    return _parameters(list(itertools.product(*factors)), rows)


def _pairs(row: tuple[Any, ...]) -> set[Any]:
    return set(itertools.combinations(enumerate(row), 2))


def _parameters(cases: Sequence[Any], chosen: Collection[Any]) -> list[Any]:
    return [
        pytest.param(
            *(case if isinstance(case, tuple) else (case,)),
            marks=() if case in chosen else pytest.mark.campaign,
        )
        for case in cases
    ]
