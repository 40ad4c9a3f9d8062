"""Expressions reduced by equations that hold on a surface: gaps that are zero, sin² + cos² = 1."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.identities import by_single_angles
from lagrange_cli.mechanics.algebra.polynomials import cancelled, expand_terms
from lagrange_cli.mechanics.elimination.solve_equation import linear_parts

#: Terms to which a numerator or denominator may be multiplied out.
_TERMS = 400


class TooLongError(Exception):
    """An expression exceeds the budget of terms."""


@dataclass(frozen=True)
class Square:
    """A symbol whose square is known: symbol² = value, free of the symbol."""

    symbol: sp.Symbol
    value: sp.Expr


@dataclass(frozen=True)
class Surface:
    """The configurations in which gaps are zero.

    Attributes
    ----------
    chart
        Coordinates over the others, by gaps that hold them linearly.
    squares
        For each other gap, the coordinates that it gives the square of.
    distances
        Radicand → value of its root, by gaps between a distance and a constant.
    """

    chart: Mapping[sp.Symbol, sp.Expr]
    squares: tuple[tuple[Square, ...], ...]
    distances: Mapping[sp.Expr, sp.Expr] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        gaps: Iterable[sp.Expr],
        coordinates: Sequence[sp.Symbol],
        start: Mapping[sp.Symbol, mpf],
    ) -> Surface | None:
        """Solve gaps for coordinates or their squares; None if one is of another form.

        ``start``: values of the coordinates; squares of large ones come first.
        """
        chart: dict[sp.Symbol, sp.Expr] = {}
        others: list[sp.Expr] = []
        for gap in gaps:
            placed = gap.xreplace(chart)
            solved = _linear(placed, [q for q in coordinates if q not in chart])
            if solved is None:
                others.append(gap)
                continue
            q, value = solved
            chart = {k: e.xreplace({q: value}) for k, e in chart.items()} | {q: value}
        free = [q for q in coordinates if q not in chart]
        free.sort(key=lambda q: -abs(start[q]))
        distances = {}
        for k, gap in enumerate(others):
            others[k] = gap = gap.xreplace(chart)
            distance = _distance(gap, free)
            if distance is not None:
                radicand, value = distance
                distances[radicand] = value
                others[k] = radicand - value**2
        squares = tuple(tuple(_squares(gap, free)) for gap in others)
        return cls(chart, squares, distances) if all(squares) else None

    def without_roots(self, expression: sp.Expr) -> sp.Expr:
        """Replace the roots of radicands whose distance is known."""
        for radicand, value in self.distances.items():
            powers = [p for p in expression.atoms(sp.Pow) if p.base == radicand and p.exp.q == 2]
            expression = expression.xreplace({p: value ** (2 * p.exp) for p in powers})
        return expression

    def velocities(
        self, coordinates: Sequence[tuple[sp.Symbol, sp.Symbol]], time: sp.Symbol
    ) -> dict[sp.Symbol, sp.Expr]:
        """Velocities over the independent ones; the keys are symbols q̇.

        ``coordinates``: q and q̇ of each coordinate.
        """
        rates = dict(coordinates)
        solved: dict[sp.Symbol, sp.Expr] = {}
        for options in self.squares:
            q, value = options[0].symbol, options[0].value
            slope = _rate(value, coordinates, time)
            solved[rates[q]] = slope.xreplace(solved) / (2 * q)
        for q, value in self.chart.items():
            slope = _rate(value, coordinates, time)
            solved[rates[q]] = slope.xreplace(solved)
        return solved


def _rate(
    value: sp.Expr, coordinates: Sequence[tuple[sp.Symbol, sp.Symbol]], time: sp.Symbol
) -> sp.Expr:
    moved = (derivative(value, q) * v for q, v in coordinates)
    return sp.Add(derivative(value, time), *moved)


def _linear(gap: sp.Expr, free: Sequence[sp.Symbol]) -> tuple[sp.Symbol, sp.Expr] | None:
    """Return a coordinate that a gap holds times a constant, and its value; numbers first."""
    solved = []
    for q in free:
        parts = linear_parts(gap, q)
        if parts is not None and parts[0] != 0 and not parts[0].free_symbols & set(free):
            solved.append((not parts[0].is_number, q, -parts[1] / parts[0]))
    return min(solved, key=lambda one: one[0])[1:] if solved else None


def _distance(gap: sp.Expr, free: Sequence[sp.Symbol]) -> tuple[sp.Expr, sp.Expr] | None:
    """Return the radicand and the value of the root that a gap compares with a constant."""
    roots = [p for p in gap.atoms(sp.Pow) if p.exp == sp.S.Half and p.free_symbols & set(free)]
    if len(roots) != 1:
        return None
    place = sp.Dummy("d")
    parts = linear_parts(gap.xreplace({roots[0]: place}), place)
    if (
        parts is None
        or parts[0] == 0
        or (parts[0].free_symbols | parts[1].free_symbols) & set(free)
    ):
        return None
    return roots[0].base, -parts[1] / parts[0]


def _squares(gap: sp.Expr, free: Sequence[sp.Symbol]) -> Iterator[Square]:
    for q in free:
        if not gap.is_polynomial(q):
            continue
        powers = {d: c for (d,), c in sp.Poly(gap, q).terms()}
        if set(powers) <= {0, 2} and 2 in powers and not powers[2].free_symbols & set(free):
            yield Square(q, sp.expand(-powers.get(0, sp.S.Zero) / powers[2]))


@dataclass(frozen=True)
class Flat:
    """Sines and cosines as symbols.

    Attributes
    ----------
    functions
        Symbol → sine or cosine.
    """

    functions: Mapping[sp.Symbol, sp.Expr]

    @classmethod
    def of(cls, expressions: Iterable[sp.Expr]) -> Flat:
        """Name the sines and cosines of all angles in expressions whose angles are multiplied out.

        The sine and cosine of one angle come behind each other.
        """
        angles = {f.args[0]: None for e in expressions for f in _ordered(e.atoms(sp.sin, sp.cos))}
        return cls(
            {
                sp.Dummy(f.__name__, real=True): f(angle)
                for angle in angles
                for f in (sp.sin, sp.cos)
            }
        )

    def flat(self, expression: sp.Expr) -> sp.Expr:
        return expression.xreplace({f: s for s, f in self.functions.items()})

    def full(self, expression: sp.Expr) -> sp.Expr:
        return expression.xreplace(dict(self.functions))

    @property
    def squares(self) -> list[tuple[Square, Square]]:
        """Each sine over its cosine, and each cosine over its sine."""
        symbols = list(self.functions)
        return [
            (Square(s, 1 - c**2), Square(c, 1 - s**2))
            for s, c in zip(symbols[::2], symbols[1::2], strict=True)
        ]

    def moving(self, coordinates: Collection[sp.Symbol]) -> list[sp.Symbol]:
        """Symbols of functions that hold a coordinate."""
        return [s for s, f in self.functions.items() if f.free_symbols & set(coordinates)]


def _ordered(functions: Iterable[sp.Expr]) -> list[sp.Expr]:
    return sorted(functions, key=str)


def reduced(surface: Surface, expression: sp.Expr) -> sp.Expr:
    """Write an expression in lowest terms on a surface, as short as its equations make it.

    Raises
    ------
    TooLongError
        There are too many terms.
    """
    placed = surface.without_roots(expression.xreplace(dict(surface.chart)))
    placed = by_single_angles(placed)
    flat = Flat.of([placed])
    parts = sp.fraction(sp.together(flat.flat(placed)))
    above, below = (_expanded(part) for part in parts)
    for options in (*surface.squares, *flat.squares):
        above, below = (_shortest(part, options) for part in (above, below))
    quotient = sp.fraction(cancelled(above / below))
    for options in (*surface.squares, *flat.squares):
        quotient = tuple(_shortest(part, options) for part in quotient)
    above, below = quotient
    return flat.full(cancelled(above / below))


def _expanded(expression: sp.Expr) -> sp.Expr:
    terms = expand_terms(expression, _TERMS)
    if terms is None:
        raise TooLongError
    return sp.Add(*terms)


def _shortest(expression: sp.Expr, options: Sequence[Square]) -> sp.Expr:
    """Replace even powers of the symbol after which the fewest operations are left."""
    forms = [expression, *(_without_square(expression, option) for option in options)]
    return min(forms, key=lambda form: int(sp.count_ops(form)))


def _without_square(expression: sp.Expr, square: Square) -> sp.Expr:
    functions = {
        f: sp.Dummy(real=True)
        for f in expression.atoms(sp.Function, sp.Pow)
        if square.symbol in f.free_symbols and not f.is_polynomial(square.symbol)
    }
    polynomial = expression.xreplace(functions)
    if not polynomial.is_polynomial(square.symbol):
        return expression
    powers = sp.Poly(polynomial, square.symbol).terms()
    terms = (c * square.symbol ** (d % 2) * square.value ** (d // 2) for (d,), c in powers)
    return _expanded(sp.Add(*terms)).xreplace({s: f for f, s in functions.items()})
