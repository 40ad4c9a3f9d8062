"""Refuse infeasible one-sided constraints: a smallest set of them, with its proof.

A proof is a false nonnegative sum of the constraints (Farkas' lemma, :mod:`.proofs.farkas`) or a
sum-of-squares certificate (:mod:`.proofs.sum_of_squares`). Without one, the refusal reports a
failed search.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, InputError, Problem
from lagrange_cli.mechanics.contacts.feasibility import FeasibilitySearch
from lagrange_cli.mechanics.diagnosis.errors import equations_behind
from lagrange_cli.mechanics.diagnosis.inconsistency import irreducible_subset, is_contradictory
from lagrange_cli.mechanics.diagnosis.rod_lengths import overlong_rod_error
from lagrange_cli.mechanics.elimination.eliminate import StatedEquation, substitute
from lagrange_cli.mechanics.elimination.solve_equation import linear_parts
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.farkas import FalseSum, false_sum
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import (
    contradict,
    leave_out,
    one_sided_snippet,
    quoted,
    written,
)
from lagrange_cli.scene.model import Unilateral

#: Most constraints among which a smallest set is sought by proofs. This and the numbers below keep
#: a refusal quick; beyond them it names more constraints, or gives no proof. None is tuned.
_MOST = 40
#: Most constraints among which a smallest set is sought by searches.
_MOST_SEARCHES = 12
#: Starts of the search that precedes a proof.
_FIRST = 8
#: Most constraints in a sum that a message writes out.
_WRITTEN = 4
#: Doublings and halvings of the trial distance by which a constraint is missed.
_DOUBLINGS = 16
#: Bisections of that distance.
_BISECTIONS = 12
#: Digits of numbers in messages.
_DIGITS = 3
#: Factor by which a proposed bound exceeds the distance that is missed.
_MORE = mpf("1.1")


def require_feasible(reduced: Reduced) -> None:
    """Refuse one-sided constraints that no configuration satisfies.

    Raises
    ------
    InputError
        A smallest set that contradicts itself, with its proof; or one for which no
        configuration came up.
    """
    search = FeasibilitySearch(reduced)
    if not reduced.gaps or search.configuration(starts=_FIRST) is not None:
        return
    one_sided = [_stated(reduced.names, u) for u in reduced.scene.unilateral]
    proven = _proven(reduced, [*reduced.chart.geometry.elimination.stated, *one_sided])
    if proven is not None:
        raise proven
    valued = len(reduced.values.exact) == len(reduced.scene.parameters)
    if valued and search.configuration() is None:
        refusal = _not_found(reduced, search)
        if refusal is not None:
            raise refusal


def _stated(names: Names, one_sided: Unilateral) -> StatedEquation:
    """Return the inequality over the names in which it is written, left ≥ right."""
    written_down = one_sided.inequality
    left, right = names.convert(written_down.left), names.convert(written_down.right)
    if written_down.relation == "<=":
        left, right = right, left
    return StatedEquation(one_sided.name, written_down, left, right, one_sided=True)


def _squared(stated: StatedEquation, constants: Mapping[sp.Symbol, mpf]) -> StatedEquation:
    """Write ``norm(x, z) <= l`` as x² + z² ≤ l², a sum of squares; leave others."""
    roots = [p for p in stated.phi.atoms(sp.Pow) if p.exp == sp.Rational(1, 2)]
    roots = [p for p in roots if not p.free_symbols <= constants.keys()]
    if len(roots) != 1:
        return stated
    place = sp.Dummy(real=True)
    parts = linear_parts(stated.phi.xreplace({roots[0]: place}), place)
    if parts is None or not all(e.free_symbols <= constants.keys() for e in parts):
        return stated
    share, bound = evaluate(list(parts), constants)
    if share * bound > 0:
        return stated
    wide, narrow = parts[0] ** 2 * roots[0].base, parts[1] ** 2
    left, right = (wide, narrow) if share > 0 else (narrow, wide)
    return replace(stated, left=left, right=right)


def _proven(reduced: Reduced, stated: Sequence[StatedEquation]) -> InputError | None:
    """Return the error of a smallest set that is proven to contradict itself."""
    names, reference = reduced.names, reduced.reference
    parameters = reduced.names.parameters
    constants = {parameters[n]: reference[parameters[n]] for n in reduced.values.exact}
    stated = [_squared(s, constants) if s.one_sided else s for s in stated]
    total = _false_sum(names, stated, constants)
    if total is not None:
        chosen = [stated[k] for k in total.shares]
        last = next((s for s in reversed(chosen) if s.one_sided), chosen[-1])
        missing = total.shortfall / abs(total.shares[stated.index(last)])
        if total.bounds and len(chosen) <= _WRITTEN:  # others may say more than their sum
            premises = [s for s in chosen if s is not last]
            missing = _missed(names, premises, last, constants) or missing
        return _refusal(reduced, chosen, _sum(chosen, total), last, missing)
    rods = overlong_rod_error(names, stated, reference)
    if rods is not None or len(stated) > _MOST:
        return rods

    def wrong(numbers: Sequence[int]) -> bool:
        return is_contradictory(names, [stated[k] for k in numbers], constants)

    everything = range(len(stated))
    if not wrong(everything):
        return None
    chosen = [stated[k] for k in irreducible_subset(everything, wrong)]
    return _by_squares(reduced, chosen, constants)


def _false_sum(
    names: Names, stated: Sequence[StatedEquation], constants: Mapping[sp.Symbol, mpf]
) -> FalseSum | None:
    """Find a false sum of constraints with definitions put in."""
    parameters = frozenset(names.parameters.values())
    declared = set(names.coordinates.values())
    unknowns = [s for s in names.cartesian.values() if s not in names.given and s not in declared]
    state = substitute([], names.given, unknowns, parameters)
    return false_sum([(state.reduce(s.phi), s.one_sided) for s in stated], constants)


def _sum(chosen: Sequence[StatedEquation], total: FalseSum) -> str:
    """Write the phrase ``their sum a + 2*b says 0 >= 3``."""
    unit = min(abs(x) for x in total.shares.values())
    shares = [x / unit for x in total.shares.values()]
    what = "it"
    if len(chosen) > 1:
        plain = all(_number(x) == "1" for x in shares)
        what = "their sum" if plain else "their sum, with factors,"
        if len(chosen) <= _WRITTEN:
            what = f"their sum {_products(chosen, shares)}"
    says = f"0 >= {_number(total.shortfall / unit)}"
    if not total.shortfall:
        factors = (sp.Rational(_number(x)) for x in shares)
        left = sp.Add(*(x * s.phi for x, s in zip(factors, chosen, strict=True)))
        says = f"{written(sp.expand(left))} >= 0"
    known = f", as {', '.join(sorted(total.bounds)[:_WRITTEN])}" if total.bounds else ""
    return f"{what} says {says}{known}"


def _products(chosen: Sequence[StatedEquation], shares: Sequence[mpf]) -> str:
    """Write a sum of the names of constraints with factors, positive ones first."""
    parts = []
    for stated, share in sorted(zip(chosen, shares, strict=True), key=lambda x: x[1] < 0):
        factor = "" if _number(abs(share)) == "1" else f"{_number(abs(share))}*"
        sign = "-" if share < 0 else "+"
        parts.append(f"{sign} {factor}{stated.constraint}")
    return " ".join(parts).removeprefix("+ ")


def _number(x: mpf) -> str:
    return f"{float(x):.{_DIGITS}g}"


def _by_squares(
    reduced: Reduced, chosen: Sequence[StatedEquation], constants: Mapping[sp.Symbol, mpf]
) -> InputError:
    """Return the error of a set that a sum of squares refutes, with the miss of its last one."""
    names = reduced.names
    last = next(s for s in reversed(chosen) if s.one_sided)
    premises = [s for s in chosen if s is not last]
    symbols = sorted({str(x) for s in chosen for x in s.phi.free_symbols} - {*names.parameters})
    why = f"no real {', '.join(symbols[:_WRITTEN])} satisfies {'them' if premises else 'it'}"
    missed = _missed(names, premises, last, constants)
    if missed is not None:
        where = f"where {quoted([s.constraint for s in premises])} holds, " if premises else ""
        if len(premises) > 1:
            where = where.replace(" holds", " hold")
        why = f"{where}{_reached(names, last, missed, constants)}"
    return _refusal(reduced, chosen, why, last, missed)


def _reached(
    names: Names, last: StatedEquation, missed: mpf, constants: Mapping[sp.Symbol, mpf]
) -> str:
    """Write the phrase ``z is at most 1`` if the other side is a number."""
    if (last.right.free_symbols | last.left.free_symbols) - constants.keys():
        for moving, fixed, word, sign in (
            (last.left, last.right, "most", -1),
            (last.right, last.left, "least", 1),
        ):
            if fixed.free_symbols <= constants.keys():
                (bound,) = evaluate([fixed], constants)
                return f"{written(moving)} is at {word} {_number(bound + sign * missed)}"
    return f"{written(last.phi)} is at most -{_number(missed)}"


def _missed(
    names: Names,
    premises: Sequence[StatedEquation],
    last: StatedEquation,
    constants: Mapping[sp.Symbol, mpf],
) -> mpf | None:
    """Find a number that −φ provably exceeds if the premises hold; None without proof."""

    def fails(by: mpf) -> bool:
        moved = replace(last, left=last.left + sp.Rational(str(by)))
        return is_contradictory(names, [*premises, moved], constants, products=(False,))

    step = mpf(1)
    for _ in range(_DOUBLINGS):
        if fails(step):
            break
        step /= 2
    else:
        return None
    low = step
    for _ in range(_DOUBLINGS):
        if not fails(2 * low):
            break
        low *= 2
    high = 2 * low
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if fails(middle) else (low, middle)
    return low


def _refusal(
    reduced: Reduced,
    chosen: Sequence[StatedEquation],
    why: str,
    last: StatedEquation,
    missing: mpf | None,
) -> InputError:
    """Build the error; ``last`` would be feasible with its bound moved by ``missing``."""
    named = [s.constraint for s in chosen]
    what = contradict(named)
    hints = [leave_out(named)]
    line = _wider(reduced, last, missing) if missing else ""
    if line:
        hints = [f"{hints[0]}, or give it more room:", line]
    mark = chosen[-1].equation.mark()
    return InconsistentError(Problem(f"{what}: {why}", mark, "\n".join(hints), rule="inconsistent"))


def _wider(reduced: Reduced, stated: StatedEquation, missing: mpf) -> str:
    """A one-sided constraint as YAML with a feasible bound; empty where none is found."""
    pairs = zip(reduced.scene.unilateral, reduced.gaps, strict=True)
    stating = [(one, gap) for one, gap in pairs if one.name == stated.constraint]
    if not stated.one_sided or not stating:
        return ""
    ((one_sided, gap),) = stating
    phi, reference = gap.left - gap.right, reduced.reference
    if phi.free_symbols <= reference.keys():  # the given values have to satisfy it too
        with contextlib.suppress(DomainError):
            missing = max(missing, -evaluate([phi], {s: reference[s] for s in phi.free_symbols})[0])
    more = sp.Rational(mpmath.nstr(missing * _MORE, 2))
    moved = replace(gap, left=gap.left + more)
    gaps = [moved if g is gap else g for g in reduced.gaps]
    if FeasibilitySearch(reduced, gaps).configuration() is None:
        return ""
    bound = reduced.names.convert(one_sided.inequality.right)
    return one_sided_snippet(one_sided, more, bound)


def _not_found(reduced: Reduced, search: FeasibilitySearch) -> InputError | None:
    """Return the error of a smallest set without known configuration, unproven.

    None for an inequality by itself: tan z >= 1e300 holds, where no search finds it.
    """
    closures, gaps = [*range(len(search.closures))], [*range(len(search.gaps))]
    if len(gaps) <= _MOST_SEARCHES:
        gaps = irreducible_subset(gaps, lambda fewer: search.configuration(closures, fewer) is None)
    if 0 < len(closures) <= _MOST_SEARCHES and search.configuration([], gaps) is not None:
        closures = irreducible_subset(
            closures, lambda fewer: search.configuration(fewer, gaps) is None
        )
    elif search.configuration([], gaps) is None:
        closures = []
    named = [*_beside(reduced, search, closures, gaps), *(search.gaps[k].name for k in gaps)]
    if len(named) == 1:
        return None
    return InconsistentError(
        Problem(
            f"no configuration found in {search.starts} starts that satisfies {quoted(named)}",
            search.gaps[gaps[-1]].mark,
            hint=f"give one in 'initial' or 'near', or {leave_out(named)}",
            rule="inconsistent",
        )
    )


def _beside(
    reduced: Reduced, search: FeasibilitySearch, closures: Sequence[int], gaps: Sequence[int]
) -> list[str]:
    """Constraints that are kept, or were put into what a gap is written in."""
    names, elimination = reduced.names, reduced.chart.geometry.elimination
    chosen = {search.gaps[k].name for k in gaps}
    sources: set[int] = set()
    for one_sided in reduced.scene.unilateral:
        if one_sided.name in chosen:
            sources |= elimination.sources_of(_stated(names, one_sided).phi)
    closure_names = {search.closures[k].name for k in closures}
    numbers = [k for k, s in enumerate(elimination.stated) if s.constraint in closure_names]
    return [s.constraint for s in equations_behind(elimination, sorted(sources | {*numbers}))]
