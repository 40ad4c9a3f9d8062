"""Expressions too long to be read, in whose place the count of their operations is printed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from lagrange_cli.notation.ordering import spelled_symbol
from lagrange_cli.notation.tree import Dependence, DisplaySymbol

if TYPE_CHECKING:
    from sympy import Basic, Expr

#: Operations of the longest expression that is printed: more than three pages are not read, and
#: are more than pdfLaTeX has memory for.
MOST_OPERATIONS = 3_000


@dataclass(frozen=True)
class Omission:
    """Leaves long expressions out.

    Attributes
    ----------
    written
        Number of operations → what stands in place of the expression, in letters of the format.
    counts
        Operations of those that were left out so far.
    """

    written: Callable[[int], str]
    counts: list[int] = field(default_factory=list)

    def instead(self, parts: Sequence[Expr]) -> DisplaySymbol | None:
        """What stands in place of a sum of parts; None if that is not too long."""
        if not _may_be_long(parts):
            return None
        count = operations(parts)
        if count <= MOST_OPERATIONS:
            return None
        self.counts.append(count)
        return spelled_symbol(self.written(count), Dependence.ACCELERATION, 0)


def operations(parts: Sequence[Expr]) -> int:
    """The operations of a sum of parts: signs, sums, products, powers and functions."""
    return sum(int(part.count_ops()) for part in parts) + len(parts) - 1


def _may_be_long(parts: Sequence[Expr]) -> bool:
    """Tell whether there are so many nodes that the operations are worth counting."""
    # A node is two operations at the most, as the number -1/2.
    left = MOST_OPERATIONS // 2
    stack: list[Basic] = list(parts)
    while stack and left:
        stack.extend(stack.pop().args)
        left -= 1
    return bool(stack)
