"""Functions of mpmath's numbers, refused where a value or its digits would fill the memory.

Exponents of these numbers have no bound: five exponentials in each other are a number with
millions of digits in its exponent, and an angle is reduced to a turn with as many digits of π as
it has before its point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import mpmath
from mpmath import mpf

Mpf = Any  # mpmath.mpf, which carries no types

#: Beyond this an exponential leaves the range of decimals (10^±10^18), and below its negative it
#: is 0 to every digit.
LARGEST_EXPONENT = mpf(10) ** 17

#: Most decimal digits before the point of an angle that is reduced to a turn. Not tuned.
LONGEST_ANGLE = 5_000
#: Largest argument of a periodic function.
LARGEST_ANGLE = mpf(10) ** LONGEST_ANGLE


_vanishes = ContextVar("powers below all decimals are 0", default=True)


class DomainError(ArithmeticError):
    """A value is not a finite real number at this point, or is beyond memory."""


def bounded(x: Mpf, largest: Mpf) -> Mpf:
    """Return a number; DomainError for one that is larger in size, or not real."""
    if not isinstance(x, mpf) or abs(x) > largest:
        raise DomainError
    return x


@contextmanager
def nothing_vanishes() -> Iterator[None]:
    """Refuse powers below all decimals, which are 0 elsewhere: e^(-2u) may be one where e^(-u) is
    none, and its square is compared with it."""
    token = _vanishes.set(False)
    try:
        yield
    finally:
        _vanishes.reset(token)


def _below_all_decimals() -> Mpf:
    if not _vanishes.get():
        raise DomainError
    return mpf(0)


def exponential(x: Mpf) -> Mpf:
    """Evaluate e^x."""
    if isinstance(x, mpf) and x < -LARGEST_EXPONENT:
        return _below_all_decimals()
    return mpmath.exp(bounded(x, LARGEST_EXPONENT))


def hyperbolic_tangent(x: Mpf) -> Mpf:
    """Evaluate tanh x, which is ±1 to every digit beyond the bound of exponentials."""
    if isinstance(x, mpf) and abs(x) > LARGEST_EXPONENT:
        return mpmath.sign(x)
    return mpmath.tanh(x)


def power(base: Mpf, exponent: Mpf) -> Mpf:
    """Evaluate a power of a number that is not known to be a whole one."""
    if not (isinstance(base, mpf) and isinstance(exponent, mpf)):
        raise DomainError
    # The logarithm of a base to 2 is at most one above its binary exponent.
    if base and abs(exponent) * (abs(mpmath.mag(base)) + 1) > LARGEST_EXPONENT:
        height = exponent * mpmath.log(abs(base))
        if height < -LARGEST_EXPONENT:
            return _below_all_decimals()
        bounded(height, LARGEST_EXPONENT)
    return mpmath.power(base, exponent)


def _within(function: Callable[[Mpf], Mpf], largest: Mpf) -> Callable[[Mpf], Mpf]:
    return lambda x: function(bounded(x, largest))


#: Functions of programs that take no arguments beyond a bound, by name.
BOUNDED_FUNCTIONS: dict[str, Callable[..., Mpf]] = {
    "exp": exponential,
    "pow": power,
    "sinh": _within(mpmath.sinh, LARGEST_EXPONENT),
    "cosh": _within(mpmath.cosh, LARGEST_EXPONENT),
    "sin": _within(mpmath.sin, LARGEST_ANGLE),
    "cos": _within(mpmath.cos, LARGEST_ANGLE),
    "tan": _within(mpmath.tan, LARGEST_ANGLE),
    "tanh": hyperbolic_tangent,
}
