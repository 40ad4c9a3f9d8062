"""A scene over its generalized coordinates: r(q, t) of every name, and the closures."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import attrgetter
from typing import NamedTuple, TypeAlias

import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import Problem
from lagrange_cli.mechanics.algebra.shorten import drawn_from_roots
from lagrange_cli.mechanics.algebra.substitution import Element, Shape, Step, Substitution
from lagrange_cli.mechanics.elements.body import BodyElement
from lagrange_cli.mechanics.elements.particle import MassElement, ParticleElement
from lagrange_cli.mechanics.findings import Account
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.kinks import Switch
from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.sampling import Sampler
from lagrange_cli.mechanics.reduction.coordinates import (
    SEED,
    Chart,
    generalized_coordinates,
    manifold_of,
    positive_places,
    sampler_of,
    scales,
)
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation, Geometry, rotation_of
from lagrange_cli.mechanics.symbols.convert import Rate, total_derivative
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.values import ParameterValues
from lagrange_cli.mechanics.system import Coordinate, State
from lagrange_cli.scene.bodies import Body
from lagrange_cli.scene.declared_numbers import DeclaredSwitch
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Scene

_Motion: TypeAlias = "Mapping[sp.Symbol, tuple[int, sp.Symbol]]"


@dataclass(frozen=True)
class Reduced:
    """A scene over its generalized coordinates.

    Attributes
    ----------
    scene
        The scene.
    names
        Its names as symbols.
    values
        Values of its parameters.
    coordinates
        Generalized coordinates.
    resolved
        Raw symbol → r(q, t).
    masses
        One expression for each particle.
    account
        Account of degrees of freedom.
    reference
        Values of symbols that ``initial`` and ``near`` give.
    warnings, remarks
        Findings to be reported.
    closures
        Independent equations that restrict the coordinates and their velocities.
    chart
        The coordinates with values from which points are drawn.
    origin
        The scene as it was reduced before, if these coordinates replace others; else None.
    """

    scene: Scene
    names: Names
    values: ParameterValues
    coordinates: tuple[Coordinate, ...]
    resolved: Mapping[sp.Symbol, sp.Expr]
    masses: tuple[sp.Expr, ...]
    account: Account
    reference: Mapping[sp.Symbol, mpf]
    warnings: tuple[Problem, ...]
    remarks: tuple[str, ...]
    closures: tuple[ClosureEquation, ...]
    chart: Chart
    origin: Reduced | None = None

    def resolve(self, expr: sp.Expr) -> sp.Expr:
        """Replace raw symbols in ``expr`` by their r(q, t)."""
        if expr not in self._put_in:
            self._put_in[expr] = self.drawn(self._positions.put_into(expr))
        return self._put_in[expr]

    def drawn(self, expr: sp.Expr) -> sp.Expr:
        """Take positive coordinates out of roots in ``expr``."""
        return drawn_from_roots(expr, self._positive) if self._positive else expr

    def convert(self, expression: Expression) -> sp.Expr:
        """Convert an expression of the scene over raw symbols, q, v and t."""
        return self.element(expression).expr

    def element(self, expression: Expression) -> Element:
        """Convert an expression to an element with its shape."""
        known = self._converted.get(id(expression))
        if known is None:
            # Kept with the expression, so that its id stays its own.
            known = expression, self.names.element(expression, self.rate, self._meanings)
            self._converted[id(expression)] = known
        return known[1]

    def resolved_element(self, element: Element) -> Element:
        """Replace raw symbols in an element by their r(q, t)."""
        resolved = self._resolved_elements.resolved(element)
        self._put_in[element.expr] = resolved.expr
        return resolved

    # Several steps need these values, computed once.

    @cached_property
    def elements(self) -> tuple[MassElement, ...]:
        """The elements that carry mass, in the order of the scene."""
        return _elements(self.names, self.masses)

    @cached_property
    def _positive(self) -> list[sp.Symbol]:
        return [c.q for c in self.coordinates if c.is_positive]

    @cached_property
    def _positions(self) -> Substitution:
        return Substitution({s: place for s, place in self.resolved.items() if place != s})

    @cached_property
    def _put_in(self) -> dict[sp.Expr, sp.Expr]:
        return {}

    @cached_property
    def _resolved_elements(self) -> ResolvedElements:
        coordinates = frozenset(c.q for c in self.coordinates)
        return ResolvedElements(self._positions, coordinates, self.resolve)

    @cached_property
    def _meanings(self) -> dict[str, sp.Expr]:
        """Meanings of abbreviations that hold rates, as they are converted."""
        return {}

    @cached_property
    def _converted(self) -> dict[int, tuple[Expression, Element]]:
        return {}

    @property
    def scales(self) -> Mapping[sp.Symbol, mpf]:
        """Size of the motion of each coordinate."""
        return scales(self.chart)

    @cached_property
    def motion(self) -> _Motion:
        """Number and rate of each q, then of each v."""
        moving = [(c.q, c.v) for c in self.coordinates] + [(c.v, c.a) for c in self.coordinates]
        return {symbol: (number, rate) for number, (symbol, rate) in enumerate(moving)}

    @cached_property
    def states(self) -> tuple[State, ...]:
        """States of first order with their rates over q, v, states, inputs and t."""
        pairs = zip(self.scene.states, self.names.states.values(), strict=True)
        return tuple(
            State(
                s.name,
                x,
                self.resolve(self.convert(s.rate)),
                s.unit,
                s.description,
                s.latex,
                self._switch(s.switch),
            )
            for s, x in pairs
        )

    def _switch(self, declared: DeclaredSwitch | None) -> Switch | None:
        """Return the conditions of a state with two values over q, v, states, inputs and t."""
        if declared is None:
            return None
        on, off = (
            self.resolve(self.convert(c.left)) - self.resolve(self.convert(c.right))
            for c in (declared.on, declared.off)
        )
        return Switch(
            on if declared.on.relation == ">=" else -on,
            off if declared.off.relation == ">=" else -off,
        )

    @property
    def gaps(self) -> tuple[ClosureEquation, ...]:
        """One-sided constraints, ``left`` ≥ ``right``."""
        return self.chart.geometry.gaps

    @property
    def positive(self) -> list[tuple[str, sp.Expr]]:
        """Names that are declared to stay above zero, with their expressions over q and t."""
        return positive_places(self.chart.geometry)

    @property
    def rate(self) -> Rate:
        """Total time derivative of an expression over raw symbols, q, v and t.

        Raw symbols move with ṙ(q, v, t); velocities with accelerations.
        """
        return partial(_rate, self)

    def sampler(self, domain: list[sp.Expr], seed: str = SEED) -> Sampler:
        """Random feasible configurations at which ``domain`` is real as well."""
        return sampler_of(self.chart, domain, self.manifold(), seed)

    def manifold(self, gaps: Sequence[ClosureEquation] = ()) -> Manifold:
        """Manifold of the states that satisfy the closures, and ``gaps`` that are closed."""
        return manifold_of(self.chart, [*self.closures, *gaps]) if gaps else self._manifold

    @cached_property
    def _manifold(self) -> Manifold:
        return manifold_of(self.chart, self.closures)


def _elements(names: Names, masses: Sequence[sp.Expr]) -> tuple[MassElement, ...]:
    """Return the elements of a scene, one for each particle and body, with these masses."""
    return tuple(
        BodyElement(
            p.name,
            centre,
            mass,
            rotation_of(names, p),
            tuple(names.convert(moment) for row in p.inertia for moment in row),
        )
        if isinstance(p, Body)
        else ParticleElement(p.name, centre, mass)
        for p, centre, mass in zip(
            names.scene.particles, names.particle_symbols, masses, strict=True
        )
    )


def _rate(reduced: Reduced, expr: sp.Expr) -> sp.Expr:
    t, motion = reduced.names.t, reduced.motion
    chain = _chain(motion, expr)
    for symbol in sorted(symbols_in(expr) & reduced.resolved.keys(), key=str):
        if symbol not in motion:
            position = reduced.resolved[symbol]
            chain.append((symbol, total_derivative(position, t, _chain(motion, position))))
    return total_derivative(expr, t, chain)


def _chain(motion: _Motion, expr: sp.Expr) -> list[tuple[sp.Symbol, sp.Expr]]:
    """Symbols of an expression with their rates; a large system has far more than these."""
    present = sorted(symbols_in(expr) & motion.keys(), key=lambda s: motion[s][0])
    return [(s, motion[s][1]) for s in present]


def in_coordinates(
    reduced: Reduced,
    names: Names,
    resolved: Mapping[sp.Symbol, sp.Expr],
    coordinates: Sequence[sp.Symbol],
    closures: Sequence[ClosureEquation],
    reference: Mapping[sp.Symbol, mpf],
) -> Reduced:
    """Write the scene over other coordinates with closures beside them; its account stays."""
    elimination = reduced.chart.geometry.elimination
    geometry = Geometry(names, elimination, resolved, coordinates, reference)
    chart = Chart(reduced.values, geometry, tuple(generalized_coordinates(geometry, closures)))
    return replace(
        reduced,
        names=names,
        coordinates=chart.coordinates,
        resolved=resolved,
        reference=reference,
        remarks=tuple(r for r in reduced.remarks if r not in elimination.remarks),
        closures=tuple(closures),
        chart=chart,
        origin=reduced,
    )


class _Plan(NamedTuple):
    """Evaluation plan for the elements of one shape.

    Attributes
    ----------
    put_in
        Numbers of the symbols that expressions replace.
    steps
        Operations on these and on constants alone, with their numbers.
    largest
        Numbers of those that are operands of other steps.
    """

    put_in: Sequence[int]
    steps: Sequence[tuple[int, Step]]
    largest: Sequence[int]


class ResolvedElements:
    """Elements with expressions put in place of some symbols.

    Parameters
    ----------
    substitution
        The expressions by symbol.
    coordinates
        Symbols that may be exchanged for one another; all others stay distinct.
    resolve
        Substitutes them in an expression.
    """

    def __init__(
        self,
        substitution: Substitution,
        coordinates: Collection[sp.Symbol],
        resolve: Callable[[sp.Expr], sp.Expr],
    ) -> None:
        self._substitution = substitution
        self._coordinates = coordinates
        self._resolve = resolve
        self._plans: dict[Hashable, _Plan] = {}
        self._shapes: dict[Hashable, Shape] = {}

    def resolved(self, element: Element) -> Element:
        """Substitute expressions in an element."""
        places = [self._substitution.place(s) for s in element.symbols]
        still = [s for s, place in zip(element.symbols, places, strict=True) if place is None]
        pattern = element.shape, *[place is None for place in places]
        if pattern not in self._plans:
            self._plans[pattern] = _plan(element.shape, places)
        parts = self._parts(element, self._plans[pattern], places)
        symbols_present = set().union(*map(symbols_in, parts))
        symbols = tuple(sorted(symbols_present.union(still), key=attrgetter("name")))
        number = {s: k for k, s in enumerate(still)}
        kinds = [
            (number.get(s), s if s in symbols_present else self._kind(s), s.is_positive)
            for s in symbols
        ]
        key = *pattern, *map(id, parts), *kinds
        if key in self._shapes:
            shape = self._shapes[key]
            return Element(shape.template.over(symbols), shape, symbols)
        expr = self._resolve(element.expr)
        self._shapes[key] = Shape(expr, symbols)
        return Element(expr, self._shapes[key], symbols)

    def _kind(self, symbol: sp.Symbol) -> Hashable:
        return "coordinate" if symbol in self._coordinates else symbol

    def _parts(
        self, element: Element, plan: _Plan, places: Sequence[sp.Expr | None]
    ) -> list[sp.Expr]:
        """Evaluate the largest parts in which expressions replace all symbols."""
        constants = element.shape.template.constants
        values: dict[int, sp.Expr] = dict(enumerate(constants, len(places)))
        values.update((k, place) for k in plan.put_in if (place := places[k]) is not None)
        for number, step in plan.steps:
            operands = [values[k] for k in step.operands]
            values[number] = self._substitution.evaluated(step.kind, operands)
        return [values[k] for k in plan.largest]


def _plan(shape: Shape, places: Sequence[sp.Expr | None]) -> _Plan:
    template = shape.template
    put_in = [k for k, place in enumerate(places) if place is not None]
    first = len(places) + len(template.constants)
    numbered = list(enumerate(template.steps, first))
    inner = [(k, step) for k, step in numbered if step.symbols.issubset(put_in)]
    known = {*put_in, *(k for k, _ in inner)}
    used = {k for number, step in numbered if number not in known for k in step.operands}
    used.add(template.whole)
    return _Plan(put_in, inner, sorted(known & used))
