"""Closure equations checked at random states by routes of their own.

Gradient, rate and bias are compared with derivatives along the motion of the equations
as stated. Accelerations and multipliers that solve M a = f + Σ λ·gradient are put into
Newton's law: its residual must be the constraint force Σ λ ∂φ/∂q, which does no work in
admissible displacements.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal

import mpmath
from mpmath import mpf

from lagrange_cli.mechanics.certify.contacts import DerivedClosures, GapCheck, relative
from lagrange_cli.mechanics.certify.routes import Observation, Tapes
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.numerics.autodiff import DecimalRun, Tape
from lagrange_cli.mechanics.numerics.elementary import (
    DecimalRow,
    DecimalValues,
    in_decimals,
    numbers_as_decimals,
    numbers_as_mpf,
    to_decimal,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, Sampler

_ZERO = Decimal(0)

#: Most unknowns of a system that is solved for accelerations and multipliers.
_LARGE = 32


class ClosureCheck:
    """Check of the closure equations of one derivation."""

    def __init__(self, derivation: Uncertified, tapes: Tapes) -> None:
        self.closures = derivation.closures
        self.is_by_recursion = derivation.tree is not None
        self.tapes = tapes
        self.gaps = GapCheck(derivation, tapes)
        self.manifold = derivation.reduced.manifold()
        self.derived = DerivedClosures(self.closures, tapes.moving)
        expressions = [c.expression for c in self.closures]
        self._expressions = Tape(expressions, tapes.moving)
        lengths = derivation.reduced.scene.lengths
        self._of_lengths = [k for k, c in enumerate(self.closures) if c.constraint in lengths]

    def draw(self, point: SamplePoint, sampler: Sampler) -> SamplePoint:
        """The point with velocities that satisfy the closures, and random multipliers."""
        moved = self.manifold.tangent(point) if self.closures else dict(point)
        for closure in (*self.closures, *self.gaps.derived.closures):
            moved[closure.multiplier] = sampler.noise(mpf(1))
        is_kept = self.is_by_recursion and self._of_lengths
        return self._keeping_lengths(moved) if is_kept else moved

    def _keeping_lengths(self, state: SamplePoint) -> SamplePoint:
        """Return a state with accelerations that keep the lengths of quaternions.

        M by recursion has no inertia along them, where r(q) of a longer quaternion is further out.
        """
        with in_decimals():
            point = numbers_as_decimals(state)
            derived = list(self.derived.at(point))
            for _, gradient, _, bias in (derived[k] for k in self._of_lengths):
                symbols = {j: self.tapes.a[j] for j in gradient}
                change = sum((g * point[symbols[j]] for j, g in gradient.items()), bias)
                squared = sum(g * g for g in gradient.values())
                for j, g in gradient.items():
                    point[symbols[j]] -= g * change / squared
            return {**state, **numbers_as_mpf({a: point[a] for a in self.tapes.a})}

    def gradients(self, point: DecimalValues) -> list[DecimalRow]:
        """The derived gradients."""
        return [gradient for _, gradient, _, _ in self.derived.at(point)]

    def forces(self, point: DecimalValues) -> list[list[Decimal]]:
        """List for each coordinate λ·gradient of each closure and gap that holds it."""
        forces: list[list[Decimal]] = [[] for _ in self.tapes.q]
        for derived in (self.derived, self.gaps.derived):
            for j, force in derived.forces(point):
                forces[j].append(force)
        return forces

    def mismatch(self, point: DecimalValues, least: Decimal = _ZERO) -> Decimal:
        """Largest relative difference between derived closures and the equations as stated.

        Differences up to ``least`` count as zero.
        """
        worst = self.gaps.mismatch(point)
        if not self.closures:
            return worst
        v = [point[s] for s in self.tapes.v]
        a = [point[s] for s in self.tapes.a]
        levels, rates, gradients = self.manifold.motion_in_decimals(point, a)
        inputs = [(point[s], _ZERO, _ZERO) for s in self.tapes.moving]
        run = self._expressions.run_in_decimals(inputs, 0)
        for k, (_, gradient, rate, bias) in enumerate(self.derived.at(point)):
            stated = gradients[k]
            size = max(map(abs, stated.values()), default=_ZERO)
            pairs = []
            for slopes in (gradient, self._of_expression(run, k)):
                columns = [*stated, *(j for j in slopes if j not in stated)]
                pairs += [(slopes.get(j, _ZERO), stated.get(j, _ZERO), size) for j in columns]
            for terms, extra, expected in ((v, rate, levels[k]), (a, bias, rates[k])):
                products = [g * terms[j] for j, g in gradient.items()]
                pairs.append((sum(products, extra), expected, sum(map(abs, products), abs(extra))))
            worst = max([worst, *(relative(x - y, scale, least) for x, y, scale in pairs)])
        return worst

    def _of_expression(self, run: DecimalRun, number: int) -> dict[int, Decimal]:
        """Gradient of the equation as shown, by positions or by velocities."""
        n = self.tapes.n
        first = 1 if self.closures[number].kind == "position" else 1 + n
        slopes = run.partials(number)
        return {j - first: x for j, x in slopes.items() if first <= j < first + n}

    def without_lengths(
        self, residual: Sequence[Decimal], gradients: Sequence[DecimalRow]
    ) -> list[Decimal]:
        """Return a residual less its part along the lengths of quaternions.

        No motion has a part along them: L of a rotation has a force there, Newton's law none, and
        multipliers take up the difference.
        """
        across = list(residual)
        directions: list[list[Decimal]] = []
        for k in self._of_lengths:
            direction = [gradients[k].get(j, _ZERO) for j in range(len(across))]
            for earlier in directions:
                direction = _across(direction, earlier)
            directions.append(direction)
            across = _across(across, direction)
        return across

    def newton_mismatch(
        self,
        seen: Observation,
        mass: Sequence[DecimalRow],
        forcing: Sequence[Decimal],
        sizes: Sequence[Decimal],
    ) -> Decimal:
        """Relative mismatch of the solved accelerations and multipliers with Newton's law.

        ``sizes`` of the parts of Newton's law at the state's own accelerations: those
        solved for may be zero.
        """
        n, m = self.tapes.n, len(self.closures)
        if not m or n + m > _LARGE:
            return _ZERO
        solution = self.solved(seen.point, mass, forcing)
        if solution is None:
            return _ZERO  # singular here: refused elsewhere, or regular at another state
        a, multipliers = solution[:n], solution[n:]
        point = {**seen.point, **dict(zip(self.tapes.a, a, strict=True))}
        _, rates, gradients = self.manifold.motion_in_decimals(point, a)
        worst = _ZERO
        for rate, gradient in zip(rates, gradients, strict=True):
            drawn = [seen.point[w] for w in self.tapes.a]
            parts = [abs(g) * (abs(a[j]) + abs(drawn[j])) for j, g in gradient.items()]
            worst = max(worst, relative(rate, sum(parts, _ZERO)))
        newton = self.tapes.newton(self.tapes.series(point), seen.forces)
        pushes: list[list[Decimal]] = [[] for _ in newton]
        for j, force in self.gaps.derived.forces(point):
            pushes[j].append(force)
        differences, scales = [], []
        for j, (lacking, size) in enumerate(newton):
            forces = [x * g[j] for x, g in zip(multipliers, gradients, strict=True) if j in g]
            forces += pushes[j]
            differences.append(lacking - sum(forces, _ZERO))
            scales.append(sum(map(abs, forces), size + sizes[j]))
        differences = self.without_lengths(differences, gradients)
        return max([worst, *map(relative, differences, scales)])

    def solved(
        self, point: DecimalValues, mass: Sequence[DecimalRow], forcing: Sequence[Decimal]
    ) -> list[Decimal] | None:
        """Solve [[M, −Φᵀ], [Φ, 0]] [a; λ] = [f; −bias]; None if that is singular or too large.

        Contacts push as the state says.
        """
        if len(forcing) + len(self.closures) > _LARGE:
            return None
        derived = self.derived.at(point)
        n, m = self.tapes.n, len(derived)
        matrix = mpmath.zeros(n + m)
        pushed = [*forcing, *(-bias for _, _, _, bias in derived)]
        for j, force in self.gaps.derived.forces(point):
            pushed[j] += force
        right = mpmath.matrix([to_mpf(x) for x in pushed])
        for i in range(n):
            for j, x in mass[i].items():
                matrix[i, j] = to_mpf(x)
        for k, (_, gradient, _, _) in enumerate(derived):
            for i, x in gradient.items():
                matrix[n + k, i] = to_mpf(x)
                matrix[i, n + k] = -matrix[n + k, i]
        try:
            return [to_decimal(x) for x in mpmath.lu_solve(matrix, right)]
        except ZeroDivisionError:
            return None


def _across(vector: Sequence[Decimal], direction: Sequence[Decimal]) -> list[Decimal]:
    """Return a vector less its part along a direction."""
    squared = sum((x * x for x in direction), _ZERO)
    along = sum((x * y for x, y in zip(vector, direction, strict=True)), _ZERO)
    part = along / squared if squared else _ZERO
    return [x - part * y for x, y in zip(vector, direction, strict=True)]
