"""Displacements of the coordinates that move all particles as one rigid body.

A field ξ moves a particle at r by Σ ∂r/∂q ξ. If that is a + ω × r, with one a and one ω for all
particles at all states, ξ is a translation, a rotation, or a boost where it grows with time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
import sympy as sp

from lagrange_cli.analysis.sampled_values import Array, SampledValues
from lagrange_cli.analysis.symmetries.body_turns import quaternion_turns
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.phrases import Phrase

#: States at which displacements are compared.
_STATES = 12

#: Relative difference below which displacements are the same.
_SAME = 1e-8

Kind: TypeAlias = Literal["translation", "rotation", "boost", "spin"]

_AXES = "xyz"
_STEMS = {"translation": "P", "rotation": "L", "boost": "boost", "spin": "L"}


@dataclass(frozen=True)
class Displacement:
    """A rigid displacement along or around a coordinate axis, or of one body around its own.

    Attributes
    ----------
    kind
        ``rotation`` is around the axis through the origin, ``spin`` around an axis of the body.
    axis
        0, 1, 2 for x, y, z, or for the axes 1, 2, 3 of the body.
    sense
        1, or -1 against the axis.
    size
        Length of the displacement, or angle of the rotation: 2 of a quaternion's parts.
    body
        Name of the body of a ``spin``, else empty.
    """

    kind: Kind
    axis: int
    sense: int = 1
    size: int = 1
    body: str = ""

    @property
    def rank(self) -> tuple[int, int]:
        """Its place in reports: by kinds, then by axes."""
        return get_args(Kind).index(self.kind), self.axis

    @property
    def name(self) -> str:
        """Usual name of the conserved quantity."""
        if self.kind == "spin":
            return f"L_{self.axis + 1}_{self.body}"
        return f"{_STEMS[self.kind]}_{_AXES[self.axis]}"

    @property
    def described(self) -> Phrase:
        """The displacement in words."""
        if self.kind == "spin":
            parts = {"body": (self.body,), "axis": (str(self.axis + 1),)}
            return Phrase("rotation of {body} around its axis {axis}", **parts)
        axis = (_AXES[self.axis],)
        if self.kind == "rotation":
            return Phrase("rotation around {axis}", axis=axis)
        if self.kind == "translation":
            return Phrase("translation along {axis}", axis=axis)
        return Phrase("boost along {axis}", axis=axis)


def displacement(equations: Equations, field: Sequence[sp.Expr]) -> Displacement | None:
    """Recognize a field as a unit translation, rotation or boost along an axis, else None.

    Or as the turn of a body by a quaternion around one of its own axes.
    """
    return _of_all(equations, field) or _spin(equations, field)


def _spin(equations: Equations, field: Sequence[sp.Expr]) -> Displacement | None:
    """Recognize the turn of a body around one of its own axes."""
    for turn in quaternion_turns(equations):
        pairs = zip(field, turn.field, strict=True)
        if not turn.in_space and all(sp.expand(x - y) == 0 for x, y in pairs):
            return Displacement("spin", turn.axis, body=turn.body)
    return None


def _of_all(equations: Equations, field: Sequence[sp.Expr]) -> Displacement | None:
    """Recognize a displacement of all particles as one rigid body."""
    moving = _material_points(equations)
    if not moving:
        return None
    places = [r for point in moving for r in point]
    shifts = [
        sp.Add(
            *(
                derivative(r, c.q) * x
                for c, x in zip(equations.system.coordinates, field, strict=True)
            )
        )
        for r in places
    ]
    symbols = {s for r in places for s in r.free_symbols}
    if any(
        x != 0 and c.q not in symbols
        for c, x in zip(equations.system.coordinates, field, strict=True)
    ):
        return None  # it turns what is no particle as well
    samples = SampledValues(equations, _STATES, seed=2)
    values = samples.values_at_states([*places, *shifts, equations.system.t])
    number = values.shape[1]
    if not number:
        return None
    shape = len(moving), 3, number
    r, moved = (values[k * len(places) : (k + 1) * len(places)].reshape(shape) for k in (0, 1))
    grows = equations.system.t in {s for x in field for s in x.free_symbols}
    if grows:
        moved = moved / values[-1]
    along, around = _rigid(r, moved)
    if along is None or around is None:
        return None
    if around.any():
        return None if grows or along.any() else _unit("rotation", around)
    return _unit("boost" if grows else "translation", along)


def _material_points(equations: Equations) -> list[tuple[sp.Expr, ...]]:
    """List positions of points fixed in all that has mass."""
    return [point for p in equations.system.particles if p.mass != 0 for point in p.material_points]


def translations_among(equations: Equations, fields: Array) -> Array:
    """Find the combinations of constant fields that move all particles by a unit along an axis.

    Parameters
    ----------
    fields
        Shape (k, n).

    Returns
    -------
    Their weights, shape (m, k), of combinations of two fields or more.
    """
    moving = _material_points(equations)
    none = np.zeros((0, len(fields)))
    if len(fields) < 2 or not moving:
        return none
    slopes = [
        derivative(r, c.q) for point in moving for r in point for c in equations.system.coordinates
    ]
    values = SampledValues(equations, _STATES, seed=4).values_at_states(slopes)
    table = values.reshape(len(moving), 3, len(equations.system.coordinates), -1)
    shifts = np.einsum("kj,pajs->kpsa", fields, table)
    combinations = []
    for axis in range(3):
        wanted = np.broadcast_to(np.eye(3)[axis], shifts.shape[1:]).ravel()
        columns = shifts.reshape(len(fields), -1)
        if not columns.shape[1]:
            return none
        weights, *_ = np.linalg.lstsq(columns.T, wanted, rcond=_SAME)
        misses = np.abs(weights @ columns - wanted).max() > _SAME
        if not misses and (np.abs(weights) > _SAME).sum() > 1:
            combinations.append(weights)
    return np.array(combinations) if combinations else none


def _rigid(r: Array, moved: Array) -> tuple[Array | None, Array | None]:
    """Fit a and ω to displacements a + ω × r; None if they do not fit."""
    x, y, z = (r[:, k].ravel() for k in range(3))
    one, zero = np.ones_like(x), np.zeros_like(x)
    rows = np.concatenate(
        [
            np.stack([one, zero, zero, zero, z, -y], axis=1),
            np.stack([zero, one, zero, -z, zero, x], axis=1),
            np.stack([zero, zero, one, y, -x, zero], axis=1),
        ]
    )
    wanted = np.concatenate([moved[:, k].ravel() for k in range(3)])
    # Least squares give the solution of least norm: in a plane two axes move nothing.
    solution, *_ = np.linalg.lstsq(rows, wanted, rcond=_SAME)
    if np.abs(rows @ solution - wanted).max() > _SAME * max(1.0, np.abs(wanted).max()):
        return None, None
    solution[np.abs(solution) < _SAME] = 0.0
    return solution[:3], solution[3:]


def _unit(kind: Kind, vector: Array) -> Displacement | None:
    """Return the displacement by 1 along an axis, or by 2 around one; None for other vectors."""
    (present,) = np.nonzero(vector)
    sizes = (1, 2) if kind == "rotation" else (1,)
    fitting = [size for size in sizes if np.abs(np.abs(vector[present]) - size).max() <= _SAME]
    if len(present) != 1 or not fitting:
        return None
    axis = int(present[0])
    return Displacement(kind, axis, 1 if vector[axis] > 0 else -1, fitting[0])
