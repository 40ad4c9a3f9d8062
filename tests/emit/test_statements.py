"""Constraints of the scene as formulas: one tree, printed in text and in LaTeX."""

import pytest

from lagrange_cli import api
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.report.statements import statement_of

SCENE = """
name: letters
parameters: {l: 1, R: {value: 1, latex: "R_0"}, omega: 1, n: 1}
coordinates: {x: {}, y: {}, z: {}, z2: {}, x_1: {}, phi: {latex: "\\\\varphi"}}
kinetic:
  all: (dot(x)^2 + dot(y)^2 + dot(z)^2 + dot(z2)^2 + dot(x_1)^2 + dot(phi)^2)/2
"""


@pytest.fixture(scope="module")
def equations():
    return api.loads(SCENE).derive().equations


@pytest.mark.parametrize(
    ("written", "text", "latex"),
    [
        ("z - z2 = l", ("z - z2", "l"), ("z - z_{2}", "l")),
        ("z = l*x^2", ("z", "l x²"), ("z", "l x^{2}")),
        (
            "x^2 + z**2 = (l/2)^2",
            ("x² + z²", "(l / 2)²"),
            ("x^{2} + z^{2}", r"\left( \frac{l}{2} \right)^{2}"),
        ),
        ("x = cos(omega*t)*l", ("x", "l cos(ω t)"), ("x", r"l \cos(\omega t)")),
        ("x^(n + 1) = y^-2", ("x^(n + 1)", "y^(-2)"), ("x^{n + 1}", "y^{-2}")),
        ("x = -1.5e-3*y", ("x", "-1.5e-3 y"), ("x", r"-1.5 \times 10^{-3} y")),
        ("dot(x) = R*dot(phi)", ("ẋ", "R φ̇"), (r"\dot{x}", r"{R_0} \dot{\varphi}")),
        ("dot(x_1)^2 = ddot(z)", ("ẋ_1²", "z̈"), (r"\dot{x}_{1}^{2}", r"\ddot{z}")),
        ("norm(x - y, z) = l", ("√((x - y)² + z²)", "l"), (r"\sqrt{(x - y)^{2} + z^{2}}", "l")),
        (
            "sum(p[i, 1]*x, i=1..n-1) = pi",
            ("Σᵢ₌₁ⁿ⁻¹ x p[i,1]", "π"),
            (r"\sum_{i = 1}^{n-1} x p_{i,1}", r"\pi"),
        ),
    ],
)
def test_sides(equations, written, text, latex):
    statement = statement_of(written, equations, vocabulary(equations))
    for printer, expected in ((UnicodePrinter(), text), (LatexPrinter(), latex)):
        assert (printer.inline(statement.left), printer.inline(statement.right)) == expected


@pytest.mark.parametrize("written", ["x; y", r"\input{a}", "x = dot(x + y)", "x = dot", "x"])
def test_other_texts_stay_as_written(equations, written):
    assert statement_of(written, equations, vocabulary(equations)) is None
