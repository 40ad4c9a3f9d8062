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

#: Numbers that code reads of each contact: whether it is closed, and what an impulse aims at.
_CONTACT_NUMBERS = 2

#: Numbers that it reads of each switching surface: the weights of both sides.
SURFACE_NUMBERS = 2


def parameter_values(model: Model, pattern: int = 0, real: NativeReal = DOUBLE) -> Array:
    """Parameters, and behind them what is read of each surface, then of each contact.

    In a ``pattern`` other than 0 the parameters are off by their rounding error, and the
    rounding factors of the pattern, of the type ``real``, follow.
    """
    surfaces, contacts = (
        SURFACE_NUMBERS * len(model.surfaces),
        _CONTACT_NUMBERS * len(model.contacts),
    )
    numbers = np.array([*model.numbers, *[0.0] * (surfaces + contacts)])
    if not pattern:
        return numbers
    factors = rounding_factors(model.code.factors, pattern, real)
    return np.concatenate([off_by_one_ulp(numbers, pattern), factors])
