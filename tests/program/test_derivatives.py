"""Derivatives of value graphs, beside SymPy's and beside differences in 40 digits."""

from __future__ import annotations

import mpmath
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.errors import InternalError
from lagrange_cli.program.graph import derivatives as differentiation
from lagrange_cli.program.graph.derivatives import UNIT, derivatives, replaced
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.graph.schedule import schedule
from lagrange_cli.program.graph.value_graph import ValueGraph
from lagrange_cli.program.printing import Dialect, expression_text

X, Y, Z = SYMBOLS = sp.symbols("x y z", real=True)
INPUTS = [(X, "q0", 3), (Y, "q1", 3), (Z, "p0", 1)]


def numbers(values, wanted, point):
    """Run the scheduled statements over mpmath numbers."""
    assignments, ((_, results),) = schedule(values, [("out", list(wanted))])
    names = {name: mpmath.mpf(x) for (_, name, _), x in zip(INPUTS, point, strict=True)}
    functions = {name: getattr(mpmath, name, None) for name in PROGRAM_FUNCTIONS}
    functions |= {"abs": abs, "sign": mpmath.sign, "min": min, "max": max, "pow": mpmath.power}
    table = {name: name for name in PROGRAM_FUNCTIONS}
    dialect = Dialect(lambda x: f"mpf({x.numerator})/{x.denominator}", table, {})
    space = {"mpf": mpmath.mpf, **functions, **names}
    for name, operand in assignments:
        space[name] = eval(f"({expression_text(operand, dialect)})", space)
    return [eval(f"({expression_text(operand, dialect)})", space) for operand in results]


def gradient(expression, point):
    """Derivatives by x, y and z at a point."""
    values = ValueGraph(INPUTS)
    value = values.convert(expression)
    seeds = {values.convert(symbol)[1]: {k: UNIT} for k, symbol in enumerate(SYMBOLS)}
    (tangent,) = derivatives(values, [value], seeds)
    found = numbers(values, tangent.values(), point) if tangent else []
    return [dict(zip(tangent, found, strict=True)).get(k, mpmath.mpf(0)) for k in range(3)]


def check(expression, point):
    with mpmath.workdps(40):
        function = sp.lambdify(SYMBOLS, expression, modules="mpmath")
        found = gradient(expression, point)
        step = mpmath.mpf(10) ** -13
        for k, value in enumerate(found):
            moved = [
                [mpmath.mpf(x) + sign * (j == k) * step for j, x in enumerate(point)]
                for sign in (1, -1)
            ]
            up, down = (function(*numbers) for numbers in moved)
            exact = (up - down) / (2 * step)
            assert abs(value - exact) < 1e-15 * (1 + abs(exact)), (expression, k)


ONE_ARGUMENT = {
    "sin": X * Y,
    "cos": X - 2 * Y,
    "tan": X / 3,
    "asin": X * Y / 3,
    "acos": X / 2 - Y / 5,
    "atan": X * Y * Z,
    "sinh": X,
    "cosh": X * Y,
    "tanh": X + Y**2,
    "asinh": X * Z,
    "acosh": 2 + X * Y,
    "atanh": X * Y / 3,
    "exp": -X * Y,
    "log": 1 + X**2,
    "sqrt": 1 + X * Y,
}


@pytest.mark.parametrize("name", list(ONE_ARGUMENT))
def test_functions_of_one_argument(name):
    check(Z * getattr(sp, name)(ONE_ARGUMENT[name]), (0.7, 0.4, 1.3))


@pytest.mark.parametrize(
    "expression",
    [
        sp.atan2(X * Y, 1 + Z),
        (1 + X) ** (Y + Z),
        (1 + X * Y) ** sp.Rational(3, 2),
        (1 + X * Y) ** sp.Rational(-1, 3),
        sp.Abs(X - Y) * Z,
        sp.Max(X, Y * Z) ** 2,
        sp.Min(X, Y, Z * X),
        X**3 / (Y * Z**2) - 2 * X * Y / 3,
        (X + Y) ** 5 / (X - Y) ** 3,
        sp.cot(X) + sp.sec(Y) * sp.csc(Z),
    ],
)
def test_other_functions(expression):
    check(expression, (0.7, 0.4, 1.3))


def test_every_function_of_a_program_has_derivatives():
    assert set(PROGRAM_FUNCTIONS) == set(differentiation.SLOPES)


@pytest.mark.parametrize("name", ["acosh", "asin", "acos", "atanh"])
def test_digits_near_a_branch_point(name):
    """1 − x² keeps its digits where x is close to 1."""
    with mpmath.workdps(16):
        x = 1 + 2.0**-40 if name == "acosh" else 1 - 2.0**-40
        (found, *_) = gradient(getattr(sp, name)(X), (x, 0.0, 0.0))
        with mpmath.workdps(40):
            exact = mpmath.diff(getattr(mpmath, name), mpmath.mpf(x), h=mpmath.mpf(10) ** -25)
        assert abs(found - exact) < 1e-14 * abs(exact)


def test_a_jump_has_no_derivative_and_a_kink_the_mean():
    assert gradient(sp.sign(X) + sp.Heaviside(Y), (0.3, 0.2, 0.0)) == [0, 0, 0]
    assert gradient(sp.Abs(X), (0.0, 0.0, 0.0)) == [0, 0, 0]
    assert gradient(sp.Max(2 * X, 4 * Y), (1.0, 0.5, 0.0)) == [1, 2, 0]


def test_constants_have_none():
    values = ValueGraph(INPUTS)
    seeds = {values.convert(X)[1]: {0: UNIT}}
    tangents = derivatives(
        values, [values.convert(e) for e in (Y * Z, sp.Integer(3), X - X)], seeds
    )
    assert tangents == [{}, {}, {}]


def test_an_unknown_function_is_refused():
    values = ValueGraph(INPUTS)
    x = values.convert(X)
    strange = values.call("gamma", x)
    with pytest.raises(InternalError, match="gamma"):
        derivatives(values, [strange], {x[1]: {0: UNIT}})


LEAVES = st.sampled_from([*SYMBOLS, sp.Integer(2), sp.Rational(1, 3), sp.Integer(-1)])
EXPRESSIONS = st.recursive(
    LEAVES,
    lambda parts: st.one_of(
        st.tuples(parts, parts).map(lambda ab: ab[0] + ab[1]),
        st.tuples(parts, parts).map(lambda ab: ab[0] * ab[1]),
        parts.map(sp.sin),
        parts.map(lambda e: sp.sqrt(1 + e**2)),
        parts.map(lambda e: 1 / (2 + sp.cos(e))),
    ),
    max_leaves=12,
)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(EXPRESSIONS)
def test_any_expression(expression):
    check(expression, (0.7, 0.4, 1.3))


@settings(max_examples=40, deadline=None)
@given(EXPRESSIONS, EXPRESSIONS)
def test_values_in_the_place_of_inputs(expression, part):
    values = ValueGraph(INPUTS)
    value, known = values.convert(expression), values.convert(part)
    (found,) = replaced(values, [value], {values.convert(X)[1]: known})
    with mpmath.workdps(30):
        (number,) = numbers(values, [found], (0.7, 0.4, 1.3))
        exact = sp.lambdify(SYMBOLS, expression.xreplace({X: part}), modules="mpmath")
        expected = exact(mpmath.mpf(0.7), mpmath.mpf(0.4), mpmath.mpf(1.3))
        assert abs(number - expected) < 1e-25 * (1 + abs(expected))
