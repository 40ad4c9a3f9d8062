"""Shared parts of flat sums and products, pair by pair.

Value numbering makes equal expressions one node; parts that sums or products have in
common (``m2*l1*l2`` in two products, ``m2 + m3`` in two sums) are recognized by repeatedly
giving the pair that occurs most often a node of its own, as in
Breuer, "Generation of optimal code for expressions via factorization",
Comm. ACM 12 (1969) 333-340. Among equally frequent pairs the one of lower rank
wins, so that parts made of parameters alone come together.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from heapq import heapify, heappop, heappush
from itertools import groupby
from typing import Protocol, TypeAlias

from lagrange_cli.program.graph.operands import Coefficient, magnitude, quotient
from lagrange_cli.program.graph.value_graph import ONE, ProductNode, ScaledNode, SumNode, ValueGraph

#: Longest sum or product that is searched for pairs: their number grows with its square.
LONGEST_GROUP = 256

_Weight: TypeAlias = Coefficient
"""Coefficient of a term of a sum, or exponent of a factor of a product."""

_Group: TypeAlias = dict[int, _Weight]
"""A sum or a product: node → weight."""

_Key: TypeAlias = tuple[int, int, _Weight]
"""First node, second node, and their relation (ratio of coefficients or of exponents)."""


class _Kind(Protocol):
    """Pairs of terms or factors: found in a group, and taken out of it."""

    def between(self, a: tuple[int, _Weight], b: tuple[int, _Weight]) -> tuple[_Key, int]: ...
    def within(self, a: tuple[int, _Weight]) -> int: ...
    def take(self, group: _Group, key: _Key) -> _Weight: ...
    def define(self, key: _Key) -> _Group: ...


class _Sums:
    """Pairs of terms, up to a common numeric factor."""

    def between(self, a: tuple[int, _Weight], b: tuple[int, _Weight]) -> tuple[_Key, int]:
        (m, c), (n, d) = (a, b) if a[0] < b[0] else (b, a)
        return (m, n, 1 if c == d else quotient(d, c)), 1

    def within(self, a: tuple[int, _Weight]) -> int:
        return 0

    def take(self, group: _Group, key: _Key) -> _Weight:
        coefficient = group.pop(key[0])
        del group[key[1]]
        return coefficient

    def define(self, key: _Key) -> _Group:
        return {key[0]: 1, key[1]: key[2]}


class _Products:
    """Pairs of factors: x·y (relation 1, also x·x) or x/y (relation −1)."""

    def between(self, a: tuple[int, _Weight], b: tuple[int, _Weight]) -> tuple[_Key, int]:
        (m, d), (n, e) = (a, b) if a[0] < b[0] else (b, a)
        times = min(abs(int(d)), abs(int(e)))
        if (d > 0) == (e > 0):
            return (m, n, 1), times
        return ((m, n, -1) if d > 0 else (n, m, -1)), times

    def within(self, a: tuple[int, _Weight]) -> int:
        return abs(int(a[1])) // 2

    def take(self, group: _Group, key: _Key) -> _Weight:
        first, second, relation = key
        sign = 1 if group[first] > 0 else -1
        if first == second:
            times = abs(int(group[first])) // 2
            group[first] -= sign * 2 * times
        else:
            times = min(abs(int(group[first])), abs(int(group[second])))
            group[first] -= sign * times
            group[second] -= sign * relation * times
        for number in {first, second}:
            if not group[number]:
                del group[number]
        return sign * times

    def define(self, key: _Key) -> _Group:
        first, second, relation = key
        return {first: 2} if first == second else {first: 1, second: relation}


class _Extraction:
    """The pairs of a set of groups (all sums, or all products), kept up to date."""

    def __init__(self, values: ValueGraph, kind: _Kind, groups: dict[int, _Group]) -> None:
        self.values = values
        self.kind = kind
        self.groups = groups
        self.occurrences: dict[_Key, dict[int, int]] = {}
        self.counts: Counter[_Key] = Counter()
        self.definitions: dict[_Key, int] = {}
        # A node in one group alone, once, has no pair that occurs twice.
        often = Counter(n for group in groups.values() for n in group)
        self.candidates = {n for n, count in often.items() if count > 1}
        self.candidates.update(
            n for group in groups.values() for n in group if kind.within((n, group[n]))
        )
        for number, group in groups.items():
            pairs = list(self._pairs(group, list(group)))
            for key, times in pairs:
                self._enter(key, number, times)
            self._note_definition(number, group, pairs)
        self.heap = [(*self._priority(k), k) for k, count in self.counts.items() if count > 1]
        heapify(self.heap)

    def run(self) -> None:
        """Give every pair that occurs at least twice a node, most frequent first."""
        while self.heap:
            priority, rank, key = heappop(self.heap)
            if self.counts[key] < 2:
                continue
            if (priority, rank) != self._priority(key):
                heappush(self.heap, (*self._priority(key), key))
                continue
            self._extract(key)

    def _priority(self, key: _Key) -> tuple[int, int]:
        rank = self.values.rank
        return -self.counts[key], max(rank[key[0]], rank[key[1]])

    def _pairs(self, group: _Group, nodes: Iterable[int]) -> Iterator[tuple[_Key, int]]:
        """The pairs of a group in which at least one of ``nodes`` takes part."""
        candidates, seen = self.candidates, set[int]()
        for number in nodes:
            seen.add(number)
            if number not in candidates:
                continue
            term = (number, group[number])
            times = self.kind.within(term)
            if times:
                yield (number, number, 1), times
            for partner, weight in group.items():
                if partner not in seen and partner in candidates:
                    yield self.kind.between(term, (partner, weight))

    def _enter(self, key: _Key, number: int, times: int) -> None:
        holders = self.occurrences.setdefault(key, {})
        self.counts[key] += times - holders.get(number, 0)
        holders[number] = times

    def _leave(self, key: _Key, number: int) -> None:
        self.counts[key] -= self.occurrences.get(key, {}).pop(number, 0)

    def _note_definition(
        self, number: int, group: _Group, pairs: Iterable[tuple[_Key, int]]
    ) -> None:
        """Use a group that consists of a pair alone as that pair's node."""
        if len(group) > 2:
            return
        for key, _ in pairs:
            if self.kind.define(key) == group:
                self.definitions.setdefault(key, number)

    def _extract(self, key: _Key) -> None:
        holders = self.occurrences[key]
        target = self.definitions.get(key)
        if target is None:
            target = self._new_node(key)
        changed: dict[_Key, None] = {}
        for number in sorted(holders):
            if number != target:
                changed.update(dict.fromkeys(self._replace(number, key, target)))
        self.occurrences[key] = {target: 1}
        self.counts[key] = 1
        for new in changed:
            if self.counts[new] > 1:
                heappush(self.heap, (*self._priority(new), new))

    def _new_node(self, key: _Key) -> int:
        values, definition = self.values, self.kind.define(key)
        rank = max(values.rank[n] for n in definition)
        number = len(values.nodes)
        # The node itself is written with all other groups (see share_products).
        values.nodes.append(values.nodes[ONE])
        values.rank.append(rank)
        self.groups[number] = definition
        self.definitions[key] = number
        self.candidates.add(number)
        return number

    def _replace(self, number: int, key: _Key, target: int) -> list[_Key]:
        """Put a pair's node in its place in a group; return the pairs that the group has since."""
        group = self.groups[number]
        touched = [n for n in dict.fromkeys(key[:2]) if n in group]
        if target in group:
            touched.append(target)
        self.candidates.add(target)
        for old, _ in self._pairs(group, touched):
            self._leave(old, number)
        weight = self.kind.take(group, key)
        if target in group:
            weight += group[target]
        if weight:
            group[target] = weight
        else:
            del group[target]
        present = [n for n in dict.fromkeys((*key[:2], target)) if n in group]
        pairs = dict(self._pairs(group, present))
        for new, times in pairs.items():
            self._enter(new, number, times)
        self._note_definition(number, group, self._pairs(group, list(group)))
        return list(pairs)


def share_products(values: ValueGraph, reachable: Iterable[int]) -> None:
    """Rewrite the products among ``reachable`` nodes so that what they have in
    common is computed once. Numbers of nodes keep their meaning."""
    products: dict[int, _Group] = {}
    for number in sorted(reachable):
        node = values.nodes[number]
        if isinstance(node, ProductNode) and len(node.factors) <= LONGEST_GROUP:
            products[number] = dict(node.factors)
    _Extraction(values, _Products(), products).run()
    for number, powers in products.items():
        values.nodes[number] = ProductNode(tuple(sorted((n, int(e)) for n, e in powers.items())))


def share_sums(values: ValueGraph, reachable: Iterable[int]) -> None:
    """Do for sums what :func:`share_products` does for products."""
    sums: dict[int, _Group] = {}
    for number in sorted(reachable):
        node = values.nodes[number]
        if isinstance(node, SumNode) and 1 < len(node.terms) <= LONGEST_GROUP:
            sums[number] = dict(node.terms)
    _nest(sums)
    _Extraction(values, _Sums(), sums).run()
    for number, terms in sums.items():
        values.nodes[number] = SumNode(tuple(sorted(terms.items())))


def _nest(sums: dict[int, _Group]) -> None:
    """Write every sum that holds all terms of other sums by means of the longest of these.

    Running sums, of masses along a chain say, so become one addition each.
    """
    longest_first = sorted(sums, key=lambda n: (-len(sums[n]), n))
    # Longer sums alone can hold a sum, and of these, those that are not written yet are sought.
    holders: defaultdict[int, set[int]] = defaultdict(set)
    inner: dict[int, tuple[int, Coefficient]] = {}
    for _, alike in groupby(longest_first, key=lambda n: len(sums[n])):
        numbers = list(alike)
        for number in numbers:
            group = sums[number]
            for whole in sorted(set.intersection(*(holders[part] for part in group))):
                ratio = _ratio(sums[whole], group)
                if ratio is not None:
                    inner[whole] = (number, ratio)
                    for part in sums[whole]:
                        holders[part].discard(whole)
        for number in numbers:
            for part in sums[number]:
                holders[part].add(number)
    for whole in longest_first:
        if whole in inner:
            number, ratio = inner[whole]
            for part in sums[number]:
                del sums[whole][part]
            # The sum may hold the other one as a term already.
            sums[whole][number] = sums[whole].get(number, 0) + ratio


def _ratio(whole: _Group, part: _Group) -> Coefficient | None:
    """Divide ``whole`` by ``part``, term by term; None if the ratios differ."""
    first = next(iter(part))
    ratio = quotient(whole[first], part[first])
    alike = all(whole[number] == ratio * weight for number, weight in part.items())
    return ratio if alike else None


def share_scaled(
    values: ValueGraph, reachable: Iterable[int], roots: list[ScaledNode]
) -> list[ScaledNode]:
    """Multiply a node by a number once where several sums or roots do; return the new roots."""
    sums: dict[int, SumNode] = {}
    for number in sorted(reachable):
        node = values.nodes[number]
        if isinstance(node, SumNode) and len(node.terms) > 1:
            sums[number] = node
    terms = [(n, c) for node in sums.values() for n, c in node.terms]
    often = Counter((n, magnitude(c)) for n, c in (*terms, *((n, c) for c, n in roots)))

    def once(number: int, coefficient: Coefficient) -> tuple[int, Coefficient]:
        size = magnitude(coefficient)
        if number == ONE or size in (0, 1) or often[number, size] < 2:
            return number, coefficient
        return values.node((size, number)), quotient(coefficient, size)

    for number, node in sums.items():
        values.nodes[number] = SumNode(tuple(sorted(once(n, c) for n, c in node.terms)))
    return [(c, n) for n, c in (once(number, coefficient) for coefficient, number in roots)]
