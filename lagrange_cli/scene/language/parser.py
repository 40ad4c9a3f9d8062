"""The operator-precedence parser behind the grammar: tokens in, one tree out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from lagrange_cli.scene.language.expression import (
    CONDITIONS,
    FUNCTIONS,
    PIECEWISE,
    RANGE,
    RESERVED,
    SUM,
    Add,
    Call,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    own_function,
)
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.language.tokens import (
    ExpressionError,
    ExpressionLimitError,
    Token,
    call_meant,
    in_radians,
    number_value,
    operand_from,
    operand_to,
)

#: Deepest nesting of an expression.
MAX_NESTING = 200


def parse_tokens(tokens: Sequence[Token], functions: Mapping[str, int]) -> Node:
    """Parse tokens, the last of which is the end, into a tree.

    ``functions``: numbers of arguments of the scene's own ones; primes behind are derivatives.

    Raises
    ------
    ExpressionError
        At the token that cannot stand where it does.
    """
    return _Parser(tokens, functions).parse()


@dataclass(slots=True)
class _Bracket:
    """Parts read since an opening bracket, or since the beginning.

    Attributes
    ----------
    opener
        The bracket, None at the beginning.
    function
        Name before the bracket, if any.
    arguments
        Arguments that are complete.
    terms
        The sum so far, with signs.
    sign
        Sign of the term being read, if one is written.
    start
        Offset at which that term begins.
    factors
        The product so far, with operators.
    operator
        Operator before the factor being read.
    pending
        Signs and bases that wait for the operand to their right.
    index, first
        Index and first end of a range being read, if any.
    relation
        Relation in the condition of a piece, once it is read.
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
    index: Token | None = None
    first: Node | None = None
    relation: Token | None = None

    @property
    def is_piece(self) -> bool:
        """True of the brackets around a value and its condition."""
        return self.opener is not None and self.opener.text == "[" and self.function is None

    @property
    def at_start(self) -> bool:
        """True if nothing of the sum has been read."""
        return not (self.terms or self.sign or self.factors or self.pending)


#: What stands in the brackets of a piece, and between the sides of its condition.
_PIECE = "a piece is a value and a condition: [value, x >= a]"
_RELATIONS = "'>=', '>', '<=' or '<'"

#: Names of degrees behind a number.
_DEGREES = ("deg", "degree", "degrees")


class _Parser:
    """Reads tokens into one tree; ``value`` is the operand just read, if any."""

    def __init__(self, tokens: Sequence[Token], functions: Mapping[str, int]) -> None:
        self.tokens = tokens
        self.functions = functions
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
        elif token.text == "(" or (token.text == "[" and self._begins_piece()):
            self._open(token, None)
        elif token.text in ("+", "-"):
            self._sign(token)
        else:
            self._refuse_operand(token)

    def _name(self, token: Token) -> None:
        following = self.tokens[self.position]
        if following.text == "(":
            self._require_function(token)
            self.position += 1
            self._open(following, token)
        elif token.text in FUNCTIONS or token.text == SUM:
            hint = f"write {call_meant(self.tokens, self.position)}"
            raise ExpressionError(f"'{token.text}' is a function", token.span, hint)
        elif following.text == "[":
            if token.text in RESERVED:
                raise ExpressionError(f"'{token.text}' has no index", token.span)
            self.position += 1
            self._open(following, token)
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
        text = shown(token.text) if token.text else "the end"
        after = f" after {shown(before)}" if before else ""
        raise ExpressionError(f"expected an expression{after}, found {text}", _visible(token))

    def _operator(self, token: Token, value: Node) -> None:
        bracket = self.brackets[-1]
        self.value = None
        if _is_piece(value) and token.text != ",":
            raise ExpressionError(
                "the last argument of piecewise(...) is the value where no condition holds",
                value.span,
                "piecewise([value, condition], ..., otherwise)",
            )
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
        elif token.text in (")", "]"):
            self._close_bracket(token, value)
        elif token.text == "..":
            self._ends(token, value)
        elif token.kind == "condition":
            self._relation(token, value)
        else:
            self._refuse_juxtaposition(token)

    def _comma(self, token: Token, value: Node) -> None:
        bracket = self.brackets[-1]
        if bracket.is_piece and not bracket.arguments:
            bracket.arguments.append(self._end_sum(value))
            return
        if bracket.function is None:
            before, behind = self.tokens[self.position - 2], self.tokens[self.position]
            decimal = (before.kind, behind.kind) == ("number", "number")
            hint = f"a decimal number has a point: write {before.text}.{behind.text}"
            said = "a comma separates the arguments of a function"
            raise ExpressionError(said, token.span, hint if decimal else "")
        bracket.arguments.append(self._argument(value))
        self._begin_range()

    def _begins_piece(self) -> bool:
        """Tell whether an argument of ``piecewise`` begins here."""
        bracket = self.brackets[-1]
        function = bracket.function
        return function is not None and function.text == PIECEWISE and bracket.at_start

    def _relation(self, token: Token, value: Node) -> None:
        """Read the relation of a piece's condition."""
        bracket = self.brackets[-1]
        if not bracket.is_piece or len(bracket.arguments) != 1:
            raise ExpressionError(_PIECE, token.span)
        if token.text not in CONDITIONS:
            hint = "a condition is an inequality: two of them bound an interval"
            raise ExpressionError(f"expected {_RELATIONS}, found '{token.text}'", token.span, hint)
        bracket.arguments.append(self._end_sum(value))
        bracket.relation = token

    def _piece(self, end: Token, last: Node) -> Call:
        """Finish a piece: its value, and both sides of its condition."""
        bracket = self.brackets[-1]
        assert bracket.opener is not None
        span = (bracket.opener.start, end.end)
        if bracket.relation is None:
            raise ExpressionError(_PIECE, span)
        return Call(bracket.relation.text, (*bracket.arguments, last), span)

    def _begin_range(self) -> None:
        """Read the beginning ``i=`` of a range, if the next argument is one."""
        index = self.tokens[self.position]
        # Only the end has no token after it.
        if index.kind == "name" and self.tokens[self.position + 1].kind == "range":
            if index.text in RESERVED:
                raise ExpressionError(f"'{index.text}' cannot be an index", index.span)
            self.brackets[-1].index = index
            self.position += 2

    def _ends(self, token: Token, value: Node) -> None:
        bracket = self.brackets[-1]
        if bracket.index is None or bracket.first is not None:
            raise ExpressionError(
                "'..' stands between the ends of a range",
                token.span,
                "ranges stand in declared names and sums: x[i=1..n], sum(x[i], i=1..n)",
            )
        bracket.first = self._end_sum(value)

    def _argument(self, value: Node) -> Node:
        """Finish an argument: an expression or a range."""
        bracket = self.brackets[-1]
        node = self._end_sum(value)
        index, first = bracket.index, bracket.first
        if index is None:
            return node
        span = (index.start, node.span[1])
        if first is None:
            raise ExpressionError(
                "a range has two ends, as in i=1..n", span, "a fixed index stands alone: x[0]"
            )
        bracket.index = bracket.first = None
        return Call(RANGE, (Name(index.text, index.span), first, node), span)

    def _close_bracket(self, token: Token, value: Node) -> None:
        bracket = self.brackets[-1]
        opener = bracket.opener
        if opener is None:
            raise ExpressionError(f"this '{token.text}' closes nothing", token.span)
        if (opener.text == "(") != (token.text == ")"):
            raise ExpressionError(f"this '{opener.text}' is never closed", opener.span)
        node = self._argument(value)
        if bracket.is_piece:
            node = self._piece(token, node)
        self.brackets.pop()
        self.depth -= 1
        function = bracket.function
        if function is not None:
            arguments = (*bracket.arguments, node)
            if opener.text == "[":
                node = Name(function.text, (function.start, token.end), arguments)
            else:
                node = self._call(function, arguments, token.end)
        self.value = node

    def _refuse_juxtaposition(self, token: Token) -> None:
        before = self.tokens[self.position - 2]
        span = (before.start, token.end)
        hint = ""
        if token.kind == "name" or token.text == "(":
            first = operand_to(self.tokens, self.position - 2)
            second = operand_from(self.tokens, self.position - 1)
            hint = f"for a product write {first}*{second}"
        if before.kind == "number" and token.text in _DEGREES:
            hint = in_radians(before.text)
        elif (before.kind, token.kind) == ("number", "name") and before.end < token.start:
            unit = f"{{value: {before.text}, unit: {token.text[:20]}}}"
            hint += f", for a parameter with a unit {unit}"
        raise ExpressionError(
            f"expected an operator between {shown(before.text)} and {shown(token.text)}", span, hint
        )

    def _require_function(self, token: Token) -> None:
        name = token.text
        if name in FUNCTIONS or name == SUM or own_function(name) in self.functions:
            return
        known = [*FUNCTIONS, *self.functions]
        product = (
            f"for a product write {token.text[:40]}*{operand_from(self.tokens, self.position)}"
        )
        raise ExpressionError(
            f"unknown function {shown(token.text)}",
            token.span,
            suggestion(token.text, known, product),
            rule="unknown-function",
        )

    def _call(self, function: Token, arguments: tuple[Node, ...], end: int) -> Call:
        span = (function.start, end)
        if function.text == SUM:
            return _sum(arguments, span)
        if function.text == PIECEWISE:
            _require_pieces(arguments, span)
        arity = self.functions.get(own_function(function.text), 1)
        wanted = FUNCTIONS.get(function.text, arity)
        if wanted is not None and len(arguments) != wanted:
            plural = "" if wanted == 1 else "s"
            raise ExpressionError(
                f"{function.text}(...) takes {wanted} argument{plural}, found {len(arguments)}",
                span,
            )
        return Call(function.text, arguments, span)

    def _open(self, opener: Token, function: Token | None) -> None:
        self._deeper(opener)
        self.brackets.append(_Bracket(opener, function))
        if opener.text == "[":
            self._begin_range()

    def _deeper(self, token: Token) -> None:
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise ExpressionLimitError(
                f"nested more than {MAX_NESTING} deep", token.span, rule="limit"
            )

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
        bracket.start = None
        if len(terms) > 1:
            return Add(terms, (start, terms[-1][1].span[1]))
        return Neg(node, (start, node.span[1])) if sign == "-" else node

    def _finish(self, token: Token) -> Node:
        assert self.value is not None
        bracket = self.brackets[-1]
        if bracket.opener is not None:
            raise ExpressionError(
                f"this '{bracket.opener.text}' is never closed", bracket.opener.span
            )
        return self._end_sum(self.value)


def _visible(token: Token) -> tuple[int, int]:
    """Return a span of at least one character; the end is marked just after the text."""
    return (token.start, max(token.end, token.start + 1))


def _sum(arguments: tuple[Node, ...], span: tuple[int, int]) -> Call:
    body, *ranges = arguments
    if not ranges or not all(isinstance(r, Call) and r.function == RANGE for r in ranges):
        raise ExpressionError(
            "sum(...) takes an expression and ranges", span, "as in sum(x[i]^2, i=1..n)"
        )
    return Call(SUM, (body, *ranges), span)


def _is_piece(node: Node) -> bool:
    return isinstance(node, Call) and node.function in CONDITIONS


def _require_pieces(arguments: tuple[Node, ...], span: tuple[int, int]) -> None:
    """Refuse ``piecewise`` without pieces, or with a value that is not the last."""
    *pieces, _ = arguments
    for piece in pieces:
        if not _is_piece(piece):
            raise ExpressionError(_PIECE, piece.span)
    if not pieces:
        raise ExpressionError("piecewise(...) needs pieces", span, _PIECE)
