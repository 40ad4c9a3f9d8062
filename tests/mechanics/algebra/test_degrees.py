"""Degrees of expressions, of which nothing is multiplied out."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.polynomials import degree_bound

x, y, z = sp.symbols("x y z", real=True)


@pytest.mark.parametrize(
    ("expr", "degree"),
    [
        (sp.Integer(3), 0),
        (z * sp.sin(z), 0),
        (x + z, 1),
        (x * y + x, 2),
        ((x * sp.cos(z) + y) ** 2 / z, 2),
        ((x + y) ** 2 * (x + 1) - z, 3),
        (z**z * x, 1),
        (x**z, None),
        (sp.sqrt(x), None),
        (1 / (1 + x), None),
        (sp.sin(x), None),
        (sp.Abs(x) ** 2 + y, 2),
    ],
)
def test_degree_is_asked_of_the_parts(expr: sp.Expr, degree: int | None) -> None:
    assert degree_bound(expr, frozenset({x, y})) == degree


def test_nested_sums_are_not_expanded() -> None:
    expr = x
    for _ in range(60):
        expr = (expr + y) * sp.cos(z) + expr
    assert degree_bound(expr**2, frozenset({x, y})) == 2
