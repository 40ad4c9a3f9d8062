"""The equations of equilibrium: forces and constraints at rest.

By virtual work Q_j = 0, without constraint forces; with closures f + Σ λ ∇φ = 0 and φ = 0. Forces
with a kink or a jump, as of ``abs`` and ``sign``, have no derivatives where they change sides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_functions import RestFunctions, exact_value
from lagrange_cli.analysis.equilibria.state_coordinates import with_state_coordinates
from lagrange_cli.analysis.values import DIGITS, Mpf
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import has_value, is_periodic
from lagrange_cli.mechanics.free_symbols import is_open, require_given, symbols_in
from lagrange_cli.mechanics.kinks import JUMPING, KINKED, sides_of, surfaces_of
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.zero_test import does_not_depend
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.symbols.inputs import with_symbols_of_inputs
from lagrange_cli.phrases import Phrase

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Equilibrium
    from lagrange_cli.mechanics.equations import Equations


#: Coordinates and closures beyond which nothing is analyzed. Matrices are dense.
MOST_UNKNOWNS = 160

#: Further digits in which closed forms are evaluated, and a bound of errors that decimals cause.
_GUARD, _HALF_OF_DECIMALS = 60, 1e-15

_ZERO = sp.S.Zero

#: Size of an argument of these that is zero: a configuration is known to 30 digits.
_NOTHING = mpf(10) ** -12


@dataclass(frozen=True)
class RestSystem:
    """Forces and constraints at rest.

    Attributes
    ----------
    equations
        The equations of motion.
    forces
        f + Σ λ ∇φ at v = 0, one a coordinate.
    constraints
        φ and ψ at v = 0, one a closure.
    known
        Values of parameters that have one, and of inputs.
    inputs
        Values of inputs at rest, over the parameters.
    held_inputs
        Inputs that vary with time and states with two values, with what they are held at.
    free
        Numbers of the coordinates that neither forces nor constraints depend on.
    free_to_give
        Names of the parameters that ``--at`` gives, momenta and rates, which no scene declares.
    states
        Names of the coordinates that are states of first order; they are the last.
    shared
        The functions of the same system with other values of parameters, None if there are none.
    """

    equations: Equations
    forces: tuple[sp.Expr, ...]
    constraints: tuple[sp.Expr, ...]
    known: Mapping[sp.Symbol, Mpf]
    inputs: Mapping[sp.Symbol, sp.Expr]
    held_inputs: tuple[tuple[str, float], ...]
    free: tuple[int, ...]
    free_to_give: frozenset[str] = frozenset()
    states: tuple[str, ...] = ()
    shared: RestFunctions | None = None

    @property
    def moving(self) -> int:
        """Number of the coordinates that are no states of first order."""
        return len(self.equations.system.coordinates) - len(self.states)

    @property
    def unknowns(self) -> tuple[sp.Symbol, ...]:
        """The coordinates that are sought, then multipliers."""
        coordinates = self.equations.system.coordinates
        sought = (c.q for k, c in enumerate(coordinates) if k not in self.free)
        return (*sought, *(c.multiplier for c in self.equations.system.closures))

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of parameters without a value."""
        unused = self.equations.derivation.facts.unused_parameters
        return tuple(
            p.name
            for p in self.equations.system.parameters
            if p.symbol not in self.known and p.name not in unused
        )

    @property
    def sought(self) -> str:
        """Return the name of a solution."""
        return "steady motion" if self.free_to_give else "equilibrium"

    def require_values(self) -> None:
        """Refuse parameters without a value.

        Raises
        ------
        InputError
            Some have none.
        """
        if self.missing:
            names = ", ".join(f"'{name}'" for name in self.missing)
            options = self.free_to_give
            hint = " ".join(
                f"--at {name}=1" if name in options else f"-p {name}=1" for name in self.missing
            )
            message = Phrase("no value for {names}", names=names)
            raise InputError(Problem(message, hint=hint, rule="no-value"))

    def allows(self, position: Sequence[Mpf]) -> bool:
        """Say whether coordinates that the scene declares positive are positive."""
        pairs = zip(self.equations.system.coordinates, position, strict=True)
        return all(x > 0 for c, x in pairs if c.q.is_positive)

    @cached_property
    def kinks(self) -> list[tuple[sp.Expr, sp.Expr]]:
        """Forces, each with a function in it that has a kink or jumps."""
        return [(f, atom) for f in self.equations.system.forcing for atom in f.atoms(*KINKED)]

    @cached_property
    def periodic(self) -> frozenset[int]:
        """Numbers of the angles whose values a turn apart give the same equations of motion."""
        system = self.equations.system
        masses = [e for row in system.mass_matrix for e in entries(row).values()]
        everything = (*self.forces, *self.constraints, *system.forcing, *masses)
        return frozenset(
            k
            for k, c in enumerate(self.equations.system.coordinates)
            if c.is_angle and all(is_periodic(e, c.q) for e in everything if e.has(c.q))
        )

    @property
    def jumps(self) -> bool:
        """True if forces jump somewhere, as dry friction does at rest.

        There they have any value between both sides, which may balance other forces.
        """
        return any(e.atoms(*JUMPING) for e in self.equations.system.forcing)

    @cached_property
    def functions(self) -> RestFunctions:
        """Forces and constraints as functions of numbers."""
        if self.shared is not None:
            return self.shared.with_values(self.known)
        return RestFunctions(self.equations, self.known)

    @cached_property
    def exact_known(self) -> Mapping[sp.Symbol, sp.Expr]:
        """Values of parameters, and of inputs, of which the exact number is known."""
        exact_numbers = {p.symbol: p.exact for p in self.equations.system.parameters}
        with mpmath.workdps(DIGITS):
            exact = {s: exact_value(x, exact_numbers.get(s)) for s, x in self.known.items()}
        return {s: x for s, x in exact.items() if x is not None}

    def numbers(self, expressions: Sequence[sp.Expr]) -> tuple[list[Mpf], float]:
        """Evaluate expressions over parameters, and coordinates at the start.

        Returns them with a bound of their errors, relative to 1 and to each: rounded values of
        parameters cost the root of an angle or of a difference half of its digits.

        Raises
        ------
        DomainError
            They have no values.
        """
        coordinates = self.equations.system.coordinates
        start = {c.q: x for c, x in zip(coordinates, self.start, strict=True)}
        exact = [e.xreplace(self.exact_known) for e in expressions]
        with mpmath.workdps(DIGITS + _GUARD):
            if all(e.free_symbols <= start.keys() for e in exact):
                return evaluate(exact, start), 10.0**-DIGITS
            return evaluate(expressions, {**self.known, **start}), _HALF_OF_DECIMALS

    def with_parameters(self, values: Mapping[sp.Symbol, Mpf]) -> RestSystem:
        """Return the same system with other values of parameters."""
        with mpmath.workdps(DIGITS):
            known = {**self.known, **values}
            places = {s: known[s] for s in known if s not in self.inputs}
            known |= {
                u: evaluate([value], places)[0]
                for u, value in self.inputs.items()
                if _is_known(value, places)
            }
        return replace(self, known=known, shared=self.functions)

    @cached_property
    def start(self) -> tuple[Mpf, ...]:
        """The initial configuration, zeros if the scene has none."""
        initial, n = self.equations.system.initial, len(self.equations.system.coordinates)
        if initial is None:
            return (mpf(0),) * n
        with mpmath.workdps(DIGITS):
            return tuple(map(mpf, (initial.decimals or initial.positions)[:n]))


def rest_system(equations: Equations, held_inputs: Mapping[str, sp.Expr]) -> RestSystem:
    """Write the equations of equilibrium.

    Parameters
    ----------
    equations
        The equations of motion.
    held_inputs
        Values of inputs that are held, over the parameters. Other inputs have their own value, or 0
        if they vary with time.

    Raises
    ------
    InputError
        There is no rest to speak of: the equations depend on time, hold unknown functions or
        one-sided constraints, or are too many.
    """
    states = tuple(s.name for s in equations.system.states if s.switch is None)
    switches = {s.name for s in equations.system.switches}
    equations = with_state_coordinates(equations)
    _require_small(equations)
    equations = with_symbols_of_inputs(equations)
    own_values = {u.name: u.expression for u in equations.system.inputs}
    for rate in (u for u in equations.system.inputs if u.order):
        # Where inputs are held, their rates are 0; those of positions have their first value.
        own_values[rate.name], expression = _ZERO, own_values[rate.base]
        if expression is not None:
            own_values[rate.base] = expression.xreplace({equations.system.t: _ZERO})
    inputs = {
        u.symbol: _input_value(own_values[u.name], held_inputs.get(u.name), equations.system.t)
        for u in equations.system.inputs
    }
    # The graph is differentiated by inputs; here each has its value.
    values_at_rest = {c.v: _ZERO for c in equations.system.coordinates} | inputs
    forces = list(equations.system.forcing)
    for closure in equations.system.closures:
        for j, entry in entries(closure.gradient).items():
            forces[j] += closure.multiplier * entry
    stills = tuple(e.xreplace(values_at_rest) for e in forces)
    constraints = tuple(c.expression.xreplace(values_at_rest) for c in equations.system.closures)
    _require_values_at_rest(equations, (*stills, *constraints))
    _require_autonomous(equations, (*stills, *constraints))
    with mpmath.workdps(DIGITS):
        known = parameter_values(equations)
    values = known | {
        u: mpf(sp.N(value.subs(known), DIGITS))
        for u, value in inputs.items()
        if _is_known(value, known)
    }
    varying = [
        (u.name, float(values[u.symbol]))
        for u in equations.system.inputs
        if u.name in switches | held_inputs.keys()
        or u.expression is None
        or equations.system.t in u.expression.free_symbols
    ]
    system = RestSystem(equations, stills, constraints, values, inputs, tuple(varying), ())
    return replace(system, free=_free(system), states=states)


def parameter_values(equations: Equations) -> dict[sp.Symbol, Mpf]:
    """Return the values of the parameters that have one, in the digits that are set."""
    return {
        p.symbol: mpf(p.decimal or p.value)
        for p in equations.system.parameters
        if p.value is not None
    }


def _free(system: RestSystem) -> tuple[int, ...]:
    """Find the coordinates that neither forces nor constraints depend on."""
    everything = (*system.forces, *system.constraints)
    coordinates = system.equations.system.coordinates
    place = {c.q: x for c, x in zip(coordinates, system.start, strict=True)}
    point = {
        **system.known,
        **place,
        **{c.multiplier: mpf(1) for c in system.equations.system.closures},
    }
    return tuple(
        k
        for k, c in enumerate(coordinates)
        if not _is_seen(everything, c.q, point) and all(does_not_depend(e, c.q) for e in everything)
    )


def _is_seen(
    expressions: Sequence[sp.Expr], symbol: sp.Symbol, point: Mapping[sp.Symbol, Mpf]
) -> bool:
    """Say whether a value changes with a symbol at one point: that saves a long proof."""
    present = [e for e in expressions if symbol in symbols_in(e)]
    if not all(symbols_in(e) <= point.keys() for e in present):
        return False
    try:
        before = evaluate(present, point)
        after = evaluate(present, {**point, symbol: point[symbol] + mpf("0.37")})
    except DomainError:
        return False
    pairs = zip(before, after, strict=True)
    return any(abs(a - b) > mpf(10) ** -6 * (abs(a) + abs(b)) for a, b in pairs)


def _is_known(value: sp.Expr, known: Mapping[sp.Symbol, Mpf]) -> bool:
    return bool(value.free_symbols <= known.keys())


def _input_value(expression: sp.Expr | None, held_value: sp.Expr | None, t: sp.Symbol) -> sp.Expr:
    """Return the value of an input at rest: the held one, else its own constant, else 0."""
    if held_value is not None:
        return held_value
    if expression is None or t in expression.free_symbols:
        return _ZERO
    return expression


def _require_small(equations: Equations) -> None:
    require_given(equations.system.functions)
    size = len(equations.system.coordinates) + len(equations.system.closures)
    if equations.system.contacts:
        names = ", ".join(f"'{c.name}'" for c in equations.system.contacts)
        message = Phrase(
            "equilibria are not sought where one-sided constraints ({names}) may push", names=names
        )
        raise InputError(
            Problem(message, equations.system.contacts[0].closure.mark, rule="analysis-contacts")
        )
    if size > MOST_UNKNOWNS:
        message = Phrase(
            "{count} coordinates and multipliers are more than the {most} analyzed",
            count=str(size),
            most=str(MOST_UNKNOWNS),
        )
        raise InputError(Problem(message, rule="analysis-size"))
    if not equations.system.coordinates:
        raise InputError(Problem(Phrase("nothing can move"), rule="analysis-size"))


def _require_values_at_rest(equations: Equations, at_rest: Sequence[sp.Expr]) -> None:
    """Refuse forces that have no value where nothing moves, as y/ẏ."""
    for k, expression in enumerate(at_rest):
        if not has_value(expression):
            coordinates = equations.system.coordinates
            raise no_value_at_rest(coordinates[k].mark if k < len(coordinates) else None)


def no_value_at_rest(mark: Mark | None) -> InputError:
    """The refusal of a force or constraint that has no value where nothing moves."""
    message = Phrase("a force or constraint has no value at rest")
    return InputError(Problem(message, mark, rule="analysis-rest"))


def _require_autonomous(equations: Equations, at_rest: tuple[sp.Expr, ...]) -> None:
    """Refuse equations that depend on time."""
    others = [e for row in equations.system.mass_matrix for e in entries(row).values()]
    for closure in equations.system.closures:
        others += [*entries(closure.gradient).values(), closure.expression]
    everything = [*at_rest, *equations.system.forcing, *others]
    if any(any(map(is_open, e.atoms(sp.Function))) for e in everything):
        raise InputError(Problem(Phrase("a function is not given"), rule="unknown-function"))
    timed = [e for e in everything if equations.system.t in symbols_in(e)]
    if not all(does_not_depend(e, equations.system.t) for e in timed):
        message = Phrase("nothing stays at rest: the equations depend on {time}", time=("t",))
        hint = "only inputs can be held, with --at NAME=VALUE"
        raise InputError(Problem(message, hint=hint, rule="analysis-time"))


def kinks_at(system: RestSystem, at: Equilibrium) -> list[tuple[sp.Expr, sp.Expr]]:
    """List forces, each with a function in it whose kink or jump is at this equilibrium or at rest.

    Each with that function.
    """
    place = _place(system, at)
    return [(force, atom) for force, atom in system.kinks if _changes(system, atom, place)]


def has_derivatives(system: RestSystem, at: Equilibrium) -> bool:
    """Tell whether forces and their first derivatives agree on both sides of all kinks.

    They are of a drag c |v| v; they are not of dry friction.
    """
    place = _place(system, at)
    state = [s for c in system.equations.system.coordinates for s in (c.q, c.v)]
    for force, atom in kinks_at(system, at):
        first, second = (force.xreplace({atom: side}) for side in sides_of(atom))
        difference = sp.Add(first, -second)
        slopes = (derivative(difference, s) for s in state if s in difference.free_symbols)
        try:
            with mpmath.workdps(DIGITS):
                values = evaluate([difference, *slopes], place)
        except DomainError:
            return False
        if any(abs(x) > _NOTHING for x in values):
            return False
    return True


def _place(system: RestSystem, at: Equilibrium) -> dict[sp.Symbol, Mpf]:
    coordinates = system.equations.system.coordinates
    place = dict(zip((c.q for c in coordinates), at.position or (), strict=False))
    return place | {c.v: mpf(0) for c in coordinates} | dict(system.known)


def _changes(system: RestSystem, atom: sp.Expr, place: dict[sp.Symbol, Mpf]) -> bool:
    moving = atom.free_symbols - system.known.keys()
    if not any(s in place for s in moving):
        return False
    surfaces = tuple(surfaces_of(atom))
    with mpmath.workdps(DIGITS):
        try:
            return any(abs(x) < _NOTHING for x in evaluate(surfaces, place))
        except DomainError:
            return True
