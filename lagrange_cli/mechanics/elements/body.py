"""A rigid body: Newton's law for its centre of mass, Euler's law for its turning.

Both are taken from the motion of the centre and of the rotation matrix R alone, so that neither the
angular velocity that the equations are derived with nor its kinetic energy is used: ω is the axial
vector of Ṙ Rᵀ, and the torque of inertia is the rate of R I Rᵀ ω,

    τ = R (I ω̇ + ω × I ω)   with ω along the body's axes

(L. D. Landau and E. M. Lifshitz, Mechanics, 3rd ed. 1976, sections 34 to 36). In a displacement δR
it does the work τ·δθ, where δθ is the axial vector of δR Rᵀ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import TypeAlias

import sympy as sp

from lagrange_cli.mechanics.numerics.elementary import Jet

_Rows: TypeAlias = list[list[Decimal]]

_ZERO = Decimal(0)


@dataclass(frozen=True)
class TurningValues:
    """Values of the turning of a body.

    Attributes
    ----------
    rotation
        Rows of R.
    spin, change, torque
        ω, ω̇ and I ω̇ + ω × I ω along the axes of the body.
    """

    rotation: _Rows
    spin: list[Decimal]
    change: list[Decimal]
    torque: list[Decimal]

    def along_axes(self, vector: Sequence[Decimal]) -> list[Decimal]:
        """Return the components along the axes of the body of a vector along those of space."""
        return _times(_transposed(self.rotation), vector)

    def along_space(self, vector: Sequence[Decimal]) -> list[Decimal]:
        """Return the components along the axes of space of a vector along those of the body."""
        return _times(self.rotation, vector)

    def spin_by(self, slopes: Sequence[Decimal]) -> list[Decimal]:
        """Return the axial vector of Rᵀ R', of slopes of R by rows: ∂ω/∂q̇, or of ω without q̇."""
        return _axial(_product(_transposed(self.rotation), _rows(slopes)))


@dataclass(frozen=True)
class BodyElement:
    """A rigid body, as an :class:`MassElement`; its places are those of its centre, then R by rows.

    Attributes
    ----------
    name, centre
        Its name, and the raw symbols of its centre of mass.
    mass, inertia
        Its mass, and the entries of its tensor about the centre by rows.
    rotation
        R by rows.
    """

    name: str
    centre: tuple[sp.Symbol, ...]
    mass: sp.Expr
    rotation: tuple[sp.Expr, ...]
    inertia: tuple[sp.Expr, ...]

    @property
    def places(self) -> tuple[sp.Expr, ...]:
        return (*self.centre, *self.rotation)

    @property
    def constants(self) -> tuple[sp.Expr, ...]:
        return (self.mass, *self.inertia)

    def turning(self, places: Sequence[Jet], moments: Sequence[Decimal]) -> TurningValues:
        """Return its angular velocity, the rate of that, and the torque of its inertia.

        ``places`` are the entries of R by rows, ``moments`` those of the tensor.
        """
        rotation, rate, acceleration = (_rows([x[k] for x in places]) for k in range(3))
        inertia = _rows(moments)
        # Along the body's axes: ω̂ = Rᵀ Ṙ and its rate, whose symmetric part Ṙᵀ Ṙ is left out.
        spin = _axial(_product(_transposed(rotation), rate))
        change = _axial(_product(_transposed(rotation), acceleration))
        torque = _sum(_times(inertia, change), _crossed(spin, _times(inertia, spin)))
        return TurningValues(rotation, spin, change, torque)

    def inertial_forces(self, places: Sequence[Jet], constants: Sequence[Decimal]) -> list[Decimal]:
        mass, *moments = constants
        turning = self.turning(places[3:], moments)
        # Half of τ̂ R is what δR has to be multiplied by: a·b = ½ Σ â_ij b̂_ij.
        work = _product(turning.rotation, _hat(turning.torque))
        return [
            *(mass * x[2] for x in places[:3]),
            *(entry / 2 for row in work for entry in row),
        ]

    def work_of_torque(self, torque: Sequence[Decimal], places: Sequence[Decimal]) -> list[Decimal]:
        """Return the factors of a displacement of R that the work of a torque has.

        The torque is along the axes of space.
        """
        work = _product(_hat(torque), _rows(places[3:]))
        return [entry / 2 for row in work for entry in row]

    def kinetic_terms(self, places: Sequence[Jet], constants: Sequence[Decimal]) -> list[Decimal]:
        mass, *moments = constants
        rotation, rate = (_rows([x[k] for x in places[3:]]) for k in range(2))
        spin = _axial(_product(_transposed(rotation), rate))
        momentum = _times(_rows(moments), spin)
        turning = sum((w * x for w, x in zip(spin, momentum, strict=True)), _ZERO)
        return [*(mass * x[1] ** 2 / 2 for x in places[:3]), turning / 2]


def _rows(entries: Sequence[Decimal]) -> _Rows:
    return [list(entries[3 * i : 3 * i + 3]) for i in range(3)]


def _transposed(matrix: _Rows) -> _Rows:
    return [list(column) for column in zip(*matrix, strict=True)]


def _product(left: _Rows, right: _Rows) -> _Rows:
    columns = _transposed(right)
    return [[_dot(row, column) for column in columns] for row in left]


def _times(matrix: _Rows, vector: Sequence[Decimal]) -> list[Decimal]:
    return [_dot(row, vector) for row in matrix]


def _dot(left: Sequence[Decimal], right: Sequence[Decimal]) -> Decimal:
    return sum((a * b for a, b in zip(left, right, strict=True)), _ZERO)


def _sum(left: Sequence[Decimal], right: Sequence[Decimal]) -> list[Decimal]:
    return [a + b for a, b in zip(left, right, strict=True)]


def _axial(matrix: _Rows) -> list[Decimal]:
    """Return the axial vector of the antisymmetric part."""
    return [(matrix[k][j] - matrix[j][k]) / 2 for j, k in ((1, 2), (2, 0), (0, 1))]


def _hat(vector: Sequence[Decimal]) -> _Rows:
    a, b, c = vector
    return [[_ZERO, -c, b], [c, _ZERO, -a], [-b, a, _ZERO]]


def _crossed(left: Sequence[Decimal], right: Sequence[Decimal]) -> list[Decimal]:
    return _times(_hat(left), right)
