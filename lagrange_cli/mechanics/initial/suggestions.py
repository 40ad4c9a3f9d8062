"""Feasible initial configurations that hints propose as YAML, and angles begun in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import (
    InconsistentStartError,
    InputError,
    MissingStartError,
    NotRealError,
    SingularError,
)
from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE
from lagrange_cli.mechanics.numerics.sampling import working_digits
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import initial_snippet, section_snippet
from lagrange_cli.scene.language.expression import Number

#: Most coordinates of a scene for which a configuration is sought: a hint of more is not pasted,
#: and the search would take longer than the refusal.
_MOST = 16
#: Starts of the search.
_PLACES = 8
#: Digits of values that can be chosen.
_CHOSEN = 2
#: Digits of values that follow from the chosen ones.
_EXACT = 12
#: Gap at the proposed values, relative to scales.
_INSIDE = mpf("0.05")
#: Errors after which the given values do not stay as they are.
_WRONG = (InconsistentStartError, NotRealError, SingularError)

_Point = dict[sp.Symbol, mpf]


def _suggested_configuration(
    reduced: Reduced, known: Mapping[sp.Symbol, mpf], around: Mapping[sp.Symbol, mpf] | None = None
) -> dict[str, str] | None:
    """Values of all coordinates, with few digits, that satisfy closures and gaps; by name.

    Parameters
    ----------
    known
        Coordinates that have their value.
    around
        Coordinates near which the search begins.
    """
    q = [c.q for c in reduced.coordinates]
    if len(q) > _MOST:
        return None
    with mpmath.workdps(working_digits(_EXACT)):
        free = [s for s in q if s not in known]
        for place in _places(reduced, around):
            point = _placed(reduced, {**place, **known}, free)
            if point is not None:
                exact = _rounded(reduced, point, free)
                return {
                    s.name: _text(point[s], _EXACT if s in exact else _CHOSEN)
                    if s in free
                    else _text(point[s], _EXACT)
                    for s in q
                }
    return None


def _places(reduced: Reduced, around: Mapping[sp.Symbol, mpf] | None) -> Iterator[_Point]:
    sampler = reduced.sampler([])
    for attempt in range(_PLACES):
        point = sampler.draw()
        if point is None:
            return
        point[reduced.names.t] = reduced.reference[reduced.names.t]
        if around is not None and not attempt:
            point.update(around)
        yield point


def _placed(reduced: Reduced, point: _Point, free: Sequence[sp.Symbol]) -> _Point | None:
    """Move some coordinates of a point so that closures and gaps hold; None on failure."""
    names, scale = reduced.names, reduced.manifold().scale
    sizes = dict(zip((c.q for c in reduced.coordinates), scale, strict=True))
    fixed = [c.q for c in reduced.coordinates if c.q not in free]
    closures = [c for c in reduced.closures if c.kind == "position"]
    manifold = Manifold(
        [(c.left, c.right) for c in (*closures, *reduced.gaps)],
        [],
        names.t,
        free,
        [],
        [*names.parameters.values(), *fixed],
        sizes,
    )
    if gaps := len(reduced.gaps):
        return manifold.within(point, gaps, _INSIDE) or manifold.within(point, gaps)
    moved = manifold.placed(point) if free else dict(point)
    if moved is None or any(x > RANK_TOLERANCE for x in manifold.violations(moved)):
        return None
    return None if any(s.is_positive and not moved[s] > 0 for s in free) else moved


def _rounded(reduced: Reduced, point: _Point, free: Sequence[sp.Symbol]) -> set[sp.Symbol]:
    """Round as many coordinates of the point as possible, in place; return the dependent ones."""
    left = list(free)
    for s in free:
        moving = [symbol for symbol in left if symbol != s]
        trial = {**point, s: mpf(_text(point[s], _CHOSEN))}
        moved = _placed(reduced, trial, moving)
        if moved is not None:
            point.update(moved)
            left = moving
    return set(left)


def _text(x: mpf, digits: int) -> str:
    return f"{float(x):.{digits}g}"


def possible_start(reduced: Reduced) -> dict[str, str]:
    """Values of all coordinates from which a motion can start; empty if none are known.

    If only starts for constants of integration are missing, these and the coordinates.
    """
    scene = reduced.scene
    lacking = {p.name for p in scene.parameters if p.name not in reduced.values.exact}
    if lacking - {parameter for _, parameter in scene.starts}:
        return {}
    if not lacking:
        return _suggested_configuration(reduced, {}) or {}
    initial_texts = {e.name: e.value.text for e in scene.initial if e.order == 0}
    names = [*(c.name for c in reduced.coordinates), *(name for name, _ in scene.starts)]
    above = {*scene.positive, *(name for q, name in scene.starts if q in scene.positive)}
    return {name: initial_texts.get(name, "1" if name in above else "0") for name in names}


def other_start_hint(reduced: Reduced) -> str:
    """Write a hint with another initial configuration."""
    hint = "start from another configuration"
    values = _suggested_configuration(reduced, {})
    return f"{hint}:\n{section_snippet('initial', values)}" if values else hint


def with_suggestion(
    reduced: Reduced, error: InputError, known: Mapping[sp.Symbol, mpf], *, placed: bool
) -> InputError:
    """Append to the error of an initial state a line that could replace the scene's.

    Parameters
    ----------
    known
        Values of coordinates that the scene gives.
    placed
        True if the positions satisfy the constraints.
    """
    (problem,) = error.problems
    singular, orders = isinstance(error, SingularError), tuple[int, ...]()
    values: dict[str, str] | None = {}
    if isinstance(error, MissingStartError):
        values, orders = _suggested_configuration(reduced, known), (0, 1)
    elif isinstance(error, _WRONG) and placed and not singular:
        orders = (0,)
    elif isinstance(error, _WRONG):
        values = _suggested_configuration(reduced, {}, None if singular else known)
        # Velocities are free where only gaps hold the positions.
        orders = () if reduced.closures else (1,)
    if not values and orders in ((), (1,)):
        return error
    line = initial_snippet(reduced.scene, values or {}, orders)
    return type(error)(replace(problem, hint=f"{problem.hint}\n{line}" if problem.hint else line))


def degrees_remarks(reduced: Reduced) -> Iterator[str]:
    """Yield a remark on each angle that begins at a number of radians that is common in degrees."""
    angles = {c.name for c in reduced.coordinates if c.is_angle}
    for entry in reduced.scene.initial:
        node = entry.value.node
        if entry.order or entry.name not in angles or not isinstance(node, Number):
            continue
        value = node.value
        if 7 < value <= 360 and value % 5 == 0:
            turns = float(value) / (2 * math.pi)
            yield (
                f"{entry.name} begins at {value} radians, {turns:.3g} turns;"
                f" for degrees write {entry.name}: {value}*pi/180"
            )
