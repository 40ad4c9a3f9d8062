"""Exact motions of a particle of mass 1 past a smooth pulse of the time or of its position.

It starts at x = 0 with dot(x) = 1. The force is A f((t − c)/w) or A f((x − c)/w). In time,
velocity and place are areas under f in closed form; in position, v² is such an area by
conservation of energy, and the time is the integral of 1/v. Where v vanishes the particle turns
and goes back through the same speeds. All in the digits of mpmath's context.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate, pairwise

from mpmath import mp, mpf

#: A function of s = (place − c)/w.
Shape = Callable[[mpf], mpf]

#: Beyond this the exponential in log cosh(s) is less than any digit.
_LARGE = 200


def _log_cosh(s: mpf) -> mpf:
    return abs(s) + mp.log1p(mp.exp(-2 * abs(s))) - mp.log(2)


def _area_of_log_cosh(s: mpf) -> mpf:
    """Integrate log cosh from 0, by the dilogarithm."""
    a = abs(s)
    dilogarithm = mp.polylog(2, -mp.exp(-2 * a)) if a < _LARGE else 0
    area = a * a / 2 - a * mp.log(2) + (dilogarithm + mp.pi**2 / 12) / 2
    return area if s > 0 else -area


def _area_of_power(s: mpf) -> mpf:
    """Integrate (1 + s²)^(-8) from 0, by the formula that lowers the exponent."""
    area = mp.atan(s)
    for n in range(2, 9):
        area = s / (2 * (n - 1) * (1 + s * s) ** (n - 1)) + mpf(2 * n - 3) / (2 * n - 2) * area
    return area


def _gauss(s: mpf) -> mpf:
    return mp.sqrt(mp.pi) / 2 * mp.erf(s)


#: Name of a pulse → its area from 0, and an area of that.
AREAS: Mapping[str, tuple[Shape, Shape]] = {
    "Gauss": (_gauss, lambda s: s * _gauss(s) + mp.exp(-s * s) / 2),
    "Lorentz": (mp.atan, lambda s: s * mp.atan(s) - mp.log1p(s * s) / 2),
    "sech²": (mp.tanh, _log_cosh),
    "tanh difference": (
        lambda s: (_log_cosh(s + 1) - _log_cosh(s - 1)) / 2,
        lambda s: (_area_of_log_cosh(s + 1) - _area_of_log_cosh(s - 1)) / 2,
    ),
    "power": (_area_of_power, lambda s: s * _area_of_power(s) + (1 + s * s) ** -7 / mpf(14)),
}


def past_a_moment(
    kind: str, numbers: Mapping[str, float], times: Sequence[float]
) -> list[tuple[mpf, mpf]]:
    """x and its rate at some times, struck at the time c."""
    strength, w, c = (mpf(numbers[name]) for name in ("A", "w", "c"))
    area, second = AREAS[kind]
    start, found = -c / w, []
    for t in map(mpf, times):
        s = (t - c) / w
        way = second(s) - second(start) - (s - start) * area(start)
        found.append((t + strength * w**2 * way, 1 + strength * w * (area(s) - area(start))))
    return found


def past_a_place(
    kind: str, numbers: Mapping[str, float], times: Sequence[float]
) -> list[tuple[mpf, mpf]]:
    """x and its rate at some times, struck at x = c."""
    flight = _Flight(kind, numbers, mpf(times[-1]))
    return [flight.at(mpf(t)) for t in times]


class _Flight:
    """Motion along s = (x − c)/w in a field of force, until it has taken some time."""

    def __init__(self, kind: str, numbers: Mapping[str, float], until: mpf) -> None:
        self._strength, self._w, self._c = (mpf(numbers[name]) for name in ("A", "w", "c"))
        self._area = AREAS[kind][0]
        start = -self._c / self._w
        self._first = self._area(start)
        # Speeds are at most 3: the strongest push of the campaign gives v² = 1 + 4.
        reach = 4 * (until + 1) / self._w
        beside = [mpf(2) ** k for k in range(-2, 40) if mpf(2) ** k < reach]
        marks = sorted({-reach, start, mpf(0), reach, *beside, *(-s for s in beside)})
        self._marks, self._turns = self._until_turn(marks)
        seconds = [self._seconds(a, b) for a, b in pairwise(self._marks)]
        known = list(accumulate(seconds, initial=mpf(0)))
        self._times = [t - known[self._marks.index(start)] for t in known]

    def _square(self, s: mpf) -> mpf:
        """The square of the speed."""
        return 1 + 2 * self._strength * self._w * (self._area(s) - self._first)

    def _until_turn(self, marks: Sequence[mpf]) -> tuple[list[mpf], bool]:
        """Return the marks before the place at which the particle turns, and that; all if none."""
        for k, (low, high) in enumerate(pairwise(marks)):
            if self._square(high) <= 0:
                for _ in range(4 * mp.dps):
                    middle = (low + high) / 2
                    low, high = (middle, high) if self._square(middle) > 0 else (low, middle)
                return [*marks[: k + 1], low], True
        return list(marks), False

    def _seconds(self, low: mpf, high: mpf) -> mpf:
        """Time from one place to another on the way there."""
        if not self._turns:
            return self._w * mp.quad(lambda s: 1 / mp.sqrt(self._square(s)), [low, high])
        # Beside the turn v² is linear in s: u² = turn − s takes the root away.
        turn = self._marks[-1]

        def by_root(u: mpf) -> mpf:
            square = self._square(turn - u * u)
            return 2 * u / mp.sqrt(square) if square > 0 else mpf(0)

        return self._w * mp.quad(by_root, [mp.sqrt(turn - high), mp.sqrt(turn - low)])

    def at(self, t: mpf) -> tuple[mpf, mpf]:
        """Place and rate at a time."""
        turned = self._turns and t > self._times[-1]
        s = self._place(2 * self._times[-1] - t if turned else t)
        speed = mp.sqrt(max(self._square(s), mpf(0)))
        return self._c + self._w * s, -speed if turned else speed

    def _place(self, t: mpf) -> mpf:
        """Place at a time before the turn, by Newton's method within bounds."""
        k = max(k for k, known in enumerate(self._times[:-1]) if known <= t)
        first, low, high = self._marks[k], self._marks[k], self._marks[k + 1]
        s = low
        for _ in range(100):
            late = self._times[k] + self._seconds(first, s) - t
            low, high = (low, s) if late > 0 else (s, high)
            new = s - late * mp.sqrt(max(self._square(s), mpf(0))) / self._w
            if not low < new < high:
                new = (low + high) / 2
            if abs(new - s) <= mpf(10) ** -22 * (1 + abs(s)):
                return new
            s = new
        return s
