"""Sums that hold another sum both term by term and as one of their terms."""

from __future__ import annotations

import random

import pytest
import sympy as sp

from lagrange_cli.program.emitted_functions import program_of
from tests.emit import emit_systems as systems
from tests.parts import changed
from tests.program.interpreted import interpreted

M, G = (systems.parameter(name, value, positive=True) for name, value in (("m", 1.7), ("g", 9.81)))
X, Z = systems.coordinate("x"), systems.coordinate("z")
PLANE = systems.build("plane", [M, G], [X, Z], [("bob", M.symbol, (X.q, 0, Z.q))], 0)

x, z, u, w, m, g = X.q, Z.q, X.v, Z.v, M.symbol, G.symbol
STATE, PARAMETERS = [0.3, 0.7, -1.1, 2.3], [1.7, 9.81]
AT = dict(zip((x, z, u, w, m, g), (*STATE, *PARAMETERS), strict=True))


def difference(expression):
    """How far the program of an expression is from SymPy's value, beside the size of that."""
    programs = {"energy": program_of(changed(PLANE, energy=expression), "energy")}
    functions = interpreted(programs)
    exact = float(expression.subs(AT))
    return abs(functions["energy"](0.0, STATE, PARAMETERS) - exact) / (1 + abs(exact))


@pytest.mark.parametrize(
    "expression",
    [
        m * u**2 + m * w**2 + g * m * z - m * (u**2 + w**2) / 2,
        m * x + m * z - 2 * m * (x + z),
        m * x + m * z - m * (x + z),
        sp.sin(x + z) + x + z - m * (x + z) + m * x + m * z,
    ],
)
def test_both_count(expression):
    assert difference(expression) < 1e-14


@pytest.mark.slow
def test_random_sums():
    draw = random.Random(1)
    factors = [1, -1, 2, sp.Rational(-1, 2), 3]

    def drawn(depth):
        if depth == 0:
            return draw.choice([x, z, u, w, m, g])
        parts = [drawn(depth - 1) for _ in range(draw.randint(2, 3))]
        if draw.random() < 0.6:
            return sp.Add(*(draw.choice(factors) * part for part in parts))
        return sp.Mul(*parts)

    for _ in range(150):
        base = drawn(2)
        rest = [draw.choice(factors) * drawn(draw.randint(1, 3)) for _ in range(3)]
        expression = sp.Add(*rest, base / 2, draw.choice(factors) * sp.expand(base))
        assert difference(expression) < 1e-12, expression
