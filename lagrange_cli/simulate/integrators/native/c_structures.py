"""Twins of the structures and constants of the C kernels, as ctypes has them.

Nothing compares the two when a library is loaded: a test has the compiler judge the place and
size of every field, and every constant that both languages know.
"""

from __future__ import annotations

import ctypes
from enum import IntEnum
from functools import cache
from typing import Any

from lagrange_cli.simulate.integrators.event_functions import EVENT_PARTS
from lagrange_cli.simulate.integrators.native.c_types import LONG, POINTER, NativeReal

#: Events of one function in a step at most (MOST of events.c).
MOST_EVENTS = 3 * EVENT_PARTS

#: Rows of values of landmarks: those of one state, and those of the TIMES of a step (landmarks.c).
LANDMARK_ROWS = 8


class KernelStatus(IntEnum):
    """Why a call of a kernel came back: ``LAGRANGE_OK`` and those that follow it in kernel.h."""

    OK = 0
    UNDERFLOW = 1
    NOT_FINITE = 2
    ENDED = 3
    UNMET = 4
    DIVERGES = 5


@cache
def run_type(real: NativeReal) -> Any:
    """``lagrange_run`` of kernel.h."""
    fields = (
        *((name, POINTER) for name in ("rhs", "lanes", "project", "u", "p", "work")),
        *((name, POINTER) for name in ("rtol", "atol", "memory")),
        ("events", POINTER),
        ("n", LONG),
        *((name, real.ctype) for name in ("t_end", "max_step", "t", "t_old", "t_new", "h")),
        *((name, LONG) for name in ("steps", "rejections", "evaluations", "dense", "mode")),
        *((name, real.ctype) for name in ("rate", "noise")),
        *((name, POINTER) for name in ("starts", "inputs")),
        *((name, LONG) for name in ("width", "pieces", "piece")),
        *((name, POINTER) for name in ("shift", "landmarks", "series")),
        ("series_rows", LONG),
        *((name, POINTER) for name in ("observed", "since", "looser")),
        ("stretches", LONG),
    )
    return _structure("Run", fields)


@cache
def events_type() -> Any:
    """``lagrange_events`` of events.h."""
    fields = (
        *((name, POINTER) for name in ("function", "u", "p", "work", "direction", "terminal")),
        *((name, POINTER) for name in ("sign", "noise", "reach", "before", "values", "state")),
        *((name, LONG) for name in ("count", "capacity", "located", "first")),
        *((name, POINTER) for name in ("times", "indices", "states")),
    )
    return _structure("Events", fields)


@cache
def landmarks_type() -> Any:
    """``lagrange_landmarks`` of kernel.h."""
    fields = (
        *((name, POINTER) for name in ("function", "p", "work", "level", "active")),
        *((name, POINTER) for name in ("values", "state")),
        *((name, LONG) for name in ("count", "remade")),
    )
    return _structure("Landmarks", fields)


@cache
def observed_type() -> Any:
    """``lagrange_observed`` of kernel.h: doubles, since coarse runs are made in these alone."""
    fields = (
        *((name, POINTER) for name in ("origin", "angle", "kind", "moved", "scales", "way")),
        *((name, POINTER) for name in ("closest", "ends", "lengths", "size", "state")),
        *((name, ctypes.c_double) for name in ("tolerance", "least", "span", "brief", "longest")),
        *((name, ctypes.c_double) for name in ("nearest", "slowest", "since")),
        *((name, LONG) for name in ("recorded", "passed", "settling", "window", "ended")),
    )
    return _structure("Observed", fields)


@cache
def members_type(width: int, real: NativeReal) -> Any:
    """``lagrange_members`` of taylor.c, for so many lanes."""
    fields = (
        *((name, POINTER) for name in ("series", "times", "starts", "p", "kinds", "states")),
        *((name, POINTER) for name in ("filled", "steps", "memory")),
        *((name, LONG) for name in ("n", "rows", "order", "members", "samples", "parameters")),
        ("most_steps", LONG),
        *((name, real.ctype) for name in ("tolerance", "longest", "glance", "forgiven")),
        ("begun", LONG),
        *((name, LONG * width) for name in ("member", "next")),
    )
    return _structure("Members", fields)


def _structure(name: str, fields: tuple[tuple[str, Any], ...]) -> Any:
    return type(name, (ctypes.Structure,), {"_fields_": fields})
