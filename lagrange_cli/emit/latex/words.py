"""Texts of a scene in LaTeX: units, numbers, constraints as they stand.

Nothing is interpreted beyond tokens, and every token is printed from a table or escaped, so that no
text of a scene acts as a command.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from lagrange_cli.notation.latex import LATEX_FUNCTIONS, latex_number
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.symbols import latex_name

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[^\W\d]\w*(?:\[[\w, +-]*\])?)"
    r"|(?P<sign>\*\*|>=|<=|[-+*/^()=,]))"
)

_SIGNS = {
    "+": " + ",
    "-": " - ",
    "*": r" \, ",
    "/": " / ",
    "(": "(",
    ")": ")",
    "=": " = ",
    ">=": r" \ge ",
    "<=": r" \le ",
    ",": ", ",
}


def scene_text_latex(text: str) -> str:
    """Write an equation or expression of the scene language, token by token, in math mode.

    Any other text is set as it is.
    """
    tokens = _tokens(text)
    if tokens is None:
        return rf"\texttt{{{latex_text(text)}}}"
    shown = list(_shown(tokens))
    return "$" + "".join(shown).strip() + "$"


def _tokens(text: str) -> list[tuple[str, str]] | None:
    """Return (kind, token) of each token; None if the text is not in the scene language."""
    tokens, position = [], 0
    while text[position:].strip():
        token = _TOKEN.match(text, position)
        if token is None or token.lastgroup is None:
            return None
        tokens.append((token.lastgroup, token[token.lastgroup]))
        position = token.end()
    return tokens


def _shown(tokens: list[tuple[str, str]]) -> Iterator[str]:
    index = 0
    while index < len(tokens):
        kind, token = tokens[index]
        index += 1
        if token in ("^", "**"):
            end = _operand_end(tokens, index)
            inner = tokens[index:end]
            if len(inner) > 2 and inner[0][1] == "(" and inner[-1][1] == ")":
                inner = inner[1:-1]
            yield "^{" + "".join(_shown(inner)).strip() + "}"
            index = end
        elif token in ("dot", "ddot") and _is_of_a_name(tokens, index):
            yield rf"\{token}{{{_one(*tokens[index + 1])}}}"
            index += 3
        else:
            yield _one(kind, token)


def _is_of_a_name(tokens: list[tuple[str, str]], start: int) -> bool:
    """Say whether a name between parentheses begins at ``start``."""
    group = tokens[start : start + 3]
    return [token for _, token in group[::2]] == ["(", ")"] and group[1][0] == "name"


def _operand_end(tokens: list[tuple[str, str]], start: int) -> int:
    """Return the end of the exponent that begins at ``start``: a sign, then a token or group."""
    end, depth = start, 0
    while end < len(tokens):
        token = tokens[end][1]
        end += 1
        depth += (token == "(") - (token == ")")
        calls = end < len(tokens) and tokens[end][1] == "(" and token in LATEX_FUNCTIONS
        if depth <= 0 and token not in "+-" and not calls:
            break
    return end


def _one(kind: str, token: str) -> str:
    if kind == "number":
        return latex_number(token)
    if kind == "sign":
        return _SIGNS[token]
    if token in LATEX_FUNCTIONS:
        return LATEX_FUNCTIONS[token]
    if token in ("sqrt", "norm", "dot", "ddot", "sum"):
        return rf"\operatorname{{{token}}}"
    return r"\pi" if token == "pi" else latex_name(token)


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
