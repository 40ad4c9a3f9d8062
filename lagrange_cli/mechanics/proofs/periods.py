"""Proofs that a whole turn of an angle changes nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sympy import pi

from lagrange_cli.mechanics.proofs.zero_test import UndecidableError, vanish

if TYPE_CHECKING:
    from sympy import Expr


def is_periodic(expression: Expr, angle: Expr) -> bool:
    """Tell if a whole turn of an angle is proven to leave an expression as it is."""
    further = expression.xreplace({angle: angle + 2 * pi})
    try:
        return further == expression or vanish(further - expression)
    except UndecidableError:
        return False
