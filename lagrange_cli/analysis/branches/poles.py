"""Poles of small motions along branches, and points at which pairs leave the imaginary axis.

In doubles poles are counted at all points; in digits a crossing is a zero of an analytic function
along the branch: the real part of a pair that crosses singly, or (s₁ − s₂)² of two pairs that meet
on the axis, as those of circulatory and gyroscopic systems without damping do (A. P. Seyranian and
A. A. Mailybaev, Multiparameter Stability Theory with Mechanical Applications, 2003).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mpmath
import numpy as np
from mpmath import mpf

from lagrange_cli.analysis.branches.singular_points import Located, point_at
from lagrange_cli.analysis.linear.first_order import first_order
from lagrange_cli.analysis.linear.linearize import linear_system
from lagrange_cli.analysis.values import DIGITS, Equilibrium, Matrix, Mpf
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.numerics.autodiff import DomainError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lagrange_cli.analysis.branches.curve import Space
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem

#: Real part of a pole, relative to the largest pole, that counts in doubles, and in digits.
_COARSE, _FINE = 1e-6, mpf(10) ** -15
#: Eigenvalue of M⁻¹K, relative to the largest, that counts as zero.
_FLAT = 1e-9
#: Steps of the search for a zero, and the part of the interval at which it ends.
_STEPS, _LAST = 60, mpf(10) ** -24
#: Distance of neighbours of a point at which corrections are not determined, over the chord.
_ASIDE = mpf(10) ** -13
#: States up to which poles are found in digits.
MOST_STATES = 16


@dataclass(frozen=True)
class Counts:
    """Numbers of poles with a positive real part, and of negative eigenvalues of M⁻¹K."""

    unstable: int
    negative: int


def counted(space: Space, points: Sequence[Matrix]) -> list[Counts | None]:
    """Count poles at points; None where coordinates are singular."""
    if not points:
        return []
    tables = space.functions.small_motions(np.array(points).T)
    return [_counts(*(table[k] for table in tables)) for k in range(len(points))]


def _counts(mass: Matrix, damping: Matrix, stiffness: Matrix, gradients: Matrix) -> Counts | None:
    known = first_order_in_doubles(mass, damping, stiffness, gradients)
    if known is None:
        return None
    poles, squares = map(np.linalg.eigvals, known)
    size = float(np.abs(poles).max(initial=0.0))
    height = float(np.abs(squares).max(initial=0.0))
    negative = (squares.real < -_FLAT * height) & (np.abs(squares.imag) <= _FLAT * height)
    return Counts(int((poles.real > _COARSE * size).sum()), int(negative.sum()))


def first_order_in_doubles(
    mass: Matrix, damping: Matrix, stiffness: Matrix, gradients: Matrix
) -> tuple[Matrix, Matrix] | None:
    """Write A of small motions that closures allow, and M⁻¹K; None where there are none."""
    if not all(np.isfinite(m).all() for m in (mass, damping, stiffness, gradients)):
        return None
    if len(gradients):
        _, sizes, rows = np.linalg.svd(gradients)
        rank = int((sizes > 1e-10 * sizes.max(initial=0.0)).sum())
        free = rows[rank:]
        mass, damping, stiffness = (free @ m @ free.T for m in (mass, damping, stiffness))
    n = len(mass)
    try:
        below = np.linalg.solve(mass, np.hstack([stiffness, damping]))
    except np.linalg.LinAlgError:
        return None
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-below[:, :n], -below[:, n:]]])
    square = np.asarray(below[:, :n], dtype=np.float64)
    return (a, square) if np.isfinite(a).all() else None


def equilibrium(system: RestSystem, space: Space, at: Located) -> Equilibrium:
    """Return a point of a branch as an equilibrium of the system at its parameter."""
    moving = space.functions.moving
    position = list(system.start)
    for k, x in zip(moving, at.y, strict=False):
        position[k] = x
    free = tuple(system.equations.system.coordinates[k].name for k in system.free)
    multipliers = at.y[len(moving) : -1]
    return Equilibrium(tuple(position), tuple(multipliers), free=free, uncertainty=at.radius)


#: Gives the system at a value of the parameter.
SystemAt = Callable[[Mpf], "RestSystem"]


def poles_at(system: RestSystem, space: Space, at: Located) -> list[mpmath.mpc]:
    """Find the poles at a point in digits.

    Raises
    ------
    InputError
        Coordinates are singular there.
    """
    place = equilibrium(system, space, at)
    linear = linear_system(system, place)
    with mpmath.workdps(DIGITS):
        return _eigenvalues(first_order(system, place, linear))


def _eigenvalues(matrix: mpmath.matrix) -> list[mpmath.mpc]:
    """Find eigenvalues in the digits that are set; mpmath.eig does not take one row."""
    if matrix.rows == 1:
        return [mpmath.mpc(matrix[0, 0])]
    return [mpmath.mpc(x) for x in mpmath.eig(matrix, left=False, right=False)]


@dataclass(frozen=True)
class AxisCrossing:
    """A point at which poles cross the imaginary axis, and the frequency if it is not zero."""

    at: Located
    frequency: float | None


@dataclass(frozen=True)
class CrossingSearch:
    """Looks for the point between two points of a branch where poles cross the axis.

    Attributes
    ----------
    space, system_at
        The branch's equations, and the system at a value of the parameter.
    """

    space: Space
    system_at: SystemAt

    def flutter(self, start: Matrix, end: Matrix) -> AxisCrossing | None:
        """Find the point where a pair leaves the axis; None if no measure changes its sign."""
        return self._found(_Chord(self.space, start, end), self._on_chord)

    def divergence(self, start: Matrix, end: Matrix) -> AxisCrossing | None:
        """Find the point where an eigenvalue of M⁻¹K changes its sign; None if none does."""
        return self._found(_Chord(self.space, start, end), self._flat_on_chord)

    def _found(
        self, chord: _Chord, look: Callable[[_Chord], AxisCrossing | None]
    ) -> AxisCrossing | None:
        try:
            return look(chord)
        except (InputError, DomainError, ZeroDivisionError, _LostError):
            return None

    def _poles(self, at: Located) -> list[mpmath.mpc]:
        return poles_at(self.system_at(at.y[-1]), self.space, at)

    def _on_chord(self, chord: _Chord) -> AxisCrossing | None:
        ends = [self._poles(chord.place(mpf(x))) for x in (0, 1)]
        unstable = max((0, 1), key=lambda k: max(p.real for p in ends[k]))
        leaving = max((p for p in ends[unstable] if p.imag > 0), key=lambda p: p.real, default=None)
        if leaving is None:
            return None
        mirrored = min(abs(p + mpmath.conj(leaving)) for p in ends[unstable])
        measure = _gap_of_two if mirrored < _FINE * abs(leaving) else _real_part
        near = leaving

        def value(part: Mpf) -> Mpf:
            nonlocal near
            number, near = measure(self._poles(chord.place(part)), near)
            return number

        at = self._zero_of(chord, value)
        if at is None:
            return None
        closest = min(self._poles(at), key=lambda p: abs(p - near))
        return AxisCrossing(at, float(closest.imag))

    def _flat_on_chord(self, chord: _Chord) -> AxisCrossing | None:
        at = self._zero_of(chord, lambda part: mpmath.re(self._flattest(chord.place(part))))
        if at is None:
            return None
        # Two that are not real pass zero beside it.
        sizes = [abs(self._flattest(chord.place(mpf(x)))) for x in (0, 1)]
        return AxisCrossing(at, None) if abs(self._flattest(at)) < _FINE * max(sizes) else None

    def _flattest(self, at: Located) -> mpmath.mpc:
        """Return the eigenvalue of M⁻¹K that is nearest to zero, but for drift."""
        system = self.system_at(at.y[-1])
        place = equilibrium(system, self.space, at)
        linear = linear_system(system, place)
        a = first_order(system, place, linear)
        k = len(linear.independent)
        positions = a.rows - k
        names = [c.name for c in system.equations.system.coordinates]
        rows = [
            positions + i for i, j in enumerate(linear.independent) if names[j] not in place.free
        ]
        with mpmath.workdps(DIGITS):
            square = mpmath.matrix(
                [[-a[row, column] for column in range(positions)] for row in rows]
            )
            return min(_eigenvalues(square), key=abs)

    def _zero_of(self, chord: _Chord, value: Callable[[Mpf], Mpf]) -> Located | None:
        bracket = _zero(value, (mpf(0), value(mpf(0))), (mpf(1), value(mpf(1))))
        if bracket is None:
            return None
        part, width = bracket
        at = chord.place(part)
        span = abs(chord.place(mpf(1)).y[-1] - chord.place(mpf(0)).y[-1])
        error = float(width * span / (self.space.high - self.space.low))
        return Located(at.y, max(at.error, error))


@dataclass(frozen=True)
class _Chord:
    """Points of a branch in digits, above a chord between two of its points."""

    space: Space
    start: Matrix
    end: Matrix

    def place(self, part: Mpf) -> Located:
        """Return the point above a part of the chord.

        Corrections are not determined where several eigenvalues vanish: there the point is the mean
        of two neighbours, with an error of the square of their distance.
        """
        at = self._corrected(part)
        if at is not None:
            return at
        near = [self._corrected(part + side) for side in (-_ASIDE, _ASIDE)]
        known = [x for x in near if x is not None]
        if len(known) < 2:
            raise _LostError
        with mpmath.workdps(DIGITS):
            y = tuple((a + b) / 2 for a, b in zip(known[0].y, known[1].y, strict=True))
        return Located(y, float(_ASIDE**2))

    def _corrected(self, part: Mpf) -> Located | None:
        chord = (self.end - self.start) / self.space.scale
        pairs = zip(self.start.tolist(), self.end.tolist(), strict=True)
        with mpmath.workdps(DIGITS):
            guess = [mpf(a) + part * (mpf(b) - mpf(a)) for a, b in pairs]
        return point_at(self.space, guess, chord / np.linalg.norm(chord))


class _LostError(Exception):
    """A point between two others could not be corrected."""


def _real_part(poles: Sequence[mpmath.mpc], near: mpmath.mpc) -> tuple[Mpf, mpmath.mpc]:
    """Measure the pole that is nearest to one on the way."""
    closest = min((p for p in poles if p.imag > 0), key=lambda p: abs(p - near), default=None)
    if closest is None:
        raise _LostError
    return closest.real, closest


def _gap_of_two(poles: Sequence[mpmath.mpc], near: mpmath.mpc) -> tuple[Mpf, mpmath.mpc]:
    """Measure (s₁ − s₂)² of the two poles that are nearest to their mean on the way."""
    centre = mpmath.mpc(0, near.imag)
    above = sorted((p for p in poles if p.imag > 0), key=lambda p: abs(p - centre))
    if len(above) < 2:
        raise _LostError
    first, second = above[:2]
    return ((first - second) ** 2).real, (first + second) / 2


def _zero(
    value: Callable[[Mpf], Mpf], left: tuple[Mpf, Mpf], right: tuple[Mpf, Mpf]
) -> tuple[Mpf, Mpf] | None:
    """Find a zero between two places with values of different sign (Illinois method).

    Returns it, and the width within which it is.
    """
    if left[1] * right[1] > 0:
        return None
    largest = max(abs(left[1]), abs(right[1]))
    with mpmath.workdps(DIGITS):
        last = abs(right[0] - left[0])
        for _ in range(_STEPS):
            if left[1] == right[1]:
                return None
            part = (left[0] * right[1] - right[0] * left[1]) / (right[1] - left[1])
            number = value(part)
            change = min(abs(part - left[0]), abs(part - right[0]))
            if (number == 0 or change < _LAST) and abs(number) > largest:
                return None  # it passes infinity
            if number == 0 or change < _LAST:
                return part, _LAST if number == 0 else change
            left = right if number * right[1] < 0 else (left[0], left[1] / 2)
            right = (part, number)
            last = min(last, change)
        return (right[0], last) if last < mpf(10) ** -12 else None
