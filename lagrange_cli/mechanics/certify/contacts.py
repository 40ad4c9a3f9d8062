"""Gaps checked at random states by a route of their own.

A gap as the scene states it, over the Cartesian names, is followed along the motion of
the particles; its gradient is the virtual work of the force ∇φ on them. States need not
lie where the gap is closed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mpmath import mpf

from lagrange_cli.mechanics.certify.routes import Tapes
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.numerics.autodiff import Tape, TapeRun
from lagrange_cli.mechanics.numerics.gauss_newton import SparseRow
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.reduction.geometry import gap_over_names
from lagrange_cli.mechanics.sparse import entries

_ZERO = mpf(0)

#: Reported, expected, and the size of the parts.
_Triple = tuple[mpf, mpf, mpf]


class GapCheck:
    """Check of the gaps of one derivation, kept in ``closures``."""

    def __init__(self, derivation: Uncertified, tapes: Tapes) -> None:
        reduced = derivation.reduced
        self.closures = tuple(c.closure for c in derivation.contacts)
        self.tapes = tapes
        stated = [gap_over_names(reduced.names, u) for u in reduced.scene.unilateral]
        self._stated = Tape(stated, [*tapes.raw, tapes.t, *tapes.parameters])
        self._held = [entries(c.gradient) for c in self.closures]
        self._derived = Tape(
            [
                e
                for c, row in zip(self.closures, self._held, strict=True)
                for e in (c.expression, *row.values(), c.rate, c.bias)
            ],
            tapes.moving,
        )

    def forces(self, point: SymbolValues) -> Iterator[tuple[int, mpf]]:
        """Number of a coordinate and λ times its entry of the gradient, for each gap."""
        if not self.closures:
            return
        for closure, (_, gradient, _, _) in zip(self.closures, self._parts(point), strict=True):
            for j, x in gradient.items():
                yield j, point[closure.multiplier] * x

    def _parts(self, point: SymbolValues) -> list[tuple[mpf, SparseRow, mpf, mpf]]:
        """Value, gradient, rate and bias of each gap, as derived."""
        inputs = [(point[s], _ZERO, _ZERO) for s in self.tapes.moving]
        pending = iter(self._derived.run(inputs, 0).values)
        return [
            (next(pending), {j: next(pending) for j in row}, next(pending), next(pending))
            for row in self._held
        ]

    def mismatch(self, point: SymbolValues) -> mpf:
        """Largest relative difference between gaps as derived and as stated."""
        if not self.closures:
            return _ZERO
        tapes = self.tapes
        series = tapes.series(point)
        places = tapes.positions.run([series[s] for s in tapes.still], 2)
        run = self._stated.run(tapes.raw_inputs(series, places.outputs), 2)
        moving = ([point[s] for s in tapes.v], [point[s] for s in tapes.a])
        expected, worst = run.outputs, _ZERO
        for k, derived in enumerate(self._parts(point)):
            slopes = {j: x for j, x in run.partials(k).items() if j < len(tapes.raw)}
            worst = max(
                worst,
                *(
                    abs(x - y) / size if size else abs(x - y)
                    for x, y, size in _triples(
                        derived, expected[k], self._work(places, slopes), moving
                    )
                ),
            )
        return worst

    def _work(self, places: TapeRun, slopes: SparseRow) -> SparseRow:
        """∂φ/∂q = Σ ∂φ/∂r ∂r/∂q from ∂φ/∂r by number of the name."""
        tapes, gradient = self.tapes, dict[int, mpf]()
        for k, slope in slopes.items():
            if k >= len(tapes.symbols):
                moved = {tapes.q.index(tapes.raw[k]): mpf(1)}
            else:
                moved = {j - 1: x for j, x in places.partials(k).items() if 1 <= j <= tapes.n}
            for j, x in moved.items():
                gradient[j] = gradient.get(j, _ZERO) + slope * x
        return gradient


def _triples(
    derived: tuple[mpf, SparseRow, mpf, mpf],
    expected: Sequence[mpf],
    work: SparseRow,
    moving: tuple[Sequence[mpf], Sequence[mpf]],
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
