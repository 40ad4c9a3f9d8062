"""Applied forces along each Cartesian name, with the inertia of ``kinetic``.

Potentials, kinetic terms and dissipation are read over Cartesian names and their rates,
so that a force belongs to the particle whose name it is written in. A term that is written
in other coordinates acts on no particle, unless one alone moves with these: its force is then the
one in the directions ∂r/∂q that does the same work, J (JᵀJ)⁻¹ Q.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.dynamics.idle_potentials import weights_of
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.scene.bodies import bodies_of, rotation_term
from lagrange_cli.scene.language.expression import Equation, Expression
from lagrange_cli.scene.model import Term


@dataclass(frozen=True)
class AppliedForces:
    """−F by Cartesian name or coordinate, in two parts.

    Attributes
    ----------
    positional
        Forces of potentials without velocities, over q and t.
    dynamic
        All other forces (the Euler–Lagrange expression of T_extra − U, forces of the scene,
        dissipation), over q, v, a, t.
    unattached
        Names of terms that act on no particle.
    attached
        The part of the dynamic forces that terms in other coordinates exert on a single particle.
    shared
        Names of particles of which several move with the coordinates of unattached terms.
    passed_on
        Names of the unattached terms on whose coordinates some particle moves.
    free
        Cartesian names of bodies of which each component moves by itself: nothing constrains them.
    """

    positional: dict[sp.Symbol, sp.Expr]
    dynamic: dict[sp.Symbol, sp.Expr]
    unattached: tuple[str, ...]
    attached: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    shared: tuple[str, ...] = ()
    passed_on: tuple[str, ...] = ()
    free: frozenset[sp.Symbol] = frozenset()

    def along(self, symbol: sp.Symbol) -> sp.Expr:
        """−F along one symbol."""
        return self.positional.get(symbol, sp.Integer(0)) + self.dynamic.get(symbol, sp.Integer(0))


def applied_forces(derivation: Uncertified, *, of_turning: bool = True) -> AppliedForces:
    """Collect the applied forces of a scene, with opposite sign.

    ``of_turning``: with the inertia of the turning of bodies and torques on them, by their work.
    """
    reader = _Reader(derivation)
    applied = reader.applied_forces(of_turning=of_turning)
    groups = _moving_together(derivation)
    for group in groups:
        applied = reader.attached(applied, group)
    moving = frozenset().union(*(group.coordinates for group in groups))
    names = (n for n in applied.unattached if not reader.unattached[n].isdisjoint(moving))
    return replace(applied, passed_on=tuple(names))


@dataclass(frozen=True)
class TermsOverNames:
    """Terms of a scene over Cartesian names, coordinates and their rates.

    Attributes
    ----------
    lagrangian
        Kinetic terms less the potentials that hold rates.
    dissipation
        The dissipation function.
    rates
        Symbol of each Cartesian name or coordinate → symbol of its rate.
    """

    lagrangian: sp.Expr
    dissipation: sp.Expr
    rates: dict[sp.Symbol, sp.Symbol]


def terms_over_names(derivation: Uncertified) -> TermsOverNames:
    """Convert the terms of a scene that hold rates, over the names in the scene.

    Energies of the turning of bodies are not among them.
    """
    reader = _Reader(derivation)
    scene = derivation.reduced.scene
    of_bodies = {rotation_term(body.name) for body in bodies_of(scene)}
    potentials = [reader.converted(p.expression) for p in scene.potentials]
    moving = [u for u in potentials if not u.free_symbols.isdisjoint(reader.rates.values())]
    kinetic = [reader.converted(k.expression) for k in scene.kinetic if k.name not in of_bodies]
    dissipation = [reader.converted(d.expression) for d in scene.dissipation]
    return TermsOverNames(
        sp.Add(*kinetic, *(-u for u in moving)), sp.Add(*dissipation), reader.rates
    )


def velocity_slopes(derivation: Uncertified, equation: Equation) -> dict[sp.Symbol, sp.Expr]:
    """∂ψ/∂ṡ of an equation of velocities, by Cartesian name or coordinate."""
    reader = _Reader(derivation)
    left, right = (reader.converted(side) for side in (equation.left, equation.right))
    slopes = {s: derivative(left - right, rate) for s, rate in reader.rates.items()}
    return {s: slope for s, slope in slopes.items() if slope != 0}


#: Most coordinates of a particle whose forces are written in the directions ∂r/∂q.
_MOST_DIRECTIONS = 3
#: Most components of bodies of which each moves by itself.
_MOST_COMPONENTS = 6


@dataclass(frozen=True)
class _Group:
    """Bodies that move with common coordinates.

    Attributes
    ----------
    bodies
        Names of the particles, and of the points that forces act on.
    components
        Raw symbols of their positions that move.
    coordinates
        The coordinates.
    """

    bodies: tuple[str, ...]
    components: frozenset[sp.Symbol]
    coordinates: frozenset[sp.Symbol]

    def joined(self, group: _Group) -> _Group:
        return _Group(
            (*self.bodies, *group.bodies),
            self.components | group.components,
            self.coordinates | group.coordinates,
        )


def _moving_together(derivation: Uncertified) -> list[_Group]:
    """Return the bodies in groups without a common coordinate."""
    reduced = derivation.reduced
    names, every = reduced.names, {c.q for c in reduced.coordinates}
    pulled = {force.on for force in derivation.forces}
    groups: list[_Group] = []
    for number, (body, symbols) in enumerate(zip(names.bodies, names.body_symbols, strict=True)):
        if number >= len(reduced.masses) and body.name not in pulled:
            continue
        moving = {s: symbols_in(reduced.resolved[s]) & every for s in symbols}
        one = _Group(
            (body.name,),
            frozenset(s for s, by in moving.items() if by),
            frozenset().union(*moving.values()),
        )
        for group in [g for g in groups if not g.coordinates.isdisjoint(one.coordinates)]:
            groups.remove(group)
            one = group.joined(one)
        groups.append(one)
    return groups


def _in_directions(
    reduced: Reduced, group: _Group, loads: Mapping[sp.Symbol, sp.Expr]
) -> dict[sp.Symbol, sp.Expr] | None:
    """J (JᵀJ)⁻¹ Q of generalized forces Q; None if several bodies could share them otherwise.

    Several cannot where each of their components moves by itself.
    """
    coordinates = [c.q for c in reduced.coordinates if c.q in group.coordinates]
    components = [s for s in reduced.resolved if s in group.components]
    is_free = len(components) == len(coordinates)
    if len(group.bodies) > 1 and not is_free:
        return None
    if len(coordinates) > (_MOST_COMPONENTS if is_free else _MOST_DIRECTIONS):
        return None
    slopes = sp.Matrix(
        [[derivative(reduced.resolved[s], q) for q in coordinates] for s in components]
    )
    work = sp.Matrix([loads.get(q, sp.Integer(0)) for q in coordinates])
    square = slopes.T if is_free else (slopes.T * slopes).applyfunc(shortened)
    determinant = shortened(square.det(method="berkowitz"))
    if determinant == 0:
        return None
    rates = (square.adjugate() * work).applyfunc(shortened)
    along = (rates if is_free else slopes * rates).applyfunc(
        lambda e: shortened(shortened(e) / determinant)
    )
    return {s: e for s, e in zip(components, along, strict=True) if e != 0}


class _Reader:
    def __init__(self, derivation: Uncertified) -> None:
        self.derivation = derivation
        self.reduced: Reduced = derivation.reduced
        names = self.reduced.names
        cartesian = list(names.cartesian.values())
        self.own = [c for c in self.reduced.coordinates if c.q not in cartesian]
        self.rates = {s: sp.Dummy(f"dot_{s.name}", real=True) for s in cartesian}
        self.rates |= {c.q: c.v for c in self.own}
        self.positional: dict[sp.Symbol, list[sp.Expr]] = {}
        self.dynamic: dict[sp.Symbol, list[sp.Expr]] = {}
        #: Term that is written in coordinates → coordinates that it acts on.
        self.unattached: dict[str, set[sp.Symbol]] = {}
        self.inertial: set[sp.Symbol] = set()
        self.rigid = {body.name for body in bodies_of(self.reduced.scene)}

    def applied_forces(self, *, of_turning: bool) -> AppliedForces:
        scene = self.reduced.scene
        for name, raw in self._converted(scene.potentials):
            moving = not raw.free_symbols.isdisjoint(self.rates.values())
            self._add_energy(name, -raw, self.dynamic if moving else self.positional)
        turning = {rotation_term(body.name) for body in bodies_of(scene)}
        for name, raw in self._converted(scene.kinetic):
            if name in turning and not of_turning:
                continue
            self._add_energy(None if name in turning else name, raw, self.dynamic)
            self.inertial |= {c.q for c in self.own if not raw.free_symbols.isdisjoint((c.q, c.v))}
        for name, raw in self._converted(scene.dissipation):
            for s, rate in self.rates.items():
                self._add(name, s, derivative(raw, rate), self.dynamic)
        self._add_forces(of_turning=of_turning)
        return AppliedForces(
            _summed(self.positional), _summed(self.dynamic), tuple(self.unattached)
        )

    def attached(self, applied: AppliedForces, group: _Group) -> AppliedForces:
        """Give the forces of unattached terms to the particle that they act on, if it is alone."""
        among = [c.q for c in self.own if c.q in group.coordinates]
        loads = {q: load for q in among if (load := applied.along(q)) != 0}
        if not loads or not self.rigid.isdisjoint(group.bodies):
            return applied  # forces on the centres of bodies are theirs, whatever turns them
        along = None
        if self.inertial.isdisjoint(group.coordinates):
            along = _in_directions(self.reduced, group, loads)
        if along is None:
            kinetic = {term.name for term in self.reduced.scene.kinetic}
            forces = {n for n, on in self.unattached.items() if not on.isdisjoint(loads)} - kinetic
            several = group.bodies if forces or len(group.bodies) > 1 else ()
            return replace(applied, shared=(*applied.shared, *several))
        dynamic = {s: e for s, e in applied.dynamic.items() if s not in loads}
        dynamic |= {s: dynamic.get(s, sp.Integer(0)) + e for s, e in along.items()}
        return replace(
            applied,
            positional={s: e for s, e in applied.positional.items() if s not in loads},
            dynamic=dynamic,
            unattached=tuple(
                name for name in applied.unattached if not self.unattached[name] <= loads.keys()
            ),
            attached={**applied.attached, **along},
            free=applied.free | (group.components if self._is_free(group) else frozenset()),
        )

    def _is_free(self, group: _Group) -> bool:
        """Tell whether nothing constrains the bodies of a group."""
        is_whole = len(group.components) == len(group.coordinates)
        return is_whole and not self.derivation.pushing

    def _converted(self, terms: Sequence[Term]) -> Iterator[tuple[str, sp.Expr]]:
        for term in terms:
            yield term.name, self.converted(term.expression)

    def converted(self, expression: Expression) -> sp.Expr:
        """An expression over Cartesian names, coordinates and their rates."""
        return self.reduced.names.convert(expression, self._rate)

    def _rate(self, expr: sp.Expr) -> sp.Expr:
        return total_derivative(expr, self.reduced.names.t, list(self.rates.items()))

    def _add_energy(
        self, name: str | None, term: sp.Expr, into: dict[sp.Symbol, list[sp.Expr]]
    ) -> None:
        """d/dt ∂L/∂ṡ − ∂L/∂s of a term of L."""
        for s, rate in self.rates.items():
            self._add(name, s, -derivative(term, s), into)
            momentum = derivative(term, rate)
            if momentum != 0:
                self._add(name, s, self.reduced.rate(self._resolved(momentum)), into)

    def _add_forces(self, *, of_turning: bool) -> None:
        names = self.reduced.names
        bodies = dict(zip((b.name for b in names.bodies), names.body_symbols, strict=True))
        coordinates = {c.name: c.q for c in self.reduced.coordinates}
        for force in self.derivation.forces:
            if force.is_torque:  # it does work where the body turns, and is no force on its centre
                works = force.generalized if of_turning else ()
                for c, work in zip(self.reduced.coordinates, works, strict=False):
                    self._add(None, c.q, -work, self.dynamic)
                continue
            symbols = bodies[force.on] if len(force.components) == 3 else (coordinates[force.on],)
            for s, component in zip(symbols, force.components, strict=True):
                self._add(force.name, s, -component, self.dynamic)

    def _add(
        self,
        name: str | None,
        symbol: sp.Symbol,
        load: sp.Expr,
        into: dict[sp.Symbol, list[sp.Expr]],
    ) -> None:
        """Add a load along a symbol; without a name it is of the turning of bodies."""
        if load == 0:
            return
        into.setdefault(symbol, []).append(self._resolved(load))
        if name is not None and any(symbol == c.q for c in self.own):
            self.unattached.setdefault(name, set()).add(symbol)

    def _resolved(self, expr: sp.Expr) -> sp.Expr:
        """Write an expression over q, v, t in place of Cartesian names and their rates."""
        moving = {
            rate: self.reduced.rate(s)
            for s, rate in self.rates.items()
            if s in self.reduced.resolved and rate in expr.free_symbols
        }
        return self.reduced.resolve(expr.xreplace(moving))


def _summed(parts: dict[sp.Symbol, list[sp.Expr]]) -> dict[sp.Symbol, sp.Expr]:
    return {s: sp.Add(*terms) for s, terms in parts.items()}


def weightless(derivation: Uncertified) -> tuple[str, ...]:
    """Name the particles without weight in a scene whose potentials give it to others."""
    reduced = derivation.reduced
    weights = [weights_of(reduced, term) for term in reduced.scene.potentials]
    heavy = [w for w in weights if w is not None]
    if not heavy or len({(w.axis, w.strength) for w in heavy}) > 1:
        return ()
    axis = "xyz".index(heavy[0].axis)
    written = frozenset().union(
        *(symbols_in(reduced.convert(term.expression)) for term in reduced.scene.potentials)
    )
    particles = zip(reduced.scene.particles, reduced.names.particle_symbols, strict=True)
    return tuple(p.name for p, symbols in particles if symbols[axis] not in written)
