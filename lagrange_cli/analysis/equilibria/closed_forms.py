"""Equilibria in closed form: equations split into factors and solved one after the other.

An equation that is a product gives a branch for each factor. Within a branch an equation in one
unknown is solved (:mod:`.single_equation`), an unknown that stands linearly is eliminated, and so
on until nothing is left. A factor in parameters alone gives a branch as well, under the relation
that it vanishes: the law of a lever (:mod:`.parameter_relations`); so does a factor that was
divided by. Each step keeps all solutions, so that a search that ends has found all. A branch that
cannot be solved is tried where symmetry often puts an equilibrium, its angles at 0 and π.
Candidates are put into the equations before they count.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import mpmath
import sympy as sp

from lagrange_cli.analysis.equilibria.parameter_relations import (
    ParameterFacts,
    Relation,
    all_vanish,
    solved_relation,
)
from lagrange_cli.analysis.equilibria.repeats import without_contained
from lagrange_cli.analysis.equilibria.rest_system import RestSystem
from lagrange_cli.analysis.equilibria.single_equation import (
    constant_factors,
    factors_of,
    real_roots,
)
from lagrange_cli.analysis.values import DIGITS, AbsentEquilibrium, Equilibrium, Existence, Mpf
from lagrange_cli.mechanics.algebra.identities import by_single_angles
from lagrange_cli.mechanics.algebra.polynomials import cancelled
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.elimination.solve_equation import linear_parts
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.zero_test import vanish

# The budget, in counts, so that outputs do not depend on the speed of a machine: beyond it a search
# in numbers is quicker, and closed forms are too long to read.

#: Unknowns.
_UNKNOWNS = 12
#: Branches that are followed.
_BRANCHES = 300
#: Angles of a branch of which each is tried at 0 and at π; all of more are tried at 0.
_TURNED = 4
#: Operations of one equation.
_OPERATIONS = 400


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
    nonzero
        Names of parameters without a value for which that is proven only where they are not zero.
    """

    points: tuple[Equilibrium, ...]
    absent: tuple[AbsentEquilibrium, ...]
    complete: bool
    nonzero: tuple[str, ...] = ()


@dataclass(frozen=True)
class Branch:
    """Equations that are still to be solved, and the values found so far, the last first.

    ``relations`` between parameters hold in all of it. Where one of the ``excluded`` expressions
    vanishes another branch has what there is. ``is_trial``: some unknowns are at places that were
    tried, so that a relation would only say when these are equilibria.
    """

    equations: tuple[sp.Expr, ...]
    unknowns: tuple[sp.Symbol, ...]
    values: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    conditions: tuple[Existence, ...] = ()
    relations: tuple[Relation, ...] = ()
    excluded: frozenset[sp.Expr] = frozenset()
    is_trial: bool = False

    def solved(
        self, unknown: sp.Symbol, value: sp.Expr, conditions: tuple[Existence, ...] = ()
    ) -> Branch:
        """Substitute a value for an unknown."""
        return replace(
            self,
            equations=tuple(e.xreplace({unknown: value}) for e in self.equations),
            unknowns=tuple(u for u in self.unknowns if u != unknown),
            values=((unknown, value), *self.values),
            conditions=(*self.conditions, *conditions),
        )

    def without(self, expressions: Iterable[sp.Expr]) -> Branch:
        """Leave what there is where an expression in parameters vanishes to other branches."""
        return replace(self, excluded=self.excluded | {s * e for e in expressions for s in (1, -1)})

    def related(self, condition: Existence, relation: Relation | None) -> Branch:
        """Take a relation between parameters to hold."""
        solved = () if relation is None else (relation,)
        equations = self.equations
        for taken in solved:
            equations = tuple(map(taken.applied, equations))
        return replace(
            self,
            equations=equations,
            conditions=(*self.conditions, condition),
            relations=(*self.relations, *solved),
        )

    @property
    def solution(self) -> dict[sp.Symbol, sp.Expr]:
        """The values over parameters and the unknowns that stay open."""
        values = dict[sp.Symbol, sp.Expr]()
        for unknown, value in self.values:
            values[unknown] = value.xreplace(values)
        return values

    def under_relations(self, expression: sp.Expr) -> sp.Expr:
        """Put the relations between parameters into an expression."""
        for relation in self.relations:
            expression = relation.applied(expression)
        return expression


class Solver:
    """Follows the branches of some equations in the unknowns of a system.

    Parameters
    ----------
    exhaustive
        Follow also the branches in which a parameter without a value is zero.

    Attributes
    ----------
    complete
        True if all branches were followed to their end.
    nonzero
        Parameters without a value that were taken not to be zero.
    """

    def __init__(self, system: RestSystem, *, exhaustive: bool = False) -> None:
        self.system, self.exhaustive = system, exhaustive
        coordinates = system.equations.system.coordinates
        self.facts = ParameterFacts.of_system(system)
        self.angles = {c.q for c in coordinates if c.is_angle}
        self.branches = 0
        self.nonzero: set[sp.Symbol] = set()
        # Equations of an angle outside of sines and cosines are solved for one turn only.
        turning = (k for k, c in enumerate(coordinates) if c.is_angle and k not in system.free)
        self.complete = all(k in system.periodic for k in turning)

    def run(self, equations: Sequence[sp.Expr], unknowns: Sequence[sp.Symbol]) -> Iterator[Branch]:
        """Yield the branches that end in a solution."""
        pending = [Branch(tuple(equations), tuple(unknowns))]
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
                pending = [*self._trials(branch), *pending]

    def _trials(self, branch: Branch) -> Iterator[Branch]:
        """Put the angles of a branch to 0 and π; without angles all coordinates to 0."""
        present = frozenset().union(*(e.free_symbols for e in branch.equations))
        coordinates = self.system.equations.system.coordinates
        open_ones = [c.q for c in coordinates if c.q in present and c.q in branch.unknowns]
        angles = [q for q in open_ones if q in self.angles]
        sides = (sp.S.Zero, sp.pi) if angles and len(angles) <= _TURNED else (sp.S.Zero,)
        chosen = angles or open_ones
        for places in product(sides, repeat=len(chosen)) if chosen else ():
            trial = replace(branch, is_trial=True)
            for unknown, place in zip(chosen, places, strict=True):
                trial = trial.solved(unknown, place)
            yield trial

    def _simplified(self, branch: Branch) -> Branch | None:
        """Drop equations that hold; None if one of them cannot hold."""
        unknowns, remaining = frozenset(branch.unknowns), []
        for written in branch.equations:
            if sp.count_ops(written) > _OPERATIONS:
                raise _BudgetError
            equation = cancelled(written)
            if equation.free_symbols & unknowns:
                remaining.append(equation)
            elif not has_value(equation):
                return None
            elif equation != 0 and not _vanish(written) and not _is_zero(equation):
                remaining.append(equation)
        return replace(branch, equations=tuple(remaining))

    def _step(self, branch: Branch) -> list[Branch]:
        unknowns = frozenset(branch.unknowns)
        split = [factors_of(e, unknowns) for e in branch.equations]
        for k, (equation, factors) in enumerate(zip(branch.equations, split, strict=True)):
            balances = self._balances(equation, unknowns)
            if len(factors) == 1 and not balances:
                continue
            before, after = branch.equations[:k], branch.equations[k + 1 :]
            regular = branch.without(balances)
            return [
                *(replace(regular, equations=(*before, f, *after)) for f in factors),
                *self._related(replace(branch, equations=(*before, *after)), balances),
            ]
        equations = tuple(factors[0] for factors in split)
        branch = replace(branch, equations=equations)
        return self._by_roots(branch) or self._by_elimination(branch)

    # Factors in parameters alone.

    def _balances(self, equation: sp.Expr, unknowns: frozenset[sp.Symbol]) -> list[sp.Expr]:
        """List the factors in parameters alone that may vanish: ``a m g − b F`` of a lever.

        These are differences, functions such as a sine, and factors that are zero for the values
        of the parameters. A parameter without a value is taken not to be zero.
        """
        balances = []
        for factor in constant_factors(equation, unknowns):
            if self.facts.vanishes(factor) or self._is_difference(factor):
                balances.append(factor)
            elif not self.facts.is_nonzero(factor):
                if factor.is_Symbol and not self.exhaustive:
                    self.nonzero.add(factor)
                else:
                    balances.append(factor)
        return balances

    def _is_difference(self, factor: sp.Expr) -> bool:
        """Say whether the terms of a sum with values have both signs."""
        known = self.system.known
        if not factor.is_Add or factor.is_nonzero or not factor.free_symbols <= known.keys():
            return False
        try:
            return len({term > 0 for term in evaluate(factor.args, known)}) == 2
        except DomainError:
            return False

    def _related(self, branch: Branch, expressions: Iterable[sp.Expr]) -> Iterator[Branch]:
        """Take one of the expressions in parameters to vanish."""
        for expression in expressions:
            if branch.is_trial or expression in branch.excluded:
                continue
            relation = solved_relation(expression, self.facts)
            if relation is not None and branch.equations:
                self.nonzero |= set(self.facts.open_symbols(relation.divisor) or ())
                if not all(map(relation.is_whole_in, branch.equations)):
                    self.complete = False
            yield branch.related(self.facts.balance(expression), relation)

    def _divided(
        self, branch: Branch, divisors: Sequence[sp.Expr], regular: Sequence[Branch]
    ) -> list[Branch]:
        """Add the branches in which a factor vanishes that ``regular`` ones are divided by."""
        exceptions: list[sp.Expr] = []
        for divisor in dict.fromkeys(divisors):
            if self.facts.vanishes(divisor):
                return list(self._related(branch, [divisor]))
            if self.facts.is_nonzero(divisor):
                continue
            symbols = self.facts.open_symbols(divisor)
            if symbols is None:
                exceptions.append(divisor)
                continue
            zeros = [s for s in symbols if self._holds_without(branch, s)]
            if self.exhaustive:
                exceptions += zeros
            else:
                self.nonzero |= set(zeros)
        return [*(b.without(exceptions) for b in regular), *self._related(branch, exceptions)]

    def _holds_without(self, branch: Branch, symbol: sp.Symbol) -> bool:
        """Say whether the equations may hold where a parameter is zero."""
        unknowns = frozenset(branch.unknowns)
        zero = (cancelled(e.xreplace({symbol: sp.S.Zero})) for e in branch.equations)
        return not any(
            e != 0 and not e.free_symbols & unknowns and self.facts.is_nonzero(e) for e in zero
        )

    # Unknowns.

    def _by_roots(self, branch: Branch) -> list[Branch] | None:
        """Solve the shortest equation in one unknown; None if there is none that can be."""
        unknowns = frozenset(branch.unknowns)
        for equation in sorted(branch.equations, key=sp.count_ops):
            present = equation.free_symbols & unknowns
            if len(present) != 1:
                continue
            (unknown,) = present
            root_set = real_roots(equation, unknown, is_angle=unknown in self.angles)
            if root_set is not None:
                regular = [branch.solved(unknown, r.value, r.conditions) for r in root_set.roots]
                return self._divided(branch, root_set.divisors, regular) or [
                    replace(branch, equations=(sp.S.One,))
                ]
        return None

    def _by_elimination(self, branch: Branch) -> list[Branch]:
        """Solve an equation for an unknown whose factor is a constant that does not vanish."""
        unknowns = frozenset(branch.unknowns)
        for equation in sorted(branch.equations, key=sp.count_ops):
            for unknown in branch.unknowns:
                if unknown not in equation.free_symbols:
                    continue
                parts = linear_parts(equation, unknown)
                if parts is None or parts[0].free_symbols & unknowns:
                    continue
                if not self.facts.vanishes(parts[0]):
                    regular = branch.solved(unknown, cancelled(-parts[1] / parts[0]))
                    return self._divided(branch, parts[:1], [regular])
        raise _BudgetError


def closed_forms(system: RestSystem) -> ClosedForms | None:
    """Solve the equations of equilibrium in closed form; None beyond the budget.

    Some equilibria may be found, and others not: then they are not complete.
    """
    if len(system.unknowns) > _UNKNOWNS:
        return None
    if sum(sp.count_ops(e) for e in system.forces) > _UNKNOWNS * _OPERATIONS:
        return None
    solver = Solver(system)
    points: list[Equilibrium] = []
    absent: list[AbsentEquilibrium] = []
    complete = True
    for branch in solver.run((*system.forces, *system.constraints), system.unknowns):
        try:
            solution = _with_positions(system, branch)
        except _BudgetError:
            complete = False
            continue
        if isinstance(solution, AbsentEquilibrium):
            absent.append(solution)
        elif solution is not None:
            points.append(solution)
    nonzero = tuple(s.name for s in solver.facts.order if s in solver.nonzero)
    points = without_contained(system.equations.system.coordinates, points)
    return ClosedForms(tuple(points), tuple(absent), complete and solver.complete, nonzero)


def _with_positions(system: RestSystem, branch: Branch) -> Equilibrium | AbsentEquilibrium | None:
    """Return the equilibrium of a branch; None if it does not satisfy the equations.

    Raises
    ------
    _BudgetError
        It has no value for these parameters, or satisfies them for some alone.
    """
    values = branch.solution
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
    everything = (*system.forces, *system.constraints)
    placed = [branch.under_relations(e.xreplace(values)) for e in everything]
    if not all(has_value(branch.under_relations(e)) for e in (*exact, *forces)):
        return None  # a relation makes a divisor vanish, whose branch is another one
    if system.missing:
        if any(
            c.q.is_positive and e.is_nonpositive for c, e in zip(coordinates, exact, strict=True)
        ):
            return None
        if not _vanish(*placed):
            raise _BudgetError
        return point
    residuals = [e.xreplace(values) for e in everything]
    start = {c.q: x for c, x in zip(coordinates, system.start, strict=True)}
    at = {**system.known, **start}
    with mpmath.workdps(DIGITS):
        if any(_holds(c, system.known) is False for c in branch.conditions):
            return AbsentEquilibrium(exact, branch.conditions)
        try:
            numbers, uncertainty = system.numbers([*exact, *forces])
        except DomainError:
            raise _BudgetError from None
        if not _vanish(*placed) and not all_vanish(residuals, at):
            return None
    n = len(exact)
    if not system.allows(numbers[:n]):
        return None
    return replace(
        point,
        position=tuple(numbers[:n]),
        multipliers=tuple(numbers[n:]),
        uncertainty=uncertainty,
    )


def _vanish(*expressions: sp.Expr) -> bool:
    """Say whether it is proven that expressions vanish, as sin 2u − 2 sin u cos u at u = asin c."""
    return vanish(*expressions) or vanish(*map(by_single_angles, expressions))


def _is_zero(number: sp.Expr) -> bool:
    """Say whether digits do not tell a number from zero; False for expressions in parameters."""
    with mpmath.workdps(DIGITS):
        return not number.free_symbols and all_vanish([number], {})


def _holds(condition: Existence, known: Mapping[sp.Symbol, Mpf]) -> bool | None:
    """Say whether a condition holds; None if its sides have no values."""
    if condition.relation == "=":
        return all_vanish([condition.smaller - condition.larger], known)
    try:
        smaller, larger = evaluate([condition.smaller, condition.larger], known)
    except DomainError:
        return None
    return bool(smaller <= larger)
