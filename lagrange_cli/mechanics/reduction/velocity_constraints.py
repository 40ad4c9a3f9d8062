"""Constraints on velocities: rates of positional ones, and nonholonomic ones.

Integrable ones whose integral has a closed form become constraints on positions; the
others are kept as closures ψ(q, v, t) = A v + b = 0.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, InputError, Problem
from lagrange_cli.mechanics.algebra.collect import fewest_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import term_count
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.elimination.eliminate import StatedEquation
from lagrange_cli.mechanics.elimination.solve_equation import factor_branches
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.rank import (
    RANK_TOLERANCE,
    DoubleRow,
    SymbolValues,
    column_factors,
    dependent_rows,
    scale_columns,
)
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, to_double
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation
from lagrange_cli.mechanics.reduction.integrability import (
    PfaffianForm,
    integrable_rank,
    integrate_form,
)
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import contradict, leave_out
from lagrange_cli.mechanics.system import Coordinate
from lagrange_cli.scene.language.expression import Equation

#: Most terms that a side of a constraint is multiplied out to, to see which cancel. A ball on a
#: sphere or a cylinder has fewer.
_TERM_BUDGET = 200


@dataclass(frozen=True)
class VelocityConstraint:
    """A constraint on velocities, ``left = right``.

    Attributes
    ----------
    constraint
        Its name.
    equation
        Its equation as written.
    left, right
        Its sides over q, v and t.
    """

    constraint: str
    equation: Equation
    left: sp.Expr
    right: sp.Expr

    @property
    def psi(self) -> sp.Expr:
        return self.left - self.right

    def closure_equation(self) -> ClosureEquation:
        """Return the constraint as a closure."""
        place = self.equation.mark()
        return ClosureEquation(
            self.constraint, "velocity", self.left, self.right, self.equation.text, place
        )

    def shortened(self, velocities: Collection[sp.Symbol]) -> VelocityConstraint:
        """Return a constraint that nobody wrote as ψ = 0, with fewer terms if some cancel.

        A coefficient of a velocity is one quotient where that is shorter: sin² α/cos α + cos α of
        an inclined plane is 1/cos α.
        """
        psi = self.psi
        terms = fewest_terms(psi, _TERM_BUDGET)
        if terms is None:
            return self
        coefficients: dict[sp.Expr, list[sp.Expr]] = {}
        for term in terms:
            coefficient, velocity = term.as_independent(*velocities, as_Add=False)
            coefficients.setdefault(velocity, []).append(coefficient)
        summands = (v * shortened(sp.Add(*parts)) for v, parts in coefficients.items())
        psi = psi if len(terms) >= term_count(psi) else sp.Add(*terms)
        psi = min((psi, sp.Add(*summands)), key=sp.count_ops)
        return replace(self, left=psi, right=sp.Integer(0))

    def form(self, coordinates: Sequence[Coordinate], t: sp.Symbol) -> PfaffianForm:
        """ψ dt = Σ A dq + b dt.

        Raises
        ------
        InputError
            ψ is not linear in velocities.
        """
        velocities = {c.v for c in coordinates}
        coefficients = [derivative(self.psi, c.v) for c in coordinates]
        coefficients = [sp.expand(a) if a.free_symbols & velocities else a for a in coefficients]
        if any(a.free_symbols & velocities for a in coefficients):
            raise self._not_linear()
        drift = self.psi.xreplace(dict.fromkeys(velocities, sp.Integer(0)))
        return PfaffianForm((*(c.q for c in coordinates), t), (*coefficients, drift))

    def _not_linear(self) -> InputError:
        return InputError(
            Problem(
                f"constraint '{self.constraint}' is not linear in velocities",
                self.equation.mark(),
                hint="multiply out quotients of velocities; others are no constraints of mechanics",
                rule="not-linear",
            )
        )


class StartNeededError(Exception):
    """Raised if constants of integration need parameters for the starts of coordinates.

    Attributes
    ----------
    names
        Names of the coordinates, and ``t`` for the time at which motions start.
    """

    def __init__(self, names: Sequence[str]) -> None:
        super().__init__(*names)
        self.names = tuple(names)


def integrate_constraints(
    names: Names,
    levels: Sequence[VelocityConstraint],
    coordinates: Sequence[Coordinate],
    points: Sequence[SymbolValues],
    reference: SymbolValues,
) -> tuple[dict[int, StatedEquation], list[str]]:
    """Integrate levels to constraints on positions, by number; return these and remarks.

    Parameters
    ----------
    points
        Configurations at which candidates are checked.
    reference
        Values of symbols at the given configuration, where integrals must be real.

    Raises
    ------
    InputError
        A level is not linear in velocities.
    StartNeededError
        No parameter of the scene names the start of a coordinate.
    """
    integrals: dict[int, StatedEquation] = {}
    constants = frozenset(names.parameters.values())
    remarks = []
    for number, level in enumerate(levels):
        whole = integrate_form(level.form(coordinates, names.t), points)
        whole = None if whole is None else _real_branch(whole, reference)
        if whole is None or whole == 0:
            continue
        moving = [c.q for c in coordinates if c.q in whole.free_symbols]
        start = _start(names, [*moving, *({names.t} & whole.free_symbols)])
        sides = _sides(whole, start)
        written = " = ".join(str(side).replace("**", "^") for side in sides)
        remarks.append(f"constraint '{level.constraint}' is the rate of {written}: it counts to K")
        sides = _through_start(sides, start, constants)
        integrals[number] = StatedEquation(level.constraint, level.equation, *sides, integral=True)
    return integrals, remarks


def _real_branch(whole: sp.Expr, reference: SymbolValues) -> sp.Expr | None:
    """Write log(−u) for log(u) in an integral if u < 0 at the reference; None unless real there.

    Both have the rate u̇/u, which no motion carries through u = 0.
    """
    for logarithm in sorted(whole.atoms(sp.log), key=sp.default_sort_key):
        argument = logarithm.args[0]
        if _known(argument, reference) and _value(argument, reference) < 0:
            whole = whole.xreplace({logarithm: sp.log(-argument)})
    if not _known(whole, reference):
        return whole
    try:
        _value(whole, reference)
    except DomainError:
        return None
    return whole


def _known(expr: sp.Expr, reference: SymbolValues) -> bool:
    return all(s in reference for s in expr.free_symbols)


def _value(expr: sp.Expr, reference: SymbolValues) -> mpf:
    return evaluate([expr], {s: reference[s] for s in expr.free_symbols})[0]


def _start(names: Names, moving: Sequence[sp.Symbol]) -> dict[sp.Symbol, sp.Expr]:
    """Starts of coordinates and of t: parameters in ``initial``, or those added for starts.

    Raises
    ------
    StartNeededError
        Some of them have none.
    """
    scene = names.scene
    start: dict[sp.Symbol, sp.Expr] = {}
    for entry in scene.initial:
        symbol = names.lookup(entry.name)
        value = names.convert(entry.value)
        if entry.order == 0 and symbol is not None and value.is_Symbol:
            start[symbol] = value
    begin = scene.simulate.start
    if begin is None or names.convert(begin) == 0:
        start[names.t] = sp.Integer(0)
    starts = dict(scene.starts)
    unnamed = [s.name for s in moving if s not in start and s.name not in starts]
    if unnamed:
        raise StartNeededError(unnamed)
    return {s: start[s] if s in start else names.parameters[starts[s.name]] for s in moving}


def _sides(whole: sp.Expr, start: Mapping[sp.Symbol, sp.Expr]) -> tuple[sp.Expr, sp.Expr]:
    """The integral and its value at the start, as the sides of an equation.

    Where it is linear, coordinate by coordinate: ``a*(phi - phi_0) = (R + a)*(theta - theta_0)``.
    """
    moving = [s for s in sorted(whole.free_symbols, key=str) if s in start]
    slopes = {s: derivative(whole, s) for s in moving}
    if any(not slope.free_symbols.isdisjoint(moving) for slope in slopes.values()):
        return whole, whole.xreplace(start)
    left, right = [], []
    for s, slope in slopes.items():
        if slope.could_extract_minus_sign():
            right.append(-slope * (s - start[s]))
        else:
            left.append(slope * (s - start[s]))
    return sp.Add(*left), sp.Add(*right)


def _through_start(
    sides: tuple[sp.Expr, sp.Expr],
    start: Mapping[sp.Symbol, sp.Expr],
    constants: frozenset[sp.Symbol],
) -> tuple[sp.Expr, sp.Expr]:
    """Choose the factor that vanishes at the start, if one alone does: y − y₀ of y² = y₀²."""
    factors = factor_branches(sides[0] - sides[1], constants)
    through = [f for f in factors if sp.expand(f.xreplace(start)) == 0]
    return (through[0], sp.Integer(0)) if len(through) == 1 < len(factors) else sides


def from_start(expr: sp.Expr, pairs: Sequence[tuple[sp.Symbol, sp.Symbol]]) -> sp.Expr:
    """Write the sums of an expression over q − q_0, for pairs of a coordinate and its start."""

    def grouped(total: sp.Expr) -> sp.Expr:
        for q, start in pairs:
            slope = total.coeff(q)
            if slope != 0 and sp.expand(slope + total.coeff(start)) == 0:
                total = total - sp.expand(slope * (q - start)) + slope * (q - start)
        return total

    return expr.replace(lambda e: e.is_Add, grouped) if pairs else expr


@dataclass(frozen=True)
class IndependentPart:
    """Independent part of the velocity constraints.

    Attributes
    ----------
    numbers
        Numbers of the independent ones.
    integrable
        Number of integrable ones without a known integral: they count to K.
    redundant
        Names of constraints that others imply, by number of the level.
    """

    numbers: tuple[int, ...]
    integrable: int
    redundant: Mapping[int, tuple[str, ...]]


def independent_constraints(
    levels: Sequence[VelocityConstraint],
    coordinates: Sequence[Coordinate],
    closures: Sequence[ClosureEquation],
    t: sp.Symbol,
    manifold: Manifold,
    points: Sequence[SamplePoint],
) -> IndependentPart:
    """Rank of the levels beside the positional closures, and their integrable part.

    Parameters
    ----------
    manifold
        The manifold of closures and levels.
    points
        Feasible configurations.

    Raises
    ------
    InputError
        Levels that contradict each other.
    """
    names = [*(c.name for c in closures), *(x.constraint for x in levels)]
    unscaled = [_slopes(manifold, coordinates, p) for p in points]
    units = column_factors(unscaled[0], len(coordinates))
    slopes = [scale_columns(rows, units) for rows in unscaled]
    everywhere = [dependent_rows(rows) for rows in slopes]
    dropped = {
        k: by
        for k, by in everywhere[0].items()
        if k >= len(closures) and all(k in dependent for dependent in everywhere)
    }
    _require_consistent(
        [*closures, *(x.closure_equation() for x in levels)], everywhere, manifold, points
    )
    first = len(closures)
    numbers = tuple(k for k in range(len(levels)) if first + k not in dropped)
    positional = [
        PfaffianForm((*(c.q for c in coordinates), t), _slope(c, coordinates, t)) for c in closures
    ]
    forms = [*positional, *(levels[k].form(coordinates, t) for k in numbers)]
    scale = _curving(forms, [u * to_double(x) for u, x in zip(units, manifold.scale, strict=True)])
    integrable = integrable_rank(forms, points, [*scale, 1.0]) - len(closures)
    redundant = {k - first: tuple(names[j] for j in by) for k, by in dropped.items()}
    return IndependentPart(numbers, max(0, integrable), redundant)


def _curving(forms: Sequence[PfaffianForm], scale: Sequence[float]) -> list[float]:
    """Scales of coordinates, those within rows so that they are 1 where coefficients turn."""
    inside = set().union(*(c.free_symbols for f in forms for c in f.coefficients))
    columns = {j for f in forms for j, c in enumerate(f.coefficients[:-1]) if c != 0}
    turn = max((scale[j] for j in columns if forms[0].variables[j] in inside), default=1.0)
    return [x / turn if j in columns else x for j, x in enumerate(scale)]


def _slope(
    closure: ClosureEquation, coordinates: Sequence[Coordinate], t: sp.Symbol
) -> tuple[sp.Expr, ...]:
    phi = closure.left - closure.right
    return tuple(derivative(phi, s) for s in (*(c.q for c in coordinates), t))


def _slopes(
    manifold: Manifold, coordinates: Sequence[Coordinate], point: SamplePoint
) -> list[DoubleRow]:
    at_rest = {**point, **{c.v: mpf(0) for c in coordinates}}
    _, _, gradients = manifold.motion(at_rest, [mpf(0)] * len(coordinates))
    scale = manifold.scale
    return [{j: to_double(x * scale[j]) for j, x in row.items()} for row in gradients]


def _require_consistent(
    equations: Sequence[ClosureEquation],
    dependent: Sequence[Mapping[int, tuple[int, ...]]],
    manifold: Manifold,
    points: Sequence[SamplePoint],
) -> None:
    """Refuse levels that no velocities satisfy together.

    Parameters
    ----------
    dependent
        At each point the equations that depend on others, with those.
    """
    still = [mpf(0)] * len(manifold.v)
    for rows, point in zip(dependent, points, strict=True):
        at_rest = {**point, **dict.fromkeys(manifold.v, mpf(0))}
        before, _, _ = manifold.motion(at_rest, still)
        after, _, _ = manifold.motion(manifold.tangent(at_rest), still)
        least = RANK_TOLERANCE * max(map(abs, before), default=mpf(1))
        wrong = [k for k, x in enumerate(after) if abs(x) > least]
        if wrong:
            circuits = ([*by, k] for k, by in rows.items() if k in wrong)
            raise _inconsistent([equations[k] for k in sorted(next(circuits, wrong))])


def _inconsistent(taking_part: Sequence[ClosureEquation]) -> InputError:
    named = list(dict.fromkeys(r.name for r in taking_part))
    them = "them together" if len(named) > 1 else "its equations"
    what = f"{contradict(named, 'contradicts itself')}: no velocities satisfy {them}"
    mark, hint = taking_part[-1].mark, leave_out(named)
    return InconsistentError(Problem(what, mark, hint=hint, rule="inconsistent"))
