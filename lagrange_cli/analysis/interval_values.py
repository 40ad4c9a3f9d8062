"""Functions of programs over intervals, rounded outward: values that proofs rest on.

Arithmetic, sin, cos, exp, log, sqrt and atan are those of :mod:`mpmath`'s intervals; monotone
functions are enclosed by their values at both ends, found in more digits and moved apart by more
than their rounding (R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval
Analysis, 2009).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import mpmath
from mpmath import MPIntervalContext, libmp, mpf

from lagrange_cli.mechanics.numerics.bounded_functions import (
    BOUNDED_FUNCTIONS,
    LARGEST_ANGLE,
    LARGEST_EXPONENT,
)
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Mpf
    from lagrange_cli.program.graph.operands import Coefficient

#: Bits of interval ends, and those beside them in which monotone functions are evaluated.
BITS = 200
_GUARD = 24

Interval: TypeAlias = Any
"""An interval of :data:`INTERVALS`, which carries no types."""

INTERVALS = MPIntervalContext()
INTERVALS.prec = BITS


#: Bits of denominators from which on a coefficient may be rounded, and a factor that holds that.
_IRRATIONAL = 100
_ROUNDED = INTERVALS.one + INTERVALS.mpf(("-1e-48", "1e-48"))


class NotEnclosedError(ArithmeticError):
    """A function has no values, or jumps, somewhere in an interval."""


def interval(low: Mpf, high: Mpf) -> Interval:
    """Return the interval between two numbers, whose digits are kept."""
    return INTERVALS.make_mpf((low._mpf_, high._mpf_))


def around(x: Mpf, radius: Mpf) -> Interval:
    """Return the interval of all numbers that differ from one by a radius at most."""
    middle = interval(x, x)
    return middle + interval(-radius, radius) if radius else middle


def interval_of_ratio(x: Coefficient) -> Interval:
    """Return an interval that holds a coefficient of a graph; irrational ones have 50 digits."""
    value = INTERVALS._mpq((x.numerator, x.denominator))
    return value if x.denominator.bit_length() < _IRRATIONAL else value * _ROUNDED


def ends(x: Interval) -> tuple[Mpf, Mpf]:
    """Return both ends of an interval.

    Raises
    ------
    NotEnclosedError
        One of them is infinite or no number.
    """
    if not isinstance(x, INTERVALS.mpf):
        raise NotEnclosedError
    low, high = (mpmath.mp.make_mpf(end) for end in x._mpi_)
    if not (mpmath.isfinite(low) and mpmath.isfinite(high)):
        raise NotEnclosedError
    return low, high


def holds_zero(x: Interval) -> bool:
    """Say whether zero lies in an interval."""
    low, high = ends(x)
    return bool(low <= 0 <= high)


def _exponential(x: Interval) -> Interval:
    """Enclose e^x; an end whose exponential would fill the memory is taken to be a bound of it."""
    if not isinstance(x, INTERVALS.mpf):
        raise NotEnclosedError
    low, high = (mpmath.mp.make_mpf(end) for end in x._mpi_)
    return INTERVALS.exp(
        interval(
            -mpmath.inf if low < -LARGEST_EXPONENT else min(low, LARGEST_EXPONENT),
            mpmath.inf if high > LARGEST_EXPONENT else max(high, -LARGEST_EXPONENT),
        )
    )


def _turning(function: Callable[[Interval], Interval]) -> Callable[[Interval], Interval]:
    """Enclose sine or cosine; by −1 and 1, where reducing an angle to a turn would fill memory."""

    def enclosed(x: Interval) -> Interval:
        if isinstance(x, INTERVALS.mpf) and not abs(x) <= LARGEST_ANGLE:
            return INTERVALS.mpf((-1, 1))
        return function(x)

    return enclosed


def _monotone(function: Callable[[Mpf], Mpf], *, falls: bool = False) -> Callable[..., Interval]:
    """Enclose a function that rises, or falls, wherever it is defined."""

    def enclosed(x: Interval) -> Interval:
        with mpmath.workprec(BITS + _GUARD):
            values = [function(end) for end in ends(x)]
            if not all(isinstance(y, mpf) and mpmath.isfinite(y) for y in values):
                raise NotEnclosedError
            low, high = reversed(values) if falls else values
            part = mpf(2) ** -BITS
            return interval(low - part * abs(low), high + part * abs(high))

    return enclosed


def _even(function: Callable[[Interval], Interval]) -> Callable[[Interval], Interval]:
    return lambda x: function(abs(x))


def _within(function: Callable[..., Interval]) -> Callable[..., Interval]:
    """Refuse values that are not real."""

    def enclosed(*arguments: Interval) -> Interval:
        try:
            value = function(*arguments)
        except libmp.ComplexResult as error:
            raise NotEnclosedError from error
        if not isinstance(value, INTERVALS.mpf):
            raise NotEnclosedError
        return value

    return enclosed


def _atan2(y: Interval, x: Interval) -> Interval:
    if ends(x)[0] > 0:
        return _ATAN(y / x)
    if ends(y)[0] > 0:
        return INTERVALS.pi / 2 - _ATAN(x / y)
    if ends(y)[1] < 0:
        return -INTERVALS.pi / 2 - _ATAN(x / y)
    raise NotEnclosedError


def _power(x: Interval, exponent: Interval) -> Interval:
    if ends(x)[0] <= 0:
        raise NotEnclosedError
    return _exponential(exponent * INTERVALS.ln(x))


def _extremum(choose: Callable[..., Mpf]) -> Callable[[Interval, Interval], Interval]:
    def enclosed(a: Interval, b: Interval) -> Interval:
        lows, highs = zip(ends(a), ends(b), strict=True)
        return interval(choose(lows), choose(highs))

    return enclosed


def _sign_of(x: Interval) -> Interval:
    """Enclose the sign; where it jumps, all values between both sides."""
    low, high = ends(x)
    return interval(mpmath.sign(low), mpmath.sign(high))


def _steady_sign(x: Interval) -> Interval:
    """Return the sign where it does not jump."""
    low, high = ends(x)
    if low < high and low <= 0 <= high:
        raise NotEnclosedError
    return _sign_of(x)


_ATAN = _monotone(mpmath.atan)
_SIN, _COS = _turning(INTERVALS.sin), _turning(INTERVALS.cos)

#: Functions of programs over intervals. In derivatives the sign stands for all slopes of a kink.
IN_INTERVALS: dict[str, Callable[..., Interval]] = {
    "sin": _SIN,
    "cos": _COS,
    "tan": _within(lambda x: _SIN(x) / _COS(x)),
    "asin": _monotone(mpmath.asin),
    "acos": _monotone(mpmath.acos, falls=True),
    "atan": _ATAN,
    "sinh": _monotone(BOUNDED_FUNCTIONS["sinh"]),
    "cosh": _even(_monotone(BOUNDED_FUNCTIONS["cosh"])),
    "tanh": _monotone(BOUNDED_FUNCTIONS["tanh"]),
    "asinh": _monotone(mpmath.asinh),
    "acosh": _monotone(mpmath.acosh),
    "atanh": _monotone(mpmath.atanh),
    "exp": _exponential,
    "log": _within(INTERVALS.ln),
    "sqrt": _within(INTERVALS.sqrt),
    "abs": abs,
    "sign": _sign_of,
    "atan2": _atan2,
    "pow": _power,
    "min": _extremum(min),
    "max": _extremum(max),
}

#: The same, refused where a function jumps: for values, of which derivatives tell all changes.
WITHOUT_JUMPS = IN_INTERVALS | {"sign": _steady_sign}


#: Both ends of an interval as the functions of :mod:`mpmath` take them that its class calls.
_Ends: TypeAlias = Any


def _ends_of(x: Interval) -> _Ends:
    if not isinstance(x, INTERVALS.mpf):
        raise NotEnclosedError
    return x._mpi_


def _arithmetic_by_ends(functions: Mapping[str, Callable[..., Interval]]) -> Arithmetic:
    def by_ends(function: Callable[..., Interval]) -> Callable[..., _Ends]:
        return lambda *arguments: _ends_of(function(*map(INTERVALS.make_mpf, arguments)))

    return Arithmetic(
        {name: by_ends(function) for name, function in functions.items()},
        lambda x: _ends_of(interval_of_ratio(x)),
        lambda x, y: libmp.mpi_add(x, y, BITS),
        lambda x, y: libmp.mpi_mul(x, y, BITS),
        lambda x, y: libmp.mpi_div(x, y, BITS),
        lambda x, exponent: libmp.mpi_pow_int(x, exponent, BITS),
    )


#: Arithmetic of graphs over ends of intervals: half the time of that over their class.
BY_ENDS = _arithmetic_by_ends(IN_INTERVALS)
BY_ENDS_WITHOUT_JUMPS = _arithmetic_by_ends(WITHOUT_JUMPS)


def enclosed(
    evaluation: Evaluation, inputs: Mapping[str, Interval], arithmetic: Arithmetic
) -> list[Interval]:
    """Enclose values of a graph, by one of the arithmetics over ends.

    Raises
    ------
    ArithmeticError, ValueError
        They have no values somewhere, or jump where that is refused.
    """
    ends_of_inputs = {name: _ends_of(x) for name, x in inputs.items()}
    return [INTERVALS.make_mpf(x) for x in evaluation.at(ends_of_inputs, arithmetic)]
