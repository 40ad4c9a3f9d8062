"""Tensors of inertia: in other axes, about other points, and those that bodies can have."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.robots.quantities import (
    ZERO,
    Matrix,
    Vector,
    added,
    composed,
    is_square,
    scaled,
    transposed,
)
from lagrange_cli.robots.robot import Tensor

#: Excess of a moment over the sum of the others, relative to it, that rounding in files explains.
_ROUNDED = Decimal("1e-6")

#: Entries below this part of the moments are what is left of exact cancellations.
_NOTHING = Decimal("1e-30")


def in_turned_axes(tensor: Tensor, matrix: Matrix) -> Tensor:
    """Return a tensor given in the axes of a frame in those that the frame is turned against."""
    turned = composed(composed(matrix, _rows(tensor)), transposed(matrix))
    if not is_square(matrix):
        least = _NOTHING * max(abs(entry) for entry in turned)
        turned = tuple(ZERO if abs(entry) <= least else entry for entry in turned)
    return _entries(turned)


def _rows(tensor: Tensor) -> Matrix:
    xx, yy, zz, xy, xz, yz = tensor
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


def _entries(rows: Matrix) -> Tensor:
    return rows[0], rows[4], rows[8], rows[1], rows[2], rows[5]


def total_inertia(
    parts: Iterable[tuple[Decimal, Vector, Tensor]],
) -> tuple[Decimal, Vector, Tensor]:
    """Return mass, centre and tensor about that of parts, each about its own centre."""
    parts = tuple(parts)
    mass = sum((part[0] for part in parts), ZERO)
    centre = scaled(
        (
            sum((m * c[0] for m, c, _ in parts), ZERO),
            sum((m * c[1] for m, c, _ in parts), ZERO),
            sum((m * c[2] for m, c, _ in parts), ZERO),
        ),
        1 / mass,
    )
    total = [ZERO] * 6
    for part_mass, place, tensor in parts:
        x, y, z = added(place, scaled(centre, Decimal(-1)))
        shift = (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)
        total = [t + e + part_mass * s for t, e, s in zip(total, tensor, shift, strict=True)]
    xx, yy, zz, xy, xz, yz = total
    return mass, centre, (xx, yy, zz, xy, xz, yz)


def require_possible(tensor: Tensor, what: str, mark: Mark) -> None:
    """Refuse moments that no body has: negative ones, or one above the sum of the others.

    In any axes the eigenvalues of tr(I)/2 − I are at least 0: it is the tensor of Σ m x xᵀ.
    """
    xx, yy, zz, xy, xz, yz = tensor
    half = (xx + yy + zz) / 2
    a, b, c = half - xx, half - yy, half - zz
    allowed = -_ROUNDED * abs(half)
    minors = (
        *(a, b, c),
        *(m / half for m in (a * b - xy * xy, a * c - xz * xz, b * c - yz * yz) if half),
        *(
            (a * b * c - 2 * xy * xz * yz - a * yz**2 - b * xz**2 - c * xy**2) / half**2
            if half
            else ZERO,
        ),
    )
    if half < 0 or any(minor < allowed for minor in minors):
        hint = "moments are not negative, and none is above the sum of the others"
        raise InputError(Problem(f"no body has the inertia of {what}", mark, hint, "inertia"))
