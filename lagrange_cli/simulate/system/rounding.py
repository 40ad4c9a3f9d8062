"""Rounding errors to order, and the numbers that the code of a model reads behind one address.

Factors perturb a program, values are off by their last place. The code reads in this order: values
of the scene's parameters, weights of the sides of switching surfaces, flags and targets of
contacts, factors of rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from random import Random
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, NativeReal
from lagrange_cli.simulate.model.model import Model


def rounding_factors(number: int, pattern: int, real: NativeReal = DOUBLE) -> Any:
    """Choose factors for a perturbed program, neighbours of 1 among numbers of type ``real``.

    Each ``pattern``, a number, is another choice. Shape (number,).
    """
    epsilon = Fraction(real.epsilon)
    neighbours = real.exact([1 + epsilon, 1 - epsilon / 2])
    return neighbours[Random(pattern).choices((0, 1), k=number)]


def off_by_one_ulp(values: Sequence[float] | Array, pattern: int) -> Array:
    """Move each value by one unit in the last place, up or down by ``pattern``; 0 stays."""
    array = np.asarray(values, dtype=float)
    signs = _signs(array.size, (pattern,)).reshape(array.shape)
    return np.where(array == 0, 0.0, array + signs * np.spacing(np.abs(array)))


@lru_cache(maxsize=16)
def _signs(number: int, patterns: tuple[int, ...]) -> Array:
    """Choose signs for so many numbers in each pattern, 0 in pattern 0, (patterns, 1, number)."""
    signs = [Random(pattern).choices((-1.0, 1.0), k=number) for pattern in patterns]
    return np.asarray(np.sign(patterns)[:, None, None] * np.array(signs)[:, None])


def in_arithmetic(
    doubles: Sequence[float], exact: Sequence[Fraction | None], real: NativeReal, pattern: int = 0
) -> Any:
    """Round exact numbers to a type wider than doubles; doubles stand for those not known.

    In a ``pattern`` other than 0 each is moved by one unit in the last place, up or down: of the
    type, or of doubles where no more is known. 0 stays. Shape (len(doubles),).
    """
    moves = Random(pattern).choices((-1, 1), k=len(doubles)) if pattern else [0] * len(doubles)
    values = []
    for double, known, move in zip(doubles, exact, moves, strict=True):
        value = Fraction(double) if known is None else known
        ulp = Fraction(float(np.spacing(abs(double)))) if value else Fraction(0)
        part = 1 if known is None else Fraction(real.epsilon) / Fraction(DOUBLE.epsilon)
        values.append(value + move * part * ulp)
    return real.exact(values)


def each_off_by_one_ulp(rows: Array, patterns: tuple[int, ...]) -> Array:
    """Move each row as :func:`off_by_one_ulp` moves it alone, in pattern 0 not at all, shapes
    (m, n) → (patterns, m, n)."""
    moves = _signs(rows.shape[1], patterns) * np.spacing(np.abs(rows))
    return np.where(rows == 0, 0.0, rows + moves)


#: Numbers that code reads of each contact: whether it is closed, and what an impulse aims at.
_CONTACT_NUMBERS = 2

#: Numbers that it reads of each switching surface: the weights of both sides.
SURFACE_NUMBERS = 2


def first_flag(model: Model) -> int:
    """Return the place of the first contact's flag among the numbers that code reads."""
    return len(model.parameters) + SURFACE_NUMBERS * len(model.surfaces)


def parameter_values(model: Model, pattern: int = 0, real: NativeReal = DOUBLE) -> Array:
    """Return the parameters, then the numbers of each surface, then those of each contact.

    They are of the type ``real``, exact but for its rounding. In a ``pattern`` other than 0 the
    parameters are off by their rounding error, and the rounding factors of the pattern follow.
    """
    surfaces, contacts = (
        SURFACE_NUMBERS * len(model.surfaces),
        _CONTACT_NUMBERS * len(model.contacts),
    )
    values, behind = model.numbers, [0.0] * (surfaces + contacts)
    if real is DOUBLE:
        numbers = np.array([*values, *behind])
        numbers = off_by_one_ulp(numbers, pattern) if pattern else numbers
    else:
        exact = [*model.exact_numbers, *[None] * len(behind)]
        numbers = in_arithmetic([*values, *behind], exact, real, pattern)
    if not pattern:
        return numbers
    return np.concatenate([numbers, rounding_factors(model.code.factors, pattern, real)])
