"""Types and numbers that routines share."""

from __future__ import annotations

import sys
from collections.abc import MutableSequence, Sequence
from math import sqrt
from typing import TypeAlias

#: Numbers, which a routine may store.
Array: TypeAlias = MutableSequence[float]

#: A table of indices.
Integers: TypeAlias = Sequence[int]

#: Half the distance from 1 to the next number.
EPSILON = 2.0**-53

#: The smallest number that is held with all its digits.
SMALLEST = 2.0**-1022

#: The largest number.
LARGEST = sys.float_info.max


def power_of_two(x: float) -> float:
    """Return the largest power of two that is not above x, or the smallest normal number."""
    power = 1.0
    while power > x and power > SMALLEST:
        power *= 0.5
    while power < 0.5 * x:
        power *= 2.0
    if 2.0 * power <= x:
        power *= 2.0
    return power


def scale_of(x: float) -> float:
    """Return the power of two that brings a positive number to between 1/2 and 1."""
    return 0.5 / power_of_two(x)


def root_scale_of(x: float) -> float:
    """Return the power of two whose square brings a positive number to between 1/4 and 1."""
    return scale_of(sqrt(x))
