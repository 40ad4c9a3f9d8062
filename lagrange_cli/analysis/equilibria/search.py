"""Equilibria found in numbers: Newton's method from many starts, polished in many digits.

Starts are drawn about the initial configuration and about zero, with a fixed seed, and move side by
side in doubles by the method of Levenberg and Marquardt (Nocedal and Wright, Numerical
Optimization, 2006, section 10.3). Newton's method in 50 digits goes on from where they end, and
a point counts as an equilibrium if a proof follows (:mod:`.existence`). How many there are is not
known: a search says from how many starts it found what it found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.existence import EquilibriumProver, is_of_potential
from lagrange_cli.analysis.equilibria.release import Release
from lagrange_cli.analysis.equilibria.repeats import distance
from lagrange_cli.analysis.equilibria.rest_functions import RestFunctions
from lagrange_cli.analysis.equilibria.rest_system import RestSystem
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Matrix, Mpf, NearBalance
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

# Budgets are counts of operations, so that outputs do not depend on the speed of a machine. More
# starts and steps take longer and miss fewer equilibria; the values are not tuned.

#: Starts, at most and at least.
_MOST_STARTS, _FEWEST_STARTS = 256, 16
#: The work of all: values of the graph times starts, and unknowns cubed times starts.
_WORK, _SOLVING = 400_000, 10_000_000
#: Values of the graph that are found in digits, over all points.
_DIGIT_WORK = 1_500_000
#: Steps of a start.
_STEPS = 80
#: Damping of the first step, relative to the squares of the columns, and how it changes.
_DAMPING, _DOWN, _UP = 1e-2, 1 / 5, 4.0
#: Distances of starts in units of the largest length in sight.
_WIDTHS = (0.5, 1.0, 2.0, 6.0)
#: Points farther than this many lengths are on their way to infinity.
_FAR = 1e6
#: Residual, relative to its row, at which digits are asked.
_NEAR = 1e-6
#: Newton steps in digits that reach a simple root.
_FEWEST_STEPS = 8
#: The same at most: multiple roots gain one bit a step.
_POLISHING = 100
#: Steps after which one is to be shorter than half of an earlier one.
_WANDER = 8
#: Size of a step, relative to the point, that ends them, and one after which a proof is tried.
_LAST, _SETTLED = mpf(10) ** -45, mpf(10) ** -3
#: Difference below which equilibria are one, and below which doubtful points are.
_SAME, _DOUBTFUL = mpf(10) ** -25, mpf(10) ** -2
#: Relative difference of potentials above which continua are several.
_LEVEL = mpf(10) ** -9
#: Doubtful points that are kept.
_MOST_DOUBTFUL = 4
#: Ends of starts that are closer are one.
_CLOSE = 1e-5
#: Different equilibria that are kept.
_MOST_POINTS = 64
#: Singular values below which a step is not taken.
_CUT = 1e-13


@dataclass(frozen=True)
class SearchResult:
    """The outcome of a search.

    Attributes
    ----------
    points
        Equilibria, each with a proof that it exists.
    unproven
        Configurations near which numbers balance, without a proof of an equilibrium.
    starts
        Number of starts.
    """

    points: list[Equilibrium]
    unproven: tuple[NearBalance, ...]
    starts: int


def search(system: RestSystem) -> SearchResult:
    """Search for equilibria.

    Raises
    ------
    InputError
        A parameter lacks its value.
    """
    system.require_values()
    functions, prover = system.functions, EquilibriumProver(system)
    size = functions.n + functions.m
    affordable = min(_WORK // functions.operations, _SOLVING // size**3)
    starts = max(_FEWEST_STARTS, min(_MOST_STARTS, affordable))
    points: list[Equilibrium] = []
    doubtful: list[tuple[Mpf, ...]] = []
    release = Release(system, usual_length(system))
    ends = [
        end
        for end in _different(system, _moved(system, _starts(system, starts)))
        if not release.moves(end[: functions.n])
    ][:_MOST_POINTS]
    steps = max(_FEWEST_STEPS, _DIGIT_WORK // functions.operations // max(1, len(ends)))
    for unknown in ends:
        end = _approached(system, unknown, steps)
        if end is None:
            continue
        point = _established(prover, end)
        if isinstance(point, Equilibrium):
            if all(_differ(system, point, known) for known in points):
                points.append(point)
        elif point is not None:
            doubtful.append(point)
    near = _apart(system, doubtful, [p.position or () for p in points])
    unproven = tuple(NearBalance(position, prover.free) for position in near)
    return SearchResult(_without_continua(system, points), unproven, starts)


def with_exact(
    system: RestSystem, exact: Sequence[Equilibrium], result: SearchResult
) -> list[Equilibrium]:
    """Add exact equilibria to those of a search; of a continuum of both one is kept."""
    if all(point.isolated for point in result.points):
        return [*exact, *result.points]
    prover = EquilibriumProver(system)
    points = [
        replace(p, isolated=near is None or near.isolated)
        for p in exact
        for near in [prover.established([*(p.position or ()), *(p.multipliers or ())])]
    ]
    return _without_continua(system, [*points, *result.points])


def _apart(
    system: RestSystem, doubtful: Sequence[tuple[Mpf, ...]], known: Sequence[Sequence[Mpf]]
) -> tuple[tuple[Mpf, ...], ...]:
    """Keep a few positions that are neither close to one another nor to known ones."""
    chosen: list[tuple[Mpf, ...]] = []
    for position in sorted(doubtful, key=lambda p: distance(system, p, system.start)):
        if all(distance(system, position, near) > _DOUBTFUL for near in (*known, *chosen)):
            chosen.append(position)
    return tuple(chosen[:_MOST_DOUBTFUL])


def _different(system: RestSystem, ends: Matrix) -> list[list[float]]:
    """Drop ends that are close to earlier ones."""
    numbers = [k for k in range(len(system.equations.system.coordinates)) if k not in system.free]
    turning = np.array([k in system.periodic for k in numbers], dtype=bool)
    distinct: list[list[float]] = []
    chosen = np.zeros((0, len(numbers)))
    for end in ends:
        place = end[numbers]
        gaps = np.abs(chosen - place)
        turned = np.abs(gaps - 2 * np.pi * np.round(gaps / (2 * np.pi)))
        sizes = np.where(turning, turned, gaps / np.maximum(1, np.abs(place)))
        if (sizes.max(axis=1, initial=0.0) > _CLOSE).all():
            distinct.append(end.tolist())
            chosen = np.vstack([chosen, place])
    return distinct


def _differ(system: RestSystem, first: Equilibrium, second: Equilibrium) -> bool:
    known = mpf(first.uncertainty) + mpf(second.uncertainty)
    gap = distance(system, first.position or (), second.position or ())
    return bool(gap > max(known, _SAME))


def _without_continua(system: RestSystem, points: list[Equilibrium]) -> list[Equilibrium]:
    """Keep of the points of each continuum the one that is nearest to the start.

    Along a continuum a potential stays as it is: points at which it differs are of several ones.
    """
    continua = [p for p in points if not p.isolated]
    nearest: list[tuple[Equilibrium, list[Mpf]]] = []
    for point in sorted(continua, key=lambda p: distance(system, p.position or (), system.start)):
        terms = _potential_terms(system, point)
        if all(_is_apart(terms, known) for _, known in nearest):
            nearest.append((point, terms))
    return [*(p for p in points if p.isolated), *(p for p, _ in nearest)]


def _potential_terms(system: RestSystem, point: Equilibrium) -> list[Mpf]:
    """Evaluate the terms of the potential at an equilibrium; none where other forces balance."""
    if not is_of_potential(system) or point.position is None:
        return []
    coordinates = system.equations.system.coordinates
    place = {c.q: x for c, x in zip(coordinates, point.position, strict=True)}
    still = system.equations.system.potential.xreplace({system.equations.system.t: sp.S.Zero})
    try:
        with mpmath.workdps(DIGITS):
            return evaluate([*sp.Add.make_args(still)], {**system.known, **place})
    except (DomainError, KeyError):
        return []


def _is_apart(first: Sequence[Mpf], second: Sequence[Mpf]) -> bool:
    """Say whether two sums differ, relative to their terms."""
    sizes = map(abs, (*first, *second))
    difference = abs(sum(first, mpf(0)) - sum(second, mpf(0)))
    return bool(difference > _LEVEL * max(sizes, default=mpf(0)))


def _starts(system: RestSystem, count: int) -> Matrix:
    """Draw positions, shape (n, count): the initial ones and zeros first."""
    random = np.random.default_rng(0)
    coordinates = system.equations.system.coordinates
    start = np.array([float(x) for x in system.start])
    length = usual_length(system)
    angles = np.array([c.is_angle or c.unit == "rad" for c in coordinates])
    points = np.zeros((len(coordinates), count))
    points[:, 0] = start
    for column in range(2, count):
        width = _WIDTHS[column % len(_WIDTHS)] * length
        center = start if column % 2 else np.zeros_like(start)
        drawn = center + width * random.uniform(-1, 1, len(start))
        turn = random.uniform(-np.pi, np.pi, len(start))
        points[:, column] = np.where(angles, turn, drawn)
    for k, c in enumerate(coordinates):
        if c.q.is_positive:
            points[k] = np.abs(points[k]) + (points[k] == 0.0) * usual_length(system)
    for k in system.free:
        points[k] = start[k]
    return points


def usual_length(system: RestSystem) -> float:
    """Return the largest length in the initial configuration, else among the parameters, else 1."""
    coordinates = system.equations.system.coordinates
    pairs = zip(coordinates, system.start, strict=True)
    lengths = [abs(float(x)) for c, x in pairs if not c.is_angle]
    units = {c.unit for c in coordinates if c.unit and not c.is_angle} - {"rad"}
    lengths += [
        abs(p.value)
        for p in system.equations.system.parameters
        if p.value is not None and p.unit in units
    ]
    return max((x for x in lengths if 0 < x < _FAR), default=1.0)


@np.errstate(over="ignore", invalid="ignore")
def _moved(system: RestSystem, positions: Matrix) -> Matrix:
    """Move starts towards equilibria; return the ends close to one, shape (ends, n + m)."""
    functions = system.functions
    fixed = list(system.free)
    unknown = np.vstack([positions, _multipliers(functions, positions)])
    damping = np.full(positions.shape[1], _DAMPING)
    level, jacobian = _finite(functions, unknown, fixed)
    rows = _row_sizes(jacobian)
    cost = _cost(level, rows)
    for _ in range(_STEPS):
        step = _step(level / rows, jacobian / rows[:, None], damping)
        trial = unknown - step.T
        there, slopes = _finite(functions, trial, fixed)
        after = _cost(there, rows)
        better = after < cost
        damping = np.where(better, damping * _DOWN, damping * _UP).clip(1e-15, 1e12)
        unknown = np.where(better, trial, unknown)
        level = np.where(better[:, None], there, level)
        jacobian = np.where(better[:, None, None], slopes, jacobian)
        cost = np.where(better, after, cost)
    size = np.abs(unknown[: functions.n]).max(axis=0)
    near = np.isfinite(cost) & (cost < _NEAR**2) & (size < _FAR * usual_length(system))
    return np.asarray(unknown[:, near].T)


def _finite(
    functions: RestFunctions, unknown: Matrix, fixed: Sequence[int]
) -> tuple[Matrix, Matrix]:
    """Evaluate residuals; where they have no values, they are infinite with no slopes."""
    level, jacobian = functions.residuals(unknown)
    jacobian[:, :, fixed] = 0.0
    wrong = ~(np.isfinite(level).all(axis=1) & np.isfinite(jacobian).all(axis=(1, 2)))
    level[wrong], jacobian[wrong] = np.inf, 0.0
    return level, jacobian


def _row_sizes(jacobian: Matrix) -> Matrix:
    """Return the usual size of each row of the Jacobian matrix, 1 where it is zero."""
    sizes = np.median(np.abs(jacobian).max(axis=2), axis=0)
    return np.where(sizes > 0, sizes, 1.0)


def _cost(level: Matrix, rows: Matrix) -> Matrix:
    return np.asarray(((level / rows) ** 2).sum(axis=1))


def _step(level: Matrix, jacobian: Matrix, damping: Matrix) -> Matrix:
    """Find the damped least-squares steps, shape (points, unknowns)."""
    transposed = np.swapaxes(jacobian, 1, 2)
    normal = transposed @ jacobian
    size = np.einsum("kii->ki", normal)
    scale = np.maximum(size, size.max(axis=1, keepdims=True) * 1e-12) + 1e-300
    diagonal = np.arange(normal.shape[1])
    normal[:, diagonal, diagonal] += damping[:, None] * scale
    slope = transposed @ np.where(np.isfinite(level), level, 0.0)[:, :, None]
    return np.asarray(np.linalg.solve(normal, slope)[:, :, 0])


def _multipliers(functions: RestFunctions, positions: Matrix) -> Matrix:
    """Find the multipliers that balance forces best, shape (m, points)."""
    n, m, count = functions.n, functions.m, positions.shape[1]
    level, jacobian = functions.residuals(np.vstack([positions, np.zeros((m, count))]))
    multipliers = np.zeros((m, count))
    for k in range(count if m else 0):
        gradient, force = jacobian[k, :n, n:], level[k, :n]
        if np.isfinite(gradient).all() and np.isfinite(force).all():
            multipliers[:, k] = np.linalg.lstsq(gradient, -force, rcond=1e-9)[0]
    return multipliers


def polished(system: RestSystem, unknown: Sequence[float]) -> Equilibrium | None:
    """Return the equilibrium near a point; None if it is not proven that there is one.

    ``unknown``: positions and multipliers close to it.
    """
    end = _approached(system, unknown, _POLISHING)
    point = None if end is None else _established(EquilibriumProver(system), end)
    return point if isinstance(point, Equilibrium) else None


@dataclass(frozen=True)
class _End:
    """The last point of Newton's method, and the size of its last step, relative to the point."""

    unknown: list[Mpf]
    step: Mpf


def _approached(system: RestSystem, unknown: Sequence[float], steps: int) -> _End | None:
    """Approach an equilibrium by Newton's method in 50 digits; None where there are no values.

    Residuals and derivatives have all digits, steps are solved for in doubles.
    """
    functions = system.functions
    n, m = functions.n, functions.m
    moving = [k for k in range(n + m) if k not in system.free]
    with mpmath.workdps(DIGITS):
        x = [mpf(float(value)) for value in unknown]
        for k in system.free:
            x[k] = system.start[k]
        sizes = [mpf("inf")]
        try:
            for _ in range(min(steps, _POLISHING)):
                level, jacobian = _system_at(functions, x, moving)
                step = _newton_step(jacobian, level)
                for k, change in zip(moving, step, strict=True):
                    x[k] -= change
                pairs = zip(moving, step, strict=True)
                sizes.append(max((abs(s) / max(1, abs(x[k])) for k, s in pairs), default=mpf(0)))
                wanders = len(sizes) > _WANDER and sizes[-1] > sizes[-_WANDER] / 2
                if sizes[-1] < _LAST or wanders:
                    break
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None
    return _End(x, sizes[-1])


def _established(prover: EquilibriumProver, end: _End) -> Equilibrium | tuple[Mpf, ...] | None:
    """Return an equilibrium that is proven, or a position where numbers balance, or None."""
    system, n = prover.system, prover.system.functions.n
    if end.step > _SETTLED or not system.allows(end.unknown[:n]):
        return None
    with mpmath.workdps(DIGITS):
        unknown = [*_within_turns(system, end.unknown[:n]), *end.unknown[n:]]
    point = prover.established(unknown)
    if point is not None:
        return point if system.allows(point.position or ()) else None
    return None if prover.is_excluded(unknown) else tuple(unknown[:n])


def _within_turns(system: RestSystem, position: Sequence[Mpf]) -> tuple[Mpf, ...]:
    return tuple(_within_turn(x) if k in system.periodic else x for k, x in enumerate(position))


def _within_turn(angle: Mpf) -> Mpf:
    turned = angle - 2 * mpmath.pi * mpmath.nint(angle / (2 * mpmath.pi))
    return turned + 2 * mpmath.pi if turned <= -mpmath.pi + mpf(10) ** -30 else turned


def _system_at(
    functions: RestFunctions, x: Sequence[Mpf], moving: Sequence[int]
) -> tuple[list[Mpf], Matrix]:
    """Evaluate all residuals, and in doubles their derivatives by the unknowns that move."""
    _, jacobian = functions.residuals(np.array([[float(value)] for value in x]))
    if not np.isfinite(jacobian).all():
        raise DomainError
    return functions.levels_at(x[: functions.n], x[functions.n :]), jacobian[0][:, list(moving)]


def _newton_step(jacobian: Matrix, level: Sequence[Mpf]) -> list[Mpf]:
    """Solve J x = r with least squares and least norm."""
    sizes = np.abs(jacobian).max(axis=1, initial=0.0)
    sizes[sizes == 0.0] = 1.0
    rows = jacobian / sizes[:, None]
    right = [r / mpf(float(s)) for r, s in zip(level, sizes, strict=True)]
    largest = max(map(abs, right), default=mpf(0))
    if not largest:
        return [mpf(0)] * jacobian.shape[1]
    target = np.array([float(r / largest) for r in right])
    step = np.linalg.lstsq(rows, target, rcond=_CUT)[0]
    return [largest * mpf(x) for x in step.tolist()]
