"""Elimination of Cartesian names by definitions and constraints.

The order is that of a calculation by hand: names that stand alone on one side of an equation, then
names in which an equation is linear (pivots that are numbers or parameters first), then closed-form
solutions of single equations, whose branch the reference configuration picks. An equation whose
branches depend on another name still open stays: a choice would hold in one chart only.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from graphlib import TopologicalSorter

import mpmath
import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.alpha_equivalence import shape
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import Substitution
from lagrange_cli.mechanics.elimination.branches import (
    AmbiguousFactorError,
    BranchedSolution,
    NoRealSolutionError,
    meet,
)
from lagrange_cli.mechanics.elimination.solve_equation import (
    factor_branches,
    linear_parts,
    linear_solution,
    solutions,
    solves_everywhere,
)
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.symbols.quoting import with_carets
from lagrange_cli.scene.language.expression import Equation

#: Largest relative value that counts as zero at the reference, written in some ten decimals.
_VANISHES = mpmath.mpf(10) ** -9
#: Distance of another solution, relative to the scene's length: above rounding, below branches.
_ELSEWHERE = mpmath.mpf(10) ** -6


@dataclass(frozen=True)
class StatedEquation:
    """One equation of a constraint over raw symbols; φ = left − right.

    Attributes
    ----------
    constraint, equation
        Name of the constraint; the equation as written.
    left, right
        Its sides.
    integral, one_sided, joint
        True if the scene states its rate; if it is φ ≥ 0; if it is one of a joint.
    """

    constraint: str
    equation: Equation
    left: sp.Expr
    right: sp.Expr
    integral: bool = False
    one_sided: bool = False
    joint: bool = False

    @property
    def phi(self) -> sp.Expr:
        return self.left - self.right


@dataclass
class Elimination:
    """State of an elimination, and its result when nothing more can be solved.

    Attributes
    ----------
    solved
        Raw symbol → expression over symbols that are not solved.
    by
        Raw symbol → number of the stated equation that it was solved from.
    pending
        Numbers of the stated equations without a solved name, with both sides reduced.
    sources
        Raw symbol → numbers of the stated equations that its expression rests on.
    touched
        Pending equation → numbers of the stated equations that were put into it.
    remarks
        Sentences on the branches that were chosen.
    """

    stated: Sequence[StatedEquation]
    reference: Mapping[sp.Symbol, mpmath.mpf]
    constants: frozenset[sp.Symbol]
    declared: bool = True
    solved: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    by: dict[sp.Symbol, int] = field(default_factory=dict)
    sources: dict[sp.Symbol, frozenset[int]] = field(default_factory=dict)
    pending: dict[int, tuple[sp.Expr, sp.Expr]] = field(default_factory=dict)
    touched: dict[int, frozenset[int]] = field(default_factory=dict)
    unknowns: dict[sp.Symbol, None] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    _holders: dict[sp.Symbol, dict[sp.Symbol, None]] = field(default_factory=dict)
    _in_equations: dict[sp.Symbol, dict[int, None]] = field(default_factory=dict)
    #: Shapes of equations, and steps that are known to fail for a shape.
    _shapes: dict[int, Hashable] = field(default_factory=dict)
    _useless: set[tuple[str, Hashable]] = field(default_factory=set)
    #: Factor over parameters → true if it is zero at their values.
    _zeros: dict[sp.Expr, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._order = {symbol: k for k, symbol in enumerate(self.unknowns)}

    def reduce(self, expr: sp.Expr) -> sp.Expr:
        """Substitute all solved symbols in ``expr``."""
        present = {s: self.solved[s] for s in symbols_in(expr) if s in self.solved}
        return Substitution(present).put_into(expr) if present else expr

    def sources_of(self, expr: sp.Expr) -> frozenset[int]:
        """Collect the numbers of stated equations that the symbols of ``expr`` rest on."""
        return frozenset[int]().union(*(self.sources.get(s, ()) for s in symbols_in(expr)))

    def behind(self, numbers: Iterable[int]) -> list[int]:
        """List the numbers of some stated equations and of those put into them, ascending."""
        return sorted(set(numbers).union(*(self.touched[k] for k in numbers)))

    def give(self, symbol: sp.Symbol, expr: sp.Expr, sources: frozenset[int]) -> None:
        """Record ``symbol = expr`` (already reduced) and substitute it for the symbol."""
        sources |= self.sources_of(expr)
        for holder in self._holders.pop(symbol, {}):
            self.solved[holder] = self.solved[holder].xreplace({symbol: expr})
            self.sources[holder] |= sources
            self._index(holder, expr)
        self.solved[symbol] = expr
        self.sources[symbol] = sources
        self.unknowns.pop(symbol, None)
        self._index(symbol, expr)
        for number in self._in_equations.pop(symbol, {}):
            if number in self.pending:
                left, right = self.pending[number]
                self.touched[number] |= sources
                self._await(number, left.xreplace({symbol: expr}), right.xreplace({symbol: expr}))

    def _index(self, holder: sp.Symbol, expr: sp.Expr) -> None:
        for s in symbols_in(expr):
            if s in self.unknowns:
                self._holders.setdefault(s, {})[holder] = None

    def _await(self, number: int, left: sp.Expr, right: sp.Expr) -> None:
        self.pending[number] = (left, right)
        self._shapes.pop(number, None)
        for s in symbols_in(left) | symbols_in(right):
            if s in self.unknowns:
                self._in_equations.setdefault(s, {})[number] = None

    def _define(self, definitions: Mapping[sp.Symbol, sp.Expr]) -> None:
        """Give symbols their defining expressions, each after those that occur in it."""
        within = {
            s: sorted(symbols_in(e) & definitions.keys(), key=str) for s, e in definitions.items()
        }
        for symbol in TopologicalSorter(within).static_order():
            self.give(symbol, self.reduce(definitions[symbol]), frozenset())

    def begin(self, definitions: Mapping[sp.Symbol, sp.Expr]) -> None:
        """Put definitions in and queue all stated equations."""
        self._define(definitions)
        for number, stated in enumerate(self.stated):
            self.touched[number] = self.sources_of(stated.phi)
            self._await(number, self.reduce(stated.left), self.reduce(stated.right))

    def run(self, kinds: int) -> None:
        """Solve until none of the first ``kinds`` steps applies."""
        steps = [
            self._isolated,
            lambda number: self._linear(number, constant_pivot=True),
            self._linear,
            self._closed_form,
        ][:kinds]
        rank = 0
        while rank < len(steps):
            progress = False
            for number in list(self.pending):
                solution = steps[rank](number)
                if solution is not None:
                    del self.pending[number]
                    symbol, expr = solution
                    self.by[symbol] = number
                    self.give(symbol, expr, self.touched[number] | {number})
                    progress = True
                    if rank:
                        break
            rank = 0 if progress and rank else rank + 1

    def _open_in(self, number: int) -> list[sp.Symbol]:
        """List the unknowns of an equation, the last declared first."""
        left, right = self.pending[number]
        return self.in_order(symbols_in(left) | symbols_in(right))[::-1]

    def in_order(self, symbols: Iterable[sp.Symbol]) -> list[sp.Symbol]:
        """Sort the unknowns among some symbols by declaration."""
        return sorted((s for s in symbols if s in self.unknowns), key=self._order.__getitem__)

    def _shape(self, number: int) -> Hashable:
        """Compute a key shared by equations that differ in the names of their unknowns only."""
        if number not in self._shapes:
            places = {u: k for k, u in enumerate(self._open_in(number))}
            left, right = self.pending[number]
            self._shapes[number] = shape(left, places), shape(right, places)
        return self._shapes[number]

    def _isolated(self, number: int) -> tuple[sp.Symbol, sp.Expr] | None:
        left, right = self.pending[number]
        for name, opposite in ((left, right), (right, left)):
            if name in self.unknowns and name not in opposite.free_symbols:
                return name, opposite
        return None

    def _linear(
        self, number: int, constant_pivot: bool = False
    ) -> tuple[sp.Symbol, sp.Expr] | None:
        if ("linear", self._shape(number)) in self._useless:
            return None
        candidates, linear, phi = [], False, self._phi(number)
        for unknown in self._open_in(number):
            parts = linear_parts(phi, unknown)
            linear = linear or parts is not None
            if parts is None:
                continue
            pivot, remainder = parts
            fixed = pivot.free_symbols <= self.constants
            if (constant_pivot and not fixed) or not self._everywhere(pivot, remainder):
                continue
            if fixed or not self._loses(number, unknown, [-remainder / pivot]):
                candidates.append((pivot, unknown, remainder))
        if not linear:
            self._useless.add(("linear", self._shape(number)))
        if not candidates:
            return None
        pivot, unknown, remainder = candidates[self._best([a for a, _, _ in candidates])]
        if not pivot.free_symbols <= self.constants and self._choose_factor(number):
            return self._linear(number, constant_pivot)
        return unknown, linear_solution(pivot, remainder)

    def _phi(self, number: int) -> sp.Expr:
        left, right = self.pending[number]
        return left - right

    def _choose_factor(self, number: int) -> bool:
        """Replace a product that must vanish by the factor that does at the reference.

        False if φ is no product; AmbiguousFactorError if no or several factors vanish there.
        """
        factors = factor_branches(self._phi(number), self.constants)
        if len(factors) < 2:
            return False
        sizes = self._at_reference(factors)
        vanish = [k for k, x in enumerate(sizes) if x is not None and abs(x) <= _VANISHES]
        if None in sizes or len(vanish) != 1:
            stated = self.stated[number]
            raise AmbiguousFactorError(stated.constraint, stated.equation, factors)
        self._await(number, factors[vanish[0]], sp.Integer(0))
        return True

    def _closed_form(self, number: int) -> tuple[sp.Symbol, sp.Expr] | None:
        if ("closed form", self._shape(number)) in self._useless:
            return None
        self._choose_factor(number)
        phi = self._phi(number)
        candidates, solved = [], False
        names = self._open_in(number)
        for unknown in names:
            branches = solutions(phi, unknown, self._value, several=len(names) == 1)
            solved = solved or bool(branches)
            parts = linear_parts(phi, unknown)
            if parts is not None and not self._everywhere(*parts):
                continue
            if branches and not self._loses(number, unknown, branches):
                candidates.append((derivative(phi, unknown), unknown, branches))
        if not solved:
            self._useless.add(("closed form", self._shape(number)))
        if not candidates:
            return None
        _, unknown, branches = candidates[self._best([slope for slope, _, _ in candidates])]
        return unknown, self._branch(number, unknown, branches)

    def _everywhere(self, pivot: sp.Expr, remainder: sp.Expr) -> bool:
        """Say whether −remainder/pivot may be divided out.

        With declared coordinates it may unless a factor is zero at the parameters' values.
        """
        factors = [f for f in sp.Mul.make_args(pivot) if f.free_symbols <= self.constants]
        if any(self._is_zero(f) for f in factors):
            return False
        return self.declared or solves_everywhere(pivot, remainder, self.constants)

    def _is_zero(self, factor: sp.Expr) -> bool:
        """Say whether a factor vanishes within relative changes of 1e-9 of the parameters."""
        if factor not in self._zeros:
            symbols = sorted(factor.free_symbols, key=str)
            value, *changes = self._at_reference(
                [factor, *(s * derivative(factor, s) for s in symbols)]
            )
            size = sum(abs(x) for x in changes if x is not None)
            unknown = value is None or not symbols
            self._zeros[factor] = not unknown and bool(abs(value or 0) <= _VANISHES * size)
        return self._zeros[factor]

    def _loses(self, number: int, unknown: sp.Symbol, branches: Sequence[sp.Expr]) -> bool:
        """Say whether the given configuration satisfies an equation, but none of its solutions.

        They divide by a factor that vanishes there: z·(eˣ − 1) = 0 holds at x = 0 for every z.
        """
        phi = self._phi(number)
        if unknown not in self.reference or not all(s in self.reference for s in phi.free_symbols):
            return False
        terms = self._at_reference(sp.Add.make_args(phi))
        sizes = [abs(x) for x in terms if x is not None]
        if len(sizes) < len(terms) or abs(self._value(phi) or 0) > _VANISHES * sum(sizes):
            return False
        target = self.reference[unknown]
        reach = _ELSEWHERE * max(self._length([phi]), abs(target))
        return all(x is None or abs(x - target) > reach for x in self._at_reference(branches))

    def _value(self, expr: sp.Expr) -> mpmath.mpf | None:
        return self._at_reference([expr])[0]

    def _best(self, pivots: list[sp.Expr]) -> int:
        """Choose the largest pivot at the reference configuration; the first one without values."""
        if len(pivots) == 1 or all(p.free_symbols <= self.constants for p in pivots):
            return 0
        sizes = self._at_reference(pivots)
        if any(s is None for s in sizes):
            return 0
        return max(range(len(pivots)), key=lambda k: (abs(sizes[k] or 0), -k))

    def _at_reference(self, expressions: Sequence[sp.Expr]) -> list[mpmath.mpf | None]:
        """Evaluate at the reference configuration; None for an unknown or complex value."""
        numbers: list[mpmath.mpf | None] = [None] * len(expressions)
        for k, expr in enumerate(expressions):
            point = {s: self.reference[s] for s in expr.free_symbols if s in self.reference}
            if len(point) == len(expr.free_symbols):
                with suppress(DomainError):
                    numbers[k] = evaluate([expr], point)[0]
        return numbers

    def _branch(self, number: int, unknown: sp.Symbol, branches: list[sp.Expr]) -> sp.Expr:
        """Choose the branch on which the reference configuration lies."""
        if unknown.is_positive:
            branches = [b for b in branches if not b.is_nonpositive] or branches
        at = self._at_reference(branches)
        real = [k for k, value in enumerate(at) if value is not None]
        never = all(b.is_real is False for b in branches)
        known = all(b.free_symbols <= self.reference.keys() for b in branches)
        if never or (not real and known):
            raise self._unreal(number, unknown, branches)
        if len(branches) == 1:
            return branches[0]
        target = self.reference.get(unknown)
        if not real or (target is None and len(real) != 1):
            raise self._solution(number, unknown, branches).several()
        distance = {k: abs((at[k] or 0) - (target or 0)) for k in real}
        best = min(real, key=distance.__getitem__)
        length = self._length(branches)
        if any(k != best and meet(at[k], at[best], length) for k in real):
            raise self._solution(number, unknown, branches).meeting()
        named = self.stated[number].constraint
        self.remarks.append(
            f"{unknown} = {with_carets(branches[best])} is the branch of '{named}'"
            " that the given configuration is on"
        )
        return branches[best]

    def _length(self, expressions: Sequence[sp.Expr]) -> mpmath.mpf:
        """Largest value of the names in the expressions at the reference configuration."""
        symbols = {s for e in expressions for s in e.free_symbols - self.constants}
        return max((abs(self.reference[s]) for s in symbols if s in self.reference), default=0)

    def _unreal(self, number: int, unknown: sp.Symbol, branches: list[sp.Expr]) -> InputError:
        """Refuse branches that are complex: for good, or at the given configuration."""
        used = sorted(self.touched[number] | {number})
        listed = ", ".join(f"'{n}'" for n in dict.fromkeys(self.stated[k].constraint for k in used))
        if all(b.is_real is False or b.free_symbols <= self.constants for b in branches):
            left, right = self.pending[number]
            written = f"{with_carets(left)} = {with_carets(right)}"
            message = f"{written} holds for no real {unknown}: {listed}"
            mark = self.stated[number].equation.mark()
            return NoRealSolutionError(Problem(message, mark, rule="inconsistent"), used)
        message = f"the given configuration does not satisfy {listed}: {unknown} is not real"
        return self._solution(number, unknown, branches).unreal(message)

    def _solution(
        self, number: int, unknown: sp.Symbol, branches: Sequence[sp.Expr]
    ) -> BranchedSolution:
        name, mark = self.stated[number].constraint, self.stated[number].equation.mark()
        return BranchedSolution(name, mark, unknown, branches, self.reference, self.constants)


def eliminate(
    stated: Sequence[StatedEquation],
    definitions: Mapping[sp.Symbol, sp.Expr],
    unknowns: Sequence[sp.Symbol],
    reference: Mapping[sp.Symbol, mpmath.mpf],
    constants: frozenset[sp.Symbol],
    check: Callable[[Elimination], None] = lambda _: None,
    declared: bool = True,
) -> Elimination:
    """Solve definitions and stated equations for as many unknowns as possible.

    Parameters
    ----------
    definitions
        Raw symbol → defining expression, in any order, free of circles.
    unknowns
        Raw symbols to solve for, in reading order.
    reference
        Values of symbols at ``initial``/``near``; it picks branches.
    constants
        Parameter symbols: preferred as pivots.
    check
        Called when only closed forms with several branches remain; raises to refuse.
    declared
        True if the scene declares its coordinates.
    """
    state = Elimination(stated, reference, constants, declared, unknowns=dict.fromkeys(unknowns))
    state.begin(definitions)
    state.run(3)
    check(state)
    state.run(4)
    return state


def substitute(
    stated: Sequence[StatedEquation],
    definitions: Mapping[sp.Symbol, sp.Expr],
    unknowns: Sequence[sp.Symbol],
    constants: frozenset[sp.Symbol],
    reference: Mapping[sp.Symbol, mpmath.mpf] | None = None,
) -> Elimination:
    """Eliminate without a choice of branch, and without division by a factor that may vanish.

    Parameters are those of :func:`eliminate`; the reference holds values of the constants.
    """
    state = Elimination(stated, reference or {}, constants, unknowns=dict.fromkeys(unknowns))
    state.begin(definitions)
    state.run(2)
    return state
