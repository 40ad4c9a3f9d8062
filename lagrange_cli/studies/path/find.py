"""Find paths of stationary action between two configurations at two times.

From many starts :mod:`.search` comes to candidates, and with one degree of freedom :mod:`.scan` to
all up to an energy; :mod:`.aiming` makes them accurate. Of each
path that is not known yet the action is integrated, conjugate points are counted (:mod:`.morse`),
and the motion is simulated from its start as ``lagrange simulate`` does: it has to come to the end.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import AccuracyError, InputError, Problem
from lagrange_cli.studies.path.aiming import aimed
from lagrange_cli.studies.path.ends import End
from lagrange_cli.studies.path.measure import StationaryPath, measured_path
from lagrange_cli.studies.path.models import PathModels, require_smooth
from lagrange_cli.studies.path.motions import Motions
from lagrange_cli.studies.path.result import Paths
from lagrange_cli.studies.path.scan import scan, scanned
from lagrange_cli.studies.path.search import candidates, scales_of

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache
    from lagrange_cli.simulate.arrays import Array

#: Defaults: accuracy, starts for each end, samples of a path.
ACCURACY, STARTS, SAMPLES = 1e-9, 32, 101

#: Most starts of all ends together.
_MOST_STARTS = 20_000

#: Distance of initial velocities, over scale/span, within which two paths are one.
_SAME = 1e-5

#: Relative distance of the actions of degenerate paths that belong to one family.
_SAME_ACTION = 1e-6


def find_paths(
    models: PathModels,
    first: End,
    last: End,
    *,
    accuracy: float = ACCURACY,
    starts: int = STARTS,
    turns: int = 0,
    samples: int = SAMPLES,
    cache: Cache | None = None,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Paths:
    """Find the paths between two ends that some starts lead to.

    Parameters
    ----------
    accuracy
        Largest error of a coordinate or velocity anywhere on a path, over its scale.
    starts
        Number of starts for each end.
    turns
        Whole turns, at most, by which ends of angles may differ from ``last``.
    samples
        Number of samples of each path.
    cache, stop
        As :class:`.motions.Motions` has them.
    progress
        Called with a fraction from 0 to 1 that never falls.

    Raises
    ------
    InputError
        A number cannot be used, no angle can be turned, or no motion begins at ``first``.
    AccuracyError
        No path was found.
    """
    _require_counts(starts, turns, samples)
    require_smooth(models.motion)
    turnable = tuple(itertools.compress(models.motion.coordinates, models.periodic))
    ends = _turned(last, models.periodic, turns, starts)
    motions = Motions(models, cache, stop)
    motions.require(first, last, accuracy, samples)
    solutions: list[StationaryPath] = []
    tried = lost = further = 0
    size = float(scales_of(motions, first, last)[0])
    whole = scan(motions, first, last, size)
    for number, end in enumerate(ends):
        scale = scales_of(motions, first, end) / (end.t - first.t)
        known: list[Array] = []
        from_scan = () if whole is None else scanned(motions, first, end, whole, size)
        for k, v in enumerate(itertools.chain(candidates(motions, first, end, starts), from_scan)):
            tried += k < starts
            if progress is not None:
                progress((number + min(k + 1, starts) / starts) / len(ends))
            if v is None or _is_among(known, v, scale):
                continue
            aim = aimed(motions, first, end, v, accuracy)
            if aim is not None and _is_among(known, aim.v, scale):
                continue
            path = (
                None if aim is None else measured_path(motions, first, end, aim, accuracy, samples)
            )
            if path is None:
                lost += 1
                continue
            known.append(path.velocity)
            if not _is_of_family(path, solutions):
                solutions.append(path)
                further += k >= starts and whole is None
    if not solutions:
        raise _none_found(tried, lost)
    ordered = tuple(sorted(solutions, key=_order))
    counts = tried, lost, turnable, turns
    return Paths(first, last, ordered, accuracy, *counts, motions, whole, further)


def _require_counts(starts: int, turns: int, samples: int) -> None:
    for name, value, least in (("starts", starts, 1), ("turns", turns, 0), ("samples", samples, 2)):
        if not least <= value <= _MOST_STARTS:
            message = f"{name} must be from {least} to {_MOST_STARTS:,}, not {value}"
            raise InputError(Problem(message, hint=f"--{name} {least}", rule="path"))


def _turned(last: End, periodic: Sequence[bool], turns: int, starts: int) -> list[End]:
    """Return the end with angles turned by up to some whole turns, the least turned first."""
    if turns and not any(periodic):
        message = "no coordinate is an angle whose whole turn leaves L as it is"
        raise InputError(Problem(message, hint="leave out --turns", rule="path"))
    choices = [range(-turns, turns + 1) if turnable else (0,) for turnable in periodic]
    number = math.prod(map(len, choices))
    if number * starts > _MOST_STARTS:
        message = f"{number} ends with {starts} starts each are more than {_MOST_STARTS:,} starts"
        raise InputError(Problem(message, hint="fewer --turns or --starts", rule="path"))
    turned = sorted(itertools.product(*choices), key=lambda turn: sum(map(abs, turn)))
    return [replace(last, q=last.q + 2 * np.pi * np.array(turn)) for turn in turned]


def _is_among(known: Sequence[Array], v: Array, scale: Array) -> bool:
    return any(np.max(np.abs(v - seen) / scale) < _SAME for seen in known)


def _is_of_family(path: StationaryPath, solutions: Sequence[StationaryPath]) -> bool:
    """Decide whether a degenerate path is one of a family of which another is known.

    All paths of a family between the same ends have the same action, by its being stationary.
    """
    return path.conjugacy.kind == "degenerate" and any(
        seen.conjugacy.kind == "degenerate"
        and np.array_equal(seen.last.q, path.last.q)
        and math.isclose(seen.action, path.action, rel_tol=_SAME_ACTION, abs_tol=path.action_error)
        for seen in solutions
    )


def _order(path: StationaryPath) -> tuple[float, ...]:
    """Order paths by their action; by their start those whose actions differ by rounding."""
    return float(f"{path.action:.8g}"), *path.velocity.tolist()


def _none_found(starts: int, lost: int) -> AccuracyError:
    message = f"no path of stationary action was found from {starts} starts"
    if lost:
        message += f"; {lost} came close to paths that could not be certified"
    hint = "--starts N tries more; there is none to some ends that are conjugate to the start"
    return AccuracyError(Problem(message, hint=hint, rule="path"))
