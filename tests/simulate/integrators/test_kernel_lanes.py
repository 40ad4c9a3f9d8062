"""Sine and cosine of the lanes against mpmath, and right-hand sides that use them."""

from __future__ import annotations

import ctypes
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.api import loads
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.native.c_types import LANES
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.toolchain.shared_library import CSource
from tests.simulate.compiling import compiled_or_skip
from tests.simulate.native_systems import compiled

#: fabs(x) up to which the functions promise a value (LAGRANGE_LARGEST_ANGLE).
LARGEST = 823549.0

_TEXT = """
#include "lanes.h"
void both(const double *x, double *sine, double *cosine, long count)
{
    long i;
    for (i = 0; i < count; ++i) {
        sine[i] = lagrange_lane_sin(x[i]);
        cosine[i] = lagrange_lane_cos(x[i]);
    }
}
"""


@pytest.fixture(scope="module", params=["-O2", "-O3", "-O2 -ffp-contract=fast"])
def both(request, real_compiler):
    files = {"both.c": _TEXT, **kernels.kernel_headers()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CC", real_compiler)
        (library,) = compiled(CSource(files, tuple(request.param.split())))
    call = library.both
    call.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_long]

    def function(x):
        x = np.ascontiguousarray(x, dtype=float)
        out = np.empty((2, len(x)))
        call(x.ctypes.data, out[0].ctypes.data, out[1].ctypes.data, len(x))
        return out

    return function


def ulps(found, exact):
    """How far a double is from an exact value, in units of the last place of that value."""
    unit = math.ulp(float(exact)) if exact else math.ulp(0.0)
    return float(abs(mpmath.mpf(float(found)) - exact) / unit)


def hard_angles():
    """Near multiples of π/2, at the ends of the reduced interval, tiny, and large."""
    random = np.random.default_rng(1)
    k = np.concatenate([np.arange(-64, 65), random.integers(-(2**19), 2**19, 500)])
    near = np.concatenate([np.nextafter(k * (math.pi / 2), s * np.inf) for s in (-1, 1)])
    ends = (k + 0.5) * (math.pi / 2)
    tiny = 10.0 ** random.uniform(-300, 0, 100)
    plain = random.uniform(-10, 10, 2000)
    large = random.uniform(-LARGEST, LARGEST, 2000)
    found = np.concatenate([k * (math.pi / 2), near, ends, tiny, -tiny, plain, large, [LARGEST]])
    return found[np.abs(found) <= LARGEST]


@pytest.mark.slow
def test_within_one_unit_in_the_last_place(both):
    x = hard_angles()
    sine, cosine = both(x)
    with mpmath.workprec(300):
        worst = max(
            max(ulps(s, mpmath.sin(a)), ulps(c, mpmath.cos(a)))
            for a, s, c in zip(map(mpmath.mpf, x.tolist()), sine, cosine, strict=True)
        )
    assert worst < 0.9  # 0.76 as measured


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(x=st.floats(-LARGEST, LARGEST))
def test_any_angle(both, x):
    sine, cosine = both([x])
    with mpmath.workprec(1300):
        assert ulps(sine[0], mpmath.sin(mpmath.mpf(x))) < 1.0
        assert ulps(cosine[0], mpmath.cos(mpmath.mpf(x))) < 1.0


def test_symmetry_and_exact_values(both):
    x = hard_angles()
    sine, cosine = both(x)
    minus = both(-x)
    assert (minus[0] == -sine).all()
    assert (minus[1] == cosine).all()
    assert both([0.0]).tolist() == [[0.0], [1.0]]


@pytest.mark.parametrize("x", [1e6, -1e9, 1e300, math.inf, -math.inf, math.nan])
def test_beyond_the_reduction_is_no_number(both, x):
    assert np.isnan(both([x])).all()


SCENE = """
name: pair
parameters: {g: 9.81, m1: 1.0, m2: 2.0, l1: 1.0, l2: 0.5}
plane: xz
particles:
  p1: {mass: m1, position: [l1*sin(a), 0, -l1*cos(a)]}
  p2: {mass: m2, position: [l1*sin(a) + l2*sin(b), 0, -l1*cos(a) - l2*cos(b)]}
coordinates: [a, b]
potentials:
  weight: {gravity: g}
"""

EXPONENTIAL = """
name: valley
parameters: {m: 1.0, k: 2.0}
plane: xz
particles:
  p: {mass: m, position: [x, 0, 0]}
coordinates: [x]
potentials:
  valley: k*(exp(x) + exp(-x))
"""


def right_hand_side_of(text):
    return compiled_or_skip(model_of(loads(text).derive().equations))


def at_eight_states(rhs, y):
    """The lanes at rows of y, shape (8, n), and what they return."""
    out = np.empty(y.T.shape)
    t, turned = np.zeros(8), np.ascontiguousarray(y.T)
    bad = LANES(rhs.lanes_address)(
        t.ctypes.data,
        turned.ctypes.data,
        None,
        rhs.parameters_address,
        rhs.work.ctypes.data,
        out.ctypes.data,
    )
    return out.T, bad


@pytest.mark.slow
@pytest.mark.parametrize("which", ["rhs", "first", "second"])
def test_eight_states_at_once_are_eight_states(which):
    found = right_hand_side_of(SCENE)
    rhs = dict(zip(("first", "second"), found.perturbed, strict=True), rhs=found.rhs)[which]
    y = np.random.default_rng(2).uniform(-5, 5, (8, 4))
    out, bad = at_eight_states(rhs, y)
    expected = np.array([rhs(0.0, row) for row in y])
    assert bad == 0
    assert np.abs(out - expected).max() <= 1e-13 * np.abs(expected).max()


def test_eight_states_refuse_where_one_is_out_of_reach():
    rhs = right_hand_side_of(SCENE).rhs
    y = np.zeros((8, 4))
    y[5, 1] = 1e9
    assert at_eight_states(rhs, y)[1] != 0


def test_far_angles_are_integrated_one_by_one():
    """An angle beyond the reach of the lanes, by whole turns, moves as that within it."""
    rhs = right_hand_side_of(SCENE).rhs
    found = []
    for turns in (0.0, 2.0**20):
        how = Control(np.zeros(4), np.full(4, 1e-9), 1e-3, 1.0)
        shift = np.array([1.0, 1.0, 0.0, 0.0]) * turns * 2 * math.pi
        y0 = np.array([1.0, 0.5, 0.0, 0.0]) + shift
        run = start_integrator(INTEGRATORS["Gauss16"], rhs, 0.0, y0, 1.0, how)
        out = np.empty((1, 4))
        assert run.advance(np.array([1.0]), out, most_steps=10**6, most_evaluations=1e9).filled
        found.append(out[0] - shift)
    assert np.abs(found[0] - found[1]).max() < 1e-7


def test_functions_without_lanes_do_without():
    """exp has no form without calls."""
    found = right_hand_side_of(EXPONENTIAL)
    assert found.rhs.lanes_address is None
    how = Control(np.zeros(2), np.full(2, 1e-11), 1e-3, 1.0)
    run = start_integrator(INTEGRATORS["Gauss16"], found.rhs, 0.0, np.array([1.0, 0.0]), 9.0, how)
    out = np.empty((1, 2))
    run.advance(np.array([9.0]), out, most_steps=10**6, most_evaluations=1e9)
    energy = [v * v / 2 + 4.0 * math.cosh(x) for x, v in ((1.0, 0.0), out[0])]
    assert energy[1] == pytest.approx(energy[0], rel=1e-10)
