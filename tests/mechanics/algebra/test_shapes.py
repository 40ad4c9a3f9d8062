"""Keys for SymPy's order, plain products, and results that expressions of one shape share.

SymPy itself is the other route: its comparison, its products and its derivatives.
"""

import random

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.alpha_equivalence import OrderedShapes, rename_symbols
from lagrange_cli.mechanics.algebra.argument_order import sympy_order
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.plain_products import power, product
from lagrange_cli.mechanics.symbols.plain_signs import is_plainly_real

A, B, X, Y, Z = sp.symbols("a b x y z", real=True)
P = sp.Symbol("p", positive=True)
NUMBERS = [sp.Integer(3), sp.Rational(7, 3), -sp.S.One, sp.S.Half, sp.pi, sp.sqrt(2), sp.S.Zero]
BUDGET = 20


@pytest.fixture(scope="module")
def pool() -> list[sp.Expr]:
    """Expressions of growing size, each made of earlier ones."""
    choose = random.Random(5)
    functions = [sp.sin, sp.cos, sp.exp, sp.Abs, sp.atan, sp.sign, sp.sqrt, sp.Function("f")]
    found = [A, B, X, Y, Z, P, sp.Symbol("x"), *NUMBERS]
    while len(found) < 250:
        a, b = choose.choice(found), choose.choice(found)
        exponent = choose.choice([2, 3, -1, sp.S.Half, -sp.S.Half, b])
        made = choose.choice([a + b, a - b, a * b, a**exponent, choose.choice(functions)(a)])
        if made.count_ops() < BUDGET and not made.has(sp.zoo, sp.nan, sp.oo, -sp.oo, sp.I):
            found.append(made)
    return found


def test_keys_order_as_sympy_compares(pool):
    for a in pool:
        for b in pool:
            first, second = sympy_order(a), sympy_order(b)
            assert (first > second) - (first < second) == a.compare(b), (a, b)


def test_powers_and_products_are_those_of_sympy(pool):
    choose = random.Random(7)
    for _ in range(1500):
        factors = choose.choices(pool, k=choose.randint(1, 4))
        factors += choose.choices([(X - Y) ** 2, (A - P) ** -1, sp.Rational(2, 3)], k=2)
        assert product(factors) == sp.Mul(*factors), factors
        exponent = choose.choice([*NUMBERS, A])
        assert power(factors[0], exponent) == sp.Pow(factors[0], exponent)


def test_what_is_plainly_real_is_real(pool):
    choose = random.Random(9)
    seen = 0
    for expr in pool:
        real, nonnegative = is_plainly_real(expr), is_plainly_real(expr, nonnegative=True)
        if not (real or nonnegative):
            continue
        seen += real and not expr.is_number
        for _ in range(5):
            values = {s: sp.Float(choose.uniform(-2, 2), 30) for s in expr.free_symbols}
            values = {s: abs(x) if s.is_positive else x for s, x in values.items()}
            value = sp.N(expr.xreplace(values), 20)
            assert not real or abs(sp.im(value)) < 1e-15, expr
            assert not nonnegative or sp.re(value) > -1e-15, expr
    assert seen > 20
    assert is_plainly_real(sp.sqrt((X - Y) ** 2 + P) - A)
    assert not is_plainly_real(sp.sqrt(X - Y))


def slopes(expr: sp.Expr) -> list[sp.Expr]:
    return [derivative(expr, s) for s in sorted(expr.free_symbols - {A}, key=str)]


def spring(*ends: sp.Symbol) -> sp.Expr:
    return A * (sp.sqrt((ends[0] - ends[1]) ** 2 + (ends[2] - ends[3]) ** 2) - P) ** 2 / 2


def test_a_shape_is_worked_out_once_and_carried_over():
    counted = []

    def work_out(expr: sp.Expr) -> list[sp.Expr]:
        counted.append(expr)
        return slopes(expr)

    shapes = OrderedShapes(lambda s: None if s in (A, P) else "place", work_out)
    names = [sp.Symbol(f"u{k:02}", real=True) for k in range(12)]
    for k in range(9):
        expr = spring(*names[k : k + 4])
        result, exchanged = shapes.of(expr)
        found = {rename_symbols(e, exchanged) for e in result}
        assert found == {derivative(expr, s) for s in [*names[k : k + 4], P]}
    assert len(counted) == 1


def test_another_order_or_kind_of_names_is_another_shape():
    u, v, w = (sp.Symbol(n, real=True) for n in "uvw")
    counted = []
    shapes = OrderedShapes(lambda s: s.name in "uvw" or None, counted.append)
    for expr in (u - v, v - w, v - u, A * u, B * u, A * v, sp.Symbol("u", positive=True) - v):
        shapes.of(expr)
    # v − w is like u − v; A·v like A·u; the others differ in a sign, a parameter or an assumption.
    assert counted == [u - v, v - u, A * u, B * u, sp.Symbol("u", positive=True) - v]
