"""Structures and constants of the C kernels, as ctypes has them.

Structures are read from the files that declare them. A test has the compiler judge the place and
size of every field, and every constant that both languages know.
"""

from __future__ import annotations

import ctypes
from enum import IntEnum
from functools import cache
from typing import Any

from lagrange_cli.simulate.integrators.event_functions import EVENT_PARTS
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, LONG, POINTER, NativeReal
from lagrange_cli.simulate.kernels import source

#: Events of one function in a step at most (MOST of events.c).
MOST_EVENTS = EVENT_PARTS + 1

#: Rows of values of landmarks: those of one state, and those of the TIMES of a step (landmarks.c).
LANDMARK_ROWS = 8

#: The file that declares each structure; what is observed is doubles, as coarse runs are.
_FILES = {
    "run": "kernel.h",
    "landmarks": "kernel.h",
    "observed": "kernel.h",
    "events": "events.h",
    "members": "members/taylor.c",
}


class KernelStatus(IntEnum):
    """Why a call of a kernel came back: ``LAGRANGE_OK`` and those that follow it in kernel.h."""

    OK = 0
    UNDERFLOW = 1
    NOT_FINITE = 2
    ENDED = 3
    UNMET = 4
    DIVERGES = 5


@cache
def structure(name: str, real: NativeReal = DOUBLE, lanes: int = 1) -> Any:
    """Make the twin of ``lagrange_NAME``, with numbers of a type and arrays of so many lanes."""
    text = source(_FILES[name]).partition(f"}} lagrange_{name};")[0]
    body = text.rpartition("typedef struct")[2]
    text = "".join(part.rpartition("*/")[2] for part in body.partition("{")[2].split("/*"))
    fields: list[tuple[str, Any]] = []
    for declaration in text.split(";")[:-1]:
        kind, names = declaration.replace("const ", "").replace("struct ", "").split(None, 1)
        number = {"double": real.ctype, "int64_t": LONG}.get(kind, POINTER)
        for declared in names.split(","):
            field, _, several = declared.strip().partition("[")
            ctype = POINTER if field.startswith("*") else number
            fields.append((field.lstrip("*"), ctype * lanes if several else ctype))
    return type(name, (ctypes.Structure,), {"_fields_": fields})
