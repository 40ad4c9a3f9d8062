"""Check of constraint forces by Newton's law at states of the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import partial
from typing import TypeVar

import mpmath
import sympy as sp

from lagrange_cli.errors import InputError, InternalError, Mark, Problem
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.certify.constraints import ClosureCheck
from lagrange_cli.mechanics.certify.routes import Tapes
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate_in_decimals
from lagrange_cli.mechanics.numerics.elementary import (
    DecimalValues,
    in_decimals,
    numbers_as_decimals,
    numbers_as_mpf,
)
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.reactions.applied_forces import AppliedForces
from lagrange_cli.mechanics.reactions.multipliers import ForceBalance
from lagrange_cli.scene.model import Scene

_ZERO = Decimal(0)

#: Digits of a second look.
_CLOSE_DIGITS = 1300
#: Numbers below it count as zero then: products of three doubles are larger.
_NOTHING = Decimal("1e-1000")

#: Factor by which one rounding error may exceed another one.
_MARGIN = 1000

_Seen = TypeVar("_Seen")

#: States at which forces are compared with Newton's law.
_STATES = 2


@dataclass(frozen=True)
class Forces:
    """Constraint forces along raw symbols.

    Attributes
    ----------
    along
        Raw symbol → force along it.
    by_multipliers
        Raw symbol whose force is written as Σ λ·gradient → its number as a coordinate.
    solved
        Symbol of an acceleration → expression for it; empty if one has none.
    """

    along: dict[sp.Symbol, sp.Expr]
    by_multipliers: dict[sp.Symbol, int]
    solved: dict[sp.Symbol, sp.Expr]


class ForcesCheck:
    """Check of constraint forces by Newton's law at states of the motion.

    Attributes
    ----------
    seen, points
        Once compared, states of the certificate, and these with accelerations and multipliers
        that solve the equations of motion, or with any where the system is too large to solve here.
    scales
        Size of the forces at each.
    """

    def __init__(self, derivation: Uncertified, applied: AppliedForces, evidence: Evidence) -> None:
        self.applied, self.scene = applied, derivation.reduced.scene
        self.tolerance = Decimal(10) ** (5 - evidence.certificate.digits)
        self.tapes = Tapes(derivation)
        self.closures = ClosureCheck(derivation, self.tapes)
        self.states = evidence.states
        self.seen: list[SymbolValues] = []
        self.points: list[SymbolValues] = []
        self.scales: list[Decimal] = []
        self._floor = self._rounding = _ZERO

    def _moving(self, state: SymbolValues) -> DecimalValues:
        point = numbers_as_decimals(state)
        if not self.tapes.n:
            return point
        mass, forcing = self.tapes.derived_parts(point)
        solution = self.closures.solved(point, mass, forcing)
        if solution is None:
            return point
        multipliers = [c.multiplier for c in self.closures.closures]
        return {**point, **dict(zip([*self.tapes.a, *multipliers], solution, strict=True))}

    def newton(self, forces: Forces) -> None:
        """Compare forces with m r̈ − F, and their work with that of closures and contacts."""
        for state in self.states:
            try:
                compare = partial(self._compared, forces=forces)
                scale = self._looked_at(state, compare)
                with in_decimals():
                    self.points.append(numbers_as_mpf(self._moving(state)))
                # Forces that vanish have no size: take that of ordinary forces with the same
                # rounding.
                self.scales.append(max(scale, _MARGIN * self._rounding / self.tolerance))
                self.seen.append(state)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue  # a form of the forces that is singular here
            if len(self.seen) == _STATES:
                return
        if not self.seen:
            raise _without_values(self.scene)

    def _looked_at(self, state: SymbolValues, compare: Callable[[DecimalValues], _Seen]) -> _Seen:
        """Compare at a state; on failure again with digits at which rounding is negligible.

        Forces that vanish, as those on a straight path, are rounding alone at the first look.
        """
        self._rounding = _ZERO
        try:
            with in_decimals():
                return compare(self._moving(state))
        except InternalError:
            with mpmath.workdps(_CLOSE_DIGITS), in_decimals():
                self._floor = _NOTHING
                try:
                    return compare(self._moving(state))
                finally:
                    self._floor = _ZERO

    def _compared(self, point: DecimalValues, forces: Forces) -> Decimal:
        """Compare at one state; return the size of the forces there."""
        tapes = self.tapes
        series = tapes.series(point)
        run = tapes.positions.run_in_decimals([series[s] for s in tapes.still], 2)
        slopes = tapes.potential_slopes(series, run.outputs)
        masses = dict.fromkeys(range(len(tapes.symbols)), _ZERO)
        for mass, k in zip(tapes.mass_values(series), tapes.components, strict=True):
            masses[k] += mass
        pairs = zip(self._residuals(point), self.closures.forces(point), strict=True)
        # M a − f − Σ λ·gradient, which is zero at a state of the motion.
        lacking = [residual - sum(parts, _ZERO) for (residual, _), parts in pairs]
        symbols = [s for s in tapes.symbols if s in forces.along]
        derived = evaluate_in_decimals([forces.along[s] for s in symbols], point)
        loads = evaluate_in_decimals(
            [self.applied.dynamic.get(s, sp.Integer(0)) for s in symbols], point
        )
        seeds: dict[int, Decimal] = {}
        differences, scale = [], _ZERO
        for s, force, load in zip(symbols, derived, loads, strict=True):
            k = tapes.symbols.index(s)
            if s in forces.by_multipliers:
                force += lacking[forces.by_multipliers[s]]
            parts = [masses[k] * run.outputs[k][2], slopes[s], load]
            differences.append(force - sum(parts, _ZERO))
            scale = max(scale, sum(map(abs, parts), abs(force)))
            seeds[k] = force
        for difference in differences:
            self._require(difference, scale)
        work = run.gradient(seeds)[1 : 1 + tapes.n]
        self._require_work(point, work, scale)
        return scale

    def _require_work(self, point: DecimalValues, work: Sequence[Decimal], scale: Decimal) -> None:
        """Require that Σ f ∂r/∂q plus forces on coordinates alone is M a − f."""
        coordinates = [q for q in self.tapes.q if q not in self.tapes.symbols]
        direct = evaluate_in_decimals([self.applied.along(q) for q in coordinates], point)
        alone = dict(zip(coordinates, direct, strict=True))
        for q, done, (residual, size) in zip(
            self.tapes.q, work, self._residuals(point), strict=True
        ):
            load = alone.get(q, _ZERO)
            self._require(done + load - residual, size + abs(load) + scale)

    def _residuals(self, point: DecimalValues) -> list[tuple[Decimal, Decimal]]:
        """M a − f of each coordinate, with the size of its terms."""
        mass, forcing = self.tapes.derived_parts(point)
        accelerations = [point[a] for a in self.tapes.a]
        residuals = []
        for row, f in zip(mass, forcing, strict=True):
            parts = [m * accelerations[k] for k, m in row.items()]
            residuals.append((sum(parts, -f), sum(map(abs, parts), abs(f))))
        return residuals

    def rows(self, rows: Sequence[ForceBalance], multipliers: Mapping[int, sp.Expr]) -> None:
        """Require that the multipliers make up the forces."""
        for state, scale in zip(self.seen, self.scales, strict=True):
            compare = partial(self._compare_rows, rows=rows, multipliers=multipliers, scale=scale)
            self._looked_at(state, compare)

    def _compare_rows(
        self,
        point: DecimalValues,
        rows: Sequence[ForceBalance],
        multipliers: Mapping[int, sp.Expr],
        scale: Decimal,
    ) -> None:
        numbers = sorted(multipliers)
        known = dict(
            zip(
                numbers, evaluate_in_decimals([multipliers[k] for k in numbers], point), strict=True
            )
        )
        for row in rows:
            force, *slopes = evaluate_in_decimals([row.force, *row.gradient.values()], point)
            parts = [known[k] * g for k, g in zip(row.gradient, slopes, strict=True)]
            self._require(force - sum(parts, _ZERO), sum(map(abs, parts), scale))

    def _require(self, difference: Decimal, size: Decimal) -> None:
        if abs(difference) > max(self.tolerance * size, self._floor):
            self._rounding = abs(difference)
            raise InternalError(Problem("the constraint forces disagree with Newton's law"))


def _without_values(scene: Scene) -> InputError:
    """Build the refusal of constraint forces without values at any state that was tried."""
    marks = [term.mark for term in (*scene.potentials, *scene.kinetic)]
    marks += [force.mark for force in scene.forces]
    return InputError(
        Problem(
            "the constraint forces are no finite real numbers at any state that was tried",
            marks[0] if marks else Mark(scene.file, 1, 1),
            hint="look for numbers whose powers or exponentials are beyond 1e308 or below 1e-308",
            rule="no-forces",
        )
    )
