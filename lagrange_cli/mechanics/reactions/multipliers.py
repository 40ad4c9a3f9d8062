"""Multipliers of the scene's constraints from the forces that these exert.

f = Σ λ_k ∂φ_k/∂r holds for the Cartesian components of all particles. A body on which one unknown
multiplier acts gives it, λ = f·∇φ / ∇φ·∇φ; the forces that it exerts elsewhere are then known, and
so on from body to body, as in a statically determinate truss, joint by joint.

Definitions are first substituted in the constraints: the remaining equations must hold. Constraints
that the definitions satisfy vanish there; afterwards the search assumes that these constraints, and
no definition, hold the particles, and keeps the result where it explains the forces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced

#: Numbers below this part of their terms are zeros.
_NOTHING = mpf(10) ** -20

#: Most operations of a multiplier that is reported, and from which others are computed.
_LONGEST = 300


@dataclass(frozen=True)
class ConstraintEquation:
    """One equation of the scene with its gradient.

    Attributes
    ----------
    slopes
        Raw symbol or coordinate → ∂φ/∂s, or ∂ψ/∂ṡ of velocities, over raw symbols.
    known
        Symbol of its multiplier where it is a closure equation.
    role
        What its multiplier is of a joint.
    """

    name: str
    text: str
    slopes: Mapping[sp.Symbol, sp.Expr]
    known: sp.Expr | None = None
    role: tuple[str, ...] = ()


@dataclass(frozen=True)
class ForceBalance:
    """``force = Σ λ_k gradient_k`` along one symbol of a body.

    Attributes
    ----------
    body
        Name of the body, or of a coordinate that belongs to no body.
    force
        The constraint force.
    gradient
        Number k of an equation → slope of φ_k along the symbol.
    """

    body: str
    force: sp.Expr
    gradient: Mapping[int, sp.Expr]


@dataclass
class _Search:
    """Search for multipliers, body by body.

    Attributes
    ----------
    solved
        Number of an equation → its multiplier, as far as known.
    point
        State at which expressions are tested for zero.
    scale
        Size of the forces at the point.
    given_up
        Equations whose multipliers fill pages.
    """

    solved: dict[int, sp.Expr]
    point: SymbolValues
    scale: mpf
    given_up: set[int] = field(default_factory=set)

    def peel(self, rows: Sequence[ForceBalance], unknown: set[int]) -> None:
        """Solve body by body until no body has one or two unknown multipliers."""
        bodies: dict[str, list[ForceBalance]] = {}
        for row in rows:
            bodies.setdefault(row.body, []).append(row)
        # Two at once only where no body has one: two rods in line share their force.
        while any(
            self._solve_body(body, unknown, number) for number in (1, 2) for body in bodies.values()
        ):
            pass

    def _solve_body(self, rows: Sequence[ForceBalance], unknown: set[int], number: int) -> bool:
        """Solve for multipliers that some rows of a body determine, ``number`` at once."""
        groups: list[list[ForceBalance]] = []
        for row in rows:
            wanted = row.gradient.keys() - self.solved.keys()
            if wanted:
                joined = [g for g in groups if any(wanted & member.gradient.keys() for member in g)]
                groups = [g for g in groups if g not in joined]
                groups.append([row, *(member for g in joined for member in g)])
        return any(self._solve_group(group, unknown, number) for group in groups)

    def _solve_group(self, group: Sequence[ForceBalance], unknown: set[int], number: int) -> bool:
        """Solve the unknown multipliers of some rows, where they are determined."""
        wanted = sorted({k for row in group for k in row.gradient} - self.solved.keys())
        sought = unknown - self.given_up
        if len(wanted) != number or not sought.issuperset(wanted):
            return False
        gram = [[_dot(group, i, j) for j in wanted] for i in wanted]
        right = [self._work(group, i) for i in wanted]
        determinant = gram[0][0] if len(wanted) == 1 else sp.Matrix(gram).det()
        if _is_zero(determinant, self.point):
            return False
        if len(wanted) == 1:
            solution = [right[0] / shortened(determinant)]
        else:
            (a, b), (c, d) = gram
            x, y = right
            solution = [(d * x - b * y) / determinant, (a * y - c * x) / determinant]
        short = [shortened(e) for e in solution]
        if max(map(sp.count_ops, short)) > _LONGEST:
            self.given_up.update(wanted)
            return False
        self.solved.update(zip(wanted, short, strict=True))
        return True

    def _work(self, group: Sequence[ForceBalance], number: int) -> sp.Expr:
        """Force along the gradient of an equation, less that of known multipliers."""
        terms = []
        for row in group:
            direction = row.gradient.get(number)
            if direction is not None:
                known = [self.solved[k] * g for k, g in row.gradient.items() if k in self.solved]
                terms.append(direction * shortened(row.force - sp.Add(*known)))
        return shortened(sp.Add(*terms))

    def explains(self, row: ForceBalance) -> bool:
        """Tell whether the known multipliers make up the force along a row."""
        parts = [self.solved[k] * g for k, g in row.gradient.items() if k in self.solved]
        total, *sizes = evaluate([row.force - sp.Add(*parts), row.force, *parts], self.point)
        return bool(abs(total) <= _NOTHING * sum(map(abs, sizes), self.scale))


def multipliers(
    equations: Sequence[ConstraintEquation],
    exact: Sequence[ForceBalance],
    hoped: Sequence[ForceBalance],
    point: SymbolValues,
    scale: mpf,
) -> dict[int, sp.Expr]:
    """Multiplier of each equation that is determined, by its number.

    Parameters
    ----------
    exact
        Rows that hold, over names that no definition gives.
    hoped
        Rows that hold where the scene's equations alone hold the particles.
    point, scale
        A state of the motion, and the size of the forces there.
    """
    known = {k: e.known for k, e in enumerate(equations) if e.known is not None}
    search = _Search(known, point, scale)
    stated = {k for row in exact for k in row.gradient}
    search.peel(exact, stated)
    before = dict(search.solved)
    unknown = set(range(len(equations))) - before.keys()
    try:
        search.peel(hoped, unknown)
        wrong = {k for row in hoped if not search.explains(row) for k in row.gradient}
    except DomainError:
        return before
    # A multiplier that does not explain a force is dropped with those computed from it.
    while True:
        spoiled = {
            k for row in hoped if wrong & unknown & row.gradient.keys() for k in row.gradient
        }
        if spoiled <= wrong:
            break
        wrong |= spoiled
    return {k: e for k, e in search.solved.items() if k in before or k not in wrong}


def force_balances(
    reduced: Reduced,
    equations: Sequence[ConstraintEquation],
    forces: Mapping[sp.Symbol, sp.Expr],
    point: SymbolValues,
    *,
    keep_definitions: bool,
) -> list[ForceBalance]:
    """Rows over all names of particles, or over names and coordinates that no definition gives.

    Rows that no equation acts on are left out: they are equations of motion.

    Parameters
    ----------
    forces
        Raw symbol or coordinate → force along it, over q, v, t.
    keep_definitions
        Leave the definitions of particles' names as they are.
    """
    names = reduced.names
    owners = _owners(reduced)
    left_alone = {s for body in names.particle_symbols for s in body} if keep_definitions else set()
    givens = {s: e for s, e in names.given.items() if s not in left_alone}
    expanded = {s: _expanded(givens, s) for s in givens}
    variables = [s for s in names.cartesian.values() if s not in expanded]
    if not keep_definitions:
        variables += [c.q for c in reduced.coordinates if c.q not in names.cartesian.values()]
    rows = []
    for w in variables:
        moved = [(s, derivative(e, w)) for s, e in expanded.items()]
        chain = [(w, sp.Integer(1)), *((s, slope) for s, slope in moved if slope != 0)]
        chain = [(s, reduced.resolve(slope)) for s, slope in chain]
        slopes = ((k, _chained(reduced, e.slopes, chain)) for k, e in enumerate(equations))
        gradient = {k: slope for k, slope in slopes if not _is_zero(slope, point)}
        if gradient:
            force = _chained(reduced, forces, chain)
            rows.append(ForceBalance(owners.get(w, w.name), force, gradient))
    return rows


def _chained(
    reduced: Reduced,
    slopes: Mapping[sp.Symbol, sp.Expr],
    chain: Sequence[tuple[sp.Symbol, sp.Expr]],
) -> sp.Expr:
    """Σ slope·∂s/∂w over the names s that move with w."""
    terms = [reduced.resolve(slopes[s]) * moved for s, moved in chain if s in slopes]
    return shortened(sp.Add(*terms))


def _is_zero(expr: sp.Expr, point: SymbolValues) -> bool:
    """Tell whether a sum vanishes at a point."""
    value, *parts = evaluate([expr, *sp.Add.make_args(expr)], point)
    return bool(abs(value) <= _NOTHING * sum(map(abs, parts), mpf(0)))


def _owners(reduced: Reduced) -> dict[sp.Symbol, str]:
    """The body of each raw symbol."""
    names = reduced.names
    owners: dict[sp.Symbol, str] = {}
    for body, symbols in zip(names.bodies, names.body_symbols, strict=True):
        for s in symbols:
            owners.setdefault(s, body.name)
    return owners


def _expanded(definitions: Mapping[sp.Symbol, sp.Expr], symbol: sp.Symbol) -> sp.Expr:
    """Write a defined name over names without definitions."""
    expr = definitions[symbol]
    while present := expr.free_symbols & definitions.keys():
        expr = expr.xreplace({s: definitions[s] for s in present})
    return expr


def _dot(group: Sequence[ForceBalance], i: int, j: int) -> sp.Expr:
    pairs = [(row.gradient[i], row.gradient[j]) for row in group if {i, j} <= row.gradient.keys()]
    return shortened(sp.Add(*(a * b for a, b in pairs)))
