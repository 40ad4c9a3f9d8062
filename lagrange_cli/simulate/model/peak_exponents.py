"""Exponents of sharp functions: at the peak of one a force may act for a short time.

``exp(−((t − c)/w)²)``, ``1/(w² + x²)``, ``tanh(x/w)`` and ``cos(x)^1000`` are smooth, and yet may
do all that they do between two evaluations of a step. Their exponents change slowly beside them:
the peak of an exponent shows on a step's interpolant, however narrow the force is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import sympy

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

#: Systems with more of them are left without.
_MOST_EXPONENTS = 32

#: The least exponent of a power that is sharp at its largest.
_LEAST_SHARP_POWER = 8

#: Functions that go from one value to another within a few units of their argument.
_STEPS = (sympy.tanh, sympy.atan)


def peak_exponents(equations: Equations, parts: Iterable[Expr]) -> tuple[Expr, ...]:
    """Find the exponents of sharp functions in the equations, over q, v, t, parameters.

    A function has a peak, or its step, where its exponent has a peak. Empty where there are
    more than can be watched. ``parts`` are those of :func:`.expressions.calls_and_powers`.
    """
    moving = {equations.t, *(s for c in equations.coordinates for s in (c.q, c.v))}
    every: dict[Expr, None] = {}
    for part in parts:
        for exponent in _exponents(part):
            if not moving.isdisjoint(exponent.free_symbols):
                every[exponent] = None
    return tuple(every) if len(every) <= _MOST_EXPONENTS else ()


def _exponents(e: Expr) -> Iterator[Expr]:
    if isinstance(e, sympy.exp):
        yield e.args[0]
        yield -sympy.Abs(e.args[0])
    elif isinstance(e, _STEPS):
        yield -sympy.Abs(e.args[0])
    elif e.is_Pow and e.exp.is_number and (e.exp.is_negative or e.exp >= _LEAST_SHARP_POWER):
        if isinstance(e.base, sympy.cosh):
            # As good as its logarithm, and never too large.
            yield e.exp * sympy.Abs(e.base.args[0])
        else:
            yield e.exp * sympy.log(sympy.Abs(e.base))
