"""Statements of one shape brought together, so that loops can replace them.

The statements of a large program that have the same shape (``w*w + p``, whatever
the numbers of the names) stand one after the other as far as what they need
allows it, those that need earlier values first. A chain, in which each needs
the one before, stays together too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from heapq import heappop, heappush
from operator import itemgetter
from types import MappingProxyType
from typing import TypeAlias

from lagrange_cli.program.graph.operands import (
    Coefficient,
    Constant,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
    rebuilt,
    variables,
)

Assignment: TypeAlias = tuple[str, Operand]

#: To how many levels shapes must agree: ``p*w`` where w is a sine is not ``p*w`` where it
#: is a cosine.
_DEPTH = 3

_Key: TypeAlias = tuple[str, tuple[int, ...]]
"""The shape of an operand, with names cut down to their kind, and the numbers of its names."""

#: No other names.
_AS_THEY_ARE: Mapping[str, Variable] = MappingProxyType({})

_KEY: Callable[[tuple[Operand, _Key]], _Key] = itemgetter(1)


def grouped_by_shape(
    assignments: Sequence[Assignment],
) -> tuple[list[Assignment], dict[str, Variable]]:
    """Order assignments so that those of one family stand together, and name them w0, w1, …

    Each still stands after those that it needs. Terms and factors are in the order of
    :func:`in_canonical_order`. The second result maps old names to new ones.
    """
    return _Scheduler(assignments).run()


def in_canonical_order(operand: Operand, new: Mapping[str, Variable] = _AS_THEY_ARE) -> Operand:
    """Terms and factors ordered by shape, then by the numbers of their names.

    ``new`` has other names for some variables, by the old ones.
    """
    return _with_key(operand, new)[0]


def _with_key(operand: Operand, new: Mapping[str, Variable]) -> tuple[Operand, _Key]:
    if isinstance(operand, Variable):
        operand = new.get(operand.name, operand)
        kind = operand.name.rstrip("0123456789")
        number = operand.name[len(kind) :]
        return operand, (kind, (int(number),) if number else ())
    if isinstance(operand, Constant):
        return operand, (str(operand.value), ())
    if isinstance(operand, Sum):
        return _sum_with_key(operand, new)
    if isinstance(operand, Product):
        numerator, above = _factors_with_key(operand.numerator, new)
        denominator, below = _factors_with_key(operand.denominator, new)
        return Product(numerator, denominator), (f"({above[0]}/{below[0]})", above[1] + below[1])
    arguments = [_with_key(argument, new) for argument in operand.arguments]
    shape, numbers = _joined([key for _, key in arguments])
    return FunctionCall(operand.function, tuple(a for a, _ in arguments)), (
        f"{operand.function}({shape})",
        numbers,
    )


def _sum_with_key(operand: Sum, new: Mapping[str, Variable]) -> tuple[Operand, _Key]:
    def place(
        term: tuple[Coefficient, tuple[Operand, _Key]],
    ) -> tuple[bool, str, Coefficient, object]:
        coefficient, (_, (shape, numbers)) = term
        return coefficient < 0, shape, coefficient, numbers

    terms = sorted([(c, _with_key(part, new)) for c, part in operand.terms], key=place)
    shape, numbers = _joined([(f"{c}*{key[0]}", key[1]) for c, (_, key) in terms])
    return Sum(tuple([(c, part) for c, (part, _) in terms])), (f"[{shape}]", numbers)


def _factors_with_key(
    factors: Sequence[Operand], new: Mapping[str, Variable]
) -> tuple[tuple[Operand, ...], _Key]:
    parts = sorted([_with_key(factor, new) for factor in factors], key=_KEY)
    return tuple([part for part, _ in parts]), _joined([key for _, key in parts])


def _joined(keys: Sequence[_Key]) -> _Key:
    shape = ",".join([shape for shape, _ in keys])
    return shape, tuple([number for _, numbers in keys for number in numbers])


class _Scheduler:
    """Picks statements that are ready, family by family."""

    def __init__(self, assignments: Sequence[Assignment]) -> None:
        self.operands = dict(assignments)
        self.new: dict[str, Variable] = {}
        self.result: list[Assignment] = []
        self.missing: dict[str, int] = {}
        self.users: dict[str, list[str]] = {name: [] for name in self.operands}
        self.ready: dict[int, list[tuple[tuple[int, ...], str, Operand]]] = {}
        self.waiting: dict[int, int] = {}
        self.family = _families(self.operands)
        for name, operand in assignments:
            family = self.family[name]
            self.waiting[family] = self.waiting.get(family, 0) + 1
            needs = {v.name for v in variables(operand)} & self.operands.keys()
            self.missing[name] = len(needs)
            for part in needs:
                self.users[part].append(name)
        for name, _ in assignments:
            if not self.missing[name]:
                self._release(name)

    def run(self) -> tuple[list[Assignment], dict[str, Variable]]:
        """Take a family as long as it has ready statements, then the one of which fewest wait."""
        while self.ready:
            family = min(self.ready, key=lambda f: (self.waiting[f], f))
            while family in self.ready:
                self._take(family)
        return self.result, self.new

    def _take(self, family: int) -> None:
        heap = self.ready[family]
        _, name, operand = heappop(heap)
        if not heap:
            del self.ready[family]
        self.new[name] = Variable(f"w{len(self.result)}")
        self.result.append((self.new[name].name, operand))
        for user in self.users[name]:
            self.missing[user] -= 1
            if not self.missing[user]:
                self._release(user)

    def _release(self, name: str) -> None:
        family = self.family[name]
        self.waiting[family] -= 1
        operand, (_, numbers) = _with_key(self.operands[name], self.new)
        heappush(self.ready.setdefault(family, []), (numbers, name, operand))


def _families(operands: Mapping[str, Operand]) -> dict[str, int]:
    """Map every name to its family: its shape and the shapes of its operands."""
    family = dict.fromkeys(operands, 0)
    for _ in range(_DEPTH):
        numbers: dict[str, int] = {}
        shapes = {name: _shape(operand, family) for name, operand in operands.items()}
        family = {name: numbers.setdefault(s, len(numbers)) for name, s in shapes.items()}
    return family


def _shape(operand: Operand, family: Mapping[str, int]) -> str:
    """The shape of an operand, assigned names cut down to their families."""
    if isinstance(operand, Variable):
        number = family.get(operand.name)
        return operand.name.rstrip("0123456789") if number is None else f"w{number}_"
    if isinstance(operand, Constant):
        return str(operand.value)
    if isinstance(operand, Sum):
        terms = sorted([(c < 0, _shape(part, family), c) for c, part in operand.terms])
        return f"[{','.join([f'{c}*{shape}' for _, shape, c in terms])}]"
    if isinstance(operand, Product):
        above = sorted([_shape(part, family) for part in operand.numerator])
        below = sorted([_shape(part, family) for part in operand.denominator])
        return f"({','.join(above)}/{','.join(below)})"
    return f"{operand.function}({','.join([_shape(part, family) for part in operand.arguments])})"


def renamed(operand: Operand, new: Mapping[str, Variable]) -> Operand:
    """The operand with other names for some of its variables."""
    return rebuilt(operand, lambda variable: new.get(variable.name, variable))


def dependents(assignments: Iterable[Assignment], names: Iterable[str]) -> tuple[Assignment, ...]:
    """List the assignments that need one of the names, in their order."""
    late = set(names)
    needing = []
    for name, operand in assignments if late else ():
        if any(variable.name in late for variable in variables(operand)):
            late.add(name)
            needing.append((name, operand))
    return tuple(needing)
