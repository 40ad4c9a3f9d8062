"""Textbook order of factors and terms, and building of ordered nodes.

Products: number, parameters (G, masses, g, the others in order of declaration; a sum of them
where its first symbol would stand), time, coordinates, sums that move, velocities,
accelerations, roots, functions, trigonometric ones last: ``m g l sin θ``,
``(1 + 4 a² x²) ẍ``, ``2 l1 l2 θ̇1 θ̇2 cos(θ1 - θ2)``. Nothing that a function does not hold
stands behind it. Sums: numbers, the highest derivative first, squares before cross terms,
powers of coordinates ascending, functions last, else by order of declaration:
``1 + 4 a² x²``, ``M + m``; a positive term leads where there is one: ``r - l``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lagrange_cli.notation.term_order import TRIGONOMETRIC, key_beside, term_key, value_of
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNode,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRange,
    DisplayRate,
    DisplayRoot,
    DisplaySeries,
    DisplaySum,
    DisplaySymbol,
    OrderTraits,
    Role,
    SignedNode,
    as_terms,
    factors_of,
)


def number_of(numerator: int, denominator: int = 1, literal: str | None = None) -> DisplayNumber:
    text = f"{numerator:020d}/{denominator:020d}"
    return DisplayNumber(
        numerator, denominator, OrderTraits(Dependence.NUMBER, 0, 0, text), literal
    )


def pi() -> DisplayPi:
    return DisplayPi(OrderTraits(Dependence.NUMBER, 0, 0, "pi"))


def symbol_of(
    name: str,
    level: Dependence,
    rank: int,
    *,
    order: int = 0,
    latex: str | None = None,
    role: Role = Role.OTHER,
) -> DisplaySymbol:
    """Return a symbol with its place in the order of declaration, and its role in products."""
    degree = 1 if level in (Dependence.TIME, Dependence.COORDINATE) else 0
    return DisplaySymbol(name, order, latex, OrderTraits(level, degree, 0, f"{rank:06d}"), role)


def spelled_symbol(text: str, level: Dependence, rank: int) -> DisplaySymbol:
    """Return a symbol that is in the letters of the format already."""
    return replace(symbol_of(text, level, rank), spelled=True)


def labelled_symbol(label: object, level: Dependence, rank: int) -> DisplaySymbol:
    """Return a symbol that a writer puts into the letters of its format."""
    return replace(symbol_of("", level, rank), label=label)


def start_symbol(name: str, rank: int, latex: str | None = None) -> DisplaySymbol:
    """The start of a coordinate, as a constant: it stands behind the coordinate of this rank."""
    traits = OrderTraits(Dependence.PARAMETER, 1, 0, f"{rank:06d}~")
    return DisplaySymbol(name, 0, latex, traits, Role.START)


def abbreviation_of(
    name: str,
    level: Dependence,
    rank: int,
    latex: str | None = None,
    *,
    is_last: bool = False,
) -> DisplaySymbol:
    """Return a symbol for an expression of some dependence; one that moves counts as a function.

    ``is_last``: it stands behind other factors, as a trigonometric function that moves does.
    """
    level = min(level, Dependence.COORDINATE)
    moves = int(level >= Dependence.TIME)
    # Behind the parameters.
    traits = OrderTraits(level, 0, moves, f"{rank + 500_000:06d}")
    role = Role.TRIGONOMETRIC if is_last and moves else Role.OTHER
    return DisplaySymbol(name, 0, latex, traits, role, abbreviates=True)


def power_of(base: DisplayNode, exponent: DisplayNode) -> DisplayNode:
    """``base ^ exponent``; an exponent 1 leaves the base."""
    if is_one(exponent):
        return base
    inner = base.traits
    is_number = isinstance(exponent, DisplayNumber)
    size = value_of(exponent) if isinstance(exponent, DisplayNumber) else 0
    is_root = size % 1 != 0 and inner.level >= Dependence.TIME
    moves = exponent.traits.level >= Dependence.TIME or is_root
    return DisplayPower(
        base,
        exponent,
        OrderTraits(
            max(inner.level, exponent.traits.level),
            inner.degree * size,
            inner.functions * (size if is_number else 1) + bool(moves),
            f"{inner.text}^({exponent.traits.text})",
        ),
    )


def root_of(radicand: DisplayNode) -> DisplayRoot:
    inner = radicand.traits
    functions = int(inner.level >= Dependence.TIME)
    return DisplayRoot(radicand, OrderTraits(inner.level, 0, functions, f"sqrt({inner.text})"))


def call_of(
    function: str,
    arguments: tuple[DisplayNode, ...],
    order: int | None = None,
    latex: str | None = None,
) -> DisplayCall:
    level = max(a.traits.level for a in arguments)
    # sin before cos before tan is the textbook's order, not the alphabet's.
    rank = TRIGONOMETRIC.index(function) if function in TRIGONOMETRIC else len(TRIGONOMETRIC)
    text = f"{rank}{function}{order or ''}({','.join(a.traits.text for a in arguments)})"
    traits = OrderTraits(level, 0, int(level >= Dependence.TIME), text)
    return DisplayCall(function, arguments, traits, order, latex)


def piece_of(value: DisplayNode, side: DisplayNode, strict: bool) -> DisplayCall:
    """Return a value under the condition that another is positive, or not negative.

    The condition has what moves on its left, where the first term has no minus sign: ``t < 1``.
    """
    terms = as_terms(side)
    moving = [t for t in terms if t.node.traits.level > Dependence.PARAMETER]
    left = moving or list(terms)
    right = [SignedNode(not t.negative, t.node) for t in terms if t not in left]
    relation = ">" if strict else ">="
    if all(t.negative for t in left):
        left, right = ([SignedNode(not t.negative, t.node) for t in ts] for ts in (left, right))
        relation = relation.replace(">", "<")
    return call_of(relation, (value, sum_of(left), sum_of(right)))


def series_of(body: DisplayNode, ranges: tuple[DisplayRange, ...]) -> DisplaySeries:
    """Return the sum of a body over indices, which stands like a sum of its terms."""
    inner = body.traits
    text = f"sum({inner.text},{','.join(r.letter + r.first for r in ranges)})"
    return DisplaySeries(body, ranges, OrderTraits(inner.level, inner.degree, 0, text))


def rate_of(quantity: DisplayNode) -> DisplayRate:
    """Return the time derivative of a quantity, not carried out; it counts as an acceleration."""
    traits = OrderTraits(Dependence.ACCELERATION, 0, 0, f"d({quantity.traits.text})")
    return DisplayRate(quantity, traits)


def is_one(node: DisplayNode) -> bool:
    return isinstance(node, DisplayNumber) and node.numerator == node.denominator


def _is_zero(node: DisplayNode) -> bool:
    return isinstance(node, DisplayNumber) and node.numerator == 0


def product_of(factors: list[DisplayNode]) -> DisplayNode:
    """Return the product of unsigned factors in textbook order; ones are dropped."""
    flat = [f for factor in factors for f in factors_of(factor) if not is_one(f)]
    if not flat:
        return number_of(1)
    if len(flat) == 1:
        return flat[0]
    ordered = sorted(flat, key=key_beside(flat))
    return DisplayProduct(
        tuple(ordered),
        OrderTraits(
            max(f.traits.level for f in ordered),
            sum(f.traits.degree for f in ordered),
            sum(f.traits.functions for f in ordered),
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
            above.functions + below.functions,
            f"{above.text}/{below.text}",
        ),
    )


def _ordered(terms: list[SignedNode], leading: bool) -> list[SignedNode]:
    rising = sorted(terms, key=term_key)
    if not leading or not rising[0].negative or all(t.negative for t in rising):
        return rising
    falling = sorted(terms, key=lambda term: term_key(term).falling())
    if not falling[0].negative:
        return falling
    leader = next(i for i, t in enumerate(rising) if not t.negative)
    return [rising[leader], *rising[:leader], *rising[leader + 1 :]]


def sum_of(terms: list[SignedNode], *, ordered: bool = False, leading: bool = True) -> DisplayNode:
    """Return the sum of signed terms, in textbook order unless they are ``ordered``.

    Sums among the terms are spliced in; no terms give 0. Terms that others precede, which are
    not ``leading``, need none that is positive to begin with.
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
    arranged = flat if ordered else _ordered(flat, leading)
    text = "+".join(("-" if t.negative else "") + t.node.traits.text for t in arranged)
    return DisplaySum(
        tuple(arranged),
        OrderTraits(
            max(t.node.traits.level for t in arranged),
            min(t.node.traits.degree for t in arranged),
            min(1, max(t.node.traits.functions for t in arranged)),
            f"({text})",
        ),
    )


def rising_first(terms: list[SignedNode], own_terms: Sequence[int]) -> list[SignedNode]:
    """Return terms with a positive acceleration first, of ``own_terms`` if one of these is.

    They are unchanged if the first is positive; ``own_terms`` are places among them.
    """
    rising = [
        k
        for k, term in enumerate(terms)
        if not term.negative and term.node.traits.level == Dependence.ACCELERATION
    ]
    if not rising or not terms[0].negative:
        return terms
    leader = next((k for k in own_terms if k in rising), rising[0])
    return [terms[leader], *terms[:leader], *terms[leader + 1 :]]


def signed(term: SignedNode) -> DisplayNode:
    """Return a signed term as a node of its own."""
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
    return min(pivots, key=term_key).negative
