"""Geometry after elimination: positions over coordinates, and pending equations."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import sympy as sp
from mpmath import mpf
from mpmath.libmp import to_rational

from lagrange_cli.errors import Mark
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import Substitution
from lagrange_cli.mechanics.diagnosis import errors as refusals
from lagrange_cli.mechanics.diagnosis.inconsistency import contradiction_error
from lagrange_cli.mechanics.elimination.eliminate import Elimination
from lagrange_cli.mechanics.elimination.solve_equation import (
    linear_parts,
    solutions,
    solves_everywhere,
)
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE, SymbolValues
from lagrange_cli.mechanics.proofs.zero_test import does_not_depend
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import must_stay
from lagrange_cli.scene.bodies import Body, bodies_of
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Unilateral

#: Function from equations to the numbers of those that hold identically around the start.
IdentityFinder = Callable[[Mapping[int, tuple[sp.Expr, sp.Expr]]], Collection[int]]


@dataclass(frozen=True)
class Geometry:
    """Positions over the coordinates that an elimination leaves.

    Attributes
    ----------
    resolved
        Raw symbol → r(q, t).
    coordinates
        Symbols q.
    reference
        Values of symbols at ``initial``/``near``.
    """

    names: Names
    elimination: Elimination
    resolved: Mapping[sp.Symbol, sp.Expr]
    coordinates: Sequence[sp.Symbol]
    reference: Mapping[sp.Symbol, mpf]

    @property
    def positions(self) -> list[sp.Symbol]:
        """Raw symbols of the particles' components, 3N of them."""
        return [s for body in self.names.particle_symbols for s in body]

    @cached_property
    def raw_rotations(self) -> tuple[sp.Expr, ...]:
        """Entries of the rotation matrices of bodies over raw symbols."""
        return tuple(e for b in bodies_of(self.names.scene) for e in rotation_of(self.names, b))

    @cached_property
    def rotations(self) -> tuple[sp.Expr, ...]:
        """Distinct entries of the rotation matrices of bodies that move."""
        placed = dict.fromkeys(map(self._placed, self.raw_rotations))
        return tuple(e for e in placed if not symbols_in(e).isdisjoint(self._free))

    @cached_property
    def _free(self) -> frozenset[sp.Symbol]:
        return frozenset(self.coordinates)

    @property
    def places(self) -> list[sp.Expr]:
        """Distinct components of particles that move, and entries of rotation matrices."""
        components = (s for s in dict.fromkeys(self.positions) if self.position_symbols[s])
        return [*(self.resolved[s] for s in components), *self.rotations]

    def moving(self, expressions: Sequence[sp.Expr] = ()) -> list[sp.Symbol]:
        """Coordinates that move particles and bodies, or occur in some expressions."""
        inside = set().union(*(self.position_symbols[s] for s in self.positions))
        inside.update(s for e in (*self.rotations, *expressions) for s in symbols_in(e))
        return [q for q in self.coordinates if q in inside]

    @cached_property
    def order(self) -> Mapping[sp.Symbol, int]:
        """Numbers of the coordinates."""
        return {q: j for j, q in enumerate(self.coordinates)}

    @cached_property
    def position_symbols(self) -> Mapping[sp.Symbol, frozenset[sp.Symbol]]:
        """Raw symbol → free symbols of its position."""
        return {s: symbols_in(r) for s, r in self.resolved.items()}

    def closure_equation(self, number: int) -> ClosureEquation:
        """Return a pending equation as a closure."""
        stated = self.elimination.stated[number]
        left, right = self.elimination.pending[number]
        equation = stated.equation
        return ClosureEquation(
            stated.constraint,
            "position",
            left,
            right,
            equation.text,
            equation.mark(),
            stated.integral,
        )

    @cached_property
    def solved_sides(self) -> dict[int, tuple[sp.Expr, sp.Expr]]:
        """Both sides of the equations from which names were solved, with the solutions put in."""
        sides = {}
        for number in sorted(set(self.elimination.by.values())):
            stated = self.elimination.stated[number]
            left, right = (self._placed(e) for e in (stated.left, stated.right))
            if left != right:
                sides[number] = left, right
        return sides

    def _placed(self, expr: sp.Expr) -> sp.Expr:
        return self._substitution.put_into(expr)

    @cached_property
    def _substitution(self) -> Substitution:
        return Substitution({s: place for s, place in self.resolved.items() if place != s})

    @cached_property
    def gaps(self) -> tuple[ClosureEquation, ...]:
        """The one-sided constraints: ``left`` ≥ ``right``."""
        return tuple(map(self._gap, self.names.scene.unilateral))

    def _gap(self, one_sided: Unilateral) -> ClosureEquation:
        written = one_sided.inequality
        left, right = self._resolved(written.left), self._resolved(written.right)
        if written.relation == "<=":
            left, right = right, left
        return ClosureEquation(
            one_sided.name, "position", left, right, written.text, written.mark()
        )

    @property
    def terms(self) -> list[sp.Expr]:
        """Energies, dissipation and forces of the scene over q, with any numbers as velocities."""
        scene = self.names.scene
        written = [t.expression for t in (*scene.kinetic, *scene.potentials, *scene.dissipation)]
        written += [component for force in scene.forces for component in force.components]
        return [self._placed(self.names.convert(e, self._rate)) for e in written]

    def _rate(self, expression: sp.Expr) -> sp.Expr:
        placed = self._placed(expression)
        moving = symbols_in(placed).intersection(self.coordinates)
        return sp.Add(*(sp.Dummy() * derivative(placed, q) for q in moving))

    def _resolved(self, expression: Expression) -> sp.Expr:
        """Write an expression of the scene over q and t."""
        return self._placed(self.names.convert(expression))

    def without(self, q: sp.Symbol) -> list[str]:
        """Names of all coordinates but one."""
        return [coordinate.name for coordinate in self.coordinates if coordinate != q]


@dataclass(frozen=True)
class ClosureEquation:
    """An equation kept beside the coordinates, ``left = right``.

    Attributes
    ----------
    name
        Name of the constraint.
    kind
        ``position`` if it is between positions, ``velocity`` if between velocities.
    left, right
        Its sides, over q and t, of velocities over v too.
    text, mark
        The scene's equation and its place.
    integral
        True if it is an integral of the scene's equation.
    """

    name: str
    kind: Literal["position", "velocity"]
    left: sp.Expr
    right: sp.Expr
    text: str
    mark: Mark | None
    integral: bool = False


@dataclass(frozen=True)
class Leftover:
    """A stated equation that no unknown was solved from, and its values at feasible points.

    Attributes
    ----------
    number
        Number of the equation.
    reduced
        left − right over the coordinates.
    identity
        True if that is zero at all points.
    constant
        True if that is one number at all points.
    """

    number: int
    reduced: sp.Expr
    identity: bool
    constant: bool


def rotation_of(names: Names, body: Body) -> tuple[sp.Expr, ...]:
    """Return the entries of a body's R by rows, over raw symbols."""
    return tuple(names.convert(entry) for entry in body.rotation)


def gap_over_names(names: Names, one_sided: Unilateral) -> sp.Expr:
    """φ ≥ 0 of a one-sided constraint over the names in which it is written."""
    written = one_sided.inequality
    difference = names.convert(written.left) - names.convert(written.right)
    return difference if written.relation == ">=" else -difference


def restricting_equations(
    geometry: Geometry,
    points: Sequence[SymbolValues],
    holding: IdentityFinder = lambda _: frozenset(),
) -> tuple[int, ...]:
    """Numbers of the pending equations that restrict the coordinates and stay as closures.

    Parameters
    ----------
    points
        Configurations that need not satisfy them.
    holding
        Tells which of some equations hold identically around the start.

    Raises
    ------
    InputError
        A contradiction, or a declared coordinate that an equation gives in closed form.
    """
    pending = geometry.elimination.pending
    relations = [r for r in classify_leftovers(pending, points) if not r.identity]
    satisfied = holding({r.number: pending[r.number] for r in relations}) if relations else ()
    restricting = [r for r in relations if r.number not in satisfied]
    for relation in restricting:
        # A sum of squares is singular wherever it holds: a later error reports it.
        if not refusals.is_sum_of_squares(geometry.elimination.stated[relation.number].phi):
            _require_relation(geometry, relation)
    return tuple(r.number for r in restricting)


def classify_leftovers(
    equations: Mapping[int, tuple[sp.Expr, sp.Expr]], points: Sequence[SymbolValues]
) -> list[Leftover]:
    """Evaluate reduced equations: identities, contradictions or relations."""
    asked = {number: _terms(*sides) for number, sides in equations.items()}
    everything = [e for terms in asked.values() for e in terms]
    try:
        samples = [iter(evaluate(everything, point)) for point in points]
    except DomainError:
        if len(asked) > 1:
            return [classify_leftovers({k: sides}, points)[0] for k, sides in equations.items()]
        # Not even real at some coordinates: it restricts them.
        return [
            Leftover(k, terms[-1], identity=False, constant=False) for k, terms in asked.items()
        ]
    return [
        _leftover(k, terms[-1], [[next(sample) for _ in terms] for sample in samples])
        for k, terms in asked.items()
    ]


def _terms(left: sp.Expr, right: sp.Expr) -> list[sp.Expr]:
    """Terms whose sizes φ is compared with, then φ."""
    phi = left - right
    if phi == 0:
        return [phi]
    terms = [*sp.Add.make_args(left), *sp.Add.make_args(right)]
    if len(sp.Add.make_args(phi)) == 1:
        terms += _sensitivities(phi)
    return [*terms, phi]


def _leftover(number: int, phi: sp.Expr, samples: Sequence[Sequence[mpf]]) -> Leftover:
    totals = [total for *_, total in samples]
    sizes = [sum(map(abs, parts), mpf(0)) for *parts, _ in samples]
    identity = all(abs(x) <= RANK_TOLERANCE * size for x, size in zip(totals, sizes, strict=True))
    spread = max(totals) - min(totals)
    return Leftover(number, phi, identity, constant=bool(spread <= RANK_TOLERANCE * max(sizes)))


def _sensitivities(product: sp.Expr) -> list[sp.Expr]:
    """Changes of a product with each term of the sums inside its factors.

    log(sin² q + cos² q) is zero, and as small as its argument is off 1.
    """
    changes = []
    for factor in sp.Mul.make_args(product):
        inner = factor if factor.is_Add else next(iter(factor.args), factor)
        if inner.is_Add:
            place = sp.Dummy(real=True)
            slope = derivative(factor.xreplace({inner: place}), place).xreplace({place: inner})
            changes += [product / factor * slope * part for part in inner.args]
    return changes


def _require_relation(geometry: Geometry, leftover: Leftover) -> None:
    """Refuse an equation that cannot hold, or that gives a declared coordinate by others."""
    elimination = geometry.elimination
    present = leftover.reduced.free_symbols
    involved = sorted(present & geometry.order.keys(), key=geometry.order.__getitem__)
    if not involved or (leftover.constant and _has_one_value(leftover.reduced, involved, geometry)):
        raise contradiction_error(
            geometry.names, elimination, leftover.number, leftover.reduced, geometry.reference
        )
    stated = elimination.stated[leftover.number]
    if stated.integral or stated.joint or any(q in elimination.unknowns for q in involved):
        return
    constants = frozenset(geometry.names.parameters.values())
    if any(_is_given(leftover.reduced, q, set(involved), constants) for q in involved):
        raise refusals.too_many_error(
            geometry.names.scene,
            elimination.stated[leftover.number],
            involved,
            *_surplus(geometry, leftover.reduced, involved),
        )


def _has_one_value(phi: sp.Expr, moving: Sequence[sp.Symbol], geometry: Geometry) -> bool:
    """Tell whether an expression is proven to be constant: (x + y)^100 nearly is at small x, y."""
    values = {p: geometry.reference.get(p) for p in geometry.names.parameters.values()}
    exact = {p: sp.Rational(*to_rational(x._mpf_)) for p, x in values.items() if x is not None}
    candidates = phi, phi.xreplace(exact)
    return any(all(does_not_depend(e, q) for q in moving) for e in candidates)


def _surplus(
    geometry: Geometry, phi: sp.Expr, involved: Sequence[sp.Symbol]
) -> tuple[list[str], tuple[str, sp.Expr]]:
    """Choose the coordinate that φ = 0 gives best; return the others, and it with its value.

    Coordinates that the scene needs nowhere else come before others, without choice before with
    one, Cartesian names before others, the last declared first.
    """
    ways = {q: solutions(phi, q) or [] for q in involved}
    scene, reference = geometry.names.scene, geometry.reference

    def rank(q: sp.Symbol) -> tuple[bool, bool, bool, bool]:
        alone = len(ways[q]) == 1
        return must_stay(scene, q.name), not ways[q], not alone, q not in geometry.resolved

    q = min(reversed(involved), key=rank)
    branches = sorted(ways[q] or [sp.Integer(1)], key=lambda b: _is_elsewhere(b, q, reference))
    return geometry.without(q), (q.name, branches[0])


def _is_elsewhere(
    branch: sp.Expr, q: sp.Symbol, reference: Mapping[sp.Symbol, mpf]
) -> tuple[bool, mpf]:
    """Return True if a branch is not that of the given configuration, and its distance from it."""
    symbols = branch.free_symbols
    if q not in reference or not symbols <= reference.keys():
        return True, mpf(0)
    try:
        value = evaluate([branch], {s: reference[s] for s in symbols})[0]
    except (DomainError, ZeroDivisionError):
        return True, mpf(0)
    return False, abs(value - reference[q])


def _is_given(
    phi: sp.Expr, q: sp.Symbol, coordinates: set[sp.Symbol], constants: frozenset[sp.Symbol]
) -> bool:
    """Tell whether φ = 0 gives q in closed form without a choice that holds in one chart only.

    Several branches none of which ends in a root or an inverse function cross each other:
    φ is a product in disguise. One that divides by what may vanish holds in one chart.
    """
    parts = linear_parts(phi, q)
    if parts is not None and not solves_everywhere(*parts, constants):
        return False
    branches = solutions(phi, q)
    if not branches:
        return False
    return len(branches) == 1 or not any(_ends(b, coordinates) for b in branches)


def _ends(branch: sp.Expr, coordinates: set[sp.Symbol]) -> bool:
    roots = (p for p in branch.atoms(sp.Pow) if not p.exp.is_Integer)
    inverses = branch.atoms(sp.asin, sp.acos, sp.acosh)
    return any(e.free_symbols & coordinates for e in (*roots, *inverses))
