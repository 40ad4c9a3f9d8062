"""Derivatives as difference quotients, each number moved on the scale of its own motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lagrange_cli.simulate.arrays import Array

#: Distance by which a number is moved, as a part of its motion.
_MOVE = 2.0**-26

#: The same at least, as a part of its size.
_LEAST_MOVE = 2.0**-40


def distances(y: Array, motion: Array) -> Array:
    """Choose how far to move each number, so that neither curvature nor rounding has a large part.

    ``motion``: how far each has come, or may come in a step.
    """
    size = np.abs(y)
    least = _MOVE * np.maximum(motion, np.sqrt(motion) * np.sqrt(size))
    least = np.maximum(least, _LEAST_MOVE * size)
    return np.where(least > 0, least, _MOVE)


def quotients(function: Callable[[Array], Array], y: Array, moves: Array) -> Array:
    """Differentiate a function at y, each number moved to where there is a value; NaN elsewhere.

    Returns
    -------
    Derivatives by the number of their column, shape (values, len(y)).
    """
    at, columns = function(y), []
    for k, move in enumerate(moves.tolist()):
        for by in (move, -move):
            there = y.copy()
            there[k] += by
            column = (function(there) - at) / (there[k] - y[k])
            if np.isfinite(column).all():
                break
        columns.append(column)
    return np.array(columns).T
