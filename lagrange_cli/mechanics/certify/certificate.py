"""Certificate: derived equations compared with Newton's law and Lagrange's equations.

No derivation is shown unchecked. At random feasible states, in high precision, the residual
M q̈ − f is compared by routes that share nothing with the derivation,

* with Newton's law: m r̈ − F, contracted with virtual displacements (so that
  constraint forces, orthogonal to them, drop out), where r̈ comes from series
  arithmetic along the motion and ∂r/∂q from a backward sweep;
* with d/dt ∂L/∂q̇ − ∂L/∂q − Q, evaluated from the Lagrangian that is shown, by
  a backward sweep over series.

Closures are checked beside them (:mod:`.constraints`), at states that satisfy them.
T, V, velocities and generalized forces, as reported, are compared with the
scene's as well, since equations alone do not tell an energy from one that
differs by a total derivative.

No derivative taken symbolically enters either. The same evaluations show coordinates that are not
cyclic and an energy function that is not conserved; facts that they do not refute are proven
elsewhere (:mod:`.facts`).
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, InternalError, Mark, NotRealError, Problem
from lagrange_cli.mechanics.certify.constraints import ClosureCheck
from lagrange_cli.mechanics.certify.routes import Observation, Tapes
from lagrange_cli.mechanics.diagnosis.errors import nesting_error
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.findings import Certificate
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.numerics.bounded_functions import nothing_vanishes
from lagrange_cli.mechanics.numerics.elementary import (
    DecimalRow,
    DecimalValues,
    in_decimals,
    numbers_as_decimals,
    to_decimal,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.numerics.sampling import to_double, working_digits
from lagrange_cli.mechanics.system import Closure
from lagrange_cli.scene.model import Scene
from lagrange_cli.stages import announce

_ZERO, _NONE = mpf(0), Decimal(0)

#: Doubles that have all their digits.
_RANGE = mpf(2) ** -1022, mpf(2) ** 1023

#: Draws, each closer to the initial configuration, before the scene is called singular there.
_DRAWS = 60

#: Relative change with more digits up to which a number counts as nonzero, not as rounding.
_AGREEMENT = Decimal("1e-3")
#: Additional digits of that second evaluation.
_MORE_DIGITS = 30

#: Digits at which a mismatch is looked at again: two numbers that doubles hold, with their squares,
#: are 10^1200 apart at most.
CLOSE_DIGITS = 1300

#: Negative exponent of numbers that then count as zero: less than a product of doubles can be.
_CLOSE_NOTHING = 700

#: States at which reported values are compared with declared ones.
_THOROUGH = 2

#: Number of coordinates → most states that are checked above it: a wrong equation is wrong almost
#: everywhere, and few terms among many vanish at one state in a hundred.
_STATES = ((64, 1), (24, 2))


@dataclass(frozen=True)
class Evidence:
    """A passed certificate with the findings of its evaluations.

    Attributes
    ----------
    cyclic
        For each coordinate, true if ∂L/∂q vanished at every state, and no closure or
        contact acts on it.
    forced
        For each coordinate, true if a generalized force did not vanish.
    energy_conserved
        True if d/dt (Σ q̇ ∂L/∂q̇ − L) = Q·q̇ − ∂L/∂t vanished at every state, and
        no closure or contact does work: none is moved in time.
    energy_is_sum
        True if Σ q̇ ∂L/∂q̇ − L equals T + V (V without velocities) at every state.
        These four are about states near the start until :func:`.facts.proven` has proven
        them of all.
    mass_matrices
        M at each state, as doubles, by rows without zeros.
    states
        The states themselves (symbol → value).
    residuals
        M q̈ − f − Σ λ·gradient at the first state, each with the size of its terms.
    energy
        Σ q̇ ∂L/∂q̇ − L at the first state, with the size of its terms.
    look_closely
        Looks at the first state with so many digits that rounding is nothing.
    value
        Evaluates an expression over t, q, v and parameters at the first state, in the working
        precision; parts that it shares with T, V and L are taken from their tape.
    gradients
        Gradients of the closures at each state, in the same way.
    beyond
        A coordinate, by number, whose entry of M is too large or small for a double.
    """

    certificate: Certificate
    cyclic: tuple[bool, ...]
    forced: tuple[bool, ...]
    energy_conserved: bool
    energy_is_sum: bool
    mass_matrices: tuple[list[dict[int, float]], ...]
    states: tuple[SymbolValues, ...]
    residuals: tuple[tuple[mpf, mpf], ...]
    energy: tuple[mpf, mpf]
    look_closely: Callable[[], Look]
    value: Callable[[sp.Expr], mpf]
    gradients: tuple[list[dict[int, float]], ...]
    beyond: tuple[int, mpf] | None


@dataclass
class Look:
    """Findings at one state; fields as in :class:`Evidence` where these have one name.

    Attributes
    ----------
    mismatch
        Largest relative mismatch of the derivation.
    mass
        Rows of the mass matrix.
    vanishes
        For each delicate number, true if it is zero or nothing but rounding.
    residuals
        Residual of each equation of motion, with the size of its terms.
    energy
        Σ q̇ ∂L/∂q̇ − L, with the size of its terms.
    gradients
        Rows of the closures' gradients.
    beyond
        First diagonal entry of M that no double holds, with its index; None if all are held.
    """

    mismatch: mpf
    mass: list[dict[int, float]]
    vanishes: list[bool]
    residuals: list[tuple[mpf, mpf]]
    energy: tuple[mpf, mpf]
    gradients: list[dict[int, float]]
    beyond: tuple[int, mpf] | None


def certify(derivation: Uncertified, digits: int, points: int) -> Evidence:
    """Check a derivation at random states by the routes of this module.

    Parameters
    ----------
    digits
        Decimal digits that must agree (the arithmetic carries more).
    points
        Number of random states; at most two above 24 coordinates, one above 64.

    Raises
    ------
    InternalError
        The derivation disagrees with Newton's law or with the Lagrangian.
    InputError
        The scene's expressions are not real near its initial configuration.
    """
    number = len(derivation.reduced.coordinates)
    points = min(points, next((most for n, most in _STATES if number > n), points))
    with mpmath.workdps(working_digits(digits)):
        try:
            tapes = Tapes(derivation)
            closures = ClosureCheck(derivation, tapes)
        except DomainError as error:
            raise not_real(derivation.reduced.scene) from error
        tolerance = mpf(10) ** (5 - digits)
        states: list[SymbolValues] = []
        seen: list[Look] = []
        known = [False] * (2 * tapes.n + 2)
        for point in _points(derivation, closures, points):
            announce(f"certifying the equations at state {len(seen) + 1} of {points}")
            try:
                thorough = len(seen) < _THOROUGH
                state = _look(tapes, closures, point, known, thorough=thorough)
                if state.mismatch > tolerance:
                    with nothing_vanishes():
                        state = _looked_at_closely(tapes, closures, point, known, thorough=thorough)
                seen.append(state)
                known = [k or not zero for k, zero in zip(known, state.vanishes, strict=True)]
                states.append(point)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue
            if len(seen) == points:
                break
        if len(seen) < points:
            raise not_real(derivation.reduced.scene)
        worst = max((s.mismatch for s in seen), default=_ZERO)
    if worst > tolerance:
        size = f"mismatch {mpmath.nstr(worst, 3)} at {digits} digits"
        raise InternalError(Problem(f"the derived equations disagree with Newton's law: {size}"))
    certificate = Certificate(points, digits, to_double(worst))

    def look_closely() -> Look:
        return _looked_at_closely(tapes, closures, states[0], known, thorough=False)

    def value(expression: sp.Expr) -> mpf:
        return tapes.value(expression, states[0])

    vanishes = [not k for k in known]
    return _evidence(derivation.pushing, certificate, states, seen, vanishes, look_closely, value)


def _evidence(
    closures: Sequence[Closure],
    certificate: Certificate,
    states: Sequence[SymbolValues],
    seen: Sequence[Look],
    vanishes: Sequence[bool],
    look_closely: Callable[[], Look],
    value: Callable[[sp.Expr], mpf],
) -> Evidence:
    n = len(vanishes) // 2 - 1
    acted_on = {j for closure in closures for j in closure.coordinate_numbers}
    return Evidence(
        certificate,
        tuple(vanishes[j] and j not in acted_on for j in range(n)),
        tuple(not zero for zero in vanishes[n : 2 * n]),
        vanishes[2 * n] and all(c.rate == 0 for c in closures),
        vanishes[2 * n + 1],
        tuple(s.mass for s in seen),
        tuple(states),
        tuple(seen[0].residuals) if seen else (),
        seen[0].energy if seen else (_ZERO, _ZERO),
        look_closely,
        value,
        tuple(s.gradients for s in seen),
        next((s.beyond for s in seen if s.beyond is not None), None),
    )


@contextmanager
def explained(scene: Scene) -> Iterator[None]:
    """Turn errors of expressions without values or nested too deeply into refusals of the scene."""
    try:
        yield
    except DomainError:
        raise not_real(scene) from None
    except RecursionError:
        raise nesting_error(scene) from None


def not_real(scene: Scene) -> InputError:
    """The refusal of a scene whose expressions have no values around its configuration."""
    mark = scene.initial[0].mark if scene.initial else Mark(scene.file, 1, 1)
    return NotRealError(
        Problem(
            "the scene's expressions are not finite real numbers at any configuration tried"
            + (" near the initial one" if scene.initial else ""),
            mark,
            hint="" if scene.initial else "give a configuration in 'initial' or 'near'",
            rule="not-real",
        )
    )


def _points(
    derivation: Uncertified, closures: ClosureCheck, points: int
) -> Iterable[dict[sp.Symbol, mpf]]:
    reduced = derivation.reduced
    sampler = reduced.sampler([], seed=reduced.scene.digest)
    for k in range(_DRAWS + points):
        width = mpf(2) ** -(max(0, k - points) // 4)
        point = sampler.draw(vary_parameters=k < _DRAWS // 2, width=width)
        if point is None:
            return
        for c in reduced.coordinates:
            scale = sampler.spread(c.q)
            # Time has units of its own: velocities may have to be far smaller where they are
            # bounded.
            point[c.v] = sampler.noise(scale * width**3)
            point[c.a] = sampler.noise(scale)
        yield closures.draw(point, sampler)


def _look(
    tapes: Tapes,
    closures: ClosureCheck,
    state: SymbolValues,
    known: Sequence[bool],
    *,
    thorough: bool,
    least: mpf = _ZERO,
) -> Look:
    """Compare all routes at one state.

    Parameters
    ----------
    known
        For each delicate number, true if it did not vanish at an earlier state.
    thorough
        Compare reported values with the declared ones, too.
    least
        Difference up to which two numbers are the same.
    """
    with in_decimals():
        point = numbers_as_decimals(state)
        return _compared(tapes, closures, point, known, thorough, to_decimal(least))


def _compared(
    tapes: Tapes,
    closures: ClosureCheck,
    point: DecimalValues,
    known: Sequence[bool],
    thorough: bool,
    least: Decimal,
) -> Look:
    """Compare as :func:`_look` does, in decimals."""
    n = tapes.n
    mass, forcing = tapes.derived_parts(point)
    seen = tapes.observe(point)
    newton = tapes.newton(seen.series, seen.forces)
    momenta, slopes = tapes.momenta(seen), tapes.slopes(seen)
    constraint = closures.forces(point)
    mismatch = _NONE
    residuals = []
    inertias = [[x * point[tapes.a[k]] for k, x in row.items() if x] for row in mass]
    derived = [sum(terms, -force) for terms, force in zip(inertias, forcing, strict=True)]
    lacking = [ours - theirs for ours, (theirs, _) in zip(derived, newton, strict=True)]
    gradients = closures.gradients(point)
    lacking = closures.without_lengths(lacking, gradients)
    stated = [momenta[j][1] - slopes[j][0] - seen.forces[j] for j in range(n)]
    apart = [ours - lagrange for ours, lagrange in zip(derived, stated, strict=True)]
    if closures.is_by_recursion:
        apart = closures.without_lengths(apart, gradients)
    for j in range(n):
        ours, inertia = derived[j], inertias[j]
        scale = sum((abs(x) for x in inertia), abs(forcing[j])) + abs(momenta[j][1])
        size = sum(map(abs, constraint[j]), scale)
        residuals.append((to_mpf(ours - sum(constraint[j])), to_mpf(size)))
        scale += newton[j][1]
        difference = max(abs(lacking[j]), abs(apart[j]))
        if difference > least:
            mismatch = max(mismatch, difference / scale if scale else difference)
    for off, scale in _reports(tapes, closures, seen, gradients) if thorough else ():
        if abs(off) > least:
            mismatch = max(mismatch, abs(off) / scale)
    mismatch = max(mismatch, closures.mismatch(point, least))
    if thorough:
        mismatch = max(
            mismatch, closures.newton_mismatch(seen, mass, forcing, [s for _, s in newton])
        )
    vanishes = _vanishing(tapes, seen, known)
    energy, terms = tapes.energy_function(seen)
    return Look(
        to_mpf(mismatch),
        _doubles(mass),
        vanishes,
        residuals,
        (to_mpf(energy), to_mpf(terms)),
        _doubles(gradients),
        _beyond(mass, to_mpf(least)),
    )


def _reports(
    tapes: Tapes, closures: ClosureCheck, seen: Observation, gradients: Sequence[DecimalRow]
) -> Iterator[tuple[Decimal, Decimal]]:
    """Yield differences of reported values; forces by recursion have no part along lengths."""
    values, works = tapes.reports(seen)
    yield from values
    if closures.is_by_recursion and works:
        across = closures.without_lengths([off for off, _ in works], gradients)
        works = [(off, max(size for _, size in works)) for off in across]
    yield from works


def _looked_at_closely(
    tapes: Tapes,
    closures: ClosureCheck,
    point: SymbolValues,
    known: Sequence[bool],
    *,
    thorough: bool,
) -> Look:
    """Compare at a state with so many digits that rounding alone makes no mismatch.

    If numbers of very different sizes occur, as 1 and a displacement of 1e-150, terms cancel to
    more digits than are carried; a mismatch that remains here is a real one. A force whose terms
    cancel altogether is nothing but rounding, which has no digits to agree in.
    """
    with mpmath.workdps(CLOSE_DIGITS):
        least = mpf(10) ** -_CLOSE_NOTHING
        return _look(tapes, closures, point, known, thorough=thorough, least=least)


def _beyond(rows: Sequence[DecimalRow], least: mpf) -> tuple[int, mpf] | None:
    """Find the first number on the diagonal that is neither 0 nor a double with all its digits.

    Numbers up to ``least`` count as 0.
    """
    for j, row in enumerate(rows):
        size = to_mpf(abs(row.get(j, _NONE)))
        if size > least and not _RANGE[0] <= size <= _RANGE[1]:
            return j, size
    return None


def _doubles(rows: Sequence[DecimalRow]) -> list[dict[int, float]]:
    return [{j: to_double(x) for j, x in row.items()} for row in rows]


def _vanishing(tapes: Tapes, seen: Observation, known: Sequence[bool]) -> list[bool]:
    """For each delicate number, tell whether it is zero or nothing but rounding.

    With more digits the rounding error of a zero shrinks, and any other number stays. There are so
    many digits that nothing is lost beside the largest number on the way. Numbers known not to
    vanish are not examined, and are False.
    """
    first = tapes.delicate(seen)
    zero = [x == 0 and not k for x, k in zip(first, known, strict=True)]
    if all(map(operator.or_, zero, known)):
        return zero
    more = _MORE_DIGITS + min(max(0, seen.magnitude), CLOSE_DIGITS)
    with mpmath.workdps(mpmath.mp.dps + more), in_decimals():
        second = tapes.delicate(tapes.observe(seen.point, order=0))
    return [
        z or (not k and abs(y - x) > _AGREEMENT * abs(x))
        for z, k, x, y in zip(zero, known, first, second, strict=True)
    ]
