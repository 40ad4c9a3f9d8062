"""No printed expression can be misread: formulas are read back as a reader reads a line of text."""

import math
import random
from pathlib import Path

import pytest
from sympy import Add, Symbol
from sympy import sin as sine

from lagrange_cli import api
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.tabulated import Tabulated
from lagrange_cli.notation.build import display, display_row, display_terms
from lagrange_cli.notation.layout import break_lines
from lagrange_cli.notation.printers.mathml import MathmlPrinter, mathml_table
from lagrange_cli.notation.printers.typst import TypstPrinter, balanced
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import vocabulary
from tests.notation.formula_readers import Reader, TypstReader
from tests.notation.mathml_reader import MathmlReader
from tests.systems.shipped import sliced

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"
#: The bicycle's formulas have thousands of terms of the kinds that others have.
SCENES = [
    path
    for path in sorted(SYSTEMS.glob("*/*.yaml"))
    if path.parent.name != "refused" and path.stem != "bicycle"
]


def _formulas(equations, words):
    yield display(equations.system.kinetic, words), equations.system.kinetic
    yield display(equations.system.potential, words), equations.system.potential
    for shown in equations.derivation.shown:
        yield display_terms(shown, words), shown.residual
    for quantity in equations.derivation.conserved:
        yield display(quantity.expression, words), quantity.expression


def _tabulated(*arguments):
    """What stands for the functions of tables, whose points may lie elsewhere."""
    return sum(math.sin(x + k) for k, x in enumerate(arguments))


def _without_tables(formula):
    def stand_in(function):
        assert not any(function.orders)
        return Add(*(sine(x + k) for k, x in enumerate(function.arguments)))

    return formula.replace(lambda e: isinstance(e, Tabulated), stand_in)


def _values(printer, equations, words, point):
    """Value of each symbol as it is printed, those of abbreviations and of tables among them."""
    values = {printer.inline(node): point[symbol] for symbol, node in words.atoms.items()}
    tables = {f.token for e in equations.derivation.shown for f in e.residual.atoms(Tabulated)}
    values |= {printer.symbol(table.name): _tabulated for table in tables}
    for name, expression in equations.presentation.abbreviations:
        try:
            values[printer.symbol(name)] = float(evaluate([expression], point)[0])
        except (ArithmeticError, ValueError):
            continue
    return values


def _rates(equations, words, printer, begin):
    """Momenta that an equation says to take the rate of, and what stands beside, as printed."""
    for shown in equations.derivation.shown:
        form = shown.rate_form
        if form is None:
            continue
        text = printer.inline(display_row(shown, words))
        assert text.startswith(begin)
        # What stands beside a rate is read with the momentum in its place.
        yield text.removeprefix(begin), form.momentum + form.remainder_sum


def _typst_text(tree):
    """A formula on narrow lines."""
    lines = break_lines(TypstPrinter().pieces(tree), 30, 26, step=2)
    return ' \\ & "" '.join(balanced(line.text for line in lines))


def _mathml_text(tree):
    """A formula on narrow lines, each of which is well-formed."""
    lines = break_lines(MathmlPrinter().pieces(tree), 30, 26, step=2)
    return mathml_table([[line.text] for line in lines], ["left"])


@pytest.mark.slow
@sliced(SCENES, argument="path")
def test_formulas_read_back(path):
    equations = api.load(path).derive().equations
    words = vocabulary(equations, abbreviating=True)
    chance = random.Random(7)
    # An input with rates is a function of t in equations, and prints as its symbol does.
    numbers = {node: chance.uniform(0.1, 0.9) for node in words.atoms.values()}
    point = {symbol: numbers[node] for symbol, node in words.atoms.items()}
    values = _values(UnicodePrinter(), equations, words, point)
    in_typst = _values(TypstPrinter(), equations, words, point)
    trees = list(_formulas(equations, words))
    texts = [(Reader(UnicodePrinter().inline(tree), values), e) for tree, e in trees]
    texts += [(TypstReader(_typst_text(tree), in_typst), e) for tree, e in trees]
    in_mathml = _values(MathmlPrinter(), equations, words, point)
    for printer in (MathmlPrinter(), MathmlPrinter(10)):
        texts += [(MathmlReader(printer.inline(tree), in_mathml), e) for tree, e in trees]
    texts += [(MathmlReader(_mathml_text(tree), in_mathml), e) for tree, e in trees]
    for printer, begin, reader, known in (
        (UnicodePrinter(), "d/dt ", Reader, values),
        (TypstPrinter(), f"{TypstPrinter.ddt} ", TypstReader, in_typst),
        (MathmlPrinter(), f"{MathmlPrinter.ddt} ", MathmlReader, in_mathml),
    ):
        texts += [(reader(t, known), e) for t, e in _rates(equations, words, printer, begin)]
    compared = 0
    held = {u.symbol: Symbol(u.name, real=True) for u in equations.system.inputs}
    for reading, formula in texts:
        expression = _without_tables(formula.xreplace(held))
        try:
            expected = float(evaluate([expression], point)[0])
        except (ArithmeticError, ValueError):
            continue
        if not math.isfinite(expected):
            continue
        assert reading.read() == pytest.approx(expected, rel=1e-9, abs=1e-9), reading.text
        compared += 1
    assert compared


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("½ m ẋ² sin²θ", 0.5 * 2 * 9 * math.sin(5) ** 2),
        ("sin θ cos θ", math.sin(5) * math.cos(5)),
        ("2 m / (3 ẋ)", 4 / 9),
        ("m / ẋ^(3/2)", 2 / 3**1.5),
        ("-m (ẋ - θ)", 4),
        ("√(m ẋ) - √2", math.sqrt(6) - math.sqrt(2)),
        ("m piecewise([½ m, ẋ > θ], [-(ẋ + θ), -ẋ ≤ -m], 0)", -16),
        ("m T(-ẋ, θ - m) + 1", -5),
    ],
)
def test_the_reader(text, expected):
    values = {"m": 2.0, "ẋ": 3.0, "θ": 5.0, "T": lambda x, y: x * y / 3}
    assert Reader(text, values).read() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("frac(1, 2) m dot(x)^2 sin^2 theta", 0.5 * 2 * 9 * math.sin(5) ** 2),
        ("sin theta thin cos 2 theta", math.sin(5) * math.cos(10)),
        (r"frac(2 m, dot(x)^(3\/2))", 4 / 3**1.5),
        (r'-m \(dot(x) \ & "" - theta\) + 2 times 10^(-1)', 4.2),
        ('frac(& m \\ & quad "" + theta, 2 dot.op 3)', 7 / 6),
        (r"m cases(m\, & m > 7, -theta\, & m <= 7\, thick m >= 1, 0\, & m < 1)", -10),
        ("m T (-dot(x)) + 1", -5),
    ],
)
def test_the_reader_of_typst(text, expected):
    values = {"m": 2.0, "dot(x)": 3.0, "theta": 5.0, "T": lambda x: x}
    assert TypstReader(text, values).read() == pytest.approx(expected)
