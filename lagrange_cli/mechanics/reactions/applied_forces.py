"""Applied forces along each Cartesian name, with the inertia of ``kinetic``.

Potentials, kinetic terms and dissipation are read over Cartesian names and their rates,
so that a force belongs to the particle whose name it is written in. A term that is written
in other coordinates acts on no particle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.convert import total_derivative
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
    """

    positional: dict[sp.Symbol, sp.Expr]
    dynamic: dict[sp.Symbol, sp.Expr]
    unattached: tuple[str, ...]

    def along(self, symbol: sp.Symbol) -> sp.Expr:
        """−F along one symbol."""
        return self.positional.get(symbol, sp.Integer(0)) + self.dynamic.get(symbol, sp.Integer(0))


def applied_forces(derivation: Uncertified) -> AppliedForces:
    """Collect the applied forces of a scene, with opposite sign."""
    return _Reader(derivation).applied_forces()


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
    """Convert the terms of a scene that hold rates, over the names in the scene."""
    reader = _Reader(derivation)
    scene = derivation.reduced.scene
    potentials = [reader.converted(p.expression) for p in scene.potentials]
    moving = [u for u in potentials if not u.free_symbols.isdisjoint(reader.rates.values())]
    kinetic = [reader.converted(k.expression) for k in scene.kinetic]
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
        self.unattached: list[str] = []

    def applied_forces(self) -> AppliedForces:
        scene = self.reduced.scene
        for name, raw in self._converted(scene.potentials):
            moving = not raw.free_symbols.isdisjoint(self.rates.values())
            self._add_energy(name, -raw, self.dynamic if moving else self.positional)
        for name, raw in self._converted(scene.kinetic):
            self._add_energy(name, raw, self.dynamic)
        for name, raw in self._converted(scene.dissipation):
            for s, rate in self.rates.items():
                self._add(name, s, derivative(raw, rate), self.dynamic)
        self._add_forces()
        return AppliedForces(
            _summed(self.positional), _summed(self.dynamic), tuple(self.unattached)
        )

    def _converted(self, terms: Sequence[Term]) -> Iterator[tuple[str, sp.Expr]]:
        for term in terms:
            yield term.name, self.converted(term.expression)

    def converted(self, expression: Expression) -> sp.Expr:
        """An expression over Cartesian names, coordinates and their rates."""
        return self.reduced.names.convert(expression, self._rate)

    def _rate(self, expr: sp.Expr) -> sp.Expr:
        return total_derivative(expr, self.reduced.names.t, list(self.rates.items()))

    def _add_energy(self, name: str, term: sp.Expr, into: dict[sp.Symbol, list[sp.Expr]]) -> None:
        """d/dt ∂L/∂ṡ − ∂L/∂s of a term of L."""
        for s, rate in self.rates.items():
            self._add(name, s, -derivative(term, s), into)
            momentum = derivative(term, rate)
            if momentum != 0:
                self._add(name, s, self.reduced.rate(self._resolved(momentum)), into)

    def _add_forces(self) -> None:
        names = self.reduced.names
        bodies = dict(zip((b.name for b in names.bodies), names.body_symbols, strict=True))
        coordinates = {c.name: c.q for c in self.reduced.coordinates}
        for force in self.derivation.forces:
            symbols = bodies[force.on] if len(force.components) == 3 else (coordinates[force.on],)
            for s, component in zip(symbols, force.components, strict=True):
                self._add(force.name, s, -component, self.dynamic)

    def _add(
        self, name: str, symbol: sp.Symbol, load: sp.Expr, into: dict[sp.Symbol, list[sp.Expr]]
    ) -> None:
        if load == 0:
            return
        into.setdefault(symbol, []).append(self._resolved(load))
        if any(symbol == c.q for c in self.own) and name not in self.unattached:
            self.unattached.append(name)

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
