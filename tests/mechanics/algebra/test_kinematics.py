"""Slopes of positions stay short where their own slopes would be multiplied out to many terms."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import Kinematics, derivative

x, y, z, u, v, w, t = sp.symbols("x y z u v w t")
HEIGHT = sp.Symbol("h")


def parts(position: sp.Expr) -> tuple[list[sp.Expr], list[sp.Expr]]:
    kinematics = Kinematics({HEIGHT: position}, [x, y, z], [u, v, w], t)
    slopes = [part for row in kinematics.jacobian(HEIGHT).values() for part in row]
    return slopes, kinematics.convective(HEIGHT)


def convective(position: sp.Expr) -> sp.Expr:
    rates = {x: u, y: v, z: w}
    return sum(sp.diff(position, a, b) * rates[a] * rates[b] for a in rates for b in rates)


def test_a_root_of_a_long_square_is_differentiated_as_it_stands() -> None:
    cosine = sp.sin(x) * (1 + sp.cos(y) + sp.sin(z)) + sp.cos(x) * (
        sp.sin(y) * sp.cos(z) - sp.sin(z)
    )
    cosine += sp.cos(x) * sp.sin(z) * (sp.sin(y) + sp.cos(y)) - sp.sin(x + y + z)
    position = sp.sqrt(9 - cosine**2)
    slopes, bends = parts(position)
    assert len(slopes) == 3
    assert len(bends) < 30
    at = {x: 0.3, y: -0.7, z: 1.1, u: 0.4, v: 0.5, w: -0.2}
    exact = convective(position).subs(at).evalf(30)
    assert abs(sum(part.subs(at).evalf(30) for part in bends) - exact) < 1e-12


def test_short_positions_are_multiplied_out() -> None:
    slopes, bends = parts((1 + sp.cos(x)) * sp.sin(y))
    assert len(slopes) == 3
    assert all(not part.is_Add for part in (*slopes, *bends))


#: Functions of the scene language, and a place within the domain of each.
PLACES = {
    **dict.fromkeys([sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan, sp.exp, sp.log], 0.3),
    **dict.fromkeys([sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.atanh], 0.3),
    sp.acosh: 1.7,
    sp.Abs: -0.3,
}


@pytest.mark.parametrize("function", PLACES, ids=lambda function: function.__name__)
def test_derivatives_of_functions_are_those_of_sympy(function: Any) -> None:
    x = sp.Symbol("x", real=True)
    at = {x: sp.Float(PLACES[function], 30) / 2}
    ours, sympys = derivative(function(2 * x), x), sp.diff(function(2 * x), x)
    assert abs(ours.subs(at).evalf(30) - sympys.subs(at).evalf(30)) < 1e-25
