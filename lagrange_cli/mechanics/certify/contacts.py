"""Gaps checked at random states by a route of their own.

A gap as the scene states it, over the Cartesian names, is followed along the motion of
the particles; its gradient is the virtual work of the force ∇φ on them. States need not
lie where the gap is closed.
"""

from __future__ import annotations

import decimal
from collections.abc import Iterator, Sequence
from decimal import Decimal

from sympy import Symbol

from lagrange_cli.mechanics.certify.routes import Tapes
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.numerics.autodiff import DecimalRun, Tape
from lagrange_cli.mechanics.numerics.elementary import DecimalRow, DecimalValues
from lagrange_cli.mechanics.reduction.geometry import gap_over_names
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.system import Closure

_ZERO = Decimal(0)

#: Reported, expected, and the size of the parts.
_Triple = tuple[Decimal, Decimal, Decimal]

#: Value, gradient, rate and bias of a closure.
_Derived = tuple[Decimal, DecimalRow, Decimal, Decimal]


class DerivedClosures:
    """Closures, or gaps, as derived: their numbers at states."""

    def __init__(self, closures: Sequence[Closure], moving: Sequence[Symbol]) -> None:
        self.closures = closures
        self._moving = moving
        self._held = [entries(c.gradient) for c in closures]
        parts = [
            e
            for c, row in zip(closures, self._held, strict=True)
            for e in (c.expression, *row.values(), c.rate, c.bias)
        ]
        self._tape = Tape(parts, moving)
        #: The last point, the digits carried, and the values there.
        self._latest: tuple[DecimalValues, int, list[_Derived]] | None = None

    def at(self, point: DecimalValues) -> list[_Derived]:
        """Evaluate value, gradient (nonzero entries), rate and bias of each at a state."""
        if not self.closures:
            return []
        digits = decimal.getcontext().prec
        if self._latest is None or self._latest[0] is not point or self._latest[1] != digits:
            pending = iter(
                self._tape.run_in_decimals(
                    [(point[s], _ZERO, _ZERO) for s in self._moving], 0
                ).values
            )
            derived: list[_Derived] = [
                (next(pending), {j: next(pending) for j in row}, next(pending), next(pending))
                for row in self._held
            ]
            self._latest = point, digits, derived
        return self._latest[2]

    def forces(self, point: DecimalValues) -> Iterator[tuple[int, Decimal]]:
        """Yield for each closure coordinate numbers with λ times the entry of the gradient."""
        for closure, (_, gradient, _, _) in zip(self.closures, self.at(point), strict=True):
            for j, x in gradient.items():
                yield j, point[closure.multiplier] * x


class GapCheck:
    """Check of the gaps of one derivation."""

    def __init__(self, derivation: Uncertified, tapes: Tapes) -> None:
        reduced = derivation.reduced
        self.derived = DerivedClosures([c.closure for c in derivation.contacts], tapes.moving)
        self.tapes = tapes
        stated = [gap_over_names(reduced.names, u) for u in reduced.scene.unilateral]
        self._stated = Tape(stated, [*tapes.raw, tapes.t, *tapes.parameters])

    def mismatch(self, point: DecimalValues) -> Decimal:
        """Largest relative difference between gaps as derived and as stated."""
        if not self.derived.closures:
            return _ZERO
        tapes = self.tapes
        series = tapes.series(point)
        places = tapes.positions.run_in_decimals([series[s] for s in tapes.still], 2)
        run = self._stated.run_in_decimals(tapes.raw_inputs(series, places.outputs), 2)
        moving = ([point[s] for s in tapes.v], [point[s] for s in tapes.a])
        expected, worst = run.outputs, _ZERO
        for k, derived in enumerate(self.derived.at(point)):
            slopes = {j: x for j, x in run.partials(k).items() if j < len(tapes.raw)}
            triples = _triples(derived, expected[k], self._work(places, slopes), moving)
            worst = max(worst, *(relative(x - y, size) for x, y, size in triples))
        return worst

    def _work(self, places: DecimalRun, slopes: DecimalRow) -> DecimalRow:
        """∂φ/∂q = Σ ∂φ/∂r ∂r/∂q from ∂φ/∂r by number of the name."""
        tapes, gradient = self.tapes, dict[int, Decimal]()
        for k, slope in slopes.items():
            if k >= len(tapes.symbols):
                moved = {tapes.q.index(tapes.raw[k]): Decimal(1)}
            else:
                moved = {j - 1: x for j, x in places.partials(k).items() if 1 <= j <= tapes.n}
            for j, x in moved.items():
                gradient[j] = gradient.get(j, _ZERO) + slope * x
        return gradient


def _triples(
    derived: _Derived,
    expected: Sequence[Decimal],
    work: DecimalRow,
    moving: tuple[Sequence[Decimal], Sequence[Decimal]],
) -> Iterator[_Triple]:
    """Triples that must agree for one gap: φ, φ̇, φ̈ and the entries of its gradient."""
    value, gradient, rate, bias = derived
    steepest = max(map(abs, work.values()), default=_ZERO)
    yield value, expected[0], max(abs(value), steepest)
    for rates, extra, total in zip(moving, (rate, bias), expected[1:], strict=True):
        products = [x * rates[j] for j, x in gradient.items()]
        yield sum(products, extra), total, sum(map(abs, products), abs(extra))
    for j in {*gradient, *work}:
        yield gradient.get(j, _ZERO), work.get(j, _ZERO), steepest


def relative(difference: Decimal, size: Decimal, least: Decimal = _ZERO) -> Decimal:
    """Compare a difference with a size; differences up to ``least`` are none."""
    if abs(difference) <= least:
        return _ZERO
    return abs(difference) / size if size else abs(difference)
