"""Equilibria in closed form: equations split into factors and solved one after the other.

An equation that is a product gives a branch for each factor. Within a branch an equation in one
unknown is solved (:mod:`.single_equation`), an unknown that stands linearly is eliminated, and so
on until nothing is left. Each step keeps all solutions, so that a search that ends has found all.
Candidates are put into the equations before they count.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_system import RestSystem
from lagrange_cli.analysis.equilibria.single_equation import factors_of, real_roots
from lagrange_cli.analysis.values import AbsentEquilibrium, Equilibrium, Existence, Mpf
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form
from lagrange_cli.mechanics.elimination.solve_equation import linear_parts
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.zero_test import vanish

# The budget, in counts, so that outputs do not depend on the speed of a machine: beyond it a search
# in numbers is quicker, and closed forms are too long to read.

#: Unknowns.
_UNKNOWNS = 12
#: Branches that are followed.
_BRANCHES = 300
#: Operations of one equation.
_OPERATIONS = 400

#: Digits of the numbers that decide, and the relative size below which one is rounding.
DIGITS = 50
ROUNDING = mpf(10) ** -30


class _BudgetError(Exception):
    """A branch has no closed form, or is too large."""


@dataclass(frozen=True)
class ClosedForms:
    """Equilibria in closed form.

    Attributes
    ----------
    points
        Equilibria that exist for the values of the parameters, or may exist where some lack one.
    absent
        Equilibria that do not exist for these values.
    complete
        True if there are no others.
    """

    points: tuple[Equilibrium, ...]
    absent: tuple[AbsentEquilibrium, ...]
    complete: bool


@dataclass(frozen=True)
class _Branch:
    """Equations that are still to be solved, and the values found so far, the last first."""

    equations: tuple[sp.Expr, ...]
    unknowns: tuple[sp.Symbol, ...]
    values: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    conditions: tuple[Existence, ...] = ()

    def solved(
        self, unknown: sp.Symbol, value: sp.Expr, conditions: tuple[Existence, ...] = ()
    ) -> _Branch:
        """Substitute a value for an unknown."""
        return _Branch(
            tuple(e.xreplace({unknown: value}) for e in self.equations),
            tuple(u for u in self.unknowns if u != unknown),
            ((unknown, value), *self.values),
            (*self.conditions, *conditions),
        )


class _Solver:
    """Follows the branches of the equations of one system."""

    def __init__(self, system: RestSystem) -> None:
        self.system = system
        coordinates = system.equations.system.coordinates
        self.angles = {c.q for c in coordinates if c.is_angle}
        self.branches = 0
        # Equations of an angle outside of sines and cosines are solved for one turn only.
        turning = (k for k, c in enumerate(coordinates) if c.is_angle and k not in system.free)
        self.complete = all(k in system.periodic for k in turning)

    def run(self) -> Iterator[_Branch]:
        """Yield the branches that end in a solution."""
        equations = (*self.system.forces, *self.system.constraints)
        pending = [_Branch(equations, self.system.unknowns)]
        while pending:
            self.branches += 1
            if self.branches > _BRANCHES:
                self.complete = False
                return
            branch = pending.pop(0)
            try:
                simplified = self._simplified(branch)
                if simplified is None:
                    continue
                if simplified.equations:
                    pending = [*self._step(simplified), *pending]
                else:
                    yield simplified
            except _BudgetError:
                self.complete = False

    def _simplified(self, branch: _Branch) -> _Branch | None:
        """Drop equations that hold; None if one of them cannot hold."""
        unknowns, remaining = frozenset(branch.unknowns), []
        for written in branch.equations:
            if sp.count_ops(written) > _OPERATIONS:
                raise _BudgetError
            equation = cancelled(written)
            if equation.free_symbols & unknowns:
                remaining.append(equation)
            elif equation.has(sp.zoo, sp.nan, sp.oo):
                return None
            elif equation != 0 and not vanish(equation):
                remaining.append(equation)
        return replace(branch, equations=tuple(remaining))

    def _may_vanish(self, expression: sp.Expr) -> bool:
        """Say whether an expression in parameters is zero for their values."""
        known = self.system.known
        if not expression.free_symbols <= known.keys():
            return False
        return _is_zero(expression, known)

    def _step(self, branch: _Branch) -> list[_Branch]:
        unknowns = frozenset(branch.unknowns)
        split = [factors_of(e, unknowns) for e in branch.equations]
        for k, (equation, factors) in enumerate(zip(branch.equations, split, strict=True)):
            balances = self._balances(equation, unknowns)
            if len(factors) == 1 and not balances:
                continue
            return [
                *(
                    replace(
                        branch, equations=(*branch.equations[:k], f, *branch.equations[k + 1 :])
                    )
                    for f in factors
                ),
                *(self._balanced(branch, k, balance) for balance in balances),
            ]
        equations = tuple(factors[0] for factors in split)
        branch = replace(branch, equations=equations)
        return self._by_roots(branch) or self._by_elimination(branch)

    def _balances(self, equation: sp.Expr, unknowns: frozenset[sp.Symbol]) -> list[sp.Expr]:
        """List the factors in parameters alone that may vanish: ``a m g − b F`` of a lever.

        These are differences, and factors that are zero for the values of the parameters.
        """
        numerator = sp.fraction(cancelled(equation))[0]
        factors = [f.as_base_exp()[0] for f in sp.Mul.make_args(factored_form(numerator))]
        constant = [f for f in factors if f.free_symbols and not f.free_symbols & unknowns]
        return [f for f in constant if self._may_vanish(f) or self._is_difference(f)]

    def _is_difference(self, factor: sp.Expr) -> bool:
        """Say whether the terms of a sum have both signs."""
        known = self.system.known
        if not factor.is_Add or factor.is_nonzero:
            return False
        if not factor.free_symbols <= known.keys():
            return True
        try:
            return len({term > 0 for term in evaluate(factor.args, known)}) == 2
        except DomainError:
            return False

    def _balanced(self, branch: _Branch, k: int, balance: sp.Expr) -> _Branch:
        """Leave out an equation that holds if a factor in parameters alone is zero."""
        equations = (*branch.equations[:k], *branch.equations[k + 1 :])
        condition = Existence(balance, sp.S.Zero, "=")
        return replace(branch, equations=equations, conditions=(*branch.conditions, condition))

    def _by_roots(self, branch: _Branch) -> list[_Branch] | None:
        """Solve the shortest equation in one unknown; None if there is none that can be."""
        unknowns = frozenset(branch.unknowns)
        for equation in sorted(branch.equations, key=sp.count_ops):
            present = equation.free_symbols & unknowns
            if len(present) != 1:
                continue
            (unknown,) = present
            roots = real_roots(equation, unknown, is_angle=unknown in self.angles)
            if roots is not None:
                return [branch.solved(unknown, r.value, r.conditions) for r in roots] or [
                    replace(branch, equations=(sp.S.One,))
                ]
        return None

    def _by_elimination(self, branch: _Branch) -> list[_Branch]:
        """Solve an equation for an unknown whose factor is a constant that does not vanish."""
        unknowns = frozenset(branch.unknowns)
        for equation in sorted(branch.equations, key=sp.count_ops):
            for unknown in branch.unknowns:
                if unknown not in equation.free_symbols:
                    continue
                parts = linear_parts(equation, unknown)
                if parts is None or parts[0].free_symbols & unknowns:
                    continue
                if not self._may_vanish(parts[0]):
                    return [branch.solved(unknown, cancelled(-parts[1] / parts[0]))]
        raise _BudgetError


def closed_forms(system: RestSystem) -> ClosedForms | None:
    """Solve the equations of equilibrium in closed form; None beyond the budget.

    Some equilibria may be found, and others not: then they are not complete.
    """
    if len(system.unknowns) > _UNKNOWNS:
        return None
    if sum(sp.count_ops(e) for e in system.forces) > _UNKNOWNS * _OPERATIONS:
        return None
    solver = _Solver(system)
    points: list[Equilibrium] = []
    absent: list[AbsentEquilibrium] = []
    complete = True
    for branch in solver.run():
        try:
            solution = _with_positions(system, branch)
        except _BudgetError:
            complete = False
            continue
        if isinstance(solution, AbsentEquilibrium):
            absent.append(solution)
        elif solution is not None:
            points.append(solution)
    return ClosedForms(tuple(points), tuple(absent), complete and solver.complete)


def _with_positions(system: RestSystem, branch: _Branch) -> Equilibrium | AbsentEquilibrium | None:
    """Return the equilibrium of a branch; None if it does not satisfy the equations.

    Raises
    ------
    _BudgetError
        It has no value for these parameters, and it is not known why.
    """
    values = dict[sp.Symbol, sp.Expr]()
    for unknown, value in branch.values:
        values[unknown] = value.xreplace(values)
    open_ones = [u for u in branch.unknowns if u not in values]
    coordinates, closures = system.equations.system.coordinates, system.equations.system.closures
    multipliers = [c.multiplier for c in closures]
    shared = {u for u in multipliers if u in open_ones}
    if any(not shared.isdisjoint(values.get(c.q, c.q).free_symbols) for c in coordinates):
        raise _BudgetError  # a continuum, along which constraint forces differ
    # Redundant closures share their forces in any way.
    values = {u: e.xreplace(dict.fromkeys(shared, sp.S.Zero)) for u, e in values.items()}
    values |= dict.fromkeys(shared, sp.S.Zero)
    exact = tuple(values.get(c.q, c.q) for c in coordinates)
    forces = tuple(values[multiplier] for multiplier in multipliers)
    if any(e.has(sp.I) for e in (*exact, *forces)):
        return None  # real for no parameters
    free = tuple(c.name for k, c in enumerate(coordinates) if k in system.free or c.q in open_ones)
    point = Equilibrium(None, None, exact, forces, free, branch.conditions)
    residuals = [e.xreplace(values) for e in (*system.forces, *system.constraints)]
    if system.missing:
        return point if vanish(*residuals) else None
    start = {c.q: x for c, x in zip(coordinates, system.start, strict=True)}
    at = {**system.known, **start}
    with mpmath.workdps(DIGITS):
        if any(_holds(c, system.known) is False for c in branch.conditions):
            return AbsentEquilibrium(exact, branch.conditions)
        try:
            numbers = evaluate([*exact, *forces], at)
        except DomainError:
            raise _BudgetError from None
        if not vanish(*residuals) and not _all_vanish(residuals, at):
            return None
    n = len(exact)
    if not system.allows(numbers[:n]):
        return None
    return replace(point, position=tuple(numbers[:n]), multipliers=tuple(numbers[n:]))


def _holds(condition: Existence, known: Mapping[sp.Symbol, Mpf]) -> bool | None:
    """Say whether a condition holds; None if its sides have no values."""
    if condition.relation == "=":
        return _all_vanish([condition.smaller - condition.larger], known)
    try:
        smaller, larger = evaluate([condition.smaller, condition.larger], known)
    except DomainError:
        return None
    return bool(smaller <= larger)


def _is_zero(expression: sp.Expr, known: Mapping[sp.Symbol, Mpf]) -> bool:
    with mpmath.workdps(DIGITS):
        return _all_vanish([expression], known)


def _all_vanish(residuals: Sequence[sp.Expr], at: Mapping[sp.Symbol, Mpf]) -> bool:
    """Say whether sums are rounding beside their terms; False if they have no values."""
    for residual in residuals:
        try:
            terms = evaluate(sp.Add.make_args(residual), at)
        except DomainError:
            return False
        if abs(mpmath.fsum(terms)) > ROUNDING * mpmath.fsum(map(abs, terms)):
            return False
    return True
