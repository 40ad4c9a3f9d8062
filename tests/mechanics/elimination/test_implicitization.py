"""Names between which relations stay, without the coordinates that only tied them together."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli.mechanics.elimination.implicitization import ImplicitEquation, ImplicitSystem

X, Y, U, W = sp.symbols("x y u w", real=True)


def related(*expressions: sp.Expr) -> ImplicitSystem:
    relations = [ImplicitEquation("rod", e, f"{e} = 0", stated=True) for e in expressions]
    return ImplicitSystem(relations, [X, Y, U, W], [])


@pytest.mark.parametrize("other", [U, Y])
def test_a_length_known_by_its_square_stays_where_another_name_needs_its_sign(
    other: sp.Symbol,
) -> None:
    """u² = x² + 1 has two solutions: w = x - u tells them apart, w = x - y does not."""
    system = related(X - W - other, U**2 - X**2 - 1)
    assert system.drop_length(W, needed=False)
    assert system.given == {W: X - other}
    assert system.drop_length(U, needed=False) == (other != U)
    assert bool(system.relations) == (other == U)
