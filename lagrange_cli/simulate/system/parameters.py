"""The numbers that the code of a model reads behind one address, in their order.

Values of the scene's parameters come first, then weights of the sides of switching surfaces, then
flags and targets of contacts, then factors of rounding.
"""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, NativeReal
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.rounding import off_by_one_ulp, rounding_factors

__all__ = ["CONTACT_NUMBERS", "SIDES", "given", "off"]

#: Numbers that code reads of each contact: whether it is closed, and what an impulse aims at.
CONTACT_NUMBERS = 2

#: Numbers that it reads of each switching surface: the weights of both sides.
SIDES = 2


def given(model: Model) -> Array:
    """Parameters, and behind them what is read of each surface, then of each contact."""
    values = [0.0 if p.value is None else p.value for p in model.parameters]
    surfaces, contacts = SIDES * len(model.surfaces), CONTACT_NUMBERS * len(model.contacts)
    return np.array([*values, *[0.0] * (surfaces + contacts)])


def off(model: Model, pattern: int, real: NativeReal = DOUBLE) -> Array:
    """Parameters off by their rounding error, then the factors of a pattern."""
    moved = off_by_one_ulp(given(model), pattern)
    return np.concatenate([moved, rounding_factors(model.code.factors, pattern, real)])
