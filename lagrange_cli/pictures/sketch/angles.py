"""Lines whose angle is a coordinate: from body to body, or from the pivot that a coordinate has.

A coordinate is the angle of a line if it is so at all of some feasible configurations, up to its
sign and a number of right angles.
"""

from __future__ import annotations

from itertools import permutations, product
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.pictures.sketch.findings import MOST_SOUGHT, MOVES, SAME, Angle, Findings, Link

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr

    Array: TypeAlias = NDArray[np.float64]

#: Most coordinates on which a line depends whose angle is sought.
_MOST_TURNING = 3


def find_angles(known: Findings) -> None:
    """Find for each coordinate a line whose angle it is."""
    configurations = known.configurations
    if len(configurations.q) < 4:
        return  # too few configurations to tell
    origin = known.add("O", np.zeros((len(configurations.q), 3)))
    pairs = _pairs(known)
    for number, coordinate in enumerate(configurations.equations.system.coordinates):
        if not coordinate.is_angle or np.ptp(configurations.q[:, number]) < MOVES:
            continue
        try:
            angle = _angle(known, number, pairs[number])
        except DomainError:
            continue
        if angle is None:
            continue
        known.angles.append(angle)
        if not known.linked(*angle.ends) and not angle.projected:
            kind: Literal["rod", "radius"] = "rod" if known.constant(*angle.ends) else "radius"
            size = _length_symbol(known, *angle.ends) if kind == "rod" else None
            known.links.append(Link(kind, angle.ends, size))
    used = {end for angle in known.angles for end in angle.ends}
    if origin == len(known.names) - 1 >= known.declared and origin not in used:
        known.keep(origin)


def _pairs(known: Findings) -> dict[int, list[tuple[int, int]]]:
    """Return pairs of bodies between which each coordinate turns the second alone.

    Lines that many coordinates turn are left out: those along two links of a chain, say.
    """
    count = len(known.configurations.equations.system.coordinates)
    pairs: dict[int, list[tuple[int, int]]] = {number: [] for number in range(count)}
    for a, b in product(range(len(known.names)), range(known.declared)):
        first, second = known.depends[a], known.depends[b]
        if a != b and len(first ^ second) <= _MOST_TURNING:
            for number in second - first:
                pairs[number].append((a, b))
    if known.declared <= MOST_SOUGHT:
        anywhere = list(permutations(range(known.declared), 2))
        for number in pairs.keys() - set().union(*known.depends):
            pairs[number] = anywhere  # closures alone tie it to positions
    return pairs


def _angle(known: Findings, number: int, pairs: list[tuple[int, int]]) -> Angle | None:
    """Find the line between two bodies, or from a pivot to a body, that has this angle."""
    for a, b in sorted(pairs, key=lambda pair: _preference(known, *pair)):
        angle = _angle_of(known, number, a, b)
        if angle is not None:
            return angle
    moving = [b for b in range(known.declared) if number in known.depends[b]]
    return _about_pivot(known, number, moving)


def _preference(known: Findings, a: int, b: int) -> tuple[bool, int, bool, bool, float]:
    lengths = known.distances(a, b)
    kind = 2 if known.is_particle(a) else 0 if a < known.declared else 1
    varies = bool(np.ptp(lengths) > SAME * lengths.max())
    return not known.is_fixed(a), kind, varies, not known.is_particle(b), float(lengths[0])


def _about_pivot(known: Findings, number: int, bodies: list[int]) -> Angle | None:
    """Find the centre about which a coordinate turns a body: half a turn leads across it."""
    configurations = known.configurations
    if len(known.names) - known.declared > MOST_SOUGHT:
        return None
    across = np.array(
        [configurations.turned(number, np.pi, k) for k in range(len(configurations.q))]
    )
    candidates = []
    for b in bodies:
        centres = (across[:, b] + known.places[:, b]) / 2
        candidates.append((float(np.ptp(centres, axis=0).max()), b, centres))
    for _, b, centres in sorted(candidates, key=lambda c: (round(c[0], 9), c[1])):
        count = len(known.names)
        pivot = known.add("", centres, known.depends[b] - {number})
        angle = _angle_of(known, number, pivot, b)
        if angle is not None:
            return angle
        known.keep(count)
    return None


def _angle_of(known: Findings, number: int, a: int, b: int) -> Angle | None:
    """Tell whether a coordinate is an angle of the line from a to b."""
    along = known.places[:, b] - known.places[:, a]
    if np.linalg.norm(along, axis=1).min() <= MOVES * known.configurations.size:
        return None
    q = known.configurations.q[:, number]
    return _polar(number, (a, b), along, q) or _azimuth(number, (a, b), along, q)


def _azimuth(number: int, ends: tuple[int, int], along: Array, q: Array) -> Angle | None:
    """Return an angle in a coordinate plane from one of its axes."""
    size = np.abs(along).max()
    for i, j in ((0, 1), (0, 2), (1, 2)):
        flat = np.hypot(along[:, i], along[:, j])
        if flat.min() <= MOVES * size:
            continue
        polar = np.arctan2(along[:, j], along[:, i])
        for sign in (1, -1):
            turns = np.exp(1j * (polar - sign * q))
            quarter = round(float(np.angle(turns[0])) / (np.pi / 2))
            if np.abs(turns - 1j**quarter).max() > 1e-7:
                continue
            frame = np.eye(3)[[i, j, i, j]] * np.array([1, 1, -1, -1])[:, None]
            projected = bool(np.abs(flat - np.linalg.norm(along, axis=1)).max() > SAME * size)
            reference, towards = frame[quarter % 4], sign * frame[(quarter + 1) % 4]
            return Angle(number, ends, reference, towards, float(q[0]), projected)
    return None


def _polar(number: int, ends: tuple[int, int], along: Array, q: Array) -> Angle | None:
    """Return an angle in space between the line and an axis, in three dimensions."""
    if (np.abs(along).max(axis=0) <= SAME * np.abs(along).max()).any():
        return None
    units = along / np.linalg.norm(along, axis=1)[:, None]
    for axis in (2, 1, 0):
        for sign in (-1, 1):
            if np.abs(units[:, axis] - sign * np.cos(q)).max() > 1e-9:
                continue
            reference = sign * np.eye(3)[axis]
            across = units[0] - (units[0] @ reference) * reference
            if np.linalg.norm(across) < MOVES or not 0 < q[0] < np.pi:
                return None
            towards = across / np.linalg.norm(across)
            return Angle(number, ends, reference, towards, float(q[0]), False)
    return None


def _length_symbol(known: Findings, a: int, b: int) -> Expr | None:
    """Return the parameter that a distance is equal to whatever the parameters are."""
    configurations = known.configurations
    bodies = known.declared
    values = configurations.values
    length = known.distances(a, b)[0]
    fixed = known.places[0]
    if not all(end < bodies or known.is_fixed(end) for end in (a, b)):
        return None
    for symbol, value in values.items():
        if abs(value - length) > SAME * abs(length):
            continue
        others = {s: v * (1.17 + 0.05 * k) for k, (s, v) in enumerate(values.items())}
        try:
            moved = configurations.moved(
                configurations.q[0], float(configurations.times[0]), others
            )
        except DomainError:
            continue
        ends = [moved[end] if end < bodies else fixed[end] for end in (a, b)]
        if abs(np.linalg.norm(ends[1] - ends[0]) - abs(others[symbol])) <= SAME * length:
            return symbol
    return None
