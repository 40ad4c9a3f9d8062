"""Numbers of 113 binary digits as bytes: what C's ``_Float128`` is, which NumPy does not know.

An array of them has numbers of 16 bytes without a value (``V16``); whoever computes with them is C.
They are the ``binary128`` of IEEE 754: a sign, 15 bits of exponent, 112 bits behind the leading 1.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array

#: The type of their arrays.
BYTES = np.dtype("V16")

#: Binary digits of a number.
DIGITS = 113

_BIAS = 16383
_LARGEST_EXPONENT = 0x7FFF
_FRACTION = 2**48 - 1

#: Digits of a double, and those behind the leading 1.
_DOUBLE_DIGITS, _DOUBLE_FRACTION = 53, 2**52 - 1


class Quadruple(ctypes.c_longdouble):
    """One number as a field of a C structure: as long and aligned as a long double of 16 bytes."""

    def __float__(self) -> float:
        return float(to_doubles(np.frombuffer(bytes(self), BYTES))[0])


def number(value: float) -> Quadruple:
    """Return a double as a field has it."""
    return Quadruple.from_buffer_copy(from_doubles(np.array([value])).tobytes())


def from_doubles(values: Array) -> NDArray[np.void]:
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
    return words.view(BYTES)[..., 0]


def to_doubles(numbers: NDArray[np.void]) -> Array:
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


def from_fractions(values: Sequence[Fraction]) -> NDArray[np.void]:
    """Round exact numbers to the nearest, shape (len(values),)."""
    bits = b"".join(_bits(value).to_bytes(16, "little") for value in values)
    return np.frombuffer(bits, BYTES).copy()


def _bits(value: Fraction) -> int:
    if value == 0:
        return 0
    size = abs(value)
    exponent = size.numerator.bit_length() - size.denominator.bit_length()
    exponent -= size < Fraction(2) ** exponent
    digits = round(size * Fraction(2) ** (DIGITS - 1 - exponent))
    # A round-up to the next power of two carries into the exponent.
    biased = (exponent + _BIAS << DIGITS - 1) + digits - (1 << DIGITS - 1)
    return (value < 0) << 127 | biased
