"""One-sided constraints: gaps φ(q, t) ≥ 0 whose multipliers push while they are closed.

The coordinates must describe free flight too: a gap that they, or the constraints beside
it, do not let change is refused, and so is one whose sign is proven.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.contacts.infeasible import require_feasible
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, working_digits
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation, gap_over_names
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import leave_out, quoted
from lagrange_cli.mechanics.symbols.values import nearest_double
from lagrange_cli.mechanics.system import Closure, Contact
from lagrange_cli.scene.model import Unilateral

#: Decimal digits of gaps that count; more are carried.
_DIGITS = 30
#: Change relative to |∂φ/∂q|·|Δq| below which a gap counts as constant: far above the rounding of
#: the digits carried, and below the change of any gap that a motion opens.
_STILL = mpf(10) ** -9
#: Digits that rounding may take.
_LOST = 15
#: Digits of the second look at a gap that seems constant: a steep power changes below rounding.
_SURE = 1000

#: Configurations beside one that are tried, each half as far from it: down to 1/4096 of the scales.
_TRIALS = 12
#: Number of neighbours that suffice.
_ENOUGH = 3

_FREE = "the coordinates must describe free flight too"


def contacts(reduced: Reduced, gaps: Sequence[Closure]) -> tuple[Contact, ...]:
    """Return the contacts of a scene, from its gaps with gradient, rate and bias.

    Raises
    ------
    InputError
        Located: a gap that no motion changes, that cannot be violated or is violated
        everywhere, infeasible gaps; a restitution outside [0, 1].
    """
    if not gaps:
        return ()
    with mpmath.workdps(working_digits(_DIGITS)):
        states = _neighbours(reduced)
        for gap, closure in zip(reduced.gaps, gaps, strict=True):
            _require_change(reduced, gap, closure, states)
            _require_sign_open(reduced, gap, closure)
        require_feasible(reduced)
    coefficients = [_restitution(reduced, one_sided) for one_sided in reduced.scene.unilateral]
    return tuple(map(Contact, gaps, coefficients))


def _restitution(reduced: Reduced, one_sided: Unilateral) -> sp.Expr:
    """Convert Newton's coefficient of restitution over the parameters."""
    written = one_sided.restitution
    if written is None:
        return sp.Integer(0)
    value = reduced.values.number(written)
    number = None if value is None else nearest_double(value)
    if number is not None and not 0 <= number <= 1:
        raise InputError(
            Problem(
                f"the restitution of '{one_sided.name}' is from 0 to 1,"
                f" found {written.text} = {number:g}",
                written.mark(),
                rule="restitution",
            )
        )
    return reduced.names.convert(written)


def _require_sign_open(reduced: Reduced, gap: ClosureEquation, closure: Closure) -> None:
    """Refuse a gap whose expression has one sign whatever the coordinates are."""
    names = reduced.names
    constants = {names.parameters[n]: x for n, x in reduced.values.exact.items()}
    phi = closure.expression.xreplace(constants)
    if phi.is_nonpositive:
        raise _refusal(gap, "leaves no room to move", "turn it round, or write an equation")
    if phi.is_nonnegative:
        raise _refusal(gap, "cannot be violated", "leave it out, or correct it")


def _require_change(
    reduced: Reduced, gap: ClosureEquation, closure: Closure, states: Sequence[SamplePoint]
) -> None:
    """Refuse a gap that is the same in all configurations next to each other."""
    slopes = {reduced.coordinates[j].q: closure.gradient[j] for j in closure.coordinate_numbers}
    level, size, changes = _change(gap, slopes, states)
    if changes:
        return
    with mpmath.workdps(_SURE):
        # A steep power changes below the rounding of fewer digits.
        if _change(gap, slopes, states)[2]:
            return
    if reduced.names.t in (gap.left - gap.right).free_symbols:
        says = "changed by no motion: it depends on t alone"
    elif abs(level) <= _STILL * size:
        says = "closed at every configuration"
    elif level > 0:
        says = "never closed"
    else:
        stated = _constraints_that_hold(reduced, gap)
        hint = leave_out([*stated, gap.name]) if stated else _FREE
        raise _refusal(gap, "is violated at every configuration", hint)
    raise _refusal(gap, f"is {says}", "\n".join([_FREE, *_holding(reduced, gap)]))


def _change(
    gap: ClosureEquation, slopes: Mapping[sp.Symbol, sp.Expr], states: Sequence[SamplePoint]
) -> tuple[mpf, mpf, bool]:
    """Return φ and the size of its terms at the first state, and true if φ differs at another."""
    terms = [*sp.Add.make_args(gap.left), *sp.Add.make_args(gap.right)]
    symbols = sorted(set().union(*(e.free_symbols for e in (*slopes.values(), *terms))), key=str)
    points = [{s: state[s] for s in symbols} for state in states]
    level, *parts = evaluate([gap.left - gap.right, *slopes.values(), *terms], points[0])
    steepness = dict(zip(slopes, parts, strict=False))
    size = sum(map(abs, parts[len(slopes) :]), mpf(0))
    rounding = mpf(10) ** (_LOST - mpmath.mp.dps) * size
    for point in points[1:]:
        moves = (abs(g * (point[s] - points[0][s])) for s, g in steepness.items() if s in point)
        change = evaluate([gap.left - gap.right], point)[0] - level
        if abs(change) > max(_STILL * sum(moves, mpf(0)), rounding):
            return level, size, True
    return level, size, False


def _constraints_that_hold(reduced: Reduced, gap: ClosureEquation) -> list[str]:
    """Constraints that determine the names of a gap, or are kept beside them."""
    elimination = reduced.chart.geometry.elimination
    symbols = _names_in(reduced, gap)
    stated = [
        elimination.stated[elimination.by[s]].constraint for s in symbols if s in elimination.by
    ]
    present = (gap.left - gap.right).free_symbols
    for closure in reduced.closures:
        if present & (closure.left - closure.right).free_symbols:
            stated.append(closure.name)
    return list(dict.fromkeys(stated))


def _names_in(reduced: Reduced, gap: ClosureEquation) -> list[sp.Symbol]:
    one_sided = next(u for u in reduced.scene.unilateral if u.name == gap.name)
    return sorted(gap_over_names(reduced.names, one_sided).free_symbols, key=str)


def _holding(reduced: Reduced, gap: ClosureEquation) -> Iterator[str]:
    """Name the constraints and definitions that keep a gap from changing."""
    stated = _constraints_that_hold(reduced, gap)
    if stated:
        yield f"constraints that hold it: {quoted(stated)}"
    defined = [s.name for s in _names_in(reduced, gap) if s in reduced.names.given]
    if defined:
        yield f"take {', '.join(defined)} as coordinates instead of defining them"


def _neighbours(reduced: Reduced) -> list[SamplePoint]:
    """A configuration and some next to it, at the same t and parameters."""
    sampler, manifold = reduced.sampler([]), reduced.manifold()
    point = sampler.draw()
    points = [] if point is None else [point]
    differences = [gap.left - gap.right for gap in reduced.gaps]
    for count in range(_TRIALS if point is not None else 0):
        moved = manifold.placed(sampler.near(points[0], mpf(2) ** -(1 + count)))
        if moved is None:
            continue
        try:
            evaluate(differences, moved)
        except DomainError:
            continue
        points.append(moved)
        if len(points) > _ENOUGH:
            break
    return points


def _refusal(gap: ClosureEquation, says: str, hint: str) -> InputError:
    return InputError(
        Problem(f"the one-sided constraint '{gap.name}' {says}", gap.mark, hint, rule="one-sided")
    )
