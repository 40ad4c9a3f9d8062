"""Steady motions of systems with constraints between velocities: circles of wheels and disks.

Voronets' equations are over independent velocities. Where they do not hold some of the coordinates,
these turn at constant rates Ω while the others rest, if all forces h(q, u = Ω) vanish: a family of
motions, with as many parameters as there are such rates, since no momentum selects one
(E. J. Routh, Dynamics of a System of Rigid Bodies, Advanced Part, 6th ed., 1905, chapter 5; J. I.
Neimark and N. A. Fufaev, Dynamics of Nonholonomic Systems, 1972, chapter 5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_system import RestSystem, rest_system
from lagrange_cli.analysis.equilibria.steady import SteadyForm, given_parameter, initial_of
from lagrange_cli.analysis.forms.voronets import VoronetsForm, voronets_form
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Mpf, Turning
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import factored_form
from lagrange_cli.mechanics.proofs.zero_test import vanish
from lagrange_cli.mechanics.sparse import ExpressionRow

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.configuration import Configuration
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate, Parameter


@dataclass(frozen=True)
class SteadyRates:
    """The equations of steady motion at given rates of the ignored coordinates.

    Attributes
    ----------
    form
        The equations over the deviations from the steady motion, and the rates.
    sought
        The system whose equilibria are sought: a deviation that rests is a steady motion.
    written
        Voronets' equations.
    """

    form: SteadyForm
    sought: RestSystem
    written: VoronetsForm

    def system_at(self, _: Equilibrium) -> RestSystem:
        """Return the system that is linearized."""
        return self.sought

    def completed(self, points: Sequence[Equilibrium]) -> list[Equilibrium]:
        """Add the rates to steady motions."""
        symbols = [symbol for symbol, _ in self.form.given_values]
        known = [self.sought.known.get(s) for s in symbols]
        numbers = None if None in known else tuple(known)
        turning = Turning((), numbers, (), tuple(symbols))
        return [replace(point, turning=turning) for point in points]

    @cached_property
    def is_family(self) -> bool:
        """True if it is proven that any rates leave ignored coordinates without acceleration."""
        still = dict.fromkeys((c.v for c in self._resting), sp.S.Zero)
        return all(vanish(force.xreplace(still)) for force in self._ignored_forces)

    @cached_property
    def is_along_one_coordinate(self) -> bool:
        """True if it is proven that the rates are functions of one coordinate along each motion.

        With u̇ = ṙ (A(r) u + a(r)) they solve a linear equation over r, so that motions have as many
        integrals; at the values of these r̈ = F(r) + B(r) ṙ², which has an energy.
        """
        if len(self._resting) != 1:
            return False
        (r,) = self._resting
        place = self.written.coordinates.index(r)
        row, force = self.written.mass_matrix[place], self.written.forcing[place]
        cubic = derivative(derivative(derivative(force, r.v), r.v), r.v)
        backward = force.xreplace({r.v: -r.v})
        if not vanish(*row[:place], *row[place + 1 :], force - backward, cubic):
            return False
        rates = [c.v for c in self.written.ignored]
        for ignored in self._ignored_forces:
            slope = derivative(ignored, r.v)
            bends = [derivative(derivative(slope, a), b) for a in rates for b in rates]
            if not vanish(ignored - slope * r.v, *bends):
                return False
        return True

    @property
    def _resting(self) -> list[Coordinate]:
        return [c for c in self.written.coordinates if c not in self.written.ignored]

    @property
    def _ignored_forces(self) -> list[sp.Expr]:
        pairs = zip(self.written.coordinates, self.written.forcing, strict=True)
        return [force for c, force in pairs if c in self.written.ignored]


def steady_rates(equations: Equations, configuration: Configuration) -> SteadyRates:
    """Write the equations of steady motion at the rates that are given.

    Ignored coordinates without a given rate have that of the initial state.

    Raises
    ------
    InputError
        Independent velocities are not found, no coordinate can be ignored, none is left, or a rate
        is given of one that is not ignored.
    """
    written = voronets_form(equations)
    if not written.ignored:
        message = "no coordinate is free of forces and constraints: nothing is steady"
        raise InputError(Problem(message, rule="analysis-steady"))
    if len(written.ignored) == len(written.coordinates):
        message = "every motion is steady: all coordinates are ignored"
        raise InputError(Problem(message, rule="analysis-steady"))
    _require_ignored(written, configuration)
    values = {c.v: _rate(equations, c, configuration) for c in written.ignored}
    parameters = [given_parameter(symbol, value) for symbol, value in values.items()]
    deviations = _deviations(equations, written, parameters)
    asked = rest_system(deviations, configuration.held_inputs)
    sought = replace(
        asked,
        # Bodies are placed by coordinates that no equation holds.
        known={**asked.known, **{c.q: mpf(0) for c in written.dependent}},
        free_to_give=frozenset(symbol.name for symbol in values),
    )
    given_values = tuple((s, None if x is None else float(x)) for s, x in values.items())
    form = SteadyForm(deviations, written.ignored, (), given_values, _conditions(written, sought))
    return SteadyRates(form, sought, written)


def _require_ignored(written: VoronetsForm, configuration: Configuration) -> None:
    names = {f"dot({c.name})": c.name for c in written.ignored}
    for name in configuration.turning:
        if name not in names:
            ignored = ", ".join(names.values())
            message = f"only rates of {ignored} are given to a steady motion"
            raise InputError(Problem(message, configuration.marks[name], rule="analysis-steady"))


def _rate(equations: Equations, c: Coordinate, configuration: Configuration) -> Mpf | None:
    """Return the given rate of a coordinate, else that of the initial state, or None."""
    rate = configuration.turning.get(f"dot({c.name})")
    initial, coordinates = equations.system.initial, equations.system.coordinates
    if rate is not None or initial is None:
        return rate
    place, n = coordinates.index(c), len(coordinates)
    with mpmath.workdps(DIGITS):
        return mpf(initial.decimals[n + place] if initial.decimals else initial.velocities[place])


def _deviations(
    equations: Equations, written: VoronetsForm, parameters: Sequence[Parameter]
) -> Equations:
    """Write the equations of deviations from motions at constant rates, which are parameters."""
    coordinates = [
        replace(c, v=sp.Dummy(c.v.name, real=True)) if c in written.ignored else c
        for c in written.coordinates
    ]
    turning = {
        c.v: c.v + deviation.v
        for c, deviation in zip(written.coordinates, coordinates, strict=True)
        if deviation.v != c.v
    }
    resting = {c.q for c in written.coordinates if c not in written.ignored}
    positions = {c.q for c in equations.system.coordinates} - resting
    velocities = {c.v: v for c, v in zip(written.dependent, written.velocities, strict=True)}
    outputs = ((name, e.xreplace(velocities)) for name, e in equations.system.outputs)
    system = replace(
        equations.system,
        coordinates=tuple(coordinates),
        parameters=(*equations.system.parameters, *parameters),
        mass_matrix=tuple(ExpressionRow(len(r), dict(enumerate(r))) for r in written.mass_matrix),
        forcing=tuple(f.xreplace(turning) for f in written.forcing),
        closures=(),
        initial=initial_of(equations, [c.name for c in coordinates]),
        outputs=tuple(
            (name, e.xreplace(turning)) for name, e in outputs if not e.free_symbols & positions
        ),
    )
    derivation = replace(equations.derivation, cyclic=(), conserved=())
    return replace(equations, system=system, derivation=derivation)


def _conditions(written: VoronetsForm, system: RestSystem) -> tuple[sp.Expr, ...]:
    """Write the forces h(q, u = Ω) that vanish in steady motions, without factors that do not."""
    still = {c.v: sp.S.Zero for c in written.coordinates if c not in written.ignored}
    nonzero = {s for s, x in system.known.items() if x != 0} - {c.v for c in written.ignored}
    conditions = []
    for force in written.forcing:
        whole = sp.numer(factored_form(force.xreplace(still).xreplace(dict(system.inputs))))
        if whole != 0:
            factors = (f for f in sp.Mul.make_args(whole) if f.as_base_exp()[0] not in nonzero)
            _, shorter = sp.Mul(*factors).as_coeff_Mul()
            conditions.append(-shorter if shorter.could_extract_minus_sign() else shorter)
    return tuple(conditions)
