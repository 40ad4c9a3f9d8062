"""Pipeline from equilibria at several values of a parameter to their marked branches."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import mpmath
import numpy as np
from mpmath import mpf
from scipy.optimize import linear_sum_assignment

from lagrange_cli.analysis.branches.curve import Space, row_sizes
from lagrange_cli.analysis.branches.functions import BranchFunctions
from lagrange_cli.analysis.branches.marked_curve import Traced, within_range
from lagrange_cli.analysis.branches.poles import first_order_in_doubles
from lagrange_cli.analysis.branches.refining import amid
from lagrange_cli.analysis.branches.stability import Judge
from lagrange_cli.analysis.branches.tracing import Tracing
from lagrange_cli.analysis.branches.values import Branch, Branches, Locus, Stretch
from lagrange_cli.analysis.equilibria.repeats import without_repeats
from lagrange_cli.analysis.equilibria.search import search, usual_length
from lagrange_cli.analysis.values import DIGITS
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.phrases import Phrase
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lagrange_cli.analysis.branches.curve import CurvePoint
    from lagrange_cli.analysis.branches.parameter import Varied
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.analysis.values import Matrix


#: Parts of the range at which equilibria are sought: no round ones, at which branches would meet.
_PLACES = (0.0, 0.1371, 0.3093, 0.5021, 0.6907, 0.8629, 1.0)

#: Parts of a branch at which it is compared with others: branches may meet at some of them.
_COMPARED = (0.0, 0.29, 0.63, 1.0)

#: Unknowns beside the parameter; systems of equations of marked points are twice as large.
MOST_UNKNOWNS = 24

#: Part of the range by which branches are followed beyond its ends.
_BEYOND = 0.02

#: Part of the largest pole of a branch by which a pole moves between neighbouring points at most:
#: a step that a picture of a root locus does not show.
_FAR = 0.01
#: Halvings of an interval: poles that meet move as the root of the parameter.
_HALVINGS = 12
#: Points of a locus at most, a bound of its time.
_MOST = 2000


def find_branches(system: RestSystem, varied: Varied) -> Branches:
    """Find branches of equilibria over a parameter.

    Raises
    ------
    InputError
        Equilibria are not isolated, there are too many unknowns, or another parameter has no value.
    """
    _require_branches(system)
    seeds, starts, working = _seeds(system, varied)
    functions = BranchFunctions(system, varied.parameter.symbol, varied.follows)
    if not functions.is_square:
        message = Phrase("equilibria come in continua: fewer equations than coordinates hold them")
        raise InputError(Problem(message, rule="analysis-branches"))
    space = _space(working, varied, functions, seeds)
    announce("following branches")
    tracing = Tracing(space)
    for seed in seeds:
        tracing.start_at(seed)
    tracing.finish()
    low, high = float(varied.low), float(varied.high)
    tracing.branches[:] = [
        part for b in tracing.branches for part in within_range(space, b, low, high)
    ]
    announce("judging stability")
    judge = Judge(system, varied, space)
    _leave_out_repeats(tracing, judge)
    return _gathered(system, varied, tracing, judge, starts)


def _require_branches(system: RestSystem) -> None:
    if any(c.kind == "velocity" for c in system.equations.system.closures):
        message = Phrase("with constraints between velocities equilibria come in continua")
        raise InputError(Problem(message, rule="analysis-branches"))
    size = len(system.unknowns)
    if size > MOST_UNKNOWNS:
        message = Phrase(
            "{count} coordinates and multipliers are more than the {most} of which branches are"
            " followed",
            count=str(size),
            most=str(MOST_UNKNOWNS),
        )
        raise InputError(Problem(message, rule="analysis-size"))
    if not size:
        message = Phrase("no force depends on a coordinate")
        raise InputError(Problem(message, rule="analysis-branches"))


def _seeds(system: RestSystem, varied: Varied) -> tuple[list[Matrix], int, RestSystem]:
    """Search for equilibria at values of the parameter; return the last system, too."""
    moving = [k for k in range(len(system.equations.system.coordinates)) if k not in system.free]
    seeds, starts, valued = [], 0, system
    for part in _PLACES:
        with mpmath.workdps(DIGITS):
            value = varied.low + mpf(part) * (varied.high - varied.low)
        try:
            valued = system.with_parameters(varied.values(value, system.known))
        except DomainError:
            continue
        announce(f"looking for equilibria at {varied.parameter.name} = {float(value):.6g}")
        outcome = search(valued)
        starts += outcome.starts
        for point in outcome.points:
            position, multipliers = point.position or (), point.multipliers or ()
            numbers = [*(position[k] for k in moving), *multipliers, value]
            seeds.append(np.array([float(x) for x in numbers]))
    return seeds, starts, valued


def _space(
    system: RestSystem, varied: Varied, functions: BranchFunctions, seeds: Sequence[Matrix]
) -> Space:
    coordinates = [system.equations.system.coordinates[k] for k in functions.moving]
    length = usual_length(system)
    sizes = [1.0 if c.is_angle or c.unit == "rad" else length for c in coordinates]
    width = float(varied.high - varied.low)
    count = len(coordinates)
    pushes = np.abs(np.array(seeds)[:, count:-1]).max(axis=0) if seeds else np.zeros(0)
    largest = float(pushes.max(initial=0.0)) or 1.0
    scale = np.array([*sizes, *[largest] * functions.multipliers, width])
    turns = np.zeros(functions.size + 1)
    turns[:count] = [2 * np.pi if k in system.periodic else 0.0 for k in functions.moving]
    positive = [k for k, c in enumerate(coordinates) if c.q.is_positive]

    def allows(y: Matrix) -> bool:
        return all(y[k] > 0 for k in positive)

    rows = row_sizes(functions, seeds, scale)
    low, high = _followed(varied, functions, seeds)
    return Space(functions, scale, rows, low, high, turns, allows)


def _followed(
    varied: Varied, functions: BranchFunctions, seeds: Sequence[Matrix]
) -> tuple[float, float]:
    """Return a range a little wider than the parameter's, where forces have values beyond its ends.

    Folds and branch points at the ends are so passed, and seen.
    """
    low, high = float(varied.low), float(varied.high)
    room = _BEYOND * (high - low)
    below = low - (min(room, low / 2) if varied.parameter.positive else room)

    def reached(end: float, beyond: float) -> float:
        return beyond if all(_has_values(functions, y, beyond) for y in seeds) else end

    return reached(low, below), reached(high, high + room)


def _has_values(functions: BranchFunctions, seed: Matrix, value: float) -> bool:
    return all(np.isfinite(x).all() for x in functions.residuals(np.append(seed[:-1], value)))


def _leave_out_repeats(tracing: Tracing, judge: Judge) -> None:
    """Drop branches that repeat the places of all particles, as (r, φ) and (-r, φ + π) do."""
    distinct: list[Traced] = []
    for branch in tracing.branches:
        last = len(branch.points) - 1
        shown = (branch.points[round(part * last)].y for part in _COMPARED)
        if not distinct or not all(_is_elsewhere_too(tracing, judge, distinct, y) for y in shown):
            distinct.append(branch)
    tracing.branches[:] = distinct


def _is_elsewhere_too(tracing: Tracing, judge: Judge, known: list[Traced], y: Matrix) -> bool:
    """Say whether a branch puts all particles in the same places at the same parameter."""
    value = float(y[-1])
    neighbours = [point for branch in known for point in tracing.at(branch, value)]
    places = [judge.equilibrium(point) for point in [*neighbours, y]]
    different = without_repeats(judge.system_at(mpf(value)), places)
    return all(place is not places[-1] for place in different)


def _gathered(
    system: RestSystem, varied: Varied, tracing: Tracing, judge: Judge, starts: int
) -> Branches:
    """Judge stretches and marks, and return all branches as values."""
    stretches = [judge.stretches(branch) for branch in tracing.branches]
    marks = {id(m): m for b in tracing.branches for _, m in b.marks}
    ordered = sorted(marks.values(), key=lambda m: (float(m.y[-1]), m.y.tolist()))
    marked_points = tuple(judge.marked(mark) for mark in ordered)
    numbers = {id(mark): k for k, mark in enumerate(ordered)}
    names = [c.name for c in system.equations.system.coordinates]
    branches = tuple(
        _branch(system, tracing.space, branch, numbers, parts)
        for branch, parts in zip(tracing.branches, stretches, strict=True)
    )
    return Branches(
        varied.parameter.name,
        float(varied.low),
        float(varied.high),
        branches,
        marked_points,
        len(_PLACES),
        starts,
        tracing.skipped,
        tracing.left,
        system.held_inputs,
        tuple(names[k] for k in system.free),
        tuple(names[k] for k in sorted(system.periodic)),
    )


def _branch(
    system: RestSystem,
    space: Space,
    branch: Traced,
    numbers: dict[int, int],
    stretches: tuple[Stretch, ...],
) -> Branch:
    table = np.array([p.y for p in branch.points])
    positions = np.tile([float(x) for x in system.start], (len(table), 1))
    positions[:, list(space.functions.moving)] = table[:, : len(space.functions.moving)]
    marks = tuple((k, numbers[id(mark)]) for k, mark in branch.marks)
    poles = locus(space, branch.points)
    return Branch(table[:, -1], positions, branch.ends, marks, stretches, poles)


def locus(space: Space, points: Sequence[CurvePoint]) -> Locus:
    """Follow the poles along a branch, except at points where coordinates are singular."""
    places = [point.y for point in points]
    poles = _poles(space, places)
    for _ in range(_HALVINGS):
        size = max((float(np.abs(p).max(initial=0.0)) for p in poles if p is not None), default=0.0)
        jumps = [_jump(before, after) for before, after in pairwise(poles)]
        far = [k for k, jump in enumerate(jumps) if jump > _FAR * size]
        if not far or len(places) + len(far) > _MOST:
            break
        between = {k: y for k in far if (y := amid(space, places[k], places[k + 1])) is not None}
        new_poles = dict(zip(between, _poles(space, list(between.values())), strict=True))
        for k in sorted(between, reverse=True):
            places.insert(k + 1, between[k])
            poles.insert(k + 1, new_poles[k])
    known = [(y[-1], p) for y, p in zip(places, poles, strict=True) if p is not None]
    if not known:
        return Locus(np.empty(0), np.empty((0, 0), dtype=complex))
    values, rows = zip(*known, strict=True)
    return Locus(np.array(values), _in_turn(rows))


def _poles(space: Space, places: Sequence[Matrix]) -> list[NDArray[np.complex128] | None]:
    """Compute the poles at points, in doubles; None where coordinates are singular."""
    if not places:
        return []
    tables = space.functions.small_motions(np.array(places).T)
    systems = (first_order_in_doubles(*(table[k] for table in tables)) for k in range(len(places)))
    return [None if s is None else np.linalg.eigvals(s[0]).astype(complex) for s in systems]


def _jump(before: NDArray[np.complex128] | None, after: NDArray[np.complex128] | None) -> float:
    """Return the largest distance that a pole moves; 0 if numbers of poles differ."""
    if before is None or after is None or before.shape != after.shape:
        return 0.0
    moved = before - after[_pairing(before, after)]
    return float(np.abs(moved).max(initial=0.0))


def _pairing(before: NDArray[np.complex128], after: NDArray[np.complex128]) -> NDArray[np.intp]:
    """Return for each pole the number of the one that it becomes."""
    return np.asarray(linear_sum_assignment(np.abs(before[:, None] - after))[1])


def _in_turn(rows: Sequence[NDArray[np.complex128]]) -> NDArray[np.complex128]:
    """Sort poles into columns in which they move least; rows of another length become NaN."""
    ordered = [rows[0][np.lexsort((rows[0].imag, rows[0].real))]]
    for row in rows[1:]:
        if row.shape == ordered[0].shape:
            ordered.append(row[_pairing(ordered[-1], row)])
        else:
            ordered.append(np.full_like(ordered[0], np.nan))
    return np.array(ordered)
