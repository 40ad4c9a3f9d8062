"""M a = f of a few coordinates, solved exactly so that few digits cancel.

Numerical elimination subtracts: the second pivot of a double pendulum is
``m2 − (m2 cos Δ)²/(m1 + m2)`` up to lengths, of which nothing is left where
m2 ≫ m1 and Δ is small. Exactly it is ``m2 (m1 + m2 sin²Δ)/(m1 + m2)``, a sum
without a difference. In general, for M = Σ m JᵀJ, determinants are sums over
products of masses whose coefficients are sums of squares, and the numerators of
Cramer's rule are sums over the same products (formula of Cauchy and Binet);
collected by products of parameters, the terms that masses of different
magnitude would make cancel are gone. The remaining cancellation is bounded independently of the
masses (G. W. Stewart, On scaled projections and pseudoinverses, Linear Algebra
Appl. 112 (1989) 189–193).

Coordinates whose inertia is a single term are eliminated first, since dividing
by it is exact. The acceleration of one remaining coordinate is a quotient; of two, one
follows Cramer's rule. A solution is returned only if every divisor is proven to be a sum of terms
that are not negative, and if it solves the equations at a random point.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum, sympy_rational, trig_factors
from lagrange_cli.mechanics.algebra.factor import common_factor, scaled
from lagrange_cli.mechanics.algebra.trig_polynomials import TrigPolynomial, refined
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.numerics.sampling import values_at_points

#: Most products that one entry may be multiplied out to.
_PRODUCT_BUDGET = 250
#: Most terms of a numerator.
_NUMERATOR_BUDGET = 40

#: Decimal digits carried when a solution is tried at a point.
_DIGITS = 40
#: Relative agreement that is asked for there: far above the rounding of these digits, and far below
#: any difference of a wrong solution.
_AGREEMENT = mpf(10) ** -25
#: Points that are tried, since expressions may be complex at some.
_DRAWS = 8

_UNIT = [sp.Integer(1)]

_Terms = list[sp.Expr]
_Product = tuple[int, _Terms, _Terms]


@dataclass(frozen=True)
class SolvedAcceleration:
    """a of one coordinate: (numerator − Σ coupling · a of another) / denominator.

    Attributes
    ----------
    coordinate
        Number of the coordinate.
    numerator, denominator
        Parts of the quotient.
    coupling
        Numbers of coordinates that are solved before, each with its factor.
    """

    coordinate: int
    numerator: sp.Expr
    coupling: tuple[tuple[int, sp.Expr], ...]
    denominator: sp.Expr


@dataclass(frozen=True)
class ExactSolution:
    """Accelerations in the order of their solution, and as many pivots.

    Parameters that are to be positive being so, M is positive definite where
    all pivots are positive, and only there. No pivot holds a difference.
    """

    steps: tuple[SolvedAcceleration, ...]
    pivots: tuple[sp.Expr, ...]


class _OverBudgetError(Exception):
    """More terms than may be multiplied out."""


def solve_exactly(
    mass: Sequence[Sequence[sp.Expr]], forcing: Sequence[sp.Expr], coordinates: Iterable[sp.Symbol]
) -> ExactSolution | None:
    """Solve M a = f with positive definite M without cancellation; None if that is not possible.

    Parameters
    ----------
    coordinates
        The symbols q. Sums that hold them outside of sines and cosines are at first left
        as they are, so that ``(l + x)²`` stays a square; then they are multiplied out.
    """
    q = frozenset(coordinates)
    for distribute in (_Distribution(q), _Distribution(frozenset())):
        try:
            solution = _System(mass, forcing, distribute).solution()
        except _OverBudgetError:
            return None
        if solution is not None:
            return solution if _is_confirmed(solution, mass, forcing) else None
        if not distribute.left_alone:
            return None
    return None


def _is_confirmed(
    solution: ExactSolution, mass: Sequence[Sequence[sp.Expr]], forcing: Sequence[sp.Expr]
) -> bool:
    """Tell whether some random point gives real and finite values, and check M a = f there.

    Raises
    ------
    InternalError
        M a = f does not hold there: a defect of this module.
    """
    parts = [
        e for s in solution.steps for e in (s.numerator, s.denominator, *dict(s.coupling).values())
    ]
    expressions = [*parts, *forcing, *(e for row in mass for e in row)]
    with mpmath.workdps(_DIGITS):
        for numbers in map(iter, values_at_points(expressions, _DRAWS)):
            try:
                a = _substituted(solution, numbers)
            except (DomainError, ZeroDivisionError):
                continue
            right = [next(numbers) for _ in forcing]
            rows = [[next(numbers) * x for x in a] for _ in forcing]
            if any(
                abs(sum(row) - f) > _AGREEMENT * (sum(map(abs, row)) + abs(f))
                for row, f in zip(rows, right, strict=True)
            ):
                raise InternalError(Problem("the exact solution does not solve M a = f"))
            return True
    return False


def _substituted(solution: ExactSolution, numbers: Iterator[mpf]) -> list[mpf]:
    """Compute accelerations from the values of the steps' expressions, in their order."""
    accelerations: dict[int, mpf] = {}
    for step in solution.steps:
        numerator, denominator = next(numbers), next(numbers)
        numerator -= sum(next(numbers) * accelerations[coupled] for coupled, _ in step.coupling)
        accelerations[step.coordinate] = numerator / denominator
    return [accelerations[i] for i in range(len(accelerations))]


class _Distribution:
    """Multiplies sums out, except those with ``closed`` symbols outside of sines and cosines."""

    def __init__(self, closed: frozenset[sp.Symbol]) -> None:
        self.closed = closed
        self.left_alone = False

    def terms(self, expr: sp.Expr) -> _Terms:
        return [t for a in sp.Add.make_args(expr) if a != 0 for t in self._product(a)]

    def _product(self, term: sp.Expr) -> _Terms:
        factors, terms = [], _UNIT
        for factor in sp.Mul.make_args(term):
            if not factor.is_Add:
                factors.append(factor)
            elif self._is_closed(factor):
                self.left_alone = True
                factors.append(factor)
            else:
                terms = [a * b for a in terms for b in self.terms(factor)]
                if len(terms) > _PRODUCT_BUDGET:
                    raise _OverBudgetError
        return [sp.Mul(t, *factors) for t in terms]

    def _is_closed(self, expr: sp.Expr) -> bool:
        if expr.func in (sp.sin, sp.cos):
            return False
        return expr in self.closed or any(map(self._is_closed, expr.args))


class _System:
    """M a = f with entries as lists of collected terms."""

    def __init__(
        self,
        mass: Sequence[Sequence[sp.Expr]],
        forcing: Sequence[sp.Expr],
        distribute: _Distribution,
    ) -> None:
        self.splitter = Splitter()
        self.left = list(range(len(forcing)))
        #: Arguments of the sines and cosines in collected entries, the only ones that code should
        #: compute.
        self.arguments: set[sp.Expr] = set()
        rows = [[self._sum((1, distribute.terms(e), _UNIT)) for e in row] for row in mass]
        right = [self._sum((1, distribute.terms(f), _UNIT)) for f in forcing]
        terms = [t for row in (*rows, right) for entry in row for t in entry]
        self.arguments.update(f.args[0] for t in terms for f in t.atoms(sp.sin, sp.cos))
        self.forcing = [self._refined(entry) for entry in right]
        self.mass = {
            (i, j): self._refined(entry)
            for i, row in enumerate(rows)
            for j, entry in enumerate(row)
        }

    def solution(self) -> ExactSolution | None:
        order = self._eliminate_mass()
        if len(self.left) > 2:
            return None
        determinant = self._determinant()
        if not _never_negative(determinant):
            return None
        pivots = [sp.Add(*self.mass[k, k]) for k in (*order, *self.left[1:])]
        rows = self._eliminate_forcing(order)
        first = self._last_coordinates(determinant)
        if first is None:
            return None
        return ExactSolution((*first, *reversed(rows)), (*pivots, _factored(determinant)))

    def _eliminate_mass(self) -> list[int]:
        """Eliminate every coordinate that can be from M; return them in order."""
        order: list[int] = []
        while len(self.left) > 1 and (k := self._single()) is not None:
            self.left.remove(k)
            order.append(k)
            for i in self.left:
                ratio = self._ratio(i, k)
                for j in self.left[self.left.index(i) :]:
                    self.mass[i, j] = self.mass[j, i] = self._sum(
                        (1, self.mass[i, j], _UNIT), (-1, ratio, self.mass[k, j])
                    )
        return order

    def _single(self) -> int | None:
        """A coordinate whose inertia is one term by which others can be divided."""
        for k in reversed(self.left):
            inertia = self.mass[k, k]
            if len(inertia) == 1 and not inertia[0].has(sp.sin, sp.cos, sp.tan):
                return k if _never_negative(inertia) else None
        return None

    def _ratio(self, i: int, k: int) -> _Terms:
        (inertia,) = self.mass[k, k]
        return [t / inertia for t in self.mass[i, k]]

    def _eliminate_forcing(self, order: Sequence[int]) -> list[SolvedAcceleration]:
        """Apply the elimination of M to f; return the rows for substitution."""
        rows = []
        for position, k in enumerate(order):
            later = [*order[position + 1 :], *self.left]
            rows.append(self._row(k, later))
            for i in later:
                self.forcing[i] = self._sum(
                    (1, self.forcing[i], _UNIT), (-1, self._ratio(i, k), self.forcing[k])
                )
        return rows

    def _row(self, k: int, later: Sequence[int]) -> SolvedAcceleration:
        """The equation of coordinate k, solved for its acceleration."""
        coupled = [j for j in later if self.mass[k, j]]
        entries = [self.forcing[k], self.mass[k, k], *(self.mass[k, j] for j in coupled)]
        common = common_factor([term for entry in entries for term in entry])
        right, inertia, *coupling = (sp.Add(*(t / common for t in entry)) for entry in entries)
        return SolvedAcceleration(k, right, tuple(zip(coupled, coupling, strict=True)), inertia)

    def _determinant(self) -> _Terms:
        i, j = self.left[0], self.left[-1]
        if i == j:
            return self.mass[i, i]
        return self._sum(
            (1, self.mass[i, i], self.mass[j, j]), (-1, self.mass[i, j], self.mass[i, j])
        )

    def _last_coordinates(self, determinant: _Terms) -> list[SolvedAcceleration] | None:
        """Solve for one or two coordinates; None beyond the budget.

        The first by Cramer's rule, the second so too if that is shorter than by its equation.
        """
        if len(self.left) == 1:
            (i,) = self.left
            return [_quotient(i, self.forcing[i], determinant)]
        choices = []
        for i, j in (self.left, self.left[::-1]):
            if _never_negative(self.mass[j, j]):
                numerator = self._numerator(i, j)
                choices.append((len(numerator), i, j, numerator))
        if not choices:
            return None
        length, i, j, numerator = min(choices, key=lambda choice: choice[:3])
        if length > _NUMERATOR_BUDGET:
            return None
        first = _quotient(i, numerator, determinant)
        last_numerator = self._numerator(j, i)
        if len(last_numerator) <= len(self.forcing[j]) + len(self.mass[i, j]):
            return [first, _quotient(j, last_numerator, determinant)]
        return [first, self._row(j, [i])]

    def _numerator(self, i: int, j: int) -> _Terms:
        """Cramer's numerator of coordinate i beside the one remaining coordinate j."""
        return self._sum(
            (1, self.mass[j, j], self.forcing[i]), (-1, self.mass[i, j], self.forcing[j])
        )

    def _sum(self, *products: _Product) -> _Terms:
        """Σ ± first · second, collected."""
        if sum(len(a) * len(b) for _, a, b in products) > _PRODUCT_BUDGET:
            raise _OverBudgetError
        total = TermSum(self.splitter)
        for sign, first, second in products:
            for a in first:
                for b in second:
                    total.add_product(a, b, {_UNIT[0]: sign})
        return self._refined(total.collected())

    def _refined(self, terms: _Terms) -> _Terms:
        """Apply the identities that collection does not recognize."""
        groups: dict[frozenset[tuple[sp.Expr, sp.Expr]], TrigPolynomial] = {}
        for term in terms:
            split = self.splitter.split(term)
            group = groups.setdefault(split.powers, {})
            group[self.splitter.canonical(split.trig)] = split.number
        return [
            sp.Mul(sympy_rational(number), *(b**e for b, e in powers), *trig_factors(monomial))
            for powers, group in groups.items()
            for monomial, number in refined(group, self.arguments).items()
        ]


def _never_negative(terms: _Terms) -> bool:
    return bool(terms) and all(t.is_nonnegative for t in terms)


def _factored(terms: _Terms) -> sp.Expr:
    """The sum as common factor times cofactor, which is thus one value wherever it is used."""
    common = common_factor(terms)
    return _times(common, sp.Add(*(t / common for t in terms)))


def _quotient(coordinate: int, numerator: _Terms, determinant: _Terms) -> SolvedAcceleration:
    common = common_factor(determinant)
    cofactor = sp.Add(*(t / common for t in determinant))
    shared = common_factor([*numerator, common])
    above = sp.Add(*(t / shared for t in numerator))
    return SolvedAcceleration(coordinate, above, (), _times(common / shared, cofactor))


def _times(factor: sp.Expr, cofactor: sp.Expr) -> sp.Expr:
    number, factors = factor.as_coeff_Mul(rational=True)
    return scaled(number, factors * cofactor)
