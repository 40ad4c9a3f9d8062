"""Project an initial state onto its closed gaps; refuse violated ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentStartError, InputError, NotRealError, Problem
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, TapeRun
from lagrange_cli.mechanics.numerics.gauss_newton import SparseRow
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation, gap_over_names
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced

_ZERO = mpf(0)

#: Largest gap, relative to the scene's length, that counts as closed, and largest rate of a gap,
#: relative to its terms, that counts as zero.
_TOLERANCE = mpf(10) ** -9
#: Change, relative to the largest value, that counts as rounding of the arithmetic.
_ROUNDING = mpf(10) ** -20


class GapProjection:
    """Projection onto the closed gaps of a scene at its parameters and start time.

    Parameters
    ----------
    constants
        Values of parameters and t.
    """

    def __init__(self, reduced: Reduced, constants: Mapping[sp.Symbol, mpf]) -> None:
        self._reduced = reduced
        self._constants = dict(constants)
        self._q = [c.q for c in reduced.coordinates]
        self._v = [c.v for c in reduced.coordinates]
        self._number = {q: j for j, q in enumerate(self._q)}
        gaps = [gap.left - gap.right for gap in reduced.gaps]
        self._held = [sorted(gap.free_symbols, key=str) for gap in gaps]
        self._tapes = [Tape([g], symbols) for g, symbols in zip(gaps, self._held, strict=True)]

    def placed(self, q: Sequence[mpf]) -> tuple[list[mpf], mpf]:
        """Project coordinates so that closed gaps are zero in all digits, with the largest change.

        Raises
        ------
        InputError
            They violate a gap by more than 1e-9 of the scene's length, or leave it without
            a gradient.
        """
        touching = self._touching(q)
        if not touching:
            return list(q), _ZERO
        point = self._reduced.manifold(touching).placed(self._point(q, [_ZERO] * len(q)))
        if point is None:
            raise self._violated(touching[0], _ZERO)
        return self._changed(q, [point[s] for s in self._q])

    def tangent(self, q: Sequence[mpf], v: Sequence[mpf]) -> tuple[list[mpf], mpf]:
        """Project velocities that leave closed gaps by rounding only; return the largest change."""
        touching = self._touching(q)
        if not touching:
            return list(v), _ZERO
        sliding = []
        for k, gap in enumerate(self._reduced.gaps):
            if gap not in touching:
                continue
            run = self._run(k, q, v)
            speeds = [x * v[j] for j, x in self._slopes(run, k).items()]
            level = run.outputs[0][1]
            parts = sum(map(abs, speeds), abs(level - sum(speeds, _ZERO)))
            if abs(level) <= _TOLERANCE * parts:
                sliding.append(gap)
        moved = self._reduced.manifold(sliding).tangent(self._point(q, v))
        return self._changed(v, [moved[w] for w in self._v])

    def possible(self, configurations: Sequence[list[mpf]]) -> list[list[mpf]]:
        """Select the configurations that violate no gap.

        Raises
        ------
        InputError
            Each of them violates a gap; the message names that of the first.
        """
        admitted = [q for q in configurations if self._allows(q)]
        if not admitted:
            self._touching(configurations[0])
        return admitted

    def _allows(self, q: Sequence[mpf]) -> bool:
        try:
            self._touching(q)
        except InputError:
            return False
        return True

    def _touching(self, q: Sequence[mpf]) -> list[ClosureEquation]:
        """List the closed gaps; raise for one that is violated or has no gradient."""
        touching = []
        scales, still = self._reduced.scales, [_ZERO] * len(q)
        for k, gap in enumerate(self._reduced.gaps):
            try:
                run = self._run(k, q, still)
                steps = [abs(x) * scales[self._q[j]] for j, x in self._slopes(run, k).items()]
                distance = run.values[0] / (max(steps, default=_ZERO) or mpf(1))
            except (DomainError, ZeroDivisionError):
                raise _rough(gap) from None
            if distance < -_TOLERANCE:
                raise self._violated(gap, run.values[0])
            if distance <= _TOLERANCE:
                touching.append(gap)
        return touching

    def _run(self, number: int, q: Sequence[mpf], v: Sequence[mpf]) -> TapeRun:
        """φ and φ̇ of a gap."""
        t, inputs = self._reduced.names.t, []
        for s in self._held[number]:
            j = self._number.get(s)
            moving = (self._constants[s], mpf(s == t)) if j is None else (q[j], v[j])
            inputs.append((*moving, _ZERO))
        return self._tapes[number].run(inputs, 1)

    def _slopes(self, run: TapeRun, number: int) -> SparseRow:
        """The gradient of a gap."""
        symbols = self._held[number]
        pairs = ((self._number.get(symbols[i]), x) for i, x in run.partials(0).items())
        return {j: x for j, x in pairs if j is not None}

    def _point(self, q: Sequence[mpf], v: Sequence[mpf]) -> dict[sp.Symbol, mpf]:
        return {**self._constants, **dict(zip([*self._q, *self._v], [*q, *v], strict=True))}

    @staticmethod
    def _changed(before: Sequence[mpf], after: list[mpf]) -> tuple[list[mpf], mpf]:
        change = max((abs(x - y) for x, y in zip(before, after, strict=True)), default=_ZERO)
        size = max(map(abs, before), default=_ZERO)
        return after, change if change > _ROUNDING * size else _ZERO

    def _violated(self, gap: ClosureEquation, value: mpf) -> InputError:
        """Build the error at the first initial value in the gap, or at the first of all."""
        scene, names = self._reduced.scene, self._reduced.names
        one_sided = next(u for u in scene.unilateral if u.name == gap.name)
        symbols = gap_over_names(names, one_sided).free_symbols
        entry = next(
            (e for e in scene.initial if names.lookup(e.name) in symbols), scene.initial[0]
        )
        return InconsistentStartError(
            Problem(
                f"the initial values violate the one-sided constraint '{gap.name}':"
                f" {gap.text} is missed by {mpmath.nstr(abs(value), 3)}",
                entry.mark,
                rule="initial-inconsistent",
            )
        )


def _rough(gap: ClosureEquation) -> InputError:
    return NotRealError(
        Problem(
            f"the one-sided constraint '{gap.name}' has no gradient at the initial configuration",
            gap.mark,
            hint="without a root it has one everywhere: x^2 + y^2 <= l^2 says norm(x, y) <= l",
            rule="not-real",
        )
    )
