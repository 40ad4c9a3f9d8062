"""Tokens of the expression grammar."""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from lagrange_cli.errors import InputError, LimitError, Mark, NotRealError, Problem
from lagrange_cli.scene.language.expression import ANGULAR_VELOCITIES, Span

#: Largest decimal exponent of a literal, and of any constant part of an expression.
MAX_EXPONENT = 400
#: Most digits of a literal.
MAX_DIGITS = 1000
#: Most characters of an operand that a hint repeats.
_MOST_WRITTEN = 20

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

_TOKEN = re.compile(
    r"""[ \t\r\n]*(?:
        (?P<number>(?:[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
      | (?P<name>[A-Za-z_][A-Za-z0-9_]*(?:'+(?=\())?)
      | (?P<operator>\*\*|\.\.|<=|>=|==|[-+*/^(),\[\]=<>])
      | (?P<end>\Z)
      | (?P<other>.)
    )""",
    re.VERBOSE | re.DOTALL,
)

_ALPHABET = (
    *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa"),
    *("lambda", "mu", "nu", "xi", "omicron", "pi", "rho", "sigma", "sigma", "tau", "upsilon"),
    *("phi", "chi", "psi", "omega"),
)
#: Character of a pasted formula → what to write instead.
_INSTEAD = {
    **{chr(0x3B1 + i): name for i, name in enumerate(_ALPHABET)},
    **{chr(0x391 + i): name.capitalize() for i, name in enumerate(_ALPHABET)},
    "\N{GREEK PHI SYMBOL}": "phi",
    "\N{GREEK THETA SYMBOL}": "theta",
    "\N{MINUS SIGN}": "-",
    "\N{EN DASH}": "-",
    "\N{MIDDLE DOT}": "*",
    "\N{DOT OPERATOR}": "*",
    "\N{MULTIPLICATION SIGN}": "*",
    "\N{DIVISION SIGN}": "/",
    "\N{SUPERSCRIPT TWO}": "^2",
    "\N{SUPERSCRIPT THREE}": "^3",
    "\N{VULGAR FRACTION ONE HALF}": "1/2",
    "\N{SQUARE ROOT}": "sqrt",
    "\N{GREATER-THAN OR EQUAL TO}": ">=",
    "\N{LESS-THAN OR EQUAL TO}": "<=",
}


class ExpressionError(Exception):
    """Something wrong within an expression's text; the parser adds the place in the file."""

    _refusal: ClassVar[type[InputError]] = InputError

    def __init__(self, message: str, span: Span, hint: str = "", rule: str = "syntax") -> None:
        super().__init__(message)
        self.message = message
        self.span = span
        self.hint = hint
        self.rule = rule

    def located(self, mark: Mark) -> InputError:
        """Return the refusal at a place in a file."""
        return self._refusal(Problem(self.message, mark, self.hint, self.rule))


class ExpressionLimitError(ExpressionError):
    """An expression is too large or too deep."""

    _refusal = LimitError


class NotRealExpressionError(ExpressionError):
    """A constant is no real number."""

    _refusal = NotRealError


@dataclass(frozen=True, slots=True)
class Token:
    """A lexical unit.

    Attributes
    ----------
    kind
        ``number``, ``name``, ``operator``, ``end``, or ``range``: the ``=`` of ``i=1..n``.
    text
        As written, but ``^`` for the operator ``**`` and empty for the end.
    start, end
        Offsets of its first character and behind its last one.
    """

    kind: str
    text: str
    start: int
    end: int

    @property
    def span(self) -> Span:
        return (self.start, self.end)


def tokenize(text: str) -> list[Token]:
    """Split an expression or equation into tokens; the last one is the end.

    Raises
    ------
    ExpressionError
        At a character that the language does not have.
    """
    tokens: list[Token] = []
    position = 0
    while not tokens or tokens[-1].kind != "end":
        match = _TOKEN.match(text, position)
        assert match is not None
        assert match.lastgroup is not None
        kind, lexeme = match.lastgroup, match.group(match.lastgroup)
        start, position = match.span(kind)
        if kind == "other":
            hint = _instead_of(lexeme, tokens[-1] if tokens else None)
            raise ExpressionError(f"unexpected character '{lexeme}'", (start, position), hint)
        tokens.append(Token(kind, "^" if lexeme == "**" else lexeme, start, position))
    return tokens


def _instead_of(character: str, before: Token | None) -> str:
    """Return what to write instead of a character and the token before it."""
    if character == "\N{DEGREE SIGN}" and before is not None and before.kind == "number":
        return in_radians(before.text)
    if character == "'" and before is not None and before.kind == "name":
        return f"write dot({before.text}) for its rate"
    instead = _INSTEAD.get(character, "")
    return f"write '{instead}' instead" if instead else ""


def in_radians(degrees: str) -> str:
    """Return the hint to write an angle in degrees as one in radians."""
    return f"angles are in radians: write {degrees}*pi/180"


def call_meant(tokens: Sequence[Token], following: int) -> str:
    """Write the call that ``sin x``, ``sin^2 x`` or ``sin^2(x)`` is meant for.

    ``following`` is the place of the token behind the function.
    """
    function, power = tokens[following - 1].text, ""
    caret, exponent = tokens[following].text, tokens[following + 1 : following + 2]
    if caret == "^" and exponent[0].kind == "number":
        following, power = following + 2, f"^{exponent[0].text}"
    argument = operand_from(tokens, following)
    if not argument:
        return f"{function}(...)"
    bracketed = argument if argument.startswith("(") else f"({argument})"
    return f"{function}{bracketed}{power}"


def operand_from(tokens: Sequence[Token], first: int) -> str:
    """Write the operand that begins at a token, ``""`` if none does."""
    token = tokens[first]
    if token.kind not in ("name", "number") and token.text != "(":
        return ""
    called = token.kind == "name" and tokens[first + 1].text in ("(", "[")
    return _written(tokens, first, _partner(tokens, first + 1 if called else first))


def operand_to(tokens: Sequence[Token], last: int) -> str:
    """Write the operand that ends with a token."""
    first = _partner(tokens, last)
    called = first < last and first > 0 and tokens[first - 1].kind == "name"
    return _written(tokens, first - 1 if called else first, last)


def _partner(tokens: Sequence[Token], place: int) -> int:
    """Find the bracket that belongs to one; the place itself if it is none, or has no partner."""
    step = -1 if tokens[place].text in (")", "]") else 1
    depth, reached = 0, place
    while 0 <= reached < len(tokens):
        depth += (tokens[reached].text in ("(", "[")) - (tokens[reached].text in (")", "]"))
        if depth == 0:
            return reached
        reached += step
    return place


def _written(tokens: Sequence[Token], first: int, last: int) -> str:
    """Write an operand; brackets that are long, or never closed, hold three dots."""
    text = "".join(token.text for token in tokens[first : last + 1])
    if tokens[last].text not in ("(", "[", ")", "]"):
        return text[:_MOST_WRITTEN]
    whole = tokens[last].text in (")", "]") and len(text) <= _MOST_WRITTEN
    name = tokens[first].text if tokens[first].kind == "name" else ""
    return text if whole else f"{name[:_MOST_WRITTEN]}(...)"


def with_angular_velocities(tokens: Sequence[Token], functions: Container[str]) -> list[Token]:
    """Join ``omega_x(top)`` to one name, and ``omega_x(link[3])`` to an element of a family.

    A scene's own function of such a name stays one.
    """
    joined: list[Token] = []
    following = list(tokens)
    while following:
        token = following.pop(0)
        if (
            token.text in ANGULAR_VELOCITIES
            and token.text not in functions
            and [t.text for t in following[:1]] == ["("]
            and following[1].kind == "name"
        ):
            closing = _partner(following, 0)
            frame, inside, end = following[1], following[2:closing], following[closing].end
            if closing and (not inside or (inside[0].text, inside[-1].text) == ("[", "]")):
                token = Token("name", f"{token.text}({frame.text})", token.start, end)
                following[: closing + 1] = inside
        joined.append(token)
    return joined


def number_value(token: Token) -> Fraction:
    """Return the exact value of a number token.

    Raises
    ------
    ExpressionError
        If it has more than :data:`MAX_DIGITS` digits or a decimal exponent
        beyond :data:`MAX_EXPONENT`.
    """
    mantissa, _, exponent = token.text.lower().partition("e")
    whole, _, fraction = mantissa.partition(".")
    if len(whole) + len(fraction) > MAX_DIGITS:
        raise ExpressionLimitError(
            f"a number of more than {MAX_DIGITS} digits", token.span, rule="limit"
        )
    # A long exponent is compared by its length: int() is not asked to read it.
    if len(exponent.lstrip("+-0")) > 3 or abs(int(exponent or "0")) > MAX_EXPONENT:
        raise ExpressionLimitError(
            f"a decimal exponent beyond {MAX_EXPONENT}", token.span, rule="limit"
        )
    shift = int(exponent or "0") - len(fraction)
    digits = int((whole + fraction) or "0")
    return Fraction(digits * 10**shift) if shift >= 0 else Fraction(digits, 10**-shift)
