"""Elimination of Cartesian names by definitions and constraints.

The order is that of a calculation by hand: names that stand alone on one side
of an equation, then names in which an equation is linear (pivots that are
numbers or parameters first), then closed-form solutions of single equations,
whose branch the reference configuration picks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import mpmath
import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.solving import linear_parts, solutions
from lagrange_cli.mechanics.tape import DomainError, values
from lagrange_cli.scene.expression import Equation

__all__ = ["Elimination", "Stated", "eliminate"]


@dataclass(frozen=True)
class Stated:
    """One equation of a constraint over raw symbols; φ = left − right."""

    constraint: str
    equation: Equation
    left: sp.Expr
    right: sp.Expr

    @property
    def phi(self) -> sp.Expr:
        return self.left - self.right


@dataclass
class Elimination:
    """State of an elimination, and its result when nothing more can be solved.

    Attributes
    ----------
    solved
        Raw symbol → expression over what is not solved.
    by
        Raw symbol → number of the stated equation that it was solved from.
    pending
        Numbers of the stated equations not used, with both sides reduced.
    sources
        Raw symbol → numbers of the stated equations that its expression rests on.
    """

    stated: Sequence[Stated]
    reference: Mapping[sp.Symbol, mpmath.mpf]
    constants: frozenset[sp.Symbol]
    solved: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    by: dict[sp.Symbol, int] = field(default_factory=dict)
    sources: dict[sp.Symbol, frozenset[int]] = field(default_factory=dict)
    pending: dict[int, tuple[sp.Expr, sp.Expr]] = field(default_factory=dict)
    touched: dict[int, frozenset[int]] = field(default_factory=dict)
    unknowns: dict[sp.Symbol, None] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    _holders: dict[sp.Symbol, dict[sp.Symbol, None]] = field(default_factory=dict)
    _in_equations: dict[sp.Symbol, dict[int, None]] = field(default_factory=dict)

    def reduce(self, expr: sp.Expr) -> sp.Expr:
        """``expr`` with everything that is solved put in."""
        present = {s: self.solved[s] for s in expr.free_symbols if s in self.solved}
        return expr.xreplace(present) if present else expr

    def sources_of(self, expr: sp.Expr) -> frozenset[int]:
        found: frozenset[int] = frozenset()
        for s in expr.free_symbols:
            found |= self.sources.get(s, frozenset())
        return found

    def give(self, symbol: sp.Symbol, expr: sp.Expr, sources: frozenset[int]) -> None:
        """Record ``symbol = expr`` (already reduced) and put it into all that holds the symbol."""
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
        for s in expr.free_symbols:
            if s in self.unknowns:
                self._holders.setdefault(s, {})[holder] = None

    def _await(self, number: int, left: sp.Expr, right: sp.Expr) -> None:
        self.pending[number] = (left, right)
        for s in left.free_symbols | right.free_symbols:
            if s in self.unknowns:
                self._in_equations.setdefault(s, {})[number] = None

    def begin(self) -> None:
        """Queue all stated equations."""
        for number, stated in enumerate(self.stated):
            self.touched[number] = self.sources_of(stated.phi)
            self._await(number, self.reduce(stated.left), self.reduce(stated.right))

    def run(self, closed_forms: bool) -> None:
        """Solve until no step applies; only what is linear unless ``closed_forms``."""
        steps = [self._isolated, self._linear_constant, self._linear]
        if closed_forms:
            steps.append(self._closed_form)
        rank = 0
        while rank < len(steps):
            progress = False
            for number in list(self.pending):
                found = steps[rank](number)
                if found is not None:
                    del self.pending[number]
                    symbol, expr = found
                    self.by[symbol] = number
                    self.give(symbol, expr, self.touched[number] | {number})
                    progress = True
                    if rank:
                        break
            rank = 0 if progress and rank else rank + 1

    def _open_in(self, number: int) -> list[sp.Symbol]:
        """Unknowns of an equation, the last declared first."""
        left, right = self.pending[number]
        present = left.free_symbols | right.free_symbols
        return [u for u in reversed(self.unknowns) if u in present]

    def _isolated(self, number: int) -> tuple[sp.Symbol, sp.Expr] | None:
        left, right = self.pending[number]
        for name, other in ((left, right), (right, left)):
            if name in self.unknowns and name not in other.free_symbols:
                return name, other
        return None

    def _linear_constant(self, number: int) -> tuple[sp.Symbol, sp.Expr] | None:
        return self._linear_if(number, lambda a: a.free_symbols <= self.constants)

    def _linear(self, number: int) -> tuple[sp.Symbol, sp.Expr] | None:
        return self._linear_if(number, lambda a: True)

    def _linear_if(
        self, number: int, admits: Callable[[sp.Expr], bool]
    ) -> tuple[sp.Symbol, sp.Expr] | None:
        left, right = self.pending[number]
        found = []
        for unknown in self._open_in(number):
            parts = linear_parts(left - right, unknown)
            if parts is not None and admits(parts[0]):
                found.append((parts[0], unknown, -parts[1] / parts[0]))
        if not found:
            return None
        pivot = self._best([a for a, _, _ in found])
        return found[pivot][1], found[pivot][2]

    def _closed_form(self, number: int) -> tuple[sp.Symbol, sp.Expr] | None:
        left, right = self.pending[number]
        phi = left - right
        found = []
        for unknown in self._open_in(number):
            branches = solutions(phi, unknown)
            if branches:
                found.append((phi.diff(unknown), unknown, branches))
        if not found:
            return None
        _, unknown, branches = found[self._best([slope for slope, _, _ in found])]
        return unknown, self._branch(number, unknown, branches)

    def _best(self, pivots: list[sp.Expr]) -> int:
        """The pivot largest at the reference configuration; the first where that is unknown."""
        if len(pivots) == 1 or all(p.free_symbols <= self.constants for p in pivots):
            return 0
        sizes = self._at_reference(pivots)
        if any(s is None for s in sizes):
            return 0
        return max(range(len(pivots)), key=lambda k: (abs(sizes[k] or 0), -k))

    def _at_reference(self, expressions: Sequence[sp.Expr]) -> list[mpmath.mpf | None]:
        """Values at the reference configuration, None where it does not reach or is not real."""
        found: list[mpmath.mpf | None] = []
        for expr in expressions:
            point = {s: self.reference[s] for s in expr.free_symbols if s in self.reference}
            if len(point) < len(expr.free_symbols):
                found.append(None)
                continue
            try:
                found.append(values([expr], point)[0])
            except DomainError:
                found.append(None)
        return found

    def _branch(self, number: int, unknown: sp.Symbol, branches: list[sp.Expr]) -> sp.Expr:
        """The branch that the reference configuration is on."""
        if len(branches) == 1:
            return branches[0]
        at = self._at_reference(branches)
        target = self.reference.get(unknown)
        real = [k for k, value in enumerate(at) if value is not None]
        if not real and self._reaches(branches):
            raise self._unreal(number, unknown, branches)
        if not real or (target is None and len(real) != 1):
            raise self._ambiguous(number, unknown, branches)
        if target is None:
            return branches[real[0]]
        turns = {k: _turns(target, at[k], self.stated[number].phi, unknown) for k in real}
        best = min(real, key=lambda k: abs((at[k] or 0) + 2 * mpmath.pi * turns[k] - target))
        chosen = branches[best] + 2 * sp.pi * turns[best]
        self.remarks.append(
            f"{unknown} = {_written(chosen)} is the branch of"
            f" '{self.stated[number].constraint}' that the given configuration is on"
        )
        return chosen

    def _reaches(self, branches: list[sp.Expr]) -> bool:
        return all(s in self.reference for b in branches for s in b.free_symbols)

    def _unreal(self, number: int, unknown: sp.Symbol, branches: list[sp.Expr]) -> InputError:
        """The branches are complex: for good, or at the configuration that the scene gives."""
        used = sorted(self.touched[number] | {number})
        named = list(dict.fromkeys(self.stated[k].constraint for k in used))
        listed = ", ".join(f"'{n}'" for n in named)
        fixed = all(b.free_symbols <= self.constants for b in branches)
        square = _written(sp.expand(branches[-1] ** 2))
        if fixed:
            contradict = "constraints " + listed + " contradict each other"
            if len(named) == 1:
                contradict = f"constraint {listed} cannot hold"
            message = f"{contradict}: they ask for {unknown}^2 = {square}"
        else:
            message = (
                f"the given configuration does not satisfy {listed}: {unknown} would not be real"
            )
        return InputError(
            Problem(
                message,
                self.stated[number].equation.mark(),
                hint="\n".join(
                    f"{self.stated[k].constraint}: {self.stated[k].equation.text}" for k in used
                ),
                rule="inconsistent",
            )
        )

    def _ambiguous(self, number: int, unknown: sp.Symbol, branches: list[sp.Expr]) -> InputError:
        stated = self.stated[number]
        listed = ", ".join(f"{unknown} = {_written(b)}" for b in branches)
        return InputError(
            Problem(
                f"constraint '{stated.constraint}' leaves several branches: {listed}",
                stated.equation.mark(),
                hint=f"choose one by giving '{unknown}', and what it depends on,"
                " in 'initial' or 'near'",
                rule="ambiguous-branch",
            )
        )


def _turns(target: mpmath.mpf, value: mpmath.mpf | None, phi: sp.Expr, unknown: sp.Symbol) -> int:
    """Full turns between a value and the reference where the unknown is under sin or cos."""
    periodic = any(
        unknown in f.free_symbols for f in phi.atoms(sp.sin, sp.cos) if f.args[0] == unknown
    )
    if not periodic or value is None:
        return 0
    return int(mpmath.nint((target - value) / (2 * mpmath.pi)))


def _written(expr: sp.Expr) -> str:
    return str(expr).replace("**", "^")


def eliminate(
    stated: Sequence[Stated],
    given: Mapping[sp.Symbol, sp.Expr],
    unknowns: Sequence[sp.Symbol],
    reference: Mapping[sp.Symbol, mpmath.mpf],
    constants: frozenset[sp.Symbol],
    check: Callable[[Elimination], None] = lambda _: None,
) -> Elimination:
    """Solve definitions and stated equations for as many unknowns as possible.

    Parameters
    ----------
    given
        Raw symbols with their defining expressions, in any order, free of circles.
    unknowns
        Raw symbols to solve for, in reading order.
    reference
        Values of symbols at ``initial``/``near``; it picks branches.
    constants
        Parameter symbols: preferred as pivots.
    check
        Called when only closed forms with several branches remain; may refuse.
    """
    state = Elimination(stated, reference, constants, unknowns=dict.fromkeys(unknowns))
    for symbol in _dependency_order(given):
        state.give(symbol, state.reduce(given[symbol]), frozenset())
    state.begin()
    state.run(closed_forms=False)
    check(state)
    state.run(closed_forms=True)
    return state


def _dependency_order(given: Mapping[sp.Symbol, sp.Expr]) -> list[sp.Symbol]:
    """Symbols such that each comes after those its expression holds (chains may be long)."""
    done: dict[sp.Symbol, None] = {}
    for first in given:
        stack = [first]
        while stack:
            symbol = stack[-1]
            held = given[symbol].free_symbols & given.keys()
            ahead = [s for s in sorted(held, key=str) if s not in done]
            if symbol in done or not ahead:
                done[stack.pop()] = None
            else:
                stack.extend(ahead)
    return list(done)
