"""Coordinates from given Cartesian values.

Newton's method from several starts, so that configurations other than the
nearest are seen too: a choice that nothing makes is not made in silence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.reduction import Reduced
from lagrange_cli.mechanics.tape import DomainError, Tape

__all__ = ["Configurations", "Search", "rank"]

_ZERO = mpf(0)
_STARTS = 24
_NEWTON_STEPS = 60


@dataclass
class Configurations:
    """What a search found.

    Attributes
    ----------
    exact
        Configurations that have the given values, each physically different one
        once, that nearest to the guess first.
    nearest
        Where there are none: a configuration of least distance, with the
        ``values`` it has and their ``misses``.
    """

    exact: list[list[mpf]] = field(default_factory=list)
    nearest: list[mpf] = field(default_factory=list)
    values: list[mpf] = field(default_factory=list)
    misses: list[mpf] = field(default_factory=list)


class Search:
    """Search for the coordinates ``missing`` that give ``symbols`` the values ``target``.

    Parameters
    ----------
    constants
        Values of parameters and t.
    """

    def __init__(
        self,
        reduced: Reduced,
        constants: Mapping[sp.Symbol, mpf],
        symbols: Sequence[sp.Symbol],
        target: Sequence[mpf],
        missing: Sequence[int],
    ) -> None:
        self._coordinates = reduced.coordinates
        self._constants = list(constants.values())
        self._target = list(target)
        self._missing = list(missing)
        inputs = [*(c.q for c in reduced.coordinates), *constants]
        self._tape = Tape([reduced.resolved[s] for s in symbols], inputs)
        self._everything = Tape(list(reduced.resolved.values()), inputs)

    def configurations(self, guess: Sequence[mpf], tolerance: mpf) -> Configurations:
        """All configurations that were reached, from the guess and from around it."""
        found = Configurations()
        kept: list[tuple[list[mpf], list[mpf]]] = []
        for start in self._starts(guess):
            q = self._gauss_newton(start)
            if q is None:
                continue
            values = self._run(self._tape, q)
            misses = [abs(x - y) for x, y in zip(self._target, values, strict=True)]
            if max(misses) <= tolerance:
                _keep(kept, self._turned_back(q), self._run(self._everything, q), self._plain)
            elif not found.misses or max(misses) < max(found.misses):
                found.nearest, found.values, found.misses = q, values, misses
        found.exact = sorted(
            (q for q, _ in kept),
            key=lambda q: sum(abs(x - y) for x, y in zip(q, guess, strict=True)),
        )
        return found

    def _run(self, tape: Tape, q: Sequence[mpf]) -> list[mpf]:
        return tape.run([(x, _ZERO, _ZERO) for x in [*q, *self._constants]], 0).values

    def _turned_back(self, q: list[mpf]) -> list[mpf]:
        """Missing angles within half a turn of zero."""
        turned = list(q)
        for j in self._missing:
            if self._coordinates[j].is_angle:
                turned[j] -= 2 * mpmath.pi * mpmath.nint(turned[j] / (2 * mpmath.pi))
        return turned

    def _plain(self, q: Sequence[mpf]) -> tuple[int, mpf]:
        """Preference between coordinates of one configuration: lengths positive, then small."""
        lengths = [q[j] for j in self._missing if not self._coordinates[j].is_angle]
        return sum(x < 0 for x in lengths), sum((abs(q[j]) for j in self._missing), _ZERO)

    def _starts(self, guess: Sequence[mpf]) -> list[list[mpf]]:
        """The guess and others around the circle or the origin (a golden-section spread)."""
        starts = [list(guess)]
        scale = max((abs(v) for v in self._target), default=mpf(1)) or mpf(1)
        for k in range(1, _STARTS):
            start = list(guess)
            for i, j in enumerate(self._missing):
                step = mpmath.frac(k * mpmath.sqrt(2 + i)) - mpf(1) / 2
                width = 2 * mpmath.pi if self._coordinates[j].is_angle else 2 * scale
                start[j] = step * width
            starts.append(start)
        return starts

    def _gauss_newton(self, start: list[mpf]) -> list[mpf] | None:
        """A least-squares solution from one start; None where it does not converge."""
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
        run = self._tape.run([(x, _ZERO, _ZERO) for x in [*q, *self._constants]], 0)
        rows = [run.gradient({k: (mpf(1), _ZERO, _ZERO)}) for k in range(len(self._target))]
        matrix = mpmath.matrix([[row[j][0] for j in self._missing] for row in rows])
        if rank(matrix) < len(self._missing):
            return None
        residual = [x - y for x, y in zip(self._target, run.values, strict=True)]
        return list(mpmath.lu_solve(matrix, mpmath.matrix(residual)))


def _keep(
    kept: list[tuple[list[mpf], list[mpf]]],
    q: list[mpf],
    place: list[mpf],
    plain: Callable[[Sequence[mpf]], tuple[int, mpf]],
) -> None:
    """Add a configuration, or the plainer coordinates of one that is there already."""
    size = max((abs(x) for x in place), default=mpf(1)) or mpf(1)
    for k, (other, there) in enumerate(kept):
        if all(abs(x - y) <= mpf(10) ** -12 * size for x, y in zip(place, there, strict=True)):
            if plain(q) < plain(other):
                kept[k] = (q, place)
            return
    kept.append((q, place))


def rank(matrix: mpmath.matrix) -> int:
    """Numerical rank of a small matrix."""
    array = np.array(matrix.tolist(), dtype=float)
    return int(np.linalg.matrix_rank(array, rtol=1e-12)) if array.size else 0
