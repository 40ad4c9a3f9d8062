"""Units in LaTeX: upright symbols, and no command of the scene's own."""

import pytest

from lagrange_cli.notation.symbols import latex_unit


@pytest.mark.parametrize(
    ("unit", "latex"),
    [
        ("kg*m^2/s", r"\mathrm{kg}\,\mathrm{m}^{2}/\mathrm{s}"),
        ("m^(-1/2)", r"\mathrm{m}^{-1/2}"),
        ("m^-2", r"\mathrm{m}^{-2}"),
        (r"m^(\input{x})", r"\text{m\textasciicircum{}(\textbackslash{}input\{x\})}"),
        ("m^($)", r"\text{m\textasciicircum{}(\$)}"),
    ],
)
def test_units(unit, latex):
    assert latex_unit(unit) == latex
