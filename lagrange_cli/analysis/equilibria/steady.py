"""Steady motions: ignored coordinates turn uniformly while the others rest.

At given momenta of the ignored coordinates these are equilibria of Routh's equations, stationary
points of V_eff (E. J. Routh, A Treatise on the Stability of a Given State of Motion, 1877; J. E.
Marsden, Lectures on Mechanics, 1992, chapter 5). At given rates Ω they are zeros of the forces
f(q, v = Ω) of the other coordinates; each has momenta of its own, at which it is linearized.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.configuration import Configuration
from lagrange_cli.analysis.equilibria.repeats import is_turned
from lagrange_cli.analysis.equilibria.rest_system import RestSystem, parameter_values, rest_system
from lagrange_cli.analysis.forms.momenta import Momentum, momentum_letter
from lagrange_cli.analysis.forms.routhian import Routhian, ignorable, routhian_form
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Mpf, Turning
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.system import Coordinate, InitialState, Parameter

#: Part of the usual inertia below which inertia is rounding.
_WITHOUT_INERTIA = mpf(10) ** -25

#: Ignored angles whose half turns are tried when motions are compared.
_TURNED = 3


@dataclass(frozen=True)
class SteadyForm:
    """The reduced system whose equilibria are steady motions.

    Attributes
    ----------
    equations
        Routh's equations of the coordinates that rest, the momenta being parameters; or Voronets'
        equations of deviations, which hold ignored coordinates beside those that rest.
    ignored
        The ignored coordinates, which turn.
    momenta
        Their momenta; none where these are not conserved.
    given_values
        For each of these the symbol of the momentum or rate that was given, and its value, None if
        that is not known.
    conditions
        What vanishes in a steady motion, over rates: a force on each coordinate that rests, times
        what it is divided by. None where constraints exert further ones.
    """

    equations: Equations
    ignored: tuple[Coordinate, ...]
    momenta: tuple[Momentum, ...]
    given_values: tuple[tuple[sp.Symbol, float | None], ...]
    conditions: tuple[sp.Expr, ...] = ()

    @property
    def resting(self) -> list[int]:
        """Numbers of the coordinates of the equations that rest."""
        names = {c.name for c in self.ignored}
        coordinates = enumerate(self.equations.system.coordinates)
        return [k for k, c in coordinates if c.name not in names]


@dataclass(frozen=True)
class SteadySystem:
    """The equations of steady motion.

    Attributes
    ----------
    form
        The reduced equations, and the given values of the ignored coordinates.
    sought
        The system whose equilibria are sought, over the given values.
    reduced
        Routh's equations over the momenta.
    turning
        Momenta and rates over the coordinates that rest and the given values.
    inertia
        The block of M of the ignored coordinates, over the others.
    """

    form: SteadyForm
    sought: RestSystem
    reduced: RestSystem
    turning: tuple[tuple[sp.Expr, sp.Expr], ...]
    inertia: sp.Matrix

    def system_at(self, point: Equilibrium) -> RestSystem:
        """Return Routh's equations at the momenta of a steady motion.

        Raises
        ------
        InputError
            A momentum does not determine the rate there: the coordinates are singular.
        """
        turning = point.turning
        if turning is None or turning.momenta is None or point.position is None:
            return self.reduced
        self._require_regular(point.position)
        symbols = [m.symbol for m in self.form.momenta]
        known = {**self.reduced.known, **self.sought.known}
        known |= dict(zip(symbols, turning.momenta, strict=True))
        given_symbols = {symbol for symbol, _ in self.form.given_values}
        momenta = zip(symbols, (momentum for momentum, _ in self.turning), strict=True)
        over_rates = {symbol: value for symbol, value in momenta if symbol not in given_symbols}
        return replace(self.reduced, known=known, inputs={**self.reduced.inputs, **over_rates})

    def _require_regular(self, position: Sequence[Mpf]) -> None:
        usual = self._inertia_at(self.sought.start)
        here = self._inertia_at(position)
        sizes = [max(map(abs, row)) for row in here.tolist()]
        most = [max(map(abs, row)) for row in usual.tolist()]
        idle = [k for k, size in enumerate(sizes) if size <= _WITHOUT_INERTIA * most[k]]
        if not idle and abs(mpmath.det(here)) > _WITHOUT_INERTIA * mpmath.fprod(sizes):
            return
        turned = [m.coordinate for m in self.form.momenta]
        named = [turned[k] for k in idle] or turned
        names = ", ".join(f"'{c.name}'" for c in named)
        message = f"coordinates are singular there: no inertia goes with a rate of {names}"
        raise InputError(Problem(message, named[0].mark, rule="analysis-singular"))

    def _inertia_at(self, position: Sequence[Mpf]) -> mpmath.matrix:
        n = self.inertia.rows
        place = {
            c.q: x for c, x in zip(self.form.equations.system.coordinates, position, strict=True)
        }
        with mpmath.workdps(DIGITS):
            try:
                numbers = evaluate(list(self.inertia), {**self.sought.known, **place})
            except DomainError:
                return mpmath.zeros(n, n)
            return mpmath.matrix([numbers[k * n : (k + 1) * n] for k in range(n)])

    def completed(self, points: Sequence[Equilibrium]) -> list[Equilibrium]:
        """Add momenta and rates to steady motions, and drop those that differ by half turns."""
        coordinates = self.form.equations.system.coordinates
        turned = [m.coordinate.q for m in self.form.momenta if m.coordinate.is_angle][:_TURNED]
        # (r, θ) and (−r, θ + π) are one motion: any value of θ is passed.
        angles = [
            dict(zip(turned, x, strict=True)) for x in product((0, mpmath.pi), repeat=len(turned))
        ]
        distinct: list[Equilibrium] = []
        for point in points:
            if not any(
                is_turned(self.sought, known, point, a) for known in distinct for a in angles[1:]
            ):
                distinct.append(point)
        symbols = [c.q for c in coordinates]
        return [replace(p, turning=self._turning(p, symbols)) for p in distinct]

    def _turning(self, point: Equilibrium, symbols: Sequence[sp.Symbol]) -> Turning:
        """Evaluate momenta and rates; they are unknown where coordinates are singular."""
        flat = [e for pair in self.turning for e in pair]
        exact = numbers = None
        if point.exact is not None:
            place = dict(zip(symbols, point.exact, strict=True))
            exact = [factored_form(cancelled(e.xreplace(place))) for e in flat]
            if not all(map(has_value, exact)):
                exact = None
        if point.position is not None and not self.sought.missing:
            place = dict(zip(symbols, point.position, strict=True))
            with mpmath.workdps(DIGITS):
                try:
                    numbers = evaluate(flat, {**self.sought.known, **place})
                except DomainError:
                    numbers = None
        return Turning(
            None if numbers is None else tuple(numbers[::2]),
            None if numbers is None else tuple(numbers[1::2]),
            None if exact is None else tuple(exact[::2]),
            None if exact is None else tuple(exact[1::2]),
        )


def turns_by_rates(equations: Equations) -> bool:
    """Tell whether steady motions have given rates since constraints between velocities act.

    They have given momenta where these are conserved, as those of coordinates that no constraint
    holds.
    """
    differential = [c for c in equations.system.closures if c.kind == "velocity"]
    ignored = {equations.system.coordinates[j].q for j in ignorable(equations)}
    seen = any(ignored & c.expression.free_symbols for c in differential)
    return bool(differential) and (not ignored or seen)


def turning_names(equations: Equations) -> list[str]:
    """List the names of momenta and rates that ``--at`` may give."""
    if turns_by_rates(equations):
        return [f"dot({c.name})" for c in equations.system.coordinates]
    letter = momentum_letter(equations)
    names = [equations.system.coordinates[j].name for j in ignorable(equations)]
    return [*(f"{letter}_{name}" for name in names), *(f"dot({name})" for name in names)]


def steady_system(equations: Equations, configuration: Configuration) -> SteadySystem:
    """Write the equations of steady motion at the momenta or rates that are given.

    Ignored coordinates without a given momentum or rate have the momenta of the initial state.

    Raises
    ------
    InputError
        There is no coordinate to ignore, none is left, one stands in the force on another, or a
        momentum and its rate are both given.
    """
    form = routhian_form(equations)
    if not form.coordinates:
        message = "every motion is steady: all coordinates are cyclic"
        raise InputError(Problem(message, rule="analysis-steady"))
    _require_unseen(form)
    at_rate = [m for m in form.momenta if _is_rate(m, configuration)]
    starts = dict(zip((m.name for m in form.momenta), _at_start(equations, form), strict=True))
    values = {
        m.name: configuration.turning.get(f"dot({m.coordinate.name})")
        if m in at_rate
        else configuration.turning.get(m.name, starts[m.name])
        for m in form.momenta
    }
    ruled = [m.coordinate.v if m in at_rate else m.symbol for m in form.momenta]
    parameters = [
        given_parameter(symbol, values[m.name])
        for symbol, m in zip(ruled, form.momenta, strict=True)
    ]
    partial = _partial(equations, form, at_rate)
    momenta = [given_parameter(m.symbol, None) for m in form.momenta]
    reduced = _over(equations, form, momenta, form)
    sought = _over(equations, form, parameters, partial)
    given_values = tuple(
        (symbol, None if (x := values[m.name]) is None else float(x))
        for symbol, m in zip(ruled, form.momenta, strict=True)
    )
    ignored = ignorable(equations)
    asked = rest_system(sought, configuration.held_inputs)
    turned = tuple(m.coordinate for m in form.momenta)
    return SteadySystem(
        SteadyForm(reduced, turned, form.momenta, given_values, _conditions(equations, form)),
        replace(
            asked,
            known={**asked.known, **{c.q: mpf(0) for c in turned}},
            free_to_give=frozenset(symbol.name for symbol in ruled),
        ),
        rest_system(reduced, configuration.held_inputs),
        _turning_of(form, partial, at_rate),
        sp.Matrix([[equations.system.mass_matrix[i][j] for j in ignored] for i in ignored]),
    )


def _conditions(equations: Equations, form: Routhian) -> tuple[sp.Expr, ...]:
    """Write the forces f(q, v = Ω) on the coordinates that rest, without zeros."""
    system = equations.system
    if system.closures:
        return ()
    resting = {c.name for c in form.coordinates}
    still = {c.v: sp.S.Zero for c in system.coordinates if c.name in resting}
    forces = (
        sp.numer(factored_form(f.xreplace(still)))
        for c, f in zip(system.coordinates, system.forcing, strict=True)
        if c.name in resting
    )
    return tuple(-f if f.could_extract_minus_sign() else f for f in forces if f != 0)


def _require_unseen(form: Routhian) -> None:
    """Refuse forces that turn with an ignored coordinate."""
    for turned in (m.coordinate for m in form.momenta):
        for coordinate, force in zip(form.coordinates, form.forcing, strict=True):
            if turned.q in force.free_symbols:
                where = f"the force on '{coordinate.name}'"
                message = f"'{turned.name}' turns in {where}: nothing is steady"
                raise InputError(Problem(message, coordinate.mark, rule="analysis-steady"))


def _is_rate(momentum: Momentum, configuration: Configuration) -> bool:
    rate = f"dot({momentum.coordinate.name})"
    if rate in configuration.turning and momentum.name in configuration.turning:
        message = f"'{momentum.name}' and '{rate}' are both given"
        raise InputError(Problem(message, configuration.marks[rate], rule="analysis-steady"))
    return rate in configuration.turning


def _at_start(equations: Equations, form: Routhian) -> list[Mpf | None]:
    """Evaluate the momenta of the initial state; None where they have no value."""
    initial = equations.system.initial
    if initial is None:
        return [None] * len(form.momenta)
    symbols = [
        *(c.q for c in equations.system.coordinates),
        *(c.v for c in equations.system.coordinates),
    ]
    state = (*initial.positions, *initial.velocities)
    numbers = initial.decimals or tuple(map(repr, state))
    with mpmath.workdps(DIGITS):
        place = {equations.system.t: mpf(equations.system.simulate.start)}
        place |= {s: mpf(x) for s, x in zip(symbols, numbers, strict=False)}
        place |= parameter_values(equations)
        try:
            return list(evaluate([m.expression for m in form.momenta], place))
        except (DomainError, KeyError):
            return [None] * len(form.momenta)


def given_parameter(symbol: sp.Symbol, value: Mpf | None) -> Parameter:
    """Return the parameter that stands for a given momentum or rate."""
    if value is None:
        return Parameter(symbol.name, symbol)
    return Parameter(symbol.name, symbol, float(value), decimal=mpmath.nstr(value, 45))


def _partial(equations: Equations, form: Routhian, at_rate: Sequence[Momentum]) -> Routhian | None:
    """Ignore only the coordinates whose momenta are given; None if there are none."""
    if not at_rate:
        return form
    rates = {m.coordinate.name for m in at_rate}
    numbers = [j for j in ignorable(equations) if equations.system.coordinates[j].name not in rates]
    return routhian_form(equations, numbers) if numbers else None


def _over(
    equations: Equations,
    form: Routhian,
    further: Sequence[Parameter],
    source: Routhian | None,
) -> Equations:
    """Write the equations of the remaining coordinates, with the forces of a reduction.

    Parameters
    ----------
    further
        Parameters beside those of the scene: momenta and rates.
    source
        The reduction whose forces are taken; None for the equations themselves.
    """
    names = [c.name for c in form.coordinates]
    coordinates, forcing, closures = (
        equations.system.coordinates,
        equations.system.forcing,
        equations.system.closures,
    )
    if source is not None:
        coordinates, forcing, closures = source.coordinates, source.forcing, source.closures
    places = {c.name: k for k, c in enumerate(coordinates)}
    rows = [places[name] for name in names]
    numbers = {row: k for k, row in enumerate(rows)}
    turns = {m.coordinate.q for m in form.momenta}
    rates = {m.coordinate.v: v for m, v in zip(form.momenta, form.velocities, strict=True)}
    cyclic = tuple(name for name in equations.derivation.cyclic if name in names)
    system = replace(
        equations.system,
        parameters=(*equations.system.parameters, *further),
        coordinates=form.coordinates,
        mass_matrix=form.mass_matrix,
        forcing=tuple(forcing[row] for row in rows),
        closures=tuple(
            replace(
                c,
                gradient=ExpressionRow(
                    len(rows), {numbers[j]: e for j, e in entries(c.gradient).items()}
                ),
            )
            for c in closures[: len(equations.system.closures)]
        ),
        initial=initial_of(equations, names),
        outputs=tuple(
            (name, e.xreplace(rates))
            for name, e in equations.system.outputs
            if not e.free_symbols & turns
        ),
    )
    derivation = replace(equations.derivation, cyclic=cyclic)
    return replace(equations, system=system, derivation=derivation)


def initial_of(equations: Equations, names: Sequence[str]) -> InitialState | None:
    """Return the initial state of some coordinates alone."""
    initial, n = equations.system.initial, len(equations.system.coordinates)
    if initial is None:
        return None
    left = [k for k, c in enumerate(equations.system.coordinates) if c.name in names]
    decimals = initial.decimals
    return replace(
        initial,
        positions=tuple(initial.positions[k] for k in left),
        velocities=tuple(initial.velocities[k] for k in left),
        decimals=tuple(decimals[k] for k in [*left, *(n + k for k in left)]) if decimals else (),
    )


def _turning_of(
    form: Routhian, partial: Routhian | None, at_rate: Sequence[Momentum]
) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
    """Write momentum and rate of each ignored coordinate over the given values."""
    still = dict.fromkeys((c.v for c in form.coordinates), sp.S.Zero)
    solved = {}
    if partial is not None:
        pairs = zip(partial.momenta, partial.velocities, strict=True)
        solved = {m.coordinate.v: v.xreplace(still) for m, v in pairs}
    turning = []
    for m in form.momenta:
        rate = solved.get(m.coordinate.v, m.coordinate.v)
        momentum = m.expression.xreplace(still).xreplace(solved) if m in at_rate else m.symbol
        turning.append((momentum, rate))
    return tuple(turning)
