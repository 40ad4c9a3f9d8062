"""Number types and function types of C, as ctypes and NumPy know them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

#: int64_t of the kernels.
LONG = ctypes.c_int64

#: Any pointer.
POINTER = ctypes.c_void_p


@dataclass(frozen=True)
class NativeReal:
    """A floating-point type of C, as NumPy and ctypes know it."""

    dtype: type[np.floating[Any]]
    ctype: Any

    @property
    def epsilon(self) -> float:
        """The distance from 1 to the next number."""
        return float(np.finfo(self.dtype).eps)


DOUBLE = NativeReal(np.float64, ctypes.c_double)

#: On x86 the extended format of IEEE 754; on some machines nothing but double.
EXTENDED = NativeReal(np.longdouble, ctypes.c_longdouble)


#: Bytes of the largest vector of the machines of today.
_ALIGNMENT = 64


def aligned_zeros(size: int, dtype: Any) -> Any:
    """Make zeros, shape (size,), at an address where vectors of the machine may begin."""
    width = np.dtype(dtype).itemsize
    numbers = np.zeros(size + _ALIGNMENT // width, dtype)
    first = -numbers.ctypes.data % _ALIGNMENT // width
    return numbers[first : first + size]


@cache
def function_type(real: NativeReal) -> Any:
    """int f(real t, const real *y, const real *u, const void *p, real *work, real *out)"""
    return ctypes.CFUNCTYPE(ctypes.c_int, real.ctype, *[POINTER] * 5)


@cache
def projection_type(real: NativeReal) -> Any:
    """int f(real t, real *y, const real *u, const void *p, real *work)"""
    return ctypes.CFUNCTYPE(ctypes.c_int, real.ctype, *[POINTER] * 4)


#: The same for doubles.
RHS = function_type(DOUBLE)

#: The same at eight states: t and every array with the state as last index.
LANES = ctypes.CFUNCTYPE(ctypes.c_int, *[POINTER] * 6)
