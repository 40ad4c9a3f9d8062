"""Values of inputs that stand in positions, where numbers of a start are computed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.numerics.elementary import evaluating

if TYPE_CHECKING:
    from mpmath import mpf

    from lagrange_cli.files.interpolation import Polynomials
    from lagrange_cli.mechanics.reduction.reduced_scene import Reduced

_Value = Callable[["mpf", int], "mpf"]


def evaluating_inputs(reduced: Reduced) -> AbstractContextManager[None]:
    """Evaluate the inputs with rates of a scene as what they are, in place of stand-ins."""
    functions = {}
    for declared in reduced.scene.inputs:
        if declared.name in reduced.names.rated:
            functions[declared.name] = _value(reduced, declared.name)
    return evaluating(functions)


def _value(reduced: Reduced, name: str) -> _Value:
    declared = next(u for u in reduced.scene.inputs if u.name == name)
    if declared.recording is not None:
        from lagrange_cli.files.interpolation import polynomials

        return _recorded(polynomials(declared.recording))
    assert declared.expression is not None
    t = reduced.names.t
    exact = {reduced.names.parameters[n]: x for n, x in reduced.values.exact.items()}
    expression = reduced.names.convert(declared.expression).xreplace(exact)

    def at(x: mpf, order: int) -> mpf:
        slope = expression
        for _ in range(order):
            slope = derivative(slope, t)
        number = slope.xreplace({t: sp.Float(x, mpmath.mp.dps)}).evalf(mpmath.mp.dps)
        return mpmath.mpf(number)

    return at


def _recorded(pieces: Polynomials) -> _Value:
    def at(x: mpf, order: int) -> mpf:
        k = max(0, int(np.searchsorted(pieces.starts, float(x), side="right")) - 1)
        powers = [mpmath.mpf(float(c)) for c in pieces.coefficients[k]]
        for _ in range(order):
            powers = [n * c for n, c in enumerate(powers)][1:]
        return (
            mpmath.polyval(powers[::-1], x - float(pieces.starts[k])) if powers else mpmath.mpf(0)
        )

    return at
