"""A motion seen step by step along a compiled run (kernels/observed.c)."""

from __future__ import annotations

import ctypes

import numpy as np

from lagrange_cli.simulate.integrators.native.c_structures import structure
from lagrange_cli.simulate.integrators.native.c_types import place_of
from lagrange_cli.simulate.integrators.observed_motion import (
    BRIEF,
    ROOM,
    SETTLING,
    WINDOW,
    ObservedMotion,
)

#: Numbers that the kernel changes.
_CHANGED = ("longest", "since", "passed", "ended")


class ObservedBuffer:
    """Memory of a kernel for what it sees; it works on the arrays of an :class:`ObservedMotion`."""

    def __init__(self, motion: ObservedMotion) -> None:
        self._motion = motion
        self._steps, n = np.empty((2, ROOM)), len(motion.way)
        arrays = {
            **{name: getattr(motion, name) for name in ("origin", "angle", "kind", "moved")},
            **{name: getattr(motion, name) for name in ("scales", "way", "closest")},
            "ends": self._steps[0],
            "lengths": self._steps[1],
            "size": np.empty(n),
            "state": np.empty(2 * n),
        }
        self._kept_alive = arrays
        self._c = structure("observed")(brief=BRIEF, settling=SETTLING, window=WINDOW)
        for name, array in arrays.items():
            setattr(self._c, name, place_of(array))
        for name in ("tolerance", "least", "span", "nearest", "slowest"):
            setattr(self._c, name, getattr(motion, name))

    def give(self) -> None:
        """Bring the kernel up to date with the motion, which other runs may have seen."""
        for name in _CHANGED:
            setattr(self._c, name, getattr(self._motion, name))

    def take(self) -> None:
        """Bring the motion up to date with what the kernel has seen."""
        self._motion.extend(*self._steps[:, : self._c.recorded].tolist())
        self._c.recorded = 0
        for name in _CHANGED:
            setattr(self._motion, name, getattr(self._c, name))

    @property
    def address(self) -> int:
        return ctypes.addressof(self._c)
