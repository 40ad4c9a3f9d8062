"""Certificate of steps: every line compared with the derivation at random states.

Lines are SymPy expressions made by symbolic derivatives and collection. They are compared with
values by automatic differentiation of positions, of the shown Lagrangian, and of the scene's terms
over Cartesian names, which share nothing with symbolic derivatives.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal

import mpmath
import sympy as sp

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.certify.certificate import Evidence, not_real
from lagrange_cli.mechanics.certify.constraints import ClosureCheck
from lagrange_cli.mechanics.certify.routes import Observation, Tapes
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.numerics.autodiff import (
    DecimalRun,
    DomainError,
    Jet,
    Tape,
    evaluate_in_decimals,
)
from lagrange_cli.mechanics.numerics.elementary import (
    DecimalValues,
    in_decimals,
    numbers_as_decimals,
)
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.numerics.sampling import working_digits
from lagrange_cli.mechanics.reactions.applied_forces import terms_over_names
from lagrange_cli.mechanics.step_values import (
    DerivationSteps,
    rate_symbol,
)
from lagrange_cli.mechanics.steps.turning_certificate import (
    ComparedLine,
    MovedParts,
    TurningCheck,
    along,
)
from lagrange_cli.mechanics.steps.virtual_work import quaternions

_ZERO, _ONE = Decimal(0), Decimal(1)
_CONSTANT: Jet = (_ONE, _ZERO, _ZERO)
_NONE = sp.Integer(0)

#: Digits of a second comparison, in which rounding is negligible, and the bound of zeros there.
_CLOSE_DIGITS = 1300
_NOTHING = Decimal("1e-700")


def certify_steps(
    derivation: Uncertified,
    evidence: Evidence,
    equations: Equations,
    steps: DerivationSteps,
    attached: Mapping[sp.Symbol, sp.Expr],
) -> DerivationSteps:
    """Compare all lines at the states of the derivation's certificate.

    Parameters
    ----------
    attached
        −F of terms in coordinates that a single particle has, by Cartesian name: its work is
        that of these terms.

    Returns
    -------
    DerivationSteps
        The steps with the number of states and the largest mismatches.

    Raises
    ------
    InternalError
        A line disagrees with the derivation.
    InputError
        A line has no value at any of the states.
    """
    digits = evidence.certificate.digits
    tolerance = Decimal(10) ** (5 - digits)
    with mpmath.workdps(working_digits(digits)):
        check = _StepsCheck(derivation, equations, steps, attached)
        worst, apart, states = _ZERO, _ZERO, 0
        for state in evidence.states:
            try:
                with in_decimals():
                    mismatch, difference = check.compared(check.placed(state))
                if max(mismatch, difference) > tolerance:
                    with mpmath.workdps(_CLOSE_DIGITS), in_decimals():
                        mismatch, difference = check.compared(check.placed(state), least=_NOTHING)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue  # a line that is singular here
            if max(mismatch, difference) > tolerance:
                raise InternalError(Problem("a step of the derivation disagrees with it"))
            worst, apart, states = max(worst, mismatch), max(apart, difference), states + 1
    if not states:
        raise not_real(derivation.reduced.scene)
    return replace(steps, states=states, mismatch=float(worst), difference=float(apart))


class _StepsCheck:
    """Routes of one derivation by which its steps are checked."""

    def __init__(
        self,
        derivation: Uncertified,
        equations: Equations,
        steps: DerivationSteps,
        attached: Mapping[sp.Symbol, sp.Expr],
    ) -> None:
        self.equations, self.steps, self.attached = equations, steps, attached
        self.tapes = tapes = Tapes(derivation)
        self.closures = ClosureCheck(derivation, tapes)
        self.number = {s.name: k for k, s in enumerate(tapes.symbols)}
        turned = {b.displacement.name for b in steps.balances if b.displacement.axis}
        by_body = quaternions(derivation.reduced)
        self.quaternions = [by_body[name] for name in sorted(turned)]
        named = terms_over_names(derivation)
        self.rates = named.rates
        self.forces = derivation.forces
        moving = [*named.rates, *named.rates.values(), tapes.t, *tapes.parameters]
        self.named = Tape([named.lagrangian, named.dissipation], moving)

    def placed(self, state: SymbolValues) -> DecimalValues:
        """Return a state whose accelerations keep the lengths of quaternions, as its velocities do.

        Those of the certificate are any. They change along q alone, by −(q·q̈ + q̇·q̇) q.
        """
        point = numbers_as_decimals(state)
        for parts in self.quaternions:
            pairs = [(point[c.q], point[c.v], point[c.a]) for c in parts]
            excess = sum((q * a + v * v for q, v, a in pairs), _ZERO)
            point |= {c.a: a - excess * q for c, (q, _, a) in zip(parts, pairs, strict=True)}
        return point

    def compared(self, point: DecimalValues, least: Decimal = _ZERO) -> tuple[Decimal, Decimal]:
        """Largest relative mismatch of lines, and of d'Alembert's from Lagrange's equations.

        Differences up to ``least`` are none.
        """
        tapes = self.tapes
        seen = tapes.observe(point)
        moments = self.steps.named_moments
        values = evaluate_in_decimals(list(moments.values()), point)
        point = {**point, **dict(zip(moments, values, strict=True))}
        run = tapes.positions.run_in_decimals([seen.series[s] for s in tapes.still], 2)
        outputs = run.outputs
        applied = self._applied(seen, run)
        moved = [
            (parts, evaluate_in_decimals([g for _, g in parts.displacement.rates], point))
            for parts in self.steps.balances
        ]
        lines = [
            *self._bodies(run, outputs[: len(tapes.symbols)], applied, moved),
            *self._terms(point, outputs),
            *self._forces(point, run),
            *self._equations(point, seen),
        ]
        mismatch = _mismatch(point, lines, least)
        known, turnings = self._turnings(point, seen, run, moved)
        turnings += self._balances(point, seen, run, applied, moved)
        for further in (self._newton(point), (known, turnings)):
            mismatch = max(mismatch, _mismatch(*further, least))
        return mismatch, _mismatch(known, list(self._ways(seen, moved)), least)

    # -- kinematics and applied forces ----------------------------------------------

    def _bodies(
        self,
        run: DecimalRun,
        outputs: Sequence[Jet],
        applied: dict[str, Decimal],
        moved: MovedParts,
    ) -> Iterator[ComparedLine]:
        pending = dict(applied)
        variables = [self.tapes.t, *self.tapes.q]
        for body in self.steps.bodies:
            speeds = []
            for part in body.components:
                k = self.number[part.name]
                position, velocity, acceleration = outputs[k]
                yield part.position, position
                yield part.velocity, velocity
                yield part.acceleration, acceleration
                yield part.force, pending.pop(part.name, _ZERO)
                slopes, partials = run.gradient({k: _ONE}), dict(part.partials)
                for s, slope in zip(variables, slopes, strict=False):
                    yield partials.get(s, _NONE), slope
                by_displacement = dict(part.slopes)
                for parts, rates in moved:
                    one = parts.displacement
                    slope = along(one, rates, dict(zip(variables, slopes, strict=False)))
                    # A slope that vanishes may be a sum, which is compared with 1.
                    size = 0 if one.symbol in by_displacement else 1
                    yield by_displacement.get(one.symbol, _NONE) + size, slope + size
                speeds.append(velocity)
            if body.square is not None:
                yield body.square, sum((v * v for v in speeds), _ZERO)

    def _applied(self, seen: Observation, positions: DecimalRun) -> dict[str, Decimal]:
        """Name of a Cartesian name or coordinate → the applied force along it."""
        tapes, outputs = self.tapes, positions.outputs
        applied = {
            s.name: -slope for s, slope in tapes.potential_slopes(seen.series, outputs).items()
        }
        places = dict(zip(tapes.symbols, outputs, strict=False))
        series = [places.get(s, seen.series.get(s, _CONSTANT)) for s in self.rates]
        rates: list[Jet] = [(x[1], x[2], _ZERO) for x in series]
        others = [seen.series[s] for s in (tapes.t, *tapes.parameters)]
        named = self.named.run_in_decimals([*series, *rates, *others], 1)
        lagrangian, dissipation = named.moving_gradient(), named.gradient({1: _ONE})
        count = len(self.rates)
        for i, s in enumerate(self.rates):
            inertia = lagrangian[count + i][1] - lagrangian[i][0]
            applied[s.name] = applied.get(s.name, _ZERO) - inertia - dissipation[count + i]
        for force in (f for f in self.forces if not f.is_torque):
            names = self._targets(force.on, len(force.components))
            values = evaluate_in_decimals(list(force.components), seen.point)
            for name, value in zip(names, values, strict=True):
                applied[name] = applied.get(name, _ZERO) + value
        return self._moved(applied, seen, positions)

    def _moved(
        self, applied: dict[str, Decimal], seen: Observation, run: DecimalRun
    ) -> dict[str, Decimal]:
        """Move forces along coordinates to the particles that have them, by their work."""
        names = [s.name for s in self.attached]
        values = evaluate_in_decimals([-force for force in self.attached.values()], seen.point)
        for name, value in zip(names, values, strict=True):
            applied[name] = applied.get(name, _ZERO) + value
        seeds = {self.number[n]: x for n, x in zip(names, values, strict=True)}
        work = run.gradient(seeds)[1 : 1 + self.tapes.n] if seeds else []
        for q, done in zip(self.tapes.q, work, strict=False):
            if q.name not in self.number:
                applied[q.name] = applied.get(q.name, _ZERO) - done
        return applied

    def _targets(self, on: str, components: int) -> list[str]:
        if components == 1:
            return [on]
        (body,) = (b for b in self.steps.bodies if b.name == on)
        return [part.name for part in body.components]

    # -- bodies that turn -----------------------------------------------------------------

    def _turnings(
        self, point: DecimalValues, seen: Observation, run: DecimalRun, moved: MovedParts
    ) -> tuple[DecimalValues, list[ComparedLine]]:
        """ω, ω̇, ∂ω/∂v, the rates of angular momenta and torques, by R along the motion alone."""
        known, pairs = dict(point), list[ComparedLine]()
        for body in self.steps.bodies:
            if body.turning is not None:
                forces = list(zip(self.forces, self.steps.forces, strict=True))
                check = TurningCheck(self.tapes, body.name, body.turning, forces, seen, run)
                known |= check.spins()
                pairs += check.lines(moved)
        return known, pairs

    # -- energies and forces ------------------------------------------------------------

    def _terms(self, point: DecimalValues, outputs: Sequence[Jet]) -> Iterator[ComparedLine]:
        placed = list(zip(self.tapes.symbols, outputs, strict=False))
        places = {s: x[0] for s, x in placed}
        places |= {rate_symbol(s.name): x[1] for s, x in placed}
        terms = [*self.steps.kinetic, *self.steps.potentials]
        values = evaluate_in_decimals([term.written for term in terms], {**point, **places})
        for term, value in zip(terms, values, strict=True):
            yield term.resolved, value

    def _forces(self, point: DecimalValues, run: DecimalRun) -> Iterator[ComparedLine]:
        q = self.tapes.q
        for force, steps in zip(self.forces, self.steps.forces, strict=True):
            if force.is_torque:
                continue  # among those of turnings
            names = self._targets(force.on, len(force.components))
            values = dict(
                zip(names, evaluate_in_decimals(list(force.components), point), strict=True)
            )
            for name, component in steps.components:
                yield component, values[name]
            work = [values.get(s.name, _ZERO) for s in q]
            if len(force.components) == 3:
                seeds = {self.number[name]: x for name, x in values.items()}
                work = run.gradient(seeds)[1 : 1 + len(q)]
            generalized = dict(steps.generalized)
            for s, done in zip(q, work, strict=True):
                yield generalized.get(s, _NONE), done

    # -- equations ------------------------------------------------------------------------

    def _equations(self, point: DecimalValues, seen: Observation) -> Iterator[ComparedLine]:
        tapes = self.tapes
        mass, forcing = tapes.derived_parts(point)
        pushes = self.closures.forces(point)
        drag = [_ZERO] * tapes.n
        if tapes.dissipates:
            run = tapes.dissipation.run_in_decimals([seen.series[s] for s in tapes.moving], 0)
            drag = run.gradient({0: _ONE})[1 + tapes.n : 1 + 2 * tapes.n]
        momenta, slopes = tapes.momenta(seen), tapes.slopes(seen)
        # L and the energy function as they are printed, by T and V and by L.
        system, (_, kinetic, potential) = self.equations.system, seen.values
        yield system.lagrangian, kinetic - potential
        yield system.energy, tapes.energy_function(seen)[0]
        speeds = [c.v for c in system.coordinates]
        accelerations = [c.a for c in system.coordinates]
        multipliers = [closure.multiplier for closure in system.pushing]
        for j, steps in enumerate(self.steps.coordinates):
            yield steps.momentum, momenta[j][0]
            yield steps.momentum_rate, momenta[j][1]
            yield steps.slope, slopes[j][0]
            yield steps.drag, drag[j]
            shown = self.equations.derivation.shown[j]
            derived = [x * point[tapes.a[k]] for k, x in mass[j].items()]
            lacking = sum(derived, -forcing[j] - sum(pushes[j], _ZERO))
            lagrange = momenta[j][1] - slopes[j][0] - seen.forces[j] - sum(pushes[j], _ZERO)
            force = self.steps.generalized_force(system.coordinates[j].q)
            terms = steps.ungathered_terms(speeds, accelerations, multipliers, force)
            residuals = [steps.residual, shown.residual * shown.divided_by]
            if terms:
                residuals.append(sp.Add(*(c * f for c, f in terms)))
            for residual in residuals:
                yield residual, lacking
                yield residual, lagrange

    def _balances(
        self,
        point: DecimalValues,
        seen: Observation,
        run: DecimalRun,
        applied: dict[str, Decimal],
        moved: MovedParts,
    ) -> Iterator[ComparedLine]:
        if not moved:
            return
        tapes = self.tapes
        pushed = {self.number[n]: f for n, f in applied.items() if n in self.number}
        inertia = tapes.inertial_forces(seen.series, run)
        placed = {k: force for k, force in inertia.items() if k < len(tapes.symbols)}
        rotated = {k: force for k, force in inertia.items() if k >= len(tapes.symbols)}
        accelerated, turned, worked = (
            run.gradient(seeds)[1 : 1 + tapes.n] for seeds in (placed, rotated, pushed)
        )
        torques = [_ZERO] * tapes.n
        for force, works in zip(self.forces, tapes.works(seen.series, run), strict=True):
            if force.is_torque:
                (work,) = works
                torques = [x + y for x, y in zip(torques, work, strict=True)]
        alone = [_ZERO if q.name in self.number else -applied.get(q.name, _ZERO) for q in tapes.q]
        lacking = self._lacking(point)
        for parts, rates in moved:
            pairs = [
                (parts.inertia, accelerated),
                (parts.work, worked),
                (parts.turning, turned),
                (parts.torques, torques),
                (parts.coordinates, alone),
            ]
            if parts.displacement.axis:
                pairs.append((parts.whole, lacking))
                # Its rates are along the sphere of quaternions of length 1.
                yield sp.Add(*(q * g for q, g in parts.displacement.rates)), _ZERO
            for line, by_coordinate in pairs:
                values = dict(zip(tapes.q, by_coordinate, strict=True))
                yield line, along(parts.displacement, rates, values)

    def _lacking(self, point: DecimalValues) -> list[Decimal]:
        """M q̈ − f − Σ λ·gradient of each coordinate."""
        mass, forcing = self.tapes.derived_parts(point)
        pushes, a = self.closures.forces(point), self.tapes.a
        return [
            sum((x * point[a[k]] for k, x in row.items()), -force - sum(pushed, _ZERO))
            for row, force, pushed in zip(mass, forcing, pushes, strict=True)
        ]

    def _ways(self, seen: Observation, moved: MovedParts) -> Iterator[ComparedLine]:
        """d'Alembert's coefficients beside Lagrange's, evaluated from L."""
        momenta, slopes = self.tapes.momenta(seen), self.tapes.slopes(seen)
        residuals = {
            q: rate - slope - force
            for q, (_, rate), (slope, _), force in zip(
                self.tapes.q, momenta, slopes, seen.forces, strict=True
            )
        }
        for parts, rates in moved:
            yield parts.coefficient, along(parts.displacement, rates, residuals)

    def _newton(self, point: DecimalValues) -> tuple[DecimalValues, list[ComparedLine]]:
        """m r̈ = F + f of each particle along a motion, where constraint forces are derived."""
        reactions, tapes = self.equations.derivation.constraint_forces, self.tapes
        if reactions is None:
            return point, []
        solution = self.closures.solved(point, *tapes.derived_parts(point)) if tapes.n else []
        if solution is None:
            return point, []  # singular here
        multipliers = [c.multiplier for c in self.closures.closures]
        moving = {**point, **dict(zip([*tapes.a, *multipliers], solution, strict=True))}
        components = {b.name: b.components for b in reactions.bodies}
        pairs: list[ComparedLine] = []
        for body in self.steps.bodies:
            forces = components.get(body.name, (_NONE, _NONE, _NONE))
            for part, force in zip(body.components, forces, strict=True):
                inertia = (body.mass or _NONE) * part.acceleration
                (value,) = evaluate_in_decimals([inertia], moving)
                pairs.append((part.force + force, value))
        return moving, pairs


def _mismatch(point: DecimalValues, lines: Sequence[ComparedLine], least: Decimal) -> Decimal:
    """Largest difference of a line from its value, relative to the sizes of its terms."""
    terms = [sp.Add.make_args(line) for line, _ in lines]
    values = iter(evaluate_in_decimals([term for parts in terms for term in parts], point))
    worst = _ZERO
    for parts, (_, value) in zip(terms, lines, strict=True):
        sizes = [next(values) for _ in parts]
        difference = abs(sum(sizes, _ZERO) - value)
        if difference > least:
            worst = max(worst, difference / max(abs(value), sum(map(abs, sizes))))
    return worst
