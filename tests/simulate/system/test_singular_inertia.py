"""Coordinates whose mass matrix is singular by itself and regular beside a closure.

Unit quaternions are such: at (1, 0, 0, 0) the first has no inertia, near it next to none.
Accelerations, of compiled code and of Python, are those of Euler's equations however near a
component is to zero; errors are judged by what the rounding of the entries leaves open.
"""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mpf
from scipy.integrate import solve_ivp

from lagrange_cli import loads
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.program.lowered.routines.saddle import solve_saddle
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

generated = settings(deadline=None, derandomize=True, max_examples=40)

BODY = """
name: body
parameters: {{A: 1, B: 2, C: 3}}
coordinates: [q0, q1, q2, q3]
definitions:
  w1: 2*(q0*dot(q1) - q1*dot(q0) - q2*dot(q3) + q3*dot(q2))
  w2: 2*(q0*dot(q2) - q2*dot(q0) - q3*dot(q1) + q1*dot(q3))
  w3: 2*(q0*dot(q3) - q3*dot(q0) - q1*dot(q2) + q2*dot(q1))
kinetic: {{rot: A/2*w1^2 + B/2*w2^2 + C/2*w3^2}}
constraints: {{unit: q0^2 + q1^2 + q2^2 + q3^2 = 1}}
initial: {{{start}}}
outputs: {{o1: w1, o2: w2, o3: w3}}
simulate: {{until: 20, accuracy: 1e-8, samples: 41}}
"""
INERTIA = np.array([1.0, 2.0, 3.0])
IDENTITY = "q0: 1, q1: 0, q2: 0, q3: 0, dot(q1): 0.05, dot(q2): 0.5, dot(q3): 0.02"


def product(p, q):
    """The product of two quaternions, of any numbers."""
    a, b, c, d = p
    e, f, g, h = q
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]


def angular_velocity(q, v):
    """ω in the body, of q and q̇."""
    return [2 * x for x in product([q[0], -q[1], -q[2], -q[3]], v)][1:]


def euler(w):
    """The rate of ω (Landau and Lifshitz, Mechanics, section 36)."""
    a, b, c = (mpf(int(x)) if isinstance(w[0], mpf) else x for x in INERTIA)
    return [(b - c) * w[1] * w[2] / a, (c - a) * w[2] * w[0] / b, (a - b) * w[0] * w[1] / c]


def acceleration(q, v):
    """q̈ of a free body: the rate of q̇ = q∘ω/2."""
    w = angular_velocity(q, v)
    turning, turned = product(v, [0, *w]), product(q, [0, *euler(w)])
    return [(x + y) / 2 for x, y in zip(turning, turned, strict=True)]


@pytest.fixture(scope="module")
def models():
    model = model_of(loads(BODY.format(start=IDENTITY)).derive().equations)
    return {"compiled": compiled_or_skip(model), "interpreted": interpreted(model, "")}


@pytest.mark.slow
@generated
@given(
    st.permutations(range(4)),
    st.lists(st.floats(0, 320), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=6, max_size=6),
)
@example(places=[1, 2, 3, 0], depths=[0, 0, 28], numbers=[0, 0, 0.875, 0.46875, 0, 0])
def test_accelerations_near_the_zeros_of_components(models, places, depths, numbers) -> None:
    """To two hundred units of rounding, from 1 to 1e-320 away from each of the axes."""
    q = np.zeros(4)
    q[places[0]] = 1.0
    q[places[1:]] = [x * 10.0**-d for x, d in zip(numbers[:3], depths, strict=True)]
    q /= np.linalg.norm(q)
    v = np.array(product(q.tolist(), [0, *numbers[3:]])) / 2
    # Off the sphere by rounding: the closure asks for q·q̈ = −q̇·q̇, as it stands.
    with mpmath.workdps(60):
        exact_q, exact_v = ([mpf(float(x)) for x in y] for y in (q, v))
        expected = np.array([float(x) for x in acceleration(exact_q, exact_v)])
    bound = 200 * 2.0**-53 * max(1e-300, float(v @ v))
    for functions in models.values():
        found = functions.rhs(0.0, np.concatenate([q, v]))[4:]
        assert np.abs(found - expected).max() <= bound


def reference(q, v, times):
    """q and ω at some times, from Euler's equations and q̇ = q∘ω/2."""

    def rhs(_, y):
        return [*(x / 2 for x in product(y[:4], [0, *y[4:]])), *euler(y[4:])]

    start = [*q, *angular_velocity(q, v)]
    span = times[0], times[-1]
    return solve_ivp(rhs, span, start, "DOP853", times, rtol=1e-13, atol=1e-14).y


@pytest.mark.slow
@pytest.mark.parametrize(
    ("q", "v"),
    [
        ((1, 0, 0, 0), (0, 0.05, 0.5, 0.02)),
        ((0, 1, 0, 0), (0.05, 0, 0.5, 0.02)),
        ((0, 0, -1, 0), (0.3, 0.05, 0, 0.02)),
        ((0, 0, 0, 1), (0.05, 0, 0.5, 0)),
        ((0.6, 0, 0.8, 0), (0, 0.2, 0, 0.02)),
    ],
)
def test_a_free_body_from_where_components_vanish(q, v) -> None:
    names = ("q0", "q1", "q2", "q3")
    start = [f"{n}: {x}" for n, x in zip(names, q, strict=True)]
    start += [f"dot({n}): {x}" for n, x in zip(names, v, strict=True)]
    found = simulate(loads(BODY.format(start=", ".join(start))).derive().equations)
    assert found.status == "ok"
    assert found.energy_drift < 1e-9
    expected = reference(q, v, found.t)
    columns = np.array([found.columns[n] for n in (*names, "o1", "o2", "o3")])
    assert np.abs(columns - expected).max() <= 5e-8


@cache
def equations_at_identity() -> Equations:
    return loads(BODY.format(start=IDENTITY)).derive().equations


@pytest.mark.slow
@pytest.mark.parametrize("method", ["RK45", "DOP853", "Gauss16", "Radau", "BDF", "IDA", "taylor"])
def test_every_method_leaves_the_identity(method) -> None:
    package = {"IDA": "sksundae", "taylor": "heyoka"}.get(method)
    if package is not None:
        pytest.importorskip(package)
    found = simulate(equations_at_identity(), method=method, rtol=1e-9, atol=1e-11, until=2.0)
    expected = reference((1, 0, 0, 0), (0, 0.05, 0.5, 0.02), np.array([0.0, 2.0]))[:4, -1]
    ends = [found.columns[n][-1] for n in ("q0", "q1", "q2", "q3")]
    assert np.abs(ends - expected).max() <= 1e-5


# The solver by itself.


def solved(matrix, right, n):
    """The solution by the routine of all languages."""
    s = len(right)
    a, x = matrix.ravel().copy(), right.copy()
    assert solve_saddle(n, s - n, a, x, np.empty(s), np.empty(s * s), np.empty(s))
    return x


def judged(matrix, right, n, most) -> None:
    """The solution is off by no more than the rounding of entries can make it, ``most`` times."""
    with mpmath.workdps(400):
        a, b = mpmath.matrix(matrix.tolist()), mpmath.matrix(right.tolist())
        inverse = a**-1
        exact = inverse * b
        s = len(right)
        row = [sum(abs(a[i, j] * exact[j]) for j in range(s)) + abs(b[i]) for i in range(s)]
        open_ = [2.0**-53 * sum(abs(inverse[i, j]) * row[j] for j in range(s)) for i in range(s)]
        found = solved(matrix, right, n)
        found[n:] *= -1
        for x, y, bound in zip(found.tolist(), exact, open_, strict=True):
            assert abs(x - y) <= most * bound


@pytest.mark.slow
@generated
@given(st.integers(1, 4), st.integers(0, 2**31))
def test_light_and_heavy_particles_on_rods(count, seed) -> None:
    """Masses over 24 orders of magnitude, coordinates in units over 8 of them."""
    numbers = np.random.default_rng(seed)
    places = np.vstack([[0, 0], np.cumsum(numbers.standard_normal((count, 2)), axis=0)])
    n, s = 2 * count, 3 * count
    matrix, right = np.zeros((s, s)), numbers.standard_normal(s)
    matrix[:n, :n] = np.diag(np.repeat(10.0 ** numbers.uniform(-12, 12, count), 2))
    right[:n] *= np.diag(matrix)[:n]
    for k in range(count):
        matrix[n + k, 2 * k : 2 * k + 2] = places[k + 1] - places[k]
        if k:
            matrix[n + k, 2 * k - 2 : 2 * k] = places[k] - places[k + 1]
    matrix[:n, n:] = matrix[n:, :n].T
    units = np.concatenate([2.0 ** numbers.integers(-13, 13, n), np.ones(count)])
    judged(matrix * units[:, None] * units, right * units, n, 1000)


@generated
@given(st.integers(2, 5), st.floats(0, 150), st.integers(0, 2**31))
def test_inertia_that_vanishes_along_a_gradient(n, depth, seed) -> None:
    """M = P D P with P u = 0, and the gradient u near a coordinate's direction."""
    numbers = np.random.default_rng(seed)
    u = numbers.standard_normal(n) * 10.0**-depth
    u[numbers.integers(n)] = 1.0
    matrix = np.zeros((n + 1, n + 1))
    for k in range(n):
        for j in range(k):
            turn = np.zeros(n)
            turn[k], turn[j] = u[j], -u[k]
            matrix[:n, :n] += numbers.uniform(0.5, 2) * np.outer(turn, turn)
    matrix[n, :n] = matrix[:n, n] = u
    right = numbers.standard_normal(n + 1)
    units = np.append(2.0 ** numbers.integers(-13, 13, n), 1.0)
    judged(matrix * units[:, None] * units, right * units, n, 4096)
