"""Poles of expressions along motions, proven by sign changes of denominators.

An expression is written as a quotient N/D, D as a product. Where a factor of D changes its sign
between two places, and neither N nor another factor vanishes between them, N/D has no bound there:
to both sides if the factor stands in D an odd number of times, else to the side of the sign of N
over the others. A zero without a change of sign, as of 1 − cos t, proves nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.dense_motion import Numbers
from lagrange_cli.simulate.ensemble.reduce.expression_graph import Domain, Flags, Node, evaluated
from lagrange_cli.simulate.ensemble.reduce.motion_series import (
    Intervals,
    MotionSeries,
    in_middle,
    over_whole,
)

#: Parts into which intervals are divided, and divisions of a panel.
_PARTS, _DIVISIONS = 4, 16

#: Operations that jump: they change their sign without a zero.
_JUMPS = {"sign", "atan2"}

#: Numerator, and the factors of the denominator with the times that they stand there.
_Quotient = tuple[Node | float, Counter[Node]]


def rises_beyond_bounds(along: MotionSeries, value: Node | float, members: Flags) -> Flags:
    """Flag those of some members along whose motions an expression is proven to have no bound.

    ``value``: its graph. The errors of the motions are counted.
    """
    proven = np.zeros(len(members), bool)
    numerator, factors = _Quotients().quotient(value)
    for factor, count in factors.items():
        others = _times(numerator, factors - Counter({factor: count}))
        is_size = factor.operation == "abs"
        changing = factor.arguments[0] if is_size else factor
        if isinstance(changing, Node) and not _jumps(along, changing):
            both_sides = count % 2 == 1 and not is_size
            left = np.flatnonzero(members & ~proven)
            with np.errstate(all="ignore"):
                proven |= _has_pole(along, left, changing, others, both_sides=both_sides)
    return proven


def _has_pole(
    along: MotionSeries, members: Numbers, factor: Node, others: Node | float, *, both_sides: bool
) -> Flags:
    """Flag the members for which a factor changes its sign where others keep theirs."""
    proven = np.zeros(len(along.motions), bool)
    intervals = Intervals.whole(len(proven), len(along.panels.edges))
    intervals = intervals.only(np.isin(intervals.member, members))
    for _ in range(_DIVISIONS):
        low, high = _range(along, [factor, others], intervals)
        ends = [
            replace(intervals, left=end, right=end) for end in (intervals.left, intervals.right)
        ]
        first, last = (_range(along, [factor], end) for end in ends)
        changes = (first[1] < 0) & (last[0] > 0) | (first[0] > 0) & (last[1] < 0)
        changes = changes[0] & np.isfinite(low[0]) & np.isfinite(high[0])
        keeps = (low[1] > 0) | (both_sides & (high[1] < 0))
        proven[intervals.member[changes & keeps]] = True
        may_vanish = (low[0] <= 0) & (high[0] >= 0) & ~proven[intervals.member]
        intervals = intervals.only(may_vanish).divided(_PARTS)
        if not len(intervals):
            break
    return proven


def _range(
    along: MotionSeries, graphs: Sequence[Node | float], intervals: Intervals
) -> tuple[Array, Array]:
    """Bound graphs over intervals, shape (graphs, m); infinite where one may have no value."""
    taylor, domain = along.taylor(intervals), Domain.whole(len(intervals))
    is_place = (intervals.left == intervals.right).all()
    state = in_middle(taylor, 1) if is_place else over_whole(taylor, 1)
    series = evaluated(graphs, along.leaves(intervals, state, along.errors(intervals)), domain)
    low, high = np.array([s.low[0] for s in series]), np.array([s.high[0] for s in series])
    return np.where(domain.partly, -np.inf, low), np.where(domain.partly, np.inf, high)


def _jumps(along: MotionSeries, node: Node) -> bool:
    """Tell if a graph may jump: by its operations, or by recorded inputs."""
    seen, stack = set(along.outputs.inputs), [node]
    while stack:
        part = stack.pop()
        if part.operation in _JUMPS or part in along.outputs.inputs:
            return True
        stack += [a for a in part.arguments if isinstance(a, Node) and a not in seen]
        seen.update(stack)
    return False


class _Quotients:
    """Quotients of graphs, of their shared parts once."""

    def __init__(self) -> None:
        self._known: dict[Node, _Quotient] = {}

    def quotient(self, value: Node | float) -> _Quotient:
        """Return numerator and denominator."""
        if not isinstance(value, Node):
            return value, Counter()
        if value not in self._known:
            self._known[value] = self._made(value)
        return self._known[value]

    def _made(self, node: Node) -> _Quotient:
        match node.operation, [self.quotient(a) for a in node.arguments]:
            case "+", [(a, below), (b, under)]:
                common = below | under
                return _times(a, common - below) + _times(b, common - under), common
            case "-", [(a, below), (b, under)]:
                common = below | under
                return _times(a, common - below) - _times(b, common - under), common
            case "*", [(a, below), (b, under)]:
                return _product(a, b), below + under
            case "/", [(a, below), (b, under)] if isinstance(b, Node):
                return _times(a, under), below + _factors(b)
            case "neg", [(a, below)]:
                return -a, below
            case "square", [(a, below)]:
                return _product(a, a), below + below
            case "abs", [(a, below)]:
                size = Node("abs", a) if isinstance(a, Node) else abs(a)
                return size, Counter({abs(factor): k for factor, k in below.items()})
            case "tan", _:
                return Node("sin", *node.arguments), Counter([Node("cos", *node.arguments)])
        return node, Counter()


def _factors(node: Node) -> Counter[Node]:
    """Return the factors of a product."""
    match node.operation, node.arguments:
        case "*", (Node() as a, Node() as b):
            return _factors(a) + _factors(b)
        case "square", (Node() as a,):
            return _factors(a) + _factors(a)
    return Counter([node])


def _product(a: Node | float, b: Node | float) -> Node | float:
    return a * b


def _times(value: Node | float, factors: Counter[Node]) -> Node | float:
    """Multiply a graph by factors."""
    return reduce(_product, factors.elements(), value)
