"""The expression grammar against Python's own, and at its limits."""

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.scene import parse_equation, parse_expression
from lagrange_cli.scene.language.expression import Add, Call, Mul, Name, Neg, Number, Pow, walk
from tests.scene.scene_evaluation import value

NAMES = {"x": Fraction(3, 7), "y": Fraction(-5, 2), "z1": Fraction(11, 13)}


def at(text: str, column: int = 1) -> Mark:
    return Mark("f", 1, column, " " * (column - 1) + text)


def parse(text: str):
    return parse_expression(text, at(text)).node


def problem(text: str, parser=parse_expression):
    with pytest.raises(InputError) as caught:
        parser(text, at(text))
    (found,) = caught.value.problems
    return found


def glued(parts: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Texts joined without parentheses, so that precedence decides what they mean."""
    operators = st.sampled_from(["+", "-", "*", "/", " + ", " - ", " * ", "\t/ "])
    return st.one_of(
        st.builds("{}{}{}".format, parts, operators, parts),
        st.builds("-{}".format, parts),
        st.builds("( {} )".format, parts),
        st.builds("{}^{}".format, parts, st.sampled_from(["2", "3", "-2", "(1 + 1)", "0"])),
        st.builds("{}**{}".format, parts, st.sampled_from(["2", "-1", "2^2"])),
    )


ATOMS = st.sampled_from(["x", "y", "z1", "2", "0.5", "3e-1", ".25", "7.", "1E2"])
TEXTS = st.recursive(ATOMS, glued, max_leaves=12)


def python_value(text: str) -> Fraction:
    """The value that Python's grammar gives to the same text, in exact arithmetic."""
    number = r"(?<![A-Za-z0-9_.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    code = re.sub(number, r"F('\1')", text.replace("^", "**"))
    return eval(code, {"__builtins__": {}, "F": Fraction}, dict(NAMES))


@pytest.mark.slow
@given(TEXTS)
@settings(max_examples=150, deadline=None)
def test_same_meaning_as_in_python(text: str) -> None:
    try:
        node = parse(text)
    except InputError as error:
        refused = error.problems[0].rule
    else:
        refused = ""
    if refused:
        assert refused in ("limit", "not-real")
        return
    try:
        expected = python_value(text)
    except ZeroDivisionError:
        return
    assert value(node, NAMES, exact=True) == expected


@given(TEXTS)
@settings(max_examples=100, deadline=None)
def test_spans_are_texts_of_the_parts(text: str) -> None:
    try:
        node = parse(text)
    except InputError:
        return
    for part in walk(node):
        start, end = part.span
        assert 0 <= start < end <= len(text)
        if isinstance(part, Name):
            assert text[start:end] == part.name
        if isinstance(part, Number):
            assert text[start:end] == part.text


def test_minus_binds_looser_than_power() -> None:
    assert isinstance(parse("-x^2"), Neg)
    assert isinstance(parse("2^-x^2"), Pow)
    assert value(parse("-x^2"), {"x": 3}) == -9
    assert value(parse("2^3^2"), {}) == 512


@pytest.mark.slow
def test_sums_and_products_are_flat() -> None:
    total = parse(" + ".join(["x"] * 5000))
    assert isinstance(total, Add)
    assert len(total.terms) == 5000
    product = parse("x" + "/y*x" * 2000)
    assert isinstance(product, Mul)
    assert len(product.factors) == 4001


def test_decimals_are_exact_and_keep_their_text() -> None:
    node = parse("0.10")
    assert isinstance(node, Number)
    assert (node.value, node.text) == (Fraction(1, 10), "0.10")
    assert parse("1e400").value == 10**400
    assert parse("25e-400").value == Fraction(25, 10**400)


def test_functions() -> None:
    node = parse("atan2(y, x) + norm(x, y, 2) + exp(-x)*sqrt(2)")
    names = {"x": 0.3, "y": 0.7}
    expected = math.atan2(0.7, 0.3) + math.hypot(0.3, 0.7, 2) + math.exp(-0.3) * math.sqrt(2)
    assert value(node, names) == pytest.approx(expected, rel=1e-15)
    assert [n.function for n in walk(node) if isinstance(n, Call)] == [
        "atan2",
        "norm",
        "exp",
        "sqrt",
    ]


@pytest.mark.parametrize("name", ["e", "E", "I", "N", "S", "Q", "lambda", "beta", "gamma", "_a1"])
def test_every_other_identifier_is_the_users(name: str) -> None:
    assert parse(name) == Name(name, (0, len(name)))


def test_places_of_parts_follow_the_origin() -> None:
    with pytest.raises(InputError) as caught:
        parse_expression("x + 2y", at("x + 2y", column=11))
    mark = caught.value.problems[0].mark
    assert (mark.column, mark.length) == (15, 2)
    with pytest.raises(InputError) as caught:
        parse_expression("x +\n 2y", Mark("f", 3, 5, "v: |", 1), exact=False)
    mark = caught.value.problems[0].mark
    assert (mark.line, mark.column, mark.length) == (3, 5, 1)


def test_equation_sides_share_text_and_place() -> None:
    equation = parse_equation("r - z2 = l", at("r - z2 = l", column=9))
    assert equation.left.text == equation.right.text == equation.text == "r - z2 = l"
    assert equation.left.mark(equation.left.node.span).column == 9
    assert equation.right.mark(equation.right.node.span).column == 18


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("(" * 201 + "x" + ")" * 201, "nested"),
        ("-" * 300 + "x", "nested"),
        ("^".join(["x"] * 300), "nested"),
        ("1+2*(" * 150 + "x" + ")" * 150, "nested"),
        ("sin(" * 150 + "x" + "*x+1)" * 150, "nested"),
        ("x" * 20_001, "20000 characters"),
        ("1e401", "exponent"),
        ("1e-401", "exponent"),
        ("1e" + "9" * 5000, "exponent"),
        ("9" * 5000, "1000 digits"),
        ("9^9^9^9", "too large"),
        ("(9^9)^(9^9)", "too large"),
        ("1.0000001^(10^30)", "too large"),
        ("2^(10^10)", "too large"),
        ("2^-(10^10)", "too large"),
        ("(1/3)^(10^10)", "too large"),
        ("2^(1e300 + 1/2)", "too large"),
        ("1e300*1e300*x", "too large"),
        ("exp(exp(exp(exp(10))))", "too large"),
        ("cosh(1e5)", "too large"),
        ("x^101", "beyond 100"),
        ("x^-101", "beyond 100"),
        ("x^(10^3)", "beyond 100"),
        ("(((x^5)^5)^5)", "beyond 100"),
        ("(-(2*x^20 + 1))^6", "beyond 100"),
        ("x^(50*pi)", "beyond 100"),
        ("1/(2 - 2)", "division by zero"),
        ("0^-1", "division by zero"),
        ("1/0^2", "division by zero"),
        ("1/(1 - (-1)^2)", "division by zero"),
        ("asin(2)", "not a real number"),
        ("log(-1)", "not a real number"),
        ("(-2)^0.5", "not a real number"),
    ],
)
def test_limits(text: str, part: str) -> None:
    assert part in problem(text).message


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "(" * 199 + "x" + ")" * 199,
        "x^100",
        "(x^10)^10",
        "sin(x)^100 * cos(x)^100",
        "x^y^z1",
        "2^1000",
        "(-1)^(10^300)",
        "0^(10^300)",
        "1/0^0 + 1/(1 + (-1)^2)",
        "1^(10^300)",
        "x^(1/3)",
        "(-8)^3",
        "2^0.5",
        "1e400/1e400",
        "x" + "+x" * 9999,
        "abs(-2) + sign(-3) + min(1, 2, 3) + max(4) + dot(x) + ddot(y)",
    ],
)
def test_within_limits(text: str) -> None:
    parse(text)


@pytest.mark.parametrize("text", ["x = y", "x == y", "x >= y", "x < y"])
def test_relations_are_no_expressions(text: str) -> None:
    assert "expected an expression" in problem(text).message


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("x >= 0", "syntax"),
        ("x < 0", "syntax"),
        ("x[i] = 0", "index"),
        ("sum(x, i) = 0", "syntax"),
        ("x = y = z", "syntax"),
        ("x == y", "syntax"),
        ("x", "syntax"),
        ("", "syntax"),
        ("= x", "syntax"),
        ("x =", "syntax"),
    ],
)
def test_refused_equations(text: str, rule: str) -> None:
    assert problem(text, parse_equation).rule == rule


@pytest.mark.slow
@given(st.text(alphabet="xy12.e+-*/^(),= []<>sincotabdqrmpθ·\n\t\"'_", max_size=60))
@settings(max_examples=100, deadline=None)
def test_any_text_parses_or_is_refused_at_a_place(text: str) -> None:
    for parser in (parse_expression, parse_equation):
        problems = ()
        try:
            parser(text, at(text))
        except InputError as error:
            problems = error.problems
        for found in problems:
            assert found.message
            assert found.mark is not None
            assert 1 <= found.mark.column <= len(text) + 2
