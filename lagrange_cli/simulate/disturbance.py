"""Rounding errors to order: factors for a disturbed program, values off by their last place."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import numpy as np

from lagrange_cli.simulate.integrators.base import Array

__all__ = ["off_by_one_ulp", "rounding_factors"]

UP, DOWN = 1 + 2.0**-52, 1 - 2.0**-53


def rounding_factors(number: int, pattern: int) -> list[float]:
    """Factors for a disturbed program; each ``pattern``, a number, is another choice."""
    return Random(pattern).choices((UP, DOWN), k=number)


def off_by_one_ulp(values: Sequence[float] | Array, pattern: int) -> Array:
    """Each value moved by one unit in the last place, up or down by ``pattern``; 0 stays."""
    given = np.asarray(values, dtype=float)
    signs = np.reshape(Random(pattern).choices((-1.0, 1.0), k=given.size), given.shape)
    return np.where(given == 0, 0.0, given + signs * np.spacing(np.abs(given)))
