"""Products of parameters that the scene names print by that name within larger products."""

import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.notation.build import display
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import vocabulary

SCENE = """
name: two
parameters: {m1: 1, m2: 2, k: 3, c: 1}
coordinates: [x]
definitions: {mu: m1*m2/(m1 + m2), w: sqrt(k/c)}
kinetic: {T: mu*dot(x)^2/2}
potentials: {V: w^2*x^2/2}
outputs: {share: m1*x/(m1 + m2)}
"""


@pytest.fixture(scope="module")
def equations():
    return api.loads(SCENE).derive().equations


@pytest.mark.parametrize(
    ("powers", "expected"),
    [
        ((1, 1, -1), "μ x"),
        ((2, 1, -1), "m1 μ x"),
        ((2, 3, -2), "m2 μ² x"),
        ((1, 1, -2), "μ x / (m1 + m2)"),
        ((1, 0, -1), "m1 x / (m1 + m2)"),
        ((1, 1, 0), "m1 m2 x"),
        ((-1, 1, -1), "m2 x / (m1 (m1 + m2))"),
    ],
)
def test_a_name_stands_for_its_factors(equations, powers, expected):
    words = vocabulary(equations, abbreviating=True)
    m1, m2, *_ = (p.symbol for p in equations.system.parameters)
    first, second, sums = powers
    product = m1**first * m2**second * (m1 + m2) ** sums * equations.system.coordinates[0].q
    assert UnicodePrinter().inline(display(product, words)) == expected
    assert UnicodePrinter().inline(display(-product, words)) == f"-{expected}"


def test_names_of_roots_and_equations(equations):
    words = vocabulary(equations, abbreviating=True)
    k, c = (p.symbol for p in equations.system.parameters[2:])
    text = UnicodePrinter().inline(display(k * equations.system.coordinates[0].q / c, words))
    assert text == "w² x"
    assert api.loads(SCENE).derive().text().count("μ ẍ + w² x = 0") == 1


def test_without_names_products_are_written_out(equations):
    m1, m2, *_ = (p.symbol for p in equations.system.parameters)
    node = display(sp.Mul(m1, m2, 1 / (m1 + m2)), vocabulary(equations))
    assert UnicodePrinter().inline(node) == "m1 m2 / (m1 + m2)"
