"""Points of manifolds of many equations, which are approached in doubles first."""

from __future__ import annotations

import mpmath
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold


@pytest.mark.parametrize("count", [8, 80])
def test_points_beside_circles_are_moved_onto_them_to_all_digits(count: int) -> None:
    """Of circles about the origin the nearest point lies on the ray through the point."""
    t, xs = sp.Symbol("t"), sp.symbols(f"x:{count}", real=True)
    ys, radii = sp.symbols(f"y:{count}", real=True), range(1, count + 1)
    circles = [(x**2 + y**2, sp.Integer(r) ** 2) for x, y, r in zip(xs, ys, radii, strict=True)]
    with mpmath.workdps(40):
        manifold = Manifold(circles, [], t, [*xs, *ys], [], [], dict.fromkeys([*xs, *ys], mpf(1)))
        point = {t: mpf(0)}
        for x, y, r in zip(xs, ys, radii, strict=True):
            point |= {x: mpf("0.59") * r, y: mpf("0.81") * r}
        placed = manifold.placed(point)
        assert placed is not None
        for x, y, r in zip(xs, ys, radii, strict=True):
            assert abs(mpmath.hypot(placed[x], placed[y]) - r) < mpf(10) ** -30
            assert abs(placed[y] / placed[x] - mpf(81) / 59) < mpf(10) ** -15
