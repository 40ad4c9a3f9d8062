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
    """Zero, or least value, of an event function.

    Attributes
    ----------
    time
        Its time.
    index
        Number of the event function.
    state
        State then, shape (2n,).
    """

    time: float
    index: int
    state: Array


@dataclass(frozen=True)
class NativeEvents:
    """Event functions in C of the interface of a right-hand side.

    Attributes
    ----------
    function
        ``int g(t, y, u, p, work, out)`` of the :func:`.native.c_types.function_type` of the run's
        numbers, which writes one value for each event.
    parameters, work
        As of a :class:`.native.function.NativeRhs`.
    """

    function: Any
    parameters: Array
    work: Array


@dataclass(frozen=True)
class TerminalEvents:
    """Event functions g(t, y) that end a run: it stops where the first falls through zero.

    Attributes
    ----------
    values
        (t, y) → values of all functions, shape (events,).
    signs
        Signs at first. A function that rises from zero has :data:`RISES` and counts from where it
        exceeds its noise.
    noise
        Error of each function at first.
    native
        The same functions for compiled integrators; None if none are compiled.
    reach
        Least values below it are told too; by default none are.
    """

    values: Callable[[float, Array], Array]
    signs: tuple[float, ...]
    noise: tuple[float, ...]
    native: NativeEvents | None = None
    reach: tuple[float, ...] = ()
