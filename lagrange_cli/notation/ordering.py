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
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRoot,
    DisplaySum,
    DisplaySymbol,
    OrderTraits,
    SignedNode,
    as_terms,
    factors_of,
)

_FactorKey: TypeAlias = tuple[int, str, float]
_TermKey: TypeAlias = tuple[int, int, bool, float, bool, tuple[_FactorKey, ...], str]


def number_of(numerator: int, denominator: int = 1, literal: str | None = None) -> DisplayNumber:
    text = f"{numerator:020d}/{denominator:020d}"
    return DisplayNumber(
        numerator, denominator, OrderTraits(Dependence.NUMBER, 0, False, text), literal
    )


def pi() -> DisplayPi:
    return DisplayPi(OrderTraits(Dependence.NUMBER, 0, False, "pi"))


def symbol_of(
    name: str, level: Dependence, rank: int, *, order: int = 0, latex: str | None = None
) -> DisplaySymbol:
    """A symbol with its place in the order of declaration."""
    degree = 1 if level in (Dependence.TIME, Dependence.COORDINATE) else 0
    return DisplaySymbol(name, order, latex, OrderTraits(level, degree, False, f"{rank:06d}"))


def power_of(base: DisplayNode, exponent: DisplayNode) -> DisplayNode:
    """``base ^ exponent``; an exponent 1 leaves the base."""
    if is_one(exponent):
        return base
    inner = base.traits
    degree = inner.degree * _value(exponent) if isinstance(exponent, DisplayNumber) else 0
    return DisplayPower(
        base,
        exponent,
        OrderTraits(
            max(inner.level, exponent.traits.level),
            degree,
            inner.functional or exponent.traits.level >= Dependence.TIME,
            f"{inner.text}^({exponent.traits.text})",
        ),
    )


def root_of(radicand: DisplayNode) -> DisplayRoot:
    inner = radicand.traits
    functional = inner.level >= Dependence.TIME
    return DisplayRoot(radicand, OrderTraits(inner.level, 0, functional, f"sqrt({inner.text})"))


def call_of(
    function: str,
    arguments: tuple[DisplayNode, ...],
    order: int | None = None,
    latex: str | None = None,
) -> DisplayCall:
    level = max(a.traits.level for a in arguments)
    # sin before cos before tan is the textbook's order, not the alphabet's.
    rank = {"sin": "1", "cos": "2", "tan": "3"}.get(function, "4")
    text = f"{rank}{function}{order or ''}({','.join(a.traits.text for a in arguments)})"
    traits = OrderTraits(level, 0, level >= Dependence.TIME, text)
    return DisplayCall(function, arguments, traits, order, latex)


def is_one(node: DisplayNode) -> bool:
    return isinstance(node, DisplayNumber) and node.numerator == node.denominator


def _is_zero(node: DisplayNode) -> bool:
    return isinstance(node, DisplayNumber) and node.numerator == 0


def _value(exponent: DisplayNumber) -> float:
    return exponent.numerator / exponent.denominator


#: The place of a sum of coordinates in a product.
_COORDINATE_SUM = 7

# -- products -----------------------------------------------------------------


def _category(node: DisplayNode) -> int:
    """The place of a factor's kind in a product."""
    base = node.base if isinstance(node, DisplayPower) else node
    level = node.traits.level
    if level == Dependence.NUMBER:
        return 0 if isinstance(node, DisplayNumber) else 1
    if level >= Dependence.VELOCITY:
        compound = 1 if isinstance(base, (DisplaySum, DisplayCall, DisplayRoot)) else 0
        return 9 + 2 * (level - Dependence.VELOCITY) + compound
    if isinstance(base, DisplaySum):
        return 2 if level == Dependence.PARAMETER else _COORDINATE_SUM
    if isinstance(base, (DisplayCall, DisplayRoot)):
        return 4 if level == Dependence.PARAMETER else 8
    return {Dependence.PARAMETER: 3, Dependence.TIME: 5}.get(level, 6)


def _factor_key(node: DisplayNode) -> _FactorKey:
    """Category, then order of declaration, then the higher power first."""
    if isinstance(node, DisplayPower) and isinstance(node.exponent, DisplayNumber):
        return _category(node), node.base.traits.text, -_value(node.exponent)
    return _category(node), node.traits.text, -1


def product_of(factors: list[DisplayNode]) -> DisplayNode:
    """The product of unsigned factors in textbook order; ones are dropped."""
    flat = [f for factor in factors for f in factors_of(factor) if not is_one(f)]
    if not flat:
        return number_of(1)
    ordered = sorted(flat, key=_factor_key)
    if len(ordered) == 1:
        return ordered[0]
    return DisplayProduct(
        tuple(ordered),
        OrderTraits(
            max(f.traits.level for f in ordered),
            sum(f.traits.degree for f in ordered),
            any(f.traits.functional for f in ordered),
            "*".join(f.traits.text for f in ordered),
        ),
    )


def fraction_of(numerator: DisplayNode, denominator: DisplayNode) -> DisplayNode:
    """``numerator / denominator``; a denominator 1 leaves the numerator."""
    if is_one(denominator):
        return numerator
    above, below = numerator.traits, denominator.traits
    return DisplayFraction(
        numerator,
        denominator,
        OrderTraits(
            max(above.level, below.level),
            above.degree - below.degree,
            above.functional or below.functional,
            f"{above.text}/{below.text}",
        ),
    )


# -- sums ---------------------------------------------------------------------


def _term_key(term: SignedNode) -> _TermKey:
    node = term.node
    traits = node.traits
    numerator = node.numerator if isinstance(node, DisplayFraction) else node
    factors = tuple(
        _factor_key(f)
        for f in factors_of(numerator)
        if not isinstance(f, (DisplayNumber, DisplayPi))
    )
    moving = -int(traits.level) if traits.level >= Dependence.VELOCITY else 0
    is_number = 0 if traits.level == Dependence.NUMBER else 1
    compound = any(category == _COORDINATE_SUM for category, _, _ in factors)
    return is_number, moving, traits.functional, traits.degree, compound, factors, traits.text


def _falling_key(term: SignedNode) -> _TermKey:
    """The same order with numbers, the unmoving and low powers last."""
    is_number, moving, functional, degree, compound, factors, text = _term_key(term)
    return -is_number, -moving, not functional, -degree, not compound, factors, text


def _ordered(terms: list[SignedNode]) -> list[SignedNode]:
    rising = sorted(terms, key=_term_key)
    if not rising[0].negative or all(t.negative for t in rising):
        return rising
    falling = sorted(terms, key=_falling_key)
    if not falling[0].negative:
        return falling
    leader = next(i for i, t in enumerate(rising) if not t.negative)
    return [rising[leader], *rising[:leader], *rising[leader + 1 :]]


def sum_of(terms: list[SignedNode], *, ordered: bool = False) -> DisplayNode:
    """The sum of signed terms, in textbook order unless they are ``ordered``.

    Sums among the terms are spliced in; no terms give 0.
    """
    flat = [
        SignedNode(inner.negative != term.negative, inner.node)
        for term in terms
        for inner in as_terms(term.node)
        if not _is_zero(inner.node)
    ]
    if not flat:
        return number_of(0)
    if len(flat) == 1 and not flat[0].negative:
        return flat[0].node
    arranged = flat if ordered else _ordered(flat)
    text = "+".join(("-" if t.negative else "") + t.node.traits.text for t in arranged)
    return DisplaySum(
        tuple(arranged),
        OrderTraits(
            max(t.node.traits.level for t in arranged),
            min(t.node.traits.degree for t in arranged),
            any(t.node.traits.functional for t in arranged),
            f"({text})",
        ),
    )


def signed(term: SignedNode) -> DisplayNode:
    """A signed term as a node of its own."""
    return sum_of([term]) if term.negative else term.node


def pivot_is_negative(node: DisplayNode) -> bool:
    """Tell whether the term that a reader looks at first has a minus sign.

    That is the one of the highest level, of those the first in order: in
    ``ω t - φ`` with a coordinate φ, it is φ.
    """
    if not isinstance(node, DisplaySum):
        return False
    level = node.traits.level
    pivots = [t for t in node.terms if t.node.traits.level == level]
    return min(pivots, key=_term_key).negative
