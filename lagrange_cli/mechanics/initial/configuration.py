"""Coordinates from given Cartesian values and from closures.

The method of Gauss and Newton starts from several points, so that configurations other than the
nearest are met too: a choice that the scene leaves open is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape
from lagrange_cli.mechanics.numerics.gauss_newton import SparseRow
from lagrange_cli.mechanics.numerics.rank import rank
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced

_ZERO = mpf(0)
#: Starts of Newton's method, the guess first: enough to meet the second configuration of a
#: linkage. Not tuned.
NEWTON_STARTS = 24
#: Most steps from one start.
_NEWTON_STEPS = 60


@dataclass
class Configurations:
    """Outcome of a search for configurations.

    Attributes
    ----------
    exact
        Configurations with the given values, each physically different one once, the nearest to the
        guess first.
    nearest
        If there are none: a configuration of least distance.
    values, misses
        Values there, and their distances from the given ones.
    beyond
        A configuration with the given values in which coordinates that must be positive are not;
        empty if none was reached.
    regular
        True if the targets determine the coordinates to first order at some iterate.
    """

    exact: list[list[mpf]] = field(default_factory=list)
    nearest: list[mpf] = field(default_factory=list)
    values: list[mpf] = field(default_factory=list)
    misses: list[mpf] = field(default_factory=list)
    beyond: list[mpf] = field(default_factory=list)
    regular: bool = False


class ConfigurationSearch:
    """Search for the coordinates ``missing`` that give ``symbols`` the values ``target``.

    They have to satisfy the positional closures too, whose distances follow those of the symbols.

    Parameters
    ----------
    constants
        Values of parameters and t.
    length
        The scene's length: distances are measured with angles times it.
    """

    def __init__(
        self,
        reduced: Reduced,
        constants: Mapping[sp.Symbol, mpf],
        symbols: Sequence[sp.Symbol],
        target: Sequence[mpf],
        missing: Sequence[int],
        length: mpf,
    ) -> None:
        self._coordinates = reduced.coordinates
        self._constants = list(constants.values())
        self._missing = list(missing)
        self._length = length
        self._given = len(symbols)
        self._regular = False
        closures = [c.left - c.right for c in reduced.closures if c.kind == "position"]
        self._target = [*target, *(_ZERO for _ in closures)]
        inputs = [*(c.q for c in reduced.coordinates), *constants]
        self._tape = Tape([*(reduced.resolved[s] for s in symbols), *closures], inputs)
        self._reduced, self._inputs = reduced, inputs

    @cached_property
    def _everything(self) -> Tape:
        """Expressions that distinguish configurations."""
        reduced = self._reduced
        return Tape([*reduced.resolved.values(), *_outside(reduced)], self._inputs)

    def configurations(self, guess: Sequence[mpf], tolerance: mpf) -> Configurations:
        """Search for configurations from the guess and from around it."""
        outcome = Configurations()
        self._regular = False
        distinct: list[tuple[list[mpf], list[mpf]]] = []
        for start in self._starts(guess):
            q = self._gauss_newton(start)
            if q is None:
                continue
            values = self._run(self._tape, q)
            misses = self.misses(q)
            if max(misses) <= tolerance and not self._has_signs(q):
                outcome.beyond = outcome.beyond or q
            elif max(misses) <= tolerance:
                place = self._run(self._everything, q)
                _keep(distinct, self._turned_back(q), place, self._plain, self._length)
            elif not outcome.misses or max(misses) < max(outcome.misses):
                outcome.nearest, outcome.values, outcome.misses = q, values, misses
        outcome.regular = self._regular
        outcome.exact = sorted(
            (q for q, _ in distinct),
            key=lambda q: sum(abs(x - y) for x, y in zip(q, guess, strict=True)),
        )
        return outcome

    def _has_signs(self, q: Sequence[mpf]) -> bool:
        """Tell whether all coordinates that are declared positive have positive values."""
        pairs = zip(self._coordinates, q, strict=True)
        return all(value > 0 for coordinate, value in pairs if coordinate.is_positive)

    def misses(self, q: Sequence[mpf]) -> list[mpf]:
        """Distances from the given values, then from the closures (φ beside its gradient)."""
        values, rows = self._linear(q)
        misses = []
        for k, (target, value, row) in enumerate(zip(self._target, values, rows, strict=True)):
            miss = abs(target - value)
            misses.append(miss if k < self._given else miss / (self._steepest(row) or mpf(1)))
        return misses

    def _steepest(self, row: SparseRow) -> mpf:
        """Largest slope for a length; an angle moves by the scene's length."""
        slopes = (
            abs(x) / (self._length if self._coordinates[j].is_angle else 1) for j, x in row.items()
        )
        return max(slopes, default=_ZERO)

    def _run(self, tape: Tape, q: Sequence[mpf]) -> list[mpf]:
        return tape.run([(x, _ZERO, _ZERO) for x in [*q, *self._constants]], 0).values

    def _turned_back(self, q: list[mpf]) -> list[mpf]:
        """Turn missing angles to within half a turn of zero, or to the first turn if positive."""
        turned = list(q)
        for j in self._missing:
            if self._coordinates[j].is_angle:
                turns = turned[j] / (2 * mpmath.pi)
                whole = mpmath.floor if self._coordinates[j].is_positive else mpmath.nint
                turned[j] -= 2 * mpmath.pi * whole(turns)
        return turned

    def _plain(self, q: Sequence[mpf]) -> tuple[int, mpf]:
        """Rank coordinates of one configuration: positive lengths first, then small values."""
        lengths = [q[j] for j in self._missing if not self._coordinates[j].is_angle]
        return sum(x < 0 for x in lengths), sum((abs(q[j]) for j in self._missing), _ZERO)

    def _starts(self, guess: Sequence[mpf]) -> list[list[mpf]]:
        """List the guess, then starts around circle or origin (a golden-section spread)."""
        starts = [list(guess)]
        scale = max((abs(v) for v in self._target), default=mpf(1)) or self._length
        for k in range(1, NEWTON_STARTS):
            start = list(guess)
            for i, j in enumerate(self._missing):
                step = mpmath.frac(k * mpmath.sqrt(2 + i)) - mpf(1) / 2
                width = 2 * mpmath.pi if self._coordinates[j].is_angle else 2 * scale
                start[j] = abs(step * width) if self._coordinates[j].is_positive else step * width
            starts.append(start)
        return starts

    def _gauss_newton(self, start: list[mpf]) -> list[mpf] | None:
        """A least-squares solution from one start; None if it does not converge."""
        q = list(start)
        if len(self._target) < len(self._missing):
            return None
        for _ in range(_NEWTON_STEPS):
            try:
                step = self._step(q)
            except (DomainError, ZeroDivisionError):
                return None
            if step is None:
                return None
            for value, j in zip(step, self._missing, strict=True):
                q[j] += value
            size = max(abs(s) for s in step)
            if size <= mpf(10) ** (6 - mpmath.mp.dps) * max(1, *(abs(x) for x in q)):
                return q
        return None

    def _step(self, q: Sequence[mpf]) -> list[mpf] | None:
        values, rows = self._linear(q)
        # A closure's size is arbitrary; its gradient's is made that of a Cartesian name's.
        weights = [
            mpf(1) if k < self._given else 1 / (self._steepest(row) or mpf(1))
            for k, row in enumerate(rows)
        ]
        matrix = mpmath.matrix(
            [
                [w * row.get(j, _ZERO) for j in self._missing]
                for w, row in zip(weights, rows, strict=True)
            ]
        )
        if rank(np.array(matrix.tolist(), dtype=float), 1e-12) < len(self._missing):
            return None
        self._regular = True
        residual = [w * (x - y) for w, x, y in zip(weights, self._target, values, strict=True)]
        try:
            return list(mpmath.lu_solve(matrix, mpmath.matrix(residual)))
        except ValueError:  # its normal equations lose twice the digits that its rank suggests
            return None

    def _linear(self, q: Sequence[mpf]) -> tuple[list[mpf], list[SparseRow]]:
        """Values and gradients of all expressions with a target."""
        run = self._tape.run([(x, _ZERO, _ZERO) for x in [*q, *self._constants]], 0)
        slopes = map(run.partials, range(len(self._target)))
        return run.values, [{j: x for j, x in row.items() if j < len(q)} for row in slopes]


def _outside(reduced: Reduced) -> list[sp.Expr]:
    """Expressions for the coordinates that no position holds, 2π-periodic for angles."""
    inside = set().union(*map(symbols_in, reduced.resolved.values()))
    expressions: list[sp.Expr] = []
    for c in reduced.coordinates:
        if c.q not in inside:
            expressions += [sp.sin(c.q), sp.cos(c.q)] if c.is_angle else [c.q]
    return expressions


def _keep(
    distinct: list[tuple[list[mpf], list[mpf]]],
    q: list[mpf],
    place: list[mpf],
    plain: Callable[[Sequence[mpf]], tuple[int, mpf]],
    length: mpf,
) -> None:
    """Add a configuration, or the plainer coordinates of one that is listed already.

    At the origin a place has no size of its own: the error of a converged search is small beside
    the scene's ``length``.
    """
    size = max((abs(x) for x in place), default=_ZERO)
    reach = max(mpf(10) ** -12 * size, mpf(10) ** (-mpmath.mp.dps // 2) * length)
    for k, (known, there) in enumerate(distinct):
        if all(abs(x - y) <= reach for x, y in zip(place, there, strict=True)):
            if plain(q) < plain(known):
                distinct[k] = (q, place)
            return
    distinct.append((q, place))
