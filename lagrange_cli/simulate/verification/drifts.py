"""Drift of a motion: from its closure equations, of its conserved quantities, of its energy.

The estimate of the error compares runs with each other. They do not see a barrier narrower than
a step that all of them step over; the energy function may.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.samples import WINDOW, RowSequence, windows
from lagrange_cli.simulate.system.functions import RightHandSide

#: Samples at which the change of residuals with the state is measured.
_SAMPLES = 8

#: Distance by which a state is moved for that, as a part of its scales: the error of a difference
#: quotient and its rounding are then about equal.
_MOVE = 2.0**-17

#: Residuals of many states: t (m,), y (m, 2n) → (m, k).
Constraints = Callable[[Array, Array], Array]


def constraint_drift(
    constraints: Constraints, t: RowSequence, states: RowSequence, scales: Array
) -> float | None:
    """Return the largest residual at any sample, as a part of its own scale.

    The scale of a residual c is Σ |∂c/∂y_i|·scale_i, the largest at a few samples: a drift
    of 1e-12 means that the constraint is off by what moving every coordinate (or velocity)
    by 1e-12 of its scale can do. So neither units nor the way in which a constraint is
    written matter.

    Parameters
    ----------
    constraints
        Residuals at many states.
    t, states
        Samples, shapes (m,) and (m, 2n).
    scales
        Of the numbers of a state, shape (2n,).

    Returns
    -------
    None if there are no constraints, or a residual does not exist.
    """
    parts = [np.abs(constraints(*part)).max(axis=0) for part in windows(t, states)]
    residuals = np.array(parts).max(axis=0)
    if len(residuals) == 0:
        return None
    with np.errstate(all="ignore"):
        ratios = residuals / _residual_scales(constraints, t, states, scales)
    drift = float(np.where(residuals == 0, 0.0, ratios).max())
    return drift if math.isfinite(drift) else None


def _residual_scales(
    constraints: Constraints, t: RowSequence, states: RowSequence, scales: Array
) -> Array:
    """Return Σ |∂c/∂y_i|·scale_i of each residual c, the largest at a few samples."""
    picked = np.unique(np.linspace(0, len(states) - 1, _SAMPLES).round().astype(int)).tolist()
    times, at = np.array([t[k] for k in picked]), np.array([states[k] for k in picked])
    total, block = 0.0, max(1, WINDOW // (2 * at.size))
    for first in range(0, len(scales), block):
        rows = min(block, len(scales) - first)
        moves = _MOVE * scales * np.eye(rows, len(scales), first)[:, None]
        moved = np.concatenate([at + moves, at - moves])
        every = constraints(np.tile(times, len(moved)), moved.reshape(-1, len(scales)))
        above, below = every.reshape(2, rows, len(at), -1)
        total = total + (np.abs(above - below) / (2 * _MOVE)).sum(axis=0)
    return np.asarray(np.max(total, axis=0))


def quantity_values(
    model: Model, functions: RightHandSide, t: Array, states: Array
) -> dict[str, tuple[Array, Array]]:
    """Evaluate each conserved quantity at samples, by name, and the sizes of its terms.

    Parameters
    ----------
    t, states
        Shapes (m,) and (m, 2n). Values and sizes have shape (m,).
    """
    table, first = functions.outputs(t, states), len(model.outputs)
    values = dict(zip(model.outputs, table.T, strict=False))
    quantities = {}
    for quantity in model.quantities or ():
        terms = table[:, first : first + quantity.terms]
        quantities[quantity.name] = values[quantity.name], np.abs(terms).sum(axis=1)
        first += quantity.terms
    return quantities


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


#: Change of the energy that disproves an accuracy, as a multiple of its first-order effect.
_MARGIN = 8.0

#: Rounding error of an energy, relative to its parts.
_ROUNDING = 1e-12

#: Samples of largest change that are looked at before all are.
_SUSPECTS = 5

#: Energies of many states: t (m,), y (m, 2n) → (m, 1).
Energy = Callable[[Array, Array], Array]

#: The energy of one state in more digits than doubles have, at a displacement if one is given:
#: t, y (2n,), displacement (2n,) or None.
ExactEnergy = Callable[[float, Array, Array | None], Any]


def first_contradiction(
    energy: Energy,
    t: RowSequence,
    states: RowSequence,
    accuracy: float,
    scales: Array,
    drift: EnergyDrift,
    in_digits: Callable[[], ExactEnergy | None] = lambda: None,
) -> int | None:
    """Find the number of the first sample whose energy the accuracy cannot explain, or None.

    Parameters
    ----------
    energy
        Conserved function, at many states.
    t, states
        Samples, shapes (m,) and (m, 2n).
    accuracy, scales
        Each component of a state is promised to ``accuracy·scales``, shape (2n,).
    drift
        The drift of this energy at these samples.
    in_digits
        Makes the same function in more digits, None if it is not to be had; called where doubles
        convict.
    """
    # The start is given: nothing but its last place is open there.
    start, moves, exact = np.spacing(np.abs(states[0])), accuracy * scales, cache(in_digits)

    def contradict(times: Array, part: Array, change: Array) -> bool:
        """Tell if the change of the energy at one of some samples is more than errors explain."""
        change = change - _ROUNDING * drift.size
        if not (change > 0).any():
            return False
        every = np.concatenate([states[:1], part])
        around = np.full_like(every, moves)
        around[0] = start
        every_time, begun = np.concatenate([t[:1], times]), (t[0], states[0])
        # What components allow that are moved up alone acquits most.
        for sides in ((1,), (1, -1)):
            allowed = _allowed(_around(energy, every_time, every, around, sides), len(sides))
            explained = _MARGIN * (allowed[0] + allowed[1:])
            convicted = np.flatnonzero((change > 0) & (change > explained))
            if not len(convicted):
                return False
        return any(_contradicts_exactly(exact, times[k], part[k], moves, begun) for k in convicted)

    if not any(contradict(*suspects) for suspects in drift.suspects):
        return None
    begin = 0
    for times, part in windows(t, states):
        change = np.abs(energy(times, part)[:, 0] - drift.first)
        for k in np.flatnonzero(change > _ROUNDING * drift.size).tolist():
            if contradict(times[k : k + 1], part[k : k + 1], change[k : k + 1]):
                return begin + k
        begin += len(part)
    return None


def _contradicts_exactly(
    in_digits: Callable[[], ExactEnergy | None],
    t: float,
    y: Array,
    moves: Array,
    start: tuple[float, Array],
) -> bool:
    """Test with energies in more digits: what doubles lose in a difference of large terms,
    or below the smallest of them, proves nothing. True where there are no more digits.
    """
    energy = in_digits()
    if energy is None:
        return True
    begun, first = start
    change = energy(float(t), y, None) - energy(begun, first, None)
    allowed = _largest_change(energy, float(t), y, moves)
    allowed += _largest_change(energy, begun, first, np.spacing(np.abs(first)))
    return not abs(change) <= _MARGIN * allowed


def _largest_change(energy: ExactEnergy, t: float, y: Array, moves: Array) -> Any:
    """Return :func:`_allowed` in more digits, or the largest change with all components moved at
    once."""
    here = energy(t, y, None)
    each = [max(abs(energy(t, y, sign * row) - here) for sign in (1, -1)) for row in np.diag(moves)]
    signs = ((-1.0) ** (np.arange(len(y)) // 2**k) for k in range(len(y).bit_length() + 1))
    together = (energy(t, y, sign * some * moves) for some in signs for sign in (1, -1))
    return max(sum(each), *(abs(value - here) for value in together))


def _around(energy: Energy, t: Array, y: Array, moves: Array, sides: tuple[int, ...]) -> Array:
    """Evaluate the energy at states (k, 2n), and with each component moved by its error (k, 2n) to
    some sides, as 1 for up and −1 for down, shape (k, 1 + 2n·sides)."""
    width = y.shape[1]
    each = [np.zeros((1, width)), *(side * np.eye(width) for side in sides)]
    moved = y[:, None] + np.concatenate(each) * moves[:, None]
    times = np.repeat(t, moved.shape[1])
    return energy(times, moved.reshape(len(times), -1))[:, 0].reshape(moved.shape[:2])


def _allowed(values: Array, sides: int = 2) -> Array:
    """Bound it from energies of a state and of those moved to some sides, (..., 1 + 2n·sides)."""
    changes = np.abs(values[..., 1:] - values[..., :1])
    each = changes.reshape(*changes.shape[:-1], sides, -1)
    return np.asarray(each.max(axis=-2).sum(axis=-1))


def suspects(energy: Array, kinetic: Array) -> tuple[Array, NDArray[np.intp]]:
    """Find the largest changes of the energies of motions but for rounding, and their samples.

    Parameters
    ----------
    energy, kinetic
        Energies at the samples and their parts that depend on velocities, shapes (members, m).

    Returns
    -------
    Changes (members, SUSPECTS) and the numbers of the samples, the same shape; fewer where there
    are fewer samples.
    """
    size = np.maximum(np.abs(energy).max(axis=1), np.abs(kinetic).max(axis=1))
    change = np.abs(energy - energy[:, :1]) - _ROUNDING * size[:, None]
    least = max(change.shape[1] - _SUSPECTS, 0)
    picked = np.argpartition(change, least, axis=1)[:, least:]
    return np.take_along_axis(change, picked, axis=1), picked


def contradicted(change: Array, start: Array, moved: Array) -> NDArray[np.bool_]:
    """Tell for each of some motions if errors explain less than the changes of its energy.

    Parameters
    ----------
    change
        Changes at some samples, shape (members, k).
    start, moved
        Energies of a state, and with each component moved by its error, up and then down: of the
        start, shape (members, 1 + 4n), and of the samples, shape (members, k, 1 + 4n).
    """
    allowed = _MARGIN * (_allowed(start)[:, None] + _allowed(moved))
    return np.asarray(~((change <= 0) | (change <= allowed)).all(axis=1))


def energy_drifts(energy: Array, kinetic: Array) -> Array:
    """Return the drift of each motion, shapes (members, m) → (members,), as
    :class:`EnergyDrift` has it; NaN if there is none."""
    change, size = np.abs(energy - energy[:, :1]).max(axis=1), np.abs(kinetic).max(axis=1)
    drift = change / np.where(size > 0, size, 1.0)
    return np.where(np.isfinite(drift), drift, np.nan)


class EnergyDrift:
    """The drift of a conserved energy, of samples that are added in parts, in order.

    Attributes
    ----------
    first
        Energy at the start.
    energy
        Energies at the samples of the last part.
    suspects
        Of each part the samples of largest change: times (k,), states (k, 2n), changes (k,).
    """

    first: float
    energy: Array

    def __init__(self) -> None:
        self.suspects: list[tuple[Array, Array, Array]] = []
        self._change = self._largest = self._kinetic = self._lost = 0.0

    def add(self, times: Array, states: Array, energy: Array, kinetic: Array, lost: Array) -> None:
        """Take samples with their energy, its kinetic part, and what impacts took until then."""
        self.energy, conserved = energy, energy - lost
        if not self.suspects:
            self.first = conserved[0]
        change = np.abs(conserved - self.first)
        least = max(len(change) - _SUSPECTS, 0)
        some = np.argpartition(change, least)[least:]
        self.suspects.append((times[some], states[some], change[some]))
        self._change = np.maximum(self._change, change.max())
        self._largest = np.maximum(self._largest, np.abs(conserved).max())
        self._kinetic = np.maximum(self._kinetic, np.abs(kinetic).max())
        self._lost = np.maximum(self._lost, np.abs(lost).max())

    @property
    def size(self) -> float:
        """Largest of the energies and their kinetic parts."""
        return max(float(self._largest), float(self._kinetic))

    @property
    def scale(self) -> float:
        """Largest of the kinetic parts and of what impacts took, which no choice of zero shifts;
        1 if all of them are 0."""
        scale = float(np.maximum(self._kinetic, self._lost))
        return scale if scale > 0 else 1.0

    @property
    def drift(self) -> float | None:
        """Largest change over :attr:`scale`."""
        drift = float(self._change) / self.scale
        return drift if math.isfinite(drift) else None
