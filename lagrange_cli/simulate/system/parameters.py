"""The numbers that the code of a model reads behind one address, in their order.

Values of the scene's parameters come first, then weights of the sides of switching surfaces, then
flags and targets of contacts, then factors of rounding.
"""

from __future__ import annotations

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, NativeReal
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.rounding import in_arithmetic, off_by_one_ulp, rounding_factors

#: Numbers that code reads of each contact: whether it is closed, and what an impulse aims at.
_CONTACT_NUMBERS = 2

#: Numbers that it reads of each switching surface: the weights of both sides.
SURFACE_NUMBERS = 2


def parameter_values(model: Model, pattern: int = 0, real: NativeReal = DOUBLE) -> Array:
    """Parameters, and behind them what is read of each surface, then of each contact.

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
