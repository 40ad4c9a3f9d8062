"""Keys for SymPy's order, plain products, and results that expressions of one shape share.

SymPy itself is the other route: its comparison, its products and what it puts in for symbols.
"""

import random

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import power, product, sympy_order
from lagrange_cli.mechanics.algebra.substitution import Shapes, Substitution, Template
from lagrange_cli.mechanics.symbols.convert import is_plainly_real

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


@pytest.mark.slow
def test_keys_order_as_sympy_compares(pool):
    for a in pool:
        for b in pool:
            first, second = sympy_order(a), sympy_order(b)
            assert (first > second) - (first < second) == a.compare(b), (a, b)


@pytest.mark.slow
def test_powers_and_products_are_those_of_sympy(pool):
    choose = random.Random(7)
    for _ in range(1500):
        factors = choose.choices(pool, k=choose.randint(1, 4))
        factors += choose.choices([(X - Y) ** 2, (A - P) ** -1, sp.Rational(2, 3)], k=2)
        assert product(factors) == sp.Mul(*factors), factors
        exponent = choose.choice([*NUMBERS, A])
        assert power(factors[0], exponent) == sp.Pow(factors[0], exponent)


@pytest.mark.slow
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


def raw(expr: sp.Basic) -> object:
    """An expression with the order of all its arguments, which equality knows too."""
    return (expr.func, *map(raw, expr.args)) if expr.args else expr


def spring(*ends: sp.Symbol) -> sp.Expr:
    return A * (sp.sqrt((ends[0] - ends[1]) ** 2 + (ends[2] - ends[3]) ** 2) - P) ** 2 / 2


def named(names: str) -> list[sp.Symbol]:
    return [sp.Symbol(n, real=True) for n in names]


def test_templates_write_what_sympy_makes_of_other_symbols(pool):
    """Letters of the pool, and the same with letters between them and behind."""
    old = [A, B, P, X, Y, Z]
    new = [*named("ac"), sp.Symbol("q", positive=True), *named("uvw")]
    count = 0
    for expr in pool:
        if sp.Symbol("x") in expr.free_symbols:
            continue
        template = Template(expr, old)
        written = template.over(new)
        assert raw(written) == raw(expr.xreplace(dict(zip(old, new, strict=True)))), expr
        assert raw(template.over(old)) == raw(expr)
        count += bool(written.args)
    assert count > 100


def test_templates_leave_products_as_they_are_written():
    double = sp.Mul(2, X - Y, evaluate=False)
    assert raw(Template(double, [X, Y]).over(named("uv"))) == raw(
        sp.Mul(2, sp.Symbol("u", real=True) - sp.Symbol("v", real=True), evaluate=False)
    )


def test_expressions_of_one_shape_are_told():
    shapes = Shapes()
    names = [sp.Symbol(f"u{k:02}", real=True) for k in range(12)]
    elements = [shapes.element(spring(*names[k : k + 4])) for k in range(9)]
    assert len({element.shape for element in elements}) == 1
    for expr, shape, symbols in elements:
        assert raw(shape.template.over(symbols)) == raw(expr)


def test_another_order_or_kind_of_names_is_another_shape():
    u, v, w = named("uvw")
    positive = sp.Symbol("u", positive=True)
    shapes = Shapes()
    first, alike, *others = (shapes.element(e) for e in (u - v, v - w, v - u, A * u, positive - v))
    assert first.shape is alike.shape
    assert len({element.shape for element in (first, *others)}) == 4


def test_substitution_is_that_of_sympy(pool):
    places = {X: Y - 2 * A, Y: sp.S.Zero, P: sp.Symbol("r", positive=True) ** 2}
    substitution = Substitution(places)
    for expr in pool:
        expected = expr.xreplace(places)
        if not expected.has(sp.nan, sp.zoo):
            assert raw(substitution.put_into(expr)) == raw(expected), expr
    difference = A * X - A * X * P
    assert substitution.put_into(difference) is substitution.put_into(A * X - A * X * P)
    assert substitution.put_into(A * B) == A * B
