"""SymPy expressions as display trees in textbook order.

SymPy orders for its own purposes; here the order is a textbook's (see
:mod:`~lagrange_cli.notation.ordering`) and the same in every format. Values are
kept exactly; what cannot be shown exactly is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.algebra.factor import holds_powers
from lagrange_cli.mechanics.free_symbols import arguments_of, is_unknown, name_and_order
from lagrange_cli.mechanics.kinks import Cases
from lagrange_cli.mechanics.symbols.convert import (
    EVEN_FUNCTIONS,
    ODD_FUNCTIONS,
    SYMPY_FUNCTIONS,
)
from lagrange_cli.notation import ordering
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplaySum,
    DisplaySymbol,
    SignedNode,
    as_terms,
    factors_of,
)
from lagrange_cli.notation.vocabulary import NamedFactor, Vocabulary
from lagrange_cli.scene.language.expression import PIECEWISE

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import ShownEquation

#: SymPy's functions by their names in the scene language.
FUNCTION_NAMES: dict[object, str] = {cls: name for name, cls in SYMPY_FUNCTIONS.items()}

#: Functions that the scene language writes as one over another.
_RECIPROCALS: dict[type, type] = {
    sympy.cot: sympy.tan,
    sympy.sec: sympy.cos,
    sympy.csc: sympy.sin,
    sympy.coth: sympy.tanh,
    sympy.sech: sympy.cosh,
    sympy.csch: sympy.sinh,
}

_SYMMETRIC = frozenset(("min", "max"))

#: Largest denominator that is taken out of a sum in a function.
_MOST_PARTS = 4


def display(expression: sympy.Expr, words: Vocabulary) -> DisplayNode:
    """Return the display tree of an expression.

    Raises
    ------
    InternalError
        The expression holds a symbol, number or function that has no place in
        the scene language.
    """
    return _left_out((expression,), words) or _whole(expression, words)


def _whole(expression: sympy.Expr, words: Vocabulary) -> DisplayNode:
    return ordering.signed(_term(expression, words))


def _left_out(parts: Sequence[sympy.Expr], words: Vocabulary) -> DisplayNode | None:
    """Return the note in place of a sum of parts that is too long to be read."""
    return None if words.omission is None else words.omission.instead(parts)


def display_sum(expressions: Iterable[sympy.Expr], words: Vocabulary) -> DisplayNode:
    """Return the sum of expressions, kept in the order given."""
    parts = tuple(expressions)
    left_out = _left_out(parts, words)
    return left_out or ordering.sum_of([_term(e, words) for e in parts], ordered=True)


def display_row(shown: ShownEquation, words: Vocabulary) -> DisplayNode:
    """Return the left side of an equation of motion as books print it.

    That is the rate of a momentum and what stands beside it, or the terms of the equation.
    """
    form = shown.rate_form
    if form is None:
        return display_terms(shown, words)
    rate = ordering.rate_of(display(form.momentum, words))
    remainder = _row(form.remainder, shown.coordinate, words, leading=False)
    return ordering.sum_of([SignedNode(False, rate), *as_terms(remainder)], ordered=True)


def display_terms(shown: ShownEquation, words: Vocabulary) -> DisplayNode:
    """Return the left side of an equation over accelerations: its terms in their order.

    Each coefficient and its factor print as one product. Terms without a
    factor (factor 1), which may be sums, are in the order of a sum; those with
    multipliers follow them. A positive acceleration leads where there is one.
    """
    return _row(shown.terms, shown.coordinate, words)


def _row(
    terms: Sequence[tuple[sympy.Expr, sympy.Expr]],
    coordinate: str,
    words: Vocabulary,
    *,
    leading: bool = True,
) -> DisplayNode:
    """Return the sum of products in the order of an equation; ``leading`` if none precedes it."""
    left_out = _left_out([e for term in terms for e in term if e != 1], words)
    if left_out is not None:
        return left_out
    alone = [k for k, (_, factor) in enumerate(terms) if factor == 1]
    last = alone[-1] if alone else len(terms)
    products = [(k, term) for k, term in enumerate(terms) if term[1] != 1]
    own_terms = [k for k, (_, term) in enumerate(products) if str(term[1]) == f"ddot({coordinate})"]
    before = ordering.rising_first(
        [_product(term, words) for k, term in products if k < last], own_terms
    )
    still = [_term(terms[k][0], words) for k in alone]
    ungrouped = as_terms(ordering.sum_of(still, leading=leading and not before))
    after = [_product(term, words) for k, term in products if k > last]
    return ordering.sum_of([*before, *ungrouped, *after], ordered=True)


def _term(expression: sympy.Expr, words: Vocabulary) -> SignedNode:
    """Sign and unsigned tree of an expression."""
    if isinstance(expression, sympy.Add):
        return _sum(expression, words)
    return _product((expression,), words)


def _sum(expression: sympy.Add, words: Vocabulary) -> SignedNode:
    """Sign and tree of a sum: its name, or its terms as the scene orders them, else as books do."""
    if expression in words.named:
        return _product((expression,), words)
    terms, negative = words.sums.get(expression, (None, False))
    if terms is None:
        return _outward(ordering.sum_of([_term(a, words) for a in expression.args]))
    return SignedNode(negative, ordering.sum_of([_term(t, words) for t in terms], ordered=True))


def _outward(node: DisplayNode) -> SignedNode:
    """Take the sign out of a sum whose terms are all negative."""
    if isinstance(node, DisplaySum) and all(t.negative for t in node.terms):
        return SignedNode(True, _negated(node))
    return SignedNode(False, node)


def _negated(node: DisplayNode) -> DisplayNode:
    return ordering.sum_of([SignedNode(not t.negative, t.node) for t in as_terms(node)])


# -- products -----------------------------------------------------------------


@dataclass
class _Factors:
    """A product while it is gathered: sign, number, factors above and below the line.

    Attributes
    ----------
    negative
        True if the sign is minus.
    coefficient
        The number.
    above, below
        Factors above and below the line.
    roots_above, roots_below
        Radicands of square roots of parameters, kept apart since √k/√m is shown as √(k/m).
    letters
        Powers of letters that names have brought.
    """

    negative: bool = False
    coefficient: Fraction = Fraction(1)
    above: list[DisplayNode] = field(default_factory=list)
    below: list[DisplayNode] = field(default_factory=list)
    roots_above: list[DisplayNode] = field(default_factory=list)
    roots_below: list[DisplayNode] = field(default_factory=list)
    letters: dict[DisplaySymbol, Fraction] = field(default_factory=dict)

    def multiply(self, term: SignedNode, exponent: Fraction = Fraction(1)) -> None:
        """Multiply by a signed node to a rational power."""
        odd = exponent.denominator == 1 and exponent.numerator % 2 == 1
        if exponent.denominator == 1:
            self.negative ^= term.negative and odd
            base = term.node
        else:
            base = ordering.signed(term)
        if isinstance(base, DisplayFraction) and exponent == 1:
            self.above.extend(factors_of(base.numerator))
            self.below.extend(factors_of(base.denominator))
        elif abs(exponent) == Fraction(1, 2):
            self._multiply_root(base, inverse=exponent < 0)
        else:
            size = abs(exponent)
            node = ordering.power_of(base, ordering.number_of(size.numerator, size.denominator))
            (self.above if exponent > 0 else self.below).append(node)

    def multiply_named(self, factors: Iterable[NamedFactor], exponent: Fraction) -> None:
        """Multiply by a power of an expression that has a name; powers of its letters add up."""
        for term, power in factors:
            total = power * exponent
            if not isinstance(term.node, DisplaySymbol) or total.denominator != 1:
                self.multiply(term, total)
                continue
            self.negative ^= term.negative and total.numerator % 2 == 1
            self.letters[term.node] = self.letters.get(term.node, Fraction(0)) + total

    def _take_letters(self) -> None:
        """Add up the powers of letters that names have brought, and those beside them."""
        for letter, total in self.letters.items():
            for nodes, sign in ((self.above, 1), (self.below, -1)):
                for node in [n for n in nodes if _letter_power(n)[0] == letter]:
                    nodes.remove(node)
                    total += sign * _letter_power(node)[1]
            if total:
                self.multiply(SignedNode(False, letter), total)

    def _multiply_root(self, radicand: DisplayNode, *, inverse: bool) -> None:
        above, below = (
            (radicand.numerator, radicand.denominator)
            if isinstance(radicand, DisplayFraction)
            else (radicand, ordering.number_of(1))
        )
        if inverse:
            above, below = below, above
        if radicand.traits.level <= Dependence.PARAMETER:
            self.roots_above.extend(factors_of(above))
            self.roots_below.extend(factors_of(below))
        elif not ordering.is_one(above):
            self.above.append(ordering.root_of(ordering.fraction_of(above, below)))
        else:
            self.below.append(ordering.root_of(below))

    def term(self, words: Vocabulary) -> SignedNode:
        """Return the gathered product as a signed node."""
        self._take_letters()
        self._close_roots()
        self._place_coefficient(words)
        node = ordering.fraction_of(
            ordering.product_of(self.above), ordering.product_of(self.below)
        )
        return SignedNode(self.negative, node)

    def _close_roots(self) -> None:
        above, below = ordering.product_of(self.roots_above), ordering.product_of(self.roots_below)
        if not ordering.is_one(above):
            self.above.append(ordering.root_of(ordering.fraction_of(above, below)))
        elif not ordering.is_one(below):
            self.below.append(ordering.root_of(below))

    def _place_coefficient(self, words: Vocabulary) -> None:
        """Show the number before the fraction, or in it where there is one: also in π/6."""
        value = self.coefficient
        if value == 0:
            self.above, self.below = [ordering.number_of(0)], []
            return
        if words.literal(value) is None and words.literal(1 / value) is not None:
            self.below.append(words.number(1 / value))
        elif (self.below or _only_pi(self.above)) and words.decimal(value) is None:
            self.above.append(words.number(Fraction(value.numerator)))
            self.below.append(words.number(Fraction(value.denominator)))
        else:
            self.above.append(words.number(value))


def _only_pi(factors: Sequence[DisplayNode]) -> bool:
    return bool(factors) and all(isinstance(f, DisplayPi) for f in factors)


def _letter_power(node: DisplayNode) -> tuple[DisplayNode, Fraction]:
    """Return a letter and its power; a node and 1 if it is no power of a letter by a number."""
    if isinstance(node, DisplayPower) and isinstance(node.exponent, DisplayNumber):
        return node.base, Fraction(node.exponent.numerator, node.exponent.denominator)
    return node, Fraction(1)


def _product(factors: Iterable[sympy.Expr], words: Vocabulary) -> SignedNode:
    """Sign and unsigned tree of a product of expressions."""
    gathered = _Factors()
    pending = _without_names(list(factors), words, gathered)
    while pending:
        factor = pending.pop()
        if factor in words.named:
            gathered.multiply_named(words.named[factor], Fraction(1))
        elif isinstance(factor, (sympy.Mul, sympy.UnevaluatedExpr)):
            pending.extend(factor.args)
        elif isinstance(factor, sympy.Rational):
            value = Fraction(int(factor.p), int(factor.q))
            gathered.negative ^= value < 0
            gathered.coefficient *= abs(value)
        elif isinstance(factor, sympy.Pow) and not isinstance(factor, sympy.exp):
            _multiply_power(gathered, factor, words)
        elif isinstance(factor, sympy.Add):
            gathered.multiply(_oriented(_term(factor, words), factor, words))
        else:
            gathered.multiply(_single(factor, words))
    return gathered.term(words)


def _without_names(
    factors: list[sympy.Expr], words: Vocabulary, gathered: _Factors
) -> list[sympy.Expr]:
    """The factors but for those whose product has a name, which is gathered in their place."""
    for powers, name in words.products:
        flat = [a for f in factors for a in sympy.Mul.make_args(f)]
        whole = sympy.Mul(*(f for f in flat if f.as_base_exp()[0] in powers))
        if not holds_powers(whole, powers):
            continue
        factors = [f for f in flat if f.as_base_exp()[0] not in powers]
        while holds_powers(whole, powers):
            gathered.multiply_named(name, Fraction(1))
            whole /= sympy.Mul(*(base**exponent for base, exponent in powers.items()))
        factors.append(whole)
    return factors


def _multiply_power(gathered: _Factors, expression: sympy.Expr, words: Vocabulary) -> None:
    base, exponent = expression.args
    if isinstance(exponent, sympy.Rational):
        power = Fraction(int(exponent.p), int(exponent.q))
        if base in words.named:
            gathered.multiply_named(words.named[base], power)
            return
        term = _term(base, words)
        if exponent.is_Integer:
            term = _oriented(term, base, words)
        gathered.multiply(term, power)
    else:
        node = ordering.power_of(_whole(base, words), _whole(exponent, words))
        gathered.multiply(SignedNode(False, node))


def _oriented(term: SignedNode, expression: sympy.Expr, words: Vocabulary) -> SignedNode:
    """Turn a difference of parameters so that the one declared first has a plus sign.

    One that would have more minus signs than before stays.
    """
    node = term.node
    is_turned = (
        isinstance(node, DisplaySum)
        and node.traits.level == Dependence.PARAMETER
        and expression not in words.sums
        and 2 * sum(t.negative for t in node.terms) >= len(node.terms)
        and ordering.pivot_is_negative(node)
    )
    return SignedNode(not term.negative, _negated(node)) if is_turned else term


# -- symbols, constants and functions -----------------------------------------


def _single(expression: sympy.Expr, words: Vocabulary) -> SignedNode:
    """Sign and tree of a symbol, a function or a constant."""
    if expression in words.atoms:
        return SignedNode(False, words.atoms[expression])
    if isinstance(expression, sympy.Symbol):
        raise _unprintable(f"symbol '{expression}'")
    if expression is sympy.pi:
        return SignedNode(False, ordering.pi())
    if expression is sympy.E:
        return SignedNode(False, ordering.call_of("exp", (ordering.number_of(1),)))
    if isinstance(expression, Cases):
        return _called(PIECEWISE, list(_pieces(expression, words)))
    if type(expression) in _RECIPROCALS:
        base = _RECIPROCALS[type(expression)](*expression.args, evaluate=False)
        return _product((sympy.Pow(base, -1, evaluate=False),), words)
    if is_unknown(expression):
        function, order = name_and_order(expression)
        arguments = tuple(_whole(a, words) for a in arguments_of(expression))
        latex = words.functions.get(function)
        return SignedNode(False, ordering.call_of(function, arguments, order, latex))
    name = FUNCTION_NAMES.get(type(expression))
    if name is None or (name == "heaviside" and expression.args[1] != sympy.S.Half):
        raise _unprintable(f"'{type(expression).__name__}'")
    if name in ODD_FUNCTIONS or name in EVEN_FUNCTIONS:
        (argument,) = expression.args
        parts = _parts(argument)
        node = _whole(
            sympy.Add(*(parts * a for a in argument.args)) if parts > 1 else argument, words
        )
        return _called(name, [node], parts)
    arguments = expression.args[:1] if name == "heaviside" else expression.args
    return _called(name, [_whole(a, words) for a in arguments])


def _pieces(expression: sympy.Expr, words: Vocabulary) -> Iterator[DisplayNode]:
    """Yield the pieces of a function in cases, then its value where no condition holds."""
    while isinstance(expression, Cases):
        value, side, strict, expression = expression.args
        yield ordering.piece_of(_whole(value, words), _whole(side, words), strict == 1)
    yield _whole(expression, words)


def _parts(argument: sympy.Expr) -> int:
    """n of a sum of n-th parts: ``α/2 + β/2`` shows as ``½ (α + β)``."""
    if not isinstance(argument, sympy.Add):
        return 1
    denominators = {int(a.as_coeff_Mul(rational=True)[0].q) for a in argument.args}
    return denominators.pop() if len(denominators) == 1 and max(denominators) <= _MOST_PARTS else 1


def _called(name: str, arguments: list[DisplayNode], parts: int = 1) -> SignedNode:
    """Return a function, with the sign of its argument taken out where it is odd or even.

    ``parts``: the argument is to be divided by this number.
    """
    if name in _SYMMETRIC:
        arguments.sort(key=lambda node: (node.traits.level, node.traits.degree, node.traits.text))
    negative = False
    if (name in ODD_FUNCTIONS or name in EVEN_FUNCTIONS) and ordering.pivot_is_negative(
        arguments[0]
    ):
        arguments = [_negated(arguments[0])]
        negative = name in ODD_FUNCTIONS
    if parts > 1:
        arguments = [ordering.product_of([ordering.number_of(1, parts), arguments[0]])]
    return SignedNode(negative, ordering.call_of(name, tuple(arguments)))


def _unprintable(what: str) -> InternalError:
    return InternalError(
        Problem(f"no exact way to print {what} of a derived expression", rule="unprintable")
    )
