"""Constraint forces f = m r̈ − F on particles, and their multipliers.

In the formulation ``minimal``, accelerations are replaced where the equations of motion are solved
for them; larger systems keep ``ddot(q)``. With closures, a coordinate that is a Cartesian name
itself feels Σ λ·gradient. A point with a force has no mass: the constraints balance the force.

All forces are compared with Newton's law before they are shown, at the states of the derivation's
certificate: component by component, and by the work on virtual displacements, which is that of the
closures (none without closures).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import partial
from itertools import count
from typing import Literal, TypeVar

import mpmath
import sympy as sp

from lagrange_cli.errors import InputError, InternalError, Mark, Problem
from lagrange_cli.mechanics.algebra.derivatives import Kinematics, derivative
from lagrange_cli.mechanics.algebra.polynomials import factored_form
from lagrange_cli.mechanics.algebra.shorten import length_factor, shortened
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.certify.constraints import ClosureCheck
from lagrange_cli.mechanics.certify.routes import DecimalValues, Tapes
from lagrange_cli.mechanics.dynamics.accelerations import explicit_form, multiplier_terms
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.findings import BodyReaction, ConstraintForces, Reaction
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate_in_decimals
from lagrange_cli.mechanics.numerics.elementary import (
    in_decimals,
    numbers_as_decimals,
    numbers_as_mpf,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.numerics.sampling import working_digits
from lagrange_cli.mechanics.reactions.applied_forces import (
    AppliedForces,
    applied_forces,
    velocity_slopes,
    weightless,
)
from lagrange_cli.mechanics.reactions.multipliers import (
    ConstraintEquation,
    ForceBalance,
    force_balances,
    multipliers,
)
from lagrange_cli.mechanics.reduction.geometry import gap_over_names
from lagrange_cli.mechanics.system import tagged
from lagrange_cli.scene.language.expression import Equation as Written
from lagrange_cli.scene.model import Scene

_ZERO = Decimal(0)

#: Most coordinates of systems whose accelerations are replaced.
_SOLVED = 3

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
class _Forces:
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


def derive_constraint_forces(
    derivation: Uncertified, evidence: Evidence, equations: Equations
) -> ConstraintForces:
    """Find the constraint forces of certified equations.

    Raises
    ------
    InternalError
        They disagree with Newton's law.
    """
    applied = applied_forces(derivation)
    forces = _forces(derivation, equations, applied)
    with mpmath.workdps(working_digits(evidence.certificate.digits)):
        check = _Check(derivation, applied, evidence)
        check.newton(forces)
        stated = _stated(derivation)
        reactions, undetermined = _reactions(derivation, stated, forces, check)
    return ConstraintForces(
        tuple(_bodies(derivation, applied, forces)),
        tuple(reactions),
        _form(equations, [*forces.along.values(), *(r.multiplier for r in reactions)]),
        undetermined,
        applied.passed_on,
        applied.shared,
        weightless(derivation),
    )


def _form(
    equations: Equations, shown: Sequence[sp.Expr]
) -> Literal["motion", "accelerations", "multipliers"]:
    """Name the class of symbols in the expressions."""
    if equations.system.pushing:
        return "multipliers"
    symbols = set().union(*(e.free_symbols for e in shown))
    return (
        "motion"
        if symbols.isdisjoint(c.a for c in equations.system.coordinates)
        else "accelerations"
    )


def _forces(derivation: Uncertified, equations: Equations, applied: AppliedForces) -> _Forces:
    reduced = derivation.reduced
    masses = dict.fromkeys(reduced.names.cartesian.values(), sp.Integer(0))
    bodies = zip(reduced.names.particle_symbols, reduced.masses, strict=True)
    for s, mass in ((s, mass) for body, mass in bodies for s in body):
        masses[s] += mass
    solved = _accelerations(equations)
    direct = dict(_direct(derivation))
    pushes = multiplier_terms(equations)
    along = {}
    for s, mass in masses.items():
        if s in applied.free:
            along[s] = sp.Integer(0)
        elif s in direct:
            along[s] = sp.Add(*pushes[direct[s]])
        else:
            force = mass * _acceleration(derivation, s) + applied.along(s)
            along[s] = shortened(shortened(force).xreplace(solved))
    return _Forces(along, direct, solved)


def _accelerations(equations: Equations) -> dict[sp.Symbol, sp.Expr]:
    """Closed forms of all accelerations; empty if one has none."""
    if equations.system.closures or len(equations.system.coordinates) > _SOLVED:
        return {}
    explicit = explicit_form(equations).accelerations
    solved = {
        c.a: e for c, e in zip(equations.system.coordinates, explicit, strict=True) if e is not None
    }
    return solved if len(solved) == len(explicit) else {}


def _acceleration(derivation: Uncertified, symbol: sp.Symbol) -> sp.Expr:
    """r̈ along a raw symbol."""
    reduced = derivation.reduced
    q, v = [c.q for c in reduced.coordinates], [c.v for c in reduced.coordinates]
    kinematics = Kinematics(reduced.resolved, q, v, reduced.names.t)
    rows = kinematics.jacobian(symbol).items()
    turned = [part * reduced.coordinates[j].a for j, parts in rows for part in parts]
    return sp.Add(*turned, *kinematics.convective(symbol))


def _direct(derivation: Uncertified) -> Iterator[tuple[sp.Symbol, int]]:
    """Raw symbols that are coordinates and move no other component, with their numbers."""
    resolved = derivation.reduced.resolved
    for j, c in enumerate(derivation.reduced.coordinates):
        elsewhere = (e for s, e in resolved.items() if s != c.q)
        if resolved.get(c.q) == c.q and not any(c.q in e.free_symbols for e in elsewhere):
            yield c.q, j


def _bodies(
    derivation: Uncertified, applied: AppliedForces, forces: _Forces
) -> Iterator[BodyReaction]:
    """Every particle, and points that are pulled at."""
    reduced = derivation.reduced
    names = reduced.names
    masses = [*reduced.masses, *(None for _ in names.point_symbols)]
    seen: set[sp.Symbol] = set()
    for body, symbols, mass in zip(names.bodies, names.body_symbols, masses, strict=True):
        components = []
        for s in symbols:
            shared = sum(s in triple for triple in names.particle_symbols) > 1
            force = forces.along[s]
            if shared and mass is not None:
                load = sp.Integer(0) if s in seen else applied.along(s)
                force = mass * _acceleration(derivation, s) + load
                force = shortened(force.xreplace(forces.solved))
            components.append(force if mass is not None or s not in seen else sp.Integer(0))
            seen.add(s)
        if mass is not None or any(components):
            x, y, z = components
            yield BodyReaction(body.name, (x, y, z), length_factor((x, y, z)))


def _stated(derivation: Uncertified) -> list[ConstraintEquation]:
    """The scene's equations and gaps, each with the name of its multiplier."""
    reduced = derivation.reduced
    closure_of = {
        (r.mark, r.text): c for r, c in zip(reduced.closures, derivation.closures, strict=True)
    }
    taken = {closure.name for closure in closure_of.values()}
    stated = []
    for name, several, equation, slopes in _written(derivation):
        closure = closure_of.get((equation.mark(), equation.text))
        if closure is not None:
            name = closure.name
        elif several:
            name = _numbered(name, taken)
            taken.add(name)
        known = None if closure is None else closure.multiplier
        stated.append(ConstraintEquation(name, equation.text, slopes, known))
    for one_sided, contact in zip(reduced.scene.unilateral, derivation.contacts, strict=True):
        gap = gap_over_names(reduced.names, one_sided)
        slopes = {s: derivative(gap, s) for s in gap.free_symbols}
        text = one_sided.inequality.text
        stated.append(ConstraintEquation(contact.name, text, slopes, contact.closure.multiplier))
    return stated


def _written(
    derivation: Uncertified,
) -> Iterator[tuple[str, bool, Written, dict[sp.Symbol, sp.Expr]]]:
    """Yield constraint, True if it has several equations, one of these and its slopes."""
    reduced = derivation.reduced
    positional = {id(s.equation): s for s in reduced.chart.geometry.elimination.stated}
    closure_places = {(r.mark, r.text) for r in reduced.closures}
    for constraint in reduced.scene.constraints:
        for equation in constraint.equations:
            stated = positional.get(id(equation))
            if stated is not None:
                slopes = {s: derivative(stated.phi, s) for s in stated.phi.free_symbols}
            elif (equation.mark(), equation.text) in closure_places:
                slopes = velocity_slopes(derivation, equation)
            else:
                continue
            yield constraint.name, len(constraint.equations) > 1, equation, slopes


def _numbered(name: str, taken: set[str]) -> str:
    numbered = (tagged(name, f"_{number}") for number in count(1))
    return next(candidate for candidate in numbered if candidate not in taken)


def _reactions(
    derivation: Uncertified, stated: Sequence[ConstraintEquation], forces: _Forces, check: _Check
) -> tuple[list[Reaction], tuple[str, ...]]:
    """Reaction of each equation, and names of the equations without a known multiplier."""
    reduced = derivation.reduced
    along = dict(forces.along)
    along |= {c.q: check.applied.along(c.q) for c in reduced.coordinates if c.q not in along}
    point = check.points[0]
    exact = force_balances(reduced, stated, along, point, keep_definitions=False)
    hoped = force_balances(reduced, stated, forces.along, point, keep_definitions=True)
    # Of bodies that share the force of a term in an unknown way the forces explain no multiplier.
    unique = [row for row in hoped if row.force == 0 or row.body not in check.applied.shared]
    solved = multipliers(stated, exact, unique, point, to_mpf(check.scales[0]))
    check.rows([r for r in exact if r.gradient.keys() <= solved.keys()], solved)
    reactions = [
        Reaction(e.name, e.text, solved[k], tuple(_sizes(hoped, k, solved[k])))
        for k, e in enumerate(stated)
        if k in solved
    ]
    return reactions, tuple(e.name for k, e in enumerate(stated) if k not in solved)


def _sizes(
    rows: Sequence[ForceBalance], number: int, multiplier: sp.Expr
) -> Iterator[tuple[str, sp.Expr]]:
    """λ |∇φ| for each body."""
    slopes: dict[str, list[sp.Expr]] = {}
    for row in rows:
        if number in row.gradient:
            slopes.setdefault(row.body, []).append(row.gradient[number])
    for body, parts in slopes.items():
        square = shortened(sp.Add(*(e**2 for e in parts)))
        yield body, shortened(multiplier * sp.sqrt(factored_form(square)))


class _Check:
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

    def newton(self, forces: _Forces) -> None:
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

    def _compared(self, point: DecimalValues, forces: _Forces) -> Decimal:
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
