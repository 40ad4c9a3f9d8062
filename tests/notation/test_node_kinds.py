"""Each printer prints each kind of node, with all that the node holds."""

from typing import get_args

import pytest

from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.mathml import MathmlPrinter
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.printers.typst import TypstPrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRange,
    DisplayRate,
    DisplayRoot,
    DisplaySeries,
    DisplaySum,
    DisplaySymbol,
    OrderTraits,
    SignedNode,
)

PRINTERS = (LatexPrinter, MathmlPrinter, ScenePrinter, TypstPrinter, UnicodePrinter)
TRAITS = OrderTraits(Dependence.PARAMETER, 0, 0, "")


def letter(name):
    return DisplaySymbol(name, 0, None, TRAITS)


A, B = letter("a"), letter("b")

#: A node of each kind, and the letters and numbers that its formula has, from left to right.
SAMPLES = {
    DisplayNumber: (DisplayNumber(7, 1, TRAITS), "7"),
    DisplayPi: (DisplayPi(TRAITS), ""),
    DisplaySymbol: (A, "a"),
    DisplaySum: (DisplaySum((SignedNode(True, A), SignedNode(False, B)), TRAITS), "-a+b"),
    DisplayProduct: (DisplayProduct((A, B), TRAITS), "ab"),
    DisplayFraction: (DisplayFraction(A, B, TRAITS), "ab"),
    DisplayPower: (DisplayPower(A, B, TRAITS), "ab"),
    DisplayRoot: (DisplayRoot(A, TRAITS), "a"),
    DisplayCall: (DisplayCall("f", (A, B), TRAITS, 0), "fa,b"),
    DisplaySeries: (DisplaySeries(A, (DisplayRange("i", "1", "2"),), TRAITS), "a"),
    DisplayRate: (DisplayRate(A, TRAITS), "da"),
}


def test_there_is_a_sample_of_every_kind():
    assert set(SAMPLES) == set(get_args(DisplayNode))


@pytest.mark.parametrize("kind", SAMPLES, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("printer", PRINTERS, ids=lambda printer: printer.__name__)
def test_every_printer_prints_it(printer, kind):
    node, expected = SAMPLES[kind]
    text = printer().inline(node).replace("−", "-")
    assert text
    left = iter(text)
    assert all(sign in left for sign in expected), text
