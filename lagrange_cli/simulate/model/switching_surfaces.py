"""Expressions with kinks, each held on one side of its switching surface.

``abs``, ``sign``, ``min``, ``max`` and their slopes have a kink or a jump where an argument
vanishes. A step across loses its order there, and one that enters and leaves what is narrow sees
nothing of it. So a simulation works with equations in which each such function is replaced by
what it is on one side, a smooth function that goes on past the surface; weights of both sides,
parameters of the code, say which side it is. With a weight between 0 and 1 the motion
stays on the surface (A. F. Filippov, *Differential Equations with Discontinuous Righthand Sides*,
1988, §4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.kinks import KINKED, Cases, sides_of, surfaces_of
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.system import Parameter
from lagrange_cli.mechanics.tabulated import Tabulated, in_pieces
from lagrange_cli.simulate.model.expressions import distinct_parts, rates

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure, Contact

_ONE = sympy.Integer(1)

#: Functions that need not be real past a zero of their argument: what stands in them stays as it
#: is, and its surfaces only end steps.
_BOUNDED = (sympy.log, sympy.asin, sympy.acos, sympy.acosh, sympy.atanh)


@dataclass(frozen=True)
class OneSided:
    """Equations over the weights of sides, and the surfaces.

    Attributes
    ----------
    equations
        With two further parameters a surface, behind the scene's: first the weights of all
        positive sides, then those of all negative ones.
    surfaces
        Expressions that vanish on the surfaces, over q, v, t, parameters and weights. An
        expression holds weights of surfaces before it alone.
    signs
        The difference of the weights of each surface: 1 or −1, between them on the surface.
    continuous
        What does not jump where no impulse acts: the energy function, and momenta.
    written
        The expressions of the surfaces as the scene has them, without weights.
    switches
        Numbers of the states with two values. The last surfaces are where these change: their
        functions are positive until then, whatever the sides.
    """

    equations: Equations
    surfaces: tuple[Expr, ...]
    signs: tuple[Expr, ...]
    continuous: tuple[Expr, ...]
    written: tuple[Expr, ...]
    switches: tuple[int, ...] = ()


def one_sided(equations: Equations, parts: Sequence[Expr]) -> OneSided | None:
    """Write equations on one side of each surface; None if nothing has a kink.

    ``parts`` are those of :func:`.expressions.calls_and_powers`.
    """
    further = distinct_parts(_beside_forces(equations))
    switches = tuple(k for k, state in enumerate(equations.system.states) if state.switch)
    if not switches and {*KINKED, Tabulated}.isdisjoint(map(type, chain(parts, further))):
        return None
    moving = {equations.system.t, *(u.symbol for u in equations.system.inputs)}
    moving |= set(equations.system.state_symbols)
    sides = _Sides(frozenset(moving))
    mass = tuple(_row(row, sides.smooth) for row in equations.system.mass_matrix)
    forcing = tuple(map(sides.smooth, equations.system.forcing))
    states = tuple(s.rewritten(sides.smooth) for s in equations.system.states)
    closures = tuple(_closure(closure, sides.smooth) for closure in equations.system.closures)
    contacts = tuple(_contact(contact, sides.smooth) for contact in equations.system.contacts)
    continuous = (sides.smooth(equations.system.energy), *_momenta(equations, sides))
    until = [s.switch.until(s.symbol) for s in states if s.switch]
    for expression in until:
        sides.add(expression)
    if not sides.surfaces:
        return None
    weights = [*sides.above, *sides.below]
    return OneSided(
        replace(
            equations,
            system=replace(
                equations.system,
                mass_matrix=mass,
                forcing=forcing,
                states=states,
                closures=closures,
                contacts=contacts,
                parameters=(*equations.system.parameters, *(Parameter(w.name, w) for w in weights)),
            ),
        ),
        tuple(sides.surfaces),
        tuple(up - down for up, down in zip(sides.above, sides.below, strict=True)),
        continuous,
        (*sides.numbers, *until),
        switches,
    )


def _beside_forces(equations: Equations) -> Iterator[Expr]:
    """Yield what is to be without kinks beside forces and inertias."""
    yield equations.system.energy
    for closure in (*equations.system.closures, *(c.closure for c in equations.system.contacts)):
        yield from (closure.expression, closure.rate, closure.bias)
        yield from entries(closure.gradient).values()


def _momenta(equations: Equations, sides: _Sides) -> list[Expr]:
    """Return the momenta of coordinates on whose velocities a kink of L depends."""
    if sides.is_plain(equations.system.lagrangian):
        return []
    kinks = equations.system.lagrangian.atoms(*KINKED)
    kinked = {s for kink in kinks for s in kink.free_symbols}
    velocities = [c.v for c in equations.system.coordinates if c.v in kinked]
    lagrangian = (
        sides.smooth(equations.system.lagrangian) if velocities else equations.system.lagrangian
    )
    return [derivative(lagrangian, v) for v in velocities]


def _row(row: Sequence[Expr], smooth: Callable[[Expr], Expr]) -> Sequence[Expr]:
    if isinstance(row, ExpressionRow):
        return ExpressionRow(len(row), {j: smooth(entry) for j, entry in entries(row).items()})
    return tuple(map(smooth, row))


def _closure(closure: Closure, smooth: Callable[[Expr], Expr]) -> Closure:
    return replace(
        closure,
        expression=smooth(closure.expression),
        gradient=_row(closure.gradient, smooth),
        rate=smooth(closure.rate),
        bias=smooth(closure.bias),
    )


def _contact(contact: Contact, smooth: Callable[[Expr], Expr]) -> Contact:
    return replace(contact, closure=_closure(contact.closure, smooth))


@dataclass
class _Sides:
    """Surfaces met so far, and what became of expressions.

    Attributes
    ----------
    moving
        Symbols that change during a motion.
    surfaces
        Expressions that vanish on the surfaces.
    above, below
        Weights of the positive and of the negative side of each surface.
    numbers
        Expression as written, up to its sign → number of its surface.
    _smooth
        Expression → the same on one side of every surface.
    _plain
        Expressions without kinks.
    """

    moving: frozenset[Symbol]
    surfaces: list[Expr] = field(default_factory=list)
    above: list[Symbol] = field(default_factory=list)
    below: list[Symbol] = field(default_factory=list)
    numbers: dict[Expr, int] = field(default_factory=dict)
    _smooth: dict[Expr, Expr] = field(default_factory=dict)
    _plain: set[Expr] = field(default_factory=set)

    def smooth(self, expression: Expr) -> Expr:
        """Replace every kinked function in an expression by itself on one side of its surface."""
        if self.is_plain(expression):
            return expression
        if expression not in self._smooth:
            self._smooth[expression] = self._smoothed(expression)
        return self._smooth[expression]

    def add(self, surface: Expr) -> None:
        """Add a surface with the weights of its sides."""
        number = len(self.surfaces)
        self.surfaces.append(surface)
        self.above.append(sympy.Symbol(f"above({number})", real=True))
        self.below.append(sympy.Symbol(f"below({number})", real=True))

    def is_plain(self, e: Expr) -> bool:
        """Tell if nothing in an expression has a kink; parts that expressions share are known."""
        plain = e in self._plain
        if (
            not plain
            and not isinstance(e, (*KINKED, Tabulated))
            and all(map(self.is_plain, e.args))
        ):
            self._plain.add(e)
            plain = True
        return plain

    def _smoothed(self, e: Expr) -> Expr:
        if isinstance(e, Tabulated):
            return self.smooth(in_pieces(e))
        if self._is_bounded(e):
            self._only_located(e)
            return e
        if not isinstance(e, KINKED):
            return e.func(*map(self.smooth, e.args))
        if self.moving.isdisjoint(s for side in surfaces_of(e) for s in side.free_symbols):
            return e.func(*map(self.smooth, e.args))
        if isinstance(e, (sympy.Min, sympy.Max)):
            return self._extremum(e)
        (surface,) = surfaces_of(e)
        up, down, sign = self._sides_of(surface, self.smooth(surface))
        if isinstance(e, Cases):
            above, below = map(self.smooth, sides_of(e))
            return (up if sign > 0 else down) * above + (down if sign > 0 else up) * below
        if isinstance(e, sympy.Abs):
            return (up - down) * sign * self.smooth(e.args[0])
        if isinstance(e, sympy.sign):
            return (up - down) * sign
        return up if sign > 0 else down

    def _extremum(self, e: Expr) -> Expr:
        """Choose the largest, or the least, of arguments two by two."""
        kind = e.func
        plain, chosen = e.args[0], self.smooth(e.args[0])
        for argument in e.args[1:]:
            smoothed = self.smooth(argument)
            up, down, sign = self._sides_of(plain - argument, chosen - smoothed)
            first = up if (sign > 0) == (kind is sympy.Max) else down
            second = down if first is up else up
            plain, chosen = kind(plain, argument), first * chosen + second * smoothed
        return chosen

    def _is_bounded(self, e: Expr) -> bool:
        if e.is_Pow and e.base is not sympy.E:
            return not e.exp.is_Integer
        return isinstance(e, _BOUNDED)

    def _only_located(self, e: Expr) -> None:
        """Add the surfaces of the kinks within an expression that stays as it is."""
        for part in _kinks(e):
            for surface in surfaces_of(part):
                if not self.moving.isdisjoint(surface.free_symbols):
                    self._sides_of(surface, surface)

    def _sides_of(self, plain: Expr, smooth: Expr) -> tuple[Expr, Expr, int]:
        """Return the weights above and below a surface, and the sign with which it is listed."""
        sign = -1 if plain.could_extract_minus_sign() else 1
        key = sign * plain
        if key.is_Number:
            weights = (_ONE, 1 - _ONE) if key >= 0 else (1 - _ONE, _ONE)
            return *weights, sign
        if key not in self.numbers:
            self.numbers[key] = len(self.surfaces)
            self.add(sign * smooth)
        k = self.numbers[key]
        return self.above[k], self.below[k], sign


def _kinks(e: Expr) -> Iterator[Expr]:
    """Yield the kinked functions in an expression, inner ones first, in a fixed order."""
    for argument in (in_pieces(e),) if isinstance(e, Tabulated) else e.args:
        yield from _kinks(argument)
    if isinstance(e, KINKED):
        yield e


def surface_events(one_side: OneSided) -> list[Expr]:
    """List the event function of each surface, which is positive on the present side."""
    return [sign * s for sign, s in zip(one_side.signs, one_side.surfaces, strict=True)]


def surface_values(one_side: OneSided) -> list[Expr]:
    """List the function of each surface, then the magnitudes that each is the sum of."""
    return [*one_side.surfaces, *map(_magnitude, one_side.surfaces)]


def surface_rates(one_side: OneSided) -> list[Expr]:
    """List how what :func:`surface_values` gives changes, with accelerations.

    The first rate of each surface, then the second, 0 where the surface hangs on velocities, then
    the magnitudes behind the first.
    """
    first, second = rates(one_side.surfaces, one_side.equations, sympy.diff)
    return [*first, *second, *map(_magnitude, first)]


def _magnitude(e: Expr) -> Expr:
    """Bound an expression by the sum of magnitudes: nothing in its sums cancels."""
    if e.is_Add:
        return sympy.Add(*map(_magnitude, e.args))
    if e.is_Mul:
        return sympy.Mul(*map(_magnitude, e.args))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        return _magnitude(e.base) ** e.exp
    return abs(e) if e.is_Number else sympy.Abs(e, evaluate=False)
