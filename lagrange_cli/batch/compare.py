"""Decide whether equations of motion, or Lagrangians, say the same.

What a normal form does not decide is decided at random states in high
precision. Two analytic expressions that agree there to 20 of 50 digits are
equal but with a probability that is nil for any practical purpose
(Schwartz, J. ACM 27 (1980) 701, states it for polynomials).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from random import Random
from typing import TypeAlias

import sympy
from sympy import Expr, Rational, Symbol

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.calculus import derivative
from lagrange_cli.mechanics.equations import Equations

__all__ = ["lagrangians_agree", "proportional"]

POINTS = 4
TRIES = 200
DIGITS = 50
TOLERANCE = sympy.Float(10) ** -20
#: Normal forms are computed only below this number of operations.
NORMAL_FORM_BUDGET = 400

State: TypeAlias = dict[Symbol, Rational]
Row: TypeAlias = list[Expr]


def _row(residual: Expr, equations: Equations) -> Row | None:
    """Coefficients of the accelerations and the rest, of a residual linear in them; else None."""
    accelerations = [c.a for c in equations.coordinates]
    row = [derivative(residual, a) for a in accelerations]
    if any(entry.has(a) for entry in row for a in accelerations):
        return None
    return [*row, residual.xreplace(dict.fromkeys(accelerations, sympy.S.Zero))]


def proportional(first: Expr, second: Expr, equations: Equations) -> bool:
    """Say whether one residual is a nonzero factor times the other.

    The factor may hold positions, velocities and time, as equations multiplied
    by a coordinate do, but no acceleration: residuals linear in accelerations
    are compared by their rows of coefficients, which must be parallel.
    """
    one, other = _row(first, equations), _row(second, equations)
    if one is None or other is None:
        return False
    if _parallel_by_normal_form(one, other):
        return True

    def parallel(state: State) -> bool | None:
        a, b = _evaluate(one, state), _evaluate(other, state)
        return None if a is None or b is None else _parallel(a, b)

    return _everywhere(parallel, equations)


def _parallel_by_normal_form(one: Row, other: Row) -> bool:
    """Whether equality up to a constant sign or nothing shows by expanding."""
    if sum(sympy.count_ops(e) for e in (*one, *other)) > NORMAL_FORM_BUDGET:
        return False
    if not any(sympy.expand(e) != 0 for e in one):
        return False
    return all(
        sympy.expand(one[i] * other[j] - one[j] * other[i]) == 0
        for i in range(len(one))
        for j in range(i)
    )


def _parallel(one: Row, other: Row) -> bool:
    """Whether two rows of numbers are nonzero and parallel."""
    size, size_other = max(map(abs, one)), max(map(abs, other))
    if size == 0 or size_other == 0:
        return False
    return all(
        abs(one[i] * other[j] - one[j] * other[i]) <= TOLERANCE * size * size_other
        for i in range(len(one))
        for j in range(i)
    )


def lagrangians_agree(expected: Expr, equations: Equations) -> bool:
    """Say whether a Lagrangian is the derived one up to a total time derivative.

    It is if and only if both have the same Euler–Lagrange expressions
    (Courant and Hilbert, Methods of Mathematical Physics I, IV §3.5).
    """
    ours = _euler_lagrange(equations.lagrangian, equations)
    theirs = _euler_lagrange(expected, equations)

    def same(state: State) -> bool | None:
        a, b = _evaluate(ours, state), _evaluate(theirs, state)
        if a is None or b is None:
            return None
        return all(abs(x - y) <= TOLERANCE * (abs(x) + abs(y)) for x, y in zip(a, b, strict=True))

    return _everywhere(same, equations)


def _euler_lagrange(lagrangian: Expr, equations: Equations) -> Row:
    """d/dt ∂L/∂v − ∂L/∂q for each coordinate, over (q, v, a, t)."""

    def rate(expression: Expr) -> Expr:
        terms = [derivative(expression, equations.t)]
        for c in equations.coordinates:
            terms.append(derivative(expression, c.q) * c.v + derivative(expression, c.v) * c.a)
        return sympy.Add(*terms)

    return [
        rate(derivative(lagrangian, c.v)) - derivative(lagrangian, c.q)
        for c in equations.coordinates
    ]


def _evaluate(row: Row, state: State) -> Row | None:
    """Evaluate expressions in high precision; None where one is not real and finite."""
    values = [entry.evalf(DIGITS, subs=state) for entry in row]
    return values if all(v.is_real and v.is_finite for v in values) else None


def _everywhere(holds: Callable[[State], bool | None], equations: Equations) -> bool:
    """Whether a comparison holds at random states; states where it is undefined are passed over."""
    found = 0
    for state in _states(equations):
        verdict = holds(state)
        if verdict is False:
            return False
        found += verdict is True
        if found == POINTS:
            return True
    raise InputError(
        Problem("cannot be compared: no random state gives real values", rule="undecided")
    )


def _states(equations: Equations) -> Iterator[State]:
    """Random states: of order one, and in turn near the scene's parameters and initial state."""
    random = Random(1788)

    def between(low: int, high: int) -> Rational:
        return Rational(random.randint(low * 9973, high * 9973), 9973)

    for number in range(TRIES):
        state: State = {equations.t: between(0, 1)}
        near = number % 2 == 1
        for p in equations.parameters:
            given = p.value if near else None
            state[p.symbol] = between(1, 2) if given is None else _near(given, between(-1, 1))
        start = equations.initial.positions if near and equations.initial else None
        for k, c in enumerate(equations.coordinates):
            state[c.q] = between(0, 1) if start is None else _near(start[k], between(-1, 1))
            state[c.v], state[c.a] = between(-1, 1), between(-1, 1)
        state.update((closure.multiplier, between(-1, 1)) for closure in equations.pushing)
        state.update((given.symbol, between(-1, 1)) for given in equations.inputs)
        yield state


def _near(value: float, offset: Rational) -> Rational:
    """A number within a tenth of another."""
    exact = Fraction(value)
    given = Rational(exact.numerator, exact.denominator)
    return given * (1 + offset / 10) if given else offset / 10
