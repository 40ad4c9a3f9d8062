"""Event functions g(t, y) of a run, whose zeros the run tells or ends at.

Values that :mod:`.base` passes on: what looks for the zeros is :mod:`.event_location` where steps
are made in Python, and kernels/events.c where they are made in C.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from lagrange_cli.simulate.arrays import Array

#: Parts of a step in which signs are looked at (events.h).
EVENT_PARTS = 4

#: The sign of a function that is zero at first, but for rounding, and then positive (events.h).
RISES = 2.0


@dataclass(frozen=True)
class ZeroCrossing:
    """Event function ``index`` was zero at ``time``, in state ``state``."""

    time: float
    index: int
    state: Array


@dataclass(frozen=True)
class NativeEvents:
    """Event functions in C of the interface of a right-hand side.

    Parameters
    ----------
    function
        ``int g(t, y, u, p, work, out)`` of the :func:`.native.c_types.function_type` of the
        run's numbers, which writes one value for each event.
    directions
        For each event: 1 where only a rising zero counts, −1 a falling one, 0 both.
    terminal
        For each event: whether the run ends there.
    parameters, work
        As of a :class:`.native.function.NativeRhs`.
    signs, noise
        Those that the functions have at first, 0 where that is to be seen; all are by default.
        What is made of one that rises from zero (events.h) begins above its noise.
    reach
        Of each function: least values below it are told too; none are by default.
    """

    function: Any
    directions: tuple[int, ...]
    terminal: tuple[bool, ...]
    parameters: Array
    work: Array
    signs: tuple[float, ...] = ()
    noise: tuple[float, ...] = ()
    reach: tuple[float, ...] = ()


@dataclass(frozen=True)
class TerminalEvents:
    """Functions g(t, y), of which a run ends where the first falls through zero.

    ``values`` gives all of them; ``signs`` are those that they have at first (or
    :data:`RISES`, and then what is made of it begins above its ``noise``); ``native`` are the
    same functions for compiled integrators. Least values below their ``reach`` are told.
    """

    values: Callable[[float, Array], Array]
    signs: tuple[float, ...]
    noise: tuple[float, ...]
    native: NativeEvents | None = None
    reach: tuple[float, ...] = ()
