"""Expressions as LaTeX mathematics: ``\\frac{1}{2} m (\\dot{r}^{2} + r^{2} \\dot{\\phi}^{2})``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import ClassVar

from lagrange_cli.notation.layout import Piece, joined
from lagrange_cli.notation.printers.one_line import group
from lagrange_cli.notation.printers.typeset import TypesetPrinter
from lagrange_cli.notation.symbols import latex_name, scientific
from lagrange_cli.notation.tree import DisplayCall, DisplayNumber

#: Function of the scene language → its macro.
LATEX_FUNCTIONS = {
    **{name: rf"\{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    **{name: rf"\{name}" for name in ("exp", "min", "max")},
    **{f"a{name}": rf"\arc{name}" for name in ("sin", "cos", "tan")},
    **{f"a{name}": rf"\operatorname{{ar{name}}}" for name in ("sinh", "cosh", "tanh")},
    **{name: rf"\operatorname{{{name}}}" for name in ("atan2", "abs")},
    "sign": r"\operatorname{sgn}",
    "heaviside": r"\operatorname{H}",
    "log": r"\ln",
}


class LatexPrinter(TypesetPrinter):
    """LaTeX with amsmath; parentheses as tall as they need be."""

    functions = LATEX_FUNCTIONS
    lead = r"{}\cdot "
    pi = r"\pi"
    ddt = r"\frac{\mathrm{d}}{\mathrm{d} t}"
    dot = r" \cdot "
    thin = r" \, "
    # What stands between \left and \right would have to be on one line.
    tall = r"\Bigl( ", r" \Bigr)"
    unequal = r"\ne"
    ratio_opening = r"\frac"
    root_opening = r"\sqrt"
    sum_opening = r"\sum"
    bars_opening = r"\left|"
    cases_opening = r"\begin{cases}"
    relations: ClassVar = {">=": r"\ge", "<=": r"\le", ">": ">", "<": "<"}
    word_openings: tuple[str, ...] = (r"\mathrm{", r"\dot{\mathrm{", r"\ddot{\mathrm{", r"\text{")
    group_openings = ("(", r"\bigl", r"\left", r"\Bigl")

    def name(self, name: str, order: int = 0, latex: str | None = None) -> str:
        return latex_name(name, order, latex)

    def function(self, node: DisplayCall) -> str:
        return latex_name(node.function, 0, node.latex) + "'" * (node.order or 0)

    def decimal(self, literal: str) -> str:
        return latex_number(literal)

    def ratio(self, above: str, below: str) -> str:
        return rf"\frac{{{above}}}{{{below}}}"

    def radical(self, body: str) -> str:
        return rf"\sqrt{{{body}}}"

    def stack(self, lines: Sequence[str]) -> str:
        text = r" \\ & \quad {} ".join(lines)
        return rf"\begin{{aligned}} & {text} \end{{aligned}}"

    def big_sum(self, under: str, over: str) -> str:
        return rf"\sum_{{{under}}}" + (f"^{{{over}}}" if over else "")

    def magnitude(self, body: str) -> str:
        return rf"\left| {body} \right|"

    def cases(self, rows: Sequence[tuple[str, Sequence[str]]]) -> str:
        lines = (f"{value}, & " + r", \ ".join(conditions) for value, conditions in rows)
        return r"\begin{cases} " + r" \\ ".join(lines) + r" \end{cases}"

    def exponential(self, exponent: str) -> str:
        return rf"\mathrm{{e}}^{{{exponent}}}"

    def slashed(self, node: DisplayNumber) -> str:
        return f"{node.numerator}/{node.denominator}"

    def raised(self, exponent: str) -> str:
        return f"^{{{exponent}}}"

    def exponent_width(self, exponent: str) -> float:
        return 0.8 * len(re.sub(r"\\[A-Za-z]+|[{}^\s]", "", exponent))

    def fenced(self, body: str) -> str:
        return rf"\left( {body} \right)"

    def plain(self, pieces: list[Piece]) -> list[Piece]:
        """Parentheses that are taller around others."""
        text = joined(pieces)
        if r"\bigl(" in text or r"\Bigl(" in text:
            return group(pieces, *self.tall)
        return group(pieces, r"\bigl( ", r" \bigr)") if "(" in text else group(pieces)


def latex_number(literal: str) -> str:
    """Return a decimal as the scene wrote it: ``9.81``, ``1e-31`` as a power of ten."""
    mantissa, exponent = scientific(literal)
    if exponent is None:
        return mantissa
    power = f"10^{{{exponent}}}"
    return rf"{mantissa} \times {power}" if mantissa else power
