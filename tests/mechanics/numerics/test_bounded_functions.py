"""Functions of numbers of any size end at once, with the value or as a refusal."""

from __future__ import annotations

import mpmath
import pytest
from mpmath import mpf

from lagrange_cli.analysis.interval_values import IN_INTERVALS, ends, interval
from lagrange_cli.mechanics.numerics.bounded_functions import (
    BOUNDED_FUNCTIONS,
    DomainError,
    nothing_vanishes,
)

#: Three exponentials in each other: the next one has 10^16 digits in its exponent.
HUGE = mpmath.exp(mpf(10) ** 17)


@pytest.mark.parametrize("name", ["exp", "sinh", "cosh", "sin", "cos", "tan"])
def test_values_beyond_memory_are_refused(name):
    with pytest.raises(DomainError):
        BOUNDED_FUNCTIONS[name](HUGE)


@pytest.mark.parametrize("name", ["exp", "sinh", "cosh", "sin", "cos", "tan", "tanh"])
def test_values_within_the_bounds_are_those_of_mpmath(name):
    for x in (mpf(2), mpf(-3), mpf("inf") if name == "tanh" else mpf(10) ** 6):
        assert BOUNDED_FUNCTIONS[name](x) == getattr(mpmath, name)(x)


def test_what_vanishes_or_ends_to_every_digit_has_a_value():
    assert BOUNDED_FUNCTIONS["exp"](-HUGE) == 0
    assert BOUNDED_FUNCTIONS["tanh"](HUGE) == 1
    assert BOUNDED_FUNCTIONS["tanh"](-HUGE) == -1
    assert BOUNDED_FUNCTIONS["pow"](mpf(2), -HUGE) == 0
    assert BOUNDED_FUNCTIONS["pow"](mpf("0.5"), HUGE) == 0


@pytest.mark.parametrize(("name", "arguments"), [("exp", (-HUGE,)), ("pow", (mpf(2), -HUGE))])
def test_a_power_below_all_decimals_is_refused_where_nothing_may_vanish(name, arguments):
    with nothing_vanishes(), pytest.raises(DomainError):
        BOUNDED_FUNCTIONS[name](*arguments)
    assert BOUNDED_FUNCTIONS[name](*arguments) == 0


def test_powers_of_bases_near_one_have_large_exponents():
    power = BOUNDED_FUNCTIONS["pow"]
    with mpmath.workdps(50):
        assert power(1 + mpf(10) ** -20, mpf(10) ** 20) == pytest.approx(mpmath.e, rel=1e-15)
    assert power(mpf(9), mpf("0.5")) == 3
    assert power(mpf(0), mpf(2)) == 0
    for base, exponent in ((mpf(2), HUGE), (mpf("0.5"), -HUGE), (HUGE, HUGE), (mpf(-2), HUGE)):
        with pytest.raises(DomainError):
            power(base, exponent)


def test_complex_numbers_are_refused():
    root = mpmath.sqrt(mpf(-1))
    for name, function in BOUNDED_FUNCTIONS.items():
        if name == "tanh":
            continue
        with pytest.raises(DomainError):
            function(*[root] * (2 if name == "pow" else 1))


def test_intervals_hold_what_is_beyond_memory():
    wide = interval(-HUGE, HUGE)
    exp = IN_INTERVALS["exp"](wide)
    assert float(exp.a) == 0.0
    assert float(exp.b) == float("inf")
    for name in ("sin", "cos"):
        assert ends(IN_INTERVALS[name](wide)) == (-1, 1)
    low, high = ends(IN_INTERVALS["tanh"](wide))
    assert low <= -1 < 1 <= high
    least = ends(IN_INTERVALS["exp"](interval(-HUGE, -HUGE)))
    assert least[0] == 0 < least[1] < mpf(10) ** -(10**16)
