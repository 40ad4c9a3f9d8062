"""The grammar of expressions and equations.

An operator-precedence parser with an explicit stack of open brackets, so that
nesting costs no recursion. It knows an allowlist of functions and builds the
tree of :mod:`lagrange_cli.scene.language.expression`; nothing of a text is evaluated.

Binding, loosest first: ``+ -``; ``* /``; a sign; ``^`` (the same as ``**``),
which associates to the right. A leading sign belongs to the whole term:
``-x^2*y`` is −(x²·y).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import cast

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.scene.language.bounds import check_depth, extent_of
from lagrange_cli.scene.language.expression import SUM, Equation, Expression, Name, Node, Relation
from lagrange_cli.scene.language.parser import MAX_NESTING, parse_tokens
from lagrange_cli.scene.language.tokens import (
    ExpressionError,
    ExpressionLimitError,
    Token,
    tokenize,
    with_angular_velocities,
)

#: Most characters of an expression as written.
MAX_LENGTH = 20_000

_RELATIONS = ("=", "==", "<", ">", "<=", ">=")

#: The relations of a one-sided constraint.
INEQUALITIES: tuple[Relation, ...] = (">=", "<=")

#: Relation that the language does not have → the one to write.
_MEANT = {"<": "<=", ">": ">=", "=>": ">=", "=<": "<="}


def parse_expression(
    text: str,
    origin: Mark,
    *,
    exact: bool = True,
    limited: bool = True,
    functions: Mapping[str, int] = MappingProxyType({}),
) -> Expression:
    """Parse an expression whose first character is at ``origin``.

    ``exact``: offsets in the text are offsets in the line (see
    :class:`~lagrange_cli.scene.language.expression.Expression`). ``limited=False`` lifts
    the limit on the length, for text that was written out from a helper. ``functions`` are the
    scene's own functions, with their numbers of arguments.

    Raises
    ------
    InputError
        At the place where the text is not an expression, or exceeds a limit.
    """
    try:
        tokens = _tokens(text, limited)
        for token in tokens:
            if _is_relation(token):
                kind = "an equation" if token.text in ("=", "==") else "an inequality"
                raise ExpressionError(f"expected an expression, found {kind}", token.span)
        node = _checked(tokens, functions)
    except ExpressionError as error:
        raise _located(error, text, origin, exact) from None
    return Expression(node, text, origin, exact)


def parse_equation(
    text: str,
    origin: Mark,
    *,
    exact: bool = True,
    limited: bool = True,
    relations: tuple[Relation, ...] = ("=",),
    functions: Mapping[str, int] = MappingProxyType({}),
) -> Equation:
    """Parse ``left = right``, or another of ``relations``; see :func:`parse_expression`.

    Raises
    ------
    InputError
        At the place where the text is not such a relation, or exceeds a limit.
    """
    try:
        tokens = _tokens(text, limited)
        cut = _relation_sign(tokens, relations)
        end = Token("end", "", tokens[cut].start, tokens[cut].start)
        left = _checked([*tokens[:cut], end], functions)
        right = _checked(tokens[cut + 1 :], functions)
    except ExpressionError as error:
        raise _located(error, text, origin, exact) from None
    return Equation(
        Expression(left, text, origin, exact),
        Expression(right, text, origin, exact),
        text,
        origin,
        cast(Relation, tokens[cut].text),
    )


def parse_key(text: str, origin: Mark, *, exact: bool = True) -> Expression:
    """Parse the declaration of a family or of one element: ``p[i=1..n]``, ``x[0]``.

    The node is a :class:`~lagrange_cli.scene.language.expression.Name` whose indices are
    ranges or expressions.

    Raises
    ------
    InputError
        At the place where the text is not a name with indices.
    """
    try:
        node = _checked(_tokens(text, limited=True, declares=True))
        if not isinstance(node, Name):
            raise ExpressionError("expected a name with indices, as in x[i=1..n]", node.span)
    except ExpressionError as error:
        raise _located(error, text, origin, exact) from None
    return Expression(node, text, origin, exact)


def _located(error: ExpressionError, text: str, origin: Mark, exact: bool) -> InputError:
    whole = Expression(Name("", (0, 0)), text, origin, exact)
    return error.located(whole.mark(error.span))


def _tokens(text: str, limited: bool, declares: bool = False) -> list[Token]:
    if limited and len(text) > MAX_LENGTH:
        raise ExpressionLimitError(
            f"an expression of more than {MAX_LENGTH} characters", (0, 1), rule="limit"
        )
    return _with_conditions(_with_ranges(tokenize(text), declares))


def _with_ranges(tokens: list[Token], declares: bool) -> list[Token]:
    """Tell the ``=`` of ranges, in ``sum(..., i=1..n)`` and declared names, from relations."""
    takes_ranges: list[bool] = []
    for i, token in enumerate(tokens):
        if token.text in ("(", "["):
            is_sum = i > 0 and token.text == "(" and tokens[i - 1].text == SUM
            takes_ranges.append(is_sum or (declares and token.text == "["))
        elif token.text in (")", "]") and takes_ranges:
            takes_ranges.pop()
        elif token.text == "=" and takes_ranges and takes_ranges[-1]:
            follows = (",", "[") if declares else (",",)
            if tokens[i - 1].kind == "name" and tokens[i - 2].text in follows:
                tokens[i] = replace(token, kind="range")
    return tokens


def _with_conditions(tokens: list[Token]) -> list[Token]:
    """Tell the relations of pieces, in ``piecewise([value, a < b], ...)``, from those of equations.

    A bracket behind a name holds indices; any other one is a piece.
    """
    is_piece: list[bool] = []
    for i, token in enumerate(tokens):
        if token.text in ("(", "["):
            is_piece.append(token.text == "[" and (i == 0 or tokens[i - 1].kind != "name"))
        elif token.text in (")", "]") and is_piece:
            is_piece.pop()
        elif any(is_piece) and _is_relation(token):
            tokens[i] = replace(token, kind="condition")
    return tokens


def _is_relation(token: Token) -> bool:
    return token.kind == "operator" and token.text in _RELATIONS


def _relation_sign(tokens: list[Token], allowed: tuple[Relation, ...]) -> int:
    """Return the index of the one relation of an equation or inequality."""
    signs = [i for i, token in enumerate(tokens) if _is_relation(token)]
    for i in signs:
        _require_known(tokens, i)
    wanted = _wanted(allowed)
    if not signs:
        span = (tokens[0].start, max(tokens[-1].start, tokens[0].start + 1))
        missing = ", ".join(f"'{relation}'" for relation in allowed)
        missing = " or ".join(missing.rsplit(", ", 1))
        raise ExpressionError(f"expected {wanted}, found no {missing}", span)
    texts = {tokens[i].text for i in signs}
    for i in signs:
        if tokens[i].text not in allowed:
            kind = "an equation" if tokens[i].text == "=" else "an inequality"
            raise ExpressionError(f"expected {wanted}, found {kind}", tokens[i].span)
    if len(signs) > 1:
        _refuse_second(tokens[signs[1]], texts)
    return signs[0]


def _wanted(allowed: tuple[Relation, ...]) -> str:
    if "=" not in allowed:
        return "an inequality"
    return "an equation" if len(allowed) == 1 else "an equation or inequality"


def _require_known(tokens: list[Token], number: int) -> None:
    """Refuse relations that the language does not have, and name the one to write."""
    token, following = tokens[number], tokens[number + 1]
    if token.text == "==":
        raise ExpressionError("an equation has one '='", token.span)
    written, span = token.text, token.span
    if written == "=" and following.text in ("<", ">"):
        written, span = written + following.text, (token.start, following.end)
    if written in _MEANT:
        meant = _MEANT[written]
        raise ExpressionError(f"an inequality has '{meant}'", span, f"write '{meant}'")


def _refuse_second(token: Token, texts: Collection[str]) -> None:
    if texts == {"="}:
        raise ExpressionError("an equation has one '='", token.span)
    raise ExpressionError(
        "an inequality has one '>=' or '<='", token.span, "write one for each bound, in a list"
    )


def _checked(tokens: list[Token], functions: Mapping[str, int] = MappingProxyType({})) -> Node:
    node = parse_tokens(with_angular_velocities(tokens, functions), functions)
    check_depth(node, MAX_NESTING)
    extent_of(node, {})
    return node
