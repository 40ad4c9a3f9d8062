"""From a scene to generalized coordinates: 3N Cartesian components, K constraints, 3N − K.

The reduction eliminates Cartesian names (:mod:`elimination`), looks at what is
left over (:mod:`account`) and yields every raw symbol as a function of q and t.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.account import Geometry, balance
from lagrange_cli.mechanics.angles import periodic_symbols
from lagrange_cli.mechanics.elimination import Elimination, Stated, eliminate
from lagrange_cli.mechanics.equations import Account, Coordinate
from lagrange_cli.mechanics.language import Rate, total_derivative
from lagrange_cli.mechanics.names import Names
from lagrange_cli.mechanics.parameters import Values
from lagrange_cli.mechanics.refusals import require_enough, require_solved
from lagrange_cli.mechanics.sampling import Sampler, typical_length, working_digits
from lagrange_cli.mechanics.terms import tidy
from lagrange_cli.scene.model import Particle, Scene

__all__ = ["Reduced", "reduce"]

#: Decimal digits of the numbers that tests of identity and rank work with.
_DIGITS = 30


@dataclass(frozen=True)
class Reduced:
    """A scene over its generalized coordinates.

    Attributes
    ----------
    resolved
        Raw symbol → r(q, t).
    masses
        One expression for each particle.
    reference
        Values of symbols that ``initial`` and ``near`` give.
    """

    scene: Scene
    names: Names
    values: Values
    coordinates: tuple[Coordinate, ...]
    resolved: Mapping[sp.Symbol, sp.Expr]
    masses: tuple[sp.Expr, ...]
    account: Account
    reference: Mapping[sp.Symbol, mpf]
    warnings: tuple[Problem, ...]
    remarks: tuple[str, ...]
    geometry: Geometry

    def resolve(self, expr: sp.Expr) -> sp.Expr:
        """``expr`` with raw symbols replaced by their r(q, t)."""
        present = {s: self.resolved[s] for s in expr.free_symbols if s in self.resolved}
        return expr.xreplace(present) if present else expr

    @property
    def rate(self) -> Rate:
        """Total time derivative of an expression over raw symbols, q, v and t.

        Raw symbols move with ṙ(q, v, t); velocities with accelerations.
        """
        return partial(_rate, self)

    def sampler(self, domain: list[sp.Expr]) -> Sampler:
        """Random feasible configurations at which ``domain`` is real as well."""
        return _sampler(self.values, self.geometry, self.coordinates, domain)


def _rate(reduced: Reduced, expr: sp.Expr) -> sp.Expr:
    motion = [(c.q, c.v) for c in reduced.coordinates]
    accelerated = [*motion, *((c.v, c.a) for c in reduced.coordinates)]
    moving = {c.q for c in reduced.coordinates}
    t = reduced.names.t
    chain = list(accelerated)
    for symbol in sorted(expr.free_symbols & reduced.resolved.keys(), key=str):
        if symbol not in moving:
            chain.append((symbol, total_derivative(reduced.resolved[symbol], t, motion)))
    return total_derivative(expr, t, chain)


def reduce(scene: Scene) -> Reduced:
    """Reduce a scene to generalized coordinates.

    Raises
    ------
    InputError
        Located and explained: too few or too many coordinates, constraints that
        contradict each other, a branch that nothing chooses, a constraint without a
        closed-form solution, a mass that is not positive.
    """
    with mpmath.workdps(working_digits(_DIGITS)):
        names, values = Names(scene), Values(scene)
        masses = tuple(_mass(names, values, p) for p in scene.particles)
        stated = list(_stated(names, scene))
        reference = _reference(names, values, scene)
        found = _eliminate(names, scene, stated, reference)
        require_solved(scene, found)
        symbols = _coordinate_symbols(names, found)
        resolved = {s: _placed(found, s) for s in names.cartesian.values()}
        coordinates = tuple(_coordinates(scene, names, symbols, resolved))
        geometry = Geometry(names, found, resolved, symbols, reference)
        account, warnings = balance(geometry, _sampler(values, geometry, coordinates, []))
    return Reduced(
        scene,
        names,
        values,
        coordinates,
        resolved,
        masses,
        account,
        reference,
        (*scene.warnings, *warnings),
        tuple(found.remarks),
        geometry,
    )


def _placed(found: Elimination, symbol: sp.Symbol) -> sp.Expr:
    """r(q, t) of a raw symbol, with sums under roots collected."""
    expr = found.solved.get(symbol, symbol)
    rooted = any(p.exp.q != 1 and p.base.is_Add for p in expr.atoms(sp.Pow) if p.exp.is_Rational)
    return tidy(expr) if rooted else expr


def _mass(names: Names, values: Values, particle: Particle) -> sp.Expr:
    mass = names.convert(particle.mass)
    if not mass.free_symbols <= set(names.parameters.values()):
        raise InputError(
            Problem(
                f"the mass of '{particle.name}' may hold numbers and parameters only",
                particle.mass.mark(),
                rule="mass",
            )
        )
    value = values.number(particle.mass)
    if value is not None and not value.is_positive:
        raise InputError(
            Problem(
                f"the mass of '{particle.name}' must be positive, found {particle.mass.text}"
                + ("" if value.is_Integer and particle.mass.text == str(value) else f" = {value}"),
                particle.mass.mark(),
                hint="a position without mass is written under 'points'",
                rule="mass",
            )
        )
    return mass


def _stated(names: Names, scene: Scene) -> Iterator[Stated]:
    for constraint in scene.constraints:
        for equation in constraint.equations:
            left, right = names.convert(equation.left), names.convert(equation.right)
            yield Stated(constraint.name, equation, left, right)


def _reference(names: Names, values: Values, scene: Scene) -> dict[sp.Symbol, mpf]:
    """Values of symbols at ``initial`` and ``near`` (``initial`` wins), and of parameters."""
    found: dict[sp.Symbol, mpf] = {}
    for entry in (*scene.near, *scene.initial):
        value = values.number(entry.value) if entry.order == 0 else None
        symbol = names.lookup(entry.name)
        if value is not None and symbol is not None and symbol.is_Symbol:
            found[symbol] = mpf(value.evalf(mpmath.mp.dps))
    for name, value in values.exact.items():
        found[names.parameters[name]] = mpf(value.evalf(mpmath.mp.dps))
    start = scene.simulate.start
    at = values.number(start) if start is not None else None
    found[names.t] = mpf(at.evalf(mpmath.mp.dps)) if at is not None else mpf(0)
    return found


def _eliminate(
    names: Names, scene: Scene, stated: list[Stated], reference: dict[sp.Symbol, mpf]
) -> Elimination:
    declared = set(names.coordinates.values())
    unknowns = [s for s in names.cartesian.values() if s not in names.given and s not in declared]
    constants = frozenset(names.parameters.values())
    return eliminate(
        stated,
        names.given,
        unknowns,
        reference,
        constants,
        check=partial(require_enough, scene),
    )


def _coordinate_symbols(names: Names, found: Elimination) -> list[sp.Symbol]:
    """Declared coordinates, or the names that the constraints leave, in reading order."""
    if names.scene.coordinates is not None:
        return list(names.coordinates.values())
    return [s for s in names.cartesian.values() if s in found.unknowns]


def _coordinates(
    scene: Scene,
    names: Names,
    symbols: list[sp.Symbol],
    resolved: Mapping[sp.Symbol, sp.Expr],
) -> Iterator[Coordinate]:
    declared = {c.name: c for c in scene.coordinates or ()}
    positions = [resolved[s] for body in names.particle_symbols for s in body]
    periodic = periodic_symbols(positions)
    for q in symbols:
        written = declared.get(q.name)
        unit = written.unit if written else None
        yield Coordinate(
            name=q.name,
            q=q,
            v=sp.Symbol(f"dot({q.name})", real=True),
            a=sp.Symbol(f"ddot({q.name})", real=True),
            is_angle=unit == "rad" or q in periodic,
            unit=unit,
            description=written.description if written else None,
            latex=written.latex if written else None,
            mark=written.mark if written else scene.coordinates_mark,
        )


def _sampler(
    values: Values,
    geometry: Geometry,
    coordinates: Sequence[Coordinate],
    domain: list[sp.Expr],
) -> Sampler:
    names, reference = geometry.names, geometry.reference
    parameters = set(names.parameters.values())
    angles = {c.q for c in coordinates if c.is_angle}
    center = {c.q: reference.get(c.q, mpf(0)) for c in coordinates}
    lengths = [x for s, x in reference.items() if s not in parameters | angles | {names.t}]
    length = typical_length(lengths)
    return Sampler(
        names.t,
        list(center),
        {names.parameters[n]: reference[names.parameters[n]] for n in values.exact},
        [s for n, s in names.parameters.items() if n not in values.exact],
        center,
        {q: mpf(1) if q in angles else max(length, abs(x)) for q, x in center.items()},
        [*geometry.resolved.values(), *domain],
        seed=names.scene.digest,
    )
