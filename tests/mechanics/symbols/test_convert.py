"""Scene expressions as SymPy expressions: exact, real, and refused with a place otherwise."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.symbols.convert import decimal_literals, to_sympy, total_derivative
from tests.mechanics.mechanics_support import expression, generated

x, y, t = sp.symbols("x y t", real=True)
v = sp.Symbol("dot(x)", real=True)
a = sp.Symbol("ddot(x)", real=True)
m = sp.Symbol("m", positive=True)
NAMES = {"x": x, "y": y, "m": m, "t": t, "E": sp.Symbol("E", real=True)}


def converted(text: str) -> sp.Expr:
    return to_sympy(expression(text), NAMES.get)


def refused(text: str) -> tuple[str, str]:
    """Rule, and the part of the text that is marked."""
    with pytest.raises(InputError) as caught:
        to_sympy(expression(text), NAMES.get)
    (problem,) = caught.value.problems
    assert problem.mark is not None
    start = problem.mark.column - 5
    return problem.rule, text[start : start + problem.mark.length]


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("0.5", sp.Rational(1, 2)),
        ("9.81", sp.Rational(981, 100)),
        ("0.1 + 0.2", sp.Rational(3, 10)),
        ("1e-300", sp.Rational(1, 10**300)),
        ("6.02214076e23", sp.Integer(602214076 * 10**15)),
        ("0.30000000000000000000000000000001", sp.Rational(3 * 10**31 + 1, 10**32)),
        ("-2^2", sp.Integer(-4)),
        ("2^3^2", sp.Integer(512)),
        ("2^-1", sp.Rational(1, 2)),
        ("8/4/2", sp.Integer(1)),
        ("2**0.5", sp.sqrt(2)),
        ("pi/2", sp.pi / 2),
        ("norm(3, 4)", sp.Integer(5)),
        ("norm(-7)", sp.Integer(7)),
        ("atan2(0, -1)", sp.pi),
        ("atan2(1, -1)", 3 * sp.pi / 4),
        ("atan2(-1, -1)", -3 * sp.pi / 4),
        ("min(3, 2, 1.5)", sp.Rational(3, 2)),
        ("max(3, 2)", sp.Integer(3)),
        ("abs(-0.5)", sp.Rational(1, 2)),
        ("sign(-0.5)", sp.Integer(-1)),
        ("0^0", sp.Integer(1)),
    ],
)
def test_constants_are_exact(text: str, exact: sp.Expr) -> None:
    assert converted(text) == exact


@given(st.fractions(max_denominator=10**6), st.integers(0, 12))
@generated
def test_decimals_have_no_rounding(value: Fraction, places: int) -> None:
    digits = f"{abs(value.numerator)}.{value.denominator:0{places}d}"
    assert converted(digits) == sp.Rational(Fraction(digits))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("norm(x, y)", sp.sqrt(x**2 + y**2)),
        ("norm(x, y, m)", sp.sqrt(x**2 + y**2 + m**2)),
        ("atan2(y, x)", sp.atan2(y, x)),
        ("min(x, y, 1)", sp.Min(x, y, 1)),
        ("max(x, y)", sp.Max(x, y)),
        ("-x^2", -(x**2)),
        ("x - y - 1", x - y - 1),
        ("x/y*m", x * m / y),
        ("x/(y*m)", x / (y * m)),
        ("E", sp.Symbol("E", real=True)),
        ("exp(1) - E", sp.E - sp.Symbol("E", real=True)),
    ],
)
def test_functions_and_operators(text: str, expected: sp.Expr) -> None:
    assert converted(text) == expected


@pytest.mark.parametrize(
    "name",
    [
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "asinh",
        "acosh",
        "atanh",
        "exp",
        "log",
        "sqrt",
        "abs",
        "sign",
    ],
)
def test_each_function_is_the_one_of_its_name(name: str) -> None:
    point = sp.Rational(3, 2) if name == "acosh" else sp.Rational(1, 3)
    reference = {"abs": abs, "sign": mpmath.sign}.get(name) or getattr(mpmath, name)
    value = converted(f"{name}(x)").xreplace({x: point}).evalf(30)
    with mpmath.workdps(30):
        expected = reference(mpmath.mpf(int(point.p)) / int(point.q))
        assert mpmath.almosteq(mpmath.mpf(value), expected, rel_eps=mpmath.mpf(10) ** -28)


@pytest.mark.parametrize(
    ("text", "rule", "part"),
    [
        ("2 + 1/(x - x)", "not-real", "x - x"),
        ("(x - x)^(-2)", "not-real", "(x - x)^(-2)"),
        ("1/(sqrt(2)^2 - 2)", "not-real", "sqrt(2)^2 - 2"),
        ("2*zeta", "unknown-name", "zeta"),
        ("1 + dot(x)", "misplaced-rate", "dot(x)"),
        ("ddot(x)", "misplaced-rate", "ddot(x)"),
    ],
)
def test_what_is_wrong_is_marked(text: str, rule: str, part: str) -> None:
    found_rule, found_part = refused(text)
    assert (found_rule, found_part.strip("()")) == (rule, part.strip("()"))


@pytest.mark.parametrize(
    "text",
    [
        "sqrt(-m)",
        "(-m)^0.5",
        "x + log(x - x)",
        "tan(pi/2)",
        "atanh(1)",
        "atan2(0, 0)",
        "sign(sqrt(-m))",
        # Parts that are not real, though the whole might be:
        "sqrt(-m)^2",
        "abs(sqrt(-m))",
        "max(sqrt(-m), 0)",
        "min(1, sqrt(-m - 1))",
        "norm(sqrt(-m), x)",
        "0*sqrt(-m)",
    ],
)
def test_what_is_not_a_real_number_is_refused(text: str) -> None:
    assert refused(text)[0] == "not-real"


@pytest.mark.parametrize(
    "text",
    ["1/0", "sqrt(-1)", "log(0)", "0^(-1)", "2^30000", "9^9^9^9", "x^101", "acos(2)", "1e401"],
)
def test_constants_out_of_bounds_are_refused_with_a_place(text: str) -> None:
    with pytest.raises(InputError) as caught:
        converted(text)
    assert caught.value.problems[0].mark is not None


def test_a_power_too_large_to_compute_is_refused_where_names_stand_for_numbers() -> None:
    numbers = {"b": sp.Integer(10) ** 300, "n": sp.Integer(10) ** 6}
    with pytest.raises(InputError) as caught:
        to_sympy(expression("1 + b^n"), numbers.get)
    assert caught.value.problems[0].rule == "too-large"
    with pytest.raises(InputError):
        to_sympy(expression("b^(-n)"), numbers.get)


def test_rates_are_total_derivatives() -> None:
    def rate(e: sp.Expr) -> sp.Expr:
        return total_derivative(e, t, [(x, v), (v, a)])

    assert to_sympy(expression("dot(t*x^2)"), NAMES.get, rate) == x**2 + 2 * t * x * v
    assert sp.expand(to_sympy(expression("ddot(x^2)"), NAMES.get, rate) - 2 * v**2 - 2 * x * a) == 0
    assert to_sympy(expression("dot(dot(x))"), NAMES.get, rate) == a
    assert to_sympy(expression("dot(m*y)"), NAMES.get, rate) == 0


def test_literals_keep_the_first_writing_of_a_value() -> None:
    written = [expression("0.50*x + 9.81"), expression("9.810 + 0.5 + 2.0 + 3"), expression("1e-3")]
    assert decimal_literals(written) == (
        (Fraction(1, 1000), "1e-3"),
        (Fraction(1, 2), "0.50"),
        (Fraction(981, 100), "9.81"),
    )


def test_a_very_long_sum_is_converted() -> None:
    long = "+".join(["x"] * 4000)
    assert converted(long) == 4000 * x
