"""Number types and function types of C, as ctypes and NumPy know them."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native import quadruple

#: int64_t of the kernels.
LONG = ctypes.c_int64

#: Any pointer.
POINTER = ctypes.c_void_p


@dataclass(frozen=True)
class NativeReal:
    """A floating-point type of C.

    Attributes
    ----------
    name
        What it is called in reports.
    c_name
        What it is called in C.
    dtype
        Type of arrays of its numbers.
    ctype
        A number as a field of a structure and, if ``by_value``, as an argument.
    epsilon
        The distance from 1 to the next number.
    by_value
        ctypes can pass a number to a function.
    """

    name: str
    c_name: str
    dtype: np.dtype[Any]
    ctype: Any
    epsilon: float
    by_value: bool = True

    def array(self, values: Any) -> Any:
        """Return an array of its numbers from doubles, or from such an array."""
        if self.by_value or np.asarray(values).dtype == self.dtype:
            return np.ascontiguousarray(values, dtype=self.dtype)
        return quadruple.from_doubles(values)

    def exact(self, values: Sequence[Fraction]) -> Any:
        """Return an array of the numbers nearest to exact ones."""
        if not self.by_value:
            return quadruple.from_fractions(values)
        high = np.array([float(value) for value in values])
        low = [float(x - Fraction(y)) for x, y in zip(values, high.tolist(), strict=True)]
        return high.astype(self.dtype) + np.array(low, dtype=self.dtype)

    def doubles(self, numbers: Any) -> Array:
        """Round an array of its numbers to doubles, which are returned as they are."""
        if self.by_value or numbers.dtype != self.dtype:
            return np.asarray(numbers, dtype=float)
        return quadruple.to_doubles(numbers)

    def number(self, value: float) -> Any:
        """Return a double as a field of a structure takes it."""
        return value if self.by_value else quadruple.number(value)


def _of_numpy(name: str, dtype: type[np.floating[Any]], ctype: Any) -> NativeReal:
    return NativeReal(name, name, np.dtype(dtype), ctype, float(np.finfo(dtype).eps))


DOUBLE = _of_numpy("double", np.float64, ctypes.c_double)

#: On x86 the extended format of IEEE 754; on some machines nothing but double.
EXTENDED = _of_numpy("long double", np.longdouble, ctypes.c_longdouble)

#: Where the compiler has it and functions for it.
QUADRUPLE = NativeReal(
    "quadruple",
    "_Float128",
    quadruple.BYTES,
    quadruple.Quadruple,
    2.0 ** (1 - quadruple.DIGITS),
    by_value=False,
)


def _wider_types() -> tuple[NativeReal, ...]:
    """Return the types wider than doubles that this machine may have, each wider than the last."""
    layout = ctypes.sizeof(quadruple.Quadruple), ctypes.alignment(quadruple.Quadruple)
    wider = [EXTENDED] if EXTENDED.epsilon < DOUBLE.epsilon else []
    if sys.byteorder == "little" and layout == (16, 16) and QUADRUPLE.epsilon < EXTENDED.epsilon:
        wider.append(QUADRUPLE)
    return tuple(wider)


WIDER_TYPES = _wider_types()


#: Bytes of the largest vector of the machines of today.
_ALIGNMENT = 64


def aligned_zeros(size: int, dtype: Any) -> Any:
    """Make zeros, shape (size,), at an address where vectors of the machine may begin."""
    width = np.dtype(dtype).itemsize
    numbers = np.zeros(size + _ALIGNMENT // width, dtype)
    first = -place_of(numbers) % _ALIGNMENT // width
    return numbers[first : first + size]


_address, _from_buffer = ctypes.addressof, ctypes.c_char.from_buffer


def place_of(array: Any) -> int:
    """Return the address of the first number of an array: ``array.ctypes.data``, but quickly."""
    try:
        return _address(_from_buffer(array))
    except (TypeError, ValueError):  # read-only, strided, or without numbers
        return int(array.ctypes.data)


class ByReference:
    """A C function whose first argument, a number that ctypes cannot pass, goes by its address.

    Attributes
    ----------
    address
        Address of the function.
    """

    def __init__(
        self, function: tuple[str, Any], caller: tuple[str, Any], real: NativeReal
    ) -> None:
        (name, library), (calling, through) = function, caller
        self.address: int = ctypes.cast(library[name], POINTER).value or 0
        self._caller, self._real = through[calling], real

    def __call__(self, t: float, *addresses: int | None) -> int:
        pointers = (POINTER(address) for address in (self.address, *addresses))
        function, *behind = pointers
        return int(self._caller(function, ctypes.byref(self._real.number(t)), *behind))


def address_of(function: Any) -> int:
    """Return the address of a C function."""
    if isinstance(function, ByReference):
        return function.address
    return ctypes.cast(function, POINTER).value or 0


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
