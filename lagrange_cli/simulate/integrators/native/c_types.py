"""Number types, function types, structures and constants of C, as ctypes and NumPy know them.

NumPy does not know C's ``_Float128``, the ``binary128`` of IEEE 754: a sign, 15 bits of exponent,
112 bits behind the leading 1. An array of such numbers has 16 bytes a number without a value
(``V16``); only C computes with them.

Structures are read from the files that declare them. A test has the compiler judge the place and
size of every field, and every constant that both languages know.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import EVENT_PARTS
from lagrange_cli.simulate.kernels import source

#: The type of their arrays.
QUADRUPLE_BYTES = np.dtype("V16")

#: Binary digits of a number.
QUADRUPLE_DIGITS = 113

_BIAS = 16383
_LARGEST_EXPONENT = 0x7FFF
_FRACTION = 2**48 - 1

#: Digits of a double, and those behind the leading 1.
_DOUBLE_DIGITS, _DOUBLE_FRACTION = 53, 2**52 - 1


class Quadruple(ctypes.c_longdouble):
    """One number as a field of a C structure: as long and aligned as a long double of 16 bytes."""

    def __float__(self) -> float:
        return float(doubles_from_quadruples(np.frombuffer(bytes(self), QUADRUPLE_BYTES))[0])


def quadruple_from_double(value: float) -> Quadruple:
    """Return a double as a field has it."""
    return Quadruple.from_buffer_copy(quadruples_from_doubles(np.array([value])).tobytes())


def quadruples_from_doubles(values: Array) -> NDArray[np.void]:
    """Return the same numbers, of the same shape."""
    values = np.asarray(values, dtype=float)
    part, exponent = np.frexp(np.abs(values))
    finite = np.isfinite(values)
    digits = np.where(finite, np.ldexp(part, _DOUBLE_DIGITS), 0.0).astype(np.uint64)
    digits &= np.uint64(_DOUBLE_FRACTION)
    biased = np.where(finite, exponent - 1 + _BIAS, _LARGEST_EXPONENT).astype(np.uint64)
    biased[values == 0] = 0
    digits[np.isnan(values)] = _DOUBLE_FRACTION
    words = np.empty((*values.shape, 2), "<u8")
    words[..., 0] = digits << np.uint64(60)
    words[..., 1] = digits >> np.uint64(4) | biased << np.uint64(48)
    words[..., 1] |= np.signbit(values).astype(np.uint64) << np.uint64(63)
    return words.view(QUADRUPLE_BYTES)[..., 0]


def doubles_from_quadruples(numbers: NDArray[np.void]) -> Array:
    """Round numbers to doubles, of the same shape; those too small for the leading 1 are 0."""
    words = np.ascontiguousarray(numbers).view("<u8").reshape(*numbers.shape, 2)
    low, high = words[..., 0], words[..., 1]
    exponent = (high >> np.uint64(48) & np.uint64(_LARGEST_EXPONENT)).astype(np.int64)
    fraction = high & np.uint64(_FRACTION)
    upper = (fraction + np.uint64(_FRACTION + 1)).astype(float)
    with np.errstate(over="ignore"):
        size = np.ldexp(upper + np.ldexp(low.astype(float), -64), exponent - _BIAS - 48)
    endless = np.where((fraction | low) == 0, np.inf, np.nan)
    size = np.where(exponent == _LARGEST_EXPONENT, endless, size)
    size = np.where(exponent == 0, 0.0, size)
    return np.where(high >> np.uint64(63) == 1, -size, size)


def quadruples_from_fractions(values: Sequence[Fraction]) -> NDArray[np.void]:
    """Round exact numbers to the nearest, shape (len(values),)."""
    bits = b"".join(_quadruple_bits(value).to_bytes(16, "little") for value in values)
    return np.frombuffer(bits, QUADRUPLE_BYTES).copy()


def _quadruple_bits(value: Fraction) -> int:
    if value == 0:
        return 0
    size = abs(value)
    exponent = size.numerator.bit_length() - size.denominator.bit_length()
    exponent -= size < Fraction(2) ** exponent
    digits = round(size * Fraction(2) ** (QUADRUPLE_DIGITS - 1 - exponent))
    # A round-up to the next power of two carries into the exponent.
    biased = (exponent + _BIAS << QUADRUPLE_DIGITS - 1) + digits - (1 << QUADRUPLE_DIGITS - 1)
    return (value < 0) << 127 | biased


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
        return quadruples_from_doubles(values)

    def exact(self, values: Sequence[Fraction]) -> Any:
        """Return an array of the numbers nearest to exact ones."""
        if not self.by_value:
            return quadruples_from_fractions(values)
        high = np.array([float(value) for value in values])
        low = [float(x - Fraction(y)) for x, y in zip(values, high.tolist(), strict=True)]
        return high.astype(self.dtype) + np.array(low, dtype=self.dtype)

    def doubles(self, numbers: Any) -> Array:
        """Round an array of its numbers to doubles, which are returned as they are."""
        if self.by_value or numbers.dtype != self.dtype:
            return np.asarray(numbers, dtype=float)
        return doubles_from_quadruples(numbers)

    def number(self, value: float) -> Any:
        """Return a double as a field of a structure takes it."""
        return value if self.by_value else quadruple_from_double(value)


def _of_numpy(name: str, dtype: type[np.floating[Any]], ctype: Any) -> NativeReal:
    return NativeReal(name, name, np.dtype(dtype), ctype, float(np.finfo(dtype).eps))


DOUBLE = _of_numpy("double", np.float64, ctypes.c_double)

#: On x86 the extended format of IEEE 754; on some machines nothing but double.
EXTENDED = _of_numpy("long double", np.longdouble, ctypes.c_longdouble)

#: Where the compiler has it and functions for it.
QUADRUPLE = NativeReal(
    "quadruple",
    "_Float128",
    QUADRUPLE_BYTES,
    Quadruple,
    2.0 ** (1 - QUADRUPLE_DIGITS),
    by_value=False,
)


def _wider_types() -> tuple[NativeReal, ...]:
    """Return the types wider than doubles that this machine may have, each wider than the last."""
    layout = ctypes.sizeof(Quadruple), ctypes.alignment(Quadruple)
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
    """Return the type int f(real t, const real *y, const real *u, const void *p, real *work,
    real *out)."""
    return ctypes.CFUNCTYPE(ctypes.c_int, real.ctype, *[POINTER] * 5)


@cache
def projection_type(real: NativeReal) -> Any:
    """Return the type int f(real t, real *y, const real *u, const void *p, real *work)."""
    return ctypes.CFUNCTYPE(ctypes.c_int, real.ctype, *[POINTER] * 4)


#: The same for doubles.
RHS = function_type(DOUBLE)

#: The same at eight states: t and every array with the state as last index.
LANES = ctypes.CFUNCTYPE(ctypes.c_int, *[POINTER] * 6)


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
