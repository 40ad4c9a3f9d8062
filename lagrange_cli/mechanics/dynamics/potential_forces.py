"""Potentials of a scene, and their forces through the names that they are written in."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from operator import attrgetter

import sympy as sp

from lagrange_cli.mechanics.algebra.alpha_equivalence import rename_symbols
from lagrange_cli.mechanics.algebra.collect import TermParts
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import Element
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.bodies import bodies_of, rotation_term


@dataclass(frozen=True)
class RawTerms:
    """Potentials and kinetic terms before coordinates are put in.

    Attributes
    ----------
    elements
        Potentials without velocities, over raw symbols.
    velocity_dependent
        All other potentials, over q, v, t.
    kinetic
        Terms of the section ``kinetic``, and energies of the turning of bodies, over q, v, t.
    declared, turning
        Those of the section, and those of bodies.
    """

    elements: tuple[Element, ...]
    velocity_dependent: tuple[sp.Expr, ...]
    kinetic: tuple[sp.Expr, ...]
    declared: tuple[sp.Expr, ...]
    turning: tuple[sp.Expr, ...]

    @cached_property
    def positional(self) -> tuple[sp.Expr, ...]:
        """The potentials of ``elements`` as expressions."""
        return tuple(element.expr for element in self.elements)


def raw_terms(reduced: Reduced) -> RawTerms:
    """Convert the potentials and kinetic terms of a scene."""
    scene = reduced.scene
    v = {c.v for c in reduced.coordinates}
    positional, dependent = [], []
    for potential in scene.potentials:
        element = reduced.element(potential.expression)
        if v.isdisjoint(element.symbols):
            positional.append(element)
        else:
            dependent.append(reduced.resolve(element.expr))
    kinetic = {k.name: reduced.resolve(reduced.convert(k.expression)) for k in scene.kinetic}
    of_bodies = {rotation_term(body.name) for body in bodies_of(scene)}
    declared = tuple(term for name, term in kinetic.items() if name not in of_bodies)
    turning = tuple(term for name, term in kinetic.items() if name in of_bodies)
    whole = tuple(kinetic.values())
    return RawTerms(tuple(positional), tuple(dependent), whole, declared, turning)


@dataclass(frozen=True)
class NameForce:
    """−∂V/∂s of a potential V.

    Attributes
    ----------
    symbol
        The name s.
    force
        The force over coordinates.
    """

    symbol: sp.Symbol
    force: sp.Expr


@dataclass(frozen=True)
class CoordinateForce:
    """−∂V/∂q of a potential V.

    Attributes
    ----------
    symbol
        The coordinate q.
    terms
        The terms of the force, multiplied out.
    """

    symbol: sp.Symbol
    terms: Sequence[TermParts]


class PotentialForces:
    """Forces of the potentials of a scene.

    Parameters
    ----------
    reduced
        The scene.
    moves
        Says whether a coordinate moves a Cartesian name.
    split
        Gives the terms of a force.
    """

    def __init__(
        self,
        reduced: Reduced,
        moves: Callable[[sp.Symbol], bool],
        split: Callable[[sp.Expr], Sequence[TermParts]],
    ) -> None:
        self._reduced = reduced
        self._coordinates = frozenset(c.q for c in reduced.coordinates)
        self._moves = moves
        self._split = split
        #: A shape and the kinds of its symbols → these symbols, and the forces.
        self._known: dict[
            Hashable, tuple[Sequence[sp.Symbol], list[NameForce | CoordinateForce]]
        ] = {}

    def forces_of(self, potential: Element) -> Iterator[NameForce | CoordinateForce]:
        """Yield the forces of a potential along the names that move."""
        key = potential.shape, *[self._movement(s) or s for s in potential.symbols]
        if key not in self._known:
            self._known[key] = potential.symbols, self._worked_out(potential.expr)
        first, forces = self._known[key]
        pairs = zip(first, potential.symbols, strict=True)
        names = {old: new for old, new in pairs if old is not new}
        rename = cache(partial(rename_symbols, names=names))
        for force in forces:
            symbol = names.get(force.symbol, force.symbol)
            if isinstance(force, NameForce):
                yield NameForce(symbol, self._reduced.resolve(rename(force.force)))
            elif names:
                yield CoordinateForce(symbol, [term.renamed(rename) for term in force.terms])
            else:
                yield force

    def _movement(self, symbol: sp.Symbol) -> tuple[bool, bool, sp.Expr | None] | None:
        """Classify a name by properties that renaming must preserve; None for parameters and time.

        A name is a coordinate or not, moves or not, and has a number for its value or not.
        """
        if symbol in self._coordinates:
            return True, True, None
        value = self._reduced.resolved.get(symbol)
        if value is None:
            return None
        return False, self._moves(symbol), value if value.is_number else None

    def _worked_out(self, potential: sp.Expr) -> list[NameForce | CoordinateForce]:
        """Derive the forces of one shape of potentials, those along names still over names."""
        return [
            CoordinateForce(s, self._split(self._reduced.resolve(slope)))
            if s in self._coordinates and all(map(self._is_shared, symbols_in(slope)))
            else NameForce(s, slope)
            for s, slope in self._slopes(potential)
        ]

    def _is_shared(self, symbol: sp.Symbol) -> bool:
        """Say whether a name stays in its place, or has the same value in all of one shape."""
        movement = self._movement(symbol)
        return movement is None or movement[0] or movement[2] is not None

    def _slopes(self, potential: sp.Expr) -> list[tuple[sp.Symbol, sp.Expr]]:
        """−∂V/∂s over the names that V is written in, for each symbol s that moves."""
        gradient: dict[sp.Symbol, list[sp.Expr]] = {}
        for term in sp.Add.make_args(potential):
            for s in sorted(symbols_in(term), key=attrgetter("name")):
                movement = self._movement(s)
                if movement is not None and movement[1]:
                    gradient.setdefault(s, []).append(-derivative(term, s))
        return [(s, sp.Add(*parts)) for s, parts in gradient.items()]
