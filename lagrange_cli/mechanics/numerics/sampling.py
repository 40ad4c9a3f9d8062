"""Random feasible configurations, reproducible by a seed.

Points are drawn around the initial configuration if the scene gives one, so that they
lie in its component of configuration space, and closer to it while the scene's
expressions are not real there.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate

_ONE = mpf(1)

SamplePoint = dict[sp.Symbol, mpf]
"""Time, coordinates and parameters → value."""

#: Most draws before a scene is said to have no configuration, while draws shrink towards the given
#: configuration: more would delay the refusal. Not tuned; messages name the number.
DRAWS = 200
#: Most draws if each starts a search for a point on closures, which costs more.
PLACED_DRAWS = 48

#: Way to a point on closures, relative to the spread of each coordinate, beyond which it may lie on
#: another branch than the given configuration, with another number of independent closures: from a
#: nearly singular matrix Newton's method leaps by thousands of turns. Not tuned.
_REACH = 4

#: Distance, relative to the spread of each coordinate, within which a point is the given one: where
#: gradients depend on each other, an equation that holds to 1e-9 places it to the root of that.
_SAME = mpf("1e-4")

#: Number of coordinates above which points on closures are drawn close to the initial
#: configuration: from far away, where no link has its length, Newton's method diverges.
_LARGE = 64


def typical_length(lengths: Sequence[mpf]) -> mpf:
    """Give the largest magnitude, 1 if there is none: the scale on which points are drawn."""
    largest = max((abs(x) for x in lengths), default=mpf(0))
    return largest if largest > 0 else mpf(1)


class Sampler:
    """Draws values for t, q and parameters.

    Parameters
    ----------
    t, coordinates
        Symbols that are drawn.
    values
        Symbol → value of the parameters that have one.
    free
        Parameters without a value, and inputs: drawn from (1/2, 3/2).
    center, spread
        Value and half-width for each coordinate.
    domain
        Expressions that must be real and finite at a feasible point.
    seed
        Text that fixes the sequence.
    place
        Moves a point onto the closures, or onto those with given numbers; returns None on failure.
    positive
        Expressions over t, coordinates and parameters that are positive at a feasible point.

    Attributes
    ----------
    t, coordinates
        As given.
    many
        True for closures in many coordinates.
    """

    def __init__(
        self,
        t: sp.Symbol,
        coordinates: Sequence[sp.Symbol],
        values: Mapping[sp.Symbol, mpf],
        free: Sequence[sp.Symbol],
        center: Mapping[sp.Symbol, mpf],
        spread: Mapping[sp.Symbol, mpf],
        domain: Sequence[sp.Expr],
        seed: str,
        place: Callable[[SamplePoint, Sequence[int] | None], SamplePoint | None] | None = None,
        positive: Sequence[sp.Expr] = (),
    ) -> None:
        self.t = t
        self._place = place
        self.many = place is not None and len(coordinates) > _LARGE
        # If no configuration is given, all coordinates are about 0, and no rod has its length.
        self._placed = any(center[q] != 0 for q in coordinates)
        self._starts = DRAWS if place is None else PLACED_DRAWS
        self.coordinates = list(coordinates)
        self._values = dict(values)
        self._free = list(free)
        self._center = center
        self._spread = spread
        self._random = random.Random(seed)
        self._symbols = [t, *self.coordinates, *self._values, *self._free]
        self._above = len(positive)
        self._tape = Tape([*positive, *domain], self._symbols)

    def draw(
        self,
        *,
        vary_parameters: bool = False,
        width: mpf = _ONE,
        closures: Sequence[int] | None = None,
    ) -> SamplePoint | None:
        """Draw a feasible point; None after :data:`DRAWS` (:data:`PLACED_DRAWS`) failures.

        ``vary_parameters`` multiplies values of parameters by factors in (1/2, 3/2)
        as long as that leaves the point feasible; ``width`` scales the spread; ``closures`` may
        select some closures by number. A point that closures are far from is returned only if
        none was found nearby.
        """
        far: SamplePoint | None = None
        if self.many and self._placed:
            width = width / (8 * len(self.coordinates))
        for attempt in range(self._starts):
            varied = vary_parameters and attempt < (1 if self.many else self._starts // 4)
            drawn = self.candidate(width, varied)
            point = drawn if self._place is None else self._place(drawn, closures)
            if point is not None and self._is_feasible(point):
                if self._is_near(drawn, point):
                    return point
                far = far or point
            # Around a given configuration, shrink towards it; otherwise draw again.
            width = width * 3 / 4 if attempt % 4 == 3 and width > mpf(2) ** -20 else width
        return far

    def opposite(self, point: SamplePoint) -> SamplePoint | None:
        """Reflect the coordinates of a point about the given ones; None if it is not feasible."""
        turned = {**point, **{q: 2 * self._center[q] - point[q] for q in self.coordinates}}
        return turned if self._is_feasible(turned) else None

    def is_given(self, point: SamplePoint) -> bool:
        """Tell whether a point is the given configuration, up to a singular point's rounding."""
        return all(
            abs(point[q] - self._center[q]) <= _SAME * self._spread[q] for q in self.coordinates
        )

    def _is_near(self, drawn: SamplePoint, placed: SamplePoint) -> bool:
        reaches = ((q, _REACH * self._spread[q]) for q in self.coordinates)
        return all(abs(placed[q] - drawn[q]) <= reach for q, reach in reaches)

    def _is_feasible(self, point: SamplePoint) -> bool:
        inputs = [(point[s], mpf(0), mpf(0)) for s in self._symbols]
        try:
            return self._tape.run(inputs, order=0).has_positive(self._above)
        except (DomainError, ZeroDivisionError, OverflowError):
            return False

    def near(self, point: SamplePoint, width: mpf) -> SamplePoint:
        """Move the coordinates of a point at random by ``width`` times their spread."""
        moved = dict(point)
        for q in self.coordinates:
            reach = width * self._spread[q]
            if q.is_positive:
                reach = min(reach, abs(point[q]) / 2)
            moved[q] += reach * self._uniform(-1, 1)
        return moved

    def around(self, point: SamplePoint, width: mpf) -> tuple[SamplePoint, SamplePoint]:
        """Move a point at random, and by the same amount in the opposite direction.

        A border through the point separates the two.
        """
        moved = self.near(point, width)
        opposite = {q: 2 * point[q] - moved[q] for q in self.coordinates}
        return moved, {**moved, **opposite}

    def _uniform(self, low: float, high: float) -> mpf:
        # 53 random bits and more, so that points are not special in any digit.
        return low + (high - low) * mpmath.ldexp(mpf(self._random.getrandbits(120)), -120)

    def candidate(self, width: mpf, varied: bool = False) -> SamplePoint:
        """Draw a random point that need not be feasible."""
        point = {self.t: self._uniform(0, 1)}
        for q in self.coordinates:
            value = self._center[q] + width * self._spread[q] * self._uniform(-1, 1)
            point[q] = abs(value) if q.is_positive else value
        for p, value in self._values.items():
            point[p] = value * self._uniform(0.5, 1.5) if varied else value
            if varied and value == 0:
                point[p] = self._uniform(0.5, 1.5)
        for p in self._free:
            point[p] = self._uniform(0.5, 1.5)
        return point

    def spread(self, q: sp.Symbol) -> mpf:
        """Give the half-width of a coordinate: the scale of its motion."""
        return self._spread[q]

    def noise(self, scale: mpf) -> mpf:
        """Draw a number in ``(-scale, scale)``, for velocities and accelerations."""
        return scale * self._uniform(-1, 1)


def values_at_points(expressions: Sequence[sp.Expr], draws: int) -> Iterator[list[mpf]]:
    """Yield values of expressions at points with irrational coordinates, where they are finite."""
    symbols = sorted(set().union(*map(symbols_in, expressions)), key=str)
    for first in range(1, draws + 1):
        point = {s: mpmath.frac(mpmath.sqrt(2) * (k + first)) for k, s in enumerate(symbols, 7)}
        try:
            values = evaluate(expressions, point)
        except (DomainError, ZeroDivisionError):
            continue
        yield values


def working_digits(digits: int) -> int:
    """Give the digits to calculate with so that ``digits`` remain after cancellation."""
    return digits + 20


def to_double(x: mpf) -> float:
    """Round to the nearest double, ±inf beyond range."""
    try:
        return float(x)
    except OverflowError:
        return float(mpmath.sign(x)) * float("inf")
