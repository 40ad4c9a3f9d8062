"""Textbook order: lecture formulas exactly, and rules of order on small cases."""

import random
from fractions import Fraction

import pytest
import sympy
from sympy import Abs, Heaviside, Integer, Max, Min, Rational, Symbol, cos, exp, pi, sin, sqrt, tan

from lagrange_cli.errors import InternalError
from lagrange_cli.notation.build import display, display_row
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import vocabulary
from tests.emit.emit_scenes import (
    bead_on_parabola,
    build,
    chain_pendulum,
    coordinates,
    masses_through_hole,
    parameters,
    product,
)
from tests.parts import changed

GIVEN = parameters(M=2.0, m=1.0, g=9.81, a=0.5, l=2.0, omega=1.0, k=3.0, c=1.0)
CHOSEN = coordinates("r", "theta", "phi", "x", "y")
SMALL = build("small", GIVEN, CHOSEN, sympy.Add(*(c.v**2 for c in CHOSEN)), Integer(0))
WORDS = vocabulary(SMALL)
M, m, g, a, rod, omega, k, c = (p.symbol for p in GIVEN)
r, theta, phi, x, y = (q.q for q in CHOSEN)
vr, vtheta, vphi, vx, vy = (q.v for q in CHOSEN)
ar, atheta, aphi, ax, ay = (q.a for q in CHOSEN)
t = SMALL.system.t


def shown(expression, words=WORDS):
    return UnicodePrinter().inline(display(expression, words))


def rows(equations):
    words = vocabulary(equations)
    return [UnicodePrinter().inline(display_row(s, words)) for s in equations.derivation.shown]


def test_bead_on_parabola():
    bead = bead_on_parabola()
    words = vocabulary(bead)
    assert rows(bead) == ["(1 + 4 a² x²) ẍ + 4 a² x ẋ² + 2 a g x"]
    assert shown(bead.system.kinetic, words) == "½ m (1 + 4 a² x²) ẋ²"


def test_masses_through_hole():
    masses = masses_through_hole()
    words = vocabulary(masses)
    assert rows(masses) == ["(M + m) r̈ - M r θ̇² + m g", "M r² θ̈ + 2 M r ṙ θ̇"]
    assert shown(masses.system.kinetic, words) == "½ M (ṙ² + r² θ̇²) + ½ m ṙ²"
    assert shown(masses.system.potential, words) == "m g (r - l)"
    assert shown(masses.derivation.conserved[0].expression, words) == "M r² θ̇"


def test_double_pendulum():
    pendulum = chain_pendulum(2)
    assert rows(pendulum) == [
        "(m1 + m2) l1 θ̈1 + m2 l2 θ̈2 cos(θ1 - θ2) + m2 l2 θ̇2² sin(θ1 - θ2)"
        " + m1 g sin θ1 + m2 g sin θ1",
        "m2 l1 θ̈1 cos(θ1 - θ2) + m2 l2 θ̈2 - m2 l1 θ̇1² sin(θ1 - θ2) + m2 g sin θ2",
    ]


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        # products
        (ar * (M + m), "(M + m) r̈"),
        (sin(theta) * g * m * rod, "m g l sin θ"),
        (vtheta * sin(theta) * cos(theta) * m * 2, "2 m θ̇ sin θ cos θ"),
        (k * (x - rod) * vx, "k (x - l) ẋ"),
        (m * rod * (1 - cos(theta)) * g, "m g l (1 - cos θ)"),
        (2 * pi * sqrt(rod / g), "2 π √(l / g)"),
        (sqrt(2) * m, "√2 m"),
        (sqrt(k) / sqrt(m) * x, "√(k / m) x"),
        (x / sqrt(x**2 + y**2), "x / √(x² + y²)"),
        (-m * (-x - y), "m (x + y)"),
        (cos(theta) * (vx + vy), "(ẋ + ẏ) cos θ"),
        # sums
        (4 * a**2 * x**2 + 1, "1 + 4 a² x²"),
        (-rod + r, "r - l"),
        (x**2 - x - rod, "x² - x - l"),
        (-1 + x - x**2, "x - 1 - x²"),
        (cos(theta) - 1, "cos θ - 1"),
        (-g - x, "-g - x"),
        (r * vtheta**2 + vr, "r θ̇² + ṙ"),
        (m * g * x + m * vx**2, "m ẋ² + m g x"),
        (r + rod * cos(theta), "r + l cos θ"),
        ((rod + x) ** 2 * vtheta**2 + vx**2, "ẋ² + (l + x)² θ̇²"),
        (k * (x - rod) ** 2 / 2 - m * g * y, "½ k (x - l)² - m g y"),
        (x * y + y**2 + x**2, "x² + y² + x y"),
        (1 - vx**2 / c**2, "1 - ẋ² / c²"),
        # signs of arguments
        (cos(theta - phi), "cos(θ - φ)"),
        (cos(phi - theta), "cos(θ - φ)"),
        (sin(phi - theta), "-sin(θ - φ)"),
        (m * sin(phi - theta) * g, "-m g sin(θ - φ)"),
        (cos(phi - omega * t), "cos(φ - ω t)"),
        (tan(-x), "-tan x"),
        (Abs(rod - x), "|x - l|"),
        (exp(-c * t), "exp(-c t)"),
        # fractions
        (Rational(5, 12) * m * rod**2, "5/12 m l²"),
        (Rational(1, 12) * m * rod**2, "m l² / 12"),
        (Rational(3, 4) * m, "¾ m"),
        (-M * m * g / r**2, "-M m g / r²"),
        (k * x / (2 * m * rod), "k x / (2 m l)"),
        (m / (x + y), "m / (x + y)"),
        ((x + y) / m, "(x + y) / m"),
        (1 / x, "1 / x"),
        ((x**2 + y**2) ** Rational(-3, 2), "1 / (x² + y²)^(3/2)"),
        # powers
        (x ** Rational(1, 3), "x^(1/3)"),
        (k**x, "k^x"),
        (2**x * 3, "3 · 2^x"),
        ((a * x) ** c, "(a x)^c"),
        (sin(theta) ** 2, "sin²θ"),
        (cos(theta - phi) ** 2, "cos²(θ - φ)"),
        (sympy.log(x) ** 2, "(ln(x))²"),
        (vx**2, "ẋ²"),
        # constants
        (Integer(0), "0"),
        (Rational(-7, 3), "-7/3"),
        (sympy.E, "exp(1)"),
        (pi / 2, "π / 2"),
        (-5 * pi / 6 * x, "-⅚ π x"),
    ],
)
def test_order_and_form(expression, text):
    assert shown(expression) == text


def test_terms_of_a_step_are_exact():
    """d max(x, y)/dx is a step; at equality the mean of both sides."""
    step = sympy.diff(Max(x, y), x)
    assert isinstance(step, Heaviside)
    assert shown(step) == "heaviside(x - y)"


def test_arguments_of_min_and_max_have_one_order():
    assert shown(Min(y, x, m)) == "min(m, x, y)"
    assert shown(Max(x**2, r, Integer(3))) == "max(3, r, x²)"


@pytest.mark.parametrize(
    ("expression", "what"),
    [
        (sympy.DiracDelta(x), "DiracDelta"),
        (sympy.Piecewise((x, x > 0), (y, True)), "Piecewise"),
        (sympy.gamma(x), "gamma"),
        (sympy.Float(0.1) * x, "Float"),
        (sympy.I * x, "ImaginaryUnit"),
        (sympy.oo, "Infinity"),
        (sympy.nan, "NaN"),
        (Symbol("stranger", real=True), "stranger"),
        (Heaviside(x, 0), "Heaviside"),
    ],
)
def test_what_has_no_exact_form_is_refused(expression, what):
    with pytest.raises(InternalError, match=what):
        shown(expression)


def test_numbers_print_as_the_scene_wrote_them():
    words = vocabulary(
        changed(
            SMALL,
            literals=(
                (Fraction(981, 100), "9.81"),
                (Fraction(1, 2), "0.5"),
                (Fraction(10**30), "1e30"),
                (Fraction(1, 10), "0.1"),
            ),
        )
    )
    assert shown(Rational(981, 100) * m, words) == "9.81 m"
    assert shown(m * x / Rational(981, 100), words) == "m x / 9.81"
    assert shown(Rational(981, 100) * m / x, words) == "9.81 m / x"
    assert shown(m / 2, words) == "½ m"
    assert shown(Integer(10) ** 30 * m, words) == "1e30 m"
    assert shown(Integer(1000) * m, words) == "1000 m"
    assert shown(Rational(1, 7) * m, words) == "m / 7"
    assert shown(Rational(13, 1250) * m, words) == "0.0104 m"
    assert shown(Rational(13, 1250) * m / x, words) == "0.0104 m / x"
    assert shown(m * x * Rational(1250, 13), words) == "1250/13 m x"
    assert shown(Rational(13, 1200) * m, words) == "13/1200 m"
    assert shown(Rational(1, 1024**9) * m, words) == f"m / {1024**9}"


def test_unevaluated_products_are_flattened():
    nested = product(m, product(Rational(1, 2), x + y))
    assert shown(nested) == "½ m (x + y)"
    assert shown(sympy.UnevaluatedExpr(x) * 2) == "2 x"


def test_order_does_not_follow_the_order_of_arguments():
    terms = [m * vx**2, M * g * r, -k * x**2, cos(theta) * rod, Integer(5), a * vy * vx]
    generator = random.Random(7)
    texts = set()
    for _ in range(20):
        generator.shuffle(terms)
        texts.add(shown(sympy.Add(*terms, evaluate=False)))
    assert texts == {"5 + m ẋ² + a ẋ ẏ + M g r - k x² + l cos θ"}
