"""Functions that tables give, as SymPy functions that know their points.

A derivation holds f and its slopes, as it holds an unknown function. Where numbers are computed the
function is written out: a polynomial between each two points, in cases over the points, so that
every program, language and integrator has it. The pieces are exact in the decimals of the file, and
join exactly.

Slopes of the monotone interpolation are those of F. N. Fritsch and J. Butland, SIAM J. Sci. Stat.
Comput. 5 (1984) 300: a weighted harmonic mean of the differences on both sides, 0 where these
differ in sign; at the ends the three-point formula, limited to three times the difference
(C. Moler, *Numerical Computing with MATLAB*, 3.6, pchip). Over a grid the interpolant is the
product of Hermite's cubics with these slopes along both arguments and no twist: along a line of the
grid it is that of one argument.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import sympy as sp

from lagrange_cli.mechanics.kinks import Cases

if TYPE_CHECKING:
    from lagrange_cli.files import Table

#: Most functions whose pieces are kept.
_KEPT = 2**10

_Axis = Sequence[Fraction]


class TableToken(sp.AtomicExpr):  # type: ignore[misc]
    """A table among the arguments of its function.

    Attributes
    ----------
    name
        Name of the function.
    table
        Its points.
    """

    is_commutative = True
    is_real = True

    def __new__(cls, name: str, table: Table) -> TableToken:
        token: TableToken = super().__new__(cls)
        token.name, token.table = name, table
        return token

    def _hashable_content(self) -> tuple[Any, ...]:
        return self.name, self.table

    def __getnewargs__(self) -> tuple[Any, ...]:
        return self.name, self.table

    def _sympystr(self, printer: Any) -> str:
        return str(self.name)

    @property
    def free_symbols(self) -> set[sp.Symbol]:
        """No symbols: a table holds numbers."""
        return set()


class Tabulated(sp.Function):  # type: ignore[misc]
    """A function of a table, or a slope: its arguments, the table, a number of slopes for each."""

    is_real = True

    @property
    def token(self) -> TableToken:
        """The table."""
        token: TableToken = self.args[len(self.args) // 2]
        return token

    @property
    def arguments(self) -> tuple[sp.Expr, ...]:
        """Arguments of the function."""
        arguments: tuple[sp.Expr, ...] = self.args[: len(self.args) // 2]
        return arguments

    @property
    def orders(self) -> tuple[int, ...]:
        """Number of derivatives by each argument."""
        return tuple(int(n) for n in self.args[len(self.args) // 2 + 1 :])

    @property
    def is_smooth(self) -> bool:
        """Tell if its slopes are continuous: those of lines, and of a value held, jump."""
        table = self.token.table
        kinked = table.interpolation == "linear" or table.outside == "hold"
        return not kinked and not any(self.orders)

    def slope(self, number: int) -> sp.Expr:
        """Differentiate by one of the arguments."""
        orders = [n + (k == number) for k, n in enumerate(self.orders)]
        return Tabulated(*self.arguments, self.token, *map(sp.Integer, orders))

    def _eval_derivative(self, symbol: sp.Symbol) -> sp.Expr:
        return sp.Add(*(self.slope(k) * a.diff(symbol) for k, a in enumerate(self.arguments)))


def tabulated(name: str, table: Table, arguments: Sequence[sp.Expr], order: int = 0) -> sp.Expr:
    """Apply the function of a table, or a derivative of one of a single argument."""
    orders = [order, *(0 for _ in arguments[1:])]
    return Tabulated(*arguments, TableToken(name, table), *map(sp.Integer, orders))


@lru_cache(maxsize=_KEPT)
def in_pieces(function: Tabulated) -> sp.Expr:
    """Write a function of a table as polynomials in cases over its points."""
    places = tuple(sp.Dummy(real=True) for _ in function.arguments)
    pieces = _pieces(function.token.table, function.orders, places)
    return pieces.xreplace(dict(zip(places, function.arguments, strict=True)))


def borders(function: Tabulated) -> list[tuple[sp.Expr, Fraction, bool]]:
    """List what is to stay positive within a table, with its end and whether that is the upper one.

    Numbers are relative to the width of the table; there are none where it is held or extended.
    """
    table = function.token.table
    if table.outside != "end":
        return []
    return [
        border
        for argument, axis in zip(function.arguments, table.axes, strict=True)
        for border in _of_axis(argument, axis)
    ]


def _of_axis(argument: sp.Expr, axis: _Axis) -> list[tuple[sp.Expr, Fraction, bool]]:
    first, last = axis[0], axis[-1]
    width = _exact(last - first)
    above, below = (argument - _exact(first)) / width, (_exact(last) - argument) / width
    return [(above, first, False), (below, last, True)]


def _exact(value: Fraction) -> sp.Rational:
    return sp.Rational(value.numerator, value.denominator)


# -- pieces --------------------------------------------------------------------


def _pieces(table: Table, orders: Sequence[int], places: Sequence[sp.Symbol]) -> sp.Expr:
    if len(table.axes) == 1:
        return _over_line(table, table.values, places[0], orders[0])
    first, second = table.axes
    count = len(second)
    rows = [table.values[k * count : (k + 1) * count] for k in range(len(first))]
    # Values and slopes at each row are functions of the second argument; between rows these are
    # blended by Hermite's polynomials of the first.
    levels = [_over_line(table, row, places[1], orders[1]) for row in rows]
    columns = list(zip(*(_slopes(table, first, c) for c in zip(*rows, strict=True)), strict=True))
    slopes = [_blended(table, second, column, places[1], orders[1]) for column in columns]
    return _hermite(table, first, levels, slopes, places[0], orders[0])


def _over_line(table: Table, values: Sequence[Fraction], place: sp.Symbol, order: int) -> sp.Expr:
    """Interpolate values over the last axis."""
    axis = table.axes[-1]
    slopes = [_exact(s) for s in _slopes(table, axis, values)]
    return _hermite(table, axis, [_exact(v) for v in values], slopes, place, order)


def _blended(
    table: Table, axis: _Axis, values: Sequence[Fraction], place: sp.Symbol, order: int
) -> sp.Expr:
    """Blend slopes across the rows without twist."""
    if table.interpolation == "linear":
        return sp.Integer(0)
    exact = [_exact(v) for v in values]
    return _hermite(table, axis, exact, [sp.Integer(0)] * len(exact), place, order)


def _hermite(
    table: Table,
    axis: _Axis,
    values: Sequence[sp.Expr],
    slopes: Sequence[sp.Expr],
    place: sp.Symbol,
    order: int,
) -> sp.Expr:
    """Join the polynomials between points, and what holds beyond the outermost ones."""
    knots = [_exact(x) for x in axis]
    linear = table.interpolation == "linear"
    pieces = [
        _between(knots[k : k + 2], values[k : k + 2], slopes[k : k + 2], place, linear)
        for k in range(len(knots) - 1)
    ]
    ends = []
    for end in (0, -1):
        slope = sp.diff(pieces[end], place).xreplace({place: knots[end]})
        is_held = table.outside == "hold"
        ends.append(values[end] if is_held else values[end] + slope * (place - knots[end]))
    every = [ends[0], *pieces, ends[1]]
    for _ in range(order):
        every = [sp.diff(piece, place) for piece in every]
    return _in_cases(knots, every, place)


def _between(
    knots: Sequence[sp.Rational],
    values: Sequence[sp.Expr],
    slopes: Sequence[sp.Expr],
    place: sp.Symbol,
    linear: bool,
) -> sp.Expr:
    """Write the polynomial between two points in Horner's form."""
    s, h = place - knots[0], knots[1] - knots[0]
    difference = (values[1] - values[0]) / h
    if linear:
        return values[0] + difference * s
    second = (3 * difference - 2 * slopes[0] - slopes[1]) / h
    third = (slopes[0] + slopes[1] - 2 * difference) / h**2
    return values[0] + s * (slopes[0] + s * (second + s * third))


def _in_cases(knots: Sequence[sp.Rational], pieces: Sequence[sp.Expr], place: sp.Symbol) -> sp.Expr:
    """Choose a piece by halving, so that no condition is nested deeper than needed."""
    if not knots:
        return pieces[0]
    k = len(knots) // 2
    above = _in_cases(knots[k + 1 :], pieces[k + 1 :], place)
    below = _in_cases(knots[:k], pieces[: k + 1], place)
    return Cases(above, place - knots[k], sp.Integer(0), below)


# -- slopes --------------------------------------------------------------------


def _slopes(table: Table, axis: _Axis, values: Sequence[Fraction]) -> list[Fraction]:
    """Return the slopes at the points; those of linear pieces are not asked for."""
    rules: dict[str, Callable[[_Axis, Sequence[Fraction]], list[Fraction]]] = {
        "monotone": _monotone,
        "cubic": _spline,
    }
    if table.interpolation == "linear":
        return [Fraction(0) for _ in axis]
    return rules[table.interpolation](axis, values)


def _monotone(axis: _Axis, values: Sequence[Fraction]) -> list[Fraction]:
    h = [b - a for a, b in pairwise(axis)]
    d = [(b - a) / width for (a, b), width in zip(pairwise(values), h, strict=True)]
    if len(d) == 1:
        return [d[0], d[0]]
    inner = [
        _harmonic(d[k], d[k + 1], 2 * h[k + 1] + h[k], h[k + 1] + 2 * h[k])
        for k in range(len(d) - 1)
    ]
    return [_end(h[0], h[1], d[0], d[1]), *inner, _end(h[-1], h[-2], d[-1], d[-2])]


def _harmonic(before: Fraction, after: Fraction, w1: Fraction, w2: Fraction) -> Fraction:
    if before * after <= 0:
        return Fraction(0)
    return (w1 + w2) / (w1 / before + w2 / after)


def _end(h0: Fraction, h1: Fraction, d0: Fraction, d1: Fraction) -> Fraction:
    slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
    if slope * d0 <= 0:
        return Fraction(0)
    return 3 * d0 if d0 * d1 < 0 and abs(slope) > 3 * abs(d0) else slope


def _spline(axis: _Axis, values: Sequence[Fraction]) -> list[Fraction]:
    """Return the slopes of the cubic spline without a knot at the second and last but one point."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline([float(x) for x in axis], [float(v) for v in values])
    return [Fraction(repr(float(s))) for s in spline([float(x) for x in axis], 1)]
