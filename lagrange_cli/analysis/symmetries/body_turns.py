"""Turns of bodies by quaternions around the axes of space and around their own.

A quaternion q of length 1 changes by ½ e ∘ q where its body turns around a unit vector e in space,
and by ½ q ∘ e where e is along an axis of the body. Of a Lagrangian that does not change, the
second conserves the angular momentum I ω along that axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from lagrange_cli.analysis.sampled_values import Array
from lagrange_cli.mechanics.elements.motion import QuaternionParts
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.proofs.zero_test import vanish

#: Part of a turn that no combination of null vectors may miss.
_SMALL = 1e-7


@dataclass(frozen=True)
class QuaternionTurn:
    """A turn of a body that a quaternion of length 1 turns, by a unit angle.

    Attributes
    ----------
    body
        Its name.
    axis
        0, 1, 2 for x, y, z, or for the axes 1, 2, 3 of the body.
    in_space
        True around an axis of space, ½ e ∘ q; False around one of the body, ½ q ∘ e.
    field
        Displacements of the coordinates.
    """

    body: str
    axis: int
    in_space: bool
    field: tuple[sp.Expr, ...]


def quaternion_turns(equations: Equations) -> Iterator[QuaternionTurn]:
    """Yield the turns of bodies by quaternions around the axes of space, and around their own."""
    coordinates = [c.q for c in equations.system.coordinates]
    for particle in equations.system.particles:
        turns = () if particle.turning is None else particle.turning.turns
        for turn in turns[:1] if len(turns) == 1 else ():
            if not isinstance(turn, QuaternionParts) or not set(turn.parts) <= {*coordinates}:
                continue
            for axis in range(3):
                for in_space in (True, False):
                    moved = dict(zip(turn.parts, _turned(turn.parts, axis, in_space), strict=True))
                    field = tuple(moved.get(q, sp.Integer(0)) for q in coordinates)
                    yield QuaternionTurn(particle.name, axis, in_space, field)


def _turned(parts: Sequence[sp.Expr], axis: int, in_space: bool) -> list[sp.Expr]:
    """Return ½ e ∘ q or ½ q ∘ e of a unit vector e along an axis."""
    scalar, *vector = parts
    j, k = (axis + 1) % 3, (axis + 2) % 3
    sense = 1 if in_space else -1
    moved = [-vector[axis], sp.Integer(0), sp.Integer(0), sp.Integer(0)]
    moved[1 + axis] = scalar
    moved[1 + j], moved[1 + k] = -sense * vector[k], sense * vector[j]
    return [part / 2 for part in moved]


def turn_rows(equations: Equations, columns: Sequence[tuple[int, sp.Expr]], rows: Array) -> Array:
    """Find the combinations of null vectors that turn a quaternion around one axis.

    Single ones turn parts of it in pairs, around an axis of space and one of the body at once.

    Parameters
    ----------
    columns
        The unknowns: the number of a coordinate, or -1, with the factor of its displacement.
    rows
        Null vectors, shape (k, unknowns).

    Returns
    -------
    Turns that they span, shape (m, unknowns).
    """
    turns = list(quaternion_turns(equations)) if len(rows) else []
    if not turns:
        return np.zeros((0, len(columns)))
    wanted = np.zeros((len(turns), len(columns)))
    for turn, row in zip(turns, wanted, strict=True):
        for place, (number, factor) in enumerate(columns):
            if number >= 0 and factor.is_Symbol:
                row[place] = float(turn.field[number].coeff(factor))
    weights, *_ = np.linalg.lstsq(rows.T, wanted.T, rcond=None)
    misses = np.abs(weights.T @ rows - wanted).max(axis=1, initial=0.0)
    # A single null vector is recognized as a rotation in space by itself.
    is_new = (np.abs(weights.T) > _SMALL).sum(axis=1) > [int(turn.in_space) for turn in turns]
    return np.asarray(wanted[(misses <= _SMALL) & is_new])


def spin_momentum(equations: Equations, body: str, axis: int, quantity: sp.Expr) -> sp.Expr:
    """Write the quantity of a turn around an axis of a body as (I ω) along it.

    It is this times the square of the quaternion's length, which is 1; it stays as it is unless
    that is proven.
    """
    (turning,) = (p.turning for p in equations.system.particles if p.name == body)
    assert turning is not None
    row = turning.inertia[3 * axis : 3 * axis + 3]
    momentum = sp.Add(*(e * w for e, w in zip(row, turning.spin, strict=True)))
    parts = (turn.parts for turn in turning.turns if isinstance(turn, QuaternionParts))
    square = sp.Add(*(part**2 for quaternion in parts for part in quaternion))
    return momentum if vanish(quantity - square * momentum) else quantity
