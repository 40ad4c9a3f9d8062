"""Rounding errors to order: factors for a perturbed program, values off by their last place."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, NativeReal


def rounding_factors(number: int, pattern: int, real: NativeReal = DOUBLE) -> Any:
    """Choose factors for a perturbed program, neighbours of 1 among numbers of type ``real``.

    Each ``pattern``, a number, is another choice. Shape (number,).
    """
    one = real.dtype(1)
    neighbours = one + np.finfo(real.dtype).eps, one - np.finfo(real.dtype).epsneg
    return np.array(Random(pattern).choices(neighbours, k=number), dtype=real.dtype)


def off_by_one_ulp(values: Sequence[float] | Array, pattern: int) -> Array:
    """Move each value by one unit in the last place, up or down by ``pattern``; 0 stays."""
    array = np.asarray(values, dtype=float)
    signs = np.reshape(Random(pattern).choices((-1.0, 1.0), k=array.size), array.shape)
    return np.where(array == 0, 0.0, array + signs * np.spacing(np.abs(array)))


def each_off_by_one_ulp(rows: Array, pattern: int) -> Array:
    """Move each row as :func:`off_by_one_ulp` moves it alone, shape (m, n)."""
    signs = off_by_one_ulp(np.ones(rows.shape[1]), pattern) - 1
    return np.where(rows == 0, 0.0, rows + np.copysign(np.spacing(np.abs(rows)), signs))
