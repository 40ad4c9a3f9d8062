"""Search for a configuration that satisfies all one-sided constraints."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.sampling import PLACED_DRAWS, SamplePoint
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced

#: Starts in a scene of many coordinates, where each costs seconds. Not tuned.
_STARTS_OF_MANY = 4
#: Widths of the starts around the given configuration, relative to scales, in turn: near it, then
#: nearer and farther by factors of four.
_WIDTHS = (mpf(1), mpf("0.25"), mpf(4), mpf("0.0625"), mpf(16))


class FeasibilitySearch:
    """Configurations that satisfy closures and one-sided constraints.

    Parameters
    ----------
    gaps
        The one-sided constraints, ``left`` ≥ ``right``; those of the scene by default.

    Attributes
    ----------
    starts
        Number of starts of a full search.
    """

    def __init__(self, reduced: Reduced, gaps: Sequence[ClosureEquation] | None = None) -> None:
        self._reduced = reduced
        self.closures = [c for c in reduced.closures if c.kind == "position"]
        self.gaps = list(reduced.gaps if gaps is None else gaps)
        self._sampler = reduced.sampler([])
        self.starts = _STARTS_OF_MANY if self._sampler.many else PLACED_DRAWS
        self._clock = sp.Dummy("t", real=True)

    def configuration(
        self,
        closures: Sequence[int] | None = None,
        gaps: Sequence[int] | None = None,
        starts: int | None = None,
    ) -> SamplePoint | None:
        """Find a configuration for some of the closures and gaps, by number; None if none came up.

        The search is at the time at which the motion starts, then at others. The method of Gauss
        and Newton starts from ``starts`` configurations (default: all); its failure proves nothing.
        """
        closure_numbers = range(len(self.closures)) if closures is None else closures
        sides = [self.gaps[k] for k in (range(len(self.gaps)) if gaps is None else gaps)]
        ways = self._ways([self.closures[k] for k in closure_numbers], sides)
        for attempt in range(min(self.starts, starts or self.starts)):
            start = self._start(attempt, closure_numbers)
            if start is None:
                continue
            start[self._clock] = start[self._time]
            places = (manifold.within(start, len(sides)) for manifold in ways)
            if (place := next(filter(None, places), None)) is not None:
                return place
        return None

    @property
    def _time(self) -> sp.Symbol:
        return self._reduced.names.t

    @property
    def _coordinates(self) -> list[sp.Symbol]:
        return [c.q for c in self._reduced.coordinates]

    def _ways(
        self, closures: Sequence[ClosureEquation], gaps: Sequence[ClosureEquation]
    ) -> list[Manifold]:
        """List the conditions at the start time; if they hold t, also with t as an unknown."""
        sides = [(r.left, r.right) for r in (*closures, *gaps)]
        manifolds = [self._manifold(sides, [])]
        if any(self._time in (a - b).free_symbols for a, b in sides):
            moved = {self._time: self._clock}
            sides = [(a.xreplace(moved), b.xreplace(moved)) for a, b in sides]
            manifolds.append(self._manifold(sides, [self._clock]))
        return manifolds

    def _manifold(
        self, sides: Sequence[tuple[sp.Expr, sp.Expr]], gaps: Sequence[sp.Symbol]
    ) -> Manifold:
        names, q = self._reduced.names, self._coordinates
        constants = [*names.parameters.values()]
        scale = {**self._reduced.scales, **dict.fromkeys(gaps, mpf(1))}
        return Manifold(sides, [], names.t, [*q, *gaps], [], constants, scale)

    @cached_property
    def _given(self) -> SamplePoint:
        """Values of time and of the coordinates that the scene gives."""
        reference = self._reduced.reference
        return {s: reference[s] for s in (self._time, *self._coordinates) if s in reference}

    def _start(self, attempt: int, closures: Sequence[int]) -> SamplePoint | None:
        """The given configuration, then random ones on the closures around it."""
        width = _WIDTHS[attempt % len(_WIDTHS)]
        drawn = self._sampler.draw(width=width, closures=closures)
        if drawn is None:
            return None
        drawn[self._time] = self._given[self._time]
        return {**drawn, **self._given} if not attempt else drawn
