"""Integers and rational numbers as formulas of indices: offsets, ranges, coefficients."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.algebra.factor import scaled

Vector = tuple[int, ...]


class Link(NamedTuple):
    """A component of vectors: a variable plus an offset, or the offset alone.

    Attributes
    ----------
    variable
        Number of the variable, None for a constant.
    offset
        Number that is added to it.
    """

    variable: int | None
    offset: int


def links(vectors: Sequence[Vector]) -> list[Link]:
    """Find which components of vectors are equal up to constants; the first ones count.

    A component that never changes is a constant; the variables are numbered in the order of the
    components that are equal to them.
    """
    first = vectors[0]
    variables: list[int] = []
    linked: list[Link] = []
    for k, start in enumerate(first):
        if all(v[k] == start for v in vectors):
            linked.append(Link(None, start))
            continue
        for number, leader in enumerate(variables):
            offset = start - first[leader]
            if all(v[k] - v[leader] == offset for v in vectors):
                linked.append(Link(number, offset))
                break
        else:
            variables.append(k)
            linked.append(Link(len(variables) - 1, 0))
    return linked


def formula(points: Mapping[Vector, Fraction], letters: Sequence[sp.Symbol]) -> sp.Expr | None:
    """Find a number as a formula of indices: constant, linear in one or two, or 1 over that.

    Parameters
    ----------
    points
        Values of the indices → the number.
    letters
        The letters of the indices, in the order of the values.

    Returns
    -------
    Expr or None
        None if no such formula holds at more points than it has constants.
    """
    values = list(points.values())
    if all(v == values[0] for v in values):
        return _rational(values[0])
    if all(v < 0 for v in values):
        minus = formula({p: -v for p, v in points.items()}, letters)
        return None if minus is None else scaled(sp.S.NegativeOne, minus)
    for invert in (False, True):
        if invert and 0 in values:
            return None
        wanted = {p: 1 / v if invert else v for p, v in points.items()}
        for basis in _bases(len(letters)):
            constants = _combination(wanted, basis)
            if constants is None:
                continue
            monomials = [sp.Mul(*(letters[k] for k in factors)) for factors in basis]
            whole = sp.Add(*(_rational(c) * m for c, m in zip(constants, monomials, strict=True)))
            return 1 / sp.factor(whole) if invert else sp.factor(whole)
    return None


def _bases(count: int) -> list[list[tuple[int, ...]]]:
    """List sets of index products that a formula may combine, the smallest first."""
    bases: list[list[tuple[int, ...]]] = [[(), (k,)] for k in range(count)]
    bases += [[(), (k,), (m,), (k, m)] for k, m in combinations(range(count), 2)]
    return bases


def _combination(
    points: Mapping[Vector, Fraction], basis: Sequence[tuple[int, ...]]
) -> list[Fraction] | None:
    """Solve for constants with which index products add up to the number at all points."""
    if len(points) <= len(basis):
        return None
    rows: list[list[Fraction]] = []
    for point, value in points.items():
        lead = len(rows)
        if lead == len(basis):
            break
        row = [Fraction(_product(point, factors)) for factors in basis] + [value]
        for pivot, known in enumerate(rows):
            row = [a - row[pivot] * b for a, b in zip(row, known, strict=True)]
        if row[lead]:
            row = [a / row[lead] for a in row]
            rows = [[a - r[lead] * b for a, b in zip(r, row, strict=True)] for r in rows]
            rows.append(row)
    if len(rows) < len(basis):
        return None
    constants = [row[-1] for row in rows]
    for point, value in points.items():
        total = sum(
            (c * _product(point, f) for c, f in zip(constants, basis, strict=True)), Fraction(0)
        )
        if total != value:
            return None
    return constants


def _product(point: Vector, factors: tuple[int, ...]) -> int:
    product = 1
    for k in factors:
        product *= point[k]
    return product


def _rational(value: Fraction) -> sp.Rational:
    return sp.Rational(value.numerator, value.denominator)


class Bound(NamedTuple):
    """An end of a range: one of the row's indices plus an offset, or the offset alone."""

    position: int | None
    offset: int

    def at(self, row: Vector) -> int:
        """The end in a row."""
        return self.offset + (0 if self.position is None else row[self.position])


def row_ranges(
    values: Mapping[Vector, Collection[int]], rows: Collection[Vector]
) -> tuple[Bound, Bound] | None:
    """Fit the ends of a sum over all rows, as ``1`` and ``i - 1``.

    Parameters
    ----------
    values
        Row → the values that the index of the sum takes there.
    rows
        All rows; in those without values the range has to be empty.
    """
    if any(max(v) - min(v) + 1 != len(v) for v in values.values()):
        return None
    first = _bound({row: min(v) for row, v in values.items()})
    last = _bound({row: max(v) for row, v in values.items()})
    if first is None or last is None:
        return None
    empty = (row for row in rows if row not in values)
    return (first, last) if all(first.at(r) > last.at(r) for r in empty) else None


def _bound(ends: Mapping[Vector, int]) -> Bound | None:
    row, end = next(iter(ends.items()))
    if all(e == end for e in ends.values()):
        return Bound(None, end)
    for k, index in enumerate(row):
        if all(e - r[k] == end - index for r, e in ends.items()):
            return Bound(k, end - index)
    return None


def runs(numbers: Collection[int]) -> list[range]:
    """Group integers into ranges without gaps."""
    ranges: list[range] = []
    for n in sorted(numbers):
        if ranges and n == ranges[-1].stop:
            ranges[-1] = range(ranges[-1].start, n + 1)
        else:
            ranges.append(range(n, n + 1))
    return ranges
