"""Projection of a state onto closures by functions that are interpreted.

The methods are those of emitted code (:mod:`lagrange_cli.emit.c.constraints`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from lagrange_cli.emit.shared_code import NEWTON_STEPS, RESIDUAL_AT_REST, RESIDUAL_ROUNDING
from lagrange_cli.program.interpreter.interpreter import Runnable
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import Projection

#: A function of t and y.
_StateFunction = Callable[[Any, Any], Any]


def projection(
    functions: Mapping[str, Runnable], parameters: Sequence[float], kind: str = ""
) -> Projection | None:
    """Make the function that leads states back to closures; None without closures.

    It changes q as little as possible in the metric of the kinetic energy until only rounding is
    left (Newton's method), then v in the same metric. A state that is too far away becomes NaN.

    Parameters
    ----------
    kind
        ``contact_`` for the projection onto closures and closed contacts; else empty.
    """
    if f"{kind}velocity_change" not in functions:
        return None

    def function(name: str) -> _StateFunction:
        return functions[f"{kind}{name}"].bound(parameters)

    has_positions = f"{kind}position_change" in functions
    names = ("position_error", "position_reach", "position_change") if has_positions else ()
    of_positions = tuple(map(function, names))
    velocity_error, velocity_change = function("velocity_error"), function("velocity_change")

    def project(t: float, y: Array) -> Array:
        y = np.array(y, float)
        n = len(y) // 2
        with np.errstate(all="ignore"):
            if of_positions and not _lead_positions(t, y, *of_positions):
                return np.full(2 * n, np.nan)
            if not _residual(velocity_error(t, y)) <= RESIDUAL_AT_REST:
                y[n:] += velocity_change(t, y)
        return y if np.isfinite(y).all() else np.full(2 * n, np.nan)

    return project


def _lead_positions(
    t: float, y: Array, error: _StateFunction, reach: _StateFunction, change: _StateFunction
) -> bool:
    """Change the positions of a state until closures hold to rounding; False if they do not."""
    last = np.inf
    for number in range(NEWTON_STEPS + 1):
        residuals = error(t, y)
        size = _residual(residuals)
        if size <= RESIDUAL_AT_REST:
            return True
        if number:
            size = _coupled_residual(residuals, reach(t, y))
            slow = size <= RESIDUAL_ROUNDING and 2.0 * size > last
            if size <= RESIDUAL_AT_REST or slow:
                return True
        if number == NEWTON_STEPS or size != size:
            return False
        last = size
        y[: len(y) // 2] += change(t, y)
    return False


def _residual(out: Array) -> float:
    """Return the largest residual in units of the last place of the magnitudes behind them."""
    m = len(out) // 2
    return float((np.abs(out[:m]) / np.spacing(out[m:])).max())


def _coupled_residual(out: Array, squares: Array) -> float:
    """Return the same where changes of all coordinates are found, and rounded, together.

    The magnitude of one residual counts for another as far as a change of the coordinates that
    makes the one does the other; ``squares`` are those of the gradients.
    """
    m = len(out) // 2
    slopes = np.sqrt(squares)
    reach = np.max(out[m:][slopes > 0.0] / slopes[slopes > 0.0], initial=0.0)
    beside = np.where(np.isfinite(reach * slopes), reach * slopes, 0.0)
    return _residual(np.concatenate([out[:m], np.maximum(out[m:], beside)]))
