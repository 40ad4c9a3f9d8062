"""Textbook order of factors and terms, and building of ordered nodes.

Products: number, sums of parameters, parameters in order of declaration,
time, coordinates, other sums, functions, then velocities and accelerations:
``(1 + 4 a² x²) ẍ``, ``m g l sin θ``. Sums: numbers, what moves before what
does not, powers of coordinates ascending, functions last, else by order of
declaration: ``1 + 4 a² x²``, ``M + m``; a positive term leads where there is
one: ``r - l``.
"""

from __future__ import annotations

from typing import TypeAlias

from lagrange_cli.notation.tree import (
    Atom,
    Call,
    Fraction,
    Level,
    Node,
    Number,
    Pi,
    Power,
    Product,
    Root,
    Sum,
    Term,
    Traits,
    as_terms,
    factors_of,
)

__all__ = [
    "atom",
    "call",
    "fraction",
    "is_one",
    "number",
    "one",
    "pi",
    "pivot_is_negative",
    "power",
    "product",
    "root",
    "signed",
    "sum_of",
]

_FactorKey: TypeAlias = tuple[int, str, float]
_TermKey: TypeAlias = tuple[int, int, bool, float, bool, tuple[_FactorKey, ...], str]


def number(numerator: int, denominator: int = 1, literal: str | None = None) -> Number:
    text = f"{numerator:020d}/{denominator:020d}"
    return Number(numerator, denominator, Traits(Level.NUMBER, 0, False, text), literal)


def one() -> Number:
    return number(1)


def pi() -> Pi:
    return Pi(Traits(Level.NUMBER, 0, False, "pi"))


def atom(name: str, level: Level, rank: int, *, order: int = 0, latex: str | None = None) -> Atom:
    """A symbol with its place in the order of declaration."""
    degree = 1 if level in (Level.TIME, Level.COORDINATE) else 0
    return Atom(name, order, latex, Traits(level, degree, False, f"{rank:06d}"))


def power(base: Node, exponent: Node) -> Node:
    """``base ^ exponent``; an exponent 1 leaves the base."""
    if is_one(exponent):
        return base
    inner = base.traits
    degree = inner.degree * _value(exponent) if isinstance(exponent, Number) else 0
    return Power(
        base,
        exponent,
        Traits(
            max(inner.level, exponent.traits.level),
            degree,
            inner.functional or exponent.traits.level >= Level.TIME,
            f"{inner.text}^({exponent.traits.text})",
        ),
    )


def root(radicand: Node) -> Root:
    inner = radicand.traits
    functional = inner.level >= Level.TIME
    return Root(radicand, Traits(inner.level, 0, functional, f"sqrt({inner.text})"))


def call(function: str, arguments: tuple[Node, ...]) -> Call:
    level = max(a.traits.level for a in arguments)
    # sin before cos before tan is the textbook's order, not the alphabet's.
    rank = {"sin": "1", "cos": "2", "tan": "3"}.get(function, "4")
    text = f"{rank}{function}({','.join(a.traits.text for a in arguments)})"
    return Call(function, arguments, Traits(level, 0, level >= Level.TIME, text))


def is_one(node: Node) -> bool:
    return isinstance(node, Number) and node.numerator == node.denominator


def _is_zero(node: Node) -> bool:
    return isinstance(node, Number) and node.numerator == 0


def _value(exponent: Number) -> float:
    return exponent.numerator / exponent.denominator


#: The place of a sum of coordinates in a product.
_COORDINATE_SUM = 7

# -- products -----------------------------------------------------------------


def _category(node: Node) -> int:
    """The place of a factor's kind in a product."""
    base = node.base if isinstance(node, Power) else node
    level = node.traits.level
    if level == Level.NUMBER:
        return 0 if isinstance(node, Number) else 1
    if level >= Level.VELOCITY:
        compound = 1 if isinstance(base, (Sum, Call, Root)) else 0
        return 9 + 2 * (level - Level.VELOCITY) + compound
    if isinstance(base, Sum):
        return 2 if level == Level.PARAMETER else _COORDINATE_SUM
    if isinstance(base, (Call, Root)):
        return 4 if level == Level.PARAMETER else 8
    return {Level.PARAMETER: 3, Level.TIME: 5}.get(level, 6)


def _factor_key(node: Node) -> _FactorKey:
    """Category, then order of declaration, then the higher power first."""
    if isinstance(node, Power) and isinstance(node.exponent, Number):
        return _category(node), node.base.traits.text, -_value(node.exponent)
    return _category(node), node.traits.text, -1


def product(factors: list[Node]) -> Node:
    """The product of unsigned factors in textbook order; ones are dropped."""
    flat = [f for factor in factors for f in factors_of(factor) if not is_one(f)]
    if not flat:
        return one()
    ordered = sorted(flat, key=_factor_key)
    if len(ordered) == 1:
        return ordered[0]
    return Product(
        tuple(ordered),
        Traits(
            max(f.traits.level for f in ordered),
            sum(f.traits.degree for f in ordered),
            any(f.traits.functional for f in ordered),
            "*".join(f.traits.text for f in ordered),
        ),
    )


def fraction(numerator: Node, denominator: Node) -> Node:
    """``numerator / denominator``; a denominator 1 leaves the numerator."""
    if is_one(denominator):
        return numerator
    above, below = numerator.traits, denominator.traits
    return Fraction(
        numerator,
        denominator,
        Traits(
            max(above.level, below.level),
            above.degree - below.degree,
            above.functional or below.functional,
            f"{above.text}/{below.text}",
        ),
    )


# -- sums ---------------------------------------------------------------------


def _term_key(term: Term) -> _TermKey:
    node = term.node
    traits = node.traits
    numerator = node.numerator if isinstance(node, Fraction) else node
    factors = tuple(
        _factor_key(f) for f in factors_of(numerator) if not isinstance(f, (Number, Pi))
    )
    moving = -int(traits.level) if traits.level >= Level.VELOCITY else 0
    is_number = 0 if traits.level == Level.NUMBER else 1
    compound = any(category == _COORDINATE_SUM for category, _, _ in factors)
    return is_number, moving, traits.functional, traits.degree, compound, factors, traits.text


def _falling_key(term: Term) -> _TermKey:
    """The same order with numbers, the unmoving and low powers last."""
    is_number, moving, functional, degree, compound, factors, text = _term_key(term)
    return -is_number, -moving, not functional, -degree, not compound, factors, text


def _ordered(terms: list[Term]) -> list[Term]:
    rising = sorted(terms, key=_term_key)
    if not rising[0].negative or all(t.negative for t in rising):
        return rising
    falling = sorted(terms, key=_falling_key)
    if not falling[0].negative:
        return falling
    leader = next(i for i, t in enumerate(rising) if not t.negative)
    return [rising[leader], *rising[:leader], *rising[leader + 1 :]]


def sum_of(terms: list[Term], *, ordered: bool = False) -> Node:
    """The sum of signed terms, in textbook order unless they are ``ordered``.

    Sums among the terms are spliced in; no terms give 0.
    """
    flat = [
        Term(inner.negative != term.negative, inner.node)
        for term in terms
        for inner in as_terms(term.node)
        if not _is_zero(inner.node)
    ]
    if not flat:
        return number(0)
    if len(flat) == 1 and not flat[0].negative:
        return flat[0].node
    arranged = flat if ordered else _ordered(flat)
    text = "+".join(("-" if t.negative else "") + t.node.traits.text for t in arranged)
    return Sum(
        tuple(arranged),
        Traits(
            max(t.node.traits.level for t in arranged),
            min(t.node.traits.degree for t in arranged),
            any(t.node.traits.functional for t in arranged),
            f"({text})",
        ),
    )


def signed(term: Term) -> Node:
    """A signed term as a node of its own."""
    return sum_of([term]) if term.negative else term.node


def pivot_is_negative(node: Node) -> bool:
    """Whether the term that a reader looks at first has a minus sign.

    That is the one of the highest level, of those the first in order: in
    ``ω t - φ`` with a coordinate φ, it is φ.
    """
    if not isinstance(node, Sum):
        return False
    level = node.traits.level
    pivots = [t for t in node.terms if t.node.traits.level == level]
    return min(pivots, key=_term_key).negative
