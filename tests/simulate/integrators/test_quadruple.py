"""Numbers of 113 binary digits: their bytes, and motions that C computes with them."""

from __future__ import annotations

import math
import struct
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli import loads
from lagrange_cli.simulate.checkpoint.checkpoint import deserialize, serialize
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.base import Integrator
from lagrange_cli.simulate.integrators.native import c_types
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, QUADRUPLE
from lagrange_cli.simulate.integrators.native.methods import CompiledTaylor
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import WiderArithmetic
from lagrange_cli.simulate.system.rounding import in_arithmetic, rounding_factors
from tests.simulate.compiling import compiled_or_skip

PENDULUM = """
name: pendulum
parameters: {m: 1, l: 1/3, g: 9.81}
particles: {bob: {mass: m, position: [l*sin(a), -l*cos(a), 0]}}
coordinates: [a]
potentials: {weight: m*g*y_bob}
initial: {a: 2*pi/3, dot(a): 0}
"""

#: The same in Cartesian coordinates, with the rod as a constraint that is kept.
ON_A_ROD = """
name: pendulum
parameters: {m: 1, l: 1/3, g: 9.81}
particles: {bob: {mass: m, position: [x, y, 0]}}
constraints: {rod: x^2 + y^2 = l^2}
potentials: {weight: m*g*y}
initial: {x: l*sin(2*pi/3), y: -l*cos(2*pi/3), dot(x): 0, dot(y): 0}
"""


def value(number: np.ndarray) -> Fraction:
    """What 16 bytes of binary128 mean, read bit by bit."""
    low, high = struct.unpack("<QQ", number.tobytes())
    exponent, fraction = high >> 48 & 0x7FFF, (high & (1 << 48) - 1) << 64 | low
    if exponent == 0:
        assert fraction == 0
        return Fraction(0)
    size = (1 + Fraction(fraction, 2**112)) * Fraction(2) ** (exponent - 16383)
    return -size if high >> 63 else size


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1))
def test_doubles_are_the_same_numbers(values: list[float]) -> None:
    numbers = c_types.quadruples_from_doubles(np.array(values))
    assert [value(number) for number in numbers] == [Fraction(x) for x in values]
    assert c_types.doubles_from_quadruples(numbers).tolist() == values


@given(st.fractions(max_denominator=10**30))
def test_exact_numbers_are_rounded_to_the_nearest(exact: Fraction) -> None:
    (number,) = c_types.quadruples_from_fractions([exact])
    rounded = value(number)
    assert abs(rounded - exact) <= abs(exact) / 2**113
    assert float(c_types.doubles_from_quadruples(np.array([number]))[0]) == pytest.approx(
        float(exact), rel=2**-52
    )


def test_numbers_that_are_none() -> None:
    values = np.array([[math.inf, -math.inf], [math.nan, -0.0]])
    back = c_types.doubles_from_quadruples(c_types.quadruples_from_doubles(values))
    assert back.shape == (2, 2)
    assert back[0].tolist() == [math.inf, -math.inf]
    assert math.isnan(back[1, 0])
    assert math.copysign(1.0, back[1, 1]) == -1.0
    assert float(c_types.quadruple_from_double(math.pi)) == math.pi


def test_a_round_up_carries_into_the_exponent() -> None:
    (number,) = c_types.quadruples_from_fractions([2 - Fraction(1, 2**130)])
    assert value(number) == 2


def test_numbers_are_moved_by_one_in_their_last_place() -> None:
    tenth, double = Fraction(1, 10), Fraction(0.1)
    for pattern in (1, 2, 3):
        known, unknown, zero = in_arithmetic(
            [0.1, 0.1, 0.0], [tenth, None, Fraction(0)], QUADRUPLE, pattern
        )
        assert Fraction(1, 2**117) < abs(value(known) - tenth) < Fraction(1, 2**115)
        assert abs(value(unknown) - double) == Fraction(math.ulp(0.1))
        assert value(zero) == 0
    factors = [value(factor) - 1 for factor in rounding_factors(64, 1, QUADRUPLE)]
    assert set(factors) == {Fraction(1, 2**112), -Fraction(1, 2**113)}
    signs = [factor > 0 for factor in factors]
    assert signs == [factor > 1 for factor in rounding_factors(64, 1, DOUBLE)]


def in_quadruple(model: Model) -> WiderArithmetic:
    """The functions of a model, on a machine that has these numbers."""
    wider = compiled_or_skip(model).wider()
    while wider is not None and wider.real is not QUADRUPLE:
        wider = wider.wider()
    if wider is None:
        pytest.skip("this compiler has no _Float128")
    return wider


def swing(t: mpmath.mpf) -> tuple[mpmath.mpf, mpmath.mpf]:
    """The exact pendulum: sin(a/2) = k sn(K - ωt)."""
    rate, modulus = mpmath.sqrt(3 * mpmath.mpf("9.81")), mpmath.sin(mpmath.pi / 3)
    phase = mpmath.ellipk(modulus**2) - rate * t
    sn, cn = (mpmath.ellipfun(name, phase, k=modulus) for name in ("sn", "cn"))
    return 2 * mpmath.asin(modulus * sn), -2 * modulus * rate * cn


def begun(method: type[Integrator], tolerance: float, scene: str = PENDULUM) -> Integrator:
    """A run of the pendulum to t = 2, with steps of a twentieth at most."""
    model = model_of(loads(scene).derive().equations)
    assert bool(model.multipliers) == (scene is ON_A_ROD)
    start = QUADRUPLE.exact([x for x in model.exact_initial if x is not None])
    control = Control(np.zeros(len(start)), np.full(len(start), tolerance), 1e-4, 0.05)
    return start_integrator(method, in_quadruple(model).rhs, 0.0, start, 2.0, control)


def advanced(run: Integrator, steps: int) -> np.ndarray:
    """The state at the end, in quadruple, after so many steps more."""
    states = np.empty((1, len(run.y)), QUADRUPLE.dtype)
    run.advance(np.array([2.0]), states, most_steps=steps, most_evaluations=1e9)
    return states[0]


@pytest.mark.parametrize("method", [CompiledTaylor, INTEGRATORS["DOP853"]])
def test_a_run_goes_on_from_its_bytes(method: type[Integrator]) -> None:
    whole, first, second = (begun(method, 1e-20) for _ in range(3))
    advanced(first, 10)
    second.restore(deserialize(serialize(first.state())))
    assert advanced(second, 10**6).tobytes() == advanced(whole, 10**6).tobytes()
    assert second.steps == whole.steps > 10


@pytest.mark.parametrize(
    ("method", "tolerance", "error"),
    [(CompiledTaylor, 1e-33, 1e-30), (INTEGRATORS["DOP853"], 1e-24, 1e-21)],
)
def test_a_motion_to_thirty_digits(
    method: type[Integrator], tolerance: float, error: float
) -> None:
    state = advanced(begun(method, tolerance), 10**6)
    with mpmath.workdps(50):
        for number, exact in zip(state, swing(mpmath.mpf(2)), strict=True):
            own = value(number)
            off = mpmath.mpf(own.numerator) / own.denominator - exact
            assert abs(off) < error


@pytest.mark.slow
def test_a_constraint_is_kept_to_thirty_digits() -> None:
    state = [
        value(number) for number in advanced(begun(INTEGRATORS["DOP853"], 1e-24, ON_A_ROD), 10**6)
    ]
    with mpmath.workdps(50):
        x, y, *_ = (mpmath.mpf(number.numerator) / number.denominator for number in state)
        assert abs(x * x + y * y - mpmath.mpf(1) / 9) < 1e-32
        angle, _ = swing(mpmath.mpf(2))
        assert abs(mpmath.atan2(x, -y) - angle) < 1e-20
