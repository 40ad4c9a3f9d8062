"""Common factors taken out of sums: a·x + a·y becomes a·(x + y).

A greedy variant of Horner's rule for many variables: the factor that most terms
of a sum share is taken out, again and again. Only products that nothing else
uses take part, since the others must be computed anyway.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import TypeAlias

from lagrange_cli.program.graph.common_subexpressions import LONGEST_GROUP
from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.graph.value_graph import ONE, ProductNode, ScaledNode, SumNode, ValueGraph

_Factor: TypeAlias = tuple[int, int]
"""A node and the sign of its exponent."""


def factor_sums(values: ValueGraph, order: Sequence[int]) -> bool:
    """Factor the sums among the nodes ``order``, parts before wholes; return true if any changed.

    Numbers of nodes keep their meaning.
    """
    uses = Counter(chain.from_iterable(map(values.parts, order)))
    changed = False
    for number in order:
        node = values.nodes[number]
        if isinstance(node, SumNode) and 1 < len(node.terms) <= LONGEST_GROUP:
            terms = _factored(values, dict(node.terms), uses)
            rewritten = SumNode(tuple(sorted(terms.items())))
            changed = changed or rewritten != node
            values.nodes[number] = rewritten
    return changed


def _factored(
    values: ValueGraph, terms: dict[int, Coefficient], uses: Counter[int]
) -> dict[int, Coefficient]:
    """The terms of a sum after every factor that several share is taken out."""
    while True:
        holders: dict[_Factor, list[int]] = {}
        for number in terms:
            for factor in _factors(values, number, uses):
                holders.setdefault(factor, []).append(number)
        shared = [(-len(holders[f]), values.rank[f[0]], f) for f in holders if len(holders[f]) > 1]
        if not shared:
            return terms
        _, _, factor = min(shared)
        left = [(terms.pop(number), _without(values, number, factor)) for number in holders[factor]]
        coefficient, number = _times(values, factor, _sum(values, left, uses))
        terms[number] = terms.get(number, 0) + coefficient
        if not terms[number]:
            del terms[number]


def _factors(values: ValueGraph, number: int, uses: Counter[int]) -> list[_Factor]:
    """List the factors that can be taken out of a term.

    The term must be used by this sum alone, unless it is itself the factor.
    """
    node = values.nodes[number]
    whole = [] if number == ONE else [(number, 1)]
    if isinstance(node, ProductNode) and uses[number] <= 1:
        return [*whole, *((base, 1 if e > 0 else -1) for base, e in node.factors)]
    return whole


def _without(values: ValueGraph, number: int, factor: _Factor) -> int:
    """The node that remains of a term when a factor is taken out."""
    base, sign = factor
    if number == base and sign > 0:
        return ONE
    node = values.nodes[number]
    assert isinstance(node, ProductNode)
    powers = [((1, b), e - sign * (b == base)) for b, e in node.factors]
    return values.multiply(powers)[1]


def _sum(values: ValueGraph, terms: Iterable[ScaledNode], uses: Counter[int]) -> ScaledNode:
    """The sum of what remains, factored in turn."""
    scale, number = values.add(terms)
    node = values.nodes[number]
    if isinstance(node, SumNode):
        inner = _factored(values, dict(node.terms), uses)
        scale2, number = values.add((c, n) for n, c in inner.items())
        scale *= scale2
    uses[number] += 1
    return scale, number


def _times(values: ValueGraph, factor: _Factor, remainder: ScaledNode) -> ScaledNode:
    base, sign = factor
    return values.multiply([((1, base), sign), (remainder, 1)])
