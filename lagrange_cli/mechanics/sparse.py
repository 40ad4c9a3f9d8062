"""Sparse rows of expressions: of a mass matrix, or gradients of closures.

A row reads like the tuple of all its entries; long rows are walked by :func:`entries` instead, so
that zeros cost nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, overload

if TYPE_CHECKING:
    from sympy import Expr


class ExpressionRow(Sequence["Expr"]):
    """A row of expressions, of which those that are not zero are kept.

    Parameters
    ----------
    length
        Number of columns.
    nonzero
        Column → entry; zeros among them are left out.
    """

    __slots__ = ("_length", "_nonzero")

    def __init__(self, length: int, nonzero: Mapping[int, Expr]) -> None:
        self._length = length
        self._nonzero = {j: nonzero[j] for j in sorted(nonzero) if nonzero[j] != 0}

    @property
    def nonzero(self) -> Mapping[int, Expr]:
        """The entries that are not zero by column, ascending."""
        return self._nonzero

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, place: int) -> Expr: ...

    @overload
    def __getitem__(self, place: slice) -> tuple[Expr, ...]: ...

    def __getitem__(self, place: int | slice) -> Expr | tuple[Expr, ...]:
        import sympy

        columns = range(self._length)[place]
        if isinstance(columns, range):
            return tuple(self.nonzero.get(j, sympy.S.Zero) for j in columns)
        return self.nonzero.get(columns, sympy.S.Zero)

    def __iter__(self) -> Iterator[Expr]:
        return iter(self[:])

    def __eq__(self, other: object) -> bool:
        if isinstance(other, ExpressionRow):
            return (self._length, self.nonzero) == (other._length, other.nonzero)
        return isinstance(other, tuple) and self[:] == other

    def __hash__(self) -> int:
        return hash(self[:])

    def __repr__(self) -> str:
        return f"ExpressionRow({self._length}, {self.nonzero})"


def entries(row: Sequence[Expr]) -> Mapping[int, Expr]:
    """The entries of a row that are not plainly zero, by column."""
    if isinstance(row, ExpressionRow):
        return row.nonzero
    return {j: entry for j, entry in enumerate(row) if entry != 0}
