"""Functions in cases: values on and beside surfaces, derivatives, documents, refusals."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import mpmath
import pytest
import sympy as sp

from lagrange_cli.cache.values import from_bytes, to_bytes
from lagrange_cli.errors import InputError, Mark
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.kinks import KINKED, Cases, sides_of, surfaces_of
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.proofs.continuity import is_analytic, is_continuous
from lagrange_cli.mechanics.proofs.zero_test import vanish
from lagrange_cli.mechanics.symbols.convert import to_sympy
from lagrange_cli.notation.build import display
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.mathml import MathmlPrinter
from lagrange_cli.notation.printers.typst import TypstPrinter
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.scene import parse_expression, read_text
from tests.mechanics.mechanics_support import derived, refusal

X, Y = sp.symbols("x y", real=True)
A = sp.Symbol("a", positive=True)

STOPS = """
parameters: {m: 1, k: 4, a: {value: 0.5, positive: true}}
particles: {block: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {stops: "piecewise([k*(x - a)^2/2, x > a], [k*(x + a)^2/2, x < -a], 0)"}
"""


def converted(text: str) -> sp.Expr:
    expression = parse_expression(text, Mark("<test>", 1, 1, text))
    return to_sympy(expression, {"x": X, "y": Y, "a": A}.get)


CASES: dict[str, Callable[[Fraction], Fraction | int]] = {
    "piecewise([x, x >= 1], -x)": lambda x: x if x >= 1 else -x,
    "piecewise([x, x > 1], -x)": lambda x: x if x > 1 else -x,
    "piecewise([x, x <= 1], -x)": lambda x: x if x <= 1 else -x,
    "piecewise([x, x < 1], -x)": lambda x: x if x < 1 else -x,
    "piecewise([1, x < 0], [2, x <= 1], [3, x^2 < 4], 4)": (
        lambda x: 1 if x < 0 else 2 if x <= 1 else 3 if x * x < 4 else 4
    ),
    "heaviside(x - 1)": lambda x: Fraction((x > 1) - (x < 1) + 1, 2),
    "heaviside(1 - x)": lambda x: Fraction((x < 1) - (x > 1) + 1, 2),
}


@pytest.mark.parametrize("text", CASES)
@pytest.mark.parametrize("at", [-2, -1, 0, Fraction(1, 2), 1, Fraction(3, 2), 2, 3])
def test_values_on_and_beside_surfaces(text: str, at: Fraction) -> None:
    expression = converted(text)
    expected = CASES[text](Fraction(at))
    exact = sp.Rational(Fraction(at).numerator, Fraction(at).denominator)
    assert expression.xreplace({X: exact}) == sp.Rational(str(expected))
    assert evaluate([expression], {X: mpmath.mpf(float(at))})[0] == float(expected)


@pytest.mark.parametrize("text", CASES)
def test_derivatives_are_those_of_each_case(text: str) -> None:
    slope = derivative(converted(f"x^2*({text})"), X)
    for at in (-1.75, 0.25, 1.25, 3.5):
        function = CASES[text]
        step = Fraction(1, 10**6)
        ends = [Fraction(at) + s * step for s in (1, -1)]
        difference = (
            (ends[0] ** 2 * function(ends[0]) - ends[1] ** 2 * function(ends[1])) / 2 / step
        )
        assert float(evaluate([slope], {X: mpmath.mpf(at)})[0]) == pytest.approx(float(difference))


def test_a_known_side_leaves_its_case() -> None:
    assert converted("piecewise([x, a > 0], y)") == X
    assert converted("piecewise([x, -a >= 0], y)") == Y
    assert converted("piecewise([x, y > 0], x)") == X


def test_sides_and_surfaces_of_every_kink() -> None:
    examples = [sp.Abs(X), sp.sign(X), sp.Heaviside(X), Cases(Y, X, 1, A), sp.Max(X, Y)]
    assert {type(e) for e in examples} | {sp.Min} == set(KINKED)
    for kink in examples:
        (surface,) = surfaces_of(kink)
        above, below = sides_of(kink)
        for x in (2, -3):
            there = {X: sp.Integer(x), Y: sp.Integer(0), A: sp.Integer(5)}
            side = above if surface.xreplace(there) > 0 else below
            assert kink.xreplace(there) == side.xreplace(there)


def test_cases_come_back_from_the_cache() -> None:
    kept = converted("piecewise([x, x >= y], [2, x < a], 0) + heaviside(x)")
    data = to_bytes(kept)
    assert data is not None
    assert from_bytes(data) == kept


def test_continuity_is_that_of_both_cases_on_the_surface() -> None:
    assert is_continuous(converted("piecewise([(x - a)^2, x >= a], 0)"), {X})
    assert is_continuous(converted("piecewise([(x - a)^2, x > a], [(x + a)^2, x < -a], 0)"), {X})
    assert not is_continuous(converted("piecewise([(x - a)^2, x >= y], 0)"), {X})
    assert not is_continuous(converted("heaviside(x)"), {X})


def test_a_root_of_a_positive_form_of_a_unit_vector_never_bends() -> None:
    """h = √(a² n₁² + b² n₂² + c² n₃²) ≥ min(a, b, c), n being a row of a rotation."""
    form = "(a*cos(x)*sin(y))^2 + 2*sin(x)^2 + 3*(cos(x)*cos(y))^2"
    assert is_analytic(converted(f"cos(x)/sqrt({form})"), {X, Y})
    assert not is_analytic(converted(f"cos(x)/sqrt({form.replace('2*sin(x)^2 +', '')})"), {X, Y})
    assert not is_analytic(converted(f"sqrt({form.replace('2*sin(x)', '2*sin(y)')})"), {X, Y})
    assert not is_analytic(converted("sqrt(sin(x)^2)"), {X})


def test_a_nest_as_deep_as_a_long_chain_is_proven_continuous() -> None:
    nest = X
    for _ in range(2000):
        nest = sp.Add(sp.Mul(sp.cos(Y), nest, evaluate=False), X, evaluate=False)
    energy = sp.Add(sp.Pow(nest, 2, evaluate=False), nest.args[0], evaluate=False)
    assert is_continuous(energy, {X, Y})
    assert not is_continuous(energy.func(*energy.args, converted("heaviside(x)")), {X, Y})


def test_identities_of_cases_are_proven() -> None:
    assert vanish(converted("piecewise([x, x >= 0], -x) - abs(x)"))
    assert vanish(converted("heaviside(x)*x - max(x, 0)"))
    assert not vanish(converted("piecewise([x, x >= 1], -x) - abs(x)"))


def test_energy_between_stops_is_conserved_without_a_warning() -> None:
    equations = derived(STOPS)
    assert [c.name for c in equations.derivation.conserved] == ["energy"]
    assert not equations.derivation.warnings


def test_a_potential_that_jumps_is_warned_of() -> None:
    text = STOPS.replace("[k*(x + a)^2/2, x < -a]", "[k*(x + a)^2/2, x < a/2]")
    (warning,) = derived(text).derivation.warnings
    assert warning.rule == "impulse"


@pytest.mark.parametrize("function", ["heaviside(y)", "piecewise([y, y > 0], 0)"])
def test_positions_and_constraints_are_smooth(function: str) -> None:
    particles = "particles: {p: {mass: 1, position: [x, y, z]}}\n"
    name = function.partition("(")[0]
    constrained = refusal(f"{particles}constraints:\n  path: 'x = {function}'\n")
    placed = refusal(f"particles: {{p: {{mass: 1, position: ['{function}', y, 0]}}}}\n")
    for problem in (constrained, placed):
        assert problem.message.startswith(f"{name}(...) cannot stand in")


@pytest.mark.parametrize(
    ("text", "said", "part"),
    [
        ("piecewise([1, x < 1])", "the last argument of piecewise", "[1, x < 1]"),
        ("piecewise(1)", "piecewise(...) needs pieces", "piecewise(1)"),
        ("piecewise([1, x = 1], 2)", "expected '>=', '>', '<=' or '<', found '='", "="),
        ("piecewise([1], 2)", "a piece is a value and a condition", "[1]"),
        ("piecewise([1, 0 < x < 2], 3)", "a piece is a value and a condition", "< 2"),
        ("piecewise(x, 2)", "a piece is a value and a condition", "x"),
        ("piecewise([1, x < 2] + 1, 2)", "the last argument of piecewise", "[1, x < 2]"),
        ("[1, x < 2]", "expected an expression, found '['", "["),
    ],
)
def test_what_is_no_piece_is_refused_at_its_place(text: str, said: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_expression(text, Mark("<test>", 1, 1, text))
    (problem,) = caught.value.problems
    assert problem.message.startswith(said)
    assert problem.mark is not None
    assert text[problem.mark.column - 1 :].startswith(part[:1])


def test_units_of_cases_and_conditions_agree() -> None:
    scene = """
parameters: {m: {value: 1, unit: kg}, k: {value: 1, unit: N/m}, a: {value: 1, unit: m}}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: {x: {unit: m}}
forces: {pull: {on: x, force: "piecewise([-k*x, x > LIMIT], VALUE)"}}
"""
    right = scene.replace("LIMIT", "a").replace("VALUE", "k*a")
    assert not read_text("name: s\n" + right).warnings
    for limit, value in (("k", "k*a"), ("a", "k")):
        wrong = read_text("name: s\n" + scene.replace("LIMIT", limit).replace("VALUE", value))
        assert [w.rule for w in wrong.warnings] == ["unit"]


def test_documents_print_cases_with_all_that_conditions_say() -> None:
    system = derived(STOPS).system
    assert system.potential.has(Cases)
    node = display(system.potential, vocabulary(derived(STOPS)))
    assert LatexPrinter().inline(node) == (
        r"\begin{cases} \frac{1}{2} k (x - a)^{2}, & x > a \\"
        r" \frac{1}{2} k (x + a)^{2}, & x \le a, \ x < -a \\ 0, & x \le a, \ x \ge -a \end{cases}"
    )
    assert TypstPrinter().inline(node) == (
        r"cases(frac(1, 2) k (x - a)^2\, & x > a,"
        r" frac(1, 2) k (x + a)^2\, & x <= a\, thick x < -a, 0\, & x <= a\, thick x >= -a)"
    )
    assert MathmlPrinter().inline(node).count("<mtr>") == 3
