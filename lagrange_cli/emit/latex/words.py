"""Texts of a scene in LaTeX: units, numbers, constraints as they stand."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from lagrange_cli.emit.document.scene_text import SceneTextSpelling
from lagrange_cli.notation.latex import LatexPrinter, latex_number
from lagrange_cli.notation.latex_escape import latex_text


def scene_text_latex(
    text: str,
    names: Mapping[str, str] = MappingProxyType({}),
    printer: LatexPrinter | None = None,
) -> str:
    """Write an equation or expression of the scene language in math mode, other text as it is.

    ``names``: LaTeX of names that do not print as their letters.
    """
    spelling = SceneTextSpelling(
        printer or LatexPrinter(),
        over="/",
        at_least=r"\ge",
        at_most=r"\le",
        operator=r"\operatorname{{{}}}",
    )
    written = spelling.formula(text, names)
    return rf"\texttt{{{latex_text(text)}}}" if written is None else f"${written}$"


_UNIT = re.compile(
    r"(?P<space>[\s*·.]+)|(?P<power>\^(?:\((?P<grouped>[+-]?\d+)\)|(?P<exponent>[+-]?\d+)))"
    r"|(?P<over>/)|(?P<word>[A-Za-zµμΩ°%]+)|(?P<one>1)|(?P<paren>[()])"
)


def unit_latex(text: str) -> str:
    """Write a unit in upright letters: ``kg*m^2/s`` as kg m²/s; other text as it is."""
    shown, position = [], 0
    text = text.strip().replace("**", "^")
    while position < len(text):
        match = _UNIT.match(text, position)
        if match is None:
            return latex_text(text)
        position = match.end()
        shown.append(_unit_part(match))
    return f"${''.join(shown)}$" if shown else ""


def _unit_part(match: re.Match[str]) -> str:
    kind = match.lastgroup
    if match["power"]:
        return f"^{{{match['grouped'] or match['exponent']}}}"
    if kind == "space":
        return r"\,"
    if kind == "word":
        return rf"\text{{{latex_text(match['word'])}}}"
    return match[0]


def value_latex(number: float, literal: str | None = None) -> str:
    """Write a value for math mode, as the scene wrote it if that is known."""
    text = literal if literal is not None else repr(number)
    text = text.removesuffix(".0")
    sign, digits = ("-", text[1:]) if text.startswith("-") else ("", text)
    return f"{sign}{latex_number(digits)}"
