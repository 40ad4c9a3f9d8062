"""The same scene in Cartesian names, with its constraints beside them as closures.

A reduction in closed form gives every name over few coordinates. Here the definitions and
constraints stay equations between names (:mod:`.elimination.implicitization`): coordinates that are
no Cartesian names are eliminated from them, so that a mass matrix is constant and a closure holds
few names. A coordinate stays if the scene refers to it elsewhere (a spring on an angle, a force on
a coordinate, its rate), or if it cannot be eliminated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.arithmetic import negative, plain_sum
from lagrange_cli.mechanics.algebra.substitution import Substitution
from lagrange_cli.mechanics.elimination.eliminate import StatedEquation
from lagrange_cli.mechanics.elimination.implicitization import (
    AngleSymbols,
    ImplicitEquation,
    ImplicitSystem,
    angle_symbols,
    in_single_angles,
)
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE, dependent_rows, normalized_row
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, working_digits
from lagrange_cli.mechanics.reduction.coordinates import periodic_symbols
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation
from lagrange_cli.mechanics.reduction.reduce import RANK_POINTS
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced, in_coordinates
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import with_carets
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Scene

#: Decimal digits of the numbers from which ranks are computed.
_DIGITS = 30
_ZERO = sp.Integer(0)

#: Gradients that are combinations of others to this part of their size depend on them.
_DEPENDENT = 1e-6


def cartesian_form(reduced: Reduced) -> Reduced | None:
    """Return the scene over Cartesian names with closures; None if that changes nothing.

    Parameters
    ----------
    reduced
        A scene without closures: everything was reduced in closed form.
    """
    with mpmath.workdps(working_digits(_DIGITS)):
        return _Form(reduced).build()


def closure_incidence(reduced: Reduced) -> list[frozenset[sp.Symbol]]:
    """Predict the names in each closure without forming closures.

    An eliminated coordinate ties together the names of the equations that hold it.
    """
    form = _Form(reduced)
    eliminable = frozenset(form.own)
    names = eliminable.union(s for s in form.names.cartesian.values() if s not in form.known)
    groups: dict[frozenset[sp.Symbol], None] = {}
    around: dict[sp.Symbol, set[sp.Symbol]] = {q: set() for q in form.own}
    for symbols in form.symbols():
        present = symbols & names
        if present.isdisjoint(eliminable):
            groups[frozenset(present)] = None
        for q in present & eliminable:
            around[q] |= present
    groups |= dict.fromkeys(map(frozenset, around.values()))
    angles = sum(c.is_angle and c.q in eliminable for c in reduced.coordinates)
    number = len(names) - len(reduced.coordinates) - angles
    return [present for present in groups if present][:number]


@dataclass(frozen=True)
class _Uses:
    """Uses of coordinates in a scene beside its geometry.

    Attributes
    ----------
    rates
        Names of coordinates that stand under ``dot`` or that a force acts on.
    expressions
        All other expressions, over raw symbols and coordinates.
    """

    rates: frozenset[str]
    expressions: tuple[sp.Expr, ...]


class _Form:
    def __init__(self, reduced: Reduced) -> None:
        self.reduced = reduced
        self.names = reduced.names
        moving = {c.q for c in reduced.coordinates} | {self.names.t}
        raw = list(self.names.cartesian.values())
        self._coordinates = moving - {self.names.t}
        resolved = {s: reduced.resolved[s] for s in raw}
        #: Names that no coordinate moves, and names that equal another one.
        self.known = {
            s: e for s, e in resolved.items() if e != s and (e in moving or self._still(e))
        }
        cartesian = set(raw)
        self.own = [c.q for c in reduced.coordinates if c.q not in cartesian]

    @cached_property
    def uses(self) -> _Uses:
        return _uses(self.names)

    def _still(self, expr: sp.Expr) -> bool:
        return symbols_in(expr).isdisjoint(self._coordinates)

    def build(self) -> Reduced | None:
        relations = list(self.relations())
        return self._without_unused(relations) or self._eliminated(relations)

    def _without_unused(self, relations: Sequence[ImplicitEquation]) -> Reduced | None:
        """Keep the equations without coordinates that only other equations use."""
        asked = {s for e in self.uses.expressions for s in e.free_symbols}
        asked |= {q for q in self.own if q.name in self.uses.rates} | set(self.known.values())
        unused = frozenset(q for q in self.own if q not in asked)
        remaining = [r for r in relations if r.expression.free_symbols.isdisjoint(unused)]
        return self._reduced(remaining, unused, lambda expr: expr) if unused else None

    def _eliminated(self, relations: Sequence[ImplicitEquation]) -> Reduced | None:
        """Eliminate as many coordinates as possible."""
        angles = self._angles(relations)
        single = [self._in_angles(r, angles) for r in relations]
        system = ImplicitSystem(single, self._moving(angles), self.names.parameters.values())
        system.square_roots()
        # Angles in few equations first.
        ordered = sorted(angles, key=lambda a: len(system.holding(a.sine, a.cosine)))
        dropped = [a.q for a in ordered if self._drops_angle(system, a)]
        lengths = [q for q in self.own if q not in {a.q for a in angles}]
        dropped += [q for q in lengths if self._drops_length(system, q)]
        gone = frozenset(dropped)
        split = [a for a in angles if a.q in gone]
        solutions = {s: _put_back(e, angles) for s, e in system.given.items()}
        left = [
            replace(r, expression=_put_back(r.expression, angles))
            for r in system.relations.values()
        ]
        return self._reduced(left, gone, lambda e: _rewritten(e, split, solutions, gone))

    # Equations.

    def relations(self) -> Iterator[ImplicitEquation]:
        """Definitions and stated equations between names that move."""
        bodies = {
            s: body.name
            for body, symbols in zip(self.names.bodies, self.names.body_symbols, strict=True)
            for s in symbols
        }
        for s, e, expression in self._defined():
            yield ImplicitEquation(bodies[s], expression, f"{s} = {with_carets(e)}", stated=False)
        for stated, expression in self._stated():
            yield ImplicitEquation(stated.constraint, expression, stated.equation.text, stated=True)

    def symbols(self) -> Iterator[frozenset[sp.Symbol]]:
        """The symbols in each of :meth:`relations`, without forming those of definitions."""
        for s, e in self.names.given.items():
            if s not in self.known:
                yield symbols_in(self._put(e)) | {s}
        yield from (symbols_in(expression) for _, expression in self._stated())

    def _defined(self) -> Iterator[tuple[sp.Symbol, sp.Expr, sp.Expr]]:
        for s, e in self.names.given.items():
            if s not in self.known:
                yield s, e, self._put(plain_sum((s, negative(e))))

    def _stated(self) -> Iterator[tuple[StatedEquation, sp.Expr]]:
        for stated in self.reduced.chart.geometry.elimination.stated:
            expression = self._put(stated.phi)
            if expression != 0:
                yield stated, expression

    def _put(self, expr: sp.Expr) -> sp.Expr:
        present = {s: self.known[s] for s in symbols_in(expr) if s in self.known}
        return Substitution(present).put_into(expr) if present else expr

    def _angles(self, relations: Sequence[ImplicitEquation]) -> list[AngleSymbols]:
        """Coordinates that stand in the equations under sines and cosines only."""
        periodic = periodic_symbols(r.expression for r in relations)
        candidates = [angle_symbols(q) for q in self.own if q in periodic]
        while True:
            bad = {
                a.q
                for r in relations
                for a in candidates
                if a.q in r.expression.free_symbols and in_single_angles(r.expression, [a]) is None
            }
            if not bad:
                return candidates
            candidates = [a for a in candidates if a.q not in bad]

    def _in_angles(
        self, relation: ImplicitEquation, angles: Sequence[AngleSymbols]
    ) -> ImplicitEquation:
        expression = in_single_angles(relation.expression, angles)
        assert expression is not None  # as every angle alone is, all are
        return replace(relation, expression=expression)

    def _moving(self, angles: Sequence[AngleSymbols]) -> list[sp.Symbol]:
        raw = [s for s in self.names.cartesian.values() if s not in self.known]
        parts = [s for a in angles for s in (a.sine, a.cosine)]
        return [*raw, *self.own, *parts]

    # Elimination.

    def _drops_angle(self, system: ImplicitSystem, angle: AngleSymbols) -> bool:
        if angle.q.name in self.uses.rates:
            return False
        needed: set[sp.Symbol] = set()
        for expression in self.uses.expressions:
            single = in_single_angles(expression, [angle])
            if single is None:
                return False
            needed |= single.free_symbols & {angle.sine, angle.cosine}
        return system.drop_angle(angle, needed)

    def _drops_length(self, system: ImplicitSystem, q: sp.Symbol) -> bool:
        if q.name in self.uses.rates or q in self.known.values():
            return False
        used = any(q in e.free_symbols for e in self.uses.expressions)
        return system.drop_length(q, needed=used)

    # The result.

    def _reduced(
        self,
        relations: Sequence[ImplicitEquation],
        dropped: frozenset[sp.Symbol],
        rewrite: Callable[[sp.Expr], sp.Expr],
    ) -> Reduced | None:
        """Drop some coordinates from the scene; None if the relations do not suffice."""
        raw = [s for s in self.names.cartesian.values() if s not in self.known]
        remaining = [q for q in self.own if q not in dropped]
        present = {s for r in relations for s in r.expression.free_symbols}
        # Beside a coordinate of its own a definition is regular wherever it holds.
        stated_last = not present.isdisjoint(remaining)
        ordered = sorted(relations, key=lambda r: r.stated == stated_last)
        coordinates = [*remaining, *raw]
        independent = self._independent(coordinates, ordered)
        if independent is None:
            return None
        return in_coordinates(
            self.reduced,
            self.names.rewriting(rewrite, dropped),
            {s: self.known.get(s, s) for s in self.names.cartesian.values()},
            coordinates,
            [_closure_equation(r, self.reduced.scene) for r in independent],
            self._reference(coordinates),
        )

    def _independent(
        self, coordinates: Sequence[sp.Symbol], relations: Sequence[ImplicitEquation]
    ) -> list[ImplicitEquation] | None:
        """Choose independent relations, one for each surplus coordinate; None without them."""
        wanted = len(coordinates) - len(self.reduced.coordinates)
        sampler = self.reduced.sampler([])
        points = [p for p in (sampler.draw() for _ in range(RANK_POINTS)) if p is not None]
        manifold = Manifold(
            [(r.expression, _ZERO) for r in relations],
            [],
            self.names.t,
            coordinates,
            [sp.Dummy(real=True) for _ in coordinates],
            list(self.names.parameters.values()),
            dict.fromkeys(coordinates, mpf(1)),
        )
        dropped: set[int] = set()
        for number, point in enumerate(points):
            try:
                there = self._everywhere(point)
                if any(x > RANK_TOLERANCE for x in manifold.violations(there)):
                    return None
                slopes = manifold.slopes(there)
            except (DomainError, ZeroDivisionError):
                return None
            dependent = dependent_rows([normalized_row(row) for row in slopes], _DEPENDENT)
            if number and dependent.keys() != dropped:
                return None
            dropped = set(dependent)
        independent = [r for k, r in enumerate(relations) if k not in dropped]
        return independent if points and len(independent) == wanted else None

    def _everywhere(self, point: Mapping[sp.Symbol, mpf]) -> SamplePoint:
        """A point of the reduced scene with the values of all names."""
        symbols = [s for s in self.names.cartesian.values() if s not in point]
        placed = evaluate([self.reduced.resolved[s] for s in symbols], point)
        return {**point, **dict(zip(symbols, placed, strict=True))}

    def _reference(self, coordinates: Sequence[sp.Symbol]) -> dict[sp.Symbol, mpf]:
        """The given configuration over all names that it determines, less dropped ones."""
        known = dict(self.reduced.reference)
        for s, e in self.reduced.resolved.items():
            if s not in known and e.free_symbols <= known.keys():
                try:
                    known[s] = evaluate([e], {x: known[x] for x in e.free_symbols})[0]
                except (DomainError, ZeroDivisionError):
                    continue
        gone = set(self.own) - set(coordinates)
        return {s: x for s, x in known.items() if s not in gone}


def _closure_equation(relation: ImplicitEquation, scene: Scene) -> ClosureEquation:
    places = {c.name: e.mark() for c in scene.constraints for e in c.equations[:1]}
    if not relation.stated:
        places = {p.name: p.mark for p in scene.particles}
        places |= {p.name: p.mark for p in scene.points}
    place = places.get(relation.name)
    return ClosureEquation(
        relation.name, "position", relation.expression, _ZERO, relation.text, place
    )


def _put_back(expr: sp.Expr, angles: Sequence[AngleSymbols]) -> sp.Expr:
    for angle in angles:
        expr = angle.put_back(expr)
    return expr


def _rewritten(
    expr: sp.Expr,
    angles: Sequence[AngleSymbols],
    solutions: Mapping[sp.Symbol, sp.Expr],
    dropped: frozenset[sp.Symbol],
) -> sp.Expr:
    """Rewrite an expression of the scene without the dropped coordinates."""
    if expr.free_symbols.isdisjoint(dropped):
        return expr
    single = in_single_angles(expr, angles)
    return expr if single is None else single.xreplace(dict(solutions))


def _uses(names: Names) -> _Uses:
    """Collect the uses of coordinates beside positions and constraints."""
    rates = {f.on for f in names.scene.forces}
    plain = []
    for expression in _dynamics(names):
        if names.holds_rate(expression):
            rates |= names.mentioned(expression)
        else:
            plain.append(names.convert(expression))
    return _Uses(frozenset(rates), tuple(plain))


def _dynamics(names: Names) -> Iterator[Expression]:
    scene = names.scene
    for term in (*scene.potentials, *scene.kinetic, *scene.dissipation, *scene.outputs):
        yield term.expression
    yield from (c for f in scene.forces for c in f.components)
    yield from (e for state in scene.states for e in state.expressions)
    yield from (v.expression for controller in scene.controllers for v in controller.values)
