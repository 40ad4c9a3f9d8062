"""What is printed in the scene language reads back as the same number."""

import random
from fractions import Fraction

import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Integer, Rational

from lagrange_cli.errors import InternalError
from lagrange_cli.notation.build import FUNCTION_NAMES, display
from lagrange_cli.notation.printers.latex import LATEX_FUNCTIONS as LATEX_CALLS
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.scene_language import to_scene_language
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.scene.language.expression import FUNCTIONS
from tests.emit.emit_scenes import (
    HALF,
    build,
    chain_pendulum,
    coordinates,
    damped_driven,
    masses_through_hole,
    parameters,
)
from tests.notation.scene_numbers import evaluate
from tests.parts import changed

GIVEN = parameters(m=1.0, E=2.0, beta=0.5)
CHOSEN = coordinates("x", "theta")
SMALL = build("small", GIVEN, CHOSEN, HALF * sum(c.v**2 for c in CHOSEN), Integer(0))
SYMBOLS = [
    *(p.symbol for p in GIVEN),
    SMALL.system.t,
    *(s for c in CHOSEN for s in (c.q, c.v, c.a)),
]


def numbers(symbols, seed, low=0.3, high=0.9):
    generator = random.Random(seed)
    return {s: generator.uniform(low, high) for s in symbols}


def all_symbols(equations):
    return [
        *(p.symbol for p in equations.system.parameters),
        equations.system.t,
        *(s for c in equations.system.coordinates for s in (c.q, c.v, c.a)),
    ]


def value(expression, values):
    exact = {s: sympy.Rational(repr(v)) for s, v in values.items()}
    return float(sympy.N(expression.xreplace(exact), 30))


def same(text, expression, values):
    named = {s.name: v for s, v in values.items()}
    return evaluate(text, named) == pytest.approx(value(expression, values), rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("cls", FUNCTION_NAMES, ids=FUNCTION_NAMES.values())
def test_every_function_has_a_row_in_every_printer(cls):
    name = FUNCTION_NAMES[cls]
    assert name in FUNCTIONS
    assert name in LATEX_CALLS
    x, theta = CHOSEN[0].q, CHOSEN[1].q
    shift = 1 if name == "acosh" else 0
    arguments = (x + shift,) if FUNCTIONS[name] == 1 else (x, theta)
    expression = cls(*arguments)
    text = to_scene_language(expression, SMALL)
    assert same(text, expression, numbers(SYMBOLS, 3))
    readable = UnicodePrinter().inline(display(expression, vocabulary(SMALL)))
    assert readable.startswith({"log": "ln", "abs": "|"}.get(name, name))
    assert same(to_scene_language(expression**2 / 3, SMALL), expression**2 / 3, numbers(SYMBOLS, 4))


def test_every_function_of_the_language_can_be_printed():
    written = set(FUNCTION_NAMES.values()) | {"sqrt", "norm", "piecewise", "dot", "ddot"}
    assert written == set(FUNCTIONS)


@pytest.mark.parametrize("name", ["cot", "sec", "csc", "coth", "sech", "csch"])
def test_reciprocal_functions_are_written_as_quotients(name):
    expression = getattr(sympy, name)(CHOSEN[0].q) * CHOSEN[1].v
    assert same(to_scene_language(expression, SMALL), expression, numbers(SYMBOLS, 5))


@pytest.mark.parametrize(
    "equations",
    [masses_through_hole(), chain_pendulum(2), chain_pendulum(3), damped_driven()],
    ids=lambda e: e.presentation.name,
)
@pytest.mark.parametrize("form", ["lagrange", "explicit"])
def test_reports_read_back(equations, form):
    report = derivation_report(equations, form)
    values = numbers(all_symbols(equations), 11)
    accelerations = sympy.Matrix([c.a for c in equations.system.coordinates])
    mass = sympy.Matrix(equations.system.mass_matrix)
    unscaled = mass * accelerations - sympy.Matrix(equations.system.forcing)
    solved = accelerations - mass.LUsolve(sympy.Matrix(equations.system.forcing))
    for i, row in enumerate(report["equations"]):
        if form == "lagrange":
            expected = equations.derivation.shown[i].residual
        else:
            expected = solved[i] if len(equations.system.coordinates) <= 2 else unscaled[i]
        assert same(row["residual"], expected, values)
    assert same(report["kinetic"], equations.system.kinetic, values)
    assert same(report["potential"], equations.system.potential, values)
    assert same(report["lagrangian"], equations.system.lagrangian, values)
    for i, row in enumerate(report["mass_matrix"]):
        for j, entry in enumerate(row):
            assert same(entry, equations.system.mass_matrix[i][j], values)
        assert same(report["forcing"][i], equations.system.forcing[i], values)
    for quantity, entry in zip(equations.derivation.conserved, report["conserved"], strict=True):
        assert same(entry["expression"], quantity.expression, values)


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (-(SYMBOLS[0] ** 2), "-m^2"),
        ((-SYMBOLS[4]) ** 3, "-x^3"),
        (SYMBOLS[4] ** (-SYMBOLS[0]), "x^(-m)"),
        ((SYMBOLS[4] ** SYMBOLS[0]) ** SYMBOLS[1], "(x^m)^E"),
        (sympy.exp(-SYMBOLS[2] * SMALL.system.t), "exp(-beta*t)"),
        (sympy.sqrt(SYMBOLS[0]) / 3, "1/3*sqrt(m)"),
        (1 / (SYMBOLS[0] * SYMBOLS[4]), "1/(m*x)"),
        (SYMBOLS[5] ** 2 * Rational(3, 2), "3/2*dot(x)^2"),
        (sympy.pi * SYMBOLS[1], "pi*E"),
    ],
)
def test_forms(expression, text):
    assert to_scene_language(expression, SMALL) == text
    assert same(text, expression, numbers(SYMBOLS, 2))


def test_literals_read_back_exactly():
    literals = ((Fraction(981, 100), "9.81"), (Fraction(1, 10**31), "1e-31"))
    equations = changed(SMALL, literals=literals)
    x = CHOSEN[0].q
    assert to_scene_language(Rational(981, 100) * x**2, equations) == "9.81*x^2"
    tiny = Rational(1, 10**31)
    assert to_scene_language(tiny * x, equations) == "1e-31*x"
    assert to_scene_language(tiny**x, equations) == "(1e-31)^x"


def test_unknown_symbols_are_refused():
    with pytest.raises(InternalError, match="stranger"):
        to_scene_language(sympy.Symbol("stranger"), SMALL)


def trees():
    """Random expressions over the symbols, defined for values in (0, 1)."""
    leaves = st.sampled_from(SYMBOLS) | st.builds(
        Rational, st.integers(-12, 12), st.integers(1, 12)
    )

    def grow(inner):
        safe = [sympy.sin, sympy.cos, sympy.atan, sympy.tanh, sympy.Abs]
        return st.one_of(
            st.builds(lambda a, b: a + b, inner, inner),
            st.builds(lambda a, b: a - b, inner, inner),
            st.builds(lambda a, b: a * b, inner, inner),
            st.builds(lambda a, b: a / (2 + b**2), inner, inner),
            st.builds(lambda a: a**2, inner),
            st.builds(lambda a: a**3, inner),
            st.builds(lambda a: sympy.sqrt(1 + a**2), inner),
            st.builds(lambda a, b: (1 + a**2) ** (-sympy.cos(b)), inner, inner),
            st.builds(lambda f, a: f(a), st.sampled_from(safe), inner),
            st.builds(lambda a, b: sympy.Max(a, b), inner, inner),
        )

    return st.recursive(leaves, grow, max_leaves=8)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(trees(), st.integers(0, 10**6))
def test_any_expression_reads_back(expression, seed):
    expression = sympy.sympify(expression)
    values = numbers(SYMBOLS, seed)
    named = {s.name: v for s, v in values.items()}
    expected = value(expression, values)
    # Nested squares and cubes can be large; cancellation is not the printer's.
    assert evaluate(to_scene_language(expression, SMALL), named) == pytest.approx(
        expected, rel=1e-7, abs=1e-7
    )
