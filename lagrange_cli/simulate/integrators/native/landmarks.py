"""Exponents of sharp functions, watched along a compiled run (kernels/landmarks.c)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.c_structures import LANDMARK_ROWS, structure
from lagrange_cli.simulate.integrators.native.c_types import (
    NativeReal,
    address_of,
    place_of,
)


@dataclass(frozen=True)
class NativeLandmarks:
    """A C function that gives the exponents of ``count`` sharp functions.

    Attributes
    ----------
    function, parameters, work
        As of :class:`.integrators.event_functions.NativeEvents`.
    """

    function: Any
    parameters: Array
    work: Array
    count: int


class LandmarkBuffer:
    """Memory of a kernel for exponents; ``peaks``, shape (2, count), is kept between steps."""

    def __init__(self, landmarks: NativeLandmarks, dimension: int, real: NativeReal) -> None:
        count, dtype = landmarks.count, real.dtype
        self.peaks = np.zeros((2, count), dtype)
        arrays = {
            "p": real.array(landmarks.parameters),
            "work": np.empty_like(landmarks.work, dtype),
            "level": self.peaks[0],
            "active": self.peaks[1],
            "values": np.empty((LANDMARK_ROWS, count), dtype),
            "state": np.empty(dimension, dtype),
        }
        self._kept_alive = landmarks, arrays
        self._c = structure("landmarks")(count=count)
        self._c.function = address_of(landmarks.function)
        for name, array in arrays.items():
            setattr(self._c, name, place_of(array))

    @property
    def remade(self) -> int:
        """Number of steps that were made again."""
        return int(self._c.remade)

    @property
    def address(self) -> int:
        return ctypes.addressof(self._c)
