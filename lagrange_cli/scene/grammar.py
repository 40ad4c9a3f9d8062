"""The grammar of expressions and equations.

An operator-precedence parser with an explicit stack of open brackets, so that
nesting costs no recursion. It knows an allowlist of functions and builds the
tree of :mod:`lagrange_cli.scene.expression`; nothing of a text is evaluated.

Binding, loosest first: ``+ -``; ``* /``; a sign; ``^`` (the same as ``**``),
which associates to the right. A leading sign belongs to the whole term:
``-x^2*y`` is −(x²·y).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.scene.bounds import check_depth, extent_of
from lagrange_cli.scene.expression import (
    FUNCTIONS,
    Add,
    Call,
    Equation,
    Expression,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
)
from lagrange_cli.scene.problems import shown, suggestion
from lagrange_cli.scene.tokens import ExpressionError, Token, number_value, tokenize

__all__ = ["MAX_LENGTH", "MAX_NESTING", "parse_equation", "parse_expression"]

MAX_LENGTH = 20_000
MAX_NESTING = 200

_RELATIONS = ("=", "==", "<", ">", "<=", ">=")


def parse_expression(
    text: str, origin: Mark, *, exact: bool = True, limited: bool = True
) -> Expression:
    """Parse an expression whose first character is at ``origin``.

    ``exact``: offsets in the text are offsets in the line (see
    :class:`~lagrange_cli.scene.expression.Expression`). ``limited=False`` lifts
    the limit on the length, for text that was written out from a helper.

    Raises
    ------
    InputError
        At the place where the text is not an expression, or exceeds a limit.
    """
    try:
        tokens = _tokens(text, limited)
        for token in tokens:
            if token.text in _RELATIONS:
                found = "an equation" if token.text in ("=", "==") else "an inequality"
                raise ExpressionError(f"expected an expression, found {found}", token.span)
        node = _checked(tokens)
    except ExpressionError as error:
        raise _located(error, text, origin, exact) from None
    return Expression(node, text, origin, exact)


def parse_equation(
    text: str, origin: Mark, *, exact: bool = True, limited: bool = True
) -> Equation:
    """Parse ``left = right``; see :func:`parse_expression`.

    Raises
    ------
    InputError
        At the place where the text is not an equation, or exceeds a limit.
    """
    try:
        tokens = _tokens(text, limited)
        cut = _equals_sign(tokens)
        end = Token("end", "", tokens[cut].start, tokens[cut].start)
        left = _checked([*tokens[:cut], end])
        right = _checked(tokens[cut + 1 :])
    except ExpressionError as error:
        raise _located(error, text, origin, exact) from None
    return Equation(
        Expression(left, text, origin, exact), Expression(right, text, origin, exact), text, origin
    )


def _located(error: ExpressionError, text: str, origin: Mark, exact: bool) -> InputError:
    whole = Expression(Name("", (0, 0)), text, origin, exact)
    return InputError(Problem(error.message, whole.mark(error.span), error.hint, error.rule))


def _tokens(text: str, limited: bool) -> list[Token]:
    if limited and len(text) > MAX_LENGTH:
        raise ExpressionError(
            f"an expression of more than {MAX_LENGTH} characters", (0, 1), rule="limit"
        )
    return tokenize(text)


def _equals_sign(tokens: list[Token]) -> int:
    """The index of the one ``=`` of an equation."""
    relations = [i for i, token in enumerate(tokens) if token.text in _RELATIONS]
    for i in relations:
        if tokens[i].text == "==":
            raise ExpressionError("an equation has one '='", tokens[i].span)
        if tokens[i].text != "=":
            raise ExpressionError(
                "unilateral constraints are not supported yet", tokens[i].span, rule="unsupported"
            )
    if not relations:
        span = (tokens[0].start, max(tokens[-1].start, tokens[0].start + 1))
        raise ExpressionError("expected an equation, found no '='", span)
    if len(relations) > 1:
        raise ExpressionError("an equation has one '='", tokens[relations[1]].span)
    return relations[0]


def _checked(tokens: list[Token]) -> Node:
    node = _Parser(tokens).parse()
    check_depth(node, MAX_NESTING)
    extent_of(node, {})
    return node


@dataclass(slots=True)
class _Bracket:
    """What has been read since an opening bracket (or the beginning).

    ``pending`` holds the signs and bases that wait for the operand to their
    right; ``factors`` the product and ``terms`` the sum so far.
    """

    opener: Token | None = None
    function: Token | None = None
    arguments: list[Node] = field(default_factory=list)
    terms: list[tuple[Literal["+", "-"], Node]] = field(default_factory=list)
    sign: Token | None = None
    start: int | None = None
    factors: list[tuple[Literal["*", "/"], Node]] = field(default_factory=list)
    operator: Literal["*", "/"] = "*"
    pending: list[Token | Node] = field(default_factory=list)

    @property
    def at_start(self) -> bool:
        """Nothing of the sum has been read."""
        return not (self.terms or self.sign or self.factors or self.pending)


class _Parser:
    """Reads tokens into one tree; ``value`` is the operand just read, if any."""

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens = tokens
        self.position = 0
        self.brackets = [_Bracket()]
        self.value: Node | None = None
        self.depth = 0

    def parse(self) -> Node:
        while True:
            token = self.tokens[self.position]
            self.position += 1
            if self.value is None:
                self._operand(token)
            elif token.kind == "end":
                return self._finish(token)
            else:
                self._operator(token, self.value)

    def _operand(self, token: Token) -> None:
        if token.kind == "number":
            self.value = Number(number_value(token), token.text, token.span)
        elif token.kind == "name":
            self._name(token)
        elif token.text == "(":
            self._open(token, None)
        elif token.text in ("+", "-"):
            self._sign(token)
        else:
            self._refuse_operand(token)

    def _name(self, token: Token) -> None:
        following = self.tokens[self.position]
        if following.text == "(":
            _refuse_function(token)
            self.position += 1
            self._open(following, token)
        elif following.text == "[":
            raise ExpressionError(
                "indexed names are not supported yet",
                (token.start, following.end),
                rule="unsupported",
            )
        elif token.text in FUNCTIONS or token.text == "sum":
            raise ExpressionError(
                f"'{token.text}' is a function", token.span, f"write {token.text}(...)"
            )
        else:
            self.value = Name(token.text, token.span)

    def _sign(self, token: Token) -> None:
        bracket = self.brackets[-1]
        if bracket.at_start:
            bracket.sign = token
            bracket.start = token.start
        elif token.text == "-":
            self._deeper(token)
            bracket.pending.append(token)

    def _refuse_operand(self, token: Token) -> None:
        bracket = self.brackets[-1]
        before = self.tokens[self.position - 2].text if self.position > 1 else ""
        if token.text == ")" and bracket.function and before == "(":
            name = bracket.function.text
            raise ExpressionError(
                f"{name}() needs an argument", (bracket.function.start, token.end)
            )
        if token.kind == "end" and not before:
            raise ExpressionError("expected an expression, found nothing", (0, 1))
        found = shown(token.text) if token.text else "the end"
        after = f" after {shown(before)}" if before else ""
        raise ExpressionError(f"expected an expression{after}, found {found}", _visible(token))

    def _operator(self, token: Token, value: Node) -> None:
        bracket = self.brackets[-1]
        self.value = None
        if token.text == "^":
            self._deeper(token)
            bracket.pending.append(value)
        elif token.text in ("*", "/"):
            self._end_factor(value)
            bracket.operator = "*" if token.text == "*" else "/"
        elif token.text in ("+", "-"):
            self._end_term(value)
            bracket.sign = token
        elif token.text == ",":
            self._comma(token, value)
        elif token.text == ")":
            self._close_bracket(token, value)
        else:
            self._refuse_juxtaposition(token)

    def _comma(self, token: Token, value: Node) -> None:
        bracket = self.brackets[-1]
        if bracket.function is None:
            raise ExpressionError("a comma separates the arguments of a function", token.span)
        bracket.arguments.append(self._end_sum(value))

    def _close_bracket(self, token: Token, value: Node) -> None:
        if len(self.brackets) == 1:
            raise ExpressionError("this ')' closes nothing", token.span)
        node = self._end_sum(value)
        bracket = self.brackets.pop()
        self.depth -= 1
        function = bracket.function
        if function is not None:
            node = _call(function, (*bracket.arguments, node), token.end)
        self.value = node

    def _refuse_juxtaposition(self, token: Token) -> None:
        before = self.tokens[self.position - 2]
        span = (before.start, token.end)
        hint = ""
        if token.kind == "name" or token.text == "(":
            second = "(...)" if token.text == "(" else token.text[:20]
            hint = f"for a product write {before.text[-20:]}*{second}"
        raise ExpressionError(
            f"expected an operator between {shown(before.text)} and {shown(token.text)}", span, hint
        )

    def _open(self, opener: Token, function: Token | None) -> None:
        self._deeper(opener)
        self.brackets.append(_Bracket(opener, function))

    def _deeper(self, token: Token) -> None:
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise ExpressionError(f"nested more than {MAX_NESTING} deep", token.span, rule="limit")

    def _end_factor(self, value: Node) -> None:
        """Close signs and powers from the right, and append the factor."""
        bracket = self.brackets[-1]
        while bracket.pending:
            before = bracket.pending.pop()
            self.depth -= 1
            if isinstance(before, Token):
                value = Neg(value, (before.start, value.span[1]))
            else:
                value = Pow(before, value, (before.span[0], value.span[1]))
        bracket.factors.append((bracket.operator, value))
        bracket.operator = "*"

    def _end_term(self, value: Node) -> None:
        self._end_factor(value)
        bracket = self.brackets[-1]
        factors = tuple(bracket.factors)
        bracket.factors = []
        node = factors[0][1]
        if len(factors) > 1:
            node = Mul(factors, (node.span[0], factors[-1][1].span[1]))
        minus = bracket.sign is not None and bracket.sign.text == "-"
        bracket.terms.append(("-" if minus else "+", node))
        bracket.sign = None

    def _end_sum(self, value: Node) -> Node:
        self._end_term(value)
        bracket = self.brackets[-1]
        terms = tuple(bracket.terms)
        bracket.terms = []
        sign, node = terms[0]
        start = node.span[0] if bracket.start is None else bracket.start
        if len(terms) > 1:
            return Add(terms, (start, terms[-1][1].span[1]))
        return Neg(node, (start, node.span[1])) if sign == "-" else node

    def _finish(self, token: Token) -> Node:
        assert self.value is not None
        bracket = self.brackets[-1]
        if bracket.opener is not None:
            raise ExpressionError("this '(' is never closed", bracket.opener.span)
        return self._end_sum(self.value)


def _visible(token: Token) -> tuple[int, int]:
    """A span of at least one character; the end is marked just after the text."""
    return (token.start, max(token.end, token.start + 1))


def _refuse_function(token: Token) -> None:
    if token.text == "sum":
        raise ExpressionError("sum(...) is not supported yet", token.span, rule="unsupported")
    if token.text not in FUNCTIONS:
        raise ExpressionError(
            f"unknown function {shown(token.text)}",
            token.span,
            suggestion(token.text, FUNCTIONS, f"for a product write {token.text[:40]}*(...)"),
            rule="unknown-function",
        )


def _call(function: Token, arguments: tuple[Node, ...], end: int) -> Call:
    wanted = FUNCTIONS[function.text]
    span = (function.start, end)
    if wanted is not None and len(arguments) != wanted:
        plural = "" if wanted == 1 else "s"
        raise ExpressionError(
            f"{function.text}(...) takes {wanted} argument{plural}, found {len(arguments)}", span
        )
    return Call(function.text, arguments, span)
