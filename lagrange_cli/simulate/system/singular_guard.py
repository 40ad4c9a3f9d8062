"""Right-hand sides that do not exist beyond singular configurations that a motion cannot pass.

See :mod:`lagrange_cli.simulate.native.sources` for why, and for the compiled form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.right_hand_side import (
    Expressions,
    InputPieces,
    Projection,
    Rhs,
    Shift,
    StructuredRhs,
    structured,
)
from lagrange_cli.simulate.model.model import ChartSingularity, Model
from lagrange_cli.simulate.system.tracing import functions_of

#: Number of a singular configuration whose factor keeps its sign while rates of lost coordinates
#: are not zero, beside that sign.
WHILE_MOVING = 1.0

#: The same if the factor keeps its sign at all times.
ALWAYS = 2.0


def singular_factors(model: Model) -> Callable[[float, Array], Array]:
    """Make the function of t and [q, v] whose numbers vanish at singular configurations."""
    return functions_of(model.code.functions)["singular"].bound(model.numbers)


def positive_values(model: Model) -> Callable[[float, Array], Array]:
    """Make the function of t and [q, v] whose numbers are positive where the equations hold."""
    if not model.borders:
        return lambda t, y: np.empty(0)
    return functions_of(model.code.functions)["positive"].bound(model.numbers)


def _passable(model: Model) -> list[int]:
    """List the numbers of the singular configurations at which coordinates do not end."""
    return [k for k, singularity in enumerate(model.singular) if not singularity.ends]


def lost_rates(model: Model, singularity: ChartSingularity) -> list[int]:
    """Return the numbers, in a state, of the rates that move nothing at a singularity."""
    return [len(model.coordinates) + model.coordinates.index(name) for name in singularity.lost]


def guard_signs(model: Model, t: float, y: Array, *, barred: bool = True) -> Array | None:
    """Find the sides of singular configurations on which a motion stays; None without any.

    What is declared positive stays positive; singular configurations count if they are ``barred``.

    The momentum of a coordinate that is lost at one is its rate times an inertia that
    vanishes with the square of the factor. While it is not zero, the factor is not zero either:
    the motion comes close and turns round, and the coordinate changes within no time. With a rate
    that is exactly zero, as a symmetry keeps it, the motion goes through and the factor changes
    its sign. A rate that is not zero at the start may still underflow on the way.

    Returns
    -------
    A number for each one at which coordinates do not end: 0 if the motion begins there; then one
    for each of what is positive.
    """
    numbers, above = _passable(model), [ALWAYS] * len(model.borders)
    if not (above or (numbers and barred)):
        return None
    if not (numbers and barred):
        return np.array([*(0.0 for _ in numbers), *above])
    factors = singular_factors(model)(t, y)
    keeps = [
        ALWAYS if y[lost_rates(model, model.singular[k])].any() else WHILE_MOVING for k in numbers
    ]
    sides = [np.sign(factors[k]) * keep for k, keep in zip(numbers, keeps, strict=True)]
    return np.array([*sides, *above])


@dataclass(frozen=True)
class _GuardedRhs(StructuredRhs):
    """A right-hand side that is NaN beyond some singular configurations.

    Attributes
    ----------
    rhs
        The right-hand side on both sides of them.
    barred
        Tells whether a state is beyond.
    project, shift, pieces
        Those of ``rhs``.
    """

    rhs: StructuredRhs
    barred: Callable[[float, Array], bool]
    project: Projection | None
    shift: Shift | None
    pieces: InputPieces | None

    @classmethod
    def over(cls, rhs: StructuredRhs, barred: Callable[[float, Array], bool]) -> _GuardedRhs:
        """Bar states of a right-hand side, whose structure stays."""
        return cls(rhs, barred, rhs.project, rhs.shift, rhs.pieces)

    @property
    def expressions(self) -> Expressions | None:
        return self.rhs.expressions

    def in_piece(self, piece: int) -> Rhs:
        return self.over(structured(self.rhs.in_piece(piece)), self.barred)

    def __call__(self, t: float, y: Array) -> Array:
        return np.full(len(y), np.nan) if self.barred(t, y) else self.rhs(t, y)


def guarded_rhs(model: Model, guards: Array, rhs: StructuredRhs) -> StructuredRhs:
    """Make an interpreted right-hand side NaN on the sides that :func:`guard_signs` bars."""
    numbers, above = _passable(model), positive_values(model)
    factors = singular_factors(model) if numbers else None
    rates = [lost_rates(model, model.singular[k]) for k in numbers]
    rates += [[] for _ in model.borders]

    def barred(t: float, y: Array) -> bool:
        vanishing = np.empty(0) if factors is None else factors(t, y)[numbers]
        beyond = guards * np.concatenate([vanishing, above(t, y)]) < 0
        return any(
            abs(side) > WHILE_MOVING or bool(y[lost_rates].any())
            for side, lost_rates, there in zip(guards, rates, beyond, strict=True)
            if there
        )

    return _GuardedRhs.over(rhs, barred)
