"""Motions by the printed equations of a form: read back from JSON, integrated by SciPy."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

_RATE = re.compile(r"(d?dot)\(([a-zA-Z_]\w*)\)")


def read_back(text: str) -> sp.Expr:
    """An expression of a report; ``dot(x)`` is the symbol ``dot_x``."""
    plain = _RATE.sub(r"\1_\2", text).replace("^", "**")
    names = set(re.findall(r"[a-zA-Z_]\w*", plain)) - {
        "sin",
        "cos",
        "sqrt",
        "exp",
        "tan",
        "acos",
        "pi",
    }
    return sp.sympify(plain, locals={name: sp.Symbol(name) for name in names})


def numbers(derivation) -> dict[str, float]:
    """Parameters by name, and the initial state as ``x`` and ``dot_x``."""
    equations = derivation.equations
    values = {p.name: p.value for p in equations.system.parameters}
    for c, q, v in zip(
        equations.system.coordinates,
        equations.system.initial.positions,
        equations.system.initial.velocities,
        strict=True,
    ):
        values |= {c.name: q, f"dot_{c.name}": v}
    return values


def integrated(
    rates: Mapping[str, sp.Expr], values: Mapping[str, float], until: float
) -> dict[str, float]:
    """The state at the end of ``state' = rates(state, t)``."""
    symbols = [sp.Symbol(name) for name in rates]
    known = {sp.Symbol(n): x for n, x in values.items() if n not in rates and x is not None}
    functions = sp.lambdify(
        [sp.Symbol("t"), *symbols], [sp.sympify(e).subs(known) for e in rates.values()]
    )
    start = [float(values[name]) for name in rates]
    run = solve_ivp(
        lambda t, y: np.array(functions(t, *y), dtype=float),
        (0.0, until),
        start,
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    return dict(zip(rates, run.y[:, -1], strict=True))
