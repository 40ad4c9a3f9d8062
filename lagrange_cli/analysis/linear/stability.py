"""Stability of equilibria, as far as a theorem proves it.

Lagrange and Dirichlet: where a conserved energy T₂ + W(q) has a strict minimum of W, the
equilibrium is stable; dissipation does not change that. Lyapunov's first method: if all poles
lie in the left half plane it is asymptotically stable; if one lies in the right it is unstable.
If K is degenerate the first terms of higher order of W decide, along the null direction; without a
minimum there the equilibrium is unstable (V. V. Kozlov and V. P. Palamodov, Soviet Math.
Dokl. 25 (1982) 335). Poles on the imaginary axis prove nothing of the nonlinear system.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.parameter_relations import ParameterFacts
from lagrange_cli.analysis.equilibria.rest_system import kinks_at
from lagrange_cli.analysis.linear.drift import varies_along_drift
from lagrange_cli.analysis.linear.energy_test import EnergyTest, reduced_energy
from lagrange_cli.analysis.linear.first_order import first_order
from lagrange_cli.analysis.linear.linearize import exact_matrices, in_doubles
from lagrange_cli.analysis.linear.second_order import LinearSystem
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Mpf, Stability
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.kinks import KINKED
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.zero_test import does_not_depend
from lagrange_cli.phrases import Phrase

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.analysis.equilibria.steady_rates import SteadyRates

#: Part of the terms of entries below which a pivot is rounding, and growth of the entries' errors.
_ZERO, _GROWTH = mpf(10) ** -40, 100
#: Slopes of the energy at rest, relative to its second derivatives, that are rounding.
_LEVEL = mpf(10) ** -20
#: States up to which poles are found in many digits.
_MOST_STATES = 16
#: Real parts, relative to the largest pole, that count, in many digits and in doubles: a multiple
#: pole is known to a part of the digits only.
_FINE, _COARSE = 1e-10, 1e-6
#: Real part, relative to the largest pole, that doubles show: one pole then decides.
_CLEAR = 1e-3
#: Coordinates of an equilibrium whose minors are written as conditions.
_MOST_MINORS = 3
#: Relative distance of different poles.
_APART = 1e-6

_DEFINITE = Phrase("{matrix} is positive definite", matrix=("K",))
_FREE = Phrase("no force acts")
_RISING = Phrase("{matrix} is degenerate, and terms of higher order rise", matrix=("K",))
_NO_MINIMUM = Phrase(
    "{matrix} is degenerate, and along its null direction the energy has no minimum",
    matrix=("K",),
)
_LOWEST = Phrase("the energy at rest has a minimum")
_DEGENERATE = Phrase("{matrix} is degenerate", matrix=("K",))
_NOT_CYCLIC = Phrase("free coordinates are not cyclic")
_NOT_POSITIVE = Phrase("no pole has a positive real part")


def stability(system: RestSystem, at: Equilibrium, linear: LinearSystem) -> Stability:
    """Decide the stability of an equilibrium, as far as a theorem proves it."""
    if kinks_at(system, at):
        return Stability("undecided", Phrase("the forces are not smooth there"))
    return _Question(system, at, linear).answer()


def stability_of_parameters(system: RestSystem, at: Equilibrium) -> Stability:
    """Decide the stability of an equilibrium whose parameters have no values, or when it is stable.

    That is where the leading minors of K are positive (Sylvester), M being positive definite and
    the energy conserved. One of a single coordinate is unstable if K is negative.
    """
    equations = system.equations
    if system.states:
        return Stability("undecided", Phrase("parameters have no values"))
    conserved = any(c.kind in ("energy", "jacobi") for c in equations.derivation.conserved)
    smooth = not any(f.atoms(*KINKED) for f in equations.system.forcing)
    exact = None
    if conserved and smooth and not (at.free or system.held_inputs):
        exact = exact_matrices(system, at)
    unknown = Stability("undecided", Phrase("parameters have no values"))
    if exact is None or len(exact.mass) > _MOST_MINORS:
        return unknown
    signs = ParameterFacts.of_system(system)
    mass, stiffness = (
        [sp.Matrix(rows)[:k, :k].det() for k in range(1, len(rows) + 1)]
        for rows in (exact.mass, exact.stiffness)
    )
    if not all(signs.is_positive(minor) for minor in mass):
        return unknown
    if len(stiffness) == 1 and signs.is_positive(-stiffness[0]):
        return Stability("unstable", Phrase("{matrix} is negative", matrix=("K",)))
    if any(signs.is_never_positive(minor) for minor in stiffness):
        return unknown
    needed = [signs.positive_where(minor) for minor in stiffness]
    if any(condition is None for condition in needed):
        return unknown
    where = tuple(dict.fromkeys(c for conditions in needed for c in conditions or ()))
    if where:
        return replace(unknown, stable_where=where)
    return Stability("stable", Phrase("{reason}: the energy has a minimum", reason=_DEFINITE))


def stability_of_rates(
    system: RestSystem, at: Equilibrium, linear: LinearSystem, family: SteadyRates
) -> Stability:
    """Decide the stability of a steady motion, in what rests and in the rates, which are given.

    Poles of the rates vanish. If these are functions of the one coordinate that rests, it is stable
    with an imaginary pair beside them (the energy at constant integrals has a minimum); if all
    rates are steady, with negative real parts beside them (A. M. Lyapunov 1892, I. G. Malkin 1944).
    """
    if kinks_at(system, at):
        return Stability("undecided", Phrase("the forces are not smooth there"))
    question = _Question(system, at, linear)
    if varies_along_drift(system, at, linear):
        return Stability("undecided", _NOT_CYCLIC)
    poles, tolerance = question.poles()
    if max((p.real for p in poles), default=0.0) > tolerance:
        return question.by_poles()
    others = [p for p in poles if abs(p) > tolerance]
    ignored = {c.name for c in family.form.ignored}
    if len(poles) - len(others) > len(ignored) or set(at.free) > ignored:
        return Stability("undecided", _NOT_POSITIVE)
    if all(p.real < -tolerance for p in others) and family.is_family:
        reason = Phrase("all other poles than those of the rates have negative real parts")
        return Stability("stable", reason)
    if len(others) == 2 and family.is_along_one_coordinate:
        names = tuple(c.name for c in family.written.coordinates if c.name not in ignored)
        reason = Phrase(
            "the rates follow {names} by integrals, and at their values the energy has a minimum",
            names=names,
        )
        return Stability("stable", reason)
    return Stability("undecided", _NOT_POSITIVE)


@dataclass(frozen=True)
class _Question:
    """The stability of one equilibrium."""

    system: RestSystem
    at: Equilibrium
    linear: LinearSystem

    def answer(self) -> Stability:
        if not self.at.isolated:
            verdict = self.by_poles()
            if verdict.verdict == "unstable":
                return verdict
            return Stability("undecided", Phrase("it is one of a continuum of equilibria"))
        if varies_along_drift(self.system, self.at, self.linear):
            return Stability("undecided", _NOT_CYCLIC)
        if self.energy_is_bound and not self.system.states and self.has_inertia:
            if self.linear.is_holonomic:
                return self.by_energy()
            if self.rest_energy_has_minimum:
                return self.at_minimum(_LOWEST if self.bound else _FREE)
        return self.by_poles()

    # The energy.

    @property
    def is_conservative(self) -> bool:
        """True if T + V, or Jacobi's integral, is conserved."""
        return any(
            c.kind in ("energy", "jacobi") for c in self.system.equations.derivation.conserved
        )

    @property
    def energy_is_bound(self) -> bool:
        """True if the energy is conserved or decreases."""
        if self.is_conservative and not self.system.held_inputs:
            return True
        balance = self.system.equations.derivation.balance
        if balance is None or self.system.equations.system.t in balance.rate.free_symbols:
            return False
        # Inputs that do no work at their values at rest leave a conserved energy.
        rate = sp.expand(balance.rate.xreplace(self.system.inputs))
        dissipation = self.system.equations.system.dissipation.xreplace(self.system.inputs)
        return rate == 0 or (sp.expand(rate + 2 * dissipation) == 0 and self.dissipates)

    @property
    def has_inertia(self) -> bool:
        """True if M is positive definite, so that the energy rises with velocities."""
        rows = self.linear.mass.tolist()
        with mpmath.workdps(DIGITS):
            signs = _signs(rows, _ZERO * max(abs(x) for row in rows for x in row))
        return signs[0] == len(rows)

    @property
    def dissipates(self) -> bool:
        """True if the dissipation function is a quadratic form in velocities, never negative."""
        equations = self.system.equations
        v = [c.v for c in equations.system.coordinates]
        if not equations.system.dissipation.is_polynomial(*v):
            return False
        form = sp.hessian(equations.system.dissipation, v)
        if not form.free_symbols <= self.system.known.keys():
            return False
        degrees = {sum(m) for m in sp.Poly(equations.system.dissipation, *v).monoms()}
        numbers = np.array(form.subs(self.system.known).tolist(), dtype=float)
        if not np.isfinite(numbers).all():
            return False
        values = np.linalg.eigvalsh(numbers)
        return degrees <= {2} and bool(values.min(initial=0.0) >= -1e-12 * values.max(initial=0.0))

    # Directions.

    @cached_property
    def drifting(self) -> list[int]:
        """Numbers, among the independent coordinates, of the free ones."""
        names = [c.name for c in self.system.equations.system.coordinates]
        chosen = self.linear.independent
        return [k for k, j in enumerate(chosen) if names[j] in self.at.free]

    @cached_property
    def bound(self) -> list[int]:
        """Numbers, among the independent coordinates, of those that are not free."""
        return [k for k in range(len(self.linear.independent)) if k not in self.drifting]

    @cached_property
    def drift_is_cyclic(self) -> bool:
        if not self.linear.is_holonomic:
            return True  # the equations over independent velocities do not hold it
        return set(self.at.free) <= set(self.system.equations.derivation.cyclic)

    # The energy's minimum.

    @property
    def rest_energy_has_minimum(self) -> bool:
        """True if the energy at rest, conserved with velocities, has a minimum but for drift."""
        system, at = self.system.equations.system, self.at
        still = {c.v: sp.S.Zero for c in system.coordinates}
        rest_energy = system.energy.xreplace(still).xreplace(dict(self.system.inputs))
        bound = [c.q for c in system.coordinates if c.name not in at.free]
        free = [c.q for c in system.coordinates if c.name in at.free]
        if any(at.multipliers or ()) or any(c.rate != 0 for c in system.closures):
            return False
        if not all(does_not_depend(rest_energy, q) for q in free):
            return False
        slopes = [derivative(rest_energy, q) for q in bound]
        bends = [derivative(slope, q) for slope in slopes for q in bound]
        place = dict(zip((c.q for c in system.coordinates), at.position or (), strict=True))
        n = len(bound)
        with mpmath.workdps(DIGITS):
            try:
                numbers = evaluate([*slopes, *bends], {**self.system.known, **place})
            except DomainError:
                return False
            largest = max(map(abs, numbers[n:]), default=mpf(0))
            if any(abs(x) > _LEVEL * largest for x in numbers[:n]):
                return False
            rows = [numbers[n + k * n : 2 * n + k * n] for k in range(n)]
            return _signs(rows, _ZERO * largest)[0] == n

    def by_energy(self) -> Stability:
        positive, flat, negative = self.signs()
        if not negative and not flat:
            return self.at_minimum(_DEFINITE if self.bound else _FREE)
        if negative:
            return self.by_poles()
        if len(flat) == 1 and positive == len(self.bound) - 1:
            return self.by_higher_terms()
        if self.at.exact is None:
            return Stability("undecided", _DEGENERATE)
        return Stability(
            "undecided",
            Phrase("{matrix} has {count} null directions", matrix=("K",), count=str(len(flat))),
        )

    def at_minimum(self, minimum: Phrase) -> Stability:
        """Judge a strict minimum of the energy in all coordinates but those that drift."""
        if self.drifting:
            if not self.drift_is_cyclic:
                return Stability("undecided", _NOT_CYCLIC)
            reason = Phrase("{reason}; {names} may drift", reason=minimum, names=self.at.free)
            return Stability("stable but for drift", reason)
        if self.linear.has_velocity_forces:
            poles, tolerance = self.poles()
            if max(p.real for p in poles) < -tolerance:
                reason = Phrase("{reason}, and all motions are damped", reason=minimum)
                return Stability("asymptotically stable", reason)
        return Stability("stable", Phrase("{reason}: the energy has a minimum", reason=minimum))

    def signs(self) -> tuple[int, list[int], int]:
        """Count the positive directions of K, list null ones, count the negative ones."""
        chosen = self.bound
        if not chosen:
            return 0, [], 0
        with mpmath.workdps(DIGITS):
            unit = [1 / mpmath.sqrt(self.linear.mass[k, k]) for k in chosen]
            rows = [
                [
                    unit[a]
                    * unit[b]
                    * (self.linear.stiffness[i, j] + self.linear.stiffness[j, i])
                    / 2
                    for b, j in enumerate(chosen)
                ]
                for a, i in enumerate(chosen)
            ]
            pairs = [(a, b, i, j) for a, i in enumerate(chosen) for b, j in enumerate(chosen)]
            sizes, errors = self.linear.sizes, self.linear.errors
            rounding = max(
                unit[a] * unit[b] * (_ZERO * sizes[i, j] + _GROWTH * errors[i, j])
                for a, b, i, j in pairs
            )
            return _signs(rows, rounding)

    def by_higher_terms(self) -> Stability:
        test = EnergyTest.FLAT
        if not self.system.equations.system.closures and not self.drifting:
            test = reduced_energy(self.system, self.at, self.linear)
        if test is EnergyTest.MINIMUM:
            return self.at_minimum(_RISING)
        if test is EnergyTest.NONE and not self.linear.has_velocity_forces and self.is_conservative:
            return Stability("unstable", _NO_MINIMUM)
        return Stability("undecided", _DEGENERATE)

    def held_without_force(self) -> str | None:
        """Find a coordinate that may keep any value near its rest, where free ones accelerate.

        With velocities zero but for those of the free coordinates, its own acceleration then has to
        vanish identically, and theirs may depend on it alone: they are constant along the motion
        and grow with the distance from rest, as those of a quadrotor that hovers tilted.
        """
        system, exact = self.system.equations.system, self.at.exact
        if exact is None or system.closures or not self.drifting:
            return None
        free = [k for k, c in enumerate(system.coordinates) if c.name in self.at.free]
        others = [k for k, _ in enumerate(system.coordinates) if k not in free]
        resting = {system.coordinates[k].v: sp.Integer(0) for k in others}
        for k in others:
            fixed = {system.coordinates[j].q: exact[j] for j in others if j != k}
            places = {**self.system.inputs, **resting, **fixed}
            mass = sp.Matrix([[e.xreplace(places) for e in row] for row in system.mass_matrix])
            forces = sp.Matrix([f.xreplace(places) for f in system.forcing])
            if len(free) > _MOST_MINORS or mass.extract(free, free).det() == 0:
                return None
            rates = mass.extract(free, free).LUsolve(forces.extract(free, [0]))
            left = forces.extract(others, [0]) - mass.extract(others, free) * rates
            changing = {c.q for j, c in enumerate(system.coordinates) if j != k}
            changing |= {c.v for c in system.coordinates} | {system.t}
            slopes = [sp.expand(sp.diff(x, system.coordinates[k].q)) for x in rates]
            at_rest = [x.subs(system.coordinates[k].q, exact[k]) for x in slopes]
            if (
                all(sp.expand(x) == 0 for x in left)
                and not any(x.free_symbols & changing for x in rates)
                and any(self.is_surely_nonzero(x) for x in at_rest)
            ):
                return system.coordinates[k].name
        return None

    def is_surely_nonzero(self, value: sp.Expr) -> bool:
        """Tell whether a value over the parameters is not zero, by its digits."""
        number = sp.N(value.subs(self.system.known), DIGITS)
        return bool(number.is_number and abs(number) > _ZERO)

    # Poles.

    def by_poles(self) -> Stability:
        poles, tolerance = self.poles()
        largest = max((p.real for p in poles), default=0.0)
        if largest > tolerance:
            reason = Phrase("a pole has the real part {value}", value=f"{largest:.3g}")
            return Stability("unstable", reason)
        if largest < -tolerance:
            if self.drifting:
                reason = Phrase("all motions are damped; {names} may drift", names=self.at.free)
                return Stability("stable but for drift", reason)
            reason = Phrase("all poles have negative real parts")
            return Stability("asymptotically stable", reason)
        if not self.linear.is_holonomic:
            return Stability("undecided", _NOT_POSITIVE)
        size = max((abs(p) for p in poles), default=0.0)
        apart = min(
            (abs(p - q) for k, p in enumerate(poles) for q in poles[:k]), default=float("inf")
        )
        if size and apart > _APART * size and not self.drifting:
            return Stability("stable in the linear approximation", _NOT_POSITIVE)
        if (coordinate := self.held_without_force()) is not None:
            reason = Phrase(
                "beside its rest {name} may stay, and {names} drift ever faster",
                name=coordinate,
                names=self.at.free,
            )
            return Stability("unstable", reason)
        return Stability("undecided", Phrase("poles on the imaginary axis coincide"))

    def poles(self) -> tuple[list[complex], float]:
        """Find the poles of the motions without drift, and the real part that counts as nonzero."""
        a = first_order(self.system, self.at, self.linear)
        if not a.rows:
            return [], 0.0
        if a.rows == 1:
            return [complex(a[0, 0])], _FINE * self.usual_rate()
        is_finite = bool(np.isfinite(in_doubles(a)).all())
        rough = np.linalg.eigvals(in_doubles(a)).tolist() if is_finite else []
        is_clear = any(p.real > _CLEAR * max(map(abs, rough)) for p in rough)
        if not is_clear and (a.rows <= _MOST_STATES or not is_finite):
            with mpmath.workdps(DIGITS):
                values = [complex(x) for x in mpmath.eig(a, left=False, right=False)]
            tolerance = _FINE
        else:
            values, tolerance = rough, _COARSE
        return values, tolerance * max(self.usual_rate(), *map(abs, values))

    def usual_rate(self) -> float:
        """Return the frequency scale √(|K|/M) by the largest term of K."""
        linear, chosen = self.linear, range(len(self.linear.independent))
        columns = range(linear.sizes.cols)
        pairs = ((k, j) for k in chosen if linear.mass[k, k] for j in columns)
        rates = [linear.sizes[k, j] / abs(linear.mass[k, k]) for k, j in pairs]
        return float(mpmath.sqrt(max(rates, default=mpf(0))))


def _signs(rows: list[list[Mpf]], rounding: Mpf) -> tuple[int, list[int], int]:
    """Count the signs of a symmetric matrix by Sylvester's law of inertia.

    Elimination pivots on the largest diagonal entry; a block without any is indefinite if it has
    other entries.
    """
    left = list(range(len(rows)))
    positive = negative = 0
    while left:
        pivot = max(left, key=lambda k: abs(rows[k][k]))
        others = [abs(rows[i][j]) for i in left for j in left if i != j]
        largest = max((abs(rows[pivot][pivot]), *others))
        if largest <= rounding:
            return positive, left, negative
        if abs(rows[pivot][pivot]) <= rounding:
            return positive + 1, [], negative + 1  # off-diagonal entries alone: both signs
        positive += rows[pivot][pivot] > 0
        negative += rows[pivot][pivot] < 0
        left.remove(pivot)
        for i in left:
            factor = rows[i][pivot] / rows[pivot][pivot]
            for j in left:
                rows[i][j] -= factor * rows[pivot][j]
    return positive, [], negative
