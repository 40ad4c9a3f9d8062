"""Forces of contacts without velocities, and the places at which a contact can be lost.

While contacts stay closed, their multipliers follow from M a = f + Jᵀ λ and J a + bias = 0, and are
of second degree in the velocities. A multiple of E − E₀, with E₀ the energy of the start, removes
these, if need be after conserved momenta have; the equations of the contacts and sin² + cos² = 1
reduce the rest. A contact ends where its force ceases to be positive, and so, if the force is
continuous, only where it is zero (E. T. Whittaker, Analytical Dynamics, 4th ed., 1937, chapter VI).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.contacts.relations import Surface, TooLongError, reduced
from lagrange_cli.analysis.contacts.zeros import Zero, collected, with_angle, zeros
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.free_symbols import is_open
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.continuity import is_continuous
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.system import Closure
from lagrange_cli.phrases import Phrase

#: Coordinates of systems that are solved in symbols, and constraints that push at once.
_MOST_COORDINATES, _MOST_PUSHING = 8, 3

#: Coordinates of systems whose mass matrix is not diagonal.
_MOST_COUPLED = 4

#: Size of a gap or of its rate at the start below which it is closed, relative to 1.
_CLOSED = mpf(10) ** -9


@dataclass(frozen=True)
class StartConstant:
    """A constant that is named by the start, and its value there."""

    symbol: sp.Symbol
    value: float


@dataclass(frozen=True)
class ContactLoss:
    """Force of a contact that is closed at the start.

    Attributes
    ----------
    name
        Name of the one-sided constraint.
    multiplier
        Symbol of its multiplier.
    force
        The multiplier while the contacts of the start last, over coordinates, parameters and
        constants of the start; over velocities too if ``reason`` is given.
    at_start
        Its value at the start, 0 if that is rounding; None if it has none. If it is negative, a
        single contact is lost at once, and of several not all last.
    zeros
        Places at which the force vanishes; the contact is lost at none but these.
    reason
        Why velocities remain; empty if none do.
    jumps
        True if it is not proven that the force is continuous.
    """

    name: str
    multiplier: sp.Symbol
    force: sp.Expr
    at_start: float | None
    zeros: tuple[Zero, ...]
    reason: str = ""
    jumps: bool = False


@dataclass(frozen=True)
class ContactLosses:
    """Contacts that are closed at the start.

    Attributes
    ----------
    contacts
        One for each; none if all are open.
    constants
        Constants of the start in the results that are no parameters.
    angles
        Symbols of outputs in the results.
    are_all
        True if no contact is open at the start.
    """

    contacts: tuple[ContactLoss, ...]
    constants: tuple[StartConstant, ...] = ()
    angles: tuple[sp.Symbol, ...] = ()
    are_all: bool = True


def contact_losses(equations: Equations) -> ContactLosses:
    """Find the forces of contacts that are closed at the start, and where these vanish.

    Raises
    ------
    InputError
        There are no contacts, the start is not known, or the system is too large.
    """
    system = equations.system
    if not system.contacts:
        raise _refused(Phrase("no constraint of the scene is one-sided"))
    if system.initial is None:
        raise _refused(Phrase("the start is not known, and so not which contacts are closed"))
    if any(c.kind == "velocity" for c in system.closures):
        raise _refused(Phrase("a constraint is between velocities"))
    start = _Start(equations)
    closed = [c.closure for c in system.contacts if start.is_closed(c.closure)]
    if not closed:
        return ContactLosses(())
    pushing = (*system.closures, *closed)
    if len(system.coordinates) > _MOST_COORDINATES or len(pushing) > _MOST_PUSHING:
        raise _refused(Phrase("there are too many coordinates for a solution in symbols"))
    coordinates = [c.q for c in system.coordinates]
    surface = Surface.of([c.expression for c in pushing], coordinates, start.numbers)
    if surface is None:
        raise _refused(Phrase("a gap gives neither a coordinate nor the square of one"))
    try:
        solved = _Forces(equations, start, surface, pushing).losses(closed)
    except (TooLongError, sp.PolynomialError):
        raise _refused(Phrase("the forces of the contacts are too long")) from None
    symbols = {s for c in solved for e in (c.force, *_sides(c)) for s in e.free_symbols}
    outputs = {sp.Symbol(name, real=True) for name, _ in system.outputs}
    return ContactLosses(
        solved,
        tuple(c for c in start.constants if c.symbol in symbols),
        tuple(sorted(outputs & symbols, key=str)),
        are_all=len(closed) == len(system.contacts),
    )


def _sides(loss: ContactLoss) -> list[sp.Expr]:
    return [e for z in loss.zeros for e in (z.left, z.right, *(z.angle or ()))]


def _refused(message: Phrase) -> InputError:
    return InputError(Problem(message, rule="analysis-contacts"))


def _is_open(expression: sp.Expr) -> bool:
    """Tell if an expression holds an unknown function."""
    return any(is_open(part) for part in sp.preorder_traversal(expression))


@dataclass
class _Start:
    """The start, over parameters or named constants.

    Attributes
    ----------
    equations
        The equations, whose initial state is known.
    constants
        Constants that were named.
    """

    equations: Equations
    constants: list[StartConstant] = field(default_factory=list)

    @cached_property
    def known(self) -> dict[sp.Symbol, sp.Expr]:
        """Exact values of the parameters that have one."""
        parameters = self.equations.system.parameters
        known = {}
        for p in parameters:
            if p.exact is not None and not p.exact.free_symbols:
                known[p.symbol] = p.exact
            elif p.value is not None:
                known[p.symbol] = sp.Rational(p.decimal or repr(p.value))
        return known

    @cached_property
    def taken(self) -> set[str]:
        """Names of the symbols of the equations."""
        system = self.equations.system
        named = (system.parameters, system.coordinates, system.external, system.cartesian_names)
        return {one.name for group in named for one in group}

    @cached_property
    def numbers(self) -> dict[sp.Symbol, mpf]:
        """Values of parameters, coordinates, velocities and t at the start."""
        system = self.equations.system
        assert system.initial is not None
        numbers = {s: mpf(str(sp.N(x, 40))) for s, x in self.known.items()}
        numbers[system.t] = mpf(system.simulate.start)
        exact = system.initial.decimals
        floats = [*system.initial.positions, *system.initial.velocities]
        symbols = [*(c.q for c in system.coordinates), *(c.v for c in system.coordinates)]
        for k, symbol in enumerate(symbols):
            numbers[symbol] = mpf(exact[k]) if exact else mpf(floats[k])
        return numbers

    def is_closed(self, gap: Closure) -> bool:
        """Tell if a gap and its rate are zero at the start."""
        velocities = [c.v for c in self.equations.system.coordinates]
        rate = sp.Add(gap.rate, *(g * velocities[k] for k, g in entries(gap.gradient).items()))
        values = self.evaluated([gap.expression, rate])
        return values is not None and all(abs(x) <= _CLOSED for x in values)

    def evaluated(self, expressions: Sequence[sp.Expr]) -> list[mpf] | None:
        """Return values at the start; None where there are none, as of unknown functions."""
        inputs = {u.symbol: u.expression for u in self.equations.system.inputs}
        expressions = [e.xreplace({u: x for u, x in inputs.items() if x}) for e in expressions]
        if any(not e.free_symbols <= self.numbers.keys() or _is_open(e) for e in expressions):
            return None
        try:
            return evaluate(expressions, self.numbers)
        except DomainError:
            return None

    def value(self, quantity: sp.Expr, name: str, surface: Surface) -> sp.Expr:
        """Value of a conserved quantity, over parameters and named places of the start.

        It is a constant of its same_rate where velocities of the start are numbers.
        """
        places = self._places(surface)
        if places is not None:
            value = quantity.xreplace(places)
            if value.free_symbols <= {*self.known, *(c.symbol for c in self.constants)}:
                return value
        values = self.evaluated([quantity])
        if values is None:
            raise _refused(Phrase("the start is not known, and so not which contacts are closed"))
        (number,) = values
        return self._named(name, float(number)) if number else sp.S.Zero

    def _places(self, surface: Surface) -> dict[sp.Symbol, sp.Expr] | None:
        """Return q and q̇ of the start, coordinates that are decimals named; None if q̇ are."""
        coordinates = self.equations.system.coordinates
        written = dict(self.equations.derivation.start)
        for c in coordinates:
            for symbol in (c.q, c.v):
                number = self.numbers[symbol]
                written.setdefault(symbol, sp.Rational(str(number)) if number else sp.S.Zero)
        if any(written[c.v].is_Rational and written[c.v] != 0 for c in coordinates):
            return None
        for c in coordinates:
            if c.q not in surface.chart and written[c.q].is_Rational and written[c.q] != 0:
                written[c.q] = self._named(f"{c.name}_0", float(self.numbers[c.q]))
        return written | {q: e.xreplace(written) for q, e in surface.chart.items()}

    def _named(self, name: str, value: float) -> sp.Symbol:
        """Return the symbol of a constant, with a name that no other symbol has."""
        outputs = {name for name, _ in self.equations.system.outputs}
        while name in self.taken or name in outputs:
            name = f"{name}_0"
        symbol = sp.Symbol(name, real=True)
        if all(c.symbol != symbol for c in self.constants):
            self.constants.append(StartConstant(symbol, value))
        return symbol


@dataclass
class _Forces:
    """Solves for the multipliers of contacts that stay closed.

    Attributes
    ----------
    equations, start, surface
        The equations, their start, and the configurations in which the contacts are closed.
    pushing
        Closures and closed gaps.
    """

    equations: Equations
    start: _Start
    surface: Surface
    pushing: Sequence[Closure]

    @cached_property
    def coordinates(self) -> list[sp.Symbol]:
        return [c.q for c in self.equations.system.coordinates]

    @cached_property
    def velocities(self) -> dict[sp.Symbol, sp.Expr]:
        """Velocities that the contacts allow, over independent ones."""
        system = self.equations.system
        return self.surface.velocities([(c.q, c.v) for c in system.coordinates], system.t)

    @cached_property
    def free(self) -> list[sp.Symbol]:
        """The independent velocities."""
        every = [c.v for c in self.equations.system.coordinates]
        return [v for v in every if v not in self.velocities]

    def placed(self, expression: sp.Expr) -> sp.Expr:
        """Write an expression over the surface and velocities along it."""
        return reduced(self.surface, expression.xreplace(self.velocities))

    def losses(self, closed: Sequence[Closure]) -> tuple[ContactLoss, ...]:
        forces = self._multipliers()
        offset = len(self.pushing) - len(closed)
        columns = zip(closed, forces[offset:], self._at_start()[offset:], strict=True)
        return tuple(self._loss(gap, force, number) for gap, force, number in columns)

    def _at_start(self) -> list[float | None]:
        """Solve for the multipliers of the start in numbers; None where they have none."""
        system, n, k = self.equations.system, len(self.coordinates), len(self.pushing)
        rows = [entries(row) for row in (*system.mass_matrix, *(c.gradient for c in self.pushing))]
        dense = [row.get(j, sp.S.Zero) for row in rows for j in range(n)]
        sides = [*system.forcing, *(c.bias for c in self.pushing)]
        values = self.start.evaluated([*dense, *sides])
        if values is None:
            return [None] * k
        matrix, right = mpmath.matrix(n + k, n + k), mpmath.matrix(values[len(dense) :])
        for i in range(n + k):
            for j in range(n):
                matrix[i, j] = values[i * n + j]
                if i >= n:
                    matrix[j, i] = -values[i * n + j]
        for i in range(n, n + k):
            right[i] = -right[i]
        try:
            solution = mpmath.lu_solve(matrix, right)
        except ZeroDivisionError:
            return [None] * k
        return [float(x) if abs(x) > _CLOSED else 0.0 for x in list(solution)[n:]]

    def _multipliers(self) -> list[sp.Expr]:
        """Solve J M⁻¹ (f + Jᵀ λ) + bias = 0 for λ."""
        system, n = self.equations.system, len(self.coordinates)
        rows = [entries(row) for row in system.mass_matrix]
        mass = sp.Matrix(n, n, lambda i, j: self.placed(rows[i].get(j, sp.S.Zero)))
        slopes = [entries(c.gradient) for c in self.pushing]
        jacobian = sp.Matrix(len(slopes), n, lambda i, j: self.placed(slopes[i].get(j, sp.S.Zero)))
        forcing = sp.Matrix([self.placed(f) for f in system.forcing])
        bias = sp.Matrix([self.placed(c.bias) for c in self.pushing])
        inverse = self._inverse(mass)
        weight = (jacobian * inverse * jacobian.T).applyfunc(self.placed)
        size = self.placed(weight.det())
        if size == 0:
            raise _refused(Phrase("contacts that are closed depend on each other"))
        right = -(jacobian * inverse * forcing + bias).applyfunc(self.placed)
        return [self.placed(e) for e in weight.adjugate() * right / size]

    def _inverse(self, mass: sp.Matrix) -> sp.Matrix:
        if mass.is_diagonal() and all(mass.diagonal()):
            return sp.diag(*(1 / entry for entry in mass.diagonal()))
        if mass.rows > _MOST_COUPLED:
            raise _refused(Phrase("there are too many coordinates for a solution in symbols"))
        determinant = self.placed(mass.det())
        if determinant == 0:
            raise _refused(Phrase("the mass matrix is singular"))
        return mass.adjugate() / determinant

    def _loss(self, gap: Closure, force: sp.Expr, at_start: float | None) -> ContactLoss:
        jumps = not self._is_continuous(force)
        remaining, reason = self._without_velocities(force)
        remaining = collected(remaining, [*self.coordinates, *self.free])
        if reason:
            return ContactLoss(gap.name, gap.multiplier, remaining, at_start, (), reason, jumps)
        numerator = sp.fraction(sp.together(remaining))[0]
        known = {c.symbol: sp.Rational(repr(c.value)) for c in self.start.constants}
        moving = [*self.coordinates, self.equations.system.t]
        places = zeros(reduced(self.surface, numerator), moving, self.start.known | known)
        outputs = {n: e for n, e in self.equations.system.outputs if n not in self.start.taken}
        named = tuple(with_angle(z, self.surface, self.coordinates, outputs) for z in places)
        return ContactLoss(gap.name, gap.multiplier, remaining, at_start, named, "", jumps)

    def _is_continuous(self, force: sp.Expr) -> bool:
        inputs = self.equations.system.external_symbols
        moving = [*self.coordinates, *self.free, self.equations.system.t]
        return not force.free_symbols & inputs and is_continuous(force, moving)

    def _without_velocities(self, force: sp.Expr) -> tuple[sp.Expr, str]:
        """Replace velocities by conserved quantities; say why if some remain."""
        if not self._moving(force):
            return force, ""
        momenta = self._by_momenta()
        for known in ({}, momenta) if momenta else ({},):
            for energy, value in self._energies():
                remaining = self._less_energy(
                    self.placed(force.xreplace(known)), self.placed(energy.xreplace(known)), value
                )
                if not self._moving(remaining):
                    return remaining, ""
        remaining = self.placed(force.xreplace(momenta))
        if not self._moving(remaining):
            return remaining, ""
        if not self._energies():
            return force, Phrase("no energy is conserved that gives the velocity")
        return force, Phrase("energy and conserved momenta do not remove the velocities")

    def _moving(self, expression: sp.Expr) -> bool:
        return not expression.free_symbols.isdisjoint(self.free)

    def _energies(self) -> list[tuple[sp.Expr, sp.Expr]]:
        """Conserved energies on the surface, and their values at the start."""
        return [
            (
                self.placed(c.expression),
                self.start.value(
                    c.expression,
                    "E" if c.kind == "energy" or c.is_energy else "h",
                    self.surface,
                ),
            )
            for c in self.equations.derivation.conserved
            if c.kind != "momentum"
        ]

    def _by_momenta(self) -> dict[sp.Symbol, sp.Expr]:
        """Solve conserved momenta on which no contact acts for velocities, one for each."""
        numbers = {c.name: k for k, c in enumerate(self.equations.system.coordinates)}
        solved: dict[sp.Symbol, sp.Expr] = {}
        for c in self.equations.derivation.conserved:
            if c.coordinate is None or any(
                numbers[c.coordinate] in entries(gap.gradient) for gap in self.pushing
            ):
                continue
            momentum = self.placed(self.placed(c.expression).xreplace(solved))
            same_rate = self.equations.system.coordinates[numbers[c.coordinate]].v
            for v in sorted(self.free, key=lambda v: v != same_rate):
                slope = self.placed(sp.diff(momentum, v))
                if slope != 0 and not self._moving(slope):
                    level = self.start.value(c.expression, c.name, self.surface)
                    value = self.placed((level - momentum.xreplace({v: sp.S.Zero})) / slope)
                    solved = {k: e.xreplace({v: value}) for k, e in solved.items()} | {v: value}
                    break
        return solved

    def _less_energy(self, force: sp.Expr, energy: sp.Expr, value: sp.Expr) -> sp.Expr:
        """Subtract the multiple of E − E₀ that removes the square of a velocity."""
        for v in self.free:
            square = self.placed(sp.diff(energy, v, 2))
            if square != 0 and not self._moving(square):
                factor = sp.diff(force, v, 2) / square
                return self.placed(force - factor * (energy - value))
        return force
