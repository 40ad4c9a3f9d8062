"""Drift of conserved quantities along a motion, relative to the terms that they are sums of."""

from __future__ import annotations

import math

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.samples.rows import RowSequence, windows
from lagrange_cli.simulate.system.functions import RightHandSide


def quantity_values(
    model: Model, functions: RightHandSide, t: Array, states: Array
) -> dict[str, tuple[Array, Array]]:
    """Name of each conserved quantity → its values at samples, and the sizes of its terms.

    Parameters
    ----------
    t, states
        Shapes (m,) and (m, 2n). Values and sizes have shape (m,).
    """
    table, first = functions.outputs(t, states), len(model.outputs)
    values = dict(zip(model.outputs, table.T, strict=False))
    found = {}
    for quantity in model.quantities or ():
        terms = table[:, first : first + quantity.terms]
        found[quantity.name] = values[quantity.name], np.abs(terms).sum(axis=1)
        first += quantity.terms
    return found


def conserved_drifts(
    model: Model, functions: RightHandSide, t: RowSequence, states: RowSequence
) -> dict[str, float | None]:
    """Measure the largest change of each quantity over the largest sum of sizes of its terms.

    None where a number is not finite.
    """
    first: dict[str, float] = {}
    change = {quantity.name: 0.0 for quantity in model.quantities or ()}
    scale = dict(change)
    if not change:
        return {}
    for part in windows(t, states):
        for name, (values, sizes) in quantity_values(model, functions, *part).items():
            start = first.setdefault(name, float(values[0]))
            change[name] = float(np.max([change[name], np.abs(values - start).max()]))
            scale[name] = float(np.max([scale[name], sizes.max()]))
    drifts = {name: change[name] / (scale[name] or 1.0) for name in change}
    return {name: drift if math.isfinite(drift) else None for name, drift in drifts.items()}
