"""Equations that hold identically on a part of the configurations only.

Roots and inverse functions have branches: acos(cos q) is q for q between 0 and π alone. A
constraint may so follow from the definitions around the start and restrict the motion elsewhere. An
identity between analytic functions that holds around one point holds wherever both stay analytic;
only functions with branches end it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.kinks import KINKED
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, Sampler
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation

EquationSides = tuple[sp.Expr, sp.Expr]

#: Functions with branches.
_BRANCHES = (sp.asin, sp.acos, sp.atan, sp.atan2, sp.acosh, *KINKED)

#: Distances around a point at which an identity is tried, relative to scales, widest first; the
#: last is far below the distance from a border of a start that is not meant to be on it.
_WIDTHS = tuple(mpf(2) ** -k for k in (*range(13), 20, 30, 40))
#: Number of random directions, each with its opposite, in which it is tried.
_DIRECTIONS = 4
#: Factor of the digits with which values are compared: a small number stays as small as it is, a
#: zero shrinks with rounding.
_MORE = 3
#: Widths, relative to scales, at which an equation is tried elsewhere: to some tens of turns away.
_FAR = (1, 4, 16, 64)
#: Configurations tried at each width.
_TRIALS = 12
#: Most coordinates of a scene that is tried.
_MOST = 16
#: Part of the terms of an equation above which its residual counts as a violation.
_VIOLATED = mpf(10) ** -6


def has_branches(sides: EquationSides) -> bool:
    """Tell whether a function with branches stands in an equation."""
    return any(
        e.has(*_BRANCHES) or any(not p.exp.is_Integer for p in e.atoms(sp.Pow)) for e in sides
    )


def identities_around(
    equations: Mapping[int, EquationSides], sampler: Sampler, point: Mapping[sp.Symbol, mpf]
) -> set[int]:
    """Numbers of the equations with branches that hold identically around a point.

    Parameters
    ----------
    point
        Values of t and of coordinates; equations that hold a coordinate without a value
        are left out.
    """
    identities = set[int]()
    for number, sides in _placed(equations, sampler, point):
        around = (_around(sampler, point, width) for width in _WIDTHS)
        if any(all(_is_identity(sides, p) for p in points) for points in around):
            identities.add(number)
    return identities


def identities_beside(
    equations: Mapping[int, EquationSides], sampler: Sampler, point: Mapping[sp.Symbol, mpf]
) -> dict[int, list[Mapping[sp.Symbol, mpf]]]:
    """Numbers of the equations that hold identically on one side of a point, and places there.

    Of a point and its opposite one is on that side, whatever is drawn. ``point``: as for
    :func:`identities_around`.
    """
    one_sided: dict[int, list[Mapping[sp.Symbol, mpf]]] = {}
    for number, sides in _placed(equations, sampler, point):
        holding = [_is_identity(sides, p) for p in _around(sampler, point, _WIDTHS[-1])]
        if any(holding) and not all(holding):
            around = (p for width in _WIDTHS for p in _around(sampler, point, width))
            one_sided[number] = [p for p in around if _is_identity(sides, p)]
    return one_sided


def _placed(
    equations: Mapping[int, EquationSides], sampler: Sampler, point: Mapping[sp.Symbol, mpf]
) -> Iterator[tuple[int, EquationSides]]:
    """Yield the equations with branches whose coordinates have values at a point."""
    coordinates = set(sampler.coordinates)
    for number, sides in equations.items():
        present = (symbols_in(sides[0]) | symbols_in(sides[1])) & coordinates
        if present and present <= point.keys() and has_branches(sides):
            yield number, sides


def _around(
    sampler: Sampler, point: Mapping[sp.Symbol, mpf], width: mpf
) -> Iterator[Mapping[sp.Symbol, mpf]]:
    """Points near a point, before and after its time."""
    for _ in range(_DIRECTIONS):
        center = {**sampler.candidate(mpf(1)), **point}
        for moved, sign in zip(sampler.around(center, width), (1, -1), strict=True):
            yield {**moved, sampler.t: point[sampler.t] + sign * width}


def _is_identity(sides: EquationSides, point: Mapping[sp.Symbol, mpf]) -> bool:
    """Tell whether left − right is rounding, which vanishes as digits grow."""
    misses = _misses(sides, point)
    if misses is None:
        return False
    coarse, fine, size = misses
    is_small = fine <= size * mpf(10) ** (-2 * mpmath.mp.dps)
    return bool(is_small and (not fine or _differ(coarse, fine)))


def _differ(coarse: mpf, fine: mpf) -> bool:
    """Tell whether a value is rounding, which other digits do not repeat."""
    return bool(abs(coarse - fine) > _VIOLATED * fine)


def _violation(sides: EquationSides, point: Mapping[sp.Symbol, mpf]) -> mpf:
    """|left − right| beside the terms of both; 0 where it is small, or rounding."""
    misses = _misses(sides, point)
    if misses is None:
        return mpf(0)
    coarse, fine, size = misses
    if fine <= _VIOLATED * size or _differ(coarse, fine):
        return mpf(0)
    return fine / size


def _misses(sides: EquationSides, point: Mapping[sp.Symbol, mpf]) -> tuple[mpf, mpf, mpf] | None:
    """|left − right| with the digits carried and with more, and Σ |terms|; None if not real."""
    terms = [e for side in sides for e in sp.Add.make_args(side)]
    try:
        left, right = evaluate(sides, point)
        with mpmath.workdps(_MORE * mpmath.mp.dps):
            more_left, more_right, *parts = evaluate([*sides, *terms], point)
            fine, size = abs(more_left - more_right), sum(map(abs, parts), mpf(0))
    except (DomainError, ZeroDivisionError, OverflowError):
        return None
    return abs(left - right), fine, size


def violating_configurations(
    equations: Mapping[int, EquationSides], sampler: Sampler, gaps: Sequence[ClosureEquation]
) -> dict[int, SamplePoint]:
    """Configurations that violate equations which hold identically around the start, by number.

    Only equations with branches are tried; absence from the result proves nothing.

    Parameters
    ----------
    gaps
        One-sided constraints that the configurations satisfy.
    """
    if len(sampler.coordinates) > _MOST:
        return {}
    tried = {k: sides for k, sides in equations.items() if has_branches(sides)}
    if not tried:
        return {}
    openings = [gap.left - gap.right for gap in gaps]
    violated = dict[int, SamplePoint]()
    for width in _FAR:
        worst = dict[int, mpf]()
        for point in _allowed(sampler, mpf(width), openings):
            for number in sorted(tried.keys() - (violated.keys() - worst.keys())):
                excess = _violation(tried[number], point)
                if excess > worst.get(number, 0):
                    worst[number], violated[number] = excess, point
    return violated


def _allowed(sampler: Sampler, width: mpf, openings: Sequence[sp.Expr]) -> Iterator[SamplePoint]:
    """Random configurations that leave all gaps open."""
    for _ in range(_TRIALS):
        point = sampler.draw(width=width)
        if point is not None and all(x >= 0 for x in evaluate(openings, point)):
            yield point
