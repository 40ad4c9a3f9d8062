"""Functions over discs in the complex plane: where they are analytic, and how large they get there.

A disc has a real middle and a radius; what a function makes of it is enclosed by another one
(Petković and Petković, *Complex Interval Arithmetic and Its Applications*, 1998). Both may be
arrays, of many discs at once. Middles and radii are rounded: a last place more or less is not
what is asked.
"""

from __future__ import annotations

import numbers
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import UnfitError


class Disc:
    """All complex numbers within ``radius`` of ``middle``.

    The radius is infinite, or not a number, where what made it is not analytic. Operands that
    are neither discs nor real numbers answer for themselves.
    """

    __slots__ = ("middle", "radius")

    def __init__(self, middle: Array | float, radius: Array | float = 0.0) -> None:
        self.middle, self.radius = middle, radius

    @property
    def largest(self) -> Any:
        """The largest magnitude in it."""
        return np.abs(self.middle) + self.radius

    def __add__(self, other: Disc | float) -> Disc:
        if isinstance(other, Disc):
            return Disc(self.middle + other.middle, self.radius + other.radius)
        return Disc(self.middle + other, self.radius) if _is_real(other) else NotImplemented

    __radd__ = __add__

    def __neg__(self) -> Disc:
        return Disc(-self.middle, self.radius)

    def __sub__(self, other: Disc | float) -> Disc:
        if isinstance(other, Disc):
            return Disc(self.middle - other.middle, self.radius + other.radius)
        return Disc(self.middle - other, self.radius) if _is_real(other) else NotImplemented

    def __rsub__(self, other: float) -> Disc:
        return Disc(other - self.middle, self.radius)

    def __mul__(self, other: Disc | float) -> Disc:
        if not isinstance(other, Disc):
            if not _is_real(other):
                return NotImplemented
            return Disc(self.middle * other, self.radius * abs(other))
        crossed = np.abs(self.middle) * other.radius + other.largest * self.radius
        return Disc(self.middle * other.middle, crossed)

    __rmul__ = __mul__

    def inverse(self) -> Disc:
        """1/z, where 0 is not in the disc."""
        # The image is a disc; its middle is not the inverse of the middle.
        squared = (np.abs(self.middle) - self.radius) * self.largest
        return Disc(self.middle / squared, _where(squared > 0, self.radius / squared))

    def __truediv__(self, other: Disc | float) -> Disc:
        if isinstance(other, Disc):
            return self * other.inverse()
        if not _is_real(other):
            return NotImplemented
        return Disc(self.middle / other, self.radius / abs(other))

    def __rtruediv__(self, other: float) -> Disc:
        return self.inverse() * other

    def __pow__(self, other: Disc | float) -> Disc:
        if not isinstance(other, Disc) and not _is_real(other):
            return NotImplemented
        if isinstance(other, Disc) or other != int(other):
            return exp(log(self) * other)
        if other < 0:
            return (self**-other).inverse()
        power = self.middle ** int(other)
        return Disc(power, self.largest ** int(other) - np.abs(power))

    def __rpow__(self, other: float) -> Disc:
        return exp(self * float(np.log(other)))


def _is_real(value: object) -> bool:
    return isinstance(value, numbers.Real)


def _where(analytic: Any, radius: Any) -> Any:
    """A radius, infinite elsewhere."""
    return np.where(analytic, radius, np.inf)


def exp(z: Disc) -> Disc:
    size = np.exp(z.middle)
    return Disc(size, size * np.expm1(z.radius))


def log(z: Disc) -> Disc:
    ratio = z.radius / z.middle
    return Disc(np.log(z.middle), _where((ratio >= 0) & (ratio < 1), -np.log1p(-ratio)))


def sqrt(z: Disc) -> Disc:
    root = np.sqrt(z.middle)
    return Disc(root, _where(z.radius < z.middle, root - np.sqrt(z.middle - z.radius)))


def _turned(own: Any, other: Any, radius: Any) -> Disc:
    """A sine or cosine, hyperbolic or not, from its value and its derivative in the middle."""
    more = 2.0 * np.sinh(radius / 2.0) ** 2  # cosh(radius) - 1
    return Disc(own, np.abs(other) * np.sinh(radius) + np.abs(own) * more)


def sin(z: Disc) -> Disc:
    return _turned(np.sin(z.middle), np.cos(z.middle), z.radius)


def cos(z: Disc) -> Disc:
    return _turned(np.cos(z.middle), np.sin(z.middle), z.radius)


def sinh(z: Disc) -> Disc:
    return _turned(np.sinh(z.middle), np.cosh(z.middle), z.radius)


def cosh(z: Disc) -> Disc:
    return _turned(np.cosh(z.middle), np.sinh(z.middle), z.radius)


def tan(z: Disc) -> Disc:
    return sin(z) / cos(z)


def tanh(z: Disc) -> Disc:
    return sinh(z) / cosh(z)


def atan(z: Disc) -> Disc:
    # On a disc without the poles ±i: as far as the largest derivative leads.
    return Disc(np.arctan(z.middle), z.radius * (z * z + 1.0).inverse().largest)


def _unknown(name: str) -> Callable[..., Any]:
    def refuse(*_: Disc) -> Disc:
        raise UnfitError(f"{name} is not known over discs")

    return refuse


def _disc(value: Disc | float) -> Disc:
    return value if isinstance(value, Disc) else Disc(float(value))


#: What :class:`.external.heyoka_algebra.Algebra` asks a package for.
DISCS = SimpleNamespace(
    **{name: _unknown(name) for name in ("asin", "acos", "asinh", "acosh", "atanh", "atan2")},
    **{of.__name__: of for of in (sin, cos, tan, sinh, cosh, tanh, atan, exp, log, sqrt)},
    expression=_disc,
)
