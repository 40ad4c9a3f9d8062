"""Decide if equations of motion, or Lagrangians, are equivalent.

Agreement is proven by zero tests that look at every side of every switching function
(:mod:`lagrange_cli.mechanics.proofs.zero_test`). Real states at which two expressions differ refute
it. Analytic expressions with functions that the tests know little of (logarithms, inverse
functions) are compared at real states over many magnitudes, unless a term could be too small
there to be seen. All other comparisons are undecided, and never pass.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from fractions import Fraction
from functools import partial
from itertools import chain
from random import Random
from typing import TypeAlias, TypeVar

import sympy
from mpmath import mpf
from sympy import Expr, Rational, Symbol

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.proofs.continuity import is_analytic, is_continuous
from lagrange_cli.mechanics.proofs.refutation import is_nonzero, states_for, values_at
from lagrange_cli.mechanics.proofs.zero_test import (
    UndecidableError,
    relation_holds,
    values_on_sides,
    vanish,
)

#: Real states at which expressions must agree if states alone prove it. One state refutes almost
#: every analytic difference; the others guard against accidents and cost little.
_FEWEST_STATES = 12
#: Relative difference that refutes: well above rounding errors of 1e-120 and their cancellation.
_TOLERANCE = mpf(10) ** -90
#: Number of random states of order one and near the scene's own, in turn.
_NEARBY_STATES = 24
#: Terms that one term of a Lagrangian may be multiplied out to.
_TERM_BUDGET = 200
#: Numerators and denominators from which on a term may be too small to be seen at random states.
_EXTREME = 10**12
#: Exponents beyond which it may be, likewise.
_STEEP = 12

#: Size of an entry below which it is rounding, in tables whose rows are of size 1.
_SINGULAR = mpf(10) ** -80

_Number = TypeVar("_Number", int, mpf)
_State: TypeAlias = dict[Symbol, mpf]
_Row: TypeAlias = list[Expr]


class Agreement(Enum):
    """The verdict of a comparison of two expressions."""

    SAME = "same"
    DIFFERENT = "different"
    UNDECIDED = "undecided"


def linear_row(residual: Expr, unknown: Sequence[Symbol]) -> _Row | None:
    """Return the coefficients of some symbols, then the remainder; None if not linear in them."""
    row = [derivative(residual, symbol) for symbol in unknown]
    if any(entry.has(symbol) for entry in row for symbol in unknown):
        return None
    return [*row, residual.xreplace(dict.fromkeys(unknown, sympy.S.Zero))]


def proportional(expected: Expr, derived: Expr, equations: Equations) -> Agreement:
    """Compare two residuals up to a nonzero factor.

    The factor may hold positions, velocities and time, as equations multiplied by a coordinate
    do, but no acceleration: residuals linear in accelerations are compared by their rows of
    coefficients, which must be parallel. It may vanish at single places, and nowhere else: not
    on a side of a switching function.
    """
    accelerations = [c.a for c in equations.system.coordinates]
    first, second = linear_row(expected, accelerations), linear_row(derived, accelerations)
    if first is None or second is None:
        return Agreement.DIFFERENT
    places = [k for k, pair in enumerate(zip(first, second, strict=True)) if any(pair)]
    first, second = [first[k] for k in places], [second[k] for k in places]
    if not any(first) or not any(second):
        return Agreement.DIFFERENT
    n = len(places)
    if relation_holds([*first, *second], lambda values, p: _parallel(values[:n], values[n:], p)):
        return Agreement.SAME if _have_nonzero_factor(first, second) else Agreement.UNDECIDED

    def parallel(values: Sequence[mpf]) -> bool:
        a, b = values[:n], values[n:]
        sizes = max(map(abs, a)), max(map(abs, b))
        return 0 not in sizes and all(
            abs(a[i] * b[j] - a[j] * b[i]) <= _TOLERANCE * sizes[0] * sizes[1]
            for i in range(n)
            for j in range(i)
        )

    verdict = _by_states([*first, *second], parallel, equations)
    if verdict is Agreement.SAME and not _have_nonzero_factor(first, second):
        return Agreement.UNDECIDED
    return verdict


def _parallel(a: Sequence[int], b: Sequence[int], p: int) -> bool:
    """Say whether two rows are parallel modulo p."""
    return not any((a[i] * b[j] - a[j] * b[i]) % p for i in range(len(a)) for j in range(i))


def _have_nonzero_factor(first: _Row, second: _Row) -> bool:
    """Say whether parallel rows are zero nowhere but at single places.

    An analytic entry that is nonzero somewhere is nonzero almost everywhere.
    """
    for pair in zip(first, second, strict=True):
        symbols = set().union(*(e.free_symbols for e in pair))
        if all(is_analytic(e, symbols) and is_nonzero(e) for e in pair):
            return True
    known = [e for pair in zip(first, second, strict=True) if not _has_opaque(pair) for e in pair]
    try:
        return all(
            any(v % p for v in values[::2]) and any(v % p for v in values[1::2])
            for values, p in values_on_sides(known)
        )
    except UndecidableError:
        return False


def _has_opaque(pair: Sequence[Expr]) -> bool:
    """Say whether functions occur whose zeros arithmetic in finite fields does not show."""
    inverse = (sympy.asin, sympy.acos, sympy.atan, sympy.atan2, sympy.asinh, sympy.acosh)
    return any(e.has(sympy.log, sympy.atanh, *inverse) for e in pair)


def within_span(row: _Row, rows: Sequence[_Row], equations: Equations) -> Agreement:
    """Decide if a row of functions is a sum of others, each times a function.

    Rows of equations that hold together follow from each other so, and gradients of functions of
    each other.
    """
    width = len(row)
    if any(
        entry != 0 and all(line[k] == 0 for line in rows) and is_nonzero(entry)
        for k, entry in enumerate(row)
    ):
        return Agreement.DIFFERENT

    def joins(
        values: Sequence[_Number], rank: Callable[[Sequence[Sequence[_Number]]], int]
    ) -> bool:
        table = [values[k : k + width] for k in range(0, len(values), width)]
        return rank(table) == rank(table[1:])

    flat = [entry for line in (row, *rows) for entry in line]
    if relation_holds(flat, lambda values, p: joins(values, partial(_rank_modulo, p))):
        return Agreement.SAME
    return _by_states(flat, lambda values: joins(values, _real_rank), equations)


def _rank_modulo(p: int, table: Sequence[Sequence[int]]) -> int:
    residues = [[value % p for value in line] for line in table]
    return _rank(residues, lambda a, b: a * pow(b, -1, p) % p, lambda a: a % p)


def _real_rank(table: Sequence[Sequence[mpf]]) -> int:
    sizes = [max(map(abs, line)) or 1 for line in table]
    scaled = [[value / size for value in line] for line, size in zip(table, sizes, strict=True)]
    return _rank(scaled, lambda a, b: a / b, lambda a: a if abs(a) > _SINGULAR else mpf(0))


def _rank(
    table: Sequence[Sequence[_Number]],
    divide: Callable[[_Number, _Number], _Number],
    rounded: Callable[[_Number], _Number],
) -> int:
    """Return the rank of a table of numbers by Gauss's algorithm with pivots of largest size."""
    rows, rank = [list(line) for line in table], 0
    while True:
        places = ((abs(v), i, j) for i, line in enumerate(rows) for j, v in enumerate(line))
        size, i, j = max(places, default=(0, 0, 0))
        if not size:
            return rank
        pivot = rows.pop(i)
        for line in rows:
            factor = divide(line[j], pivot[j])
            line[:] = [rounded(a - factor * b) for a, b in zip(line, pivot, strict=True)]
            line[j] -= line[j]
        rank += 1


def lagrangians_agree(expected: Expr, derived: Expr, equations: Equations) -> Agreement:
    """Compare two Lagrangians up to a total time derivative.

    They agree if and only if both have the same Euler–Lagrange expressions (Courant and Hilbert,
    Methods of Mathematical Physics I, IV §3.5), and neither their difference nor its momenta jump:
    the impulses are not in these expressions.
    """
    difference = _expanded(expected - derived)
    if vanish(difference):
        return Agreement.SAME
    moving = {equations.system.t, *(s for c in equations.system.coordinates for s in (c.q, c.v))}
    rows = [e for e in _euler_lagrange(difference, equations) if e != 0]
    if vanish(*rows):
        impulsive = (
            difference,
            *(derivative(difference, c.v) for c in equations.system.coordinates),
        )
        calm = all(is_continuous(e, moving) for e in impulsive)
        return Agreement.SAME if calm else Agreement.UNDECIDED
    terms = [sympy.Add.make_args(row) for row in rows]

    def agree(values: Sequence[mpf]) -> bool:
        pending = iter(values)
        parts = [[next(pending) for _ in row] for row in terms]
        return all(abs(sum(p)) <= _TOLERANCE * sum(map(abs, p)) for p in parts)

    return _by_states([t for row in terms for t in row], agree, equations)


def expressions_agree(expected: Expr, derived: Expr, equations: Equations) -> Agreement:
    """Compare two functions of states, of which symbols may be momenta."""
    difference = _expanded(expected - derived)
    if vanish(difference):
        return Agreement.SAME
    terms = list(sympy.Add.make_args(difference))
    further = sorted(difference.free_symbols - set(_symbols(equations)), key=str)

    def agree(values: Sequence[mpf]) -> bool:
        return bool(abs(sum(values)) <= _TOLERANCE * sum(map(abs, values)))

    return _by_states(terms, agree, equations, further)


def _expanded(e: Expr) -> Expr:
    """Multiply out products of sums, within a budget, so that equal terms cancel."""
    terms = [expand_terms(t, _TERM_BUDGET) or [t] for t in sympy.Add.make_args(e)]
    return sympy.Add(*(t for parts in terms for t in parts))


def _euler_lagrange(lagrangian: Expr, equations: Equations) -> _Row:
    """Return d/dt ∂L/∂v − ∂L/∂q for each coordinate, over (q, v, a, t)."""

    def rate(expression: Expr) -> Expr:
        terms = [derivative(expression, equations.system.t)]
        for c in equations.system.coordinates:
            terms.append(derivative(expression, c.q) * c.v + derivative(expression, c.v) * c.a)
        return sympy.Add(*terms)

    return [
        rate(derivative(lagrangian, c.v)) - derivative(lagrangian, c.q)
        for c in equations.system.coordinates
    ]


def _by_states(
    expressions: _Row,
    agree: Callable[[Sequence[mpf]], bool],
    equations: Equations,
    further: Sequence[Symbol] = (),
) -> Agreement:
    """Compare at real states: one can refute; many prove it of analytic, tame expressions."""
    points = 0
    symbols = [*_symbols(equations), *further]
    far = states_for(expressions, symbols)
    for values in values_at(expressions, chain(_states(equations, symbols), far)):
        if not agree(values):
            return Agreement.DIFFERENT
        points += 1
    if points >= _FEWEST_STATES and all(_shows_at_states(e) for e in expressions):
        return Agreement.SAME
    return Agreement.UNDECIDED


def _shows_at_states(e: Expr) -> bool:
    """Say whether an expression, unless it is zero, shows so at many random states."""
    steep = (sympy.exp, sympy.sinh, sympy.cosh, sympy.tanh)
    return (
        is_analytic(e, e.free_symbols)
        and not e.has(*steep)
        and all(max(abs(n.p), n.q) < _EXTREME for n in e.atoms(Rational))
        and all(f.exp.is_Rational and abs(f.exp) <= _STEEP for f in e.atoms(sympy.Pow))
    )


def _symbols(equations: Equations) -> list[Symbol]:
    moving = [s for c in equations.system.coordinates for s in (c.q, c.v, c.a)]
    driven = [closure.multiplier for closure in equations.system.pushing]
    driven += [entry.symbol for entry in equations.system.external]
    return [equations.system.t, *moving, *(p.symbol for p in equations.system.parameters), *driven]


def _states(equations: Equations, symbols: Sequence[Symbol]) -> Iterator[_State]:
    """Yield random states: in turn of order one, and near the scene's parameters and start."""
    random = Random(1788)

    def between(low: int, high: int) -> mpf:
        return low + (high - low) * mpf(random.getrandbits(400)) / mpf(2) ** 400

    def near(value: float) -> mpf:
        exact = Fraction(value)
        center = mpf(exact.numerator) / exact.denominator
        return center * (1 + between(-1, 1) / 10) if center else between(-1, 1) / 10

    for number in range(_NEARBY_STATES):
        close = number % 2 == 1
        state: _State = {s: between(-1, 1) for s in symbols}
        state[equations.system.t] = between(0, 1)
        for p in equations.system.parameters:
            value = p.value if close else None
            state[p.symbol] = between(1, 2) if value is None else near(value)
        start = equations.system.initial.positions if close and equations.system.initial else None
        for k, c in enumerate(equations.system.coordinates):
            state[c.q] = between(0, 1) if start is None else near(start[k])
        yield state
